// The estimator: a path as a coroutine that asks for one ray at a time. Only this file and its parts, `path_*.glsl`, combine
// concepts.
//
// A path's life:
//   1. path_start       a ray from the camera, a free flight for its first segment
//   2. (traversal)      the nearest primitive within the free flight, or none
//   3. meet             a boundary without a surface: change the medium, go on along the same ray  -> 2
//                       nothing within the flight: scatter in the medium                           -> 4
//                       a surface: add what it emits, reflect                                      -> 4
//                       nothing at all: add what comes from infinitely far, end
//   4. scatter          choose a light, ask for a shadow ray, or for a probe behind glass; sample the next direction
//   5. (traversal)      everything along the shadow ray, in any order
//   6. path_light       add the light that got through
//   7. next_segment     roulette, a free flight -> 2
#include "lib/path_state.glsl"
#include "lib/path_vertex.glsl"
#include "lib/path_lights.glsl"
#include "lib/path_rays.glsl"
#include "lib/path_flight.glsl"
#include "lib/path_shadow.glsl"
#include "lib/path_share.glsl"
#include "lib/path_probe.glsl"
#include "lib/camera.glsl"
#include "lib/filter.glsl"
#include "lib/film.glsl"
#include "lib/outlook.glsl"

// Depth at which roulette begins to end paths that lose nothing, so that a closed scene without absorption ends. A path gets
// to depth d with a probability near (RELENTLESS_DEPTH / d)²: slowly enough for dense media that absorb nothing, in which the number
// of events has a long tail; a constant probability would give the longest paths weights beyond all bounds.
const uint RELENTLESS_DEPTH = 256u;

// The sets of random numbers by which light meets masks or passes them begin here, beyond those of any segment.
const uint MASK_SETS = 0x80000000u;

// The sets by which one of several BSDFs of a surface is chosen, one for each segment.
const uint BLEND_SETS = 0xc0000000u;
const float ONE_MINUS_EPSILON = 1.0 - 1.0 / 16777216.0;

// Where a sample of the pixel with the given centre lies on the film, in pixels, and its factor by the filter.
vec2 filtered_place(inout Path path, vec2 center, vec2 u) {
    vec2 low = params.sample_area_begin - center, high = params.sample_area_end - center;
    FilterSample x = sample_filter(params.first_filter_value, params.filter_cells, params.filter_radius, vec2(low.x, high.x), u.x);
    FilterSample y = sample_filter(params.first_filter_value, params.filter_cells, params.filter_radius, vec2(low.y, high.y), u.y);
    path.filter_weight = x.weight * y.weight;
    return center + vec2(x.offset, y.offset);
}

// Begins a path at a pixel of the crop window.
void path_start(inout Path path, uvec2 pixel) {
    uint row = pixel.y + params.crop_y, column = pixel.x + params.crop_x;
    path.pixel = row * params.film_width + column;
    if (HAS_SHARING) {
        uvec2 place = pixel + group_offset(SHARERS, path.sample_index), group = place / SHARE_SIZE;
        path.group = group.y * params.film_width + group.x;
        path.member = sharer_number(place);
    }
    vec4 u = sample_camera(path);
    vec2 place = vec2(column, row) + u.xy;
    path.filter_weight = 1.0;
    if (HAS_FILTER && params.filter_cells > 0u) {
        place = filtered_place(path, vec2(column, row) + 0.5, u.xy);
    }
    vec2 film = place * vec2(params.inverse_width, params.inverse_height);
    vec3 direction = camera_direction(params.camera_corner, params.camera_right, params.camera_down, film);
    path.origin = params.camera_origin;
    if (HAS_ORTHOGRAPHIC) {
        path.origin += direction;
        direction = params.lens_u;
    } else if (HAS_LENS) {
        vec3 point = lens_point(params.lens_u, params.lens_v, sample_lens(path).xy);
        path.origin += point;
        direction = focused_direction(direction, point, params.inverse_focus);
    }
    float depth_to_distance = length(direction);
    path.direction = direction / depth_to_distance;
    path.t_min = params.near_clip * depth_to_distance;
    path.far_end = HAS_FAR_CLIP ? params.far_clip * depth_to_distance : INFINITE_DISTANCE;
    path.throughput = vec3(1.0);
    path.radiance = vec3(0.0);
    path.segment = 0u;
    path.depth = 0u;
    path.pdf = 0.0;
    path.guide_pdf = 0.0;
    path.probe = false;
    path.scattered_pdf = 0.0;
    path.alive = true;
    path.eta_scale = 1.0;
    path.foreseen = false;
    if (HAS_PILOT) {
        uvec2 block = uvec2(quotient(pixel.x, params.block_side), quotient(pixel.y, params.block_side));
        uint first = params.first_block + 4u * (block.y * params.block_columns + block.x);
        path.focus = vec3(VALUE(first), VALUE(first + 1u), VALUE(first + 2u));
    }
    path.sharing = 0u;
    path.before = vec3(1.0);
    path.left = NONE;
    path.crossings = 0u;
    path.medium = params.camera_medium;
    begin_segment(path, u.zw);
}

