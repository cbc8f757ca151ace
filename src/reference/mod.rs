//! The renderer on the CPU, in double precision, for trust: one file for each file of `shaders/lib`, with the same
//! names, the same random numbers and the same decisions. It follows the very paths of the kernels, so the two differ
//! by rounding alone, but for the few paths where rounding turns a decision.
//!
//! It shares no code with [`crate::gpu`]; both read the tables of [`crate::pack`].

pub mod bindings;
pub mod bsdf;
pub mod bvh;
pub mod camera;
pub mod equiangular;
pub mod film;
pub mod filter;
pub mod grid;
pub mod guide;
pub mod light;
pub mod math;
pub mod medium;
pub mod microfacet;
pub mod outlook;
pub mod path;
pub mod path_aim;
pub mod path_flight;
pub mod path_lights;
pub mod path_open;
pub mod path_probe;
pub mod path_rays;
pub mod path_shadow;
pub mod path_share;
pub mod path_state;
pub mod path_surface;
pub mod path_vertex;
pub mod phase;
pub mod principled;
pub mod ray;
pub mod rng;
pub mod sampler;
pub mod sky;
pub mod texture;
pub mod toward_light;
pub mod warp;

use crate::pack::Packed;
use crate::pack::groups::{group_offset, groups};
use crate::pack::layout::TILE;
use crate::render::allocation::{self, Allocation, Level, tile_grid};
use crate::render::{BLOCK_SAMPLES, Backend, BackendError, Block, DeviceInfo, RUN_SAMPLES, Run};
use bindings::Tables;
use bvh::{grid_ray, next_primitive, start_walk, step_walk};
use glam::DVec3;
use path::{Path, begin_hit, path_answer, path_start, test_primitive};
use path_share::{share, share_rest};
use ray::Ray;
use rayon::prelude::*;
use std::ops::Range;

/// A scene on the CPU.
pub struct Renderer {
    tables: Tables,
    info: DeviceInfo,
    allocation: Allocation,
}

impl Renderer {
    /// Widens the tables.
    pub fn new(packed: Packed) -> Renderer {
        let driver = format!("tyndall {}", env!("CARGO_PKG_VERSION"));
        let tables = Tables::new(&packed);
        Renderer {
            info: DeviceInfo { name: "CPU reference (f64)".to_owned(), driver },
            allocation: Allocation::uniform(crop(&tables), tables.features.sharers),
            tables,
        }
    }

    fn render_block(&self, samples: Range<u32>) -> Block {
        let [width, height] = crop(&self.tables);
        let pixels = (width * height) as usize;
        let sharers = self.tables.features.sharers;
        let mut block = Block::new(samples.clone(), pixels, sharers);
        for (level, tiles) in self.allocation.tiles_by_level() {
            self.render_tiles(level, &tiles, &samples, &mut block);
        }
        block
    }

    /// Adds to a block the samples of tiles with one level.
    fn render_tiles(&self, level: Level, in_tiles: &[u32], asked: &Range<u32>, block: &mut Block) {
        let crop = crop(&self.tables);
        let sharers = self.tables.features.sharers;
        let across = tile_grid(crop, sharers)[0];
        let samples = level.samples(asked);
        for first in samples.clone().step_by(RUN_SAMPLES as usize) {
            let run = first..samples.end.min(first + RUN_SAMPLES);
            let [dx, dy] = group_offset(sharers, first);
            let of_tiles = |group: &Vec<[u32; 2]>| {
                let tile = group.first().map(|[x, y]| (y + dy) / TILE * across + (x + dx) / TILE);
                tile.is_some_and(|tile| in_tiles.binary_search(&tile).is_ok())
            };
            // In parallel by pixel or group of pixels; the samples of each in order, so the sums are always the same.
            let sums: Vec<(usize, PixelSums)> = groups(crop, sharers, first)
                .into_par_iter()
                .filter(of_tiles)
                .flat_map_iter(|group| {
                    let sums = self.group_sums(&group, run.clone());
                    group.into_iter().map(|[x, y]| (y * crop[0] + x) as usize).zip(sums)
                })
                .collect();
            let rounded = |v: DVec3| v.as_vec3().to_array();
            for (index, pixel) in sums {
                let of_pixel = Run {
                    first,
                    count: run.len() as u32,
                    sum: rounded(pixel.sum),
                    squares: rounded(pixel.squares),
                    shared: rounded(pixel.shared),
                };
                block.add_run(index, &of_pixel);
                for (total, count) in block.invalid.iter_mut().zip(pixel.invalid) {
                    *total += count;
                }
            }
        }
    }

