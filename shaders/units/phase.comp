// Unit kernel of lib/phase.glsl: (g, u, v, choice), (direction before, 0), (first component plus one, components, 0, 0) in;
// (1 - cos, cos, sin, density at that angle), (direction after, phase function of both directions) out. No components: Henyey and
// Greenstein's function with g.
#version 460
#include "lib/layout.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Phases { Phase phases[]; };
layout(set = 0, binding = 2, std430) readonly buffer Values { float values[]; };
layout(set = 0, binding = 3, std430) buffer Outputs { vec4 outputs[]; };
#define PHASE(i) phases[i]
#define VALUE(i) values[i]
#include "lib/math.glsl"
#include "lib/warp.glsl"
#include "lib/phase.glsl"

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 3u) {
        vec4 numbers = inputs[3u * i];
        float g = numbers.x;
        vec3 before = inputs[3u * i + 1u].xyz;
        uvec2 components = uvec2(inputs[3u * i + 2u].xy);
        uint phase = components.x | components.y << 24u;
        PhaseAngle angle;
        if (phase == 0u) {
            angle = sample_henyey_greenstein(g, numbers.y);
        } else {
            angle = sample_mixture(phase, numbers.y, numbers.w);
        }
        vec3 local = from_polar(angle.cos_theta, angle.sin_theta, numbers.z);
        vec3 after = from_frame(before, local);
        float pdf, value;
        if (phase == 0u) {
            pdf = henyey_greenstein_from(g, angle.one_minus_cos);
            value = eval_henyey_greenstein(g, before, after);
        } else {
            pdf = eval_mixture(phase, vec3(0.0, 0.0, 1.0), local);
            value = eval_mixture(phase, before, after);
        }
        outputs[2u * i] = vec4(angle.one_minus_cos, angle.cos_theta, angle.sin_theta, pdf);
        outputs[2u * i + 1u] = vec4(after, value);
    }
}
