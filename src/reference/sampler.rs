//! Mirror of `shaders/lib/sampler.glsl`: the points of the integrand, four dimensions at a time.

use super::rng::{pcg4d, to_unit};
use crate::pack::sobol::reversed_directions;
use glam::DVec4;
use std::sync::LazyLock;

/// The first sets are Sobol points, later ones are hashed.
pub const SOBOL_SETS: u32 = 4;

static SOBOL_REVERSED: LazyLock<[[u32; 3]; 32]> = LazyLock::new(reversed_directions);

/// A permutation of the bits' subtrees in which each bit depends on lower bits only: Laine and Karras (2011) with the
/// constants of Vegdahl (2021). On reversed bits this is Owen's scrambling.
pub fn laine_karras(x: u32, seed: u32) -> u32 {
    let mut x = x;
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul(seed >> 16 | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

/// Point number `index` of an Owen-scrambled Sobol sequence in four dimensions, of which the index takes the low `bits`
/// bits.
pub fn sobol_set(seed: u32, pixel: u32, set: u32, index: u32, bits: u32) -> DVec4 {
    let key = pcg4d([pixel, set, seed, 0x7f4a_7c15]);
    let reversed = laine_karras(index.reverse_bits(), key[0] ^ key[3].wrapping_mul(0x9e37_79b9));
    let mut point = [0u32; 4];
    for bit in 0..bits {
        let mask = ((reversed << bit) as i32 >> 31) as u32;
        point[0] ^= mask & 1 << bit;
        for (coordinate, direction) in point[1..].iter_mut().zip(SOBOL_REVERSED[bit as usize]) {
            *coordinate ^= mask & direction;
        }
    }
    for (coordinate, key) in point.iter_mut().zip(key) {
        *coordinate = laine_karras(*coordinate, key);
    }
    to_unit(point.map(u32::reverse_bits))
}

/// The four numbers of a set.
pub fn sample_set(seed: u32, pixel: u32, set: u32, index: u32, bits: u32, mask: u32) -> DVec4 {
    if set < SOBOL_SETS {
        // Beyond the announced number of samples the sequence begins again with other scrambling.
        return sobol_set(seed.wrapping_add(index & !mask), pixel, set, index & mask, bits);
    }
    to_unit(pcg4d([pixel, index, set, seed]))
}
