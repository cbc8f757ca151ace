// Unit kernel of lib/medium.glsl: (u, tau, sigma_t, 0), throughput, tau, sigma_t and albedo (RGB) in; (channel, free
// flight, survival probability, 0), channel weights, survival weight and scatter weight out.
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
        outputs[4u * i] = vec4(float(sample_channel(weights, flight.x)), free_flight(flight.y, flight.z), survival_probability(weights, tau), 0.0);
        outputs[4u * i + 1u] = vec4(weights, 0.0);
        outputs[4u * i + 2u] = vec4(survival_weight(weights, tau), 0.0);
        outputs[4u * i + 3u] = vec4(scatter_weight(weights, tau, sigma_t, albedo), 0.0);
    }
}
