//! Images under spots, parallel light and environment maps: closed forms, orientation.

mod common;

use common::random::Random;
use common::scenes::{self, v};
use common::statistics::mean_and_error;
use common::{images, units};
use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use tyndall::pack::{PackError, Packed};
use tyndall::scene::{Bitmap, Bsdf, Film, Light, Medium, Phase, Scene, Shape};

const RHO: f64 = 0.5;

/// A floor in the plane y = 0, seen at a point; all pixels see the same, and light scatters there once.
fn floor(point: DVec3) -> Scene {
    let mut scene = scenes::one_ray(point + v(0.3, 2.0, 1.5), point, 8);
    let plane = scenes::quad(v(-50.0, 0.0, 50.0), DVec3::X * 100.0, DVec3::NEG_Z * 100.0);
    scene.shapes.push(Shape::diffuse("floor", plane, DVec3::splat(RHO)));
    scene.integrator.max_depth = Some(2);
    scene
}

/// What all pixels see.
fn seen(scene: &Scene) -> DVec3 {
    images::average(&images::on_device(&scenes::pack(scene, 1), 16))
}

/// Whether each channel is right.
fn check(found: DVec3, expected: DVec3, tolerance: f64) -> Result<(), String> {
    let right = (found - expected).abs().cmple(expected * tolerance).all();
    if right { Ok(()) } else { Err(format!("{found}, expected {expected}")) }
}

#[test]
fn parallel_light_on_a_floor() {
    // Radiance is rho/pi E cos, whatever the scale of the scene.
    let irradiance = v(2.0, 3.0, 5.0);
    for direction in [v(0.0, -1.0, 0.0), v(0.6, -0.8, 0.0), v(-0.1, -0.02, 0.3).normalize()] {
        let mut scene = floor(v(0.1, 0.0, -0.2));
        scene.lights.push(Light::Directional { direction, irradiance });
        let expected = irradiance * (RHO / PI * -direction.y);
        check(seen(&scene), expected, 1e-5).unwrap_or_else(|why| panic!("{direction}: {why}"));
        check(seen(&scene) * 1.0002, expected, 1e-5).expect_err("a little too bright");
        // A wall between, out of the camera's sight.
        let place = v(0.1, 0.0, -0.2) - direction * 30.0;
        scene.shapes.push(Shape::diffuse("wall", scenes::ball(place, 0.3), DVec3::ZERO));
        assert_eq!(seen(&scene), DVec3::ZERO, "{direction}: light goes through a wall");
    }
    let mut scene = floor(DVec3::ZERO);
    scene.lights.push(Light::Directional { direction: v(0.6, 0.8, 0.0), irradiance });
    if let Bsdf::Diffuse { two_sided, .. } = &mut scene.shapes[0].bsdf {
        *two_sided = false;
    }
    assert_eq!(seen(&scene), DVec3::ZERO, "light from below");
}

#[test]
fn parallel_light_through_an_absorber() {
    // A slab of thickness 0.7 above the floor, beside the camera: exp(-sigma d/cos), chromatic.
    let (sigma, direction) = (v(0.5, 1.0, 4.0), v(0.6, -0.8, 0.0));
    let absorber = Medium::new("absorber", sigma, DVec3::ZERO, Phase::Isotropic);
    let mut scene = floor(DVec3::ZERO);
    let slab = glam::DMat4::from_scale_rotation_translation(v(20.0, 0.35, 20.0), Default::default(), v(0.0, 3.0, 0.0));
    let medium = scene.add_medium(absorber.clone());
    scene.shapes.push(Shape::boundary("slab", scenes::cuboid(slab), medium));
    scene.lights.push(Light::Directional { direction, irradiance: DVec3::ONE });
    let transmittance = (-sigma * 0.7 / 0.8).map(f64::exp);
    let expected = transmittance * (RHO / PI * 0.8);
    check(seen(&scene), expected, 2e-5).unwrap_or_else(|why| panic!("{why}"));
    check(seen(&scene) * 1.0002, expected, 2e-5).expect_err("a little too bright");
    // Nothing comes through a medium without an end.
    for medium in [absorber, scenes::gray(1.0, 0.0, 0.0)] {
        let mut scene = floor(DVec3::ZERO);
        scene.camera.medium = Some(scene.add_medium(medium));
        scene.lights.push(Light::Directional { direction, irradiance: DVec3::ONE });
        scene.lights.push(Light::Envmap { bitmap: scenes::sunny(), scale: 1.0, to_world: DMat3::IDENTITY });
        assert_eq!(seen(&scene), DVec3::ZERO);
    }
}

