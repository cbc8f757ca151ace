//! The table of textures, and what a shape's primitives carry for them: texture coordinates and shading normals.

use super::layout::{
    Corners, TEXTURE_ATTRIBUTE, TEXTURE_BITMAP, TEXTURE_CHECKERBOARD, TEXTURE_CLAMP, TEXTURE_MIRROR, TEXTURE_NEAREST,
    Texture,
};
use crate::scene::{self, Bitmap, Filter, Geometry, Shape, Wrap};
use glam::{DAffine2, DVec3, Vec3};
use std::sync::Arc;

/// Textures that 16 bits can name.
pub const MAX_TEXTURES: usize = 65535;

/// Textures as the kernel reads them.
#[derive(Default)]
pub struct TextureTable {
    /// The entries.
    pub textures: Vec<Texture>,
    /// Images whose pixels are among the values already, and where.
    images: Vec<(Arc<Bitmap>, u32)>,
}

impl TextureTable {
    /// Adds a texture, and the pixels of its image to the `values` unless they are there. Returns its mean over the image or the
    /// pattern, and its index plus one; of a constant colour the colour and 0.
    pub fn add(&mut self, texture: &scene::Texture, values: &mut Vec<f32>) -> (Vec3, u32) {
        match texture {
            scene::Texture::Constant(color) => (color.as_vec3(), 0),
            _ => self.entry(texture, values),
        }
    }

    /// The same of a texture in front of a light, which has an entry, be it constant.
    pub fn add_painted(&mut self, texture: &scene::Texture, values: &mut Vec<f32>) -> (Vec3, u32) {
        self.entry(texture, values)
    }

    /// The same of a texture that must have an entry, be it constant. Returns its index plus one.
    pub fn add_entry(&mut self, texture: &scene::Texture, values: &mut Vec<f32>) -> u32 {
        self.entry(texture, values).1
    }

    fn entry(&mut self, texture: &scene::Texture, values: &mut Vec<f32>) -> (Vec3, u32) {
        let (mean, entry) = match texture {
            scene::Texture::Constant(color) => {
                let color = color.as_vec3();
                let entry =
                    Texture { kind: TEXTURE_CHECKERBOARD, color_0: color, color_1: color, ..Texture::default() };
                (color.as_dvec3(), entry)
            }
            scene::Texture::Checkerboard { color0, color1, to_uv } => {
                let entry = Texture {
                    kind: TEXTURE_CHECKERBOARD,
                    color_0: color0.as_vec3(),
                    color_1: color1.as_vec3(),
                    ..placed(to_uv)
                };
                ((*color0 + *color1) / 2.0, entry)
            }
            scene::Texture::Bitmap { bitmap, filter, wrap, to_uv } => {
                let wrap = match wrap {
                    Wrap::Repeat => 0,
                    Wrap::Mirror => TEXTURE_MIRROR,
                    Wrap::Clamp => TEXTURE_CLAMP,
                };
                let entry = Texture {
                    kind: TEXTURE_BITMAP,
                    flags: wrap | if *filter == Filter::Nearest { TEXTURE_NEAREST } else { 0 },
                    width: bitmap.width(),
                    height: bitmap.height(),
                    first_value: self.first_value(bitmap, values),
                    ..placed(to_uv)
                };
                (mean(bitmap), entry)
            }
            scene::Texture::Attribute { bitmap } => {
                let entry = Texture {
                    kind: TEXTURE_BITMAP,
                    flags: TEXTURE_CLAMP | TEXTURE_ATTRIBUTE,
                    width: bitmap.width(),
                    height: bitmap.height(),
                    first_value: self.first_value(bitmap, values),
                    ..placed(&DAffine2::IDENTITY)
                };
                (mean(bitmap), entry)
            }
        };
        // The same texture on many shapes is one entry.
        let index = self.textures.iter().position(|known| *known == entry).unwrap_or_else(|| {
            self.textures.push(entry);
            self.textures.len() - 1
        });
        // An index that does not fit is an error of the whole scene, which the caller finds in the length of the table.
        (mean.as_vec3(), index as u32 + 1)
    }

    /// Where the pixels of an image begin.
    fn first_value(&mut self, bitmap: &Arc<Bitmap>, values: &mut Vec<f32>) -> u32 {
        if let Some((_, first)) = self.images.iter().find(|(known, _)| Arc::ptr_eq(known, bitmap)) {
            return *first;
        }
        let first = values.len() as u32;
        values.extend(bitmap.pixels().iter().flatten());
        self.images.push((bitmap.clone(), first));
        first
    }
}

fn mean(bitmap: &Bitmap) -> DVec3 {
    let sum: DVec3 = bitmap.pixels().iter().map(|pixel| Vec3::from(*pixel).as_dvec3()).sum();
    sum / bitmap.pixels().len() as f64
}

/// An entry with nothing but its transform.
fn placed(to_uv: &DAffine2) -> Texture {
    let (matrix, shift) = (to_uv.matrix2, to_uv.translation);
    Texture {
        row_u: DVec3::new(matrix.x_axis.x, matrix.y_axis.x, shift.x).as_vec3(),
        row_v: DVec3::new(matrix.x_axis.y, matrix.y_axis.y, shift.y).as_vec3(),
        ..Texture::default()
    }
}

/// What the corners of a shape's primitives carry, one entry for each in order: normals and texture coordinates that the shape
/// does not have are 0.
pub fn corners(shape: &Shape) -> Vec<Corners> {
    let Geometry::Mesh(mesh) = &shape.geometry else {
        let [normal_a, normal_b, normal_c] =
            [shape.axes.x_axis, shape.axes.y_axis, shape.axes.z_axis].map(|axis| axis.as_vec3());
        return vec![Corners { normal_a, normal_b, normal_c, ..Corners::default() }];
    };
    let normal = |corner: u32| mesh.normals.get(corner as usize).map_or(Vec3::ZERO, |normal| normal.as_vec3());
    let uv = |corner: u32| mesh.uvs.get(corner as usize).map_or(glam::Vec2::ZERO, |uv| uv.as_vec2());
    let entry = |(number, &[a, b, c]): (u32, &[u32; 3])| Corners {
        normal_a: normal(a),
        u_a: uv(a).x,
        normal_b: normal(b),
        u_b: uv(b).x,
        normal_c: normal(c),
        u_c: uv(c).x,
        v: Vec3::new(uv(a).y, uv(b).y, uv(c).y),
        number,
    };
    (0..).zip(&mesh.triangles).map(entry).collect()
}
