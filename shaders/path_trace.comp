// The path tracer: which pixel, which sample, one ray after the other, store.
//
// A workgroup renders the samples of one tile of pixels. Its invocations take the next sample as soon as their path ends, so
// none waits for another's long path; each sample has a place of its own, so the order does not matter. One flat loop serves
// camera, extension and shadow rays.
#version 460
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "lib/bindings.glsl"
#include "lib/path.glsl"
#include "lib/path_walk.glsl"
#include "lib/film.glsl"

layout(local_size_x = WORKGROUP) in;

shared uint next_sample;

// The pixel, and the sample's index, of a slot of the tile with this corner. Beyond the left and the upper edge it is a large number.
uvec2 pixel_of(uint slot, uvec2 corner, uint count, out uint sample_index) {
    uint in_tile = quotient(slot, count);
    sample_index = push.work.first_sample + slot - in_tile * count;
    return corner + uvec2(in_tile % TILE, in_tile / TILE) - group_offset(SHARERS, sample_index);
}

void main() {
    if (gl_LocalInvocationIndex == 0u) {
        next_sample = WORKGROUP;
    }
    barrier();
    uint turn = gl_WorkGroupID.x;
    uvec2 corner = tile_pixel(TILE_NUMBER(turn), 0u, params.crop_width + group_margin(SHARERS).x);
    uint count = push.work.sample_count, samples_in_tile = TILE * TILE * count;
    uint slot = gl_LocalInvocationIndex;

    Path path;
    path.alive = false;
    path.shadow = false;
    Hit hit;
    Ray ray;
    GridRay grid;
    Walk walk;
    end_walk(walk);
    bool fresh = true; // the invocation has no path yet
    [[dont_unroll]] while (true) {
        if (walk_rays(path, ray, grid, walk, hit)) {
            if (!fresh) {
                path_answer(path, hit);
            }
            if (!path.alive && !path.shadow) {
                if (!fresh) {
                    vec3 radiance = path.radiance;
                    if (HAS_SHARING && path.sharing == 2u) {
                        share_part(path, 3u, path.shared_direction);
                        radiance = vec3(0.0);
                    }
                    store_sample(turn * samples_in_tile + slot, HAS_FILTER ? vec4(radiance * path.filter_weight, path.filter_weight) : vec4(radiance, 0.0));
                    slot = atomicAdd(next_sample, 1u);
                }
                fresh = false;
                // Pixels beyond the crop window's edge have no samples.
                uvec2 pixel = pixel_of(slot, corner, count, path.sample_index);
                while (slot < samples_in_tile && (pixel.x >= params.crop_width || pixel.y >= params.crop_height)) {
                    slot = atomicAdd(next_sample, 1u);
                    pixel = pixel_of(slot, corner, count, path.sample_index);
                }
                if (slot >= samples_in_tile) {
                    break;
                }
                if (HAS_SHARING) {
                    path.slot = turn * samples_in_tile + slot;
                    share_nothing(path.slot);
                }
                path_start(path, pixel);
            }
            begin_ray(path, ray, grid, walk, hit);
        }
    }
}
