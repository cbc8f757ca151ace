//! Rectangular lights, sampled by solid angle: their distribution, density, closed forms, and the variance they save.

mod common;

use common::images;
use common::random::Random;
use common::scenes::{self, v};
use common::statistics::{check_uniform, mean_and_error};
use common::units::{run, vec4};
use glam::{DVec2, DVec3, Vec3};
use tyndall::pack::layout::{LIGHT_QUAD, LIGHT_RECTANGLE, LIGHT_TRIANGLE, Light};
use tyndall::pack::lights::LightTable;
use tyndall::reference::{bindings, light};
use tyndall::scene::{Camera, Film, Scene, Shape};

/// A rectangle of radiance 1 in the plane y = 0 that shines downwards, [0, 2] × [0, 1] in x and z.
fn rectangle(kind: u32) -> Light {
    Light {
        kind,
        edge_1: Vec3::new(2.0, 0.0, 0.0),
        edge_2: Vec3::new(0.0, 0.0, 1.0),
        area: 2.0,
        normal: Vec3::NEG_Y,
        radiance: Vec3::ONE,
        ..Light::default()
    }
}

const WIDTH: f64 = 2.0;
const DEPTH: f64 = 1.0;

/// Points below the rectangle: near, far, below its corner, its edge and its middle, and seen at a flat angle. All are sampled by solid angle.
fn points() -> Vec<DVec3> {
    vec![
        v(1.0, -1.0, 0.5),
        v(1.3, -0.05, 0.2),
        v(1.3, -1e-3, 0.2),
        v(1.3, -1e-5, 0.8),
        v(0.0, -0.3, 0.0),
        v(2.0, -0.01, 1.0),
        v(0.7, -0.02, 0.0),
        v(-3.0, -2.0, -1.0),
        v(-3.0, -0.5, -1.0),
        v(-0.3, -0.02, 0.5),
        v(2.1, -0.02, 1.2),
        v(1.0, -30.0, 2.0),
        v(-40.0, -25.0, -30.0),
        v(4.0, -4.0, 12.0),
    ]
}

/// Solid angle of the part [0, x] × [0, z] of the rectangle, by the corners: Σ ± atan(x y / (h √(x² + y² + h²))). In double precision
/// its cancellation does no harm here.
fn part(point: DVec3, x: f64, z: f64) -> f64 {
    let h = -point.y;
    let corner = |x: f64, z: f64| {
        let (x, z) = (x - point.x, z - point.z);
        (x * z).atan2(h * (x * x + z * z + h * h).sqrt())
    };
    corner(x, z) - corner(0.0, z) - corner(x, 0.0) + corner(0.0, 0.0)
}

fn solid_angle(point: DVec3) -> f64 {
    part(point, WIDTH, DEPTH)
}

/// What the kernel finds for numbers of its two dimensions: triples of its outputs.
fn sampled(kind: u32, point: DVec3, numbers: &[DVec2]) -> Vec<[[f32; 4]; 3]> {
    let [x, y, z] = point.to_array();
    let inputs: Vec<[f32; 4]> = numbers.iter().flat_map(|u| [vec4(&[x, y, z, u.y]), vec4(&[u.x, 0.0])]).collect();
    let lights = [rectangle(kind)];
    let count = numbers.len();
    let outputs: Vec<[f32; 4]> = run("light", &inputs, &[bytemuck::cast_slice(&lights)], count, 4 * count);
    outputs.chunks(4).map(|output| [output[0], output[1], output[2]]).collect()
}

/// Where a sample lies on the rectangle.
fn place(point: DVec3, output: &[[f32; 4]; 3]) -> DVec2 {
    let direction = common::units::widen(&output[0][..3]);
    let hit = point + direction * f64::from(output[0][3]);
    DVec2::new(hit.x, hit.z)
}

fn random_numbers(seed: u64, count: usize) -> Vec<DVec2> {
    let mut random = Random(seed);
    (0..count).map(|_| DVec2::new(random.unit(), random.unit())).collect()
}

