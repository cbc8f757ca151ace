// Neighbouring pixels share their paths. Of each path the first two vertices are kept, and what the second one scatters. The first vertex
// of every pixel of a group is then connected to the second vertices of all the others, so that a pixel has as many continuations as the
// group has pixels, for one ray each instead of a path (Bekaert, Sbert and Halton 2002, "Accelerating path tracing by re-using paths").
// The balance heuristic over the group (Veach and Guibas 1995) keeps the expectation of each pixel: second vertex j counts for pixel i with
//
//   p_i(j) / sum_k p_k(j),
//
// where p_k is the density with which the first vertex of k finds it, visibility and flight through the medium with it, so that no weight
// exceeds 1 and no singularity is left. Only vertices that scatter in a way which is known without their place on a surface take part:
// diffuse surfaces and media. All else is left to its own pixel.
//
// The groups are shifted from run to run of samples (lib/film.glsl), so that the noise that the pixels of a group have in common can be
// told from the image afterwards (src/render/reconstruct.rs), which needs the shared part of each sample by itself.
#include "lib/path_state.glsl"
#include "lib/path_vertex.glsl"
#include "lib/path_rays.glsl"
#include "lib/path_aim.glsl"
#include "lib/path_flight.glsl"

// What the vertex of a path is for others.
const uint END_NONE = 0u;
const uint END_SURFACE = 1u;
const uint END_MEDIUM = 2u;

// The RECORD_VECTORS of a record: the first vertex in two; the triangle that its rays leave, and what the second vertex's direction went by;
// the first one's weight, and how far the flight from there went until it left its medium; and then from here on:
const uint SECOND = 4u; // the second vertex
const uint SENT = 6u;   // what it sends: see Sent
const uint BASE = 11u;  // radiance that came before it
const uint PIVOT = 12u; // what the first vertex's direction and flight went by
const uint NORMALS = 13u; // where shading normals are: the geometric ones of the first and the second vertex

const uvec2 SHARE_SIZE = uvec2(2u, SHARERS == 4u ? 2u : 4u);

// Connections have streams of numbers as if they were the shadow rays of these segments, one for each second vertex.
const uint CONNECTION_SEGMENTS = 0x10000000u;

// Rays end this many times the offset of rays that leave a surface before it.
const float END_MARGIN = 4.0;

// A vertex as others see it.
struct End {
    vec3 point;
    uint kind;
    vec3 axis;      // the shading normal on its side; in a medium, the direction of propagation
    vec3 normal;    // of a surface: the geometric normal on its side
    uint medium;    // where the path arrived through
    float offset;   // of a surface: of rays that begin or end here
};

// What the second vertex sends back. All but `ended` depends on the direction, where the phase function does.
struct Sent {
    vec3 ended;
    vec3 light;
    vec3 light_direction;
    vec3 rest;
    vec3 rest_direction;
};

// The place in a tile of number n in the group of a place, and its own number.
uvec2 sharer_place(uvec2 place, uint n) {
    return place / SHARE_SIZE * SHARE_SIZE + uvec2(n % SHARE_SIZE.x, n / SHARE_SIZE.x);
}

uint sharer_number(uvec2 place) {
    place %= SHARE_SIZE;
    return place.y * SHARE_SIZE.x + place.x;
}

uint record_of(uint slot) {
    return push.work.first_record + RECORD_VECTORS * slot;
}

// Whether what a connection brings and its density are not one and the same number.
const bool HAS_PAIR_VECTORS = HAS_CHROMATIC || HAS_EQUIANGULAR || HAS_GRIDS;

// Where the densities of a group's connections begin. `number` is that of the group, times samples.
uint pairs_of(uint number) {
    return push.work.first_pair + SHARERS * (HAS_PAIR_VECTORS ? SHARERS : SHARERS / 4u) * number;
}

// What reaches the first vertex of i from the second of j in each channel, and the density with which it finds that.
void store_pair(uint pairs, uint i, uint j, vec4 density) {
    if (HAS_PAIR_VECTORS) {
        store_sample(pairs + SHARERS * j + i, density);
    } else {
        SAMPLE(pairs + SHARERS / 4u * j + i / 4u)[i % 4u] = density.w;
    }
}

// The first place of a group of a tile.
uvec2 group_place(uint group) {
    return uvec2(group % (TILE / SHARE_SIZE.x), group / (TILE / SHARE_SIZE.x)) * SHARE_SIZE;
}

// Stores the first vertex (0) or the second one (1) of a record.
void store_end(uint record, uint which, Path path, Vertex vertex) {
    uint at = record + which * SECOND;
    uint kind = vertex.in_medium ? END_MEDIUM : END_SURFACE;
    store_sample(at, vec4(vertex.point, float(kind | path.medium << 2u)));
    store_sample(at + 1u, vec4(vertex.axis, path.offset));
    if (HAS_SHADING_NORMALS) {
        store_sample(record + NORMALS + which, vec4(vertex.normal, 0.0));
    }
}

