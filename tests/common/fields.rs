//! Fields in space, and tiny scenes of media whose coefficients depend on the place.

use super::scenes::{ball, camera, gray, lamp, phase, spot_and_directional, still_life, v, walls};
use glam::{DMat4, DVec3};
use std::sync::Arc;
use tyndall::scene::{
    Bsdf, Film, Filter, Geometry, Grid, GridVolume, HeightVolume, Light, Medium, MediumId, Scene, Shape, Volume,
    Volumes, Wrap,
};

/// Voxels in which nothing is alike: empty ones, and one that is a hundred times the others.
pub fn uneven(size: [usize; 3], channels: usize) -> Arc<Grid> {
    grid(size, channels, |x, y, z, c| match (7 * x + 13 * y + 29 * z + 5 * x * y * z + 3 * c) % 11 {
        0..5 => 0.0,
        10 if x == 1 && y == 2 => 60.0,
        hash => hash as f64 / 10.0,
    })
}

/// Voxels by a rule: the number of a voxel in a channel.
pub fn grid(size: [usize; 3], channels: usize, value: impl Fn(usize, usize, usize, usize) -> f64) -> Arc<Grid> {
    let mut values = Vec::new();
    for z in 0..size[2] {
        for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
            values.extend((0..channels).map(|channel| value(x, y, z, channel) as f32));
        }
    }
    Arc::new(Grid::new(size, channels, values).expect("voxels of the tests are valid"))
}

/// Voxels in a box, trilinear, with the voxels at the faces going on.
pub fn field(grid: Arc<Grid>, to_world: DMat4) -> GridVolume {
    GridVolume { grid, to_world, filter: Filter::Bilinear, wrap: Wrap::Clamp }
}

/// From the unit cube to a box.
pub fn unit_to(low: DVec3, high: DVec3) -> DMat4 {
    DMat4::from_translation(low) * DMat4::from_scale(high - low)
}

/// The boundary of a medium that fills the box of its voxels.
pub fn box_of(name: &str, to_world: DMat4, medium: MediumId) -> Shape {
    Shape::boundary(name, Geometry::Mesh(tyndall::scene::mesh::box_of(to_world)), medium)
}

/// Coloured, glowing voxels, some of them empty, in a turned box, with a ball of haze and one of glass in them.
pub fn voxels() -> Scene {
    let mut scene = Scene::new(camera(4.0), Film::new(24, 24));
    walls(&mut scene);
    scene.shapes.push(lamp());
    let turned = DMat4::from_rotation_y(0.4) * unit_to(v(-0.7, -0.8, -0.6), v(0.6, 0.3, 0.6));
    let rule = |x: usize, y: usize, z: usize, channel: usize| {
        let hash = (7 * x + 13 * y + 29 * z + 5 * x * y * z) % 11;
        if hash < 4 { 0.0 } else { hash as f64 / 10.0 * (1.0 + channel as f64) }
    };
    let smoke = Medium {
        emission: v(0.3, 0.2, 0.1),
        volumes: Volumes {
            sigma_t: Some(Volume::Grid(field(grid([9, 6, 7], 3, rule), turned))),
            albedo: Some(field(grid([2, 3, 2], 1, |x, y, z, _| (1 + x + y + z) as f64 / 6.0), turned)),
            emission: Some(GridVolume {
                filter: Filter::Nearest,
                wrap: Wrap::Repeat,
                ..field(grid([4, 4, 4], 3, |x, y, _, c| ((x + 2 * y + c) % 3) as f64), turned)
            }),
        },
        ..Medium::new("smoke", DVec3::splat(4.0), DVec3::splat(0.9), phase(0.5))
    };
    let smoke = scene.add_medium(smoke);
    scene.shapes.push(box_of("smoke", turned, smoke));
    let haze = scene.add_medium(Medium::new("haze", v(3.0, 2.0, 1.0), v(0.9, 0.8, 0.95), phase(0.0)));
    scene.shapes.push(Shape::boundary("haze", ball(v(0.1, -0.2, 0.1), 0.25), haze));
    let mut glass = Shape::boundary("glass", ball(v(-0.35, -0.4, 0.2), 0.2), haze);
    glass.bsdf = Bsdf::Dielectric {
        int_ior: 1.5,
        ext_ior: 1.0,
        specular_reflectance: DVec3::ONE.into(),
        specular_transmittance: DVec3::ONE.into(),
    };
    scene.shapes.push(glass);
    scene.lights.push(Light::Constant { radiance: v(0.1, 0.2, 0.3) });
    scene
}