/// Whether points are uniform by solid angle as a place sees them: χ² over 8 × 8 cells of equal solid angle. The first
/// coordinate is the share of the solid angle below x, the second that of the strip at x below z, which is uniform in
/// z/√(z² + d²), d being the distance from the line at x along z.
fn uniform_by_solid_angle(seen_from: DVec3, places: &[DVec2]) -> Result<f64, String> {
    let total = solid_angle(seen_from);
    let cells = places.iter().map(|place| {
        let x = place.x.clamp(0.0, WIDTH);
        let first = part(seen_from, x, DEPTH) / total;
        let d2 = (x - seen_from.x).powi(2) + seen_from.y.powi(2);
        let sine = |z: f64| (z - seen_from.z) / ((z - seen_from.z).powi(2) + d2).sqrt();
        let second = (sine(place.y) - sine(0.0)) / (sine(DEPTH) - sine(0.0));
        ((first * 8.0).floor().clamp(0.0, 7.0) + second.clamp(0.0, 0.999_999)) / 8.0
    });
    check_uniform(cells, 64)
}

#[test]
fn rectangles_are_sampled_uniformly_by_solid_angle() {
    for (seed, point) in (1..).zip(points()) {
        let numbers = random_numbers(seed, 40_000);
        let places =
            |kind| sampled(kind, point, &numbers).iter().map(|output| place(point, output)).collect::<Vec<_>>();
        let found = places(LIGHT_RECTANGLE);
        // Rounding of the direction moves a point that is seen at a flat angle.
        let slack = 1e-4 + 3e-6 * point.length() / -point.y;
        for place in &found {
            let inside = (-slack..=WIDTH + slack).contains(&place.x) && (-slack..=DEPTH + slack).contains(&place.y);
            assert!(inside, "{point}: {place} is outside of the rectangle");
        }
        let probability = uniform_by_solid_angle(point, &found)
            .unwrap_or_else(|why| panic!("{point}, {} sr: {why}", solid_angle(point)));
        eprintln!("{point}: {:.3e} sr, probability {probability:.3}", solid_angle(point));
        // Near the light, uniform points are something else; so is what another point sees.
        if solid_angle(point) > 0.2 {
            uniform_by_solid_angle(point, &places(LIGHT_QUAD)).expect_err("uniform by area");
            let other = point + v(0.1, -0.1, 0.0);
            uniform_by_solid_angle(other, &found).expect_err("seen from elsewhere");
        }
    }
}

#[test]
fn their_density_is_one_over_the_solid_angle() {
    let mut random = Random(7);
    let mut worst = 0.0f64;
    let mut by_area = [0; 2];
    let numbers = [DVec2::new(0.3, 0.6)];
    let mut cases = points();
    cases.extend((0..300).map(|_| v(1.0, 0.0, 0.5) + random.direction() * random.log_between(0.01, 200.0)));
    // About the threshold, from which the solid angle is used: 2 cos^4/(h²) sr.
    cases.extend((0..60).map(|k| v(f64::from(k % 4) * 20.0, -70.0 - f64::from(k), 0.5)));
    for point in cases {
        let point = point.as_vec3().as_dvec3();
        let [direction, weight, asked] = sampled(LIGHT_RECTANGLE, point, &numbers)[0];
        let cosine = f64::from(direction[1]);
        if point.y >= 0.0 {
            assert_eq!([weight[0], weight[3]], [0.0; 2], "{point} is on the dark side");
            continue;
        }
        let uniform = f64::from(direction[3]).powi(2) / (2.0 * cosine);
        let expected = solid_angle(point).recip();
        // Both techniques must be consistent: what is asked for is what was sampled with, and the weight its inverse.
        let [found, asked] = [weight[3], asked[0]].map(f64::from);
        assert!((asked / found - 1.0).abs() < 1e-5, "{point}: sampled with {found}, asked for {asked}");
        assert!((f64::from(weight[0]) * found - 1.0).abs() < 1e-6, "{point}: weight {} of {found}", weight[0]);
        let error = (found / expected - 1.0).abs();
        let area = expected > 1.0 / light::LEAST_SOLID_ANGLE || error > 1e-4;
        if area {
            // Flat, or far away: by area, to what the cosine has of digits.
            assert!((found / uniform - 1.0).abs() < 1e-5, "{point}: {found}, neither {expected} nor {uniform}");
        } else {
            worst = worst.max(error);
        }
        by_area[usize::from(area)] += 1;
        if points().contains(&point) {
            assert!(!area, "{point} is not sampled by solid angle");
        }
    }
    eprintln!("largest relative error {worst:.1e}; {} by solid angle, {} by area", by_area[0], by_area[1]);
    assert!(by_area.iter().all(|&count| count > 50), "one of both is not tested: {by_area:?}");
}

