//! How distances are sampled in each medium.

use super::frame::{Bounds, Frame};
use super::layout::{LIGHT_VOLUME, Light, MEDIUM_DENSITY, MEDIUM_SEALED, MEDIUM_VOXELS, Medium};
use super::lights::is_near;
use super::nesting::Nesting;
use crate::scene::{MediumId, Scene};
use glam::Vec3;

/// Share of equiangular distances in media that are thin enough for them.
const SHARE: f32 = 0.5;
/// Across a medium of more than this optical depth, light does not come from near the lights alone. Rays are traced through all of a
/// medium with equiangular sampling, so it is dear where free flights are short: measured, a gain of four at a depth of 4 and a loss at 20.
const THIN: f64 = 10.0;
/// The same for a medium that has no light in it, but near it.
const THIN_BESIDE: f64 = 3.0;
/// A light further than this share of a medium's size from the box about it shines on all of it alike.
const NEAR: f64 = 0.5;

/// Least part of the extinction coefficient that flights are sampled by, up to the one albedo, and all of it from the other one on (measured
/// at an albedo of 1/6: .6 and .35 are better than 1 and 1/6, by a quarter).
const LEAST_SHARE: f32 = 0.5;
const DARK: f32 = 0.3;
const BRIGHT: f32 = 0.7;

/// Whether a light is brightest near some place. A medium that emits shines all over.
fn is_lamp(light: &Light) -> bool {
    is_near(light) && light.kind != LIGHT_VOLUME
}

/// Chooses the part of the extinction coefficient that flights are sampled by. In media that only absorb, none: what light loses there is
/// known. Where little is scattered, most of what is seen came straight through: flights that end less often, with a weight, see more of
/// it; only where all media are gray, for else flights choose between channels.
pub fn choose_flight_shares(media: &mut [Medium]) {
    let gray = media.iter().all(|medium| medium.sigma_t.min_element() == medium.sigma_t.max_element());
    for medium in media.iter_mut().skip(1) {
        if medium.grids & !MEDIUM_SEALED != 0 || medium.equiangular > 0.0 || medium.emission != Vec3::ZERO {
            continue;
        }
        if medium.albedo == Vec3::ZERO {
            medium.flight_share = 0.0;
        } else if gray {
            let bright = (medium.albedo.max_element() - DARK) / (BRIGHT - DARK);
            medium.flight_share = LEAST_SHARE + (1.0 - LEAST_SHARE) * bright.clamp(0.0, 1.0);
        }
    }
}

/// Switches equiangular sampling, and directions past lamps, on for thin media that have a light in or near them. Behind glass light never
/// arrives directly.
pub fn choose_equiangular(scene: &Scene, nesting: &Nesting, frame: &Frame, lights: &[Light], media: &mut [Medium]) {
    if !lights.iter().any(is_lamp) || scene.integrator.max_depth.is_some_and(|depth| depth < 2) {
        return;
    }
    for (index, medium) in media.iter_mut().enumerate().skip(1) {
        // Where the density depends on the place, it decides where light is scattered.
        if medium.grids & (MEDIUM_VOXELS | MEDIUM_DENSITY | MEDIUM_SEALED) != 0 {
            continue;
        }
        let id = MediumId(index as u32 - 1);
        let filled = scene.filled_with(id);
        let bounds = filled.fold(Bounds::EMPTY, |bounds, shape| bounds.union(Bounds::of(&shape.geometry)));
        let size = if bounds.is_empty() { 0.0 } else { f64::from(frame.length((bounds.max - bounds.min).length())) };
        let everywhere = nesting.world == Some(id);
        let extent = if everywhere { 2.0 * frame.radius } else { size };
        let (min, max) = (frame.point(bounds.min), frame.point(bounds.max));
        let holds = |room: f64| {
            let room = Vec3::splat((room * size) as f32);
            let inside = |place: Vec3| place.cmpge(min - room).all() && place.cmple(max + room).all();
            lights.iter().any(|light| is_lamp(light) && inside(light.origin))
        };
        let depth = extent * f64::from(medium.sigma_t.element_sum() / 3.0);
        let thin = depth < THIN && (everywhere || holds(0.0)) || depth < THIN_BESIDE && holds(NEAR);
        if thin && depth > 0.0 && medium.albedo.max_element() > 0.0 {
            medium.equiangular = SHARE;
        }
    }
}
