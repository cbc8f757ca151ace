// Unit kernel of lib/film.glsl: (tile, pixel, width of the crop window, divisor) in; (column, row, pixel / divisor, and in bytes the shift
// and the margin of groups of 4 (tile mod 3) pixels for the sample `pixel`) out.
#version 460
#include "lib/layout.glsl"
#include "lib/film.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { uvec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { uvec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length())) {
        uint sharers = 4u * (inputs[i].x % 3u);
        uvec2 offset = group_offset(sharers, inputs[i].y), margin = group_margin(sharers);
        uint shifts = offset.x | offset.y << 8u | margin.x << 16u | margin.y << 24u;
        outputs[i] = uvec4(tile_pixel(inputs[i].x, inputs[i].y, inputs[i].z), quotient(inputs[i].y, inputs[i].w), shifts);
    }
}
