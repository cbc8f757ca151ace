//! Guides: where light comes from inside bodies of smooth glass.
//!
//! A medium behind smooth glass sees no lamp straight: shadow rays end at the glass, and scattering finds lamps by chance. So the kernels
//! send probes through the glass (`shaders/lib/path_probe.glsl`), in directions from which light is known to come. What is known are
//! lobes, one for each cell of a grid about the glass, found here before a render: light is sampled at random points of the glass and bent
//! inwards, and probes go outwards through such points; what they bring is counted along its way through the medium. The expectation of an
//! image does not depend on the lobes.

use crate::pack::Packed;
use crate::pack::layout::{BSDF_DIFFUSE, GUIDE_CELLS, MEDIUM_SEALED, SURFACE_KIND_SHIFT};
use crate::pilot::MOST_PRIMITIVES;
use crate::reference::bindings::{Primitive, Surface, Tables};
use crate::reference::bsdf::{fresnel_dielectric, is_smooth_glass, refract_at};
use crate::reference::guide::guide_cell;
use crate::reference::math::{exp_minus, exp_minus_rgb, from_frame, orthonormal_frame};
use crate::reference::path::{NONE, Path, path_answer};
use crate::reference::path_aim::Aim;
use crate::reference::path_lights::sample_light;
use crate::reference::path_state::INFINITE_DISTANCE;
use crate::reference::path_surface::is_sphere;
use crate::reference::path_vertex::{Vertex, offset_origin};
use crate::reference::ray::offset_distance;
use crate::reference::traverse;
use crate::reference::warp::{square_to_cosine_hemisphere, square_to_sphere};
use glam::{DVec2, DVec3, Vec2Swizzles as _};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Rays from lamps to the glass, and outwards through it in each round.
const RAYS: u32 = 1 << 11;
/// Rounds of the latter at most, and rays that bring light into each medium after which there is no other.
const ROUNDS: u32 = 8;
const ENOUGH: usize = 128;
/// A probe is given up after so many surfaces.
const MOST_SURFACES: u32 = 64;
/// Probes begin this part of the size of the glass before it.
const NEAR: f64 = 1e-4;
/// Lobes that are broader than this tell nothing.
const LEAST_SHARPNESS: f64 = 1.0;
/// And none is trusted to be sharper.
const MOST_SHARPNESS: f64 = 300.0;
/// Probes are sent from all vertices of a cell that gets at least one over this of the light of a bright one, and in proportion to that from
/// darker ones, but from this part of them at least (measured: 1.2 times better than from all vertices, in boxes).
const EAGER: f64 = 2.0;
const LEAST_CHANCE: f64 = 0.2;
/// The resultant of a cell is taken together with so many rays from all sides.
const PRIOR_RAYS: f64 = 0.5;

/// A primitive of glass, with a medium on one of its sides.
struct Wall {
    index: u32,
    medium: u32,
    /// The medium lies on the side of the normal.
    outside: bool,
    /// Of all walls up to this one.
    area: f64,
}

/// What a ray brings into a medium.
struct Arrival {
    point: DVec3,
    /// From where it comes.
    direction: DVec3,
    radiance: f64,
    /// The length of its way through the medium.
    way: f64,
    medium: u32,
    extinction: f64,
}

/// Adds the guides to the tables of a scene; where there is no glass about a medium, or nothing shines through it, none.
pub fn run(packed: &mut Packed) {
    let features = &packed.features;
    let deep = features.max_depth > 2;
    let certain = !features.grids && !features.emission && !features.masks && !features.panes && !features.tints;
    let small = packed.primitives.len() <= MOST_PRIMITIVES;
    if !(features.sealed && features.light_sampling && deep && certain && small) {
        return;
    }
    let tables = Tables::new(packed);
    let Some((walls, low, high)) = walls(&tables) else { return };
    let size = high - low;
    let arrivals = arrivals(&tables, &walls, size.length());
    let scale = f64::from(GUIDE_CELLS) / size;
    let guides = lobes(&arrivals, low, scale);
    let some = guides.iter().any(|guide| guide[3] > 0.0);
    if some && scale.is_finite() && packed.values.len() + 4 * guides.len() <= u32::MAX as usize {
        packed.params.guide_origin = low.as_vec3();
        packed.params.guide_scale = scale.as_vec3();
        packed.params.first_guide = packed.values.len() as u32;
        packed.values.extend(guides.iter().flatten());
        packed.features.guides = true;
    }
}

/// Light that passes one surface of glass is found best from lamps, light that passes several ones from within.
fn arrivals(tables: &Tables, walls: &[Wall], size: f64) -> Vec<Arrival> {
    let place = |number| Place::of(tables, walls, number);
    let mut found: Vec<Arrival> =
        (0..RAYS).into_par_iter().filter_map(|number| receive(tables, &place(number))).collect();
    for round in 0..ROUNDS {
        let numbers = (round * RAYS..(round + 1) * RAYS).into_par_iter();
        found.par_extend(numbers.filter_map(|number| look_out(tables, &place(number), size)));
        let of = |medium: u32| found.iter().filter(|arrival| arrival.medium == medium).count();
        let media: BTreeSet<u32> = walls.iter().map(|wall| wall.medium).collect();
        if media.into_iter().all(|medium| of(medium) >= ENOUGH) {
            break;
        }
    }
    found
}

