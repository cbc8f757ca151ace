// Connects the first vertices of the pixels of a group to the second vertices of all: lib/path_share.glsl. A workgroup traces the rays of
// one tile, as in path_trace.comp.
#version 460
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "lib/bindings.glsl"
#include "lib/path_share.glsl"
#include "lib/path_walk.glsl"
#include "lib/film.glsl"

layout(local_size_x = WORKGROUP) in;

shared uint next_sample;

void main() {
    if (gl_LocalInvocationIndex == 0u) {
        next_sample = 0u;
    }
    barrier();
    uint count = push.work.sample_count, samples_in_tile = TILE * TILE * count;
    uint first_slot = gl_WorkGroupID.x * samples_in_tile;
    uvec2 size = uvec2(params.crop_width, params.crop_height);
    uvec2 corner = tile_pixel(push.work.first_tile + gl_WorkGroupID.x, 0u, params.crop_width);
    // The sample whose first vertex is connected, and the number of the next pixel of its group.
    uint slot = 0u, next = SHARERS, own = 0u, pairs = 0u, to = 0u;
    uvec2 pixel = uvec2(0u);
    End first, second;
    vec3 weight = vec3(0.0);
    float density = 0.0;
    bool asked = false;
    Path path;
    path.shadow = true;
    Hit hit;
    Ray ray;
    GridRay grid;
    Walk walk = Walk(0u, 0u, 0u);
    [[dont_unroll]] while (true) {
        if (walk_rays(path, ray, grid, walk, hit)) {
            if (asked) {
                store_pair(pairs, own, to, end_connection(hit, second, weight, density));
            }
            asked = false;
            [[dont_unroll]] while (!asked) {
                if (next == SHARERS) {
                    slot = atomicAdd(next_sample, 1u);
                    if (slot >= samples_in_tile) {
                        break;
                    }
                    uint in_tile = slot / count;
                    uvec2 place = uvec2(in_tile % TILE, in_tile / TILE);
                    pixel = corner + place;
                    own = sharer_number(place);
                    pairs = pairs_of(gl_WorkGroupID.x * (samples_in_tile / SHARERS) + group_in_tile(place) * count + slot % count);
                    uint record = record_of(first_slot + slot);
                    if (all(lessThan(pixel, size))) {
                        first = load_end(record);
                    } else {
                        first.kind = END_NONE;
                    }
                    if (first.kind != END_NONE) {
                        vec4 left = SAMPLE(record + 2u);
                        path.left = uint(left.x) | uint(left.y) << 16u;
                        if (HAS_CHROMATIC) {
                            weight = SAMPLE(record + 3u).xyz;
                        }
                    }
                    next = 0u;
                }
                to = next;
                next += 1u;
                uvec2 other = sharer_pixel(pixel, to);
                if (first.kind != END_NONE && all(lessThan(other, size))) {
                    uvec2 place = other - corner;
                    uint record = record_of(first_slot + (place.y * TILE + place.x) * count + slot % count);
                    second = load_end(record + SECOND);
                    if (second.kind != END_NONE) {
                        asked = begin_connection(path, first, second, density);
                        if (asked && to == own && !HAS_CHROMATIC) {
                            // The path has been there.
                            hit.blocked = false;
                            hit.tau = SAMPLE(record + BASE).w;
                            store_pair(pairs, own, to, end_connection(hit, second, weight, density));
                            asked = false;
                            continue;
                        }
                    }
                }
                if (!asked) {
                    store_pair(pairs, own, to, vec4(0.0));
                }
            }
            if (!asked) {
                break;
            }
            begin_ray(path, ray, grid, walk, hit);
        }
    }
}
