// The estimator: a path as a coroutine that asks for one ray at a time. This is the only file that combines concepts.
//
// A path's life:
//   1. path_start       a ray from the camera, a free flight for its first segment
//   2. (traversal)      the nearest primitive within the free flight, or none
//   3. path_advance     a boundary without a surface: change the medium, go on along the same ray  -> 2
//                       nothing within the flight: scatter in the medium                           -> 4
//                       a surface: add what it emits, reflect                                      -> 4
//                       nothing at all: add what comes from infinitely far, end
//   4. (same call)      choose a light, ask for a shadow ray; sample the next direction; roulette
//   5. (traversal)      everything along the shadow ray, in any order
//   6. path_light       add the light that got through; next segment -> 2
#include "lib/math.glsl"
#include "lib/sampler.glsl"
#include "lib/warp.glsl"
#include "lib/ray.glsl"
#include "lib/camera.glsl"
#include "lib/medium.glsl"
#include "lib/phase.glsl"
#include "lib/bsdf.glsl"
#include "lib/light.glsl"

// Depth at which roulette begins to end paths that lose nothing, so that a closed scene without absorption ends.
const uint RELENTLESS_DEPTH = 256u;

struct Path {
    uint pixel;             // of the whole film
    uint sample_index;
    // The ray that is asked for.
    vec3 origin;
    vec3 direction;
    float t_min;            // where the ray begins, or the last boundary on it
    float t_max;            // the free flight, or the distance to the light
    uint last;              // the boundary at t_min, or NONE
    bool shadow;
    // The path.
    vec3 throughput;
    vec3 radiance;
    uint segment;           // counts the random numbers' sets
    uint depth;             // scattering events so far
    float pdf;              // density per solid angle of `direction`; 0 for a camera ray
    bool alive;
    // The medium and the flight through it. Scalars serve gray media, vectors chromatic ones.
    uint medium;
    float tau_left;         // optical depth, in the chosen channel, from t_min to the end of the flight
    float tau;              // optical depth from the last event to t_min
    vec3 tau_rgb;
    uint channel;
    float far_end;          // where the far clip plane ends a camera ray
    // The shadow ray.
    vec3 next_direction;
    vec3 light_weight;      // what arrives if nothing is in the way
    float pdf_ratio;        // density of the light's direction by scattering over that by light sampling; 0 for a point
    uint light;             // the light it goes to
    vec3 light_channels;    // chromatic media: the throughput that scattering towards the light would have
    uint light_medium;      // where dielectrics are: the medium in which the shadow ray begins
    // The vertex.
    vec3 point;
    float offset;           // of rays that leave a surface, along its normal; 0 in a medium
    vec3 normal;            // only valid when offset > 0
    uint next_medium;       // where dielectrics are: the medium of the next segment
    float eta_scale;        // where dielectrics are: the product of squared indices that refraction divided radiance by
};

// What the traversal found.
struct Hit {
    float t;
    uint primitive;         // NONE: nothing within t_max
    bool along_normal;
    vec2 barycentric;
    float tau;              // shadow rays: optical depth
    vec3 tau_rgb;
    bool blocked;           // shadow rays: something is in the way
};

// The four numbers of a set.
vec4 sample_set(Path path, uint set) {
    uvec4 key = set_key(params.seed, path.pixel, set, path.sample_index);
    uvec2 point = uvec2(0u);
    if (set < SOBOL_SETS) {
        point = POINT(point_index(set, path.sample_index, key));
    }
    return shifted_point(point, key);
}

uint valid_medium(uint medium) {
    return medium < params.medium_count ? medium : 0u;
}

float channel_of(vec3 v, uint channel) {
    return channel == 0u ? v.x : (channel == 1u ? v.y : v.z);
}

// Distance to the end of the flight with the extinction that holds from t_min on.
float flight_end(Path path) {
    if (!HAS_MEDIA) {
        return path.far_end;
    }
    vec3 sigma_t = MEDIUM(valid_medium(path.medium)).sigma_t;
    float sigma = HAS_CHROMATIC ? channel_of(sigma_t, path.channel) : sigma_t.x;
    return min(path.t_min + free_flight(path.tau_left, sigma), path.far_end);
}

