// One step of the walk through the hierarchy (see src/pack/bvh.rs for the layout of a node).
#include "lib/constants.glsl"

// The ray in the grid of the nodes' bounds: the slab test is bound * scale + offset.
struct GridRay {
    vec3 scale;
    vec3 offset;
    uvec3 near_shift; // which half of a word holds the bound where the ray enters; only used with a single copy of the tree
    uint octant;
};

// Where a walk stands.
struct Walk {
    uint node;
    uint end;
    uint leaf; // 0: none pending; else 1 + (first primitive << 3 | primitives left - 1)
};

GridRay grid_ray(vec3 origin, vec3 direction, vec3 grid_origin, vec3 grid_step) {
    // A component too small to be inverted is as good as a small one: it moves the slabs by less than their margin.
    vec3 safe = mix(direction, vec3(1e-9), lessThan(abs(direction), vec3(1e-9)));
    vec3 inverse = 1.0 / safe;
    bvec3 negative = lessThan(safe, vec3(0.0));
    GridRay ray;
    ray.scale = inverse * grid_step;
    ray.offset = (grid_origin - origin) * inverse;
    ray.near_shift = uvec3(negative) * 16u;
    ray.octant = uint(negative.x) | uint(negative.y) << 1 | uint(negative.z) << 2;
    return ray;
}

// The walk's start in the copy of the tree for the ray's octant.
Walk start_walk(GridRay ray, uint node_count, uint copies) {
    uint first = copies == 8u ? ray.octant * node_count : 0u;
    return Walk(first, first + node_count, 0u);
}

// Tests one node. Bit patterns of non-negative floats compare as integers do, which maps to one instruction; a negative far
// distance is a negative integer and loses as it should.
void step_walk(uvec4 node, GridRay ray, float t_max, uint copies, inout Walk walk) {
    uvec3 near_bits = node.xyz, far_bits = node.xyz >> 16u;
    if (copies != 8u) {
        near_bits = node.xyz >> ray.near_shift;
        far_bits = node.xyz >> (16u - ray.near_shift);
    }
    vec3 t_near = vec3(ivec3(near_bits & 0xffffu)) * ray.scale + ray.offset;
    vec3 t_far = vec3(ivec3(far_bits & 0xffffu)) * ray.scale + ray.offset;
    int enter = max(max(floatBitsToInt(t_near.x), floatBitsToInt(t_near.y)), max(floatBitsToInt(t_near.z), 0));
    int leave = min(min(floatBitsToInt(t_far.x), floatBitsToInt(t_far.y)), min(floatBitsToInt(t_far.z), floatBitsToInt(t_max)));
    bool hit = enter <= leave;
    bool leaf = int(node.w) < 0;
    walk.node = hit || leaf ? walk.node + 1u : node.w;
    walk.leaf = hit && leaf ? (node.w & 0x7fffffffu) + 1u : 0u;
}

// The primitive that a pending leaf asks for; the leaf moves on to its next one.
uint next_primitive(inout Walk walk) {
    uint word = walk.leaf - 1u;
    // One further, one fewer left: + 8 - 1 in the word.
    walk.leaf = (word & 7u) == 0u ? 0u : walk.leaf + 7u;
    return word >> 3u;
}
