// One step of the walk through the hierarchy (see src/pack/bvh.rs for the layout of a node). NODE_WORDS(i), the table of nodes as pairs of
// words, is that of the file that includes this one.
#include "lib/constants.glsl"

const uint NO_NODE = 0xffffffffu;

// The ray in the grid of the nodes' bounds: the slab test is bound * scale + offset.
struct GridRay {
    vec3 scale;
    vec3 offset;
    uvec3 negative; // all bits where the ray goes backwards, and enters by the upper bound
};

// A node as it is loaded: of the bounds, child k has byte k.
struct Node {
    uvec3 low;
    uvec3 high;
    uvec2 frame;     // the origin of its grid and the logarithms of its steps
    uint children;   // first inner child << 6 | kinds of the children 0 and 1
    uint primitives; // first primitive << 6 | kinds of the children 2 and 3
};

// Where a walk stands.
struct Walk {
    uint node;     // the next one; NO_NODE behind the last
    uint first;    // the primitives of leaves that were hit: the first of its node,
    uint pending;  // and a bit for each that is to be tested
    uint stack[WALK_STACK]; // each: first inner child of a node << 6 | three of its children, 2 bits each; the last one may be there twice or thrice
};

const uint INNER = 7u; // kind of a child that is a node
const int MISS = 0x7fffffff; // a distance behind all others

Node load_node(uint index) {
    uint at = 5u * index;
    uvec2 low_xy = NODE_WORDS(at), between = NODE_WORDS(at + 1u), high_yz = NODE_WORDS(at + 2u), frame = NODE_WORDS(at + 3u), links = NODE_WORDS(at + 4u);
    return Node(uvec3(low_xy, between.x), uvec3(between.y, high_yz), frame, links.x, links.y);
}

GridRay grid_ray(vec3 origin, vec3 direction, vec3 grid_origin, vec3 grid_step) {
    // A component too small to be inverted is as good as a small one: it moves the slabs by less than their margin.
    vec3 safe = mix(direction, vec3(1e-9), lessThan(abs(direction), vec3(1e-9)));
    vec3 inverse = 1.0 / safe;
    return GridRay(inverse * grid_step, (grid_origin - origin) * inverse, uvec3(ivec3(floatBitsToInt(safe)) >> 31));
}

// A walk of which nothing is left.
void end_walk(inout Walk walk) {
    walk.node = NO_NODE;
    walk.pending = 0u;
}

// A walk that begins at the root, if the ray meets the tree at all: from the corner 0 of its grid to `size`.
void start_walk(GridRay ray, vec3 size, float t_max, inout Walk walk) {
    vec3 one = ray.offset, other = size * ray.scale + ray.offset;
    vec3 t_near = min(one, other), t_far = max(one, other);
    float enter = max(max(t_near.x, t_near.y), max(t_near.z, 0.0)), leave = min(min(t_far.x, t_far.y), min(t_far.z, t_max));
    walk.node = enter <= leave ? 0u : NO_NODE;
    walk.pending = 0u;
    [[unroll]] for (uint k = 0u; k < WALK_STACK; ++k) {
        walk.stack[k] = NO_NODE;
    }
}

bool is_done(Walk walk) {
    return walk.node == NO_NODE && walk.pending == 0u;
}

// On from a node whose first inner child this is; `keys` are the distances to those that are hit, with their numbers as the last two bits.
void advance_walk(uint first_child, ivec4 keys, inout Walk walk) {
    // The nearest first.
    ivec2 least = min(keys.xz, keys.yw), most = max(keys.xz, keys.yw);
    int nearest = min(least.x, least.y), farthest = max(most.x, most.y);
    int one = max(least.x, least.y), two = min(most.x, most.y);
    int second = min(one, two), third = max(one, two);
    // One to three others go on the stack together, of which those that are not there repeat the one before.
    uint next = uint(second) & 3u, after = third == MISS ? next : uint(third) & 3u, last = farthest == MISS ? after : uint(farthest) & 3u;
    uint above = first_child << 6u | next << 4u | after << 2u | last;
    // Where nothing is hit, the entry on top gives the next node, and goes with its last one.
    uint top = walk.stack[0], of_top = top >> 4u & 3u, next_of_top = top >> 2u & 3u;
    bool push = second != MISS, pop = nearest == MISS, drop = pop && next_of_top == of_top;
    walk.node = first_child + (uint(nearest) & 3u);
    if (pop) {
        walk.node = top == NO_NODE ? NO_NODE : (top >> 6u) + of_top;
    }
    [[unroll]] for (uint k = 0u; k < WALK_STACK; ++k) {
        uint entry = walk.stack[k], below = k + 1u < WALK_STACK ? walk.stack[min(k + 1u, WALK_STACK - 1u)] : NO_NODE;
        walk.stack[k] = push ? above : drop ? below : entry;
        above = entry;
    }
    if (pop && !drop) {
        walk.stack[0] = (top & ~63u) | next_of_top << 4u | (top & 3u) << 2u | (top & 3u);
    }
}

// Tests the children of one node. Bit patterns of non-negative floats compare as integers do, which maps to one instruction; a negative far
// distance is a negative integer and loses as it should.
void step_walk(Node node, GridRay ray, float t_max, inout Walk walk) {
    vec3 origin = vec3(ivec3(node.frame.x & 0xffffu, node.frame.x >> 16u, node.frame.y & 0xffffu));
    vec3 offset = origin * ray.scale + ray.offset;
    uvec3 exponents = (uvec3(node.frame.y) >> uvec3(16u, 20u, 24u) & 15u) + 127u;
    vec3 scale = ray.scale * uintBitsToFloat(exponents << 23u);
    uvec3 flip = (node.low ^ node.high) & ray.negative;
    uvec3 near = node.low ^ flip, far = node.high ^ flip;
    uint kinds = node.children & 63u | (node.primitives & 63u) << 6u, before = 0u;
    walk.first = node.primitives >> 6u;
    ivec4 keys;
    [[unroll]] for (uint k = 0u; k < 4u; ++k) {
        vec3 t_near = vec3(ivec3(near >> 8u * k & 0xffu)) * scale + offset;
        vec3 t_far = vec3(ivec3(far >> 8u * k & 0xffu)) * scale + offset;
        int enter = max(max(floatBitsToInt(t_near.x), floatBitsToInt(t_near.y)), max(floatBitsToInt(t_near.z), 0));
        int leave = min(min(floatBitsToInt(t_far.x), floatBitsToInt(t_far.y)), min(floatBitsToInt(t_far.z), floatBitsToInt(t_max)));
        uint kind = kinds >> 3u * k & 7u;
        bool hit = enter <= leave, inner = kind == INNER;
        keys[k] = hit && inner ? enter & ~3 | int(k) : MISS;
        uint count = inner ? 0u : kind;
        walk.pending |= (hit ? (1u << count) - 1u : 0u) << before;
        before += count;
    }
    advance_walk(node.children >> 6u, keys, walk);
}

// The next primitive of those that wait for their test.
uint next_primitive(inout Walk walk) {
    uint bit = uint(findLSB(walk.pending));
    walk.pending &= walk.pending - 1u;
    return walk.first + bit;
}
