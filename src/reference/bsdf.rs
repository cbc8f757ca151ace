//! Mirror of `shaders/lib/bsdf.glsl`: what surfaces do to light.

use std::f64::consts::FRAC_1_PI;

/// Lambert's law: BSDF times cosine, divided by the reflectance. \[1/sr\]
pub fn eval_diffuse(cos_out: f64) -> f64 {
    cos_out.max(0.0) * FRAC_1_PI
}

/// Density, per solid angle, of cosine-distributed directions.
pub fn diffuse_pdf(cos_out: f64) -> f64 {
    cos_out.max(0.0) * FRAC_1_PI
}
