//! Phase functions beyond Henyey and Greenstein's: what is packed, what the kernel draws, and what a path makes of it.
//! The definition that all is held against is `tyndall::scene::Phase::eval`.

mod common;

use common::comparison::Comparison;
use common::phases::Packed;
use common::random::Random;
use common::scenes::{self, v};
use common::statistics::{check_uniform, mean_and_error, sidak_bound};
use common::tolerances::comparison;
use common::units::widen;
use common::{images, phases};
use glam::DVec3;
use std::f64::consts::PI;
use tyndall::pack::PackError;
use tyndall::pack::layout::{PHASE_HENYEY_GREENSTEIN, PHASE_RAYLEIGH, PHASE_TABULATED};
use tyndall::reference::{math, phase, warp};
use tyndall::scene::{Film, Light, Medium, Phase, Shape};

fn table(values: &[f64]) -> Phase {
    Phase::tabulated(values.to_vec()).expect("a table")
}

fn blend(weight: f64, a: Phase, b: Phase) -> Phase {
    Phase::Blend { weight, a: Box::new(a), b: Box::new(b) }
}

/// Nothing but forwards, within 60°.
fn forward_only() -> Phase {
    table(&[0.0, 0.0, 0.0, 0.0, 3.0])
}

/// Rayleigh's, Henyey and Greenstein's, and a table, in shares of 0.3, 0.49 and 0.21.
fn three() -> Phase {
    let inner = blend(0.3, Phase::HenyeyGreenstein { g: 0.6 }, table(&[2.0, 0.0, 1.0, 0.2, 0.0, 5.0]));
    blend(0.7, Phase::Rayleigh, inner)
}

fn kinds() -> Vec<(&'static str, Phase)> {
    let many: Vec<f64> = (0..1001).map(|k| 1.0 + (f64::from(k) * 0.1).sin()).collect();
    vec![
        ("Rayleigh", Phase::Rayleigh),
        ("two values", table(&[1.0, 3.0])),
        ("even", table(&[1e-30; 7])),
        ("forward only", forward_only()),
        ("backward only", table(&[1.0, 0.0, 0.0])),
        ("gap", table(&[4.0, 1.0, 0.0, 0.0, 0.0, 1e-6, 3.0])),
        ("many values", table(&many)),
        ("blend of three", three()),
        ("small share", blend(1e-4, Phase::Isotropic, forward_only())),
    ]
}

#[test]
fn blends_are_packed_flat() {
    let packed = Packed::new(&three());
    assert_eq!((packed.g, packed.phase), (0.0, 2 | 3 << 24), "three components, after the one that is there");
    let found: Vec<_> = packed.phases[1..].iter().map(|component| (component.kind, component.weight)).collect();
    let weights = [(1.0 - 0.7), 0.7 * (1.0 - 0.3), 0.7 * 0.3].map(|weight: f64| weight as f32);
    let kinds = [PHASE_RAYLEIGH, PHASE_HENYEY_GREENSTEIN, PHASE_TABULATED];
    assert_eq!(found, kinds.into_iter().zip(weights).collect::<Vec<_>>());
    assert_eq!((packed.phases[2].g, packed.phases[3].first_value, packed.phases[3].value_count), (0.6, 3, 6));
    assert_eq!((packed.values[9], packed.values[14]), (0.0, 1.0), "the distribution function follows the densities");

    // What amounts to one function of Henyey and Greenstein's is one, and what has no share is left out.
    let forward = || Phase::HenyeyGreenstein { g: 0.5 };
    for same in [
        forward(),
        blend(0.3, forward(), forward()),
        blend(0.0, forward(), Phase::Rayleigh),
        blend(1.0, three(), blend(0.2, forward(), forward())),
    ] {
        assert_eq!((Packed::new(&same).g, Packed::new(&same).phase), (0.5, 0), "{same:?}");
    }
    assert_eq!(Packed::new(&Phase::Isotropic).phase, 0);
    let united =
        Packed::new(&blend(0.5, blend(0.5, Phase::Rayleigh, forward()), blend(0.5, forward(), Phase::Rayleigh)));
    assert_eq!(united.phase >> 24, 2);
    assert_eq!([united.phases[1].weight, united.phases[2].weight], [0.5, 0.5]);
}

#[test]
fn too_many_components_are_refused() {
    let of = |count: u32| {
        let one = |k: u32| Phase::HenyeyGreenstein { g: f64::from(k) / 1000.0 };
        let phase = (1..count).fold(one(0), |phase, k| blend(1.0 / f64::from(k + 1), phase, one(k)));
        let mut scene = scenes::gray_box();
        scene.media[0].phase = phase;
        tyndall::pack::Packed::new(&scene, 0)
    };
    assert_eq!(of(255).expect("it fits").media[1].phase, 1 | 255 << 24);
    let error = of(256).expect_err("one too many");
    assert_eq!(error, PackError::TooManyPhases { name: "gray".to_owned(), count: 256 });
}

