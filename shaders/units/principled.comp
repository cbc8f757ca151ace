// Unit kernel of lib/principled.glsl: (wi, which surface), (wo, lobe), (u, 0, 0) in; (sampled direction, density), (weight, index) and
// (value for wo, density) out.
#version 460
#include "lib/layout.glsl"
#include "lib/features.glsl"
layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Surfaces { Surface surfaces[]; };
layout(set = 0, binding = 2, std430) readonly buffer Values { float values[]; };
#define VALUE(i) values[i]
#include "lib/principled.glsl"
layout(set = 0, binding = 3, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= uint(inputs.length()) / 3u) {
        return;
    }
    vec3 wi = inputs[3u * i].xyz, wo = inputs[3u * i + 1u].xyz;
    Surface surface = surfaces[uint(inputs[3u * i].w)];
    BsdfSample found = sample_principled(surface, wi, inputs[3u * i + 2u].xy, inputs[3u * i + 1u].w);
    BsdfValue asked = eval_principled(surface, wi, wo);
    outputs[3u * i] = vec4(found.direction, found.pdf);
    outputs[3u * i + 1u] = vec4(found.weight, found.eta);
    outputs[3u * i + 2u] = vec4(asked.value, asked.pdf);
}
