//! Mirror of `shaders/lib/path_share.glsl`: neighbouring pixels share their paths. What is shared, and why the expectation of each
//! pixel stays, is told there. `connect.comp` and `share.comp` are [`share`] here.

use super::bindings::Tables;
use super::bsdf::BsdfSample;
use super::film::group_size;
use super::math::{exp_minus, exp_minus_rgb, max_component};
use super::medium::channel_weights;
use super::path_aim::{Aim, Pivot, aim_at, aimed_pdf, is_common};
use super::path_flight::{albedo_factor, extinction_at};
use super::path_open::{mean_passage, open_factor, open_flight};
use super::path_shadow::advance_shadow;
use super::path_state::{Hit, NONE, Path, medium_at};
use super::path_vertex::Vertex;
use super::phase::eval_henyey_greenstein;
use crate::pack::layout::{BSDF_DIFFUSE, SURFACE_KIND_SHIFT};
use glam::DVec3;
use std::f64::consts::PI;

/// The number of a pixel in its group; the place is within the shifted groups.
pub fn sharer_number(place: [u32; 2], sharers: u32) -> u32 {
    let [columns, rows] = group_size(sharers);
    place[1] % rows * columns + place[0] % columns
}

/// Rays end this many times the offset of rays that leave a surface before it.
const END_MARGIN: f64 = 4.0;

/// Connections have streams of numbers as if they were the shadow rays of these segments, one for each second vertex.
const CONNECTION_SEGMENTS: u32 = 0x1000_0000;

/// What a vertex is for others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Nothing to be shared.
    #[default]
    None,
    /// A diffuse surface.
    Surface,
    /// A medium.
    Medium,
}

/// A vertex as others see it.
#[derive(Clone, Copy, Debug, Default)]
pub struct End {
    /// Where it is.
    pub point: DVec3,
    /// On what.
    pub kind: Kind,
    /// The shading normal on its side; in a medium, the direction of propagation.
    pub axis: DVec3,
    /// Of a surface: the geometric normal on its side.
    pub normal: DVec3,
    /// The one that the path arrived through.
    pub medium: u32,
    /// Of a surface: of rays that begin or end here.
    pub offset: f64,
}

/// What is kept of a path for the others of its group.
#[derive(Clone, Copy, Debug, Default)]
pub struct Record {
    /// The first vertex.
    pub first: End,
    /// The triangle on which it lies, which its rays cannot meet again.
    pub left: u32,
    /// Of the film, and of that the sample.
    pub pixel: u32,
    /// Of the pixel.
    pub sample_index: u32,
    /// What its direction and its flight went by.
    pub pivot: Pivot,
    /// What the radiance that it scatters is multiplied with.
    pub weight: DVec3,
    /// The second vertex.
    pub second: End,
    /// Radiance that came before it.
    pub base: DVec3,
    /// What the second vertex sends, if the path ends there by roulette; all here is for a throughput of 1.
    pub ended: DVec3,
    /// What it sends of sampled light.
    pub light: DVec3,
    /// From where that comes.
    pub light_direction: DVec3,
    /// All that it sends besides.
    pub rest: DVec3,
    /// From where that comes.
    pub rest_direction: DVec3,
    /// Where the second vertex scatters in a medium: the probability that it does without an aim, and the density of that direction by it.
    pub unaimed: f64,
    /// The density of that direction by the aim, times its probability.
    pub aimed: f64,
}

/// Whether a vertex scatters in a way that is known without its place on a surface.
pub fn can_share(path: &Path, vertex: &Vertex) -> bool {
    if vertex.in_medium {
        return vertex.phase == 0;
    }
    let surface = &vertex.surface;
    surface.flags >> SURFACE_KIND_SHIFT == BSDF_DIFFUSE && surface.relief_texture == 0 && path.medium != NONE
}

/// A vertex as others see it.
pub fn end_of(path: &Path, vertex: &Vertex) -> End {
    let kind = if vertex.in_medium { Kind::Medium } else { Kind::Surface };
    let Vertex { point, axis, normal, .. } = *vertex;
    End { point, kind, axis, normal, medium: path.medium, offset: path.offset }
}

/// Before the path scatters: keeps its first two vertices. From the second one on the path gathers radiance for a throughput of 1.
pub fn share_vertex(tables: &Tables, path: &mut Path, vertex: &mut Vertex) {
    if path.depth == 0 && can_share(path, vertex) {
        let weight = path.throughput * if vertex.in_medium { vertex.albedo } else { vertex.surface.reflectance };
        if max_component(weight) > 0.0 {
            path.record.first = end_of(path, vertex);
            path.record.left = path.left;
            path.record.pixel = path.pixel;
            path.record.sample_index = path.sample_index;
            path.record.weight = weight;
            path.record.unaimed = 1.0;
            path.sharing = 1;
        }
    } else if path.depth == 1 && path.sharing == 1 && can_share(path, vertex) {
        path.record.second = end_of(path, vertex);
        path.record.base = path.radiance;
        path.radiance = DVec3::ZERO;
        path.before = if vertex.in_medium { path.throughput * vertex.albedo } else { path.throughput };
        // The densities are those of flights that end in media that only absorb as well. A path that does not brings so much less instead.
        path.throughput = DVec3::splat(path.absorbed);
        path.before /= path.absorbed.max(1e-30);
        if vertex.in_medium {
            let medium = medium_at(tables, path.medium);
            vertex.albedo = medium.albedo * albedo_factor(tables, medium, vertex.point);
        }
        path.sharing = 2;
    }
}

