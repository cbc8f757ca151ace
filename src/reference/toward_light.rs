//! Mirror of `shaders/lib/toward_light.glsl`: directions in which a medium scatters the light of a point towards a vertex (Georgiev et
//! al. 2013).

use super::math::{arctan2, from_frame};
use super::warp::from_polar;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Smallest sine of the angle to the point that the density knows.
const LEAST_SINE: f64 = 1e-6;

/// A direction about the unit vector to the point.
pub fn sample_toward_light(axis: DVec3, u: DVec2) -> DVec3 {
    let theta = PI * u.x / (1.0 + (1.0 - u.x).sqrt());
    from_frame(axis, from_polar(theta.cos(), theta.sin(), u.y))
}

/// Its density per solid angle.
pub fn toward_light_pdf(axis: DVec3, direction: DVec3) -> f64 {
    let sine = axis.cross(direction).length().max(LEAST_SINE);
    arctan2(sine, -axis.dot(direction)) / (PI * PI * PI * sine)
}
