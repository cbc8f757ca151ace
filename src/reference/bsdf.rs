//! Mirror of `shaders/lib/bsdf.glsl`: what surfaces do to light. The conventions for directions, values and densities
//! stand there.

use super::bindings::Surface;
use super::microfacet::{facet_density, facet_masking, facet_pdf, sample_facet};
use super::warp::square_to_cosine_hemisphere;
use crate::pack::layout::{
    BSDF_CONDUCTOR, BSDF_DIELECTRIC, BSDF_DIFFUSE, BSDF_PLASTIC, SURFACE_GGX, SURFACE_KIND_SHIFT, SURFACE_NONLINEAR,
    SURFACE_PANE, SURFACE_THIN,
};
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_1_PI;

/// A BSDF for a pair of directions.
#[derive(Clone, Copy, Debug, Default)]
pub struct BsdfValue {
    /// BSDF times |cos wo|, 1/sr.
    pub value: DVec3,
    /// Density with which [`sample_bsdf`] finds wo, 1/sr.
    pub pdf: f64,
}

/// A direction that was sampled.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// In the local frame.
    pub direction: DVec3,
    /// Value over density; its limit for a direction without a density. Refracted radiance scales with the square of the
    /// index (Veach 1997, section 5.2).
    pub weight: DVec3,
    /// Density per solid angle; 0 where there is none.
    pub pdf: f64,
    /// Index behind the surface over that in front of it, if the direction crosses; else 1.
    pub eta: f64,
}

/// No direction.
pub(super) const NO_SAMPLE: BsdfSample = BsdfSample { direction: DVec3::Z, weight: DVec3::ZERO, pdf: 0.0, eta: 1.0 };

/// Fresnel's equations, unpolarised, and the cosine of refraction with the sign opposite to `cos_i`, which is positive
/// outside; `eta` is the index inside over the one outside.
pub fn fresnel_dielectric(cos_i: f64, eta: f64) -> (f64, f64) {
    let n = if cos_i >= 0.0 { eta } else { 1.0 / eta };
    let c = cos_i.abs();
    let beyond = (eta - 1.0) * (eta + 1.0);
    let t_squared = if cos_i >= 0.0 { (c * c + beyond) / (eta * eta) } else { c * c * eta * eta - beyond };
    if t_squared <= 0.0 {
        return (1.0, 0.0);
    }
    let t = t_squared.sqrt();
    let s = (c - n * t) / (c + n * t);
    let p = (n * c - t) / (n * c + t);
    (0.5 * (s * s + p * p), if cos_i >= 0.0 { -t } else { t })
}

/// Fresnel's equations for a conductor with the complex index eta + i k, relative to what is outside (Born and Wolf
/// 1999, 14.2).
pub fn fresnel_conductor(cos_i: f64, eta: DVec3, k: DVec3) -> DVec3 {
    let c2 = cos_i * cos_i;
    let s2 = 1.0 - c2;
    let t0 = eta * eta - k * k - DVec3::splat(s2);
    let a2b2 = (t0 * t0 + 4.0 * k * k * eta * eta).map(f64::sqrt);
    let a = (0.5 * (a2b2 + t0)).max(DVec3::ZERO).map(f64::sqrt);
    let (t1, t2) = (a2b2 + DVec3::splat(c2), 2.0 * a * cos_i);
    let s = (t1 - t2) / (t1 + t2);
    let (t3, t4) = (a2b2 * c2 + DVec3::splat(s2 * s2), t2 * s2);
    let p = s * (t3 - t4) / (t3 + t4);
    0.5 * (s + p)
}

/// One of the `BSDF_` constants.
pub fn bsdf_kind(surface: &Surface) -> u32 {
    surface.flags >> SURFACE_KIND_SHIFT
}

/// Roughness along tangent and bitangent.
pub fn roughness(surface: &Surface) -> DVec2 {
    DVec2::new(surface.alpha, surface.alpha_v)
}

fn is_ggx(surface: &Surface) -> bool {
    surface.flags & SURFACE_GGX != 0
}