/// Keeps what the segments behind the first two vertices went by. After a second one in a medium the path goes on as if scattering alone
/// had chosen its direction, which has the density `scattered`.
pub fn share_aim(path: &mut Path, vertex: &Vertex, pivot: &Pivot, aim: &Aim, next: &mut BsdfSample, scattered: f64) {
    if path.sharing == 1 && path.depth == 1 {
        path.record.pivot = *pivot;
        path.lamp_way = pivot.point - vertex.point;
    } else if is_common(path, vertex) && aim.share > 0.0 && scattered > 0.0 {
        path.record.unaimed = 1.0 - aim.share;
        path.record.aimed = aimed_pdf(aim, 0.0, next.direction);
        let ratio = scattered / next.pdf;
        next.weight /= ratio;
        path.before *= ratio;
    }
}

/// Keeps what a path brings that ends at its second vertex.
pub fn share_ended(path: &mut Path) {
    path.record.ended = std::mem::take(&mut path.radiance);
}

/// Keeps the light that was sampled at the second vertex.
pub fn share_light(path: &mut Path) {
    path.record.light = std::mem::take(&mut path.radiance);
    path.record.light_direction = path.direction;
}

/// Keeps the rest at the end of the path, and returns the radiance that is left to its pixel alone.
pub fn share_rest(path: &mut Path) -> DVec3 {
    if path.sharing != 2 {
        return path.radiance;
    }
    path.record.rest = path.radiance;
    DVec3::ZERO
}

/// The ray from a first vertex to a second one, the density of the place by scattering without what lies on the way, and that with the
/// directions past the lamp over it; none if the first could not have found the second.
fn begin_connection(tables: &Tables, record: &Record, second: &End, pivot: &Pivot) -> Option<(Path, f64, f64)> {
    let first = &record.first;
    let way = second.point - first.point;
    let (mut begin, mut end) = (first.point, second.point);
    if first.kind == Kind::Surface {
        begin += first.normal * if first.normal.dot(way) >= 0.0 { first.offset } else { -first.offset };
    }
    if second.kind == Kind::Surface {
        let margin = END_MARGIN * second.offset;
        end += second.normal * if second.normal.dot(way) <= 0.0 { margin } else { -margin };
    }
    let way = end - begin;
    let far = way.length();
    let direction = way / far;
    let mut density = match first.kind {
        Kind::Surface if first.normal.dot(direction) <= 0.0 => 0.0,
        Kind::Surface => first.axis.dot(direction).max(0.0) / PI,
        _ => eval_henyey_greenstein(medium_at(tables, first.medium).g, first.axis, direction),
    };
    let aim = aim_at(pivot, first.point, medium_at(tables, first.medium), 0.0);
    let aimed = aimed_pdf(&aim, density, direction) / density;
    if second.kind == Kind::Surface {
        let seen = second.axis.dot(direction) < 0.0;
        density *= if seen { (-second.normal.dot(direction)).max(0.0) } else { 0.0 };
    }
    density /= far * far;
    let path = Path {
        origin: begin,
        direction,
        t_min: 0.0,
        t_max: far,
        last: NONE,
        // No primitive has this light.
        light: NONE - 1,
        medium: first.medium,
        light_medium: first.medium,
        left: record.left,
        shadow: true,
        light_passes: DVec3::ONE,
        passed: 1.0,
        pixel: record.pixel,
        sample_index: record.sample_index,
        ..Path::default()
    };
    (far > 0.0 && density > 0.0).then_some((path, density, aimed))
}

/// The density of a flight that ends at the second vertex, over that of a free flight, which is `free` for a density of 1.
fn connection_factor(tables: &Tables, path: &Path, hit: &Hit, to: &Record, from: &Record, free: f64) -> f64 {
    let (medium, weights) = (medium_at(tables, from.first.medium), channel_weights(from.weight));
    let flight = open_flight(medium, weights, path.origin, path.direction, to.pivot.point - from.first.point);
    let way = hit.first.min(path.t_max);
    let ends = hit.first >= path.t_max && to.second.kind == Kind::Medium;
    let free = if ends { free } else { mean_passage(weights, medium.sigma_t * way) };
    open_factor(&flight, way, ends, free)
}

