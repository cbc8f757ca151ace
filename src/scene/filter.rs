//! Reconstruction filters: how the samples about a pixel make up its value.

use std::f64::consts::PI;

/// A reconstruction filter, separable and even: a pixel is the mean of the picture about it, with the weight
/// `eval(x) eval(y)` at the distances x and y, in pixels, from the pixel's centre. Models and parameters are Mitsuba's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReconstructionFilter {
    /// The same weight everywhere.
    Box {
        /// Half the width, in pixels; with ½ every sample counts for the pixel in which it lies.
        radius: f64,
    },
    /// A triangle.
    Tent {
        /// Where the weight is 0, in pixels.
        radius: f64,
    },
    /// A Gaussian, cut off at four standard deviations and lowered by its value there.
    Gaussian {
        /// Standard deviation, in pixels.
        stddev: f64,
    },
    /// The cubic splines of Mitchell and Netravali (1988), which reach two pixels far.
    Mitchell {
        /// Their parameter B: blur.
        b: f64,
        /// Their parameter C: ringing.
        c: f64,
    },
    /// A sinc that is windowed by the main lobe of a wider one (Duchon 1979).
    Lanczos {
        /// How far it reaches, in pixels.
        lobes: f64,
    },
}

impl ReconstructionFilter {
    /// Each sample counts for the pixel in which it lies, alike.
    pub const PIXEL: ReconstructionFilter = ReconstructionFilter::Box { radius: 0.5 };
    /// Catmull and Rom's cubic spline, a case of Mitchell and Netravali's.
    pub const CATMULL_ROM: ReconstructionFilter = ReconstructionFilter::Mitchell { b: 0.0, c: 0.5 };
    /// The filter of Mitsuba's films that name none.
    pub const DEFAULT: ReconstructionFilter = ReconstructionFilter::Gaussian { stddev: 0.5 };

    /// Where it ends, in pixels from the centre.
    pub fn radius(&self) -> f64 {
        match *self {
            ReconstructionFilter::Box { radius } | ReconstructionFilter::Tent { radius } => radius,
            ReconstructionFilter::Gaussian { stddev } => 4.0 * stddev,
            ReconstructionFilter::Mitchell { .. } => 2.0,
            ReconstructionFilter::Lanczos { lobes } => lobes,
        }
    }

    /// The weight at a distance of `x` pixels from the centre along one axis, not normalised; 0 beyond the radius.
    pub fn eval(&self, x: f64) -> f64 {
        let x = x.abs();
        if x > self.radius() {
            return 0.0;
        }
        match *self {
            ReconstructionFilter::Box { .. } => 1.0,
            ReconstructionFilter::Tent { radius } => 1.0 - x / radius,
            ReconstructionFilter::Gaussian { stddev } => {
                (-x * x / (2.0 * stddev * stddev)).exp() - (-self.radius().powi(2) / (2.0 * stddev * stddev)).exp()
            }
            ReconstructionFilter::Mitchell { b, c } if x < 1.0 => {
                ((12.0 - 9.0 * b - 6.0 * c) * x.powi(3) + (-18.0 + 12.0 * b + 6.0 * c) * x * x + 6.0 - 2.0 * b) / 6.0
            }
            ReconstructionFilter::Mitchell { b, c } => {
                ((-b - 6.0 * c) * x.powi(3) + (6.0 * b + 30.0 * c) * x * x - (12.0 * b + 48.0 * c) * x
                    + 8.0 * b
                    + 24.0 * c)
                    / 6.0
            }
            ReconstructionFilter::Lanczos { lobes } => {
                let sinc = |x: f64| if x < 1e-9 { 1.0 } else { (PI * x).sin() / (PI * x) };
                sinc(x) * sinc(x / lobes)
            }
        }
    }
}

impl ReconstructionFilter {
    /// Whether some samples count negatively.
    pub fn has_negative_lobes(&self) -> bool {
        (0..=1000).any(|step| self.eval(self.radius() * f64::from(step) / 1000.0) < 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_mitsuba() {
        // As Mitsuba 3.9.1 prints them (scalar_rgb: `mi.load_dict({'type': 'lanczos'}).eval(x)`), which looks up a table or
        // a polynomial for some: at 0, 0.25, 0.9, 1.3, 1.8.
        let mitchell = ReconstructionFilter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 };
        for (filter, expected) in [
            (ReconstructionFilter::Tent { radius: 2.0 }, [1.0, 0.875, 0.55, 0.35, 0.1]),
            (ReconstructionFilter::DEFAULT, [0.99925, 0.88217, 0.19747, 0.0337, 0.00119]),
            (ReconstructionFilter::Gaussian { stddev: 0.7 }, [0.99925, 0.93772, 0.43728, 0.17786, 0.03633]),
            (mitchell, [0.88889, 0.78212, 0.11939, -0.02994, -0.01022]),
            (ReconstructionFilter::Mitchell { b: 0.5, c: 0.1 }, [0.83333, 0.73255, 0.13268, 0.01388, -0.00253]),
            (ReconstructionFilter::CATMULL_ROM, [1.0, 0.86719, 0.0685, -0.0735, -0.016]),
            (ReconstructionFilter::Lanczos { lobes: 3.0 }, [1.0, 0.89007, 0.09382, -0.14233, -0.05244]),
            (ReconstructionFilter::Lanczos { lobes: 2.0 }, [1.0, 0.87735, 0.07636, -0.08643, -0.01136]),
        ] {
            for (x, expected) in [0.0, 0.25, 0.9, 1.3, 1.8].into_iter().zip(expected) {
                let got = filter.eval(x);
                assert!((got - expected).abs() < 5e-4, "{filter:?} at {x}: {got} instead of {expected}");
                assert_eq!(got, filter.eval(-x));
            }
            assert_eq!(filter.eval(filter.radius() + 1e-3), 0.0);
            assert_eq!(filter.has_negative_lobes(), expected.iter().any(|value| *value < 0.0), "{filter:?}");
        }
    }
}
