//! Lamps that the camera sees are found apart: the same image, with less noise, on the device and by the reference.

mod common;

use common::scenes::v;
use common::statistics::mean_and_error;
use common::{device, images, scenes};
use glam::DVec3;
use images::Image;
use tyndall::pack::Packed;
use tyndall::render::Backend;
use tyndall::scene::{Camera, Film, Scene, Shape};
use tyndall::seen::{Seen, with_seen};
use tyndall::{gpu, reference};

const SIDE: u32 = 40;

/// Scenes of which the camera sees lamps.
fn cases() -> Vec<(&'static str, Scene, Packed, Seen)> {
    let mut cases = Vec::new();
    for (name, mut scene) in scenes::all() {
        scene.film = Film { filter: scene.film.filter, ..Film::new(SIDE, SIDE) };
        let mut packed = scenes::pack(&scene, 7);
        if let Some(seen) = Seen::find(&mut packed) {
            assert!(packed.features.seen);
            cases.push((name, scene, packed, seen));
        }
    }
    assert!(cases.len() >= 4, "{} scenes", cases.len());
    cases.truncate(6);
    cases
}

fn image(backend: impl Backend + 'static, seen: Option<Seen>, spp: u32) -> Image {
    images::mean(&with_seen(backend, seen).render(0..spp).expect("it renders"))
}

fn on_device(packed: &Packed, seen: Option<Seen>, spp: u32) -> Image {
    image(gpu::Renderer::new(device(), packed).expect("the kernels compile"), seen, spp)
}

#[test]
fn device_and_reference_leave_out_the_same() {
    for (name, _, packed, seen) in cases() {
        let device = on_device(&packed, Some(seen.clone()), 4);
        let reference = image(reference::Renderer::new(packed), Some(seen), 4);
        let share = images::compare(&device, &reference).unwrap_or_else(|why| panic!("{name}: {why}"));
        eprintln!("{name}: {:.2} % of the pixels agree", share * 100.0);
    }
}

/// z of the mean difference of some pixels of two images of independent noise, over their mean, and its standard error.
fn difference(pixels: &[usize], one: &Image, two: &Image) -> (f64, f64) {
    let brightness = pixels.iter().map(|pixel| two[*pixel].element_sum()).sum::<f64>() / pixels.len() as f64;
    let relative: Vec<f64> = pixels.iter().map(|&p| (one[p] - two[p]).element_sum() / brightness).collect();
    let (mean, error) = mean_and_error(&relative);
    (mean / error, error)
}

#[test]
fn the_expectation_stays() {
    for (name, scene, packed, seen) in cases() {
        let pixels: Vec<usize> = seen.pixels().collect();
        let truth = on_device(&scenes::pack(&scene, 8), None, 256);
        let apart = on_device(&packed, Some(seen), 64);
        let (z, error) = difference(&pixels, &apart, &truth);
        eprintln!("{name}: z = {z:.2}, standard error {:.3} %", error * 100.0);
        assert!(z.abs() < 4.0, "{name}: z = {z}");
        // Lamps that neither paths nor rays bring, or both.
        let without = on_device(&packed, None, 64);
        assert!(difference(&pixels, &without, &truth).0 < -4.0, "{name}: no lamps would be seen");
        let twice: Image = apart.iter().zip(&without).map(|(apart, without)| *apart * 2.0 - *without).collect();
        assert!(difference(&pixels, &twice, &truth).0 > 4.0, "{name}: lamps that count twice would be seen");
    }
}

/// A camera before a small lamp, in absorbing fog if `sigma_t` is not 0.
fn lamp_ahead(sigma_t: f64) -> Scene {
    let mut scene = Scene::new(scenes::camera(4.0), Film::new(SIDE, SIDE));
    let quad = scenes::quad(v(-0.3, -0.3, 0.0), DVec3::X * 0.6, DVec3::Y * 0.6);
    scene.shapes.push(Shape::lamp("lamp", quad, v(12.0, 10.0, 6.0)));
    if sigma_t > 0.0 {
        let fog = scene.add_medium(scenes::gray(sigma_t, 0.0, 0.0));
        scene.camera.medium = Some(fog);
    }
    scene
}

#[test]
fn edges_and_fog_have_less_noise() {
    for sigma_t in [0.0, 0.5] {
        let scene = lamp_ahead(sigma_t);
        let mut packed = scenes::pack(&scene, 3);
        let seen = Seen::find(&mut packed).expect("the lamp is seen");
        let truth = on_device(&packed, Some(seen.clone()), 4096);
        let noise = |image: Image| image.iter().zip(&truth).map(|(a, b)| (*a - *b).length_squared()).sum::<f64>();
        let apart = noise(on_device(&packed, Some(seen), 16));
        let by_paths = noise(on_device(&scenes::pack(&scene, 3), None, 16));
        assert!(apart < 0.2 * by_paths, "σ = {sigma_t}: {apart} is not far below {by_paths}");
    }
}

#[test]
fn fog_dims_a_lamp_as_it_should() {
    let scene = lamp_ahead(0.5);
    let mut packed = scenes::pack(&scene, 3);
    let seen = Seen::find(&mut packed).expect("the lamp is seen");
    let image = on_device(&packed, Some(seen), 16);
    // The middle of the film looks at the origin, from a distance of 4.0025.
    let expected = 12.0 * f64::exp(-0.5 * v(0.05, 0.1, 4.0).length());
    let found = image[(SIDE / 2 * SIDE + SIDE / 2) as usize].x;
    assert!((found / expected - 1.0).abs() < 2e-3, "{found} instead of {expected}");
}

#[test]
fn no_lamp_in_view_is_nothing_to_find() {
    let mut scene = lamp_ahead(0.0);
    scene.camera = Camera::look_at(v(0.0, 0.0, 4.0), v(9.0, 0.0, 4.0), DVec3::Y, 42.0);
    let mut packed = scenes::pack(&scene, 3);
    assert!(Seen::find(&mut packed).is_none() && !packed.features.seen);
    // Whatever a lamp fills brings the same on all rays.
    let mut near = lamp_ahead(0.0);
    near.camera = Camera::look_at(v(0.0, 0.0, 0.1), DVec3::ZERO, DVec3::Y, 42.0);
    assert!(Seen::find(&mut scenes::pack(&near, 3)).is_none());
}
