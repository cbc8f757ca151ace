// Unit kernel of lib/warp.glsl: (u, v, 1 - cos of a cone, 0) in; a direction and its density of the sphere, the cosine
// hemisphere and the cone out.
#version 460
#include "lib/warp.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length())) {
        vec2 u = inputs[i].xy;
        vec3 hemisphere = square_to_cosine_hemisphere(u);
        outputs[3u * i] = vec4(square_to_sphere(u), square_to_sphere_pdf());
        outputs[3u * i + 1u] = vec4(hemisphere, square_to_cosine_hemisphere_pdf(hemisphere.z));
        outputs[3u * i + 2u] = vec4(square_to_cone(u, inputs[i].z), square_to_cone_pdf(inputs[i].z));
    }
}