#[test]
fn spots_fall_off_with_the_angle() {
    // On the floor under a spot at the height h, at the angle theta from its axis straight down, the distance is h/cos theta:
    // rho/pi I falloff cos^3/h^2. The falloff is 1 up to the beam width, then a straight line to 0 at the cutoff.
    let (height, intensity) = (2.5, v(7.0, 5.0, 3.0));
    for (cutoff, beam) in [(40.0, 25.0), (40.0, 0.0), (60.0, 60.0), (180.0, 90.0), (180.0, 180.0)] {
        for angle in [0.0, 24.9, 33.0, 39.9, 40.1, 60.1] {
            let (cutoff_angle, beam_width): (f64, f64) = (cutoff, beam);
            let theta = f64::to_radians(angle);
            let mut scene = floor(v(height * theta.tan(), 0.0, 0.0));
            let position = v(0.0, height, 0.0);
            scene.lights.push(Light::Spot {
                position,
                direction: -DVec3::Y,
                intensity,
                cutoff_angle,
                beam_width,
                slide: None,
            });
            let falloff = |angle: f64| {
                if angle <= beam { 1.0 } else { ((cutoff - angle) / (cutoff - beam)).clamp(0.0, 1.0) }
            };
            let falloff = if angle >= cutoff { 0.0 } else { falloff(angle) };
            let full = intensity * (RHO / PI * theta.cos().powi(3) / height.powi(2));
            let found = seen(&scene);
            let case = format!("{cutoff}, {beam}: at {angle}");
            // The edge is as sharp as the slope: the falloff has the absolute error of the angle, times the slope.
            let agrees = |found: DVec3| (found - full * falloff).abs().cmple(full * 2e-5).all();
            assert!(agrees(found), "{case}: {found}, expected {}", full * falloff);
            if falloff > 0.0 {
                assert!(!agrees(found * 1.01), "{case}: blind to 1 %");
            }
        }
    }
    // Turned, and seen from its axis: all of the intensity.
    let (position, target) = (v(-3.0, 1.0, 2.0), v(0.5, 0.0, -0.5));
    let mut scene = floor(target);
    let offset: DVec3 = target - position;
    let direction = offset.normalize();
    scene.lights.push(Light::Spot { position, direction, intensity, cutoff_angle: 1.0, beam_width: 0.5, slide: None });
    let expected = intensity * (RHO / PI * -direction.y / offset.length_squared());
    check(seen(&scene), expected, 1e-4).unwrap_or_else(|why| panic!("{why}"));
}

/// The radiance of an environment map in a direction of the world, as it is defined.
fn definition(bitmap: &Bitmap, scale: f64, to_world: DMat3, direction: DVec3) -> DVec3 {
    bitmap.sky(Light::sky_uv(to_world.inverse() * direction)) * scale
}

