// What a path is between two rays, and its flight through media.
#include "lib/math.glsl"
#include "lib/sampler.glsl"
#include "lib/medium.glsl"
#include "lib/light.glsl"
#include "lib/grid.glsl"
#include "lib/path_open.glsl"

// More than minus_log_1m ever gives: no flight is longer.
const float MAX_FLIGHT_TAU = 16.7;

// Sets of the numbers that choose points of emission, one for each segment: beyond all others.
const uint EMISSION_SETS = 0x80000000u;

// Streams of numbers for tentative collisions, one for each segment's flight, and one for the shadow ray at its end.
const uint FLIGHT_STREAMS = 0xc0000000u;
const uint SHADOW_STREAMS = 0xe0000000u;

struct Path {
    uint pixel;             // of the whole film
    uint sample_index;
    uint group;             // where pixels share paths: of this sample
    uint member;            // and the pixel's number in it
    float filter_weight;    // where the filter is wide: factor of the radiance; negative in its negative lobes
    // The ray that is asked for.
    vec3 origin;
    vec3 direction;
    float t_min;            // where the ray begins, or the last boundary on it
    float t_max;            // how far the free flight may get, or the distance to the light
    uint last;              // the boundary at t_min, or NONE
    bool last_along_normal; // the ray went along its normal; this and the next only valid if last is not NONE
    vec3 anchor;            // the point of the boundary that the ray went through
    bool shadow;
    // The path.
    vec3 throughput;
    vec3 radiance;
    uint segment;           // counts the random numbers' sets
    uint depth;             // scattering events so far
    float pdf;              // density per solid angle of `direction`; 0 for a camera ray; of a mirror that light sampling knows, minus its probability
    float scattered_pdf;    // the same by scattering alone
    bool alive;
    // The medium and the flight through it. Scalars serve gray media, vectors chromatic ones.
    uint medium;            // NONE where boundaries that contradict each other leave none
    uint medium_sum;        // of the codes of media, over the crossings at t_min
    float tau_left;         // optical depth, in the chosen channel, from t_min to the end of the flight
    float tau;              // optical depth from the last event to t_min
    vec3 tau_rgb;
    uint channel;
    float passed;           // where masks are: probability to pass those between the last event and t_min
    float absorbed;         // where pixels share paths: what media that only absorb have left since the last event
    uint crossings;         // where masks are: how many the path has passed or met
    float far_end;          // where the far clip plane ends a camera ray
    // Where media are not homogeneous; a shadow ray has its own, and of `medium`, `tau_rgb` and `passed` as well.
    uint collisions;        // numbers of the stream that are used up
    vec3 tau_mean;          // optical depth from the last event to t_min as the weights of light sampling see it
    vec3 segment_weights;   // channel weights at the beginning of the segment
    vec3 light_passes;      // shadow rays: estimate of the transmittance of voxels up to t_min
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
    uint left;              // the triangle on which the vertex lies, which its rays cannot meet again; else NONE
    uint next_medium;       // where dielectrics are: the medium of the next segment
    // Where media are guided: lib/path_probe.glsl.
    float guide_pdf;        // density of the direction of the last vertex by the guide, where a probe from there is bent like the path; else 0
    bool probe;             // the ray is a probe's
    vec3 kept_throughput;   // what the path goes on with
    float kept_pdf;
    float kept_guide_pdf;
    uint kept_depth;
    vec3 kept_point;
    vec3 kept_normal;
    float kept_offset;
    uint kept_left;
    // Where pixels share paths.
    uint slot;              // of the sample, in the buffer
    uint sharing;           // 1: the first vertex is kept; 2: the second one is, and radiance is that of a throughput of 1 from there
    vec3 before;            // the throughput at the second vertex
    vec3 shared_direction;  // in which the path left it
    vec3 lamp_way;          // from the first vertex to the lamp that the flight from there may go by, or 0
    bool open;              // it goes by lib/path_open.glsl, and has not left the medium in which it began
    float way;              // its length
    float first_way;        // how far it went until it left that medium
    // Roulette by a pilot.
    vec3 focus;             // one over the square of the pixel's radiance
    bool foreseen;          // the pilot knows the vertex
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
    float first;            // shadow rays: distance of the first boundary
    uint medium;            // shadow rays to an emitting medium: the medium at the end of the ray
    float passed;           // shadow rays, where masks are: fraction of the light that passes them
};

vec4 numbers_of_set(uint seed, uint pixel, uint set, uint index) {
    uvec4 key = set_key(seed, pixel, set, index);
    uvec2 point = uvec2(0u);
    if (set < SOBOL_SETS) {
        point = POINT(point_index(set, index, key));
    }
    return shifted_point(point, key);
}

// The four numbers of a set.
vec4 sample_set(Path path, uint set) {
    if (HAS_SHARING) {
        return numbers_of_set(half_seed(params.seed, path.sample_index), path.pixel, set, half_index(path.sample_index));
    }
    return numbers_of_set(params.seed, path.pixel, set, path.sample_index);
}

// The numbers of the camera's segment.
vec4 sample_camera(Path path) {
    vec4 own = sample_set(path, 0u);
    if (HAS_SHARING && HAS_MEDIA) {
        own.zw = numbers_of_set(group_seed(params.seed, path.sample_index), path.group, 0u, group_index(path.sample_index)).zw;
    }
    return own;
}

