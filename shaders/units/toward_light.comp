// Unit kernel of lib/toward_light.glsl: (unit vector to the point, u.x), (-, -, -, u.y) in; (direction, its density) out.
#version 460
#include "lib/layout.glsl"
#include "lib/toward_light.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 2u) {
        vec4 axis = inputs[2u * i];
        vec3 direction = sample_toward_light(axis.xyz, vec2(axis.w, inputs[2u * i + 1u].w));
        outputs[i] = vec4(direction, toward_light_pdf(axis.xyz, direction));
    }
}
