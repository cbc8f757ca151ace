//! How distances are sampled in each medium.

use super::frame::{Bounds, Frame};
use super::layout::{Light, MEDIUM_HEIGHT, MEDIUM_VOXELS, Medium};
use super::lights::is_near;
use super::nesting::Nesting;
use crate::scene::{MediumId, Scene};

/// Share of equiangular distances in media that are thin enough for them.
const SHARE: f32 = 0.5;
/// Across a medium of more than this optical depth, light does not come from near the lights alone.
const THIN: f64 = 10.0;

/// Switches equiangular sampling on for media that light from somewhere shines through. Behind glass it never arrives directly,
/// and in an opaque medium only the first few free paths matter, which free flights sample well.
pub fn choose_equiangular(scene: &Scene, nesting: &Nesting, frame: &Frame, lights: &[Light], media: &mut [Medium]) {
    if !lights.iter().any(is_near) || scene.integrator.max_depth.is_some_and(|depth| depth < 2) {
        return;
    }
    for (index, medium) in media.iter_mut().enumerate().skip(1) {
        // Where the density depends on the place, it decides where light is scattered.
        if medium.grids & (MEDIUM_VOXELS | MEDIUM_HEIGHT) != 0 {
            continue;
        }
        let id = MediumId(index as u32 - 1);
        let filled = scene.filled_with(id);
        let bounds = filled.fold(Bounds::EMPTY, |bounds, shape| bounds.union(Bounds::of(&shape.geometry)));
        let within = if bounds.is_empty() { 0.0 } else { f64::from(frame.length((bounds.max - bounds.min).length())) };
        let extent = if nesting.world == Some(id) { 2.0 * frame.radius } else { within };
        let sigma_t = f64::from(medium.sigma_t.element_sum() / 3.0);
        if sigma_t > 0.0 && sigma_t * extent < THIN && medium.albedo.max_element() > 0.0 {
            medium.equiangular = SHARE;
        }
    }
}
