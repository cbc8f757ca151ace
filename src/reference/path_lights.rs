//! Mirror of `shaders/lib/path_lights.glsl`: how a path comes to light, by chance or by light sampling.

use super::bindings::{Light, Medium, Primitive, Tables, Texture};
use super::bsdf::{BsdfSample, BsdfValue, reflect_z};
use super::grid::{clip_to_grid, grid_local, grid_value};
use super::light::{
    LightSample, area_pdf, plane_light_in, rectangle_light_pdf, sample_directional_light, sample_plane_light,
    sample_point_light, sample_rectangle_light, sample_sphere_light, sample_spot_light, sample_volume_light,
    sphere_light_in, sphere_light_pdf, volume_light_pdf,
};
use super::math::max_component;
use super::medium::{channel_weights, emitting_length, emitting_length_rgb, survival_weight};
use super::path_aim::{Aim, aimed_pdf, weighing_pdf};
use super::path_state::{
    EMISSION_SETS, INFINITE_DISTANCE, Path, choose_light, sample_set, survival, survived_throughput,
};
use super::path_vertex::{
    Vertex, eval_scattering, from_surface_frame, medium_towards, offset_origin, sample_scattering, sides_agree,
};
use super::sky::{SKY_STEPS, SkySample, sample_sky, sky_pdf, sky_radiance, sky_uv};
use super::texture::eval_texture;
use crate::pack::layout::{
    LIGHT_CONSTANT, LIGHT_DIRECTIONAL, LIGHT_ENVMAP, LIGHT_POINT, LIGHT_QUAD, LIGHT_RECTANGLE, LIGHT_SPHERE,
    LIGHT_SPOT, LIGHT_TEXTURE_SHIFT, LIGHT_TRIANGLE, LIGHT_VOLUME, MEDIUM_EMISSION_GRID,
};
use glam::{DVec2, DVec3};

/// Weight of what one way to the light finds, if another finds it with `ratio` times its density: the power heuristic with the
/// exponent 2 (Veach and Guibas 1995). Light sampling alone has little variance, so what scattering finds by chance must count for
/// little beside it.
pub fn power_heuristic(ratio: f64) -> f64 {
    1.0 / (1.0 + ratio * ratio)
}

/// Weight of a direction found by scattering that light sampling finds with density `light_pdf`. Scattering finds the light only if the
/// flight survives, so its probability to do so is part of the density.
pub fn scattering_mis_weight(tables: &Tables, path: &Path, survival: f64, light_pdf: f64) -> f64 {
    let found = if tables.features.mis { path.pdf.abs() * survival } else { 0.0 };
    if path.pdf == 0.0 || light_pdf == 0.0 {
        return 1.0;
    }
    if found > light_pdf { power_heuristic(light_pdf / found) } else { 1.0 - power_heuristic(found / light_pdf) }
}

/// The same where the density is that of light sampling, or of a guide: of directions that glass bends since, it alone is known. A probe
/// has what is left.
fn emission_weight(tables: &Tables, path: &Path, light_pdf: f64) -> f64 {
    let known = if path.guide_pdf > 0.0 { path.guide_pdf } else { light_pdf };
    let weight = scattering_mis_weight(tables, path, survival(tables, path), known);
    if path.probe { 1.0 - weight } else { weight }
}

/// Whether light that arrives by chance counts.
pub fn emitters_seen(tables: &Tables, path: &Path) -> bool {
    !(tables.features.hide_emitters && path.depth == 0)
}

/// The texture of an environment map.
pub fn envmap<'a>(tables: &'a Tables, light: &Light) -> Option<&'a Texture> {
    let is_envmap = light.kind & ((1 << LIGHT_TEXTURE_SHIFT) - 1) == LIGHT_ENVMAP;
    is_envmap.then(|| &tables.textures[(light.kind >> LIGHT_TEXTURE_SHIFT) as usize])
}

/// A direction in the axes of an environment map.
pub fn to_envmap(light: &Light, direction: DVec3) -> DVec3 {
    DVec3::new(light.edge_1.dot(direction), light.edge_2.dot(direction), light.normal.dot(direction))
}

/// A direction from the axes of an environment map.
pub fn from_envmap(light: &Light, direction: DVec3) -> DVec3 {
    (light.edge_1 * direction.x + light.edge_2 * direction.y + light.normal * direction.z).normalize()
}

/// Adds what comes from all directions of the sky to a path that leaves the scene.
pub fn add_sky(tables: &Tables, path: &mut Path) {
    if !emitters_seen(tables, path) {
        return;
    }
    for light in &tables.lights[tables.params.first_sky as usize..] {
        let (radiance, pdf) = match envmap(tables, light) {
            Some(sky) => {
                let direction = to_envmap(light, path.direction);
                let uv = sky_uv(direction);
                (sky_radiance(&tables.values, sky, uv), sky_pdf(&tables.values, sky, uv.x, direction.y))
            }
            // Light sampling takes the constant light's directions from the same scattering function (see `sample_light`).
            None => (light.radiance, path.scattered_pdf),
        };
        let known = tables.features.light_sampling && path.pdf >= 0.0;
        let light_pdf = if known { light.probability * pdf } else { 0.0 };
        path.radiance += survived_throughput(path) * radiance * emission_weight(tables, path, light_pdf);
    }
}

