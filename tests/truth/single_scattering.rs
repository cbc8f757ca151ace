//! Exactly one scattering event (table E): a point light and a square lamp in an unbounded medium.

use crate::CASES;
use crate::common::scenes::{self, quad};
use crate::common::trial::{Case, judge, must_reject};
use crate::common::truth::{Row, full, rows};
use glam::DVec3;
use tyndall::scene::{Light, Medium, Scene, Shape};

fn medium(row: &Row, g: f64) -> Medium {
    let (sigma_s, sigma_a) = (row.number("sigma_s"), row.number("sigma_a"));
    scenes::gray(sigma_s + sigma_a, sigma_s / (sigma_s + sigma_a), g)
}

/// A square about a point, perpendicular to a direction.
fn square(middle: DVec3, normal: DVec3, along: DVec3, side: f64) -> tyndall::scene::Geometry {
    let x = along.normalize() * side;
    let y = normal.normalize().cross(along.normalize()) * side;
    quad(middle - (x + y) / 2.0, x, y)
}

/// The row's scene, with a phase function of its own.
fn scene(row: &Row, g: f64) -> Scene {
    let (origin, direction) = (row.vector("o"), row.vector("d").normalize());
    let mut scene = scenes::one_ray(origin, origin + direction, 16);
    scene.camera.near_clip = 1e-6;
    scene.integrator.max_depth = Some(2);
    let id = scene.add_medium(medium(row, g));
    scene.camera.medium = Some(id);
    // Without a wall, one so far away that nothing comes from behind it. It is so small that it shadows nothing.
    let distance = row.maybe_number("tmax").unwrap_or(40.0 / (row.number("sigma_s") + row.number("sigma_a")));
    let wall = square(origin + direction * distance, -direction, direction.any_orthonormal_vector(), 1e-3);
    scene.shapes.push(Shape::diffuse("wall", wall, DVec3::ZERO));
    if row.word("light") == "point" {
        scene
            .lights
            .push(Light::Point { position: row.vector("light_pos"), intensity: DVec3::splat(row.number("I0")) });
    } else {
        let lamp = square(row.vector("c"), row.vector("n"), row.vector("t"), row.number("s"));
        scene.shapes.push(Shape::lamp("lamp", lamp, DVec3::splat(row.number("Le"))));
    }
    scene
}

fn case(row: &Row, g: f64) -> Case {
    let (expected, error) = row.value("L");
    // Relative alone: the radiances lie far below 1.
    let tolerance = expected * if full() { 1e-2 } else { 3e-2 };
    Case::new(row.id.clone(), scene(row, g), (expected, error), tolerance)
}

#[test]
fn single_scattering_of_points_and_lamps() {
    let rows = rows("E").into_iter().filter(|row| row.word("light") != "collimated_beam");
    judge("E, points and lamps", &rows.map(|row| case(&row, row.number("g"))).collect::<Vec<_>>(), CASES);
}

#[test]
fn the_wrong_phase_function_is_rejected() {
    let rows = rows("E").into_iter().filter(|row| row.id == "E:point:side:-0.9" || row.id == "E:area:small:-0.6");
    must_reject(&rows.map(|row| case(&row, -row.number("g"))).collect::<Vec<_>>());
}