End load_end(uint record, uint which) {
    vec4 point = SAMPLE(record + which * SECOND), axis = SAMPLE(record + which * SECOND + 1u);
    vec3 normal = HAS_SHADING_NORMALS ? SAMPLE(record + NORMALS + which).xyz : axis.xyz;
    return End(point.xyz, whole(point.w) & 3u, axis.xyz, normal, whole(point.w) >> 2u, axis.w);
}

bool can_share(Path path, Vertex vertex) {
    if (vertex.in_medium) {
        return !HAS_PHASES || vertex.phase == 0u;
    }
    bool diffuse = vertex.surface.flags >> SURFACE_KIND_SHIFT == BSDF_DIFFUSE;
    return diffuse && vertex.surface.relief_texture == 0u && path.medium != NONE;
}

// A sample begins: none of its vertices is kept.
void share_nothing(uint slot) {
    SAMPLE(record_of(slot)).w = float(END_NONE);
    SAMPLE(record_of(slot) + SECOND).w = float(END_NONE);
}

// Before the path scatters: keeps its first two vertices. From the second one on the path gathers radiance for a throughput of 1.
void share_vertex(inout Path path, inout Vertex vertex) {
    uint record = record_of(path.slot);
    if (path.depth == 0u && can_share(path, vertex)) {
        vec3 weight = path.throughput * (vertex.in_medium ? vertex.albedo : vertex.surface.reflectance);
        if (max_component(weight) > 0.0) {
            store_end(record, 0u, path, vertex);
            store_sample(record + 2u, vec4(float(path.left & 0xffffu), float(path.left >> 16u), 1.0, 0.0));
            store_sample(record + RECORD_WEIGHT, vec4(weight, 0.0));
            path.sharing = 1u;
        }
    } else if (path.depth == 1u && path.sharing == 1u && can_share(path, vertex)) {
        store_end(record, 1u, path, vertex);
        store_sample(record + BASE, vec4(path.radiance, HAS_MEDIA && !HAS_CHROMATIC ? path.tau : 0.0));
        if (HAS_EQUIANGULAR) {
            SAMPLE(record + RECORD_WEIGHT).w = path.first_way;
        }
        path.radiance = vec3(0.0);
        path.before = vertex.in_medium ? path.throughput * vertex.albedo : path.throughput;
        // The densities are those of flights that end in media that only absorb as well. A path that does not brings so much less instead.
        path.throughput = vec3(HAS_ABSORBING || HAS_TINTS ? path.absorbed : 1.0);
        path.before /= max(path.throughput, vec3(1e-30));
        if (vertex.in_medium) {
            Medium medium = MEDIUM(valid_medium(path.medium));
            vertex.albedo = HAS_GRIDS ? medium.albedo * albedo_factor(medium, vertex.point) : medium.albedo;
        }
        path.sharing = 2u;
    }
}

// Keeps what the segments behind the first two vertices went by. At a second one in a medium it takes part in the density of each path that
// may come there, so the path goes on as if scattering alone had chosen its direction, which has the density `scattered`.
void share_aim(inout Path path, Vertex vertex, Pivot pivot, Aim aim, inout BsdfSample next, float scattered) {
    uint record = record_of(path.slot);
    if (path.sharing == 1u && path.depth == 1u) {
        path.lamp_way = pivot.point - vertex.point;
        store_sample(record + PIVOT, vec4(pivot.point, pivot.area));
    } else if (is_common(path, vertex) && aim.share > 0.0 && scattered > 0.0) {
        SAMPLE(record + 2u).zw = vec2(1.0 - aim.share, aimed_pdf(aim, 0.0, next.direction));
        float ratio = scattered / next.pdf;
        next.weight /= ratio;
        path.before *= ratio;
    }
}

// Keeps what a path brings that ends at its second vertex, and clears what has not come yet.
void share_ended(inout Path path) {
    uint at = record_of(path.slot) + SENT;
    store_sample(at, vec4(path.radiance, 0.0));
    store_sample(at + 1u, vec4(0.0));
    store_sample(at + 2u, vec4(0.0));
    path.radiance = vec3(0.0);
}

// Keeps a part of what the second vertex sends, and begins the next.
void share_part(inout Path path, uint part, vec3 direction) {
    uint at = record_of(path.slot) + SENT + part;
    store_sample(at, vec4(path.radiance, 0.0));
    if (HAS_HENYEY_GREENSTEIN) {
        store_sample(at + 1u, vec4(direction, 0.0));
    }
    path.radiance = vec3(0.0);
}

Sent load_sent(uint record) {
    Sent sent = Sent(vec3(0.0), vec3(0.0), vec3(0.0), SAMPLE(record + SENT + 3u).xyz, vec3(0.0, 0.0, 1.0));
    if (HAS_HENYEY_GREENSTEIN) {
        sent.ended = SAMPLE(record + SENT).xyz;
        sent.light = SAMPLE(record + SENT + 1u).xyz;
        sent.light_direction = SAMPLE(record + SENT + 2u).xyz;
        sent.rest_direction = SAMPLE(record + SENT + 4u).xyz;
    }
    return sent;
}

