// Unit kernel of lib/bsdf.glsl: (wi, which surface), (wo, lobe), (u, 0, 0) in; (sampled direction, density), (weight, index),
// (value for wo, density), (Fresnel's reflectance at wi, cosine of refraction) and (a conductor's reflectance at wi) out.
#version 460
#include "lib/layout.glsl"
#include "lib/features.glsl"
layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Surfaces { Surface surfaces[]; };
layout(set = 0, binding = 2, std430) readonly buffer Values { float values[]; };
#define VALUE(i) values[i]
#include "lib/bsdf.glsl"
layout(set = 0, binding = 3, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= uint(inputs.length()) / 3u) {
        return;
    }
    vec3 wi = inputs[3u * i].xyz, wo = inputs[3u * i + 1u].xyz;
    Surface surface = surfaces[uint(inputs[3u * i].w)];
    vec2 u = inputs[3u * i + 2u].xy;
    BsdfSample found = sample_bsdf(surface, wi, u, inputs[3u * i + 1u].w);
    BsdfValue asked = eval_bsdf(surface, wi, wo);
    float cos_t;
    float fresnel = fresnel_dielectric(wi.z, surface.eta, cos_t);
    outputs[5u * i] = vec4(found.direction, found.pdf);
    outputs[5u * i + 1u] = vec4(found.weight, found.eta);
    outputs[5u * i + 2u] = vec4(asked.value, asked.pdf);
    outputs[5u * i + 3u] = vec4(fresnel, cos_t, 0.0, 0.0);
    outputs[5u * i + 4u] = vec4(fresnel_conductor(abs(wi.z), surface.transmittance, surface.extinction), 0.0);
}
