//! Mirror of `shaders/lib/film.glsl`: which pixel is worked on.

use crate::pack::layout::TILE;

pub use crate::pack::groups::{group_margin, group_offset, group_size};

/// Column and row, within the crop window, of a pixel of a tile. Tiles and the pixels in them go row by row.
pub fn tile_pixel(tile: u32, pixel: u32, crop_width: u32) -> [u32; 2] {
    let tiles_across = crop_width.div_ceil(TILE);
    [tile % tiles_across * TILE + pixel % TILE, tile / tiles_across * TILE + pixel / TILE]
}

/// a / b, for a below 2²² in the kernels.
pub fn quotient(a: u32, b: u32) -> u32 {
    a / b
}
