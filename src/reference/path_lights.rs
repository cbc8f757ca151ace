//! Mirror of `shaders/lib/path_lights.glsl`: how a path comes to light, by chance or by light sampling.

use super::bindings::{Light, Primitive, Tables};
use super::bsdf::BsdfSample;
use super::light::{
    LightSample, alias_keeps, alias_line, area_pdf, sample_plane_light, sample_point_light, sample_sphere_light,
    sphere_light_pdf,
};
use super::math::max_component;
use super::path_state::{INFINITE_DISTANCE, Path, survival, survived_throughput};
use super::path_vertex::{Vertex, eval_scattering, medium_towards, offset_origin, sample_scattering};
use crate::pack::layout::{LIGHT_CONSTANT, LIGHT_POINT, LIGHT_SPHERE};
use glam::{DVec2, DVec3};

/// Weight of a direction found by scattering that light sampling finds with density `light_pdf`: the balance heuristic
/// (Veach and Guibas 1995).
pub fn scattering_mis_weight(path: &Path, survival: f64, light_pdf: f64) -> f64 {
    let found = path.pdf * survival;
    if path.pdf == 0.0 || light_pdf == 0.0 { 1.0 } else { found / (found + light_pdf) }
}

/// Whether light that arrives by chance counts.
pub fn emitters_seen(tables: &Tables, path: &Path) -> bool {
    !(tables.features.hide_emitters && path.depth == 0)
}

/// Adds the constant light to a path that leaves the scene.
pub fn add_constant_light(tables: &Tables, path: &mut Path) {
    if !emitters_seen(tables, path) {
        return;
    }
    for light in tables.lights.iter().filter(|light| light.kind == LIGHT_CONSTANT) {
        // Light sampling takes its directions from the same scattering function (see `sample_light`).
        let light_pdf = if tables.features.light_sampling { light.probability * path.pdf } else { 0.0 };
        let weight = scattering_mis_weight(path, survival(path), light_pdf);
        path.radiance += survived_throughput(path) * light.radiance * weight;
    }
}

/// Adds what a primitive emits towards the path.
pub fn add_emission(tables: &Tables, path: &mut Path, primitive: &Primitive, t: f64, normal: DVec3) {
    let cos_light = -path.direction.dot(normal);
    if primitive.light == 0 || cos_light <= 0.0 || !emitters_seen(tables, path) {
        return;
    }
    let light: &Light = &tables.lights[primitive.light as usize - 1];
    let pdf = if light.kind == LIGHT_SPHERE {
        sphere_light_pdf(light.edge_1.x, path.origin.distance(light.origin))
    } else {
        area_pdf(light.area, t, cos_light)
    };
    let light_pdf = if tables.features.light_sampling { light.probability * pdf } else { 0.0 };
    let weight = scattering_mis_weight(path, survival(path), light_pdf);
    path.radiance += survived_throughput(path) * light.radiance * weight;
}

/// Chooses a light and a point on it, and sets up the shadow ray. Returns whether there is anything to ask for.
pub fn sample_light(tables: &Tables, path: &mut Path, vertex: &Vertex, mut u: DVec2, lobe: f64) -> bool {
    if !tables.features.light_sampling {
        return false;
    }
    let mut index = alias_line(tables.lights.len() as u32, &mut u.x);
    let line = &tables.lights[index as usize];
    index = if alias_keeps(line.alias_threshold, &mut u.x) { index } else { line.alias };
    let light = &tables.lights[index as usize];
    let found = match light.kind {
        LIGHT_CONSTANT => {
            // No direction is better than another, so the scattering function samples them; what light sampling adds is
            // the transmittance, exact instead of 0 or 1.
            let BsdfSample { direction, pdf, .. } = sample_scattering(tables, vertex, u, lobe);
            let weight = if pdf > 0.0 { light.radiance / pdf } else { DVec3::ZERO };
            LightSample { direction, distance: INFINITE_DISTANCE, weight, pdf }
        }
        LIGHT_POINT => sample_point_light(light, vertex.point),
        LIGHT_SPHERE => sample_sphere_light(light, vertex.point, u),
        _ => sample_plane_light(light, vertex.point, u),
    };
    let scattering = eval_scattering(tables, vertex, found.direction);
    path.direction = found.direction;
    path.t_max = found.distance;
    path.light = index;
    path.light_channels = path.throughput * scattering.value;
    path.light_weight = path.light_channels * found.weight / light.probability;
    path.pdf_ratio = if found.pdf > 0.0 { scattering.pdf / (found.pdf * light.probability) } else { 0.0 };
    path.light_medium = medium_towards(vertex, path.medium, found.direction);
    path.origin = offset_origin(path, found.direction);
    max_component(path.light_weight) > 0.0 || !path.light_weight.is_finite()
}
