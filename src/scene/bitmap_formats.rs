//! Images from JPEG files and from Radiance's `.hdr` files.

use super::bitmap::{Bitmap, BitmapError, srgb_to_linear};

/// A baseline or progressive JPEG, gray or colour. Its codes are decoded from sRGB to linear values unless it is `raw`.
pub(super) fn read_jpeg(bytes: &[u8], raw: bool) -> Result<Bitmap, BitmapError> {
    let malformed = |error: jpeg_decoder::Error| BitmapError::Malformed(error.to_string());
    let mut decoder = jpeg_decoder::Decoder::new(bytes);
    decoder.read_info().map_err(malformed)?;
    let info = decoder.info().ok_or_else(|| BitmapError::Malformed("it has no header".to_owned()))?;
    let (width, height) = (usize::from(info.width), usize::from(info.height));
    // Before the pixels are made room for.
    if width * height > Bitmap::MAX_PIXELS {
        return Err(BitmapError::Size { width, height });
    }
    let channels = match info.pixel_format {
        jpeg_decoder::PixelFormat::L8 => 1,
        jpeg_decoder::PixelFormat::RGB24 => 3,
        other => return Err(BitmapError::Channels(format!("of the format {other:?}"))),
    };
    let codes = decoder.decode().map_err(malformed)?;
    let table: Vec<f32> = (0..256)
        .map(|code| {
            let v = f64::from(code) / 255.0;
            (if raw { v } else { srgb_to_linear(v) }) as f32
        })
        .collect();
    let pixels = codes
        .chunks_exact(channels)
        .map(|pixel| [0, 1, 2].map(|channel| table[usize::from(pixel[channel.min(channels - 1)])]))
        .collect();
    Bitmap::new(width, height, pixels)
}

/// A picture in the format of Ward (1991), "Real pixels": three mantissas with a common exponent, run-length encoded or not. Rows from
/// the top, pixels from the left, as all programs write them.
pub(super) fn read_rgbe(bytes: &[u8]) -> Result<Bitmap, BitmapError> {
    let malformed = |what: &str| BitmapError::Malformed(what.to_owned());
    let mut rest = bytes;
    let mut line = || -> Result<String, BitmapError> {
        let end = rest.iter().position(|&byte| byte == b'\n').ok_or_else(|| malformed("its header does not end"))?;
        let text = String::from_utf8_lossy(&rest[..end]).trim_end().to_owned();
        rest = &rest[end + 1..];
        Ok(text)
    };
    loop {
        let text = line()?;
        if text.is_empty() {
            break;
        }
        if text.strip_prefix("FORMAT=").is_some_and(|format| format != "32-bit_rle_rgbe") {
            return Err(malformed(&format!("its {text} is not 32-bit_rle_rgbe")));
        }
    }
    let size = line()?;
    let sides = match size.split_whitespace().collect::<Vec<&str>>()[..] {
        ["-Y", height, "+X", width] => width.parse::<usize>().ok().zip(height.parse::<usize>().ok()),
        _ => None,
    };
    let (width, height) =
        sides.ok_or_else(|| malformed(&format!("its size \"{size}\" is not like \"-Y 512 +X 1024\"")))?;
    if width.saturating_mul(height) > Bitmap::MAX_PIXELS || width.saturating_mul(height) == 0 {
        return Err(BitmapError::Size { width, height });
    }
    let mut pixels = Vec::with_capacity(width * height);
    for row in 0..height {
        let short = || malformed(&format!("row {row} is incomplete"));
        let encoded =
            rest.len() >= 4 && rest[..2] == [2, 2] && usize::from(rest[2]) << 8 | usize::from(rest[3]) == width;
        if encoded && (8..32_768).contains(&width) {
            rest = &rest[4..];
            let mut planes = [(); 4].map(|()| Vec::with_capacity(width));
            for plane in &mut planes {
                while plane.len() < width {
                    let (&count, after) = rest.split_first().ok_or_else(short)?;
                    let (length, taken) =
                        if count > 128 { (usize::from(count) - 128, 1) } else { (count.into(), count.into()) };
                    if length == 0 || after.len() < taken || plane.len() + length > width {
                        return Err(short());
                    }
                    match taken {
                        1 => plane.resize(plane.len() + length, after[0]),
                        _ => plane.extend(&after[..taken]),
                    }
                    rest = &after[taken..];
                }
            }
            pixels.extend((0..width).map(|x| rgbe([0, 1, 2, 3].map(|k: usize| planes[k][x]))));
        } else {
            let flat = rest.get(..4 * width).ok_or_else(short)?;
            pixels.extend(flat.chunks_exact(4).map(|code| rgbe([code[0], code[1], code[2], code[3]])));
            rest = &rest[4 * width..];
        }
    }
    Bitmap::new(width, height, pixels)
}

/// Three mantissas of 8 binary digits with an exponent.
fn rgbe([r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
    let unit = if exponent == 0 { 0.0 } else { (f64::from(exponent) - 136.0).exp2() };
    [r, g, b].map(|mantissa| (f64::from(mantissa) * unit) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radiance_pictures_flat_and_encoded() {
        let header = "#?RADIANCE\nEXPOSURE=1\nFORMAT=32-bit_rle_rgbe\n\n";
        // 2 x 1 pixels: (128, 64, 0) 2^(129 - 136) and black.
        let flat = [format!("{header}-Y 1 +X 2\n").as_bytes(), &[128, 64, 0, 129, 9, 9, 9, 0]].concat();
        assert_eq!(read_rgbe(&flat).unwrap().pixels(), [[1.0, 0.5, 0.0], [0.0; 3]]);
        // 9 x 1 pixels: red in a run of nine, green as eight numbers and a run of one, blue 0, exponent 136.
        let row = [&[2, 2, 0, 9, 128 + 9, 7, 8, 1, 2, 3, 4, 5, 6, 7, 8, 129, 9, 128 + 9, 0, 128 + 9, 136][..]].concat();
        let encoded = [format!("{header}-Y 1 +X 9\n").as_bytes(), &row].concat();
        let expected: Vec<[f32; 3]> = (1..=9).map(|green| [7.0, green as f32, 0.0]).collect();
        assert_eq!(read_rgbe(&encoded).unwrap().pixels(), expected);
        for broken in [
            &encoded[..encoded.len() - 1],
            &flat[..flat.len() - 1],
            b"#?RADIANCE\n",
            b"#?RADIANCE\n\n+X 1 -Y 1\n\0\0\0\0",
            b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n\0\0\0\0",
        ] {
            assert!(matches!(read_rgbe(broken), Err(BitmapError::Malformed(_))), "{broken:?}");
        }
    }
}
