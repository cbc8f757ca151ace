//! From the film to an image with a header that says how it came about.

use std::time::Duration;

use glam::{DMat4, DVec3, DVec4};

use super::film::Film;
use super::scene_hash::scene_hash;
use super::session::{Outcome, Rendered};
use super::{DeviceInfo, reconstruct};
use crate::image::{Attribute, Image, Metadata, Window};
use crate::scene::{self, Camera, Colors, Lens, Scene};

/// The image of a render: `R G B`, `Variance.R Variance.G Variance.B` (the variance of the mean, see [`Film::variance`]),
/// and `sampleCount`.
///
/// Its header has the camera's matrices and these attributes: `tyndall:version`, `tyndall:device`, `tyndall:driver`,
/// `tyndall:sceneHash` and `tyndall:outcome` ("finished", "time limit", "interrupted") as strings; `tyndall:spp`,
/// `tyndall:sampleBegin` and `tyndall:sampleEnd` (the samples of each pixel are those of the half-open range) as
/// integers; `tyndall:seconds` as a float; `tyndall:seed` and `tyndall:invalidSamples` as doubles, which hold every
/// 32-bit seed exactly.
pub fn assemble(scene: &Scene, rendered: &Rendered, device: &DeviceInfo, seed: u32) -> Image {
    let crop = scene.film.crop;
    let mut image = Image::new(crop.width as usize, crop.height as usize);
    let Rendered { film, outcome, elapsed } = rendered;
    image.metadata = metadata(scene, film, *outcome, *elapsed, device, seed);
    let mean = reconstruct::image(film, crop.width);
    for (q, name) in ["R", "G", "B"].into_iter().enumerate() {
        image.push(name, mean.iter().map(|pixel| pixel[q] as f32).collect());
    }
    let variance = film.variance();
    // Sorted by name like everything behind the colours.
    for (q, name) in [(2, "Variance.B"), (1, "Variance.G"), (0, "Variance.R")] {
        image.push(name, variance.iter().map(|pixel| pixel[q] as f32).collect());
    }
    image.push("sampleCount", film.counts().iter().map(|&count| count as f32).collect());
    image
}

/// The image as it is to be written: with further channels, which go before those of errors and counts where they belong to the
/// colours (`A`), and in the colours of a format.
pub fn finish(mut image: Image, colors: Colors, further: Vec<(String, Vec<f32>)>) -> Image {
    let mut channels = std::mem::take(&mut image.channels);
    let behind = channels.split_off(3);
    // Taken as they are, so that a channel that is not finite leaves the others alone.
    if colors == Colors::Rgb {
        image.channels = channels;
        further.into_iter().for_each(|(name, samples)| image.push(name, samples));
        image.channels.extend(behind);
        return image;
    }
    let rgb: Vec<Vec<f32>> = channels.into_iter().map(|channel| channel.samples).collect();
    let mix = |row: DVec3| {
        let mixed = |k: usize| row.dot(DVec3::from([0, 1, 2].map(|q: usize| f64::from(rgb[q][k])))) as f32;
        (0..rgb[0].len()).map(mixed).collect::<Vec<f32>>()
    };
    let [x, y, z] = LINEAR_SRGB_TO_XYZ.map(DVec3::from);
    let rows = if colors == Colors::Xyz { vec![("X", x), ("Y", y), ("Z", z)] } else { vec![("Y", y)] };
    for (name, row) in rows {
        image.push(name, mix(row));
    }
    for (name, samples) in further {
        image.push(name, samples);
    }
    image.channels.extend(behind);
    image
}

/// Rows of the matrix from linear sRGB to CIE XYZ, with the digits of Mitsuba 3.9.1's `srgb_to_xyz`.
const LINEAR_SRGB_TO_XYZ: [[f64; 3]; 3] =
    [[0.412_453, 0.357_580, 0.180_423], [0.212_671, 0.715_160, 0.072_169], [0.019_334, 0.119_193, 0.950_227]];

fn metadata(
    scene: &Scene,
    film: &Film,
    outcome: Outcome,
    elapsed: Duration,
    device: &DeviceInfo,
    seed: u32,
) -> Metadata {
    let text = |value: &str| Attribute::Text(value.to_owned());
    // Sample numbers stay below 2^31: the command line sees to it.
    let int = |value: u32| Attribute::Int(i32::try_from(value).unwrap_or(i32::MAX));
    let outcome = match outcome {
        Outcome::Finished => "finished",
        Outcome::TimeLimit => "time limit",
        Outcome::Interrupted => "interrupted",
    };
    let samples = film.range();
    let attributes = [
        ("version", text(env!("CARGO_PKG_VERSION"))),
        ("device", text(&device.name)),
        ("driver", text(&device.driver)),
        ("sceneHash", text(&scene_hash(scene))),
        ("outcome", text(outcome)),
        ("spp", int(film.samples())),
        ("sampleBegin", int(samples.start)),
        ("sampleEnd", int(samples.end)),
        ("seconds", Attribute::Float(elapsed.as_secs_f32())),
        ("seed", Attribute::Double(f64::from(seed))),
        ("invalidSamples", Attribute::Double(film.invalid().iter().sum::<u64>() as f64)),
    ];
    let whole = &scene.film;
    Metadata {
        origin: (whole.crop.x as i32, whole.crop.y as i32),
        display: Window { x: 0, y: 0, width: whole.width as usize, height: whole.height as usize },
        world_to_camera: Some(row_vector_layout(world_to_camera(&scene.camera))),
        world_to_ndc: Some(row_vector_layout(world_to_ndc(&scene.camera, whole))),
        half: whole.pixel_format.half,
        attributes: attributes.into_iter().map(|(name, value)| (format!("tyndall:{name}"), value)).collect(),
    }
}

