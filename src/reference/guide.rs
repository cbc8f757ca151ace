//! Mirror of `shaders/lib/guide.glsl`: lobes about the directions from which light comes into bodies of smooth glass.

use super::math::{exp_minus, from_frame, one_minus_exp_minus};
use super::warp::from_polar;
use crate::pack::layout::GUIDE_CELLS;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Von Mises' and Fisher's distribution.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guide {
    /// Unit.
    pub axis: DVec3,
    /// κ.
    pub sharpness: f64,
    /// Of a vertex to look for light by it; 0 where none is known to come.
    pub chance: f64,
}

/// The cell of a point, in units of cells from the lower corner.
pub fn guide_cell(place: DVec3) -> u32 {
    let cell = place.clamp(DVec3::ZERO, DVec3::splat(f64::from(GUIDE_CELLS) - 0.5)).as_uvec3();
    (cell.z * GUIDE_CELLS + cell.y) * GUIDE_CELLS + cell.x
}

/// A direction by two numbers in [0, 1).
pub fn sample_guide(guide: &Guide, u: DVec2) -> DVec3 {
    let x = u.x * one_minus_exp_minus(2.0 * guide.sharpness);
    let one_minus_cos = (-(-x).ln_1p() / guide.sharpness).min(2.0);
    let sine = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
    from_frame(guide.axis, from_polar(1.0 - one_minus_cos, sine, u.y))
}

/// Its density per solid angle, times the chance.
pub fn guide_pdf(guide: &Guide, direction: DVec3) -> f64 {
    let scale = guide.chance * guide.sharpness / (2.0 * PI * one_minus_exp_minus(2.0 * guide.sharpness));
    scale * exp_minus(0.5 * guide.sharpness * (direction - guide.axis).length_squared())
}