// A new segment along path.direction: its flight from two random numbers.
void begin_segment(inout Path path, vec2 u) {
    path.last = NONE;
    path.shadow = false;
    if (HAS_MEDIA) {
        path.tau = 0.0;
        path.tau_left = minus_log_1m(u.x);
        if (HAS_CHROMATIC) {
            path.tau_rgb = vec3(0.0);
            path.channel = sample_channel(channel_weights(path.throughput), u.y);
        }
    }
    path.t_max = flight_end(path);
}

void path_start(inout Path path) {
    vec4 u = sample_set(path, 0u);
    uint row = path.pixel / params.film_width, column = path.pixel - row * params.film_width;
    vec2 film = (vec2(column, row) + u.xy) * vec2(params.inverse_width, params.inverse_height);
    vec3 direction = camera_direction(params.camera_corner, params.camera_right, params.camera_down, film);
    float depth_to_distance = length(direction);
    path.origin = params.camera_origin;
    path.direction = direction / depth_to_distance;
    path.t_min = params.near_clip * depth_to_distance;
    path.far_end = HAS_FAR_CLIP ? params.far_clip * depth_to_distance : INFINITE_DISTANCE;
    path.throughput = vec3(1.0);
    path.radiance = vec3(0.0);
    path.segment = 0u;
    path.depth = 0u;
    path.pdf = 0.0;
    path.alive = true;
    path.eta_scale = 1.0;
    path.medium = params.camera_medium;
    begin_segment(path, u.zw);
}

// Weight of a direction found by scattering that light sampling finds with density light_pdf: the balance heuristic (Veach and
// Guibas 1995). Scattering finds the light only if the flight survives, so its probability to do so is part of the density.
float scattering_mis_weight(Path path, float survival, float light_pdf) {
    float found = path.pdf * survival;
    return path.pdf == 0.0 || light_pdf == 0.0 ? 1.0 : found / (found + light_pdf);
}

// Probability that the flight got as far as it did.
float survival(Path path) {
    if (!HAS_MEDIA) {
        return 1.0;
    }
    return HAS_CHROMATIC ? survival_probability(channel_weights(path.throughput), path.tau_rgb) : exp_minus(path.tau);
}

vec3 survived_throughput(Path path) {
    if (HAS_MEDIA && HAS_CHROMATIC) {
        return path.throughput * survival_weight(channel_weights(path.throughput), path.tau_rgb);
    }
    return path.throughput;
}

bool emitters_seen(Path path) {
    return !(HAS_HIDDEN_EMITTERS && path.depth == 0u);
}

// Adds the constant light to a path that leaves the scene.
void add_constant_light(inout Path path) {
    if (!HAS_CONSTANT_LIGHT || !emitters_seen(path)) {
        return;
    }
    for (uint i = 0u; i < params.light_count; ++i) {
        Light light = LIGHT(i);
        if (light.kind == LIGHT_CONSTANT) {
            // Light sampling takes its directions from the same scattering function (see sample_light).
            float light_pdf = HAS_LIGHT_SAMPLING ? light.probability * path.pdf : 0.0;
            path.radiance += survived_throughput(path) * light.radiance * scattering_mis_weight(path, survival(path), light_pdf);
        }
    }
}

// Adds what a primitive emits towards the path.
void add_emission(inout Path path, Primitive primitive, float t, vec3 normal) {
    float cos_light = -dot(path.direction, normal);
    if (!HAS_AREA_LIGHTS || primitive.light == 0u || cos_light <= 0.0 || !emitters_seen(path)) {
        return;
    }
    Light light = LIGHT(primitive.light - 1u);
    float pdf = HAS_SPHERE_LIGHTS && light.kind == LIGHT_SPHERE
        ? sphere_light_pdf(light.edge_1.x, distance(path.origin, light.origin))
        : area_pdf(light.area, t, cos_light);
    float light_pdf = HAS_LIGHT_SAMPLING ? light.probability * pdf : 0.0;
    path.radiance += survived_throughput(path) * light.radiance * scattering_mis_weight(path, survival(path), light_pdf);
}

