//! Lamps that the camera sees: what comes from them straight, or through media, is found apart from the paths.
//!
//! A lamp is far brighter than what surrounds it, so in a pixel on its edge, and in fog in all pixels that it covers, most of the error
//! of a path tracer is that of whether a path has come to it. There the paths leave such light out, and camera rays bring it, several
//! for each path: one ray to a known lamp costs little, the transmittance on the way is known, and well-spread rays over a pixel find
//! the part that a lamp covers with an error that falls faster than that of paths. The expectation of each pixel stays the same.
//!
//! Which pixels these are is found once, from the scene alone, so that the samples of a render can be split and merged as ever.

use crate::pack::Packed;
use crate::pack::layout::{MEDIUM_DENSITY, MEDIUM_VOXELS, PRIMITIVE_SPHERE, Primitive};
use crate::reference::bindings::Tables;
use crate::reference::math::exp_minus_rgb;
use crate::reference::path::{Path, begin_hit, path_start};
use crate::reference::path_lights::add_emission;
use crate::reference::path_rays::test_primitive;
use crate::reference::path_vertex::surface_point;
use crate::reference::ray::Ray;
use crate::reference::traverse;
use crate::render::{Backend, BackendError, Block, DeviceInfo};
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use std::ops::Range;

/// Rays for each sample of a pixel which a lamp covers in part, and where that part is small: rays that miss cost little.
const RAYS: u32 = 4;
const MANY_RAYS: u32 = 16;
const SMALL_PART: f64 = 0.2;
/// Rays by which the pixels are found, and where all of these miss.
const TRIAL_RAYS: u32 = 16;
const MANY_TRIAL_RAYS: u32 = 256;
/// A pixel is left alone if its rays bring the same to this part.
const ALIKE: f64 = 0.02;
/// Scenes with more primitives that shine are left alone.
const MOST_PRIMITIVES: usize = 4096;
/// At most this part of the rays for each sample of all pixels.
const MOST_RAYS: f64 = 0.125;
/// Seed of these rays, apart from that of the paths.
const SEED: u32 = 0x7365_656e;

/// A pixel whose lamps are found apart.
#[derive(Clone, Debug)]
struct Pixel {
    /// In the crop window, row by row.
    index: u32,
    /// Rays for each sample.
    rays: u32,
    /// The primitives that shine into it.
    primitives: Vec<u32>,
}

/// The pixels whose lamps are found apart, and the rays for them.
#[derive(Clone, Debug)]
pub struct Seen {
    tables: Tables,
    pixels: Vec<Pixel>,
}

impl Seen {
    /// Finds the pixels, and tells the tables that paths leave out the lamps in them. Nothing, where no lamp is seen, or where the way to
    /// lamps is known by chance only: through voxels, masks, panes and lenses.
    pub fn find(packed: &mut Packed) -> Option<Seen> {
        let features = &packed.features;
        let by_chance = features.grids || features.masks || features.panes || features.lens;
        let voxels = packed.media.iter().any(|medium| medium.grids & (MEDIUM_VOXELS | MEDIUM_DENSITY) != 0);
        if by_chance || voxels || features.hide_emitters {
            return None;
        }
        let candidates = candidates(packed)?;
        let mut tables = Tables::new(packed);
        tables.params.seed ^= SEED;
        tables.features.sharers = 0;
        let mut pixels: Vec<Pixel> = candidates.into_par_iter().filter_map(|pixel| judge(&tables, pixel)).collect();
        // Edges first, as far as there is time.
        pixels.sort_by_key(|pixel| std::cmp::Reverse(pixel.rays));
        let most = (MOST_RAYS * packed.pixel_count() as f64) as u32;
        let mut rays = 0;
        pixels.retain(|pixel| {
            rays += pixel.rays;
            rays <= most
        });
        let room = (u32::MAX as usize).saturating_sub(packed.values.len());
        if pixels.is_empty() || packed.pixel_count() > room {
            return None;
        }
        packed.params.first_seen = packed.values.len() as u32;
        packed.values.resize(packed.values.len() + packed.pixel_count(), 0.0);
        for pixel in &pixels {
            packed.values[packed.params.first_seen as usize + pixel.index as usize] = 1.0;
        }
        packed.features.seen = true;
        Some(Seen { tables, pixels })
    }

