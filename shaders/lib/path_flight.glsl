// Where a flight through a medium ends: at a surface, or at a point where it scatters.
#include "lib/path_state.glsl"
#include "lib/path_aim.glsl"
#include "lib/equiangular.glsl"
#include "lib/light.glsl"
#include "lib/ray.glsl"
#include "lib/grid.glsl"

struct FlightEnd {
    bool scatters;
    float way;      // since t_min
    vec3 weight;    // of a path that scatters: albedo, transmittance and density of t together
    float dense;    // density times length of the way, in units of the medium's sigma_t; 0 where voxels have been accounted for
};

// How far the free flight gets in the medium from t_min on.
float free_way(Path path, Medium medium) {
    return free_flight(path.tau_left, HAS_CHROMATIC ? channel_of(medium.sigma_t, path.channel) : medium.sigma_t.x);
}

// The weight of a flight that goes on over that of one with the whole extinction coefficient, where flights take a part of it; and that of
// one that ends.
float rare_passage_weight(Medium medium, float way) {
    return exp_minus((1.0 - medium.flight_share) * medium.sigma_t.x * way);
}

float rare_collision_weight(Medium medium, float way) {
    return HAS_ABSORBING ? rare_passage_weight(medium, way) / medium.flight_share : 1.0;
}

// Where the flight ends on a ray that meets a surface at t_end, or nothing before t_end. A flight in a medium with equiangular
// sampling is traced as far as it may get at all; whether it scatters on the way is decided by its free flight, and where, by
// one of two techniques: the free flight itself, or with the probability `equiangular` distances that are likely near a light.
// The weight has the density of both (one-sample MIS).
FlightEnd end_flight(Path path, Medium medium, float t_end, bool surface) {
    FlightEnd end = FlightEnd(!surface && t_end < path.far_end, t_end - path.t_min, medium.albedo, t_end - path.t_min);
    float sigma = HAS_CHROMATIC ? channel_of(medium.sigma_t, path.channel) : medium.sigma_t.x;
    float way = t_end - path.t_min;
    bool mixed = goes_by_lamps(path, medium);
    if (mixed) {
        end.scatters = path.tau_left < sigma * way;
    }
    if (!end.scatters) {
        return end;
    }
    vec3 weights = HAS_CHROMATIC ? channel_weights(path.throughput) : vec3(0.0);
    if (!HAS_EQUIANGULAR || !mixed) {
        // Not the difference of two distances, which are rounded.
        end.way = free_flight(path.tau_left, HAS_ABSORBING ? medium.flight_share * sigma : sigma);
        if (HAS_OPEN_FLIGHTS && path.open) {
            end.way = path.way;
            vec3 collision = medium.sigma_t * exp_minus(medium.sigma_t * end.way);
            float free = HAS_CHROMATIC ? dot(weights, collision) : collision.x;
            end.weight /= open_factor(open_flight_of(path, medium), end.way, true, free);
        }
        if (HAS_CHROMATIC) {
            end.weight *= scatter_weight(weights, path.tau_rgb + medium.sigma_t * end.way, medium.sigma_t, vec3(1.0));
        }
        end.weight *= rare_collision_weight(medium, end.way);
        return end;
    }
    float scatters = one_minus_exp_minus(sigma * way);
    float u = min(one_minus_exp_minus(path.tau_left) / scatters, 0.99999994);
    float share = medium.equiangular;
    Stretch stretch = stretch_seen_from(find_pivot(path, path.segment).point, path.origin, path.direction, path.t_min, t_end);
    float s;
    if (u < share) {
        s = sample_equiangular(stretch, u / share);
    } else {
        s = min(free_flight(minus_log_1m_small((u - share) / (1.0 - share) * scatters), sigma), way);
    }
    float density = equiangular_pdf(stretch, s);
    end.way = s;
    if (HAS_CHROMATIC) {
        vec3 collision = medium.sigma_t * exp_minus(path.tau_rgb + medium.sigma_t * s);
        vec3 ends = exp_minus(path.tau_rgb) * one_minus_exp_minus(medium.sigma_t * way);
        end.weight = medium.albedo * collision / ((1.0 - share) * dot(weights, collision) + share * dot(weights, ends) * density);
    } else {
        end.weight = medium.albedo / (1.0 - share + share * scatters * density / (sigma * exp_minus(sigma * s)));
    }
    return end;
}

// The way of a flight, or of a shadow ray, through a medium with a density, up to where the ray ends.
DenseWay way_through_density(Path path, Hit hit) {
    DenseWay found = DenseWay(0.0, 0.0, false);
    Medium medium = MEDIUM(valid_medium(path.medium));
    if ((medium.grids & MEDIUM_DENSITY) != 0u && !(path.shadow && hit.blocked)) {
        float t_end = hit.primitive != NONE ? min(hit.t, path.t_max) : path.t_max;
        float wanted = path.shadow ? INFINITE_DISTANCE : free_way(path, medium);
        found = dense_way(GRID((medium.grids & 0xffffffu) - 1u), path.origin, path.direction, path.t_min, t_end, wanted);
    }
    return found;
}