/// The colour of the texture in front of a light, for light in a direction from a point on it.
pub fn slide_color(tables: &Tables, light: &Light, point: DVec3, direction: DVec3) -> DVec3 {
    if light.texture == 0 {
        return DVec3::ONE;
    }
    let place = if light.kind == LIGHT_SPOT {
        DVec2::new(direction.dot(light.edge_2), direction.dot(light.slide_y)) / direction.dot(light.normal)
    } else {
        // The coordinates along the edges, which need not be perpendicular.
        let (across, offset) = (light.edge_1.cross(light.edge_2), point - light.origin);
        let (s, t) = (offset.cross(light.edge_2).dot(across), light.edge_1.cross(offset).dot(across));
        DVec2::new(s, t) / across.length_squared()
    };
    eval_texture(&tables.textures[light.texture as usize - 1], &tables.values, place)
}

/// Whether what a camera ray finds of lamps is left to other rays ([`crate::seen`]).
fn seen_apart(tables: &Tables, pixel: u32) -> bool {
    let params = &tables.params;
    let (row, column) = (pixel / params.film_width - params.crop_y, pixel % params.film_width - params.crop_x);
    tables.values[(params.first_seen + row * params.crop_width + column) as usize] > 0.0
}

/// Adds what a primitive emits towards the path.
pub fn add_emission(tables: &Tables, path: &mut Path, primitive: &Primitive, t: f64, normal: DVec3) {
    let cos_light = -path.direction.dot(normal);
    if primitive.light == 0 || cos_light <= 0.0 || !emitters_seen(tables, path) {
        return;
    }
    if tables.features.seen && path.depth == 0 && seen_apart(tables, path.pixel) {
        return;
    }
    let light: &Light = &tables.lights[primitive.light as usize - 1];
    let pdf = match light.kind {
        LIGHT_SPHERE => sphere_light_pdf(light.edge_1.x, path.origin.distance(light.origin)),
        // Of the vertex itself, as light sampling has it: near the light the offset of the ray's origin counts.
        LIGHT_RECTANGLE => rectangle_light_pdf(light, path.point, t, cos_light),
        _ => area_pdf(light.area, t, cos_light),
    };
    // In a mirror's direction the choice of the light alone counts.
    let pdf = if path.pdf < 0.0 { 1.0 } else { pdf };
    let light_pdf = if tables.features.light_sampling { light.probability * pdf } else { 0.0 };
    let weight = emission_weight(tables, path, light_pdf);
    let radiance = light.radiance * slide_color(tables, light, path.origin + path.direction * t, -path.direction);
    path.radiance += survived_throughput(path) * radiance * weight;
}

/// Adds what voxels emit along the flight through a homogeneous medium: one point stands for the way through them.
fn add_field_emission(tables: &Tables, path: &mut Path, medium: &Medium, way: f64) {
    let grid = &tables.grids[(medium.grids & 0xff_ffff) as usize + 1];
    let clipped = clip_to_grid(grid, path.origin, path.direction, path.t_min, path.t_min + way);
    if clipped.x >= clipped.y {
        return;
    }
    let u = sample_set(tables, path, EMISSION_SETS + path.segment).x;
    let t = clipped.x + u * (clipped.y - clipped.x);
    let local = grid_local(grid, path.origin + path.direction * t);
    let emitted = medium.emission * grid_value(&tables.values, grid, local) * (clipped.y - clipped.x);
    let survived = survival_weight(channel_weights(path.throughput), path.tau_rgb + medium.sigma_t * (t - path.t_min));
    path.radiance += path.throughput * emitted * survived;
}

/// Adds what a medium emits along the flight through it, from `t_min` on.
pub fn add_medium_emission(tables: &Tables, path: &mut Path, medium: &Medium, way: f64, ended: bool) {
    if max_component(medium.emission) == 0.0 || !emitters_seen(tables, path) {
        return;
    }
    if medium.grids & MEDIUM_EMISSION_GRID != 0 {
        add_field_emission(tables, path, medium, way);
        return;
    }
    let (share, sigma_t) = (medium.collision_share, medium.sigma_t);
    let length = if tables.features.chromatic {
        let u = sample_set(tables, path, EMISSION_SETS + path.segment).x;
        let weights = channel_weights(path.throughput);
        emitting_length_rgb(share, weights, path.tau_rgb, sigma_t, way, ended, u)
    } else {
        DVec3::splat(emitting_length(share, sigma_t.x, way, ended))
    };
    let mut mis_weight = 1.0;
    if tables.features.light_sampling && medium.light != 0 {
        // Of the direction alone: whatever lies on the way, light sampling has the same density for all of its points.
        let light = &tables.lights[medium.light as usize - 1];
        let pdf = if path.pdf < 0.0 { 0.0 } else { volume_light_pdf(light, path.origin, path.direction) };
        let light_pdf = light.probability * pdf;
        mis_weight = scattering_mis_weight(tables, path, 1.0, light_pdf);
    }
    path.radiance += path.throughput * medium.emission * length * mis_weight;
}

