//! What must not depend on the size of anything: coefficients, scales, places, angles, shapes of triangles, and the ends of
//! the random numbers. The table of what holds, and how well, is in `docs/THEORY.md`, section "Numerical behaviour".
//!
//! That no sample is lost is part of every image here: `images::mean` fails where one is not finite.

mod common;

#[path = "numerics/frames.rs"]
mod frames;
#[path = "numerics/guides.rs"]
mod guides;
#[path = "numerics/media.rs"]
mod media;
#[path = "numerics/meshes.rs"]
mod meshes;
#[path = "numerics/samplers.rs"]
mod samplers;
#[path = "numerics/toward_light.rs"]
mod toward_light;

use common::scenes::{self, v};
use common::statistics::mean_and_error;
use common::{images, trial};
use glam::DVec3;
use tyndall::scene::{Geometry, Light, Medium, Scene, Shape};

/// A body with one medium.
type Body = (Medium, Geometry);

/// A camera ray through bodies, with a sky of radiance 1 behind them.
fn seen_through(bodies: Vec<Body>, origin: DVec3, target: DVec3) -> Scene {
    let mut scene = scenes::one_ray(origin, target, 16);
    for (index, (medium, geometry)) in bodies.into_iter().enumerate() {
        let medium = scene.add_medium(medium);
        scene.shapes.push(Shape::boundary(&format!("body {index}"), geometry, medium));
    }
    scene.lights.push(Light::Constant { radiance: DVec3::ONE });
    scene
}

/// A floor about the origin, under a point light at the height 3, with bodies on the way: the light that arrives is ρ/π I/h² times
/// the transmittance, which is computed and not estimated.
fn lit_through(bodies: Vec<Body>) -> Scene {
    let mut scene = scenes::one_ray(v(0.0, 0.3, 2.5), DVec3::ZERO, 16);
    scene.shapes.push(Shape::diffuse(
        "floor",
        scenes::quad(v(-0.1, 0.0, 0.1), DVec3::X * 0.2, DVec3::NEG_Z * 0.2),
        DVec3::splat(0.5),
    ));
    for (index, (medium, geometry)) in bodies.into_iter().enumerate() {
        let medium = scene.add_medium(medium);
        scene.shapes.push(Shape::boundary(&format!("body {index}"), geometry, medium));
    }
    scene.lights.push(Light::Point { position: v(0.0, 3.0, 0.0), intensity: DVec3::splat(9.0) });
    scene.integrator.max_depth = Some(2);
    scene
}

/// The transmittance of bodies between the floor at the height 0 and the light at the height 3.
fn transmittance(bodies: Vec<Body>) -> DVec3 {
    let packed = scenes::pack(&lit_through(bodies), 1);
    images::average(&images::on_device(&packed, 16)) * std::f64::consts::PI / 0.5
}

/// Whether a transmittance is that of an optical depth, up to `rounding` of the depth and of the image.
fn check_transmittance(found: f64, tau: f64, rounding: f64) -> Result<(), String> {
    let expected = (-tau).exp();
    // Below the smallest normal number there is nothing but 0.
    let right = (found - expected).abs() <= expected * rounding * (1.0 + tau) + 1e-37 && found >= 0.0;
    if right { Ok(()) } else { Err(format!("{found:e}, expected {expected:e}: {:e}", found / expected - 1.0)) }
}

/// What the pixels of a scene have in common, with its standard error.
fn estimate(scene: &Scene, seed: u32, spp: u32) -> (f64, f64) {
    let batches: Vec<f64> = images::batches(scene, seed, spp).iter().map(|batch| batch.x).collect();
    mean_and_error(&batches)
}

/// Whether an estimate is what is expected: within four standard errors (63 batches: once in 6,000 cases by chance, and the seeds
/// are fixed) and `rounding`, and resolved to `resolution`.
fn check_estimate((mean, error): (f64, f64), expected: f64, rounding: f64, resolution: f64) -> Result<(), String> {
    let right = (mean - expected).abs() <= 4.0 * error + rounding * expected && error <= resolution * expected;
    if right { Ok(()) } else { Err(format!("{mean:.6} ± {error:.1e}, expected {expected:.6}")) }
}

/// The same, where an estimate that is `fault` off must be rejected.
fn judge(case: &str, found: (f64, f64), expected: f64, rounding: f64, resolution: f64) {
    eprintln!("{case}: {:.6} ± {:.1e}, expected {expected:.6}", found.0, found.1);
    check_estimate(found, expected, rounding, resolution).unwrap_or_else(|why| panic!("{case}: {why}"));
    let off = 2.0 * (8.0 * resolution + rounding);
    check_estimate((found.0 * (1.0 + off), found.1), expected, rounding, resolution).expect_err("too bright");
    check_estimate((found.0 * (1.0 - off), found.1), expected, rounding, resolution).expect_err("too dark");
}

/// Chandrasekhar's function H for isotropic scattering with an albedo, at μ = 1, from its integral equation
///   1/H(μ) = √(1 − ω) + ω/2 ∫₀¹ μ′ H(μ′)/(μ + μ′) dμ′        (Chandrasekhar 1960, section 38)
/// by iteration. Under a sky of radiance 1 a half space that is seen along its normal has the radiance 1 − √(1 − ω) H(1), by the
/// reciprocity of its reflection function.
fn half_space(albedo: f64) -> f64 {
    let nodes = trial::gauss(48);
    let root = (1.0 - albedo).sqrt();
    let step = |h: &[f64], mu: f64| {
        let integral: f64 = nodes.iter().zip(h).map(|(&(x, weight), h)| weight * x * h / (mu + x)).sum();
        1.0 / (root + 0.5 * albedo * integral)
    };
    let mut h = vec![1.0; nodes.len()];
    for _ in 0..2000 {
        let next: Vec<f64> = nodes.iter().zip(&h).map(|(&(mu, _), old)| 0.5 * (old + step(&h, mu))).collect();
        h = next;
    }
    1.0 - root * step(&h, 1.0)
}

#[test]
fn the_comparisons_reject_what_is_wrong() {
    check_transmittance(0.5, 2f64.ln(), 3e-6).expect("it is right");
    check_transmittance(0.5001, 2f64.ln(), 3e-6).expect_err("a little too bright");
    check_transmittance(f64::NAN, 1.0, 3e-6).expect_err("not a number");
    check_transmittance(1e-20, 1e3, 3e-6).expect_err("light where there is none");
    check_estimate((f64::NAN, 0.0), 1.0, 1e-3, 1e-3).expect_err("not a number");
    check_estimate((1.0, f64::NAN), 1.0, 1e-3, 1e-3).expect_err("no error estimate");
    // Albedo 0.8 and 0.5 to six digits, from the tables of Chandrasekhar's function.
    assert!((half_space(0.8) - 0.285_25).abs() < 1e-5 && (half_space(0.5) - 0.115_226).abs() < 1e-5);
}
