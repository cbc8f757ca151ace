// Connects the first vertices of the pixels of a group to the second vertices of the others: lib/path_share.glsl. A workgroup traces the
// rays of one tile, as in path_trace.comp.
#version 460
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "lib/bindings.glsl"
#include "lib/path_share.glsl"
#include "lib/path_walk.glsl"
#include "lib/film.glsl"

layout(local_size_x = WORKGROUP) in;

shared uint next_pair;

void main() {
    if (gl_LocalInvocationIndex == 0u) {
        next_pair = WORKGROUP;
    }
    barrier();
    uint samples_in_tile = TILE * TILE * push.work.sample_count;
    uint first_slot = gl_WorkGroupID.x * samples_in_tile;
    uint tile = push.work.first_tile + gl_WorkGroupID.x;
    uint pair = gl_LocalInvocationIndex;
    bool asked = false;
    uint place = 0u;
    float density = 0.0;
    vec3 weight = vec3(0.0);
    End second;
    Path path;
    path.shadow = true;
    Hit hit;
    Ray ray;
    GridRay grid;
    Walk walk = Walk(0u, 0u, 0u);
    [[dont_unroll]] while (true) {
        if (walk_rays(path, ray, grid, walk, hit)) {
            if (asked) {
                SAMPLE(place) = end_connection(hit, second, weight, density);
            }
            asked = false;
            [[dont_unroll]] while (!asked && pair < samples_in_tile * SHARERS) {
                uint slot = pair / SHARERS, n = pair % SHARERS;
                uint pixel_in_tile = slot / push.work.sample_count;
                uvec2 pixel = tile_pixel(tile, pixel_in_tile, params.crop_width), other = sharer_pixel(pixel, n);
                bool inside = all(lessThan(max(pixel, other), uvec2(params.crop_width, params.crop_height)));
                if (inside) {
                    uint other_slot = (other.y % TILE * TILE + other.x % TILE) * push.work.sample_count + slot % push.work.sample_count;
                    uint record = record_of(first_slot + slot), partner = record_of(first_slot + other_slot);
                    vec4 rest = SAMPLE(record + 3u);
                    vec4 weighted = SAMPLE(record + 2u);
                    End first = load_end(record, weighted.w);
                    second = load_end(partner + SECOND, SAMPLE(partner + 3u).w);
                    place = pair_of(first_slot + slot, n);
                    weight = weighted.xyz;
                    path.left = uint(rest.x) | uint(rest.y) << 16u;
                    asked = first.kind != END_NONE && second.kind != END_NONE;
                    if (asked) {
                        asked = begin_connection(path, first, second, density);
                    }
                    bool own = asked && all(equal(pixel, other)) && !HAS_CHROMATIC;
                    if (own) {
                        // The path has been there.
                        hit.blocked = false;
                        hit.tau = rest.z;
                        asked = false;
                    }
                    if (!asked) {
                        SAMPLE(place) = own ? end_connection(hit, second, weight, density) : vec4(0.0);
                    }
                }
                pair = atomicAdd(next_pair, 1u);
            }
            if (!asked) {
                break;
            }
            begin_ray(path, ray, grid, walk, hit);
        }
    }
}
