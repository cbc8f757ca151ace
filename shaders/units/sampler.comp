// Unit kernel of lib/sampler.glsl: (seed, pixel, set, index) and the table of points in; the set's numbers (bit patterns), and seed and
// index of the half and of the group out.
#version 460
#include "lib/layout.glsl"
#include "lib/sampler.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { uvec4 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Points { uvec2 points[]; };
layout(set = 0, binding = 2, std430) buffer Outputs { uvec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length())) {
        uvec4 at = inputs[i];
        uvec4 key = set_key(at.x, at.y, at.z, at.w);
        uvec2 point = at.z < SOBOL_SETS ? points[point_index(at.z, at.w, key)] : uvec2(0u);
        outputs[2u * i] = floatBitsToUint(shifted_point(point, key));
        outputs[2u * i + 1u] = uvec4(half_seed(at.x, at.w), half_index(at.w), group_seed(at.x, at.w), group_index(at.w));
    }
}
