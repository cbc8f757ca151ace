// Unit kernel of lib/camera.glsl: corner, right, down, (film point, two random numbers) in; the direction, the point of a lens with the
// axes right and down, and the direction from there with the plane in focus at distance 2 out.
#version 460
#include "lib/camera.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 4u) {
        vec3 corner = inputs[4u * i].xyz, right = inputs[4u * i + 1u].xyz, down = inputs[4u * i + 2u].xyz;
        vec4 numbers = inputs[4u * i + 3u];
        vec3 direction = camera_direction(corner, right, down, numbers.xy), point = lens_point(right, down, numbers.zw);
        outputs[3u * i] = vec4(direction, 0.0);
        outputs[3u * i + 1u] = vec4(point, 0.0);
        outputs[3u * i + 2u] = vec4(focused_direction(direction, point, 0.5), 0.0);
    }
}
