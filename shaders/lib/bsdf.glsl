// What surfaces do to light. Directions are in the local frame of the surface, z along its normal (for a surface with two
// different sides, towards the outside), and point away from the surface: wi to where the path comes from, wo to where it goes
// on; x is the tangent, along which the roughness is alpha, and y the bitangent. Values include the cosine of wo. Densities are per
// solid angle; a direction without a density (a mirror's) has pdf 0. Tables are read by VALUE(i), which the kernel declares.
#include "lib/constants.glsl"
#include "lib/math.glsl"
#include "lib/warp.glsl"
#include "lib/microfacet.glsl"

struct BsdfValue {
    vec3 value;     // BSDF times |cos wo|, [1/sr]
    float pdf;      // with which sample_bsdf finds wo
};

struct BsdfSample {
    vec3 direction;
    vec3 weight;    // value / pdf; for a direction without a density, the limit of this. Radiance that is refracted into or out
                    // of a body scales with the square of the index (Veach 1997, section 5.2)
    float pdf;      // 0: no density
    float eta;      // index behind the surface over that in front of it, if the direction crosses; else 1
};

// Fresnel's equations, unpolarised. cos_i is signed, positive outside; eta is the index inside over the one outside. cos_t is
// the cosine of refraction, with the opposite sign; both are computed without cancellation near total reflection.
float fresnel_dielectric(float cos_i, float eta, out float cos_t) {
    float n = cos_i >= 0.0 ? eta : 1.0 / eta;
    float c = abs(cos_i);
    // 1 - (1 - c^2) / n^2, in terms of eta, which has no rounding error, so that glass of index 1 is invisible.
    float beyond = (eta - 1.0) * (eta + 1.0);
    float t_squared = cos_i >= 0.0 ? (c * c + beyond) / (eta * eta) : c * c * eta * eta - beyond;
    if (t_squared <= 0.0) {
        cos_t = 0.0;
        return 1.0;
    }
    float t = sqrt(t_squared);
    float s = (c - n * t) / (c + n * t);
    float p = (n * c - t) / (n * c + t);
    cos_t = cos_i >= 0.0 ? -t : t;
    return 0.5 * (s * s + p * p);
}

// The fraction of light that a thin pane reflects: reflections between its two faces add up. Both of its sides are the same.
float pane_reflectance(float cosine, float eta) {
    float unused;
    float f = fresnel_dielectric(abs(cosine), eta, unused);
    return 2.0 * f / (1.0 + f);
}

// Fresnel's equations for a conductor with complex index eta + i k, relative to what is outside (Born and Wolf 1999, 14.2).
vec3 fresnel_conductor(float cos_i, vec3 eta, vec3 k) {
    float c2 = cos_i * cos_i, s2 = 1.0 - c2;
    vec3 t0 = eta * eta - k * k - s2;
    vec3 a2b2 = sqrt(t0 * t0 + 4.0 * k * k * eta * eta);
    vec3 a = sqrt(max(0.5 * (a2b2 + t0), vec3(0.0)));
    vec3 t1 = a2b2 + c2, t2 = 2.0 * a * cos_i;
    vec3 s = (t1 - t2) / (t1 + t2);
    vec3 t3 = a2b2 * c2 + s2 * s2, t4 = t2 * s2;
    vec3 p = s * (t3 - t4) / (t3 + t4);
    return 0.5 * (s + p);
}

uint bsdf_kind(Surface surface) {
    return surface.flags >> SURFACE_KIND_SHIFT;
}

vec2 roughness(Surface surface) {
    return vec2(surface.alpha, HAS_ANISOTROPIC ? surface.alpha_v : surface.alpha);
}

bool is_ggx(Surface surface) {
    return !HAS_BECKMANN || (surface.flags & SURFACE_GGX) != 0u;
}

vec3 reflect_z(vec3 w) {
    return vec3(-w.xy, w.z);
}

