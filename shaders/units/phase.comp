// Unit kernel of lib/phase.glsl: (g, u, v, 0), (direction before, 0) in; (1 - cos, cos, sin, density at that angle),
// (direction after, phase function of both directions) out.
#version 460
#include "lib/math.glsl"
#include "lib/warp.glsl"
#include "lib/phase.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 2u) {
        float g = inputs[2u * i].x;
        vec3 before = inputs[2u * i + 1u].xyz;
        PhaseAngle angle = sample_henyey_greenstein(g, inputs[2u * i].y);
        vec3 after = from_frame(before, from_polar(angle.cos_theta, angle.sin_theta, inputs[2u * i].z));
        float pdf = henyey_greenstein_from(g, angle.one_minus_cos);
        outputs[2u * i] = vec4(angle.one_minus_cos, angle.cos_theta, angle.sin_theta, pdf);
        outputs[2u * i + 1u] = vec4(after, eval_henyey_greenstein(g, before, after));
    }
}
