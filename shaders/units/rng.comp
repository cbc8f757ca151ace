// Unit kernel of lib/rng.glsl: words in; their hashes, and what they are as numbers (bit patterns), out.
#version 460
#include "lib/rng.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { uvec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { uvec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length())) {
        outputs[2u * i] = pcg4d(inputs[i]);
        outputs[2u * i + 1u] = floatBitsToUint(to_unit(inputs[i]));
    }
}
