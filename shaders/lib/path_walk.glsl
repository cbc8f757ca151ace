// The traversal of a path's rays, many at a time: a few steps through the hierarchy, at most one primitive where a leaf is pending, until
// half of the rays that run in step are done. Answering a ray costs much more than a step, so it waits for company: on lavapipe this
// takes a quarter off the time.
#include "lib/path_rays.glsl"
#include "lib/bvh.glsl"

const uint NODE_STEPS = 2u;

void begin_ray(Path path, out Ray ray, inout GridRay grid, inout Walk walk, out Hit hit) {
    hit = begin_hit(path);
    ray.origin = path.origin;
    ray.direction = path.direction;
    orthonormal_frame(ray.direction, ray.tangent, ray.bitangent);
    test_immediates(path, ray, hit);
    end_walk(walk);
    if (HAS_TREE && !hit.blocked) {
        grid = grid_ray(path.origin, path.direction, params.grid_origin, params.grid_step);
        start_walk(grid, params.tree_size, hit.t, walk);
    }
}

// Returns whether the ray is done.
bool walk_rays(Path path, Ray ray, GridRay grid, inout Walk walk, inout Hit hit) {
    bool busy;
    if (HAS_TREE) [[dont_unroll]] do {
        [[dont_unroll]] for (uint k = 0u; k < NODE_STEPS; ++k) {
            if (walk.node != NO_NODE && walk.pending == 0u) {
                step_walk(load_node(walk.node), grid, hit.t, walk);
            }
        }
        if (walk.pending != 0u) {
            uint index = next_primitive(walk);
            test_primitive(path, ray, index, PRIMITIVE(index), hit);
            if (hit.blocked) {
                end_walk(walk);
            }
        }
        busy = !is_done(walk);
    } while (subgroupAdd(busy ? 1u : 0u) > gl_SubgroupSize / 2u);
    return is_done(walk);
}
