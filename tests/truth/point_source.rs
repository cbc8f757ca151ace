//! A point source in an infinite medium (table F).
//!
//! Where paths scatter near the source, 1/r² has an infinite variance: the share of estimates above x falls as x^(−3/2). So the tolerance
//! is wide, and the z-values are no normal deviates.

use crate::CASES;
use crate::common::scenes;
use crate::common::trial::{Case, gauss, judge};
use crate::common::truth::{Row, full, rows};
use glam::DVec3;
use std::f64::consts::PI;
use tyndall::scene::{Light, Scene, Shape};

/// The source at the origin, of 1 W, seen from a distance at an angle to the direction towards it. The medium ends so far away that what
/// is lost is less than exp(−24): the diffusion length ν₀ bounds what comes back.
fn scene(row: &Row, theta: f64) -> Scene {
    let (albedo, g, r) = (row.number("albedo"), row.number("g"), row.number("r"));
    // At the albedos of the table, and for g = 0; with other g no longer than 1 / sqrt(3 (1 − albedo) (1 − albedo g)).
    let length = if albedo < 0.6 { 1.05 } else { 1.2 / (3.0 * (1.0 - albedo) * (1.0 - albedo * g.max(0.0))).sqrt() };
    let origin = DVec3::X * r;
    let mut scene =
        scenes::one_ray(origin, origin + DVec3::new(-theta.cos(), 0.6 * theta.sin(), 0.8 * theta.sin()), 16);
    scene.camera.near_clip = 1e-6;
    let medium = scene.add_medium(scenes::gray(row.number("sigma_t"), albedo, g));
    scene.shapes.push(Shape::boundary("medium", scenes::ball(DVec3::ZERO, 12.0 * length + r), medium));
    scene.lights.push(Light::Point { position: DVec3::ZERO, intensity: DVec3::splat(1.0 / (4.0 * PI)) });
    scene
}

fn cases(row: &Row) -> Vec<Case> {
    let mut cases = Vec::new();
    if row.has("L_pixel") {
        let (expected, error) = row.output("L_pixel");
        for (theta, expected) in row.list("theta_deg").into_iter().zip(expected) {
            let name = format!("{} L_pixel {theta}", row.id);
            let case = Case::new(name, scene(row, theta.to_radians()), (expected, error), 0.1 * expected);
            cases.push(Case { heavy_tailed: true, ..case });
        }
    }
    // All directions: 2π ∫ L dcos, and with cos = 1 − 2 s², which takes away the peak about the source, 2π ∫ L 4 s ds.
    let (expected, error) = row.value("phi_scattered");
    let views = gauss(10).into_iter().map(|(s, weight)| (8.0 * PI * s * weight, scene(row, 2.0 * s.asin())));
    cases.push(Case {
        name: format!("{} phi_scattered", row.id),
        views: views.collect(),
        channel: 0,
        expected,
        // Of the quadrature.
        error: error + 2e-3 * expected,
        tolerance: 0.1 * expected,
        heavy_tailed: true,
    });
    cases
}

#[test]
fn point_sources() {
    judge(
        "F",
        &rows("F").iter().filter(|row| full() || row.number("albedo") < 0.6).flat_map(cases).collect::<Vec<_>>(),
        CASES,
    );
}
