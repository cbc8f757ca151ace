//! Renders blocks of samples on a Vulkan device.

use super::buffer::Buffer;
use super::kernel::Kernel;
use super::shader::{Variant, compile_cached, expand};
use super::{Device, Error};
use crate::pack::Packed;
use crate::pack::groups::{group_margin, group_offset};
use crate::pack::layout::{Dispatch, RECORD_VECTORS, TILE};
use crate::pack::sobol;
use crate::render::{BLOCK_SAMPLES, Backend, BackendError, Block, DeviceInfo, RUN_SAMPLES, Shared};
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
    params: Buffer,
    samples: Buffer,
    sums: Buffer,
    invalid: Buffer,
    crop: [u32; 2],
    /// Samples that `samples` holds.
    capacity: usize,
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
            params: Buffer::new(device, "params", &[packed.params])?,
            samples: Buffer::zeroed::<[f32; 4]>(device, "samples", capacity * vectors_of_sample(sharers))?,
            sums: Buffer::zeroed::<[f32; 4]>(device, "sums", sums_length(pixels, capacity, sharers))?,
            invalid: Buffer::zeroed::<[u32; 4]>(device, "invalid", capacity / TILE_PIXELS)?,
            crop,
            capacity,
        })
    }

    /// Bytes that a crop window of so many pixels takes at most on the device, and on the host for the blocks of one dispatch; both
    /// beside the tables of the scene.
    pub fn working_memory(crop: [u32; 2], sharers: u32) -> (u64, u64) {
        let pixels = tile_count(crop, sharers) as usize * TILE_PIXELS;
        let capacity = capacity(pixels, sharers as usize, u64::MAX);
        let of_samples = capacity * vectors_of_sample(sharers as usize);
        let quads = of_samples + sums_length(pixels, capacity, sharers as usize) + capacity / TILE_PIXELS;
        // A block has a sum and a sum of squares for each channel of a pixel, and what was shared in each run.
        let sums_of_block = if sharers == 0 { 2 } else { 2 + u64::from(BLOCK_SAMPLES / RUN_SAMPLES) };
        let blocks = (capacity / pixels / BLOCK_SAMPLES as usize).max(1);
        let block = u64::from(crop[0]) * u64::from(crop[1]) * size_of::<[f32; 3]>() as u64 * sums_of_block;
        ((quads * size_of::<[f32; 4]>()) as u64, blocks as u64 * block)
    }

    /// Renders some samples of some tiles, and adds them to the blocks that they belong to.
    fn dispatch(&mut self, samples: Range<u32>, tiles: Range<u32>, blocks: &mut [Block]) -> Result<(), Error> {
        let tile_count = tiles.end - tiles.start;
        let work = Dispatch {
            first_sample: samples.start,
            sample_count: samples.end - samples.start,
            first_tile: tiles.start,
            tile_count,
            tile_step: coprime_step(tile_count),
            first_record: self.capacity as u32,
            first_pair: (self.capacity * (1 + RECORD_VECTORS as usize)) as u32,
            ..Dispatch::default()
        };
        let buffers: Vec<&Buffer> = self.tables.iter().chain([&self.samples, &self.params]).collect();
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

        self.invalid.write(&vec![[0u32; 4]; blocks.len()]);
        let pixels = tile_count as usize * TILE_PIXELS;
        let groups = (pixels as u32).div_ceil(self.device.subgroup_size);
        let buffers = [&self.samples, &self.sums, &self.invalid, &self.params];
        self.resolve.dispatch(&buffers, bytemuck::bytes_of(&work), groups)?;
        self.collect(&samples, tiles.start, pixels, blocks);
        Ok(())
    }

    /// Takes the sums of a dispatch from tiles to rows of the crop window.
    fn collect(&self, samples: &Range<u32>, first_tile: u32, pixels: usize, blocks: &mut [Block]) {
        let sharers = self.sharers();
        let (samples_of_sum, vectors) = sum_format(sharers as usize);
        let starts = samples.clone().step_by(samples_of_sum);
        let sums: Vec<[f32; 4]> = self.sums.read(vectors * pixels * starts.len());
        let [width, height] = self.crop.map(|side| side as usize);
        let tiles_across = (width + group_margin(sharers)[0] as usize).div_ceil(TILE as usize);
        for (start, sums) in starts.zip(sums.chunks_exact(vectors * pixels)) {
            let in_dispatch = start - samples.start;
            let block = &mut blocks[(in_dispatch / BLOCK_SAMPLES) as usize];
            let run = (in_dispatch % BLOCK_SAMPLES / RUN_SAMPLES) as usize;
            let [dx, dy] = group_offset(sharers, start).map(|shift| shift as usize);
            for (slot, sums) in sums.chunks_exact(vectors).enumerate() {
                let (tile, pixel) = (first_tile as usize + slot / TILE_PIXELS, slot % TILE_PIXELS);
                let x = (tile % tiles_across * TILE as usize + pixel % TILE as usize).wrapping_sub(dx);
                let y = (tile / tiles_across * TILE as usize + pixel / TILE as usize).wrapping_sub(dy);
                if x < width && y < height {
                    let pixel = y * width + x;
                    add(&mut block.sums[pixel], sums[0]);
                    add(&mut block.squares[pixel], sums[1]);
                    if let Some(shared) = &mut block.shared {
                        shared.runs[run][pixel] = [sums[2][0], sums[2][1], sums[2][2]];
                    }
                }
            }
        }
        let invalid: Vec<[u32; 4]> = self.invalid.read(blocks.len());
        for (block, invalid) in blocks.iter_mut().zip(&invalid) {
            for (total, count) in block.invalid.iter_mut().zip(invalid) {
                *total += u64::from(*count);
            }
        }
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
}

