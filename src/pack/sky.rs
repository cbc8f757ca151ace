//! Environment maps as tables: their pixels, and the distribution by which directions to them are sampled.
//!
//! The distribution is a grid of cells of equal solid angle, uniform in the azimuth and in the height y: a row is drawn by an alias
//! table, then a column by the table of that row. A cell's weight is the integral of the bilinear radiance over it, mean of the
//! channels, by exact integration along the rows of the image and Gauss's rule across, so that no pixel falls between the cells,
//! however fine the image. A share of each choice is uniform, which covers what the weights make too little of.
//!
//! Thresholds are multiples of 2⁻¹³, and the density in the table is that of the rounded thresholds: it is exactly the density of
//! what is drawn.

use super::layout::{TEXTURE_SKY, Texture};
use super::lights::alias_table;
use crate::scene::Bitmap;
use std::f64::consts::PI;

/// Share of the choice of a row, and of a column within it, that is uniform.
const UNIFORM_SHARE: f64 = 1.0 / 16.0;
/// Steps of the thresholds.
const THRESHOLDS: f64 = 8192.0;
/// The coarsest and the finest grid: powers of two of columns and rows. 2048 columns are as many as an alias of eleven bits can
/// name.
const COLUMNS: [u32; 2] = [4, 11];
const ROWS: [u32; 2] = [3, 10];

/// What became of an environment map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackedSky {
    /// Mean over all directions and channels, W/(m² sr).
    pub mean: f64,
    /// Where its tables are.
    pub texture: Texture,
}

/// Appends the pixels of an environment map, multiplied by `scale`, and its distribution to the values. Whether single
/// precision can hold the product, [`largest`] tells, and [`value_count`] whether there is room.
pub fn pack(bitmap: &Bitmap, scale: f64, values: &mut Vec<f32>) -> PackedSky {
    let first_value = values.len() as u32;
    values.reserve(3 * bitmap.pixels().len());
    values.extend(bitmap.pixels().iter().flatten().map(|value| (f64::from(*value) * scale) as f32));
    let power_of_two = |size: u32, [least, most]: [u32; 2]| size.next_power_of_two().ilog2().clamp(least, most);
    let (columns, rows) = (power_of_two(bitmap.width(), COLUMNS), power_of_two(bitmap.height(), ROWS));
    let weights = cell_weights(bitmap, 1 << columns, 1 << rows);
    let first_weight = values.len() as u32;
    append_distribution(&weights, 1 << columns, values);
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

/// The largest value of a bitmap once it is multiplied by `scale`.
pub fn largest(bitmap: &Bitmap, scale: f64) -> f64 {
    f64::from(bitmap.max()) * scale
}

/// How many numbers [`pack`] appends at most.
pub fn value_count(bitmap: &Bitmap) -> usize {
    let cells = 1usize << (COLUMNS[1] + ROWS[1]);
    3 * bitmap.pixels().len() + 2 * cells + (1 << ROWS[1])
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

/// Lines of an alias table with rounded thresholds, and the exact probability with which each is drawn.
fn rounded_table(weights: &[f64]) -> (Vec<f32>, Vec<f64>) {
    let count = weights.len() as f64;
    let total: f64 = weights.iter().sum();
    let by_weight = |weight: f64| if total > 0.0 { weight / total } else { 1.0 / count };
    let wanted: Vec<f64> =
        weights.iter().map(|&weight| (1.0 - UNIFORM_SHARE) * by_weight(weight) + UNIFORM_SHARE / count).collect();
    let mut probabilities = vec![0.0; weights.len()];
    let mut entries = Vec::with_capacity(weights.len());
    for (line, (threshold, alias)) in alias_table(&wanted).into_iter().enumerate() {
        let steps = (threshold * THRESHOLDS).round();
        // A line without an alias is its own: a threshold of 8192 would not fit in thirteen bits.
        let (steps, alias) = if steps >= THRESHOLDS { (0.0, line) } else { (steps.max(0.0), alias as usize) };
        probabilities[line] += steps / THRESHOLDS / count;
        probabilities[alias] += (1.0 - steps / THRESHOLDS) / count;
        entries.push((alias as f64 * THRESHOLDS + steps) as f32);
    }
    (entries, probabilities)
}

/// Appends the table of rows, the tables of columns, and the densities per solid angle.
fn append_distribution(weights: &[f64], columns: usize, values: &mut Vec<f32>) {
    let sums: Vec<f64> = weights.chunks_exact(columns).map(|row| row.iter().sum()).collect();
    let (entries, row_probabilities) = rounded_table(&sums);
    values.extend(entries);
    let per_solid_angle = weights.len() as f64 / (4.0 * PI);
    let mut densities = Vec::with_capacity(weights.len());
    for (row, probability) in weights.chunks_exact(columns).zip(row_probabilities) {
        let (entries, probabilities) = rounded_table(row);
        values.extend(entries);
        densities.extend(probabilities.iter().map(|column| (probability * column * per_solid_angle) as f32));
    }
    values.extend(densities);
}
