// Unit kernel of lib/bsdf.glsl: four cosines in; the diffuse BSDF and its density out.
#version 460
#include "lib/bsdf.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length())) {
        vec4 cosines = inputs[i];
        outputs[2u * i] = vec4(eval_diffuse(cosines.x), eval_diffuse(cosines.y), eval_diffuse(cosines.z), eval_diffuse(cosines.w));
        outputs[2u * i + 1u] = vec4(diffuse_pdf(cosines.x), diffuse_pdf(cosines.y), diffuse_pdf(cosines.z), diffuse_pdf(cosines.w));
    }
}
