//! Numbers of the device against numbers of the reference, within a declared tolerance.

use glam::DVec3;

/// The error that is allowed: `relative` of the size of what is expected, plus `absolute`.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    pub function: &'static str,
    pub relative: f64,
    pub absolute: f64,
}

/// Pairs of numbers that should be equal.
pub struct Comparison {
    tolerance: Tolerance,
    pairs: Vec<Pair>,
}

struct Pair {
    case: String,
    got: f64,
    want: f64,
    /// What the relative error is relative to.
    size: f64,
}

impl Comparison {
    /// For a function of the table.
    pub fn new(table: &[Tolerance], function: &str) -> Comparison {
        let tolerance = table.iter().find(|entry| entry.function == function);
        Comparison { tolerance: *tolerance.expect("each function has a declared tolerance"), pairs: Vec::new() }
    }

    /// Adds a pair; `case` names it in messages.
    pub fn scalar(&mut self, case: impl ToString, got: f32, want: f64) {
        self.pairs.push(Pair { case: case.to_string(), got: f64::from(got), want, size: want.abs() });
    }

    /// Adds the components of a vector; errors are relative to its length.
    pub fn vector(&mut self, case: impl ToString, got: &[f32], want: DVec3) {
        for (got, want_component) in got.iter().zip(want.to_array()) {
            let (case, got) = (case.to_string(), f64::from(*got));
            self.pairs.push(Pair { case, got, want: want_component, size: want.length() });
        }
    }

    /// The largest error, in units of what is allowed, if the expected numbers are put through `fault` first; or the
    /// first pair that is too far apart.
    fn verdict(&self, fault: impl Fn(f64) -> f64) -> Result<f64, String> {
        let Tolerance { function, relative, absolute } = self.tolerance;
        let mut worst = 0f64;
        for Pair { case, got, want, size } in &self.pairs {
            let want = fault(*want);
            if *got == want {
                continue;
            }
            let error = (got - want).abs() / (relative * size + absolute);
            if error.is_nan() || error > 1.0 {
                return Err(format!("{function}({case}) is {got:e}, expected {want:e}: {error:.2} × the tolerance"));
            }
            worst = worst.max(error);
        }
        Ok(worst)
    }

    /// Fails unless all pairs agree, and unless the comparison would notice a relative error of 1e-3 and a flipped sign.
    pub fn finish(self) {
        let function = self.tolerance.function;
        assert!(!self.pairs.is_empty(), "{function}: nothing is compared");
        let worst = self.verdict(|want| want).unwrap_or_else(|why| panic!("{why}"));
        eprintln!("{function}: {} numbers, largest error {worst:.3} of the tolerance", self.pairs.len());
        self.verdict(|want| want * 1.001).expect_err("a relative error of 1e-3 must be noticed");
        self.verdict(|want| -want).expect_err("a flipped sign must be noticed");
    }
}
