//! Media that no shadow ray leaves: behind glass, without a light in them. Light sampling in them would find nothing, so it is left
//! out, and all light that scattering finds counts in full.

use super::frame::Bounds;
use super::layout::{MEDIUM_SEALED, Medium};
use super::material::lets_shadow_rays_through;
use crate::scene::{Light, MediumId, Scene, Shape};

/// Marks the media of a scene that are sealed. The expectation does not depend on it where light comes from surfaces or from infinitely
/// far; light from a point or of one direction is found by light sampling alone, so nothing is sealed then.
pub fn mark(scene: &Scene, media: &mut [Medium]) {
    let delta = |light: &Light| matches!(light, Light::Point { .. } | Light::Spot { .. } | Light::Directional { .. });
    if scene.lights.iter().any(delta) || media.iter().any(|medium| medium.emission != glam::Vec3::ZERO) {
        return;
    }
    for (index, medium) in media.iter_mut().enumerate().skip(1) {
        let id = MediumId(index as u32 - 1);
        let mut walls = scene.filled_with(id).peekable();
        let sealed = walls.peek().is_some()
            && walls.all(|wall| !lets_shadow_rays_through(&wall.bsdf) && !holds_a_light(scene, wall));
        if sealed && scene.camera.medium != Some(id) {
            medium.grids |= MEDIUM_SEALED;
        }
    }
}

/// Whether the box of some light meets the box of a shape.
fn holds_a_light(scene: &Scene, wall: &Shape) -> bool {
    let around = Bounds::of(&wall.geometry);
    scene.shapes.iter().filter(|shape| shape.emission.is_some()).any(|shape| {
        let light = Bounds::of(&shape.geometry);
        light.min.cmple(around.max).all() && light.max.cmpge(around.min).all()
    })
}
