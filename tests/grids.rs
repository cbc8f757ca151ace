//! Fields in space, and tracking through them: unit kernels against Mitsuba's values, the reference, quadrature and theory.

mod common;

use common::comparison::Comparison;
use common::fields::{field, grid, uneven, unit_to};
use common::random::Random;
use common::scenes::{self, v};
use common::statistics::mean_and_error;
use common::tolerances::comparison;
use common::units::{run, vec4, widen};
use glam::{DMat4, DVec3};
use std::sync::Arc;
use tyndall::pack::Packed;
use tyndall::pack::layout::{self, MEDIUM_DENSITY, MEDIUM_VOXELS};
use tyndall::reference::grid as reference;
use tyndall::reference::rng::pcg4d;
use tyndall::scene::{Camera, Film, Filter, GridVolume, HeightVolume, Medium, Phase, Scene, Shape, Volume, Wrap};

/// The same with voxels that have three numbers, all alike: through those, light is tracked.
fn packed(mut volume: Volume, sigma_t: DVec3) -> Packed {
    if let Volume::Grid(field) = &mut volume
        && field.grid.channels() == 1
    {
        let [x, y, z] = field.grid.resolution().map(|side| side as usize);
        let values = field.grid.values().iter().flat_map(|value| [*value; 3]).collect();
        field.grid = Arc::new(tyndall::scene::Grid::new([x, y, z], 3, values).expect("they were valid before"));
    }
    packed_density(volume, sigma_t)
}

/// A scene with a medium whose density is a field, in a box that does not matter.
fn packed_density(volume: Volume, sigma_t: DVec3) -> Packed {
    packed_glow(volume, sigma_t, DVec3::ZERO)
}

/// The same, of a medium that emits.
fn packed_glow(volume: Volume, sigma_t: DVec3, emission: DVec3) -> Packed {
    let mut scene = Scene::new(Camera::look_at(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, 40.0), Film::new(8, 8));
    let mut medium = Medium { emission, ..Medium::new("field", sigma_t, DVec3::ONE, Phase::Isotropic) };
    medium.volumes.sigma_t = Some(volume);
    let id = scene.add_medium(medium);
    scene.shapes.push(Shape::boundary("box", scenes::cuboid(DMat4::IDENTITY), id));
    scenes::pack(&scene, 1)
}

/// What one invocation of the unit kernel is asked.
#[derive(Clone, Copy)]
struct Query {
    origin: DVec3,
    direction: DVec3,
    begin: f64,
    end: f64,
    sigma_t: DVec3,
    u: f64,
    seed: u32,
    wanted: f64,
}

impl Query {
    fn along(origin: DVec3, direction: DVec3, sigma_t: DVec3) -> Query {
        let [begin, end] = [0.0, 10.0];
        Query { origin, direction, begin, end, sigma_t, u: 0.5, seed: 0, wanted: 1.0 }
    }

    fn inputs(&self, grid: usize) -> [[f32; 4]; 4] {
        let xyz = |vector: DVec3, w: f64| vec4(&[vector.x, vector.y, vector.z, w]);
        [
            xyz(self.origin, self.begin),
            xyz(self.direction, self.end),
            xyz(self.sigma_t, grid as f64),
            vec4(&[self.u, f64::from(self.seed), self.wanted, 0.0]),
        ]
    }
}

/// Four vectors of answers for each query.
fn ask(grids: &[layout::Grid], values: &[f32], queries: &[(usize, Query)]) -> Vec<[f32; 4]> {
    let inputs: Vec<[f32; 4]> = queries.iter().flat_map(|(grid, query)| query.inputs(*grid)).collect();
    let tables: [&[u8]; 2] = [bytemuck::cast_slice(grids), bytemuck::cast_slice(values)];
    run("grid", &inputs, &tables, queries.len(), 4 * queries.len())
}

