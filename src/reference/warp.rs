//! Mirror of `shaders/lib/warp.glsl`: from the unit square to directions; cosines are relative to +z.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, PI};

/// 1/(4π).
pub const INV_4PI: f64 = FRAC_1_PI / 4.0;

/// A unit vector from its z, the distance sin from the axis, and a number in \[0, 1) for the azimuth.
pub fn from_polar(z: f64, sin_theta: f64, u: f64) -> DVec3 {
    let phi = 2.0 * PI * u;
    DVec3::new(sin_theta * phi.cos(), sin_theta * phi.sin(), z)
}

/// Uniform over the sphere of directions.
pub fn square_to_sphere(u: DVec2) -> DVec3 {
    let z = 2.0 * u.x - 1.0;
    from_polar(z, 2.0 * (u.x * (1.0 - u.x)).sqrt(), u.y)
}

/// Density of [`square_to_sphere`], 1/sr.
pub fn square_to_sphere_pdf() -> f64 {
    INV_4PI
}

/// Density proportional to the cosine, over z > 0.
pub fn square_to_cosine_hemisphere(u: DVec2) -> DVec3 {
    from_polar((1.0 - u.x).sqrt(), u.x.sqrt(), u.y)
}

/// Density of [`square_to_cosine_hemisphere`], 1/sr.
pub fn square_to_cosine_hemisphere_pdf(cos_theta: f64) -> f64 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Uniform over the cone of directions with 1 − cos ≤ `one_minus_cos_max`.
pub fn square_to_cone(u: DVec2, one_minus_cos_max: f64) -> DVec3 {
    let m = u.x * one_minus_cos_max;
    from_polar(1.0 - m, (m * (2.0 - m)).sqrt(), u.y)
}

/// Density of [`square_to_cone`], 1/sr.
pub fn square_to_cone_pdf(one_minus_cos_max: f64) -> f64 {
    1.0 / (2.0 * PI * one_minus_cos_max)
}
