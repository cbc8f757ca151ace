//! Mirror of `shaders/lib/path_flight.glsl`: where a flight through a medium ends, at a surface or at a point where it scatters.

use super::bindings::{Medium, Primitive, Tables};
use super::equiangular::{equiangular_pdf, sample_equiangular, stretch_seen_from};
use super::grid::{
    DenseWay, Rate, Span, dense_way, density_at, grid_local, grid_mean, grid_transmittance, grid_value,
    start_grid_walk, stream_numbers, walk_point, walk_to_collision,
};
use super::math::{exp_minus_rgb, max_component, minus_log_1m, one_minus_exp_minus, one_minus_exp_minus_rgb};
use super::medium::{channel_weights, free_flight, medium_code, medium_of_code, scatter_weight, survival_weight};
use super::path_aim::find_pivot;
use super::path_open::open_factor;
use super::path_state::{FLIGHT_STREAMS, Hit, NONE, Path, SHADOW_STREAMS, goes_by_lamps, medium_at, open_flight_of};
use super::ray::{offset_distance, vertex_clearance};
use super::sampler::set_key;
use crate::pack::layout::{MEDIUM_ALBEDO_GRID, MEDIUM_DENSITY, MEDIUM_EMISSION_GRID, MEDIUM_VOXELS, PRIMITIVE_SPHERE};
use glam::DVec3;

/// The end of a flight.
#[derive(Clone, Copy, Debug)]
pub struct FlightEnd {
    /// In the medium; else at a surface, or nowhere.
    pub scatters: bool,
    /// Distance since `t_min`.
    pub way: f64,
    /// Of a path that scatters: albedo, transmittance and density of `t` together.
    pub weight: DVec3,
    /// Density times length of the way, in units of the medium's `sigma_t`; 0 where voxels have been accounted for.
    pub dense: f64,
}

/// How far the free flight gets in the medium from `t_min` on.
pub fn free_way(path: &Path, medium: &Medium) -> f64 {
    free_flight(path.tau_left, medium.sigma_t[path.channel as usize])
}

/// The weight of a flight that goes on over that of one with the whole extinction coefficient, where flights take a part of it.
pub fn rare_passage_weight(medium: &Medium, way: f64) -> f64 {
    (-(1.0 - medium.flight_share) * medium.sigma_t.x * way).exp()
}

/// The same of a flight that ends.
pub fn rare_collision_weight(medium: &Medium, way: f64) -> f64 {
    rare_passage_weight(medium, way) / medium.flight_share
}

/// Where the flight ends on a ray that meets a surface at `t_end`, or nothing before `t_end`.
pub fn end_flight(tables: &Tables, path: &Path, medium: &Medium, t_end: f64, surface: bool) -> FlightEnd {
    let way = t_end - path.t_min;
    let mut end = FlightEnd { scatters: !surface && t_end < path.far_end, way, weight: medium.albedo, dense: way };
    let sigma = medium.sigma_t[path.channel as usize];
    let length = t_end - path.t_min;
    let mixed = goes_by_lamps(path, medium);
    if mixed {
        end.scatters = path.tau_left < sigma * length;
    }
    if !end.scatters {
        return end;
    }
    let weights = channel_weights(path.throughput);
    if !mixed {
        end.way = free_flight(path.tau_left, medium.flight_share * sigma);
        if path.open {
            end.way = path.way;
            let free = weights.dot(medium.sigma_t * exp_minus_rgb(medium.sigma_t * end.way));
            end.weight /= open_factor(&open_flight_of(path, medium), end.way, true, free);
        }
        end.weight *= scatter_weight(weights, path.tau_rgb + medium.sigma_t * end.way, medium.sigma_t, DVec3::ONE);
        end.weight *= rare_collision_weight(medium, end.way);
        return end;
    }
    let scatters = one_minus_exp_minus(sigma * length);
    let u = (one_minus_exp_minus(path.tau_left) / scatters).min(0.999_999_94);
    let share = medium.equiangular;
    let pivot = find_pivot(tables, path, path.segment);
    let stretch = stretch_seen_from(pivot.point, path.origin, path.direction, path.t_min, t_end);
    let s = if u < share {
        sample_equiangular(&stretch, u / share)
    } else {
        free_flight(minus_log_1m((u - share) / (1.0 - share) * scatters), sigma).min(length)
    };
    let density = equiangular_pdf(&stretch, s);
    end.way = s;
    let collision = medium.sigma_t * exp_minus_rgb(path.tau_rgb + medium.sigma_t * s);
    let ends = exp_minus_rgb(path.tau_rgb) * one_minus_exp_minus_rgb(medium.sigma_t * length);
    let mixture = (1.0 - share) * weights.dot(collision) + share * weights.dot(ends) * density;
    end.weight = medium.albedo * collision / mixture;
    end
}

