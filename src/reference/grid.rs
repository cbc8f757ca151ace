//! Mirror of `shaders/lib/grid.glsl`: fields in space, and walks through the cells of voxels.

use super::math::{exp_minus, max_component, minus_log_1m, one_minus_exp_minus};
use super::rng::{pcg4d, to_unit};
use crate::pack::layout::{self, GRID_CLAMP, GRID_MIRROR, GRID_NEAREST, GRID_RGB};
use glam::{DVec2, DVec3, DVec4, IVec3, UVec3};

/// Longest distance.
const INFINITE_DISTANCE: f64 = layout::INFINITE_DISTANCE as f64;

/// See [`layout::Grid`].
#[derive(Clone, Copy, Debug, Default)]
#[allow(missing_docs, reason = "the members are documented in `layout`")]
pub struct Grid {
    pub rows: [DVec3; 3],
    pub shift: DVec3,
    pub size: [u32; 3],
    pub flags: u32,
    pub cells: [u32; 3],
    pub first_value: u32,
    pub first_cell: u32,
}

impl From<&layout::Grid> for Grid {
    fn from(from: &layout::Grid) -> Grid {
        Grid {
            rows: [from.row_x, from.row_y, from.row_z].map(|row| row.as_dvec3()),
            shift: DVec3::new(f64::from(from.shift_x), f64::from(from.shift_y), f64::from(from.shift_z)),
            size: [from.size_x, from.size_y, from.size_z],
            flags: from.flags,
            cells: [from.cells_x, from.cells_y, from.cells_z],
            first_value: from.first_value,
            first_cell: from.first_cell,
        }
    }
}

impl Grid {
    fn cell_counts(&self) -> DVec3 {
        DVec3::from_array(self.cells.map(f64::from))
    }

    fn direction(&self, direction: DVec3) -> DVec3 {
        DVec3::from_array(self.rows.map(|row| row.dot(direction)))
    }
}

/// A coordinate in the unit cube, moved to \[−½, 5/2\] without moving to another voxel.
pub fn grid_coordinate(x: f64, flags: u32) -> f64 {
    if flags & GRID_CLAMP != 0 {
        x.clamp(-0.5, 1.5)
    } else if flags & GRID_MIRROR != 0 {
        x - 2.0 * (0.5 * x).floor()
    } else {
        x - x.floor()
    }
}

/// The voxel of an index that may lie outside of the box.
pub fn grid_index(index: i32, size: u32, flags: u32) -> u32 {
    let count = size as i32;
    if flags & GRID_CLAMP != 0 {
        return index.clamp(0, count - 1) as u32;
    }
    let period = if flags & GRID_MIRROR != 0 { 2 * count } else { count };
    let index = index.rem_euclid(period);
    (if index < count { index } else { period - 1 - index }) as u32
}

fn grid_voxel(values: &[f32], grid: &Grid, [x, y, z]: [u32; 3]) -> DVec3 {
    let index = (z * grid.size[1] + y) * grid.size[0] + x;
    let value = |index: u32| f64::from(values[index as usize]);
    if grid.flags & GRID_RGB != 0 {
        let first = grid.first_value + 3 * index;
        DVec3::new(value(first), value(first + 1), value(first + 2))
    } else {
        DVec3::splat(value(grid.first_value + index))
    }
}

/// A point in the unit cube of the voxels.
pub fn grid_local(grid: &Grid, point: DVec3) -> DVec3 {
    grid.direction(point) + grid.shift
}

/// The field at a point of the unit cube.
pub fn grid_value(values: &[f32], grid: &Grid, local: DVec3) -> DVec3 {
    let nearest = grid.flags & GRID_NEAREST != 0;
    let size = DVec3::from_array(grid.size.map(f64::from));
    let at = DVec3::from_array(local.to_array().map(|x| grid_coordinate(x, grid.flags)));
    let at = at * size - if nearest { 0.0 } else { 0.5 };
    let (low, part) = (at.floor(), at - at.floor());
    let index = |k: usize, step: i32| grid_index(low[k] as i32 + step, grid.size[k], grid.flags);
    if nearest {
        return grid_voxel(values, grid, [0, 1, 2].map(|k| index(k, 0)));
    }
    let row = |y: i32, z: i32| {
        let voxel = |x: i32| grid_voxel(values, grid, [index(0, x), index(1, y), index(2, z)]);
        voxel(0).lerp(voxel(1), part.x)
    };
    let plane = |z: i32| row(0, z).lerp(row(1, z), part.y);
    plane(0).lerp(plane(1), part.z)
}

