//! Samplers at the ends of their numbers, and for geometry that leaves them no digits.

use crate::common::comparison::Comparison;
use crate::common::random::Random;
use crate::common::scenes::v;
use crate::common::statistics::check_uniform;
use crate::common::surfaces::{Query, ask, ask_facets, brushed, glass, metal, plastic, rough_plastic};
use crate::common::tolerances::comparison;
use crate::common::units::{run, vec4, widen};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;
use tyndall::pack::layout::*;
use tyndall::reference::{bindings, equiangular, light};

/// The largest of the program's random numbers.
const LAST: f64 = 1.0 - 1.0 / 16_777_216.0;

/// A stretch of a ray and a point that sees it, as the kernel gets them.
#[derive(Clone, Copy, Debug)]
struct Seen {
    point: DVec3,
    origin: DVec3,
    direction: DVec3,
    begin: f64,
    end: f64,
}

/// What the kernel finds for one number.
#[derive(Clone, Copy, Debug)]
struct Distance {
    s: f64,
    pdf: f64,
    angle: f64,
    distance: f64,
}

fn distances(stretches: &[(Seen, f64)]) -> Vec<Distance> {
    let inputs: Vec<[f32; 4]> = stretches
        .iter()
        .flat_map(|(Seen { point, origin, direction, begin, end }, u)| {
            [(point, u), (origin, begin), (direction, end)].map(|(at, last)| vec4(&[at.x, at.y, at.z, *last]))
        })
        .collect();
    let outputs: Vec<[f32; 4]> = run("equiangular", &inputs, &[], stretches.len(), stretches.len());
    outputs
        .into_iter()
        .map(|output| {
            let [s, pdf, angle, distance] = output.map(f64::from);
            Distance { s, pdf, angle, distance }
        })
        .collect()
}

/// The longest stretch that is sampled.
const LONGEST: f64 = 1e3;

fn stretches() -> Vec<Seen> {
    let mut random = Random(71);
    let infinite = f64::from(INFINITE_DISTANCE);
    // On the ray; beside it; in front; far behind; very far away; at the beginning; at the end; and all of these with stretches
    // that are short, empty or without an end.
    let points = [
        v(0.0, 0.0, 0.5),
        v(1e-6, 0.0, 0.5),
        v(1e-4, 0.0, 0.5),
        v(0.3, 0.0, 0.5),
        v(0.0, 0.0, -3.0),
        v(0.1, 0.0, -50.0),
        v(1e4, 0.0, 0.3),
        v(10.0, 0.0, 1e4),
        DVec3::ZERO,
        v(0.0, 0.0, 1.0),
        v(0.0, 1e-5, 1.0),
    ];
    let ends = [(0.0, 1.0), (0.25, 0.25 + 1e-6), (0.5, 0.5), (0.0, 1e-20), (0.0, 2e3), (0.5, infinite)];
    let mut all: Vec<Seen> = points
        .into_iter()
        .flat_map(|point| {
            let of = move |(begin, end)| Seen { point, origin: DVec3::ZERO, direction: DVec3::Z, begin, end };
            ends.map(of)
        })
        .collect();
    for _ in 0..600 {
        let size = random.log_between(1e-3, 10.0);
        let begin = random.between(0.0, 1.0);
        all.push(Seen {
            point: (random.in_cube() * size).as_vec3().as_dvec3(),
            origin: random.in_cube(),
            direction: random.direction(),
            begin,
            end: begin + random.log_between(1e-6, 1e4),
        });
    }
    all
}

/// The share of the angle that lies before s.
fn rank(begin: f64, distance: f64, angle: f64, s: f64) -> f64 {
    (distance * s).atan2(distance * distance + begin * (begin + s)) / angle
}

