// Unit kernel of lib/sampler.glsl: (seed, pixel, set, index), (bits, mask, 0, 0) in; the set's numbers (bit patterns)
// out.
#version 460
#include "lib/sampler.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { uvec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { uvec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 2u) {
        uvec4 at = inputs[2u * i], range = inputs[2u * i + 1u];
        outputs[i] = floatBitsToUint(sample_set(at.x, at.y, at.z, at.w, range.x, range.y));
    }
}