/// What a lamp sends to a vertex from exactly this direction, if it is of a kind that has a surface.
fn lamp_in(tables: &Tables, light: &Light, point: DVec3, direction: DVec3) -> LightSample {
    let mut found = match light.kind {
        LIGHT_SPHERE => sphere_light_in(light, point, direction),
        LIGHT_TRIANGLE | LIGHT_QUAD | LIGHT_RECTANGLE => plane_light_in(light, point, direction),
        _ => LightSample { direction, distance: 0.0, weight: DVec3::ZERO, pdf: 0.0 },
    };
    if light.texture != 0 && max_component(found.weight) > 0.0 {
        found.weight *= slide_color(tables, light, point + direction * found.distance, -direction);
    }
    found
}

/// Sets up a shadow ray to a lamp that a surface mirrors ([`super::bsdf::mirrored`]). Returns whether there is anything to ask for.
pub fn sample_mirrored(tables: &Tables, path: &mut Path, vertex: &Vertex, mirror: &BsdfValue, mut u: f64) -> bool {
    let index = choose_light(tables, &mut u);
    let light = &tables.lights[index as usize];
    path.direction = from_surface_frame(vertex.tangent, vertex.axis, reflect_z(vertex.incident));
    let found = lamp_in(tables, light, vertex.point, path.direction);
    path.t_max = found.distance;
    path.light = index;
    path.light_channels = path.throughput * mirror.value;
    path.light_weight = path.light_channels * found.weight / light.probability;
    path.pdf_ratio = if tables.features.mis { mirror.pdf / light.probability } else { 0.0 };
    path.light_medium = path.medium;
    path.origin = offset_origin(path, path.direction);
    let arrives = max_component(path.light_weight) > 0.0 || !path.light_weight.is_finite();
    sides_agree(vertex, vertex.incident.z, path.direction) && arrives
}

/// Chooses a light and a point on it by `u`, and where a sampler has more to decide, by `decision`, and sets up the shadow ray. Returns whether there is anything to ask for.
pub fn sample_light(
    tables: &Tables,
    path: &mut Path,
    vertex: &Vertex,
    aim: &Aim,
    mut u: DVec2,
    decision: DVec2,
) -> bool {
    if !tables.features.light_sampling {
        return false;
    }
    let index = choose_light(tables, &mut u.x);
    let light = &tables.lights[index as usize];
    let found = match light.kind {
        LIGHT_CONSTANT => {
            // No direction is better than another, so the scattering function samples them; what light sampling adds is
            // the transmittance, exact instead of 0 or 1.
            let BsdfSample { direction, pdf, .. } = sample_scattering(tables, vertex, u, decision.x);
            let weight = if pdf > 0.0 { light.radiance / pdf } else { DVec3::ZERO };
            LightSample { direction, distance: INFINITE_DISTANCE, weight, pdf: weighing_pdf(path, vertex, pdf) }
        }
        LIGHT_VOLUME => {
            let u_distance = sample_set(tables, path, EMISSION_SETS + path.segment).y;
            sample_volume_light(light, vertex.point, u, u_distance)
        }
        LIGHT_POINT => sample_point_light(light, vertex.point),
        LIGHT_SPOT => sample_spot_light(light, vertex.point),
        LIGHT_DIRECTIONAL => sample_directional_light(light),
        LIGHT_SPHERE => sample_sphere_light(light, vertex.point, u),
        LIGHT_RECTANGLE => sample_rectangle_light(light, vertex.point, u),
        _ => match envmap(tables, light) {
            Some(sky) => {
                // With the digits that went into the choice of the light.
                let lost = if tables.lights.len() > 1 { decision.x / (SKY_STEPS * light.probability) } else { 0.0 };
                let SkySample { direction, radiance, pdf } = sample_sky(&tables.values, sky, u + DVec2::new(lost, 0.0));
                let direction = from_envmap(light, direction);
                LightSample { direction, distance: INFINITE_DISTANCE, weight: radiance / pdf, pdf }
            }
            None => sample_plane_light(light, vertex.point, u),
        },
    };
    let lit = vertex.point + found.direction * found.distance;
    // Where nothing arrives, there need be no point.
    let arrives = light.texture != 0 && max_component(found.weight) > 0.0;
    let color = if arrives { slide_color(tables, light, lit, -found.direction) } else { DVec3::ONE };
    let weight = found.weight * color;
    let scattering = eval_scattering(tables, vertex, found.direction);
    path.direction = found.direction;
    path.t_max = found.distance;
    path.light = index;
    path.light_channels = path.throughput * scattering.value;
    path.light_weight = path.light_channels * weight / light.probability;
    let pdf = aimed_pdf(aim, weighing_pdf(path, vertex, scattering.pdf), found.direction);
    path.pdf_ratio = if tables.features.mis && found.pdf > 0.0 { pdf / (found.pdf * light.probability) } else { 0.0 };
    path.light_medium = medium_towards(tables, vertex, path.medium, found.direction);
    path.origin = offset_origin(path, found.direction);
    max_component(path.light_weight) > 0.0 || !path.light_weight.is_finite()
}