// Roulette at a vertex, by what the pilot expects of the rest of the path. Returns whether the path goes on.
bool goes_on(inout Path path, Vertex vertex) {
    vec3 place = (vertex.point - params.pilot_origin) * params.pilot_scale;
    uint first = params.first_cell + 8u * outlook_cell(place, vertex.in_medium, vertex.axis);
    Outlook outlook;
    outlook.mean = vec3(VALUE(first), VALUE(first + 1u), VALUE(first + 2u));
    outlook.worth = vec3(VALUE(first + 3u), VALUE(first + 4u), VALUE(first + 5u));
    path.foreseen = outlook.worth.x >= 0.0;
    vec3 throughput = vertex.in_medium ? path.throughput * vertex.albedo : path.throughput;
    float keep = path.foreseen ? keep_by_outlook(outlook, HAS_SHARING ? throughput * path.before : throughput, path.focus) : 1.0;
    // The second vertex has points of the table to itself, unless the other roulette begins so early.
    uint set = path.segment == 1u && RR_DEPTH > 1u ? 2u : 2u * path.segment + 2u;
    path.alive = sample_set(path, set).x < keep;
    path.radiance += throughput * outlook.mean * (path.alive ? 1.0 - 1.0 / keep : 1.0);
    path.throughput /= keep;
    return path.alive;
}

// Scatters at a vertex: the shadow ray and the next direction.
void scatter(inout Path path, Vertex vertex) {
    path.depth += 1u;
    path.shadow = false;
    path.alive = path.depth < MAX_DEPTH;
    if (!path.alive) {
        return;
    }
    vec4 u = vertex_numbers(path, path.segment);
    float lobe = HAS_LOBES || HAS_PHASES ? sample_set(path, 2u * path.segment + 2u).y : 0.0;
    Pivot pivot = Pivot(vec3(0.0), 0.0);
    Aim aim = Aim(vec3(0.0, 0.0, 1.0), 0.0, 0.0);
    if (HAS_EQUIANGULAR) {
        pivot = find_pivot(path, path.segment + 1u);
        aim = find_aim(path, vertex, pivot);
    }
    float scattered;
    BsdfSample next = sample_next(vertex, aim, u.zw, lobe, scattered);
    if (HAS_SHARING && HAS_EQUIANGULAR) {
        share_aim(path, vertex, pivot, aim, next, scattered);
    }
    path.scattered_pdf = weighing_pdf(path, vertex, scattered);
    float pdf = is_common(path, vertex) ? aimed_pdf(aim, path.scattered_pdf, next.direction) : next.pdf;
    path.point = vertex.point;
    path.t_min = 0.0;
    path.last = NONE;
    path.far_end = INFINITE_DISTANCE;
    bool sealed = HAS_SEALED && (MEDIUM(valid_medium(path.medium)).grids & MEDIUM_SEALED) != 0u
        && (vertex.in_medium || (HAS_GUIDES && (vertex.surface.flags & SURFACE_ORIENTED) == 0u));
    bool samples_light = !sealed && (vertex.in_medium || !HAS_LOBES || bsdf_has_density(vertex.surface));
    BsdfValue mirror = BsdfValue(vec3(0.0), 0.0);
    if (HAS_DIELECTRIC && HAS_AREA_LIGHTS && HAS_LIGHT_SAMPLING && !vertex.in_medium) {
        mirror = mirrored(vertex.surface, vertex.incident);
    }
    if (HAS_DIELECTRIC && mirror.pdf > 0.0) {
        path.shadow = sample_mirrored(path, vertex, mirror, u.x);
        pdf = goes_through(vertex, next.direction) ? 0.0 : -mirror.pdf;
    } else {
        path.shadow = samples_light && sample_light(path, vertex, aim, u.xy, u.zw);
    }
    path.next_direction = next.direction;
    path.next_medium = medium_towards(vertex, path.medium, next.direction);
    if (HAS_GRIDS && path.shadow) {
        path.medium = path.light_medium;
        path.tau_rgb = vec3(0.0);
        path.tau_mean = vec3(0.0);
        path.light_passes = vec3(1.0);
        path.passed = 1.0;
        path.collisions = 0u;
    }
    vec3 arriving = path.throughput;
    path.throughput *= next.weight;
    Guide guide = Guide(vec3(0.0), 0.0, 0.0);
    if (HAS_GUIDES) {
        bool bends = path.guide_pdf > 0.0 && !vertex.in_medium && is_smooth_glass(vertex.surface) && goes_through(vertex, next.direction);
        if (bends) {
            pdf = path.pdf * passing_probability(vertex);
        } else if (sealed) {
            guide = find_guide(path, vertex.point);
        }
        path.guide_pdf = guide.chance > 0.0 ? guide_pdf(guide, next.direction) : (bends ? path.guide_pdf : 0.0);
    }
    path.pdf = sealed && path.guide_pdf == 0.0 ? 0.0 : pdf; // light that only scattering finds counts in full
    path.eta_scale *= next.eta * next.eta;
    path.alive = max_component(path.throughput) > 0.0;
    if (!is_finite(path.throughput)) {
        // The sample is lost, and must be seen to be: no comparison may drop it.
        path.radiance += path.throughput;
        path.alive = false;
    }
    if (HAS_GUIDES && path.alive && u.x < guide.chance) {
        send_probe(path, vertex, guide, arriving, vec2(u.x / guide.chance, u.y));
    }
}

