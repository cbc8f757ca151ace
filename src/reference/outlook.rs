//! Mirror of `shaders/lib/outlook.glsl`: what is to be expected of the rest of a path, from a pilot run, and roulette by
//! it.

use crate::pack::layout::PILOT_CELLS;
use glam::DVec3;

/// The least probability to go on.
const LEAST_KEEP: f64 = 0.3;

/// Of the vertices in a cell of space, apart for media and the six directions that a surface can face.
#[derive(Clone, Copy, Debug)]
pub struct Outlook {
    /// Radiance to be expected, for a throughput of 1.
    pub mean: DVec3,
    /// Variance over the rays it takes, times those of the image over its variance; negative where nothing is known.
    pub worth: DVec3,
}

/// The cell of a point, in units of cells from the lower corner.
pub fn outlook_cell(place: DVec3, in_medium: bool, axis: DVec3) -> u32 {
    let cell = place.clamp(DVec3::ZERO, DVec3::splat(f64::from(PILOT_CELLS) - 0.5)).as_uvec3();
    let size = axis.abs();
    let along = if size.x > size.y && size.x > size.z {
        0
    } else if size.y > size.z {
        1
    } else {
        2
    };
    let face = if in_medium { 6 } else { 2 * along as u32 + u32::from(axis[along] < 0.0) };
    ((cell.z * PILOT_CELLS + cell.y) * PILOT_CELLS + cell.x) * 7 + face
}

/// The probability with which a path goes on. `focus` is one over the square of the pixel's radiance.
pub fn keep_by_outlook(outlook: &Outlook, throughput: DVec3, focus: DVec3) -> f64 {
    (throughput * throughput * focus).dot(outlook.worth).sqrt().clamp(LEAST_KEEP, 1.0)
}