/// The numbers k/2²⁴ that matter most: both ends, powers of two, and some in between.
fn units_in_question() -> Vec<f64> {
    let last = (1u32 << 24) - 1;
    let mut numbers: Vec<u32> = (0..100).chain(last - 100..=last).collect();
    numbers.extend((0..24).flat_map(|bit| [(1 << bit) - 1, 1 << bit, last - (1 << bit)]));
    let mut random = Random(1);
    numbers.extend((0..2000).map(|_| random.bits() as u32 >> 8));
    numbers.into_iter().map(|k| f64::from(k) / 16_777_216.0).collect()
}

#[test]
fn device_and_reference_agree() {
    let names = ["mixture's 1 - cos", "mixture's cos", "mixture's sin", "mixture's direction", "eval_mixture"];
    let mut functions = names.map(comparison);
    let mut random = Random(2);
    for (name, phase) in kinds() {
        let packed = Packed::new(&phase);
        let tables = phase::PhaseTables { phases: &packed.phases, values: &packed.values };
        let query = |u| packed.query(u, random.unit(), random.unit(), random.direction());
        let inputs: Vec<[f32; 4]> = units_in_question().into_iter().flat_map(query).collect();
        for (input, output) in inputs.chunks(3).zip(packed.ask(&inputs).chunks(2)) {
            let [_, u, turn, choice] = input[0].map(f64::from);
            let before = widen(&input[1][..3]);
            let case = format!("{name}, u = {u}, choice = {choice}");
            let angle = phase::sample_mixture(tables, packed.phase, u, choice);
            functions[0].scalar(&case, output[0][0], angle.one_minus_cos);
            functions[1].scalar(&case, output[0][1], angle.cos_theta);
            functions[2].scalar(&case, output[0][2], angle.sin_theta);
            let local = warp::from_polar(angle.cos_theta, angle.sin_theta, turn);
            functions[3].vector(&case, &output[1][..3], math::from_frame(before, local));
            // Of the direction that the kernel found: rounding it is not an error of the function.
            let after = widen(&output[1][..3]);
            functions[4].scalar(&case, output[1][3], phase::eval_mixture(tables, packed.phase, before, after));
        }
    }
    functions.into_iter().for_each(Comparison::finish);
}

#[test]
fn rayleighs_angle_is_the_root_of_the_cubic() {
    // c³ + 3 c = 8 u − 4 has the one real root a − 1/a, a³ = q + √(q² + 1), q = 4 u − 2 (Cardano).
    let packed = Packed::new(&Phase::Rayleigh);
    let numbers = units_in_question();
    let inputs: Vec<[f32; 4]> = numbers.iter().flat_map(|&u| packed.query(u, 0.0, 0.0, DVec3::Z)).collect();
    let outputs = packed.ask(&inputs);
    let wrong = |shift: f64| {
        numbers.iter().zip(outputs.chunks(2)).find(|(u, output)| {
            let q = 4.0 * (*u + shift) - 2.0;
            let a = (q + (q * q + 1.0).sqrt()).cbrt();
            let [_, cosine, sine, _] = output[0].map(f64::from);
            (cosine - (a - 1.0 / a)).abs() > 2e-7 || (cosine.hypot(sine) - 1.0).abs() > 2e-7
        })
    };
    assert_eq!(wrong(0.0), None);
    assert!(wrong(1e-6).is_some(), "the comparison is blind");
}

/// The distribution function of the cosine, by Simpson's rule on the definition, as a function that interpolates.
fn distribution(phase: &Phase) -> impl Fn(f64) -> f64 {
    // A multiple of the steps of all tables, so that no kink lies within a step.
    let steps = 60_000usize;
    let cosine = |k: f64| 2.0 * k / steps as f64 - 1.0;
    let mut sums = vec![0.0];
    for k in 0..steps {
        let at = |offset: f64| phase.eval(cosine(k as f64 + offset));
        sums.push(sums[k] + 2.0 * PI * 2.0 / steps as f64 / 6.0 * (at(0.0) + 4.0 * at(0.5) + at(1.0)));
    }
    move |cosine: f64| {
        let place = ((cosine + 1.0) / 2.0 * steps as f64).clamp(0.0, steps as f64);
        let index = (place as usize).min(steps - 1);
        sums[index] + (place - index as f64) * (sums[index + 1] - sums[index])
    }
}

