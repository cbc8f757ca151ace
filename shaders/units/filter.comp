// Unit kernel of lib/filter.glsl, of the table that begins with the values: (u, lower bound, upper bound, 0), (cells, radius, offset, 0)
// in; (offset, weight, density at the offset asked for, 0) out.
#version 460
#extension GL_EXT_control_flow_attributes : require

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Values { float values[]; };
layout(set = 0, binding = 2, std430) buffer Outputs { vec4 outputs[]; };
#define VALUE(i) values[i]
#include "lib/filter.glsl"

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 2u) {
        vec4 asked = inputs[2u * i], filter_of = inputs[2u * i + 1u];
        FilterSample found = sample_filter(0u, uint(filter_of.x), filter_of.y, asked.yz, asked.x);
        float pdf = filter_pdf(0u, uint(filter_of.x), filter_of.y, asked.yz, filter_of.z);
        outputs[i] = vec4(found.offset, found.weight, pdf, 0.0);
    }
}
