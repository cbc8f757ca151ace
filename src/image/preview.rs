//! A picture to look at: 8-bit PNG.

use std::path::Path;

use super::{Image, ImageError};

/// Writes the `R`, `G`, `B` channels of `image` as they are, without exposure or tone curve: clamped to \[0, 1\], encoded
/// with the sRGB curve, rounded to 8 bits. A NaN appears black.
pub fn write_png(path: &Path, image: &Image) -> Result<(), ImageError> {
    let rgb = image.rgb().map_err(|channel| ImageError::MissingChannel { path: path.to_owned(), channel })?;
    let mut bytes = Vec::with_capacity(3 * image.width * image.height);
    for pixel in 0..image.width * image.height {
        bytes.extend(rgb.map(|channel| encode(channel[pixel])));
    }
    super::write_whole(path, |file| {
        let too_large = |_| std::io::Error::other("the image is too large for a PNG");
        let width = u32::try_from(image.width).map_err(too_large)?;
        let height = u32::try_from(image.height).map_err(too_large)?;
        let mut encoder = png::Encoder::new(file, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&bytes)?;
        writer.finish()?;
        Ok(())
    })
}

/// The 8-bit code of a linear value.
fn encode(linear: f32) -> u8 {
    // The conversion to an integer saturates, and turns NaN into 0.
    (255.0 * srgb_from_linear(linear.clamp(0.0, 1.0)) + 0.5) as u8
}

/// The transfer curve of IEC 61966-2-1 (sRGB), for values in \[0, 1\].
fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodes_with_the_srgb_curve() {
        // Middle grey, the toe, both ends, and what lies beyond them.
        let cases = [(0.214_041_14, 128), (0.001, 3), (0.0, 0), (1.0, 255), (-1.0, 0), (7.0, 255)];
        for (linear, code) in cases {
            assert_eq!(encode(linear), code, "of {linear}");
        }
        assert_eq!(encode(f32::NAN), 0);
        assert_eq!(encode(f32::INFINITY), 255);
    }
}