// The same in a medium with a density: its optical depths are those of a homogeneous medium, with density times length in the place of
// lengths.
FlightEnd end_dense_flight(Path path, Medium medium, DenseWay found) {
    FlightEnd end = FlightEnd(found.ends, found.way, medium.albedo, found.dense);
    if (HAS_CHROMATIC && end.scatters) {
        end.weight = scatter_weight(channel_weights(path.throughput), path.tau_rgb + medium.sigma_t * found.dense, medium.sigma_t, medium.albedo);
    }
    return end;
}

// What a medium emits at a point, per unit of length.
vec3 emission_at(Medium medium, vec3 point) {
    if ((medium.grids & MEDIUM_EMISSION_GRID) == 0u) {
        return medium.emission;
    }
    Grid grid = GRID((medium.grids & 0xffffffu) + 1u);
    vec3 local = grid_local(grid, point);
    bool outside = any(lessThan(local, vec3(0.0))) || any(greaterThan(local, vec3(1.0)));
    return outside ? vec3(0.0) : medium.emission * grid_value(grid, local);
}

// The same through voxels, by delta tracking (Woodcock et al. 1965) with the rates of their cells: at a tentative collision light
// scatters with the probability sigma_t / rate of the flight's channel, and else goes on. The throughput has the probabilities of
// these decisions in all channels (one-sample MIS over the channels; Miller et al. 2019). Adds what is emitted, at each tentative
// collision where `shines` (Raab et al. 2008).
FlightEnd end_voxel_flight(inout Path path, Medium medium, float t_end, bool shines) {
    uint first = (medium.grids & 0xffffffu) - 1u;
    Grid grid = GRID(first);
    FlightEnd end = FlightEnd(false, t_end - path.t_min, medium.albedo, 0.0);
    if (HAS_CHROMATIC) {
        path.throughput *= survival_weight(channel_weights(path.throughput), path.tau_rgb);
        path.tau_rgb = vec3(0.0);
    }
    uvec4 key = set_key(params.seed, path.pixel, FLIGHT_STREAMS + path.segment, path.sample_index);
    GridWalk walk = start_grid_walk(grid, path.origin, path.direction, path.t_min, t_end);
    float tau = path.tau_left;
    [[dont_unroll]] while (walk_to_collision(grid, WALK_DELTA, walk, tau)) {
        vec4 u = stream_numbers(key, path.collisions);
        path.collisions += 1u;
        vec3 sigma = medium.sigma_t * grid_value(grid, walk_point(grid, walk));
        if (HAS_EMISSION && shines) {
            path.radiance += path.throughput * emission_at(medium, path.origin + path.direction * walk.t) / walk.rate;
        }
        end.scatters = u.x * walk.rate < (HAS_CHROMATIC ? channel_of(sigma, path.channel) : sigma.x);
        if (HAS_CHROMATIC) {
            vec3 share = end.scatters ? sigma : max(walk.rate - sigma, vec3(0.0));
            path.throughput *= share * (sum_components(path.throughput) / dot(path.throughput, share));
        }
        tau = minus_log_1m(u.y);
        if (end.scatters) {
            end.way = walk.t - path.t_min;
            break;
        }
    }
    path.tau_left = tau;
    path.tau_mean += walk.mean;
    return end;
}

// The same from the first vertex of a path that pixels share to the second. The density of that must be known, so the flight is one through
// the means of the cells, and the throughput has an estimate of what truly passes, and scatters, over that. A medium's vertex that is shared
// does without: there the throughput begins anew.
FlightEnd end_mean_flight(inout Path path, Medium medium, float t_end) {
    Grid grid = GRID((medium.grids & 0xffffffu) - 1u);
    FlightEnd end = FlightEnd(false, t_end - path.t_min, medium.albedo, 0.0);
    GridWalk walk = start_grid_walk(grid, path.origin, path.direction, path.t_min, t_end);
    end.scatters = walk_to_collision(grid, WALK_MEAN, walk, path.tau_left);
    path.tau_mean += walk.mean;
    if (end.scatters) {
        end.way = walk.t - path.t_min;
    }
    if (!end.scatters || medium.phase != 0u) {
        uvec4 key = set_key(params.seed, path.pixel, FLIGHT_STREAMS + path.segment, path.sample_index);
        float mean = 0.0;
        float t = path.t_min + end.way;
        vec3 passes = grid_transmittance(grid, medium.sigma_t, true, path.origin, path.direction, path.t_min, t, key, path.collisions, mean);
        vec3 scattered = end.scatters ? medium.sigma_t * grid_value(grid, walk_point(grid, walk)) / walk.rate : vec3(1.0);
        path.throughput *= passes * scattered / exp_minus(mean);
    }
    return end;
}

