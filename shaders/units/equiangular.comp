// Unit kernel of lib/equiangular.glsl: (point, u), (origin, t_begin), (direction, t_end) in; (s, density at s, angle, distance)
// out.
#version 460
#include "lib/layout.glsl"
#include "lib/equiangular.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 3u) {
        vec4 point = inputs[3u * i], origin = inputs[3u * i + 1u], direction = inputs[3u * i + 2u];
        Stretch stretch = stretch_seen_from(point.xyz, origin.xyz, direction.xyz, origin.w, direction.w);
        float s = sample_equiangular(stretch, point.w);
        outputs[i] = vec4(s, equiangular_pdf(stretch, s), stretch.angle, stretch.distance);
    }
}
