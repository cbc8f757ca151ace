// Elementary functions with the accuracy that drivers do not promise, and orthonormal frames.
#include "lib/constants.glsl"

// The whole part of a number from 0 to below 2^31. lavapipe's compiler has an instruction for int(), but converts one invocation after the
// other for uint().
uint whole(float x) {
    return uint(int(x));
}

uvec2 whole(vec2 x) {
    return uvec2(ivec2(x));
}

uvec3 whole(vec3 x) {
    return uvec3(ivec3(x));
}

// -log(x) for x in (0, 1], normal. Relative error below 3e-7; drivers' log() loses all digits near 1. x is split into m 2^e with m in
// [sqrt(1/2), sqrt(2)), and log m = 2 artanh((m - 1)/(m + 1)).
float minus_log(float x) {
    uint bits = floatBitsToUint(x);
    // The bits of sqrt(1/2) divide one binade of m from the next.
    int exponent = int(bits - 0x3f3504f3u) >> 23;
    float m = uintBitsToFloat(bits - (uint(exponent) << 23));
    float s = (m - 1.0) / (m + 1.0);
    float z = s * s;
    float log_m = 2.0 * s * (1.0 + z * (0.33333334 + z * (0.2 + z * (0.14285715 + z * 0.11111111))));
    return -(float(exponent) * 0.69314718 + log_m);
}

// -log(1 - u) for u = k / 2^24 in [0, 1): the optical depth of a free flight. 1 - u is exact.
float minus_log_1m(float u) {
    return minus_log(1.0 - u);
}

// -log(1 - x) for any x in [0, 1 - 2^-24], also where 1 - x has lost digits of x: there Taylor's polynomial.
float minus_log_1m_small(float x) {
    float series = x * (1.0 + x * (0.5 + x * (0.33333334 + x * (0.25 + x * 0.2))));
    return x < 0.03 ? series : minus_log_1m(x);
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

// 1 - exp(-x) for x >= 0, with a relative error below 4e-7: Taylor's polynomial where the difference would cancel.
float one_minus_exp_minus(float x) {
    float tail = 0.0013888889 - x * (0.0001984127 - x * 0.0000248015873);
    float series = x * (1.0 - x * (0.5 - x * (0.16666667 - x * (0.041666668 - x * (0.0083333338 - x * tail)))));
    return x < 0.5 ? series : 1.0 - exp_minus(x);
}

vec3 one_minus_exp_minus(vec3 x) {
    return vec3(one_minus_exp_minus(x.x), one_minus_exp_minus(x.y), one_minus_exp_minus(x.z));
}

// exp(x^2) erfc(x) for x in [0, 5], with a relative error below 5e-7. The polynomial has the least relative error of its degree, 4e-8.
float scaled_erfc(float x) {
    float k = 1.0 / (1.0 + 0.35 * x);
    float low = 0.000955227519 + k * (0.183239685 + k * (0.288855855 + k * -0.144423284));
    return low + k * k * k * k * (0.887846256 + k * (-0.85872097 + k * (0.857258302 + k * -0.215011106)));
}

// The angle of the point (x, y) from the x axis, in [-pi, pi]; 0 at the origin. Relative error below 3e-7, also of angles next to
// 0; drivers promise 4096 units in the last place. The quotient of the smaller by the larger coordinate is moved by 45 degrees if it
// exceeds tan(22.5 degrees), by atan a = pi/4 + atan((a - 1)/(a + 1)); then comes a polynomial, interpolated at Chebyshev's points
// with an error of 3e-9.
float arctan2(float y, float x) {
    float least = min(abs(x), abs(y)), most = max(abs(x), abs(y));
    bool turned = least > 0.41421356 * most;
    float s = turned ? (least - most) / (least + most) : (most > 0.0 ? least / most : 0.0);
    float z = s * s;
    float tail = z * (-0.33333331 + z * (0.19999547 + z * (-0.14264116 + z * (0.10745036 + z * -0.064551845))));
    float angle = (turned ? 0.25 * PI : 0.0) + (s + s * tail);
    angle = abs(y) > abs(x) ? 0.5 * PI - angle : angle;
    angle = x < 0.0 ? PI - angle : angle;
    return y < 0.0 ? -angle : angle;
}

// The sine for |x| <= pi/2 with a relative error below 2e-7, also next to 0, where drivers promise an absolute error only. The
// polynomial has the least relative error of its degree, 5e-9.
float sine(float x) {
    float z = x * x;
    return x + x * (z * (-0.16666661 + z * (0.0083330879 + z * (-0.00019811113 + z * 2.6089326e-6))));
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
