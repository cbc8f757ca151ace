// Normals of the facets that make up a rough surface, of Beckmann (1963) or GGX (Walter et al. 2007). Directions are in the local frame of
// the surface, z along its normal; alpha is the roughness along x and y.
#include "lib/constants.glsl"
#include "lib/math.glsl"
#include "lib/warp.glsl"

// Of Beckmann's slopes, in units of the roughness, exp(-25) are larger.
const float MAX_SLOPE = 5.0;
// Rounding moves a slope by less than this.
const float SLOPE_ERROR = 1e-5;

// Density of normals, [1/sr], with z > 0, in the anisotropic form (Heitz 2014, equations 79 and 85).
float facet_density(vec3 m, vec2 alpha, bool ggx) {
    if (m.z <= 0.0) {
        return 0.0;
    }
    vec2 stretched = m.xy / alpha;
    float c2 = m.z * m.z, s2 = dot(stretched, stretched);
    if (ggx) {
        float d = c2 + s2;
        return 1.0 / (PI * alpha.x * alpha.y * d * d);
    }
    // Where c2 is too small for single precision, the exponential is 0.
    float shape = exp_minus(s2 / c2);
    return shape > 0.0 ? shape / (PI * alpha.x * alpha.y * c2 * c2) : 0.0;
}

// What a direction of cosine c and sine q to the normal sees of Beckmann's facets with roughness 1. Their slopes towards it have the density
// exp(-s^2) (c + q s) as far as that is positive.
struct SeenSlopes {
    float c;
    float q;
    float least;  // slope
    float rest;   // the area of all of them is 2 c + rest
};

SeenSlopes seen_slopes(float c, float q) {
    float least = c < MAX_SLOPE * q ? c / q : MAX_SLOPE;
    float turned_away = q * INV_SQRT_PI - c * scaled_erfc(least);
    return SeenSlopes(c, q, -least, exp_minus(least * least) * max(turned_away, 0.0));
}

// The area of facets between the slope that u draws and s, negative if s is the smaller one; `shape` is exp(-s^2). The areas beyond s and before
// it are subtracted where they are small.
float slope_excess(SeenSlopes seen, float s, float shape, float u) {
    float upright = seen.c * scaled_erfc(abs(s)), leaning = seen.q * INV_SQRT_PI, area = 2.0 * seen.c + seen.rest;
    return s < 0.0 ? seen.rest + shape * (upright - leaning) - u * area : (1.0 - u) * area - shape * (upright + leaning);
}

// A slope by inversion of its distribution: Halley's method from between the logistic and Rayleigh's distribution, with bisection where it
// goes astray. Slopes rise with u.
float sample_slope(SeenSlopes seen, float u) {
    float beyond = minus_log_1m(u), odds = beyond - minus_log(max(u, 3e-8));
    float s = mix(odds * (0.443 - 0.00066 * odds * odds), sqrt(beyond), seen.q / (seen.q + seen.c));
    float low = seen.least, high = MAX_SLOPE;
    s = clamp(s, low, high);
    [[dont_unroll]] for (uint step = 0u; step < 16u; ++step) {
        float shape = exp_minus(s * s), excess = slope_excess(seen, s, shape, u);
        low = excess < 0.0 ? s : low;
        high = excess < 0.0 ? high : s;
        float facing = max(seen.c + seen.q * s, 1e-6);
        float newton = -excess / (2.0 * INV_SQRT_PI * facing * shape);
        float next = s + newton / clamp(1.0 + newton * (0.5 * seen.q / facing - s), 0.3, 4.0);
        next = next > low - SLOPE_ERROR && next < high + SLOPE_ERROR ? next : 0.5 * (low + high);
        float moved = abs(next - s);
        s = next;
        // The error is then about the cube of this.
        if (moved < 3e-4) {
            break;
        }
    }
    return s;
}

// Smith's masking of direction v for facets with normal m: of the area of facets that lean towards v, the share that is seen.
float facet_masking(vec3 v, vec3 m, vec2 alpha, bool ggx) {
    if (dot(v, m) * v.z <= 0.0) {
        return 0.0;
    }
    vec2 stretched = v.xy * alpha;
    float q2 = dot(stretched, stretched);
    if (ggx) {
        return 2.0 / (1.0 + sqrt(1.0 + q2 / (v.z * v.z)));
    }
    SeenSlopes seen = seen_slopes(abs(v.z), sqrt(q2));
    return 2.0 * seen.c / (2.0 * seen.c + seen.rest);
}

// The normal of a facet that w sees (Heitz and d'Eon 2014). Of GGX: on the sphere to which the roughness stretches facets (Dupuy and Benyoub
// 2023). Of Beckmann: by the slopes along w and across it.
vec3 sample_facet(vec3 w, vec2 u, vec2 alpha, bool ggx) {
    vec3 v = normalize(vec3(alpha * w.xy, w.z));
    v = w.z < 0.0 ? -v : v;
    if (!ggx) {
        float q = length(v.xy);
        vec2 along = q > 0.0 ? v.xy / q : vec2(1.0, 0.0);
        float slope = sample_slope(seen_slopes(v.z, q), u.x), across = sample_slope(seen_slopes(1.0, 0.0), u.y);
        return normalize(vec3(alpha * (along * slope + vec2(-along.y, along.x) * across), 1.0));
    }
    // A point of the cap z > -v.z of the unit sphere, uniformly; 1 - z is `down` and 1 + z is `up`, neither with cancellation. The
    // normal is half way to v.
    float height = 1.0 + v.z;
    float down = u.x * height, up = (1.0 - u.x) * height + dot(v.xy, v.xy) / height;
    vec3 cap = from_polar(1.0 - down, sqrt(down * up), u.y);
    return normalize(vec3(alpha * (cap.xy + v.xy), height * (1.0 - u.x)));
}

// Density of sample_facet, [1/sr]: D G1(w) |w.m| / |w.z| (Heitz 2014, equation 15).
float facet_pdf(vec3 w, vec3 m, vec2 alpha, bool ggx) {
    return facet_density(m, alpha, ggx) * facet_masking(w, m, alpha, ggx) * abs(dot(w, m) / w.z);
}
