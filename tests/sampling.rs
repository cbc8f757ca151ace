//! What the samplers draw, against densities and closed forms that are derived here and not taken from the program.

mod common;

use common::phases;
use common::random::Random;
use common::scenes::v;
use common::statistics::{check_uniform, chi_squared_tail, sidak_bound, student_tails};
use common::truth;
use common::units::{run, vec4};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use tyndall::pack::layout::{LIGHT_POINT, LIGHT_QUAD, LIGHT_SPHERE, LIGHT_TRIANGLE, Light};
use tyndall::pack::sobol;

/// What the phase function's kernel finds for one number.
#[derive(Clone, Copy)]
struct Scattered {
    /// 1 − cos, mirrored for g < 0.
    one_minus_cos: f64,
    cosine: f64,
    sine: f64,
    pdf: f64,
    before: DVec3,
    after: DVec3,
    /// Of the directions before and after.
    eval: f64,
}

fn scatter(g: f64, numbers: &[f64], seed: u64) -> Vec<Scattered> {
    let mut random = Random(seed);
    let mut query = |u: f64| [vec4(&[g, u, random.unit()]), vec4(&random.direction().to_array()), [0.0; 4]];
    let inputs: Vec<[f32; 4]> = numbers.iter().flat_map(|&u| query(u)).collect();
    let outputs = phases::ask(&[], &[], &inputs);
    let one = |(input, output): (&[[f32; 4]], &[[f32; 4]])| {
        let [one_minus_cos, cosine, sine, pdf] = output[0].map(f64::from);
        let direction = |vector: [f32; 4]| Vec3::from_slice(&vector[..3]).as_dvec3();
        let (before, after) = (direction(input[1]), direction(output[1]));
        Scattered { one_minus_cos, cosine, sine, pdf, before, after, eval: f64::from(output[1][3]) }
    };
    inputs.chunks(3).zip(outputs.chunks(2)).map(one).collect()
}

/// g as the kernel knows it.
fn single(g: f64) -> f64 {
    f64::from(g as f32)
}

const ASYMMETRIES: [f64; 11] = [0.0, 1e-6, -1e-6, 0.3, -0.3, 0.9, -0.9, 0.999, -0.999, 0.9999, -0.9999];

/// Henyey and Greenstein's distribution function of m = 1 − cos (of 1 + cos for g < 0), the integral of their density:
///   P(1 − cos ≤ m) = 1 − (1 − a²)/(2 a) (1/√((1 − a)² + 2 a m) − 1/(1 + a)), a = |g|; m/2 for a = 0.
/// With s = √(…): 1/s − 1/(1 + a) = ((1 + a)² − s²)/(s (1 + a) (1 + a + s)) and (1 + a)² − s² = 2 a (2 − m), which does
/// not cancel.
fn distribution(g: f64, m: f64) -> f64 {
    let a = g.abs();
    let s = ((1.0 - a).powi(2) + 2.0 * a * m).sqrt();
    1.0 - (1.0 - a) * (2.0 - m) / (s * (1.0 + a + s))
}

#[test]
fn phase_functions_draw_what_their_density_says() {
    let mut random = Random(21);
    let numbers: Vec<f64> = (0..200_000).map(|_| random.unit()).collect();
    for g in ASYMMETRIES.map(single) {
        let samples = scatter(g, &numbers, 22);
        let ranks =
            |g: f64| samples.iter().map(move |sample| distribution(g, sample.one_minus_cos)).collect::<Vec<_>>();
        check_uniform(ranks(g), 40).unwrap_or_else(|why| panic!("g = {g}: {why}"));
        // The same samples are not those of another g.
        let other = if g == 0.0 { 0.02 } else { g.signum() * (1.0 - (1.0 - g.abs()) * 1.05) };
        if g.abs() > 1e-3 || g == 0.0 {
            check_uniform(ranks(other), 40).expect_err("the samples of another g");
        }
        // Azimuths, in any frame about the direction before.
        let azimuths = samples.iter().filter(|sample| sample.sine > 1e-3).map(|sample| {
            let axis = sample.before;
            let (tangent, bitangent) = axis.any_orthonormal_pair();
            sample.after.dot(bitangent).atan2(sample.after.dot(tangent)) / (2.0 * PI) + 0.5
        });
        check_uniform(azimuths, 20).unwrap_or_else(|why| panic!("g = {g}, azimuth: {why}"));
    }
}

