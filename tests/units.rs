//! Each concept of the kernels against the reference, over ordinary and extreme inputs.

mod common;

use common::comparison::Comparison;
use common::phases;
use common::random::Random;
use common::scenes::v;
use common::tolerances::comparison;
use common::units::{run, vec4, widen};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;
use tyndall::pack::filter;
use tyndall::pack::layout::{
    self, INFINITE_DISTANCE, LIGHT_DIRECTIONAL, LIGHT_POINT, LIGHT_QUAD, LIGHT_RECTANGLE, LIGHT_SPHERE, LIGHT_SPOT,
    LIGHT_TRIANGLE, Light,
};
use tyndall::pack::lights::alias_table;
use tyndall::pack::sobol;
use tyndall::reference;
use tyndall::reference::{bindings, camera, film, light, math, medium, phase, rng, sampler, warp};
use tyndall::scene::ReconstructionFilter;

/// The numbers k/2²⁴ that matter most: both ends, powers of two, and some in between.
fn units_in_question() -> Vec<f64> {
    let last = (1u32 << 24) - 1;
    let mut numbers: Vec<u32> = (0..300).chain(last - 300..=last).collect();
    numbers.extend((0..24).flat_map(|bit| [(1 << bit) - 1, 1 << bit, last - (1 << bit)]));
    let mut random = Random(1);
    numbers.extend((0..4000).map(|_| random.bits() as u32 >> 8));
    numbers.into_iter().map(|k| f64::from(k) / 16_777_216.0).collect()
}

fn narrow(vector: DVec3) -> [f32; 3] {
    vector.as_vec3().to_array()
}

#[test]
fn random_numbers_agree_to_the_last_bit() {
    let mut random = Random(2);
    let mut inputs: Vec<[u32; 4]> = (0..5000).map(|_| [0; 4].map(|_: u32| random.bits() as u32)).collect();
    inputs.extend([[0; 4], [u32::MAX; 4], [1, 0, 0, 0], [0, 0, 0, 1]]);
    let outputs: Vec<[u32; 4]> = run("rng", &inputs, &[], inputs.len(), 2 * inputs.len());
    for (input, output) in inputs.iter().zip(outputs.chunks(2)) {
        assert_eq!(output[0], rng::pcg4d(*input), "pcg4d({input:?})");
        let numbers = rng::to_unit(*input).to_array();
        assert_eq!(output[1].map(f32::from_bits).map(f64::from), numbers, "to_unit({input:?})");
        assert!(numbers.iter().all(|number| (0.0..1.0).contains(number)));
        assert_ne!(output[0], rng::pcg4d([input[0] ^ 1, input[1], input[2], input[3]]), "a bit of the input is lost");
    }
}

#[test]
fn sets_of_the_sampler_agree_to_the_last_bit() {
    let mut random = Random(3);
    let table = sobol::points();
    let inputs: Vec<[u32; 4]> = (0..5000)
        .map(|_| {
            let index = random.bits() as u32 >> (random.bits() % 32);
            [random.bits() as u32, random.bits() as u32, (random.bits() % 12) as u32, index]
        })
        .collect();
    let outputs: Vec<[u32; 4]> =
        run("sampler", &inputs, &[bytemuck::cast_slice(&table)], inputs.len(), 2 * inputs.len());
    let expected = |[seed, pixel, set, index]: [u32; 4]| {
        let key = sampler::set_key(seed, pixel, set, index);
        let point =
            if set < sobol::SOBOL_SETS { table[sampler::point_index(set, index, key) as usize] } else { [0; 2] };
        sampler::shifted_point(point, key).to_array()
    };
    for (input, output) in inputs.iter().zip(outputs.chunks(2)) {
        let found = output[0].map(f32::from_bits).map(f64::from);
        assert_eq!(found, expected(*input), "{input:?}");
        let [seed, .., index] = *input;
        let of_half = [sampler::half_seed(seed, index), sampler::half_index(index)];
        let of_group = [sampler::group_seed(seed, index), sampler::group_index(index)];
        assert_eq!(output[1], [of_half[0], of_half[1], of_group[0], of_group[1]], "{input:?}");
        assert!(found.iter().all(|number| (0.0..1.0).contains(number)), "{input:?}");
        let neighbour = [input[0], input[1] ^ 1, input[2], input[3]];
        assert_ne!(found, expected(neighbour), "pixels share their numbers");
    }
}