#[test]
fn equiangular_distances_are_those_of_the_reference() {
    let numbers = [0.0, 1.0 / 16_777_216.0, 1e-3, 0.25, 0.5, 0.9, 0.999, LAST];
    let asked: Vec<(Seen, f64)> = stretches().into_iter().flat_map(|seen| numbers.map(|u| (seen, u))).collect();
    let names = ["equiangular distance", "equiangular angle", "equiangular rank", "equiangular_pdf"];
    let [mut distance, mut angle, mut ranks, mut pdf] = names.map(comparison);
    let mut compared = 0;
    for ((seen, u), found) in asked.iter().zip(distances(&asked)) {
        let case = format!("{seen:?}, u = {u}: {found:?}");
        let stretch =
            equiangular::stretch_seen_from(seen.point, seen.origin, seen.direction, seen.begin, single(seen.end));
        // Whatever comes in: a distance of the stretch, and a density that can be divided by unless there is no stretch.
        assert!(found.s >= 0.0 && found.s <= (single(stretch.extent) * (1.0 + 1e-6)).min(LONGEST), "{case}");
        assert!(found.pdf.is_finite() && found.angle.is_finite() && found.distance > 0.0, "{case}");
        assert!(found.pdf > 0.0 || stretch.angle < 1e-18, "{case}");
        // The coordinates are rounded: no more digits than this are left of what lies next to the line of the ray.
        let offset = seen.origin + seen.direction * seen.begin - seen.point;
        let digits = offset.length().max(seen.origin.length()).max(seen.point.length()) / stretch.distance;
        let clamped = stretch.distance < 2e-5;
        if clamped || digits > 8.0 || stretch.extent < 1e-3 * offset.length() {
            continue;
        }
        compared += 1;
        distance.scalar(&case, found.distance as f32, stretch.distance);
        angle.scalar(&case, found.angle as f32, stretch.angle);
        let s = equiangular::sample_equiangular(&stretch, *u);
        let [got, want] = [found.s, s].map(|s| rank(stretch.begin, stretch.distance, stretch.angle, s));
        ranks.scalar(&case, got as f32, want);
        pdf.scalar(&case, found.pdf as f32, equiangular::equiangular_pdf(&stretch, found.s.min(stretch.extent)));
    }
    assert!(compared > 2000, "too few of them are ordinary: {compared}");
    [distance, angle, ranks, pdf].into_iter().for_each(Comparison::finish);
}

/// A number as the kernel gets it.
fn single(number: f64) -> f64 {
    f64::from(number as f32)
}

/// Whether distances lie as the angles under which they are seen, and their densities integrate to 1: the mean of 1/pdf is the
/// extent.
fn check_distances(found: &[Distance], seen: &Seen, distance: f64) -> Result<f64, String> {
    let begin = (seen.origin + seen.direction * seen.begin - seen.point).dot(seen.direction);
    let extent = (seen.end - seen.begin).min(LONGEST);
    let angle = ((begin + extent) / distance).atan() - (begin / distance).atan();
    check_uniform(found.iter().map(|found| rank(begin, distance, angle, found.s).min(LAST)), 40)?;
    let integral = found.iter().map(|found| 1.0 / found.pdf).sum::<f64>() / found.len() as f64 / extent;
    if (integral - 1.0).abs() < 5e-3 { Ok(integral) } else { Err(format!("the density integrates to {integral}")) }
}

#[test]
fn equiangular_distances_are_drawn_as_their_density_says() {
    let count = 100_000;
    let ray = |point: DVec3, end: f64| Seen { point, origin: DVec3::ZERO, direction: DVec3::Z, begin: 0.0, end };
    let cases = [
        (ray(v(0.3, 0.0, 0.5), 1.0), 0.3),
        (ray(v(0.05, 0.0, 0.2), 1.0), 0.05),
        (ray(v(0.0, 0.2, -0.5), 2.0), 0.2),
        (ray(v(0.6, 0.8, 0.5), 1.0), 1.0),
        (ray(v(0.5, 0.0, 1.5), 1.0), 0.5),
    ];
    for (seen, distance) in cases {
        // Evenly spread numbers: the means below are sums of Riemann, without noise.
        let asked: Vec<(Seen, f64)> = (0..count).map(|k| (seen, (f64::from(k) + 0.5) / f64::from(count))).collect();
        let found = distances(&asked);
        let integral = check_distances(&found, &seen, distance).unwrap_or_else(|why| panic!("{seen:?}: {why}"));
        eprintln!("{seen:?}: the density integrates to {integral:.5}");
        check_distances(&found, &seen, distance * 1.6).expect_err("the distances of another point");
        let wrong: Vec<Distance> = found.iter().map(|one| Distance { pdf: one.pdf * 1.01, ..*one }).collect();
        check_distances(&wrong, &seen, distance).expect_err("a density that is 1 % off");
    }
}