// A point where light is scattered, in a medium or on a surface.
struct Vertex {
    vec3 point;
    vec3 axis;      // z of the surface's local frame; in a medium, the direction of propagation
    bool in_medium;
    float g;        // of the medium
    vec3 albedo;    // of the medium, with the weight of the flight
    Surface surface;
    vec3 incident;  // on a surface: towards where the path comes from, in the local frame
};

// Scattering function times cosine, and the density with which directions are sampled.
BsdfValue eval_scattering(Vertex vertex, vec3 direction) {
    if (HAS_MEDIA && vertex.in_medium) {
        float phase = HAS_HENYEY_GREENSTEIN ? eval_henyey_greenstein(vertex.g, vertex.axis, direction) : INV_4PI;
        return BsdfValue(vertex.albedo * phase, phase);
    }
    return eval_bsdf(vertex.surface, vertex.incident, to_frame(vertex.axis, direction));
}

BsdfSample sample_scattering(Vertex vertex, vec2 u, float lobe) {
    if (HAS_MEDIA && vertex.in_medium) {
        vec3 direction;
        if (HAS_HENYEY_GREENSTEIN && vertex.g != 0.0) {
            PhaseAngle angle = sample_henyey_greenstein(vertex.g, u.x);
            direction = from_frame(vertex.axis, from_polar(angle.cos_theta, angle.sin_theta, u.y));
        } else {
            direction = square_to_sphere(u);
        }
        return BsdfSample(direction, vertex.albedo, eval_scattering(vertex, direction).pdf, 1.0);
    }
    BsdfSample found = sample_bsdf(vertex.surface, vertex.incident, u, lobe);
    found.direction = from_frame(vertex.axis, found.direction);
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
    bool outwards = dot(vertex.axis, direction) > 0.0;
    if (outwards == (vertex.incident.z > 0.0) || vertex.surface.media == 0u) {
        return medium;
    }
    uint inside = vertex.surface.media & 0xffffu, outside = vertex.surface.media >> 16u;
    return cross_boundary(medium, outwards ? inside : outside, outwards ? outside : inside);
}

// Chooses a light and a point on it, and sets up the shadow ray. Returns whether there is anything to ask for.
bool sample_light(inout Path path, Vertex vertex, vec2 u, float lobe) {
    if (!HAS_LIGHT_SAMPLING) {
        return false;
    }
    uint index = 0u;
    if (HAS_MANY_LIGHTS) {
        index = alias_line(params.light_count, u.x);
        Light line = LIGHT(index);
        index = alias_keeps(line.alias_threshold, u.x) ? index : line.alias;
    }
    Light light = LIGHT(index);
    LightSample found;
    if (HAS_CONSTANT_LIGHT && light.kind == LIGHT_CONSTANT) {
        // No direction is better than another, so the scattering function samples them; what light sampling adds is the
        // transmittance, exact instead of 0 or 1.
        BsdfSample scattered = sample_scattering(vertex, u, lobe);
        vec3 weight = scattered.pdf > 0.0 ? light.radiance / scattered.pdf : vec3(0.0);
        found = LightSample(scattered.direction, INFINITE_DISTANCE, weight, scattered.pdf);
    } else if (HAS_POINT_LIGHTS && light.kind == LIGHT_POINT) {
        found = sample_point_light(light, vertex.point);
    } else if (HAS_SPHERE_LIGHTS && light.kind == LIGHT_SPHERE) {
        found = sample_sphere_light(light, vertex.point, u);
    } else {
        found = sample_plane_light(light, vertex.point, u);
    }
    BsdfValue scattering = eval_scattering(vertex, found.direction);
    path.direction = found.direction;
    path.t_max = found.distance;
    path.light = index;
    path.light_channels = path.throughput * scattering.value;
    path.light_weight = path.light_channels * found.weight / light.probability;
    path.pdf_ratio = found.pdf > 0.0 ? scattering.pdf / (found.pdf * light.probability) : 0.0;
    path.light_medium = medium_towards(vertex, path.medium, found.direction);
    path.origin = offset_origin(path, found.direction);
    return max_component(path.light_weight) > 0.0 || !is_finite(path.light_weight);
}

