//! A pilot: a few thousand paths before a render, on the CPU, that tell the renderer where paths are worth their time.
//!
//! The pilot follows paths of the reference ([`crate::reference`]) and remembers, for each vertex, what the rest of the path brought
//! and how many rays it took. Means and variances over cells of space drive the roulette of `shaders/lib/outlook.glsl`: a path may end
//! at a vertex with what was expected of it there, and goes on for the difference with the probability
//!
//! q = √(Σ_c (β_c / I_c)² V_c / 3 / C) · √(C_image / V_image),
//!
//! where β is its throughput, I the pixel's radiance, V the variance of what the rest of a path from that cell brings, and C the rays it
//! takes (Rath, Grittmann, Herholz, Weier and Slusallek 2022, "EARS: Efficiency-Aware Russian Roulette and Splitting", eq. 8 and 12;
//! Bolin and Meyer 1997). Rath et al. roll for a path's radiance, which costs its second moment; a path that ends with its
//! expectation costs only its variance, so far more paths can end early. Whatever the pilot says, the expected image stays the same.
//!
//! It also finds how much of the variance is left to paths behind their second vertices, and lets pixels share those where it pays
//! ([`crate::reference::path_share`]).
//!
//! The pilot has seeds of its own and depends on the scene alone, so the samples of a render can be split and merged as ever.

use crate::pack::Packed;
use crate::pack::layout::PILOT_CELLS;
use crate::reference::bindings::Tables;
use crate::reference::outlook::outlook_cell;
use crate::reference::path::{Path, arriving_throughput, path_answer_seen, path_start};
use crate::reference::path_share::{End, Record, can_share, end_of, passage_weight};
use crate::reference::path_state::NONE;
use crate::reference::traverse;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// Paths of each block, where only sharing is to be decided.
const FEW_PATHS_PER_BLOCK: u32 = 4;
/// The light of mirrors and glass on other surfaces, which cannot be shared, is rare and bright: a few paths do not see it. So where surfaces
/// have lobes and sharing seems to pay, that is asked of so many.
const MANY_PATHS_PER_BLOCK: u32 = 64;
/// The part of a render's variance before the second vertex is stratified so much better than that of the pilot.
const DIRECT_STRATIFIED: f64 = 4.0;
/// What a group of M pixels shares has the variance of so many times M to this power paths of one's own, as the image is put together
/// from it (measured: 1.9 to 2.4, and .2 to .4).
const ALIKE: f64 = 2.0;
const ALIKE_EXPONENT: f64 = 0.35;
/// What keeping paths and summing up costs, in units of a path (measured: .25 to .35).
const SHARE_COST: f64 = 0.35;
/// A connection's ray takes this share of the time of a path's own ray, which has more to decide (measured: .4 to .5).
const CONNECTION_COST: f64 = 0.45;

/// Pixels of the largest groups.
pub const MOST_SHARERS: u32 = 8;
/// Pixels share their paths if the pilot promises at most this much of the variance times time without (measured: it pays where .81 is
/// promised, and costs more than it brings where .91 is).
const WORTH_SHARING: f64 = 0.86;
/// The same where a medium is a density of voxels: first vertices of neighbouring pixels lie apart along the ways through it, and connections
/// take as long as paths (measured: it pays where .56 is promised, and costs more than it brings where .68 is).
const WORTH_SHARING_FIELDS: f64 = 0.6;

/// Films with fewer pixels are rendered before a pilot would be.
const LEAST_PIXELS: usize = 4096;
/// Paths that may not get deeper than this are short anyway: no pilot ends them.
const LEAST_MAX_DEPTH: u32 = 8;
/// The least depth with light behind second vertices.
const LEAST_SHARED_DEPTH: u32 = 3;
/// Scenes with more primitives are not copied for a pilot, nor for guides.
pub const MOST_PRIMITIVES: usize = 4_000_000;
/// The film is divided into blocks of pixels, at most this many on a side.
const MOST_BLOCKS: u32 = 32;
/// Paths of each block.
const PATHS_PER_BLOCK: u32 = 16;
/// No further path is begun for each block after this many rays.
const MOST_RAYS: u64 = 400_000;
/// A path of the pilot ends after this many rays, whatever it loses.
const MOST_RAYS_OF_A_PATH: u32 = 400;
/// A cell with fewer vertices tells nothing.
const LEAST_VERTICES: f64 = 4.0;
/// A cell's variance is taken together with as many vertices of the average over all cells.
const PRIOR_VERTICES: f64 = 4.0;
/// Share of the image's mean radiance below which a pixel does not count as darker.
const FLOOR: f64 = 0.1;
/// A render's first dimensions are stratified, the pilot's are not: its variance is this many times that of a render (measured: 2 is
/// better than 1 or 4 for 64 samples a pixel).
const STRATIFIED: f64 = 2.0;
/// Seed of the pilot's random numbers, apart from those of renders.
const SEED: u32 = 0x7079_6c74;