// Begins the segment after a vertex, unless roulette ends the path.
void next_segment(inout Path path) {
    path.segment += 1u;
    vec4 u = sample_set(path, 2u * path.segment);
    // A path whose second vertex is shared gets there.
    if (path.depth >= RR_DEPTH && !(HAS_SHARING && path.depth < 2u)) {
        float most = path.depth < RELENTLESS_DEPTH ? 1.0 : 1.0 - 2.0 / float(path.depth);
        float worth = 3.0 * max_component(HAS_SHARING ? path.throughput * path.before : path.throughput) * (HAS_DIELECTRIC ? path.eta_scale : 1.0);
        float keep = HAS_PILOT && path.foreseen ? most : min(worth, most);
        path.alive = path.alive && u.x < keep;
        path.throughput /= keep;
    }
    path.direction = path.next_direction;
    path.origin = offset_origin(path, path.direction);
    path.medium = HAS_DIELECTRIC || HAS_GRIDS ? path.next_medium : path.medium;
    path.t_min = 0.0;
    begin_segment(path, u.zw);
}

// Whether light passes a mask. The choice has the probabilities of the two ways, so the throughput stays.
bool passes_mask(inout Path path, Surface surface, Primitive primitive, Hit hit) {
    float opacity = opacity_at(surface, primitive, hit.primitive, path.origin + path.direction * hit.t, hit.barycentric, path.direction);
    float u = sample_set(path, MASK_SETS + path.crossings).z; // the sets are those of emission as well, which takes the first
    path.crossings += 1u;
    path.passed *= 1.0 - opacity;
    return u >= opacity;
}

// Goes on behind a coloured pane, or a stretch of a medium that only absorbs. What it takes is an optical depth of the flight, so that
// whatever weighs a flight knows of it; but no flight ends there. Instead the channel is chosen anew by what is left of each, and the
// throughput loses what all of them lose together.
void pass_absorbing(inout Path path, vec3 depth) {
    if (max_component(depth) == 0.0) {
        return;
    }
    vec3 weights = channel_weights(path.throughput);
    float before = dot(weights, exp_minus(path.tau_rgb));
    path.tau_rgb += depth;
    if (HAS_GRIDS) {
        path.tau_mean += depth;
    }
    vec3 left = weights * exp_minus(path.tau_rgb);
    float sum = sum_components(left);
    if (sum == 0.0) {
        path.alive = false;
        return;
    }
    float passes = sum / before;
    path.throughput *= passes;
    path.absorbed *= passes;
    path.channel = sample_channel(left / sum, sample_set(path, MASK_SETS + path.crossings).w);
    path.crossings += 1u;
}

