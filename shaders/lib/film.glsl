// Which pixel and sample an invocation works on.

// Column and row, within the crop window, of a pixel of a tile. Tiles and the pixels in them go row by row.
uvec2 tile_pixel(uint tile, uint pixel, uint crop_width) {
    uint tiles_across = (crop_width + TILE - 1u) / TILE;
    return uvec2(tile % tiles_across, tile / tiles_across) * TILE + uvec2(pixel % TILE, pixel / TILE);
}

// a / b for a below 2^22: devices that divide integers one by one, as lavapipe does, take much longer for that.
uint quotient(uint a, uint b) {
    return uint((float(a) + 0.5) / float(b));
}
