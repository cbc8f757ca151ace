//! Mirror of `shaders/lib/path.glsl`: the estimator, a path as a coroutine that asks for one ray at a time. A path's
//! life is described there. What the kernel leaves out where a scene does not need it is always here.

use super::bindings::{Medium, Params, Surface, Tables};
use super::bsdf::{BsdfValue, bsdf_has_density, is_smooth_glass, mirrored};
use super::camera::{camera_direction, focused_direction, lens_point};
use super::film::{group_offset, group_size};
use super::filter::sample_filter;
use super::guide::{Guide, guide_pdf};
use super::math::{exp_minus_rgb, max_component, minus_log_1m, orthonormal_frame};
use super::medium::{channel_weights, sample_channel};
use super::outlook::{Outlook, keep_by_outlook, outlook_cell};
use super::path_aim::{Pivot, aimed_pdf, find_aim, find_pivot, is_common, sample_next, weighing_pdf};
use super::path_flight::{
    FlightEnd, albedo_factor, end_dense_flight, end_flight, end_mean_flight, end_voxel_flight, flight_point,
    flight_side, free_way, rare_collision_weight, rare_passage_weight,
};
use super::path_lights::{
    add_emission, add_medium_emission, add_sky, emitters_seen, power_heuristic, sample_light, sample_mirrored,
};
use super::path_open::{mean_passage, open_factor};
use super::path_probe::{end_probe, find_guide, goes_through, passing_probability, refract_probe, send_probe};
pub use super::path_rays::{begin_hit, test_primitive};
use super::path_shadow::{advance_shadow, cross_surface};
use super::path_share::{share_aim, share_ended, share_light, share_vertex, sharer_number};
pub use super::path_state::{Hit, NONE, Path};
use super::path_state::{
    INFINITE_DISTANCE, begin_segment, medium_at, open_flight_of, sample_camera, sample_lens, sample_set, survival,
    survived_throughput, vertex_numbers,
};
use super::path_surface::{
    Place, apply_textures, opacity_at, pane_depth, shading_normal, share_at, surface_tangent, turn_frame,
};
use super::path_vertex::{Vertex, medium_towards, offset_origin, sides_agree, surface_point, to_surface_frame};
use super::ray::offset_distance;
use crate::pack::layout::{
    LIGHT_VOLUME, MEDIUM_DENSITY, MEDIUM_SEALED, MEDIUM_VOXELS, PRIMITIVE_BOUNDARY, PRIMITIVE_SPHERE, SURFACE_INVERTED,
    SURFACE_MASK, SURFACE_ORIENTED, SURFACE_PANE, SURFACE_SIDES, SURFACE_SMOOTH, SURFACE_TWO_SIDED,
};
use glam::{DVec2, DVec3, UVec2, Vec4Swizzles};

/// Depth at which roulette begins to end paths that lose nothing.
const RELENTLESS_DEPTH: u32 = 256;
/// The sets of random numbers by which light meets masks or passes them begin here.
const MASK_SETS: u32 = 0x8000_0000;
/// The sets by which one of several BSDFs of a surface is chosen, one for each segment.
const BLEND_SETS: u32 = 0xc000_0000;

/// Where a sample of the pixel with the given upper left corner lies on the film, in pixels, and its factor by the filter.
fn filtered_place(tables: &Tables, path: &mut Path, corner: DVec2, u: DVec2) -> DVec2 {
    path.filter_weight = 1.0;
    let Params { sample_area_begin, sample_area_end, first_filter_value, filter_cells, filter_radius, .. } =
        tables.params;
    if filter_cells == 0 {
        return corner + u;
    }
    let center = corner + 0.5;
    let (low, high) = (sample_area_begin - center, sample_area_end - center);
    let values = &tables.values[first_filter_value as usize..];
    let x = sample_filter(values, filter_cells, filter_radius, DVec2::new(low.x, high.x), u.x);
    let y = sample_filter(values, filter_cells, filter_radius, DVec2::new(low.y, high.y), u.y);
    path.filter_weight = x.weight * y.weight;
    center + DVec2::new(x.offset, y.offset)
}