#[test]
fn elementary_functions() {
    let mut random = Random(4);
    let mut inputs = Vec::new();
    let extremes = [0.0, 1e-30, 86.9, 87.0, 87.4, 88.0, 200.0, 1e9, 1e30, f64::INFINITY];
    for (k, u) in units_in_question().into_iter().enumerate() {
        let x = if k < extremes.len() { extremes[k] } else { random.log_between(1e-12, 87.0) };
        let axes = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::Z, v(1e-4, 0.0, -1.0), v(0.0, 1e-20, -1.0)];
        let n = if k < axes.len() { axes[k] } else { random.direction() };
        // Of arctan2: all signs of the corner cases, then anything; rounded to what the kernel gets.
        let special = [0.0, 1.0, -1.0, 1e-30, -1e-30, 0.41421357, -0.41421357, 0.41421354, 2.4142135, 1e30];
        let [y, x_of_angle] = if k < 100 {
            [special[k / 10], special[k % 10]]
        } else {
            [0; 2].map(|_| random.log_between(1e-9, 1e9) * if random.unit() < 0.5 { 1.0 } else { -1.0 })
        };
        // Of 1 − exp(−z) and −log(1 − z): tiny, at the borders of the series, and up to the last number below 1.
        let z = match k {
            0..8 => [0.0, 1e-37, 0.029_999_999, 0.03, 0.499_999_97, 0.5, 1.0 - 1.0 / 16_777_216.0, 1e30][k],
            _ if k % 3 == 0 => u,
            _ => random.log_between(1e-30, 100.0),
        };
        inputs.extend([vec4(&[u, x, y, x_of_angle]), vec4(&[n.x, n.y, n.z, z])]);
    }
    let outputs: Vec<[f32; 4]> = run("math", &inputs, &[], inputs.len() / 2, inputs.len() / 2 * 4);
    let mut log = comparison("minus_log_1m");
    let mut exp = comparison("exp_minus");
    let mut frame = comparison("orthonormal_frame");
    let mut angle = comparison("arctan2");
    let mut sine = comparison("sine");
    let mut ended = comparison("one_minus_exp_minus");
    let mut erfc = comparison("scaled_erfc");
    let mut small_log = comparison("minus_log_1m_small");
    for (input, output) in inputs.chunks(2).zip(outputs.chunks(4)) {
        let [u, x] = [input[0][0], input[0][1]].map(f64::from);
        log.scalar(u, output[0][0], math::minus_log_1m(u));
        // What lies below the smallest normal number is 0.
        exp.scalar(x, output[0][1], math::exp_minus(x));
        let [y, x_of_angle] = [input[0][2], input[0][3]].map(f64::from);
        angle.scalar(format!("{y}, {x_of_angle}"), output[0][2], math::arctan2(y, x_of_angle));
        let clamped = input[0][2].clamp(-1.5, 1.5);
        sine.scalar(clamped, output[2][3], math::sine(f64::from(clamped)));
        let z = f64::from(input[1][3]);
        ended.scalar(z, output[0][3], math::one_minus_exp_minus(z));
        erfc.scalar(z, output[3][0], math::scaled_erfc(z.min(5.0)));
        if z < 1.0 {
            small_log.scalar(z, output[1][3], math::minus_log_1m(z));
        }
        let n = widen(&input[1][..3]);
        let (tangent, bitangent) = math::orthonormal_frame(n);
        frame.vector(n, &output[1][..3], tangent);
        frame.vector(n, &output[2][..3], bitangent);
        assert!((tangent.cross(bitangent) - n).length() < 1e-6, "the frame of {n} is not right-handed");
    }
    log.finish();
    exp.finish();
    angle.finish();
    sine.finish();
    ended.finish();
    small_log.finish();
    erfc.finish();
    frame.finish();
}

