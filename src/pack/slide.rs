//! Textures in front of lights: over which coordinates the kernel looks them up.

use super::frame::Frame;
use super::layout::Light;
use crate::scene::{Mesh, Texture};
use glam::{DAffine2, DMat2, DVec2, DVec3};

/// Largest difference of texture coordinates that rounding may make.
const ROUNDING: f64 = 1e-5;

/// The texture coordinates in the plane of a triangle, as far as it goes on.
struct Plane {
    corner: DVec3,
    edges: [DVec3; 2],
    uv: [DVec2; 3],
}

impl Plane {
    fn of(mesh: &Mesh, triangle: usize) -> Plane {
        let corners = mesh.triangles[triangle].map(|corner| corner as usize);
        let [a, b, c] = corners.map(|corner| mesh.positions[corner]);
        Plane { corner: a, edges: [b - a, c - a], uv: corners.map(|corner| mesh.uvs[corner]) }
    }

    /// The coordinates of a point, by its own along the edges.
    fn at(&self, point: DVec3) -> DVec2 {
        let [one, two] = self.edges;
        let normal = one.cross(two);
        let (offset, squared) = (point - self.corner, normal.length_squared());
        let s = offset.cross(two).dot(normal) / squared;
        let t = one.cross(offset).dot(normal) / squared;
        self.uv[0] + (self.uv[1] - self.uv[0]) * s + (self.uv[2] - self.uv[0]) * t
    }
}

/// Whether the texture coordinates of a triangle go on in the next one, of the same plane.
pub fn continues(mesh: &Mesh, triangle: usize) -> bool {
    let plane = Plane::of(mesh, triangle);
    mesh.triangles[triangle + 1].iter().all(|&corner| {
        let corner = corner as usize;
        plane.at(mesh.positions[corner]).distance(mesh.uvs[corner]) <= ROUNDING
    })
}

/// A texture over the coordinates along the edges of the light that a triangle is part of.
pub fn on_plane(texture: &Texture, mesh: &Mesh, triangle: usize, frame: &Frame, light: &Light) -> Texture {
    let plane = Plane::of(mesh, triangle);
    let world = |point: DVec3| point / frame.scale + frame.center;
    let origin = light.origin.as_dvec3();
    let [corner, one, two] = [origin, origin + light.edge_1.as_dvec3(), origin + light.edge_2.as_dvec3()]
        .map(|point| plane.at(world(point)));
    over(texture, DAffine2::from_mat2_translation(DMat2::from_cols(one - corner, two - corner), corner))
}

/// A texture over the tangents of the angles along the axes of a spot with that cutoff, in radians.
pub fn before_spot(texture: &Texture, cutoff: f64) -> Texture {
    let factor = 0.5 / cutoff.tan();
    over(texture, DAffine2::from_scale_angle_translation(DVec2::splat(factor), 0.0, DVec2::splat(0.5)))
}

/// The texture after a transform of its coordinates.
fn over(texture: &Texture, first: DAffine2) -> Texture {
    let mut texture = texture.clone();
    match &mut texture {
        // Lights have no attributes of meshes: the reader refuses them.
        Texture::Constant(_) | Texture::Attribute { .. } => {}
        Texture::Bitmap { to_uv, .. } | Texture::Checkerboard { to_uv, .. } => *to_uv *= first,
    }
    texture
}
