//! Media whose density depends on the place: transmittances of fields (H), layers (H2), a density that changes with depth (H3), and one
//! scattering event in fog that thins out with height (H4).

use super::slabs::Slab;
use crate::CASES;
use crate::common::fields::{self, field, grid, unit_to};
use crate::common::scenes::{self, quad, v};
use crate::common::trial::{Case, judge, must_reject};
use crate::common::truth::{Row, full, rows, tolerance, whole};
use glam::{DMat4, DVec3};
use serde_json::Value;
use tyndall::scene::{Filter, GridVolume, HeightVolume, Light, Medium, Phase, Scene, Shape, Volume};

/// Voxels along a side where a smooth field is interpolated; what that changes of the optical depth is below a thousandth.
const SMOOTH: usize = 65;

/// A field of the table in the unit cube, and by how much its optical depth may be off, relatively.
fn volume(input: &Value) -> (Volume, f64) {
    let number = |name: &str| input[name].as_f64().unwrap_or_else(|| panic!("{input}: no {name}"));
    let cube = unit_to(DVec3::ZERO, DVec3::ONE);
    // Voxels whose outermost centres lie on the faces of the cube.
    let vertices = |size: [usize; 3]| {
        let half = DVec3::from_array(size.map(|count| 0.5 / (count - 1) as f64));
        unit_to(-half, DVec3::ONE + half)
    };
    let at = |k: usize| k as f64 / (SMOOTH - 1) as f64;
    match input["type"].as_str().expect("a field has a type") {
        "linear" => {
            let voxels = grid([2, 1, 1], 1, |x, _, _, _| number("a") + number("b") * x as f64);
            (Volume::Grid(field(voxels, unit_to(v(-0.5, 0.0, 0.0), v(1.5, 1.0, 1.0)))), 0.0)
        }
        "exp_height" => {
            let height = HeightVolume { base: DVec3::ZERO, up: DVec3::Y, scale_height: number("H") };
            (Volume::Height(height), 0.0)
        }
        "gaussian" => {
            let center = DVec3::from_array([0, 1, 2].map(|k| input["center"][k].as_f64().expect("a center")));
            let rule = |x: usize, y: usize, z: usize, _: usize| {
                let squared = (v(at(x), at(y), at(z)) - center).length_squared();
                number("rho0") * (-squared / (2.0 * number("s").powi(2))).exp()
            };
            (Volume::Grid(field(grid([SMOOTH; 3], 1, rule), vertices([SMOOTH; 3]))), 1e-3)
        }
        "grid" => {
            let size = input["shape"].as_array().expect("a grid has a shape");
            let size = [0, 1, 2].map(|k| size[k].as_u64().expect("a size") as usize);
            let rule = |x: usize, y: usize, z: usize, _: usize| match input["values"].as_str() {
                Some("checker") => f64::from(u8::from((x + y + z).is_multiple_of(2))) * 2.0,
                Some("pseudo") => ((7 * x + 13 * y + 29 * z + 5 * x * y * z) % 11) as f64 / 10.0,
                other => panic!("voxels {other:?}"),
            };
            let place = if input["interpolation"] == "vertex" { vertices(size) } else { cube };
            let filter = if input["interpolation"] == "nearest" { Filter::Nearest } else { Filter::Bilinear };
            (Volume::Grid(GridVolume { filter, ..field(grid(size, 1, rule), place) }), 0.0)
        }
        other => panic!("a field of type {other}"),
    }
}

/// Transmittance, as a camera sees light behind the cube: by delta tracking, 0 or 1; with `sampled`, as light sampling finds a lamp
/// behind the cube from a white sheet before it, by ratio tracking.
fn transmittance(row: &Row, factor: f64) -> Case {
    let (field, off) = volume(&row.input()["field"]);
    let (origin, direction) = (row.vector("o"), row.vector("d").normalize());
    let mut scene = scenes::one_ray(origin, origin + direction, 16);
    scene.camera.near_clip = 1e-3;
    let mut medium = Medium::new("field", DVec3::splat(row.number("sigma") * factor), DVec3::ZERO, Phase::Isotropic);
    if matches!(field, Volume::Height(_)) {
        medium.sigma_t *= row.input()["field"]["rho0"].as_f64().expect("a density");
    }
    medium.volumes.sigma_t = Some(field);
    let id = scene.add_medium(medium);
    scene.shapes.push(fields::box_of("cube", DMat4::IDENTITY, id));
    scene.lights.push(Light::Constant { radiance: DVec3::ONE });
    let (expected, error) = row.value("T");
    let tau = row.value("tau").0;
    Case::new(row.id.clone(), scene, (expected, error + off * tau * expected), tolerance(expected))
}

