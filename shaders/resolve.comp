// Sums the samples of each pixel, run by run, and in order, so that the sums do not depend on who rendered a sample or when.
#version 460
#include "lib/layout.glsl"
#include "lib/features.glsl"
#include "lib/film.glsl"

layout(local_size_x = WORKGROUP) in;

layout(set = 0, binding = 0, std430) readonly buffer Samples { vec4 samples[]; };
// For each run, and each place of the dispatch: the sum, the sum of squares, and the sum of what was shared.
layout(set = 0, binding = 1, std430) buffer Sums { vec4 sums[]; };
// For each block: samples that are NaN, infinite, negative; one unused.
layout(set = 0, binding = 2, std430) buffer Invalid { uint invalid[]; };
layout(set = 0, binding = 3, std430) readonly buffer ParamsBuffer { Params params; };
layout(push_constant) uniform Push { Dispatch work; } push;
#define SAMPLE(i) samples[i]

// By bit pattern: compilers may assume that numbers are finite.
bool is_nan(float x) { return (floatBitsToUint(x) & 0x7fffffffu) > 0x7f800000u; }
bool is_infinite(float x) { return (floatBitsToUint(x) & 0x7fffffffu) == 0x7f800000u; }
bool is_negative(float x) { return floatBitsToUint(x) > 0x80000000u; }

// Vectors of a sum.
const uint SUM_VECTORS = HAS_SHARING ? 3u : 2u;

void main() {
    uint place = gl_GlobalInvocationID.x;
    uint place_count = push.work.tile_count * TILE * TILE;
    if (place >= place_count) {
        return;
    }
    uvec2 unshifted = tile_pixel(TILE_NUMBER(place / (TILE * TILE)), place % (TILE * TILE), params.crop_width + group_margin(SHARERS).x);
    uint first = place * push.work.sample_count;
    for (uint start = 0u; start < push.work.sample_count; start += RUN_SAMPLES) {
        uvec2 pixel = unshifted - group_offset(SHARERS, push.work.first_sample + start);
        if (pixel.x >= params.crop_width || pixel.y >= params.crop_height) {
            continue; // The tile reaches over the crop window's edge: nobody rendered this pixel.
        }
        uint block = start / BLOCK_SAMPLES;
        vec3 sum = vec3(0.0), squares = vec3(0.0), brought = vec3(0.0);
        for (uint k = start; k < min(start + RUN_SAMPLES, push.work.sample_count); ++k) {
            vec4 weighted = samples[first + k];
            vec3 value = weighted.xyz;
            sum += value;
            squares += value * value;
            if (HAS_SHARING) {
                brought += samples[push.work.first_record + RECORD_VECTORS * (first + k) + RECORD_WEIGHT].xyz;
            }
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
        uint slot = SUM_VECTORS * (start / RUN_SAMPLES * place_count + place);
        sums[slot] = vec4(sum, 0.0);
        sums[slot + 1u] = vec4(squares, 0.0);
        if (HAS_SHARING) {
            sums[slot + 2u] = vec4(brought, 0.0);
        }
    }
}
