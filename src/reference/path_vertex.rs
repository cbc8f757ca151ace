//! Mirror of `shaders/lib/path_vertex.glsl`: where a path scatters, in a medium or on a surface.

use super::bindings::{Primitive, Surface, Tables};
use super::bsdf::bsdf_kind;
use super::bsdf::{BsdfSample, BsdfValue, eval_bsdf, sample_bsdf};
use super::math::{from_frame, max_component};
use super::medium::{medium_code, medium_of_code};
use super::path_state::{Hit, NONE, Path};
use super::path_surface::relief_fading;
use super::phase::{PhaseTables, eval_henyey_greenstein, eval_mixture, sample_henyey_greenstein, sample_mixture};
use super::principled::{eval_principled, sample_principled};
use super::warp::from_polar;
use crate::pack::layout::{BSDF_PRINCIPLED, PRIMITIVE_SPHERE, SURFACE_ORIENTED};
use glam::{DVec2, DVec3};

/// A point where light is scattered, in a medium or on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Where it is.
    pub point: DVec3,
    /// z of the surface's local frame; in a medium, the direction of propagation.
    pub axis: DVec3,
    /// Else on a surface.
    pub in_medium: bool,
    /// Of the medium.
    pub g: f64,
    /// Of the medium: its mixture of phase functions, as in [`crate::pack::layout::Medium`]; 0 is the one of `g`.
    pub phase: u32,
    /// Of the medium, with the weight of the flight.
    pub albedo: DVec3,
    /// What is there, if it is not in a medium.
    pub surface: Surface,
    /// On a surface: towards where the path comes from, in the local frame.
    pub incident: DVec3,
    /// On a surface: x of the local frame.
    pub tangent: DVec3,
    /// On a surface: the geometric normal, on the side of `axis`.
    pub normal: DVec3,
    /// Where normals are turned by maps: the normal before that.
    pub base: DVec3,
    /// There: squared roughness by which light fades where it grazes the surface, or 0.
    pub fade: f64,
}

/// The components of a direction in the local frame of a surface.
pub fn to_surface_frame(tangent: DVec3, axis: DVec3, direction: DVec3) -> DVec3 {
    DVec3::new(tangent.dot(direction), axis.cross(tangent).dot(direction), axis.dot(direction))
}

/// A direction from its components in that frame.
pub fn from_surface_frame(tangent: DVec3, axis: DVec3, local: DVec3) -> DVec3 {
    (tangent * local.x + axis.cross(tangent) * local.y + axis * local.z).normalize()
}

/// Whether a direction lies on the same side of a surface and of its shading normal, which it must not leak through.
pub fn sides_agree(vertex: &Vertex, local_z: f64, direction: DVec3) -> bool {
    (local_z > 0.0) == (vertex.normal.dot(direction) > 0.0)
}

fn phase_tables(tables: &Tables) -> PhaseTables<'_> {
    PhaseTables { phases: &tables.phases, values: &tables.values }
}

/// What a surface does to light, whatever its kind. `values` holds the tables of surfaces.
pub fn eval_surface(surface: &Surface, values: &[f32], wi: DVec3, wo: DVec3) -> BsdfValue {
    match bsdf_kind(surface) {
        BSDF_PRINCIPLED => eval_principled(surface, wi, wo),
        _ => eval_bsdf(surface, values, wi, wo),
    }
}

/// A direction in which light goes on from a surface, in the local frame.
pub fn sample_surface(surface: &Surface, values: &[f32], wi: DVec3, u: DVec2, lobe: f64) -> BsdfSample {
    match bsdf_kind(surface) {
        BSDF_PRINCIPLED => sample_principled(surface, wi, u, lobe),
        _ => sample_bsdf(surface, values, wi, u, lobe),
    }
}

