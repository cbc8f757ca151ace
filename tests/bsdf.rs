//! BSDFs: what they draw against their densities, closed forms, energy, reciprocity, and whole images.

mod common;

use common::images;
use common::random::Random;
use common::scenes::{self, v};
use common::statistics::{chi_squared_tail, mean_and_error};
use common::surfaces::{Answer, Query, ask, brushed, glass, metal, plastic, principled, rough_plastic, single, values};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use tyndall::pack::Packed;
use tyndall::pack::features::Features;
use tyndall::pack::layout::{PRIMITIVE_BOUNDARY, PRIMITIVE_SPHERE, SURFACE_THIN, Surface};
use tyndall::reference::bsdf::pane_reflectance;
use tyndall::scene::{Camera, Film, Light, Scene, Shape};

/// A direction from its cosine and azimuth.
fn towards(cosine: f64, phi: f64) -> DVec3 {
    let sine = (1.0 - cosine * cosine).sqrt();
    single(v(sine * phi.cos(), sine * phi.sin(), cosine))
}

/// Bins of cosine and azimuth over the whole sphere; the surface is an edge between bins.
const ROWS: usize = 16;
const COLUMNS: usize = 16;
/// Points per side of a bin in the integral of the density.
const POINTS: usize = 20;
const SAMPLES: usize = 50_000;

fn samples(surface: &Surface, wi: DVec3, seed: u64) -> Vec<(Query, Answer)> {
    let mut random = Random(seed);
    let draw = |_| {
        let u = [random.unit(), random.unit()];
        Query { surface: 0, wi, wo: DVec3::Z, u, lobe: random.unit() }
    };
    let queries: Vec<Query> = (0..SAMPLES).map(draw).collect();
    let answers = ask(&[*surface], &queries);
    queries.into_iter().zip(answers).collect()
}

/// Numbers of samples in each bin.
fn histogram(samples: &[(Query, Answer)]) -> Vec<f64> {
    let mut counts = vec![0.0; ROWS * COLUMNS];
    for (_, answer) in samples.iter().filter(|(_, answer)| !answer.failed()) {
        let wo = answer.wo();
        let row = ((wo.z + 1.0) / 2.0 * ROWS as f64) as usize;
        let column = ((wo.y.atan2(wo.x) / (2.0 * PI) + 0.5) * COLUMNS as f64) as usize;
        counts[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)] += 1.0;
    }
    counts
}

/// The integral of the density over each bin, by the midpoint rule.
fn integrals(surface: &Surface, wi: DVec3) -> Vec<f64> {
    let (rows, columns) = (ROWS * POINTS, COLUMNS * POINTS);
    let query = |k: usize| {
        let cosine = ((k / columns) as f64 + 0.5) / rows as f64 * 2.0 - 1.0;
        let phi = (((k % columns) as f64 + 0.5) / columns as f64 - 0.5) * 2.0 * PI;
        Query { surface: 0, wi, wo: towards(cosine, phi), u: [0.5; 2], lobe: 0.5 }
    };
    let queries: Vec<Query> = (0..rows * columns).map(query).collect();
    let mut bins = vec![0.0; ROWS * COLUMNS];
    for (k, answer) in ask(&[*surface], &queries).iter().enumerate() {
        let bin = k / columns / POINTS * COLUMNS + k % columns / POINTS;
        bins[bin] += f64::from(answer.value_pdf) * 4.0 * PI / (rows * columns) as f64;
    }
    bins
}