/// Whether the mean of cosines is g: within five standard errors, from the variance (1 + 2 g²)/3 − g² of one.
fn check_mean_cosine(g: f64, cosines: impl Iterator<Item = f64>) -> Result<(), String> {
    let (sum, count) = cosines.fold((0.0, 0.0), |(sum, count), cosine| (sum + cosine, count + 1.0));
    let error = ((1.0 - g * g) / 3.0 / count).sqrt();
    let mean: f64 = sum / count;
    if (mean - g).abs() > 5.0 * error + 1e-7 {
        return Err(format!("the mean cosine is {mean}, g is {g}"));
    }
    Ok(())
}

#[test]
fn the_mean_cosine_is_g() {
    let mut random = Random(23);
    let numbers: Vec<f64> = (0..200_000).map(|_| random.unit()).collect();
    for g in ASYMMETRIES.map(single) {
        let samples = scatter(g, &numbers, 24);
        check_mean_cosine(g, samples.iter().map(|sample| sample.cosine)).unwrap_or_else(|why| panic!("{why}"));
        let of_directions = samples.iter().map(|sample| sample.before.dot(sample.after));
        check_mean_cosine(g, of_directions).unwrap_or_else(|why| panic!("directions: {why}"));
        if g.abs() > 1e-3 {
            check_mean_cosine(-g, samples.iter().map(|sample| sample.cosine)).expect_err("the wrong sign of g");
        }
    }
}

/// Whether a density integrates to 1 over the sphere, from its values at m = 1 − cos in ascending order, by trapezoids:
/// 2π dm is the solid angle.
fn check_integral(points: &[(f64, f64)]) -> Result<(), String> {
    let trapezoid = |pair: &[(f64, f64)]| PI * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0);
    let integral = points.windows(2).map(trapezoid).sum::<f64>() + 2.0 * PI * points[0].0 * points[0].1;
    if (integral - 1.0).abs() > 1e-4 {
        return Err(format!("the density integrates to {integral}"));
    }
    Ok(())
}