// The end of the medium in which an open flight began, after `way`. From here on it is a free flight, with a channel and a length of its own.
void leave_open_flight(inout Path path, Medium medium, float way) {
    vec3 tau = medium.sigma_t * way;
    float passage = mean_passage(HAS_CHROMATIC ? channel_weights(path.throughput) : vec3(0.0), tau);
    path.throughput /= open_factor(open_flight_of(path, medium), way, false, passage);
    path.open = false;
    path.first_way = way;
    vec4 u = sample_set(path, MASK_SETS + path.crossings);
    path.crossings += 1u;
    path.tau_left = minus_log_1m(u.z);
    if (HAS_CHROMATIC && passage > 0.0) {
        path.throughput *= exp_minus(tau) / passage;
        path.pdf *= passage;
        path.tau_rgb = vec3(0.0);
        path.channel = sample_channel(channel_weights(path.throughput), u.w);
    }
}

// Puts the one of the BSDFs of a surface in its place that acts at this vertex: by the side, or by chance. A choice has the share of the
// BSDF as its probability, so the throughput stays, and all that follows at the vertex knows of one BSDF alone.
void choose_surface(Path path, inout Surface surface, Primitive primitive, Hit hit, bool back) {
    float u = sample_set(path, BLEND_SETS + path.segment).x;
    [[dont_unroll]] while (surface.other != 0u) {
        bool taken = back != ((surface.flags & SURFACE_INVERTED) != 0u);
        if ((surface.flags & SURFACE_SIDES) == 0u) {
            float share = share_at(surface, primitive, hit.primitive, path.origin + path.direction * hit.t, hit.barycentric);
            taken = u < share;
            // What is left of the number is uniform again.
            u = taken ? min(u / share, ONE_MINUS_EPSILON) : u;
        }
        if (!taken) {
            break;
        }
        surface = SURFACE(surface.other - 1u);
    }
}

