//! Images that a scene uses: pixels in linear sRGB, from PNG, JPEG, OpenEXR and Radiance files.

use std::fmt;
use std::io::Cursor;
use std::path::Path;

use glam::{DVec2, DVec3, Vec3};

use super::bitmap_formats as formats;
use crate::image::{ImageError, exr};

/// An image: rows from the top, pixels of a row from the left, three channels.
#[derive(Clone, PartialEq)]
pub struct Bitmap {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
}

/// Why a file is no [`Bitmap`].
#[derive(Debug, thiserror::Error)]
pub enum BitmapError {
    /// The file cannot be read.
    #[error("{0}")]
    Unreadable(#[from] std::io::Error),
    /// None of the formats that are known.
    #[error("it is neither a PNG, a JPEG, an OpenEXR nor a Radiance (.hdr) file")]
    UnknownFormat,
    /// The file breaks the rules of its format.
    #[error("{0}")]
    Malformed(String),
    /// The channels say no colour.
    #[error("it has the channels {0}; R, G and B are needed, or Y alone")]
    Channels(String),
    /// Nothing in it, or more than can be used.
    #[error("it has {width} x {height} pixels; both must be at least 1, and at most 2^28 together")]
    Size {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A value that is not a number, or infinite.
    #[error("pixel ({x}, {y}) is not finite")]
    NotFinite {
        /// Column, from 0.
        x: u32,
        /// Row, from 0 at the top.
        y: u32,
    },
}

impl Bitmap {
    /// Most pixels of an image, 3 GiB of them.
    pub const MAX_PIXELS: usize = 1 << 28;

    /// An image from its pixels, row by row from the top, which must be finite.
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Result<Bitmap, BitmapError> {
        let too_large = width.checked_mul(height).is_none_or(|count| count > Self::MAX_PIXELS);
        if width == 0 || height == 0 || too_large {
            return Err(BitmapError::Size { width, height });
        }
        assert_eq!(pixels.len(), width * height, "one value for each pixel");
        if let Some(index) = pixels.iter().position(|pixel| !pixel.iter().all(|value| value.is_finite())) {
            return Err(BitmapError::NotFinite { x: (index % width) as u32, y: (index / width) as u32 });
        }
        Ok(Bitmap { width: width as u32, height: height as u32, pixels })
    }

    /// Reads a PNG (8 or 16 bits, gray or colour, with a palette or without), a JPEG, an OpenEXR or a Radiance file. What is in a
    /// PNG or JPEG is decoded from sRGB (IEC 61966-2-1) to linear values unless it is `raw`, where codes from 0 to the largest
    /// become 0 to 1; the others are linear already. Alpha is left out. Which of them a file is shows in its first bytes, not in
    /// its name.
    pub fn read(path: &Path, raw: bool) -> Result<Bitmap, BitmapError> {
        let bytes = std::fs::read(path)?;
        if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
            read_png(&bytes, raw)
        } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            drop(bytes);
            read_exr(path)
        } else if bytes.starts_with(&[0xff, 0xd8, 0xff]) {
            formats::read_jpeg(&bytes, raw)
        } else if bytes.starts_with(b"#?RADIANCE") || bytes.starts_with(b"#?RGBE") {
            formats::read_rgbe(&bytes)
        } else {
            Err(BitmapError::UnknownFormat)
        }
    }

    /// Pixels in a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row from the top.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// One pixel; x from the left, y from the top.
    ///
    /// # Panics
    /// Outside of the image.
    pub fn pixel(&self, x: u32, y: u32) -> Vec3 {
        assert!(x < self.width, "column {x} of {}", self.width);
        self.pixels[y as usize * self.width as usize + x as usize].into()
    }

    /// The largest value of all channels.
    pub fn max(&self) -> f32 {
        self.pixels.iter().flatten().copied().fold(f32::NEG_INFINITY, f32::max)
    }

    /// The same with every pixel changed.
    pub fn map(&self, change: impl Fn([f32; 3]) -> [f32; 3]) -> Bitmap {
        Bitmap { width: self.width, height: self.height, pixels: self.pixels.iter().copied().map(change).collect() }
    }