    /// Mirror of `resolve.comp`, for pixels that share their paths, or a single one.
    fn group_sums(&self, group: &[[u32; 2]], samples: Range<u32>) -> Vec<PixelSums> {
        let params = &self.tables.params;
        let index = |[x, y]: &[u32; 2]| (y + params.crop_y) * params.film_width + x + params.crop_x;
        let pixels: Vec<u32> = group.iter().map(index).collect();
        let mut sums: Vec<PixelSums> = group.iter().map(|_| PixelSums::default()).collect();
        for sample_index in samples {
            for (sums, found) in sums.iter_mut().zip(find_samples(&self.tables, &pixels, sample_index)) {
                sums.sum += found.value;
                sums.squares += found.value * found.value;
                sums.shared += found.shared;
                let positive = if found.filter_weight < 0.0 { -found.value } else { found.value };
                if let Some(cause) = invalid_cause(positive, self.tables.features.pilot) {
                    sums.invalid[cause] += 1;
                }
            }
        }
        sums
    }
}

impl Backend for Renderer {
    fn device(&self) -> &DeviceInfo {
        &self.info
    }

    fn render(&mut self, samples: Range<u32>) -> Result<Vec<Block>, BackendError> {
        assert!(samples.start.is_multiple_of(BLOCK_SAMPLES), "blocks are aligned");
        let starts = samples.clone().step_by(BLOCK_SAMPLES as usize);
        Ok(starts.map(|first| self.render_block(first..samples.end.min(first.saturating_add(BLOCK_SAMPLES)))).collect())
    }

    fn allocate(&mut self, trial: u32) -> Result<(), BackendError> {
        let (crop, sharers) = (crop(&self.tables), self.tables.features.sharers);
        self.allocation = Allocation::uniform(crop, sharers);
        if trial > 0 {
            let seed = self.tables.params.seed;
            self.tables.params.seed = allocation::trial_seed(seed);
            let block = self.render_block(0..trial);
            self.tables.params.seed = seed;
            self.allocation = Allocation::measured(&block, crop, sharers);
        }
        Ok(())
    }
}

fn crop(tables: &Tables) -> [u32; 2] {
    [tables.params.crop_width, tables.params.crop_height]
}

/// What a block has of one pixel.
#[derive(Default)]
struct PixelSums {
    sum: DVec3,
    squares: DVec3,
    shared: DVec3,
    invalid: [u64; 3],
}

/// Index in [`crate::render::INVALID_CAUSES`] of what is wrong with a sample.
fn invalid_cause(value: DVec3, may_be_negative: bool) -> Option<usize> {
    if value.is_nan() {
        Some(0)
    } else if !value.is_finite() {
        Some(1)
    } else if value.min_element() < 0.0 && !may_be_negative {
        Some(2)
    } else {
        None
    }
}

/// The radiance of one sample of a pixel of the film, which is counted row by row over the whole film.
pub fn sample_radiance(packed: &Packed, pixel: u32, sample_index: u32) -> DVec3 {
    trace(&Tables::new(packed), pixel, sample_index)
}

/// Mirror of the loop of `path_trace.comp` for one sample of a pixel that shares nothing: what it adds to its pixel.
pub fn trace(tables: &Tables, pixel: u32, sample_index: u32) -> DVec3 {
    find_samples(tables, &[pixel], sample_index)[0].value
}

/// What a sample adds to a pixel.
struct Found {
    value: DVec3,
    /// Of this, what the group brought.
    shared: DVec3,
    /// Factor by the reconstruction filter, in both; it may be negative.
    filter_weight: f64,
}

/// What a sample adds to each pixel of a group.
fn find_samples(tables: &Tables, pixels: &[u32], sample_index: u32) -> Vec<Found> {
    let (mut found, mut records) = (Vec::new(), Vec::new());
    for pixel in pixels {
        let mut path = path_start(tables, *pixel, sample_index);
        while path.alive || path.shadow {
            let hit = traverse(tables, &path);
            path_answer(tables, &mut path, &hit);
        }
        let value = (share_rest(&mut path) + path.record.base) * path.filter_weight;
        found.push(Found { value, shared: DVec3::ZERO, filter_weight: path.filter_weight });
        records.push(path.record);
    }
    if tables.features.sharers > 0 {
        for (found, brought) in found.iter_mut().zip(share(tables, &records)) {
            found.shared = brought * found.filter_weight;
            found.value += found.shared;
        }
    }
    found
}

/// Answers the ray that a path asks for.
pub fn traverse(tables: &Tables, path: &Path) -> path::Hit {
    let params = &tables.params;
    let mut hit = begin_hit(tables, path);
    let ray = Ray::new(path.origin, path.direction);
    let grid = grid_ray(path.origin, path.direction, params.grid_origin, params.grid_step);
    for index in 0..tables.immediate_count {
        test_primitive(tables, path, &ray, index, &mut hit);
    }
    let mut walk = start_walk(&grid, params.tree_size, hit.t);
    while !hit.blocked {
        if let Some(index) = next_primitive(&mut walk) {
            test_primitive(tables, path, &ray, index, &mut hit);
        } else if let Some(node) = walk.next_node() {
            step_walk(&tables.nodes[node as usize], &grid, hit.t, &mut walk);
        } else {
            break;
        }
    }
    hit
}