// The direction opposite to w on the other side of a facet with normal m, bent by Snell's law.
vec3 refract_at(vec3 w, vec3 m, float cos_t, float eta) {
    float c = dot(w, m);
    float scale = c >= 0.0 ? 1.0 / eta : eta;
    return m * (c * scale + cos_t) - w * scale;
}

// Fraction of light from outside that the varnish of plastic lets through: of a rough one, from a table over the cosine.
float coat_transmittance(Surface surface, float cosine) {
    if (HAS_ROUGH_PLASTIC && surface.value_count != 0u) {
        float place = cosine * float(surface.value_count - 1u);
        uint entry = min(whole(place), surface.value_count - 2u);
        return mix(VALUE(surface.first_value + entry), VALUE(surface.first_value + entry + 1u), place - float(entry));
    }
    float unused;
    return 1.0 - fresnel_dielectric(cosine, surface.eta, unused);
}

// The diffuse lobe of plastic: light refracted in, scattered, and refracted out again (Mitsuba's model, after Jakob 2010;
// internal reflection adds up to a geometric series). The varnish lets the fractions through_i and through_o through.
vec3 plastic_diffuse(Surface surface, float through_i, float through_o) {
    vec3 body = surface.reflectance;
    bool nonlinear = (surface.flags & SURFACE_NONLINEAR) != 0u;
    body /= 1.0 - (nonlinear ? body * surface.internal_reflectance : vec3(surface.internal_reflectance));
    return body * (through_i * through_o / (surface.eta * surface.eta));
}

// Probability of plastic's specular lobe: its part of what is reflected, but a quarter at least. Light sampling does much of the diffuse lobe's
// work; what a coat without roughness mirrors is found in no other way.
float plastic_specular_probability(Surface surface, float through_i) {
    float specular = (1.0 - through_i) * surface.specular_weight;
    float part = specular / max(specular + through_i * (1.0 - surface.specular_weight), 1e-30);
    return surface.specular_weight > 0.0 ? max(part, 0.25) : 0.0;
}