/// One vertex of a path, and what came after it.
struct Vertex {
    point: DVec3,
    in_medium: bool,
    axis: DVec3,
    throughput: DVec3,
    /// For a throughput of 1.
    brought: DVec3,
    rays: f64,
}

/// One path.
struct Trail {
    block: usize,
    /// What came behind the first vertex.
    radiance: DVec3,
    /// Of that, what came before the second.
    direct: DVec3,
    /// The first two vertices can be shared.
    shares: bool,
    /// What the flight between them would weigh, if they were.
    weight: f64,
    rays: f64,
    vertices: Vec<Vertex>,
}

/// Sums over the vertices of one cell.
#[derive(Clone, Copy, Default)]
struct Cell {
    count: f64,
    sum: DVec3,
    squares: DVec3,
    rays: f64,
}

/// How the film is divided.
#[derive(Clone, Copy)]
struct Blocks {
    side: u32,
    columns: u32,
    rows: u32,
}

/// Runs a pilot and adds what it found to the tables of a scene; pixels may then share their paths if `sharing` says so. Scenes that
/// gain nothing by it stay as they are.
pub fn run(packed: &mut Packed, sharing: bool) {
    let features = &packed.features;
    let large = packed.pixel_count() >= LEAST_PIXELS;
    // Without a tree rays are so cheap that shorter paths hardly pay for the noise of their ends.
    // Light that comes through glass comes in rare, bright paths, of which a pilot has seen too few.
    let roulette = features.tree && !features.dielectric && features.max_depth >= LEAST_MAX_DEPTH;
    let sharing = sharing && features.max_depth >= LEAST_SHARED_DEPTH && can_share_paths(packed);
    if large && (roulette || sharing) && packed.primitives.len() <= MOST_PRIMITIVES {
        look_ahead(packed, sharing, roulette);
    }
}

fn look_ahead(packed: &mut Packed, sharing: bool, roulette: bool) {
    let features = &packed.features;
    let rounds = if roulette || features.voxels { PATHS_PER_BLOCK } else { FEW_PATHS_PER_BLOCK };
    let worth = if features.fields { WORTH_SHARING_FIELDS } else { WORTH_SHARING };
    let mut tables = Tables::new(packed);
    tables.params.seed = SEED;
    let params = &packed.params;
    let side = params.crop_width.max(params.crop_height).div_ceil(MOST_BLOCKS);
    let blocks = Blocks { side, columns: params.crop_width.div_ceil(side), rows: params.crop_height.div_ceil(side) };
    let mut trails = follow(&tables, blocks, 0..rounds);
    let Some(mut view) = View::of(&trails, blocks) else { return };
    if sharing && features.lobes() && view.best_sharers(worth) > 0 {
        trails.extend(follow(&tables, blocks, rounds..MANY_PATHS_PER_BLOCK));
        view = View::of(&trails, blocks).unwrap_or(view);
    }
    packed.features.sharers = if sharing { view.best_sharers(worth) } else { 0 };
    if roulette && let Some(found) = Found::of(&trails, &view, packed.features.sharers) {
        found.add_to(packed, blocks);
    }
}

/// Whether the kernels can connect paths of different pixels in such a scene: light through masks and panes is known by chance only, and the
/// density of flights through fields only where all media are gray and dark, and no distances go by lamps.
pub fn can_share_paths(packed: &Packed) -> bool {
    let features = &packed.features;
    let fields = features.grids && (features.chromatic || features.equiangular || features.emission);
    features.light_sampling && !fields && !features.masks && !features.panes
}

