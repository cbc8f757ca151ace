//! Mirror of `shaders/lib/principled.glsl`: the principled BSDF (Burley 2012 and 2015). Where a surface of this kind has its parameters
//! stands there.

use super::bindings::Surface;
use super::bsdf::{BsdfSample, BsdfValue, NO_SAMPLE, fresnel_dielectric, refract_at, roughness, weighted_sample};
use super::math::{exp_minus, one_minus_exp_minus};
use super::microfacet::{facet_density, facet_masking, facet_pdf, sample_facet};
use super::warp::{from_polar, square_to_cosine_hemisphere};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, PI};

/// A smoother surface is taken to be as rough as this.
const LEAST_ALPHA: f64 = 0.001;
/// The clear coat brings this share of its weight.
const COAT_SHARE: f64 = 0.25;
/// It shadows itself as a surface of this roughness does.
const COAT_MASKING: DVec2 = DVec2::splat(0.25);
/// Reflectance of the clear coat at normal incidence.
const COAT_REFLECTANCE: f64 = 0.04;

/// (1 − cosine)⁵, of Schlick (1994).
fn schlick_weight(cosine: f64) -> f64 {
    (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

/// Roughness of the microfacets along the tangent and across it.
pub fn principled_alpha(surface: &Surface) -> DVec2 {
    (surface.specular.x * surface.specular.x * roughness(surface)).max(DVec2::splat(LEAST_ALPHA))
}

/// A colour of luminance 1 with the hue of the base colour; white for black.
fn principled_tint(base: DVec3) -> DVec3 {
    let luminance = base.dot(DVec3::new(0.212671, 0.715160, 0.072169));
    if luminance > 0.0 { base / luminance } else { DVec3::ONE }
}

/// Shares of light that do not meet metal: what is opaque, and what is clear.
fn principled_shares(surface: &Surface) -> (f64, f64) {
    let (metallic, clear) = (surface.transmittance.x, surface.transmittance.y);
    ((1.0 - metallic) * (1.0 - clear), (1.0 - metallic) * clear)
}

/// Density of the clear coat's normals with z > 0, 1/sr: Burley's (2012) generalisation of Trowbridge and Reitz with the exponent 1.
pub fn coat_density(m: DVec3, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    (1.0 - a2) / (PI * -a2.ln() * (m.truncate().length_squared() + a2 * m.z * m.z))
}

/// A normal of the clear coat with the density [`coat_density`] times its z.
pub fn sample_coat(u: DVec2, alpha: f64) -> DVec3 {
    let a2 = alpha * alpha;
    let depth = -a2.ln();
    let rest = (1.0 - u.x) * depth;
    let cos_squared = one_minus_exp_minus(rest) / (1.0 - a2);
    let sin_squared = exp_minus(rest) * one_minus_exp_minus(u.x * depth) / (1.0 - a2);
    from_polar(cos_squared.sqrt(), sin_squared.sqrt(), u.y)
}

/// What the microfacets reflect on the front: glass, tinted glass and metal. `grazing` is Schlick's weight, f that of glass.
fn principled_fresnel(surface: &Surface, f: f64, grazing: f64) -> DVec3 {
    let base = surface.reflectance;
    let (metallic, tinted) = (surface.transmittance.x, surface.extinction.z);
    let ratio = (surface.eta - 1.0) / (surface.eta + 1.0);
    let metal = base.lerp(DVec3::ONE, grazing);
    let tint = (principled_tint(base) * (ratio * ratio)).lerp(DVec3::ONE, grazing);
    metal * metallic + (tint * tinted + f * (1.0 - tinted)) * (1.0 - metallic)
}

/// The diffuse body and the sheen on it, without the cosine of wo; m is half way between the two directions.
fn principled_body(surface: &Surface, opaque: f64, wi: DVec3, wo: DVec3, m: DVec3) -> DVec3 {
    let (f_in, f_out, cos_d) = (schlick_weight(wi.z), schlick_weight(wo.z), wo.dot(m));
    let retro = 2.0 * surface.specular.x * cos_d * cos_d;
    let body = (1.0 - 0.5 * f_in) * (1.0 - 0.5 * f_out) + retro * (f_out + f_in + f_out * f_in * (retro - 1.0));
    // As if light had gone some way below the surface, after Hanrahan and Krueger (1993).
    let mix = |a: f64, b: f64, share: f64| a + (b - a) * share;
    let below = mix(1.0, 0.5 * retro, f_out) * mix(1.0, 0.5 * retro, f_in);
    let below = 1.25 * (below * (1.0 / (wo.z + wi.z) - 0.5) + 0.5);
    let found = surface.reflectance * (opaque * FRAC_1_PI * mix(body, below, surface.transmittance.z));
    let sheen = DVec3::ONE.lerp(principled_tint(surface.reflectance), surface.extinction.y);
    found + sheen * (surface.extinction.x * (1.0 - surface.transmittance.x) * schlick_weight(cos_d))
}

/// The BSDF times cosine, and the density of wo.
pub fn eval_principled(surface: &Surface, wi: DVec3, wo: DVec3) -> BsdfValue {
    let (opaque, clear) = principled_shares(surface);
    let clearcoat = COAT_SHARE * surface.internal_reflectance;
    let (front, reflects) = (wi.z > 0.0, wi.z * wo.z > 0.0);
    if wi.z == 0.0 || wo.z == 0.0 || (clear == 0.0 && !(front && reflects)) {
        return BsdfValue::default();
    }
    // The facet's normal for reflection or refraction, on the outside (Walter et al. 2007, equations 13 and 16).
    let eta = if front { surface.eta } else { 1.0 / surface.eta };
    let m = (wi + wo * if reflects { 1.0 } else { eta }).normalize();
    let m = if m.z < 0.0 { -m } else { m };
    let (ci, co) = (wi.dot(m), wo.dot(m));
    if ci * wi.z <= 0.0 || co * wo.z <= 0.0 {
        return BsdfValue::default();
    }
    let alpha = principled_alpha(surface);
    let (density, facets) = (facet_density(m, alpha, true), facet_pdf(wi, m, alpha, true));
    let masking = facet_masking(wi, m, alpha, true) * facet_masking(wo, m, alpha, true);
    let (f, cos_t) = fresnel_dielectric(ci, surface.eta);
    let total = if front { 1.0 + opaque + clearcoat } else { 1.0 };
    if !reflects {
        let jacobian = co.abs() / ((ci + eta * co) * (ci + eta * co));
        let through = clear * (1.0 - f) * density * masking * jacobian * (ci / wi.z).abs();
        let share = if front { clear } else { 1.0 } * (1.0 - f) / total;
        return BsdfValue {
            value: surface.reflectance.map(f64::sqrt) * through,
            pdf: share * facets * jacobian * eta * eta,
        };
    }
    // Facets between equal indices reflect nothing.
    let facet_value = if surface.eta == 1.0 { 0.0 } else { density * masking / (4.0 * wi.z.abs()) };
    if !front {
        return BsdfValue { value: DVec3::splat(clear * f * facet_value), pdf: f * facets / (4.0 * ci.abs()) };
    }
    let grazing = schlick_weight(if surface.eta > 1.0 { ci } else { -cos_t });
    let mut value =
        principled_fresnel(surface, f, grazing) * facet_value + principled_body(surface, opaque, wi, wo, m) * wo.z;
    let mut pdf = (1.0 - clear * (1.0 - f)) * facets / (4.0 * ci) + opaque * wo.z * FRAC_1_PI;
    if clearcoat > 0.0 {
        let coat = coat_density(m, surface.specular_weight);
        let shadows = facet_masking(wi, m, COAT_MASKING, true) * facet_masking(wo, m, COAT_MASKING, true);
        let fresnel = COAT_REFLECTANCE + (1.0 - COAT_REFLECTANCE) * grazing;
        value += DVec3::splat(clearcoat * fresnel * coat * shadows * wo.z);
        pdf += clearcoat * coat * m.z / (4.0 * ci);
    }
    BsdfValue { value, pdf: pdf / total }
}

/// Samples a direction. `u` chooses within a lobe, `lobe` between them.
pub fn sample_principled(surface: &Surface, wi: DVec3, u: DVec2, lobe: f64) -> BsdfSample {
    let (opaque, clear) = principled_shares(surface);
    let clearcoat = COAT_SHARE * surface.internal_reflectance;
    let front = wi.z > 0.0;
    if wi.z == 0.0 || (!front && clear == 0.0) {
        return NO_SAMPLE;
    }
    let mut found = NO_SAMPLE;
    // Body, coat and facets have the shares `opaque`, `clearcoat` and 1 of the total; from inside there are facets alone.
    let place = if front { lobe * (1.0 + opaque + clearcoat) } else { lobe };
    let before = if front { opaque + clearcoat } else { 0.0 };
    if front && place < opaque {
        found.direction = square_to_cosine_hemisphere(u);
    } else {
        let coat = place < before;
        let m = if coat {
            sample_coat(u, surface.specular_weight)
        } else {
            sample_facet(wi, u, principled_alpha(surface), true)
        };
        let ci = wi.dot(m);
        let (f, cos_t) = fresnel_dielectric(ci, surface.eta);
        // A facet that is seen from behind is none.
        if ci * wi.z <= 0.0 {
            return NO_SAMPLE;
        }
        let bends = !coat && place - before < if front { clear } else { 1.0 } * (1.0 - f);
        if bends {
            found.direction = refract_at(wi, m, cos_t, surface.eta);
            found.eta = if front { surface.eta } else { 1.0 / surface.eta };
        } else {
            found.direction = 2.0 * ci * m - wi;
        }
        let side = found.direction.z * wi.z;
        if side == 0.0 || (side > 0.0) == bends {
            return NO_SAMPLE;
        }
    }
    weighted_sample(found, eval_principled(surface, wi, found.direction))
}
