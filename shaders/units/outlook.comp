// Unit kernel of lib/outlook.glsl: (place, in medium), (axis, -), (throughput, -), (focus, -), (worth, -) in; (keep, cell as bits, 0, 0)
// out.
#version 460
#include "lib/layout.glsl"
#include "lib/outlook.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 5u) {
        vec4 place = inputs[5u * i];
        vec3 axis = inputs[5u * i + 1u].xyz, throughput = inputs[5u * i + 2u].xyz, focus = inputs[5u * i + 3u].xyz;
        Outlook outlook = Outlook(vec3(0.0), inputs[5u * i + 4u].xyz);
        float keep = keep_by_outlook(outlook, throughput, focus);
        outputs[i] = vec4(keep, uintBitsToFloat(outlook_cell(place.xyz, place.w > 0.0, axis)), 0.0, 0.0);
    }
}
