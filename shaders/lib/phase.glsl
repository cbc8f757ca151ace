// Phase functions, [1/sr]. cos is the dot product of the directions of propagation before and after scattering: +1 is straight
// on, and the mean cosine is g. This convention is stated here and nowhere else.
#include "lib/constants.glsl"

// 1 - cos and 1 + cos of a scattering angle, and its sine: each to full relative accuracy.
struct PhaseAngle {
    float one_minus_cos;
    float cos_theta;
    float sin_theta;
};

// Henyey and Greenstein (1941) from 1 - cos (mirrored for g < 0), which keeps its accuracy where |g| is near 1.
float henyey_greenstein_from(float g, float m) {
    float a = abs(g);
    float o = 1.0 - a;
    float d = o * o + 2.0 * a * m;
    return o * (1.0 + a) * INV_4PI / (d * sqrt(d));
}

// The phase function for unit directions before and after. Their difference keeps the accuracy that their dot product loses.
float eval_henyey_greenstein(float g, vec3 before, vec3 after) {
    vec3 difference = g >= 0.0 ? after - before : after + before;
    return henyey_greenstein_from(g, 0.5 * dot(difference, difference));
}

// The angle at which the distribution function reaches u in [0, 1). Every factor is non-negative, there is no cancellation
// and no branch but the sign of g, so the form holds for all |g| < 1 including 0. The density is eval_henyey_greenstein.
//   F(cos) = (1 - g^2)/(2 g) (1/sqrt(1 + g^2 - 2 g cos) - 1/(1 + g)), solved for cos, then factored.
PhaseAngle sample_henyey_greenstein(float g, float u) {
    float a = abs(g);
    float x = g >= 0.0 ? u : 1.0 - u;
    float o = 1.0 - a;
    float d = o + 2.0 * a * x;
    float q = o / d;
    float r = (1.0 + a) / d;
    float m = 2.0 * (1.0 - x) * (1.0 + a * x) * q * q;
    float p = 2.0 * x * (o + a * x) * r * r;
    float c = m < 1.0 ? 1.0 - m : p - 1.0;
    return PhaseAngle(m, g >= 0.0 ? c : -c, sqrt(m * p));
}