// The extinction coefficient of a gray medium at a point, and that by which flights go that end at second vertices.
vec2 extinction_at(Medium medium, vec3 point) {
    uint first = (medium.grids & 0xffffffu) - 1u;
    float sigma = medium.sigma_t.x;
    if (HAS_VOXELS && (medium.grids & MEDIUM_VOXELS) != 0u) {
        Grid grid = GRID(first);
        vec3 local = grid_local(grid, point);
        return vec2(sigma * grid_value(grid, local).x, grid_mean(grid, local));
    }
    if (HAS_DENSITIES && (medium.grids & MEDIUM_DENSITY) != 0u) {
        sigma *= density_at(GRID(first), point);
    }
    return vec2(sigma);
}

// The albedo's factor at the end of a flight.
vec3 albedo_factor(Medium medium, vec3 point) {
    if (!HAS_GRIDS || (medium.grids & MEDIUM_ALBEDO_GRID) == 0u) {
        return vec3(1.0);
    }
    Grid grid = GRID(medium.grids & 0xffffffu);
    return grid_value(grid, grid_local(grid, point));
}

// A stretch of a shadow ray from t_min to t_end, within one medium. Where nothing passes, its mean optical depth is known only where the
// `whole` is asked for.
void pass_medium(inout Path path, float t_end, bool whole, DenseWay through) {
    Medium medium = MEDIUM(valid_medium(path.medium));
    uint first = (medium.grids & 0xffffffu) - 1u;
    if (HAS_VOXELS && (medium.grids & MEDIUM_VOXELS) != 0u) {
        uvec4 key = set_key(params.seed, path.pixel, SHADOW_STREAMS + path.segment, path.sample_index);
        float mean = 0.0;
        path.light_passes *= grid_transmittance(GRID(first), medium.sigma_t, whole, path.origin, path.direction, path.t_min, t_end, key, path.collisions, mean);
        path.tau_mean += mean;
        return;
    }
    float dense = t_end - path.t_min;
    if (HAS_DENSITIES && (medium.grids & MEDIUM_DENSITY) != 0u) {
        dense = through.dense;
    }
    path.tau_rgb += medium.sigma_t * dense;
    path.tau_mean += medium.sigma_t * dense;
}

// How near to a surface a point of a flight may round to its other side, with some room for rays that graze it.
float near_distance(Path path, float t) {
    return 4.0 * offset_distance(max_component(abs(path.origin)) + t);
}

// Moves a point to its side of a primitive, if rounding left it closer than a surface's own points are kept. `side` is +1 for
// the side that the normal points to. In a medium that is opaque over a few roundings, a vertex beyond the boundary would
// start a walk outside that never comes to an end.
vec3 keep_on_side(Primitive primitive, vec3 point, float side) {
    if (HAS_SPHERES && (primitive.surface & PRIMITIVE_SPHERE) != 0u) {
        vec3 offset = point - primitive.a;
        float distance = length(offset), outwards = side * primitive.b.y;
        float largest = max_component(abs(primitive.a)) + primitive.b.x;
        float missing = vertex_clearance(largest) - outwards * (distance - primitive.b.x);
        return missing > 0.0 ? point + offset * (outwards * missing / distance) : point;
    }
    vec3 normal = normalize(cross(primitive.b - primitive.a, primitive.c - primitive.a));
    float largest = max_component(max(abs(primitive.a), max(abs(primitive.b), abs(primitive.c))));
    float missing = vertex_clearance(largest) - side * dot(point - primitive.a, normal);
    // Beyond the edge of the primitive its plane means nothing, but then the point is far from it.
    return missing > 0.0 && missing < 64.0 * vertex_clearance(largest) ? point + normal * (side * missing) : point;
}

// The surface that the end of a flight is so close to that it may round to the other side: the one behind it (`hit`), or else the one
// before it (`path.last`), or NONE. `side` is that of the flight, as in keep_on_side().
struct FlightSide {
    uint primitive;
    float side;
};

FlightSide flight_side(Path path, Hit hit, float way) {
    float t = path.t_min + way;
    float close = near_distance(path, t);
    if (hit.primitive != NONE && hit.t - t < close) {
        return FlightSide(hit.primitive, hit.along_normal ? -1.0 : 1.0);
    }
    return FlightSide(way < close ? path.last : NONE, path.last_along_normal ? 1.0 : -1.0);
}

// The end of a flight, on its side of the primitive. It is found from the boundary through which the ray came, so that what the ray's
// distances lose to rounding on a long way does not matter.
vec3 flight_point(Path path, Primitive primitive, FlightSide side, float way) {
    vec3 point = path.last != NONE ? path.anchor + path.direction * way : path.origin + path.direction * (path.t_min + way);
    return side.primitive != NONE ? keep_on_side(primitive, point, side.side) : point;
}

// Goes through a boundary. Crossings at one place, `again` but for the first, may come in any order (rounding
// alone decides, where faces coincide); only their sum counts.
void enter_medium(inout Path path, uint from, uint to, bool again) {
    uint base = again || path.medium == NONE ? path.medium_sum : medium_code(path.medium);
    path.medium_sum = base + medium_code(to) - medium_code(from);
    uint found = medium_of_code(path.medium_sum, to, params.medium_count);
    // Where the boundary does not expect the medium in front of it but behind, the vertex lay on the other side by rounding.
    path.medium = found == NONE && path.medium == to ? to : found;
}
