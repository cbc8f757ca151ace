//! Mirror of `shaders/lib/microfacet.glsl`: normals of the facets that make up a rough surface. The conventions for directions
//! stand there.

use super::math::{exp_minus, minus_log, minus_log_1m, scaled_erfc};
use super::warp::from_polar;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Beyond are few of Beckmann's slopes, in units of the roughness.
const MAX_SLOPE: f64 = 5.0;
/// Rounding moves a slope by less than this.
const SLOPE_ERROR: f64 = 1e-5;
const INV_SQRT_PI: f64 = 0.564_189_583_547_756_3;

/// Density of normals with z > 0, 1/sr; `alpha` is the roughness along tangent and bitangent. Beckmann (1963) or GGX (Walter et al.
/// 2007), in their anisotropic forms (Heitz 2014, equations 79 and 85).
pub fn facet_density(m: DVec3, alpha: DVec2, ggx: bool) -> f64 {
    if m.z <= 0.0 {
        return 0.0;
    }
    let (c2, s2) = (m.z * m.z, (m.truncate() / alpha).length_squared());
    if ggx {
        let d = c2 + s2;
        return 1.0 / (PI * alpha.x * alpha.y * d * d);
    }
    let shape = exp_minus(s2 / c2);
    if shape > 0.0 { shape / (PI * alpha.x * alpha.y * c2 * c2) } else { 0.0 }
}

/// What a direction sees of Beckmann's facets with roughness 1.
struct SeenSlopes {
    /// Cosine and sine of the direction.
    c: f64,
    q: f64,
    /// Slope towards it.
    least: f64,
    /// The area of all facets is 2 c + rest.
    rest: f64,
}

fn seen_slopes(c: f64, q: f64) -> SeenSlopes {
    let least = if c < MAX_SLOPE * q { c / q } else { MAX_SLOPE };
    let turned_away = q * INV_SQRT_PI - c * scaled_erfc(least);
    SeenSlopes { c, q, least: -least, rest: exp_minus(least * least) * turned_away.max(0.0) }
}

/// The area of facets between the slope that u draws and s, negative if s is the smaller one; `shape` is exp(−s²).
fn slope_excess(seen: &SeenSlopes, s: f64, shape: f64, u: f64) -> f64 {
    let (upright, leaning) = (seen.c * scaled_erfc(s.abs()), seen.q * INV_SQRT_PI);
    let area = 2.0 * seen.c + seen.rest;
    if s < 0.0 {
        seen.rest + shape * (upright - leaning) - u * area
    } else {
        (1.0 - u) * area - shape * (upright + leaning)
    }
}

/// A slope by inversion of its distribution.
fn sample_slope(seen: &SeenSlopes, u: f64) -> f64 {
    let beyond = minus_log_1m(u);
    let odds = beyond - minus_log(u.max(3e-8));
    let lean = seen.q / (seen.q + seen.c);
    let (mut low, mut high) = (seen.least, MAX_SLOPE);
    let mut s = odds * (0.443 - 0.00066 * odds * odds) * (1.0 - lean) + beyond.sqrt() * lean;
    s = s.clamp(low, high);
    for _ in 0..16 {
        let shape = exp_minus(s * s);
        let excess = slope_excess(seen, s, shape, u);
        if excess < 0.0 {
            low = s;
        } else {
            high = s;
        }
        let facing = (seen.c + seen.q * s).max(1e-6);
        let newton = -excess / (2.0 * INV_SQRT_PI * facing * shape);
        let mut next = s + newton / (1.0 + newton * (0.5 * seen.q / facing - s)).clamp(0.3, 4.0);
        if !(next > low - SLOPE_ERROR && next < high + SLOPE_ERROR) {
            next = 0.5 * (low + high);
        }
        let moved = (next - s).abs();
        s = next;
        if moved < 3e-4 {
            break;
        }
    }
    s
}

/// Smith's masking of direction v for facets with normal m: of the area of facets that lean towards v, the share that is seen.
pub fn facet_masking(v: DVec3, m: DVec3, alpha: DVec2, ggx: bool) -> f64 {
    if v.dot(m) * v.z <= 0.0 {
        return 0.0;
    }
    let q2 = (v.truncate() * alpha).length_squared();
    if ggx {
        return 2.0 / (1.0 + (1.0 + q2 / (v.z * v.z)).sqrt());
    }
    let seen = seen_slopes(v.z.abs(), q2.sqrt());
    2.0 * seen.c / (2.0 * seen.c + seen.rest)
}

/// The normal of a facet that w sees (Heitz and d'Eon 2014).
pub fn sample_facet(w: DVec3, u: DVec2, alpha: DVec2, ggx: bool) -> DVec3 {
    let v = (alpha * w.truncate()).extend(w.z).normalize();
    let v = if w.z < 0.0 { -v } else { v };
    if !ggx {
        let q = v.truncate().length();
        let along = if q > 0.0 { v.truncate() / q } else { DVec2::X };
        let slope = sample_slope(&seen_slopes(v.z, q), u.x);
        let across = sample_slope(&seen_slopes(1.0, 0.0), u.y);
        return (alpha * (along * slope + along.perp() * across)).extend(1.0).normalize();
    }
    let height = 1.0 + v.z;
    let (down, up) = (u.x * height, (1.0 - u.x) * height + v.truncate().length_squared() / height);
    let cap = from_polar(1.0 - down, (down * up).sqrt(), u.y);
    (alpha * (cap + v).truncate()).extend(height * (1.0 - u.x)).normalize()
}

/// Density of [`sample_facet`], 1/sr (Heitz 2014, equation 15).
pub fn facet_pdf(w: DVec3, m: DVec3, alpha: DVec2, ggx: bool) -> f64 {
    facet_density(m, alpha, ggx) * facet_masking(w, m, alpha, ggx) * (w.dot(m) / w.z).abs()
}
