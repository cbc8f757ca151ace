//! Images: the device against the reference, and both against closed forms and tables.

mod common;

use common::scenes::v;
use common::statistics::{chi_squared_tail, mean_and_error, sidak_bound};
use common::{device, images, scenes, truth};
use glam::{DMat4, DVec3};
use tyndall::gpu::shader::Variant;
use tyndall::scene::{Camera, Film, Geometry, Light, Medium, Phase, Scene, Shape};

#[test]
fn device_and_reference_follow_the_same_paths() {
    for (name, scene) in scenes::all() {
        let packed = scenes::pack(&scene, 7);
        let (device, reference) = (images::on_device(&packed, 16), images::by_reference(&packed, 16));
        let share = images::compare(&device, &reference).unwrap_or_else(|why| panic!("{name}: {why}"));
        eprintln!("{name}: {:.2} % of the pixels agree", share * 100.0);
    }
}

#[test]
fn samples_that_are_not_numbers_are_counted() {
    use tyndall::render::Backend;
    let mut packed = scenes::pack(&scenes::gray_box(), 9);
    let invalid = |packed: &tyndall::pack::Packed| {
        let mut renderer = tyndall::gpu::Renderer::new(device(), packed).expect("the kernels compile");
        let on_device = renderer.render(0..16).expect("it renders")[0].invalid;
        let mut reference = tyndall::reference::Renderer::new(packed.clone());
        [on_device, reference.render(0..16).expect("it renders")[0].invalid]
    };
    assert_eq!(invalid(&packed), [[0; 3]; 2]);
    for surface in &mut packed.surfaces {
        surface.reflectance = glam::Vec3::NAN;
    }
    for counts in invalid(&packed) {
        assert!(counts[0] > 0, "{counts:?}");
    }
}

#[test]
fn more_features_than_needed_do_not_change_the_image() {
    for (name, scene) in scenes::all() {
        let packed = scenes::pack(&scene, 8);
        let variant = |features| Variant {
            features,
            workgroup: device().subgroup_size,
            buffer_reference: device().buffer_reference,
        };
        let needed = images::mean(&images::with_variant(&packed, 16, &variant(packed.features)));
        let everything = images::mean(&images::with_variant(&packed, 16, &variant(packed.features.everything())));
        let share = images::compare(&needed, &everything).unwrap_or_else(|why| panic!("{name}: {why}"));
        let same = needed.iter().zip(&everything).filter(|(a, b)| a == b).count() as f64 / needed.len() as f64;
        eprintln!("{name}: {:.2} % agree, {:.2} % bit-identical", share * 100.0, same * 100.0);
    }
}

#[test]
fn the_comparison_rejects_a_brighter_image_and_the_wrong_sign_of_g() {
    let packed = scenes::pack(&scenes::gray_box(), 7);
    let right = images::on_device(&packed, 16);
    let brighter = right.iter().map(|pixel| *pixel * 1.02).collect();
    images::compare(&right, &brighter).expect_err("an image that is 2 % brighter");
    let mut flipped = packed.clone();
    flipped.media.iter_mut().for_each(|medium| medium.g = -medium.g);
    images::compare(&right, &images::by_reference(&flipped, 16)).expect_err("scattering in the wrong direction");
}

/// Batches of an estimate, and the z-value of their mean under the hypothesis that the expectation is `expected`, which
/// is known to `error`. The standard error must be below a seventh of `resolution`, so that a bias of that size would
/// be seen.
fn z_value(batches: &[f64], expected: f64, error: f64, resolution: f64) -> Result<f64, String> {
    let (mean, deviation) = mean_and_error(batches);
    if deviation > resolution / 7.0 {
        return Err(format!("the standard error {deviation:.2e} is too large to see a bias of {resolution:.2e}"));
    }
    let rounding = 1e-5 * expected;
    Ok((mean - expected) / (deviation.powi(2) + error.powi(2) + rounding.powi(2)).sqrt().max(1e-300))
}

