// Distances that go by a lamp along a ray whose end is not known: between the first and the second vertex of paths that pixels share
// (lib/path_share.glsl). There the density must follow from the two points and what lies between them, so it cannot depend on the surface
// behind, as that of path_flight.glsl does. A share of flights goes by equiangular distances along the whole ray, all others are free:
//
//   p(t) = (1 - s) sum_c w_c sigma_c exp(-sigma_c t) + s q(t)        P(t) = (1 - s) sum_c w_c exp(-sigma_c t) + s (1 - Q(t))
//
// with the density q and its distribution function Q. Once a flight has left the medium in which it began, it goes on as a free one.
#include "lib/constants.glsl"
#include "lib/layout.glsl"
#include "lib/math.glsl"
#include "lib/equiangular.glsl"

// A medium is expected to go on for as many distances to the lamp: the share is that of free flights which end by then.
const float OPEN_REACH = 2.0;

struct OpenFlight {
    Stretch stretch;    // of the ray, seen from the lamp
    float share;        // of flights that go by the lamp; 0 where none do
};

// Mean over the channels of what gets as far as an optical depth.
float mean_passage(vec3 weights, vec3 tau) {
    return HAS_CHROMATIC ? dot(weights, exp_minus(tau)) : exp_minus(tau.x);
}

// A flight from `origin` by the lamp that lies `way` from there; by none, where that is 0.
OpenFlight open_flight(Medium medium, vec3 weights, vec3 origin, vec3 direction, vec3 way) {
    float reach = OPEN_REACH * length(way);
    bool may = medium.equiangular > 0.0 && max_component(medium.emission) == 0.0 && reach > 0.0;
    float share = may ? medium.equiangular * (1.0 - mean_passage(weights, medium.sigma_t * reach)) : 0.0;
    return OpenFlight(stretch_seen_from(origin + way, origin, direction, 0.0, INFINITE_DISTANCE), share);
}

// The density of a flight that ends at a distance, or the probability of one that gets there, over that of a free flight, which is `free`.
float open_factor(OpenFlight flight, float way, bool ends, float free) {
    float by_lamp = ends ? equiangular_pdf(flight.stretch, way) : equiangular_rest(flight.stretch, way);
    return flight.share > 0.0 ? 1.0 - flight.share + flight.share * by_lamp / max(free, 1e-30) : 1.0;
}