#[test]
fn the_camera_sees_the_sky_where_it_is() {
    let turned = DMat3::from_rotation_x(0.4) * DMat3::from_rotation_y(1.0) * DMat3::from_rotation_z(-2.0);
    let mirrored = turned * DMat3::from_diagonal(v(-1.0, 1.0, 1.0));
    let bitmap = scenes::sunny();
    let mut random = Random(91);
    for to_world in [DMat3::IDENTITY, turned, mirrored] {
        let mut blind = [true; 3];
        for k in 0..5 {
            let direction = random.direction();
            let mut scene = scenes::one_ray(v(0.1, 0.2, 0.3), v(0.1, 0.2, 0.3) + direction, 8);
            scene.shapes.push(Shape::diffuse("behind", scenes::ball(-direction * 9.0, 1.0), DVec3::ONE));
            scene.lights.push(Light::Envmap { bitmap: bitmap.clone(), scale: 0.5, to_world });
            let expected = definition(&bitmap, 0.5, to_world, direction);
            let found = seen(&scene);
            check(found, expected, 1e-3).unwrap_or_else(|why| panic!("{direction}: {why}"));
            let faults = [to_world.transpose(), -to_world, to_world * DMat3::from_diagonal(v(1.0, 1.0, -1.0))];
            for (blind, fault) in blind.iter_mut().zip(faults) {
                *blind &= check(found, definition(&bitmap, 0.5, fault, direction), 1e-3).is_ok();
            }
            if k == 0 {
                scene.lights.push(scene.lights[0].clone());
                scene.lights.push(Light::Constant { radiance: v(1.0, 2.0, 3.0) });
                let all = expected * 2.0 + v(1.0, 2.0, 3.0);
                check(seen(&scene), all, 1e-3).unwrap_or_else(|why| panic!("all skies: {why}"));
                scene.integrator.hide_emitters = true;
                assert_eq!(seen(&scene), DVec3::ZERO, "hidden emitters");
            }
        }
        // The transpose of the identity is no fault.
        assert_eq!(blind, [to_world == DMat3::IDENTITY, false, false]);
    }
}

/// A z-value of the mean of batches, if it could see a relative bias of 1 %.
fn z_value(batches: &[f64], expected: f64) -> f64 {
    let (mean, error) = mean_and_error(batches);
    assert!(error < 0.01 * expected / 7.0, "the standard error {error:.1e} of {expected:.3e} is too large");
    (mean - expected) / error.hypot(1e-4 * expected)
}

fn channel(batches: &[DVec3], channel: usize) -> Vec<f64> {
    batches.iter().map(|batch| batch[channel]).collect()
}

