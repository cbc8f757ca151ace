//! Extreme numbers with answers in closed form (table J).

use crate::CASES;
use crate::absorption::{check_channels, transmittance_of_shadow_ray};
use crate::common::scenes::{self, v};
use crate::common::trial::{Case, judge, record};
use crate::common::truth::{Row, full, rows};
use crate::common::{images, units};
use crate::slabs::Slab;
use glam::{DMat4, DVec3};
use tyndall::scene::{Geometry, Light, Medium, Phase, Scene, Shape};

fn kind(kind: &str) -> Vec<Row> {
    let rows: Vec<Row> = rows("J").into_iter().filter(|row| row.word("kind") == kind).collect();
    assert!(!rows.is_empty(), "no rows of {kind}");
    rows
}

fn cuboid(min: DVec3, max: DVec3) -> Geometry {
    scenes::cuboid(DMat4::from_translation((min + max) / 2.0) * DMat4::from_scale((max - min) / 2.0))
}

/// A layer across a shadow ray, from a height of half its thickness on.
fn layer(thickness: f64, first: usize) -> Geometry {
    let (low, side) = (thickness * (0.5 + first as f64), 0.7 * thickness);
    cuboid(v(-side, low, -side), v(side, low + thickness, side))
}

fn coefficients(sigma_a: f64, sigma_s: f64) -> Medium {
    let sigma_t = sigma_a + sigma_s;
    scenes::gray(sigma_t, if sigma_t > 0.0 { sigma_s / sigma_t } else { 0.0 }, 0.0)
}

/// Transmittances of shadow rays, which are computed and not estimated.
#[test]
fn transmittances() {
    let mut checked = 0;
    let mut check = |row: &Row, media: Vec<(Medium, Geometry)>, height: f64, tolerance: (f64, f64)| {
        let found = transmittance_of_shadow_ray(media, height);
        let (expected, _) = row.output("T");
        let expected = if expected.len() == 3 { DVec3::from_slice(&expected) } else { DVec3::splat(expected[0]) };
        let relative = (-expected.max(DVec3::splat(1e-37)).map(f64::ln) * 1e-6).max(DVec3::splat(tolerance.0));
        let right = check_channels(found, expected, relative, tolerance.1);
        right.unwrap_or_else(|why| panic!("{}: {why}", row.id));
        if expected.max_element() > 1e-30 {
            check_channels(found * 1.0005, expected, relative, tolerance.1).expect_err("a little too bright");
        }
        checked += 1;
    };
    for row in kind("transmittance") {
        let medium = coefficients(row.number("tau"), 0.0);
        check(&row, vec![(medium, layer(1.0, 0))], 2.0, (1e-5, row.number("atol_T")));
    }
    for row in kind("chromatic") {
        let medium = Medium::new("chromatic", row.vector("sigma_t"), DVec3::ZERO, Phase::Isotropic);
        let d = row.number("d");
        check(&row, vec![(medium, layer(d, 0))], 2.0 * d, (row.number("rtol"), 1e-30));
    }
    for row in kind("touching_media") {
        let length = row.number("length_each");
        let sigma = row.list("sigma_a").into_iter().enumerate();
        let media: Vec<_> = sigma.map(|(k, sigma)| (coefficients(sigma, 0.0), layer(length, k))).collect();
        let height = length * (media.len() + 1) as f64;
        check(&row, media, height, (1e-5, 0.0));
    }
    for row in kind("zero_coeffs") {
        let d = row.number("d");
        let medium = coefficients(row.number("sigma_a"), row.number("sigma_s"));
        let (albedo, _) = row.value("albedo");
        assert!((medium.albedo.x - albedo).abs() < 1e-9, "{}", row.id);
        check(&row, vec![(medium, layer(d, 0))], 2.0 * d, (1e-5, 0.0));
    }
    record("J transmittances", &format!("| J, transmittances | {checked} | all within 1e-5 | | | | |\n"));
}

#[test]
fn free_flights() {
    let rows = kind("free_flight");
    // The kernel takes -log(1 - xi) from the kernel of elementary functions.
    let logs: Vec<[f32; 4]> =
        rows.iter().flat_map(|row| [units::vec4(&[row.number("xi"), 1.0]), units::vec4(&[0.0, 0.0, 1.0])]).collect();
    let logs: Vec<[f32; 4]> = units::run("math", &logs, &[], rows.len(), 4 * rows.len());
    let inputs: Vec<[f32; 4]> = rows
        .iter()
        .zip(logs.chunks(4))
        .flat_map(|(row, log)| {
            let one = units::vec4(&[1.0, 1.0, 1.0]);
            [units::vec4(&[0.5, f64::from(log[0][0]), row.number("sigma_t")]), one, one, one, one]
        })
        .collect();
    let outputs: Vec<[f32; 4]> = units::run("medium", &inputs, &[], rows.len(), 5 * rows.len());
    for (row, output) in rows.iter().zip(outputs.chunks(5)) {
        let (expected, _) = row.value("t");
        let error = (f64::from(output[0][1]) / expected - 1.0).abs();
        assert!(error < row.number("rtol"), "{}: {}, expected {expected:e}", row.id, output[0][1]);
    }
}

