//! Mirror of `shaders/lib/path_open.glsl`: distances that go by a lamp along a ray whose end is not known.

use super::bindings::Medium;
use super::equiangular::{Stretch, equiangular_pdf, equiangular_rest, stretch_seen_from};
use super::math::exp_minus_rgb;
use super::path_state::INFINITE_DISTANCE;
use glam::DVec3;

/// A medium is expected to go on for as many distances to the lamp.
const OPEN_REACH: f64 = 2.0;

/// A flight.
#[derive(Clone, Copy, Debug)]
pub struct OpenFlight {
    /// The ray, seen from the lamp.
    pub stretch: Stretch,
    /// Of flights that go by the lamp; 0 where none do.
    pub share: f64,
}

/// Mean over the channels of what gets as far as an optical depth.
pub fn mean_passage(weights: DVec3, tau: DVec3) -> f64 {
    weights.dot(exp_minus_rgb(tau))
}

/// A flight from `origin` by the lamp that lies `way` from there; by none, where that is 0.
pub fn open_flight(medium: &Medium, weights: DVec3, origin: DVec3, direction: DVec3, way: DVec3) -> OpenFlight {
    let reach = OPEN_REACH * way.length();
    let may = medium.equiangular > 0.0 && medium.emission.max_element() == 0.0 && reach > 0.0;
    let share = if may { medium.equiangular * (1.0 - mean_passage(weights, medium.sigma_t * reach)) } else { 0.0 };
    OpenFlight { stretch: stretch_seen_from(origin + way, origin, direction, 0.0, INFINITE_DISTANCE), share }
}

/// The density of a flight that ends at a distance, or the probability of one that gets there, over that of a free flight.
pub fn open_factor(flight: &OpenFlight, way: f64, ends: bool, free: f64) -> f64 {
    let by_lamp = if ends { equiangular_pdf(&flight.stretch, way) } else { equiangular_rest(&flight.stretch, way) };
    if flight.share > 0.0 { 1.0 - flight.share + flight.share * by_lamp / free.max(1e-30) } else { 1.0 }
}
