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
    uint line = min(whole(scaled), count - 1u);
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

// Coordinates along the two edges of a uniform point of a triangle or parallelogram.
vec2 plane_light_point(Light light, vec2 u) {
    float s = sqrt(u.x);
    return light.kind == LIGHT_TRIANGLE ? vec2(1.0 - s, u.y * s) : u;
}

// What arrives from the point of a plane light with the coordinates v along its edges, sampled uniformly by the solid angle of the
// whole light, or by area if that is 0.
LightSample from_plane_light(Light light, vec3 point, vec2 v, float solid_angle) {
    vec3 offset = light.origin + light.edge_1 * v.x + light.edge_2 * v.y - point;
    float squared = dot(offset, offset);
    LightSample result;
    result.distance = sqrt(squared);
    result.direction = offset / result.distance;
    float cos_light = -dot(result.direction, light.normal);
    bool seen = cos_light > 0.0 && squared > 0.0;
    bool by_area = solid_angle == 0.0;
    result.pdf = seen ? (by_area ? squared / (light.area * cos_light) : 1.0 / solid_angle) : 0.0;
    result.weight = seen ? light.radiance * (by_area ? light.area * cos_light / squared : solid_angle) : vec3(0.0);
    return result;
}

LightSample sample_plane_light(Light light, vec3 point, vec2 u) {
    return from_plane_light(light, point, plane_light_point(light, u), 0.0);
}

// A rectangle as a point sees it, in units of its first edge: it spans [low, high] in a plane at the height h above the point, along
// axes that are parallel to its edges and begin below the point.
struct SphericalRectangle {
    vec2 low;
    vec2 high;
    float h;
    float solid_angle;  // 0 if the rectangle is to be sampled by area
};

// Below this solid angle, uniform points are as good.
const float LEAST_SOLID_ANGLE = 2e-4;
// Square of the sine under which the nearest point of the rectangle is seen above its plane; below, the distances along the plane
// cannot be told from sines that are next to 1.
const float LEAST_SIN_SQUARED = 2e-3;

// The solid angles A and B of the two triangles that make up the rectangle: tan(A/2) = N/D, where N is the determinant of the
// corners (van Oosterom and Strackee 1983), here the height times the area for both, so that nothing cancels however small the
// rectangle is. (A + B)/2 is the angle of the product of both complex numbers D + iN.
SphericalRectangle spherical_rectangle(Light light, vec3 point) {
    vec3 offset = light.origin - point;
    float unit = 1.0 / dot(light.edge_1, light.edge_1);
    float height = light.area * unit;
    SphericalRectangle r;
    r.low = vec2(dot(offset, light.edge_1) * unit, dot(offset, light.edge_2) / light.area);
    r.high = r.low + vec2(1.0, height);
    r.h = -dot(offset, light.normal) * sqrt(unit);
    r.solid_angle = 0.0;
    float h2 = r.h * r.h;
    vec2 near = max(max(r.low, -r.high), 0.0);
    float nearest = dot(near, near) + h2;
    if (r.h > 0.0 && h2 > LEAST_SIN_SQUARED * nearest && height > LEAST_SOLID_ANGLE * nearest) {
        vec2 low2 = r.low * r.low, high2 = r.high * r.high, mixed = r.low * r.high;
        float r00 = sqrt(low2.x + low2.y + h2), r10 = sqrt(high2.x + low2.y + h2);
        float r01 = sqrt(low2.x + high2.y + h2), r11 = sqrt(high2.x + high2.y + h2);
        float diagonal = mixed.x + mixed.y + h2;
        float n = r.h * height;
        float d1 = r11 * (r00 * r10 + mixed.x + low2.y + h2) + diagonal * r10 + (high2.x + mixed.y + h2) * r00;
        float d2 = r11 * (r00 * r01 + low2.x + mixed.y + h2) + diagonal * r01 + (mixed.x + high2.y + h2) * r00;
        // The sum of both halves is at most pi, also where rounding says otherwise.
        float solid_angle = 2.0 * arctan2(max(n * (d1 + d2), 0.0), d1 * d2 - n * n);
        r.solid_angle = solid_angle >= LEAST_SOLID_ANGLE ? solid_angle : 0.0;
    }
    return r;
}

// high sqrt(low^2 + d2) - low sqrt(high^2 + d2) of an interval, given the two roots, without cancellation.
float root_difference(float low, float high, float d2, float root_low, float root_high) {
    float p = high * root_low, q = low * root_high;
    return p * q > 0.0 ? (high - low) * (high + low) * d2 / (p + q) : p - q;
}