// Asks for the ray from a first vertex to a second one. Returns whether the first could have found the second: `density` is that of the
// place by scattering, without what lies on the way, and `aimed` the density with directions past the lamp over that.
bool begin_connection(inout Path path, End first, End second, Pivot pivot, out float density, out float aimed) {
    vec3 way = second.point - first.point;
    vec3 begin = first.point, end = second.point;
    if (first.kind == END_SURFACE) {
        begin += first.normal * (dot(first.normal, way) >= 0.0 ? first.offset : -first.offset);
    }
    if (second.kind == END_SURFACE) {
        // The distance to the surface itself is rounded as well as its points are.
        float margin = END_MARGIN * second.offset;
        end += second.normal * (dot(second.normal, way) <= 0.0 ? margin : -margin);
    }
    way = end - begin;
    float far = length(way);
    path.origin = begin;
    path.direction = way / far;
    path.t_min = 0.0;
    path.t_max = far;
    path.last = NONE;
    path.light = NONE - 1u; // no primitive has this light
    path.medium = first.medium;
    path.light_medium = first.medium;
    path.shadow = true;
    if (HAS_GRIDS) {
        path.tau_rgb = vec3(0.0);
        path.tau_mean = vec3(0.0);
        path.light_passes = vec3(1.0);
        path.passed = 1.0;
        path.collisions = 0u;
    }
    if (first.kind == END_SURFACE) {
        density = max(dot(first.axis, path.direction), 0.0) * INV_PI;
        density = HAS_SHADING_NORMALS && dot(first.normal, path.direction) <= 0.0 ? 0.0 : density;
    } else {
        density = HAS_HENYEY_GREENSTEIN ? eval_henyey_greenstein(MEDIUM(first.medium).g, first.axis, path.direction) : INV_4PI;
    }
    aimed = HAS_EQUIANGULAR ? aimed_pdf(aim_at(pivot, first.point, MEDIUM(first.medium), 0.0), density, path.direction) / density : 1.0;
    if (second.kind == END_SURFACE) {
        density *= max(-dot(second.normal, path.direction), 0.0);
        density = HAS_SHADING_NORMALS && dot(second.axis, path.direction) >= 0.0 ? 0.0 : density;
    }
    density /= far * far;
    return far > 0.0 && density > 0.0;
}

// The density of a flight that ends at the second vertex, over that of a free flight, which is `free` for a density of 1.
float connection_factor(Path path, Hit hit, End first, End second, Pivot pivot, vec3 weights, float free) {
    Medium medium = MEDIUM(first.medium);
    OpenFlight flight = open_flight(medium, weights, path.origin, path.direction, pivot.point - first.point);
    bool leaves = hit.first < path.t_max;
    float way = min(hit.first, path.t_max);
    bool ends = !leaves && second.kind == END_MEDIUM;
    return open_factor(flight, way, ends, ends ? free : mean_passage(weights, medium.sigma_t * way));
}

// What a connection through fields brings in each channel: an estimate of what passes, and a density that is known.
vec4 end_grid_connection(Path path, End second, float density) {
    vec2 extinction = vec2(1.0);
    if (second.kind == END_MEDIUM) {
        extinction = extinction_at(MEDIUM(second.medium), second.point);
    }
    vec3 passes = density * extinction.x * path.light_passes * exp_minus(path.tau_rgb);
    return vec4(passes, density * extinction.y * exp_minus(path.tau_mean.x));
}

// What a connection whose ray has arrived brings in each channel, and its density by the flight of the first vertex, which chooses one.
vec4 end_connection(Path path, Hit hit, End first, End second, Pivot pivot, vec3 weight, float density, float aimed) {
    vec3 passes = vec3(density);
    if (HAS_MEDIA) {
        passes *= HAS_CHROMATIC ? exp_minus(max(hit.tau_rgb, vec3(0.0))) : vec3(exp_minus(max(hit.tau, 0.0)));
        passes *= second.kind == END_MEDIUM ? MEDIUM(second.medium).sigma_t : vec3(1.0);
    }
    vec3 weights = HAS_CHROMATIC ? channel_weights(weight) : vec3(0.0);
    float found = HAS_CHROMATIC ? dot(weights, passes) : passes.x;
    float factor = HAS_EQUIANGULAR ? aimed * connection_factor(path, hit, first, second, pivot, weights, found / density) : 1.0;
    return vec4(passes, factor * found);
}

// The phase function of the second vertex for light from `from`.
float phase_from(End second, vec3 from, vec3 direction) {
    return eval_henyey_greenstein(MEDIUM(second.medium).g, normalize(second.point - from), direction);
}
