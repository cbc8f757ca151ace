// Where a path scatters: in a medium or on a surface.
#include "lib/path_state.glsl"
#include "lib/path_surface.glsl"
#include "lib/warp.glsl"
#include "lib/ray.glsl"
#include "lib/phase.glsl"
#include "lib/bsdf.glsl"
#include "lib/principled.glsl"

// A point where light is scattered, in a medium or on a surface.
struct Vertex {
    vec3 point;
    vec3 axis;      // z of the surface's local frame; in a medium, the direction of propagation
    bool in_medium;
    float g;        // of the medium
    uint phase;     // of the medium: its mixture of phase functions, as in Medium; 0 is the one of g
    vec3 albedo;    // of the medium, with the weight of the flight
    Surface surface;
    vec3 incident;  // on a surface: towards where the path comes from, in the local frame
    vec3 tangent;   // on a surface, where roughness depends on the direction: x of the local frame
    vec3 normal;    // on a surface: the geometric normal, on the side of `axis`
    vec3 base;      // where normals are turned by maps: the normal before that
    float fade;     // there: squared roughness by which light fades where it grazes the surface, or 0
};

// The components of a direction in the local frame of a surface, and back.
vec3 to_surface_frame(vec3 tangent, vec3 axis, vec3 direction) {
    if (HAS_ANISOTROPIC) {
        return vec3(dot(tangent, direction), dot(cross(axis, tangent), direction), dot(axis, direction));
    }
    return to_frame(axis, direction);
}

vec3 from_surface_frame(vec3 tangent, vec3 axis, vec3 local) {
    if (HAS_ANISOTROPIC) {
        return normalize(tangent * local.x + cross(axis, tangent) * local.y + axis * local.z);
    }
    return from_frame(axis, local);
}

// Whether a direction lies on the same side of a surface and of its shading normal. One that does not would leak through the
// surface, so the BSDF knows no such directions.
bool sides_agree(Vertex vertex, float local_z, vec3 direction) {
    return !(HAS_SHADING_NORMALS || HAS_RELIEFS) || (local_z > 0.0) == (dot(vertex.normal, direction) > 0.0);
}

// What a surface does to light, whatever its kind.
BsdfValue eval_surface(Surface surface, vec3 wi, vec3 wo) {
    if (HAS_PRINCIPLED && bsdf_kind(surface) == BSDF_PRINCIPLED) {
        return eval_principled(surface, wi, wo);
    }
    return eval_bsdf(surface, wi, wo);
}

BsdfSample sample_surface(Surface surface, vec3 wi, vec2 u, float lobe) {
    if (HAS_PRINCIPLED && bsdf_kind(surface) == BSDF_PRINCIPLED) {
        return sample_principled(surface, wi, u, lobe);
    }
    return sample_bsdf(surface, wi, u, lobe);
}

// Scattering function times cosine, and the density with which directions are sampled.
BsdfValue eval_scattering(Vertex vertex, vec3 direction) {
    if (HAS_MEDIA && vertex.in_medium) {
        if (HAS_PHASES && vertex.phase != 0u) {
            float mixed = eval_mixture(vertex.phase, vertex.axis, direction);
            return BsdfValue(vertex.albedo * mixed, mixed);
        }
        float phase = HAS_HENYEY_GREENSTEIN ? eval_henyey_greenstein(vertex.g, vertex.axis, direction) : INV_4PI;
        return BsdfValue(vertex.albedo * phase, phase);
    }
    vec3 local = to_surface_frame(vertex.tangent, vertex.axis, direction);
    if (!sides_agree(vertex, local.z, direction)) {
        return BsdfValue(vec3(0.0), 0.0);
    }
    BsdfValue found = eval_surface(vertex.surface, vertex.incident, local);
    if (HAS_RELIEFS && vertex.fade > 0.0) {
        found.value *= relief_fading(vertex.fade, dot(vertex.base, direction));
    }
    return found;
}

BsdfSample sample_scattering(Vertex vertex, vec2 u, float lobe) {
    if (HAS_MEDIA && vertex.in_medium) {
        vec3 direction;
        if (HAS_PHASES && vertex.phase != 0u) {
            PhaseAngle angle = sample_mixture(vertex.phase, u.x, lobe);
            direction = from_frame(vertex.axis, from_polar(angle.cos_theta, angle.sin_theta, u.y));
        } else if (HAS_HENYEY_GREENSTEIN && vertex.g != 0.0) {
            PhaseAngle angle = sample_henyey_greenstein(vertex.g, u.x);
            direction = from_frame(vertex.axis, from_polar(angle.cos_theta, angle.sin_theta, u.y));
        } else {
            direction = square_to_sphere(u);
        }
        return BsdfSample(direction, vertex.albedo, eval_scattering(vertex, direction).pdf, 1.0);
    }
    BsdfSample found = sample_surface(vertex.surface, vertex.incident, u, lobe);
    float side = found.direction.z;
    found.direction = from_surface_frame(vertex.tangent, vertex.axis, found.direction);
    if (!sides_agree(vertex, side, found.direction)) {
        found.weight = vec3(0.0);
        found.pdf = 0.0;
    }
    if (HAS_RELIEFS && vertex.fade > 0.0) {
        found.weight *= relief_fading(vertex.fade, dot(vertex.base, found.direction));
    }
    return found;
}

// Where a ray in some direction begins so that it does not meet the surface it leaves.
vec3 offset_origin(Path path, vec3 direction) {
    return path.point + path.normal * (dot(path.normal, direction) >= 0.0 ? path.offset : -path.offset);
}

// The medium on the side of a surface to which a direction goes, for a path that came in `medium`.
uint medium_towards(Vertex vertex, uint medium, vec3 direction) {
    if (!HAS_DIELECTRIC || vertex.in_medium || (vertex.surface.flags & SURFACE_ORIENTED) == 0u) {
        return medium;
    }
    bool outwards = dot(vertex.normal, direction) > 0.0;
    if (outwards == (vertex.incident.z > 0.0) || vertex.surface.media == 0u) {
        return medium;
    }
    uint inside = vertex.surface.media & 0xffffu, outside = vertex.surface.media >> 16u;
    uint from = outwards ? inside : outside, to = outwards ? outside : inside;
    // If the surface does not expect the medium in front of it, it coincides with another boundary.
    uint found = medium == from ? to : medium_of_code(medium_code(medium) + medium_code(to) - medium_code(from), to, params.medium_count);
    return found == NONE ? to : found;
}

// A point on a primitive, its unit normal, and the largest coordinate that went into it.
void surface_point(Primitive primitive, Path path, Hit hit, out vec3 point, out vec3 normal, out float largest) {
    if (HAS_SPHERES && (primitive.surface & PRIMITIVE_SPHERE) != 0u) {
        vec3 outwards = normalize(path.origin + path.direction * hit.t - primitive.a);
        point = primitive.a + outwards * primitive.b.x;
        normal = outwards * primitive.b.y;
        largest = max_component(abs(primitive.a)) + primitive.b.x;
    } else {
        vec3 edge_1 = primitive.b - primitive.a, edge_2 = primitive.c - primitive.a;
        point = primitive.a + edge_1 * hit.barycentric.x + edge_2 * hit.barycentric.y;
        normal = normalize(cross(edge_1, edge_2));
        largest = max_component(max(abs(primitive.a), max(abs(primitive.b), abs(primitive.c))));
    }
}