/// World space to OpenEXR's camera space: x to the right, y up, z forward, in scene units.
fn world_to_camera(camera: &Camera) -> DMat4 {
    // Our camera looks along +z with +x to the left. A uniform scale of its transform does not change the picture, and
    // would only falsify the distances.
    let scale = camera.to_world.x_axis.truncate().length();
    DMat4::from_scale(DVec3::new(-scale, scale, scale)) * camera.to_world.inverse()
}

/// World space to the unit square of the whole film, (0, 0) in its upper left corner; the third coordinate goes from 0 on
/// the near plane to 1 on the far plane. Inverse of the camera's rays: the direction through (u, v) has x / z =
/// 2 tan(fov/2) (u + offset − ½), and the same for y with the film's proportions.
fn world_to_ndc(camera: &Camera, film: &scene::Film) -> DMat4 {
    if let Lens::Orthographic { half_width, half_height } = camera.lens {
        let depth = 1.0 / (camera.far_clip - camera.near_clip);
        let scale = DMat4::from_scale(DVec3::new(0.5 / half_width, -0.5 / half_height, depth));
        let center = DVec3::new(0.5, 0.5, -camera.near_clip * depth);
        return DMat4::from_translation(center) * scale * world_to_camera(camera);
    }
    let reciprocal_width = 0.5 / (0.5 * camera.fov_x).to_radians().tan();
    let proportion = f64::from(film.width) / f64::from(film.height);
    let center = 0.5 - camera.principal_point_offset;
    let (near, far) = (camera.near_clip, camera.far_clip);
    let depth = far / (far - near);
    let projection = DMat4::from_cols(
        DVec4::new(reciprocal_width, 0.0, 0.0, 0.0),
        DVec4::new(0.0, -reciprocal_width * proportion, 0.0, 0.0),
        DVec4::new(center.x, center.y, depth, 1.0),
        DVec4::new(0.0, 0.0, -near * depth, 0.0),
    );
    projection * world_to_camera(camera)
}

/// OpenEXR's matrices multiply row vectors and are stored row by row: that is a column-vector matrix column by column.
fn row_vector_layout(matrix: DMat4) -> [f32; 16] {
    matrix.to_cols_array().map(|value| value as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    /// OpenEXR's rule: the point as a row vector times the stored matrix.
    fn transform(matrix: &[f32; 16], point: DVec3) -> DVec3 {
        let row = [point.x, point.y, point.z, 1.0];
        let column = |j: usize| (0..4).map(|i| row[i] * f64::from(matrix[4 * i + j])).sum::<f64>();
        DVec3::new(column(0), column(1), column(2)) / column(3)
    }

    fn close(a: DVec3, b: DVec3) -> bool {
        a.abs_diff_eq(b, 1e-5)
    }

    /// At (1, 2, 8), looking down −z with +y up, so right is +x.
    fn camera() -> Camera {
        Camera {
            near_clip: 2.0,
            far_clip: 10.0,
            ..Camera::look_at(DVec3::new(1.0, 2.0, 8.0), DVec3::new(1.0, 2.0, 0.0), DVec3::Y, 90.0)
        }
    }

    #[test]
    fn camera_space_is_right_up_forward() {
        let matrix = row_vector_layout(world_to_camera(&camera()));
        assert!(close(transform(&matrix, DVec3::new(1.5, 2.25, 5.0)), DVec3::new(0.5, 0.25, 3.0)));
        // The planted fault: the camera space of the scene file has x to the left.
        let wrong = row_vector_layout(camera().to_world.inverse());
        assert!(!close(transform(&wrong, DVec3::new(1.5, 2.25, 5.0)), DVec3::new(0.5, 0.25, 3.0)));
    }

    #[test]
    fn a_scaled_camera_measures_in_scene_units() {
        let mut camera = camera();
        camera.to_world *= DMat4::from_scale(DVec3::splat(2.0));
        let matrix = row_vector_layout(world_to_camera(&camera));
        assert!(close(transform(&matrix, DVec3::new(1.5, 2.25, 5.0)), DVec3::new(0.5, 0.25, 3.0)));
    }

    #[test]
    fn the_film_is_the_unit_square() {
        // 90° horizontally: at distance 4 the film is 8 wide, and, at 2:1, 4 high.
        let film = scene::Film::new(200, 100);
        let matrix = row_vector_layout(world_to_ndc(&camera(), &film));
        let at = |x: f64, y: f64| transform(&matrix, DVec3::new(1.0 + x, 2.0 + y, 4.0)).truncate();
        let cases = [
            (at(0.0, 0.0), (0.5, 0.5)),
            (at(-4.0, 2.0), (0.0, 0.0)),
            (at(4.0, -2.0), (1.0, 1.0)),
            (at(2.0, 1.0), (0.75, 0.25)),
        ];
        for (got, (u, v)) in cases {
            assert!(got.abs_diff_eq(DVec2::new(u, v), 1e-5), "{got} is not ({u}, {v})");
        }
        let depth = |distance: f64| transform(&matrix, DVec3::new(0.0, 0.0, 8.0 - distance)).z;
        assert!(depth(2.0).abs() < 1e-5 && (depth(10.0) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn the_principal_point_is_shifted_as_in_mitsuba() {
        // There, a sample at u has the direction that u + offset would have without the offset.
        let mut camera = camera();
        camera.principal_point_offset = DVec2::new(0.25, 0.0);
        let matrix = row_vector_layout(world_to_ndc(&camera, &scene::Film::new(100, 100)));
        assert!(close(transform(&matrix, DVec3::new(1.0, 2.0, 4.0)).with_z(0.0), DVec3::new(0.25, 0.5, 0.0)));
    }
}