/// Where a ray is in the unit cube, (enters, leaves) between two distances.
pub fn clip_to_grid(grid: &Grid, origin: DVec3, direction: DVec3, t_begin: f64, t_end: f64) -> DVec2 {
    let from = grid_local(grid, origin);
    let inverse = DVec3::ONE / away_from_zero(grid.direction(direction));
    let (low, high) = (-from * inverse, (DVec3::ONE - from) * inverse);
    DVec2::new(low.min(high).max_element().max(t_begin), low.max(high).min_element().min(t_end))
}

fn away_from_zero(step: DVec3) -> DVec3 {
    DVec3::select(step.abs().cmplt(DVec3::splat(1e-20)), DVec3::splat(1e-20), step)
}

/// Where a ray stands on its way through the cells.
#[derive(Clone, Copy, Debug)]
pub struct GridWalk {
    origin: DVec3,
    direction: DVec3,
    cell: IVec3,
    /// Distance.
    pub t: f64,
    end: f64,
    /// Integral of the smallest extinction coefficient of the cells.
    pub least: f64,
    /// Integral of their mean.
    pub mean: f64,
    /// Of the cell at `t`: the largest extinction coefficient.
    pub most: f64,
    /// Of the cell at `t`: tentative collisions per unit of length.
    pub rate: f64,
}

/// The beginning of a walk.
pub fn start_grid_walk(grid: &Grid, origin: DVec3, direction: DVec3, t_begin: f64, t_end: f64) -> GridWalk {
    let cells = grid.cell_counts();
    let clipped = clip_to_grid(grid, origin, direction, t_begin, t_end);
    let origin = grid_local(grid, origin) * cells;
    let direction = away_from_zero(grid.direction(direction) * cells);
    let start = (origin + direction * clipped.x.min(clipped.y)).floor().clamp(DVec3::ZERO, cells - 1.0);
    let cell = start.as_ivec3();
    let (t, end) = (clipped.x, clipped.y);
    GridWalk { origin, direction, cell, t, end, least: 0.0, mean: 0.0, most: 0.0, rate: 0.0 }
}

/// The point of the unit cube where a walk stands.
pub fn walk_point(grid: &Grid, walk: &GridWalk) -> DVec3 {
    (walk.origin + walk.direction * walk.t) / grid.cell_counts()
}

/// Which rate a walk's tentative collisions have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rate {
    /// That of delta tracking.
    Delta,
    /// What is left of the largest extinction coefficient without the smallest.
    Residual,
    /// The mean.
    Mean,
}

/// The numbers of a cell: the largest, the smallest and the mean extinction coefficient, and the rate of delta tracking.
fn cell_numbers(values: &[f32], grid: &Grid, cell: UVec3) -> [f64; 4] {
    let first = grid.first_cell + 4 * ((cell.z * grid.cells[1] + cell.y) * grid.cells[0] + cell.x);
    [0, 1, 2, 3].map(|number| f64::from(values[first as usize + number]))
}

/// Goes on to the next tentative collision, at an optical depth `tau` of them; false if the walk ends before.
pub fn walk_to_collision(values: &[f32], grid: &Grid, kind: Rate, walk: &mut GridWalk, tau: &mut f64) -> bool {
    let counts = IVec3::from_array(grid.cells.map(|count| count as i32));
    while walk.t < walk.end {
        let [most, least, mean, rate] = cell_numbers(values, grid, walk.cell.as_uvec3());
        let rate = match kind {
            Rate::Delta => rate,
            Rate::Residual => most - least,
            Rate::Mean => mean,
        };
        let forward = walk.direction.cmpgt(DVec3::ZERO);
        let side = walk.cell.as_dvec3() + DVec3::select(forward, DVec3::ONE, DVec3::ZERO);
        let leaves = (side - walk.origin) / walk.direction;
        let nearest = leaves.min_element();
        let mut way = nearest.max(walk.t).min(walk.end) - walk.t;
        let collides = *tau < rate * way;
        if collides {
            way = (*tau / rate).min(way);
        }
        walk.t += way;
        walk.least += least * way;
        walk.mean += mean * way;
        if collides {
            walk.most = most;
            walk.rate = rate;
            return true;
        }
        *tau = (*tau - rate * way).max(0.0);
        let axis = if leaves.x == nearest { 0 } else { 1 + usize::from(leaves.y != nearest) };
        walk.cell[axis] += if forward.test(axis) { 1 } else { -1 };
        if walk.cell.cmplt(IVec3::ZERO).any() || walk.cell.cmpge(counts).any() {
            walk.end = walk.t;
        }
    }
    false
}

