// The principled BSDF (Burley 2012 and 2015), with the choices of Mitsuba 3.9.1: a diffuse body that shines back where it is grazed, sheen,
// a clear coat, and microfacets that reflect as a metal or as glass, and refract. Directions, values and densities are those of
// bsdf.glsl. A surface of this kind has its parameters where others have theirs:
//     reflectance             base colour
//     specular.x              roughness; a texture may stand for it
//     transmittance           metallic, spec_trans, flatness
//     extinction              sheen, sheen_tint, spec_tint
//     internal_reflectance    clearcoat
//     specular_weight         roughness of the clear coat, in [0.001, 0.1]
//     alpha, alpha_v          factors of the squared roughness along the tangent and across it
#include "lib/constants.glsl"
#include "lib/math.glsl"
#include "lib/warp.glsl"
#include "lib/microfacet.glsl"
#include "lib/bsdf.glsl"

// A smoother surface is taken to be as rough as this.
const float LEAST_ALPHA = 0.001;
// The clear coat brings a quarter of its weight, and shadows itself as a surface of this roughness does.
const float COAT_SHARE = 0.25;
const float COAT_MASKING = 0.25;
// Reflectance of the clear coat at normal incidence.
const float COAT_REFLECTANCE = 0.04;

// (1 - cosine)^5, of Schlick (1994).
float schlick_weight(float cosine) {
    float m = clamp(1.0 - cosine, 0.0, 1.0);
    return m * m * (m * m) * m;
}

// Roughness of the microfacets along the tangent and across it.
vec2 principled_alpha(Surface surface) {
    return max(surface.specular.x * surface.specular.x * roughness(surface), vec2(LEAST_ALPHA));
}

// A colour of luminance 1 with the hue of the base colour; white for black.
vec3 principled_tint(vec3 base) {
    float luminance = dot(base, vec3(0.212671, 0.715160, 0.072169));
    return luminance > 0.0 ? base / luminance : vec3(1.0);
}

// Shares of light that do not meet metal: what is opaque, and what is clear.
vec2 principled_shares(Surface surface) {
    float metallic = surface.transmittance.x, clear = HAS_DIELECTRIC ? surface.transmittance.y : 0.0;
    return vec2((1.0 - metallic) * (1.0 - clear), (1.0 - metallic) * clear);
}

// Density of the clear coat's normals, [1/sr], for normals with z > 0: Burley's (2012) generalisation of Trowbridge and Reitz with the
// exponent 1. 1 + (a^2 - 1) z^2 is written without cancellation.
float coat_density(vec3 m, float alpha) {
    float a2 = alpha * alpha;
    return (1.0 - a2) / (PI * minus_log(a2) * (dot(m.xy, m.xy) + a2 * m.z * m.z));
}

// A normal of the clear coat with the density coat_density() times its z. The squared cosine is (1 - a^(2 (1 - u))) / (1 - a^2).
vec3 sample_coat(vec2 u, float alpha) {
    float a2 = alpha * alpha, depth = minus_log(a2), rest = (1.0 - u.x) * depth;
    float cos_squared = one_minus_exp_minus(rest) / (1.0 - a2);
    float sin_squared = exp_minus(rest) * one_minus_exp_minus(u.x * depth) / (1.0 - a2);
    return from_polar(sqrt(cos_squared), sqrt(sin_squared), u.y);
}

// What the microfacets reflect on the front: glass, tinted glass and metal. `grazing` is Schlick's weight, f that of glass.
vec3 principled_fresnel(Surface surface, float f, float grazing) {
    vec3 base = surface.reflectance;
    float metallic = surface.transmittance.x, tinted = surface.extinction.z;
    float ratio = (surface.eta - 1.0) / (surface.eta + 1.0);
    vec3 metal = mix(base, vec3(1.0), grazing);
    vec3 tint = mix(principled_tint(base) * (ratio * ratio), vec3(1.0), grazing);
    return metal * metallic + (tint * tinted + f * (1.0 - tinted)) * (1.0 - metallic);
}

// The diffuse body and the sheen on it, without the cosine of wo; m is half way between the two directions.
vec3 principled_body(Surface surface, float opaque, vec3 wi, vec3 wo, vec3 m) {
    float f_in = schlick_weight(wi.z), f_out = schlick_weight(wo.z), cos_d = dot(wo, m);
    float retro = 2.0 * surface.specular.x * cos_d * cos_d;
    float body = (1.0 - 0.5 * f_in) * (1.0 - 0.5 * f_out) + retro * (f_out + f_in + f_out * f_in * (retro - 1.0));
    // As if light had gone some way below the surface, after Hanrahan and Krueger (1993).
    float below = mix(1.0, 0.5 * retro, f_out) * mix(1.0, 0.5 * retro, f_in);
    below = 1.25 * (below * (1.0 / (wo.z + wi.z) - 0.5) + 0.5);
    vec3 found = surface.reflectance * (opaque * INV_PI * mix(body, below, surface.transmittance.z));
    vec3 sheen = mix(vec3(1.0), principled_tint(surface.reflectance), surface.extinction.y);
    return found + sheen * (surface.extinction.x * (1.0 - surface.transmittance.x) * schlick_weight(cos_d));
}

