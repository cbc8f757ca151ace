//! Direction numbers of Sobol's sequence in four dimensions (Joe and Kuo 2008).

/// Degree, coefficients and initial numbers of the primitive polynomials of dimensions 2, 3 and 4. The first dimension is
/// van der Corput's sequence.
const POLYNOMIALS: [(u32, u32, &[u32]); 3] = [(1, 0, &[1]), (2, 1, &[1, 3]), (3, 1, &[1, 3, 1])];

/// For each bit of the index, lowest first, what it adds to dimensions 2, 3 and 4, with the bits reversed: the most
/// significant digit of the point is the lowest bit.
pub fn reversed_directions() -> [[u32; 3]; 32] {
    let mut table = [[0; 3]; 32];
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
            let direction = (numbers[i] << (31 - i)) as u32;
            table[i][dimension] = direction.reverse_bits();
        }
    }
    table
}

/// The text of `sobol.glsl`.
pub fn glsl() -> String {
    let rows: Vec<String> =
        reversed_directions().iter().map(|[y, z, w]| format!("    uvec3({y}u, {z}u, {w}u)")).collect();
    format!("const uvec3 SOBOL_REVERSED[32] = uvec3[32](\n{}\n);\n", rows.join(",\n"))
}
