// The path tracer: which pixel, which sample, one ray after the other, store.
//
// A workgroup renders the samples of one tile of pixels. Its invocations take the next sample as soon as their path ends, so
// none waits for another's long path; each sample has a place of its own, so the order does not matter. One flat loop serves
// camera, extension and shadow rays: a few steps through the hierarchy, at most one primitive where a leaf is pending, and
// once half of the rays that run in step are done, their paths' next rays. Answering a ray costs much more than a step, so it
// waits for company: on lavapipe this takes a quarter off the time.
#version 460
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "lib/bindings.glsl"
#include "lib/path.glsl"
#include "lib/bvh.glsl"
#include "lib/film.glsl"

layout(local_size_x = WORKGROUP) in;

shared uint next_sample;

const uint NODE_STEPS = 8u;

void main() {
    if (gl_LocalInvocationIndex == 0u) {
        next_sample = WORKGROUP;
    }
    barrier();
    // Neighbouring tiles cost alike: a step coprime to their number spreads them over the processors.
    uint turn = (gl_WorkGroupID.x * push.work.tile_step) % push.work.tile_count;
    uint tile = push.work.first_tile + turn;
    uint samples_in_tile = TILE * TILE * push.work.sample_count;
    uint slot = gl_LocalInvocationIndex;

    Path path;
    path.alive = false;
    path.shadow = false;
    Hit hit;
    Ray ray;
    GridRay grid;
    Walk walk = Walk(0u, 0u, 0u);
    bool fresh = true; // the invocation has no path yet
    [[dont_unroll]] while (true) {
        bool busy;
        if (HAS_TREE) [[dont_unroll]] do {
            [[dont_unroll]] for (uint k = 0u; k < NODE_STEPS; ++k) {
                if (walk.node < walk.end && walk.leaf == 0u) {
                    step_walk(NODE(walk.node), grid, hit.t, NODE_COPIES, walk);
                }
            }
            if (walk.leaf != 0u) {
                uint index = next_primitive(walk);
                test_primitive(path, ray, index, PRIMITIVE(index), hit);
                if (hit.blocked) {
                    walk = Walk(walk.end, walk.end, 0u);
                }
            }
            busy = walk.node < walk.end || walk.leaf != 0u;
        } while (subgroupAdd(busy ? 1u : 0u) > gl_SubgroupSize / 2u);
        if (walk.node >= walk.end && walk.leaf == 0u) {
            if (!fresh) {
                path_answer(path, hit);
            }
            if (!path.alive && !path.shadow) {
                if (!fresh) {
                    SAMPLE(turn * samples_in_tile + slot) = HAS_FILTER ? vec4(path.radiance * path.filter_weight, path.filter_weight) : vec4(path.radiance, 0.0);
                    slot = atomicAdd(next_sample, 1u);
                }
                fresh = false;
                // Pixels beyond the crop window's edge have no samples.
                uvec2 pixel = tile_pixel(tile, slot / push.work.sample_count, params.crop_width);
                while (slot < samples_in_tile && (pixel.x >= params.crop_width || pixel.y >= params.crop_height)) {
                    slot = atomicAdd(next_sample, 1u);
                    pixel = tile_pixel(tile, slot / push.work.sample_count, params.crop_width);
                }
                if (slot >= samples_in_tile) {
                    break;
                }
                path.pixel = (pixel.y + params.crop_y) * params.film_width + pixel.x + params.crop_x;
                path.sample_index = push.work.first_sample + slot % push.work.sample_count;
                path_start(path);
            }
            hit = begin_hit(path);
            ray.origin = path.origin;
            ray.direction = path.direction;
            orthonormal_frame(ray.direction, ray.tangent, ray.bitangent);
            test_immediates(path, ray, hit);
            if (HAS_TREE) {
                grid = grid_ray(path.origin, path.direction, params.grid_origin, params.grid_step);
                walk = start_walk(grid, params.node_count, NODE_COPIES);
                walk.node = hit.blocked ? walk.end : walk.node;
            }
        }
    }
}
