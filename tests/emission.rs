//! Media that emit: equilibrium, light sampling, and what is refused. `tests/truth/emission.rs` compares them with tables.

mod common;

use common::images;
use common::scenes::{self, v};
use common::statistics::{mean_and_error, sidak_bound};
use glam::{DMat4, DVec3};
use tyndall::pack::{PackError, Packed};
use tyndall::scene::{Bsdf, Film, Medium, Phase, Shape};

/// A medium that emits what it would in equilibrium with radiance 1, `sigma_a`.
fn warm(sigma_t: DVec3, albedo: DVec3, phase: Phase) -> Medium {
    Medium { emission: sigma_t * (DVec3::ONE - albedo), ..Medium::new("warm", sigma_t, albedo, phase) }
}

fn hg(g: f64) -> Phase {
    Phase::HenyeyGreenstein { g }
}

#[test]
fn media_in_equilibrium_are_invisible() {
    // Kirchhoff's law: what emits as much as it absorbs of the surrounding radiance 1 sends out 1 everywhere, whatever its
    // albedo, colour and shape; in a body of index n, n².
    let colours = [
        ("gray", DVec3::splat(3.0), DVec3::splat(0.7)),
        ("chromatic", v(0.3, 2.0, 6.0), v(0.9, 0.0, 0.6)),
        ("one channel", v(0.0, 0.0, 4.0), v(0.0, 0.0, 0.99)),
    ];
    let bound = sidak_bound(18, (images::BATCHES - 1) as f64);
    for (seed, (name, sigma_t, albedo)) in (1..).zip(colours) {
        for (index, n) in [1.0, 1.5].into_iter().enumerate() {
            let mut scene = scenes::furnace(scenes::ball(DVec3::ZERO, 1.0), 1.0, 0.0);
            let phase = Phase::Blend { weight: 0.5, a: Box::new(Phase::Rayleigh), b: Box::new(hg(0.6)) };
            scene.media[0] = warm(sigma_t, albedo, phase);
            scene.media[0].emission *= n * n;
            if n != 1.0 {
                let full = || DVec3::ONE.into();
                scene.shapes[0].bsdf = Bsdf::Dielectric {
                    int_ior: n,
                    ext_ior: 1.0,
                    specular_reflectance: full(),
                    specular_transmittance: full(),
                };
            }
            let mut core = warm(v(1.0, 0.5, 3.0), v(0.2, 0.5, 0.9), hg(-0.4));
            core.emission *= n * n;
            let core = scene.add_medium(core);
            scene.shapes.push(Shape::boundary("core", scenes::ball(v(0.2, 0.1, 0.0), 0.4), core));
            scene.camera.fov_x = 8.0;
            scene.film = Film::new(16, 16);
            let batches = images::batches(&scene, 10 * seed + index as u32, 512);
            for channel in 0..3 {
                let (mean, error) = mean_and_error(&batches.iter().map(|batch| batch[channel]).collect::<Vec<_>>());
                eprintln!("{name}, index {n}, channel {channel}: {mean:.5} ± {error:.1e}");
                let right = |mean: f64| error < 5e-3 && (mean - 1.0).abs() < bound * error + 1e-5;
                assert!(right(mean), "{name}, index {n}, channel {channel}: {mean} ± {error}");
                assert!(!right(mean * 0.97), "{name}, index {n}: blind to what is 3 % off");
            }
        }
    }
}

#[test]
fn glow_without_end_is_refused() {
    let of = |sigma_t: DVec3, emission: DVec3| {
        let mut scene = scenes::point_light();
        scene.media[0] = Medium { emission, ..Medium::new("glow", sigma_t, DVec3::ZERO, Phase::Isotropic) };
        Packed::new(&scene, 0)
    };
    let error = of(v(1.0, 0.0, 1.0), DVec3::ONE).expect_err("the green is endless");
    assert_eq!(error, PackError::EndlessEmission("glow".to_owned()));
    assert!(of(v(1.0, 0.0, 1.0), v(1.0, 0.0, 1.0)).is_ok() && of(DVec3::ONE, DVec3::ONE).is_ok());
    assert!(of(DVec3::ZERO, DVec3::ZERO).is_ok());
}