#[test]
fn densities_integrate_to_one_and_weights_are_one() {
    for g in ASYMMETRIES.map(single) {
        // Angles from the narrowest peak to straight back, evenly in the logarithm.
        let angles = (0..=6000).map(|k| 2.0 * 10f64.powf(-13.0 * (1.0 - f64::from(k) / 6000.0)));
        let numbers: Vec<f64> = angles
            .map(|m| if g >= 0.0 { 1.0 - distribution(g, m) } else { distribution(g, m) })
            .map(|u| u.clamp(0.0, 1.0 - 1.0 / 16_777_216.0))
            .collect();
        let samples = scatter(g, &numbers, 25);
        let mut points: Vec<(f64, f64)> = samples.iter().map(|sample| (sample.one_minus_cos, sample.pdf)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        check_integral(&points).unwrap_or_else(|why| panic!("g = {g}: {why}"));
        let brighter: Vec<_> = points.iter().map(|(m, pdf)| (*m, pdf * 1.001)).collect();
        check_integral(&brighter).expect_err("a density that is too large");
        for sample in &samples {
            // The weight f/pdf of a sample is 1, to what single precision leaves of the direction: an error e of a unit
            // vector is an error e/sin of the angle, and the density changes with the angle on the scale of 1 - |g|.
            let scale = (2.0 * sample.one_minus_cos + (1.0 - g.abs()).powi(2)).sqrt();
            let tolerance = 2e-6 + 6e-7 / scale;
            let weight = sample.eval / sample.pdf;
            assert!((weight - 1.0).abs() < tolerance, "g = {g}: weight {weight} at 1 - cos = {}", sample.one_minus_cos);
        }
    }
}

#[test]
fn phase_functions_agree_with_the_table() {
    for row in truth::table("G") {
        let (g, numbers) = (row.number("g"), row.list("xi"));
        let samples = scatter(g, &numbers, 26);
        let [cosines, one_minus, pdfs] = ["cos", "one_minus_cos", "pdf"].map(|name| row.output(name).0);
        let wrong = |sign: f64, factor: f64| {
            samples.iter().enumerate().find_map(|(k, sample)| {
                // The kernel keeps 1 - cos for g >= 0 and 1 + cos for g < 0; the other follows from the cosine.
                let m = if g >= 0.0 { one_minus[k] } else { 1.0 + cosines[k] };
                let resolved = g >= 0.0 || m > 1e-6;
                let right = (sample.cosine - sign * cosines[k]).abs() < 4e-7
                    && (!resolved || (sample.one_minus_cos - m).abs() <= 1e-6 * m)
                    && (sample.pdf - factor * pdfs[k]).abs() <= 3e-6 * pdfs[k];
                (!right).then(|| format!("{}: xi = {}", row.id, numbers[k]))
            })
        };
        assert_eq!(wrong(1.0, 1.0), None);
        assert!(wrong(-1.0, 1.0).is_some() && wrong(1.0, 1.001).is_some(), "{}: blind", row.id);
        // As many in each of the twenty bins of equal probability: of the cosine, or of 1 - cos where the peak is narrow.
        let mut random = Random(28);
        let drawn = scatter(g, &(0..100_000).map(|_| random.unit()).collect::<Vec<_>>(), 29);
        let narrow = g.abs() > 0.99;
        let name = if narrow { "equiprobable_m_edges20_absg" } else { "equiprobable_cos_edges20" };
        let mut edges = row.output(name).0;
        edges.sort_by(f64::total_cmp);
        assert_eq!(edges.len(), 21, "{}", row.id);
        let in_bins = |shift: f64| {
            let place = |sample: &Scattered| if narrow { sample.one_minus_cos } else { sample.cosine } + shift;
            let bin = |place: f64| edges[1..20].partition_point(|edge| *edge <= place);
            check_uniform(drawn.iter().map(|sample| (bin(place(sample)) as f64 + 0.5) / 20.0), 20)
        };
        in_bins(0.0).unwrap_or_else(|why| panic!("{}: {why}", row.id));
        in_bins((edges[11] - edges[10]) * 0.2).expect_err("samples that are shifted by a fifth of a bin");
        // Legendre moments, over numbers in the middles of equal intervals: <P_l> = g^l.
        let count = 1 << 16;
        let middles: Vec<f64> = (0..count).map(|k| (f64::from(k) + 0.5) / f64::from(count)).collect();
        let samples = scatter(g, &middles, 27);
        let moment = |polynomial: fn(f64) -> f64| {
            samples.iter().map(|sample| polynomial(sample.cosine)).sum::<f64>() / f64::from(count)
        };
        let moments = [
            moment(|c| c),
            moment(|c| 1.5 * c * c - 0.5),
            moment(|c| (5.0 * c * c - 3.0) * c / 2.0),
            moment(|c| ((35.0 * c * c - 30.0) * c * c + 3.0) / 8.0),
        ];
        for (order, found) in (1..).zip(moments) {
            let expected = g.powi(order);
            assert!((found - expected).abs() < 2e-5, "{}: <P_{order}> is {found}, expected {expected}", row.id);
        }
    }
}

#[test]
fn warps_draw_what_their_densities_say() {
    let mut random = Random(31);
    let widths = [2.0, 0.3, 1e-4, 1e-9];
    for width in widths.map(single) {
        let inputs: Vec<[f32; 4]> = (0..100_000).map(|_| vec4(&[random.unit(), random.unit(), width])).collect();
        let outputs: Vec<[f32; 4]> = run("warp", &inputs, &[], inputs.len(), 3 * inputs.len());
        let column = |k: usize| outputs.iter().skip(k).step_by(3).map(|output| output.map(f64::from));
        let squared = |[x, y, ..]: [f64; 4]| x * x + y * y;
        let azimuth = |[x, y, ..]: [f64; 4]| y.atan2(x) / (2.0 * PI) + 0.5;
        // Distribution functions: of z for the sphere, of z² for the hemisphere, of 1 - z (from the sine) for the cone.
        let sphere = |[_, _, z, _]: [f64; 4]| (z + 1.0) / 2.0;
        let cone = |direction: [f64; 4]| {
            let sine_squared = squared(direction);
            let beyond = direction[2] < 0.0;
            let cosine = (1.0 - sine_squared.min(1.0)).sqrt();
            (if beyond { 1.0 + cosine } else { sine_squared / (1.0 + cosine) }) / width
        };
        for (name, result) in [
            ("sphere", check_uniform(column(0).map(sphere), 50)),
            ("hemisphere", check_uniform(column(1).map(squared), 50)),
            ("cone", check_uniform(column(2).map(cone), 50)),
            ("sphere, azimuth", check_uniform(column(0).map(azimuth), 36)),
            ("hemisphere, azimuth", check_uniform(column(1).map(azimuth), 36)),
            ("cone, azimuth", check_uniform(column(2).map(azimuth), 36)),
        ] {
            result.unwrap_or_else(|why| panic!("{name} of width {width}: {why}"));
        }
        check_uniform(column(1).map(sphere), 50).expect_err("the hemisphere is not the sphere");
        check_uniform(column(0).map(squared), 50).expect_err("the sphere is not the hemisphere");
        check_uniform(column(2).map(|direction| cone(direction) * 0.98), 50).expect_err("a cone of another width");
        // Densities of uniform distributions are 1 over the solid angle; of the hemisphere, cos/π.
        for (k, output) in outputs.iter().enumerate() {
            let expected = [1.0 / (4.0 * PI), f64::from(output[2]) / PI, 1.0 / (2.0 * PI * width)][k % 3];
            assert!((f64::from(output[3]) / expected - 1.0).abs() < 1e-6, "density {} for {expected}", output[3]);
        }
    }
}

#[test]
fn free_flights_are_exponential() {
    let mut random = Random(41);
    let numbers: Vec<f64> = (0..100_000).map(|_| random.unit()).collect();
    let inputs: Vec<[f32; 4]> = numbers.iter().flat_map(|&u| [vec4(&[u, 1.0]), vec4(&[0.0, 0.0, 1.0])]).collect();
    let depths: Vec<[f32; 4]> = run("math", &inputs, &[], numbers.len(), 4 * numbers.len());
    for sigma in [1e-12, 1e-3, 1.0, 37.0, 1e8].map(single) {
        let inputs: Vec<[f32; 4]> = depths
            .chunks(4)
            .flat_map(|depth| [[0.5, depth[0][0], sigma as f32, 0.0], [1.0; 4], [1.0; 4], [1.0; 4], [1.0; 4]])
            .collect();
        let outputs: Vec<[f32; 4]> = run("medium", &inputs, &[], numbers.len(), 5 * numbers.len());
        let distances: Vec<f64> = outputs.iter().step_by(5).map(|output| f64::from(output[1])).collect();
        let ranks = |sigma: f64| distances.iter().map(move |t| 1.0 - (-sigma * t).exp()).collect::<Vec<_>>();
        check_uniform(ranks(sigma), 50).unwrap_or_else(|why| panic!("sigma_t = {sigma}: {why}"));
        check_uniform(ranks(sigma * 1.03), 50).expect_err("another extinction");
        // The mean free path, from all numbers.
        let mean = distances.iter().sum::<f64>() / distances.len() as f64 * sigma;
        assert!((mean - 1.0).abs() < 5.0 / (distances.len() as f64).sqrt(), "sigma_t = {sigma}: mean {mean}");
    }
}

/// Irradiance from a polygon of radiance 1, all of it above the horizon: Lambert (1760), E = ½ Σ θ_i n · Γ_i with the
/// angle θ_i under which an edge is seen and the unit normal Γ_i of the plane through it and the point.
fn lambert(corners: &[DVec3], point: DVec3, normal: DVec3) -> f64 {
    let seen: Vec<DVec3> = corners.iter().map(|corner| (*corner - point).normalize()).collect();
    let edge = |k: usize| {
        let (a, b) = (seen[k], seen[(k + 1) % seen.len()]);
        a.angle_between(b) * normal.dot(a.cross(b).normalize())
    };
    (0..seen.len()).map(edge).sum::<f64>().abs() / 2.0
}

#[test]
fn lights_give_the_irradiance_of_closed_forms() {
    let plane = |kind, area: f32| Light {
        origin: Vec3::new(-0.3, 0.9, -0.2),
        kind,
        edge_1: Vec3::new(0.6, 0.0, 0.0),
        edge_2: Vec3::new(0.1, 0.0, 0.5),
        area,
        normal: Vec3::NEG_Y,
        radiance: Vec3::ONE,
        ..Light::default()
    };
    let sphere = |center: Vec3, radius: f32, side: f32| Light {
        origin: center,
        kind: LIGHT_SPHERE,
        edge_1: Vec3::new(radius, side, 0.0),
        radiance: Vec3::ONE,
        ..Light::default()
    };
    let point_light =
        Light { kind: LIGHT_POINT, origin: Vec3::new(0.3, 0.8, 0.1), radiance: Vec3::ONE, ..Light::default() };
    let lights = [
        plane(LIGHT_TRIANGLE, 0.15),
        plane(LIGHT_QUAD, 0.3),
        sphere(Vec3::new(0.2, 1.0, -0.1), 0.4, 1.0),
        sphere(Vec3::new(0.2, 1.0, -0.1), 1e-3, 1.0),
        sphere(Vec3::ZERO, 4.0, -1.0),
        point_light,
    ];
    let normal = DVec3::Y;
    let [a, b, c] = [v(-0.3, 0.9, -0.2), v(0.3, 0.9, -0.2), v(-0.2, 0.9, 0.3)];
    for point in [DVec3::ZERO, v(0.7, 0.2, 0.5), v(-1.5, -1.0, 1.0)] {
        let center = v(0.2, 1.0, -0.1) - point;
        // A sphere above the horizon: the projected solid angle of its cone, π sin² θ, times the cosine to its centre.
        let of_sphere = |radius: f64| PI * (radius / center.length()).powi(2) * center.normalize().dot(normal);
        let to_point = v(0.3, 0.8, 0.1) - point;
        let expected = [
            lambert(&[a, b, c], point, normal),
            lambert(&[a, b, b + c - a, c], point, normal),
            of_sphere(0.4),
            of_sphere(1e-3),
            PI,
            to_point.normalize().dot(normal) / to_point.length_squared(),
        ];
        for (index, expected) in expected.into_iter().enumerate() {
            let side = 256;
            let inputs: Vec<[f32; 4]> = (0..side * side)
                .flat_map(|k| {
                    let middle = |k: i32| (f64::from(k) + 0.5) / f64::from(side);
                    let [x, y, z] = point.to_array();
                    [vec4(&[x, y, z, middle(k / side)]), vec4(&[middle(k % side), index as f64])]
                })
                .collect();
            let count = (side * side) as usize;
            let outputs: Vec<[f32; 4]> = run("light", &inputs, &[bytemuck::cast_slice(&lights)], count, 4 * count);
            let found = outputs
                .chunks(4)
                .map(|output| {
                    normal.dot(Vec3::from_slice(&output[0][..3]).as_dvec3()).max(0.0) * f64::from(output[1][0])
                })
                .sum::<f64>()
                / count as f64;
            let agrees = |found: f64| (found / expected - 1.0).abs() < 5e-4;
            assert!(agrees(found), "light {index} from {point}: {found}, expected {expected}");
            assert!(!agrees(found * 1.01) && !agrees(found * 0.99), "the comparison is blind");
            // The weight is the radiance over the density; to find a point has no density.
            for output in outputs.chunks(4).filter(|output| output[1][3] > 0.0) {
                assert!((f64::from(output[1][0]) * f64::from(output[1][3]) - 1.0).abs() < 1e-5, "{output:?}");
            }
        }
    }
}

/// The sampler's numbers for (seed, pixel, set, index).
fn numbers(inputs: &[[u32; 4]]) -> Vec<[f64; 4]> {
    let table = sobol::points();
    let outputs: Vec<[u32; 4]> =
        run("sampler", inputs, &[bytemuck::cast_slice(&table)], inputs.len(), 2 * inputs.len());
    outputs.chunks(2).map(|output| output[0].map(f32::from_bits).map(f64::from)).collect()
}

/// Points of a set for some samples of a pixel.
fn points(seed: u32, pixel: u32, set: u32, first: u32, count: u32) -> Vec<[f64; 4]> {
    let inputs: Vec<[u32; 4]> = (first..first + count).map(|index| [seed, pixel, set, index]).collect();
    numbers(&inputs)
}

/// Whether every elementary interval of the shape 2^-d₀ × 2^-d₁ … has the same number of points.
fn equidistributed(points: &[[f64; 4]], splits: [u32; 4]) -> bool {
    let cells = 1usize << splits.iter().sum::<u32>();
    let mut counts = vec![0; cells];
    for point in points {
        let cell =
            point.iter().zip(splits).fold(0, |cell, (x, split)| (cell << split) + (x * f64::from(1 << split)) as usize);
        counts[cell] += 1;
    }
    counts.iter().all(|count| count * cells == points.len())
}

/// All ways to split `total` over four dimensions.
fn shapes(total: u32) -> Vec<[u32; 4]> {
    let mut shapes = Vec::new();
    for a in 0..=total {
        for b in 0..=total - a {
            for c in 0..=total - a - b {
                shapes.push([a, b, c, total - a - b - c]);
            }
        }
    }
    shapes
}

/// Whether points are as even as Sobol's: each dimension stratified, the first two a (0, m, 2)-net, and all four a (3,
/// m, 4)-net, 3 being the sum of the degrees less one of the polynomials of dimensions 2 to 4 (Niederreiter 1987).
fn check_net(points: &[[f64; 4]]) -> Result<(), String> {
    let m = points.len().ilog2();
    for axis in 0..4 {
        let mut splits = [0; 4];
        splits[axis] = m;
        if !equidistributed(points, splits) {
            return Err(format!("dimension {axis} is not stratified in {m} bits"));
        }
    }
    for a in 0..=m {
        if !equidistributed(points, [a, m - a, 0, 0]) {
            return Err(format!("no (0, {m}, 2)-net: {a} and {} bits", m - a));
        }
    }
    match shapes(m.saturating_sub(3)).into_iter().find(|splits| !equidistributed(points, *splits)) {
        Some(splits) => Err(format!("no (3, {m}, 4)-net: {splits:?} bits")),
        None => Ok(()),
    }
}

#[test]
fn sobol_points_are_nets() {
    let mut random = Random(51);
    for set in 0..4 {
        let (seed, pixel) = (random.bits() as u32, random.bits() as u32);
        let all = points(seed, pixel, set, 0, 1024);
        // Every aligned run of a power of two is a net: so is what a block or a part of a render holds.
        for m in 0..=10 {
            for (k, part) in all.chunks(1 << m).enumerate() {
                check_net(part).unwrap_or_else(|why| panic!("set {set}, points {k} of 2^{m}: {why}"));
            }
        }
        // Beyond the table the sequence begins again, with other shifts.
        let again = points(seed, pixel, set, 1024, 1024);
        check_net(&again).unwrap_or_else(|why| panic!("set {set}, second round: {why}"));
        assert_ne!(all, again);
        // Points that are only random are no net, nor are a net's with one moved.
        check_net(&points(seed, pixel, 9, 0, 1024)).expect_err("hashed numbers");
        let mut moved = all.clone();
        moved[77][2] = (moved[77][2] + 0.5).fract();
        check_net(&moved).expect_err("a net with one point moved");
    }
}

#[test]
fn sets_and_pixels_are_independent_of_each_other() {
    // One number of one set against one of another, over many pixels: uniform on the square.
    let inputs: Vec<[u32; 4]> =
        (0..100_000u32).flat_map(|pixel| [[1, pixel, pixel % 6, 3], [1, pixel, pixel % 6 + 1, 3]]).collect();
    let outputs = numbers(&inputs);
    for (one, two) in [(0, 0), (0, 1), (2, 3), (3, 1)] {
        let pairs = outputs.chunks(2).map(|pair| {
            let (a, b) = (pair[0][one], pair[1][two]);
            ((a * 10.0).floor() + b) / 10.0
        });
        check_uniform(pairs, 100).unwrap_or_else(|why| panic!("dimensions {one} and {two}: {why}"));
    }
    let same = outputs.chunks(2).map(|pair| ((pair[0][0] * 10.0).floor() + pair[0][0]) / 10.0);
    check_uniform(same, 100).expect_err("a number is not independent of itself");
}

#[test]
fn the_tests_statistics_agree_with_printed_tables() {
    // Abramowitz and Stegun, tables 26.8 and 26.10.
    for (x, freedom, probability) in
        [(18.307, 10.0, 0.05), (3.841, 1.0, 0.05), (29.588, 10.0, 0.001), (3.940, 10.0, 0.95)]
    {
        assert!((chi_squared_tail(x, freedom) / probability - 1.0).abs() < 1e-3, "chi² = {x}");
    }
    for (t, freedom, probability) in [(2.228, 10.0, 0.05), (2.0, 60.0, 0.05), (3.460, 60.0, 0.001)] {
        assert!((student_tails(t, freedom) / probability - 1.0).abs() < 5e-3, "t = {t}");
    }
    assert!((sidak_bound(30, 63.0) - 4.5).abs() < 0.05);
}

#[test]
fn directions_are_those_of_another_implementation() {
    let directions = sobol::directions();
    let differs = |index: u32, dimension: usize| {
        let digits =
            (0..16).filter(|bit| index >> bit & 1 == 1).fold(0, |value, bit| value ^ directions[bit][dimension]);
        // The crate has the first 16 digits, before it scrambles them.
        let oracle = sobol_burley::parts::sobol_rev(index.reverse_bits(), dimension as u32).reverse_bits();
        (digits ^ oracle) >> 16 != 0
    };
    for dimension in 0..4 {
        assert_eq!((0..1 << 16).find(|&index| differs(index, dimension)), None, "dimension {dimension}");
    }
}
