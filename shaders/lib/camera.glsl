// The pinhole camera.

// Unnormalised direction through a point of the film (0..1 from the left, 0..1 from the top); its component along the
// optical axis is 1, so its length times the depth of a plane is the distance to that plane along the ray.
vec3 camera_direction(vec3 corner, vec3 right, vec3 down, vec2 film) {
    return corner + right * film.x + down * film.y;
}