/// Asks the kernel of lights; the outputs come in threes.
fn ask_lights(lights: &[Light], inputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let count = inputs.len() / 2;
    run("light", inputs, &[bytemuck::cast_slice(lights)], count, 4 * count)
}

fn volume(center: Vec3, radius: f32) -> Light {
    Light {
        kind: LIGHT_VOLUME,
        origin: center,
        edge_1: Vec3::new(radius, 1.0, 0.0),
        radiance: Vec3::new(3.0, 2.0, 1.0),
        alias_threshold: 1.0,
        ..Light::default()
    }
}

#[test]
fn emitting_volumes_are_sampled_as_by_the_reference() {
    let lights = [volume(Vec3::new(0.3, 0.2, -0.1), 0.5), volume(Vec3::ZERO, 0.1), volume(Vec3::ONE, 1e-3)];
    let wide: Vec<bindings::Light> = lights.iter().map(bindings::Light::from).collect();
    let mut random = Random(73);
    let numbers = [0.0, 1.0 / 16_777_216.0, 0.5, LAST];
    let mut inputs = Vec::new();
    for k in 0..6000 {
        let p = random.in_cube() * if k % 10 == 0 { 100.0 } else { 2.0 };
        let [u, v, w] = [0, 1, 2].map(|j| if k % 4 == j { numbers[k / 4 % 4] } else { random.unit() });
        inputs.extend([vec4(&[p.x, p.y, p.z, v]), vec4(&[u, (k % 3) as f64, w])]);
    }
    let names =
        ["volume light direction", "volume light distance", "volume light weight", "volume_light_pdf", "light pdf"];
    let [mut direction, mut distance, mut weight, mut asked, mut pdf] = names.map(comparison);
    let outputs = ask_lights(&lights, &inputs);
    let mut inside = 0;
    for (input, output) in inputs.chunks(2).zip(outputs.chunks(4)) {
        let (point, u) = (widen(&input[0][..3]), DVec2::new(f64::from(input[1][0]), f64::from(input[0][3])));
        let light = &wide[input[1][1] as usize];
        let case = format!("{input:?}");
        let expected = light::sample_volume_light(light, point, u, f64::from(input[1][2]));
        let radius = light.edge_1.x;
        if (point.distance(light.origin) / radius - 1.0).abs() < 1e-3 {
            continue;
        }
        inside += usize::from(expected.pdf == 0.0);
        direction.vector(&case, &output[0][..3], expected.direction);
        pdf.scalar(&case, output[1][3], expected.pdf);
        // At the rim of a sphere, and all over one that covers little of the view, the chord is lost to rounding of the direction.
        let sine = radius / point.distance(light.origin);
        if sine > 0.1 && u.x < 0.9 {
            distance.scalar(&case, output[0][3], expected.distance);
            weight.vector(&case, &output[1][..3], expected.weight);
            asked.scalar(&case, output[2][0], light::volume_light_pdf(light, point, expected.direction));
        }
        let sampled = widen(&output[1][..3]);
        assert!(sampled.is_finite() && sampled.min_element() >= 0.0 && output[0][3] >= 0.0, "{case}");
    }
    assert!(inside > 10, "some points lie inside: {inside}");
    [direction, distance, weight, asked, pdf].into_iter().for_each(Comparison::finish);
}

