//! Mirror of `shaders/lib/path_shadow.glsl`: the way of a ray through boundaries, one after the other.

use super::bindings::{Surface, Tables};
use super::math::max_component;
use super::path_flight::{enter_medium, near_distance, pass_medium};
use super::path_state::{Hit, NONE, Path, flight_end};
use super::path_surface::{Place, opacity_at, pane_depth};
use crate::pack::layout::{PRIMITIVE_BOUNDARY, SURFACE_PANE};

/// Goes straight on through a surface, at `path.anchor`.
pub fn cross_surface(tables: &Tables, path: &mut Path, surface: &Surface, hit: &Hit) {
    let (inside, outside) = (surface.media & 0xffff, surface.media >> 16);
    let (from, to) = if hit.along_normal { (inside, outside) } else { (outside, inside) };
    let again = path.last != NONE && hit.t - path.t_min < near_distance(path, hit.t);
    enter_medium(tables, path, from, to, again);
    path.t_min = hit.t;
    path.last = hit.primitive;
    path.last_along_normal = hit.along_normal;
    path.tau_left = path.tau_left.max(0.0);
    path.t_max = flight_end(tables, path);
}

/// Takes a shadow ray to the next boundary, or to its end; whether it has to go on from there.
pub fn advance_shadow(tables: &Tables, path: &mut Path, hit: &mut Hit, whole: bool) -> bool {
    let reaches = hit.primitive == NONE;
    pass_medium(tables, path, if reaches { path.t_max } else { hit.t }, whole);
    if !whole && max_component(path.light_passes) == 0.0 {
        hit.blocked = true;
        return false;
    }
    if reaches {
        hit.medium = path.medium;
        hit.passed = path.passed;
        return false;
    }
    let primitive = tables.primitive(hit.primitive);
    let surface = tables.surface_of(primitive);
    if primitive.surface & PRIMITIVE_BOUNDARY == 0 {
        let point = path.origin + path.direction * hit.t;
        let place = Place { index: hit.primitive, point, barycentric: hit.barycentric };
        path.passed *= 1.0 - opacity_at(tables, surface, &place, path.direction);
        if surface.flags & SURFACE_PANE != 0 {
            let depth = pane_depth(tables, surface, &place);
            path.tau_rgb += depth;
            path.tau_mean += depth;
        }
    }
    let t_max = path.t_max;
    cross_surface(tables, path, surface, hit);
    path.t_max = t_max;
    true
}