    /// The pixels whose lamps are found apart: their numbers in the crop window, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = usize> {
        self.pixels.iter().map(|pixel| pixel.index as usize)
    }

    /// Adds to blocks what the paths have left out.
    fn add(&self, blocks: &mut [Block]) {
        for block in blocks {
            let of_pixels: Vec<DVec3> = self.pixels.par_iter().map(|pixel| self.mean(pixel, block)).collect();
            for (pixel, mean) in self.pixels.iter().zip(of_pixels) {
                let index = pixel.index as usize;
                let count = block.counts[index] as f32;
                for (q, mean) in mean.as_vec3().to_array().into_iter().enumerate() {
                    // The same for all samples of the block, so that their scatter stays.
                    block.squares[index][q] += mean * (2.0 * block.sums[index][q] + count * mean);
                    block.sums[index][q] += count * mean;
                }
                block.invalid[0] += if mean.is_finite() { 0 } else { u64::from(block.counts[index]) };
            }
        }
    }

    fn mean(&self, pixel: &Pixel, block: &Block) -> DVec3 {
        let rays = pixel.rays * block.first..pixel.rays * (block.first + block.count);
        let count = f64::from(rays.end - rays.start);
        rays.map(|ray| light_of(&self.tables, pixel, ray)).sum::<DVec3>() / count
    }
}

/// A device, with rays that bring what its paths leave out, if they do.
pub fn with_seen(device: impl Backend + 'static, seen: Option<Seen>) -> Box<dyn Backend> {
    match seen {
        Some(seen) => Box::new(WithSeen { device, seen }),
        None => Box::new(device),
    }
}

struct WithSeen<B> {
    device: B,
    seen: Seen,
}

impl<B: Backend> Backend for WithSeen<B> {
    fn device(&self) -> &DeviceInfo {
        self.device.device()
    }

    fn render(&mut self, samples: Range<u32>) -> Result<Vec<Block>, BackendError> {
        let mut blocks = self.device.render(samples)?;
        self.seen.add(&mut blocks);
        Ok(blocks)
    }

    fn allocate(&mut self, trial: u32) -> Result<(), BackendError> {
        self.device.allocate(trial)
    }
}

/// The pixels on which the primitives that shine may lie. Nothing if there are none, or too many.
fn candidates(packed: &Packed) -> Option<Vec<Pixel>> {
    let shining: Vec<u32> = (0u32..).zip(&packed.primitives).filter(|(_, p)| p.light != 0).map(|(k, _)| k).collect();
    if shining.len() > MOST_PRIMITIVES {
        return None;
    }
    let crop = [packed.params.crop_width, packed.params.crop_height];
    let mut primitives = vec![Vec::new(); packed.pixel_count()];
    let mut room = 8 * packed.pixel_count();
    for index in shining {
        let [columns, rows] = shadow_on_film(packed, &packed.primitives[index as usize])?;
        room = room.checked_sub(columns.len() * rows.len())?;
        for row in rows {
            for column in columns.clone() {
                primitives[(row * crop[0] + column) as usize].push(index);
            }
        }
    }
    let pixels = (0u32..).zip(primitives).filter(|(_, primitives)| !primitives.is_empty());
    let pixels: Vec<Pixel> = pixels.map(|(index, primitives)| Pixel { index, rays: 0, primitives }).collect();
    (!pixels.is_empty()).then_some(pixels)
}