#[test]
fn hidden_emitters_hide_a_glow_from_the_camera_alone() {
    let mut scene = scenes::through_ball(warm(DVec3::ONE, DVec3::ZERO, Phase::Isotropic), 2.0, 0.0);
    assert!(images::average(&images::on_device(&scenes::pack(&scene, 1), 16)).min_element() > 0.5);
    scene.integrator.hide_emitters = true;
    assert_eq!(images::average(&images::on_device(&scenes::pack(&scene, 1), 16)), DVec3::ZERO);
    // By way of a mirror's worth of scattering it is still seen.
    scene.media[0] = Medium { albedo: DVec3::splat(0.9), ..scene.media[0].clone() };
    assert!(images::average(&images::on_device(&scenes::pack(&scene, 1), 16)).min_element() > 0.05);
}

#[test]
fn a_floor_is_lit_by_a_glow_with_and_without_light_sampling() {
    // A cube of absorbing, glowing gas, turned, and with a hole of another gas in it, over a floor, behind a bar that shades a
    // part of it: light sampling and chance must agree, and sampling must pay.
    let mut scene = scenes::one_ray(v(0.0, 0.3, 3.0), DVec3::ZERO, 16);
    let glow = |name: &str, sigma_t, emission| Medium {
        emission,
        ..Medium::new(name, sigma_t, DVec3::splat(0.3), Phase::Isotropic)
    };
    let gas = scene.add_medium(glow("gas", DVec3::splat(1.5), v(3.0, 2.0, 1.0)));
    let inner = scene.add_medium(glow("inner", DVec3::ZERO, v(0.0, 5.0, 9.0)));
    let floor = scenes::quad(v(-4.0, 0.0, 4.0), DVec3::X * 8.0, DVec3::NEG_Z * 8.0);
    scene.shapes.push(Shape::diffuse("floor", floor, DVec3::splat(0.5)));
    let turned = DMat4::from_translation(v(0.3, 1.8, 0.0)) * DMat4::from_rotation_z(0.5);
    let cube = scenes::cuboid(turned * DMat4::from_scale(DVec3::splat(0.2)));
    scene.shapes.push(Shape::boundary("gas", cube, gas));
    scene.shapes.push(Shape::boundary("inner", scenes::ball(v(0.35, 1.8, 0.0), 0.12), inner));
    let bar = scenes::quad(v(0.25, 0.8, 0.5), DVec3::X * 0.1, DVec3::NEG_Z);
    scene.shapes.push(Shape::diffuse("bar", bar, DVec3::splat(0.2)));
    let packed = scenes::pack(&scene, 5);
    assert!(packed.features.volume_lights && packed.features.light_sampling);
    assert_eq!((packed.lights.len(), packed.media[1].light, packed.media[2].light), (2, 1, 2));
    let estimate = |packed: &Packed| {
        let batches: Vec<f64> = images::batches_of(packed, 512).iter().map(|batch| batch.element_sum()).collect();
        mean_and_error(&batches)
    };
    let (sampled, error) = estimate(&packed);
    let mut by_chance = packed.clone();
    by_chance.features.light_sampling = false;
    let (found, coarse) = estimate(&by_chance);
    eprintln!("sampled {sampled:.5} ± {error:.1e}, by chance {found:.5} ± {coarse:.1e}");
    let z = |sampled: f64| (sampled - found) / error.hypot(coarse);
    assert!(z(sampled).abs() < 3.5, "{}", z(sampled));
    assert!(error < 0.5 * coarse, "light sampling does not pay: {error:e} against {coarse:e}");
    assert!(coarse < 0.025 * found && z(sampled * 1.15).abs() > 5.0, "blind: {coarse:e}");
    // A light of the wrong medium brings nothing from its points, and what chance leaves of it is too little.
    let mut wrong = packed;
    wrong.lights.iter_mut().for_each(|light| light.edge_1.y += 7.0);
    assert!(z(estimate(&wrong).0).abs() > 5.0);
}