/// A ray from the camera, and a free flight for its first segment.
pub fn path_start(tables: &Tables, pixel: u32, sample_index: u32) -> Path {
    let mut path = Path { pixel, sample_index, ..Path::default() };
    let params = &tables.params;
    let (row, column) = (pixel / params.film_width, pixel % params.film_width);
    if tables.features.sharers > 0 {
        let [dx, dy] = group_offset(tables.features.sharers, sample_index);
        let [columns, rows] = group_size(tables.features.sharers);
        let place = [column - params.crop_x + dx, row - params.crop_y + dy];
        path.group = place[1] / rows * params.film_width + place[0] / columns;
        path.member = sharer_number(place, tables.features.sharers);
    }
    let u = sample_camera(tables, &path);
    let corner = DVec2::new(f64::from(column), f64::from(row));
    let place = filtered_place(tables, &mut path, corner, u.xy());
    let film = place * DVec2::new(params.inverse_width, params.inverse_height);
    let mut direction = camera_direction(params.camera_corner, params.camera_right, params.camera_down, film);
    path.origin = params.camera_origin;
    if tables.features.orthographic {
        path.origin += direction;
        direction = params.lens_u;
    } else if tables.features.lens {
        let point = lens_point(params.lens_u, params.lens_v, sample_lens(tables, &path).xy());
        path.origin += point;
        direction = focused_direction(direction, point, params.inverse_focus);
    }
    let depth_to_distance = direction.length();
    path.direction = direction / depth_to_distance;
    path.t_min = params.near_clip * depth_to_distance;
    path.far_end = params.far_clip * depth_to_distance;
    path.throughput = DVec3::ONE;
    path.before = DVec3::ONE;
    path.radiance = DVec3::ZERO;
    path.alive = true;
    path.eta_scale = 1.0;
    if tables.features.pilot {
        let block = UVec2::new(column - params.crop_x, row - params.crop_y) / params.block_side;
        let first = params.first_block + 4 * (block.y * params.block_columns + block.x);
        path.focus = three_values(tables, first);
    }
    path.left = NONE;
    path.medium = params.camera_medium;
    begin_segment(tables, &mut path, u.zw());
    path
}

/// Three numbers of the table.
fn three_values(tables: &Tables, first: u32) -> DVec3 {
    let first = first as usize;
    DVec3::from([0, 1, 2].map(|k| f64::from(tables.values[first + k])))
}

/// Roulette at a vertex, by what the pilot expects of the rest of the path. Returns whether the path goes on.
fn goes_on(tables: &Tables, path: &mut Path, vertex: &Vertex) -> bool {
    let params = &tables.params;
    let place = (vertex.point - params.pilot_origin) * params.pilot_scale;
    let first = params.first_cell + 8 * outlook_cell(place, vertex.in_medium, vertex.axis);
    let outlook = Outlook { mean: three_values(tables, first), worth: three_values(tables, first + 3) };
    path.foreseen = outlook.worth.x >= 0.0;
    let throughput = arriving_throughput(path, vertex);
    let keep = if path.foreseen { keep_by_outlook(&outlook, throughput * path.before, path.focus) } else { 1.0 };
    let set = if path.segment == 1 && tables.features.rr_depth > 1 { 2 } else { 2 * path.segment + 2 };
    path.alive = sample_set(tables, path, set).x < keep;
    path.radiance += throughput * outlook.mean * if path.alive { 1.0 - 1.0 / keep } else { 1.0 };
    path.throughput /= keep;
    path.alive
}

/// What the radiance that scatters at a vertex is multiplied with.
pub fn arriving_throughput(path: &Path, vertex: &Vertex) -> DVec3 {
    if vertex.in_medium { path.throughput * vertex.albedo } else { path.throughput }
}