/// ∫ pdf dω over the rectangle, by the midpoint rule in the reference; `fault` is put on the density.
fn total_probability(point: DVec3, fault: impl Fn(f64) -> f64) -> f64 {
    let light = bindings::Light::from(&rectangle(LIGHT_RECTANGLE));
    let side = 1000;
    let cell = WIDTH * DEPTH / f64::from(side * side);
    let middle = |k: i32| (f64::from(k) + 0.5) / f64::from(side);
    let mut sum = 0.0;
    for k in 0..side * side {
        let offset = v(WIDTH * middle(k % side), 0.0, DEPTH * middle(k / side)) - point;
        let cosine = offset.y / offset.length();
        let pdf = light::rectangle_light_pdf(&light, point, offset.length(), cosine);
        sum += fault(pdf) * cosine / offset.length_squared() * cell;
    }
    sum
}

#[test]
fn their_density_integrates_to_one() {
    let mut places: Vec<DVec3> = points().into_iter().filter(|point| point.y <= -0.01).collect();
    // By area: flat, beyond the edge, and far.
    places.extend([v(-3.0, -0.05, 0.4), v(4.0, -0.02, 3.0), v(30.0, -200.0, 20.0)]);
    for point in places {
        let found = total_probability(point, |pdf| pdf);
        assert!((found - 1.0).abs() < 2e-4, "{point}: {found}");
        assert!((total_probability(point, |pdf| pdf * 1.002) - 1.0).abs() > 1e-3);
    }
}

/// Irradiance from a rectangle of radiance 1 on a parallel surface at the distance h: π times the configuration factor, which is,
/// of a rectangle a × b with a corner above the point (Siegel and Howell, Thermal Radiation Heat Transfer),
///   [A/√(1 + A²) atan(B/√(1 + A²)) + B/√(1 + B²) atan(A/√(1 + B²))]/2π        A = a/h, B = b/h.
fn irradiance(point: DVec3) -> f64 {
    let corner = |x: f64, z: f64| {
        let (a, b) = ((x - point.x) / -point.y, (z - point.z) / -point.y);
        let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        0.5 * (a / p * (b / p).atan() + b / q * (a / q).atan())
    };
    corner(WIDTH, DEPTH) - corner(0.0, DEPTH) - corner(WIDTH, 0.0) + corner(0.0, 0.0)
}

#[test]
fn they_give_the_irradiance_of_the_configuration_factor_with_less_variance() {
    for (seed, point) in (30..).zip(points().into_iter().filter(|point| point.y <= -0.01)) {
        let numbers = random_numbers(seed, 60_000);
        let estimate = |kind| {
            let values: Vec<f64> = sampled(kind, point, &numbers)
                .iter()
                .map(|output| f64::from(output[1][0]) * f64::from(output[0][1]))
                .collect();
            mean_and_error(&values)
        };
        let expected = irradiance(point);
        let (mean, error) = estimate(LIGHT_RECTANGLE);
        let (by_area, error_by_area) = estimate(LIGHT_QUAD);
        let gain = (error_by_area / error).powi(2);
        eprintln!("{point}: {expected:.4e}, relative error {:.4}, variance {gain:.2} times less", error / expected);
        assert!(
            (mean - expected).abs() < 4.0 * error + 1e-5 * expected,
            "{point}: {mean} ± {error}, expected {expected}"
        );
        let deviation = (by_area - expected).abs() / error_by_area;
        assert!(deviation < 4.0, "{point}: by area {by_area}, {deviation:.1} standard errors from {expected}");
        let fault = (mean * 1.02 - expected).abs();
        assert!(fault > 4.0 * error + 1e-5 * expected, "{point}: blind to 2 %");
        assert!(gain > 1.0 || solid_angle(point) < 0.05, "{point}: more variance than by area, {gain}");
        assert!(gain > 2.0 || solid_angle(point) < 2.0, "{point}: hardly less variance than by area, {gain}");
    }
}

