//! What the unit kernel of phase functions finds.

use super::units::{run, vec4};
use glam::DVec3;
use tyndall::pack::layout;
use tyndall::pack::phase::pack;
use tyndall::scene::{Medium, Phase};

/// A phase function as the kernels have it.
pub struct Packed {
    pub g: f32,
    /// As in [`layout::Medium`].
    pub phase: u32,
    pub phases: Vec<layout::Phase>,
    pub values: Vec<f32>,
}

impl Packed {
    pub fn new(phase: &Phase) -> Packed {
        let medium = Medium::new("medium", DVec3::ONE, DVec3::ONE, phase.clone());
        let (mut phases, mut values) = (Vec::new(), Vec::new());
        // Something before it in the tables, so that indices matter.
        values.extend([7.0, 8.0, 9.0]);
        phases.push(layout::Phase { kind: layout::PHASE_RAYLEIGH, weight: 0.25, ..layout::Phase::default() });
        let (g, phase) = pack(&medium, &mut phases, &mut values).expect("it can be packed");
        Packed { g, phase, phases, values }
    }

    /// One invocation's inputs: a number for the angle, one for the azimuth, one for the component, the direction before.
    pub fn query(&self, u: f64, turn: f64, choice: f64, before: DVec3) -> [[f32; 4]; 3] {
        let [x, y, z] = before.to_array();
        let (first, count) = (self.phase & 0xff_ffff, self.phase >> 24);
        [vec4(&[f64::from(self.g), u, turn, choice]), vec4(&[x, y, z]), vec4(&[f64::from(first), f64::from(count)])]
    }

    /// Two vectors of outputs for three of inputs.
    pub fn ask(&self, inputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
        ask(&self.phases, &self.values, inputs)
    }
}

/// Runs the unit kernel: three vectors of inputs, two of outputs each.
pub fn ask(phases: &[layout::Phase], values: &[f32], inputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let count = inputs.len() / 3;
    run("phase", inputs, &[bytemuck::cast_slice(phases), bytemuck::cast_slice(values)], count, 2 * count)
}
