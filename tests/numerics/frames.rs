//! The unit of length, and where the scene lies.

use crate::common::{images, scenes};
use glam::DVec3;
use tyndall::scene::{Geometry, Light, Scene};

/// The same scene in another unit of length, moved.
fn placed(scene: &Scene, scale: f64, offset: DVec3) -> Scene {
    let mut placed = scene.clone();
    let point = |at: DVec3| at * scale + offset;
    placed.camera.to_world.w_axis = point(scene.camera.to_world.w_axis.truncate()).extend(1.0);
    placed.camera.near_clip *= scale;
    placed.camera.far_clip *= scale;
    for shape in &mut placed.shapes {
        match &mut shape.geometry {
            Geometry::Mesh(mesh) => mesh.positions.iter_mut().for_each(|at| *at = point(*at)),
            Geometry::Sphere { center, radius, .. } => {
                *center = point(*center);
                *radius *= scale;
            }
        }
    }
    for medium in &mut placed.media {
        medium.sigma_t /= scale;
        medium.emission /= scale;
    }
    for light in &mut placed.lights {
        if let Light::Point { position, intensity } | Light::Spot { position, intensity, .. } = light {
            *position = point(*position);
            *intensity *= scale * scale;
        }
    }
    placed
}

fn rendered(scene: &Scene) -> images::Image {
    images::on_device(&scenes::pack(scene, 3), 16)
}

/// Scenes with media in each other, lights that have a place or none, spheres, meshes, emission.
fn all() -> Vec<(&'static str, Scene)> {
    let wanted = ["nested media", "all lights", "glow"];
    let all: Vec<_> = scenes::all().into_iter().filter(|(name, _)| wanted.contains(name)).collect();
    assert_eq!(all.len(), wanted.len());
    all
}

#[test]
fn neither_the_unit_of_length_nor_the_place_matters() {
    for (name, scene) in all() {
        let expected = rendered(&scene);
        for exponent in [-20, 20] {
            let image = rendered(&placed(&scene, f64::exp2(f64::from(exponent)), DVec3::ZERO));
            assert!(image == expected, "{name}, scaled by 2^{exponent}, is not the same to the last bit");
        }
        // Other factors and places round differently, so that some paths take another turn.
        let (origin, far) = (DVec3::ZERO, DVec3::new(1e5, -1e5, 1e5));
        for (scale, offset) in [(1e-6, origin), (1e6, origin), (1.0, far), (1e-3, -far)] {
            let image = rendered(&placed(&scene, scale, offset));
            let case = format!("{name}, scaled by {scale:e} and moved by {offset}");
            let share = images::compare(&image, &expected).unwrap_or_else(|why| panic!("{case}: {why}"));
            eprintln!("{case}: {:.2} % of the pixels agree", share * 100.0);
            let brighter: images::Image = image.iter().map(|pixel| *pixel * 1.02).collect();
            images::compare(&brighter, &expected).expect_err("2 % brighter");
        }
    }
    let (_, scene) = all().remove(0);
    let mut wrong = placed(&scene, f64::exp2(20.0), DVec3::ZERO);
    wrong.media.iter_mut().for_each(|medium| medium.sigma_t *= 1.3);
    images::compare(&rendered(&wrong), &rendered(&scene)).expect_err("30 % more extinction");
}