/// What a connection through fields brings in each channel: an estimate of what passes, and a density that is known.
fn end_grid_connection(tables: &Tables, path: &Path, to: &Record, density: f64) -> (DVec3, f64) {
    let [truly, known] = match to.second.kind {
        Kind::Medium => extinction_at(tables, medium_at(tables, to.second.medium), to.second.point),
        _ => [1.0; 2],
    };
    let passes = density * truly * path.light_passes * exp_minus_rgb(path.tau_rgb);
    (passes, density * known * exp_minus(path.tau_mean.x))
}

/// What a connection brings in each channel, and its density as the flight of the first vertex chooses one.
fn end_connection(
    tables: &Tables,
    path: &Path,
    hit: &Hit,
    to: &Record,
    from: &Record,
    density: f64,
    aimed: f64,
) -> (DVec3, f64) {
    let mut passes = density * exp_minus_rgb(hit.tau_rgb.max(DVec3::ZERO));
    if to.second.kind == Kind::Medium {
        passes *= medium_at(tables, to.second.medium).sigma_t;
    }
    let found = channel_weights(from.weight).dot(passes);
    (passes, aimed * found * connection_factor(tables, path, hit, to, from, found / density))
}

/// What the second vertex of `to` brings to the first of `from`, and its density by that.
fn connect(tables: &Tables, from: &Record, to: &Record, number: u32) -> (DVec3, f64) {
    if from.first.kind == Kind::None || to.second.kind == Kind::None {
        return (DVec3::ZERO, 0.0);
    }
    let Some((mut path, density, aimed)) = begin_connection(tables, from, &to.second, &to.pivot) else {
        return (DVec3::ZERO, 0.0);
    };
    path.segment = CONNECTION_SEGMENTS + number;
    let mut hit = super::traverse(tables, &path);
    while tables.features.grids && !hit.blocked && advance_shadow(tables, &mut path, &mut hit, true) {
        hit = super::traverse(tables, &path);
    }
    if hit.blocked {
        return (DVec3::ZERO, 0.0);
    }
    if tables.features.grids {
        return end_grid_connection(tables, &path, to, density);
    }
    end_connection(tables, &path, &hit, to, from, density, aimed)
}

/// What truly passes between the two vertices of a path through voxels, and scatters there, over the density of flights that end there.
pub fn passage_weight(tables: &Tables, record: &Record) -> f64 {
    let (passes, density) = connect(tables, record, record, 0);
    if density > 0.0 { passes.x / density } else { 1.0 }
}

/// The phase function of a second vertex for light that arrives along `axis`; 1 on a surface, which scatters alike to all sides.
fn phase(tables: &Tables, second: &End, axis: DVec3, direction: DVec3) -> f64 {
    match second.kind {
        Kind::Medium => eval_henyey_greenstein(medium_at(tables, second.medium).g, axis, direction),
        _ => 1.0,
    }
}

/// What the second vertices of a group bring to each of its pixels.
pub fn share(tables: &Tables, records: &[Record]) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; records.len()];
    for (number, to) in (0..).zip(records) {
        let densities: Vec<(DVec3, f64)> = records.iter().map(|from| connect(tables, from, to, number)).collect();
        let of_place: f64 = densities.iter().map(|(_, density)| density).sum();
        if of_place == 0.0 {
            continue;
        }
        let towards = |from: &Record, direction: DVec3| {
            phase(tables, &to.second, (to.second.point - from.first.point).normalize(), direction)
        };
        let found = phase(tables, &to.second, to.second.axis, to.light_direction);
        let phases: Vec<f64> = (records.iter().zip(&densities))
            .map(|(from, (_, density))| if *density > 0.0 { towards(from, to.rest_direction) } else { 0.0 })
            .collect();
        let by_aim = |phase: f64| if to.second.kind == Kind::Medium { to.unaimed * phase + to.aimed } else { phase };
        let of_path: f64 = densities.iter().zip(&phases).map(|((_, density), phase)| density * by_aim(*phase)).sum();
        let unless_zero = |v: DVec3, by: f64| if v == DVec3::ZERO { v } else { v / by };
        let ended = unless_zero(to.ended, of_place);
        let light = unless_zero(to.light, of_place * found);
        let rest = unless_zero(to.rest, of_path);
        for (((from, (reaches, density)), phase), sum) in records.iter().zip(&densities).zip(&phases).zip(&mut sums) {
            if *density > 0.0 {
                let lit = if light == DVec3::ZERO { light } else { light * towards(from, to.light_direction) };
                *sum += *reaches * (ended + lit + rest * *phase);
            }
        }
    }
    let brought =
        |(record, sum): (&Record, DVec3)| if record.first.kind == Kind::None { sum } else { record.weight * sum };
    records.iter().zip(sums).map(brought).collect()
}
