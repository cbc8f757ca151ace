//! Light that comes into media through smooth glass, and that glass mirrors: the kernels against the reference, and that guides change no
//! expectation, whatever they say.

mod common;

use common::images::{self, Image};
use common::random::Random;
use common::scenes::{self, pack, v};
use common::statistics::mean_and_error;
use glam::{DVec3, Vec3};
use tyndall::guide;
use tyndall::pack::Packed;
use tyndall::pack::layout::GUIDE_CELLS;
use tyndall::pilot;
use tyndall::scene::{Bsdf, Film, Geometry, Light, Medium, Mesh, Phase, Scene, Shape};

const SIDE: u32 = 32;

fn glass(name: &str, geometry: Geometry, inside: Option<tyndall::scene::MediumId>, index: f64) -> Shape {
    let mut shape = match inside {
        Some(medium) => Shape::boundary(name, geometry, medium),
        None => Shape::diffuse(name, geometry, DVec3::ZERO),
    };
    let full = || DVec3::ONE.into();
    shape.bsdf =
        Bsdf::Dielectric { int_ior: index, ext_ior: 1.0, specular_reflectance: full(), specular_transmittance: full() };
    shape
}

fn boxed() -> Scene {
    let mut scene = Scene::new(scenes::camera(4.0), Film::new(SIDE, SIDE));
    scenes::walls(&mut scene);
    scene.shapes.push(scenes::lamp());
    scene
}

/// Bodies of glass with media in them: of one surface, with shading normals, within each other, and lamps of all kinds.
fn cases() -> Vec<(&'static str, Scene)> {
    let mut milk = boxed();
    let white = milk.add_medium(Medium::new("milk", v(1.0, 2.0, 4.0), v(0.9, 0.95, 0.8), Phase::Isotropic));
    milk.shapes.push(glass("ball", scenes::ball(v(0.0, -0.2, 0.0), 0.5), Some(white), 1.5));

    let mut smooth = boxed();
    let hazy = smooth.add_medium(scenes::gray(1.5, 0.9, 0.7));
    smooth.shapes.push(glass("ball", scenes::smooth_ball(2, v(0.2, -0.1, 0.1), 0.5), Some(hazy), 1.33));
    smooth.shapes.push(Shape::lamp("ball lamp", scenes::ball(v(-0.6, 0.3, 0.3), 0.15), v(9.0, 6.0, 3.0)));

    // A shell of glass with milk in it: light is bent twice on its way.
    let mut shell = boxed();
    let [wall, drink] = [
        Medium::new("wall", v(0.1, 0.2, 0.1), v(0.1, 0.1, 0.1), Phase::Isotropic),
        Medium::new("drink", v(2.0, 2.0, 3.0), v(0.9, 0.9, 0.8), Phase::Isotropic),
    ]
    .map(|medium| shell.add_medium(medium));
    shell.shapes.push(glass("outer", scenes::ball(v(0.0, -0.2, 0.0), 0.6), Some(wall), 1.5));
    shell.shapes.push(glass("inner", scenes::ball(v(0.0, -0.2, 0.0), 0.5), Some(drink), 1.2));

    let mut sky = boxed();
    sky.shapes.truncate(1);
    let tea = sky.add_medium(Medium::new("tea", v(0.5, 1.0, 2.0), v(0.8, 0.6, 0.3), Phase::Isotropic));
    sky.shapes.push(glass("cube", scenes::cuboid(glam::DMat4::from_scale(DVec3::splat(0.4))), Some(tea), 1.4));
    sky.lights.push(Light::Constant { radiance: v(0.2, 0.3, 0.4) });
    sky.shapes.push(Shape::lamp("lamp", scenes::ball(v(0.9, 0.8, 0.5), 0.2), v(20.0, 15.0, 10.0)));
    // Clear coloured water over a floor, and a ball in it: light is found by surfaces.
    let mut pool = boxed();
    let water = pool.add_medium(Medium::new("water", v(0.5, 0.3, 0.2), v(0.1, 0.2, 0.3), Phase::Isotropic));
    let place = glam::DMat4::from_translation(v(0.0, -0.6, 0.0)) * glam::DMat4::from_scale(v(0.8, 0.35, 0.8));
    pool.shapes.push(glass("water", scenes::cuboid(place), Some(water), 1.33));
    let bottom = scenes::quad(v(-0.7, -0.9, 0.7), DVec3::X * 1.4, DVec3::NEG_Z * 1.4);
    pool.shapes.push(Shape::diffuse("bottom", bottom, v(0.8, 0.7, 0.5)));
    let mut stone = Shape::diffuse("stone", scenes::ball(v(0.2, -0.7, 0.2), 0.15), DVec3::ZERO);
    stone.bsdf = Bsdf::Plastic {
        diffuse_reflectance: v(0.6, 0.2, 0.2).into(),
        specular_reflectance: DVec3::ONE.into(),
        int_ior: 1.9,
        ext_ior: 1.33,
        nonlinear: true,
        two_sided: true,
    };
    pool.shapes.push(stone);

    let corner = Mesh {
        positions: vec![v(-0.9, 0.3, -0.6), v(-0.9, 0.8, -0.6), v(-0.4, 0.8, -0.8)],
        triangles: vec![[0, 2, 1]],
        ..Mesh::default()
    };
    sky.shapes.push(Shape::lamp("corner", Geometry::Mesh(corner), v(3.0, 9.0, 6.0)));
    vec![("milk", milk), ("smooth", smooth), ("shell", shell), ("pool", pool), ("sky", sky)]
}