fn red(batches: &[DVec3]) -> Vec<f64> {
    batches.iter().map(|batch| batch.x).collect()
}

/// A ball of radius 1 under an environment of radiance 1, seen along a ray that passes its centre at a distance.
fn lit_ball(tau: f64, albedo: f64, g: f64, distance: f64) -> Scene {
    let mut scene = scenes::one_ray(v(distance, 0.0, 4.0), v(distance, 0.0, 0.0), 16);
    let medium = scene.add_medium(scenes::gray(tau, albedo, g));
    scene.shapes.push(Shape::boundary("ball", scenes::ball(DVec3::ZERO, 1.0), medium));
    scene.lights.push(Light::Constant { radiance: DVec3::ONE });
    scene
}

#[test]
fn balls_under_a_uniform_sky_agree_with_the_table() {
    let rows: Vec<_> = truth::table("D").into_iter().filter(|row| !row.id.contains("furnace")).collect();
    // All checks of `ci/test`, or the four times as many samples of `ci/test --full`, which resolve half the bias.
    let (spp, finest) = if std::env::var_os("TYNDALL_FULL").is_some() { (4 * 2048, 0.5) } else { (2048, 1.0) };
    let mut z_values = Vec::new();
    let mut seed = 1000;
    for row in &rows {
        let (tau, albedo, g) = (row.number("tau_R"), row.number("albedo"), row.number("g"));
        let (expected, error) = row.output("L_chord");
        for (distance, expected) in row.list("b_over_R").into_iter().zip(expected) {
            seed += 1;
            let batches = red(&images::batches(&lit_ball(tau, albedo, g, distance), seed, spp));
            let resolution = finest * (0.01 * expected).max(1e-3);
            let z = z_value(&batches, expected, error, resolution);
            let z = z.unwrap_or_else(|why| panic!("{} at {distance}: {why}", row.id));
            z_values.push((format!("{} at {distance}", row.id), z));
            // The same data must reject an expectation that is off by the bias worth catching, and far more so 2 % of it.
            let off = z_value(&batches, expected - resolution, error, resolution).expect("as above");
            assert!(off.abs() > 4.5, "{} at {distance}: a bias of {resolution:e} has z = {off:.2}", row.id);
        }
    }
    let count = z_values.len();
    let bound = sidak_bound(count, (images::BATCHES - 1) as f64);
    for (case, z) in &z_values {
        assert!(z.abs() < bound, "{case}: z = {z:.2}, the bound is {bound:.2}");
    }
    // All together: neither a small bias of all, nor errors that are estimated wrong.
    let mean = z_values.iter().map(|(_, z)| z).sum::<f64>() / (count as f64).sqrt();
    assert!(mean.abs() < 3.3, "the z-values lean to one side: {mean:.2}");
    let probability = chi_squared_tail(z_values.iter().map(|(_, z)| z * z).sum(), count as f64);
    assert!((1e-3..1.0 - 1e-3).contains(&probability), "the z-values spread wrongly: {probability:e}");
    eprintln!("{count} rays: sum of z {mean:.2}, probability of their squares {probability:.3}");
}

#[test]
fn the_table_rejects_the_wrong_sign_of_g() {
    let row = truth::table("D").into_iter().find(|row| row.id == "D2:1.0:0.8:0.75").expect("the row exists");
    let (expected, error) = row.output("L_chord");
    let (tau, albedo, g) = (row.number("tau_R"), row.number("albedo"), row.number("g"));
    let batches = red(&images::batches(&lit_ball(tau, albedo, -g, 0.0), 7, 2048));
    let z = z_value(&batches, expected[0], error, 0.01).expect("it is resolved");
    assert!(z.abs() > 10.0, "z = {z}");
}

