// Lights: what they send to a point, and the density with which they are sampled.
#include "lib/constants.glsl"
#include "lib/warp.glsl"
#include "lib/math.glsl"

// A direction from a point to a light.
struct LightSample {
    vec3 direction;  // unit
    float distance;  // to the sampled point
    vec3 weight;     // radiance / density per solid angle; of a point: intensity / distance^2; of parallel light: irradiance; 0 if nothing arrives
    float pdf;       // per solid angle, without the choice of the light; 0 for a point, a spot and parallel light, which no other technique finds
};

// One line of the alias table (Walker 1977): `u` in [0, 1) is split into a choice and a number that is uniform again.
uint alias_line(uint count, inout float u) {
    float scaled = u * float(count);
    uint line = min(uint(scaled), count - 1u);
    u = min(scaled - float(line), 0.99999994);
    return line;
}

bool alias_keeps(float threshold, inout float u) {
    bool keeps = u < threshold;
    u = keeps ? u / threshold : (u - threshold) / (1.0 - threshold);
    u = min(u, 0.99999994);
    return keeps;
}

// Density per solid angle of a uniform point on a plane figure, seen at a distance under the cosine at the figure.
float area_pdf(float area, float distance, float cos_light) {
    return distance * distance / (area * cos_light);
}

// Whether a light is at some place, not infinitely far.
bool is_local(Light light) {
    uint kind = light.kind & 0xffu;
    return kind != LIGHT_CONSTANT && kind != LIGHT_DIRECTIONAL && kind != LIGHT_ENVMAP;
}

// Coordinates along the two edges of a uniform point of a triangle or parallelogram.
vec2 plane_light_point(Light light, vec2 u) {
    float s = sqrt(u.x);
    return light.kind == LIGHT_TRIANGLE ? vec2(1.0 - s, u.y * s) : u;
}

LightSample sample_plane_light(Light light, vec3 point, vec2 u) {
    vec2 v = plane_light_point(light, u);
    vec3 offset = light.origin + light.edge_1 * v.x + light.edge_2 * v.y - point;
    float squared = dot(offset, offset);
    LightSample result;
    result.distance = sqrt(squared);
    result.direction = offset / result.distance;
    float cos_light = -dot(result.direction, light.normal);
    bool seen = cos_light > 0.0 && squared > 0.0;
    result.pdf = seen ? squared / (light.area * cos_light) : 0.0;
    result.weight = seen ? light.radiance * (light.area * cos_light / squared) : vec3(0.0);
    return result;
}

// 1 - cos of half the angle under which a sphere is seen from outside, without cancellation.
float sphere_one_minus_cos(float radius, float center_distance) {
    float sin_squared = min(radius * radius / (center_distance * center_distance), 1.0);
    return sin_squared / (1.0 + sqrt(1.0 - sin_squared));
}

// The outside of a sphere from outside, uniformly over its cone; the inside of a sphere with normals inwards from inside,
// uniformly over all directions.
LightSample sample_sphere_light(Light light, vec3 point, vec2 u) {
    vec3 to_center = light.origin - point;
    float radius = light.edge_1.x;
    float center_distance = length(to_center);
    bool inwards = light.edge_1.y < 0.0;
    bool inside = center_distance < radius;
    LightSample result = LightSample(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0);
    if (inside != inwards) {
        return result;
    }
    if (inside) {
        result.direction = square_to_sphere(u);
        result.pdf = square_to_sphere_pdf();
    } else {
        float one_minus_cos = sphere_one_minus_cos(radius, center_distance);
        result.direction = from_frame(to_center / center_distance, square_to_cone(u, one_minus_cos));
        result.pdf = square_to_cone_pdf(one_minus_cos);
    }
    float along = dot(to_center, result.direction);
    vec3 closest = to_center - along * result.direction;
    float half_chord = sqrt(max(radius * radius - dot(closest, closest), 0.0));
    // From a point of the sphere itself, rounding may find it behind.
    result.distance = max(inside ? along + half_chord : along - half_chord, 0.0);
    result.weight = light.radiance / result.pdf;
    return result;
}

float sphere_light_pdf(float radius, float center_distance) {
    return center_distance < radius ? square_to_sphere_pdf() : square_to_cone_pdf(sphere_one_minus_cos(radius, center_distance));
}

// A point in the sphere about an emitting medium, from outside: its direction uniform over the cone, its distance over the chord.
// The weight is the emission per length times the chord over the density of the direction. Nothing from inside, where flights
// find the emission well.
LightSample sample_volume_light(Light light, vec3 point, vec2 u, float u_distance) {
    vec3 to_center = light.origin - point;
    float radius = light.edge_1.x, center_distance = length(to_center);
    if (center_distance <= radius) {
        return LightSample(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0);
    }
    float one_minus_cos = sphere_one_minus_cos(radius, center_distance);
    vec3 direction = from_frame(to_center / center_distance, square_to_cone(u, one_minus_cos));
    float pdf = square_to_cone_pdf(one_minus_cos);
    float along = dot(to_center, direction);
    vec3 closest = to_center - along * direction;
    float half_chord = sqrt(max(radius * radius - dot(closest, closest), 0.0));
    float distance = max(along + half_chord * (2.0 * u_distance - 1.0), 0.0);
    return LightSample(direction, distance, light.radiance * (2.0 * half_chord / pdf), pdf);
}

// Density per solid angle with which directions to that sphere are sampled: 0 from inside and past it.
float volume_light_pdf(Light light, vec3 point, vec3 direction) {
    vec3 to_center = light.origin - point;
    float radius = light.edge_1.x, center_distance = length(to_center);
    float along = dot(to_center, direction);
    vec3 closest = to_center - along * direction;
    bool met = center_distance > radius && along > 0.0 && dot(closest, closest) <= radius * radius;
    return met ? square_to_cone_pdf(sphere_one_minus_cos(radius, center_distance)) : 0.0;
}

LightSample sample_point_light(Light light, vec3 point) {
    vec3 offset = light.origin - point;
    float squared = dot(offset, offset);
    float distance = sqrt(squared);
    return squared > 0.0 ? LightSample(offset / distance, distance, light.radiance / squared, 0.0)
                         : LightSample(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0);
}

// Share of its intensity that a spot sends at an angle from its axis: all of it within the beam, then less by a straight line down
// to nothing at the cutoff.
float spot_falloff(Light light, float angle) {
    float cutoff = light.edge_1.x, beam = light.edge_1.y;
    return angle <= beam ? 1.0 : max(cutoff - angle, 0.0) * light.edge_1.z;
}

LightSample sample_spot_light(Light light, vec3 point) {
    LightSample result = sample_point_light(light, point);
    // The angle between unit vectors a and b is 2 atan2(|a - b|, |a + b|), without cancellation (Kahan 2006, section 12).
    vec3 away = -result.direction;
    result.weight *= spot_falloff(light, 2.0 * arctan2(length(away - light.normal), length(away + light.normal)));
    return result;
}

// The one direction from which parallel light comes; the weight is the irradiance.
LightSample sample_directional_light(Light light) {
    return LightSample(-light.normal, INFINITE_DISTANCE, light.radiance, 0.0);
}
