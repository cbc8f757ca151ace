//! Mirror of `shaders/lib/medium.glsl`: optical depths and what a path weighs after a free flight.

use super::math::{exp_minus_rgb, sum_components};
use crate::pack::layout::INFINITE_DISTANCE;
use glam::DVec3;

/// Probabilities to choose each channel: proportional to the throughput.
pub fn channel_weights(throughput: DVec3) -> DVec3 {
    throughput / sum_components(throughput)
}

/// The channel in which u in \[0, 1) falls; never one of probability 0, even where the others add up to a little less than 1.
pub fn sample_channel(weights: DVec3, u: f64) -> u32 {
    if u < weights.x {
        0
    } else if weights.y > 0.0 && (u < weights.x + weights.y || weights.z == 0.0) {
        1
    } else if weights.z > 0.0 {
        2
    } else {
        0
    }
}

/// Distance at which the optical depth reaches tau; never, in vacuum.
pub fn free_flight(tau: f64, sigma_t: f64) -> f64 {
    let infinite = f64::from(INFINITE_DISTANCE);
    if sigma_t > 0.0 { (tau / sigma_t).min(infinite) } else { infinite }
}

/// Probability that a flight gets as far as tau.
pub fn survival_probability(weights: DVec3, tau: DVec3) -> f64 {
    weights.dot(exp_minus_rgb(tau))
}

/// Weight of a path that got as far as tau.
pub fn survival_weight(weights: DVec3, tau: DVec3) -> DVec3 {
    let transmittance = exp_minus_rgb(tau);
    transmittance / weights.dot(transmittance)
}

/// Weight of a path that scatters at tau.
pub fn scatter_weight(weights: DVec3, tau: DVec3, sigma_t: DVec3, albedo: DVec3) -> DVec3 {
    let collision = sigma_t * exp_minus_rgb(tau);
    albedo * collision / weights.dot(collision)
}

/// A number for each medium, such that sums and differences of a few are not that of another by chance.
pub fn medium_code(medium: u32) -> u32 {
    let code = medium.wrapping_add(1).wrapping_mul(0x9e37_79b9);
    let code = (code ^ code >> 16).wrapping_mul(0x85eb_ca6b);
    code ^ code >> 13
}

/// The medium whose code is `sum`; `u32::MAX` if there is none.
pub fn medium_of_code(sum: u32, guess: u32, medium_count: u32) -> u32 {
    if sum == medium_code(guess) {
        return guess;
    }
    (0..medium_count).find(|medium| sum == medium_code(*medium)).unwrap_or(u32::MAX)
}

/// Emission along a flight through a medium that adds 1 per unit of length, for gray media: `way` is how far it went there,
/// `ended` whether it ended there and not at a boundary.
pub fn emitting_length(share: f64, sigma_t: f64, way: f64, ended: bool) -> f64 {
    (1.0 - share) * way + if ended { share / sigma_t } else { 0.0 }
}

/// The same for chromatic media: `tau` is the optical depth up to where the flight entered the medium, `way` how far it went
/// there, `ended` whether it ended there, and `u` in \[0, 1) chooses the point that stands for the way.
pub fn emitting_length_rgb(
    share: f64,
    weights: DVec3,
    tau: DVec3,
    sigma_t: DVec3,
    way: f64,
    ended: bool,
    u: f64,
) -> DVec3 {
    let along = (1.0 - share) * way * survival_weight(weights, tau + sigma_t * (u * way));
    let transmittance = exp_minus_rgb(tau + sigma_t * way);
    along + if ended { share * transmittance / weights.dot(sigma_t * transmittance) } else { DVec3::ZERO }
}
