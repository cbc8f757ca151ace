//! Colours that depend on the place on a surface.

use std::sync::Arc;

use glam::{DAffine2, DVec2, DVec3};

use super::Bitmap;

/// A colour in linear sRGB, constant or looked up by texture coordinates.
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    /// The same everywhere.
    Constant(DVec3),
    /// An image.
    Bitmap {
        /// The pixels.
        bitmap: Arc<Bitmap>,
        /// What happens between the centres of pixels.
        filter: Filter,
        /// What happens outside of \[0, 1\].
        wrap: Wrap,
        /// Applied to the surface's coordinates before the look-up.
        to_uv: DAffine2,
    },
    /// Numbers that a mesh file gives to vertices or faces, looked up by the triangle and the place on it rather than by texture coordinates.
    Attribute {
        /// For each triangle of the shape's mesh a block of 2 × 2 pixels: see [`super::mesh::attributes`].
        bitmap: Arc<Bitmap>,
    },
    /// Squares of side 1/2 in turn: `color0` where the fractional parts of u and v are both above 1/2 or both not.
    Checkerboard {
        /// The colour at (0, 0).
        color0: DVec3,
        /// The other one.
        color1: DVec3,
        /// Applied to the surface's coordinates before the look-up.
        to_uv: DAffine2,
    },
}

/// What happens between the centres of pixels, which lie at ((x + ½)/width, (y + ½)/height).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The pixel in which a point lies.
    Nearest,
    /// Bilinear interpolation of the four nearest centres.
    Bilinear,
}

/// What happens outside of \[0, 1\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The image is repeated.
    Repeat,
    /// The image is repeated, mirrored every other time.
    Mirror,
    /// The pixels at the edge go on.
    Clamp,
}

impl From<DVec3> for Texture {
    fn from(color: DVec3) -> Self {
        Texture::Constant(color)
    }
}

impl Wrap {
    /// The pixel that stands at an index which may lie outside of the image.
    pub fn index(self, index: i64, size: u32) -> u32 {
        let size = i64::from(size);
        let inside = match self {
            Wrap::Repeat => index.rem_euclid(size),
            Wrap::Mirror => {
                let period = index.rem_euclid(2 * size);
                period.min(2 * size - 1 - period)
            }
            Wrap::Clamp => index.clamp(0, size - 1),
        };
        u32::try_from(inside).expect("less than a size of 32 bits")
    }
}

impl Texture {
    /// The colour if it is the same everywhere.
    pub fn constant(&self) -> Option<DVec3> {
        match self {
            Texture::Constant(color) => Some(*color),
            _ => None,
        }
    }

    /// Whether it is looked up by texture coordinates.
    pub fn needs_uvs(&self) -> bool {
        matches!(self, Texture::Bitmap { .. } | Texture::Checkerboard { .. })
    }

    /// The colour at texture coordinates; of an attribute, at coordinates in its image. This is the definition that renderers follow; conventions of Mitsuba 3.9.1.
    pub fn eval(&self, uv: DVec2) -> DVec3 {
        match self {
            Texture::Constant(color) => *color,
            Texture::Checkerboard { color0, color1, to_uv } => {
                let uv = to_uv.transform_point2(uv);
                let above = (uv - uv.floor()).cmpgt(DVec2::splat(0.5));
                if above.x == above.y { *color0 } else { *color1 }
            }
            Texture::Attribute { bitmap } => {
                let (filter, wrap, to_uv) = (Filter::Bilinear, Wrap::Clamp, DAffine2::IDENTITY);
                Texture::Bitmap { bitmap: bitmap.clone(), filter, wrap, to_uv }.eval(uv)
            }
            Texture::Bitmap { bitmap, filter, wrap, to_uv } => {
                let size = DVec2::new(f64::from(bitmap.width()), f64::from(bitmap.height()));
                let place = to_uv.transform_point2(uv) * size;
                let pixel = |x: f64, y: f64| {
                    bitmap.pixel(wrap.index(x as i64, bitmap.width()), wrap.index(y as i64, bitmap.height())).as_dvec3()
                };
                match filter {
                    Filter::Nearest => pixel(place.x.floor(), place.y.floor()),
                    Filter::Bilinear => {
                        let place = place - DVec2::splat(0.5);
                        let (low, share) = (place.floor(), place - place.floor());
                        let row = |y: f64| pixel(low.x, y).lerp(pixel(low.x + 1.0, y), share.x);
                        row(low.y).lerp(row(low.y + 1.0), share.y)
                    }
                }
            }
        }
    }
}
