// Elementary functions with the accuracy that drivers do not promise, and orthonormal frames.
#include "lib/constants.glsl"

// -log(1 - u) for u = k / 2^24 in [0, 1): the optical depth of a free flight. Relative error below 3e-7; drivers' log() loses
// all digits near 1. 1 - u is exact; it is split into m 2^e with m in [sqrt(1/2), sqrt(2)), and log m = 2 artanh((m - 1)/(m + 1)).
float minus_log_1m(float u) {
    float x = 1.0 - u;
    uint bits = floatBitsToUint(x);
    // The bits of sqrt(1/2) divide one binade of m from the next.
    int exponent = int(bits - 0x3f3504f3u) >> 23;
    float m = uintBitsToFloat(bits - (uint(exponent) << 23));
    float s = (m - 1.0) / (m + 1.0);
    float z = s * s;
    float log_m = 2.0 * s * (1.0 + z * (0.33333334 + z * (0.2 + z * (0.14285715 + z * 0.11111111))));
    return -(float(exponent) * 0.69314718 + log_m);
}

// exp(-x) for x >= 0 with a relative error below 2e-7 down to the smallest normal number; 0 beyond, and for infinite x.
// Range reduction by Cody and Waite (1980), then Taylor's polynomial on [-log(2)/2, log(2)/2].
float exp_minus(float x) {
    float k = floor(x * 1.44269504 + 0.5);
    float r = k * 0.693145752 - x + k * 1.42860677e-6;
    float p = 1.0 + r * (1.0 + r * (0.5 + r * (0.16666667 + r * (0.041666668 + r * (0.0083333338 + r * 0.0013888889)))));
    float scale = uintBitsToFloat(uint(127 - int(min(k, 126.0))) << 23);
    return x >= 87.0 ? 0.0 : p * scale;
}

vec3 exp_minus(vec3 x) {
    return vec3(exp_minus(x.x), exp_minus(x.y), exp_minus(x.z));
}

// The angle of the point (x, y), in [-pi, pi], with a relative error below 4e-7; 0 at the origin. The tangent is reduced to one below
// tan(pi/8), for which Cephes' (Moshier 1989) polynomial holds.
float atan2(float y, float x) {
    float low = min(abs(x), abs(y)), high = max(abs(x), abs(y));
    bool reduced = low > 0.41421357 * high;
    float t = reduced ? (low - high) / (low + high) : low / max(high, 1e-37);
    float z = t * t;
    float angle = t + t * z * (-0.33332949 + z * (0.19977711 + z * (-0.13877685 + z * 0.080537444)));
    angle = reduced ? 0.78539819 + angle : angle;
    angle = abs(y) > abs(x) ? 1.5707964 - angle : angle;
    angle = x < 0.0 ? 3.1415927 - angle : angle;
    return y < 0.0 ? -angle : angle;
}

// Two unit vectors that make up a right-handed frame with the unit vector n: tangent x bitangent = n (Duff et al. 2017).
void orthonormal_frame(vec3 n, out vec3 tangent, out vec3 bitangent) {
    float side = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (side + n.z);
    float b = n.x * n.y * a;
    tangent = vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x);
    bitangent = vec3(b, side + n.y * n.y * a, -n.y);
}

// A direction from its components in the frame about a unit vector.
vec3 from_frame(vec3 axis, vec3 local) {
    vec3 tangent, bitangent;
    orthonormal_frame(axis, tangent, bitangent);
    return normalize(tangent * local.x + bitangent * local.y + axis * local.z);
}

// The components of a direction in that frame.
vec3 to_frame(vec3 axis, vec3 direction) {
    vec3 tangent, bitangent;
    orthonormal_frame(axis, tangent, bitangent);
    return vec3(dot(tangent, direction), dot(bitangent, direction), dot(axis, direction));
}

// By bit pattern: compilers may assume that numbers are finite.
bool is_finite(vec3 v) {
    uvec3 exponent = floatBitsToUint(v) & 0x7f800000u;
    return all(notEqual(exponent, uvec3(0x7f800000u)));
}

float max_component(vec3 v) {
    return max(v.x, max(v.y, v.z));
}

float sum_components(vec3 v) {
    return v.x + v.y + v.z;
}