/// Pearson's test of samples against the integrals of a density. What is missing from 1 in their sum is the share of
/// samples that fail, which is a bin of its own; bins that expect little are taken together.
fn check_histogram(counts: &[f64], integrals: &[f64]) -> Result<f64, String> {
    let (total, integral) = (SAMPLES as f64, integrals.iter().sum::<f64>());
    if integral > 1.0 + 2e-3 {
        return Err(format!("the density integrates to {integral}"));
    }
    let failed = (total - counts.iter().sum::<f64>(), total * (1.0 - integral).max(0.0));
    let bins = counts.iter().copied().zip(integrals.iter().map(|share| share * total)).chain([failed]);
    let (mut rest, mut chi_squared, mut freedom) = ((0.0, 0.0), 0.0, -1.0);
    let mut add = |(count, expected): (f64, f64)| {
        chi_squared += (count - expected).powi(2) / expected;
        freedom += 1.0;
    };
    for (count, expected) in bins {
        if expected < 25.0 {
            rest = (rest.0 + count, rest.1 + expected);
        } else {
            add((count, expected));
        }
    }
    if rest.1 >= 25.0 {
        add(rest);
    } else if rest.0 > 75.0 {
        return Err(format!("{} samples where {:.1} are expected", rest.0, rest.1));
    }
    let probability = chi_squared_tail(chi_squared, freedom);
    if probability < 1e-5 {
        return Err(format!(
            "chi² = {chi_squared:.1} with {freedom} degrees of freedom; integral {integral:.4}, failed {failed:?}"
        ));
    }
    Ok(probability)
}

fn rough_surfaces() -> Vec<(String, Surface, f64)> {
    let mut all = Vec::new();
    for ggx in [false, true] {
        for alpha in [0.1, 0.5] {
            for cosine in [0.8, 0.3] {
                let name = |kind: &str| format!("{kind}, alpha {alpha}, GGX {ggx}, cosine {cosine}");
                all.push((name("glass from outside"), glass(alpha, ggx), cosine));
                all.push((name("glass from inside"), glass(alpha, ggx), -cosine));
                all.push((name("metal"), metal(alpha, ggx), cosine));
                all.push((name("plastic"), plastic(alpha, ggx), cosine));
                all.push((name("rough plastic"), rough_plastic(alpha, ggx), cosine));
                all.push((name("brushed metal"), brushed(metal(alpha, ggx), 0.25), cosine));
                all.push((name("glass brushed from outside"), brushed(glass(alpha, ggx), 0.25), cosine));
                all.push((name("glass brushed from inside"), brushed(glass(alpha, ggx), 0.25), -cosine));
            }
        }
    }
    for (roughness, metallic, spec_trans) in [(0.4, 0.0, 0.0), (0.7, 0.3, 0.0), (0.5, 0.1, 0.6), (0.6, 0.0, 1.0)] {
        for cosine in [0.8, 0.3, -0.7] {
            let surface = principled(roughness, metallic, spec_trans);
            let name = |kind: &str| format!("{kind}, {roughness}, {metallic}, {spec_trans}, cosine {cosine}");
            if cosine > 0.0 || spec_trans > 0.0 {
                all.push((name("principled"), surface, cosine));
            }
            if cosine == 0.3 {
                all.push((name("brushed principled"), Surface { alpha: 1.5, ..brushed(surface, 0.6) }, cosine));
            }
        }
    }
    all
}

