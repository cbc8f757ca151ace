// Which pixel and sample an invocation works on.
#include "lib/math.glsl"

// The number, in the crop window, of a tile of the dispatch. SAMPLE is what the including kernel reads samples by.
#define TILE_NUMBER(turn) whole(SAMPLE(push.work.first_tile + (turn) / 4u)[(turn) % 4u])

// Column and row, within the crop window, of a pixel of a tile. Tiles and the pixels in them go row by row.
uvec2 tile_pixel(uint tile, uint pixel, uint crop_width) {
    uint tiles_across = (crop_width + TILE - 1u) / TILE;
    return uvec2(tile % tiles_across, tile / tiles_across) * TILE + uvec2(pixel % TILE, pixel / TILE);
}

// a / b for a below 2^22: devices that divide integers one by one, as lavapipe does, take much longer for that.
uint quotient(uint a, uint b) {
    return whole((float(a) + 0.5) / float(b));
}

// Where pixels share paths, columns and rows of their groups are shifted by these for a sample: all groups meet all their neighbours in
// turn. No shift without sharing (sharers = 0).
uvec2 group_offset(uint sharers, uint sample_index) {
    uint k = sample_index / (2u * RUN_SAMPLES) % RUN_SHIFTS, x = k & 1u, y = k >> 1u;
    return sharers == 0u ? uvec2(0u) : sharers == 4u ? uvec2(x, x ^ y) : uvec2(x, 2u * x + y);
}

// The largest shift.
uvec2 group_margin(uint sharers) {
    return sharers == 0u ? uvec2(0u) : sharers == 4u ? uvec2(1u) : uvec2(1u, 3u);
}