#[test]
fn warps() {
    let mut random = Random(5);
    let inputs: Vec<[f32; 4]> =
        units_in_question().into_iter().map(|u| vec4(&[u, random.unit(), random.log_between(1e-12, 2.0)])).collect();
    let outputs: Vec<[f32; 4]> = run("warp", &inputs, &[], inputs.len(), 3 * inputs.len());
    let names = ["square_to_sphere", "square_to_cosine_hemisphere", "square_to_cone"];
    let mut directions = names.map(comparison);
    let mut densities = comparison("warp densities");
    for (input, output) in inputs.iter().zip(outputs.chunks(3)) {
        let [x, y, m, _] = input.map(f64::from);
        let u = DVec2::new(x, y);
        let expected = [warp::square_to_sphere(u), warp::square_to_cosine_hemisphere(u), warp::square_to_cone(u, m)];
        let pdfs = [
            warp::square_to_sphere_pdf(),
            warp::square_to_cosine_hemisphere_pdf(f64::from(output[1][2])),
            warp::square_to_cone_pdf(m),
        ];
        for k in 0..3 {
            directions[k].vector(format!("{x}, {y}, {m}"), &output[k][..3], expected[k]);
            densities.scalar(format!("{} {x}, {y}, {m}", names[k]), output[k][3], pdfs[k]);
        }
    }
    directions.into_iter().for_each(Comparison::finish);
    densities.finish();
}

#[test]
fn media() {
    let mut random = Random(9);
    let mut inputs = Vec::new();
    for (k, u) in units_in_question().into_iter().enumerate() {
        let depth = random.log_between(1e-12, 1e8);
        let throughput =
            v(random.log_between(1e-6, 10.0), random.log_between(1e-6, 10.0), random.log_between(1e-6, 10.0));
        // The channel that the flight was sampled in has a depth below 17; the others have any.
        let deep = [random.log_between(1e-12, 16.6), random.log_between(1e-12, 1e8), random.log_between(1e-12, 1e8)];
        let tau = [0, 1, 2].map(|channel| deep[(channel + k) % 3]);
        let sigma = [0; 3].map(|_| if random.unit() < 0.1 { 0.0 } else { random.log_between(1e-6, 1e6) });
        let sigma = if sigma[(3 - k % 3) % 3] == 0.0 { [1.0; 3] } else { sigma };
        let albedo = [random.unit(), random.unit(), 1.0];
        inputs.push(vec4(&[u, math::minus_log_1m(u), if k % 50 == 0 { 0.0 } else { depth }, (k % 40) as f64]));
        let mut vectors = [vec4(&throughput.to_array()), vec4(&tau), vec4(&sigma), vec4(&albedo)];
        // A share, a way that is short in the densest channel, whether the flight ended there, and a number.
        let way = random.unit() * 3.0 / (1e-3 + sigma.into_iter().fold(0.0, f64::max));
        let emission = [random.unit(), way, f64::from(k as u32 % 2), random.unit()];
        vectors.iter_mut().zip(emission).for_each(|(vector, number)| vector[3] = number as f32);
        inputs.extend(vectors);
    }
    let count = inputs.len() / 5;
    let outputs: Vec<[f32; 4]> = run("medium", &inputs, &[], count, 5 * count);
    let names = ["channel_weights", "free_flight", "survival_probability", "survival_weight", "scatter_weight"];
    let [mut weights, mut flight, mut probability, mut survival, mut scatter] = names.map(comparison);
    let [mut emitting, mut emitting_rgb] = ["emitting_length", "emitting_length_rgb"].map(comparison);
    for (input, output) in inputs.chunks(5).zip(outputs.chunks(5)) {
        let [u, tau_one, sigma_one, _] = input[0].map(f64::from);
        let [throughput, tau, sigma_t, albedo] = [1, 2, 3, 4].map(|k| widen(&input[k][..3]));
        let expected = medium::channel_weights(throughput);
        let case = format!("{input:?}");
        // Where u lies at the very border of two channels, either is right.
        let border = [expected.x, expected.x + expected.y].iter().any(|edge| (u - edge).abs() < 1e-6);
        assert!(border || f64::from(output[0][0]) == f64::from(medium::sample_channel(expected, u)), "{case}");
        flight.scalar(&case, output[0][1], medium::free_flight(tau_one, sigma_one));
        probability.scalar(&case, output[0][2], medium::survival_probability(expected, tau));
        weights.vector(&case, &output[1][..3], expected);
        survival.vector(&case, &output[2][..3], medium::survival_weight(expected, tau));
        scatter.vector(&case, &output[3][..3], medium::scatter_weight(expected, tau, sigma_t, albedo));
        let [share, way, ended, u] = [1, 2, 3, 4].map(|k| f64::from(input[k][3]));
        let ended = ended > 0.0;
        let rgb = medium::emitting_length_rgb(share, expected, tau, sigma_t, way, ended, u);
        emitting_rgb.vector(&case, &output[4][..3], rgb);
        let gray = medium::emitting_length(share, sigma_t.x, way, ended && sigma_t.x > 0.0);
        emitting.scalar(&case, output[4][3], gray);
        // Crossings in any order lead to the medium that they lead to, and what leads nowhere is no medium.
        let index = input[0][3] as u32;
        let [code, next, last] = [0, 1, 2].map(|step| medium::medium_code(index + step));
        assert_eq!([output[1][3], output[2][3]], [(code >> 16) as f32, (code & 0xffff) as f32], "code of {index}");
        assert_eq!((output[0][3], medium::medium_of_code(code, index + 1, index + 1)), (index as f32, index));
        let nowhere = code.wrapping_add(next).wrapping_sub(last);
        assert_eq!((output[3][3], medium::medium_of_code(nowhere, index, index + 3)), (u32::MAX as f32, u32::MAX));
    }
    assert!(outputs.iter().flatten().all(|number| number.abs() <= INFINITE_DISTANCE), "a weight is not finite");
    [weights, flight, probability, survival, scatter, emitting, emitting_rgb].into_iter().for_each(Comparison::finish);
}

