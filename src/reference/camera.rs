//! Mirror of `shaders/lib/camera.glsl`: the pinhole camera.

use glam::{DVec2, DVec3};

/// Unnormalised direction through a point of the film (0..1 from the left, 0..1 from the top); its component along the
/// optical axis is 1.
pub fn camera_direction(corner: DVec3, right: DVec3, down: DVec3, film: DVec2) -> DVec3 {
    corner + right * film.x + down * film.y
}
