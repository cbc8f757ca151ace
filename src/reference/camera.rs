//! Mirror of `shaders/lib/camera.glsl`: a pinhole, a thin lens, or a rectangle from which all rays go in one direction.

use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Unnormalised direction through a point of the film (0..1 from the left, 0..1 from the top); its component along the
/// optical axis is 1. Of an orthographic camera, a place instead.
pub fn camera_direction(corner: DVec3, right: DVec3, down: DVec3, film: DVec2) -> DVec3 {
    corner + right * film.x + down * film.y
}

/// A point of the lens relative to its centre, uniform over the disk that the two axes span.
pub fn lens_point(lens_u: DVec3, lens_v: DVec3, u: DVec2) -> DVec3 {
    let (radius, angle) = (u.x.sqrt(), TAU * u.y);
    lens_u * (radius * angle.cos()) + lens_v * (radius * angle.sin())
}

/// From a point of the lens, the direction to where the ray through its centre meets the plane in focus; its component along
/// the optical axis is 1 again.
pub fn focused_direction(direction: DVec3, point: DVec3, inverse_focus: f64) -> DVec3 {
    direction - point * inverse_focus
}
