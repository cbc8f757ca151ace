//! Renders blocks of samples on a Vulkan device.

use super::buffer::Buffer;
use super::kernel::Kernel;
use super::shader::{Variant, compile_cached, expand};
use super::{Device, Error};
use crate::pack::Packed;
use crate::pack::groups::group_offset;
use crate::pack::layout::{Dispatch, Params, RECORD_VECTORS, TILE};
use crate::pack::sobol;
use crate::render::allocation::{self, Allocation, Level, tile_grid};
use crate::render::{BLOCK_SAMPLES, Backend, BackendError, Block, DeviceInfo, RUN_SAMPLES, Run};
use std::ops::Range;
use std::sync::Arc;

/// Most vectors of four numbers, of 16 bytes, for samples in flight: one each, and more where pixels share paths.
const MAX_VECTORS: usize = 1 << 23;
/// Bytes of them for each core where the device is a CPU, and the fewest: what it has to touch first is time before the first sample.
const CORE_BYTES: u64 = 16 << 20;
const LEAST_BYTES: u64 = 32 << 20;
/// Bindings of the path tracer; the first [`ADDRESSES`] can also be read by address.
const BINDINGS: u32 = 13;
const ADDRESSES: usize = 12;
/// Bytes of the addresses in the push constants, a multiple of 16.
const ADDRESS_BYTES: usize = (ADDRESSES * 8).next_multiple_of(16);
const TILE_PIXELS: usize = (TILE * TILE) as usize;

/// A scene on a device.
pub struct Renderer {
    device: Arc<Device>,
    path_trace: Kernel,
    /// Where pixels share paths.
    sharing: Option<Sharing>,
    resolve: Kernel,
    /// The tables that kernels only read, in the order of their bindings.
    tables: [Buffer; 11],
    params: Params,
    params_buffer: Buffer,
    samples: Buffer,
    sums: Buffer,
    invalid: Buffer,
    crop: [u32; 2],
    /// Samples that `samples` holds.
    capacity: usize,
    allocation: Allocation,
}

/// What connects the paths of a group of pixels. Their records lie behind the samples, and then the densities of connections.
struct Sharing {
    connect: Kernel,
    share: Kernel,
    /// Pixels of a group.
    sharers: u32,
}

impl Renderer {
    /// Uploads the tables and compiles the kernels for just this scene.
    pub fn new(device: &Arc<Device>, packed: &Packed) -> Result<Renderer, Error> {
        let variant = Variant {
            features: packed.features,
            immediates: packed.immediates().to_vec(),
            workgroup: device.subgroup_size,
            buffer_reference: device.buffer_reference,
        };
        Renderer::with_variant(device, packed, &variant)
    }

    /// The same with a kernel that can do more than the scene needs, or in another form.
    pub fn with_variant(device: &Arc<Device>, packed: &Packed, variant: &Variant) -> Result<Renderer, Error> {
        let push_size = ADDRESS_BYTES + size_of::<Dispatch>();
        let kernel = |name: &str| -> Result<Kernel, Error> {
            Kernel::new(device, &compile_cached(&expand(name, variant)?)?, BINDINGS, push_size as u32)
        };
        let path_trace = kernel("path_trace.comp")?;
        let sharers = variant.features.sharers;
        let sharing = match sharers {
            0 => None,
            _ => Some(Sharing { connect: kernel("connect.comp")?, share: kernel("share.comp")?, sharers }),
        };
        let sharers = sharers as usize;
        let code = compile_cached(&expand("resolve.comp", variant)?)?;
        let resolve = Kernel::new(device, &code, 4, size_of::<Dispatch>() as u32)?;
        let tables = [
            Buffer::new(device, "nodes", &packed.bvh.nodes)?,
            Buffer::new(device, "primitives", &packed.primitives)?,
            Buffer::new(device, "surfaces", &packed.surfaces)?,
            Buffer::new(device, "media", &packed.media)?,
            Buffer::new(device, "lights", &packed.lights)?,
            Buffer::new(device, "points", &sobol::points())?,
            Buffer::new(device, "phases", &packed.phases)?,
            Buffer::new(device, "corners", &packed.corners)?,
            Buffer::new(device, "textures", &packed.textures)?,
            Buffer::new(device, "values", &packed.values)?,
            Buffer::new(device, "grids", &packed.grids)?,
        ];
        if !variant.buffer_reference
            && let Some(table) = tables.iter().find(|table| table.size() > device.max_binding)
        {
            let (name, size, limit) = (table.name().to_owned(), table.size(), device.max_binding);
            return Err(Error::TooLarge { name, size, limit });
        }
        let crop = [packed.params.crop_width, packed.params.crop_height];
        let pixels = tile_count(crop, sharers as u32) as usize * TILE_PIXELS;
        let bound = if variant.buffer_reference { u64::MAX } else { device.max_binding };
        let capacity = capacity(pixels, sharers, bound.min(samples_bytes(device.is_cpu)));
        Ok(Renderer {
            device: device.clone(),
            path_trace,
            sharing,
            resolve,
            tables,
            params: packed.params,
            params_buffer: Buffer::new(device, "params", &[packed.params])?,
            samples: Buffer::zeroed::<[f32; 4]>(device, "samples", samples_length(capacity, sharers))?,
            sums: Buffer::zeroed::<[f32; 4]>(device, "sums", sums_length(pixels, capacity, sharers))?,
            invalid: Buffer::zeroed::<[u32; 4]>(device, "invalid", capacity / TILE_PIXELS)?,
            crop,
            capacity,
            allocation: Allocation::uniform(crop, sharers as u32),
        })
    }