#[test]
fn the_sky_lights_a_floor_from_where_it_is() {
    // Irradiance by the midpoint rule over the definition, in the image's coordinates.
    let irradiance = |bitmap: &Bitmap, to_world: DMat3| {
        let (across, down) = (960u32, 480u32);
        let mut sum = DVec3::ZERO;
        for row in 0..down {
            for column in 0..across {
                let uv =
                    DVec2::new((f64::from(column) + 0.5) / f64::from(across), (f64::from(row) + 0.5) / f64::from(down));
                let (theta, phi) = (PI * uv.y, 2.0 * PI * uv.x);
                let direction = v(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
                sum += bitmap.sky(uv) * (theta.sin() * (to_world * direction).y.max(0.0));
            }
        }
        sum * (2.0 * PI * PI / f64::from(across * down))
    };
    // One bright pixel, and little else; and a single sun.
    let sun = scenes::sky(32, 17, |x, y| if (x, y) == (9, 4) { v(3e3, 2e3, 1e3) } else { DVec3::ZERO });
    for (seed, (bitmap, angle)) in
        (1..).zip([(scenes::sunny(), 0.0), (scenes::sunny(), 1.1), (sun.clone(), 0.3), (sun, -0.9)])
    {
        let to_world = DMat3::from_rotation_z(angle) * DMat3::from_rotation_y(2.0 * angle);
        let mut scene = floor(DVec3::ZERO);
        scene.film = Film::new(16, 16);
        scene.lights.push(Light::Envmap { bitmap: bitmap.clone(), scale: 1.0, to_world });
        let batches = images::batches(&scene, seed, 1024);
        let expected = irradiance(&bitmap, to_world) * (RHO / PI);
        for k in 0..3 {
            let z = z_value(&channel(&batches, k), expected[k]);
            assert!(z.abs() < 4.0, "{seed}, channel {k}: z = {z}");
            let off = z_value(&channel(&batches, k), expected[k] * 1.01);
            assert!(off.abs() > 4.0, "{seed}, channel {k}: blind to 1 %");
        }
        let other = irradiance(&bitmap, to_world.transpose()) * (RHO / PI);
        assert!(angle == 0.0 || (other.x / expected.x - 1.0).abs() > 0.03, "the rotation has a direction");
    }
}

#[test]
fn an_image_of_one_colour_is_a_constant_light() {
    let with = |light: Light, seed: u32| {
        let mut scene = scenes::one_ray(v(0.3, 0.2, 4.0), v(0.3, 0.2, 0.0), 16);
        let medium = scene.add_medium(scenes::gray(3.0, 0.8, 0.6));
        scene.shapes.push(Shape::boundary("ball", scenes::ball(DVec3::ZERO, 1.0), medium));
        scene.lights.push(light);
        channel(&images::batches(&scene, seed, 2048), 1)
    };
    let radiance = v(1.0, 2.0, 3.0);
    let constant = with(Light::Constant { radiance }, 1);
    let bitmap = scenes::sky(9, 6, |_, _| radiance / 2.0);
    let image = with(Light::Envmap { bitmap, scale: 2.0, to_world: DMat3::from_rotation_x(1.0) }, 2);
    let z = |factor: f64| {
        let ((a, error_a), (b, error_b)) = (mean_and_error(&constant), mean_and_error(&image));
        (a - b * factor) / error_a.hypot(error_b * factor)
    };
    assert!(z(1.0).abs() < 4.0, "z = {}", z(1.0));
    assert!(z(1.01).abs() > 4.0, "blind: z = {} at 1 %", z(1.01));
}

#[test]
fn lights_that_cannot_be_sampled_or_held() {
    let empty = scenes::one_ray(v(0.0, 0.0, 4.0), DVec3::ZERO, 8);
    let pack = |lights: Vec<Light>| Packed::new(&Scene { lights, ..empty.clone() }, 0);
    let sky =
        |bitmap: &Arc<Bitmap>, scale: f64| Light::Envmap { bitmap: bitmap.clone(), scale, to_world: DMat3::IDENTITY };
    // Black ones are left out, and cost nothing.
    let (black, gray) = (scenes::sky(4, 4, |_, _| DVec3::ZERO), scenes::sky(4, 4, |_, _| DVec3::ONE));
    let packed = pack(vec![sky(&black, 1.0), sky(&gray, 0.0), Light::Constant { radiance: DVec3::ZERO }]).unwrap();
    assert!(packed.lights.is_empty() && packed.values.is_empty() && !packed.features.envmaps);
    assert!(!packed.features.light_sampling);
    let packed = pack(vec![sky(&gray, 1.0)]).unwrap();
    assert!(packed.features.envmaps && packed.features.light_sampling && !packed.features.many_lights);
    // The lights of the whole sky come last, in whatever order the scene has them.
    let directional = Light::Directional { direction: -DVec3::Y, irradiance: DVec3::ONE };
    let packed = pack(vec![sky(&gray, 1.0), Light::Constant { radiance: DVec3::ONE }, directional]).unwrap();
    assert_eq!((packed.params.first_sky, packed.lights.len()), (1, 3));
    assert!((packed.lights.iter().map(|light| light.probability).sum::<f32>() - 1.0).abs() < 1e-6);
    // Too bright for single precision.
    let error = pack(vec![sky(&gray, 1.0), sky(&gray, 1e39)]).unwrap_err();
    assert_eq!(error, PackError::TooBright { name: "emitter 2".to_owned(), value: 1e39 });
    assert!(error.to_string().starts_with("the largest radiance of \"emitter 2\" is 1e39"), "{error}");
    assert!(units::variant().features.envmaps, "kernels that can do everything can do these");
}
