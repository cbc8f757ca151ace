//! BSDFs of the kernels against the reference, over ordinary and extreme inputs.

mod common;

use common::comparison::Comparison;
use common::random::Random;
use common::scenes::v;
use common::surfaces::{
    Query, ask, ask_facets, brushed, glass, metal, plastic, principled, rough_plastic, single, values,
};
use common::tolerances::comparison;
use common::units::widen;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use tyndall::pack::layout::{SURFACE_GGX, SURFACE_NONLINEAR, SURFACE_THIN, Surface};
use tyndall::reference::bindings;
use tyndall::reference::bsdf::{BsdfValue, fresnel_conductor, fresnel_dielectric, roughness};
use tyndall::reference::microfacet::{facet_density, facet_masking, facet_pdf, sample_facet};
use tyndall::reference::path_vertex::{eval_surface, sample_surface};

/// The largest of the program's random numbers.
const LAST: f64 = 1.0 - 1.0 / 16_777_216.0;

fn surfaces() -> Vec<Surface> {
    let mut all = vec![Surface { reflectance: glam::Vec3::new(0.2, 0.5, 1.0), ..Surface::default() }];
    for ggx in [false, true] {
        for alpha in [0.0, 1e-3, 0.03, 0.1, 0.5, 1.0] {
            all.extend([glass(alpha, ggx), metal(alpha, ggx), plastic(alpha, ggx)]);
            all.push(Surface { eta: 0.7, ..glass(alpha, ggx) });
            all.push(Surface { eta: 1.02, ..glass(alpha, ggx) });
        }
    }
    all.push(Surface { flags: glass(0.0, false).flags | SURFACE_THIN, ..glass(0.0, false) });
    all.push(Surface { flags: plastic(0.2, true).flags | SURFACE_NONLINEAR, ..plastic(0.2, true) });
    for ggx in [false, true] {
        all.extend([rough_plastic(0.1, ggx), rough_plastic(0.5, ggx)]);
        for (alpha, alpha_v) in [(0.05, 0.4), (0.6, 0.1)] {
            all.extend([brushed(glass(alpha, ggx), alpha_v), brushed(metal(alpha, ggx), alpha_v)]);
        }
    }
    all
}

/// Every parameter of the principled BSDF at its ends and between them.
fn principled_surfaces() -> Vec<Surface> {
    let mut all = Vec::new();
    for roughness in [0.0, 0.1, 0.3, 0.7, 1.0] {
        for (metallic, spec_trans) in [(0.0, 0.0), (1.0, 0.0), (0.2, 0.7), (0.0, 1.0)] {
            all.push(principled(roughness, metallic, spec_trans));
        }
    }
    let plain = principled(0.5, 0.3, 0.4);
    let opaque = principled(0.5, 0.3, 0.0);
    all.push(Surface { alpha: 2.0, ..brushed(plain, 0.5) });
    all.push(Surface { eta: 0.7, ..plain });
    all.push(Surface { eta: 1.05, ..plain });
    all.push(Surface { eta: 1.0, ..opaque });
    all.push(Surface { specular_weight: 0.001, internal_reflectance: 1.0, ..opaque });
    all.push(Surface { specular_weight: 0.1, internal_reflectance: 1.0, ..opaque });
    all.push(Surface { reflectance: glam::Vec3::ZERO, ..plain });
    all.push(Surface { internal_reflectance: 0.0, extinction: glam::Vec3::ZERO, ..opaque });
    all
}

/// Directions that matter: along the normal, grazing, at and beside the border of total reflection, on both sides.
fn directions(random: &mut Random, eta: f64) -> Vec<DVec3> {
    let critical = (1.0 - eta.min(1.0 / eta).powi(2)).sqrt();
    let mut cosines = vec![1.0, 1.0 - 1e-7, 1e-2, 1e-4, 1e-6];
    cosines.extend([-1e-3, -1e-5, -1e-6, 1e-6, 1e-5, 1e-3].map(|step| (critical + step).clamp(1e-6, 1.0)));
    cosines.extend((0..12).map(|_| random.unit().max(1e-3)));
    cosines
        .into_iter()
        .flat_map(|z| [z, -z])
        .map(|z: f64| {
            let (sine, phi) = ((1.0 - z * z).max(0.0).sqrt(), 6.0 * random.unit());
            single(v(sine * phi.cos(), sine * phi.sin(), z))
        })
        .collect()
}

/// Errors that rounding of the inputs explains are none: `got` moved towards `want` by as much as `want` changes when each
/// component of the inputs moves by two units of single precision's last place.
fn explained(got: f32, want: f64, moved: impl Iterator<Item = f64>) -> f32 {
    let slack: f64 = moved.map(|moved| (moved - want).abs()).sum();
    let error = f64::from(got) - want;
    if error.abs() <= slack { want as f32 } else { (want + error - slack.copysign(error)) as f32 }
}