/// Scattering function times cosine, and the density with which directions are sampled.
pub fn eval_scattering(tables: &Tables, vertex: &Vertex, direction: DVec3) -> BsdfValue {
    if vertex.in_medium {
        let phase = if vertex.phase != 0 {
            eval_mixture(phase_tables(tables), vertex.phase, vertex.axis, direction)
        } else {
            eval_henyey_greenstein(vertex.g, vertex.axis, direction)
        };
        return BsdfValue { value: vertex.albedo * phase, pdf: phase };
    }
    let local = to_surface_frame(vertex.tangent, vertex.axis, direction);
    if !sides_agree(vertex, local.z, direction) {
        return BsdfValue::default();
    }
    let found = eval_surface(&vertex.surface, &tables.values, vertex.incident, local);
    BsdfValue { value: found.value * fading(vertex, direction), ..found }
}

/// What turned normals leave of light in a direction.
fn fading(vertex: &Vertex, direction: DVec3) -> f64 {
    if vertex.fade > 0.0 { relief_fading(vertex.fade, vertex.base.dot(direction)) } else { 1.0 }
}

/// A direction found by scattering, in world space.
pub fn sample_scattering(tables: &Tables, vertex: &Vertex, u: DVec2, lobe: f64) -> BsdfSample {
    if vertex.in_medium {
        let angle = if vertex.phase != 0 {
            sample_mixture(phase_tables(tables), vertex.phase, u.x, lobe)
        } else {
            sample_henyey_greenstein(vertex.g, u.x)
        };
        let local = from_polar(angle.cos_theta, angle.sin_theta, u.y);
        // For g = 0 no axis matters; the kernel leaves the frame out where it knows no other g.
        let direction = if vertex.g == 0.0 && vertex.phase == 0 { local } else { from_frame(vertex.axis, local) };
        let pdf = eval_scattering(tables, vertex, direction).pdf;
        return BsdfSample { direction, weight: vertex.albedo, pdf, eta: 1.0 };
    }
    let found = sample_surface(&vertex.surface, &tables.values, vertex.incident, u, lobe);
    let direction = from_surface_frame(vertex.tangent, vertex.axis, found.direction);
    if !sides_agree(vertex, found.direction.z, direction) {
        return BsdfSample { direction, weight: DVec3::ZERO, pdf: 0.0, ..found };
    }
    BsdfSample { direction, weight: found.weight * fading(vertex, direction), ..found }
}

/// Where a ray in some direction begins so that it does not meet the surface it leaves.
pub fn offset_origin(path: &Path, direction: DVec3) -> DVec3 {
    path.point + path.normal * if path.normal.dot(direction) >= 0.0 { path.offset } else { -path.offset }
}

/// The medium on the side of a surface to which a direction goes, for a path that came in `medium`.
pub fn medium_towards(tables: &Tables, vertex: &Vertex, medium: u32, direction: DVec3) -> u32 {
    if vertex.in_medium || vertex.surface.flags & SURFACE_ORIENTED == 0 {
        return medium;
    }
    let outwards = vertex.normal.dot(direction) > 0.0;
    if outwards == (vertex.incident.z > 0.0) || vertex.surface.media == 0 {
        return medium;
    }
    let (inside, outside) = (vertex.surface.media & 0xffff, vertex.surface.media >> 16);
    let (from, to) = if outwards { (inside, outside) } else { (outside, inside) };
    // If the surface does not expect the medium in front of it, it coincides with another boundary.
    let sum = medium_code(medium).wrapping_add(medium_code(to)).wrapping_sub(medium_code(from));
    let found = if medium == from { to } else { medium_of_code(sum, to, tables.media.len() as u32) };
    if found == NONE { to } else { found }
}

/// A point on a primitive, its unit normal, and the largest coordinate that went into it.
pub fn surface_point(primitive: &Primitive, path: &Path, hit: &Hit) -> (DVec3, DVec3, f64) {
    let Primitive { a, b, c, .. } = *primitive;
    if primitive.surface & PRIMITIVE_SPHERE != 0 {
        let outwards = (path.origin + path.direction * hit.t - a).normalize();
        return (a + outwards * b.x, outwards * b.y, max_component(a.abs()) + b.x);
    }
    let (edge_1, edge_2) = (b - a, c - a);
    let point = a + edge_1 * hit.barycentric.x + edge_2 * hit.barycentric.y;
    (point, edge_1.cross(edge_2).normalize(), max_component(a.abs().max(b.abs().max(c.abs()))))
}