/// Values of Mitsuba 3.9.1 (`scalar_rgb`, `gridvolume`, `eval_1`) for 3 x 4 x 5 voxels of which the k-th is (7 k mod 11)/10.
#[test]
fn voxels_have_mitsuba_s_values() {
    let voxels = grid([3, 4, 5], 1, |x, y, z, _| ((7 * (x + 3 * (y + 4 * z))) % 11) as f64 / 10.0);
    let points = [
        (0.5, 0.5, 0.5),
        (0.1, 0.2, 0.9),
        (0.99, 0.01, 0.35),
        (0.02, 0.5, 0.98),
        (0.3, 0.77, 0.6),
        (1.2, -0.3, 0.4),
        (-0.6, 2.3, 1.7),
    ];
    let expected = [
        (Filter::Bilinear, Wrap::Clamp, [0.85, 0.57, 0.9, 0.45, 0.452, 0.8, 0.3]),
        (Filter::Bilinear, Wrap::Repeat, [0.85, 0.63, 0.621, 0.5884, 0.452, 0.285, 0.65]),
        (Filter::Bilinear, Wrap::Mirror, [0.85, 0.57, 0.9, 0.45, 0.452, 0.715, 0.44]),
        (Filter::Nearest, Wrap::Clamp, [0.8, 0.6, 1.0, 0.4, 0.7, 0.6, 0.3]),
        (Filter::Nearest, Wrap::Repeat, [0.8, 0.6, 1.0, 0.4, 0.7, 0.1, 0.5]),
        (Filter::Nearest, Wrap::Mirror, [0.8, 0.6, 1.0, 0.4, 0.7, 0.5, 0.2]),
    ];
    let mut off = 0.0f64;
    for (filter, wrap, values) in expected {
        let volume = GridVolume { grid: voxels.clone(), to_world: DMat4::IDENTITY, filter, wrap };
        let packed = packed(Volume::Grid(volume), DVec3::ONE);
        let queries: Vec<(usize, Query)> =
            points.iter().map(|&(x, y, z)| (0, Query::along(v(x, y, z), DVec3::X, DVec3::ONE))).collect();
        // The kernel's frame is that of the scene here: its box goes from -1 to 1.
        assert_eq!((packed.frame.scale, packed.frame.center), (1.0, DVec3::ZERO));
        let answers = ask(&packed.grids, &packed.values, &queries);
        for (index, (answer, value)) in answers.chunks(4).zip(values).enumerate() {
            let got = f64::from(answer[0][0]);
            assert!((got - value).abs() < 2e-6, "{filter:?} {wrap:?} {:?}: {got}, expected {value}", points[index]);
        }
        // A density, within its box.
        let volume = GridVolume { grid: voxels.clone(), to_world: DMat4::IDENTITY, filter, wrap };
        let density = packed_density(Volume::Grid(volume), DVec3::ONE);
        assert_eq!(density.media[1].grids & (MEDIUM_DENSITY | MEDIUM_VOXELS), MEDIUM_DENSITY);
        for (index, answer) in ask(&density.grids, &density.values, &queries[..5]).chunks(4).enumerate() {
            let got = f64::from(answer[3][3]);
            assert!((got - values[index]).abs() < 2e-6, "{filter:?} {wrap:?} {:?}: {got}", points[index]);
        }
        // A look-up half a voxel off is another field.
        let shifted: Vec<(usize, Query)> = queries
            .iter()
            .map(|&(grid, query)| (grid, Query { origin: query.origin + v(1.0 / 6.0, 1.0 / 8.0, 0.1), ..query }))
            .collect();
        let answers = ask(&packed.grids, &packed.values, &shifted);
        let worst = answers.chunks(4).zip(values).map(|(answer, value)| (f64::from(answer[0][0]) - value).abs());
        off = worst.fold(off, f64::max);
    }
    assert!(off > 0.1, "half a voxel is not noticed");
    let colored = grid([2, 3, 2], 3, |x, y, z, c| ((5 * (c + 3 * (x + 2 * (y + 3 * z)))) % 13) as f64 / 13.0);
    let packed = packed(Volume::Grid(field(colored, DMat4::IDENTITY)), DVec3::ONE);
    let query = Query::along(v(0.3, 0.77, 0.6), DVec3::X, DVec3::ONE);
    let got = widen(&ask(&packed.grids, &packed.values, &[(0, query)])[0][..3]);
    assert!((got - v(0.5184615, 0.6033769, 0.2876923)).abs().max_element() < 1e-6, "{got}");
    assert!((got - v(0.6033769, 0.5184615, 0.2876923)).abs().max_element() > 1e-2, "channels are told apart");
}