/// Columns and rows of the crop window that hold a primitive, with some room. Nothing for a primitive that reaches behind the camera.
fn shadow_on_film(packed: &Packed, primitive: &Primitive) -> Option<[Range<u32>; 2]> {
    let params = &packed.params;
    let (a, b, c) = (primitive.a.as_dvec3(), primitive.b.as_dvec3(), primitive.c.as_dvec3());
    let corners: Vec<DVec3> = if primitive.surface & PRIMITIVE_SPHERE != 0 {
        let side = |bit: u32, of: u32| if of & bit == 0 { -b.x } else { b.x };
        (0..8).map(|k| a + DVec3::new(side(1, k), side(2, k), side(4, k))).collect()
    } else {
        vec![a, b, c]
    };
    let (right, down, corner) =
        (params.camera_right.as_dvec3(), params.camera_down.as_dvec3(), params.camera_corner.as_dvec3());
    let parallel = packed.features.orthographic;
    let third = if parallel { params.lens_u.as_dvec3() } else { corner };
    let to_film = DMat3::from_cols(right, down, third).inverse();
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for point in corners {
        let offset = point - params.camera_origin.as_dvec3();
        let place = if parallel {
            let p = to_film * (offset - corner);
            DVec2::new(p.x, p.y)
        } else {
            let p = to_film * offset;
            if p.z <= 0.0 {
                return None;
            }
            DVec2::new(p.x, p.y) / p.z
        };
        low = low.min(place);
        high = high.max(place);
    }
    let room = 1.0 + f64::from(params.filter_radius);
    let range = |low: f64, high: f64, inverse: f32, first: u32, length: u32| {
        let pixel = |place: f64| place / f64::from(inverse) - f64::from(first);
        let end = f64::from(length);
        (pixel(low) - room).floor().clamp(0.0, end) as u32..(pixel(high) + room).ceil().clamp(0.0, end) as u32
    };
    Some([
        range(low.x, high.x, params.inverse_width, params.crop_x, params.crop_width),
        range(low.y, high.y, params.inverse_height, params.crop_y, params.crop_height),
    ])
}

/// How many rays a pixel needs, if any: none where all bring the same without loss, for so do paths.
fn judge(tables: &Tables, mut pixel: Pixel) -> Option<Pixel> {
    let bring = |rays: Range<u32>| rays.map(|ray| light_of(tables, &pixel, ray).element_sum()).collect::<Vec<f64>>();
    let mut brought = bring(0..TRIAL_RAYS);
    if brought.iter().all(|light| *light == 0.0) {
        brought = bring(TRIAL_RAYS..MANY_TRIAL_RAYS);
    }
    let (low, high) = brought.iter().fold((f64::INFINITY, 0.0f64), |(low, high), &b| (low.min(b), high.max(b)));
    let full = pixel.primitives.iter().map(|&index| {
        let light = &tables.lights[tables.primitive(index).light as usize - 1];
        light.radiance.element_sum()
    });
    let full = full.fold(0.0, f64::max);
    let part = brought.iter().filter(|light| **light > 0.0).count() as f64 / brought.len() as f64;
    pixel.rays = if high - low > ALIKE * high {
        if part < SMALL_PART { MANY_RAYS } else { RAYS }
    } else if high > 0.0 && high < full * (1.0 - ALIKE) {
        1
    } else {
        return None;
    };
    Some(pixel)
}

/// What a camera ray brings of the lamps of a pixel, times its factor by the reconstruction filter.
fn light_of(tables: &Tables, pixel: &Pixel, ray_index: u32) -> DVec3 {
    let params = &tables.params;
    let (x, y) = (pixel.index % params.crop_width + params.crop_x, pixel.index / params.crop_width + params.crop_y);
    let mut path = path_start(tables, y * params.film_width + x, ray_index);
    let Some((index, t, normal)) = nearest(tables, pixel, &path) else { return DVec3::ZERO };
    let primitive = tables.primitive(index);
    path.shadow = true;
    path.t_max = t;
    path.light = primitive.light - 1;
    path.light_medium = params.camera_medium;
    let hit = traverse(tables, &path);
    if hit.blocked {
        return DVec3::ZERO;
    }
    path.throughput = exp_minus_rgb(hit.tau_rgb.max(DVec3::ZERO)) * hit.passed;
    path.tau_rgb = DVec3::ZERO;
    add_emission(tables, &mut path, primitive, t, normal);
    path.radiance * path.filter_weight
}

/// The nearest of a pixel's primitives on a camera ray, its distance and normal there.
fn nearest(tables: &Tables, pixel: &Pixel, path: &Path) -> Option<(u32, f64, DVec3)> {
    let path = Path { t_max: path.far_end, ..*path };
    let mut hit = begin_hit(tables, &path);
    let ray = Ray::new(path.origin, path.direction);
    for &index in &pixel.primitives {
        test_primitive(tables, &path, &ray, index, &mut hit);
    }
    let found = pixel.primitives.contains(&hit.primitive) && hit.t < path.far_end;
    found.then(|| (hit.primitive, hit.t, surface_point(tables.primitive(hit.primitive), &path, &hit).1))
}