#[test]
fn samples_follow_the_definition() {
    let mut random = Random(3);
    let all = kinds();
    for (index, (name, phase)) in all.iter().enumerate() {
        let packed = Packed::new(phase);
        let inputs: Vec<[f32; 4]> = (0..200_000)
            .flat_map(|_| packed.query(random.unit(), random.unit(), random.unit(), random.direction()))
            .collect();
        let outputs = packed.ask(&inputs);
        let samples = || inputs.chunks(3).zip(outputs.chunks(2));
        let along = || samples().map(|(input, output)| widen(&input[1][..3]).dot(widen(&output[1][..3])));
        let ranks = |phase: &Phase| {
            let distribution = distribution(phase);
            assert!((distribution(1.0) - 1.0).abs() < 1e-6, "{name} is not normalised");
            along().map(distribution).collect::<Vec<_>>()
        };
        check_uniform(ranks(phase), 40).unwrap_or_else(|why| panic!("{name}: {why}"));
        let other = if index == 0 { &all[1].1 } else { &Phase::Rayleigh };
        check_uniform(ranks(other), 40).expect_err("the samples of another phase function");
        let azimuths = samples().filter(|(_, output)| output[0][2] > 1e-3).map(|(input, output)| {
            let (tangent, bitangent) = widen(&input[1][..3]).any_orthonormal_pair();
            let after = widen(&output[1][..3]);
            after.dot(bitangent).atan2(after.dot(tangent)) / (2.0 * PI) + 0.5
        });
        check_uniform(azimuths, 20).unwrap_or_else(|why| panic!("{name}, azimuth: {why}"));
        // The density that is reported is the definition, up to the error that its slope makes of a cosine's.
        let wrong = |factor: f64| {
            samples().find(|(input, output)| {
                let cosine = widen(&input[1][..3]).dot(widen(&output[1][..3])).clamp(-1.0, 1.0);
                let (value, got) = (phase.eval(cosine), f64::from(output[1][3]));
                let slope = (phase.eval((cosine - 1e-4).max(-1.0)) - value).abs().max(value) * 1e4;
                (got - factor * value).abs() > 2e-6 * value + 4e-7 * slope.min(2000.0 * value.max(0.1))
            })
        };
        assert!(wrong(1.0).is_none(), "{name}: {:?}", wrong(1.0));
        assert!(wrong(1.01).is_some(), "{name}: blind to a density that is 1 % off");
    }
}

#[test]
fn densities_integrate_to_one_and_have_the_right_mean() {
    for (name, phase) in kinds() {
        let packed = Packed::new(&phase);
        // A lattice over the numbers for the angle and for the component.
        let count = 1 << 16;
        let golden = (5f64.sqrt() - 1.0) / 2.0;
        let inputs: Vec<[f32; 4]> = (0..count)
            .map(f64::from)
            .flat_map(|k| packed.query((k + 0.5) / f64::from(count), 0.25, (k * golden).fract(), DVec3::Z))
            .collect();
        let outputs = packed.ask(&inputs);
        let mean = outputs.chunks(2).map(|output| f64::from(output[0][1])).sum::<f64>() / (outputs.len() / 2) as f64;
        let steps = 60_000;
        let middle = |k: u32| (f64::from(k) + 0.5) * 2.0 / f64::from(steps) - 1.0;
        let expected = (0..steps).map(|k| middle(k) * phase.eval(middle(k))).sum::<f64>() * 4.0 * PI / f64::from(steps);
        assert!((mean - expected).abs() < 2e-4, "{name}: mean cosine {mean}, expected {expected}");
        if expected.abs() > 1e-3 {
            assert!((mean + expected).abs() > 2e-4, "{name}: blind to the sign");
        }
        let mut points: Vec<(f64, f64)> =
            outputs.chunks(2).map(|output| (f64::from(output[0][1]), f64::from(output[0][3]))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let trapezoid = |pair: &[(f64, f64)]| PI * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0);
        // Where the density is 0 there are no samples.
        let near = |pair: &&[(f64, f64)]| pair[1].0 - pair[0].0 < 0.02;
        let integral: f64 = points.windows(2).filter(near).map(trapezoid).sum();
        assert!((integral - 1.0).abs() < 2e-3, "{name}: the density integrates to {integral}");
    }
}