// Scatters at a vertex: the shadow ray, the next direction, roulette.
void scatter(inout Path path, Vertex vertex) {
    path.depth += 1u;
    path.shadow = false;
    path.alive = path.depth < MAX_DEPTH;
    if (!path.alive) {
        return;
    }
    vec4 u = sample_set(path, 2u * path.segment + 1u);
    float lobe = HAS_LOBES ? sample_set(path, 2u * path.segment + 2u).y : 0.0;
    BsdfSample next = sample_scattering(vertex, u.zw, lobe);
    path.point = vertex.point;
    path.t_min = 0.0;
    path.last = NONE;
    path.far_end = INFINITE_DISTANCE;
    path.shadow = (vertex.in_medium || !HAS_LOBES || bsdf_has_density(vertex.surface)) && sample_light(path, vertex, u.xy, u.z);
    path.next_direction = next.direction;
    path.next_medium = medium_towards(vertex, path.medium, next.direction);
    path.throughput *= next.weight;
    path.pdf = next.pdf;
    path.eta_scale *= next.eta * next.eta;
    path.alive = max_component(path.throughput) > 0.0;
    if (!is_finite(path.throughput)) {
        // The sample is lost, and must be seen to be: no comparison may drop it.
        path.radiance += path.throughput;
        path.alive = false;
    }
}

// Begins the segment after a vertex, unless roulette ends the path.
void next_segment(inout Path path) {
    path.segment += 1u;
    vec4 u = sample_set(path, 2u * path.segment);
    if (path.depth >= RR_DEPTH) {
        float most = path.depth < RELENTLESS_DEPTH ? 1.0 : 0.95;
        float keep = min(3.0 * max_component(path.throughput) * (HAS_DIELECTRIC ? path.eta_scale : 1.0), most);
        path.alive = path.alive && u.x < keep;
        path.throughput /= keep;
    }
    path.direction = path.next_direction;
    path.origin = offset_origin(path, path.direction);
    path.medium = HAS_DIELECTRIC ? path.next_medium : path.medium;
    path.t_min = 0.0;
    begin_segment(path, u.zw);
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

// Answers a ray that extends the path.
void path_advance(inout Path path, Hit hit) {
    bool surface_hit = hit.primitive != NONE;
    float t = surface_hit ? hit.t : path.t_max;

    // The optical depth of the way through the medium since t_min.
    Medium medium;
    if (HAS_MEDIA) {
        medium = MEDIUM(valid_medium(path.medium));
        float way = t - path.t_min;
        path.tau_left -= way * (HAS_CHROMATIC ? channel_of(medium.sigma_t, path.channel) : medium.sigma_t.x);
        if (HAS_CHROMATIC) {
            path.tau_rgb += medium.sigma_t * way;
        } else {
            path.tau += medium.sigma_t.x * way;
        }
    }
    if (!surface_hit && t >= path.far_end) {
        add_constant_light(path);
        path.alive = false;
        path.shadow = false;
        return;
    }
    if (!surface_hit) {
        vec3 weight = medium.albedo;
        if (HAS_CHROMATIC) {
            weight = scatter_weight(channel_weights(path.throughput), path.tau_rgb, medium.sigma_t, medium.albedo);
        }
        vec3 point = path.origin + path.direction * t;
        path.offset = 0.0;
        path.normal = path.direction;
        Surface none;
        scatter(path, Vertex(point, path.direction, true, medium.g, weight, none, vec3(0.0)));
    } else {
        Primitive primitive = PRIMITIVE(hit.primitive);
        Surface surface = SURFACE(primitive.surface & ~(PRIMITIVE_BOUNDARY | PRIMITIVE_SPHERE));
        if (HAS_BOUNDARIES && (primitive.surface & PRIMITIVE_BOUNDARY) != 0u) {
            uint inside = surface.media & 0xffffu, outside = surface.media >> 16u;
            path.medium = cross_boundary(path.medium, hit.along_normal ? inside : outside, hit.along_normal ? outside : inside);
            path.t_min = t;
            path.last = hit.primitive;
            path.tau_left = max(path.tau_left, 0.0);
            path.t_max = flight_end(path);
            return;
        }
        vec3 point, normal;
        float largest;
        surface_point(primitive, path, hit, point, normal, largest);
        add_emission(path, primitive, t, normal);
        path.throughput = survived_throughput(path);
        bool back = dot(path.direction, normal) > 0.0;
        if (HAS_ONE_SIDED && back && (surface.flags & (SURFACE_TWO_SIDED | SURFACE_ORIENTED)) == 0u) {
            path.alive = false;
            path.shadow = false;
            return;
        }
        vec3 axis = back && !(HAS_DIELECTRIC && (surface.flags & SURFACE_ORIENTED) != 0u) ? -normal : normal;
        path.offset = offset_distance(largest);
        path.normal = axis;
        scatter(path, Vertex(point, axis, false, 0.0, vec3(0.0), surface, to_frame(axis, -path.direction)));
    }
    if (!path.shadow && path.alive) {
        next_segment(path);
    }
}

// Answers a shadow ray.
void path_light(inout Path path, Hit hit) {
    if (!hit.blocked) {
        vec3 transmittance = vec3(1.0);
        float survives = 1.0;
        if (HAS_MEDIA) {
            if (HAS_CHROMATIC) {
                transmittance = exp_minus(max(hit.tau_rgb, vec3(0.0)));
                survives = dot(channel_weights(path.light_channels), transmittance);
            } else {
                survives = exp_minus(max(hit.tau, 0.0));
                transmittance = vec3(survives);
            }
        }
        path.radiance += path.light_weight * transmittance / (1.0 + path.pdf_ratio * survives);
    }
    path.shadow = false;
    if (path.alive) {
        next_segment(path);
    }
}

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
    Hit hit = Hit(path.t_max, NONE, false, vec2(0.0), 0.0, vec3(0.0), false);
    if (HAS_MEDIA && HAS_LIGHT_SAMPLING && path.shadow) {
        uint medium = HAS_DIELECTRIC ? path.light_medium : path.medium;
        vec3 tau = MEDIUM(valid_medium(medium)).sigma_t * shadow_length(path) + depth_at_infinity(path);
        hit.tau = tau.x;
        hit.tau_rgb = tau;
    }
    return hit;
}