/// The mean of the cell in which a point of the unit cube lies.
pub fn grid_mean(values: &[f32], grid: &Grid, local: DVec3) -> f64 {
    let cell = (local * grid.cell_counts()).floor().clamp(DVec3::ZERO, grid.cell_counts() - 1.0);
    cell_numbers(values, grid, cell.as_uvec3())[2]
}

/// Four numbers of a stream.
pub fn stream_numbers(key: [u32; 4], index: u32) -> DVec4 {
    to_unit(pcg4d([key[0].wrapping_add(index), key[1], key[2], key[3]]))
}

/// Below this transmittance a shadow ray goes on by chance.
const FAINT_TRANSMITTANCE: f64 = 1e-3;
const FAINT_DEPTH: f64 = 7.0;

/// A stretch of a ray: origin, direction, and the distances between which it lies.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub struct Span {
    pub origin: DVec3,
    pub direction: DVec3,
    pub t_begin: f64,
    pub t_end: f64,
}

/// An unbiased estimate of the transmittance of a stretch, by residual ratio tracking (Novák et al. 2014), and the optical depth of
/// the cells' means. `index` counts the numbers of the stream.
pub fn grid_transmittance(
    values: &[f32],
    grid: &Grid,
    sigma_t: DVec3,
    whole: bool,
    span: &Span,
    key: [u32; 4],
    index: &mut u32,
) -> (DVec3, f64) {
    let mut walk = start_grid_walk(grid, span.origin, span.direction, span.t_begin, span.t_end);
    let mut passes = DVec3::ONE;
    let mut tau = minus_log_1m(stream_numbers(key, *index).x);
    *index += 1;
    while walk_to_collision(values, grid, Rate::Residual, &mut walk, &mut tau) {
        let u = stream_numbers(key, *index);
        *index += 1;
        let sigma = sigma_t * grid_value(values, grid, walk_point(grid, &walk));
        passes *= ((DVec3::splat(walk.most) - sigma) / walk.rate).clamp(DVec3::ZERO, DVec3::ONE);
        tau = minus_log_1m(u.x);
        if max_component(passes) < FAINT_TRANSMITTANCE || walk.least > FAINT_DEPTH {
            passes = if u.y < 0.5 { DVec3::ZERO } else { 2.0 * passes };
            if max_component(passes) == 0.0 {
                if !whole {
                    break;
                }
                tau = INFINITE_DISTANCE;
            }
        }
    }
    (passes * exp_minus(walk.least), walk.mean)
}

/// Density times length of a density exp(−h) at heights above 0, `low` at the lower end of the way.
pub fn length_above(low: f64, slope: f64, way: f64) -> f64 {
    let change = slope * way;
    exp_minus(low) * if change > 1e-12 { one_minus_exp_minus(change) / slope } else { way }
}

/// The height at a distance along a ray, and how it changes, in units of the scale height.
fn height_at(grid: &Grid, origin: DVec3, direction: DVec3, t: f64) -> (f64, f64) {
    let slope = grid.rows[0].dot(direction);
    (grid.rows[0].dot(origin) + grid.shift.x + slope * t, slope)
}

/// The density at a point.
pub fn height_density(grid: &Grid, point: DVec3) -> f64 {
    exp_minus(height_at(grid, point, DVec3::ZERO, 0.0).0.max(0.0))
}

/// Density times length between two distances; the density is exp(−h) above the height 0, and 1 below.
pub fn height_length(grid: &Grid, span: &Span) -> f64 {
    let (begin, slope) = height_at(grid, span.origin, span.direction, span.t_begin);
    let (way, steep) = (span.t_end - span.t_begin, slope.abs());
    if slope > 0.0 {
        let below = if begin < 0.0 { (-begin / slope).min(way) } else { 0.0 };
        return below + length_above(begin.max(0.0), steep, way - below);
    }
    let above = if begin > 0.0 { (begin / steep.max(1e-30)).min(way) } else { 0.0 };
    way - above + length_above((begin - steep * above).max(0.0), steep, above)
}

