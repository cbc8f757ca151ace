//! Fields in space as the kernels have them: voxels, and for the walk along a ray cells with bounds of the extinction coefficient.

use super::PackError;
use super::frame::{Bounds, Frame};
use super::layout::{
    GRID_CLAMP, GRID_MIRROR, GRID_NEAREST, GRID_RGB, Grid, MEDIUM_ALBEDO_GRID, MEDIUM_DENSITY, MEDIUM_EMISSION_GRID,
    MEDIUM_VOXELS,
};
use crate::scene::{self, Filter, GridVolume, HeightVolume, Scene, Volume, Wrap};
use glam::{DMat4, DVec3, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Voxels along the side of a cell of a large grid. Cells of fewer voxels bound the density more closely, but there are more to walk
/// through.
const CELL_VOXELS: u32 = 8;
/// A tentative collision costs as much as so many cells of a density, for the variance that it brings.
const CELLS_PER_COLLISION: f64 = 8.0;
/// Cells along the side of a block; that of `grid.glsl`.
const BLOCK: usize = 4;
/// Cells along a side of a small grid, unless it has fewer voxels.
const LEAST_CELLS: u32 = 8;
/// Most cells along a side.
const MOST_CELLS: u32 = 64;
/// Numbers of a cell: largest, smallest and mean extinction coefficient, and the rate of tentative collisions; see `grid.glsl`.
const CELL_NUMBERS: usize = 4;
/// How far, in voxels, rounding may move a point to another cell.
const SLACK: f64 = 0.01;
/// By how much rounding may lift an interpolated value above all voxels.
const ROUNDING: f32 = 1e-5;
/// Grids that the table can hold: their index has 24 bits, and each medium has three.
const MAX_GRIDS: usize = (1 << 24) - 4;

/// The table of grids, and the voxels that are among the values already.
#[derive(Default)]
pub struct GridTable {
    /// Three for each medium that is not homogeneous: of the extinction coefficient, the albedo and the emission.
    pub grids: Vec<Grid>,
    voxels: Vec<(Arc<scene::Grid>, u32)>,
    densities: Vec<(Arc<scene::Grid>, (Filter, Wrap), u32)>,
}

impl GridTable {
    /// Adds the fields of a medium, whose extinction coefficient and emission per canonical unit, without their fields, are given.
    /// Returns `Medium::grids`.
    pub fn add(
        &mut self,
        medium: &scene::Medium,
        sigma_t: Vec3,
        frame: &Frame,
        values: &mut Vec<f32>,
    ) -> Result<u32, PackError> {
        let fields = &medium.volumes;
        if fields.is_empty() {
            return Ok(0);
        }
        if self.grids.len() >= MAX_GRIDS {
            return Err(PackError::TooManyMedia(self.grids.len() / 3));
        }
        let first = self.grids.len();
        let mut code = first as u32 + 1;
        let mut entries = [Grid::default(); 3];
        match &fields.sigma_t {
            None => {}
            Some(Volume::Height(height)) => {
                code |= MEDIUM_DENSITY;
                entries[0] = height_grid(height, frame);
            }
            Some(Volume::Grid(field)) => {
                let most = sigma_t.max_element() * field.grid.max();
                if !most.is_finite() {
                    let value = f64::from(sigma_t.max_element()) * f64::from(field.grid.max());
                    return Err(PackError::OutOfRange { what: "sigma_t", name: medium.name.clone(), value });
                }
                let place = placed(field, frame);
                let tracked = cells(field, medium, sigma_t, &place);
                // What glows is found at tentative collisions.
                let one = field.grid.channels() == 1 && medium.emission == DVec3::ZERO;
                let dense =
                    one.then(|| blocks(field)).filter(|(_, blocks)| is_worth_its_cells(&place, blocks, &tracked.1));
                let (cells, numbers) = if let Some(dense) = dense {
                    code |= MEDIUM_DENSITY;
                    entries[0] = Grid { first_value: self.first_dense_value(field, values)?, ..place };
                    dense
                } else {
                    code |= MEDIUM_VOXELS;
                    entries[0] = Grid { first_value: self.first_value(&field.grid, values)?, ..place };
                    tracked
                };
                room(values, numbers.len())?;
                [entries[0].cells_x, entries[0].cells_y, entries[0].cells_z] = cells;
                entries[0].first_cell = values.len() as u32;
                values.extend(numbers);
            }
        }
        let others = [(&fields.albedo, MEDIUM_ALBEDO_GRID), (&fields.emission, MEDIUM_EMISSION_GRID)];
        for ((field, bit), entry) in others.into_iter().zip(&mut entries[1..]) {
            if let Some(field) = field {
                code |= bit;
                *entry = self.voxel_grid(field, frame, values)?;
            }
        }
        self.grids.extend(entries);
        Ok(code)
    }

    /// A grid without cells.
    fn voxel_grid(&mut self, field: &GridVolume, frame: &Frame, values: &mut Vec<f32>) -> Result<Grid, PackError> {
        Ok(Grid { first_value: self.first_value(&field.grid, values)?, ..placed(field, frame) })
    }

    /// Where the voxels begin among the values.
    fn first_value(&mut self, grid: &Arc<scene::Grid>, values: &mut Vec<f32>) -> Result<u32, PackError> {
        if let Some((_, first)) = self.voxels.iter().find(|(known, _)| Arc::ptr_eq(known, grid)) {
            return Ok(*first);
        }
        room(values, grid.values().len())?;
        let first = values.len() as u32;
        values.extend_from_slice(grid.values());
        self.voxels.push((grid.clone(), first));
        Ok(first)
    }

    /// Where the voxels of a density begin, with those beyond the box around them that interpolation takes.
    fn first_dense_value(&mut self, field: &GridVolume, values: &mut Vec<f32>) -> Result<u32, PackError> {
        let GridVolume { grid, filter, wrap, .. } = field;
        if let Some((.., first)) =
            self.densities.iter().find(|(known, as_known, _)| Arc::ptr_eq(known, grid) && *as_known == (*filter, *wrap))
        {
            return Ok(*first);
        }
        let [xs, ys, zs] = voxels_of_cells(field);
        room(values, xs.len() * ys.len() * zs.len())?;
        let first = values.len() as u32;
        for (z, y) in zs.iter().flat_map(|z| ys.iter().map(move |y| (*z, *y))) {
            values.extend(xs.iter().map(|x| grid.voxel(*x, y, z)[0]));
        }
        self.densities.push((grid.clone(), (*filter, *wrap), first));
        Ok(first)
    }
}

/// Whether the values have room for so many more.
fn room(values: &[f32], more: usize) -> Result<(), PackError> {
    let count = values.len() + more;
    if u32::try_from(count).is_ok() { Ok(()) } else { Err(PackError::TooManyValues(count)) }
}

/// Where a grid is and how it is read.
fn placed(field: &GridVolume, frame: &Frame) -> Grid {
    let [size_x, size_y, size_z] = field.grid.resolution();
    let wrap = match field.wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => GRID_MIRROR,
        Wrap::Clamp => GRID_CLAMP,
    };
    let nearest = if field.filter == Filter::Nearest { GRID_NEAREST } else { 0 };
    let rgb = if field.grid.channels() == 3 { GRID_RGB } else { 0 };
    let to_local = to_local(field, frame);
    let row = |k: usize| to_local.row(k).truncate().as_vec3();
    let shift = |k: usize| to_local.row(k).w as f32;
    Grid {
        row_x: row(0),
        shift_x: shift(0),
        row_y: row(1),
        shift_y: shift(1),
        row_z: row(2),
        shift_z: shift(2),
        size_x,
        size_y,
        size_z,
        flags: wrap | nearest | rgb,
        ..Grid::default()
    }
}