#[test]
fn a_table_that_is_forward_goes_forward() {
    let cosines = |phase: &Phase| {
        let packed = Packed::new(phase);
        let query = |u| packed.query(u, 0.3, 0.0, DVec3::X);
        let inputs: Vec<[f32; 4]> = units_in_question().into_iter().flat_map(query).collect();
        packed.ask(&inputs).chunks(2).map(|output| f64::from(output[1][0])).collect::<Vec<_>>()
    };
    assert!(cosines(&forward_only()).iter().all(|cosine| *cosine >= 0.5 - 1e-6));
    assert!(cosines(&table(&[3.0, 0.0, 0.0, 0.0, 0.0])).iter().all(|cosine| *cosine <= -0.5 + 1e-6));
    assert_eq!(phases::ask(&[], &[], &[]).len(), 0);
}

/// Single scattering in fog that fills everything, along a ray from the origin towards +z, from a point of intensity 1:
///   L = ∫ σs p(cos) exp(−σt (t + r))/r² dt, r = |light − t z|, cos = z · (t z − light)/r with the sign turned twice:
/// light travels from the lamp to the ray and then against it, so cos = (lamp − t z)·z / r.
fn single_scattering(phase: &Phase, light: DVec3, sigma_s: f64, sigma_t: f64) -> f64 {
    let (steps, end) = (50_000, 40.0 / sigma_t);
    let at = |t: f64| {
        let offset = light - DVec3::Z * t;
        let r = offset.length();
        sigma_s * phase.eval(offset.z / r) * (-sigma_t * (t + r)).exp() / (r * r)
    };
    // Midpoints, closer together near the camera.
    let place = |k: f64| end * (k / f64::from(steps)).powi(2);
    (0..steps).map(|k| at(place(f64::from(k) + 0.5)) * (place(f64::from(k) + 1.0) - place(f64::from(k)))).sum()
}

#[test]
fn single_scattering_is_that_of_the_definition() {
    let (light, sigma_s, sigma_t) = (v(0.4, 0.3, 1.5), 0.8, 1.0);
    let mut cases = Vec::new();
    for (seed, (name, phase)) in (1..).zip(kinds()) {
        if ["even", "two values", "many values", "backward only"].contains(&name) {
            continue;
        }
        let mut scene = scenes::one_ray(DVec3::ZERO, DVec3::Z, 16);
        scene.camera.near_clip = 0.0;
        let fog = scene.add_medium(Medium::new("fog", DVec3::splat(sigma_t), DVec3::splat(sigma_s), phase.clone()));
        scene.camera.medium = Some(fog);
        scene.lights.push(Light::Point { position: light, intensity: DVec3::ONE });
        // Something behind the camera, which spans the frame.
        let behind = scenes::quad(v(-1.0, -1.0, -5.0), DVec3::X * 2.0, DVec3::Y * 2.0);
        scene.shapes.push(Shape::diffuse("behind", behind, DVec3::ZERO));
        scene.integrator.max_depth = Some(2);
        let batches: Vec<f64> = images::batches(&scene, seed, 512).iter().map(|batch| batch.x).collect();
        let (mean, error) = mean_and_error(&batches);
        let z = |phase: &Phase| (mean - single_scattering(phase, light, sigma_s, sigma_t)) / error;
        assert!(error < 0.01 * mean, "{name}: {mean} ± {error}");
        let mirrored = match &phase {
            Phase::Tabulated { values } => Phase::Tabulated { values: values.iter().rev().copied().collect() },
            _ => Phase::HenyeyGreenstein { g: 0.1 },
        };
        assert!(z(&mirrored).abs() > 8.0, "{name}: blind");
        cases.push((name, z(&phase)));
    }
    let bound = sidak_bound(cases.len(), (images::BATCHES - 1) as f64);
    assert!(cases.iter().all(|(_, z)| z.abs() < bound), "{cases:?}, bound {bound:.2}");
    eprintln!("{cases:.2?}");
}

#[test]
fn a_medium_that_absorbs_nothing_is_invisible_in_a_furnace() {
    for (seed, (name, phase)) in (1..).zip(kinds()).step_by(3) {
        let mut scene = scenes::furnace(scenes::ball(DVec3::ZERO, 1.0), 3.0, 0.0);
        scene.media[0].phase = phase;
        let inner = scene.add_medium(Medium::new("inner", DVec3::splat(5.0), DVec3::ONE, three()));
        scene.shapes.push(Shape::boundary("inner", scenes::ball(v(0.2, 0.0, 0.1), 0.5), inner));
        scene.camera.fov_x = 8.0;
        scene.film = Film::new(16, 16);
        let batches: Vec<f64> = images::batches(&scene, seed, 192).iter().map(|batch| batch.x).collect();
        let (mean, error) = mean_and_error(&batches);
        let right = |mean: f64| error < 4e-3 && (mean - 1.0).abs() < 3.3 * error + 1e-5;
        assert!(right(mean), "{name}: {mean} ± {error}");
        assert!(!right(mean * 0.98), "{name}: blind");
    }
}