#[test]
fn emitting_volumes_give_the_fluence_of_the_closed_form() {
    // What a ball of radius R that emits ε per length and absorbs nothing sends to a point at the distance D > R, from all
    // directions: ∫ ε/r² dV = 2π ε (R − (D² − R²)/(2 D) log((D + R)/(D − R))), by shells about the point.
    let light = volume(Vec3::new(0.2, 0.1, 0.0), 0.5);
    for far in [0.501, 0.6, 1.0, 3.0] {
        let point = DVec3::new(0.2, 0.1, 0.0).as_vec3().as_dvec3() + v(0.48, 0.64, 0.6) * far;
        let side = 128;
        let middle = |k: i32| (f64::from(k) + 0.5) / f64::from(side);
        let inputs: Vec<[f32; 4]> = (0..side * side)
            .flat_map(|k| {
                [vec4(&[point.x, point.y, point.z, middle(k / side)]), vec4(&[middle(k % side), 0.0, middle(k % 97)])]
            })
            .collect();
        let outputs = ask_lights(&[light], &inputs);
        let found = outputs.chunks(4).map(|output| f64::from(output[1][0])).sum::<f64>() / f64::from(side * side);
        let (r, d) = (0.5, point.distance(DVec3::new(0.2, 0.1, 0.0).as_vec3().as_dvec3()));
        let expected = 3.0 * 2.0 * PI * (r - (d * d - r * r) / (2.0 * d) * ((d + r) / (d - r)).ln());
        let agrees = |found: f64| (found / expected - 1.0).abs() < 2e-3;
        assert!(agrees(found), "from {far}: {found}, expected {expected}");
        assert!(!agrees(found * 1.005) && !agrees(found * 0.995), "the comparison is blind");
    }
}

#[test]
fn lights_at_the_ends_of_their_numbers_and_at_impossible_points() {
    let plane = |kind| Light {
        kind,
        origin: Vec3::new(-0.3, 0.9, -0.2),
        edge_1: Vec3::new(0.6, 0.0, 0.0),
        edge_2: Vec3::new(0.0, 0.0, 0.5),
        area: if kind == LIGHT_QUAD { 0.3 } else { 0.15 },
        normal: Vec3::NEG_Y,
        radiance: Vec3::ONE,
        ..Light::default()
    };
    let sphere = |radius, side| Light {
        kind: LIGHT_SPHERE,
        origin: Vec3::new(0.2, 0.8, -0.1),
        edge_1: Vec3::new(radius, side, 0.0),
        radiance: Vec3::ONE,
        ..Light::default()
    };
    let point = Light { kind: LIGHT_POINT, origin: Vec3::new(0.2, 0.8, -0.1), radiance: Vec3::ONE, ..Light::default() };
    let spot = |cutoff: f32, beam: f32| {
        let slope = if cutoff > beam { 1.0 / (cutoff - beam) } else { 0.0 };
        Light { kind: LIGHT_SPOT, edge_1: Vec3::new(cutoff, beam, slope), normal: Vec3::NEG_Y, ..point }
    };
    let lights = [
        plane(LIGHT_TRIANGLE),
        plane(LIGHT_QUAD),
        sphere(0.3, 1.0),
        sphere(1e-6, 1.0),
        sphere(0.3, -1.0),
        point,
        spot(0.6, 0.3),
        spot(1e-3, 1e-3),
        volume(Vec3::new(0.2, 0.8, -0.1), 0.3),
        volume(Vec3::new(0.2, 0.8, -0.1), 1e-6),
    ];
    // On the lights, at their corners and centres, on the axis of the spot and behind it, beside and very far away.
    let mut points = vec![
        v(-0.3, 0.9, -0.2),
        v(0.3, 0.9, -0.2),
        v(0.0, 0.9, 0.0),
        v(0.0, 0.9 - 1e-7, 0.0),
        v(5.0, 0.9, 0.0),
        v(0.2, 0.8, -0.1),
        v(0.2, 0.8 + 1e-20, -0.1),
        v(0.2, 0.5, -0.1),
        v(0.2, 1.1, -0.1),
        v(0.5, 0.8, -0.1),
        v(0.2, -5.0, -0.1),
        v(1e6, 0.8, 2e6),
        v(0.0, -1e8, 0.0),
    ];
    let mut random = Random(74);
    points.extend((0..200).map(|_| v(0.2, 0.8, -0.1) + random.direction() * 0.3));
    let ends = [0.0, 1.0 / 16_777_216.0, 0.5, LAST];
    let mut inputs = Vec::new();
    for index in 0..lights.len() {
        for p in &points {
            for k in 0..64 {
                let [u, v, w] = [k % 4, k / 4 % 4, k / 16].map(|k| ends[k]);
                inputs.extend([vec4(&[p.x, p.y, p.z, v]), vec4(&[u, index as f64, w])]);
            }
        }
    }
    let outputs = ask_lights(&lights, &inputs);
    let check = |output: &[[f32; 4]]| {
        let (direction, weight) = (widen(&output[0][..3]), widen(&output[1][..3]));
        let pdf = f64::from(output[1][3]);
        let sent = weight != DVec3::ZERO;
        // Only what is sent has to have a direction and a distance.
        let usable = (direction.length() - 1.0).abs() < 1e-5 && output[0][3] >= 0.0 && output[0][3].is_finite();
        weight.is_finite() && weight.min_element() >= 0.0 && pdf.is_finite() && pdf >= 0.0 && (usable || !sent)
    };
    for (input, output) in inputs.chunks(2).zip(outputs.chunks(4)) {
        assert!(check(output), "{input:?}: {output:?}");
    }
    let mut broken = outputs[..3].to_vec();
    broken[1][0] = f32::NAN;
    assert!(!check(&broken), "a weight that is not a number must be noticed");
}

