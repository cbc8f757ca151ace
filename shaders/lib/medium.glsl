// Homogeneous media: optical depths and what a path weighs after a free flight. tau is the optical depth of the flight.
//
// A flight is sampled with the extinction of one channel, chosen with probabilities w, and weighted with the density of the
// mixture (one-sample MIS over the channels; Wilkie et al. 2014, Miller et al. 2019). In a gray medium this reduces to weights
// of albedo and 1.
#include "lib/constants.glsl"
#include "lib/math.glsl"

// Probabilities to choose each channel: proportional to the throughput.
vec3 channel_weights(vec3 throughput) {
    return throughput / sum_components(throughput);
}

// The channel in which u in [0, 1) falls; never one of probability 0, even where the others add up to a little less than 1.
uint sample_channel(vec3 weights, float u) {
    if (u < weights.x) {
        return 0u;
    }
    if (weights.y > 0.0 && (u < weights.x + weights.y || weights.z == 0.0)) {
        return 1u;
    }
    return weights.z > 0.0 ? 2u : 0u;
}

// Distance at which the optical depth reaches tau; never, in vacuum.
float free_flight(float tau, float sigma_t) {
    return sigma_t > 0.0 ? min(tau / sigma_t, INFINITE_DISTANCE) : INFINITE_DISTANCE;
}

// Probability that a flight gets as far as tau.
float survival_probability(vec3 weights, vec3 tau) {
    return dot(weights, exp_minus(tau));
}

// Weight of a path that got as far as tau.
vec3 survival_weight(vec3 weights, vec3 tau) {
    vec3 transmittance = exp_minus(tau);
    return transmittance / dot(weights, transmittance);
}

// Weight of a path that scatters at tau.
vec3 scatter_weight(vec3 weights, vec3 tau, vec3 sigma_t, vec3 albedo) {
    vec3 collision = sigma_t * exp_minus(tau);
    return albedo * collision / dot(weights, collision);
}

// Which medium lies behind boundaries is a sum: each crossing adds the code of the medium it leads to and takes away that of
// the medium it leads from, so boundaries that coincide may be met in any order. On the way the sum may stand for no medium.
// Codes are scattered numbers, so that no such sum is that of a medium by chance.
uint medium_code(uint medium) {
    uint code = (medium + 1u) * 0x9e3779b9u;
    code = (code ^ code >> 16u) * 0x85ebca6bu;
    return code ^ code >> 13u;
}

// The medium whose code is `sum`, first asked if it is `guess`; NONE if there is none.
uint medium_of_code(uint sum, uint guess, uint medium_count) {
    if (sum == medium_code(guess)) {
        return guess;
    }
    [[dont_unroll]] for (uint medium = 0u; medium < medium_count; ++medium) {
        if (sum == medium_code(medium)) {
            return medium;
        }
    }
    return NONE;
}

// Emission along a flight through a medium that adds 1 per unit of length: `way` is how far it went there, `ended` whether it
// ended there and not at a boundary. The share is counted where the flight ends, the rest along the way; see src/pack/emission.rs.
float emitting_length(float share, float sigma_t, float way, bool ended) {
    return (1.0 - share) * way + (ended ? share / sigma_t : 0.0);
}

// The same where media are chromatic: tau is the optical depth up to where the flight entered, u in [0, 1) chooses the one
// point that stands for the way. A point is passed with the probability that survives to it.
vec3 emitting_length_rgb(float share, vec3 weights, vec3 tau, vec3 sigma_t, float way, bool ended, float u) {
    vec3 along = (1.0 - share) * way * survival_weight(weights, tau + sigma_t * (u * way));
    vec3 transmittance = exp_minus(tau + sigma_t * way);
    return along + (ended ? share * transmittance / dot(weights, sigma_t * transmittance) : vec3(0.0));
}