    /// Bytes that a crop window of so many pixels takes at most on the device, and on the host for the blocks of one dispatch; both
    /// beside the tables of the scene.
    pub fn working_memory(crop: [u32; 2], sharers: u32) -> (u64, u64) {
        let pixels = tile_count(crop, sharers) as usize * TILE_PIXELS;
        let capacity = capacity(pixels, sharers as usize, u64::MAX);
        let quads = samples_length(capacity, sharers as usize)
            + sums_length(pixels, capacity, sharers as usize)
            + capacity / TILE_PIXELS;
        let blocks = (capacity / pixels / BLOCK_SAMPLES as usize).max(1);
        let block = crop[0] as usize * crop[1] as usize * Block::bytes_of_pixel(sharers);
        ((quads * size_of::<[f32; 4]>()) as u64, (blocks * block) as u64)
    }

    /// Renders some samples of some tiles, and adds them to the blocks that they belong to.
    fn dispatch(&mut self, part: &Part, blocks: &mut [Block]) -> Result<(), Error> {
        let tile_count = part.tiles.len() as u32;
        let first_tile = self.capacity * vectors_of_sample(self.sharers() as usize);
        // Neighbouring tiles cost alike: a step coprime to their number spreads them over the processors.
        let step = coprime_step(tile_count);
        let tiles: Vec<u32> = (0..tile_count)
            .map(|turn| part.tiles[(u64::from(turn) * u64::from(step) % u64::from(tile_count)) as usize])
            .collect();
        let numbers: Vec<f32> = tiles.iter().map(|tile| *tile as f32).collect();
        self.samples.write_behind(first_tile * size_of::<[f32; 4]>(), &numbers);
        let work = Dispatch {
            first_sample: part.samples.start,
            sample_count: part.samples.end - part.samples.start,
            tile_count,
            first_tile: first_tile as u32,
            first_record: self.capacity as u32,
            first_pair: (self.capacity * (1 + RECORD_VECTORS as usize)) as u32,
            ..Dispatch::default()
        };
        let buffers: Vec<&Buffer> = self.tables.iter().chain([&self.samples, &self.params_buffer]).collect();
        let mut addresses = [0u64; ADDRESS_BYTES / 8];
        if self.device.buffer_reference {
            for (address, buffer) in addresses.iter_mut().zip(&buffers[..ADDRESSES]) {
                *address = buffer.address();
            }
        }
        let push = [bytemuck::cast_slice(&addresses), bytemuck::bytes_of(&work)].concat();
        self.path_trace.dispatch(&buffers, &push, tile_count)?;
        if let Some(Sharing { connect, share, sharers }) = &mut self.sharing {
            connect.dispatch(&buffers, &push, tile_count)?;
            let groups = tile_count * TILE * TILE / *sharers * work.sample_count;
            share.dispatch(&buffers, &push, groups.div_ceil(self.device.subgroup_size))?;
        }

        self.invalid.write(&vec![[0u32; 4]; work.sample_count.div_ceil(BLOCK_SAMPLES) as usize]);
        let pixels = tile_count as usize * TILE_PIXELS;
        let groups = (pixels as u32).div_ceil(self.device.subgroup_size);
        let buffers = [&self.samples, &self.sums, &self.invalid, &self.params_buffer];
        self.resolve.dispatch(&buffers, bytemuck::bytes_of(&work), groups)?;
        self.collect(part, &tiles, blocks);
        Ok(())
    }