/// log(1 + x) for x ≥ 0.
pub fn log_1p(x: f64) -> f64 {
    x.ln_1p()
}

/// The way from `t_begin` on over which density times length becomes `wanted`; 1e30 if it never does.
pub fn height_flight(grid: &Grid, origin: DVec3, direction: DVec3, t_begin: f64, wanted: f64) -> f64 {
    let (begin, slope) = height_at(grid, origin, direction, t_begin);
    if slope > 0.0 {
        let below = if begin < 0.0 { (-begin / slope).min(INFINITE_DISTANCE) } else { 0.0 };
        if wanted <= below {
            return wanted;
        }
        let part = (wanted - below) * slope / exp_minus(begin.max(0.0)).max(1e-37);
        return if part < 1.0 {
            (below + minus_log_1m(part) / slope).min(INFINITE_DISTANCE)
        } else {
            INFINITE_DISTANCE
        };
    }
    if begin <= 0.0 {
        return wanted;
    }
    let (steep, thin) = (-slope, exp_minus(begin));
    let above = (begin / steep.max(1e-30)).min(INFINITE_DISTANCE);
    let part = wanted * steep / thin.max(1e-37);
    let way = if part > 1e-12 {
        log_1p(part.min(1e37)) / steep.max(1e-30)
    } else {
        (wanted / thin.max(1e-30)).min(INFINITE_DISTANCE)
    };
    if way <= above { way } else { above + (wanted - length_above(0.0, steep, above)).max(0.0) }
}

/// A density's voxels, and what lies beyond the box around them.
struct DenseVoxels {
    first: u32,
    row: u32,
    layer: u32,
    shift: DVec3,
    count: IVec3,
    nearest: bool,
}

fn dense_voxels(grid: &Grid) -> DenseVoxels {
    let nearest = grid.flags & GRID_NEAREST != 0;
    let more = if nearest { 0 } else { 2 };
    let row = grid.size[0] + more;
    DenseVoxels {
        first: grid.first_value,
        row,
        layer: row * (grid.size[1] + more),
        shift: DVec3::splat(if nearest { 0.0 } else { 0.5 }),
        count: IVec3::from_array(grid.size.map(|side| side as i32 + i32::from(!nearest))),
        nearest,
    }
}

/// The density `s` after a place of a ray in a cell: a polynomial of s, constant first.
fn density_along(values: &[f32], voxels: &DenseVoxels, cell: IVec3, part: DVec3, step: DVec3) -> DVec4 {
    let first = voxels.first + cell.z as u32 * voxels.layer + cell.y as u32 * voxels.row + cell.x as u32;
    let voxel = |x: u32, y: u32, z: u32| {
        DVec4::new(f64::from(values[(first + z * voxels.layer + y * voxels.row + x) as usize]), 0.0, 0.0, 0.0)
    };
    if voxels.nearest {
        return voxel(0, 0, 0);
    }
    // Interpolates two polynomials, by a part that grows by `step`.
    let between = |from: DVec4, to: DVec4, part: f64, step: f64| {
        let rise = to - from;
        from + rise * part + DVec4::new(0.0, rise.x, rise.y, rise.z) * step
    };
    let row = |y: u32, z: u32| between(voxel(0, y, z), voxel(1, y, z), part.x, step.x);
    let plane = |z: u32| between(row(0, z), row(1, z), part.y, step.y);
    between(plane(0), plane(1), part.z, step.z)
}

/// The integral of such a density from 0 to s.
fn length_along(density: DVec4, s: f64) -> f64 {
    s * (density.x + s * (density.y / 2.0 + s * (density.z / 3.0 + s * (density.w / 4.0))))
}

/// Cells along the side of a block that a ray passes in one step if they are all alike.
const BLOCK: i32 = 4;

/// How far a ray gets.
#[derive(Clone, Copy, Debug)]
pub struct DenseWay {
    /// From where it begins.
    pub way: f64,
    /// Density times length of that way.
    pub dense: f64,
    /// Whether that is what was wanted.
    pub ends: bool,
}

