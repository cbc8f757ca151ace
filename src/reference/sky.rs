//! Mirror of `shaders/lib/sky.glsl`: radiance from infinitely far, from an image, and the density with which its directions
//! are sampled.

use super::bindings::Texture;
use super::math::arctan2;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, PI};

/// Steps in which probabilities are counted.
pub const SKY_STEPS: f64 = 16_777_216.0;

/// A cell of a row, or a row, as a number in \[0, 1) draws it.
#[derive(Clone, Copy, Debug)]
pub struct SkyCell {
    /// Which one.
    pub index: u32,
    /// Of the number within the cell.
    pub place: f64,
    /// 1 − place, without its loss of digits.
    pub rest: f64,
    /// That it is drawn.
    pub probability: f64,
}

/// A direction to the sky.
#[derive(Clone, Copy, Debug)]
pub struct SkySample {
    /// In the image's axes; unit.
    pub direction: DVec3,
    /// Not divided by the density.
    pub radiance: DVec3,
    /// Per solid angle.
    pub pdf: f64,
}

/// Columns of the grid by which directions are sampled.
pub fn sky_columns(sky: &Texture) -> u32 {
    1 << (sky.flags & 0xff)
}

/// Rows of that grid.
pub fn sky_rows(sky: &Texture) -> u32 {
    1 << (sky.flags >> 8)
}

/// Where the image has a direction.
pub fn sky_uv(direction: DVec3) -> DVec2 {
    let u = arctan2(direction.x, -direction.z) * (0.5 * FRAC_1_PI);
    let horizontal = DVec2::new(direction.x, direction.z).length();
    DVec2::new(u - u.floor(), arctan2(horizontal, direction.y) * FRAC_1_PI)
}

/// A number of the table of values.
fn value(values: &[f32], index: u32) -> f64 {
    f64::from(values[index as usize])
}

fn sky_pixel(values: &[f32], sky: &Texture, x: u32, y: u32) -> DVec3 {
    let first = sky.first_value + 3 * (y * sky.width + x);
    DVec3::new(value(values, first), value(values, first + 1), value(values, first + 2))
}

/// Bilinear. Columns have their centres at (x + ½)/width and go round; rows lie at y/(height − 1), so that the first and the
/// last are the poles.
pub fn sky_radiance(values: &[f32], sky: &Texture, uv: DVec2) -> DVec3 {
    let x = uv.x * f64::from(sky.width) - 0.5;
    let left = x.floor();
    let fx = x - left;
    let x0 = if left < 0.0 { sky.width - 1 } else { (left as u32).min(sky.width - 1) };
    let x1 = if x0 + 1 == sky.width { 0 } else { x0 + 1 };
    let y = uv.y.clamp(0.0, 1.0) * f64::from(sky.height - 1);
    let y0 = (y as u32).min(sky.height - 2);
    let fy = y - f64::from(y0);
    let row = |y: u32| sky_pixel(values, sky, x0, y) * (1.0 - fx) + sky_pixel(values, sky, x1, y) * fx;
    row(y0) * (1.0 - fy) + row(y0 + 1) * fy
}

/// Numbers of a distribution over `count` cells, a power of two: `count` + 1 guides, and then as many borders of the cells in steps
/// of 2⁻²⁴.
pub fn sky_distribution_size(count: u32) -> u32 {
    2 * count + 2
}

/// Where the distribution of a row begins.
pub fn sky_row(sky: &Texture, row: u32) -> u32 {
    sky.first_weight + sky_distribution_size(sky_rows(sky)) + row * sky_distribution_size(sky_columns(sky))
}

/// Of a cell, or a row.
pub fn sky_probability(values: &[f32], first: u32, count: u32, index: u32) -> f64 {
    let border = first + count + 1 + index;
    (value(values, border + 1) - value(values, border)) / SKY_STEPS
}

/// The cell that `u` draws.
pub fn sky_cell(values: &[f32], first: u32, count: u32, u: f64) -> SkyCell {
    let step = (u * SKY_STEPS).floor().min(SKY_STEPS - 1.0);
    let (guide, borders) = (first + (step * (f64::from(count) / SKY_STEPS)) as u32, first + count + 1);
    let (mut index, mut last) = (value(values, guide) as u32, value(values, guide + 1) as u32);
    while index < last {
        let middle = (index + last) / 2;
        if step >= value(values, borders + middle + 1) {
            index = middle + 1;
        } else {
            last = middle;
        }
    }
    let (begin, end) = (value(values, borders + index), value(values, borders + index + 1));
    let steps = end - begin;
    SkyCell {
        index,
        place: (step - begin + 0.5) / steps,
        rest: (end - step - 0.5) / steps,
        probability: steps / SKY_STEPS,
    }
}

/// Density per solid angle of a cell, from the probabilities of its row and of its column there.
pub fn sky_cell_pdf(sky: &Texture, of_row: f64, of_column: f64) -> f64 {
    of_row * of_column * f64::from(sky_rows(sky) * sky_columns(sky)) * (0.25 * FRAC_1_PI)
}

/// Density per solid angle of a direction of height `y`, which the image has at `u`.
pub fn sky_pdf(values: &[f32], sky: &Texture, u: f64, y: f64) -> f64 {
    let (columns, rows) = (sky_columns(sky), sky_rows(sky));
    let row = (((0.5 - 0.5 * y).max(0.0) * f64::from(rows)) as u32).min(rows - 1);
    let column = ((u * f64::from(columns)) as u32).min(columns - 1);
    let of_row = sky_probability(values, sky.first_weight, rows, row);
    sky_cell_pdf(sky, of_row, sky_probability(values, sky_row(sky, row), columns, column))
}

/// A direction with a density that follows the image.
pub fn sample_sky(values: &[f32], sky: &Texture, u: DVec2) -> SkySample {
    let row = sky_cell(values, sky.first_weight, sky_rows(sky), u.x);
    let column = sky_cell(values, sky_row(sky, row.index), sky_columns(sky), u.y);
    // (1 − y)/2 and (1 + y)/2, and the azimuth/2π.
    let rows = f64::from(sky_rows(sky));
    let (t, rest) = ((f64::from(row.index) + row.place) / rows, (rows - f64::from(row.index + 1) + row.rest) / rows);
    let azimuth = (f64::from(column.index) + column.place) / f64::from(sky_columns(sky));
    let sin_theta = 2.0 * (t * rest).sqrt();
    let phi = 2.0 * PI * azimuth;
    let v = 2.0 * FRAC_1_PI * arctan2(t.sqrt(), rest.sqrt());
    SkySample {
        direction: DVec3::new(sin_theta * phi.sin(), 1.0 - 2.0 * t, -sin_theta * phi.cos()),
        radiance: sky_radiance(values, sky, DVec2::new(azimuth, v)),
        pdf: sky_cell_pdf(sky, row.probability, column.probability),
    }
}
