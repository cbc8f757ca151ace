//! Mirror of `shaders/lib/path_state.glsl`: what a path is between two rays, and its flight through media.

use super::bindings::{Medium, Tables};
use super::equiangular::sample_equiangular;
use super::light::{alias_keeps, alias_line};
use super::math::{exp_minus_rgb, minus_log_1m};
use super::medium::{channel_weights, free_flight, sample_channel, survival_probability, survival_weight};
use super::path_open::{OpenFlight, open_flight};
use super::path_probe::Kept;
use super::path_share::Record;
use super::sampler::{group_index, group_seed, half_index, half_seed, lens_key, point_index, set_key, shifted_point};
use crate::pack::layout::{self, MEDIUM_DENSITY, MEDIUM_VOXELS};
use crate::pack::sobol::{LENS_SET, SOBOL_SETS};
use glam::{DVec2, DVec3, DVec4};

/// Nothing, among indices.
pub const NONE: u32 = u32::MAX;
/// Longest distance; rays that end nowhere end here.
pub const INFINITE_DISTANCE: f64 = layout::INFINITE_DISTANCE as f64;
/// More than the optical depth that any free flight gets.
const MAX_FLIGHT_TAU: f64 = 16.7;

/// Sets of the numbers that choose points of emission, one for each segment: beyond all others.
pub const EMISSION_SETS: u32 = 0x8000_0000;

/// Streams of numbers for tentative collisions, one for each segment's flight.
pub const FLIGHT_STREAMS: u32 = 0xc000_0000;
/// The same for the shadow ray at the segment's end.
pub const SHADOW_STREAMS: u32 = 0xe000_0000;

/// A path between two rays.
#[derive(Clone, Copy, Debug, Default)]
pub struct Path {
    /// Of the whole film.
    pub pixel: u32,
    /// Of the pixel.
    pub sample_index: u32,
    /// Where pixels share paths, that of this sample.
    pub group: u32,
    /// And the pixel's number in it.
    pub member: u32,
    /// Factor of the radiance by the reconstruction filter; negative in its negative lobes.
    pub filter_weight: f64,
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
    /// The ray went along the normal of `last`.
    pub last_along_normal: bool,
    /// The point of `last` that the ray went through.
    pub anchor: DVec3,
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
    /// Density per solid angle of `direction`; 0 for a camera ray; of a mirror that light sampling knows, minus its probability.
    pub pdf: f64,
    /// The same by scattering alone.
    pub scattered_pdf: f64,
    /// Density of the direction of the last vertex by its guide, where a probe from there is bent like the path; else 0.
    pub guide_pdf: f64,
    /// The ray is a probe's ([`super::path_probe`]).
    pub probe: bool,
    /// What the path goes on with behind the probe.
    pub kept: Kept,
    /// Where pixels share paths: what is kept of this one.
    pub record: Record,
    /// 1: the first vertex is kept; 2: the second one is, and radiance is that of a throughput of 1 from there.
    pub sharing: u32,
    /// The throughput at the second vertex.
    pub before: DVec3,
    /// From the first vertex to the lamp that the flight from there may go by, or 0.
    pub lamp_way: DVec3,
    /// It goes by [`super::path_open`], and has not left the medium in which it began.
    pub open: bool,
    /// Its length.
    pub way: f64,
    /// The path goes on behind the ray that is asked for.
    pub alive: bool,
    /// Where the path is; [`NONE`] where boundaries that contradict each other leave no medium.
    pub medium: u32,
    /// Sum of the codes of media over the crossings at `t_min`.
    pub medium_sum: u32,
    /// Optical depth, in the chosen channel, from `t_min` to the end of the flight.
    pub tau_left: f64,
    /// Optical depth from the last event to `t_min`.
    pub tau_rgb: DVec3,
    /// The flight's.
    pub channel: u32,
    /// Probability to pass the masks between the last event and `t_min`.
    pub passed: f64,
    /// What media that only absorb have left since the last event.
    pub absorbed: f64,
    /// How many masks the path has passed or met.
    pub crossings: u32,
    /// Where the far clip plane ends a camera ray.
    pub far_end: f64,
    /// Numbers of the stream that are used up. This and the next three: where media are not homogeneous.
    pub collisions: u32,
    /// Optical depth from the last event to `t_min` as the weights of light sampling see it.
    pub tau_mean: DVec3,
    /// Channel weights at the beginning of the segment.
    pub segment_weights: DVec3,
    /// Shadow rays: estimate of the transmittance of voxels up to `t_min`.
    pub light_passes: DVec3,
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
    /// The triangle on which the vertex lies, which its rays cannot meet again; else [`NONE`].
    pub left: u32,
    /// The medium of the next segment.
    pub next_medium: u32,
    /// For roulette by a pilot: one over the square of the pixel's radiance.
    pub focus: DVec3,
    /// The pilot knows the vertex.
    pub foreseen: bool,
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
    /// Shadow rays: distance of the first boundary.
    pub first: f64,
    /// Shadow rays: the medium at the end of the ray.
    pub medium: u32,
    /// Shadow rays: fraction of the light that passes masks.
    pub passed: f64,
}

/// The four numbers of a set.
pub fn sample_set(tables: &Tables, path: &Path, set: u32) -> DVec4 {
    let (seed, index) = seed_and_index(tables, path);
    numbers_of_set(tables, seed, path.pixel, set, index)
}

fn numbers_of_set(tables: &Tables, seed: u32, pixel: u32, set: u32, index: u32) -> DVec4 {
    let key = set_key(seed, pixel, set, index);
    let point = if set < SOBOL_SETS { tables.points[point_index(set, index, key) as usize] } else { [0; 2] };
    shifted_point(point, key)
}

