// Unit kernel of lib/math.glsl: (u, x of exp, y and x of arctan2), (unit vector, z) in; (-log(1 - u), exp(-x), arctan2(y, x),
// 1 - exp(-z)), (tangent, -log(1 - z) for z below 1, else 0), (bitangent, sine of y clamped to [-1.5, 1.5]), (scaled_erfc of z up to 5) out.
#version 460
#include "lib/math.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 2u) {
        vec3 tangent, bitangent;
        orthonormal_frame(inputs[2u * i + 1u].xyz, tangent, bitangent);
        float z = inputs[2u * i + 1u].w;
        outputs[4u * i] = vec4(minus_log_1m(inputs[2u * i].x), exp_minus(inputs[2u * i].y), arctan2(inputs[2u * i].z, inputs[2u * i].w), one_minus_exp_minus(z));
        outputs[4u * i + 1u] = vec4(tangent, z < 1.0 ? minus_log_1m_small(z) : 0.0);
        outputs[4u * i + 2u] = vec4(bitangent, sine(clamp(inputs[2u * i].z, -1.5, 1.5)));
        outputs[4u * i + 3u] = vec4(scaled_erfc(min(z, 5.0)), 0.0, 0.0, 0.0);
    }
}
