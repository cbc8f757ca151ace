//! Mirror of `shaders/lib/path_rays.glsl`: what a path's rays take from the primitives they meet.

use super::bindings::Tables;
use super::path_flight::near_distance;
use super::path_state::{Hit, INFINITE_DISTANCE, NONE, Path, medium_at};
use super::path_surface::{Place, opacity_at, pane_depth};
use super::ray::{Ray, TriangleHit, intersect_sphere, intersect_triangle};
use crate::pack::layout::{PRIMITIVE_BOUNDARY, PRIMITIVE_SPHERE, SURFACE_MASK, SURFACE_PANE};
use glam::{DVec2, DVec3};

/// The length L of a shadow ray in its optical depth σ₀ L + Σ (σ after − σ before) (L − t). Where an infinite ray ends in
/// vacuum, σ₀ and the steps add up to 0 and any L serves.
pub fn shadow_length(path: &Path) -> f64 {
    if path.t_max >= INFINITE_DISTANCE { 0.0 } else { path.t_max }
}

/// An infinite ray that ends in a medium brings no light.
pub fn depth_at_infinity(tables: &Tables, path: &Path) -> DVec3 {
    if path.t_max < INFINITE_DISTANCE {
        return DVec3::ZERO;
    }
    DVec3::select(tables.params.world_sigma_t.cmpgt(DVec3::ZERO), DVec3::splat(INFINITE_DISTANCE), DVec3::ZERO)
}

/// The state of a traversal before its first step.
pub fn begin_hit(tables: &Tables, path: &Path) -> Hit {
    // Extension rays see a little beyond their flight: see `flight_point`.
    let t = if path.shadow { path.t_max } else { path.t_max + near_distance(path, path.t_max) };
    let mut hit = Hit {
        t,
        primitive: NONE,
        along_normal: false,
        barycentric: DVec2::ZERO,
        tau_rgb: DVec3::ZERO,
        blocked: false,
        first: INFINITE_DISTANCE,
        medium: path.light_medium,
        passed: 1.0,
    };
    if path.shadow {
        hit.tau_rgb =
            medium_at(tables, path.light_medium).sigma_t * shadow_length(path) + depth_at_infinity(tables, path);
    }
    hit
}

/// One crossing of a ray with a primitive.
pub struct Crossing {
    t: f64,
    along_normal: bool,
    barycentric: DVec2,
}

/// Takes one crossing with a primitive into account.
pub fn record(tables: &Tables, path: &Path, index: u32, crossing: Crossing, hit: &mut Hit) {
    let primitive = tables.primitive(index);
    let Crossing { t, along_normal, barycentric } = crossing;
    // Distances first, the primitive's index among equals: surfaces that coincide are met one after the other, none
    // twice.
    let begins = t > path.t_min || (t == path.t_min && index > path.last && path.last != NONE);
    let begins = begins && index != path.left;
    if tables.features.grids && path.shadow {
        // In order: what lies between boundaries is not known before.
        let counts = begins && t < path.t_max && primitive.light != path.light + 1;
        let mut passes = primitive.surface & PRIMITIVE_BOUNDARY != 0;
        let surface = tables.surface_of(primitive);
        if counts && !passes && surface.flags & SURFACE_MASK != 0 {
            let place = Place { index, point: path.origin + path.direction * t, barycentric };
            passes = opacity_at(tables, surface, &place, path.direction) < 1.0;
        }
        hit.blocked |= counts && !passes;
        if counts && passes && (t < hit.t || (t == hit.t && index < hit.primitive && hit.primitive != NONE)) {
            hit.t = t;
            hit.primitive = index;
            hit.along_normal = along_normal;
            hit.barycentric = barycentric;
        }
    } else if path.shadow {
        let mut boundary = primitive.surface & PRIMITIVE_BOUNDARY != 0;
        let counts = begins && t < path.t_max;
        // The light itself is not in the way of its light.
        let mut opaque = counts && !boundary && primitive.light != path.light + 1;
        let surface = tables.surface_of(primitive);
        if opaque && surface.flags & SURFACE_MASK != 0 {
            let place = Place { index, point: path.origin + path.direction * t, barycentric };
            let opacity = opacity_at(tables, surface, &place, path.direction);
            hit.passed *= 1.0 - opacity;
            if surface.flags & SURFACE_PANE != 0 {
                hit.tau_rgb += pane_depth(tables, surface, &place);
            }
            opaque = opacity >= 1.0;
            boundary = true;
        }
        if counts && boundary {
            let way = (shadow_length(path) - t) * if along_normal { -1.0 } else { 1.0 };
            let surface = tables.surface_of(primitive);
            hit.tau_rgb += surface.sigma_t_step * way;
            // In any order: the differences of indices add up.
            let (inside, outside) = (surface.media & 0xffff, surface.media >> 16);
            let (from, to) = if along_normal { (inside, outside) } else { (outside, inside) };
            hit.medium = hit.medium.wrapping_add(to).wrapping_sub(from);
        }
        if counts && boundary {
            hit.first = hit.first.min(t);
        }
        hit.blocked |= opaque;
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