#[test]
fn fields_and_walks_agree_with_the_reference() {
    let mut random = Random(11);
    let place = DMat4::from_rotation_x(0.3) * unit_to(v(-0.9, -0.7, -0.8), v(0.8, 0.9, 0.6));
    let mut value = comparison("grid_value");
    let mut clipped = comparison("clip_to_grid");
    let mut walked = comparison("walk_to_collision");
    let mut flips = 0;
    let mut count = 0;
    for (size, channels, filter, wrap) in [
        ([9, 6, 7], 3, Filter::Bilinear, Wrap::Clamp),
        ([40, 3, 90], 1, Filter::Bilinear, Wrap::Mirror),
        ([1, 1, 1], 1, Filter::Bilinear, Wrap::Repeat),
        ([16, 16, 16], 1, Filter::Nearest, Wrap::Repeat),
    ] {
        let volume = GridVolume { grid: uneven(size, channels), to_world: place, filter, wrap };
        let packed = packed(Volume::Grid(volume), v(3.0, 3.0, 3.0));
        let grid = reference::Grid::from(&packed.grids[0]);
        let queries: Vec<(usize, Query)> = (0..2000)
            .map(|k| {
                let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
                let direction = if k < 3 { axes[k] } else { random.direction() };
                let query = Query::along(random.in_cube() * 1.5, direction, DVec3::splat(3.0));
                let (begin, end) = (random.between(-0.5, 0.5), random.log_between(0.1, 1e6));
                let u = if k % 7 == 0 { 1.0 - 1.0 / 16_777_216.0 } else { random.unit() };
                (0, Query { begin, end, u, seed: k as u32, ..query })
            })
            .collect();
        for ((_, query), answer) in queries.iter().zip(ask(&packed.grids, &packed.values, &queries).chunks(4)) {
            let Query { origin, direction, begin, end, u, .. } = *query;
            let local = reference::grid_local(&grid, origin);
            // Next to the border of two voxels, rounding decides which one is the nearest.
            let at = local * DVec3::from_array(grid.size.map(f64::from));
            if filter == Filter::Bilinear || (at - at.round()).abs().min_element() > 1e-4 {
                value.vector(origin, &answer[0][..3], reference::grid_value(&packed.values, &grid, local));
            }
            let ends = reference::clip_to_grid(&grid, origin, direction, begin, end);
            if (ends.y - ends.x).abs() > 1e-5 {
                for (got, want) in [(answer[2][0], ends.x), (answer[2][1], ends.y)] {
                    if want.abs() < 5.0 {
                        clipped.scalar(origin, got, want);
                    }
                }
            }
            let mut walk = reference::start_grid_walk(&grid, origin, direction, begin, end);
            let mut tau = tyndall::reference::math::minus_log_1m(u);
            let found =
                reference::walk_to_collision(&packed.values, &grid, reference::Rate::Delta, &mut walk, &mut tau);
            count += 1;
            if found != (answer[2][2] >= 0.0 || f64::from(answer[2][2]) > begin - 1e-3 && answer[2][2] != -1.0) {
                flips += 1;
            } else if found && (f64::from(answer[2][3]) / walk.rate - 1.0).abs() < 1e-3 {
                walked.scalar(origin, answer[2][2], walk.t);
            } else if found {
                flips += 1;
            }
        }
    }
    [value, clipped, walked].into_iter().for_each(Comparison::finish);
    assert!(flips * 200 < count, "{flips} of {count} walks end elsewhere");
}