#[test]
fn rough_surfaces_draw_what_their_densities_say() {
    let mut wrong = Vec::new();
    for (seed, (name, surface, cosine)) in (70..).zip(rough_surfaces()) {
        let wi = towards(cosine, 0.3);
        let samples = samples(&surface, wi, seed);
        let counts = histogram(&samples);
        match check_histogram(&counts, &integrals(&surface, wi)) {
            Ok(probability) => eprintln!("{name}: probability {probability:.3}"),
            Err(why) => wrong.push(format!("{name}: {why}")),
        }
        let rougher = Surface { alpha: surface.alpha * 1.5, alpha_v: surface.alpha_v * 1.5, ..surface };
        check_histogram(&counts, &integrals(&rougher, wi)).expect_err("the density of a rougher surface");
        // Weights are value over density, and both are those that are asked for.
        let again: Vec<Query> = samples.iter().map(|(query, answer)| Query { wo: answer.wo(), ..*query }).collect();
        let mut energy = Vec::new();
        for ((_, sample), asked) in samples.iter().zip(ask(&[surface], &again)) {
            energy.push(f64::from(sample.weight[0] * sample.eta * sample.eta));
            if sample.failed() {
                continue;
            }
            assert!((sample.pdf / asked.value_pdf - 1.0).abs() < 1e-5, "{name}: {sample:?}, {asked:?}");
            for k in 0..3 {
                let value = sample.weight[k] * sample.pdf;
                assert!((value - asked.value[k]).abs() <= 1e-5 * asked.value[k], "{name}: {sample:?}, {asked:?}");
            }
        }
        let (albedo, error) = mean_and_error(&energy);
        // What facets shadow is lost, and under a rough varnish twice.
        let least = match &name {
            name if name.contains("principled") => 0.2,
            name if name.starts_with("rough plastic") => 0.35,
            _ => 0.5,
        };
        assert!(
            albedo > least && albedo <= 1.0 + 4.0 * error + 1e-6,
            "{name}: it reflects and transmits {albedo} ± {error}"
        );
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn smooth_glass_loses_nothing() {
    let surfaces = [glass(0.0, false), Surface { flags: glass(0.0, false).flags | SURFACE_THIN, ..glass(0.0, false) }];
    let mut queries = Vec::new();
    for k in 0..4000 {
        let wi = towards((f64::from(k % 200) - 99.5) / 100.0, 1.0);
        let lobe = (f64::from(k / 200) + 0.5) / 20.0;
        queries.push(Query { surface: (k % 2) as usize, wi, wo: DVec3::Z, u: [0.5; 2], lobe });
    }
    for (query, answer) in queries.iter().zip(ask(&surfaces, &queries)) {
        for weight in answer.weight {
            assert!((weight * answer.eta * answer.eta - 1.0).abs() < 1e-6, "{query:?}: {answer:?}");
        }
        assert_eq!(answer.pdf, 0.0);
        let wo = answer.wo();
        assert!((wo.length() - 1.0).abs() < 1e-6, "{query:?}: {answer:?}");
        let crosses = wo.z * query.wi.z < 0.0;
        // A pane is the same from both sides.
        let share = if query.surface == 0 { f64::from(answer.fresnel) } else { pane_reflectance(query.wi.z, 1.5) };
        assert_eq!(crosses, query.lobe >= share, "{query:?}: {answer:?}");
        // Snell's law: the tangential part, times the index, stays.
        let index = if query.surface == 0 && crosses { f64::from(answer.eta) } else { 1.0 };
        let tangential = (wo.truncate() * index + query.wi.truncate() * 1.0).length();
        assert!(tangential < 1e-6, "{query:?}: {answer:?}");
    }
}

#[test]
fn reflectances_are_those_of_textbooks() {
    // Glass, water and diamond at normal incidence, ((n − 1)/(n + 1))².
    for (n, printed) in [(1.5f32, 0.04), (1.333, 0.02037), (2.417, 0.17196)] {
        let surface = Surface { eta: n, ..glass(0.0, false) };
        let n = f64::from(n);
        // Brewster's angle, tan = n: no light polarised in the plane of incidence is reflected, so half of
        // ((n² − 1)/(n² + 1))² remains, and as much from inside at the angle with tan = 1/n.
        let brewster = 0.5 * ((n * n - 1.0) / (n * n + 1.0)).powi(2);
        let cases = [
            (1.0, printed),
            (-1.0, printed),
            (1.0 / (1.0 + n * n).sqrt(), brewster),
            (-n / (1.0 + n * n).sqrt(), brewster),
            (1e-9, 1.0),
            (-0.999 * (1.0 - 1.0 / (n * n)).sqrt(), 1.0),
        ];
        let queries: Vec<Query> = cases
            .iter()
            .map(|(cosine, _)| Query { surface: 0, wi: towards(*cosine, 0.0), wo: DVec3::Z, u: [0.5; 2], lobe: 0.5 })
            .collect();
        for ((cosine, expected), answer) in cases.iter().zip(ask(&[surface], &queries)) {
            let agrees = |found: f32| (f64::from(found) - expected).abs() < 1e-5;
            assert!(agrees(answer.fresnel), "n = {n}, cosine {cosine}: {}, expected {expected}", answer.fresnel);
            assert!(!agrees(answer.fresnel * 1.001), "the comparison is blind");
        }
    }
    // Metal at normal incidence, ((n − 1)² + k²)/((n + 1)² + k²), and grazing, 1.
    let surface = metal(0.0, false);
    let query = |cosine| Query { surface: 0, wi: towards(cosine, 0.0), wo: DVec3::Z, u: [0.5; 2], lobe: 0.5 };
    let answers = ask(&[surface], &[query(1.0), query(1e-7)]);
    let (n, k2) = (surface.transmittance, surface.extinction * surface.extinction);
    let expected = ((n - 1.0) * (n - 1.0) + k2) / ((n + 1.0) * (n + 1.0) + k2);
    assert!((Vec3::from(answers[0].conductor) - expected).abs().max_element() < 1e-6, "{:?}", answers[0]);
    assert!((Vec3::from(answers[1].conductor) - Vec3::ONE).abs().max_element() < 1e-5, "{:?}", answers[1]);
}

#[test]
fn surfaces_are_reciprocal() {
    let mut random = Random(81);
    for (name, surface, _) in rough_surfaces() {
        let pairs: Vec<(DVec3, DVec3)> = (0..4000).map(|_| (random.direction(), random.direction())).collect();
        let query = |wi, wo| Query { surface: 0, wi, wo, u: [0.5; 2], lobe: 0.5 };
        let there: Vec<Query> = pairs.iter().map(|(a, b)| query(*a, *b)).collect();
        let back: Vec<Query> = pairs.iter().map(|(a, b)| query(*b, *a)).collect();
        // Radiance is divided by the square of the index on the side of wi.
        let index = |w: DVec3, n: f64| if w.z < 0.0 { n } else { 1.0 };
        let mut seen = [0; 2];
        let answers = ask(&[surface], &there).into_iter().zip(ask(&[surface], &back));
        for ((a, b), (there, back)) in pairs.iter().zip(answers) {
            let n = f64::from(surface.eta);
            if a.z.abs() < 1e-3 || b.z.abs() < 1e-3 {
                continue;
            }
            let of = |answer: &Answer, wi: DVec3, wo: DVec3, n: f64| {
                f64::from(answer.value[1]) / wo.z.abs() / index(wi, n).powi(2)
            };
            let agrees = |n: f64| {
                let (f, g) = (of(&there, *a, *b, n), of(&back, *b, *a, n));
                (f - g).abs() <= 5e-3 * f.max(g) + 2e-6
            };
            let (f, g) = (of(&there, *a, *b, n), of(&back, *b, *a, n));
            assert!(agrees(n), "{name}: {a}, {b}: {f}, {g}: {there:?}, {back:?}");
            if there.value[1] > 1e-2 {
                let crosses = a.z * b.z < 0.0;
                seen[usize::from(crosses)] += 1;
                assert!(!crosses || !agrees(n * 1.01), "the comparison is blind to the index");
            }
        }
        assert!(seen[0] > 10, "{name}: nothing is reflected");
        assert!(seen[1] > 10 || !name.starts_with("glass"), "{name}: nothing is refracted");
    }
}

/// Tables of a scene in which the surfaces of named shapes scatter in another way. A boundary becomes a surface and keeps
/// its media.
fn pack_with(scene: &Scene, seed: u32, replaced: &[(&str, Surface)]) -> Packed {
    let mut packed = scenes::pack(scene, seed);
    for (name, surface) in replaced {
        let index = scene.shapes.iter().position(|shape| shape.name == *name).expect("the shape exists");
        let old = packed.surfaces[index];
        packed.surfaces[index] = Surface { media: old.media, sigma_t_step: old.sigma_t_step, ..*surface };
        let same = |surface: u32| surface & !(PRIMITIVE_BOUNDARY | PRIMITIVE_SPHERE) == index as u32;
        for primitive in packed.primitives.iter_mut().filter(|primitive| same(primitive.surface)) {
            primitive.surface &= !PRIMITIVE_BOUNDARY;
        }
    }
    packed.values = values();
    packed.features = Features::of(scene, &packed);
    packed
}

/// A Cornell box with an object in the place of the medium.
fn box_with(medium: bool) -> Scene {
    let mut scene = scenes::gray_box();
    scene.lights.push(Light::Constant { radiance: v(0.1, 0.2, 0.3) });
    if !medium {
        scene.shapes.pop();
        scene.media.clear();
        scene.shapes.push(Shape::diffuse("ball", scenes::ball(v(0.1, -0.2, 0.0), 0.6), DVec3::splat(0.5)));
    }
    scene
}

#[test]
fn device_and_reference_follow_the_same_paths() {
    let tinted =
        Surface { specular: Vec3::new(0.9, 0.8, 1.0), transmittance: Vec3::new(1.0, 0.7, 0.9), ..glass(0.0, false) };
    let cases = [
        ("glass", false, tinted),
        ("glass with a medium", true, glass(0.0, false)),
        ("rough glass", false, glass(0.2, true)),
        ("rough glass with a medium", true, glass(0.3, false)),
        ("mirror", false, metal(0.0, false)),
        ("rough metal", false, metal(0.15, false)),
        ("smooth plastic", false, plastic(0.0, false)),
        ("rough plastic", false, rough_plastic(0.2, true)),
        ("principled", false, principled(0.4, 0.3, 0.0)),
        ("clear principled with a medium", true, principled(0.5, 0.1, 0.7)),
    ];
    for (name, medium, surface) in cases {
        let packed = pack_with(&box_with(medium), 17, &[("ball", surface)]);
        let (device, reference) = (images::on_device(&packed, 16), images::by_reference(&packed, 16));
        let share = images::compare(&device, &reference).unwrap_or_else(|why| panic!("{name}: {why}"));
        eprintln!("{name}: {:.2} % of the pixels agree", share * 100.0);
        let other = pack_with(
            &box_with(medium),
            17,
            &[(
                "ball",
                Surface {
                    eta: surface.eta * 1.05,
                    alpha: surface.alpha * 1.05,
                    alpha_v: surface.alpha_v * 1.05,
                    specular: surface.specular * 0.9,
                    ..surface
                },
            )],
        );
        images::compare(&device, &images::by_reference(&other, 16)).expect_err("another surface");
    }
}

#[test]
fn glass_around_a_medium_is_invisible_in_a_furnace() {
    for (name, surface) in [
        ("smooth", glass(0.0, false)),
        ("smooth, of a large index", Surface { eta: 2.5, ..glass(0.0, false) }),
        ("rough", glass(0.1, true)),
    ] {
        let mut scene = scenes::furnace(scenes::ball(DVec3::ZERO, 1.0), 2.0, 0.5);
        scene.camera = Camera::look_at(v(0.05, 0.1, 4.0), DVec3::ZERO, DVec3::Y, 24.0);
        scene.film = Film::new(16, 16);
        let packed = pack_with(&scene, 5, &[("medium", surface)]);
        let batches: Vec<f64> = images::batches_of(&packed, 2048).iter().map(|batch| batch.x).collect();
        let (mean, error) = mean_and_error(&batches);
        eprintln!("{name}: {mean:.6} ± {error:.1e}");
        if surface.alpha == 0.0 {
            assert!(error <= 1e-3, "{name}: the standard error is {error}");
            assert!((mean - 1.0).abs() <= 3.0 * error + 1e-5, "{name}: {mean} ± {error}");
            assert!((mean * 0.99 - 1.0).abs() > 3.0 * error + 1e-5, "the comparison is blind");
        } else {
            // Rough surfaces lose what is reflected more than once between facets, and never gain.
            assert!(error <= 5e-3 && mean <= 1.0 + 3.0 * error && mean > 0.7, "{name}: {mean} ± {error}");
        }
    }
}