/// Scatters at a vertex: the shadow ray and the next direction.
fn scatter(tables: &Tables, path: &mut Path, vertex: &Vertex) {
    path.depth += 1;
    path.shadow = false;
    path.alive = path.depth < tables.features.max_depth;
    if !path.alive {
        return;
    }
    let u = vertex_numbers(tables, path, path.segment);
    let lobe = sample_set(tables, path, 2 * path.segment + 2).y;
    let pivot = if tables.features.equiangular { find_pivot(tables, path, path.segment + 1) } else { Pivot::default() };
    let aim = find_aim(tables, path, vertex, &pivot);
    let (mut next, scattered) = sample_next(tables, vertex, &aim, u.zw(), lobe);
    share_aim(path, vertex, &pivot, &aim, &mut next, scattered);
    path.scattered_pdf = weighing_pdf(path, vertex, scattered);
    let pdf = if is_common(path, vertex) { aimed_pdf(&aim, path.scattered_pdf, next.direction) } else { next.pdf };
    path.point = vertex.point;
    path.t_min = 0.0;
    path.last = NONE;
    path.far_end = INFINITE_DISTANCE;
    let enclosed = medium_at(tables, path.medium).grids & MEDIUM_SEALED != 0;
    let opaque = tables.features.guides && vertex.surface.flags & SURFACE_ORIENTED == 0;
    let sealed = enclosed && (vertex.in_medium || opaque);
    let samples_light = !sealed && (vertex.in_medium || bsdf_has_density(&vertex.surface));
    let looks = tables.features.light_sampling && !vertex.in_medium;
    let mirror = if looks { mirrored(&vertex.surface, vertex.incident) } else { BsdfValue::default() };
    let mut pdf = pdf;
    if mirror.pdf > 0.0 {
        path.shadow = sample_mirrored(tables, path, vertex, &mirror, u.x);
        pdf = if goes_through(vertex, next.direction) { 0.0 } else { -mirror.pdf };
    } else {
        path.shadow = samples_light && sample_light(tables, path, vertex, &aim, u.xy(), u.zw());
    }
    path.next_direction = next.direction;
    path.next_medium = medium_towards(tables, vertex, path.medium, next.direction);
    if tables.features.grids && path.shadow {
        path.medium = path.light_medium;
        path.tau_rgb = DVec3::ZERO;
        path.tau_mean = DVec3::ZERO;
        path.light_passes = DVec3::ONE;
        path.passed = 1.0;
        path.collisions = 0;
    }
    let arriving = path.throughput;
    path.throughput *= next.weight;
    let guided = tables.features.guides && sealed;
    let guide = if guided { find_guide(tables, vertex.point) } else { Guide::default() };
    let passing = !vertex.in_medium && is_smooth_glass(&vertex.surface) && goes_through(vertex, next.direction);
    let bends = path.guide_pdf > 0.0 && passing;
    let pdf = if bends { path.pdf * passing_probability(vertex) } else { pdf };
    if guide.chance > 0.0 {
        path.guide_pdf = guide_pdf(&guide, next.direction);
    } else if !bends {
        path.guide_pdf = 0.0;
    }
    path.pdf = if sealed && path.guide_pdf == 0.0 { 0.0 } else { pdf };
    path.eta_scale *= next.eta * next.eta;
    path.alive = max_component(path.throughput) > 0.0;
    if !path.throughput.is_finite() {
        // The sample is lost, and must be seen to be: no comparison may drop it.
        path.radiance += path.throughput;
        path.alive = false;
    }
    if path.alive && u.x < guide.chance {
        send_probe(tables, path, vertex, &guide, arriving, DVec2::new(u.x / guide.chance, u.y));
    }
}

/// Begins the segment after a vertex, unless roulette ends the path.
fn next_segment(tables: &Tables, path: &mut Path) {
    path.segment += 1;
    let u = sample_set(tables, path, 2 * path.segment);
    // A path whose second vertex is shared gets there.
    if path.depth >= tables.features.rr_depth && !(tables.features.sharers > 0 && path.depth < 2) {
        let most = if path.depth < RELENTLESS_DEPTH { 1.0 } else { 1.0 - 2.0 / f64::from(path.depth) };
        let worth = 3.0 * max_component(path.throughput * path.before) * path.eta_scale;
        let keep = if path.foreseen { most } else { worth.min(most) };
        path.alive = path.alive && u.x < keep;
        path.throughput /= keep;
    }
    path.direction = path.next_direction;
    path.origin = offset_origin(path, path.direction);
    path.medium = path.next_medium;
    path.t_min = 0.0;
    begin_segment(tables, path, u.zw());
}