fn render_all(renderer: &mut Renderer, samples: Range<u32>) -> Result<Vec<Block>, Error> {
    assert!(samples.start.is_multiple_of(BLOCK_SAMPLES), "blocks are aligned");
    let sharers = renderer.sharers();
    let tile_count = tile_count(renderer.crop, sharers);
    let pixel_count = renderer.crop[0] as usize * renderer.crop[1] as usize;
    let mut blocks = Vec::new();
    let mut first = samples.start;
    while first < samples.end {
        // As many samples of a pixel as there is room for, then as many tiles.
        let room = (renderer.capacity / (tile_count as usize * TILE_PIXELS)) as u32 / BLOCK_SAMPLES * BLOCK_SAMPLES;
        let last = samples.end.min(first.saturating_add(room.max(BLOCK_SAMPLES)));
        let tiles_at_once = (renderer.capacity / ((last - first) as usize * TILE_PIXELS)) as u32;
        let mut part: Vec<Block> = (first..last)
            .step_by(BLOCK_SAMPLES as usize)
            .map(|start| Block {
                first: start,
                count: (last - start).min(BLOCK_SAMPLES),
                sums: vec![[0.0; 3]; pixel_count],
                squares: vec![[0.0; 3]; pixel_count],
                shared: (sharers > 0).then(|| Shared {
                    sharers,
                    runs: vec![
                        vec![[0.0; 3]; pixel_count];
                        (last - start).min(BLOCK_SAMPLES).div_ceil(RUN_SAMPLES) as usize
                    ],
                }),
                invalid: [0; 3],
            })
            .collect();
        let mut tile = 0;
        while tile < tile_count {
            let end = tile_count.min(tile + tiles_at_once);
            renderer.dispatch(first..last, tile..end, &mut part)?;
            tile = end;
        }
        blocks.append(&mut part);
        first = last;
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

/// Adds the first three of four numbers.
fn add(sum: &mut [f32; 3], numbers: [f32; 4]) {
    sum.iter_mut().zip(numbers).for_each(|(sum, number)| *sum += number);
}

/// Samples in a sum, and vectors of four numbers that it takes: the sum, the sum of squares, and where pixels share paths what they share.
fn sum_format(sharers: usize) -> (usize, usize) {
    if sharers == 0 { (BLOCK_SAMPLES as usize, 2) } else { (RUN_SAMPLES as usize, 3) }
}

/// Vectors of all sums in flight.
fn sums_length(pixels: usize, capacity: usize, sharers: usize) -> usize {
    let (samples, vectors) = sum_format(sharers);
    vectors * (capacity.div_ceil(samples) + pixels.min(capacity))
}

/// Tiles that cover the crop window, wherever groups are shifted.
fn tile_count(crop: [u32; 2], sharers: u32) -> u32 {
    let margin = group_margin(sharers);
    (crop[0] + margin[0]).div_ceil(TILE) * (crop[1] + margin[1]).div_ceil(TILE)
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
