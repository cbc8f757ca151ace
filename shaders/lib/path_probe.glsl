// Light that comes into a medium through smooth glass, to vertices in it and on what it surrounds. No shadow ray to a lamp leaves the glass straight, so a probe goes in a direction
// from which light is known to come (lib/guide.glsl), is bent by the glass on its way out, and brings what it meets there. The path itself
// finds the same light by scattering; the two are combined by multiple importance sampling (Veach and Guibas 1995), for both
// densities of the direction are known: what follows it is the same, but for the path's chances to get through.
//
// A probe takes the place of the path until it ends; what the path needs again is kept. No vertex in such a medium is shared (lib/path_share.glsl):
// the path has come through glass.
#include "lib/path_state.glsl"
#include "lib/path_vertex.glsl"
#include "lib/bsdf.glsl"
#include "lib/guide.glsl"

Guide find_guide(Path path, vec3 point) {
    uint first = params.first_guide + 4u * guide_cell((point - params.guide_origin) * params.guide_scale);
    vec3 scaled_axis = vec3(VALUE(first), VALUE(first + 1u), VALUE(first + 2u));
    float chance = length(scaled_axis);
    return Guide(scaled_axis / max(chance, 1e-9), VALUE(first + 3u), chance);
}

// Sends a probe from a vertex at which the path arrived with the throughput `arriving`, if that scatters in its direction. The path has
// scattered already.
void send_probe(inout Path path, Vertex vertex, Guide guide, vec3 arriving, vec2 u) {
    vec3 direction = sample_guide(guide, u);
    BsdfValue scattering = eval_scattering(vertex, direction);
    if (scattering.pdf == 0.0) {
        return;
    }
    path.kept_throughput = path.throughput;
    path.kept_pdf = path.pdf;
    path.kept_guide_pdf = path.guide_pdf;
    path.kept_depth = path.depth;
    path.kept_point = path.point;
    path.kept_normal = path.normal;
    path.kept_offset = path.offset;
    path.kept_left = path.left;
    path.probe = true;
    path.direction = direction;
    path.guide_pdf = guide_pdf(guide, direction);
    path.throughput = arriving * scattering.value / path.guide_pdf;
    path.pdf = scattering.pdf;
    path.origin = offset_origin(path, direction);
    path.t_max = INFINITE_DISTANCE;
    path.tau = 0.0;
    path.tau_rgb = vec3(0.0);
    path.passed = 1.0;
    path.open = false;
}

bool goes_through(Vertex vertex, vec3 direction) {
    return (vertex.incident.z > 0.0) != (dot(vertex.axis, direction) > 0.0);
}

// The probability with which a path that meets smooth glass goes through.
float passing_probability(Vertex vertex) {
    float unused;
    return 1.0 - fresnel_dielectric(vertex.incident.z, vertex.surface.eta, unused);
}

// Bends a probe at a surface. Returns whether it goes on.
bool refract_probe(inout Path path, Vertex vertex) {
    path.depth += 1u;
    float passes = is_smooth_glass(vertex.surface) ? passing_probability(vertex) : 0.0;
    if (passes == 0.0 || path.depth >= MAX_DEPTH) {
        return false;
    }
    BsdfSample next = sample_smooth_dielectric(vertex.surface, vertex.incident, 1.0);
    vec3 direction = from_surface_frame(vertex.tangent, vertex.axis, next.direction);
    if (!sides_agree(vertex, next.direction.z, direction)) {
        return false;
    }
    path.throughput *= next.weight * passes;
    path.pdf *= passes;
    path.medium = medium_towards(vertex, path.medium, direction);
    path.point = vertex.point;
    path.direction = direction;
    path.origin = offset_origin(path, direction);
    path.t_min = 0.0;
    path.t_max = INFINITE_DISTANCE;
    path.last = NONE;
    path.tau = 0.0;
    path.tau_rgb = vec3(0.0);
    return true;
}

// The path goes on from `point`, where it sent the probe.
void end_probe(inout Path path) {
    path.probe = false;
    path.alive = true;
    path.throughput = path.kept_throughput;
    path.pdf = path.kept_pdf;
    path.guide_pdf = path.kept_guide_pdf;
    path.depth = path.kept_depth;
    path.point = path.kept_point;
    path.normal = path.kept_normal;
    path.offset = path.kept_offset;
    path.left = path.kept_left;
    path.last = NONE;
}
