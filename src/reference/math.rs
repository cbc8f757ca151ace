//! Mirror of `shaders/lib/math.glsl`: elementary functions and orthonormal frames.

use glam::DVec3;

/// −log(x) for x in (0, 1\].
pub fn minus_log(x: f64) -> f64 {
    -x.ln()
}

/// −log(1 − u) for u in \[0, 1): the optical depth of a free flight.
pub fn minus_log_1m(u: f64) -> f64 {
    -(-u).ln_1p()
}

/// exp(−x) for x ≥ 0.
pub fn exp_minus(x: f64) -> f64 {
    (-x).exp()
}

/// 1 − exp(−x) for x ≥ 0.
pub fn one_minus_exp_minus(x: f64) -> f64 {
    -(-x).exp_m1()
}

/// [`one_minus_exp_minus`] of each component.
pub fn one_minus_exp_minus_rgb(x: DVec3) -> DVec3 {
    DVec3::new(one_minus_exp_minus(x.x), one_minus_exp_minus(x.y), one_minus_exp_minus(x.z))
}

/// [`exp_minus`] of each component.
pub fn exp_minus_rgb(x: DVec3) -> DVec3 {
    DVec3::new(exp_minus(x.x), exp_minus(x.y), exp_minus(x.z))
}

/// exp(x²) erfc(x) for x in \[0, 5\].
pub fn scaled_erfc(x: f64) -> f64 {
    (x * x).exp() * libm::erfc(x)
}

/// The angle of the point (x, y) from the x axis, in \[−π, π\]; 0 at the origin.
pub fn arctan2(y: f64, x: f64) -> f64 {
    // The kernel knows no difference between the zeros.
    if x == 0.0 && y == 0.0 { 0.0 } else { (y + 0.0).atan2(x) }
}

/// The sine for |x| ≤ π/2.
pub fn sine(x: f64) -> f64 {
    x.sin()
}

/// Two unit vectors (tangent, bitangent) that make up a right-handed frame with the unit vector n: tangent × bitangent
/// = n (Duff et al. 2017).
pub fn orthonormal_frame(n: DVec3) -> (DVec3, DVec3) {
    let side = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (side + n.z);
    let b = n.x * n.y * a;
    let tangent = DVec3::new(1.0 + side * n.x * n.x * a, side * b, -side * n.x);
    let bitangent = DVec3::new(b, side + n.y * n.y * a, -n.y);
    (tangent, bitangent)
}

/// A direction from its components in the frame about a unit vector.
pub fn from_frame(axis: DVec3, local: DVec3) -> DVec3 {
    let (tangent, bitangent) = orthonormal_frame(axis);
    (tangent * local.x + bitangent * local.y + axis * local.z).normalize()
}

/// The components of a direction in that frame.
pub fn to_frame(axis: DVec3, direction: DVec3) -> DVec3 {
    let (tangent, bitangent) = orthonormal_frame(axis);
    DVec3::new(tangent.dot(direction), bitangent.dot(direction), axis.dot(direction))
}

/// The largest component.
pub fn max_component(v: DVec3) -> f64 {
    v.max_element()
}

/// The sum of the components.
pub fn sum_components(v: DVec3) -> f64 {
    v.element_sum()
}
