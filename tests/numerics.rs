//! What must not depend on the scale of anything: coefficients, sizes, places, indices.

mod common;

use common::scenes::v;
use common::statistics::mean_and_error;
use common::{images, scenes};
use glam::DVec3;
use tyndall::scene::{Light, Shape};

/// A ball of radius 1 under a uniform sky, seen along its middle.
fn ball(tau: f64, albedo: f64) -> tyndall::scene::Scene {
    let mut scene = scenes::one_ray(v(0.0, 0.0, 4.0), DVec3::ZERO, 16);
    let medium = scene.add_medium(scenes::gray(tau, albedo, 0.0));
    scene.shapes.push(Shape::boundary("ball", scenes::ball(DVec3::ZERO, 1.0), medium));
    scene.lights.push(Light::Constant { radiance: DVec3::ONE });
    scene
}

fn slab(tau: f64, albedo: f64) -> tyndall::scene::Scene {
    let mut scene = scenes::one_ray(v(0.1, 0.2, 4.0), v(0.1, 0.2, 0.0), 16);
    let medium = scene.add_medium(scenes::gray(tau, albedo, 0.0));
    scene.shapes.push(Shape::boundary("slab", scenes::cuboid(glam::DMat4::IDENTITY), medium));
    scene.lights.push(Light::Constant { radiance: DVec3::ONE });
    scene
}

#[test]
fn dense_slab() {
    for (albedo, half_space) in [(0.5, 0.1157), (0.8, 0.285), (0.99, 0.751)] {
        for tau in [1e3, 1e4, 1e5, 1e6] {
            let batches = images::batches(&slab(tau, albedo), 5, 1024);
            let red: Vec<f64> = batches.iter().map(|b| b.x).collect();
            let (mean, error) = mean_and_error(&red);
            eprintln!("slab {albedo} {tau:e}: {mean:.5} ± {error:.5}, half space {half_space}");
        }
    }
}

#[test]
fn dense() {
    for (albedo, half_space) in [(0.5, 0.1157), (0.8, 0.285), (0.99, 0.751)] {
        for tau in [1e2, 1e3, 1e4, 1e5, 1e6] {
            let batches = images::batches(&ball(tau, albedo), 5, 1024);
            let red: Vec<f64> = batches.iter().map(|b| b.x).collect();
            let (mean, error) = mean_and_error(&red);
            eprintln!("{albedo} {tau:e}: {mean:.5} ± {error:.5}, half space {half_space}");
        }
    }
}