/// The same in a medium with a density.
pub fn end_dense_flight(tables: &Tables, path: &Path, medium: &Medium, t_end: f64) -> FlightEnd {
    let grid = &tables.grids[(medium.grids & 0xff_ffff) as usize - 1];
    let span = Span { origin: path.origin, direction: path.direction, t_begin: path.t_min, t_end };
    let DenseWay { way, dense, ends } = dense_way(&tables.values, grid, &span, free_way(path, medium));
    let mut end = FlightEnd { scatters: ends, way, weight: medium.albedo, dense };
    if end.scatters {
        let tau = path.tau_rgb + medium.sigma_t * dense;
        end.weight = scatter_weight(channel_weights(path.throughput), tau, medium.sigma_t, medium.albedo);
    }
    end
}

/// What a medium emits at a point, per unit of length.
fn emission_at(tables: &Tables, medium: &Medium, point: DVec3) -> DVec3 {
    if medium.grids & MEDIUM_EMISSION_GRID == 0 {
        return medium.emission;
    }
    let grid = &tables.grids[(medium.grids & 0xff_ffff) as usize + 1];
    let local = grid_local(grid, point);
    let outside = local.cmplt(DVec3::ZERO).any() || local.cmpgt(DVec3::ONE).any();
    if outside { DVec3::ZERO } else { medium.emission * grid_value(&tables.values, grid, local) }
}

/// The same through voxels, by delta tracking with the rates of their cells. Adds what is emitted, where `shines`.
pub fn end_voxel_flight(tables: &Tables, path: &mut Path, medium: &Medium, t_end: f64, shines: bool) -> FlightEnd {
    let grid = &tables.grids[(medium.grids & 0xff_ffff) as usize - 1];
    let values = &tables.values;
    let mut end = FlightEnd { scatters: false, way: t_end - path.t_min, weight: medium.albedo, dense: 0.0 };
    path.throughput *= survival_weight(channel_weights(path.throughput), path.tau_rgb);
    path.tau_rgb = DVec3::ZERO;
    let key = set_key(tables.params.seed, path.pixel, FLIGHT_STREAMS + path.segment, path.sample_index);
    let mut walk = start_grid_walk(grid, path.origin, path.direction, path.t_min, t_end);
    let mut tau = path.tau_left;
    while walk_to_collision(values, grid, Rate::Delta, &mut walk, &mut tau) {
        let u = stream_numbers(key, path.collisions);
        path.collisions += 1;
        let sigma = medium.sigma_t * grid_value(values, grid, walk_point(grid, &walk));
        if shines {
            let emission = emission_at(tables, medium, path.origin + path.direction * walk.t);
            path.radiance += path.throughput * emission / walk.rate;
        }
        end.scatters = u.x * walk.rate < sigma[path.channel as usize];
        let share = if end.scatters { sigma } else { (DVec3::splat(walk.rate) - sigma).max(DVec3::ZERO) };
        path.throughput *= share * (path.throughput.element_sum() / path.throughput.dot(share));
        tau = minus_log_1m(u.y);
        if end.scatters {
            end.way = walk.t - path.t_min;
            break;
        }
    }
    path.tau_left = tau;
    path.tau_mean += walk.mean;
    end
}

/// The same from the first vertex of a path that pixels share to the second, through the means of the cells.
pub fn end_mean_flight(tables: &Tables, path: &mut Path, medium: &Medium, t_end: f64) -> FlightEnd {
    let grid = &tables.grids[(medium.grids & 0xff_ffff) as usize - 1];
    let values = &tables.values;
    let mut end = FlightEnd { scatters: false, way: t_end - path.t_min, weight: medium.albedo, dense: 0.0 };
    let mut walk = start_grid_walk(grid, path.origin, path.direction, path.t_min, t_end);
    end.scatters = walk_to_collision(values, grid, Rate::Mean, &mut walk, &mut path.tau_left);
    path.tau_mean += walk.mean;
    if end.scatters {
        end.way = walk.t - path.t_min;
    }
    if !end.scatters || medium.phase != 0 {
        let key = set_key(tables.params.seed, path.pixel, FLIGHT_STREAMS + path.segment, path.sample_index);
        let (t_begin, t_end) = (path.t_min, path.t_min + end.way);
        let span = Span { origin: path.origin, direction: path.direction, t_begin, t_end };
        let (passes, mean) = grid_transmittance(values, grid, medium.sigma_t, true, &span, key, &mut path.collisions);
        path.throughput *= passes * mean.exp();
        if end.scatters {
            path.throughput *= medium.sigma_t * grid_value(values, grid, walk_point(grid, &walk)) / walk.rate;
        }
    }
    end
}

/// The extinction coefficient of a gray medium at a point, and that by which flights go that end at second vertices.
pub fn extinction_at(tables: &Tables, medium: &Medium, point: DVec3) -> [f64; 2] {
    let grid = || &tables.grids[(medium.grids & 0xff_ffff) as usize - 1];
    let sigma = medium.sigma_t.x;
    if medium.grids & MEDIUM_VOXELS != 0 {
        let local = grid_local(grid(), point);
        return [sigma * grid_value(&tables.values, grid(), local).x, grid_mean(&tables.values, grid(), local)];
    }
    [if medium.grids & MEDIUM_DENSITY != 0 { sigma * density_at(&tables.values, grid(), point) } else { sigma }; 2]
}