    /// Takes the sums of a dispatch from tiles to rows of the crop window. `tiles` are in the order in which they were rendered.
    fn collect(&self, part: &Part, tiles: &[u32], blocks: &mut [Block]) {
        let sharers = self.sharers();
        let vectors = vectors_of_sum(sharers as usize);
        let Range { start: first, end } = part.samples;
        let length = vectors * tiles.len() * TILE_PIXELS;
        let sums: Vec<[f32; 4]> = self.sums.read(length * (end - first).div_ceil(RUN_SAMPLES) as usize);
        let first_block = blocks[0].first / BLOCK_SAMPLES;
        let block_of = |sample: u32| (part.level.asked(sample) / BLOCK_SAMPLES - first_block) as usize;
        let [width, height] = self.crop.map(|side| side as usize);
        let tiles_across = tile_grid(self.crop, sharers)[0] as usize;
        for (start, sums) in (first..end).step_by(RUN_SAMPLES as usize).zip(sums.chunks_exact(length)) {
            let block = &mut blocks[block_of(start)];
            let [dx, dy] = group_offset(sharers, start).map(|shift| shift as usize);
            for (slot, sums) in sums.chunks_exact(vectors).enumerate() {
                let (tile, pixel) = (tiles[slot / TILE_PIXELS] as usize, slot % TILE_PIXELS);
                let x = (tile % tiles_across * TILE as usize + pixel % TILE as usize).wrapping_sub(dx);
                let y = (tile / tiles_across * TILE as usize + pixel / TILE as usize).wrapping_sub(dy);
                if x < width && y < height {
                    let rgb = |vector: usize| sums.get(vector).map_or([0.0; 3], |v| [v[0], v[1], v[2]]);
                    let count = RUN_SAMPLES.min(end - start);
                    let run = Run { first: start, count, sum: rgb(0), squares: rgb(1), shared: rgb(2) };
                    block.add_run(y * width + x, &run);
                }
            }
        }
        let invalid: Vec<[u32; 4]> = self.invalid.read((end - first).div_ceil(BLOCK_SAMPLES) as usize);
        for (start, invalid) in (first..end).step_by(BLOCK_SAMPLES as usize).zip(&invalid) {
            for (total, count) in blocks[block_of(start)].invalid.iter_mut().zip(invalid) {
                *total += u64::from(*count);
            }
        }
    }

    /// Samples of so many tiles for which there is room at once: at least a block.
    fn room(&self, tiles: usize) -> u32 {
        ((self.capacity / (tiles * TILE_PIXELS)) as u32 / BLOCK_SAMPLES * BLOCK_SAMPLES).max(BLOCK_SAMPLES)
    }

    /// Renders the samples of tiles with the same level where those of the range are asked for.
    fn render_level(
        &mut self,
        level: Level,
        tiles: &[u32],
        asked: &Range<u32>,
        blocks: &mut [Block],
    ) -> Result<(), Error> {
        let samples = level.samples(asked);
        let at_once = self.room(tiles.len());
        for first in samples.clone().step_by(at_once as usize) {
            let samples = first..samples.end.min(first.saturating_add(at_once));
            let tiles_at_once = self.capacity / (samples.len() * TILE_PIXELS);
            for tiles in tiles.chunks(tiles_at_once) {
                self.dispatch(&Part { level, samples: samples.clone(), tiles: tiles.to_vec() }, blocks)?;
            }
        }
        Ok(())
    }

    fn sharers(&self) -> u32 {
        self.sharing.as_ref().map_or(0, |sharing| sharing.sharers)
    }
}