// Takes one crossing with a primitive into account.
void record(Path path, uint index, Primitive primitive, float t, bool along_normal, vec2 barycentric, inout Hit hit) {
    // Distances first, the primitive's index among equals: surfaces that coincide are met one after the other, none twice.
    bool begins = t > path.t_min || (t == path.t_min && index > path.last && path.last != NONE);
    if (HAS_LIGHT_SAMPLING && path.shadow) {
        bool boundary = HAS_BOUNDARIES && (primitive.surface & PRIMITIVE_BOUNDARY) != 0u;
        bool counts = begins && t < path.t_max;
        if (HAS_BOUNDARIES && HAS_MEDIA) {
            float way = (shadow_length(path) - t) * (along_normal ? -1.0 : 1.0);
            hit.tau += counts && boundary ? primitive.sigma_t_step * way : 0.0;
            if (HAS_CHROMATIC && counts && boundary) {
                hit.tau_rgb += SURFACE(primitive.surface & ~(PRIMITIVE_BOUNDARY | PRIMITIVE_SPHERE)).sigma_t_step * way;
            }
        }
        // The light itself is not in the way of its light.
        hit.blocked = hit.blocked || (counts && !boundary && primitive.light != path.light + 1u);
    } else if (begins && (t < hit.t || (t == hit.t && index < hit.primitive && hit.primitive != NONE))) {
        hit.t = t;
        hit.primitive = index;
        hit.along_normal = along_normal;
        hit.barycentric = barycentric;
    }
}

// Tests one primitive.
void test_primitive(Path path, Ray ray, uint index, inout Hit hit) {
    Primitive primitive = PRIMITIVE(index);
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
