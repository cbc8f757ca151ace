//! Mirror of `shaders/lib/path.glsl`: the estimator, a path as a coroutine that asks for one ray at a time. A path's
//! life is described there. What the kernel leaves out where a scene does not need it is always here.

use super::bindings::{Surface, Tables};
use super::bsdf::bsdf_has_density;
use super::camera::camera_direction;
use super::math::{exp_minus_rgb, max_component, to_frame};
use super::medium::{channel_weights, cross_boundary, scatter_weight};
use super::path_lights::{add_constant_light, add_emission, sample_light};
pub use super::path_rays::{begin_hit, test_primitive};
pub use super::path_state::{Hit, NONE, Path};
use super::path_state::{INFINITE_DISTANCE, begin_segment, flight_end, medium_at, sample_set, survived_throughput};
use super::path_vertex::{Vertex, medium_towards, offset_origin, sample_scattering, surface_point};
use super::ray::offset_distance;
use crate::pack::layout::{PRIMITIVE_BOUNDARY, SURFACE_ORIENTED, SURFACE_TWO_SIDED};
use glam::{DVec2, DVec3, Vec4Swizzles};

/// Depth at which roulette begins to end paths that lose nothing.
const RELENTLESS_DEPTH: u32 = 256;

/// A ray from the camera, and a free flight for its first segment.
pub fn path_start(tables: &Tables, pixel: u32, sample_index: u32) -> Path {
    let mut path = Path { pixel, sample_index, ..Path::default() };
    let params = &tables.params;
    let u = sample_set(tables, &path, 0);
    let (row, column) = (pixel / params.film_width, pixel % params.film_width);
    let film = (DVec2::new(f64::from(column), f64::from(row)) + u.xy())
        * DVec2::new(params.inverse_width, params.inverse_height);
    let direction = camera_direction(params.camera_corner, params.camera_right, params.camera_down, film);
    let depth_to_distance = direction.length();
    path.origin = params.camera_origin;
    path.direction = direction / depth_to_distance;
    path.t_min = params.near_clip * depth_to_distance;
    path.far_end = params.far_clip * depth_to_distance;
    path.throughput = DVec3::ONE;
    path.radiance = DVec3::ZERO;
    path.alive = true;
    path.eta_scale = 1.0;
    path.medium = params.camera_medium;
    begin_segment(tables, &mut path, u.zw());
    path
}

/// Scatters at a vertex: the shadow ray, the next direction, roulette.
fn scatter(tables: &Tables, path: &mut Path, vertex: &Vertex) {
    path.depth += 1;
    path.shadow = false;
    path.alive = path.depth < tables.features.max_depth;
    if !path.alive {
        return;
    }
    let u = sample_set(tables, path, 2 * path.segment + 1);
    let lobe = sample_set(tables, path, 2 * path.segment + 2).y;
    let next = sample_scattering(vertex, u.zw(), lobe);
    path.point = vertex.point;
    path.t_min = 0.0;
    path.last = NONE;
    path.far_end = INFINITE_DISTANCE;
    path.shadow =
        (vertex.in_medium || bsdf_has_density(&vertex.surface)) && sample_light(tables, path, vertex, u.xy(), u.z);
    path.next_direction = next.direction;
    path.next_medium = medium_towards(vertex, path.medium, next.direction);
    path.throughput *= next.weight;
    path.pdf = next.pdf;
    path.eta_scale *= next.eta * next.eta;
    path.alive = max_component(path.throughput) > 0.0;
    if !path.throughput.is_finite() {
        // The sample is lost, and must be seen to be: no comparison may drop it.
        path.radiance += path.throughput;
        path.alive = false;
    }
}

/// Begins the segment after a vertex, unless roulette ends the path.
fn next_segment(tables: &Tables, path: &mut Path) {
    path.segment += 1;
    let u = sample_set(tables, path, 2 * path.segment);
    if path.depth >= tables.features.rr_depth {
        let most = if path.depth < RELENTLESS_DEPTH { 1.0 } else { 1.0 - 2.0 / f64::from(path.depth) };
        let keep = (3.0 * max_component(path.throughput) * path.eta_scale).min(most);
        path.alive = path.alive && u.x < keep;
        path.throughput /= keep;
    }
    path.direction = path.next_direction;
    path.origin = offset_origin(path, path.direction);
    path.medium = path.next_medium;
    path.t_min = 0.0;
    begin_segment(tables, path, u.zw());
}

/// Answers a ray that extends the path.
pub fn path_advance(tables: &Tables, path: &mut Path, hit: &Hit) {
    let surface_hit = hit.primitive != NONE;
    let t = if surface_hit { hit.t } else { path.t_max };

    // The optical depth of the way through the medium since `t_min`.
    let medium = *medium_at(tables, path.medium);
    let way = t - path.t_min;
    path.tau_left -= way * medium.sigma_t[path.channel as usize];
    path.tau_rgb += medium.sigma_t * way;
    if !surface_hit && t >= path.far_end {
        add_constant_light(tables, path);
        path.alive = false;
        path.shadow = false;
        return;
    }
    if !surface_hit {
        let weight = scatter_weight(channel_weights(path.throughput), path.tau_rgb, medium.sigma_t, medium.albedo);
        let point = path.origin + path.direction * t;
        path.offset = 0.0;
        path.normal = path.direction;
        let (surface, incident) = (Surface::default(), DVec3::ZERO);
        let vertex =
            Vertex { point, axis: path.direction, in_medium: true, g: medium.g, albedo: weight, surface, incident };
        scatter(tables, path, &vertex);
    } else {
        let primitive = tables.primitive(hit.primitive);
        let surface = tables.surface_of(primitive);
        if primitive.surface & PRIMITIVE_BOUNDARY != 0 {
            let (inside, outside) = (surface.media & 0xffff, surface.media >> 16);
            let (from, to) = if hit.along_normal { (inside, outside) } else { (outside, inside) };
            path.medium = cross_boundary(path.medium, from, to);
            path.t_min = t;
            path.last = hit.primitive;
            path.tau_left = path.tau_left.max(0.0);
            path.t_max = flight_end(tables, path);
            return;
        }
        let (point, normal, largest) = surface_point(primitive, path, hit);
        add_emission(tables, path, primitive, t, normal);
        path.throughput = survived_throughput(path);
        let back = path.direction.dot(normal) > 0.0;
        if back && surface.flags & (SURFACE_TWO_SIDED | SURFACE_ORIENTED) == 0 {
            path.alive = false;
            path.shadow = false;
            return;
        }
        let axis = if back && surface.flags & SURFACE_ORIENTED == 0 { -normal } else { normal };
        path.offset = offset_distance(largest);
        path.normal = axis;
        let (surface, incident) = (*surface, to_frame(axis, -path.direction));
        scatter(
            tables,
            path,
            &Vertex { point, axis, in_medium: false, g: 0.0, albedo: DVec3::ZERO, surface, incident },
        );
    }
    if !path.shadow && path.alive {
        next_segment(tables, path);
    }
}

/// Answers a shadow ray.
pub fn path_light(tables: &Tables, path: &mut Path, hit: &Hit) {
    if !hit.blocked {
        let transmittance = exp_minus_rgb(hit.tau_rgb.max(DVec3::ZERO));
        let survives = channel_weights(path.light_channels).dot(transmittance);
        path.radiance += path.light_weight * transmittance / (1.0 + path.pdf_ratio * survives);
    }
    path.shadow = false;
    if path.alive {
        next_segment(tables, path);
    }
}
