//! Mirror of `shaders/lib/path_surface.glsl`: what a surface is at a point.

use super::bindings::{Primitive, Surface, Tables};
use super::math::{arctan2, orthonormal_frame};
use super::texture::eval_texture;
use crate::pack::layout::PRIMITIVE_SPHERE;
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_1_PI;

/// A point on a primitive, as a ray finds it.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Index of the primitive.
    pub index: u32,
    /// Where it is; of use for spheres.
    pub point: DVec3,
    /// Of a triangle.
    pub barycentric: DVec2,
}

fn is_sphere(primitive: &Primitive) -> bool {
    primitive.surface & PRIMITIVE_SPHERE != 0
}

/// Texture coordinates of a point on a primitive: a sphere's from the direction from its centre, (azimuth / 2π, polar angle / π).
pub fn texture_coordinates(tables: &Tables, place: &Place) -> DVec2 {
    let primitive = tables.primitive(place.index);
    if is_sphere(primitive) {
        let outwards = place.point - primitive.a;
        let azimuth = arctan2(outwards.y, outwards.x) * 0.5 * FRAC_1_PI;
        let polar = arctan2(outwards.truncate().length(), outwards.z) * FRAC_1_PI;
        return DVec2::new(if azimuth < 0.0 { azimuth + 1.0 } else { azimuth }, polar);
    }
    let corners = &tables.corners[place.index as usize];
    let DVec2 { x, y } = place.barycentric;
    let weights = DVec3::new(1.0 - x - y, x, y);
    let u = DVec3::new(f64::from(corners.u_a), f64::from(corners.u_b), f64::from(corners.u_c));
    DVec2::new(u.dot(weights), corners.v.as_dvec3().dot(weights))
}

/// Probability that light meets a mask.
pub fn opacity_at(tables: &Tables, surface: &Surface, place: &Place) -> f64 {
    let texture = surface.textures_2 >> 16;
    if texture == 0 {
        return surface.opacity;
    }
    let uv = texture_coordinates(tables, place);
    eval_texture(&tables.textures[texture as usize - 1], &tables.values, uv).x.clamp(0.0, 1.0)
}

/// Puts the colours at a place in the place of their means.
pub fn apply_textures(tables: &Tables, surface: &mut Surface, uv: DVec2) {
    let color = |texture: u32, mean: DVec3| match texture {
        0 => mean,
        texture => eval_texture(&tables.textures[texture as usize - 1], &tables.values, uv),
    };
    surface.reflectance = color(surface.textures_1 & 0xffff, surface.reflectance);
    surface.specular = color(surface.textures_1 >> 16, surface.specular);
    surface.transmittance = color(surface.textures_2 & 0xffff, surface.transmittance);
}

/// The normal of the BSDF's frame: that of the surface, or the interpolated one.
pub fn shading_normal(tables: &Tables, place: &Place, normal: DVec3) -> DVec3 {
    let corners = &tables.corners[place.index as usize];
    let DVec2 { x, y } = place.barycentric;
    let [a, b, c] = [corners.normal_a, corners.normal_b, corners.normal_c].map(|corner| corner.as_dvec3());
    let sum = a * (1.0 - x - y) + b * x + c * y;
    if sum.length_squared() > 0.0 { sum.normalize() } else { normal }
}

/// The tangent of the BSDF's frame: the direction in which u grows, where it has one.
pub fn surface_tangent(tables: &Tables, place: &Place, axis: DVec3) -> DVec3 {
    let primitive = tables.primitive(place.index);
    let along = if is_sphere(primitive) {
        let outwards = place.point - primitive.a;
        DVec3::new(-outwards.y, outwards.x, 0.0)
    } else {
        let corners = &tables.corners[place.index as usize];
        let v = corners.v.as_dvec3();
        let v = DVec2::new(v.y - v.x, v.z - v.x);
        let [u_a, u_b, u_c] = [corners.u_a, corners.u_b, corners.u_c].map(f64::from);
        let side = (u_b - u_a) * v.y - (u_c - u_a) * v.x;
        ((primitive.b - primitive.a) * v.y - (primitive.c - primitive.a) * v.x) * if side < 0.0 { -1.0 } else { 1.0 }
    };
    let along = along - axis * axis.dot(along);
    if along.length_squared() > 0.0 { along.normalize() } else { orthonormal_frame(axis).0 }
}