/// The way through voxels of one number over which density times length becomes `wanted`, or else all of it.
fn voxel_way(values: &[f32], grid: &Grid, span: &Span, wanted: f64) -> DenseWay {
    let clipped = clip_to_grid(grid, span.origin, span.direction, span.t_begin, span.t_end);
    let voxels = dense_voxels(grid);
    let size = DVec3::from_array(grid.size.map(f64::from));
    let from = grid_local(grid, span.origin) * size + voxels.shift;
    let step = away_from_zero(grid.direction(span.direction) * size);
    let forward = step.cmpgt(DVec3::ZERO);
    let (mut t, mut end, mut dense) = (clipped.x, clipped.y, 0.0);
    let mut cell = (from + step * t.min(end)).floor().as_ivec3().clamp(IVec3::ZERO, voxels.count - 1);
    while t < end {
        let block = cell / BLOCK;
        let at = (block.z as u32 * grid.cells[1] + block.y as u32) * grid.cells[0] + block.x as u32;
        let same = f64::from(values[(grid.first_cell + at) as usize]);
        let skips = same >= 0.0;
        let low = if skips { block * BLOCK } else { cell };
        let high = low + if skips { BLOCK } else { 1 };
        let leaves = (DVec3::select(forward, high.as_dvec3(), low.as_dvec3()) - from) / step;
        let side = leaves.min_element();
        let way = side.max(t).min(end) - t;
        let density = if skips {
            DVec4::new(same, 0.0, 0.0, 0.0)
        } else {
            density_along(values, &voxels, cell, from + step * t - cell.as_dvec3(), step)
        };
        let more = length_along(density, way);
        if dense + more >= wanted {
            let way = t + way_along(density, way, wanted - dense) - span.t_begin;
            return DenseWay { way, dense: wanted, ends: true };
        }
        dense += more;
        t += way;
        cell = (from + step * t).floor().as_ivec3().clamp(low, high - 1);
        let axis = if leaves.x == side { 0 } else { 1 + usize::from(leaves.y != side) };
        cell[axis] = if forward.test(axis) { high[axis] } else { low[axis] - 1 };
        if cell.cmplt(IVec3::ZERO).any() || cell.cmpge(voxels.count).any() {
            end = t;
        }
    }
    DenseWay { way: span.t_end - span.t_begin, dense, ends: false }
}

/// The way from 0 to at most `most` over which the integral of a density becomes `wanted`.
fn way_along(density: DVec4, most: f64, wanted: f64) -> f64 {
    let (mut low, mut high) = (0.0, most);
    let mut s = most * (wanted / length_along(density, most).max(1e-37)).min(1.0);
    for _ in 0..16 {
        let excess = length_along(density, s) - wanted;
        if excess < 0.0 {
            low = s;
        } else {
            high = s;
        }
        let here = density.x + s * (density.y + s * (density.z + s * density.w));
        let mut next = s - excess / here.max(1e-37);
        if !(next >= low && next <= high) {
            next = 0.5 * (low + high);
        }
        let moved = (next - s).abs();
        s = next;
        if moved <= 1e-6 * most {
            break;
        }
    }
    s
}

/// The way over which density times length becomes `wanted`, or else all of it.
pub fn dense_way(values: &[f32], grid: &Grid, span: &Span, wanted: f64) -> DenseWay {
    if grid.size[0] > 0 {
        return voxel_way(values, grid, span, wanted);
    }
    let (way, dense) = (span.t_end - span.t_begin, height_length(grid, span));
    if wanted >= dense {
        return DenseWay { way, dense, ends: false };
    }
    let way = height_flight(grid, span.origin, span.direction, span.t_begin, wanted).min(way);
    DenseWay { way, dense: wanted, ends: true }
}

/// The density at a point.
pub fn density_at(values: &[f32], grid: &Grid, point: DVec3) -> f64 {
    if grid.size[0] == 0 {
        return height_density(grid, point);
    }
    let voxels = dense_voxels(grid);
    let place = grid_local(grid, point) * DVec3::from_array(grid.size.map(f64::from)) + voxels.shift;
    let cell = place.floor().as_ivec3().clamp(IVec3::ZERO, voxels.count - 1);
    let part = (place - cell.as_dvec3()).clamp(DVec3::ZERO, DVec3::ONE);
    density_along(values, &voxels, cell, part, DVec3::ZERO).x
}