#[test]
fn fog_that_thins_out_agrees_with_the_reference_and_with_quadrature() {
    let mut random = Random(12);
    let field = HeightVolume { base: v(0.1, -0.2, 0.3), up: v(0.3, 1.0, 0.1).normalize(), scale_height: 0.15 };
    let packed = packed(Volume::Height(field), DVec3::ONE);
    let grid = reference::Grid::from(&packed.grids[0]);
    let queries: Vec<(usize, Query)> = (0..3000)
        .map(|k| {
            let direction = match k {
                0 => field.up,
                1 => -field.up,
                // Level, up to rounding.
                2 | 3 => field.up.any_orthonormal_vector(),
                _ => random.direction(),
            };
            let begin = random.between(0.0, 0.5);
            let end = begin + random.log_between(1e-3, if k % 4 == 0 { 1e30 } else { 10.0 });
            let wanted = random.log_between(1e-6, 16.0);
            (0, Query { begin, end, wanted, ..Query::along(random.in_cube() * 1.2, direction, DVec3::ONE) })
        })
        .collect();
    let mut length = comparison("height_length");
    let mut flight = comparison("height_flight");
    let mut log = comparison("log_1p");
    for (k, ((_, query), answer)) in
        queries.iter().zip(ask(&packed.grids, &packed.values, &queries).chunks(4)).enumerate()
    {
        let Query { origin, direction, begin: t_begin, end: t_end, wanted, .. } = *query;
        // What the kernel is given.
        let [t_begin, t_end, wanted] = [t_begin, t_end, wanted].map(|x| f64::from(x as f32));
        let (origin, direction) = (origin.as_vec3().as_dvec3(), direction.as_vec3().as_dvec3());
        let span = reference::Span { origin, direction, t_begin, t_end };
        let dense = reference::height_length(&grid, &span);
        // On a way that is all but level and very long, rounding of the direction decides.
        if dense < 20.0 {
            length.scalar(k, answer[3][0], dense);
        }
        log.scalar(wanted, answer[3][2], reference::log_1p(wanted));
        let way = reference::height_flight(&grid, origin, direction, t_begin, wanted);
        if way < 100.0 {
            flight.scalar(k, answer[3][1], way);
            // The inverse: that way has the density times length that was wanted.
            let there = reference::height_length(&grid, &reference::Span { t_end: t_begin + way, ..span });
            assert!((there - wanted).abs() < 1e-9 * (1.0 + wanted), "{k}: {there} instead of {wanted}");
        }
        if t_end < 20.0 && k < 300 {
            let steps = 4000;
            let height = |t: f64| (origin + direction * t - field.base).dot(field.up) / field.scale_height;
            let density = |t: f64| if height(t) > 0.0 { (-height(t)).exp() } else { 1.0 };
            let step = (t_end - t_begin) / f64::from(steps);
            let sum: f64 = (0..steps).map(|i| density(t_begin + (f64::from(i) + 0.5) * step) * step).sum();
            assert!((sum - dense).abs() < 2e-5 * (1.0 + sum), "{k}: {dense}, by quadrature {sum}");
            assert!(sum < 0.1 || (sum * 1.001 - dense).abs() > 2e-5 * (1.0 + sum), "a fault of 1e-3 is noticed");
        }
    }
    [length, flight, log].into_iter().for_each(Comparison::finish);
}

#[test]
fn densities_are_those_that_are_worth_their_cells() {
    let is_density = |size: [usize; 3], sigma_t: f64, emission: f64| {
        let voxels = grid(size, 1, |x, y, z, _| ((x + 2 * y + 3 * z) % 5) as f64 / 5.0);
        let volume = Volume::Grid(field(voxels, DMat4::IDENTITY));
        let packed = packed_glow(volume, DVec3::splat(sigma_t), DVec3::splat(emission));
        let found = packed.media[1].grids & (MEDIUM_DENSITY | MEDIUM_VOXELS);
        assert_eq!((packed.features.fields, packed.features.voxels), (found == MEDIUM_DENSITY, found == MEDIUM_VOXELS));
        found == MEDIUM_DENSITY
    };
    assert!(is_density([8, 8, 8], 1.0, 0.0));
    assert!(!is_density([8, 8, 8], 1.0, 1.0), "what glows is tracked");
    // The mean chord of the unit cube is 2/3, and crosses as many cells as there are along a side.
    assert!(!is_density([64, 64, 64], 1.0, 0.0) && is_density([64, 64, 64], 20.0, 0.0));
    assert!(!is_density([160, 160, 160], 20.0, 0.0));
}

/// Voxels of which most are empty, and a block has the same value all over.
fn sparse(size: [usize; 3]) -> Arc<tyndall::scene::Grid> {
    grid(size, 1, |x, y, z, _| match (x / 7 + 2 * (y / 9) + 3 * (z / 8)) % 4 {
        0 => 0.5,
        1 => ((5 * x + 3 * y + 7 * z) % 11) as f64 / 11.0,
        _ => 0.0,
    })
}