impl Backend for Renderer {
    fn device(&self) -> &DeviceInfo {
        &self.device.info
    }

    fn render(&mut self, samples: Range<u32>) -> Result<Vec<Block>, BackendError> {
        let device = self.device.info.name.clone();
        render_all(self, samples).map_err(|error| BackendError { device, cause: error.to_string() })
    }

    fn allocate(&mut self, trial: u32) -> Result<(), BackendError> {
        self.allocation = Allocation::uniform(self.crop, self.sharers());
        if trial > 0 {
            let params = Params { seed: allocation::trial_seed(self.params.seed), ..self.params };
            self.params_buffer.write(&[params]);
            let blocks = self.render(0..trial)?;
            self.params_buffer.write(&[self.params]);
            self.allocation = Allocation::measured(&blocks[0], self.crop, self.sharers());
        }
        Ok(())
    }
}

/// Samples of tiles that one dispatch renders.
struct Part {
    level: Level,
    /// As the tiles have them.
    samples: Range<u32>,
    tiles: Vec<u32>,
}

fn render_all(renderer: &mut Renderer, samples: Range<u32>) -> Result<Vec<Block>, Error> {
    assert!(samples.start.is_multiple_of(BLOCK_SAMPLES), "blocks are aligned");
    let sharers = renderer.sharers();
    let pixel_count = renderer.crop[0] as usize * renderer.crop[1] as usize;
    let starts = samples.clone().step_by(BLOCK_SAMPLES as usize);
    let mut blocks: Vec<Block> = starts
        .map(|start| Block::new(start..samples.end.min(start.saturating_add(BLOCK_SAMPLES)), pixel_count, sharers))
        .collect();
    for (level, tiles) in renderer.allocation.tiles_by_level() {
        renderer.render_level(level, &tiles, &samples, &mut blocks)?;
    }
    Ok(blocks)
}

/// Bytes that samples in flight may take.
fn samples_bytes(is_cpu: bool) -> u64 {
    let cores = std::thread::available_parallelism().map_or(1, |count| count.get() as u64);
    if is_cpu { LEAST_BYTES.max(cores * CORE_BYTES) } else { u64::MAX }
}

/// Samples in flight for so many pixels, if a buffer may have `most` bytes.
fn capacity(pixels: usize, sharers: usize, most: u64) -> usize {
    let vectors = vectors_of_sample(sharers);
    let fitting = usize::try_from(most / (16 * vectors as u64)).unwrap_or(usize::MAX);
    (pixels * 256).min((MAX_VECTORS / vectors).min(fitting).max(BLOCK_SAMPLES as usize * TILE_PIXELS))
}

/// Vectors of four numbers that a sample takes.
fn vectors_of_sample(sharers: usize) -> usize {
    if sharers == 0 { 1 } else { 1 + RECORD_VECTORS as usize + sharers }
}

/// Vectors of all samples in flight, and of the numbers of their tiles.
fn samples_length(capacity: usize, sharers: usize) -> usize {
    capacity * vectors_of_sample(sharers) + (capacity / TILE_PIXELS).div_ceil(4)
}

/// Vectors of four numbers in the sum of a run: the sum, the sum of squares, and where pixels share paths what they share.
fn vectors_of_sum(sharers: usize) -> usize {
    if sharers == 0 { 2 } else { 3 }
}

/// Vectors of all sums in flight.
fn sums_length(pixels: usize, capacity: usize, sharers: usize) -> usize {
    vectors_of_sum(sharers) * (capacity.div_ceil(RUN_SAMPLES as usize) + pixels.min(capacity))
}

/// Tiles that cover the crop window, wherever groups are shifted.
fn tile_count(crop: [u32; 2], sharers: u32) -> u32 {
    let [columns, rows] = tile_grid(crop, sharers);
    columns * rows
}

/// A number near the golden section of `count` that has no factor in common with it.
fn coprime_step(count: u32) -> u32 {
    let gcd = |mut a: u32, mut b: u32| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let start = (f64::from(count) * 0.618) as u32;
    (start.max(1)..).find(|&step| gcd(step, count) == 1).unwrap_or(1)
}