/// Follows one path for each block, and again until there are enough. The order of the result does not depend on the threads.
fn follow(tables: &Tables, blocks: Blocks, rounds: Range<u32>) -> Vec<Trail> {
    let mut trails = Vec::new();
    let mut rays = 0;
    for round in rounds {
        let of_round: Vec<Trail> = (0..blocks.columns * blocks.rows)
            .into_par_iter()
            .map(|block| follow_one(tables, blocks, block, round))
            .collect();
        rays += of_round.iter().map(|trail| trail.rays as u64).sum::<u64>();
        trails.extend(of_round);
        if rays > MOST_RAYS {
            break;
        }
    }
    trails
}

fn follow_one(tables: &Tables, blocks: Blocks, block: u32, round: u32) -> Trail {
    let params = &tables.params;
    // The pixels of a block in turn.
    let place = round * (blocks.side * blocks.side).div_ceil(PATHS_PER_BLOCK).max(1) % (blocks.side * blocks.side);
    let x = block % blocks.columns * blocks.side + place % blocks.side;
    let y = block / blocks.columns * blocks.side + place / blocks.side;
    let (x, y) = (x.min(params.crop_width - 1), y.min(params.crop_height - 1));
    let mut path = path_start(tables, (y + params.crop_y) * params.film_width + x + params.crop_x, round);
    let mut rays = 0;
    // With what the path had gathered, and after how many rays.
    let mut vertices: Vec<Vertex> = Vec::new();
    let mut ends: Vec<End> = Vec::new();
    let mut left = NONE;
    while (path.alive || path.shadow) && rays < MOST_RAYS_OF_A_PATH {
        rays += 1;
        let hit = traverse(tables, &path);
        path_answer_seen(tables, &mut path, &hit, |path, vertex| {
            if path.depth < 2 && can_share(path, vertex) {
                ends.push(end_of(path, vertex));
                left = if path.depth == 0 { path.left } else { left };
            }
            vertices.push(Vertex {
                point: vertex.point,
                in_medium: vertex.in_medium,
                axis: vertex.axis,
                throughput: arriving_throughput(path, vertex),
                brought: path.radiance,
                rays: f64::from(rays),
            });
        });
    }
    let after =
        |index: usize| vertices.get(index).map_or(DVec3::ZERO, |vertex: &Vertex| path.radiance - vertex.brought);
    let (radiance, direct) = (after(0), after(0) - after(1));
    for vertex in &mut vertices {
        let gained = (path.radiance - vertex.brought) / vertex.throughput;
        vertex.brought = DVec3::select(vertex.throughput.cmpgt(DVec3::splat(1e-9)), gained, DVec3::ZERO);
        vertex.rays = f64::from(rays) - vertex.rays;
    }
    vertices.retain(|vertex| vertex.brought.is_finite() && vertex.point.is_finite());
    let weight = match ends[..] {
        [first, second] if tables.features.voxels => {
            let Path { pixel, sample_index, .. } = path;
            let record = Record { first, second, left, weight: DVec3::ONE, pixel, sample_index, ..Record::default() };
            passage_weight(tables, &record)
        }
        _ => 1.0,
    };
    let shares = ends.len() == 2;
    Trail { block: block as usize, radiance, direct, shares, weight, rays: f64::from(rays), vertices }
}

/// What the trails say.
struct Found {
    origin: DVec3,
    scale: DVec3,
    /// Of each cell the mean and the worth, or a worth of −1.
    cells: Vec<[DVec3; 2]>,
    /// Of each block one over the square of its radiance.
    focus: Vec<DVec3>,
}

/// The image as the trails show it.
struct View {
    /// Of each block one over the square of its radiance.
    focus: Vec<DVec3>,
    /// Relative variance of a path.
    variance: f64,
    /// The same of what comes before its second vertex, and behind it where that can be shared and where it cannot.
    direct: f64,
    shared: f64,
    lonely: f64,
    /// By how much the weights of shared flights multiply the variance of what lies behind them.
    noise: f64,
    /// Of a path.
    rays: f64,
}

