//! Numbers that a mesh file gives to vertices or faces beside their places, as textures.
//!
//! The numbers of all triangles are laid out in one image, a block of 2 × 2 pixels for each, in rows of equally many: those of the corners a, b
//! and c, and b + c − a. Bilinear interpolation between four such pixels is linear, a + s (b − a) + t (c − a).

use glam::Vec3;

use crate::scene::{Bitmap, Mesh};

/// Numbers of each vertex or of each face.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// By Mitsuba's rules, with `vertex_` or `face_` in front.
    pub name: String,
    /// Of faces; else of vertices.
    pub per_face: bool,
    /// Numbers of each.
    pub channels: usize,
    /// All of them, those of one vertex or face together.
    pub values: Vec<f32>,
}

impl Attribute {
    /// The colour of a vertex or face: one number is gray.
    fn color(&self, index: usize) -> Vec3 {
        match self.values[index * self.channels..(index + 1) * self.channels] {
            [r, g, b] => Vec3::new(r, g, b),
            [gray, ..] => Vec3::splat(gray),
            [] => Vec3::ZERO,
        }
    }

    /// The image of the attribute, times a factor. `faces` says which face of the file each triangle of the mesh is.
    pub fn image(&self, mesh: &Mesh, faces: &[u32], scale: f32) -> Bitmap {
        let (width, height) = size(mesh.triangles.len());
        let mut pixels = vec![[0.0; 3]; width * height];
        for (k, (triangle, face)) in mesh.triangles.iter().zip(faces).enumerate() {
            let at = |corner: u32| self.color(if self.per_face { *face } else { corner } as usize) * scale;
            let [a, b, c] = triangle.map(at);
            let (column, row) = place(k, width);
            let first = row * width + column;
            pixels[first] = a.to_array();
            pixels[first + 1] = b.to_array();
            pixels[first + width] = c.to_array();
            pixels[first + width + 1] = (b + c - a).to_array();
        }
        Bitmap::new(width, height, pixels).expect("the triangles were counted, and their numbers are finite")
    }
}

/// Pixels in a row of the image, and rows, for so many triangles.
fn size(triangles: usize) -> (usize, usize) {
    let columns = (triangles as f64).sqrt().ceil().max(1.0) as usize;
    (2 * columns, 2 * triangles.div_ceil(columns).max(1))
}

/// The first pixel of a triangle's block.
fn place(triangle: usize, width: usize) -> (usize, usize) {
    let columns = width / 2;
    (2 * (triangle % columns), 2 * (triangle / columns))
}

/// Which of the triangles `before` those that are `left` are; some may have been taken out, but their order is the same.
pub fn faces_left(before: &[[u32; 3]], left: &[[u32; 3]]) -> Vec<u32> {
    let mut faces = Vec::with_capacity(left.len());
    let mut numbered = before.iter().zip(0u32..);
    for triangle in left {
        faces.extend(numbered.by_ref().find(|(candidate, _)| *candidate == triangle).map(|(_, face)| face));
    }
    faces
}