#[test]
fn densities_agree_with_the_reference_and_with_quadrature() {
    let mut random = Random(15);
    let place = DMat4::from_rotation_x(0.3) * unit_to(v(-0.9, -0.7, -0.8), v(0.8, 0.9, 0.6));
    let mut length = comparison("dense_way's length");
    let mut flight = comparison("dense_way");
    for (voxels, filter, wrap) in [
        (uneven([9, 6, 7], 1), Filter::Bilinear, Wrap::Clamp),
        (uneven([40, 3, 30], 1), Filter::Bilinear, Wrap::Mirror),
        (uneven([1, 1, 1], 1), Filter::Bilinear, Wrap::Repeat),
        (uneven([16, 16, 16], 1), Filter::Nearest, Wrap::Repeat),
        (sparse([33, 40, 29]), Filter::Bilinear, Wrap::Repeat),
        (sparse([33, 40, 29]), Filter::Nearest, Wrap::Clamp),
    ] {
        let volume = GridVolume { grid: voxels, to_world: place, filter, wrap };
        let (dense, tracked) =
            (packed_density(Volume::Grid(volume.clone()), DVec3::splat(1e3)), packed(Volume::Grid(volume), DVec3::ONE));
        assert_eq!(dense.media[1].grids & MEDIUM_DENSITY, MEDIUM_DENSITY);
        let [grid, field] = [&dense, &tracked].map(|packed| reference::Grid::from(&packed.grids[0]));
        let queries: Vec<(usize, Query)> = (0..2000)
            .map(|k| {
                let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
                let direction = if k < 3 { axes[k] } else { random.direction() };
                let (begin, end) = (random.between(-0.5, 0.5), random.log_between(0.1, 1e6));
                let wanted = random.log_between(1e-4, 10.0);
                (0, Query { begin, end, wanted, ..Query::along(random.in_cube() * 1.5, direction, DVec3::ONE) })
            })
            .collect();
        for (k, ((_, query), answer)) in
            queries.iter().zip(ask(&dense.grids, &dense.values, &queries).chunks(4)).enumerate()
        {
            let [t_begin, t_end, wanted] = [query.begin, query.end, query.wanted].map(|x| f64::from(x as f32));
            let (origin, direction) = (query.origin.as_vec3().as_dvec3(), query.direction.as_vec3().as_dvec3());
            let span = reference::Span { origin, direction, t_begin, t_end };
            let all = reference::dense_way(&dense.values, &grid, &span, f64::INFINITY).dense;
            length.scalar(k, answer[3][0], all);
            let found = reference::dense_way(&dense.values, &grid, &span, wanted);
            assert_eq!((found.dense, found.ends), (wanted.min(all), wanted <= all));
            let up_to = |way: f64| {
                let part = reference::Span { t_end: t_begin + way, ..span };
                reference::dense_way(&dense.values, &grid, &part, f64::INFINITY).dense
            };
            // The way of the kernel is that to the wanted length, wherever the density lets a length tell.
            if wanted < 0.999 * all {
                assert!(
                    (up_to(found.way) - wanted).abs() < 1e-8 * (1.0 + wanted),
                    "{k}: {} is not {wanted}",
                    up_to(found.way)
                );
                flight.scalar(k, up_to(f64::from(answer[3][1])) as f32, wanted);
            }
            if k < 100 {
                let ends = reference::clip_to_grid(&field, origin, direction, t_begin, t_end);
                let steps = 20_000;
                let step = (ends.y - ends.x).max(0.0) / f64::from(steps);
                let at = |i: u32| origin + direction * (ends.x + (f64::from(i) + 0.5) * step);
                let value =
                    |i: u32| reference::grid_value(&tracked.values, &field, reference::grid_local(&field, at(i))).x;
                let sum = (0..steps).map(value).sum::<f64>() * step;
                let tolerance = if filter == Filter::Nearest { 2e-3 } else { 2e-6 } * (1.0 + sum);
                assert!((sum - all).abs() < tolerance, "{k}: {all}, by quadrature {sum}");
                assert!(sum < 0.1 || (sum * 1.05 - all).abs() > tolerance, "a fault of 5 % is noticed");
            }
        }
    }
    [length, flight].into_iter().for_each(Comparison::finish);
}

/// Optical depth of a ray through a field, by midpoints.
fn optical_depth(packed: &Packed, sigma_t: f64, query: &Query) -> f64 {
    let grid = reference::Grid::from(&packed.grids[0]);
    let ends = reference::clip_to_grid(&grid, query.origin, query.direction, query.begin, query.end);
    let steps = 40_000;
    let step = (ends.y - ends.x) / f64::from(steps);
    let at = |k: u32| query.origin + query.direction * (ends.x + (f64::from(k) + 0.5) * step);
    let sum: f64 =
        (0..steps).map(|k| reference::grid_value(&packed.values, &grid, reference::grid_local(&grid, at(k))).x).sum();
    sigma_t * sum * step
}

