// Sums the samples of each pixel, block by block and in order, so that the sums do not depend on who rendered a sample or when.
#version 460
#include "lib/layout.glsl"
#include "lib/features.glsl"
#include "lib/film.glsl"

layout(local_size_x = WORKGROUP) in;

layout(set = 0, binding = 0, std430) readonly buffer Samples { vec4 samples[]; };
// For each block and pixel of the dispatch: the sum and, behind it, the sum of squares.
layout(set = 0, binding = 1, std430) buffer Sums { vec4 sums[]; };
// For each block: samples that are NaN, infinite, negative; one unused.
layout(set = 0, binding = 2, std430) buffer Invalid { uint invalid[]; };
layout(set = 0, binding = 3, std430) readonly buffer ParamsBuffer { Params params; };
layout(push_constant) uniform Push { Dispatch work; } push;

// By bit pattern: compilers may assume that numbers are finite.
bool is_nan(float x) { return (floatBitsToUint(x) & 0x7fffffffu) > 0x7f800000u; }
bool is_infinite(float x) { return (floatBitsToUint(x) & 0x7fffffffu) == 0x7f800000u; }
bool is_negative(float x) { return floatBitsToUint(x) > 0x80000000u; }

void main() {
    uint pixel = gl_GlobalInvocationID.x;
    uint pixel_count = push.work.tile_count * TILE * TILE;
    if (pixel >= pixel_count) {
        return;
    }
    uvec2 place = tile_pixel(push.work.first_tile + pixel / (TILE * TILE), pixel % (TILE * TILE), params.crop_width);
    if (place.x >= params.crop_width || place.y >= params.crop_height) {
        return; // The tile reaches over the crop window's edge: nobody rendered this pixel.
    }
    uint first = pixel * push.work.sample_count;
    for (uint start = 0u; start < push.work.sample_count; start += BLOCK_SAMPLES) {
        uint block = start / BLOCK_SAMPLES;
        vec3 sum = vec3(0.0), squares = vec3(0.0);
        for (uint k = start; k < min(start + BLOCK_SAMPLES, push.work.sample_count); ++k) {
            vec4 weighted = samples[first + k];
            vec3 value = weighted.xyz;
            sum += value;
            squares += value * value;
            // In a negative lobe of the filter, what is positive is negative here.
            value = weighted.w < 0.0 ? -value : value;
            if (is_nan(value.x) || is_nan(value.y) || is_nan(value.z)) {
                atomicAdd(invalid[4u * block], 1u);
            } else if (is_infinite(value.x) || is_infinite(value.y) || is_infinite(value.z)) {
                atomicAdd(invalid[4u * block + 1u], 1u);
            } else if (!HAS_PILOT && (is_negative(value.x) || is_negative(value.y) || is_negative(value.z))) {
                atomicAdd(invalid[4u * block + 2u], 1u);
            }
        }
        uint slot = 2u * (block * pixel_count + pixel);
        sums[slot] = vec4(sum, 0.0);
        sums[slot + 1u] = vec4(squares, 0.0);
    }
}