// The point of a rectangle, in coordinates along its edges from 0 to 1, that is uniform by solid angle (Ureña, Fajardo and King 2013).
// With the sine s of the angle about the second axis, x = h s/sqrt(1 - s^2), and b = y/sqrt(y^2 + h^2) of both ends in y, the part of
// the rectangle below x has the solid angle asin(s b_high) - asin(s b_low) up to a constant. A triangle with two of its angles
// and this difference a gives s = sin a/sqrt(b_high^2 + b_low^2 - 2 b_high b_low cos a). Then y/sqrt(x^2 + y^2 + h^2) is uniform.
vec2 sample_spherical_rectangle(SphericalRectangle r, vec2 u) {
    float h2 = r.h * r.h, low2 = r.low.y * r.low.y, high2 = r.high.y * r.high.y;
    float edge2 = r.low.x * r.low.x + h2;
    float corner_low = sqrt(low2 + edge2), corner_high = sqrt(high2 + edge2);
    float edge_y = r.low.x * r.h * root_difference(r.low.y, r.high.y, edge2, corner_low, corner_high);
    float edge_x = h2 * corner_low * corner_high + r.low.x * r.low.x * r.low.y * r.high.y;
    float half_a = 0.5 * (arctan2(edge_y, edge_x) + u.x * r.solid_angle);
    float sin_half = sine(half_a), cos_half = sqrt(max(1.0 - sin_half * sin_half, 1e-12));

    // Times the roots under both b. Of the two forms of the square root, the one whose terms have the same sign.
    float root_low = sqrt(low2 + h2), root_high = sqrt(high2 + h2);
    float difference = root_difference(r.low.y, r.high.y, h2, root_low, root_high);
    float p = r.high.y * root_low, q = r.low.y * root_high;
    float squared = p * q > 0.0 ? difference * difference + 4.0 * p * q * sin_half * sin_half
                                : (p + q) * (p + q) - 4.0 * p * q * cos_half * cos_half;
    float s = 2.0 * sin_half * cos_half * root_low * root_high / sqrt(squared);
    float x = clamp(r.h * s / sqrt(max((1.0 - s) * (1.0 + s), 1e-12)), r.low.x, r.high.x);

    float d2 = x * x + h2;
    root_low = sqrt(low2 + d2);
    root_high = sqrt(high2 + d2);
    float w_low = r.low.y / root_low;
    float w = w_low + u.y * root_difference(r.low.y, r.high.y, d2, root_low, root_high) / (root_low * root_high);
    float y = clamp(w * sqrt(d2 / max((1.0 - w) * (1.0 + w), 1e-12)), r.low.y, r.high.y);
    return vec2(x - r.low.x, (y - r.low.y) / (r.high.y - r.low.y));
}

LightSample sample_rectangle_light(Light light, vec3 point, vec2 u) {
    SphericalRectangle r = spherical_rectangle(light, point);
    vec2 v = r.solid_angle > 0.0 ? sample_spherical_rectangle(r, u) : u;
    return from_plane_light(light, point, v, r.solid_angle);
}

// Density per solid angle of that, where the rectangle is met at a distance under the cosine at it.
float rectangle_light_pdf(Light light, vec3 point, float distance, float cos_light) {
    float solid_angle = spherical_rectangle(light, point).solid_angle;
    return solid_angle > 0.0 ? 1.0 / solid_angle : area_pdf(light.area, distance, cos_light);
}

// What a plane light sends to a point from exactly this direction.
LightSample plane_light_in(Light light, vec3 point, vec3 direction) {
    vec3 across = cross(light.edge_1, light.edge_2);
    float cos_light = -dot(direction, light.normal);
    float distance = dot(point - light.origin, light.normal) / cos_light;
    vec3 offset = point + direction * distance - light.origin;
    vec2 v = vec2(dot(cross(offset, light.edge_2), across), dot(cross(light.edge_1, offset), across)) / dot(across, across);
    bool within = light.kind == LIGHT_TRIANGLE ? v.x + v.y <= 1.0 : max(v.x, v.y) <= 1.0;
    bool seen = cos_light > 0.0 && distance > 0.0 && min(v.x, v.y) >= 0.0 && within;
    return LightSample(direction, seen ? distance : 0.0, seen ? light.radiance : vec3(0.0), 1.0);
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

// What a sphere sends to a point from exactly this direction.
LightSample sphere_light_in(Light light, vec3 point, vec3 direction) {
    vec3 to_center = light.origin - point;
    float radius = light.edge_1.x, along = dot(to_center, direction);
    vec3 closest = to_center - along * direction;
    float squared = radius * radius - dot(closest, closest);
    bool inside = dot(to_center, to_center) < radius * radius, inwards = light.edge_1.y < 0.0;
    bool seen = squared > 0.0 && inside == inwards && (inside || along > 0.0);
    float half_chord = sqrt(max(squared, 0.0));
    return LightSample(direction, seen ? max(inside ? along + half_chord : along - half_chord, 0.0) : 0.0, seen ? light.radiance : vec3(0.0), 1.0);
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
