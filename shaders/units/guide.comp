// Unit kernel of lib/guide.glsl: (axis, sharpness), (u, chance, -) in; (direction, its density), and (the cell of the axis as a place, -, -, -) out.
#version 460
#include "lib/layout.glsl"
#include "lib/guide.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 2u) {
        Guide guide = Guide(inputs[2u * i].xyz, inputs[2u * i].w, inputs[2u * i + 1u].z);
        vec3 direction = sample_guide(guide, inputs[2u * i + 1u].xy);
        outputs[2u * i] = vec4(direction, guide_pdf(guide, direction));
        outputs[2u * i + 1u] = vec4(float(guide_cell(inputs[2u * i].xyz)), 0.0, 0.0, 0.0);
    }
}
