//! Mirror of `shaders/lib/path_aim.glsl`: where a path goes next, by scattering or past a lamp.

use super::bindings::{Light, Medium, Tables};
use super::bsdf::BsdfSample;
use super::light::plane_light_point;
use super::path_state::{Path, choose_light, medium_at, sample_set, vertex_numbers};
use super::path_vertex::{Vertex, eval_scattering, sample_scattering};
use super::toward_light::{sample_toward_light, toward_light_pdf};
use crate::pack::layout::{LIGHT_QUAD, LIGHT_RECTANGLE, LIGHT_TRIANGLE, SURFACE_ORIENTED};
use glam::{DVec2, DVec3, Vec4Swizzles};
use std::f64::consts::PI;

/// Sets of random numbers that choose what a segment's sampling goes by: its direction, and then equiangular distances.
pub const PIVOT_SET: u32 = 0x4000_0000;

/// Share of directions that go by a small lamp...
const AIMED_SHARE: f64 = 0.25;
/// ...and half as many by one whose area is the squared distance over this: what a broad lamp brings varies little with direction.
const BROAD: f64 = 8.0;

/// A point of a lamp, by which a segment goes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pivot {
    /// Where it is.
    pub point: DVec3,
    /// Of the lamp.
    pub area: f64,
}

/// What a vertex's next direction goes by.
#[derive(Clone, Copy, Debug, Default)]
pub struct Aim {
    /// To a point of the lamp.
    pub axis: DVec3,
    /// Probability of directions by the lamp; 0 where only scattering counts.
    pub share: f64,
    /// Decides between the two.
    u: f64,
}

/// A point of the light, or of the strongest lamp where the light is infinitely far.
pub fn light_pivot(light: &Light, u: DVec2) -> DVec3 {
    let on_plane = matches!(light.kind, LIGHT_TRIANGLE | LIGHT_QUAD | LIGHT_RECTANGLE);
    let v = if on_plane { plane_light_point(light, u) } else { DVec2::ZERO };
    let offset = if on_plane { light.edge_1 * v.x + light.edge_2 * v.y } else { DVec3::ZERO };
    light.origin + offset
}

/// What the direction of a segment goes by, and its distances: by the lamp that the vertex at its end samples.
pub fn find_pivot(tables: &Tables, path: &Path, segment: u32) -> Pivot {
    let mut u = vertex_numbers(tables, path, segment).x;
    let light = &tables.lights[choose_light(tables, &mut u) as usize];
    Pivot { point: light_pivot(light, sample_set(tables, path, PIVOT_SET + segment).zw()), area: light.area }
}

/// What directions from a point in a medium go by.
pub fn aim_at(pivot: &Pivot, point: DVec3, medium: &Medium, u: f64) -> Aim {
    let way = pivot.point - point;
    let squared = way.length_squared();
    if medium.equiangular == 0.0 || squared == 0.0 {
        return Aim { axis: DVec3::Z, share: 0.0, u };
    }
    Aim { axis: way / squared.sqrt(), share: AIMED_SHARE * squared / (squared + BROAD * pivot.area), u }
}

/// The aim of a vertex; glass is left to its own.
pub fn find_aim(tables: &Tables, path: &Path, vertex: &Vertex, pivot: &Pivot) -> Aim {
    if !vertex.in_medium && vertex.surface.flags & SURFACE_ORIENTED != 0 {
        return Aim::default();
    }
    let u = sample_set(tables, path, PIVOT_SET + path.segment + 1).y;
    aim_at(pivot, vertex.point, medium_at(tables, path.medium), u)
}

/// Density of a direction that scattering has with the density `pdf`, by both ways to choose it.
pub fn aimed_pdf(aim: &Aim, pdf: f64, direction: DVec3) -> f64 {
    if aim.share > 0.0 { (1.0 - aim.share) * pdf + aim.share * toward_light_pdf(aim.axis, direction) } else { pdf }
}

/// Whether it is the vertex of a medium that others scatter at as well, each of them from where it comes.
pub fn is_common(path: &Path, vertex: &Vertex) -> bool {
    path.sharing == 2 && path.depth == 2 && vertex.in_medium
}

/// The density of scattering that the weights of multiple importance sampling go by; at a common vertex one on which all paths agree.
pub fn weighing_pdf(path: &Path, vertex: &Vertex, scattered: f64) -> f64 {
    if is_common(path, vertex) { 0.25 / PI } else { scattered }
}

/// The next direction, and its density by scattering alone.
pub fn sample_next(tables: &Tables, vertex: &Vertex, aim: &Aim, u: DVec2, lobe: f64) -> (BsdfSample, f64) {
    let mut next = sample_scattering(tables, vertex, u, lobe);
    let mut scattered = next.pdf;
    if aim.share > 0.0 {
        let aimed = aim.u < aim.share;
        if aimed || next.pdf > 0.0 {
            if aimed {
                next.direction = sample_toward_light(aim.axis, u);
                next.eta = 1.0;
            }
            let value = eval_scattering(tables, vertex, next.direction);
            scattered = value.pdf;
            next.pdf = aimed_pdf(aim, value.pdf, next.direction);
            next.weight = value.value / next.pdf;
        } else {
            next.weight /= 1.0 - aim.share;
        }
    }
    (next, scattered)
}
