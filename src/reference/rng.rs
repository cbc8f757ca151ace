//! Mirror of `shaders/lib/rng.glsl`: hashed random numbers, pure functions of their arguments.

use glam::DVec4;

/// Four hashes of four words: pcg4d (Jarzynski and Olano 2020).
pub fn pcg4d(v: [u32; 4]) -> [u32; 4] {
    let [mut x, mut y, mut z, mut w] = v.map(|word| word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mix = |x: &mut u32, y: &mut u32, z: &mut u32, w: &mut u32| {
        *x = x.wrapping_add(y.wrapping_mul(*w));
        *y = y.wrapping_add(z.wrapping_mul(*x));
        *z = z.wrapping_add(x.wrapping_mul(*y));
        *w = w.wrapping_add(y.wrapping_mul(*z));
    };
    mix(&mut x, &mut y, &mut z, &mut w);
    [x, y, z, w] = [x, y, z, w].map(|word| word ^ word >> 16);
    mix(&mut x, &mut y, &mut z, &mut w);
    [x, y, z, w]
}

/// The upper 24 bits as a number in \[0, 1 − 2⁻²⁴\].
pub fn to_unit(v: [u32; 4]) -> DVec4 {
    DVec4::from_array(v.map(|word| f64::from(word >> 8) / 16_777_216.0))
}