/// Of a path's own numbers.
fn seed_and_index(tables: &Tables, path: &Path) -> (u32, u32) {
    let (seed, index) = (tables.params.seed, path.sample_index);
    if tables.features.sharers == 0 { (seed, index) } else { (half_seed(seed, index), half_index(index)) }
}

/// The numbers of the camera's segment.
pub fn sample_camera(tables: &Tables, path: &Path) -> DVec4 {
    let own = sample_set(tables, path, 0);
    if tables.features.sharers == 0 {
        return own;
    }
    let seed = group_seed(tables.params.seed, path.sample_index);
    let of_group = numbers_of_set(tables, seed, path.group, 0, group_index(path.sample_index));
    DVec4::new(own.x, own.y, of_group.z, of_group.w)
}

/// The numbers of the vertex at the end of a segment.
pub fn vertex_numbers(tables: &Tables, path: &Path, segment: u32) -> DVec4 {
    if tables.features.sharers == 0 || segment > 0 {
        return sample_set(tables, path, 2 * segment + 1);
    }
    let of_render = numbers_of_set(tables, tables.params.seed, path.pixel, 1, path.sample_index);
    let seed = group_seed(tables.params.seed, path.sample_index);
    let index = group_index(path.sample_index) * tables.features.sharers + path.member;
    let of_group = numbers_of_set(tables, seed, path.group, 1, index);
    DVec4::new(of_render.x, of_render.y, of_group.z, of_group.w)
}

/// The numbers for a camera's lens.
pub fn sample_lens(tables: &Tables, path: &Path) -> DVec4 {
    let (seed, index) = seed_and_index(tables, path);
    let key = lens_key(seed, path.pixel, index);
    shifted_point(tables.points[point_index(LENS_SET, index, key) as usize], key)
}

/// A medium by its index.
pub fn medium_at(tables: &Tables, medium: u32) -> &Medium {
    // An index that boundaries without a consistent nesting made up is vacuum.
    tables.media.get(medium as usize).unwrap_or(&tables.media[0])
}

/// Whether the flight's distance goes by lamps as well, up to what the ray meets. Not from the first vertex to the second of a path that
/// is shared: see [`open_flight_of`].
pub fn goes_by_lamps(path: &Path, medium: &Medium) -> bool {
    medium.equiangular > 0.0 && !(path.sharing == 1 && path.depth == 1)
}

/// Distance to the end of the flight with the extinction that holds from `t_min` on.
pub fn flight_end(tables: &Tables, path: &Path) -> f64 {
    let medium = medium_at(tables, path.medium);
    if path.probe || medium.grids & (MEDIUM_VOXELS | MEDIUM_DENSITY) != 0 {
        return path.far_end;
    }
    let flight = if path.open {
        path.way
    } else if goes_by_lamps(path, medium) {
        free_flight(MAX_FLIGHT_TAU, medium.least_sigma_t)
    } else {
        free_flight(path.tau_left, medium.flight_share * medium.sigma_t[path.channel as usize])
    };
    (path.t_min + flight).min(path.far_end)
}

/// The flight from the first vertex of a path that is shared to the second, by a lamp.
pub fn open_flight_of(path: &Path, medium: &Medium) -> OpenFlight {
    open_flight(medium, channel_weights(path.throughput), path.origin, path.direction, path.lamp_way)
}

/// Whether such a flight goes by a lamp as well, and then how far it gets.
fn begin_open_flight(tables: &Tables, path: &mut Path, u: f64) {
    path.open = false;
    if path.sharing != 1 || path.depth != 1 {
        return;
    }
    let medium = medium_at(tables, path.medium);
    let flight = open_flight_of(path, medium);
    path.open = flight.share > 0.0;
    if path.open && u < flight.share {
        path.way = sample_equiangular(&flight.stretch, u / flight.share);
    } else if path.open {
        path.tau_left = minus_log_1m((u - flight.share) / (1.0 - flight.share));
        path.way = free_flight(path.tau_left, medium.sigma_t[path.channel as usize]);
    }
}

/// A new segment along `path.direction`: its flight from two random numbers.
pub fn begin_segment(tables: &Tables, path: &mut Path, u: DVec2) {
    path.last = NONE;
    path.shadow = false;
    path.passed = 1.0;
    path.absorbed = 1.0;
    path.tau_left = minus_log_1m(u.x);
    path.tau_rgb = DVec3::ZERO;
    path.channel = sample_channel(channel_weights(path.throughput), u.y);
    begin_open_flight(tables, path, u.x);
    path.collisions = 0;
    path.tau_mean = DVec3::ZERO;
    path.segment_weights = channel_weights(path.throughput);
    path.t_max = flight_end(tables, path);
}

/// Probability that the flight got as far as it did, through media and masks.
pub fn survival(tables: &Tables, path: &Path) -> f64 {
    if tables.features.grids {
        return path.passed * path.segment_weights.dot(exp_minus_rgb(path.tau_mean));
    }
    path.passed * survival_probability(channel_weights(path.throughput), path.tau_rgb)
}

/// The throughput with the weight of a flight that got as far as it did.
pub fn survived_throughput(path: &Path) -> DVec3 {
    if path.probe {
        return path.throughput * exp_minus_rgb(path.tau_rgb);
    }
    path.throughput * survival_weight(channel_weights(path.throughput), path.tau_rgb)
}

/// Chooses a light by the alias table; what is left of u is uniform again.
pub fn choose_light(tables: &Tables, u: &mut f64) -> u32 {
    let index = alias_line(tables.lights.len() as u32, u);
    let line = &tables.lights[index as usize];
    if alias_keeps(line.alias_threshold, u) { index } else { line.alias }
}