/// The mirrored direction.
pub fn reflect_z(w: DVec3) -> DVec3 {
    DVec3::new(-w.x, -w.y, w.z)
}

/// The direction opposite to w on the other side of a facet with normal m, bent by Snell's law.
pub fn refract_at(w: DVec3, m: DVec3, cos_t: f64, eta: f64) -> DVec3 {
    let c = w.dot(m);
    let scale = if c >= 0.0 { 1.0 / eta } else { eta };
    m * (c * scale + cos_t) - w * scale
}

/// Fraction of light from outside that the varnish of plastic lets through: of a rough one, from a table over the cosine.
pub fn coat_transmittance(surface: &Surface, values: &[f32], cosine: f64) -> f64 {
    if surface.value_count != 0 {
        let place = cosine * f64::from(surface.value_count - 1);
        let entry = (place as u32).min(surface.value_count - 2);
        let value = |entry: u32| f64::from(values[(surface.first_value + entry) as usize]);
        let (low, high) = (value(entry), value(entry + 1));
        return low + (high - low) * (place - f64::from(entry));
    }
    1.0 - fresnel_dielectric(cosine, surface.eta).0
}

/// The diffuse lobe of plastic, whose varnish lets the fractions `through_i` and `through_o` through.
fn plastic_diffuse(surface: &Surface, through_i: f64, through_o: f64) -> DVec3 {
    let body = surface.reflectance;
    let nonlinear = surface.flags & SURFACE_NONLINEAR != 0;
    let internal = if nonlinear { body } else { DVec3::ONE } * surface.internal_reflectance;
    body / (DVec3::ONE - internal) * (through_i * through_o / (surface.eta * surface.eta))
}

/// Probability of plastic's specular lobe: its part of what is reflected, but a quarter at least.
fn plastic_specular_probability(surface: &Surface, through_i: f64) -> f64 {
    let specular = (1.0 - through_i) * surface.specular_weight;
    let part = specular / (specular + through_i * (1.0 - surface.specular_weight)).max(1e-30);
    if surface.specular_weight > 0.0 { part.max(0.25) } else { 0.0 }
}

/// Density of the facet's normal, Smith's shadowing and masking of both directions, and the density of sampling the facet.
fn facet_terms(surface: &Surface, wi: DVec3, wo: DVec3, m: DVec3) -> (f64, f64, f64) {
    let (alpha, ggx) = (roughness(surface), is_ggx(surface));
    let masking = facet_masking(wi, m, alpha, ggx) * facet_masking(wo, m, alpha, ggx);
    (facet_density(m, alpha, ggx), masking, facet_pdf(wi, m, alpha, ggx))
}

/// The BSDF times cosine, and the density of wo. `values` holds the tables of surfaces.
pub fn eval_bsdf(surface: &Surface, values: &[f32], wi: DVec3, wo: DVec3) -> BsdfValue {
    let above = wi.z > 0.0 && wo.z > 0.0;
    match bsdf_kind(surface) {
        BSDF_DIFFUSE if above => {
            let pdf = wo.z * FRAC_1_PI;
            BsdfValue { value: surface.reflectance * pdf, pdf }
        }
        BSDF_PLASTIC if above => eval_plastic(surface, values, wi, wo),
        BSDF_CONDUCTOR if above && surface.alpha > 0.0 => {
            let m = (wi + wo).normalize();
            let (density, masking, facets) = facet_terms(surface, wi, wo, m);
            let f = fresnel_conductor(wi.dot(m), surface.transmittance, surface.extinction);
            let value = surface.specular * f * (density * masking / (4.0 * wi.z));
            BsdfValue { value, pdf: facets / (4.0 * wi.dot(m)) }
        }
        BSDF_DIELECTRIC if surface.alpha > 0.0 => eval_rough_dielectric(surface, wi, wo),
        _ => BsdfValue::default(),
    }
}