/// From the canonical frame to the unit cube of a grid.
fn to_local(field: &GridVolume, frame: &Frame) -> DMat4 {
    let to_world = DMat4::from_translation(frame.center) * DMat4::from_scale(DVec3::splat(1.0 / frame.scale));
    field.to_world.inverse() * to_world
}

/// The first row is the height over the base in units of the scale height.
fn height_grid(height: &HeightVolume, frame: &Frame) -> Grid {
    let row = height.up / (height.scale_height * frame.scale);
    let shift = (frame.center - height.base).dot(height.up) / height.scale_height;
    Grid { row_x: row.as_vec3(), shift_x: shift as f32, ..Grid::default() }
}

/// The box that the voxels of a scene-wide medium fill: shapes may be elsewhere.
pub fn bounds(scene: &Scene) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    if let Some(id) = scene.camera.medium
        && let Some(Volume::Grid(field)) = &scene.media[id.0 as usize].volumes.sigma_t
    {
        for corner in crate::scene::mesh::box_of(field.to_world).positions {
            bounds.grow(corner);
        }
    }
    bounds
}

/// Voxels whose values may count at a place in a cell: those from the first to the last, before they are wrapped.
fn reach(cell: u32, cells: u32, size: u32, nearest: bool) -> [i64; 2] {
    let center = if nearest { 0.0 } else { 0.5 };
    let voxel =
        |side: u32, slack: f64| (f64::from(side) / f64::from(cells) * f64::from(size) - center + slack).floor() as i64;
    let last = voxel(cell + 1, SLACK) + i64::from(!nearest);
    [voxel(cell, -SLACK), last]
}

