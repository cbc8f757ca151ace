//! From blocks of samples to a finished file: the progressive loop, its stopping rules, and the film.

use std::ops::Range;

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
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// First sample; a multiple of [`BLOCK_SAMPLES`].
    pub first: u32,
    /// Number of samples, `1..=BLOCK_SAMPLES`; only the last block of a render has fewer than [`BLOCK_SAMPLES`].
    pub count: u32,
    /// Σ radiance of each pixel.
    pub sums: Vec<[f32; 3]>,
    /// Σ radiance² of each pixel.
    pub squares: Vec<[f32; 3]>,
    /// Where pixels share paths, what of the radiance was shared.
    pub shared: Option<Shared>,
    /// Samples found invalid, for each of [`INVALID_CAUSES`]. They are *in* the sums, which they spoil.
    pub invalid: [u64; 3],
}

/// What the pixels of a crop window shared in the samples of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Shared {
    /// Pixels of a group: 4 or 8.
    pub sharers: u32,
    /// For each run of [`RUN_SAMPLES`] samples (the last may have fewer), Σ shared radiance of each pixel.
    pub runs: Vec<Vec<[f32; 3]>>,
}

/// Something that computes samples: the Vulkan device, or the CPU reference.
pub trait Backend {
    /// What is rendering, for people and for the file's header.
    fn device(&self) -> &DeviceInfo;

    /// Computes `samples` (`start` is a multiple of [`BLOCK_SAMPLES`]) for every pixel of the crop window and hands over
    /// the blocks in ascending order.
    fn render(&mut self, samples: Range<u32>) -> Result<Vec<Block>, BackendError>;
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