// The numbers of the vertex at the end of a segment.
vec4 vertex_numbers(Path path, uint segment) {
    if (!HAS_SHARING) {
        return sample_set(path, 2u * segment + 1u);
    }
    bool first = segment == 0u;
    uint seed = first ? group_seed(params.seed, path.sample_index) : half_seed(params.seed, path.sample_index);
    uint index = first ? group_index(path.sample_index) * SHARERS + path.member : half_index(path.sample_index);
    vec4 numbers = numbers_of_set(seed, first ? path.group : path.pixel, 2u * segment + 1u, index);
    // Light that the first vertex samples is not shared, and better spread over the whole render; directions to what is shared are
    // better spread over the group.
    vec2 light = numbers_of_set(params.seed, path.pixel, 1u, path.sample_index).xy;
    return vec4(first ? light : numbers.xy, numbers.zw);
}

// The numbers for a camera's lens.
vec4 sample_lens(Path path) {
    uint seed = HAS_SHARING ? half_seed(params.seed, path.sample_index) : params.seed;
    uint index = HAS_SHARING ? half_index(path.sample_index) : path.sample_index;
    uvec4 key = lens_key(seed, path.pixel, index);
    return shifted_point(POINT(point_index(LENS_SET, index, key)), key);
}

uint valid_medium(uint medium) {
    return medium < params.medium_count ? medium : 0u;
}

float channel_of(vec3 v, uint channel) {
    return channel == 0u ? v.x : (channel == 1u ? v.y : v.z);
}

// Whether the flight's distance goes by lamps as well, up to what the ray meets. Not from the first vertex to the second of a path that is
// shared: see begin_open_flight().
bool goes_by_lamps(Path path, Medium medium) {
    bool connects = HAS_SHARING && path.sharing == 1u && path.depth == 1u;
    return HAS_EQUIANGULAR && medium.equiangular > 0.0 && !connects;
}

// Distance to the end of the flight with the extinction that holds from t_min on.
float flight_end(Path path) {
    if (!HAS_MEDIA || (HAS_GUIDES && path.probe)) {
        return path.far_end;
    }
    Medium medium = MEDIUM(valid_medium(path.medium));
    if (HAS_GRIDS && (medium.grids & (MEDIUM_VOXELS | MEDIUM_DENSITY)) != 0u) {
        return path.far_end;
    }
    vec3 sigma_t = medium.sigma_t;
    float sigma = HAS_CHROMATIC ? channel_of(sigma_t, path.channel) : sigma_t.x;
    float flight = free_flight(path.tau_left, HAS_ABSORBING ? medium.flight_share * sigma : sigma);
    if (HAS_SHARING && HAS_EQUIANGULAR && path.open) {
        flight = path.way;
    } else if (goes_by_lamps(path, medium)) {
        flight = free_flight(MAX_FLIGHT_TAU, medium.least_sigma_t);
    }
    return min(path.t_min + flight, path.far_end);
}

OpenFlight open_flight_of(Path path, Medium medium) {
    vec3 weights = HAS_CHROMATIC ? channel_weights(path.throughput) : vec3(0.0);
    return open_flight(medium, weights, path.origin, path.direction, path.lamp_way);
}

// The flight from the first vertex of a path that is shared to the second: whether it goes by a lamp as well, and then how far it gets.
void begin_open_flight(inout Path path, float u) {
    Medium medium = MEDIUM(valid_medium(path.medium));
    OpenFlight flight = open_flight_of(path, medium);
    path.open = path.sharing == 1u && path.depth == 1u && flight.share > 0.0;
    path.first_way = INFINITE_DISTANCE;
    if (path.open) {
        path.tau_left = minus_log_1m((u - flight.share) / (1.0 - flight.share));
        path.way = free_flight(path.tau_left, HAS_CHROMATIC ? channel_of(medium.sigma_t, path.channel) : medium.sigma_t.x);
        if (u < flight.share) {
            path.way = sample_equiangular(flight.stretch, u / flight.share);
        }
    }
}

// A new segment along path.direction: its flight from two random numbers.
void begin_segment(inout Path path, vec2 u) {
    path.last = NONE;
    path.shadow = false;
    path.passed = 1.0;
    path.absorbed = 1.0;
    if (HAS_MEDIA) {
        path.tau = 0.0;
        path.tau_left = minus_log_1m(u.x);
        if (HAS_CHROMATIC) {
            path.tau_rgb = vec3(0.0);
            path.channel = sample_channel(channel_weights(path.throughput), u.y);
        }
        if (HAS_OPEN_FLIGHTS) {
            begin_open_flight(path, u.x);
        }
    }
    if (HAS_GRIDS) {
        path.collisions = 0u;
        path.tau_mean = vec3(0.0);
        path.segment_weights = channel_weights(path.throughput);
    }
    path.t_max = flight_end(path);
}

// Probability that the flight got as far as it did, through media and masks. That of voxels is not known, so the mean of each cell
// stands for them: any weights of two strategies serve that add up to 1, so both must see the same.
float survival(Path path) {
    float passed = HAS_MASK ? path.passed : 1.0;
    if (!HAS_MEDIA) {
        return passed;
    }
    if (HAS_GRIDS) {
        return passed * dot(path.segment_weights, exp_minus(path.tau_mean));
    }
    return passed * (HAS_CHROMATIC ? survival_probability(channel_weights(path.throughput), path.tau_rgb) : exp_minus(path.tau));
}

vec3 survived_throughput(Path path) {
    if (HAS_GUIDES && path.probe) {
        return path.throughput * (HAS_CHROMATIC ? exp_minus(path.tau_rgb) : vec3(exp_minus(path.tau)));
    }
    if (HAS_MEDIA && HAS_CHROMATIC) {
        return path.throughput * survival_weight(channel_weights(path.throughput), path.tau_rgb);
    }
    return path.throughput;
}

// Chooses a light by the alias table; what is left of u is uniform again.
uint choose_light(inout float u) {
    if (!HAS_MANY_LIGHTS) {
        return 0u;
    }
    uint index = alias_line(params.light_count, u);
    Light line = LIGHT(index);
    return alias_keeps(line.alias_threshold, u) ? index : line.alias;
}
