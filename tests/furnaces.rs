//! Furnaces: under radiance 1 from all directions, what absorbs nothing is invisible, and so is what emits all that it absorbs
//! (Kirchhoff's law). All of transport is in them, and the answer is 1 whatever the shapes are.

mod common;

use common::images;
use common::random::Random;
use common::scenes::{self, v};
use common::statistics::{mean_and_error, sidak_bound};
use glam::{DMat3, DMat4, DVec3};
use std::sync::Arc;
use tyndall::scene::{Bitmap, Bsdf, Camera, Film, Light, Medium, Scene, Shape};

/// About as many as there are in this file, for the bound on the worst.
const CASES: usize = 40;

/// Whether estimates of 1 are 1; their standard error must be at most 1e-3, so that a half per cent is seen.
fn check(batches: &[DVec3], channel: usize) -> Result<String, String> {
    let (mean, error) = mean_and_error(&batches.iter().map(|batch| batch[channel]).collect::<Vec<_>>());
    let result = format!("{mean:.6} ± {error:.1e}");
    let bound = sidak_bound(CASES, (images::BATCHES - 1) as f64);
    let right = error <= 1e-3 && (mean - 1.0).abs() <= bound * error + 1e-5;
    if right { Ok(result) } else { Err(result) }
}

/// All pixels of a scene are 1, in some channels; the same image a little darker would not pass.
fn judge(name: &str, scene: &Scene, spp: u32, channels: &[usize]) {
    let seed = name.bytes().fold(1u32, |seed, byte| seed.wrapping_mul(31).wrapping_add(byte.into()));
    let batches = images::batches(scene, seed, spp);
    let darker: Vec<DVec3> = batches.iter().map(|batch| *batch * 0.98).collect();
    for &channel in channels {
        let result = check(&batches, channel).unwrap_or_else(|why| panic!("{name}, channel {channel}: {why}"));
        eprintln!("{name}, channel {channel}: {result}");
        check(&darker, channel).expect_err("a furnace that loses 2 %");
    }
}

fn cube(side: f64) -> tyndall::scene::Geometry {
    scenes::cuboid(DMat4::from_scale(DVec3::splat(side / 2.0)))
}

/// A ball filled with a medium, in a ray's way. Its index is that of glass, or 1: then it has no surface.
fn filled_ball(medium: Medium, index: f64) -> Scene {
    let mut scene = scenes::one_ray(v(0.3, 0.2, 4.0), v(0.3, 0.2, 0.0), 16);
    let medium = scene.add_medium(medium);
    let mut ball = Shape::boundary("filled ball", scenes::ball(DVec3::ZERO, 1.0), medium);
    if index != 1.0 {
        let full = || DVec3::ONE.into();
        ball.bsdf = Bsdf::Dielectric {
            int_ior: index,
            ext_ior: 1.0,
            specular_reflectance: full(),
            specular_transmittance: full(),
        };
    }
    scene.shapes.push(ball);
    scene
}

#[test]
fn a_medium_that_absorbs_nothing_is_invisible() {
    // The furnaces of table D (all but the one of a grid), and scattering at the edge of what can be resolved.
    let mut nested = scenes::furnace(cube(2.0), 1.0, 0.3);
    let inner = nested.add_medium(scenes::gray(2.0, 1.0, 0.3));
    nested.shapes.push(Shape::boundary("inner", scenes::ball(v(0.2, 0.1, 0.0), 0.5), inner));
    let ball = |sigma_t, g| scenes::furnace(scenes::ball(DVec3::ZERO, 1.0), sigma_t, g);
    let cases = [
        ("D:furnace0", scenes::furnace(cube(1.0), 1.0, 0.0)),
        ("D:furnace1", scenes::furnace(cube(1.0), 20.0, 0.9)),
        ("D:furnace2", ball(3.0, -0.9)),
        ("D:furnace3", scenes::furnace(scenes::torus(1.0, 0.4), 5.0, 0.5)),
        ("D:furnace4", nested),
        ("isotropic", ball(3.0, 0.0)),
        ("forward", ball(3.0, 0.5)),
        ("backward", ball(3.0, -0.5)),
        ("nearly straight on", ball(4.0, 0.9999)),
        ("nearly straight back", ball(4.0, -(1.0 - 1e-6))),
    ];
    for (name, mut scene) in cases {
        // On the medium alone: the background is 1 anyway.
        scene.camera.fov_x = 8.0;
        if name == "D:furnace3" {
            scene.camera = Camera::look_at(v(2.0, 3.0, 2.0), v(1.0, 0.0, 0.0), DVec3::Y, 8.0);
        }
        scene.film = Film::new(16, 16);
        judge(name, &scene, 2048, &[0]);
    }
}