/// All glass with a sealed medium behind it, and its bounds.
fn walls(tables: &Tables) -> Option<(Vec<Wall>, DVec3, DVec3)> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (mut found, mut area): (Vec<Wall>, f64) = (Vec::new(), 0.0);
    for (index, primitive) in (0..).zip(&tables.primitives) {
        let surface = tables.surface_of(primitive);
        if !is_smooth_glass(surface) {
            continue;
        }
        for (medium, outside) in [(surface.media & 0xffff, false), (surface.media >> 16, true)] {
            let sealed = tables.media.get(medium as usize).is_some_and(|medium| medium.grids & MEDIUM_SEALED != 0);
            if !sealed {
                continue;
            }
            area += area_of(primitive);
            found.push(Wall { index, medium, outside, area });
            let (of_low, of_high) = bounds_of(primitive);
            (low, high) = (low.min(of_low), high.max(of_high));
        }
    }
    (area > 0.0 && area.is_finite()).then_some((found, low, high.max(low + 1e-6 * (high - low).max_element())))
}

fn radius_of(primitive: &Primitive) -> Option<f64> {
    is_sphere(primitive).then_some(primitive.b.x)
}

fn area_of(primitive: &Primitive) -> f64 {
    match radius_of(primitive) {
        Some(radius) => 4.0 * std::f64::consts::PI * radius * radius,
        None => 0.5 * (primitive.b - primitive.a).cross(primitive.c - primitive.a).length(),
    }
}

fn bounds_of(primitive: &Primitive) -> (DVec3, DVec3) {
    let Primitive { a, b, c, .. } = *primitive;
    radius_of(primitive).map_or((a.min(b).min(c), a.max(b).max(c)), |radius| (a - radius, a + radius))
}

/// A point of a primitive and its normal.
fn point_of(primitive: &Primitive, u: DVec2) -> (DVec3, DVec3) {
    let Primitive { a, b, c, .. } = *primitive;
    if let Some(radius) = radius_of(primitive) {
        let outwards = square_to_sphere(u);
        return (a + outwards * radius, outwards * b.y);
    }
    let root = u.x.sqrt();
    (a + (b - a) * (1.0 - root) + (c - a) * (u.y * root), (b - a).cross(c - a).normalize())
}

/// Well-spread numbers in five dimensions: multiples of the powers of 1/φ, φ⁶ = φ + 1 (Roberts 2018).
fn numbers(number: u32) -> [f64; 5] {
    const PHI: f64 = 1.134_724_138_401_519_5;
    [1, 2, 3, 4, 5].map(|power| (0.5 + f64::from(number) / PHI.powi(power)).fract())
}

/// A random point of the glass.
struct Place<'a> {
    wall: &'a Wall,
    primitive: &'a Primitive,
    point: DVec3,
    /// The normal away from the medium.
    outwards: DVec3,
    /// What is left of the random numbers.
    u: DVec2,
}

impl<'a> Place<'a> {
    fn of(tables: &'a Tables, walls: &'a [Wall], number: u32) -> Place<'a> {
        let u = numbers(number);
        let sought = u[0] * walls[walls.len() - 1].area;
        let wall = &walls[walls.partition_point(|wall| wall.area <= sought).min(walls.len() - 1)];
        let primitive = &tables.primitives[wall.index as usize];
        let (point, normal) = point_of(primitive, DVec2::new(u[1], u[2]));
        let outwards = if wall.outside { -normal } else { normal };
        Place { wall, primitive, point, outwards, u: DVec2::new(u[3], u[4]) }
    }

    /// A path that has come here, on the side away from the medium or in it.
    fn path(&self, medium: u32, outside: bool) -> Path {
        Path {
            point: self.point,
            normal: if outside { self.outwards } else { -self.outwards },
            offset: offset_distance(self.point.abs().max_element()),
            left: if is_sphere(self.primitive) { NONE } else { self.wall.index },
            medium,
            light_medium: medium,
            far_end: INFINITE_DISTANCE,
            t_max: INFINITE_DISTANCE,
            last: NONE,
            passed: 1.0,
            absorbed: 1.0,
            throughput: DVec3::ONE,
            before: DVec3::ONE,
            eta_scale: 1.0,
            depth: 1,
            alive: true,
            ..Path::default()
        }
    }

    /// How far it is through the medium, against a direction that leads out of it.
    fn way_back(&self, tables: &Tables, direction: DVec3) -> f64 {
        let path = self.path(self.wall.medium, false);
        traverse(tables, &Path { origin: offset_origin(&path, -direction), direction: -direction, ..path }).t
    }

    fn arrival(&self, tables: &Tables, direction: DVec3, radiance: DVec3, way: f64) -> Option<Arrival> {
        let (point, radiance, medium) = (self.point, radiance.element_sum(), self.wall.medium);
        let extinction = tables.media[medium as usize].sigma_t.element_sum() / 3.0;
        let lit = radiance > 0.0 && radiance.is_finite();
        lit.then_some(Arrival { point, direction, radiance, way, medium, extinction })
    }
}

