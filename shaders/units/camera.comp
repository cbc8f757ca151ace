// Unit kernel of lib/camera.glsl: corner, right, down, (film point, 0, 0) in; the direction out.
#version 460
#include "lib/camera.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 4u) {
        vec3 corner = inputs[4u * i].xyz, right = inputs[4u * i + 1u].xyz, down = inputs[4u * i + 2u].xyz;
        outputs[i] = vec4(camera_direction(corner, right, down, inputs[4u * i + 3u].xy), 0.0);
    }
}
