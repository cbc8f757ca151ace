//! The table of low-discrepancy points: Owen-scrambled Sobol points, four dimensions at a time.
//!
//! Each set of four dimensions has its own scrambling (Owen 1995, by the hash of Laine and Karras 2011 as Burley 2020 uses it)
//! and its own nested shuffle of the points' order, so that sets can be combined ("padded"). Any aligned run of 2^k points of
//! a set is a stratified set by itself. Pixels share the table; what makes each pixel's points its own is a random digital
//! shift of the digits and of the index, which keeps all of this. Making the points in the kernel instead, with a scrambling
//! for each pixel, took a quarter of the render time.

/// Points in a set. Beyond, a render goes on with other shifts.
pub const POINT_COUNT: u32 = 1 << POINT_BITS;
/// Binary digits of a point's index.
pub const POINT_BITS: u32 = 10;
/// Sets of four dimensions in the table, of a path's first segments.
pub const SOBOL_SETS: u32 = 4;
/// Index of one more set of the table, for the place on a camera's lens.
pub const LENS_SET: u32 = SOBOL_SETS;
/// All sets of the table.
const TABLE_SETS: u32 = SOBOL_SETS + 1;
/// The scrambling is part of the definition of the random numbers, like the constants of a hash.
const SCRAMBLING: u32 = 0x9e37_79b9;

/// Degree, coefficients and initial numbers of the primitive polynomials of dimensions 2, 3 and 4 (Joe and Kuo 2008). The
/// first dimension is van der Corput's sequence.
const POLYNOMIALS: [(u32, u32, &[u32]); 3] = [(1, 0, &[1]), (2, 1, &[1, 3]), (3, 1, &[1, 3, 1])];

/// For each binary digit of the index, lowest first, what it adds to each dimension, most significant digit first.
pub fn directions() -> [[u32; 4]; 32] {
    let mut table = [[0; 4]; 32];
    for (bit, row) in table.iter_mut().enumerate() {
        row[0] = 1 << (31 - bit);
    }
    for (dimension, &(degree, coefficients, initial)) in POLYNOMIALS.iter().enumerate() {
        let degree = degree as usize;
        let mut numbers = [0u64; 32];
        for i in 0..32 {
            numbers[i] = if i < degree {
                u64::from(initial[i])
            } else {
                let mut value = numbers[i - degree] ^ numbers[i - degree] << degree;
                for k in 1..degree {
                    value ^= u64::from(coefficients >> (degree - 1 - k) & 1) * (numbers[i - k] << k);
                }
                value
            };
            table[i][dimension + 1] = (numbers[i] << (31 - i)) as u32;
        }
    }
    table
}

/// Owen's scrambling of binary digits: each digit is flipped by a hash of the digits before it. Laine and Karras (2011) with
/// the constants of Vegdahl (2021), on reversed digits.
fn scramble(digits: u32, seed: u32) -> u32 {
    let mut x = digits.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul(seed >> 16 | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// All points, set by set. A point has 16 digits in each dimension: the first two dimensions in the low and high half of the
/// first word, the others in the second.
pub fn points() -> Vec<[u32; 2]> {
    let directions = directions();
    let mut table = Vec::with_capacity((TABLE_SETS * POINT_COUNT) as usize);
    for set in 0..TABLE_SETS {
        let seed = |purpose: u32| scramble(SCRAMBLING, (set * 8 + purpose + 1).wrapping_mul(0x85eb_ca6b));
        for index in 0..POINT_COUNT {
            let shuffled = scramble(index, seed(0));
            let mut point = [0u32; 4];
            for (bit, row) in directions.iter().enumerate() {
                if shuffled >> bit & 1 == 1 {
                    point = [0, 1, 2, 3].map(|dimension| point[dimension] ^ row[dimension]);
                }
            }
            let [x, y, z, w] = [0, 1, 2, 3].map(|k| scramble(point[k], seed(k as u32 + 1)) >> 16);
            table.push([x | y << 16, z | w << 16]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coordinate(point: [u32; 2], dimension: usize) -> u32 {
        point[dimension / 2] >> (16 * (dimension % 2)) & 0xffff
    }

    /// Whether 2^k points have one in each of 2^k intervals of one dimension, and one in each elementary rectangle of two.
    fn is_stratified(points: &[[u32; 2]], dimensions: (usize, usize)) -> bool {
        let bits = points.len().trailing_zeros();
        (0..=bits).all(|split| {
            let mut seen = vec![false; points.len()];
            for &point in points {
                let x = coordinate(point, dimensions.0) >> (16 - split);
                let y = coordinate(point, dimensions.1) >> (16 - (bits - split));
                seen[(x << (bits - split) | y) as usize] = true;
            }
            seen.iter().all(|&cell| cell)
        })
    }

    #[test]
    fn aligned_runs_are_nets() {
        let table = points();
        assert_eq!(table.len(), (TABLE_SETS * POINT_COUNT) as usize);
        for set in table.chunks(POINT_COUNT as usize) {
            for bits in 0..=POINT_BITS {
                for run in set.chunks(1 << bits) {
                    // The first two dimensions of Sobol's sequence are a (0, 2)-sequence; each alone is a (0, 1)-sequence.
                    assert!(is_stratified(run, (0, 1)), "{bits} bits");
                    for dimension in 0..4 {
                        let mut cells: Vec<u32> =
                            run.iter().map(|&point| coordinate(point, dimension) >> (16 - bits)).collect();
                        cells.sort_unstable();
                        assert!(cells.iter().copied().eq(0..1 << bits), "dimension {dimension}, {bits} bits");
                    }
                }
            }
        }
        // The check itself sees a point out of place.
        let mut broken = table[..16].to_vec();
        broken[3] = broken[4];
        assert!(!is_stratified(&broken, (0, 1)));
    }

    #[test]
    fn sets_differ() {
        let table = points();
        let sets: Vec<&[[u32; 2]]> = table.chunks(POINT_COUNT as usize).collect();
        for a in 0..sets.len() {
            for b in 0..a {
                assert!(sets[a].iter().zip(sets[b]).filter(|(p, q)| p == q).count() <= 1);
            }
        }
    }
}
