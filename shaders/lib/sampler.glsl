// The points of the integrand: four dimensions at a time, a "set". The first sets are Owen-scrambled Sobol points
// (Burley 2020), shuffled independently for each pixel and set; later sets are hashed.
//
// The dimensions are named, so that a feature that a scene lacks never shifts the numbers of another:
//   set 0          pixel x, pixel y, free flight, channel        of the camera's segment
//   set 2 s        roulette, unused, free flight, channel        of segment s > 0
//   set 2 s + 1    light x, light y, scatter x, scatter y        of the vertex at the end of segment s
#include "lib/rng.glsl"
#include "lib/sobol.glsl"

const uint SOBOL_SETS = 4u;

// A permutation of the bits' subtrees in which each bit depends on lower bits only: Laine and Karras (2011) with the
// constants of Vegdahl (2021). On reversed bits this is Owen's scrambling.
uint laine_karras(uint x, uint seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// Point number `index` of an Owen-scrambled Sobol sequence in four dimensions, of which the index takes the low `bits` bits.
vec4 sobol_set(uint seed, uint pixel, uint set, uint index, uint bits) {
    uvec4 key = pcg4d(uvec4(pixel, set, seed, 0x7f4a7c15u));
    // The shuffled index, reversed: bit 31 - b of it is bit b of the index. Only the low bits of the index may be set.
    uint reversed = laine_karras(bitfieldReverse(index), key.x ^ (key.w * 0x9e3779b9u));
    uvec4 point = uvec4(0u);
    [[dont_unroll]] for (uint bit = 0u; bit < bits; ++bit) {
        uint mask = uint(int(reversed << bit) >> 31);
        point.x ^= mask & (1u << bit);
        point.yzw ^= mask & SOBOL_REVERSED[bit];
    }
    point.x = laine_karras(point.x, key.x);
    point.y = laine_karras(point.y, key.y);
    point.z = laine_karras(point.z, key.z);
    point.w = laine_karras(point.w, key.w);
    return to_unit(bitfieldReverse(point));
}

// The four numbers of a set.
vec4 sample_set(uint seed, uint pixel, uint set, uint index, uint bits, uint mask) {
    if (set < SOBOL_SETS) {
        // Beyond the announced number of samples the sequence begins again with other scrambling.
        return sobol_set(seed + (index & ~mask), pixel, set, index & mask, bits);
    }
    return to_unit(pcg4d(uvec4(pixel, index, set, seed)));
}
