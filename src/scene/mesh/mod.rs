//! Triangles: from files and from the simple shapes, moved into world space.

use glam::{DMat3, DMat4, DVec2, DVec3};

use super::Mesh;

pub mod attributes;
pub mod obj;
pub mod ply;
mod round;
pub mod serialized;

pub use attributes::Attribute;
pub use round::{SEGMENTS, cylinder, disk};

/// A mesh as it is in a file: normals are unit vectors, or zero where the file has none for a vertex, and texture coordinates
/// are as in the file.
#[derive(Clone, Debug)]
pub struct FileMesh {
    /// The mesh; the lists of normals and texture coordinates are empty if the file has none at all.
    pub mesh: Mesh,
    /// Further numbers of vertices and faces.
    pub attributes: Vec<Attribute>,
    /// Vertices without texture coordinates in a file in which others have some; theirs are (0, 0).
    pub missing_uvs: usize,
}

impl Mesh {
    /// Moves every vertex. The order of corners stays, so a mirroring transform turns the geometric normals around; shading
    /// normals stay on their side.
    pub fn transform(&mut self, to_world: &DMat4) {
        if *to_world == DMat4::IDENTITY {
            return;
        }
        for position in &mut self.positions {
            *position = to_world.transform_point3(*position);
        }
        let linear = DMat3::from_mat4(*to_world);
        // The inverse transpose up to a factor, which is the matrix of cofactors, takes normals to normals. It has the sign
        // of the determinant in it, as normals from transformed corners do.
        let cofactors = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        );
        for normal in &mut self.normals {
            *normal = (cofactors * *normal).normalize_or_zero();
        }
    }

    /// Turns all normals around.
    pub fn flip(&mut self) {
        for triangle in &mut self.triangles {
            triangle.swap(1, 2);
        }
        for normal in &mut self.normals {
            *normal = -*normal;
        }
    }

    /// Takes out the triangles without area, and returns how many there were. Vertices stay, so that indices do.
    pub fn drop_degenerate(&mut self) -> usize {
        let before = self.triangles.len();
        let positions = &self.positions;
        self.triangles.retain(|triangle| scaled_normal(positions, triangle).length() > ROUNDING);
        before - self.triangles.len()
    }

    /// Makes a shading normal for every vertex that has none (or one of length 0): the mean of the normals of its
    /// triangles, weighted by their angles at the vertex (Thürmer and Wüthrich 1998), as Mitsuba's meshes have. Vertices with
    /// different texture coordinates are different vertices, so a seam of these is an edge.
    pub fn complete_normals(&mut self) {
        self.normals.resize(self.positions.len(), DVec3::ZERO);
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for triangle in &self.triangles {
            let normal = scaled_normal(&self.positions, triangle).normalize_or_zero();
            for k in 0..3 {
                let [at, next, last] = [k, (k + 1) % 3, (k + 2) % 3].map(|k| triangle[k] as usize);
                let edge = |to: usize| self.positions[to] - self.positions[at];
                sums[at] += normal * edge(next).angle_between(edge(last));
            }
        }
        for triangle in &self.triangles {
            let flat = scaled_normal(&self.positions, triangle).normalize_or_zero();
            for &corner in triangle {
                let normal = &mut self.normals[corner as usize];
                if *normal == DVec3::ZERO {
                    // Normals that cancel out leave no mean; one of them is as good as another.
                    *normal = sums[corner as usize].try_normalize().unwrap_or(flat);
                }
            }
        }
        // What no triangle uses is never seen.
        self.normals.iter_mut().filter(|normal| **normal == DVec3::ZERO).for_each(|normal| *normal = DVec3::Z);
    }

    /// Whether the shading normals, if there are any, are those of the triangles.
    pub fn is_flat(&self) -> bool {
        self.normals.is_empty()
            || self.triangles.iter().all(|triangle| {
                let flat = scaled_normal(&self.positions, triangle).normalize_or_zero();
                triangle.iter().all(|&corner| self.normals[corner as usize].dot(flat) > 1.0 - 1e-9)
            })
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

/// The square \[-1, 1\]² in the xy plane, whose normal is +z. Texture coordinates are ((x + 1)/2, (y + 1)/2).
pub fn rectangle() -> Mesh {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    Mesh {
        positions: corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(),
        normals: Vec::new(),
        uvs: corners.map(|(x, y)| DVec2::new((x + 1.0) / 2.0, (y + 1.0) / 2.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// The image of the unit cube, eight vertices with normals outwards.
pub fn box_of(to_world: DMat4) -> Mesh {
    let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
    const FACES: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let mirrored = to_world.determinant() < 0.0;
    let turn = |[a, b, c]: [u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
    Mesh {
        positions: (0..8).map(|k| to_world.transform_point3(corner(k))).collect(),
        triangles: FACES.iter().flat_map(|&[a, b, c, d]| [turn([a, b, c]), turn([a, c, d])]).collect(),
        ..Mesh::default()
    }
}

/// The cube \[-1, 1\]³, whose normals point outwards. Each face has four vertices of its own, whose texture coordinates
/// are (0, 1), (1, 1), (1, 0) and (0, 0), as Mitsuba 3.9.1 has them.
pub fn cube() -> Mesh {
    const FACES: [[[i8; 3]; 4]; 6] = [
        [[1, -1, -1], [1, -1, 1], [-1, -1, 1], [-1, -1, -1]],
        [[1, 1, -1], [-1, 1, -1], [-1, 1, 1], [1, 1, 1]],
        [[1, -1, -1], [1, 1, -1], [1, 1, 1], [1, -1, 1]],
        [[1, -1, 1], [1, 1, 1], [-1, 1, 1], [-1, -1, 1]],
        [[-1, -1, 1], [-1, 1, 1], [-1, 1, -1], [-1, -1, -1]],
        [[1, 1, -1], [1, -1, -1], [-1, -1, -1], [-1, 1, -1]],
    ];
    Mesh {
        positions: FACES.iter().flatten().map(|corner| DVec3::from_array(corner.map(f64::from))).collect(),
        normals: Vec::new(),
        uvs: [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(|(u, v)| DVec2::new(u, v)).repeat(6),
        triangles: (0..6).flat_map(|face| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k: u32| 4 * face + k))).collect(),
    }
}