// What a ray that extends the path meets. Returns whether it is a vertex that scatters; else the path ends, or goes on along the
// same ray. (Kernels compute both sides of a branch for some paths or others, so nothing stands here twice.)
bool meet(inout Path path, Hit hit, DenseWay through, out Vertex vertex) {
    bool surface_hit = hit.primitive != NONE && hit.t < path.t_max;
    float t = surface_hit ? hit.t : path.t_max;

    Medium medium;
    FlightEnd end = FlightEnd(false, 0.0, vec3(0.0), 0.0);
    bool probe = HAS_GUIDES && path.probe;
    if (HAS_MEDIA) {
        medium = MEDIUM(valid_medium(path.medium));
    }
    if (HAS_MEDIA && !probe) {
        bool voxels = HAS_VOXELS && (medium.grids & MEDIUM_VOXELS) != 0u;
        if (HAS_VOXELS && voxels) {
            if (HAS_SHARING && path.sharing == 1u && path.depth == 1u) {
                end = end_mean_flight(path, medium, t);
            } else {
                end = end_voxel_flight(path, medium, t, emitters_seen(path));
            }
        } else if (HAS_DENSITIES && (medium.grids & MEDIUM_DENSITY) != 0u) {
            end = end_dense_flight(path, medium, through);
        } else {
            end = end_flight(path, medium, t, surface_hit);
        }
        if (HAS_EMISSION && !voxels) {
            add_medium_emission(path, medium, end.scatters ? free_way(path, medium) : t - path.t_min, end.scatters);
        }
    }
    FlightSide side = FlightSide(hit.primitive, 0.0);
    if (HAS_MEDIA && end.scatters) {
        side = flight_side(path, hit, end.way);
    }
    Primitive primitive;
    if (side.primitive != NONE) {
        primitive = PRIMITIVE(side.primitive);
    }
    vertex.in_medium = end.scatters;
    vertex.axis = path.direction;
    vertex.base = path.direction;
    vertex.fade = 0.0;
    vertex.normal = path.direction;
    path.shadow = false;
    if (end.scatters) {
        path.offset = 0.0;
        path.normal = path.direction;
        path.left = NONE;
        vertex.point = flight_point(path, primitive, side, end.way);
        if (HAS_SHARING) {
            path.tau += medium.sigma_t.x * end.way;
            path.absorbed *= rare_collision_weight(medium, end.way);
        }
        vertex.g = medium.g;
        vertex.phase = medium.phase;
        vertex.albedo = HAS_GRIDS ? end.weight * albedo_factor(medium, vertex.point) : end.weight;
        return true;
    }
    if (HAS_ABSORBING && HAS_CHROMATIC && medium.flight_share == 0.0 && !probe) {
        pass_absorbing(path, medium.sigma_t * (t - path.t_min));
        if (!path.alive) {
            return false;
        }
    } else if (HAS_MEDIA) {
        // The optical depth of the way through the medium since t_min.
        float way = HAS_GRIDS ? end.dense : t - path.t_min;
        float sigma = HAS_CHROMATIC ? channel_of(medium.sigma_t, path.channel) : medium.sigma_t.x;
        path.tau_left -= way * (HAS_ABSORBING ? medium.flight_share * sigma : sigma);
        if (HAS_ABSORBING && medium.flight_share < 1.0 && !probe) {
            float left = rare_passage_weight(medium, way);
            path.throughput *= left;
            path.absorbed *= left;
        }
        if (HAS_CHROMATIC) {
            path.tau_rgb += medium.sigma_t * way;
        } else {
            path.tau += medium.sigma_t.x * way;
        }
        if (HAS_GRIDS) {
            path.tau_mean += medium.sigma_t * way;
        }
        if (HAS_OPEN_FLIGHTS && path.open) {
            leave_open_flight(path, medium, way);
        }
    }
    if (!surface_hit) {
        add_sky(path);
        path.alive = false;
        return false;
    }
    Surface surface = SURFACE(primitive.surface & ~(PRIMITIVE_BOUNDARY | PRIMITIVE_SPHERE));
    bool crosses = HAS_BOUNDARIES && (primitive.surface & PRIMITIVE_BOUNDARY) != 0u;
    vec3 point, normal;
    float largest;
    surface_point(primitive, path, hit, point, normal, largest);
    if (!crosses) {
        add_emission(path, primitive, t, normal);
        crosses = HAS_MASK && (surface.flags & SURFACE_MASK) != 0u && passes_mask(path, surface, primitive, hit);
    }
    if ((HAS_BOUNDARIES || HAS_MASK) && crosses) {
        if (HAS_TINTS && (surface.flags & SURFACE_PANE) != 0u) {
            pass_absorbing(path, pane_depth(surface, primitive, hit.primitive, path.origin + path.direction * hit.t, hit.barycentric));
        }
        path.anchor = point;
        cross_surface(path, surface, hit);
        return false;
    }
    if (HAS_GUIDES && path.guide_pdf > 0.0) {
        path.pdf *= survival(path);
    }
    path.throughput = survived_throughput(path);
    bool back = dot(path.direction, normal) > 0.0;
    if (HAS_BLENDS && surface.other != 0u) {
        choose_surface(path, surface, primitive, hit, back);
    }
    // Where a surface is seen from one side, but its shading normal from the other one, nothing is reflected.
    bool seen = !(HAS_ONE_SIDED && back && (surface.flags & (SURFACE_TWO_SIDED | SURFACE_ORIENTED)) == 0u);
    bool turned = back && !(HAS_DIELECTRIC && (surface.flags & SURFACE_ORIENTED) != 0u);
    vec3 axis = normal;
    if (HAS_SHADING_NORMALS && (surface.flags & SURFACE_SMOOTH) != 0u) {
        axis = shading_normal(hit.primitive, hit.barycentric, normal);
    }
    axis = turned ? -axis : axis;
    normal = turned ? -normal : normal;
    vec3 tangent, bitangent;
    if (HAS_ANISOTROPIC) {
        orthonormal_frame(axis, tangent, bitangent);
        if (surface.alpha != surface.alpha_v) {
            tangent = surface_tangent(primitive, hit.primitive, point, axis);
        }
    }
    vec3 base = axis;
    float fade = 0.0;
    if (HAS_RELIEFS && surface.relief_texture != 0u) {
        fade = turn_frame(surface, primitive, hit.primitive, point, hit.barycentric, -path.direction, turned, axis, tangent);
        if (surface.alpha == surface.alpha_v) {
            orthonormal_frame(axis, tangent, bitangent);
        }
    }
    if (HAS_TEXTURES && (surface.textures_1 | (surface.textures_2 & 0xffffu)) != 0u) {
        apply_textures(surface, hit.primitive, texture_coordinates(primitive, hit.primitive, point, hit.barycentric), hit.barycentric);
    }
    path.offset = offset_distance(largest);
    path.normal = normal;
    path.left = is_sphere(primitive) ? NONE : hit.primitive;
    vec3 incident = to_surface_frame(tangent, axis, -path.direction);
    vertex = Vertex(point, axis, false, 0.0, 0u, vec3(0.0), surface, incident, tangent, normal, base, fade);
    path.alive = seen && sides_agree(vertex, incident.z, -path.direction);
    return path.alive;
}

