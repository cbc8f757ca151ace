// The camera: a pinhole, a thin lens, or a rectangle from which all rays go in one direction.
#include "lib/constants.glsl"

// Unnormalised direction through a point of the film (0..1 from the left, 0..1 from the top); its component along the
// optical axis is 1, so its length times the depth of a plane is the distance to that plane along the ray. Of an orthographic
// camera, a place instead.
vec3 camera_direction(vec3 corner, vec3 right, vec3 down, vec2 film) {
    return corner + right * film.x + down * film.y;
}

// A point of the lens relative to its centre, uniform over the disk that the two axes span.
vec3 lens_point(vec3 lens_u, vec3 lens_v, vec2 u) {
    float radius = sqrt(u.x), angle = 2.0 * PI * u.y;
    return lens_u * (radius * cos(angle)) + lens_v * (radius * sin(angle));
}

// From a point of the lens, the direction to where the ray through its centre meets the plane in focus; its component along the
// optical axis is 1 again.
vec3 focused_direction(vec3 direction, vec3 point, float inverse_focus) {
    return direction - point * inverse_focus;
}
