//! Pictures as files: OpenEXR in and out, a PNG to look at, and measures of error.
//!
//! An [`Image`] is a plain table of 32-bit floats with names on its columns and a header. Every file appears whole or not
//! at all: see [`write_whole`].

use std::collections::BTreeMap;
use std::path::PathBuf;

pub mod exr;
pub mod metrics;
pub mod preview;
mod whole;

pub use whole::{check_writable, write_whole};

/// A picture: `width × height` samples in each of its channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `R`, `G` and `B` first where they exist, the others by name.
    pub channels: Vec<Channel>,
    /// Where the picture lies on its film, and how it came about.
    pub metadata: Metadata,
}

/// One number for each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The full name, with its layer: `R`, `Variance.R`, `sampleCount`.
    pub name: String,
    /// Row by row from the top, `width * height` of them.
    pub samples: Vec<f32>,
}

/// The header of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Column and row, on the film, of the first pixel of the picture.
    pub origin: (i32, i32),
    /// The whole film, of which the picture may be a part.
    pub display: Window,
    /// World space to camera space as OpenEXR defines `worldToCamera`: left-handed, x to the right, y up, z forward.
    /// Row by row, to be multiplied by a row vector from the left.
    pub world_to_camera: Option<[f32; 16]>,
    /// World space to the unit square of the display window, (0, 0) in its upper left corner, as OpenEXR defines
    /// `worldToNDC`. Same layout as `world_to_camera`.
    pub world_to_ndc: Option<[f32; 16]>,
    /// Channels are written in half precision, but for those of errors and counts. Not read back.
    pub half: bool,
    /// Everything else, by name.
    pub attributes: BTreeMap<String, Attribute>,
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x: i32,
    /// First row.
    pub y: i32,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// A value in the header, of one of OpenEXR's standard types.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// `string`.
    Text(String),
    /// `int`.
    Int(i32),
    /// `float`.
    Float(f32),
    /// `double`.
    Double(f64),
}

impl Image {
    /// A picture without channels that fills its film.
    pub fn new(width: usize, height: usize) -> Self {
        let display = Window { x: 0, y: 0, width, height };
        Image { width, height, channels: Vec::new(), metadata: Metadata { display, ..Metadata::default() } }
    }

    /// Adds a channel behind the others.
    ///
    /// # Panics
    /// When the number of samples is not that of the pixels.
    pub fn push(&mut self, name: impl Into<String>, samples: Vec<f32>) {
        assert_eq!(samples.len(), self.width * self.height, "a channel has one sample for each pixel");
        self.channels.push(Channel { name: name.into(), samples });
    }

    /// The samples of the channel called `name`, if there is one.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|channel| channel.name == name).map(|channel| channel.samples.as_slice())
    }

    /// Red, green and blue, or the name of the first of them that is missing.
    pub fn rgb(&self) -> Result<[&[f32]; 3], &'static str> {
        let channel = |name| self.channel(name).ok_or(name);
        Ok([channel("R")?, channel("G")?, channel("B")?])
    }

    /// Puts `R`, `G`, `B` first and the others behind them by name.
    pub(crate) fn sort_channels(&mut self) {
        let rank = |name: &str| ["R", "G", "B"].iter().position(|&first| first == name).unwrap_or(3);
        self.channels.sort_by(|a, b| (rank(&a.name), &a.name).cmp(&(rank(&b.name), &b.name)));
    }
}

/// A picture that could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file system refused to write.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file that was to appear.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file system refused to read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file asked for.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file was read but is not a picture that this program understands.
    #[error("cannot read {}: {cause}", path.display())]
    Format {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong with its contents.
        cause: String,
    },
    /// The picture lacks a channel that the operation needs.
    #[error("cannot write {}: the image has no channel {channel}", path.display())]
    MissingChannel {
        /// The file that was to appear.
        path: PathBuf,
        /// The name of the channel.
        channel: &'static str,
    },
}