impl View {
    /// Nothing, if the image is black or has no variance. Lamps that are seen directly do not count: the dark pixels beside them do.
    fn of(trails: &[Trail], blocks: Blocks) -> Option<View> {
        let finite = || trails.iter().filter(|trail| trail.radiance.is_finite());
        let count = finite().count() as f64;
        let mean = finite().map(|trail| trail.radiance).sum::<DVec3>() / count;
        let floor = FLOOR * mean.element_sum() / 3.0;
        let of_blocks = |part: &dyn Fn(&Trail) -> DVec3| -> Vec<DVec3> {
            let mut sums = vec![(DVec3::ZERO, 0.0); (blocks.columns * blocks.rows) as usize];
            for trail in finite() {
                let (sum, count) = &mut sums[trail.block];
                *sum += part(trail);
                *count += 1.0;
            }
            sums.iter().map(|(sum, count)| *sum / f64::max(*count, 1.0)).collect()
        };
        let focus: Vec<DVec3> = (of_blocks(&|trail| trail.radiance).iter())
            .map(|mean| (*mean * *mean + DVec3::splat(floor * floor)).recip())
            .collect();
        let variance = |part: &dyn Fn(&Trail) -> DVec3| {
            let means = of_blocks(part);
            let relative = |trail: &Trail| {
                let difference = part(trail) - means[trail.block];
                (difference * difference * focus[trail.block]).element_sum() / 3.0
            };
            finite().map(relative).sum::<f64>() / count
        };
        let (all, direct) = (variance(&|trail| trail.radiance), variance(&|trail| trail.direct));
        let behind = |trail: &Trail, shares| {
            if trail.shares == shares { trail.radiance - trail.direct } else { DVec3::ZERO }
        };
        let (shared, lonely) = (variance(&|trail| behind(trail, true)), variance(&|trail| behind(trail, false)));
        // Those of the flight that found the second vertex, and of the connection to it.
        let noise = variance(&|trail| trail.weight * behind(trail, true)) / shared.max(f64::MIN_POSITIVE);
        let rays = trails.iter().map(|trail| trail.rays).sum::<f64>() / trails.len() as f64;
        let known = floor > 0.0 && all > 0.0 && all.is_finite();
        known.then_some(View { focus, variance: all, direct, shared, lonely, noise, rays })
    }

    /// Time of the connections of a pixel over that of a path.
    fn connections(&self, sharers: u32) -> f64 {
        f64::from(sharers.max(1) - 1) * CONNECTION_COST / self.rays
    }

    /// Variance with groups of so many pixels, as far as a render has it.
    fn variance_with(&self, sharers: u32) -> f64 {
        let noise = if sharers == 0 { 1.0 } else { self.noise };
        self.direct / DIRECT_STRATIFIED + self.lonely + self.shared * noise / alike(sharers)
    }

    /// Pixels of the groups that bring the least variance times time; 0 if that is more than `worth` times what it is without.
    fn best_sharers(&self, worth: f64) -> u32 {
        let time = |sharers: u32| match sharers {
            0 => 1.0,
            _ => 1.0 + SHARE_COST + self.connections(sharers),
        };
        let cost = |sharers: u32| self.variance_with(sharers) * time(sharers);
        let best = if cost(4) < cost(MOST_SHARERS) { 4 } else { MOST_SHARERS };
        if cost(best) < worth * cost(0) { best } else { 0 }
    }
}

/// As how many paths of its own a pixel has those of its group.
fn alike(sharers: u32) -> f64 {
    if sharers == 0 { 1.0 } else { ALIKE * f64::from(sharers).powf(ALIKE_EXPONENT) }
}

impl Found {
    /// Nothing, if no path scatters.
    fn of(trails: &[Trail], view: &View, sharers: u32) -> Option<Found> {
        // Where a group shares the rest of a path, its variance counts so much less; and a sample takes more rays.
        let (variance, rays) = match sharers {
            0 => (view.variance, view.rays),
            _ => (view.variance_with(sharers) * alike(sharers), view.rays * (1.0 + view.connections(sharers))),
        };
        let efficiency = STRATIFIED * rays / variance;
        let (origin, scale) = cells_of_space(trails)?;
        if !(efficiency.is_finite() && scale.is_finite()) {
            return None;
        }
        let cells = cells(trails, origin, scale);
        Some(Found { origin, scale, cells: weigh(&cells, efficiency), focus: view.focus.clone() })
    }