BsdfValue eval_principled(Surface surface, vec3 wi, vec3 wo) {
    BsdfValue found = BsdfValue(vec3(0.0), 0.0);
    vec2 shares = principled_shares(surface);
    float opaque = shares.x, clear = shares.y, clearcoat = COAT_SHARE * surface.internal_reflectance;
    bool front = wi.z > 0.0, reflects = wi.z * wo.z > 0.0;
    if (wi.z == 0.0 || wo.z == 0.0 || (clear == 0.0 && !(front && reflects))) {
        return found;
    }
    // The facet's normal for reflection or refraction, on the outside (Walter et al. 2007, equations 13 and 16).
    float eta = front ? surface.eta : 1.0 / surface.eta;
    vec3 m = normalize(wi + wo * (reflects ? 1.0 : eta));
    m = m.z < 0.0 ? -m : m;
    float ci = dot(wi, m), co = dot(wo, m);
    if (ci * wi.z <= 0.0 || co * wo.z <= 0.0) {
        return found;
    }
    vec2 alpha = principled_alpha(surface);
    float density = facet_density(m, alpha, true), facets = facet_pdf(wi, m, alpha, true);
    float masking = facet_masking(wi, m, alpha, true) * facet_masking(wo, m, alpha, true);
    float cos_t;
    float f = fresnel_dielectric(ci, surface.eta, cos_t);
    float total = front ? 1.0 + opaque + clearcoat : 1.0;
    if (!reflects) {
        float jacobian = abs(co) / ((ci + eta * co) * (ci + eta * co));
        found.value = sqrt(surface.reflectance) * (clear * (1.0 - f) * density * masking * jacobian * abs(ci / wi.z));
        found.pdf = (front ? clear : 1.0) * (1.0 - f) * facets * jacobian * eta * eta / total;
        return found;
    }
    // Facets between equal indices reflect nothing.
    float facet_value = surface.eta == 1.0 ? 0.0 : density * masking / (4.0 * abs(wi.z));
    if (!front) {
        return BsdfValue(vec3(clear * f * facet_value), f * facets / (4.0 * abs(ci)));
    }
    float grazing = schlick_weight(surface.eta > 1.0 ? ci : -cos_t);
    found.value = principled_fresnel(surface, f, grazing) * facet_value + principled_body(surface, opaque, wi, wo, m) * wo.z;
    found.pdf = (1.0 - clear * (1.0 - f)) * facets / (4.0 * ci) + opaque * wo.z * INV_PI;
    if (clearcoat > 0.0) {
        float coat = coat_density(m, surface.specular_weight);
        vec2 rough = vec2(COAT_MASKING);
        float shadows = facet_masking(wi, m, rough, true) * facet_masking(wo, m, rough, true);
        found.value += clearcoat * mix(COAT_REFLECTANCE, 1.0, grazing) * coat * shadows * wo.z;
        found.pdf += clearcoat * coat * m.z / (4.0 * ci);
    }
    found.pdf /= total;
    return found;
}

// u chooses within a lobe, `lobe` between them.
BsdfSample sample_principled(Surface surface, vec3 wi, vec2 u, float lobe) {
    BsdfSample none = BsdfSample(vec3(0.0, 0.0, 1.0), vec3(0.0), 0.0, 1.0);
    vec2 shares = principled_shares(surface);
    float opaque = shares.x, clear = shares.y, clearcoat = COAT_SHARE * surface.internal_reflectance;
    bool front = wi.z > 0.0;
    if (wi.z == 0.0 || (!front && clear == 0.0)) {
        return none;
    }
    BsdfSample found = none;
    // Body, coat and facets have the shares `opaque`, `clearcoat` and 1 of the total; from inside there are facets alone.
    float place = front ? lobe * (1.0 + opaque + clearcoat) : lobe;
    float before = front ? opaque + clearcoat : 0.0;
    if (front && place < opaque) {
        found.direction = square_to_cosine_hemisphere(u);
    } else {
        bool coat = place < before;
        vec3 m = coat ? sample_coat(u, surface.specular_weight) : sample_facet(wi, u, principled_alpha(surface), true);
        float ci = dot(wi, m), cos_t;
        float f = fresnel_dielectric(ci, surface.eta, cos_t);
        // A facet that is seen from behind is none.
        if (ci * wi.z <= 0.0) {
            return none;
        }
        bool bends = HAS_DIELECTRIC && !coat && place - before < (front ? clear : 1.0) * (1.0 - f);
        found.direction = bends ? refract_at(wi, m, cos_t, surface.eta) : 2.0 * ci * m - wi;
        found.eta = bends ? (front ? surface.eta : 1.0 / surface.eta) : 1.0;
        if (found.direction.z * wi.z == 0.0 || (found.direction.z * wi.z > 0.0) == bends) {
            return none;
        }
    }
    return weighted_sample(found, eval_principled(surface, wi, found.direction));
}