#[test]
fn what_counts_as_a_rectangle() {
    let kind = |one: Vec3, two: Vec3| {
        let corner = Vec3::new(0.1, 0.2, 0.3);
        let triangles = [[corner, corner + one, corner + one + two], [corner, corner + one + two, corner + two]];
        let mut table = LightTable::default();
        table.add_triangles(&triangles, DVec3::ONE, |_| true);
        let lights = table.finish();
        assert_eq!(lights.len(), 1);
        lights[0].kind
    };
    let (x, z) = (Vec3::X * 0.5, Vec3::Z * 0.25);
    assert_eq!(kind(x, z), LIGHT_RECTANGLE);
    assert_eq!(kind(z, x), LIGHT_RECTANGLE);
    assert_eq!(kind(Vec3::new(0.3, 0.4, 0.0), Vec3::new(-0.04, 0.03, 0.0)), LIGHT_RECTANGLE);
    assert_eq!(kind(x, z + Vec3::X * 1e-3), LIGHT_QUAD, "slanted");
    assert_eq!(kind(x, z * 0.2), LIGHT_RECTANGLE, "narrow");
    assert_eq!(kind(x, z * 0.02), LIGHT_QUAD, "too narrow");
    let mut table = LightTable::default();
    table.add_triangles(&[[Vec3::ZERO, x, z]], DVec3::ONE, |_| true);
    assert_eq!(table.finish()[0].kind, LIGHT_TRIANGLE);
}

/// A lamp close above a floor and beside a wall, so that scattered rays find it often, in thin fog.
fn corner_lamp() -> Scene {
    let mut scene = Scene::new(Camera::look_at(v(0.3, 0.6, 3.0), v(0.0, 0.2, 0.0), DVec3::Y, 40.0), Film::new(16, 16));
    let floor = scenes::quad(v(-2.0, 0.0, 2.0), DVec3::X * 4.0, DVec3::NEG_Z * 4.0);
    let wall = scenes::quad(v(-2.0, 0.0, -1.0), DVec3::X * 4.0, DVec3::Y * 2.0);
    scene.shapes.push(Shape::diffuse("floor", floor, v(0.8, 0.5, 0.3)));
    scene.shapes.push(Shape::diffuse("wall", wall, v(0.3, 0.5, 0.8)));
    let lamp = scenes::quad(v(-0.8, 0.3, -0.9), DVec3::X * 1.6, DVec3::Z * 1.2);
    scene.shapes.push(Shape::lamp("lamp", lamp, v(3.0, 2.0, 1.0)));
    scene.camera.medium = Some(scene.add_medium(scenes::gray(0.1, 0.8, 0.5)));
    scene
}