#[test]
fn rough_surfaces_at_the_ends_of_their_numbers() {
    let surfaces: Vec<Surface> = [false, true]
        .into_iter()
        .flat_map(|ggx| {
            let rough = [1e-3f32, 0.1, 1.0].into_iter().flat_map(move |alpha| {
                [glass(alpha, ggx), metal(alpha, ggx), plastic(alpha, ggx), brushed(metal(alpha, ggx), 0.3)]
            });
            rough.chain([rough_plastic(0.1, ggx), Surface { eta: 1.0 / 1.5, ..glass(0.1, ggx) }])
        })
        .collect();
    let ends = [0.0, 1.0 / 16_777_216.0, 0.5, LAST];
    let directions = [DVec3::Z, v(1.0, 0.0, 1e-6), v(0.0, -1.0, 1e-4), v(0.6, 0.0, 0.8), -DVec3::Z, v(1.0, 0.0, -1e-6)];
    let mut queries = Vec::new();
    for surface in 0..surfaces.len() {
        for wi in directions {
            for k in 0..64 {
                let [u, v, lobe] = [k % 4, k / 4 % 4, k / 16].map(|k| ends[k]);
                queries.push(Query { surface, wi, wo: wi, u: [u, v], lobe });
            }
        }
    }
    let answers = ask(&surfaces, &queries);
    let unit = |v: DVec3| (v.length() - 1.0).abs() < 1e-5;
    let check = |answer: &crate::common::surfaces::Answer| {
        let numbers = [&answer.weight[..], &answer.value, &[answer.pdf, answer.value_pdf, answer.eta]];
        let finite = numbers.iter().flat_map(|part| part.iter()).all(|number| number.is_finite());
        finite && (answer.failed() || (unit(answer.wo()) && answer.pdf >= 0.0))
    };
    for (query, answer) in queries.iter().zip(&answers) {
        assert!(check(answer), "{query:?}: {answer:?}");
        // Of visible facets (Heitz 2018): what is masked is the weight, so it is no more than 1, but for what refraction compresses. Plastic's
        // body, which may leave a quarter of the samples to the coat, has 4/3; and that in the mean over the channels, by which it is
        // chosen, where no facet of the coat is likely (GGX has some everywhere).
        let flags = surfaces[query.surface].flags;
        let plastic = flags >> SURFACE_KIND_SHIFT == BSDF_PLASTIC;
        let weight = answer.weight.map(|weight| weight * answer.eta * answer.eta);
        let mean = [weight.iter().sum::<f32>() / 3.0];
        let weights = if plastic && flags & SURFACE_GGX == 0 { &mean[..] } else { &weight[..] };
        let most = if plastic { 1.335 } else { 1.001 };
        assert!(weights.iter().all(|weight| (0.0..most).contains(weight)), "{query:?}: {answer:?}");
    }
    for (query, facet) in queries.iter().zip(ask_facets(&surfaces, &queries)) {
        let numbers = [facet.density, facet.masking[0], facet.masking[1], facet.pdf];
        assert!(numbers.iter().all(|number| *number >= 0.0 && number.is_finite()), "{query:?}: {facet:?}");
        assert!(unit(widen(&facet.normal)), "{query:?}: {facet:?}");
    }
    let nan = crate::common::surfaces::Answer { pdf: f32::NAN, ..answers[0] };
    assert!(!check(&nan), "a density that is not a number must be noticed");
}
