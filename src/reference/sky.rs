//! Mirror of `shaders/lib/sky.glsl`: radiance from infinitely far, from an image, and the density with which its directions
//! are sampled.

use super::bindings::Texture;
use super::math::arctan2;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, PI};

const SKY_THRESHOLDS: f64 = 8192.0;

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

/// A line of an alias table: threshold + 8192 alias, an integer below 2²⁴. `u` decides whether the line is taken or its
/// alias.
pub fn sky_line(entry: f64, line: u32, u: f64) -> u32 {
    let word = entry as u32;
    if ((u * SKY_THRESHOLDS) as u32) < (word & 8191) { line } else { word >> 13 }
}

/// Density per solid angle of a cell.
pub fn sky_cell_pdf(values: &[f32], sky: &Texture, row: u32, column: u32) -> f64 {
    let (columns, rows) = (sky_columns(sky), sky_rows(sky));
    value(values, sky.first_weight + rows + rows * columns + row * columns + column)
}

/// Density per solid angle of a direction of height `y`, which the image has at `u`.
pub fn sky_pdf(values: &[f32], sky: &Texture, u: f64, y: f64) -> f64 {
    let (columns, rows) = (sky_columns(sky), sky_rows(sky));
    let row = (((0.5 - 0.5 * y).max(0.0) * f64::from(rows)) as u32).min(rows - 1);
    let column = ((u * f64::from(columns)) as u32).min(columns - 1);
    sky_cell_pdf(values, sky, row, column)
}

/// A direction with a density that follows the image. `u` chooses the lines and the place in a cell, `decision` between the
/// lines and their aliases.
pub fn sample_sky(values: &[f32], sky: &Texture, u: DVec2, decision: DVec2) -> SkySample {
    let (columns, rows) = (sky_columns(sky), sky_rows(sky));
    let scaled = u * DVec2::new(f64::from(rows), f64::from(columns));
    let (row, column) = ((scaled.x as u32).min(rows - 1), (scaled.y as u32).min(columns - 1));
    let place = scaled - DVec2::new(f64::from(row), f64::from(column));
    let row = sky_line(value(values, sky.first_weight + row), row, decision.x);
    let column = sky_line(value(values, sky.first_weight + rows + row * columns + column), column, decision.y);
    // (1 − y)/2, and the azimuth/2π.
    let t = (f64::from(row) + place.x) / f64::from(rows);
    let azimuth = (f64::from(column) + place.y) / f64::from(columns);
    let sin_theta = 2.0 * (t * (1.0 - t)).sqrt();
    let phi = 2.0 * PI * azimuth;
    let v = 2.0 * FRAC_1_PI * arctan2(t.sqrt(), (1.0 - t).sqrt());
    SkySample {
        direction: DVec3::new(sin_theta * phi.sin(), 1.0 - 2.0 * t, -sin_theta * phi.cos()),
        radiance: sky_radiance(values, sky, DVec2::new(azimuth, v)),
        pdf: sky_cell_pdf(values, sky, row, column),
    }
}
