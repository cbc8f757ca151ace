// Distances along a ray at which a light near the ray is seen under angles that are equally likely (Kulla and Fajardo 2012): the
// density falls with the squared distance to the light, as its irradiance does.
#include "lib/math.glsl"

// A stretch of a ray, seen from a point. `s` is the distance from the beginning of the stretch.
struct Stretch {
    float distance;  // from the point to the line of the ray; at least MIN_EQUIANGULAR_DISTANCE
    float begin;     // from the foot of the point to the beginning of the stretch, signed
    float extent;
    float angle;     // under which the point sees the stretch
};

// Points closer to the ray than this are treated as if they were this far, so that the density stays finite.
const float MIN_EQUIANGULAR_DISTANCE = 1e-5;
// Longer stretches, up to infinite ones, are sampled on this first part of them only.
const float MAX_EQUIANGULAR_LENGTH = 1e3;

Stretch stretch_seen_from(vec3 point, vec3 origin, vec3 direction, float t_begin, float t_end) {
    vec3 offset = origin + direction * t_begin - point;
    Stretch stretch;
    stretch.begin = dot(offset, direction);
    stretch.distance = max(length(offset - direction * stretch.begin), MIN_EQUIANGULAR_DISTANCE);
    stretch.extent = min(t_end - t_begin, MAX_EQUIANGULAR_LENGTH);
    // tan(b - a) = (tan b - tan a) / (1 + tan a tan b): no difference of angles.
    float d = stretch.distance;
    stretch.angle = arctan2(d * stretch.extent, d * d + stretch.begin * (stretch.begin + stretch.extent));
    return stretch;
}

// s in [0, extent] for u in [0, 1).
float sample_equiangular(Stretch stretch, float u) {
    float theta = u * stretch.angle;
    float slope = stretch.begin / stretch.distance;
    float rest = cos(theta) - slope * sin(theta);
    // distance * tan(a + theta) - begin, without the difference.
    float s = stretch.distance * sin(theta) * (1.0 + slope * slope) / rest;
    return rest > 0.0 ? min(s, stretch.extent) : stretch.extent;
}

// Density of s per length.
float equiangular_pdf(Stretch stretch, float s) {
    float along = stretch.begin + s;
    bool inside = s >= 0.0 && s <= stretch.extent && stretch.angle > 0.0;
    return inside ? stretch.distance / (stretch.angle * (stretch.distance * stretch.distance + along * along)) : 0.0;
}

// Probability of a distance beyond s.
float equiangular_rest(Stretch stretch, float s) {
    float left = stretch.extent - s, d = stretch.distance;
    float angle = arctan2(d * left, d * d + (stretch.begin + s) * (stretch.begin + stretch.extent));
    return left > 0.0 && stretch.angle > 0.0 ? angle / stretch.angle : 0.0;
}