/// Mean, its standard error, and the variance of one estimate.
fn moments(estimates: &[f64]) -> (f64, f64, f64) {
    let (mean, error) = mean_and_error(estimates);
    (mean, error, error * error * estimates.len() as f64)
}

/// Transmittance is unbiased, whatever the cells are. With one cell from 0 to a majorant the estimator is ratio tracking, whose
/// variance is exp(−2 τ + ∫σ²/μ) − T² (Novák et al. 2014); cells that bound the density leave much less.
#[test]
fn transmittance_has_the_right_mean_and_variance() {
    let sigma_t = 2.5;
    let volume = field(uneven([12, 10, 11], 1), unit_to(v(-0.5, -0.5, -0.5), v(0.5, 0.5, 0.5)));
    let direction = v(1.0, 0.13, -0.21).normalize();
    let calm = grid([12, 10, 11], 1, |x, y, z, _| 1.0 + ((3 * x + 5 * y + 7 * z) % 7) as f64 / 7.0);
    for (voxels, uneven) in [(volume.grid.clone(), true), (calm, false)] {
        let packed = packed(Volume::Grid(GridVolume { grid: voxels.clone(), ..volume.clone() }), DVec3::splat(sigma_t));
        let query = Query::along(v(-1.0, 0.02, 0.11), direction, DVec3::splat(sigma_t));
        let tau = optical_depth(&packed, sigma_t, &query);
        let expected = (-tau).exp();
        let queries: Vec<(usize, Query)> = (0..60_000).map(|seed| (0, Query { seed, ..query })).collect();
        let estimate = |values: &[f32]| {
            let answers = ask(&packed.grids, values, &queries);
            let first: Vec<f64> = answers.chunks(4).map(|answer| f64::from(answer[1][0])).collect();
            moments(&first)
        };
        let (mean, error, variance) = estimate(&packed.values);
        assert!(((mean - expected) / error).abs() < 4.0, "{mean} ± {error}, expected {expected}");
        // The reference takes the same random numbers.
        let grid = reference::Grid::from(&packed.grids[0]);
        let span = reference::Span { origin: query.origin, direction, t_begin: 0.0, t_end: 10.0 };
        let by_reference: Vec<f64> = (0..2000)
            .map(|seed| {
                let key = pcg4d([seed, 1, 2, 3]);
                reference::grid_transmittance(&packed.values, &grid, query.sigma_t, false, &span, key, &mut 0).0.x
            })
            .collect();
        let answers = ask(&packed.grids, &packed.values, &queries[..2000]);
        let agree =
            answers.chunks(4).zip(&by_reference).filter(|(a, b)| (f64::from(a[1][0]) - *b).abs() < 1e-4).count();
        assert!(agree > 1990, "only {agree} of 2000 agree");

        // One majorant for all cells.
        let most = f64::from(voxels.max()) * sigma_t * 1.5;
        let mut plain = packed.values.clone();
        let first = packed.grids[0].first_cell as usize;
        for cell in plain[first..].chunks_exact_mut(4) {
            cell.copy_from_slice(&[most as f32, 0.0, 0.0, most as f32]);
        }
        let (plain_mean, plain_error, plain_variance) = estimate(&plain);
        assert!(((plain_mean - expected) / plain_error).abs() < 4.0, "{plain_mean} ± {plain_error}, {expected}");
        let ends = reference::clip_to_grid(&grid, query.origin, direction, 0.0, 10.0);
        let step = (ends.y - ends.x) / 40_000.0;
        let squares: f64 = (0..40_000)
            .map(|k| {
                let at = query.origin + direction * (ends.x + (f64::from(k) + 0.5) * step);
                let value = reference::grid_value(&packed.values, &grid, reference::grid_local(&grid, at)).x;
                (sigma_t * value).powi(2) * step
            })
            .sum();
        let predicted = (-2.0 * tau + squares / most).exp() - expected * expected;
        eprintln!(
            "variance: {variance:.2e} with cells, {plain_variance:.2e} with one majorant, {predicted:.2e} by theory"
        );
        assert!((plain_variance / predicted - 1.0).abs() < 0.05, "{plain_variance} instead of {predicted}");
        assert!(uneven || variance < 0.3 * plain_variance, "cells do not help: {variance} and {plain_variance}");

        // A majorant that is too low, of one cell on the way, is a bias that is noticed.
        let mut wrong = packed.values.clone();
        for cell in wrong[first..].chunks_exact_mut(4) {
            cell[0] *= 0.5;
            cell[0] = cell[0].max(cell[1]);
        }
        let (wrong_mean, wrong_error, _) = estimate(&wrong);
        assert!(((wrong_mean - expected) / wrong_error).abs() > 5.0, "a wrong majorant passes: {wrong_mean}");
    }
}

