// Where light comes from inside a body of smooth glass: a lobe about one direction for each cell of space, found once from the scene
// (src/guide.rs). A lobe is von Mises' and Fisher's distribution (Fisher 1953), with the density κ exp(κ (cos θ - 1)) / (2π (1 - exp(-2κ)))
// per solid angle at the angle θ from its axis.
#include "lib/math.glsl"
#include "lib/warp.glsl"

struct Guide {
    vec3 axis;
    float sharpness;    // κ
    float chance;       // of a vertex to look for light by it; 0 where none is known to come
};

// The cell of a point, in units of cells from the lower corner.
uint guide_cell(vec3 place) {
    uvec3 cell = whole(clamp(place, vec3(0.0), vec3(float(GUIDE_CELLS) - 0.5)));
    return (cell.z * GUIDE_CELLS + cell.y) * GUIDE_CELLS + cell.x;
}

// exp(-κ (1 - cos θ)) is uniform between exp(-2κ) and 1.
vec3 sample_guide(Guide guide, vec2 u) {
    float one_minus_cos = min(minus_log_1m_small(u.x * one_minus_exp_minus(2.0 * guide.sharpness)) / guide.sharpness, 2.0);
    return from_frame(guide.axis, from_polar(1.0 - one_minus_cos, sqrt(one_minus_cos * (2.0 - one_minus_cos)), u.y));
}

// Times the chance.
float guide_pdf(Guide guide, vec3 direction) {
    vec3 difference = direction - guide.axis;
    float scale = guide.chance * guide.sharpness * 0.5 * INV_PI / one_minus_exp_minus(2.0 * guide.sharpness);
    return scale * exp_minus(0.5 * guide.sharpness * dot(difference, difference));
}
