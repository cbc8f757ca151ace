//! Phase functions.

use std::f64::consts::PI;

/// Phase function, normalised: its integral over the sphere of directions is 1. The angle is the one between the
/// directions of propagation before and after: cos = +1 is straight on.
#[derive(Clone, Debug, PartialEq)]
pub enum Phase {
    /// 1/(4π) everywhere.
    Isotropic,
    /// Henyey and Greenstein (1941).
    HenyeyGreenstein {
        /// Mean cosine, in (−1, 1); positive is forward.
        g: f64,
    },
    /// Rayleigh's for unpolarised light: 3/(16π) (1 + cos²).
    Rayleigh,
    /// A mixture: `(1 − weight) a + weight b`.
    Blend {
        /// Share of `b`, in \[0, 1\].
        weight: f64,
        /// The first phase function.
        a: Box<Phase>,
        /// The second one.
        b: Box<Phase>,
    },
    /// Values at cosines that are equally far apart, with straight lines between them.
    Tabulated {
        /// 1/sr, at least two: the first at cos = −1 (backward), the last at +1 (forward). Normalised.
        values: Vec<f64>,
    },
}

impl Phase {
    /// A table of values of any scale, which is normalised here. `None` unless there are at least two of them, finite and
    /// ≥ 0, with one > 0.
    pub fn tabulated(mut values: Vec<f64>) -> Option<Phase> {
        let good = values.len() >= 2 && values.iter().all(|value| value.is_finite() && *value >= 0.0);
        let largest = values.iter().copied().fold(0.0, f64::max);
        if !good || largest <= 0.0 {
            return None;
        }
        // The largest is divided out first, so that the sum neither overflows nor underflows.
        values.iter_mut().for_each(|value| *value /= largest);
        let step = 2.0 / (values.len() - 1) as f64;
        let ends = (values[0] + values[values.len() - 1]) / 2.0;
        let integral = 2.0 * PI * step * (values.iter().sum::<f64>() - ends);
        values.iter_mut().for_each(|value| *value /= integral);
        Some(Phase::Tabulated { values })
    }

    /// The value at a cosine in \[−1, 1\], 1/sr. This is the definition that renderers follow.
    pub fn eval(&self, cos: f64) -> f64 {
        match self {
            Phase::Isotropic => 1.0 / (4.0 * PI),
            Phase::HenyeyGreenstein { g } => (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5)),
            Phase::Rayleigh => 3.0 / (16.0 * PI) * (1.0 + cos * cos),
            Phase::Blend { weight, a, b } => (1.0 - weight) * a.eval(cos) + weight * b.eval(cos),
            Phase::Tabulated { values } => {
                let last = values.len() - 1;
                let place = (cos + 1.0) / 2.0 * last as f64;
                let index = (place.max(0.0) as usize).min(last - 1);
                let share = place - index as f64;
                (1.0 - share) * values[index] + share * values[index + 1]
            }
        }
    }
}