#[test]
fn phase_functions() {
    let mut random = Random(10);
    let mut inputs = Vec::new();
    let magnitudes = [1e-8, 1e-6, 1e-4, 1e-3, 0.01, 0.1, 0.3, 0.5, 0.75, 0.9, 0.99, 0.999, 0.9999, 0.99999, 1.0 - 1e-6];
    for g in magnitudes.into_iter().flat_map(|g| [g, -g]).chain([0.0]) {
        for u in units_in_question().into_iter().step_by(3) {
            inputs.extend([vec4(&[g, u, random.unit()]), vec4(&random.direction().to_array()), [0.0; 4]]);
        }
    }
    let count = inputs.len() / 3;
    let outputs = phases::ask(&[], &[], &inputs);
    assert_eq!(outputs.len(), 2 * count);
    let names = ["1 - cos", "cos", "sin", "henyey_greenstein_from", "scattered direction", "eval_henyey_greenstein"];
    let mut functions = names.map(comparison);
    for (input, output) in inputs.chunks(3).zip(outputs.chunks(2)) {
        let [g, u, turn, _] = input[0].map(f64::from);
        let before = widen(&input[1][..3]);
        let case = format!("g = {g}, u = {u}");
        let angle = phase::sample_henyey_greenstein(g, u);
        functions[0].scalar(&case, output[0][0], angle.one_minus_cos);
        functions[1].scalar(&case, output[0][1], angle.cos_theta);
        functions[2].scalar(&case, output[0][2], angle.sin_theta);
        functions[3].scalar(&case, output[0][3], phase::henyey_greenstein_from(g, angle.one_minus_cos));
        let local = warp::from_polar(angle.cos_theta, angle.sin_theta, turn);
        functions[4].vector(&case, &output[1][..3], math::from_frame(before, local));
        // Of the direction that the kernel found: rounding it is not an error of the function.
        let after = widen(&output[1][..3]);
        functions[5].scalar(&case, output[1][3], phase::eval_henyey_greenstein(g, before, after));
    }
    functions.into_iter().for_each(Comparison::finish);
}