fn nudges() -> impl Iterator<Item = DVec3> {
    [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis * 2.4e-7, axis * -2.4e-7])
}

/// `vector` moved in all ways that keep it on its side.
fn nudged(vector: DVec3) -> impl Iterator<Item = DVec3> {
    nudges().map(move |step| {
        let step = v(step.x, step.y, step.z * vector.z.abs().min(1.0));
        vector + step
    })
}

/// What `value` may lose where little light is refracted: single precision has an error of 1.2e-7 in Fresnel's reflectance
/// close to 1, so a relative one of 1.2e-7 / (1 - F) in what is left.
fn refracted(surface: &bindings::Surface, wi: DVec3, wo: DVec3) -> f64 {
    let eta = if wi.z > 0.0 { surface.eta } else { 1.0 / surface.eta };
    let m = (wi + wo * if wi.z * wo.z > 0.0 { 1.0 } else { eta }).normalize();
    let m = if m.z < 0.0 { -m } else { m };
    let left = |cosine: f64| 1.0 - fresnel_dielectric(cosine, surface.eta).0;
    let parts = [left(wi.z), left(wo.z), left(wi.dot(m))];
    if surface.eta == 0.0 { 0.0 } else { parts.iter().filter(|part| **part > 0.0).map(|part| 1.2e-7 / part).sum() }
}

