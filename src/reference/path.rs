//! Mirror of `shaders/lib/path.glsl`: the estimator, a path as a coroutine that asks for one ray at a time. A path's
//! life is described there. What the kernel leaves out where a scene does not need it is always here.

use super::bindings::{Light, Medium, Primitive, Surface, Tables};
use super::bsdf::{BsdfSample, BsdfValue, bsdf_has_density, eval_bsdf, sample_bsdf};
use super::camera::camera_direction;
use super::light::{
    LightSample, alias_keeps, alias_line, area_pdf, sample_plane_light, sample_point_light, sample_sphere_light,
    sphere_light_pdf,
};
use super::math::{exp_minus_rgb, from_frame, max_component, minus_log_1m, to_frame};
use super::medium::{
    channel_weights, cross_boundary, free_flight, sample_channel, scatter_weight, survival_probability, survival_weight,
};
use super::phase::{eval_henyey_greenstein, sample_henyey_greenstein};
use super::ray::{Ray, TriangleHit, intersect_sphere, intersect_triangle, offset_distance};
use super::sampler::{point_index, set_key, shifted_point};
use super::warp::from_polar;
use crate::pack::layout;
use crate::pack::layout::{
    LIGHT_CONSTANT, LIGHT_POINT, LIGHT_SPHERE, PRIMITIVE_BOUNDARY, PRIMITIVE_SPHERE, SURFACE_ORIENTED,
    SURFACE_TWO_SIDED,
};
use crate::pack::sobol::SOBOL_SETS;
use glam::{DVec2, DVec3, DVec4, Vec4Swizzles};

/// Nothing, among indices.
pub const NONE: u32 = u32::MAX;
/// Longest distance; rays that end nowhere end here.
const INFINITE_DISTANCE: f64 = layout::INFINITE_DISTANCE as f64;
/// Depth at which roulette begins to end paths that lose nothing.
const RELENTLESS_DEPTH: u32 = 256;

/// A path between two rays.
#[derive(Clone, Copy, Debug, Default)]
pub struct Path {
    /// Of the whole film.
    pub pixel: u32,
    /// Of the pixel.
    pub sample_index: u32,
    /// Of the ray that is asked for.
    pub origin: DVec3,
    /// Of the ray that is asked for; unit.
    pub direction: DVec3,
    /// Where the ray begins, or the last boundary on it.
    pub t_min: f64,
    /// The free flight, or the distance to the light.
    pub t_max: f64,
    /// The boundary at `t_min`, or [`NONE`].
    pub last: u32,
    /// A shadow ray is asked for.
    pub shadow: bool,
    /// What the radiance at the path's end is multiplied with.
    pub throughput: DVec3,
    /// What the path has gathered.
    pub radiance: DVec3,
    /// Counts the random numbers' sets.
    pub segment: u32,
    /// Scattering events so far.
    pub depth: u32,
    /// Density per solid angle of `direction`; 0 for a camera ray.
    pub pdf: f64,
    /// The path goes on behind the ray that is asked for.
    pub alive: bool,
    /// Where the path is.
    pub medium: u32,
    /// Optical depth, in the chosen channel, from `t_min` to the end of the flight.
    pub tau_left: f64,
    /// Optical depth from the last event to `t_min`.
    pub tau_rgb: DVec3,
    /// The flight's.
    pub channel: u32,
    /// Where the far clip plane ends a camera ray.
    pub far_end: f64,
    /// Where the path goes on behind a shadow ray.
    pub next_direction: DVec3,
    /// What arrives if nothing is in the way.
    pub light_weight: DVec3,
    /// Density of the light's direction by scattering over that by light sampling; 0 for a point.
    pub pdf_ratio: f64,
    /// The light that the shadow ray goes to.
    pub light: u32,
    /// The throughput that scattering towards the light would have.
    pub light_channels: DVec3,
    /// The medium in which the shadow ray begins.
    pub light_medium: u32,
    /// Of the vertex.
    pub point: DVec3,
    /// Of rays that leave a surface, along its normal; 0 in a medium.
    pub offset: f64,
    /// Only valid where `offset` is not 0.
    pub normal: DVec3,
    /// The medium of the next segment.
    pub next_medium: u32,
    /// The product of squared indices that refraction divided radiance by.
    pub eta_scale: f64,
}

/// What the traversal found.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance.
    pub t: f64,
    /// [`NONE`]: nothing within `t_max`.
    pub primitive: u32,
    /// The ray goes along the normal.
    pub along_normal: bool,
    /// Of a triangle.
    pub barycentric: DVec2,
    /// Shadow rays: optical depth.
    pub tau_rgb: DVec3,
    /// Shadow rays: something is in the way.
    pub blocked: bool,
}

fn medium_at(tables: &Tables, medium: u32) -> &Medium {
    // An index that boundaries without a consistent nesting made up is vacuum.
    tables.media.get(medium as usize).unwrap_or(&tables.media[0])
}