/// One light of each kind, near the origin.
fn lights() -> Vec<Light> {
    let plane = |kind, normal: Vec3, area| Light {
        origin: Vec3::new(-0.3, 0.9, -0.2),
        kind,
        edge_1: Vec3::new(0.6, 0.0, 0.0),
        edge_2: Vec3::new(0.1, 0.0, 0.5),
        area,
        normal,
        radiance: Vec3::new(3.0, 2.0, 1.0),
        ..Light::default()
    };
    let sphere = |center: Vec3, radius, side| Light {
        origin: center,
        kind: LIGHT_SPHERE,
        edge_1: Vec3::new(radius, side, 0.0),
        radiance: Vec3::new(1.0, 5.0, 0.0),
        ..Light::default()
    };
    let point = Light { kind: LIGHT_POINT, origin: Vec3::new(0.1, 0.7, 0.2), radiance: Vec3::ONE, ..Light::default() };
    let mut lights = vec![
        plane(LIGHT_TRIANGLE, Vec3::NEG_Y, 0.15),
        plane(LIGHT_QUAD, Vec3::NEG_Y, 0.3),
        sphere(Vec3::new(0.2, 0.8, -0.1), 0.3, 1.0),
        sphere(Vec3::ZERO, 4.0, -1.0),
        sphere(Vec3::new(0.5, 0.5, 0.5), 1e-3, 1.0),
        point,
        Light { kind: LIGHT_SPOT, edge_1: Vec3::new(1.9, 0.8, 1.0 / 1.1), normal: Vec3::NEG_Y, ..point },
        Light { kind: LIGHT_SPOT, edge_1: Vec3::new(PI as f32, PI as f32, 0.0), normal: Vec3::X, ..point },
        Light { edge_2: Vec3::new(0.0, 0.0, 0.5), ..plane(LIGHT_RECTANGLE, Vec3::NEG_Y, 0.3) },
        // Tilted by the Pythagorean triple (3, 4, 5), and narrow, either way.
        Light {
            edge_1: Vec3::new(0.05, 0.0, 0.0),
            edge_2: Vec3::new(0.0, 0.48, 0.64),
            ..plane(LIGHT_RECTANGLE, Vec3::new(0.0, -0.8, 0.6), 0.04)
        },
        Light {
            edge_1: Vec3::new(0.0, 0.48, 0.64),
            edge_2: Vec3::new(0.05, 0.0, 0.0),
            ..plane(LIGHT_RECTANGLE, Vec3::new(0.0, -0.8, 0.6), 0.04)
        },
        Light { kind: LIGHT_DIRECTIONAL, normal: Vec3::new(0.6, -0.8, 0.0), radiance: Vec3::ONE, ..Light::default() },
    ];
    let table = alias_table(&[0.2, 0.2, 0.15, 0.05, 0.01, 0.19, 0.03, 0.02, 0.06, 0.03, 0.01, 0.05]);
    for (light, (threshold, alias)) in lights.iter_mut().zip(table) {
        light.alias_threshold = threshold as f32;
        light.alias = alias;
    }
    lights
}

/// Whether rounding may decide how a rectangle is sampled.
fn undecided(light: &bindings::Light, point: DVec3) -> bool {
    let rectangle = |scale: f64| {
        let moved = light.origin + (point - light.origin) * scale;
        light::spherical_rectangle(light, moved).solid_angle > 0.0
    };
    rectangle(1.0 - 1e-4) != rectangle(1.0 + 1e-4)
}

/// What a lamp sends in the direction that the kernel asks for; nothing, where rounding may decide whether that meets it.
fn met(light: &bindings::Light, point: DVec3, u: DVec2) -> Option<light::LightSample> {
    let v = 1.5 * u - 0.25;
    let towards = (light.origin + light.edge_1 * v.x + light.edge_2 * v.y - point).normalize();
    let of_size = |scale: f64| {
        let mut lamp = *light;
        if light.kind == LIGHT_SPHERE {
            lamp.edge_1.x *= scale;
            return light::sphere_light_in(&lamp, point, towards);
        }
        let middle = if light.kind == LIGHT_TRIANGLE { 1.0 / 3.0 } else { 0.5 };
        lamp.origin += (light.edge_1 + light.edge_2) * (middle * (1.0 - scale));
        (lamp.edge_1, lamp.edge_2) = (light.edge_1 * scale, light.edge_2 * scale);
        light::plane_light_in(&lamp, point, towards)
    };
    let [small, found, large] = [1.0 - 1e-3, 1.0, 1.0 + 1e-3].map(of_size);
    let edge_on = light.kind != LIGHT_SPHERE && towards.dot(light.normal).abs() < 0.02;
    (small.weight == large.weight && !edge_on).then_some(found)
}