struct Functions {
    all: Vec<(&'static str, Comparison)>,
}

impl Functions {
    fn new(names: &[&'static str]) -> Functions {
        Functions { all: names.iter().map(|name| (*name, comparison(name))).collect() }
    }

    fn of(&mut self, name: &str) -> &mut Comparison {
        &mut self.all.iter_mut().find(|(known, _)| *known == name).expect("it is listed").1
    }

    /// A number with all values that it has for inputs nearby.
    fn near(&mut self, name: &str, case: &str, got: f32, want: f64, moved: &[f64]) {
        let got = explained(got, want, moved.iter().copied());
        self.of(name).scalar(case, got, want);
    }

    fn near_vector(&mut self, name: &str, case: &str, got: [f32; 3], want: DVec3, moved: &[DVec3]) {
        let got = [0, 1, 2].map(|k| explained(got[k], want[k], moved.iter().map(|moved| moved[k])));
        self.of(name).vector(case, &got, want);
    }

    fn finish(self) {
        self.all.into_iter().for_each(|(_, comparison)| comparison.finish());
    }
}

fn queries(surfaces: &[Surface]) -> Vec<Query> {
    let mut random = Random(61);
    let numbers = [0.0, 1.0 / 16_777_216.0, 0.5, 0.999, LAST];
    let mut queries = Vec::new();
    for (index, surface) in surfaces.iter().enumerate() {
        let eta = f64::from(surface.eta).max(0.1);
        for wi in directions(&mut random, eta) {
            for k in 0..12 {
                let wo = match k % 3 {
                    0 => random.direction(),
                    // Near the mirror's direction, and near that of refraction.
                    1 => single((v(-wi.x, -wi.y, wi.z) + random.in_cube() * f64::from(surface.alpha)).normalize()),
                    _ => {
                        let (_, cos_t) = fresnel_dielectric(wi.z, eta);
                        let scale = if wi.z >= 0.0 { 1.0 / eta } else { eta };
                        let straight = v(-wi.x * scale, -wi.y * scale, cos_t);
                        single((straight + random.in_cube() * f64::from(surface.alpha)).normalize())
                    }
                };
                let u = if k < 5 { [numbers[k], random.unit()] } else { [random.unit(), numbers[k % 5]] };
                let lobe = if k == 7 {
                    0.0
                } else if k == 8 {
                    LAST
                } else {
                    random.unit()
                };
                queries.push(Query { surface: index, wi, wo, u, lobe });
            }
        }
    }
    queries
}

#[test]
fn fresnel() {
    let surfaces = surfaces();
    let queries = queries(&surfaces);
    let mut functions = Functions::new(&["fresnel_dielectric", "cosine of refraction", "fresnel_conductor"]);
    for (query, answer) in queries.iter().zip(ask(&surfaces, &queries)) {
        let surface = bindings::Surface::from(&surfaces[query.surface]);
        let case = format!("{query:?}");
        if surface.eta > 0.0 {
            let (f, cos_t) = fresnel_dielectric(query.wi.z, surface.eta);
            let moved: Vec<(f64, f64)> =
                nudged(query.wi).map(|wi| fresnel_dielectric(wi.z.clamp(-1.0, 1.0), surface.eta)).collect();
            let [fs, cosines] = [|pair: &(f64, f64)| pair.0, |pair: &(f64, f64)| pair.1]
                .map(|part| moved.iter().map(part).collect::<Vec<f64>>());
            functions.near("fresnel_dielectric", &case, answer.fresnel, f, &fs);
            functions.near("cosine of refraction", &case, answer.cos_t, cos_t, &cosines);
        }
        if surface.transmittance != DVec3::ZERO && surface.extinction != DVec3::ZERO {
            let expected = fresnel_conductor(query.wi.z.abs(), surface.transmittance, surface.extinction);
            functions.of("fresnel_conductor").vector(&case, &answer.conductor, expected);
        }
    }
    functions.finish();
}

/// Numbers that differ by roundings.
fn nudged_numbers(u: DVec2) -> [DVec2; 4] {
    let moved = [DVec2::Y * 2.4e-7, DVec2::Y * -2.4e-7, DVec2::X * 1.2e-7, DVec2::X * -1.2e-7];
    moved.map(|step| (u + step).clamp(DVec2::ZERO, DVec2::splat(LAST)))
}

#[test]
fn facets() {
    let mut functions = Functions::new(&["sample_facet", "facet_density", "facet_masking", "facet_pdf"]);
    let surfaces: Vec<Surface> = surfaces().into_iter().filter(|surface| surface.alpha > 0.0).collect();
    let queries = queries(&surfaces);
    for (query, answer) in queries.iter().zip(ask_facets(&surfaces, &queries)) {
        let surface = bindings::Surface::from(&surfaces[query.surface]);
        let (ggx, alpha) = (surface.flags & SURFACE_GGX != 0, roughness(&surface));
        let (case, u) = (format!("{query:?}, {alpha}, GGX: {ggx}"), DVec2::from_array(query.u));
        let expected = sample_facet(query.wi, u, alpha, ggx);
        // Half way between two nearly opposite directions, the rounding of either counts.
        let stretched = |w: DVec3, alpha: DVec2| (w.truncate() * alpha).extend(w.z).normalize();
        let half = stretched(expected, 1.0 / alpha).dot(stretched(query.wi, alpha)).abs();
        let rounded = if ggx { DVec3::splat(1.2e-7 / half) } else { DVec3::ZERO };
        let moved: Vec<DVec3> = nudged(query.wi)
            .map(|wi| sample_facet(wi, u, alpha, ggx))
            .chain(nudged_numbers(u).map(|u| sample_facet(query.wi, u, alpha, ggx)))
            .chain([expected + rounded])
            .collect();
        functions.near_vector("sample_facet", &case, answer.normal, expected, &moved);
        // Of the facet that the kernel found: rounding it is not an error of the function.
        let m = widen(&answer.normal);
        functions.of("facet_density").scalar(&case, answer.density, facet_density(m, alpha, ggx));
        let moved: Vec<f64> = nudged(query.wi).map(|wi| facet_pdf(wi, m, alpha, ggx)).collect();
        functions.near("facet_pdf", &case, answer.pdf, facet_pdf(query.wi, m, alpha, ggx), &moved);
        for (w, found) in [query.wi, query.wo].into_iter().zip(answer.masking) {
            let moved: Vec<f64> = nudged(w).map(|w| facet_masking(w, m, alpha, ggx)).collect();
            functions.near("facet_masking", &case, found, facet_masking(w, m, alpha, ggx), &moved);
        }
    }
    functions.finish();
}

/// Of Beckmann's facets, by Simpson's rule over their slopes: what a direction sees of them, over the area that they cover.
fn covered_over_seen(cosine: f64, alpha: f64) -> f64 {
    const STEPS: i32 = 40_000;
    let tangent = alpha * (1.0 - cosine * cosine).sqrt() / cosine;
    let least = (-1.0 / tangent).max(-9.0);
    let width = (9.0 - least) / f64::from(STEPS);
    let seen: f64 = (0..=STEPS)
        .map(|step| {
            let (s, weight) = (least + width * f64::from(step), if step % 2 == 1 { 4.0 } else { 2.0 });
            let weight = if step == 0 || step == STEPS { 1.0 } else { weight };
            weight * (-s * s).exp() * (1.0 + tangent * s)
        })
        .sum();
    PI.sqrt() / (seen * width / 3.0)
}

#[test]
fn masking_is_smiths() {
    for alpha in [0.05, 0.3, 1.0] {
        for cosine in [0.999, 0.8, 0.5, 0.2, 0.05, 1e-3f64] {
            let v = v(-(1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let expected = covered_over_seen(cosine, alpha);
            let agrees = |found: f64| (found - expected).abs() < 1e-9 * expected;
            let found = facet_masking(v, DVec3::Z, DVec2::splat(alpha), false);
            assert!(agrees(found), "alpha {alpha}, cosine {cosine}: {found}, expected {expected}");
            // The rational approximation of Walter et al. (2007).
            let a = cosine / (alpha * (1.0 - cosine * cosine).sqrt());
            let near = (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a);
            assert!(a >= 1.6 || !agrees(near), "the comparison is blind to {near}");
        }
    }
}

#[test]
fn surfaces_scatter_as_the_reference() {
    let (surfaces, table) = ([surfaces(), principled_surfaces()].concat(), values());
    let queries = queries(&surfaces);
    let names = ["eval_bsdf value", "eval_bsdf pdf", "sample_bsdf direction", "sample_bsdf pdf", "sample_bsdf weight"];
    let mut functions = Functions::new(&names);
    let mut failed = 0;
    for (query, answer) in queries.iter().zip(ask(&surfaces, &queries)) {
        let surface = bindings::Surface::from(&surfaces[query.surface]);
        let case = format!("{query:?}, {:?}", surfaces[query.surface]);
        let Query { wi, wo, lobe, .. } = *query;
        let u = DVec2::from_array(query.u);
        // Both directions moved by the rounding of single precision.
        let around = |wo: DVec3| {
            let pairs = nudged(wi).map(|wi| (wi, wo)).chain(nudged(wo).map(|wo| (wi, wo)));
            let value = eval_surface(&surface, &table, wi, wo);
            let factor = 1.0 + refracted(&surface, wi, wo);
            let dimmed = BsdfValue { value: value.value * factor, pdf: value.pdf * factor };
            // Value and density may lose of it separately.
            let apart = BsdfValue { value: value.value * factor, pdf: value.pdf / factor };
            pairs.map(|(wi, wo)| eval_surface(&surface, &table, wi, wo)).chain([dimmed, apart]).collect::<Vec<_>>()
        };
        let (asked, moved) = (eval_surface(&surface, &table, wi, wo), around(wo));
        let values: Vec<DVec3> = moved.iter().map(|moved| moved.value).collect();
        let pdfs: Vec<f64> = moved.iter().map(|moved| moved.pdf).collect();
        functions.near_vector("eval_bsdf value", &case, answer.value, asked.value, &values);
        functions.near("eval_bsdf pdf", &case, answer.value_pdf, asked.pdf, &pdfs);

        let found = sample_surface(&surface, &table, wi, u, lobe);
        let moved: Vec<_> = nudged(wi)
            .map(|wi| sample_surface(&surface, &table, wi, u, lobe))
            .chain(nudged_numbers(u).map(|u| sample_surface(&surface, &table, wi, u, lobe)))
            .chain([-4e-6, 4e-6].map(|step| {
                // The tangent of the facet, whose error sample_facet declares.
                let other = bindings::Surface {
                    alpha: surface.alpha * (1.0 + step),
                    alpha_v: surface.alpha_v * (1.0 + step),
                    ..surface
                };
                sample_surface(&other, &table, wi, u, lobe)
            }))
            .chain([-1e-6, 1e-6].map(|step| sample_surface(&surface, &table, wi, u, lobe + step)))
            .collect();
        // At the border of two lobes, or of failure, either is right.
        let vanishes = found.pdf > 0.0 && around(found.direction).iter().any(|moved| moved.pdf <= 0.0);
        let flips = moved.iter().any(|moved| {
            moved.eta != found.eta || (moved.weight - found.weight).length() > 1e-2 * found.weight.length()
        });
        if flips || vanishes {
            continue;
        }
        failed += u32::from(answer.failed());
        let directions: Vec<DVec3> = moved.iter().map(|moved| moved.direction).collect();
        functions.near_vector("sample_bsdf direction", &case, answer.direction, found.direction, &directions);
        assert_eq!(answer.eta, found.eta as f32, "{case}");
        assert_eq!(answer.pdf > 0.0, found.pdf > 0.0, "{case}: {answer:?}, expected {found:?}");
        if found.pdf > 0.0 {
            // Of the direction that the kernel found.
            let (expected, moved) = (eval_surface(&surface, &table, wi, answer.wo()), around(answer.wo()));
            let weights: Vec<DVec3> =
                moved.iter().filter(|moved| moved.pdf > 0.0).map(|moved| moved.value / moved.pdf).collect();
            let pdfs: Vec<f64> = moved.iter().map(|moved| moved.pdf).collect();
            functions.near("sample_bsdf pdf", &case, answer.pdf, expected.pdf, &pdfs);
            let weight = expected.value / expected.pdf;
            functions.near_vector("sample_bsdf weight", &case, answer.weight, weight, &weights);
        } else {
            let weights: Vec<DVec3> = moved.iter().map(|moved| moved.weight).collect();
            functions.near_vector("sample_bsdf weight", &case, answer.weight, found.weight, &weights);
        }
    }
    assert!(failed > 100, "samples that fail are compared as well");
    functions.finish();
}