BsdfValue eval_bsdf(Surface surface, vec3 wi, vec3 wo) {
    BsdfValue none = BsdfValue(vec3(0.0), 0.0);
    uint kind = bsdf_kind(surface);
    float unused;
    if (kind == BSDF_DIFFUSE) {
        float pdf = wi.z > 0.0 && wo.z > 0.0 ? wo.z * INV_PI : 0.0;
        return BsdfValue(surface.reflectance * pdf, pdf);
    }
    if (HAS_PLASTIC && kind == BSDF_PLASTIC) {
        if (wi.z <= 0.0 || wo.z <= 0.0) {
            return none;
        }
        float through_i = coat_transmittance(surface, wi.z), through_o = coat_transmittance(surface, wo.z);
        float diffuse_probability = 1.0 - plastic_specular_probability(surface, through_i);
        vec3 value = plastic_diffuse(surface, through_i, through_o) * (wo.z * INV_PI);
        float pdf = diffuse_probability * wo.z * INV_PI;
        if (surface.alpha > 0.0) {
            vec3 m = normalize(wi + wo);
            vec2 alpha = roughness(surface);
            float density = facet_density(m, alpha, is_ggx(surface));
            float masking = facet_masking(wi, m, alpha, is_ggx(surface)) * facet_masking(wo, m, alpha, is_ggx(surface));
            float f = fresnel_dielectric(dot(wi, m), surface.eta, unused);
            value += surface.specular * (f * density * masking / (4.0 * wi.z));
            pdf += (1.0 - diffuse_probability) * facet_pdf(wi, m, alpha, is_ggx(surface)) / (4.0 * dot(wi, m));
        }
        return BsdfValue(value, pdf);
    }
    if (surface.alpha == 0.0) {
        return none;
    }
    vec2 alpha = roughness(surface);
    bool ggx = is_ggx(surface);
    if (HAS_CONDUCTOR && kind == BSDF_CONDUCTOR) {
        if (wi.z <= 0.0 || wo.z <= 0.0) {
            return none;
        }
        vec3 m = normalize(wi + wo);
        float density = facet_density(m, alpha, ggx);
        float masking = facet_masking(wi, m, alpha, ggx) * facet_masking(wo, m, alpha, ggx);
        vec3 f = fresnel_conductor(dot(wi, m), surface.transmittance, surface.extinction);
        return BsdfValue(surface.specular * f * (density * masking / (4.0 * wi.z)), facet_pdf(wi, m, alpha, ggx) / (4.0 * dot(wi, m)));
    }
    if (HAS_DIELECTRIC && kind == BSDF_DIELECTRIC) {
        if (wi.z == 0.0 || wo.z == 0.0) {
            return none;
        }
        // The facet's normal for reflection or refraction, on the outside (Walter et al. 2007, equations 13 and 16).
        bool reflects = wi.z * wo.z > 0.0;
        float eta = wi.z > 0.0 ? surface.eta : 1.0 / surface.eta;
        vec3 m = normalize(wi + wo * (reflects ? 1.0 : eta));
        m = m.z < 0.0 ? -m : m;
        float ci = dot(wi, m), co = dot(wo, m);
        if (ci * wi.z <= 0.0 || co * wo.z <= 0.0) {
            return none;
        }
        float density = facet_density(m, alpha, ggx), facets = facet_pdf(wi, m, alpha, ggx);
        float masking = facet_masking(wi, m, alpha, ggx) * facet_masking(wo, m, alpha, ggx);
        float f = fresnel_dielectric(ci, surface.eta, unused);
        if (reflects) {
            return BsdfValue(surface.specular * (f * density * masking / (4.0 * abs(wi.z))), f * facets / (4.0 * abs(ci)));
        }
        // The Jacobian eta^2 |co| / (ci + eta co)^2; radiance divides it by eta^2.
        float jacobian = abs(co) / ((ci + eta * co) * (ci + eta * co));
        vec3 value = surface.transmittance * ((1.0 - f) * density * masking * jacobian * abs(ci / wi.z));
        return BsdfValue(value, (1.0 - f) * facets * jacobian * eta * eta);
    }
    return none;
}

BsdfSample sample_smooth_dielectric(Surface surface, vec3 wi, float lobe) {
    if ((surface.flags & SURFACE_THIN) != 0u) {
        // What gets through is not bent.
        float f = pane_reflectance(wi.z, surface.eta);
        if (HAS_PANES && (surface.flags & SURFACE_PANE) != 0u) {
            // That the light does not pass was decided before, with this probability: see opacity_at().
            return BsdfSample(reflect_z(wi), surface.specular * (f / (1.0 - (1.0 - f) * surface.opacity)), 0.0, 1.0);
        }
        return lobe < f ? BsdfSample(reflect_z(wi), surface.specular, 0.0, 1.0)
                        : BsdfSample(-wi, surface.transmittance, 0.0, 1.0);
    }
    float cos_t;
    float f = fresnel_dielectric(wi.z, surface.eta, cos_t);
    if (lobe < f) {
        return BsdfSample(reflect_z(wi), surface.specular, 0.0, 1.0);
    }
    float eta = wi.z > 0.0 ? surface.eta : 1.0 / surface.eta;
    return BsdfSample(vec3(-wi.xy / eta, cos_t), surface.transmittance / (eta * eta), 0.0, eta);
}

// Whether it is glass without roughness, but no thin pane.
bool is_smooth_glass(Surface surface) {
    return HAS_DIELECTRIC && bsdf_kind(surface) == BSDF_DIELECTRIC && surface.alpha == 0.0 && (surface.flags & SURFACE_THIN) == 0u;
}