fn guided(scene: &Scene, seed: u32) -> Packed {
    let mut packed = pack(scene, seed);
    guide::run(&mut packed);
    packed
}

/// With lobes that have nothing to do with the scene.
fn misguided(scene: &Scene, seed: u32) -> Packed {
    let mut packed = pack(scene, seed);
    let mut random = Random(u64::from(seed));
    packed.params.guide_origin = Vec3::splat(-1.0);
    packed.params.guide_scale = Vec3::splat(GUIDE_CELLS as f32 / 2.0);
    packed.params.first_guide = packed.values.len() as u32;
    for _ in 0..GUIDE_CELLS.pow(3) {
        let chance = if random.unit() < 0.2 { 0.0 } else { random.unit() };
        let axis = random.direction() * chance;
        packed.values.extend([axis.x, axis.y, axis.z, 0.5 + 4.0 * random.unit()].map(|x| x as f32));
    }
    packed.features.guides = true;
    packed
}

#[test]
fn device_and_reference_send_the_same_probes() {
    for (name, scene) in cases() {
        for packed in [guided(&scene, 7), misguided(&scene, 7)] {
            assert!(packed.features.guides, "{name}: light is found");
            let (device, reference) = (images::on_device(&packed, 4), images::by_reference(&packed, 4));
            let share = images::compare(&device, &reference).unwrap_or_else(|why| panic!("{name}: {why}"));
            eprintln!("{name}: {:.2} % of the pixels agree", share * 100.0);
            let without = images::on_device(&pack(&scene, 7), 4);
            images::compare(&device, &without).expect_err("without guides other light is found");
        }
    }
}

/// z-values of the mean difference of two images in its standard errors, and the largest relative error.
fn differences(one: &Image, two: &Image) -> ([f64; 3], f64) {
    let brightness = images::average(two);
    let mut coarsest = 0.0f64;
    let z = std::array::from_fn(|channel| {
        let found: Vec<f64> = one.iter().zip(two).map(|(a, b)| a[channel] - b[channel]).collect();
        let (mean, error) = mean_and_error(&found);
        coarsest = coarsest.max(error / brightness[channel]);
        mean / error
    });
    (z, coarsest)
}

fn check(name: &str, one: &Image, two: &Image) {
    let (z, coarsest) = differences(one, two);
    eprintln!("{name}: z = {z:.2?}, standard errors below {:.2} %", coarsest * 100.0);
    assert!(coarsest < 0.05 / 7.0, "{name}: the standard error of {:.2} % is too large", coarsest * 100.0);
    assert!(z.iter().all(|z| z.abs() < 4.0), "{name}: z = {z:?}");
    let brighter: Image = one.iter().map(|pixel| *pixel * 1.05).collect();
    let (z, _) = differences(&brighter, two);
    assert!(z.iter().any(|z| z.abs() > 4.0), "{name}: 5 % more would be seen, z = {z:?}");
}

#[test]
fn guides_change_no_expectation() {
    for (name, scene) in cases() {
        let mut plain = pack(&scene, 1);
        plain.features.mis = false;
        // By chance alone: no lamp is sampled, none is looked for in mirrors, no probe is sent.
        let mut by_chance = pack(&scene, 5);
        by_chance.features.light_sampling = false;
        let truth = images::on_device(&by_chance, 4096);
        check(&format!("{name}, without guides"), &images::on_device(&pack(&scene, 2), 1024), &truth);
        check(&format!("{name}, light sampling in full"), &images::on_device(&plain, 1024), &truth);
        check(&format!("{name}, guided"), &images::on_device(&guided(&scene, 3), 1024), &truth);
        check(&format!("{name}, misguided"), &images::on_device(&misguided(&scene, 4), 1024), &truth);
    }
}

#[test]
fn guides_lower_the_noise() {
    let (_, scene) = cases().swap_remove(0);
    let noise = |packed: &dyn Fn(u32) -> Packed| {
        let images: Vec<Image> = (0..4).map(|seed| images::on_device(&packed(seed), 64)).collect();
        let mean = |k: usize| images.iter().map(|image| image[k].y).sum::<f64>() / 4.0;
        let variance = |k: usize| images.iter().map(|image| (image[k].y - mean(k)).powi(2)).sum::<f64>();
        (0..images[0].len()).map(variance).sum::<f64>()
    };
    let (with, without) = (noise(&|seed| guided(&scene, seed)), noise(&|seed| pack(&scene, seed)));
    eprintln!("variance {with:.4} with guides, {without:.4} without");
    assert!(with < 0.7 * without);
}

#[test]
fn glass_alone_is_guided() {
    let features = |scene: &Scene| {
        let mut packed = guided(scene, 1);
        pilot::run(&mut packed, true);
        packed.features
    };
    let (_, milk) = cases().swap_remove(0);
    assert!(features(&milk).guides);
    // Dark, open, or with paths too short to get out again.
    let mut dark = milk.clone();
    dark.shapes.retain(|shape| shape.emission.is_none());
    assert!(!features(&dark).guides);
    let mut open = milk.clone();
    open.shapes.last_mut().expect("the ball").bsdf = Bsdf::Null;
    assert!(!features(&open).guides);
    let mut short = milk;
    short.integrator.max_depth = Some(2);
    assert!(!features(&short).guides);
}
