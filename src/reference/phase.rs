//! Mirror of `shaders/lib/phase.glsl`: phase functions, \[1/sr\], with the convention for the sign of g that is stated
//! there.

use super::warp::INV_4PI;
use glam::DVec3;

/// A scattering angle.
#[derive(Clone, Copy, Debug)]
pub struct PhaseAngle {
    /// 1 − cos, mirrored for g < 0.
    pub one_minus_cos: f64,
    /// Cosine.
    pub cos_theta: f64,
    /// Sine.
    pub sin_theta: f64,
}

/// Henyey and Greenstein (1941) from 1 − cos (mirrored for g < 0).
pub fn henyey_greenstein_from(g: f64, m: f64) -> f64 {
    let a = g.abs();
    let o = 1.0 - a;
    let d = o * o + 2.0 * a * m;
    o * (1.0 + a) * INV_4PI / (d * d.sqrt())
}

/// The phase function for unit directions before and after.
pub fn eval_henyey_greenstein(g: f64, before: DVec3, after: DVec3) -> f64 {
    let difference = if g >= 0.0 { after - before } else { after + before };
    henyey_greenstein_from(g, 0.5 * difference.dot(difference))
}

/// The angle at which the distribution function reaches u in \[0, 1). Its density is [`eval_henyey_greenstein`].
pub fn sample_henyey_greenstein(g: f64, u: f64) -> PhaseAngle {
    let a = g.abs();
    let x = if g >= 0.0 { u } else { 1.0 - u };
    let o = 1.0 - a;
    let d = o + 2.0 * a * x;
    let q = o / d;
    let r = (1.0 + a) / d;
    let m = 2.0 * (1.0 - x) * (1.0 + a * x) * q * q;
    let p = 2.0 * x * (o + a * x) * r * r;
    let c = if m < 1.0 { 1.0 - m } else { p - 1.0 };
    PhaseAngle { one_minus_cos: m, cos_theta: if g >= 0.0 { c } else { -c }, sin_theta: (m * p).sqrt() }
}