#[test]
fn light_sources() {
    let lights = lights();
    let wide: Vec<bindings::Light> = lights.iter().map(bindings::Light::from).collect();
    let mut random = Random(12);
    let mut inputs = Vec::new();
    for u in units_in_question() {
        for index in 0..lights.len() {
            let p = random.in_cube() * 2.0;
            inputs.extend([vec4(&[p.x, p.y, p.z, random.unit()]), vec4(&[u, index as f64])]);
        }
    }
    let count = inputs.len() / 2;
    let outputs: Vec<[f32; 4]> = run("light", &inputs, &[bytemuck::cast_slice(&lights)], count, 4 * count);
    let names = [
        "light direction",
        "light distance",
        "sphere light distance",
        "light weight",
        "light pdf",
        "alias rescaled",
        "spot weight",
    ];
    let (mut met_distance, mut seen) = (comparison("lamp in a direction, distance"), [0; 2]);
    let [mut rectangle_direction, mut rectangle_weight, mut rectangle_pdf] =
        ["rectangle light direction", "rectangle light weight", "rectangle light pdf"].map(comparison);
    let [mut direction, mut distance, mut sphere_distance, mut weight, mut pdf, mut rescaled, mut spot_weight] =
        names.map(comparison);
    for (input, output) in inputs.chunks(2).zip(outputs.chunks(4)) {
        let point = widen(&input[0][..3]);
        let u = DVec2::new(f64::from(input[1][0]), f64::from(input[0][3]));
        let index = input[1][1] as usize;
        let light = &wide[index];
        let case = format!("light {index}, {input:?}");
        let (found, asked) = match light.kind {
            LIGHT_POINT => (light::sample_point_light(light, point), 0.0),
            LIGHT_SPOT => (light::sample_spot_light(light, point), 0.0),
            LIGHT_DIRECTIONAL => (light::sample_directional_light(light), 0.0),
            LIGHT_SPHERE => {
                let asked = light::sphere_light_pdf(light.edge_1.x, point.distance(light.origin));
                (light::sample_sphere_light(light, point, u), asked)
            }
            LIGHT_RECTANGLE => {
                let found = light::sample_rectangle_light(light, point, u);
                let cosine = -found.direction.dot(light.normal);
                (found, light::rectangle_light_pdf(light, point, found.distance, cosine))
            }
            _ => {
                let found = light::sample_plane_light(light, point, u);
                let cosine = -found.direction.dot(light.normal);
                (found, light::area_pdf(light.area, found.distance, cosine))
            }
        };
        // A plane light seen edge-on has no digits left in its cosine; a sphere's surface is where inside becomes
        // outside.
        let rectangle = light.kind == LIGHT_RECTANGLE;
        let edge_on = (light.kind <= LIGHT_QUAD || rectangle) && found.direction.dot(light.normal).abs() < 0.02;
        let border = light.kind == LIGHT_SPHERE && (point.distance(light.origin) / light.edge_1.x - 1.0).abs() < 1e-3;
        let undecided = rectangle && undecided(light, point);
        if rectangle && !edge_on && !undecided {
            rectangle_direction.vector(&case, &output[0][..3], found.direction);
            rectangle_weight.vector(&case, &output[1][..3], found.weight);
            rectangle_pdf.scalar(&case, output[1][3], found.pdf);
            if found.pdf > 0.0 {
                rectangle_pdf.scalar(&case, output[2][0], asked);
            }
        } else if !rectangle && !border && !edge_on {
            direction.vector(&case, &output[0][..3], found.direction);
            if light.kind == LIGHT_SPHERE {
                // The rim of a sphere that covers little of the view is lost to rounding of the direction.
                if light.edge_1.x > 0.1 {
                    sphere_distance.scalar(&case, output[0][3], found.distance);
                }
            } else {
                distance.scalar(&case, output[0][3], found.distance);
            }
            if light.kind == LIGHT_SPOT {
                // The falloff has an absolute error: that of the angle, times the slope.
                let full = light::sample_point_light(light, point).weight.x;
                spot_weight.scalar(&case, (f64::from(output[1][0]) / full) as f32, found.weight.x / full);
            } else {
                weight.vector(&case, &output[1][..3], found.weight);
            }
            pdf.scalar(&case, output[1][3], found.pdf);
            if asked.is_finite() {
                pdf.scalar(&case, output[2][0], asked);
            }
        }
        let lamp = [LIGHT_TRIANGLE, LIGHT_QUAD, LIGHT_RECTANGLE, LIGHT_SPHERE].contains(&light.kind);
        if let Some(found) = lamp.then(|| met(light, point, u)).flatten() {
            seen[usize::from(found.weight != DVec3::ZERO)] += 1;
            assert_eq!(widen(&output[3][..3]), found.weight, "{case}: in a given direction");
            let rim = light.kind == LIGHT_SPHERE && light.edge_1.x < 0.1;
            if !rim {
                met_distance.scalar(&case, output[3][3], found.distance);
            }
        }
        let mut rest = u.x;
        let line = light::alias_line(lights.len() as u32, &mut rest);
        let threshold = wide[line as usize].alias_threshold;
        let border = (rest - threshold).abs() < 1e-6;
        assert_eq!(output[2][1] as u32, line, "{case}");
        if !border {
            let keeps = light::alias_keeps(threshold, &mut rest);
            assert_eq!(output[2][3] == 1.0, keeps, "{case}");
            rescaled.scalar(&case, output[2][2], rest);
        }
        assert!((0.0..1.0).contains(&output[2][2]), "{case}: the rescaled number is {}", output[2][2]);
    }
    [direction, distance, sphere_distance, weight, pdf, rescaled, spot_weight].into_iter().for_each(Comparison::finish);
    [rectangle_direction, rectangle_weight, rectangle_pdf, met_distance].into_iter().for_each(Comparison::finish);
    assert!(seen.iter().all(|count| *count > 500), "lamps are met and missed: {seen:?}");
}

