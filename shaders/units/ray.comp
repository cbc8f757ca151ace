// Unit kernel of lib/ray.glsl: a ray (origin, direction), three corners and (centre, radius) in; (hit, along the
// normal, t, 0), (barycentric, both distances to the sphere) out.
#version 460
#include "lib/math.glsl"
#include "lib/ray.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 6u) {
        Ray ray;
        ray.origin = inputs[6u * i].xyz;
        ray.direction = inputs[6u * i + 1u].xyz;
        orthonormal_frame(ray.direction, ray.tangent, ray.bitangent);
        TriangleHit hit = intersect_triangle(ray, inputs[6u * i + 2u].xyz, inputs[6u * i + 3u].xyz, inputs[6u * i + 4u].xyz);
        vec4 sphere = inputs[6u * i + 5u];
        outputs[2u * i] = vec4(float(hit.hit), float(hit.along_normal), hit.t, 0.0);
        outputs[2u * i + 1u] = vec4(hit.barycentric, intersect_sphere(ray, sphere.xyz, sphere.w));
    }
}