/// What a camera ray through a shape sees of an environment of radiance 1.
fn seen_through(geometry: Geometry, medium: Medium, origin: DVec3, direction: DVec3) -> Scene {
    let mut scene = scenes::one_ray(origin, origin + direction, 16);
    scene.camera.near_clip = 1e-9;
    scene.camera.far_clip = 1e9;
    let medium = scene.add_medium(medium);
    scene.shapes.push(Shape::boundary("shape", geometry, medium));
    scene.lights.push(Light::Constant { radiance: DVec3::ONE });
    scene
}

#[test]
fn slabs_at_the_edge_of_what_can_be_resolved() {
    let mut cases = Vec::new();
    for row in kind("scale_invariance") {
        let slab = Slab { scale: row.number("scale"), half_width: 50.0 * 1.7, ..Slab::new(1.7, 0.87, 0.6, 1.0) };
        cases.extend(reflected_and_transmitted(&row, slab, 5e-3));
    }
    // Paths of thousands of events take their time.
    for row in kind("extreme_slab").into_iter().filter(|row| full() || row.number("tau") < 1.0) {
        cases.extend(reflected_and_transmitted(&row, Slab::of(&row), 2e-2));
    }
    for row in kind("grazing_slab") {
        let (cos, thickness) = (row.number("cos"), row.number("thickness"));
        // So wide that even the flattest ray leaves through the lower face.
        let half = 2.0 * thickness / cos;
        let geometry = cuboid(v(-half, -half, -thickness), v(half, half, 0.0));
        let direction = v((1.0 - cos * cos).sqrt() * 0.8, (1.0 - cos * cos).sqrt() * 0.6, -cos);
        let medium = coefficients(row.number("sigma_a"), row.number("sigma_s"));
        let scene = seen_through(geometry, medium, -direction * (0.5 * thickness / cos), direction);
        let (expected, error) = row.value("T");
        cases.push(Case::new(row.id.clone(), scene, (expected, error), (5e-3 * expected).max(5e-4)));
    }
    judge("J, slabs", &cases, CASES);
}

#[test]
fn colours_that_are_far_apart_along_camera_rays() {
    let mut cases = Vec::new();
    for row in kind("chromatic") {
        let d = row.number("d");
        let geometry = cuboid(v(-0.7, -0.6, -d), v(0.5, 0.8, 0.0));
        let medium = Medium::new("chromatic", row.vector("sigma_t"), DVec3::ZERO, Phase::Isotropic);
        let scene = seen_through(geometry, medium, v(0.0, 0.0, d), DVec3::NEG_Z);
        let (expected, error) = row.output("T");
        for (channel, expected) in expected.into_iter().enumerate() {
            cases.push(Case {
                name: format!("{} camera ray, channel {channel}", row.id),
                views: vec![(1.0, scene.clone())],
                channel,
                expected,
                error,
                tolerance: (5e-3 * expected).max(1e-6),
                heavy_tailed: false,
            });
        }
    }
    judge("J, chromatic", &cases, CASES);
}

fn reflected_and_transmitted(row: &Row, slab: Slab, relative: f64) -> [Case; 2] {
    let view = || slab.at_cosine(1.0);
    [("R_coll", slab.lit_from_above(view())), ("T_coll", slab.lit_from_below(view()))].map(|(name, scene)| {
        let (expected, error) = row.value(name);
        let tolerance = (relative * expected).max(relative / 10.0);
        Case::new(format!("{} {name}", row.id), scene, (expected, error), tolerance)
    })
}

#[test]
fn rays_through_edges_and_corners() {
    for row in kind("edge_vertex") {
        let medium = scenes::gray(1.3, 0.0, 0.0);
        let mut scene = seen_through(cuboid(DVec3::ZERO, DVec3::ONE), medium, row.vector("o"), row.vector("d"));
        // Narrower than the distances that the rows are about.
        scene.camera.fov_x = 1e-8;
        let found = images::average(&images::on_device(&scenes::pack(&scene, 1), 1024)).x;
        let (accepted, _) = row.output("T_accepted");
        // Single rays have one of the accepted transmittances; a bundle of them any mixture. 2.6e5 samples resolve 1e-3.
        let low = accepted.iter().copied().fold(f64::INFINITY, f64::min);
        let high = accepted.iter().copied().fold(0.0, f64::max);
        let right = |value: f64| (low - 4e-3..=high + 4e-3).contains(&value);
        assert!(right(found), "{}: {found}, accepted are {accepted:?}", row.id);
        assert!(!right(found + high - low + 1e-2), "the test would see it");
    }
}