fn eval_plastic(surface: &Surface, values: &[f32], wi: DVec3, wo: DVec3) -> BsdfValue {
    let [through_i, through_o] = [wi.z, wo.z].map(|cosine| coat_transmittance(surface, values, cosine));
    let diffuse_probability = 1.0 - plastic_specular_probability(surface, through_i);
    let mut value = plastic_diffuse(surface, through_i, through_o) * (wo.z * FRAC_1_PI);
    let mut pdf = diffuse_probability * wo.z * FRAC_1_PI;
    if surface.alpha > 0.0 {
        let m = (wi + wo).normalize();
        let (density, masking, facets) = facet_terms(surface, wi, wo, m);
        let (f, _) = fresnel_dielectric(wi.dot(m), surface.eta);
        value += surface.specular * (f * density * masking / (4.0 * wi.z));
        pdf += (1.0 - diffuse_probability) * facets / (4.0 * wi.dot(m));
    }
    BsdfValue { value, pdf }
}

fn eval_rough_dielectric(surface: &Surface, wi: DVec3, wo: DVec3) -> BsdfValue {
    if wi.z == 0.0 || wo.z == 0.0 {
        return BsdfValue::default();
    }
    // The facet's normal for reflection or refraction, on the outside (Walter et al. 2007, equations 13 and 16).
    let reflects = wi.z * wo.z > 0.0;
    let eta = if wi.z > 0.0 { surface.eta } else { 1.0 / surface.eta };
    let m = (wi + wo * if reflects { 1.0 } else { eta }).normalize();
    let m = if m.z < 0.0 { -m } else { m };
    let (ci, co) = (wi.dot(m), wo.dot(m));
    if ci * wi.z <= 0.0 || co * wo.z <= 0.0 {
        return BsdfValue::default();
    }
    let (density, masking, facets) = facet_terms(surface, wi, wo, m);
    let (f, _) = fresnel_dielectric(ci, surface.eta);
    if reflects {
        let value = surface.specular * (f * density * masking / (4.0 * wi.z.abs()));
        return BsdfValue { value, pdf: f * facets / (4.0 * ci.abs()) };
    }
    // The Jacobian η² |co| / (ci + η co)²; radiance divides it by η².
    let jacobian = co.abs() / ((ci + eta * co) * (ci + eta * co));
    let value = surface.transmittance * ((1.0 - f) * density * masking * jacobian * (ci / wi.z).abs());
    BsdfValue { value, pdf: (1.0 - f) * facets * jacobian * eta * eta }
}

/// The fraction of light that a thin pane reflects: reflections between its two faces add up. Both of its sides are the same.
pub fn pane_reflectance(cosine: f64, eta: f64) -> f64 {
    let (f, _) = fresnel_dielectric(cosine.abs(), eta);
    2.0 * f / (1.0 + f)
}

/// Whether it is glass without roughness, but no thin pane.
pub fn is_smooth_glass(surface: &Surface) -> bool {
    bsdf_kind(surface) == BSDF_DIELECTRIC && surface.alpha == 0.0 && surface.flags & SURFACE_THIN == 0
}

/// What smooth glass mirrors of light from outside, and the probability with which [`sample_bsdf`] goes that way; 0 for all else.
pub fn mirrored(surface: &Surface, wi: DVec3) -> BsdfValue {
    if !is_smooth_glass(surface) || wi.z <= 0.0 {
        return BsdfValue { value: DVec3::ZERO, pdf: 0.0 };
    }
    let f = fresnel_dielectric(wi.z, surface.eta).0;
    BsdfValue { value: surface.specular * f, pdf: f }
}

/// Reflection or refraction at smooth glass, whose choice `lobe` makes.
pub fn sample_smooth_dielectric(surface: &Surface, wi: DVec3, lobe: f64) -> BsdfSample {
    let reflection = BsdfSample { direction: reflect_z(wi), weight: surface.specular, ..NO_SAMPLE };
    if surface.flags & SURFACE_THIN != 0 {
        // What gets through is not bent.
        let f = pane_reflectance(wi.z, surface.eta);
        if surface.flags & SURFACE_PANE != 0 {
            // That the light does not pass was decided before, with this probability: see `opacity_at`.
            let met = 1.0 - (1.0 - f) * surface.opacity;
            return BsdfSample { weight: reflection.weight * (f / met), ..reflection };
        }
        let straight = BsdfSample { direction: -wi, weight: surface.transmittance, ..NO_SAMPLE };
        return if lobe < f { reflection } else { straight };
    }
    let (f, cos_t) = fresnel_dielectric(wi.z, surface.eta);
    if lobe < f {
        return reflection;
    }
    let eta = if wi.z > 0.0 { surface.eta } else { 1.0 / surface.eta };
    let direction = DVec3::new(-wi.x / eta, -wi.y / eta, cos_t);
    BsdfSample { direction, weight: surface.transmittance / (eta * eta), pdf: 0.0, eta }
}

