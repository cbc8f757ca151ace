//! Media that emit (table I, and the columns of emission of tables A2, D, D2 and J).

use crate::CASES;
use crate::common::scenes;
use crate::common::trial::{Case, judge, must_reject};
use crate::common::truth::{Row, cosines_of_check, rows, tolerance, whole};
use crate::slabs::Slab;
use glam::DVec3;
use tyndall::scene::{Light, Medium, Phase, Scene};

/// A medium that absorbs and emits.
fn glow(sigma_a: DVec3, emission: DVec3) -> Medium {
    Medium { emission, ..Medium::new("glow", sigma_a, DVec3::ZERO, Phase::Isotropic) }
}

/// A medium that emits what it would in equilibrium with radiance 1: `sigma_a`.
fn warm(sigma_t: f64, albedo: f64, g: f64) -> Medium {
    Medium { emission: DVec3::splat(sigma_t * (1.0 - albedo)), ..scenes::gray(sigma_t, albedo, g) }
}

/// What a path through a medium without scattering sends out, a case a channel (the channels take turns where this is no full run);
/// its radiance may be tiny, so the tolerance is relative alone.
fn along_a_path(row: &Row, scene: &Scene) -> Vec<Case> {
    let (expected, error) = row.output("L");
    let turn = row.id.bytes().last().map_or(0, usize::from) % expected.len();
    let tested = expected.iter().enumerate().filter(|(channel, _)| whole() || *channel == turn);
    let cases = tested.map(|(channel, &expected)| Case {
        name: format!("{} channel {channel}", row.id),
        views: vec![(1.0, scene.clone())],
        channel,
        expected,
        error: error.min(1e-6 * expected),
        tolerance: 1e-2 * expected,
        heavy_tailed: false,
    });
    cases.collect()
}

fn cases_of_table_i(row: &Row) -> Vec<Case> {
    if row.id.contains("scatter") {
        let medium = warm(row.number("sigma_t"), row.number("albedo"), row.number("g"));
        let (expected, error) = row.output("L");
        let distances = row.list("b_over_R").into_iter().zip(expected);
        let cases = distances.map(|(b, expected)| {
            let scene = scenes::through_ball(medium.clone(), 2.0 * row.number("radius"), b * row.number("radius"));
            Case::new(format!("{} {b}", row.id), scene, (expected, error), tolerance(expected))
        });
        return cases.collect();
    }
    if row.id.contains("sphere") {
        let medium = warm(row.number("sigma_a"), 0.0, 0.0);
        return along_a_path(row, &scenes::through_ball(medium, 2.0 * row.number("radius"), row.number("b")));
    }
    let sigma_a = row.vector("sigma_a");
    let emission = if row.id.starts_with("I:q") { row.vector("q") } else { sigma_a * row.number("Le") };
    let mut scene = scenes::through_ball(glow(sigma_a, emission), row.number("path"), 0.0);
    let behind = row.number("L_behind");
    if behind > 0.0 {
        scene.lights.push(Light::Constant { radiance: DVec3::splat(behind) });
    }
    along_a_path(row, &scene)
}

#[test]
fn emission_along_a_path() {
    judge("I", &rows("I").iter().flat_map(cases_of_table_i).collect::<Vec<_>>(), CASES);
}

#[test]
fn emission_in_the_limit_of_thin_and_dense() {
    let limits = rows("J").into_iter().filter(|row| row.word("kind") == "emission_limit");
    let cases = limits.flat_map(|row| {
        let medium = glow(DVec3::splat(row.number("sigma_t")), DVec3::splat(row.number("q")));
        along_a_path(&row, &scenes::through_ball(medium, row.number("d"), 0.0))
    });
    judge("J, emission", &cases.collect::<Vec<_>>(), CASES);
}

/// A scattering ball that glows; by Kirchhoff's law it sends out what the chord under a uniform sky lacks of 1.
fn glowing_ball(row: &Row, strength: f64) -> Case {
    let mut medium = warm(row.number("tau_R"), row.number("albedo"), row.number("g"));
    medium.emission *= strength;
    let (chord, error) = row.value("L_chord");
    let expected = 1.0 - chord;
    let scene = scenes::through_ball(medium, 2.0, 0.0);
    Case::new(format!("{} L_emit0", row.id), scene, (expected, error), tolerance(expected))
}

fn balls() -> Vec<Row> {
    rows("D").into_iter().chain(rows("D2")).filter(|row| !row.id.contains("furnace")).collect()
}

#[test]
fn glowing_balls() {
    judge("D and D2, emission", &balls().iter().map(|row| glowing_ball(row, 1.0)).collect::<Vec<_>>(), CASES);
}

/// The glow of a slab at angles. In a body of index n the radiance of equilibrium is n², and so is the emission.
fn glowing_slab(row: &Row, emission_of: impl Fn(f64) -> f64) -> Vec<Case> {
    let slab = Slab::of(row);
    let (values, error) = row.output("L_emit");
    let cases = cosines_of_check().map(|(index, mu)| {
        let mut scene = slab.at_cosine(mu);
        scene.media[0].emission = DVec3::splat((1.0 - slab.albedo) * emission_of(slab.n));
        let expected = values[index];
        Case::new(format!("{} L_emit {mu}", row.id), scene, (expected, error), tolerance(expected))
    });
    cases.collect()
}

fn slabs_that_absorb() -> Vec<Row> {
    rows("A2").into_iter().filter(|row| row.has("L_emit") && row.number("albedo") < 1.0).collect()
}

#[test]
fn glowing_slabs() {
    let cases = slabs_that_absorb().into_iter().flat_map(|row| glowing_slab(&row, |n| n * n));
    judge("A2, emission", &cases.collect::<Vec<_>>(), CASES);
}

#[test]
fn the_wrong_glow_is_rejected() {
    let ball = balls().into_iter().find(|row| row.id == "D:1:0.8").expect("a core row");
    let mut weaker = glowing_ball(&ball, 0.93);
    weaker.name += " wrong";
    let glass = slabs_that_absorb().into_iter().find(|row| row.number("n") > 1.0).expect("a core row");
    let mut no_square = glowing_slab(&glass, |n| n);
    no_square.truncate(1);
    no_square[0].name += " wrong";
    must_reject(&[weaker]);
    must_reject(&no_square);
}
