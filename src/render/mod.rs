//! From blocks of samples to a finished file: the progressive loop, its stopping rules, and the film.

use crate::pack::groups::{run_half, run_shift};
use std::ops::Range;

pub mod allocation;
pub mod aov;
pub mod film;
pub mod moments;
pub mod picture;
pub mod reconstruct;
pub mod scene_hash;
pub mod session;

/// Samples a pixel in one block. Blocks are aligned: block `k` holds the samples `16 k .. 16 k + 16`.
pub const BLOCK_SAMPLES: u32 = 16;

/// Where pixels share paths, so many samples in turn have the same groups of pixels; the groups of the next are shifted.
pub const RUN_SAMPLES: u32 = 4;
/// Runs of samples belong to the two halves of a render in turn, and in each half have so many shifts in turn.
pub const RUN_SHIFTS: u32 = 4;

/// Why a sample was not finite or otherwise impossible. The order is that of [`Block::invalid`].
pub const INVALID_CAUSES: [&str; 3] = ["NaN radiance", "infinite radiance", "negative radiance"];

/// The sums of one block over all pixels of the crop window, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Block {
    /// First sample; a multiple of [`BLOCK_SAMPLES`].
    pub first: u32,
    /// Number of samples, `1..=BLOCK_SAMPLES`; only the last block of a render has fewer than [`BLOCK_SAMPLES`].
    pub count: u32,
    /// Samples of each pixel: as many, unless [`Backend::allocate`] says otherwise.
    pub counts: Vec<u32>,
    /// Σ radiance of each pixel.
    pub sums: Vec<[f32; 3]>,
    /// Σ radiance² of each pixel.
    pub squares: Vec<[f32; 3]>,
    /// Where pixels share paths, what of the radiance was shared.
    pub shared: Option<Shared>,
    /// Samples found invalid, for each of [`INVALID_CAUSES`]. They are *in* the sums, which they spoil.
    pub invalid: [u64; 3],
}

impl Block {
    /// Of the samples in a range, with nothing in it yet; `sharers` is 0 where pixels do not share paths.
    pub fn new(samples: Range<u32>, pixels: usize, sharers: u32) -> Self {
        Block {
            first: samples.start,
            count: samples.end - samples.start,
            counts: vec![0; pixels],
            sums: vec![[0.0; 3]; pixels],
            squares: vec![[0.0; 3]; pixels],
            shared: (sharers > 0).then(|| Shared { sharers, halves: Default::default() }),
            invalid: [0; 3],
        }
    }

    /// Bytes of a pixel in a block.
    pub fn bytes_of_pixel(sharers: u32) -> usize {
        // A block of 16 samples has runs of four; with more samples in some pixels, of all halves and shifts.
        let shared = if sharers == 0 { 0 } else { 2 * RUN_SHIFTS as usize };
        (2 + shared) * size_of::<[f32; 3]>() + (1 + shared) * size_of::<u32>()
    }

    /// Adds the sums of a run of samples of a pixel.
    pub fn add_run(&mut self, pixel: usize, run: &Run) {
        self.counts[pixel] += run.count;
        for q in 0..3 {
            self.sums[pixel][q] += run.sum[q];
            self.squares[pixel][q] += run.squares[q];
        }
        if let Some(shared) = &mut self.shared {
            let sum = &mut shared.halves[run_half(run.first) as usize][run_shift(run.first) as usize];
            if sum.sums.is_empty() {
                *sum = SharedSum { counts: vec![0; self.sums.len()], sums: vec![[0.0; 3]; self.sums.len()] };
            }
            sum.counts[pixel] += run.count;
            (0..3).for_each(|q| sum.sums[pixel][q] += run.shared[q]);
        }
    }
}

/// The sums of [`RUN_SAMPLES`] samples of a pixel in turn, or of fewer at the end of a render.
#[derive(Clone, Copy, Debug, Default)]
pub struct Run {
    /// First sample.
    pub first: u32,
    /// Samples.
    pub count: u32,
    /// Σ radiance.
    pub sum: [f32; 3],
    /// Σ radiance².
    pub squares: [f32; 3],
    /// Σ shared radiance.
    pub shared: [f32; 3],
}

/// What the pixels of a crop window shared in the samples of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Shared {
    /// Pixels of a group: 4 or 8.
    pub sharers: u32,
    /// For each half of the render and each shift of its groups.
    pub halves: [[SharedSum<f32>; RUN_SHIFTS as usize]; 2],
}

/// What the pixels shared while the groups lay alike, in one half of a render.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SharedSum<T> {
    /// Samples of each pixel; empty if there are none.
    pub counts: Vec<u32>,
    /// Σ shared radiance of each pixel; empty if there are no samples.
    pub sums: Vec<[T; 3]>,
}

/// Something that computes samples: the Vulkan device, or the CPU reference.
pub trait Backend {
    /// What is rendering, for people and for the file's header.
    fn device(&self) -> &DeviceInfo;

    /// Computes `samples` (`start` is a multiple of [`BLOCK_SAMPLES`]) for every pixel of the crop window and hands over
    /// the blocks in ascending order.
    fn render(&mut self, samples: Range<u32>) -> Result<Vec<Block>, BackendError>;

    /// From now on gives more samples to pixels where there is noise, and fewer elsewhere, as many on average as [`Backend::render`] is asked
    /// for. Noise is measured on so many samples of its own, at least two; with 0 each pixel again has what is asked for.
    /// See [`allocation`].
    fn allocate(&mut self, trial: u32) -> Result<(), BackendError>;
}

/// What is rendering.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// The device's own name.
    pub name: String,
    /// The driver's name and version.
    pub driver: String,
}

/// A device that failed while it rendered.
#[derive(Debug, thiserror::Error)]
#[error("{device} failed: {cause}")]
pub struct BackendError {
    /// What was rendering.
    pub device: String,
    /// What went wrong.
    pub cause: String,
}
