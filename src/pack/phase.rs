//! Phase functions as the kernels have them: Henyey and Greenstein's as one number of the medium, everything else as a
//! flat mixture of components.

use super::PackError;
use super::layout::{PHASE_HENYEY_GREENSTEIN, PHASE_RAYLEIGH, PHASE_TABULATED, Phase};
use crate::scene;

/// Components that one mixture can have: their number has eight bits.
pub const MAX_COMPONENTS: usize = 255;

/// Something that cannot be divided further, and its share.
struct Component<'a> {
    kind: u32,
    /// As the kernel has it; 0 where it has no meaning.
    g: f32,
    values: &'a [f64],
    weight: f64,
}

/// Packs the phase function of a medium: `g` and `phase` of [`super::layout::Medium`]. Components and numbers are appended to the
/// tables. Shares of nothing are left out and equal components united, so that what amounts to Henyey and Greenstein's
/// function costs no more than that.
pub fn pack(medium: &scene::Medium, phases: &mut Vec<Phase>, values: &mut Vec<f32>) -> Result<(f32, u32), PackError> {
    let mut components = Vec::new();
    flatten(&medium.phase, 1.0, &mut components);
    if let [only] = &components[..]
        && only.kind == PHASE_HENYEY_GREENSTEIN
    {
        return Ok((only.g, 0));
    }
    if components.len() > MAX_COMPONENTS {
        return Err(PackError::TooManyPhases { name: medium.name.clone(), count: components.len() });
    }
    let first = phases.len() as u32;
    for component in &components {
        let first_value = values.len() as u32;
        if component.kind == PHASE_TABULATED {
            values.extend(component.values.iter().map(|&value| value as f32));
            values.extend(distribution(component.values));
        }
        phases.push(Phase {
            kind: component.kind,
            weight: component.weight as f32,
            g: component.g,
            first_value,
            value_count: component.values.len() as u32,
            ..Phase::default()
        });
    }
    Ok((0.0, (first + 1) | (components.len() as u32) << 24))
}

/// Appends the components of a phase function of which there is a share.
fn flatten<'a>(phase: &'a scene::Phase, weight: f64, components: &mut Vec<Component<'a>>) {
    let (kind, g, values): (_, _, &[f64]) = match phase {
        scene::Phase::Blend { weight: share, a, b } => {
            flatten(a, weight * (1.0 - share), components);
            flatten(b, weight * share, components);
            return;
        }
        scene::Phase::Isotropic => (PHASE_HENYEY_GREENSTEIN, 0.0, &[]),
        scene::Phase::HenyeyGreenstein { g } => (PHASE_HENYEY_GREENSTEIN, nearest_below_one(*g), &[]),
        scene::Phase::Rayleigh => (PHASE_RAYLEIGH, 0.0, &[]),
        scene::Phase::Tabulated { values } => (PHASE_TABULATED, 0.0, values),
    };
    if weight <= 0.0 {
        return;
    }
    match components.iter_mut().find(|other| (other.kind, other.g, other.values) == (kind, g, values)) {
        Some(equal) => equal.weight += weight,
        None => components.push(Component { kind, g, values, weight }),
    }
}

/// The distribution function at the places of a piecewise linear density, from 0 to 1. An interval of probability 0 begins
/// and ends at the very same number.
fn distribution(values: &[f64]) -> Vec<f32> {
    let mut sums = vec![0.0];
    for pair in values.windows(2) {
        sums.push(sums[sums.len() - 1] + pair[0] + pair[1]);
    }
    let total = sums[sums.len() - 1];
    sums.iter().map(|sum| (sum / total) as f32).collect()
}

/// `g` in single precision, kept inside of (−1, 1) where rounding would reach the end.
fn nearest_below_one(g: f64) -> f32 {
    let most = 1.0 - f32::EPSILON / 2.0;
    (g as f32).clamp(-most, most)
}