/// A direction with the weight of what is evaluated there; none without a density.
pub(super) fn weighted_sample(found: BsdfSample, BsdfValue { value, pdf }: BsdfValue) -> BsdfSample {
    if pdf <= 0.0 { NO_SAMPLE } else { BsdfSample { pdf, weight: value / pdf, ..found } }
}

/// Samples a direction. `u` chooses within a lobe, `lobe` between them; `values` holds the tables of surfaces.
pub fn sample_bsdf(surface: &Surface, values: &[f32], wi: DVec3, u: DVec2, lobe: f64) -> BsdfSample {
    let kind = bsdf_kind(surface);
    let mut found = NO_SAMPLE;
    if kind == BSDF_DIFFUSE {
        found.direction = square_to_cosine_hemisphere(u);
        if wi.z > 0.0 {
            found.pdf = found.direction.z * FRAC_1_PI;
            found.weight = surface.reflectance;
        }
        return found;
    }
    if kind == BSDF_DIELECTRIC && surface.alpha == 0.0 {
        return sample_smooth_dielectric(surface, wi, lobe);
    }
    if wi.z == 0.0 || (kind != BSDF_DIELECTRIC && wi.z < 0.0) {
        return NO_SAMPLE;
    }
    if kind == BSDF_CONDUCTOR && surface.alpha == 0.0 {
        let f = fresnel_conductor(wi.z, surface.transmittance, surface.extinction);
        return BsdfSample { direction: reflect_z(wi), weight: surface.specular * f, ..NO_SAMPLE };
    }
    if kind == BSDF_PLASTIC {
        let through = coat_transmittance(surface, values, wi.z);
        let p = plastic_specular_probability(surface, through);
        if lobe >= p {
            found.direction = square_to_cosine_hemisphere(u);
        } else if surface.alpha == 0.0 {
            return BsdfSample {
                direction: reflect_z(wi),
                weight: surface.specular * ((1.0 - through) / p),
                ..NO_SAMPLE
            };
        } else {
            let m = sample_facet(wi, u, roughness(surface), is_ggx(surface));
            found.direction = 2.0 * wi.dot(m) * m - wi;
        }
    } else {
        let m = sample_facet(wi, u, roughness(surface), is_ggx(surface));
        found.direction = 2.0 * wi.dot(m) * m - wi;
        if kind == BSDF_DIELECTRIC {
            // A facet that is seen from behind is none.
            if wi.dot(m) * wi.z <= 0.0 {
                return NO_SAMPLE;
            }
            let (f, cos_t) = fresnel_dielectric(wi.dot(m), surface.eta);
            if lobe >= f {
                found.direction = refract_at(wi, m, cos_t, surface.eta);
                found.eta = if wi.z > 0.0 { surface.eta } else { 1.0 / surface.eta };
                if found.direction.z * wi.z >= 0.0 {
                    return NO_SAMPLE;
                }
            } else if found.direction.z * wi.z <= 0.0 {
                return NO_SAMPLE;
            }
        }
    }
    weighted_sample(found, eval_bsdf(surface, values, wi, found.direction))
}

/// Whether [`sample_bsdf`] finds directions with a density at all, so that light sampling can compete.
pub fn bsdf_has_density(surface: &Surface) -> bool {
    matches!(bsdf_kind(surface), BSDF_DIFFUSE | BSDF_PLASTIC) || surface.alpha > 0.0
}
