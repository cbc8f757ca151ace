// Reconstruction filters, by importance sampling (Ernst, Stamminger and Greiner 2006): where a sample of a pixel lies is drawn
// from |filter|, one axis after the other, so that every sample belongs to one pixel; its factor is 1, or, where the filter has
// negative lobes, sign * integral of |filter| / integral of filter. The distance from the pixel's centre grows with the random
// number, so that stratified numbers give stratified places. The filter is a step function of narrow cells; its table (see
// src/pack/filter.rs) holds the integrals of |filter| up to the edges of the cells and, behind them, those of the filter itself.
// They are read by VALUE(i), which the kernel declares.
#include "lib/constants.glsl"
#include "lib/math.glsl"

struct FilterSample {
    float offset; // from the pixel's centre, in pixels
    float weight; // filter / density, normalised
};

// The integral of the table that begins at `first` up to a place that is counted in cells, in [0, cells].
float filter_integral(uint first, uint cells, float place) {
    float cell = min(floor(place), float(cells - 1u));
    return mix(VALUE(first + whole(cell)), VALUE(first + whole(cell) + 1u), place - cell);
}

// A distance from the pixel's centre within the bounds (pixels), which must contain 0, and its factor.
FilterSample sample_filter(uint first, uint cells, float radius, vec2 bounds, float u) {
    float cells_a_pixel = float(cells) / (2.0 * radius);
    vec2 ends = clamp((bounds + radius) * cells_a_pixel, 0.0, float(cells));
    uint second = first + cells + 1u;
    float begin = filter_integral(first, cells, ends.x), total = filter_integral(first, cells, ends.y) - begin;
    float signed_total = filter_integral(second, cells, ends.y) - filter_integral(second, cells, ends.x);
    float wanted = begin + u * total;
    // The last edge whose integral is not above what is wanted.
    uint low = 0u, high = cells;
    [[dont_unroll]] while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (VALUE(first + middle) <= wanted) {
            low = middle;
        } else {
            high = middle;
        }
    }
    float below = VALUE(first + low), width = VALUE(first + low + 1u) - below;
    float place = float(low) + (width > 0.0 ? clamp((wanted - below) / width, 0.0, 1.0) : 0.5);
    float side = VALUE(second + low + 1u) < VALUE(second + low) ? -1.0 : 1.0;
    return FilterSample(clamp(place, ends.x, ends.y) / cells_a_pixel - radius, side * total / signed_total);
}

// Density of the distance, per pixel.
float filter_pdf(uint first, uint cells, float radius, vec2 bounds, float offset) {
    float cells_a_pixel = float(cells) / (2.0 * radius);
    vec2 ends = clamp((bounds + radius) * cells_a_pixel, 0.0, float(cells));
    float place = (offset + radius) * cells_a_pixel;
    if (place < ends.x || place >= ends.y) {
        return 0.0;
    }
    uint cell = first + min(whole(place), cells - 1u);
    float total = filter_integral(first, cells, ends.y) - filter_integral(first, cells, ends.x);
    return (VALUE(cell + 1u) - VALUE(cell)) * cells_a_pixel / total;
}