/// Samples light at the glass, and bends it inwards.
fn receive(tables: &Tables, place: &Place) -> Option<Arrival> {
    let surface = *tables.surface_of(place.primitive);
    let (inside, outside) = (surface.media & 0xffff, surface.media >> 16);
    let Place { point, outwards, u, .. } = *place;
    let mut path = place.path(if place.wall.outside { inside } else { outside }, true);
    // What arrives is what a white diffuse surface would send on.
    let white = Surface { flags: BSDF_DIFFUSE << SURFACE_KIND_SHIFT, reflectance: DVec3::ONE, ..Surface::default() };
    let vertex = Vertex {
        point,
        axis: outwards,
        in_medium: false,
        g: 0.0,
        phase: 0,
        albedo: DVec3::ZERO,
        surface: white,
        incident: DVec3::Z,
        tangent: orthonormal_frame(outwards).0,
        normal: outwards,
        base: outwards,
        fade: 0.0,
    };
    path.shadow = true;
    if !sample_light(tables, &mut path, &vertex, &Aim::default(), u, u.yx()) {
        return None;
    }
    let hit = traverse(tables, &path);
    if hit.blocked {
        return None;
    }
    let normal = if place.wall.outside { -outwards } else { outwards };
    let (reflected, cosine) = fresnel_dielectric(path.direction.dot(normal), surface.eta);
    if reflected >= 1.0 {
        return None;
    }
    let direction = -refract_at(path.direction, normal, cosine, surface.eta);
    let radiance = path.light_weight * exp_minus_rgb(hit.tau_rgb.max(DVec3::ZERO)) * (1.0 - reflected);
    place.arrival(tables, direction, radiance, place.way_back(tables, direction))
}

/// Sends a probe outwards through the glass, and what lies behind it.
fn look_out(tables: &Tables, place: &Place, size: f64) -> Option<Arrival> {
    let direction = from_frame(place.outwards, square_to_cosine_hemisphere(place.u));
    let way = place.way_back(tables, direction);
    let origin = place.point - direction * (NEAR * size).min(0.5 * way);
    // The light comes in no other way.
    let (pdf, guide_pdf) = (1.0, f64::MAX);
    let path = place.path(place.wall.medium, false);
    let mut probe = Path { origin, direction, left: NONE, probe: true, pdf, guide_pdf, ..path };
    for _ in 0..MOST_SURFACES {
        if !probe.probe {
            break;
        }
        let hit = traverse(tables, &probe);
        path_answer(tables, &mut probe, &hit);
    }
    place.arrival(tables, direction, probe.radiance, way)
}

/// Of each cell the axis, times the chance to look along it, and the sharpness.
fn lobes(arrivals: &[Arrival], low: DVec3, scale: DVec3) -> Vec<[f32; 4]> {
    let cells = (GUIDE_CELLS * GUIDE_CELLS * GUIDE_CELLS) as usize;
    // Of each cell: the sum of directions, weights, and squared weights.
    let mut sums = vec![(DVec3::ZERO, 0.0, 0.0); cells];
    for arrival in arrivals {
        let along = (arrival.direction * scale).abs().max_element();
        let step = 0.5 / along;
        let most = 2 * GUIDE_CELLS;
        for k in 0..most {
            let distance = (f64::from(k) + 0.5) * step;
            if distance > arrival.way {
                break;
            }
            let cell = guide_cell((arrival.point - arrival.direction * distance - low) * scale);
            let weight = arrival.radiance * exp_minus(arrival.extinction * distance) * step;
            let (sum, weights, squares) = &mut sums[cell as usize];
            *sum += arrival.direction * weight;
            *weights += weight;
            *squares += weight * weight;
        }
    }
    let total = |of: &dyn Fn(f64) -> f64| sums.iter().map(|(_, weights, _)| of(*weights)).sum::<f64>();
    let bright = total(&|weights| weights * weights) / total(&|weights| weights);
    let chance = |weights: f64| (EAGER * weights / bright).clamp(LEAST_CHANCE, 1.0);
    sums.iter().map(|(sum, weights, squares)| lobe(*sum, *weights, *squares, chance(*weights))).collect()
}

/// The lobe with a mean direction (Banerjee, Dhillon, Ghosh and Sra 2005, eq. 4.4).
fn lobe(sum: DVec3, weights: f64, squares: f64, chance: f64) -> [f32; 4] {
    if !(weights > 0.0 && squares > 0.0) {
        return [0.0; 4];
    }
    let rays = weights * weights / squares;
    let resultant = sum.length() / weights * rays / (rays + PRIOR_RAYS);
    let sharpness = resultant * (3.0 - resultant * resultant) / (1.0 - resultant * resultant);
    if sharpness < LEAST_SHARPNESS {
        return [0.0; 4];
    }
    let axis = (sum.normalize() * chance).as_vec3();
    [axis.x, axis.y, axis.z, sharpness.min(MOST_SHARPNESS) as f32]
}
