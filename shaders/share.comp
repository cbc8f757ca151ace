// Adds to each sample what the second vertices of its group bring: lib/path_share.glsl.
#version 460
#extension GL_EXT_control_flow_attributes : require
#include "lib/bindings.glsl"
#include "lib/path_share.glsl"
#include "lib/film.glsl"

layout(local_size_x = WORKGROUP) in;

void main() {
    uint slot = gl_GlobalInvocationID.x;
    uint samples_in_tile = TILE * TILE * push.work.sample_count;
    if (slot >= push.work.tile_count * samples_in_tile) {
        return;
    }
    uint turn = slot / samples_in_tile, in_tile = slot % samples_in_tile;
    uvec2 pixel = tile_pixel(push.work.first_tile + turn, in_tile / push.work.sample_count, params.crop_width);
    if (pixel.x >= params.crop_width || pixel.y >= params.crop_height) {
        return;
    }
    uint record = record_of(slot);
    vec4 first = SAMPLE(record);
    if (uint(first.w) == END_NONE) {
        return;
    }
    vec3 weight = SAMPLE(record + 2u).xyz, sum = vec3(0.0);
    uint own = sharer_number(pixel);
    uint base = turn * samples_in_tile + in_tile % push.work.sample_count;
    [[dont_unroll]] for (uint j = 0u; j < SHARERS; ++j) {
        uvec2 other = sharer_pixel(pixel, j);
        vec3 reaches = SAMPLE(pair_of(slot, j)).xyz;
        if (other.x >= params.crop_width || other.y >= params.crop_height || max_component(reaches) == 0.0) {
            continue;
        }
        uint partner = record_of(base + (other.y % TILE * TILE + other.x % TILE) * push.work.sample_count);
        End second = load_end(partner + SECOND, 0.0);
        Sent sent = load_sent(partner);
        bool turns = HAS_HENYEY_GREENSTEIN && second.kind == END_MEDIUM;
        float of_place = 0.0, of_path = 0.0;
        [[dont_unroll]] for (uint k = 0u; k < SHARERS; ++k) {
            uvec2 third = sharer_pixel(pixel, k);
            if (third.x < params.crop_width && third.y < params.crop_height) {
                uint finder = base + (third.y % TILE * TILE + third.x % TILE) * push.work.sample_count;
                float density = SAMPLE(pair_of(finder, j)).w;
                if (density > 0.0) {
                    of_place += density;
                    of_path += turns ? density * phase_from(second, SAMPLE(record_of(finder)).xyz, sent.rest_direction) : density;
                }
            }
        }
        vec3 light = sent.light;
        float phase = 1.0;
        if (turns) {
            phase = phase_from(second, first.xyz, sent.rest_direction);
            float found = eval_henyey_greenstein(MEDIUM(second.medium).g, second.axis, sent.light_direction);
            light *= max_component(light) > 0.0 ? phase_from(second, first.xyz, sent.light_direction) / found : 1.0;
        }
        vec3 ended_and_light = max_component(abs(sent.ended + light)) > 0.0 || !is_finite(sent.ended + light) ? (sent.ended + light) / of_place : vec3(0.0);
        vec3 rest = max_component(abs(sent.rest)) > 0.0 || !is_finite(sent.rest) ? sent.rest * (phase / of_path) : vec3(0.0);
        sum += reaches * (ended_and_light + rest);
    }
    vec3 value = sum * weight;
    if (uint(SAMPLE(record + SECOND).w) != END_NONE) {
        value += SAMPLE(record + BASE).xyz;
    }
    vec4 sample_value = SAMPLE(slot);
    SAMPLE(slot) = vec4(sample_value.xyz + (HAS_FILTER ? value * sample_value.w : value), sample_value.w);
}