    fn add_to(&self, packed: &mut Packed, blocks: Blocks) {
        let numbers = 8 * self.cells.len() + 4 * self.focus.len();
        if packed.values.len() + numbers > u32::MAX as usize {
            return;
        }
        packed.params.pilot_origin = self.origin.as_vec3();
        packed.params.pilot_scale = self.scale.as_vec3();
        packed.params.block_side = blocks.side;
        packed.params.block_columns = blocks.columns;
        packed.params.first_cell = packed.values.len() as u32;
        let pad = |v: &DVec3| v.as_vec3().min(Vec3::splat(1e30));
        packed.values.extend(self.cells.iter().flat_map(|[mean, worth]| {
            let (mean, worth) = (pad(mean), pad(worth));
            [mean.x, mean.y, mean.z, worth.x, worth.y, worth.z, 0.0, 0.0]
        }));
        packed.params.first_block = packed.values.len() as u32;
        packed.values.extend(self.focus.iter().flat_map(|focus| {
            let focus = pad(focus);
            [focus.x, focus.y, focus.z, 0.0]
        }));
        packed.features.pilot = true;
    }
}

/// Lower corner and cells per unit of a box about nearly all vertices.
fn cells_of_space(trails: &[Trail]) -> Option<(DVec3, DVec3)> {
    let points: Vec<DVec3> = trails.iter().flat_map(|trail| &trail.vertices).map(|vertex| vertex.point).collect();
    if points.is_empty() {
        return None;
    }
    let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
    for axis in 0..3 {
        let mut along: Vec<f64> = points.iter().map(|point| point[axis]).collect();
        along.sort_by(f64::total_cmp);
        let outside = along.len() / 200;
        low[axis] = along[outside];
        high[axis] = along[along.len() - 1 - outside];
    }
    let size = (high - low).max(DVec3::splat((high - low).max_element().max(1e-6) * 1e-3));
    // A wall at the border must not fall into two cells by rounding.
    Some((low - size * 1e-2, f64::from(PILOT_CELLS) / (size * 1.02)))
}

fn cells(trails: &[Trail], origin: DVec3, scale: DVec3) -> Vec<Cell> {
    let mut cells = vec![Cell::default(); (PILOT_CELLS * PILOT_CELLS * PILOT_CELLS * 7) as usize];
    for vertex in trails.iter().flat_map(|trail| &trail.vertices) {
        let index = outlook_cell((vertex.point - origin) * scale, vertex.in_medium, vertex.axis);
        let cell = &mut cells[index as usize];
        cell.count += 1.0;
        cell.sum += vertex.brought;
        cell.squares += vertex.brought * vertex.brought;
        cell.rays += vertex.rays;
    }
    cells
}

/// Mean and worth of each cell.
fn weigh(cells: &[Cell], efficiency: f64) -> Vec<[DVec3; 2]> {
    let variance = |cell: &Cell| {
        let mean = cell.sum / cell.count;
        (cell.squares / cell.count - mean * mean).max(DVec3::ZERO) * cell.count / (cell.count - 1.0).max(1.0)
    };
    // The averages over surfaces and over media.
    let mut priors = [(0.0, DVec3::ZERO, 0.0); 2];
    for (index, cell) in cells.iter().enumerate().filter(|(_, cell)| cell.count > 0.0) {
        let (count, sum, rays) = &mut priors[usize::from(index % 7 == 6)];
        *count += cell.count;
        *sum += variance(cell) * cell.count;
        *rays += cell.rays;
    }
    let found = cells.iter().enumerate().map(|(index, cell)| {
        if cell.count < LEAST_VERTICES {
            return [DVec3::ZERO, DVec3::NEG_ONE];
        }
        let (count, sum, rays) = priors[usize::from(index % 7 == 6)];
        let together = cell.count + PRIOR_VERTICES;
        let variance = (variance(cell) * cell.count + sum / count * PRIOR_VERTICES) / together;
        let rays = (cell.rays + rays / count * PRIOR_VERTICES) / together;
        [cell.sum / cell.count, variance * efficiency / (3.0 * rays.max(1.0))]
    });
    found.collect()
}