/// The same by ratio tracking: a perfectly dark but for diffusely white sheet at the ray's origin, lit by parallel light along the ray
/// backwards, seen from right before it. Radiance is 1/π times the transmittance.
fn lit_through(row: &Row, factor: f64) -> Case {
    let Case { name, mut views, expected, error, tolerance, .. } = transmittance(row, factor);
    let (origin, direction) = (row.vector("o"), row.vector("d").normalize());
    let mut scene = views.remove(0).1;
    // The camera looks back at the sheet, at right angles to the ray, from a little beside it.
    let side = direction.any_orthonormal_vector();
    let across = direction.cross(side);
    let sheet = quad(origin - 0.02 * (side + across), side * 0.04, across * 0.04);
    scene.shapes.push(Shape::diffuse("sheet", sheet, DVec3::ONE));
    scene.camera = scenes::one_ray(origin + 0.005 * direction, origin, 16).camera;
    scene.camera.near_clip = 1e-4;
    scene.lights = vec![Light::Directional { direction: -direction, irradiance: DVec3::splat(std::f64::consts::PI) }];
    scene.integrator.max_depth = Some(2);
    Case::new(format!("{name} lit"), scene, (expected, error), tolerance)
}

#[test]
fn transmittance_of_fields() {
    let all = rows("H");
    // Delta tracking, whose estimates are 0 or 1, takes long: every second row in a run that leaves something out.
    let some = all.iter().step_by(if whole() { 1 } else { 2 });
    let mut cases: Vec<Case> = some.map(|row| transmittance(row, 1.0)).collect();
    cases.extend(all.iter().map(|row| lit_through(row, 1.0)));
    judge("H", &cases, CASES);
}

#[test]
fn wrong_fields_are_rejected() {
    let row = rows("H").into_iter().find(|row| row.id == "H:ramp0").expect("a core row");
    must_reject(&[transmittance(&row, 1.1), lit_through(&row, 0.9)]);
}

/// A slab of the unit optical thickness, before a density of a row is put into it.
fn slab_of(row: &Row) -> Slab {
    Slab::new(row.number("tau"), row.number("albedo"), row.number("g"), 1.0)
}

/// Puts the density of a row, over depth from 0 to 1, into the slab of a scene.
fn fill(row: &Row, slab: &Slab, mut scene: Scene, factor: f64) -> Scene {
    let (tau, half, top) = (row.number("tau"), slab.half(), slab.top());
    let medium = &mut scene.media[0];
    // The slab is as thick as its optical depth is, so lengths in it are those of the row times that.
    medium.sigma_t = DVec3::splat(row.number("sigma") / tau * factor);
    let place = |low: f64, high: f64| unit_to(v(-half, -half, top - high * tau), v(half, half, top - low * tau));
    let voxels = |values: &[f64]| {
        // Depth runs against z.
        let values: Vec<f64> = values.iter().rev().copied().collect();
        grid([1, 1, values.len()], 1, move |_, _, z, _| values[z])
    };
    medium.volumes.sigma_t = Some(match row.word("rho") {
        "rho=2z" => Volume::Grid(field(voxels(&[0.0, 2.0]), place(-0.5, 1.5))),
        "rho=exp(-z/0.25)" => {
            let base = DVec3::Z * top;
            Volume::Height(HeightVolume { base, up: DVec3::NEG_Z, scale_height: 0.25 * tau })
        }
        rule if rule.contains("z<0.3") => {
            let values: Vec<f64> =
                (0..10).map(|k| [1.0, 0.0, 4.0][usize::from(k >= 3) + usize::from(k >= 6)]).collect();
            Volume::Grid(GridVolume { filter: Filter::Nearest, ..field(voxels(&values), place(0.0, 1.0)) })
        }
        other => panic!("a density {other}"),
    });
    scene
}

/// Outputs of the rows; in a run that leaves something out, one of each, without the slab in which paths are long.
fn gradients(factor: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    let long = |row: &Row| row.number("albedo") > 0.95;
    for (index, row) in rows("H3").into_iter().filter(|row| whole() || !long(row)).enumerate() {
        let slab = slab_of(&row);
        let names = ["R_coll", "T_coll", "R_diff", "T_diff"];
        let names = if whole() { &names[..] } else { &names[index % 2..=index % 2] };
        for &name in names {
            let view = if name.ends_with("diff") { slab.mean_of_directions() } else { slab.at_cosine(1.0) };
            let lit = if name.starts_with('R') { slab.lit_from_above(view) } else { slab.lit_from_below(view) };
            let (expected, error) = row.value(name);
            let scene = fill(&row, &slab, lit, factor);
            cases.push(Case::new(format!("{} {name}", row.id), scene, (expected, error), tolerance(expected)));
        }
    }
    cases
}

#[test]
fn slabs_whose_density_changes_with_depth() {
    judge("H3", &gradients(1.0), CASES);
}

#[test]
fn wrong_densities_are_rejected() {
    must_reject(&gradients(1.2)[..1]);
}

