//! Asymmetries, optical depths and albedos without end.

use crate::common::scenes::{self, v};
use crate::common::{images, scenes::gray};
use crate::{check_transmittance, estimate, half_space, judge, seen_through, transmittance};
use glam::{DMat4, DVec3};
use tyndall::scene::{Geometry, Medium, Phase, Scene};

/// A ball of radius 1 under a sky of radiance 1, seen along its middle.
fn ball(sigma: f64, albedo: f64, g: f64) -> Scene {
    seen_through(vec![(gray(sigma, albedo, g), scenes::ball(DVec3::ZERO, 1.0))], v(0.0, 0.0, 4.0), DVec3::ZERO)
}

/// A layer across the way from the floor to the light.
fn layer(thickness: f64) -> Geometry {
    scenes::cuboid(DMat4::from_translation(v(0.0, 1.5, 0.0)) * DMat4::from_scale(v(1.0, 0.5 * thickness, 1.0)))
}

#[test]
fn furnaces_of_every_asymmetry() {
    let magnitudes = [1e-8, 1e-4, 0.5, 0.99, 1.0 - 1e-4, 1.0 - 1e-6];
    let all = magnitudes.into_iter().flat_map(|g| [g, -g]).chain([0.0]);
    for (seed, g) in (1..).zip(all) {
        let scene = ball(3.0, 1.0, g);
        judge(&format!("furnace, g = {g}"), estimate(&scene, seed, 128), 1.0, 1e-5, 5e-3);
    }
}

#[test]
fn shadow_rays_through_every_optical_depth() {
    let check = |found: f64, tau: f64, thickness: f64| {
        // The depth is a difference of distances to the light: what is thin against them has fewer digits.
        let rounding = 3e-6 * (0.1 / thickness).max(1.0);
        check_transmittance(found, tau, rounding).unwrap_or_else(|why| panic!("{tau:e}, {thickness}: {why}"));
        if tau < 80.0 {
            check_transmittance(found * 1.01, tau, rounding).expect_err("a little too bright");
        }
    };
    for (thickness, tau) in [(1.0, 1e-12), (1e-2, 1e-4), (1.0, 1.0), (1.0, 30.0), (1e-2, 80.0), (1.0, 1e4), (1.0, 1e8)]
    {
        let found = transmittance(vec![(gray(tau / thickness, 0.0, 0.0), layer(thickness))]);
        check(found.x, tau, thickness);
    }
    // Three at once, in the kernel for media with colours.
    for (thickness, tau) in [(1.0, v(1e-12, 1.0, 1e8)), (1.0, v(1e-6, 10.0, 86.0)), (1e-2, v(0.1, 0.0, 3.0))] {
        let medium = Medium::new("chromatic", tau / thickness, DVec3::ZERO, Phase::Isotropic);
        let found = transmittance(vec![(medium, layer(thickness))]);
        (0..3).for_each(|channel| check(found[channel], tau[channel], thickness));
    }
}

#[test]
fn camera_rays_through_every_optical_depth() {
    for (seed, tau) in (1..).zip([1e-12, 1e-6, 1e-2, 0.5, 3.0]) {
        let found = estimate(&ball(0.5 * tau, 0.0, 0.0), seed, 256);
        judge(&format!("camera ray, depth {tau:e}"), found, (-tau).exp(), 1e-5, 2e-2);
    }
    for (seed, tau) in (1..).zip([1e2, 1e4, 1e6, 1e8]) {
        let packed = scenes::pack(&ball(0.5 * tau, 0.0, 0.0), seed);
        assert_eq!(images::average(&images::on_device(&packed, 16)), DVec3::ZERO, "depth {tau:e}");
    }
}

#[test]
fn furnaces_of_every_optical_depth() {
    for (seed, (sigma, spp)) in (1..).zip([(1e-12, 16), (1e-4, 16), (1.0, 128), (50.0, 64), (500.0, 16)]) {
        let found = estimate(&ball(sigma, 1.0, 0.0), seed, spp);
        // Roulette gives the longest paths large weights: beyond some hundred free paths the spread of so few samples says too
        // little, and most estimates are a little too dark.
        let rounding = if sigma > 1e2 { 5e-2 } else { 1e-5 };
        judge(&format!("ball of radius {sigma:e} free paths"), found, 1.0, rounding, 6e-2);
    }
}

/// A face of a cube under a sky of radiance 1, seen along its normal.
fn face(sigma: f64, albedo: f64) -> Scene {
    let cube = (gray(sigma, albedo, 0.0), scenes::cuboid(DMat4::IDENTITY));
    seen_through(vec![cube], v(0.1, 0.2, 4.0), v(0.1, 0.2, 0.0))
}

#[test]
fn half_spaces_of_every_density() {
    for (seed, albedo) in (1..).zip([0.5, 0.8]) {
        for sigma in [1e2, 1e3, 1e4, 1e5, 1e6] {
            // A mean free path is eight roundings of a coordinate long where it is a millionth of the scene.
            let rounding = if sigma < 5e5 { 3e-3 } else { 5e-2 };
            let found = estimate(&face(sigma, albedo), 10 * seed, 256);
            judge(&format!("cube, albedo {albedo}, {sigma:e} free paths"), found, half_space(albedo), rounding, 4e-3);
            if sigma == 1e4 || sigma == 1e6 {
                let found = estimate(&ball(sigma, albedo, 0.0), 10 * seed, 256);
                judge(&format!("ball, albedo {albedo}, {sigma:e}"), found, half_space(albedo), rounding, 4e-3);
            }
        }
    }
}

#[test]
fn long_walks_under_a_boundary_stay_under_it() {
    // Light that stays long comes back to the boundary hundreds of times. A vertex that rounds to its other side would walk on there,
    // and come back brighter by 3 % from the ball and from the face.
    for (name, scene) in [("ball", ball(1e5, 0.99, 0.0)), ("face", face(1e5, 0.99))] {
        judge(&format!("{name}, albedo 0.99, 1e5 free paths"), estimate(&scene, 3, 1024), half_space(0.99), 3e-3, 3e-3);
    }
}

#[test]
fn albedos_from_nothing_to_everything() {
    // Where little is scattered, only once: ω/2 (1 − log 2), the first order of the half space.
    let once = 0.5 * (1.0 - 2f64.ln());
    for albedo in [1e-7, 1e-4] {
        judge(&format!("albedo {albedo}"), estimate(&ball(1e3, albedo, 0.0), 1, 64), once * albedo, 3e-3, 2e-2);
    }
    let black = scenes::pack(&ball(1e3, 0.0, 0.0), 1);
    assert_eq!(images::average(&images::on_device(&black, 16)), DVec3::ZERO);
    for (seed, (albedo, sigma)) in (1..).zip([(0.1, 1e3), (0.9, 1e3), (0.99, 1e4), (1.0 - 1e-4, 1e5)]) {
        let found = estimate(&face(sigma, albedo), seed, 64);
        judge(&format!("albedo {albedo}"), found, half_space(albedo), 3e-3, 3e-2);
    }
    for (seed, albedo) in (1..).zip([1.0 - 1e-7, 1.0]) {
        judge(&format!("thin, albedo {albedo}"), estimate(&ball(3.0, albedo, 0.0), seed, 128), 1.0, 1e-5, 5e-3);
    }
}
