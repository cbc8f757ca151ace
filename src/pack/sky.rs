//! Environment maps as tables: their pixels, and the distribution by which directions to them are sampled.
//!
//! The distribution is a grid of cells of equal solid angle, uniform in the azimuth and in the height y: a row is drawn by the sums of
//! the rows' probabilities, then a column by those of that row. A cell's weight is the integral of the bilinear radiance over it, mean of
//! the channels, by exact integration along the rows of the image and Gauss's rule across, so that no pixel falls between the cells,
//! however fine the image. Of that weight the distribution has what exceeds a multiple of the mean over all directions ("MIS
//! compensation": Karlík, Šik, Vévoda, Skřivan and Křivánek 2019). What is left out, whole cells of it, is found by scattering alone.
//!
//! The sums are rounded to multiples of 2⁻²⁴, and densities are those of the rounded ones: exactly what is drawn.

use super::layout::{TEXTURE_SKY, Texture};
use crate::scene::Bitmap;
use std::f64::consts::PI;

/// What of the radiance is left to scattering, in units of its mean: half the mean, so that light sampling has at least half of all light.
/// Surfaces scatter to what they face, and find more by it than media do, which scatter to all sides: without media it is the whole
/// mean, if light sampling then keeps this share of the light. Maps that hardly differ from their mean would leave it too little.
const LEFT_OUT: f64 = 0.5;
const LEFT_OUT_BETWEEN_SURFACES: f64 = 1.0;
const LEAST_SHARE: f64 = 0.25;
/// Steps of the sums.
const STEPS: f64 = 16_777_216.0;
/// The coarsest grid, the finest that is finer than its image, and the finest of all: powers of two of columns and rows.
const COLUMNS: [u32; 3] = [4, 10, 11];
const ROWS: [u32; 3] = [3, 9, 10];
/// By so many powers of two the grid of a small image is finer: where a sun ends, the radiance goes from all to nothing within a pixel.
const FINER: u32 = 2;

/// What became of an environment map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackedSky {
    /// Mean over all directions and channels, W/(m² sr).
    pub mean: f64,
    /// Where its tables are.
    pub texture: Texture,
}

/// Appends the pixels of an environment map, multiplied by `scale`, and its distribution to the values. `scattering` says
/// whether media scatter its light. Whether single precision can hold the product, [`largest`] tells, and [`value_count`] whether
/// there is room.
pub fn pack(bitmap: &Bitmap, scale: f64, scattering: bool, values: &mut Vec<f32>) -> PackedSky {
    let first_value = values.len() as u32;
    values.reserve(3 * bitmap.pixels().len());
    values.extend(bitmap.pixels().iter().flatten().map(|value| (f64::from(*value) * scale) as f32));
    let (columns, rows) = (grid_bits(bitmap.width(), COLUMNS), grid_bits(bitmap.height(), ROWS));
    let weights = cell_weights(bitmap, 1 << columns, 1 << rows);
    let first_weight = values.len() as u32;
    append_distribution(&compensated(&weights, scattering), 1 << columns, values);
    PackedSky {
        mean: weights.iter().sum::<f64>() * scale,
        texture: Texture {
            kind: TEXTURE_SKY,
            flags: columns | rows << 8,
            width: bitmap.width(),
            height: bitmap.height(),
            first_value,
            first_weight,
            ..Texture::default()
        },
    }
}

/// Columns or rows of the grid for so many of the image, as a power of two.
fn grid_bits(size: u32, [least, finer, most]: [u32; 3]) -> u32 {
    let own = size.next_power_of_two().ilog2();
    (own + FINER).min(finer).max(own).clamp(least, most)
}

/// The largest value of a bitmap once it is multiplied by `scale`.
pub fn largest(bitmap: &Bitmap, scale: f64) -> f64 {
    f64::from(bitmap.max()) * scale
}

/// How many numbers [`pack`] appends at most.
pub fn value_count(bitmap: &Bitmap) -> usize {
    let [columns, rows] = [COLUMNS[2], ROWS[2]].map(|bits| 1usize << bits);
    3 * bitmap.pixels().len() + (2 * rows + 2) + rows * (2 * columns + 2)
}

/// A stretch of a row or column of the grid between two neighbouring pixels.
struct Piece {
    /// Of the grid.
    cell: usize,
    /// The first of the two pixels.
    pixel: i64,
    /// Integral of 1 − f and of f over the stretch, f going from 0 at the first pixel to 1 at the second.
    weights: [f64; 2],
}