/// Layers on top of each other, each a box of one voxel, or homogeneous every other one.
fn layers(row: &Row, from_above: bool, lit_above: bool, swap: bool) -> Scene {
    let list = row.input()["layers_tau_albedo_g"].as_array().expect("layers");
    let mut list: Vec<[f64; 3]> =
        list.iter().map(|layer| [0, 1, 2].map(|k| layer[k].as_f64().expect("a number"))).collect();
    if !from_above ^ swap {
        list.reverse();
    }
    let tau: f64 = list.iter().map(|layer| layer[0]).sum();
    let slab = Slab::new(tau, 0.5, 0.8, 1.0);
    let view = slab.at_cosine(1.0);
    let mut scene = if lit_above { slab.lit_from_above(view) } else { slab.lit_from_below(view) };
    scene.media.clear();
    scene.shapes.retain(|shape| shape.boundary.is_none());
    let (half, mut top) = (slab.half(), slab.top());
    for (index, [thick, albedo, g]) in list.into_iter().enumerate() {
        let place = unit_to(v(-half, -half, top - thick), v(half, half, top));
        let mut medium = scenes::gray(1.0, albedo, g);
        if index % 2 == 0 {
            medium.sigma_t = DVec3::splat(2.0);
            medium.volumes.sigma_t = Some(Volume::Grid(field(grid([1, 1, 1], 1, |_, _, _, _| 0.5), place)));
        }
        let id = scene.add_medium(medium);
        scene.shapes.push(fields::box_of("layer", place, id));
        top -= thick;
    }
    scene
}

fn layer_cases(swap: bool) -> Vec<Case> {
    let mut cases = Vec::new();
    for row in rows("H2") {
        let views = [
            ("R_coll_top", true, true),
            ("T_coll_top", true, false),
            ("R_coll_bot", false, true),
            ("T_coll_bot", false, false),
        ];
        for (name, from_above, lit_above) in views {
            let (expected, error) = row.value(name);
            let scene = layers(&row, from_above, lit_above, swap);
            cases.push(Case::new(format!("{} {name}", row.id), scene, (expected, error), tolerance(expected)));
        }
    }
    cases
}

#[test]
fn layers_on_top_of_each_other() {
    let mut cases = layer_cases(false);
    if !whole() {
        // The table has no core rows.
        let row = crate::common::truth::table("H2").into_iter().find(|row| row.id == "H2:0").expect("a row");
        let (expected, error) = row.value("R_coll_top");
        let scene = layers(&row, true, true, false);
        cases.push(Case::new("H2:0 R_coll_top".to_owned(), scene, (expected, error), tolerance(expected)));
        let scene = layers(&row, true, true, true);
        must_reject(&[Case::new("H2:0 turned over".to_owned(), scene, (expected, error), tolerance(expected))]);
    }
    judge("H2", &cases, CASES);
}

/// One scattering event in a slab of fog in which the camera stands, with black ground.
fn fog(row: &Row, factor: f64) -> Case {
    let (height, ymax) = (row.number("H"), row.number("ymax"));
    let (sigma_s, sigma_a) = (row.number("sigma_s0"), row.number("sigma_a0"));
    let (origin, direction) = (row.vector("o"), row.vector("d").normalize());
    let mut scene = scenes::one_ray(origin, origin + direction, 16);
    scene.camera.near_clip = 1e-6;
    scene.integrator.max_depth = Some(2);
    let mut medium = scenes::gray(sigma_s + sigma_a, sigma_s / (sigma_s + sigma_a), row.number("g"));
    medium.volumes.sigma_t =
        Some(Volume::Height(HeightVolume { base: DVec3::ZERO, up: DVec3::Y, scale_height: height * factor }));
    let id = scene.add_medium(medium);
    let side = 50.0 * ymax;
    scene.shapes.push(fields::box_of("fog", unit_to(v(-side, -0.01, -side), v(side, ymax, side)), id));
    let ground = quad(v(-side, 0.0, side), DVec3::X * 2.0 * side, DVec3::Z * -2.0 * side);
    scene.shapes.push(Shape::diffuse("ground", ground, DVec3::ZERO));
    let sun = -row.vector("sun_dir").normalize();
    scene.lights.push(Light::Directional { direction: sun, irradiance: DVec3::splat(row.number("E_perp")) });
    let (expected, error) = row.value("L");
    let tolerance = expected * if full() { 1e-2 } else { 2e-2 };
    Case::new(row.id.clone(), scene, (expected, error), tolerance)
}

#[test]
fn single_scattering_in_fog() {
    judge("H4", &rows("H4").iter().map(|row| fog(row, 1.0)).collect::<Vec<_>>(), CASES);
    must_reject(&rows("H4").iter().take(1).map(|row| fog(row, 1.2)).collect::<Vec<_>>());
}