    /// The look-up of an environment map, `uv` from [`super::Light::sky_uv`]. Bilinear; columns have their centres at
    /// (x + ½)/width and go round, *rows stand at y/(height − 1)*, so the first row is the zenith and the last one the nadir.
    /// Convention of Mitsuba 3.9.1.
    ///
    /// # Panics
    /// For an image of one row.
    pub fn sky(&self, uv: DVec2) -> DVec3 {
        let x = uv.x * f64::from(self.width) - 0.5;
        let y = uv.y.clamp(0.0, 1.0) * f64::from(self.height - 1);
        let (left, top) = (x.floor(), y.floor().min(f64::from(self.height - 2)));
        let pixel =
            |x: f64, y: f64| self.pixel((x as i64).rem_euclid(i64::from(self.width)) as u32, y as u32).as_dvec3();
        let row = |y: f64| pixel(left, y).lerp(pixel(left + 1.0, y), x - left);
        row(top).lerp(row(top + 1.0), y - top)
    }
}

/// The size, and a hash in place of the pixels: FNV-1a (64 bit; Fowler, Noll and Vo) of their bits, a channel at a time. So
/// whatever hashes a scene by its debug form sees every bit of an image.
impl fmt::Debug for Bitmap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hash = self.pixels.iter().flatten().fold(0xcbf2_9ce4_8422_2325, |hash: u64, value| {
            (hash ^ u64::from(value.to_bits())).wrapping_mul(0x100_0000_01b3)
        });
        write!(f, "Bitmap({} x {}, {hash:016x})", self.width, self.height)
    }
}

/// The inverse of sRGB's transfer function (IEC 61966-2-1).
pub fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Luminance of linear sRGB (the second row of its matrix to XYZ, with the digits that Mitsuba uses).
pub fn luminance([r, g, b]: [f32; 3]) -> f32 {
    (0.212_671 * f64::from(r) + 0.715_160 * f64::from(g) + 0.072_169 * f64::from(b)) as f32
}

fn read_png(bytes: &[u8], raw: bool) -> Result<Bitmap, BitmapError> {
    let malformed = |error: png::DecodingError| BitmapError::Malformed(error.to_string());
    let limits = png::Limits { bytes: usize::MAX };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::EXPAND);
    let header = decoder.read_header_info().map_err(malformed)?;
    let (width, height) = (header.width as usize, header.height as usize);
    // Before the pixels are made room for.
    if width.saturating_mul(height) > Bitmap::MAX_PIXELS {
        return Err(BitmapError::Size { width, height });
    }
    let mut reader = decoder.read_info().map_err(malformed)?;
    let too_large = BitmapError::Size { width, height };
    let mut codes = vec![0; reader.output_buffer_size().ok_or(too_large)?];
    let frame = reader.next_frame(&mut codes).map_err(malformed)?;
    let channels = frame.color_type.samples();
    let sixteen = frame.bit_depth == png::BitDepth::Sixteen;
    let largest = if sixteen { 65_535 } else { 255 };
    let decode = |code: u32| {
        let v = f64::from(code) / f64::from(largest);
        (if raw { v } else { srgb_to_linear(v) }) as f32
    };
    let table: Vec<f32> = (0..=largest).map(decode).collect();
    let value = |pixel: usize, channel: usize| {
        let at = pixel * channels + channel;
        let code =
            if sixteen { usize::from(codes[2 * at]) << 8 | usize::from(codes[2 * at + 1]) } else { codes[at].into() };
        table[code]
    };
    // One or two channels are gray (with alpha), three or four are colours (with alpha).
    let colors = if channels >= 3 { [0, 1, 2] } else { [0, 0, 0] };
    let pixels = (0..width * height).map(|pixel| colors.map(|channel| value(pixel, channel))).collect();
    Bitmap::new(width, height, pixels)
}

fn read_exr(path: &Path) -> Result<Bitmap, BitmapError> {
    let image = exr::read(path).map_err(|error| match error {
        ImageError::Read { source, .. } => BitmapError::Unreadable(source),
        ImageError::Format { cause, .. } => BitmapError::Malformed(cause),
        other => BitmapError::Malformed(other.to_string()),
    })?;
    let named = |name: &str| image.channels.iter().find(|channel| channel.name == name);
    let channels = match (named("R"), named("G"), named("B"), named("Y")) {
        (Some(r), Some(g), Some(b), _) => [r, g, b],
        (None, None, None, Some(y)) => [y, y, y],
        _ => {
            let names: Vec<&str> = image.channels.iter().map(|channel| channel.name.as_str()).collect();
            return Err(BitmapError::Channels(names.join(", ")));
        }
    };
    let pixels = (0..image.width * image.height).map(|index| channels.map(|channel| channel.samples[index])).collect();
    Bitmap::new(image.width, image.height, pixels)
}
