// Adds to the samples of each group what their second vertices bring: lib/path_share.glsl. An invocation serves one sample of a group.
#version 460
#extension GL_EXT_control_flow_attributes : require
#include "lib/bindings.glsl"
#include "lib/path_share.glsl"
#include "lib/film.glsl"

layout(local_size_x = WORKGROUP) in;

bool is_something(vec3 v) {
    return max_component(abs(v)) > 0.0 || !is_finite(v);
}

void main() {
    uint count = push.work.sample_count, groups_in_tile = TILE * TILE / SHARERS;
    uint number = gl_GlobalInvocationID.x;
    if (number >= push.work.tile_count * groups_in_tile * count) {
        return;
    }
    uint turn = number / (groups_in_tile * count), in_turn = number - turn * groups_in_tile * count;
    uint group = quotient(in_turn, count), of_pixel = in_turn - group * count;
    uvec2 place = group_place(group), corner = tile_pixel(TILE_NUMBER(turn), 0u, params.crop_width + group_margin(SHARERS).x)
        - group_offset(SHARERS, push.work.first_sample + of_pixel);
    uvec2 size = uvec2(params.crop_width, params.crop_height);
    uint pairs = pairs_of(number);
    // Of each pixel of the group: its slot, whether it has a first vertex, that vertex, and the sum.
    uint slots[SHARERS];
    bool finds[SHARERS];
    vec3 points[SHARERS], sums[SHARERS];
    for (uint i = 0u; i < SHARERS; ++i) {
        uvec2 own = sharer_place(place, i);
        slots[i] = (turn * TILE * TILE + own.y * TILE + own.x) * count + of_pixel;
        vec4 first = vec4(0.0);
        if (all(lessThan(corner + own, size))) {
            first = SAMPLE(record_of(slots[i]));
        }
        finds[i] = first.w > 0.0;
        points[i] = first.xyz;
        sums[i] = vec3(0.0);
    }
    [[dont_unroll]] for (uint j = 0u; j < SHARERS; ++j) {
        vec4 densities[SHARERS];
        float of_place = 0.0;
        for (uint k = 0u; k < SHARERS; ++k) {
            if (HAS_PAIR_VECTORS) {
                densities[k] = SAMPLE(pairs + SHARERS * j + k);
            } else {
                densities[k] = vec4(SAMPLE(pairs + SHARERS / 4u * j + k / 4u)[k % 4u]);
            }
            of_place += densities[k].w;
        }
        if (of_place > 0.0) {
            uint record = record_of(slots[j]);
            Sent sent = load_sent(record);
            if (HAS_HENYEY_GREENSTEIN) {
                End second = load_end(record, 1u);
                bool turns = second.kind == END_MEDIUM;
                float g = MEDIUM(second.medium).g;
                float found = turns ? eval_henyey_greenstein(g, second.axis, sent.light_direction) : 1.0;
                // Of the direction that the path took from there: densities by the aim and by scattering.
                vec2 aimed = turns && HAS_EQUIANGULAR ? SAMPLE(record + 2u).zw : vec2(1.0, 0.0);
                float of_path = 0.0;
                float phases[SHARERS];
                for (uint k = 0u; k < SHARERS; ++k) {
                    phases[k] = 1.0;
                    if (turns && densities[k].w > 0.0) {
                        phases[k] = eval_henyey_greenstein(g, normalize(second.point - points[k]), sent.rest_direction);
                    }
                    of_path += densities[k].w * (aimed.x * phases[k] + aimed.y);
                }
                vec3 ended = is_something(sent.ended) ? sent.ended / of_place : vec3(0.0);
                vec3 light = is_something(sent.light) ? sent.light / (of_place * found) : vec3(0.0);
                vec3 rest = is_something(sent.rest) ? sent.rest / of_path : vec3(0.0);
                for (uint i = 0u; i < SHARERS; ++i) {
                    float phase = turns ? eval_henyey_greenstein(g, normalize(second.point - points[i]), sent.light_direction) : 1.0;
                    sums[i] += densities[i].w > 0.0 ? densities[i].xyz * (ended + light * phase + rest * phases[i]) : vec3(0.0);
                }
            } else if (is_something(sent.rest)) {
                vec3 rest = sent.rest / of_place;
                for (uint i = 0u; i < SHARERS; ++i) {
                    sums[i] += densities[i].xyz * rest;
                }
            }
        }
    }
    for (uint i = 0u; i < SHARERS; ++i) {
        uint record = record_of(slots[i]);
        vec3 brought = vec3(0.0);
        if (finds[i]) {
            vec4 found = SAMPLE(slots[i]);
            float filter_weight = HAS_FILTER ? found.w : 1.0;
            brought = SAMPLE(record + RECORD_WEIGHT).xyz * sums[i] * filter_weight;
            vec3 base = SAMPLE(record + SECOND).w > 0.0 ? SAMPLE(record + BASE).xyz * filter_weight : vec3(0.0);
            SAMPLE(slots[i]) = vec4(found.xyz + (brought + base), found.w);
        }
        store_sample(record + RECORD_WEIGHT, vec4(brought, 0.0));
    }
}