/// The voxel that stands for one outside.
fn wrapped(index: i64, size: u32, wrap: Wrap) -> u32 {
    let size = i64::from(size);
    let inside = match wrap {
        Wrap::Clamp => index.clamp(0, size - 1),
        Wrap::Repeat => index.rem_euclid(size),
        Wrap::Mirror => {
            let index = index.rem_euclid(2 * size);
            index.min(2 * size - 1 - index)
        }
    };
    inside as u32
}

/// The voxels between which the cells of a density lie, in each axis: with interpolation one more at either end than the box has.
fn voxels_of_cells(field: &GridVolume) -> [Vec<u32>; 3] {
    let more = if field.filter == Filter::Nearest { 0 } else { 1 };
    let size = field.grid.resolution();
    size.map(|side| (-more..i64::from(side) + more).map(|voxel| wrapped(voxel, side, field.wrap)).collect())
}

/// Blocks of a density's cells along each side, and of each the value of all of its voxels, or −1 where they differ; x fastest.
fn blocks(field: &GridVolume) -> ([u32; 3], Vec<f32>) {
    let voxels = voxels_of_cells(field);
    let more = if field.filter == Filter::Nearest { 0 } else { 1 };
    let counts = [0, 1, 2].map(|k| (voxels[k].len() - more).div_ceil(BLOCK) as u32);
    let numbers = (0..counts.iter().product::<u32>()).into_par_iter().map(|index| {
        let at = [index % counts[0], index / counts[0] % counts[1], index / counts[0] / counts[1]];
        let [xs, ys, zs] = [0, 1, 2].map(|k| {
            let first = at[k] as usize * BLOCK;
            &voxels[k][first..(first + BLOCK + more).min(voxels[k].len())]
        });
        let value = |x: u32, y: u32, z: u32| field.grid.voxel(x, y, z)[0];
        let first = value(xs[0], ys[0], zs[0]);
        let alike = zs.iter().all(|&z| ys.iter().all(|&y| xs.iter().all(|&x| value(x, y, z) == first)));
        if alike { first } else { -1.0 }
    });
    (counts, numbers.collect())
}

/// Whether to go through the cells of a density one by one, rather than to track: by how many of them the mean chord of the box crosses, those
/// of blocks that are alike aside, and how many tentative collisions there would be on it.
fn is_worth_its_cells(place: &Grid, blocks: &[f32], tracked: &[f32]) -> bool {
    let sides = [place.row_x, place.row_y, place.row_z].map(|row| 1.0 / f64::from(row.length()));
    let [x, y, z] = sides;
    // Cauchy (1841): four times the volume over the surface.
    let chord = 2.0 * x * y * z / (x * y + y * z + z * x);
    let counts = [place.size_x, place.size_y, place.size_z];
    // A random direction crosses on average half as many cells of an axis as there are on the way along it.
    let crossed = counts.iter().zip(sides).map(|(count, side)| f64::from(*count) / side / 2.0).sum::<f64>();
    let uneven = blocks.iter().filter(|value| **value < 0.0).count() as f64 / blocks.len() as f64;
    let rates = tracked.chunks_exact(CELL_NUMBERS).map(|numbers| f64::from(numbers[3]));
    let rate = rates.sum::<f64>() / (tracked.len() / CELL_NUMBERS) as f64;
    uneven * crossed * chord <= CELLS_PER_COLLISION * (1.0 + rate * chord)
}