/// Whether an estimate of 1 is 1: within three standard errors, of at most 1e-3.
fn check_furnace(batches: &[f64]) -> Result<String, String> {
    let (mean, error) = mean_and_error(batches);
    let result = format!("{mean:.6} ± {error:.1e}");
    let right = error <= 1e-3 && (mean - 1.0).abs() <= 3.0 * error + 1e-5;
    if right { Ok(result) } else { Err(result) }
}

#[test]
fn a_medium_that_absorbs_nothing_is_invisible_in_a_furnace() {
    // The furnaces of table D (all but the one of a grid), and forward scattering at the edge of what can be resolved.
    let cube = |side: f64| scenes::cuboid(DMat4::from_scale(DVec3::splat(side / 2.0)));
    let mut nested = scenes::furnace(cube(2.0), 1.0, 0.3);
    let inner = nested.add_medium(scenes::gray(2.0, 1.0, 0.3));
    nested.shapes.push(Shape::boundary("inner", scenes::ball(v(0.2, 0.1, 0.0), 0.5), inner));
    let cases = [
        ("D:furnace0", scenes::furnace(cube(1.0), 1.0, 0.0)),
        ("D:furnace1", scenes::furnace(cube(1.0), 20.0, 0.9)),
        ("D:furnace2", scenes::furnace(scenes::ball(DVec3::ZERO, 1.0), 3.0, -0.9)),
        ("D:furnace3", scenes::furnace(scenes::torus(1.0, 0.4), 5.0, 0.5)),
        ("D:furnace4", nested),
        ("isotropic", scenes::furnace(scenes::ball(DVec3::ZERO, 1.0), 3.0, 0.0)),
        ("forward", scenes::furnace(scenes::ball(DVec3::ZERO, 1.0), 3.0, 0.9)),
        ("backward", scenes::furnace(scenes::ball(DVec3::ZERO, 1.0), 3.0, -0.5)),
        ("nearly straight on", scenes::furnace(scenes::ball(DVec3::ZERO, 1.0), 4.0, 0.9999)),
    ];
    for (seed, (name, mut scene)) in (1..).zip(cases) {
        // On the medium alone: the background is 1 anyway.
        scene.camera.fov_x = 8.0;
        if name == "D:furnace3" {
            scene.camera = Camera::look_at(v(2.0, 3.0, 2.0), v(1.0, 0.0, 0.0), DVec3::Y, 8.0);
        }
        scene.film = Film::new(16, 16);
        let batches = red(&images::batches(&scene, seed, 2048));
        let result = check_furnace(&batches).unwrap_or_else(|why| panic!("{name}: {why}"));
        eprintln!("{name}: {result}");
        let darker: Vec<f64> = batches.iter().map(|batch| batch * 0.98).collect();
        check_furnace(&darker).expect_err("a furnace that loses 2 %");
    }
}

