//! Mirror of `shaders/lib/filter.glsl`: reconstruction filters, by importance sampling. The table is described there.

use glam::DVec2;

/// Where a sample lies, and what it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSample {
    /// From the pixel's centre, in pixels.
    pub offset: f64,
    /// Filter / density, normalised: its mean is 1.
    pub weight: f64,
}

/// The integral up to a place that is counted in cells, in \[0, cells\].
pub fn filter_integral(values: &[f32], cells: u32, place: f64) -> f64 {
    let cell = place.floor().min(f64::from(cells - 1));
    let [below, above] = [0, 1].map(|k| f64::from(values[cell as usize + k]));
    below + (above - below) * (place - cell)
}

/// The ends of the filter within the bounds, counted in cells, and cells in a pixel.
fn ends(cells: u32, radius: f64, bounds: DVec2) -> (DVec2, f64) {
    let cells_a_pixel = f64::from(cells) / (2.0 * radius);
    let ends = ((bounds + radius) * cells_a_pixel).clamp(DVec2::ZERO, DVec2::splat(f64::from(cells)));
    (ends, cells_a_pixel)
}

/// A distance from the pixel's centre within the bounds (pixels), which must contain 0, and its factor. `values` begins with the
/// filter's table.
pub fn sample_filter(values: &[f32], cells: u32, radius: f64, bounds: DVec2, u: f64) -> FilterSample {
    let (ends, cells_a_pixel) = ends(cells, radius, bounds);
    let second = &values[cells as usize + 1..];
    let begin = filter_integral(values, cells, ends.x);
    let total = filter_integral(values, cells, ends.y) - begin;
    let signed_total = filter_integral(second, cells, ends.y) - filter_integral(second, cells, ends.x);
    let wanted = begin + u * total;
    let (mut low, mut high) = (0, cells as usize);
    while high - low > 1 {
        let middle = usize::midpoint(low, high);
        if f64::from(values[middle]) <= wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    let below = f64::from(values[low]);
    let width = f64::from(values[low + 1]) - below;
    let place = low as f64 + if width > 0.0 { ((wanted - below) / width).clamp(0.0, 1.0) } else { 0.5 };
    let side = if second[low + 1] < second[low] { -1.0 } else { 1.0 };
    FilterSample { offset: place.clamp(ends.x, ends.y) / cells_a_pixel - radius, weight: side * total / signed_total }
}

/// Density of the distance, per pixel.
pub fn filter_pdf(values: &[f32], cells: u32, radius: f64, bounds: DVec2, offset: f64) -> f64 {
    let (ends, cells_a_pixel) = ends(cells, radius, bounds);
    let place = (offset + radius) * cells_a_pixel;
    if place < ends.x || place >= ends.y {
        return 0.0;
    }
    let cell = place.min(f64::from(cells - 1)) as usize;
    let total = filter_integral(values, cells, ends.y) - filter_integral(values, cells, ends.x);
    (f64::from(values[cell + 1]) - f64::from(values[cell])) * cells_a_pixel / total
}