#[test]
fn images_have_the_same_expectation_and_less_noise() {
    let scene = corner_lamp();
    let by_solid_angle = scenes::pack(&scene, 1);
    assert!(by_solid_angle.lights.iter().all(|light| light.kind == LIGHT_RECTANGLE), "the lamp is a rectangle");
    let mut by_area = scenes::pack(&scene, 2);
    by_area.lights.iter_mut().for_each(|light| light.kind = LIGHT_QUAD);
    // The weights of only one of both techniques are wrong if the density of the other is not what it says.
    let mut chance = scenes::pack(&scene, 3);
    chance.features.light_sampling = false;
    chance.features.equiangular = false;
    chance.media.iter_mut().for_each(|medium| medium.equiangular = 0.0);
    let one = images::on_device(&by_solid_angle, 2048);
    let z = |other: &images::Image, factor: f64| {
        let differences: Vec<f64> = one.iter().zip(other).map(|(a, b)| a.y * factor - b.y).collect();
        let (mean, error) = mean_and_error(&differences);
        (mean / error).abs()
    };
    for (name, other, spp) in [("by area", &by_area, 4096), ("by chance", &chance, 4096)] {
        let other = images::on_device(other, spp);
        eprintln!("{name}: z = {:.2}, of a picture 4 % brighter {:.1}", z(&other, 1.0), z(&other, 1.04));
        assert!(z(&other, 1.0) < 4.0, "{name}: z = {}", z(&other, 1.0));
        assert!(z(&other, 1.04) > 5.0, "{name}: blind to 4 %");
    }
    let noise = |packed| {
        let image = images::on_device(packed, 16);
        image.iter().zip(&one).map(|(a, b)| ((a.y - b.y) / b.y).powi(2)).sum::<f64>() / image.len() as f64
    };
    let [less, more] = [&scenes::pack(&scene, 4), &by_area].map(noise);
    eprintln!("relative mean square error {less:.4}, by area {more:.4}");
    assert!(less < 0.9 * more, "no less noise than by area: {less}, {more}");
}

#[test]
fn device_and_reference_agree_on_images() {
    let scene = corner_lamp();
    let packed = scenes::pack(&scene, 5);
    let (device, reference) = (images::on_device(&packed, 16), images::by_reference(&packed, 16));
    images::compare(&device, &reference).unwrap_or_else(|why| panic!("{why}"));
    let brighter: images::Image = device.iter().map(|pixel| *pixel * 1.02).collect();
    images::compare(&brighter, &reference).expect_err("2 % brighter");
    let mut by_area = packed.clone();
    by_area.lights.iter_mut().for_each(|light| light.kind = LIGHT_QUAD);
    images::compare(&images::on_device(&by_area, 16), &reference).expect_err("other samples");
    // With everything compiled in, the same picture.
    let mut everything = packed.clone();
    everything.features = everything.features.everything();
    images::compare(&images::on_device(&everything, 16), &reference).unwrap_or_else(|why| panic!("{why}"));
}

#[test]
fn vertices_on_and_behind_the_light_give_no_invalid_numbers() {
    // In the plane, on corners and edges, next to them, behind, and at extreme distances, with the first and last numbers.
    let ends = [0.0, 1.0 / 16_777_216.0, 0.5, 1.0 - 1.0 / 16_777_216.0];
    let numbers: Vec<DVec2> = ends.iter().flat_map(|&x| ends.map(|y| DVec2::new(x, y))).collect();
    for h in [0.0, 1e-38, 1e-30, 1e-20, 1e-12, 1e-7, 1e-4, 1.0, 1e6, 1e15] {
        for [x, z] in
            [[0.0, 0.0], [2.0, 1.0], [1.0, 0.5], [1.0, 0.25], [1.0, 0.0], [-1e-7, 0.5], [3.0, 0.5], [1e6, 1e6]]
        {
            for side in [-1.0, 1.0] {
                let point = v(x, side * h, z);
                for [direction, weight, _] in sampled(LIGHT_RECTANGLE, point, &numbers) {
                    // Edge-on, the density by area may be infinite: then no other technique counts.
                    let valid = weight[..3].iter().all(|number| number.is_finite()) && !weight[3].is_nan();
                    let seen = weight[0] > 0.0;
                    assert!(
                        valid && (!seen || direction.iter().all(|number| number.is_finite())),
                        "{point}: {weight:?}"
                    );
                    assert!(side < 0.0 || !seen, "{point} is on the dark side");
                }
            }
        }
    }
}
