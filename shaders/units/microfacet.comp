// Unit kernel of lib/microfacet.glsl: (w, alpha along x), (another direction, along y), (u, whether GGX) in; (the facet's normal that u
// samples, its density), (its masking of w, of the other direction, the density of sampling it) out.
#version 460
#include "lib/features.glsl"
#include "lib/microfacet.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 3u) {
        vec3 w = inputs[3u * i].xyz, other = inputs[3u * i + 1u].xyz;
        vec2 alpha = vec2(inputs[3u * i].w, inputs[3u * i + 1u].w);
        bool ggx = inputs[3u * i + 2u].z != 0.0;
        vec3 m = sample_facet(w, inputs[3u * i + 2u].xy, alpha, ggx);
        outputs[2u * i] = vec4(m, facet_density(m, alpha, ggx));
        outputs[2u * i + 1u] =
            vec4(facet_masking(w, m, alpha, ggx), facet_masking(other, m, alpha, ggx), facet_pdf(w, m, alpha, ggx), 0.0);
    }
}