#[test]
fn glass_with_a_medium_is_invisible() {
    for (name, sigma_t, g) in
        [("glass, isotropic", 2.0, 0.0), ("glass, backward", 1.0, -0.9), ("glass, forward", 8.0, 0.9)]
    {
        let mut scene = filled_ball(scenes::gray(sigma_t, 1.0, g), 1.5);
        scene.lights.push(Light::Constant { radiance: DVec3::ONE });
        judge(name, &scene, 1024, &[0]);
    }
}

#[test]
fn roulette_takes_nothing_away() {
    // Paths end where little is left of them only if the medium absorbs; that it glows makes up for it. From the first event on, as
    // ever, and never.
    let colours = [(v(3.0, 3.0, 3.0), v(0.7, 0.7, 0.7)), (v(0.3, 2.0, 6.0), v(0.9, 0.2, 0.6))];
    for (sigma_t, albedo) in colours {
        for rr_depth in [1, 3, 1_000_000] {
            for index in [1.0f64, 1.5] {
                let emission = sigma_t * (DVec3::ONE - albedo) * index * index;
                let mut scene = filled_ball(Medium { sigma_t, albedo, emission, ..scenes::gray(1.0, 0.5, 0.5) }, index);
                scene.lights.push(Light::Constant { radiance: DVec3::ONE });
                scene.integrator.rr_depth = rr_depth;
                let gray = albedo.x == albedo.y;
                let name = format!("index {index}, roulette from {rr_depth} on, gray {gray}");
                judge(&name, &scene, 1024, if gray { &[0] } else { &[0, 1, 2] });
            }
        }
    }
}

/// Two maps that add up to 1 everywhere, with random pixels and a sun.
fn complements() -> [Arc<Bitmap>; 2] {
    let mut random = Random(92);
    let mut pixels: Vec<f64> = (0..24 * 13).map(|_| random.unit()).collect();
    pixels[4 * 24 + 7] = 1.0;
    let one = scenes::sky(24, 13, |x, y| DVec3::splat(pixels[y * 24 + x]));
    let other = Arc::new(one.map(|pixel| pixel.map(|value| 1.0 - value)));
    [one, other]
}

#[test]
fn furnaces_under_images() {
    let empty = || scenes::one_ray(v(0.3, 0.2, 4.0), v(0.3, 0.2, 0.0), 16);
    let mut haze = empty();
    let medium = haze.add_medium(scenes::gray(3.0, 1.0, 0.6));
    haze.shapes.push(Shape::boundary("haze", scenes::ball(DVec3::ZERO, 1.0), medium));
    let mut white = empty();
    white.shapes.push(Shape::diffuse("white", scenes::ball(DVec3::ZERO, 1.0), DVec3::ONE));
    white.shapes.push(Shape::diffuse("also white", scenes::ball(v(1.5, 0.0, 0.5), 0.8), DVec3::ONE));
    let [one, other] = complements();
    let sky = |bitmap: &Arc<Bitmap>| Light::Envmap {
        bitmap: bitmap.clone(),
        scale: 1.0,
        to_world: DMat3::from_rotation_x(0.7),
    };
    let flat = scenes::sky(5, 4, |_, _| DVec3::ONE);
    let half = Light::Constant { radiance: DVec3::splat(0.5) };
    let gray = Light::Envmap { bitmap: flat.clone(), scale: 0.25, to_world: DMat3::IDENTITY };
    let skies = [
        ("one image", vec![sky(&flat)]),
        ("two images", vec![sky(&one), sky(&other)]),
        ("a constant and two images", vec![half, gray.clone(), gray]),
    ];
    let glass = filled_ball(scenes::gray(1.0, 1.0, 0.5), 1.5);
    let bodies = [("haze", haze, &skies[..]), ("glass", glass, &skies[1..2]), ("white", white, &skies[1..2])];
    for (body, scene, skies) in &bodies {
        for (sky, lights) in *skies {
            let scene = Scene { lights: lights.clone(), ..scene.clone() };
            judge(&format!("{body} under {sky}"), &scene, 2048, &[0]);
        }
    }
}