/// The shapes of which a ray crosses a length, from `start` on along a unit axis.
fn layers(start: DVec3, axis: DVec3, length: f64) -> [(&'static str, Geometry); 2] {
    let middle = start + axis * (length / 2.0);
    let half = axis.abs() * (length / 2.0) + (DVec3::ONE - axis.abs()) * 2.0;
    let slab = scenes::cuboid(DMat4::from_scale_rotation_translation(half, Default::default(), middle));
    [("box", slab), ("sphere", scenes::ball(middle, length / 2.0))]
}

/// An absorbing medium of table C.
fn absorber(row: &truth::Row) -> Medium {
    let [sigma_a, sigma_s] = ["sigma_a", "sigma_s"].map(|name| DVec3::from_slice(&row.list(name)));
    assert_eq!(sigma_s, DVec3::ZERO, "the rows of the table only absorb");
    Medium::new("absorber", sigma_a, DVec3::ZERO, Phase::Isotropic)
}

/// Whether three channels are right to a relative tolerance.
fn check_channels(found: DVec3, expected: DVec3, tolerance: DVec3) -> Result<(), String> {
    let wrong = (found / expected - 1.0).abs().cmpgt(tolerance).any() || !found.is_finite();
    if wrong { Err(format!("{found:?}, expected {expected:?}: {:?}", found / expected - 1.0)) } else { Ok(()) }
}

#[test]
fn absorption_follows_the_law_of_beer_and_lambert_along_shadow_rays() {
    // A point of a floor, lit by a point light above, through the medium: the shadow ray's transmittance is no
    // estimate, so each sample is rho/pi I/r² T.
    for row in truth::table("C") {
        let length = row.number("d");
        let (transmittance, _) = row.output("T");
        let transmittance = DVec3::from_slice(&transmittance);
        for (name, geometry) in layers(v(0.0, 0.5, 0.0), DVec3::Y, length) {
            let mut scene = scenes::one_ray(v(0.0, 0.2, 3.0), DVec3::ZERO, 4);
            let medium = scene.add_medium(absorber(&row));
            let floor = scenes::quad(v(-4.0, 0.0, 4.0), DVec3::X * 8.0, DVec3::NEG_Z * 8.0);
            scene.shapes.push(Shape::diffuse("floor", floor, DVec3::splat(0.5)));
            scene.shapes.push(Shape::boundary("absorber", geometry, medium));
            let height = length + 1.0;
            scene.lights.push(Light::Point { position: v(0.0, height, 0.0), intensity: DVec3::ONE });
            scene.integrator.max_depth = Some(2);
            let found = images::average(&images::on_device(&scenes::pack(&scene, 1), 16));
            let expected = transmittance * 0.5 / std::f64::consts::PI / (height * height);
            // The optical depth has the relative error of single precision.
            let tau = -transmittance.map(f64::ln);
            let tolerance = (tau * 1e-6).max(DVec3::splat(1e-5));
            check_channels(found, expected, tolerance).unwrap_or_else(|why| panic!("{} {name}: {why}", row.id));
            check_channels(found * 1.0002, expected, tolerance).expect_err("a little too bright");
        }
    }
}

#[test]
fn absorption_follows_the_law_of_beer_and_lambert_along_camera_rays() {
    // Whether a camera ray gets through is sampled; its flight and channel are low-discrepancy numbers, so some samples resolve
    // a few thousandths of the transmittance, however small it is.
    let mut z_values = Vec::new();
    for row in truth::table("C") {
        let length = row.number("d");
        let behind = DVec3::from_slice(&row.list("L_behind"));
        let (expected, error) = row.output("L");
        for (name, geometry) in layers(v(0.0, 0.0, -length), DVec3::Z, length) {
            let mut scene = scenes::one_ray(v(0.0, 0.0, 2.0), DVec3::ZERO, 16);
            let medium = scene.add_medium(absorber(&row));
            scene.shapes.push(Shape::boundary("absorber", geometry, medium));
            scene.lights.push(Light::Constant { radiance: behind });
            let batches = images::batches(&scene, 100 + z_values.len() as u32, 4096);
            for (channel, &expected) in expected.iter().enumerate() {
                let case = format!("{} {name}, channel {channel}", row.id);
                let estimates: Vec<f64> = batches.iter().map(|batch| batch[channel]).collect();
                let resolution = 3e-3 * expected;
                // The table's error is absolute; what a deep transmittance has of it is far below its own rounding here.
                let error = error.min(1e-6 * expected);
                let z = z_value(&estimates, expected, error, resolution).unwrap_or_else(|why| panic!("{case}: {why}"));
                let off = z_value(&estimates, expected - resolution, error, resolution).expect("as above");
                assert!(off.abs() > 4.5, "{case}: a bias of {resolution:e} has z = {off:.2}");
                z_values.push((case, z));
            }
        }
    }
    let bound = sidak_bound(z_values.len(), (images::BATCHES - 1) as f64);
    for (case, z) in &z_values {
        assert!(z.abs() < bound, "{case}: z = {z:.2}, the bound is {bound:.2}");
    }
}
