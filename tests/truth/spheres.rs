//! Balls of a medium under a uniform sky (tables D and D2).

use crate::CASES;
use crate::common::scenes::{self, v};
use crate::common::trial::{Case, gauss, judge, must_reject};
use crate::common::truth::{Row, rows, tolerance};
use glam::DVec3;
use tyndall::scene::{Light, Scene, Shape};

/// A ball of radius 1 under an environment of radiance 1, seen along a ray.
fn lit_ball(row: &Row, origin: DVec3, target: DVec3) -> Scene {
    let mut scene = scenes::one_ray(origin, target, 16);
    scene.camera.near_clip = 1e-6;
    let medium = scene.add_medium(scenes::gray(row.number("tau_R"), row.number("albedo"), row.number("g")));
    scene.shapes.push(Shape::boundary("ball", scenes::ball(DVec3::ZERO, 1.0), medium));
    scene.lights.push(Light::Constant { radiance: DVec3::ONE });
    scene
}

/// Along a ray that passes the centre at a distance.
fn chord(row: &Row, distance: f64) -> Scene {
    lit_ball(row, v(distance, 0.0, 4.0), v(distance, 0.0, 0.0))
}

fn cases(row: &Row) -> Vec<Case> {
    let (expected, error) = row.output("L_chord");
    let mut cases: Vec<Case> = row
        .list("b_over_R")
        .into_iter()
        .zip(expected)
        .map(|(b, expected)| {
            let tolerance = tolerance(expected);
            Case::new(format!("{} L_chord {b}", row.id), chord(row, b), (expected, error), tolerance)
        })
        .collect();
    // From the centre all directions look the same.
    let (expected, error) = row.value("J_center");
    let inside = lit_ball(row, DVec3::ZERO, v(0.3, 0.5, 0.8));
    cases.push(Case::new(format!("{} J_center", row.id), inside, (expected, error), tolerance(expected)));
    // What is not absorbed leaves: 2 ∫ L(mu) mu dmu, where the chord at mu passes the centre at sqrt(1 − mu²).
    let (absorbed, error) = row.value("absorbed_fraction");
    let views = gauss(8).into_iter().map(|(mu, weight)| (2.0 * mu * weight, chord(row, (1.0 - mu * mu).sqrt())));
    let (expected, name) = (1.0 - absorbed, format!("{} 1 - absorbed_fraction", row.id));
    let tolerance = tolerance(expected);
    cases.push(Case { name, views: views.collect(), channel: 0, expected, error, tolerance, heavy_tailed: false });
    cases
}

fn balls(table: &str) -> Vec<Row> {
    rows(table).into_iter().filter(|row| !row.id.contains("furnace")).collect()
}

#[test]
fn balls_under_a_uniform_sky() {
    for table in ["D", "D2"] {
        judge(table, &balls(table).iter().flat_map(cases).collect::<Vec<_>>(), CASES);
    }
}

#[test]
fn wrong_balls_are_rejected() {
    let row = balls("D2").into_iter().find(|row| row.id == "D2:1.0:0.8:0.75").expect("a core row");
    let mut wrong = cases(&row);
    wrong.truncate(1);
    for case in &mut wrong {
        case.name += " wrong";
        for (_, scene) in &mut case.views {
            scene.media = vec![scenes::gray(row.number("tau_R"), row.number("albedo"), -row.number("g"))];
        }
    }
    must_reject(&wrong);
}
