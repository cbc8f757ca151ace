// Unit kernel of lib/texture.glsl: (u, v, which texture, 0) in; (colour, 0) out.
#version 460
#include "lib/layout.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Textures { Texture textures[]; };
layout(set = 0, binding = 2, std430) readonly buffer Values { float values[]; };
layout(set = 0, binding = 3, std430) buffer Outputs { vec4 outputs[]; };
#define VALUE(i) values[i]
#include "lib/texture.glsl"

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length())) {
        outputs[i] = vec4(eval_texture(textures[uint(inputs[i].z)], inputs[i].xy), 0.0);
    }
}
