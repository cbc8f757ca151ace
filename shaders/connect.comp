// Connects the first vertices of the pixels of a group to the second vertices of all: lib/path_share.glsl. A workgroup traces the rays of
// one tile, as in path_trace.comp.
#version 460
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "lib/bindings.glsl"
#include "lib/path_share.glsl"
#include "lib/path_shadow.glsl"
#include "lib/path_walk.glsl"
#include "lib/film.glsl"

layout(local_size_x = WORKGROUP) in;

shared uint next_sample;

void main() {
    if (gl_LocalInvocationIndex == 0u) {
        next_sample = WORKGROUP;
    }
    barrier();
    uint count = push.work.sample_count, samples_in_tile = TILE * TILE * count;
    uint first_slot = gl_WorkGroupID.x * samples_in_tile;
    uvec2 size = uvec2(params.crop_width, params.crop_height);
    uvec2 corner = tile_pixel(TILE_NUMBER(gl_WorkGroupID.x), 0u, params.crop_width + group_margin(SHARERS).x);
    // The sample whose first vertex is connected, and the number of the next pixel of its group.
    uint slot = gl_LocalInvocationIndex, of_pixel = 0u, next = 0u, own = 0u, pairs = 0u, to = 0u;
    // Its place in the tile, and the pixel of the tile's first place.
    uvec2 place = uvec2(0u), origin = uvec2(0u);
    End first, second;
    vec3 weight = vec3(0.0);
    float density = 0.0, aimed = 1.0;
    Pivot pivot = Pivot(vec3(0.0), 0.0); // what the second vertex was found by
    bool asked = false;
    Path path;
    path.shadow = true;
    Hit hit;
    Ray ray;
    GridRay grid;
    Walk walk;
    end_walk(walk);
    [[dont_unroll]] while (true) {
        if (walk_rays(path, ray, grid, walk, hit)) {
            DenseWay through = DenseWay(0.0, 0.0, false);
            if (HAS_DENSITIES && asked) {
                through = way_through_density(path, hit);
            }
            if (HAS_GRIDS && asked && !hit.blocked && advance_shadow(path, hit, true, through)) {
                begin_ray(path, ray, grid, walk, hit);
                continue;
            }
            vec4 found = vec4(0.0);
            if (HAS_GRIDS && asked && !hit.blocked) {
                found = end_grid_connection(path, second, density);
            } else if (asked && !hit.blocked) {
                found = end_connection(path, hit, first, second, pivot, weight, density, aimed);
            }
            if (next > 0u) {
                store_pair(pairs, own, to, found);
            }
            // Without a tree all rays take the same time, and the invocations stay in step.
            if (next == SHARERS) {
                if (HAS_TREE) {
                    slot = atomicAdd(next_sample, 1u);
                } else {
                    slot += WORKGROUP;
                }
                next = 0u;
            }
            if (slot >= samples_in_tile) {
                break;
            }
            if (next == 0u) {
                // The pixels of a group one after the other: their rays to the same point are alike, and take the same way through the tree.
                uint of_group = slot / SHARERS, group = quotient(of_group, count);
                of_pixel = of_group - group * count;
                own = slot % SHARERS;
                place = sharer_place(group_place(group), own);
                uint record = record_of(first_slot + (place.y * TILE + place.x) * count + of_pixel);
                origin = corner - group_offset(SHARERS, push.work.first_sample + of_pixel);
                pairs = pairs_of(gl_WorkGroupID.x * (samples_in_tile / SHARERS) + of_group);
                first = load_end(record, 0u);
                first.kind = all(lessThan(origin + place, size)) ? first.kind : END_NONE;
                uvec2 left = whole(SAMPLE(record + 2u).xy);
                path.left = left.x | left.y << 16u;
                if (HAS_CHROMATIC) {
                    weight = SAMPLE(record + RECORD_WEIGHT).xyz;
                }
            }
            to = next;
            next += 1u;
            asked = false;
            uvec2 other = sharer_place(place, to);
            if (first.kind != END_NONE && all(lessThan(origin + other, size))) {
                uint record = record_of(first_slot + (other.y * TILE + other.x) * count + of_pixel);
                second = load_end(record, 1u);
                if (HAS_EQUIANGULAR) {
                    vec4 lamp = SAMPLE(record + PIVOT);
                    pivot = Pivot(lamp.xyz, lamp.w);
                }
                asked = second.kind != END_NONE && begin_connection(path, first, second, pivot, density, aimed);
                if (asked) {
                    if (HAS_GRIDS) {
                        path.pixel = (origin.y + place.y + params.crop_y) * params.film_width + origin.x + place.x + params.crop_x;
                        path.sample_index = push.work.first_sample + of_pixel;
                        path.segment = CONNECTION_SEGMENTS + to;
                    }
                    begin_ray(path, ray, grid, walk, hit);
                }
                if (!HAS_CHROMATIC && !HAS_GRIDS && to == own) {
                    // The path has been there.
                    end_walk(walk);
                    hit.blocked = false;
                    hit.tau = SAMPLE(record + BASE).w;
                    hit.first = HAS_EQUIANGULAR ? SAMPLE(record + RECORD_WEIGHT).w : INFINITE_DISTANCE;
                }
            }
        }
    }
}