/// Whether light passes a mask. The choice has the probabilities of the two ways, so the throughput stays.
fn passes_mask(tables: &Tables, path: &mut Path, surface: &Surface, place: &Place) -> bool {
    let opacity = opacity_at(tables, surface, place, path.direction);
    let u = sample_set(tables, path, MASK_SETS + path.crossings).z; // the sets are those of emission as well, which takes the first
    path.crossings += 1;
    path.passed *= 1.0 - opacity;
    u >= opacity
}

/// Goes on behind a coloured pane, or a stretch of a medium that only absorbs. What it takes is an optical depth of the flight; but no
/// flight ends there. Instead the channel is chosen anew by what is left of each, and the throughput loses what all of them lose together.
fn pass_absorbing(tables: &Tables, path: &mut Path, depth: DVec3) {
    if max_component(depth) == 0.0 {
        return;
    }
    let weights = channel_weights(path.throughput);
    let before = weights.dot(exp_minus_rgb(path.tau_rgb));
    path.tau_rgb += depth;
    path.tau_mean += depth;
    let left = weights * exp_minus_rgb(path.tau_rgb);
    let sum = left.element_sum();
    if sum == 0.0 {
        path.alive = false;
        return;
    }
    let passes = sum / before;
    path.throughput *= passes;
    path.absorbed *= passes;
    path.channel = sample_channel(left / sum, sample_set(tables, path, MASK_SETS + path.crossings).w);
    path.crossings += 1;
}

/// The end of the medium in which an open flight began, after `way`. From here on it is a free flight.
fn leave_open_flight(tables: &Tables, path: &mut Path, medium: &Medium, way: f64) {
    let tau = medium.sigma_t * way;
    let passage = mean_passage(channel_weights(path.throughput), tau);
    path.throughput /= open_factor(&open_flight_of(path, medium), way, false, passage);
    path.open = false;
    let u = sample_set(tables, path, MASK_SETS + path.crossings);
    path.crossings += 1;
    path.tau_left = minus_log_1m(u.z);
    if passage > 0.0 {
        path.throughput *= exp_minus_rgb(tau) / passage;
        path.pdf *= passage;
        path.tau_rgb = DVec3::ZERO;
        path.channel = sample_channel(channel_weights(path.throughput), u.w);
    }
}

/// The one of the BSDFs of a surface that acts at this vertex: by the side, or by chance.
fn chosen_surface<'a>(
    tables: &'a Tables,
    path: &Path,
    mut surface: &'a Surface,
    place: &Place,
    back: bool,
) -> &'a Surface {
    let mut u = sample_set(tables, path, BLEND_SETS + path.segment).x;
    while surface.other != 0 {
        let mut taken = back != (surface.flags & SURFACE_INVERTED != 0);
        if surface.flags & SURFACE_SIDES == 0 {
            let share = share_at(tables, surface, place);
            taken = u < share;
            // What is left of the number is uniform again.
            u = if taken { (u / share).min(1.0 - 0.5f64.powi(24)) } else { u };
        }
        if !taken {
            break;
        }
        surface = &tables.surfaces[surface.other as usize - 1];
    }
    surface
}

