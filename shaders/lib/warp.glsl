// From the unit square to directions. Each sampler has its density beside it; cosines are relative to +z.
#include "lib/constants.glsl"

// A unit vector from its z, the distance sin from the axis, and a number in [0, 1) for the azimuth.
vec3 from_polar(float z, float sin_theta, float u) {
    float phi = 2.0 * PI * u;
    return vec3(sin_theta * cos(phi), sin_theta * sin(phi), z);
}

// Uniform over the sphere of directions.
vec3 square_to_sphere(vec2 u) {
    float z = 2.0 * u.x - 1.0;
    return from_polar(z, 2.0 * sqrt(u.x * (1.0 - u.x)), u.y);
}

float square_to_sphere_pdf() {
    return INV_4PI;
}

// Density proportional to the cosine, over z > 0.
vec3 square_to_cosine_hemisphere(vec2 u) {
    return from_polar(sqrt(1.0 - u.x), sqrt(u.x), u.y);
}

float square_to_cosine_hemisphere_pdf(float cos_theta) {
    return max(cos_theta, 0.0) * INV_PI;
}

// Uniform over the cone of directions with 1 - cos <= one_minus_cos_max.
vec3 square_to_cone(vec2 u, float one_minus_cos_max) {
    float m = u.x * one_minus_cos_max;
    return from_polar(1.0 - m, sqrt(m * (2.0 - m)), u.y);
}

float square_to_cone_pdf(float one_minus_cos_max) {
    return 1.0 / (2.0 * PI * one_minus_cos_max);
}