/// Distance to the end of the flight with the extinction that holds from `t_min` on.
fn flight_end(tables: &Tables, path: &Path) -> f64 {
    let sigma = medium_at(tables, path.medium).sigma_t[path.channel as usize];
    (path.t_min + free_flight(path.tau_left, sigma)).min(path.far_end)
}

/// A new segment along `path.direction`: its flight from two random numbers.
fn begin_segment(tables: &Tables, path: &mut Path, u: DVec2) {
    path.last = NONE;
    path.shadow = false;
    path.tau_left = minus_log_1m(u.x);
    path.tau_rgb = DVec3::ZERO;
    path.channel = sample_channel(channel_weights(path.throughput), u.y);
    path.t_max = flight_end(tables, path);
}

/// The four numbers of a set.
fn sample_set(tables: &Tables, path: &Path, set: u32) -> DVec4 {
    let key = set_key(tables.params.seed, path.pixel, set, path.sample_index);
    let point =
        if set < SOBOL_SETS { tables.points[point_index(set, path.sample_index, key) as usize] } else { [0; 2] };
    shifted_point(point, key)
}

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

/// Weight of a direction found by scattering that light sampling finds with density `light_pdf`: the balance heuristic
/// (Veach and Guibas 1995).
fn scattering_mis_weight(path: &Path, survival: f64, light_pdf: f64) -> f64 {
    let found = path.pdf * survival;
    if path.pdf == 0.0 || light_pdf == 0.0 { 1.0 } else { found / (found + light_pdf) }
}

/// Probability that the flight got as far as it did.
fn survival(path: &Path) -> f64 {
    survival_probability(channel_weights(path.throughput), path.tau_rgb)
}

fn survived_throughput(path: &Path) -> DVec3 {
    path.throughput * survival_weight(channel_weights(path.throughput), path.tau_rgb)
}

fn emitters_seen(tables: &Tables, path: &Path) -> bool {
    !(tables.features.hide_emitters && path.depth == 0)
}

/// Adds the constant light to a path that leaves the scene.
fn add_constant_light(tables: &Tables, path: &mut Path) {
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
fn add_emission(tables: &Tables, path: &mut Path, primitive: &Primitive, t: f64, normal: DVec3) {
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

/// A point where light is scattered, in a medium or on a surface.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    point: DVec3,
    /// z of the surface's local frame; in a medium, the direction of propagation.
    axis: DVec3,
    in_medium: bool,
    /// Of the medium.
    g: f64,
    /// Of the medium, with the weight of the flight.
    albedo: DVec3,
    surface: Surface,
    /// On a surface: towards where the path comes from, in the local frame.
    incident: DVec3,
}

/// Scattering function times cosine, and the density with which directions are sampled.
fn eval_scattering(vertex: &Vertex, direction: DVec3) -> BsdfValue {
    if vertex.in_medium {
        let phase = eval_henyey_greenstein(vertex.g, vertex.axis, direction);
        return BsdfValue { value: vertex.albedo * phase, pdf: phase };
    }
    eval_bsdf(&vertex.surface, vertex.incident, to_frame(vertex.axis, direction))
}

fn sample_scattering(vertex: &Vertex, u: DVec2, lobe: f64) -> BsdfSample {
    if vertex.in_medium {
        let angle = sample_henyey_greenstein(vertex.g, u.x);
        let local = from_polar(angle.cos_theta, angle.sin_theta, u.y);
        // For g = 0 no axis matters; the kernel leaves the frame out where it knows no other g.
        let direction = if vertex.g == 0.0 { local } else { from_frame(vertex.axis, local) };
        let pdf = eval_scattering(vertex, direction).pdf;
        return BsdfSample { direction, weight: vertex.albedo, pdf, eta: 1.0 };
    }
    let found = sample_bsdf(&vertex.surface, vertex.incident, u, lobe);
    BsdfSample { direction: from_frame(vertex.axis, found.direction), ..found }
}

/// Where a ray in some direction begins so that it does not meet the surface it leaves.
fn offset_origin(path: &Path, direction: DVec3) -> DVec3 {
    path.point + path.normal * if path.normal.dot(direction) >= 0.0 { path.offset } else { -path.offset }
}

/// The medium on the side of a surface to which a direction goes, for a path that came in `medium`.
fn medium_towards(vertex: &Vertex, medium: u32, direction: DVec3) -> u32 {
    if vertex.in_medium || vertex.surface.flags & SURFACE_ORIENTED == 0 {
        return medium;
    }
    let outwards = vertex.axis.dot(direction) > 0.0;
    if outwards == (vertex.incident.z > 0.0) || vertex.surface.media == 0 {
        return medium;
    }
    let (inside, outside) = (vertex.surface.media & 0xffff, vertex.surface.media >> 16);
    let (from, to) = if outwards { (inside, outside) } else { (outside, inside) };
    cross_boundary(medium, from, to)
}

/// Chooses a light and a point on it, and sets up the shadow ray. Returns whether there is anything to ask for.
fn sample_light(tables: &Tables, path: &mut Path, vertex: &Vertex, mut u: DVec2, lobe: f64) -> bool {
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
            let BsdfSample { direction, pdf, .. } = sample_scattering(vertex, u, lobe);
            let weight = if pdf > 0.0 { light.radiance / pdf } else { DVec3::ZERO };
            LightSample { direction, distance: INFINITE_DISTANCE, weight, pdf }
        }
        LIGHT_POINT => sample_point_light(light, vertex.point),
        LIGHT_SPHERE => sample_sphere_light(light, vertex.point, u),
        _ => sample_plane_light(light, vertex.point, u),
    };
    let scattering = eval_scattering(vertex, found.direction);
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
        let most = if path.depth < RELENTLESS_DEPTH { 1.0 } else { 0.95 };
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

