//! Mirror of `shaders/lib/path_probe.glsl`: light that comes into a medium through smooth glass, to vertices in it and on what it surrounds.

use super::bindings::Tables;
use super::bsdf::{fresnel_dielectric, is_smooth_glass, sample_smooth_dielectric};
use super::guide::{Guide, guide_cell, guide_pdf, sample_guide};
use super::path_state::{INFINITE_DISTANCE, NONE, Path};
use super::path_vertex::{Vertex, eval_scattering, from_surface_frame, medium_towards, offset_origin, sides_agree};
use glam::{DVec2, DVec3};

/// What a path needs again behind a probe that it sends.
#[derive(Clone, Copy, Debug, Default)]
pub struct Kept {
    throughput: DVec3,
    pdf: f64,
    guide_pdf: f64,
    depth: u32,
    point: DVec3,
    normal: DVec3,
    offset: f64,
    left: u32,
}

/// The lobe of the cell of a point.
pub fn find_guide(tables: &Tables, point: DVec3) -> Guide {
    let params = &tables.params;
    let first = (params.first_guide + 4 * guide_cell((point - params.guide_origin) * params.guide_scale)) as usize;
    let [x, y, z, sharpness] = [0, 1, 2, 3].map(|k| f64::from(tables.values[first + k]));
    let scaled_axis = DVec3::new(x, y, z);
    let chance = scaled_axis.length();
    Guide { axis: scaled_axis / chance.max(1e-9), sharpness, chance }
}

/// Sends a probe from a vertex at which the path arrived with the throughput `arriving`, if that scatters in its direction. The path has
/// scattered already.
pub fn send_probe(tables: &Tables, path: &mut Path, vertex: &Vertex, guide: &Guide, arriving: DVec3, u: DVec2) {
    let direction = sample_guide(guide, u);
    let scattering = eval_scattering(tables, vertex, direction);
    if scattering.pdf == 0.0 {
        return;
    }
    let Path { throughput, pdf, guide_pdf: of_guide, depth, point, normal, offset, left, .. } = *path;
    path.kept = Kept { throughput, pdf, guide_pdf: of_guide, depth, point, normal, offset, left };
    path.probe = true;
    path.direction = direction;
    path.guide_pdf = guide_pdf(guide, direction);
    path.throughput = arriving * scattering.value / path.guide_pdf;
    path.pdf = scattering.pdf;
    path.origin = offset_origin(path, direction);
    path.t_max = INFINITE_DISTANCE;
    path.tau_rgb = DVec3::ZERO;
    path.passed = 1.0;
    path.open = false;
}

/// Whether a direction leads to the other side.
pub fn goes_through(vertex: &Vertex, direction: DVec3) -> bool {
    (vertex.incident.z > 0.0) != (vertex.axis.dot(direction) > 0.0)
}

/// The probability with which a path that meets smooth glass goes through.
pub fn passing_probability(vertex: &Vertex) -> f64 {
    1.0 - fresnel_dielectric(vertex.incident.z, vertex.surface.eta).0
}

/// Bends a probe at a surface. Returns whether it goes on.
pub fn refract_probe(tables: &Tables, path: &mut Path, vertex: &Vertex) -> bool {
    path.depth += 1;
    let passes = if is_smooth_glass(&vertex.surface) { passing_probability(vertex) } else { 0.0 };
    if passes == 0.0 || path.depth >= tables.features.max_depth {
        return false;
    }
    let next = sample_smooth_dielectric(&vertex.surface, vertex.incident, 1.0);
    let direction = from_surface_frame(vertex.tangent, vertex.axis, next.direction);
    if !sides_agree(vertex, next.direction.z, direction) {
        return false;
    }
    path.throughput *= next.weight * passes;
    path.pdf *= passes;
    path.medium = medium_towards(tables, vertex, path.medium, direction);
    path.point = vertex.point;
    path.direction = direction;
    path.origin = offset_origin(path, direction);
    path.t_min = 0.0;
    path.t_max = INFINITE_DISTANCE;
    path.last = NONE;
    path.tau_rgb = DVec3::ZERO;
    true
}

/// The path goes on from where it sent the probe.
pub fn end_probe(path: &mut Path) {
    path.probe = false;
    path.alive = true;
    path.throughput = path.kept.throughput;
    path.pdf = path.kept.pdf;
    path.guide_pdf = path.kept.guide_pdf;
    path.depth = path.kept.depth;
    path.point = path.kept.point;
    path.normal = path.kept.normal;
    path.offset = path.kept.offset;
    path.left = path.kept.left;
    path.last = NONE;
}
