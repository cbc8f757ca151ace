//! Mirror of `shaders/lib/equiangular.glsl`: distances at which a light near a ray is seen under equally likely angles (Kulla
//! and Fajardo 2012).

use super::math::arctan2;
use glam::DVec3;

/// A stretch of a ray, seen from a point.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// From the point to the line of the ray.
    pub distance: f64,
    /// From the foot of the point to the beginning of the stretch, signed.
    pub begin: f64,
    /// Of the stretch.
    pub extent: f64,
    /// Under which the point sees the stretch, in radians.
    pub angle: f64,
}

/// Points closer to the ray than this are treated as if they were this far.
const MIN_EQUIANGULAR_DISTANCE: f64 = 1e-5;
/// Longer stretches are sampled on this first part of them only.
const MAX_EQUIANGULAR_LENGTH: f64 = 1e3;

/// The stretch of a ray between two distances.
pub fn stretch_seen_from(point: DVec3, origin: DVec3, direction: DVec3, t_begin: f64, t_end: f64) -> Stretch {
    let offset = origin + direction * t_begin - point;
    let begin = offset.dot(direction);
    let distance = (offset - direction * begin).length().max(MIN_EQUIANGULAR_DISTANCE);
    let extent = (t_end - t_begin).min(MAX_EQUIANGULAR_LENGTH);
    let angle = arctan2(distance * extent, distance * distance + begin * (begin + extent));
    Stretch { distance, begin, extent, angle }
}

/// A distance from the beginning of the stretch, in \[0, extent\], for u in \[0, 1).
pub fn sample_equiangular(stretch: &Stretch, u: f64) -> f64 {
    let theta = u * stretch.angle;
    let slope = stretch.begin / stretch.distance;
    let rest = theta.cos() - slope * theta.sin();
    let s = stretch.distance * theta.sin() * (1.0 + slope * slope) / rest;
    if rest > 0.0 { s.min(stretch.extent) } else { stretch.extent }
}

/// Density of that distance, per length.
pub fn equiangular_pdf(stretch: &Stretch, s: f64) -> f64 {
    let along = stretch.begin + s;
    let inside = s >= 0.0 && s <= stretch.extent && stretch.angle > 0.0;
    if inside {
        stretch.distance / (stretch.angle * (stretch.distance * stretch.distance + along * along))
    } else {
        0.0
    }
}

/// Probability of a distance beyond s.
pub fn equiangular_rest(stretch: &Stretch, s: f64) -> f64 {
    let (left, d) = (stretch.extent - s, stretch.distance);
    if left > 0.0 && stretch.angle > 0.0 {
        arctan2(d * left, d * d + (stretch.begin + s) * (stretch.begin + stretch.extent)) / stretch.angle
    } else {
        0.0
    }
}