/// The same with a large ball about them that only absorbs.
pub fn smoke_in_a_dark_ball() -> Scene {
    let mut scene = smoke();
    let dark = scene.add_medium(gray(0.4, 0.0, 0.0));
    scene.shapes.push(Shape::boundary("dark", ball(DVec3::ZERO, 3.0), dark));
    scene.lights.clear();
    scene.lights.push(Light::Constant { radiance: v(0.6, 0.7, 0.8) });
    scene
}

/// Gray voxels in a box of their own, over a floor, in the sun; and glowing voxels in a homogeneous medium.
pub fn smoke() -> Scene {
    smoke_of([24, 20, 16])
}

/// The same of so many voxels that light is tracked through them.
pub fn fine_smoke() -> Scene {
    smoke_of([24, 600, 16])
}

fn smoke_of(size: [usize; 3]) -> Scene {
    let mut scene = still_life(false);
    let place = unit_to(v(-1.15, -0.95, -0.8), v(0.9, 0.9, 0.6));
    let density = grid(size, 1, |x, y, z, _| {
        let [x, y, z] = [(x, size[0]), (y, size[1]), (z, size[2])]
            .map(|(index, count)| (2 * index + 1) as f64 / count as f64 - 1.0);
        (1.0 - x * x - y * y - z * z).max(0.0) * (1.0 + (9.0 * x).sin() * (7.0 * y).cos())
    });
    let mut smoke = Medium::new("smoke", DVec3::splat(3.0), DVec3::splat(0.9), phase(0.3));
    smoke.volumes.sigma_t = Some(Volume::Grid(field(density.clone(), place)));
    let smoke = scene.add_medium(smoke);
    scene.shapes.push(box_of("smoke", place, smoke));
    let mut fire = Medium { emission: v(2.0, 1.0, 0.3), ..gray(0.7, 0.5, 0.0) };
    let inner = unit_to(v(1.1, -0.9, -0.3), v(1.6, -0.2, 0.3));
    fire.volumes.emission = Some(field(density, inner));
    let fire = scene.add_medium(fire);
    scene.shapes.push(Shape::boundary("fire", ball(v(1.35, -0.5, 0.0), 0.4), fire));
    scene.lights.push(Light::Directional { direction: v(0.5, -1.0, -0.3).normalize(), irradiance: v(2.0, 1.8, 1.5) });
    scene.lights.push(Light::Constant { radiance: v(0.2, 0.3, 0.4) });
    scene
}

/// Fog that thins out with height, over a floor, with a ball of haze, a spot and the sun.
pub fn height_fog() -> Scene {
    let mut scene = spot_and_directional();
    scene.shapes.pop(); // The box of homogeneous fog.
    let mut fog = Medium::new("fog", v(0.5, 0.6, 0.8), DVec3::splat(0.9), phase(0.4));
    let field = HeightVolume { base: v(0.0, -0.7, 0.0), up: v(0.1, 1.0, 0.0).normalize(), scale_height: 0.4 };
    fog.volumes.sigma_t = Some(Volume::Height(field));
    scene.camera.medium = Some(scene.add_medium(fog));
    scene.lights.push(Light::Constant { radiance: v(0.2, 0.3, 0.4) });
    scene
}
