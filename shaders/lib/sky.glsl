// Radiance from infinitely far, from an image in latitude-longitude format, and the density with which its directions are
// sampled.
//
// A direction is a unit vector from the scene to the sky, in the image's axes: +y is up, the first row; the left edge is -z, a
// quarter of the width +x. Of the image's coordinates, u is the azimuth / 2 pi and v the angle from +y / pi.
//
// Directions are sampled by a grid of cells of equal solid angle, uniform in azimuth and in the height y: a row by the sums of the rows'
// probabilities, then a column by those of that row, then uniformly within the cell. Numbers that are well spread over the unit square
// stay so over the sky, since all of these maps keep their order. The sums are multiples of 2^-24, so numbers of 24 bits draw each cell
// with exactly the probability of its density. Where the search for a cell begins stands in a guide table (Chen and Asau 1974).
#include "lib/math.glsl"

const float SKY_STEPS = 16777216.0;

// A cell of a row, or a row, as a number in [0, 1) draws it.
struct SkyCell {
    uint index;
    float place;       // of the number within the cell
    float rest;        // 1 - place, without its loss of digits
    float probability;
};

struct SkySample {
    vec3 direction;  // in the image's axes
    vec3 radiance;   // not divided by the density
    float pdf;       // per solid angle
};

uint sky_columns(Texture sky) {
    return 1u << (sky.flags & 0xffu);
}

uint sky_rows(Texture sky) {
    return 1u << (sky.flags >> 8u);
}

// Where the image has a direction.
vec2 sky_uv(vec3 direction) {
    float u = arctan2(direction.x, -direction.z) * (0.5 * INV_PI);
    return vec2(u - floor(u), arctan2(length(direction.xz), direction.y) * INV_PI);
}

vec3 sky_pixel(Texture sky, uint x, uint y) {
    uint first = sky.first_value + 3u * (y * sky.width + x);
    return vec3(VALUE(first), VALUE(first + 1u), VALUE(first + 2u));
}

// Bilinear. Columns have their centres at (x + 1/2) / width and go round; rows lie at y / (height - 1), so that the first and the
// last are the poles. Written with two products, since a + t (b - a) can fall below 0 beside a very bright pixel.
vec3 sky_radiance(Texture sky, vec2 uv) {
    float x = uv.x * float(sky.width) - 0.5;
    float left = floor(x);
    float fx = x - left;
    uint x0 = left < 0.0 ? sky.width - 1u : min(whole(left), sky.width - 1u);
    uint x1 = x0 + 1u == sky.width ? 0u : x0 + 1u;
    float y = clamp(uv.y, 0.0, 1.0) * float(sky.height - 1u);
    uint y0 = min(whole(y), sky.height - 2u);
    float fy = y - float(y0);
    vec3 above = sky_pixel(sky, x0, y0) * (1.0 - fx) + sky_pixel(sky, x1, y0) * fx;
    vec3 below = sky_pixel(sky, x0, y0 + 1u) * (1.0 - fx) + sky_pixel(sky, x1, y0 + 1u) * fx;
    return above * (1.0 - fy) + below * fy;
}

// A distribution over `count` cells, a power of two, is `count` + 1 guides, and then as many borders of the cells in steps of 2^-24.
uint sky_distribution_size(uint count) {
    return 2u * count + 2u;
}

// Where the distribution of a row begins.
uint sky_row(Texture sky, uint row) {
    return sky.first_weight + sky_distribution_size(sky_rows(sky)) + row * sky_distribution_size(sky_columns(sky));
}

float sky_probability(uint first, uint count, uint index) {
    uint border = first + count + 1u + index;
    return (VALUE(border + 1u) - VALUE(border)) / SKY_STEPS;
}

SkyCell sky_cell(uint first, uint count, float u) {
    float step = min(floor(u * SKY_STEPS), SKY_STEPS - 1.0);
    uint guide = first + whole(step * (float(count) / SKY_STEPS)), borders = first + count + 1u;
    uint index = whole(VALUE(guide)), last = whole(VALUE(guide + 1u));
    [[dont_unroll]] while (index < last) {
        uint middle = (index + last) / 2u;
        bool beyond = step >= VALUE(borders + middle + 1u);
        index = beyond ? middle + 1u : index;
        last = beyond ? last : middle;
    }
    float begin = VALUE(borders + index), end = VALUE(borders + index + 1u);
    // Differences of neighbours first: halves are lost beside large numbers.
    precise float before = (step - begin) + 0.5, behind = (end - step) - 0.5;
    return SkyCell(index, before / (end - begin), behind / (end - begin), (end - begin) / SKY_STEPS);
}

// Density per solid angle of a cell, from the probabilities of its row and of its column there.
float sky_cell_pdf(Texture sky, float of_row, float of_column) {
    return of_row * of_column * float(sky_rows(sky) * sky_columns(sky)) * (0.25 * INV_PI);
}

// Density per solid angle of a direction of height y, which the image has at u.
float sky_pdf(Texture sky, float u, float y) {
    uint columns = sky_columns(sky), rows = sky_rows(sky);
    uint row = min(whole(max(0.5 - 0.5 * y, 0.0) * float(rows)), rows - 1u);
    uint column = min(whole(u * float(columns)), columns - 1u);
    return sky_cell_pdf(sky, sky_probability(sky.first_weight, rows, row), sky_probability(sky_row(sky, row), columns, column));
}

// A direction with a density that follows the image.
SkySample sample_sky(Texture sky, vec2 u) {
    SkyCell row = sky_cell(sky.first_weight, sky_rows(sky), u.x);
    SkyCell column = sky_cell(sky_row(sky, row.index), sky_columns(sky), u.y);
    // (1 - y) / 2 and (1 + y) / 2, and the azimuth / 2 pi.
    float rows = float(sky_rows(sky));
    float t = (float(row.index) + row.place) / rows, rest = (rows - float(row.index + 1u) + row.rest) / rows;
    float azimuth = (float(column.index) + column.place) / float(sky_columns(sky));
    float sin_theta = 2.0 * sqrt(t * rest);
    float phi = 2.0 * PI * azimuth;
    SkySample result;
    result.direction = vec3(sin_theta * sin(phi), 1.0 - 2.0 * t, -sin_theta * cos(phi));
    // The angle from +y is twice the arc sine of sqrt(t).
    result.radiance = sky_radiance(sky, vec2(azimuth, 2.0 * INV_PI * arctan2(sqrt(t), sqrt(rest))));
    result.pdf = sky_cell_pdf(sky, row.probability, column.probability);
    return result;
}