/// What a ray that extends the path meets: a vertex that scatters, or else the path ends, or goes on along the same ray.
fn meet(tables: &Tables, path: &mut Path, hit: &Hit) -> Option<Vertex> {
    let surface_hit = hit.primitive != NONE && hit.t < path.t_max;
    let t = if surface_hit { hit.t } else { path.t_max };

    let medium = *medium_at(tables, path.medium);
    let voxels = medium.grids & MEDIUM_VOXELS != 0;
    let end = if path.probe {
        let way = t - path.t_min;
        FlightEnd { scatters: false, way, weight: DVec3::ONE, dense: way }
    } else if voxels && path.sharing == 1 && path.depth == 1 {
        end_mean_flight(tables, path, &medium, t)
    } else if voxels {
        let shines = emitters_seen(tables, path);
        end_voxel_flight(tables, path, &medium, t, shines)
    } else if medium.grids & MEDIUM_DENSITY != 0 {
        end_dense_flight(tables, path, &medium, t)
    } else {
        end_flight(tables, path, &medium, t, surface_hit)
    };
    if !voxels {
        let flown = if end.scatters { free_way(path, &medium) } else { t - path.t_min };
        add_medium_emission(tables, path, &medium, flown, end.scatters);
    }
    if end.scatters {
        let point = flight_point(tables, path, flight_side(path, hit, end.way), end.way);
        path.offset = 0.0;
        path.normal = path.direction;
        path.left = NONE;
        let (axis, surface, incident) = (path.direction, Surface::default(), DVec3::ZERO);
        let Medium { g, phase, .. } = medium;
        let (tangent, normal) = (DVec3::ZERO, path.direction);
        let albedo = end.weight * albedo_factor(tables, &medium, point);
        path.absorbed *= rare_collision_weight(&medium, end.way);
        let (in_medium, base, fade) = (true, axis, 0.0);
        return Some(Vertex {
            point,
            axis,
            in_medium,
            g,
            phase,
            albedo,
            surface,
            incident,
            tangent,
            normal,
            base,
            fade,
        });
    }
    // The optical depth of the way through the medium since `t_min`.
    if medium.flight_share == 0.0 && tables.features.chromatic && !path.probe {
        pass_absorbing(tables, path, medium.sigma_t * end.dense);
        if !path.alive {
            return None;
        }
    } else {
        path.tau_left -= end.dense * medium.flight_share * medium.sigma_t[path.channel as usize];
        if medium.flight_share < 1.0 && !path.probe {
            let left = rare_passage_weight(&medium, end.dense);
            path.throughput *= left;
            path.absorbed *= left;
        }
        path.tau_rgb += medium.sigma_t * end.dense;
        path.tau_mean += medium.sigma_t * end.dense;
        if path.open {
            leave_open_flight(tables, path, &medium, end.way);
        }
    }
    if !surface_hit {
        add_sky(tables, path);
        path.alive = false;
        return None;
    }
    let primitive = tables.primitive(hit.primitive);
    let surface = tables.surface_of(primitive);
    let (point, normal, largest) = surface_point(primitive, path, hit);
    let Hit { barycentric, .. } = *hit;
    let mut place = Place { index: hit.primitive, point: path.origin + path.direction * t, barycentric };
    let mut crosses = primitive.surface & PRIMITIVE_BOUNDARY != 0;
    if !crosses {
        add_emission(tables, path, primitive, t, normal);
        crosses = surface.flags & SURFACE_MASK != 0 && passes_mask(tables, path, surface, &place);
    }
    if crosses {
        if surface.flags & SURFACE_PANE != 0 {
            pass_absorbing(tables, path, pane_depth(tables, surface, &place));
        }
        path.anchor = point;
        cross_surface(tables, path, surface, hit);
        return None;
    }
    if path.guide_pdf > 0.0 {
        path.pdf *= survival(tables, path);
    }
    path.throughput = survived_throughput(path);
    let back = path.direction.dot(normal) > 0.0;
    let surface = chosen_surface(tables, path, surface, &place, back);
    // Where a surface is seen from one side, but its shading normal from the other one, nothing is reflected.
    let seen = !back || surface.flags & (SURFACE_TWO_SIDED | SURFACE_ORIENTED) != 0;
    place.point = point;
    let turned = back && surface.flags & SURFACE_ORIENTED == 0;
    let smooth = surface.flags & SURFACE_SMOOTH != 0;
    let axis = if smooth { shading_normal(tables, &place, normal) } else { normal };
    let (axis, normal) = if turned { (-axis, -normal) } else { (axis, normal) };
    let isotropic = surface.alpha == surface.alpha_v;
    let tangent = if isotropic { orthonormal_frame(axis).0 } else { surface_tangent(tables, &place, axis) };
    let (base, mut axis, mut tangent, mut fade) = (axis, axis, tangent, 0.0);
    if surface.relief_texture != 0 {
        let frame = turn_frame(tables, surface, &place, -path.direction, turned, axis);
        (axis, fade) = (frame.axis, frame.fade);
        tangent = if isotropic { orthonormal_frame(axis).0 } else { frame.tangent };
    }
    let mut surface = *surface;
    if surface.textures_1 | surface.textures_2 & 0xffff != 0 {
        apply_textures(tables, &mut surface, &place);
    }
    path.offset = offset_distance(largest);
    path.normal = normal;
    path.left = if primitive.surface & PRIMITIVE_SPHERE == 0 { hit.primitive } else { NONE };
    let incident = to_surface_frame(tangent, axis, -path.direction);
    let (in_medium, g, phase, albedo) = (false, 0.0, 0, DVec3::ZERO);
    let vertex = Vertex { point, axis, in_medium, g, phase, albedo, surface, incident, tangent, normal, base, fade };
    path.alive = seen && sides_agree(&vertex, incident.z, -path.direction);
    path.alive.then_some(vertex)
}