#[test]
fn cameras() {
    let mut random = Random(13);
    let mut inputs = Vec::new();
    for _ in 0..1000 {
        let [corner, right, down] = [0; 3].map(|_| narrow(random.in_cube()).map(f64::from));
        inputs.extend([corner, right, down].map(|vector| vec4(&vector)));
        inputs.push(vec4(&[random.unit(), random.unit(), random.unit(), random.unit()]));
    }
    let count = inputs.len() / 4;
    let outputs: Vec<[f32; 4]> = run("camera", &inputs, &[], count, 3 * count);
    let mut direction = comparison("camera_direction");
    let (mut point, mut focused) = (comparison("lens_point"), comparison("focused_direction"));
    for (input, output) in inputs.chunks(4).zip(outputs.chunks(3)) {
        let [corner, right, down] = [0, 1, 2].map(|k| widen(&input[k][..3]));
        let film = DVec2::new(f64::from(input[3][0]), f64::from(input[3][1]));
        let expected = camera::camera_direction(corner, right, down, film);
        // Relative to the vectors that are added, which may cancel.
        if expected.length() > 0.5 {
            direction.vector(format!("{input:?}"), &output[0][..3], expected);
        }
        let place = camera::lens_point(right, down, DVec2::new(f64::from(input[3][2]), f64::from(input[3][3])));
        point.vector(format!("{input:?}"), &output[1][..3], place);
        focused.vector(format!("{input:?}"), &output[2][..3], camera::focused_direction(expected, place, 0.5));
    }
    [direction, point, focused].into_iter().for_each(Comparison::finish);
}

#[test]
fn tiles_cover_the_crop_window_once() {
    let (width, height) = (29u32, 17u32);
    let tiles = width.div_ceil(layout::TILE) * height.div_ceil(layout::TILE);
    let pixels = layout::TILE * layout::TILE;
    let inputs: Vec<[u32; 4]> = (0..tiles * pixels).map(|slot| [slot / pixels, slot % pixels, width, 0]).collect();
    let outputs: Vec<[u32; 4]> = run("film", &inputs, &[], inputs.len(), inputs.len());
    let mut seen = std::collections::HashSet::new();
    for (input, output) in inputs.iter().zip(&outputs) {
        assert_eq!(film::tile_pixel(input[0], input[1], input[2]), output[..2], "{input:?}");
        let sharers = 4 * (input[0] % 3);
        let ([x, y], [right, down]) = (film::group_offset(sharers, input[1]), film::group_margin(sharers));
        assert_eq!(output[3], x | y << 8 | right << 16 | down << 24, "{input:?}");
        assert!(seen.insert(*output), "{output:?} is covered twice");
    }
    let inside = seen.iter().filter(|[x, y, ..]| *x < width && *y < height).count();
    assert_eq!(inside, (width * height) as usize);
}