/// Where delta tracking has its first collision: the distribution function at each is uniform (Kolmogorov and Smirnov).
#[test]
fn collisions_are_where_they_should_be() {
    let sigma_t = 6.0;
    let voxels = grid([8, 1, 1], 1, |x, _, _, _| [0.1, 1.0, 0.0, 0.3, 2.0, 0.0, 0.5, 1.5][x]);
    let to_world = unit_to(v(-0.5, -0.5, -0.5), v(0.5, 0.5, 0.5));
    let volume = GridVolume { grid: voxels.clone(), to_world, filter: Filter::Nearest, wrap: Wrap::Clamp };
    let mut packed = packed(Volume::Grid(volume), DVec3::splat(sigma_t));
    assert_eq!(packed.grids[0].cells_x, 8);
    // With the rate of its voxel in each cell, each tentative collision is a real one.
    let first = packed.grids[0].first_cell as usize;
    for (cell, value) in packed.values[first..].chunks_exact_mut(4).zip(voxels.values()) {
        cell[3] = value * sigma_t as f32;
    }
    let query = Query::along(v(-1.0, 0.1, 0.2), DVec3::X, DVec3::splat(sigma_t));
    let count = 20_000;
    let queries: Vec<(usize, Query)> =
        (0..count).map(|k| (0, Query { u: (f64::from(k) + 0.5) / f64::from(count), ..query })).collect();
    let answers = ask(&packed.grids, &packed.values, &queries);
    let depth = |x: f64| {
        let parts =
            (0..8).map(|k| f64::from(voxels.voxel(k, 0, 0)[0]) * (8.0 * (x + 0.5) - f64::from(k)).clamp(0.0, 1.0));
        parts.sum::<f64>() / 8.0 * sigma_t
    };
    let mut worst = 0.0f64;
    let mut fault = 0.0f64;
    for ((_, query), answer) in queries.iter().zip(answers.chunks(4)) {
        let t = f64::from(answer[2][2]);
        let got = 1.0 - (-depth(if t > 0.0 { t - 1.0 } else { 0.5 })).exp();
        let want = query.u.min(1.0 - (-depth(0.5)).exp());
        worst = worst.max((got - want).abs());
        fault = fault.max((1.0 - (-1.02 * depth(if t > 0.0 { t - 1.0 } else { 0.5 })).exp() - want).abs());
    }
    assert!(worst < 1e-5, "off by {worst}");
    assert!(fault > 2e-3, "two per cent more density are not noticed");
}

#[test]
fn one_bright_voxel_costs_its_cell_alone() {
    let bright = |factor: f64| {
        let voxels = grid([64, 64, 64], 1, |x, y, z, _| if (x, y, z) == (30, 30, 30) { factor } else { 1.0 });
        packed(Volume::Grid(field(voxels, DMat4::IDENTITY)), DVec3::ONE)
    };
    let majorants = |packed: &Packed| {
        let first = packed.grids[0].first_cell as usize;
        packed.values[first..].chunks_exact(4).map(|cell| f64::from(cell[0])).sum::<f64>()
    };
    let (plain, hot) = (bright(1.0), bright(100.0));
    assert_eq!(plain.media[1].grids & MEDIUM_VOXELS, MEDIUM_VOXELS);
    let cells = 8f64.powi(3);
    assert!((majorants(&plain) - cells).abs() < 1e-3 * cells);
    // The voxel is within one cell, and 99 more there.
    assert!(majorants(&hot) < cells + 100.0, "{} and {}", majorants(&plain), majorants(&hot));
}
