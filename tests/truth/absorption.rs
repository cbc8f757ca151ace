//! Absorption (table C): along shadow rays, where the transmittance is computed, and along camera rays, where it is estimated.

use crate::CASES;
use crate::common::images;
use crate::common::scenes::{self, v};
use crate::common::trial::{Case, judge, record};
use crate::common::truth::{Row, rows, whole};
use glam::{DMat4, DVec3};
use tyndall::scene::{Geometry, Light, Medium, Phase, Shape};

/// The shapes of which a ray crosses a length, from `start` on along a unit axis.
fn layers(start: DVec3, axis: DVec3, length: f64) -> [(&'static str, Geometry); 2] {
    let middle = start + axis * (length / 2.0);
    let half = axis.abs() * (length / 2.0) + (DVec3::ONE - axis.abs()) * 2.0;
    let slab = scenes::cuboid(DMat4::from_scale_rotation_translation(half, Default::default(), middle));
    [("box", slab), ("sphere", scenes::ball(middle, length / 2.0))]
}

/// An absorbing medium.
fn absorber(row: &Row) -> Medium {
    assert_eq!(row.vector("sigma_s"), DVec3::ZERO, "the rows of the table only absorb");
    Medium::new("absorber", row.vector("sigma_a"), DVec3::ZERO, Phase::Isotropic)
}

/// What a point of a floor gets from a point light above it, times the transmittance of all shapes between them. The shadow
/// ray's transmittance is no estimate, so each sample is ρ/π I/r² T. Returns T.
pub fn transmittance_of_shadow_ray(media: Vec<(Medium, Geometry)>, height: f64) -> DVec3 {
    let mut scene = scenes::one_ray(v(0.0, 0.2 * height, 1.3 * height), DVec3::ZERO, 4);
    scene.camera.near_clip = 1e-3 * height;
    scene.camera.far_clip = 1e3 * height;
    let side = 1e-2 * height;
    let floor = scenes::quad(v(-side, 0.0, side), DVec3::X * 2.0 * side, DVec3::NEG_Z * 2.0 * side);
    scene.shapes.push(Shape::diffuse("floor", floor, DVec3::splat(0.5)));
    for (medium, geometry) in media {
        let medium = scene.add_medium(medium);
        scene.shapes.push(Shape::boundary("medium", geometry, medium));
    }
    // Without media ρ/π comes back.
    scene.lights.push(Light::Point { position: v(0.0, height, 0.0), intensity: DVec3::splat(height * height) });
    scene.integrator.max_depth = Some(2);
    let found = images::average(&images::on_device(&scenes::pack(&scene, 1), 16));
    found * std::f64::consts::PI / 0.5
}

/// Whether three channels are right, relative or absolute.
pub fn check_channels(found: DVec3, expected: DVec3, relative: DVec3, absolute: f64) -> Result<(), String> {
    let error = (found - expected).abs();
    let wrong =
        error.cmpgt(expected.abs() * relative + absolute).any() || !found.is_finite() || found.min_element() < 0.0;
    if wrong { Err(format!("{found:?}, expected {expected:?}: {:?}", found / expected - 1.0)) } else { Ok(()) }
}

#[test]
fn absorption_along_shadow_rays() {
    let rows: Vec<Row> = rows("C").into_iter().filter(|row| !row.id.contains("geom")).collect();
    let mut worst = 0f64;
    for row in &rows {
        let length = row.number("d");
        let (transmittance, _) = row.output("T");
        let expected = DVec3::from_slice(&transmittance);
        for (name, geometry) in layers(v(0.0, 0.5, 0.0), DVec3::Y, length) {
            let found = transmittance_of_shadow_ray(vec![(absorber(row), geometry)], length + 1.0);
            // The optical depth has the relative error of single precision.
            let relative = (-expected.map(f64::ln) * 1e-6).max(DVec3::splat(1e-5));
            check_channels(found, expected, relative, 0.0).unwrap_or_else(|why| panic!("{} {name}: {why}", row.id));
            check_channels(found * 1.0002, expected, relative, 0.0).expect_err("a little too bright");
            worst = worst.max((found / expected - 1.0).abs().max_element());
        }
    }
    record("C shadow rays", &format!("| C, shadow rays | {} | relative error {worst:.1e} | | | | |\n", 2 * rows.len()));
}

/// The geometry of a row and the ray through it.
fn placed(row: &Row) -> Vec<(&'static str, Geometry, DVec3, DVec3)> {
    let geometry = &row.input()["geometry"];
    if geometry.is_null() {
        let length = row.number("d");
        let shapes = layers(v(0.0, 0.0, -length), DVec3::Z, length);
        return shapes.map(|(name, shape)| (name, shape, v(0.0, 0.0, 2.0), DVec3::NEG_Z)).into();
    }
    let vector = |name: &str| {
        let numbers = geometry[name].as_array().expect("a vector").iter();
        DVec3::from_slice(&numbers.map(|number| number.as_f64().expect("a number")).collect::<Vec<_>>())
    };
    let shape = if geometry["shape"] == "sphere" {
        scenes::ball(vector("center"), geometry["radius"].as_f64().expect("a number"))
    } else {
        let (min, max) = (vector("min"), vector("max"));
        let to_world = DMat4::from_translation((min + max) / 2.0) * DMat4::from_scale((max - min) / 2.0);
        scenes::cuboid(to_world)
    };
    vec![("", shape, vector("o"), vector("d"))]
}

#[test]
fn absorption_along_camera_rays() {
    let mut cases = Vec::new();
    for (index, row) in rows("C").into_iter().enumerate() {
        let behind = row.vector("L_behind");
        let (expected, error) = row.output("L");
        for (place, (name, geometry, origin, direction)) in placed(&row).into_iter().enumerate() {
            let mut scene = scenes::one_ray(origin, origin + direction, 16);
            let medium = scene.add_medium(absorber(&row));
            scene.shapes.push(Shape::boundary("absorber", geometry, medium));
            scene.lights.push(Light::Constant { radiance: behind });
            // Without a full run the channels take turns.
            let tested = |channel: usize| whole() || (index + place) % 3 == channel;
            for (channel, &expected) in expected.iter().enumerate().filter(|(channel, _)| tested(*channel)) {
                // A flight's channel is chosen, so that some samples resolve a transmittance however small it is. The table's
                // error is absolute; what a deep transmittance has of it is far below its own rounding here.
                cases.push(Case {
                    name: format!("{} {name} channel {channel}", row.id),
                    views: vec![(1.0, scene.clone())],
                    channel,
                    expected,
                    error: error.min(1e-6 * expected),
                    tolerance: 5e-3 * expected,
                    heavy_tailed: false,
                });
            }
        }
    }
    judge("C, camera rays", &cases, CASES);
}