/// Adds what a shadow ray brings, or takes it further.
fn path_light(tables: &Tables, path: &mut Path, hit: &Hit) {
    let mut hit = *hit;
    if tables.features.grids && !hit.blocked && advance_shadow(tables, path, &mut hit, false) {
        return;
    }
    if !hit.blocked {
        let mut transmittance = exp_minus_rgb(hit.tau_rgb.max(DVec3::ZERO)) * hit.passed;
        let mut survives = channel_weights(path.light_channels).dot(transmittance);
        if tables.features.grids {
            transmittance = path.light_passes * exp_minus_rgb(path.tau_rgb) * hit.passed;
            survives = hit.passed * channel_weights(path.light_channels).dot(exp_minus_rgb(path.tau_mean));
        }
        let light = &tables.lights[path.light as usize];
        if light.kind == LIGHT_VOLUME {
            // The point lies in the sphere about the medium, but perhaps not in the medium itself.
            survives = 1.0;
            transmittance *= f64::from(u8::from(f64::from(hit.medium) == light.edge_1.y));
        }
        path.radiance += path.light_weight * transmittance * power_heuristic(path.pdf_ratio * survives);
        if path.sharing == 2 && path.depth == 2 {
            share_light(path);
        }
    }
    path.shadow = false;
}

/// Answers the ray that the path asked for.
pub fn path_answer(tables: &Tables, path: &mut Path, hit: &Hit) {
    path_answer_seen(tables, path, hit, |_, _| ());
}

/// The same, for an observer of the vertices that the path scatters at.
pub fn path_answer_seen(tables: &Tables, path: &mut Path, hit: &Hit, see: impl FnOnce(&Path, &Vertex)) {
    if path.shadow {
        path_light(tables, path, hit);
    } else if path.probe {
        let vertex = meet(tables, path, hit);
        if vertex.map_or(path.alive, |vertex| refract_probe(tables, path, &vertex)) {
            return;
        }
        end_probe(path);
    } else {
        let Some(mut vertex) = meet(tables, path, hit) else { return };
        see(path, &vertex);
        if tables.features.sharers > 0 {
            share_vertex(tables, path, &mut vertex);
        }
        let leaves = !tables.features.pilot || path.depth == 0 || goes_on(tables, path, &vertex);
        let second = path.sharing == 2 && path.depth == 1;
        if second {
            share_ended(path);
        }
        if !leaves {
            return;
        }
        scatter(tables, path, &vertex);
        if second {
            path.record.rest_direction = path.next_direction;
        }
    }
    if path.alive && !path.shadow && !path.probe {
        next_segment(tables, path);
    }
}