// Adds what a shadow ray brings, or takes it further.
void path_light(inout Path path, Hit hit, DenseWay through) {
    if (HAS_GRIDS && !hit.blocked && advance_shadow(path, hit, false, through)) {
        return;
    }
    if (!hit.blocked) {
        vec3 transmittance = vec3(1.0);
        float survives = 1.0;
        if (HAS_GRIDS) {
            transmittance = path.light_passes * exp_minus(path.tau_rgb);
            survives = dot(channel_weights(path.light_channels), exp_minus(path.tau_mean));
        } else if (HAS_MEDIA) {
            if (HAS_CHROMATIC) {
                transmittance = exp_minus(max(hit.tau_rgb, vec3(0.0)));
                survives = dot(channel_weights(path.light_channels), transmittance);
            } else {
                survives = exp_minus(max(hit.tau, 0.0));
                transmittance = vec3(survives);
            }
        }
        if (HAS_MASK) {
            transmittance *= hit.passed;
            survives *= hit.passed;
        }
        if (HAS_VOLUME_LIGHTS && LIGHT(path.light).kind == LIGHT_VOLUME) {
            // The point lies in the sphere about the medium, but perhaps not in the medium itself.
            survives = 1.0;
            transmittance = float(hit.medium) == LIGHT(path.light).edge_1.y ? transmittance : vec3(0.0);
        }
        path.radiance += path.light_weight * transmittance * power_heuristic(path.pdf_ratio * survives);
        if (HAS_SHARING && HAS_HENYEY_GREENSTEIN && path.sharing == 2u && path.depth == 2u) {
            share_part(path, 1u, path.direction);
        }
    }
    path.shadow = false;
}

// The path has come to a vertex: it is kept for others, the path may end, or it scatters. Returns whether it goes on.
bool leave(inout Path path, Vertex vertex) {
    bool leaves = true;
    if (HAS_SHARING && path.depth < 2u) {
        share_vertex(path, vertex);
    }
    if (HAS_PILOT && path.depth > 0u) {
        leaves = goes_on(path, vertex);
    }
    if (HAS_SHARING && HAS_HENYEY_GREENSTEIN && path.sharing == 2u && path.depth == 1u) {
        share_ended(path);
    }
    if (leaves) {
        scatter(path, vertex);
    }
    if (HAS_SHARING && path.sharing == 2u && path.depth == 2u) {
        path.shared_direction = path.next_direction;
    }
    return leaves;
}

// Takes a probe further, which has come to a vertex or not. Returns whether it has ended, and the path goes on.
bool answer_probe(inout Path path, Vertex vertex, bool arrived) {
    if (arrived ? refract_probe(path, vertex) : path.alive) {
        return false;
    }
    end_probe(path);
    return true;
}

// Answers the ray that the path asked for.
void path_answer(inout Path path, Hit hit) {
    DenseWay through = DenseWay(0.0, 0.0, false);
    if (HAS_DENSITIES) {
        through = way_through_density(path, hit);
    }
    bool leaves = true; // a vertex
    if (HAS_LIGHT_SAMPLING && path.shadow) {
        path_light(path, hit, through);
    } else {
        Vertex vertex;
        leaves = meet(path, hit, through, vertex);
        if (HAS_GUIDES && path.probe) {
            leaves = answer_probe(path, vertex, leaves);
        } else if (leaves) {
            leaves = leave(path, vertex);
        }
    }
    if (leaves && path.alive && !path.shadow && !(HAS_GUIDES && path.probe)) {
        next_segment(path);
    }
}
