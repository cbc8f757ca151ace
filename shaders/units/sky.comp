// Unit kernel of lib/sky.glsl, of the map whose texture comes first: (u, v, 0, 0), (unit direction, 0) in; (sampled direction,
// density), (its radiance, 0), (radiance from the direction asked for, its density), (its u, v, 0, 0) out.
#version 460
#extension GL_EXT_control_flow_attributes : require
#include "lib/layout.glsl"
#define VALUE(i) values[i]

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Textures { Texture textures[]; };
layout(set = 0, binding = 2, std430) readonly buffer Values { float values[]; };
layout(set = 0, binding = 3, std430) buffer Outputs { vec4 outputs[]; };
#include "lib/sky.glsl"

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 2u) {
        Texture sky = textures[0];
        SkySample found = sample_sky(sky, inputs[2u * i].xy);
        vec3 direction = inputs[2u * i + 1u].xyz;
        vec2 uv = sky_uv(direction);
        outputs[4u * i] = vec4(found.direction, found.pdf);
        outputs[4u * i + 1u] = vec4(found.radiance, 0.0);
        outputs[4u * i + 2u] = vec4(sky_radiance(sky, uv), sky_pdf(sky, uv.x, direction.y));
        outputs[4u * i + 3u] = vec4(uv, 0.0, 0.0);
    }
}
