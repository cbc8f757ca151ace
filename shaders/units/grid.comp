// Unit kernel of lib/grid.glsl: (origin, first distance), (direction, last distance), (sigma_t, which grid) and (a number in [0, 1), seed,
// wanted density times length, 0) in; (value at the origin, 0), (transmittance, mean optical depth), (where the box begins and ends,
// distance of the first tentative collision or -1, its rate), (density times length, way to the wanted one, log(1 + the wanted), density at
// the origin) out. Voxels of three numbers are tracked, those of one are a density.
#version 460
#include "lib/layout.glsl"
#include "lib/features.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Grids { Grid grids[]; };
layout(set = 0, binding = 2, std430) readonly buffer Values { float values[]; };
layout(set = 0, binding = 3, std430) buffer Outputs { vec4 outputs[]; };
#define VALUE(i) values[i]
#include "lib/grid.glsl"

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 4u) {
        vec4 from = inputs[4u * i], to = inputs[4u * i + 1u], medium = inputs[4u * i + 2u], more = inputs[4u * i + 3u];
        Grid grid = grids[uint(medium.w)];
        uvec4 key = pcg4d(uvec4(uint(more.y), 1u, 2u, 3u));
        bool voxels = grid.size_x > 0u, tracked = (grid.flags & GRID_RGB) != 0u;
        outputs[4u * i] = vec4(0.0);
        outputs[4u * i + 1u] = vec4(0.0);
        outputs[4u * i + 2u] = vec4(0.0);
        if (tracked) {
            outputs[4u * i] = vec4(grid_value(grid, grid_local(grid, from.xyz)), 0.0);
            uint index = 0u;
            float mean = 0.0;
            vec3 passes = grid_transmittance(grid, medium.xyz, false, from.xyz, to.xyz, from.w, to.w, key, index, mean);
            outputs[4u * i + 1u] = vec4(passes, mean);
            vec2 clipped = clip_to_grid(grid, from.xyz, to.xyz, from.w, to.w);
            GridWalk walk = start_grid_walk(grid, from.xyz, to.xyz, from.w, to.w);
            float tau = minus_log_1m(more.x);
            bool found = walk_to_collision(grid, WALK_DELTA, walk, tau);
            outputs[4u * i + 2u] = vec4(clipped, found ? walk.t : -1.0, found ? walk.rate : 0.0);
        }
        vec4 dense = vec4(0.0, 0.0, log_1p(more.z), 0.0);
        if (voxels && !tracked) {
            dense.x = dense_way(grid, from.xyz, to.xyz, from.w, to.w, INFINITE_DISTANCE).dense;
            dense.y = dense_way(grid, from.xyz, to.xyz, from.w, to.w, more.z).way;
            dense.w = density_at(grid, from.xyz);
        } else if (!voxels) {
            dense.x = height_length(grid, from.xyz, to.xyz, from.w, to.w);
            dense.y = height_flight(grid, from.xyz, to.xyz, from.w, more.z);
        }
        outputs[4u * i + 3u] = dense;
    }
}
