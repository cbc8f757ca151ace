// The points of the integrand: four dimensions at a time, a "set". The first sets are low-discrepancy points from a table
// (see src/pack/sobol.rs), with a random digital shift for each pixel; later sets are hashed.
//
// Where pixels share paths, the free flight and the channel of the camera's segment are those of the whole group: first vertices at the
// same depth find each other's second vertices most easily. The directions from first vertices are those of one sequence for the group.
//
// The dimensions are named, so that a feature that a scene lacks never shifts the numbers of another:
//   set 0          pixel x, pixel y, free flight, channel        of the camera's segment
//   set 2 s        roulette, lobe or component, free flight, channel    of segment s > 0 (the second: of the vertex before)
//   LENS_SET             lens x, lens y               of the camera's ray, from a key of its own
//   set 2^31 + s   point of emission                             along segment s, in chromatic media
//   set 2 s + 1    light x, light y, scatter x, scatter y        of the vertex at the end of segment s
#include "lib/rng.glsl"

// The random words of a set: those of the whole pixel where they shift a table's points, those of the sample elsewhere.
uvec4 set_key(uint seed, uint pixel, uint set, uint index) {
    return pcg4d(uvec4(pixel, set, seed, set < SOBOL_SETS ? index >> POINT_BITS : index));
}

// The random words of the set for a camera's lens: those of set 0 with other words for the seed.
uvec4 lens_key(uint seed, uint pixel, uint index) {
    return set_key(seed ^ 0x6c656e73u, pixel, 0u, index);
}

// Where pixels share paths, the two halves of a render have numbers of their own, so that one can tell how to combine the other
// (src/render/reconstruct.rs): of each half, the samples in order.
uint half_seed(uint seed, uint index) {
    return index / RUN_SAMPLES % 2u == 0u ? seed : seed ^ 0x68616c66u;
}

uint half_index(uint index) {
    return index / (2u * RUN_SAMPLES) * RUN_SAMPLES + index % RUN_SAMPLES;
}

// The same for numbers that the pixels of a group have in common, from a key of its own for each half and shift.
uint group_seed(uint seed, uint index) {
    return seed ^ 0x67726f70u ^ index / RUN_SAMPLES % (2u * RUN_SHIFTS) << 16u;
}

uint group_index(uint index) {
    return index / (2u * RUN_SHIFTS * RUN_SAMPLES) * RUN_SAMPLES + index % RUN_SAMPLES;
}

// Which of the table's points is next, for a set below SOBOL_SETS, or LENS_SET. The lowest bits of the key do not reach the numbers.
uint point_index(uint set, uint index, uvec4 key) {
    return set * POINT_COUNT + ((index ^ (key.x & 0xffu) ^ (key.y & 0xffu) << 4u) & (POINT_COUNT - 1u));
}

// A point of the table, its digits shifted by the key, in [0, 1 - 2^-24].
vec4 shifted_point(uvec2 point, uvec4 key) {
    return to_unit(uvec4(point.x << 16u, point.x & 0xffff0000u, point.y << 16u, point.y & 0xffff0000u) ^ key);
}
