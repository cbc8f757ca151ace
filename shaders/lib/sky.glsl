// Radiance from infinitely far, from an image in latitude-longitude format, and the density with which its directions are
// sampled.
//
// A direction is a unit vector from the scene to the sky, in the image's axes: +y is up, the first row; the left edge is -z, a
// quarter of the width +x. Of the image's coordinates, u is the azimuth / 2 pi and v the angle from +y / pi.
//
// Directions are sampled by a grid of cells of equal solid angle, uniform in azimuth and in the height y: a row by an alias table
// (Walker 1977), then a column by the table of that row, then uniformly within the cell. The grid has powers of two of rows and
// columns, and thresholds are multiples of 1/8192, so numbers of 24 bits draw each cell with exactly the probability of its
// density.
#include "lib/math.glsl"

const float SKY_THRESHOLDS = 8192.0;

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
    uint x0 = left < 0.0 ? sky.width - 1u : min(uint(left), sky.width - 1u);
    uint x1 = x0 + 1u == sky.width ? 0u : x0 + 1u;
    float y = clamp(uv.y, 0.0, 1.0) * float(sky.height - 1u);
    uint y0 = min(uint(y), sky.height - 2u);
    float fy = y - float(y0);
    vec3 above = sky_pixel(sky, x0, y0) * (1.0 - fx) + sky_pixel(sky, x1, y0) * fx;
    vec3 below = sky_pixel(sky, x0, y0 + 1u) * (1.0 - fx) + sky_pixel(sky, x1, y0 + 1u) * fx;
    return above * (1.0 - fy) + below * fy;
}

// A line of an alias table: threshold + 8192 alias, an integer below 2^24. u decides whether the line is taken or its alias.
uint sky_line(float entry, uint line, float u) {
    uint word = uint(entry);
    return uint(u * SKY_THRESHOLDS) < (word & 8191u) ? line : word >> 13u;
}

// Density per solid angle of a cell.
float sky_cell_pdf(Texture sky, uint row, uint column) {
    uint columns = sky_columns(sky), rows = sky_rows(sky);
    return VALUE(sky.first_weight + rows + rows * columns + row * columns + column);
}

// Density per solid angle of a direction of height y, which the image has at u.
float sky_pdf(Texture sky, float u, float y) {
    uint columns = sky_columns(sky), rows = sky_rows(sky);
    uint row = min(uint(max(0.5 - 0.5 * y, 0.0) * float(rows)), rows - 1u);
    uint column = min(uint(u * float(columns)), columns - 1u);
    return sky_cell_pdf(sky, row, column);
}

// u chooses the lines and the place in a cell, `decision` between the lines and their aliases.
SkySample sample_sky(Texture sky, vec2 u, vec2 decision) {
    uint columns = sky_columns(sky), rows = sky_rows(sky);
    vec2 scaled = u * vec2(rows, columns);
    uint row = min(uint(scaled.x), rows - 1u), column = min(uint(scaled.y), columns - 1u);
    vec2 place = scaled - vec2(row, column);
    row = sky_line(VALUE(sky.first_weight + row), row, decision.x);
    column = sky_line(VALUE(sky.first_weight + rows + row * columns + column), column, decision.y);
    // (1 - y) / 2, and the azimuth / 2 pi.
    float t = (float(row) + place.x) / float(rows);
    float azimuth = (float(column) + place.y) / float(columns);
    float sin_theta = 2.0 * sqrt(t * (1.0 - t));
    float phi = 2.0 * PI * azimuth;
    SkySample result;
    result.direction = vec3(sin_theta * sin(phi), 1.0 - 2.0 * t, -sin_theta * cos(phi));
    // The angle from +y is twice the arc sine of sqrt(t).
    result.radiance = sky_radiance(sky, vec2(azimuth, 2.0 * INV_PI * arctan2(sqrt(t), sqrt(1.0 - t))));
    result.pdf = sky_cell_pdf(sky, row, column);
    return result;
}