/// Cuts the stretches between `edges` (ascending, in units of pixels) at the pixels. The measure of a place is `density` times
/// its length; three points of Gauss's rule integrate it.
fn pieces(edges: &[f64], density: impl Fn(f64) -> f64) -> Vec<Piece> {
    const GAUSS: [(f64, f64); 3] = [(-0.774_596_669_241_483_4, 5.0), (0.0, 8.0), (0.774_596_669_241_483_4, 5.0)];
    let mut found = Vec::new();
    for (cell, pair) in edges.windows(2).enumerate() {
        let mut low = pair[0];
        while low < pair[1] {
            let pixel = low.floor();
            let high = pair[1].min(pixel + 1.0);
            let mut weights = [0.0; 2];
            for (point, weight) in GAUSS {
                let place = (low + high + (high - low) * point) / 2.0;
                let measure = density(place) * (high - low) * weight / 18.0;
                weights[0] += measure * (pixel + 1.0 - place);
                weights[1] += measure * (place - pixel);
            }
            found.push(Piece { cell, pixel: pixel as i64, weights });
            low = high;
        }
    }
    found
}

/// Integral of the bilinear image over each cell of the grid, over 4π; row by row. Their sum is the mean over all directions.
fn cell_weights(bitmap: &Bitmap, columns: usize, rows: usize) -> Vec<f64> {
    let (width, height) = (i64::from(bitmap.width()), i64::from(bitmap.height()));
    let edge = |k: usize| k as f64 / columns as f64 * width as f64 - 0.5;
    let across = pieces(&(0..=columns).map(edge).collect::<Vec<_>>(), |_| 1.0 / width as f64);
    // Of one row of the image, in all columns of the grid.
    let row_sums = |y: i64| {
        let pixels = &bitmap.pixels()[(y * width) as usize..][..width as usize];
        let mean = |x: i64| {
            let pixel = pixels[x.rem_euclid(width) as usize];
            pixel.iter().map(|value| f64::from(*value)).sum::<f64>() / 3.0
        };
        let mut sums = vec![0.0; columns];
        for Piece { cell, pixel, weights } in &across {
            sums[*cell] += weights[0] * mean(*pixel) + weights[1] * mean(pixel + 1);
        }
        sums
    };
    // In units of rows of the image: heights 1 − 2 r/rows are at these angles from +y.
    let last = (height - 1) as f64;
    let edge = |r: usize| (1.0 - 2.0 * r as f64 / rows as f64).acos() / PI * last;
    let down = pieces(&(0..=rows).map(edge).collect::<Vec<_>>(), |y| (y * PI / last).sin() * PI / last / 2.0);
    let mut weights = vec![0.0; columns * rows];
    let (mut upper, mut lower) = ((-1, Vec::new()), (-1, Vec::new()));
    for Piece { cell, pixel, weights: [above, below] } in down {
        // Rounding may put the last edge beside the last row.
        let y = pixel.clamp(0, height - 2);
        if upper.0 != y {
            upper = if lower.0 == y { lower } else { (y, row_sums(y)) };
            lower = (y + 1, row_sums(y + 1));
        }
        let row = &mut weights[cell * columns..][..columns];
        for ((weight, upper), lower) in row.iter_mut().zip(&upper.1).zip(&lower.1) {
            *weight += (above * upper + below * lower).max(0.0);
        }
    }
    weights
}

/// What light sampling has of the weights.
fn compensated(weights: &[f64], scattering: bool) -> Vec<f64> {
    let total: f64 = weights.iter().sum();
    let above = |left_out: f64| -> Vec<f64> {
        let least = left_out * total / weights.len() as f64;
        weights.iter().map(|weight| (weight - least).max(0.0)).collect()
    };
    let found = above(LEFT_OUT_BETWEEN_SURFACES);
    if scattering || found.iter().sum::<f64>() < LEAST_SHARE * total { above(LEFT_OUT) } else { found }
}

/// Appends the distribution of the rows, and then those of the columns in each row.
fn append_distribution(weights: &[f64], columns: usize, values: &mut Vec<f32>) {
    let rows: Vec<f64> = weights.chunks_exact(columns).map(|row| row.iter().sum()).collect();
    append_borders(&rows, values);
    weights.chunks_exact(columns).for_each(|row| append_borders(row, values));
}

/// Appends the guides and the borders of the cells. The steps are divided into as many equal parts as there are cells; the guides name
/// the cell in which each part begins, and at last the last cell.
fn append_borders(weights: &[f64], values: &mut Vec<f32>) {
    let count = weights.len() as f64;
    let total: f64 = weights.iter().sum();
    let by_weight = |weight: f64| if total > 0.0 { weight / total } else { 1.0 / count };
    let mut sum = 0.0;
    let mut borders = vec![0.0];
    borders.extend(weights.iter().map(|&weight| {
        sum += by_weight(weight);
        (sum * STEPS).round()
    }));
    borders[weights.len()] = STEPS;
    let mut cell = 0;
    for part in 0..=weights.len() {
        while cell + 1 < weights.len() && borders[cell + 1] <= part as f64 * STEPS / count {
            cell += 1;
        }
        values.push(cell as f32);
    }
    values.extend(borders.iter().map(|&border| border as f32));
}