// What smooth glass mirrors of light from outside, and the probability with which sample_bsdf goes that way; 0 for all else.
BsdfValue mirrored(Surface surface, vec3 wi) {
    if (!is_smooth_glass(surface) || wi.z <= 0.0) {
        return BsdfValue(vec3(0.0), 0.0);
    }
    float unused;
    float f = fresnel_dielectric(wi.z, surface.eta, unused);
    return BsdfValue(surface.specular * f, f);
}

// A direction with the weight of what is evaluated there; none without a density.
BsdfSample weighted_sample(BsdfSample found, BsdfValue value) {
    return value.pdf <= 0.0 ? BsdfSample(vec3(0.0, 0.0, 1.0), vec3(0.0), 0.0, 1.0) : BsdfSample(found.direction, value.value / value.pdf, value.pdf, found.eta);
}

// u chooses within a lobe, `lobe` between them.
BsdfSample sample_bsdf(Surface surface, vec3 wi, vec2 u, float lobe) {
    BsdfSample none = BsdfSample(vec3(0.0, 0.0, 1.0), vec3(0.0), 0.0, 1.0);
    uint kind = bsdf_kind(surface);
    BsdfSample found = none;
    if (kind == BSDF_DIFFUSE) {
        found.direction = square_to_cosine_hemisphere(u);
        found.pdf = wi.z > 0.0 ? found.direction.z * INV_PI : 0.0;
        found.weight = wi.z > 0.0 ? surface.reflectance : vec3(0.0);
        return found;
    }
    if (HAS_DIELECTRIC && kind == BSDF_DIELECTRIC && surface.alpha == 0.0) {
        return sample_smooth_dielectric(surface, wi, lobe);
    }
    if (wi.z == 0.0 || (kind != BSDF_DIELECTRIC && wi.z < 0.0)) {
        return none;
    }
    if (HAS_CONDUCTOR && kind == BSDF_CONDUCTOR && surface.alpha == 0.0) {
        return BsdfSample(reflect_z(wi), surface.specular * fresnel_conductor(wi.z, surface.transmittance, surface.extinction), 0.0, 1.0);
    }
    if (HAS_PLASTIC && kind == BSDF_PLASTIC) {
        float through = coat_transmittance(surface, wi.z);
        float p = plastic_specular_probability(surface, through);
        if (lobe >= p) {
            found.direction = square_to_cosine_hemisphere(u);
        } else if (surface.alpha == 0.0) {
            return BsdfSample(reflect_z(wi), surface.specular * ((1.0 - through) / p), 0.0, 1.0);
        } else {
            vec3 m = sample_facet(wi, u, roughness(surface), is_ggx(surface));
            found.direction = 2.0 * dot(wi, m) * m - wi;
        }
    } else {
        vec3 m = sample_facet(wi, u, roughness(surface), is_ggx(surface));
        found.direction = 2.0 * dot(wi, m) * m - wi;
        if (HAS_DIELECTRIC && kind == BSDF_DIELECTRIC) {
            // A facet that is seen from behind is none; eval_bsdf knows nothing of what it would send elsewhere.
            if (dot(wi, m) * wi.z <= 0.0) {
                return none;
            }
            float cos_t;
            float f = fresnel_dielectric(dot(wi, m), surface.eta, cos_t);
            if (lobe >= f) {
                found.direction = refract_at(wi, m, cos_t, surface.eta);
                found.eta = wi.z > 0.0 ? surface.eta : 1.0 / surface.eta;
                if (found.direction.z * wi.z >= 0.0) {
                    return none;
                }
            } else if (found.direction.z * wi.z <= 0.0) {
                return none;
            }
        }
    }
    return weighted_sample(found, eval_bsdf(surface, wi, found.direction));
}

// Whether sample_bsdf finds directions with a density at all, so that light sampling can compete.
bool bsdf_has_density(Surface surface) {
    uint kind = bsdf_kind(surface);
    return kind == BSDF_DIFFUSE || kind == BSDF_PLASTIC || surface.alpha > 0.0;
}
