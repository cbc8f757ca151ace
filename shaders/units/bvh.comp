// Unit kernel of lib/bvh.glsl: rays (origin, longest distance), (direction, 0) in; of each walk through a tree of
// triangles (distance to the nearest, its index (bit pattern), crossings in all, crossings along the normal less those
// against it) out.
#version 460
#include "lib/layout.glsl"
#include "lib/features.glsl"
#include "lib/math.glsl"
#include "lib/ray.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Nodes { uvec2 nodes[]; };
layout(set = 0, binding = 2, std430) readonly buffer Primitives { Primitive primitives[]; };
layout(set = 0, binding = 3, std430) readonly buffer ParamsBuffer { Params params; };
layout(set = 0, binding = 4, std430) buffer Outputs { vec4 outputs[]; };

#define NODE_WORDS(i) nodes[i]
#include "lib/bvh.glsl"

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= uint(inputs.length()) / 2u) {
        return;
    }
    Ray ray;
    ray.origin = inputs[2u * i].xyz;
    ray.direction = inputs[2u * i + 1u].xyz;
    orthonormal_frame(ray.direction, ray.tangent, ray.bitangent);
    GridRay grid = grid_ray(ray.origin, ray.direction, params.grid_origin, params.grid_step);

    // The nearest: the walk's end comes nearer with each hit.
    float nearest = inputs[2u * i].w;
    uint index = NONE;
    Walk walk;
    start_walk(grid, params.tree_size, nearest, walk);
    [[dont_unroll]] while (!is_done(walk)) {
        if (walk.pending == 0u) {
            step_walk(load_node(walk.node), grid, nearest, walk);
        } else {
            uint candidate = next_primitive(walk);
            Primitive primitive = primitives[candidate];
            TriangleHit hit = intersect_triangle(ray, primitive.a, primitive.b, primitive.c);
            if (hit.hit && hit.t > 0.0 && hit.t < nearest) {
                nearest = hit.t;
                index = candidate;
            }
        }
    }
    // All of them.
    float crossings = 0.0, outwards = 0.0;
    start_walk(grid, params.tree_size, inputs[2u * i].w, walk);
    [[dont_unroll]] while (!is_done(walk)) {
        if (walk.pending == 0u) {
            step_walk(load_node(walk.node), grid, inputs[2u * i].w, walk);
        } else {
            Primitive primitive = primitives[next_primitive(walk)];
            TriangleHit hit = intersect_triangle(ray, primitive.a, primitive.b, primitive.c);
            if (hit.hit && hit.t > 0.0 && hit.t < inputs[2u * i].w) {
                crossings += 1.0;
                outwards += hit.along_normal ? 1.0 : -1.0;
            }
        }
    }
    outputs[i] = vec4(nearest, uintBitsToFloat(index), crossings, outwards);
}
