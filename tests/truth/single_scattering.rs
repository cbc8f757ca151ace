//! Exactly one scattering event (table E): a point light and a square lamp in an unbounded medium, and parallel light that an aperture
//! lets into a half space.

use crate::CASES;
use crate::common::scenes::{self, quad};
use crate::common::trial::{Case, judge, must_reject};
use crate::common::truth::{Row, full, rows};
use glam::{DMat4, DVec3};
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

/// The medium fills x > 0; in front of it four black sheets leave an aperture, through which light goes along +x.
fn beam(row: &Row, g: f64) -> Case {
    let (origin, direction) = (row.vector("o"), row.vector("d").normalize());
    let far = 40.0 / (row.number("sigma_s") + row.number("sigma_a"));
    let mut scene = scenes::one_ray(origin, origin + direction, 16);
    scene.camera.near_clip = 1e-6;
    scene.integrator.max_depth = Some(2);
    let id = scene.add_medium(medium(row, g));
    let half_space = DMat4::from_translation(DVec3::X * far) * DMat4::from_scale(DVec3::splat(far));
    scene.shapes.push(Shape::boundary("half space", scenes::cuboid(half_space), id));
    scene.lights.push(Light::Directional { direction: DVec3::X, irradiance: DVec3::splat(row.number("E0_perp")) });
    let &[low, high] = row.list("beam_z").as_slice() else { panic!("{}: two edges", row.id) };
    // The aperture is |y| <= 1/2 and low <= z <= high; the sheets reach beyond the half space.
    let (y, edge) = (0.5, 2.0 * far);
    let sheets = [(-edge, -y, -edge, edge), (y, edge, -edge, edge), (-y, y, -edge, low), (-y, y, high, edge)];
    for (y_low, y_high, z_low, z_high) in sheets {
        let corner = DVec3::new(-0.01, y_low, z_low);
        let sheet = quad(corner, DVec3::Y * (y_high - y_low), DVec3::Z * (z_high - z_low));
        scene.shapes.push(Shape::diffuse("sheet", sheet, DVec3::ZERO));
    }
    let (expected, error) = row.value("L");
    let tolerance = expected * if full() { 1e-2 } else { 3e-2 };
    Case::new(row.id.clone(), scene, (expected, error), tolerance)
}

fn beams() -> impl Iterator<Item = Row> {
    rows("E").into_iter().filter(|row| row.word("light") == "collimated_beam")
}

#[test]
fn single_scattering_of_a_beam() {
    judge("E, beams", &beams().map(|row| beam(&row, row.number("g"))).collect::<Vec<_>>(), CASES);
}

#[test]
fn the_wrong_phase_function_is_rejected() {
    let rows = rows("E").into_iter().filter(|row| row.id == "E:point:side:-0.9" || row.id == "E:area:small:-0.6");
    must_reject(&rows.map(|row| case(&row, -row.number("g"))).collect::<Vec<_>>());
    let rows = beams().filter(|row| row.number("g") != 0.0);
    must_reject(&rows.map(|row| beam(&row, -row.number("g"))).collect::<Vec<_>>());
}
