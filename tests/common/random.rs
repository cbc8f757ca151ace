//! Random numbers of the tests' own: splitmix64 (Steele, Lea and Flood 2014), independent of the program's.

use glam::DVec3;

/// A stream of numbers.
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// A multiple of 2⁻²⁴ in \[0, 1), like the program's numbers.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 40) as f64 / 16_777_216.0
    }

    /// Uniform, and exact in single precision.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        f64::from((low + (high - low) * self.unit()) as f32)
    }

    /// Its logarithm is uniform.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        f64::from((low.ln() + (high.ln() - low.ln()) * self.unit()).exp() as f32)
    }

    /// In the cube from −1 to 1.
    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// A unit vector, rounded to single precision.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let point = self.in_cube();
            if point.length() > 1e-3 && point.length() < 1.0 {
                return point.normalize().as_vec3().as_dvec3();
            }
        }
    }
}
