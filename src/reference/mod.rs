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
pub mod light;
pub mod math;
pub mod medium;
pub mod outlook;
pub mod path;
pub mod path_aim;
pub mod path_flight;
pub mod path_lights;
pub mod path_rays;
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
use crate::pack::layout::TILE;
use crate::render::{BLOCK_SAMPLES, Backend, BackendError, Block, DeviceInfo};
use bindings::Tables;
use bvh::{grid_ray, next_primitive, start_walk, step_walk};
use film::tile_pixel;
use glam::DVec3;
use path::{Path, begin_hit, path_answer, path_start, test_primitive};
use path_share::{group_of, share, share_rest};
use ray::Ray;
use rayon::prelude::*;
use std::ops::Range;

/// A scene on the CPU.
pub struct Renderer {
    tables: Tables,
    info: DeviceInfo,
}

impl Renderer {
    /// Widens the tables.
    pub fn new(packed: Packed) -> Renderer {
        let driver = format!("tyndall {}", env!("CARGO_PKG_VERSION"));
        Renderer { tables: Tables::new(&packed), info: DeviceInfo { name: "CPU reference (f64)".to_owned(), driver } }
    }

    fn render_block(&self, samples: Range<u32>) -> Block {
        let [width, height] = [self.tables.params.crop_width, self.tables.params.crop_height];
        let mut block = Block {
            first: samples.start,
            count: samples.end - samples.start,
            sums: vec![[0.0; 3]; (width * height) as usize],
            squares: vec![[0.0; 3]; (width * height) as usize],
            invalid: [0; 3],
        };
        let tiles = width.div_ceil(TILE) * height.div_ceil(TILE);
        // In parallel by pixel or group of pixels, in the order of tiles; the samples of each in order, so the sums are always the same.
        let sharers = self.tables.features.sharers;
        let pixels: Vec<(usize, PixelSums)> = (0..tiles * TILE * TILE)
            .into_par_iter()
            .filter_map(|slot| {
                let pixel = tile_pixel(slot / (TILE * TILE), slot % (TILE * TILE), width);
                let mut group = if sharers == 0 { vec![pixel] } else { group_of(pixel, sharers)? };
                group.retain(|[x, y]| *x < width && *y < height);
                let sums = self.group_sums(&group, samples.clone());
                Some(group.into_iter().map(|[x, y]| (y * width + x) as usize).zip(sums).collect::<Vec<_>>())
            })
            .flatten()
            .collect();
        for (index, pixel) in pixels {
            block.sums[index] = pixel.sum.as_vec3().to_array();
            block.squares[index] = pixel.squares.as_vec3().to_array();
            for (total, count) in block.invalid.iter_mut().zip(pixel.invalid) {
                *total += count;
            }
        }
        block
    }

    /// Mirror of `resolve.comp`, for pixels that share their paths, or a single one.
    fn group_sums(&self, group: &[[u32; 2]], samples: Range<u32>) -> Vec<PixelSums> {
        let params = &self.tables.params;
        let index = |[x, y]: &[u32; 2]| (y + params.crop_y) * params.film_width + x + params.crop_x;
        let pixels: Vec<u32> = group.iter().map(index).collect();
        let mut sums: Vec<PixelSums> = group.iter().map(|_| PixelSums::default()).collect();
        for sample_index in samples {
            let values = weighted_radiances(&self.tables, &pixels, sample_index);
            for (sums, (value, filter_weight)) in sums.iter_mut().zip(values) {
                sums.sum += value;
                sums.squares += value * value;
                let positive = if filter_weight < 0.0 { -value } else { value };
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
}

/// What a block has of one pixel.
#[derive(Default)]
struct PixelSums {
    sum: DVec3,
    squares: DVec3,
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
    weighted_radiances(tables, &[pixel], sample_index)[0].0
}

/// What a sample adds to each pixel of a group, and its factor by the reconstruction filter, which may be negative.
fn weighted_radiances(tables: &Tables, pixels: &[u32], sample_index: u32) -> Vec<(DVec3, f64)> {
    let (mut values, mut records) = (Vec::new(), Vec::new());
    for pixel in pixels {
        let mut path = path_start(tables, *pixel, sample_index);
        while path.alive || path.shadow {
            let hit = traverse(tables, &path);
            path_answer(tables, &mut path, &hit);
        }
        values.push((share_rest(&mut path) + path.record.base, path.filter_weight));
        records.push(path.record);
    }
    if tables.features.sharers > 0 {
        for ((value, _), brought) in values.iter_mut().zip(share(tables, &records)) {
            *value += brought;
        }
    }
    values.into_iter().map(|(value, filter_weight)| (value * filter_weight, filter_weight)).collect()
}

/// Answers the ray that a path asks for.
pub fn traverse(tables: &Tables, path: &Path) -> path::Hit {
    let (params, copies) = (&tables.params, tables.features.node_copies);
    let mut hit = begin_hit(tables, path);
    let ray = Ray::new(path.origin, path.direction);
    let grid = grid_ray(path.origin, path.direction, params.grid_origin, params.grid_step);
    let mut walk = start_walk(&grid, params.node_count, copies);
    for index in 0..tables.immediate_count {
        test_primitive(tables, path, &ray, index, &mut hit);
    }
    while !walk.is_done() && !hit.blocked {
        if walk.leaf != 0 {
            test_primitive(tables, path, &ray, next_primitive(&mut walk), &mut hit);
        } else {
            step_walk(tables.nodes[walk.node as usize], &grid, hit.t, copies, &mut walk);
        }
    }
    hit
}