/// The albedo's factor at the end of a flight.
pub fn albedo_factor(tables: &Tables, medium: &Medium, point: DVec3) -> DVec3 {
    if medium.grids & MEDIUM_ALBEDO_GRID == 0 {
        return DVec3::ONE;
    }
    let grid = &tables.grids[(medium.grids & 0xff_ffff) as usize];
    grid_value(&tables.values, grid, grid_local(grid, point))
}

/// A stretch of a shadow ray from `t_min` to `t_end`, within one medium.
pub fn pass_medium(tables: &Tables, path: &mut Path, t_end: f64, whole: bool) {
    let medium = medium_at(tables, path.medium);
    let span = Span { origin: path.origin, direction: path.direction, t_begin: path.t_min, t_end };
    let grid = || &tables.grids[(medium.grids & 0xff_ffff) as usize - 1];
    if medium.grids & MEDIUM_VOXELS != 0 {
        let key = set_key(tables.params.seed, path.pixel, SHADOW_STREAMS + path.segment, path.sample_index);
        let index = &mut path.collisions;
        let (passes, mean) = grid_transmittance(&tables.values, grid(), medium.sigma_t, whole, &span, key, index);
        path.light_passes *= passes;
        path.tau_mean += mean;
        return;
    }
    let known = medium.grids & MEDIUM_DENSITY != 0;
    let dense = if known { dense_way(&tables.values, grid(), &span, f64::INFINITY).dense } else { t_end - path.t_min };
    path.tau_rgb += medium.sigma_t * dense;
    path.tau_mean += medium.sigma_t * dense;
}

/// How near to a surface a point of a flight may round to its other side, with some room for rays that graze it.
pub fn near_distance(path: &Path, t: f64) -> f64 {
    4.0 * offset_distance(max_component(path.origin.abs()) + t)
}

/// Moves a point to its side of a primitive, if it is closer than a surface's own points are kept. `side` is +1 for the side
/// that the normal points to.
fn keep_on_side(primitive: &Primitive, point: DVec3, side: f64) -> DVec3 {
    let Primitive { a, b, c, .. } = *primitive;
    if primitive.surface & PRIMITIVE_SPHERE != 0 {
        let offset = point - a;
        let (distance, outwards) = (offset.length(), side * b.y);
        let largest = max_component(a.abs()) + b.x;
        let missing = vertex_clearance(largest) - outwards * (distance - b.x);
        return if missing > 0.0 { point + offset * (outwards * missing / distance) } else { point };
    }
    let normal = (b - a).cross(c - a).normalize();
    let largest = max_component(a.abs().max(b.abs().max(c.abs())));
    let missing = vertex_clearance(largest) - side * (point - a).dot(normal);
    if missing > 0.0 && missing < 64.0 * vertex_clearance(largest) { point + normal * (side * missing) } else { point }
}

/// The surface that the end of a flight is so close to that it may round to the other side: the one behind it (`hit`), or else the one
/// before it (`path.last`), or [`NONE`]. `side` is that of the flight, as in `keep_on_side`.
#[derive(Clone, Copy, Debug)]
pub struct FlightSide {
    primitive: u32,
    side: f64,
}

/// Which surface the end of a flight must be kept on its side of.
pub fn flight_side(path: &Path, hit: &Hit, way: f64) -> FlightSide {
    let t = path.t_min + way;
    let close = near_distance(path, t);
    if hit.primitive != NONE && hit.t - t < close {
        return FlightSide { primitive: hit.primitive, side: if hit.along_normal { -1.0 } else { 1.0 } };
    }
    let primitive = if way < close { path.last } else { NONE };
    FlightSide { primitive, side: if path.last_along_normal { 1.0 } else { -1.0 } }
}

/// The end of a flight, on its side of the primitive.
pub fn flight_point(tables: &Tables, path: &Path, side: FlightSide, way: f64) -> DVec3 {
    let (start, distance) = if path.last == NONE { (path.origin, path.t_min + way) } else { (path.anchor, way) };
    let point = start + path.direction * distance;
    if side.primitive == NONE { point } else { keep_on_side(tables.primitive(side.primitive), point, side.side) }
}

/// Goes through a boundary. Crossings at one place, `again` but for the first, may come in any order; only their
/// sum counts.
pub fn enter_medium(tables: &Tables, path: &mut Path, from: u32, to: u32, again: bool) {
    let base = if again || path.medium == NONE { path.medium_sum } else { medium_code(path.medium) };
    path.medium_sum = base.wrapping_add(medium_code(to)).wrapping_sub(medium_code(from));
    let found = medium_of_code(path.medium_sum, to, tables.media.len() as u32);
    // Where the boundary does not expect the medium in front of it but behind, the vertex lay on the other side by rounding.
    path.medium = if found == NONE && path.medium == to { to } else { found };
}
