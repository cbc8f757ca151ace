//! Mirror of `shaders/lib/sampler.glsl`: the points of the integrand, four dimensions at a time.

use super::rng::{pcg4d, to_unit};
use crate::pack::groups::{run_half, run_shift};
use crate::pack::sobol::{POINT_BITS, POINT_COUNT, SOBOL_SETS};
use crate::render::{RUN_SAMPLES, RUN_SHIFTS};
use glam::DVec4;

/// The random words of a set: those of the whole pixel where they shift a table's points, those of the sample elsewhere.
pub fn set_key(seed: u32, pixel: u32, set: u32, index: u32) -> [u32; 4] {
    pcg4d([pixel, set, seed, if set < SOBOL_SETS { index >> POINT_BITS } else { index }])
}

/// The random words of the set for a camera's lens: those of set 0 with other words for the seed.
pub fn lens_key(seed: u32, pixel: u32, index: u32) -> [u32; 4] {
    set_key(seed ^ 0x6c65_6e73, pixel, 0, index)
}

/// Where pixels share paths: the seed of the half of a render that a sample belongs to.
pub fn half_seed(seed: u32, index: u32) -> u32 {
    if run_half(index) == 0 { seed } else { seed ^ 0x6861_6c66 }
}

/// The number of a sample in its half.
pub fn half_index(index: u32) -> u32 {
    index / (2 * RUN_SAMPLES) * RUN_SAMPLES + index % RUN_SAMPLES
}

/// The seed of numbers that the pixels of a group have in common, one for each half and shift.
pub fn group_seed(seed: u32, index: u32) -> u32 {
    seed ^ 0x6772_6f70 ^ (2 * run_shift(index) + run_half(index)) << 16
}

/// The number of a sample among those of its half and shift.
pub fn group_index(index: u32) -> u32 {
    index / (2 * RUN_SHIFTS * RUN_SAMPLES) * RUN_SAMPLES + index % RUN_SAMPLES
}

/// Which of the table's points is next, for a set below [`SOBOL_SETS`] or [`crate::pack::sobol::LENS_SET`].
pub fn point_index(set: u32, index: u32, key: [u32; 4]) -> u32 {
    set * POINT_COUNT + ((index ^ (key[0] & 0xff) ^ (key[1] & 0xff) << 4) & (POINT_COUNT - 1))
}

/// A point of the table, its digits shifted by the key, in [0, 1 − 2⁻²⁴].
pub fn shifted_point(point: [u32; 2], key: [u32; 4]) -> DVec4 {
    let [low, high] = point;
    let digits = [low << 16, low & 0xffff_0000, high << 16, high & 0xffff_0000];
    to_unit([0, 1, 2, 3].map(|k| digits[k] ^ key[k]))
}
