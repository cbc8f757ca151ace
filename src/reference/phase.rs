//! Mirror of `shaders/lib/phase.glsl`: phase functions, \[1/sr\], with the convention for the sign of g that is stated
//! there.

use super::warp::INV_4PI;
use crate::pack::layout::{PHASE_HENYEY_GREENSTEIN, PHASE_RAYLEIGH, Phase};
use glam::DVec3;

/// A scattering angle.
#[derive(Clone, Copy, Debug)]
pub struct PhaseAngle {
    /// 1 − cos, of Henyey and Greenstein's mirrored for g < 0.
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

/// Rayleigh's (1871), for unpolarised light.
pub fn eval_rayleigh(cos_theta: f64) -> f64 {
    0.75 * INV_4PI * (1.0 + cos_theta * cos_theta)
}

/// The angle at which the distribution function (1/2 + (3 cos + cos³)/8) reaches u in \[0, 1). In double precision the cubic's
/// real root by Newton's method as well, until it stands still.
pub fn sample_rayleigh(u: f64) -> PhaseAngle {
    let v = u.min(1.0 - u);
    let b = 2.0 - 4.0 * v;
    let mut m = 16.0 * v * (1.0 + v) / (12.0 + b * b);
    for _ in 0..5 {
        m = (8.0 * v - m * m * (3.0 - 2.0 * m)) / (3.0 * (1.0 + (1.0 - m) * (1.0 - m)));
    }
    let sin_theta = (m * (2.0 - m)).sqrt();
    if u < 0.5 {
        PhaseAngle { one_minus_cos: 2.0 - m, cos_theta: m - 1.0, sin_theta }
    } else {
        PhaseAngle { one_minus_cos: m, cos_theta: 1.0 - m, sin_theta }
    }
}

/// The value of a table of `count` densities from `first` on at a cosine in \[−1, 1\].
pub fn eval_tabulated(values: &[f32], first: u32, count: u32, cos_theta: f64) -> f64 {
    let value = |index: u32| f64::from(values[(first + index) as usize]);
    let place = (0.5 * cos_theta + 0.5) * f64::from(count - 1);
    let index = (place.max(0.0) as u32).min(count - 2);
    let share = place - f64::from(index);
    (1.0 - share) * value(index) + share * value(index + 1)
}

/// The angle at which a table's distribution function reaches u in \[0, 1).
pub fn sample_tabulated(values: &[f32], first: u32, count: u32, u: f64) -> PhaseAngle {
    let density = |index: u32| f64::from(values[(first + index) as usize]);
    let distribution = |index: u32| f64::from(values[(first + count + index) as usize]);
    let (mut low, mut high) = (0, count - 1);
    while high - low > 1 {
        let middle = (low + high) >> 1;
        if distribution(middle) <= u { low = middle } else { high = middle }
    }
    let (below, above) = (distribution(low), distribution(high));
    let most = density(low).max(density(high));
    let (a, b) = (density(low) / most, density(high) / most);
    let (r, rest) = ((u - below) / (above - below), (above - u) / (above - below));
    let root = (rest * a * a + r * b * b).sqrt();
    let x = if r > 0.0 { r * (a + b) / (a + root) } else { 0.0 };
    let y = if rest > 0.0 { rest * (a + b) / (b + root) } else { 0.0 };
    let steps = f64::from(count - 1);
    let p = 2.0 * (f64::from(low) + x) / steps;
    let m = 2.0 * (f64::from(count - 1 - high) + y) / steps;
    PhaseAngle { one_minus_cos: m, cos_theta: if m < 1.0 { 1.0 - m } else { p - 1.0 }, sin_theta: (m * p).sqrt() }
}

/// The tables that mixtures are read from.
#[derive(Clone, Copy, Debug)]
pub struct PhaseTables<'a> {
    /// Components.
    pub phases: &'a [Phase],
    /// Numbers of tables.
    pub values: &'a [f32],
}

/// The components of a mixture, which is named as in [`crate::pack::layout::Medium::phase`].
fn components(phases: &[Phase], phase: u32) -> &[Phase] {
    let (first, count) = ((phase & 0xff_ffff) - 1, phase >> 24);
    &phases[first as usize..(first + count) as usize]
}

/// A component for unit directions before and after.
pub fn eval_component(values: &[f32], component: &Phase, before: DVec3, after: DVec3) -> f64 {
    let cos_theta = before.dot(after).clamp(-1.0, 1.0);
    match component.kind {
        PHASE_HENYEY_GREENSTEIN => eval_henyey_greenstein(f64::from(component.g), before, after),
        PHASE_RAYLEIGH => eval_rayleigh(cos_theta),
        _ => eval_tabulated(values, component.first_value, component.value_count, cos_theta),
    }
}

/// The density of all components together.
pub fn eval_mixture(tables: PhaseTables, phase: u32, before: DVec3, after: DVec3) -> f64 {
    let value = |component: &Phase| eval_component(tables.values, component, before, after);
    components(tables.phases, phase).iter().map(|component| f64::from(component.weight) * value(component)).sum()
}

/// An angle of the component in which `choice` in \[0, 1) falls.
pub fn sample_mixture(tables: PhaseTables, phase: u32, u: f64, choice: f64) -> PhaseAngle {
    let components = components(tables.phases, phase);
    let mut index = 0;
    // In single precision like the kernel, so that both choose the same.
    let mut below = components[0].weight;
    while index + 1 < components.len() && choice >= f64::from(below) {
        index += 1;
        below += components[index].weight;
    }
    let component = &components[index];
    match component.kind {
        PHASE_HENYEY_GREENSTEIN => sample_henyey_greenstein(f64::from(component.g), u),
        PHASE_RAYLEIGH => sample_rayleigh(u),
        _ => sample_tabulated(tables.values, component.first_value, component.value_count, u),
    }
}
