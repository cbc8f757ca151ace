// Unit kernel of lib/medium.glsl: (u, tau, sigma_t, index of a medium), then throughput, tau, sigma_t and albedo (RGB), and after each of these
// the share, the way, whether it ended, and the u of emission; out: (channel, free flight, survival probability,
// the medium found by a sum of codes that is that of the index, by way of the next two), (channel weights, upper half of its code),
// (survival weight, lower half), (scatter weight, the medium found by a sum that is none's), and emitting lengths (RGB, gray).
#version 460
#include "lib/layout.glsl"
#include "lib/medium.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(inputs.length()) / 5u) {
        vec4 flight = inputs[5u * i];
        vec3 weights = channel_weights(inputs[5u * i + 1u].xyz);
        vec3 tau = inputs[5u * i + 2u].xyz, sigma_t = inputs[5u * i + 3u].xyz, albedo = inputs[5u * i + 4u].xyz;
        uint medium = uint(flight.w);
        uint code = medium_code(medium), next = medium_code(medium + 1u), last = medium_code(medium + 2u);
        // Crossings in an order that makes no sense on the way.
        uint there_and_back = next + code + last - next - last;
        outputs[5u * i] = vec4(float(sample_channel(weights, flight.x)), free_flight(flight.y, flight.z), survival_probability(weights, tau), float(medium_of_code(there_and_back, medium + 1u, medium + 1u)));
        outputs[5u * i + 1u] = vec4(weights, float(code >> 16u));
        outputs[5u * i + 2u] = vec4(survival_weight(weights, tau), float(code & 0xffffu));
        outputs[5u * i + 3u] = vec4(scatter_weight(weights, tau, sigma_t, albedo), float(medium_of_code(code + next - last, medium, medium + 3u)));
        float share = inputs[5u * i + 1u].w, way = inputs[5u * i + 2u].w, u = inputs[5u * i + 4u].w;
        bool ended = inputs[5u * i + 3u].w > 0.0;
        vec3 emitting = emitting_length_rgb(share, weights, tau, sigma_t, way, ended, u);
        outputs[5u * i + 4u] = vec4(emitting, emitting_length(share, sigma_t.x, way, ended && sigma_t.x > 0.0));
    }
}
