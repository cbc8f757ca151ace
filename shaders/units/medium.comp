// Unit kernel of lib/medium.glsl: (u, tau, sigma_t, 0), then throughput, tau, sigma_t and albedo (RGB), and after each of these
// the share, the way, whether it ended, and the u of emission; out: (channel, free flight, survival probability, 0), channel
// weights, survival weight, scatter weight, and emitting lengths (RGB, gray).
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
        outputs[5u * i] = vec4(float(sample_channel(weights, flight.x)), free_flight(flight.y, flight.z), survival_probability(weights, tau), 0.0);
        outputs[5u * i + 1u] = vec4(weights, 0.0);
        outputs[5u * i + 2u] = vec4(survival_weight(weights, tau), 0.0);
        outputs[5u * i + 3u] = vec4(scatter_weight(weights, tau, sigma_t, albedo), 0.0);
        float share = inputs[5u * i + 1u].w, way = inputs[5u * i + 2u].w, u = inputs[5u * i + 4u].w;
        bool ended = inputs[5u * i + 3u].w > 0.0;
        vec3 emitting = emitting_length_rgb(share, weights, tau, sigma_t, way, ended, u);
        outputs[5u * i + 4u] = vec4(emitting, emitting_length(share, sigma_t.x, way, ended && sigma_t.x > 0.0));
    }
}