/// A point on a primitive, its unit normal, and the largest coordinate that went into it.
fn surface_point(primitive: &Primitive, path: &Path, hit: &Hit) -> (DVec3, DVec3, f64) {
    let Primitive { a, b, c, .. } = *primitive;
    if primitive.surface & PRIMITIVE_SPHERE != 0 {
        let outwards = (path.origin + path.direction * hit.t - a).normalize();
        return (a + outwards * b.x, outwards * b.y, max_component(a.abs()) + b.x);
    }
    let (edge_1, edge_2) = (b - a, c - a);
    let point = a + edge_1 * hit.barycentric.x + edge_2 * hit.barycentric.y;
    (point, edge_1.cross(edge_2).normalize(), max_component(a.abs().max(b.abs().max(c.abs()))))
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

/// The length L of a shadow ray in its optical depth σ₀ L + Σ (σ after − σ before) (L − t). Where an infinite ray ends in
/// vacuum, σ₀ and the steps add up to 0 and any L serves.
fn shadow_length(path: &Path) -> f64 {
    if path.t_max >= INFINITE_DISTANCE { 0.0 } else { path.t_max }
}

/// An infinite ray that ends in a medium brings no light.
fn depth_at_infinity(tables: &Tables, path: &Path) -> DVec3 {
    if path.t_max < INFINITE_DISTANCE {
        return DVec3::ZERO;
    }
    DVec3::select(tables.params.world_sigma_t.cmpgt(DVec3::ZERO), DVec3::splat(INFINITE_DISTANCE), DVec3::ZERO)
}

/// The state of a traversal before its first step.
pub fn begin_hit(tables: &Tables, path: &Path) -> Hit {
    let mut hit = Hit {
        t: path.t_max,
        primitive: NONE,
        along_normal: false,
        barycentric: DVec2::ZERO,
        tau_rgb: DVec3::ZERO,
        blocked: false,
    };
    if path.shadow {
        hit.tau_rgb =
            medium_at(tables, path.light_medium).sigma_t * shadow_length(path) + depth_at_infinity(tables, path);
    }
    hit
}

/// One crossing of a ray with a primitive.
struct Crossing {
    t: f64,
    along_normal: bool,
    barycentric: DVec2,
}

/// Takes one crossing with a primitive into account.
fn record(tables: &Tables, path: &Path, index: u32, crossing: Crossing, hit: &mut Hit) {
    let primitive = tables.primitive(index);
    let Crossing { t, along_normal, barycentric } = crossing;
    // Distances first, the primitive's index among equals: surfaces that coincide are met one after the other, none
    // twice.
    let begins = t > path.t_min || (t == path.t_min && index > path.last && path.last != NONE);
    if path.shadow {
        let boundary = primitive.surface & PRIMITIVE_BOUNDARY != 0;
        let counts = begins && t < path.t_max;
        if counts && boundary {
            let way = (shadow_length(path) - t) * if along_normal { -1.0 } else { 1.0 };
            hit.tau_rgb += tables.surface_of(primitive).sigma_t_step * way;
        }
        // The light itself is not in the way of its light.
        hit.blocked |= counts && !boundary && primitive.light != path.light + 1;
    } else if begins && (t < hit.t || (t == hit.t && index < hit.primitive && hit.primitive != NONE)) {
        hit.t = t;
        hit.primitive = index;
        hit.along_normal = along_normal;
        hit.barycentric = barycentric;
    }
}

/// Tests one primitive.
pub fn test_primitive(tables: &Tables, path: &Path, ray: &Ray, index: u32, hit: &mut Hit) {
    let primitive = tables.primitive(index);
    if primitive.surface & PRIMITIVE_SPHERE != 0 {
        let t = intersect_sphere(ray, primitive.a, primitive.b.x);
        // A ray that touches the sphere in one point does not cross it.
        if t.x < t.y {
            let outwards = primitive.b.y > 0.0;
            let near = Crossing { t: t.x, along_normal: !outwards, barycentric: DVec2::ZERO };
            let far = Crossing { t: t.y, along_normal: outwards, barycentric: DVec2::ZERO };
            record(tables, path, index, near, hit);
            record(tables, path, index, far, hit);
        }
    } else {
        let found = intersect_triangle(ray, primitive.a, primitive.b, primitive.c);
        if found.hit {
            let TriangleHit { t, along_normal, barycentric, .. } = found;
            record(tables, path, index, Crossing { t, along_normal, barycentric }, hit);
        }
    }
}
