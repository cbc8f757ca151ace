//! Triangles: from files and from the simple shapes, moved into world space.

use glam::{DMat4, DVec3};

use super::Mesh;

pub mod obj;

impl Mesh {
    /// Moves every corner. The order of corners stays, so a mirroring transform turns the normals around.
    pub fn transform(&mut self, to_world: &DMat4) {
        if *to_world != DMat4::IDENTITY {
            for position in &mut self.positions {
                *position = to_world.transform_point3(*position);
            }
        }
    }

    /// Turns all normals around.
    pub fn flip(&mut self) {
        for triangle in &mut self.triangles {
            triangle.swap(1, 2);
        }
    }

    /// Takes out the triangles without area, and returns how many there were. Corners stay, so that indices do.
    pub fn drop_degenerate(&mut self) -> usize {
        let before = self.triangles.len();
        let positions = &self.positions;
        self.triangles.retain(|triangle| scaled_normal(positions, triangle).length() > ROUNDING);
        before - self.triangles.len()
    }

    /// Whether all triangles lie in parallel planes and look to the same side, so that flat and interpolated normals
    /// are the same.
    pub fn is_flat(&self) -> bool {
        let mut normals = self.triangles.iter().map(|t| scaled_normal(&self.positions, t).normalize_or_zero());
        let Some(first) = normals.next() else { return true };
        normals.all(|normal| normal.dot(first) > 1.0 - 1e-9)
    }
}

/// Length of [`scaled_normal`] up to which a triangle is a line, seen with the rounding errors of double precision.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The normal of a triangle, of a length that tells the sine of its angle. The edges are divided by the longest of
/// their components first, so that the product neither overflows nor underflows, whatever the scale of the scene.
fn scaled_normal(positions: &[DVec3], &[a, b, c]: &[u32; 3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|index| positions[index as usize]);
    let size = |edge: DVec3| edge.abs().max_element();
    let unit = |edge: DVec3| if size(edge) > 0.0 { edge / size(edge) } else { DVec3::ZERO };
    unit(b - a).cross(unit(c - a))
}

/// The square \[-1, 1\]² in the xy plane, whose normal is +z.
pub fn rectangle() -> Mesh {
    Mesh {
        positions: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// The cube \[-1, 1\]³, whose normals point outwards. Corner `i` has x, y and z from bits 0, 1 and 2 of `i`.
pub fn cube() -> Mesh {
    let side = |corner: u32, bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let quads: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    Mesh {
        positions: (0..8).map(|corner| DVec3::new(side(corner, 0), side(corner, 1), side(corner, 2))).collect(),
        triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    }
}
