// The way of a ray through boundaries, one after the other: of paths, and of shadow rays where what lies between boundaries is not known
// before they are met.
#include "lib/path_state.glsl"
#include "lib/path_flight.glsl"
#include "lib/path_surface.glsl"

// Goes straight on through a surface, at path.anchor.
void cross_surface(inout Path path, Surface surface, Hit hit) {
    uint inside = surface.media & 0xffffu, outside = surface.media >> 16u;
    bool again = path.last != NONE && hit.t - path.t_min < near_distance(path, hit.t);
    enter_medium(path, hit.along_normal ? inside : outside, hit.along_normal ? outside : inside, again);
    path.t_min = hit.t;
    path.last = hit.primitive;
    path.last_along_normal = hit.along_normal;
    path.tau_left = max(path.tau_left, 0.0);
    path.t_max = flight_end(path);
}

// Takes a shadow ray to the next boundary, or to its end; whether it has to go on from there. One of which nothing is left ends, unless the
// `whole` way is asked for.
bool advance_shadow(inout Path path, inout Hit hit, bool whole, DenseWay through) {
    bool reaches = hit.primitive == NONE;
    pass_medium(path, reaches ? path.t_max : hit.t, whole, through);
    if (!whole && max_component(path.light_passes) == 0.0) {
        hit.blocked = true;
        return false;
    }
    if (reaches) {
        hit.medium = path.medium;
        hit.passed = path.passed;
        return false;
    }
    Primitive primitive = PRIMITIVE(hit.primitive);
    Surface surface = SURFACE(primitive.surface & ~(PRIMITIVE_BOUNDARY | PRIMITIVE_SPHERE));
    if (HAS_MASK && (primitive.surface & PRIMITIVE_BOUNDARY) == 0u) {
        vec3 point = path.origin + path.direction * hit.t;
        path.passed *= 1.0 - opacity_at(surface, primitive, hit.primitive, point, hit.barycentric, path.direction);
        if (HAS_TINTS && (surface.flags & SURFACE_PANE) != 0u) {
            vec3 depth = pane_depth(surface, primitive, hit.primitive, point, hit.barycentric);
            path.tau_rgb += depth;
            path.tau_mean += depth;
        }
    }
    float t_max = path.t_max;
    cross_surface(path, surface, hit);
    path.t_max = t_max;
    return true;
}