/// Cells along each side, and the numbers of each cell, x fastest.
fn cells(field: &GridVolume, medium: &scene::Medium, sigma_t: Vec3, entry: &Grid) -> ([u32; 3], Vec<f32>) {
    let size = field.grid.resolution();
    let cells = size.map(|side| side.div_ceil(CELL_VOXELS).max(LEAST_CELLS.min(side)).min(MOST_CELLS));
    // A medium that emits is looked up about once in each cell that glows, however thin it is.
    let rows = [entry.row_x, entry.row_y, entry.row_z];
    let once = (0..3).map(|k| rows[k].length() * cells[k] as f32).fold(0.0, f32::max);
    let glows = medium.emission != DVec3::ZERO;
    let same_place = |emission: &&GridVolume| {
        emission.to_world == field.to_world && emission.grid.resolution() == size && emission.wrap == field.wrap
    };
    let emission = medium.volumes.emission.as_ref().filter(same_place);
    let nearest = field.filter == Filter::Nearest && emission.is_none_or(|other| other.filter == Filter::Nearest);
    let count = cells.iter().map(|side| *side as usize).product::<usize>();
    let numbers = (0..count).into_par_iter().flat_map_iter(|index| {
        let index = index as u32;
        let at = [index % cells[0], index / cells[0] % cells[1], index / cells[0] / cells[1]];
        let [xs, ys, zs] = [0, 1, 2].map(|k| {
            let [first, last] = reach(at[k], cells[k], size[k], nearest);
            (first..=last).map(|voxel| wrapped(voxel, size[k], field.wrap)).collect::<Vec<u32>>()
        });
        let (mut most, mut least, mut sum, mut bright) = (0f32, f32::INFINITY, 0f64, 0f32);
        for (&x, &y, &z) in zs.iter().flat_map(|z| {
            ys.iter().flat_map({
                let xs = &xs;
                move |y| xs.iter().map(move |x| (x, y, z))
            })
        }) {
            let sigma = sigma_t * Vec3::from(field.grid.voxel(x, y, z));
            most = most.max(sigma.max_element());
            least = least.min(sigma.min_element());
            sum += f64::from(sigma.element_sum() / 3.0);
            bright = bright.max(emission.map_or(1.0, |other| Vec3::from(other.grid.voxel(x, y, z)).max_element()));
        }
        let mean = (sum / (xs.len() * ys.len() * zs.len()) as f64) as f32;
        let most = if most > least { most * (1.0 + ROUNDING) } else { most };
        let rate = if glows && bright > 0.0 { most.max(once) } else { most };
        [most, least, mean, rate] as [f32; CELL_NUMBERS]
    });
    (cells, numbers.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_knows_all_voxels_that_count_in_it() {
        for (size, cells, nearest) in [(16, 2, false), (16, 2, true), (5, 5, false), (100, 13, false), (3, 3, true)] {
            for cell in 0..cells {
                let [first, last] = reach(cell, cells, size, nearest);
                for step in 0..=100 {
                    let x = (f64::from(cell) + f64::from(step) / 100.0) / f64::from(cells) * f64::from(size);
                    let shifted = if nearest { x } else { x - 0.5 };
                    let low = shifted.floor() as i64;
                    let high = if nearest { low } else { low + 1 };
                    assert!(first <= low && high <= last, "{size} {cells} {cell}: {low}..{high} in {first}..{last}");
                }
                // No more than the slack asks for.
                assert!((last - first) as f64 <= f64::from(size) / f64::from(cells) + 3.0);
            }
        }
    }

    #[test]
    fn voxels_outside_stand_for_those_inside() {
        let all = |wrap| [-5, -1, 0, 3, 4, 9].map(|index| wrapped(index, 4, wrap));
        assert_eq!(all(Wrap::Clamp), [0, 0, 0, 3, 3, 3]);
        assert_eq!(all(Wrap::Repeat), [3, 3, 0, 3, 0, 1]);
        assert_eq!(all(Wrap::Mirror), [3, 0, 0, 3, 3, 1]);
    }
}
