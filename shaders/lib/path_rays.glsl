// What a path's rays take from the primitives they meet: the nearest one, or, for shadow rays, everything in any order.
#include "lib/path_state.glsl"
#include "lib/path_flight.glsl"
#include "lib/path_surface.glsl"
#include "lib/ray.glsl"

// The length L of a shadow ray in its optical depth sigma_0 L + sum (sigma_to - sigma_from) (L - t_i), in which the order of the
// crossings does not matter. Where an infinite ray ends in vacuum, sigma_0 and the steps add up to 0 and any L serves.
float shadow_length(Path path) {
    return path.t_max >= INFINITE_DISTANCE ? 0.0 : path.t_max;
}

// An infinite ray that ends in a medium brings no light.
vec3 depth_at_infinity(Path path) {
    return path.t_max >= INFINITE_DISTANCE ? mix(vec3(0.0), vec3(INFINITE_DISTANCE), greaterThan(params.world_sigma_t, vec3(0.0))) : vec3(0.0);
}

// The state of a traversal before its first step.
Hit begin_hit(Path path) {
    // Extension rays see a little beyond their flight: see flight_point().
    float t_max = HAS_MEDIA && !path.shadow ? path.t_max + near_distance(path, path.t_max) : path.t_max;
    Hit hit = Hit(t_max, NONE, false, vec2(0.0), 0.0, vec3(0.0), false, INFINITE_DISTANCE, 0u, 1.0);
    if (HAS_MEDIA && HAS_LIGHT_SAMPLING && path.shadow) {
        uint medium = HAS_DIELECTRIC ? path.light_medium : path.medium;
        vec3 tau = MEDIUM(valid_medium(medium)).sigma_t * shadow_length(path) + depth_at_infinity(path);
        hit.medium = medium;
        hit.tau = tau.x;
        hit.tau_rgb = tau;
    }
    return hit;
}

// Takes one crossing with a primitive into account.
void record(Path path, uint index, Primitive primitive, float t, bool along_normal, vec2 barycentric, inout Hit hit) {
    // Distances first, the primitive's index among equals: surfaces that coincide are met one after the other, none twice.
    bool begins = t > path.t_min || (t == path.t_min && index > path.last && path.last != NONE);
    // On a long, thin triangle rounding may find a distance above 0 for the triangle itself.
    begins = begins && index != path.left;
    if (HAS_GRIDS && HAS_LIGHT_SAMPLING && path.shadow) {
        // In order: what lies between boundaries is not known before.
        bool counts = begins && t < path.t_max && primitive.light != path.light + 1u;
        bool passes = HAS_BOUNDARIES && (primitive.surface & PRIMITIVE_BOUNDARY) != 0u;
        if (HAS_MASK && counts && !passes) {
            Surface surface = SURFACE(primitive.surface & ~(PRIMITIVE_BOUNDARY | PRIMITIVE_SPHERE));
            passes = (surface.flags & SURFACE_MASK) != 0u && opacity_at(surface, primitive, index, path.origin + path.direction * t, barycentric, path.direction) < 1.0;
        }
        hit.blocked = hit.blocked || (counts && !passes);
        if (counts && passes && (t < hit.t || (t == hit.t && index < hit.primitive && hit.primitive != NONE))) {
            hit.t = t;
            hit.primitive = index;
            hit.along_normal = along_normal;
            hit.barycentric = barycentric;
        }
    } else if (HAS_LIGHT_SAMPLING && path.shadow) {
        bool boundary = HAS_BOUNDARIES && (primitive.surface & PRIMITIVE_BOUNDARY) != 0u;
        bool counts = begins && t < path.t_max;
        // The light itself is not in the way of its light.
        bool opaque = counts && !boundary && primitive.light != path.light + 1u;
        if (HAS_MASK && opaque) {
            Surface surface = SURFACE(primitive.surface & ~(PRIMITIVE_BOUNDARY | PRIMITIVE_SPHERE));
            if ((surface.flags & SURFACE_MASK) != 0u) {
                float opacity = opacity_at(surface, primitive, index, path.origin + path.direction * t, barycentric, path.direction);
                hit.passed *= 1.0 - opacity;
                if (HAS_TINTS && (surface.flags & SURFACE_PANE) != 0u) {
                    hit.tau_rgb += pane_depth(surface, primitive, index, path.origin + path.direction * t, barycentric);
                }
                opaque = opacity >= 1.0;
                boundary = true;
            }
        }
        if ((HAS_BOUNDARIES || HAS_MASK) && HAS_MEDIA) {
            float way = (shadow_length(path) - t) * (along_normal ? -1.0 : 1.0);
            hit.tau += counts && boundary ? primitive.sigma_t_step * way : 0.0;
            if (HAS_CHROMATIC && counts && boundary) {
                hit.tau_rgb += SURFACE(primitive.surface & ~(PRIMITIVE_BOUNDARY | PRIMITIVE_SPHERE)).sigma_t_step * way;
            }
        }
        if (HAS_SHARING && HAS_EQUIANGULAR) {
            hit.first = counts && boundary ? min(hit.first, t) : hit.first;
        }
        hit.blocked = hit.blocked || opaque;
        if (HAS_VOLUME_LIGHTS && counts && boundary) {
            // In any order: the differences of indices add up.
            uint media = SURFACE(primitive.surface & ~(PRIMITIVE_BOUNDARY | PRIMITIVE_SPHERE)).media;
            uint inside = media & 0xffffu, outside = media >> 16u;
            hit.medium += along_normal ? outside - inside : inside - outside;
        }
    } else if (begins && (t < hit.t || (t == hit.t && index < hit.primitive && hit.primitive != NONE))) {
        hit.t = t;
        hit.primitive = index;
        hit.along_normal = along_normal;
        hit.barycentric = barycentric;
    }
}

// Tests one primitive.
void test_primitive(Path path, Ray ray, uint index, Primitive primitive, inout Hit hit) {
    if (HAS_SPHERES && (primitive.surface & PRIMITIVE_SPHERE) != 0u) {
        vec2 t = intersect_sphere(ray, primitive.a, primitive.b.x);
        // A ray that touches the sphere in one point does not cross it: two crossings at one distance would count as one.
        if (t.x < t.y) {
            bool outwards = primitive.b.y > 0.0;
            record(path, index, primitive, t.x, !outwards, vec2(0.0), hit);
            record(path, index, primitive, t.y, outwards, vec2(0.0), hit);
        }
    } else {
        TriangleHit found = intersect_triangle(ray, primitive.a, primitive.b, primitive.c);
        if (found.hit) {
            record(path, index, primitive, found.t, found.along_normal, found.barycentric, hit);
        }
    }
}

// Tests a triangle that stands in the kernel as constants: from the edge functions opposite to its corners, and from how far its corners
// lie along the ray, which are intersect_triangle()'s own. `doubt` is set where an edge passes exactly through the ray.
void test_projected(Path path, uint index, Primitive primitive, vec3 edges, vec3 along, inout Hit hit, inout bool doubt) {
    float least = min(edges.x, min(edges.y, edges.z)), most = max_component(edges);
    doubt = doubt || least == 0.0 || most == 0.0;
    if (least > 0.0 || most < 0.0) {
        float inverse = 1.0 / (edges.x + edges.y + edges.z);
        record(path, index, primitive, dot(edges, along) * inverse, least > 0.0, edges.yz * inverse, hit);
    }
}
#include "lib/immediates.glsl"