#[test]
fn quotients_of_integers() {
    let mut random = Random(61);
    let mut pairs: Vec<[u32; 2]> = vec![[0, 1], [(1 << 22) - 1, 1], [(1 << 22) - 1, (1 << 22) - 1]];
    for _ in 0..20_000 {
        let (b, q) = (random.log_between(1.0, 4e6) as u32, random.unit());
        // Multiples and their neighbours.
        let multiple = (q * f64::from((1 << 22) / b)) as u32 * b;
        pairs.extend([[multiple, b], [multiple.saturating_sub(1), b], [multiple + b - 1, b]]);
    }
    pairs.retain(|[a, _]| *a < 1 << 22);
    let inputs: Vec<[u32; 4]> = pairs.iter().map(|[a, b]| [0, *a, 8, *b]).collect();
    let outputs: Vec<[u32; 4]> = run("film", &inputs, &[], inputs.len(), inputs.len());
    for ([a, b], output) in pairs.iter().zip(&outputs) {
        assert_eq!(film::quotient(*a, *b), output[2], "{a} / {b}");
    }
}

#[test]
fn reconstruction_filters() {
    let (mut ranks, mut weights, mut densities) =
        (comparison("sample_filter rank"), comparison("sample_filter weight"), comparison("filter_pdf"));
    for kind in [
        ReconstructionFilter::Box { radius: 1.25 },
        ReconstructionFilter::Tent { radius: 1.0 },
        ReconstructionFilter::DEFAULT,
        ReconstructionFilter::CATMULL_ROM,
        ReconstructionFilter::Lanczos { lobes: 3.0 },
    ] {
        let table = filter::table(&kind);
        let (cells, radius) = (table.len() as u32 / 2 - 1, f64::from(kind.radius() as f32));
        let mut inputs = Vec::new();
        for (k, u) in units_in_question().into_iter().enumerate() {
            // The middle of a film, its corners, and a film of one pixel.
            let bounds = [[-1e5, 1e5], [-0.5, 1e5], [-1e5, 0.5], [-0.5, 0.5], [-1.5, 2.5]][k % 5];
            inputs.push(vec4(&[u, bounds[0], bounds[1]]));
            inputs.push(vec4(&[f64::from(cells), radius, radius * (2.2 * u - 1.1)]));
        }
        let outputs: Vec<[f32; 4]> =
            run("filter", &inputs, &[bytemuck::cast_slice(&table)], inputs.len() / 2, inputs.len() / 2);
        let mut last = [f64::NEG_INFINITY; 5];
        let mut sorted: Vec<(usize, f64, f64)> = Vec::new();
        for (k, (input, output)) in inputs.chunks(2).zip(&outputs).enumerate() {
            let [u, low, high, _] = input[0].map(f64::from);
            let bounds = DVec2::new(low, high);
            let expected = reference::filter::sample_filter(&table, cells, radius, bounds, u);
            let offset = f64::from(output[0]);
            let case = format!("{kind:?}, u {u}, bounds {bounds}");
            assert!((low..=high).contains(&offset) && offset.abs() <= radius * (1.0 + 1e-7), "{case}: {offset}");
            // Where the filter is nearly 0 its places are uncertain: what counts is how much of it lies to their left.
            let rank = |x: f64| {
                let place = |x: f64| ((x + radius) * f64::from(cells) / (2.0 * radius)).clamp(0.0, f64::from(cells));
                reference::filter::filter_integral(&table, cells, place(x))
            };
            let share = (rank(offset) - rank(low)) / (rank(high) - rank(low));
            ranks.scalar(&case, share as f32, u);
            // At the edge of a cell with another sign either may be taken.
            if f64::from(output[1]).signum() == expected.weight.signum() {
                weights.scalar(&case, output[1], expected.weight);
            }
            let asked = f64::from(input[1][2]);
            let edge = ((asked + radius) * f64::from(cells) / (2.0 * radius)).fract();
            if (1e-3..0.999).contains(&edge) && (asked - low).abs() > 1e-3 && (asked - high).abs() > 1e-3 {
                let expected = reference::filter::filter_pdf(&table, cells, radius, bounds, asked);
                densities.scalar(format!("{case} at {asked}"), output[2], expected);
            }
            sorted.push((k % 5, u, offset));
        }
        // Larger numbers lie farther to the right, so that stratified ones are stratified places.
        sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
        for (bounds, u, offset) in sorted {
            assert!(offset >= last[bounds], "{kind:?}: at u = {u}, {offset} lies to the left of {}", last[bounds]);
            last[bounds] = offset;
        }
    }
    [ranks, weights, densities].into_iter().for_each(Comparison::finish);
}
