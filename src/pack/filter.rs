//! The table of a reconstruction filter, from which the kernels draw the places of samples.

use super::layout::Params;
use crate::scene::{Film, ReconstructionFilter};
use glam::Vec2;

/// Cells in a pixel. A cell is one step of the step function that is rendered in the filter's place: with this many, a
/// Gaussian's variance is off by less than one part in ten thousand.
const CELLS_A_PIXEL: f64 = 64.0;
/// Most cells of a table.
const MAX_CELLS: f64 = 1024.0;
/// Points of the midpoint rule in a cell.
const POINTS: u32 = 16;

/// Integrals of a filter up to the edges of its cells: `cells + 1` of its absolute value, from 0 to 1, and as many of the filter, in
/// the same unit. Cells in which it changes its sign count with their mean.
pub fn table(filter: &ReconstructionFilter) -> Vec<f32> {
    let radius = filter.radius();
    let cells = (2.0 * radius * CELLS_A_PIXEL).ceil().min(MAX_CELLS) as u32;
    let width = 2.0 * radius / f64::from(cells);
    let mean = |cell: u32| {
        let place = |k| -radius + (f64::from(cell) + (f64::from(k) + 0.5) / f64::from(POINTS)) * width;
        (0..POINTS).map(|k| filter.eval(place(k))).sum::<f64>() / f64::from(POINTS)
    };
    let means: Vec<f64> = (0..cells).map(mean).collect();
    let total: f64 = means.iter().map(|mean| mean.abs()).sum();
    let integrals = |of: fn(f64) -> f64| {
        let sums = means.iter().scan(0.0, move |sum, mean| {
            *sum += of(*mean);
            Some((*sum / total) as f32)
        });
        std::iter::once(0.0).chain(sums).collect::<Vec<f32>>()
    };
    [integrals(f64::abs), integrals(|mean| mean)].concat()
}

/// Puts the film's filter into the parameters and its table behind the values, unless each sample counts for its own pixel alone.
pub fn pack(film: &Film, params: &mut Params, values: &mut Vec<f32>) {
    if film.filter == ReconstructionFilter::PIXEL {
        return;
    }
    let table = table(&film.filter);
    params.first_filter_value = values.len() as u32;
    params.filter_cells = table.len() as u32 / 2 - 1;
    params.filter_radius = film.filter.radius() as f32;
    values.extend(table);
    // Farther away than any film is long, and any filter wide.
    let far = Vec2::splat(2.0 * Film::MAX_SIDE as f32);
    (params.sample_area_begin, params.sample_area_end) = film.sample_area.map_or((-far, far), |area| {
        let begin = Vec2::new(area.x as f32, area.y as f32);
        (begin, begin + Vec2::new(area.width as f32, area.height as f32))
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_grow_and_have_the_moments_of_their_filters() {
        for (filter, negative) in [
            (ReconstructionFilter::Box { radius: 1.5 }, false),
            (ReconstructionFilter::Tent { radius: 1.0 }, false),
            (ReconstructionFilter::DEFAULT, false),
            (ReconstructionFilter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }, true),
            (ReconstructionFilter::CATMULL_ROM, true),
            (ReconstructionFilter::Lanczos { lobes: 3.0 }, true),
        ] {
            let table = table(&filter);
            let (positive, signed) = table.split_at(table.len() / 2);
            assert!(positive.is_sorted() && positive[0] == 0.0 && (positive[positive.len() - 1] - 1.0).abs() < 1e-6);
            assert_eq!(positive != signed, negative, "{filter:?}");
            // The second moment, of the filter itself and of the table's steps.
            let radius = filter.radius();
            let moment = |n: u32, weight: &dyn Fn(f64) -> f64| {
                let place = |k: u32| -radius + (f64::from(k) + 0.5) * 2.0 * radius / f64::from(n);
                let sum = |power: i32| (0..n).map(|k| weight(place(k)) * place(k).powi(power)).sum::<f64>();
                sum(2) / sum(0)
            };
            let cells = signed.len() as u32 - 1;
            let step = |x: f64| {
                let cell = ((x + radius) / (2.0 * radius) * f64::from(cells)) as usize;
                f64::from(signed[cell + 1]) - f64::from(signed[cell])
            };
            let (of_table, of_filter) = (moment(cells, &step), moment(100_000, &|x| filter.eval(x)));
            assert!((of_table - of_filter).abs() < 2e-4, "{filter:?}: {of_table} instead of {of_filter}");
        }
    }
}
