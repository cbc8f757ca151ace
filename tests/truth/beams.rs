//! Parallel light on slabs (tables A2 and A3): the radiance of what comes back and gets through at an angle.
//!
//! A directional light is never seen, so the unscattered beam and its reflection, which the tables leave out, are left out here
//! by themselves. Behind glass no shadow ray reaches it: those rows need a connection through refraction, which there is none of.

use crate::CASES;
use crate::common::scenes::v;
use crate::common::trial::{Case, judge, must_reject};
use crate::common::truth::{Row, cosines_of_check, rows, table, whole};
use crate::slabs::Slab;
use glam::DVec3;
use std::f64::consts::PI;
use tyndall::scene::{Light, Scene};

/// A unit vector at a cosine to +z, at an azimuth in degrees.
fn direction(cosine: f64, azimuth: f64) -> DVec3 {
    let (sin, azimuth) = ((1.0 - cosine * cosine).max(0.0).sqrt(), azimuth.to_radians());
    v(sin * azimuth.cos(), sin * azimuth.sin(), cosine)
}

/// A slab seen at a cosine to its normal. Parallel light falls on the side of the camera, or through the slab towards it, at a cosine
/// of its own; `azimuth` is the angle between the horizontal parts of the two propagation directions in degrees.
fn lit(slab: Slab, incident: f64, comes_back: bool, exit: f64, azimuth: f64) -> Scene {
    let mut scene = slab.seen_along(direction(exit, azimuth));
    let upwards = direction(incident, 0.0);
    let direction = if comes_back { v(upwards.x, upwards.y, -upwards.z) } else { upwards };
    scene.lights.push(Light::Directional { direction, irradiance: DVec3::ONE });
    scene
}

/// One per cent, but no less than what a white surface of a thousandth of the reflectance would send.
fn tolerance(expected: f64) -> f64 {
    crate::common::truth::tolerance(PI * expected) / PI
}

/// The cases of a row of A2: normal incidence, every direction at the same cosine alike.
fn normal_incidence(row: &Row) -> Vec<Case> {
    let slab = Slab::of(row);
    let mut cases = Vec::new();
    for (index, mu) in cosines_of_check() {
        let both = [("Lr_beam", true), ("Lt_beam", false)];
        for (name, comes_back) in both.into_iter().filter(|(_, back)| whole() || (mu < 0.5) == *back) {
            let (values, error) = row.output(name);
            let scene = lit(slab, 1.0, comes_back, mu, 37.0);
            let tolerance = tolerance(values[index]);
            cases.push(Case::new(format!("{} {name} {mu}", row.id), scene, (values[index], error), tolerance));
        }
    }
    cases
}

/// The cases of a row of A3, with an azimuth that may be wrong.
fn oblique_incidence(row: &Row, azimuth_of: impl Fn(f64) -> f64) -> Vec<Case> {
    let slab = Slab::of(row);
    let mut cases = Vec::new();
    for (name, comes_back) in [("Lr", true), ("Lt", false)] {
        let (values, error) = row.output(name);
        let pairs =
            row.list("mu").into_iter().flat_map(|mu| row.list("dphi_deg").into_iter().map(move |dphi| (mu, dphi)));
        for ((mu, dphi), expected) in pairs.zip(values) {
            let scene = lit(slab, row.number("mu0"), comes_back, mu, azimuth_of(dphi));
            let tolerance = tolerance(expected);
            cases.push(Case::new(format!("{} {name} {mu} {dphi}", row.id), scene, (expected, error), tolerance));
        }
    }
    cases
}

fn without_glass(rows: Vec<Row>) -> impl Iterator<Item = Row> {
    rows.into_iter().filter(|row| row.number("n") == 1.0)
}

#[test]
fn slabs_in_parallel_light() {
    // A peak of the phase function that points at the light makes estimates noisy, and takes its time.
    let tested = without_glass(rows("A2")).filter(|row| whole() || row.number("g").abs() < 0.9);
    judge("A2, beams", &tested.flat_map(|row| normal_incidence(&row)).collect::<Vec<_>>(), CASES);
}

#[test]
fn slabs_in_oblique_light() {
    // None of the table's rows belongs to every check: a few values of two rows are enough there.
    let cases: Vec<Case> = without_glass(table("A3")).flat_map(|row| oblique_incidence(&row, |dphi| dphi)).collect();
    let few = |index: &usize| whole() || ((24..72).contains(index) && index % 11 == 1);
    let cases: Vec<Case> =
        cases.into_iter().enumerate().filter(|(index, _)| few(index)).map(|(_, case)| case).collect();
    judge("A3", &cases, CASES);
}

#[test]
fn parallel_light_from_the_wrong_side_is_rejected() {
    let row = table("A3").into_iter().find(|row| row.id == "A3:0.2:0.5:-0.5:1:0.3").expect("a row of the table");
    let mut wrong = oblique_incidence(&row, |dphi| 180.0 - dphi);
    wrong.retain(|case| case.name.ends_with(" Lr 0.6 180"));
    assert_eq!(wrong.len(), 1);
    must_reject(&wrong);
}
