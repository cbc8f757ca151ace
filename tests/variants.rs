//! Variants of one scene that must have the same expectation: techniques on and off, one medium in one piece and in several,
//! boundaries that coincide.

mod common;

use common::scenes::v;
use common::statistics::mean_and_error;
use common::{images, scenes};
use glam::{DMat3, DMat4, DVec3};
use tyndall::pack::Packed;
use tyndall::pack::layout::MEDIUM_SEALED;
use tyndall::scene::{Bsdf, Camera, Film, Geometry, Light, Medium, Phase, Scene, Shape};

/// z-values of the mean difference of two renders, pixel by pixel, of each channel, and the largest relative standard error.
/// Each pixel of each render has its own random shifts, so the differences are independent.
fn differences(one: &Packed, two: &Packed, spp: u32) -> ([f64; 3], f64) {
    let (one, two) = (images::on_device(one, spp), images::on_device(two, spp));
    let brightness = images::average(&one);
    let mut coarsest = 0.0f64;
    let z = std::array::from_fn(|channel| {
        let differences: Vec<f64> = one.iter().zip(&two).map(|(a, b)| a[channel] - b[channel]).collect();
        let (mean, error) = mean_and_error(&differences);
        coarsest = coarsest.max(error / brightness[channel]);
        mean / error.max(1e-6 * brightness[channel])
    });
    (z, coarsest)
}

/// Both must agree, and the same comparison must see a difference of 5 %.
fn check(name: &str, one: &Packed, two: &Packed, spp: u32) {
    let (z, coarsest) = differences(one, two, spp);
    eprintln!("{name}: z = {z:.2?}, standard errors below {:.2} %", coarsest * 100.0);
    assert!(coarsest < 0.05 / 7.0, "{name}: the standard error of {:.2} % is too large", coarsest * 100.0);
    assert!(z.iter().all(|z| z.abs() < 4.0), "{name}: z = {z:?}");
}

fn packed(scene: &Scene, seed: u32) -> Packed {
    scenes::pack(scene, seed)
}

fn without_equiangular(mut packed: Packed) -> Packed {
    packed.media.iter_mut().for_each(|medium| medium.equiangular = 0.0);
    packed.features.equiangular = false;
    packed
}

/// A view through thin fog, with a black wall behind it.
fn foggy(fog: Medium, everywhere: bool) -> Scene {
    let mut scene = Scene::new(Camera::look_at(v(0.1, 0.0, 3.0), v(0.0, 0.0, 0.0), DVec3::Y, 30.0), Film::new(16, 16));
    let fog = scene.add_medium(fog);
    if everywhere {
        scene.camera.medium = Some(fog);
    } else {
        scene.shapes.push(Shape::boundary("fog", scenes::cuboid(DMat4::IDENTITY), fog));
    }
    let wall = scenes::quad(v(-4.0, -4.0, -2.0), DVec3::X * 8.0, DVec3::Y * 8.0);
    scene.shapes.push(Shape::diffuse("wall", wall, DVec3::splat(0.2)));
    scene
}

fn lamp(scene: &mut Scene, corner: DVec3, edge_1: DVec3, edge_2: DVec3) {
    scene.shapes.push(Shape::lamp("lamp", scenes::quad(corner, edge_1, edge_2), v(3.0, 2.0, 1.0)));
}

#[test]
fn equiangular_distances_change_no_expectation() {
    let gray = || scenes::gray(0.3, 0.9, 0.5);
    let chromatic = || Medium::new("fog", v(0.02, 0.2, 2.0), v(0.9, 0.8, 0.99), Phase::HenyeyGreenstein { g: -0.3 });
    let clear_red = || Medium::new("fog", v(0.0, 0.2, 0.4), v(0.9, 0.8, 0.99), Phase::Isotropic);
    let mut cases: Vec<(String, Scene)> = Vec::new();
    for (name, medium) in [("gray", gray()), ("chromatic", chromatic()), ("clear in red", clear_red())] {
        for everywhere in [true, false] {
            let place = if everywhere { "everywhere" } else { "in a box" };
            let mut add = |light: &str, change: &dyn Fn(&mut Scene)| {
                let mut scene = foggy(medium.clone(), everywhere);
                change(&mut scene);
                cases.push((format!("{name} fog {place}, {light}"), scene));
            };
            let point = |position| {
                move |scene: &mut Scene| {
                    scene.lights.push(Light::Point { position, intensity: v(2.0, 3.0, 1.0) });
                    // Longer paths come arbitrarily close to a point: their variance is infinite.
                    scene.integrator.max_depth = Some(2);
                }
            };
            add("point inside", &point(v(0.2, 1.0, 0.1)));
            add("point before", &point(v(0.0, 1.0, 2.5)));
            if name == "gray" {
                add("point behind the camera", &point(v(0.0, 0.4, 6.0)));
                add("lamp inside", &|scene| {
                    lamp(scene, v(-0.2, 0.8, -0.2), DVec3::X * 0.4, DVec3::Z * 0.4);
                });
                add("sphere inside, sky", &|scene| {
                    scene.shapes.push(Shape::lamp("ball", scenes::ball(v(0.4, 0.0, 0.0), 0.2), v(3.0, 2.0, 1.0)));
                    scene.lights.push(Light::Constant { radiance: v(0.1, 0.2, 0.3) });
                });
            }
        }
    }
    for (seed, (name, scene)) in (100..).step_by(2).zip(cases) {
        let mut with = packed(&scene, seed);
        with.media[1].equiangular = 0.4;
        with.features.equiangular = true;
        check(&name, &with, &without_equiangular(packed(&scene, seed + 1)), 1024);
    }
}

#[test]
fn a_difference_is_noticed() {
    let mut scene = foggy(scenes::gray(0.3, 0.9, 0.5), true);
    lamp(&mut scene, v(-1.0, 1.5, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0);
    let right = packed(&scene, 1);
    let mut wrong = packed(&scene, 2);
    wrong.lights.iter_mut().for_each(|light| light.radiance *= 1.05);
    let (z, _) = differences(&right, &wrong, 1024);
    assert!(z.iter().all(|z| z.abs() > 6.0), "{z:?}");
}

/// Scenes in which light can also be found by chance.
fn found_by_chance() -> Vec<(&'static str, Scene)> {
    let mut scenes = vec![("gray box", scenes::gray_box()), ("nested media", scenes::nested_media())];
    let mut fog = foggy(scenes::gray(0.5, 0.9, 0.6), false);
    lamp(&mut fog, v(-1.0, 1.5, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0);
    fog.lights.push(Light::Constant { radiance: v(0.2, 0.4, 0.8) });
    scenes.push(("fog, lamp and sky", fog));
    // Light sampling leaves the darker parts of a map out: below half its mean where media scatter, below the mean where none does.
    for (name, albedo) in [("fog and map", 0.9), ("wall and map", 0.0)] {
        let mut scene = foggy(scenes::gray(0.5, albedo, 0.6), false);
        let bitmap = scenes::sky(8, 5, |x, y| v(0.6, 0.5, 0.4) * ((x + 3 * y) % 8 + 1) as f64);
        scene.lights.push(Light::Envmap { bitmap, scale: 0.5, to_world: DMat3::IDENTITY });
        scenes.push((name, scene));
    }
    scenes
}

#[test]
fn light_sampling_and_its_weights_change_no_expectation() {
    for (seed, (name, mut scene)) in (200..).step_by(10).zip(found_by_chance()) {
        scene.film = Film::new(16, 16);
        let with = packed(&scene, seed);
        let mut chance = without_equiangular(packed(&scene, seed + 1));
        chance.features.light_sampling = false;
        check(&format!("{name}: light sampling"), &with, &chance, 4096);
        let mut sampled = packed(&scene, seed + 2);
        sampled.features.mis = false;
        check(&format!("{name}: multiple importance sampling"), &with, &sampled, 4096);
    }
}

#[test]
fn roulette_changes_no_expectation() {
    for (seed, (name, mut scene)) in (300..).step_by(10).zip(found_by_chance()) {
        scene.film = Film::new(16, 16);
        let late = packed(
            &Scene { integrator: tyndall::scene::Integrator { rr_depth: 1000, ..scene.integrator }, ..scene.clone() },
            seed,
        );
        let early = packed(
            &Scene { integrator: tyndall::scene::Integrator { rr_depth: 1, ..scene.integrator }, ..scene.clone() },
            seed + 1,
        );
        check(&format!("{name}: roulette"), &late, &early, 1024);
    }
}

/// A box [low, high] as a boundary.
fn boundary(name: &str, low: DVec3, high: DVec3, scene: &mut Scene, medium: Medium) {
    let id = scene.add_medium(medium);
    let matrix = DMat4::from_translation((low + high) / 2.0) * DMat4::from_scale((high - low) / 2.0);
    scene.shapes.push(Shape::boundary(name, scenes::cuboid(matrix), id));
}

/// A view along an oblique ray, under two lights.
fn stage() -> Scene {
    let mut scene = Scene::new(Camera::look_at(v(0.7, 0.9, 3.0), v(0.0, 0.0, 0.0), DVec3::Y, 30.0), Film::new(16, 16));
    lamp(&mut scene, v(-1.0, 2.0, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0);
    scene.lights.push(Light::Constant { radiance: v(0.2, 0.4, 0.8) });
    scene
}

#[test]
fn a_medium_in_two_pieces_is_the_medium_in_one() {
    let medium = || Medium::new("medium", v(1.0, 2.0, 0.5), v(0.9, 0.5, 0.99), Phase::HenyeyGreenstein { g: 0.4 });
    let mut whole = stage();
    boundary("whole", v(-1.0, -1.0, -1.0), v(1.0, 1.0, 1.0), &mut whole, medium());
    // Both pieces share a face; either may be met first there.
    for order in [[(-1.0, 0.1), (0.1, 1.0)], [(0.1, 1.0), (-1.0, 0.1)]] {
        let mut halves = stage();
        for (low, high) in order {
            boundary("piece", v(-1.0, -1.0, low), v(1.0, 1.0, high), &mut halves, medium());
        }
        // The second piece is of the very same medium.
        halves.shapes.last_mut().expect("it has been added").boundary = halves.shapes[1].boundary;
        check("two pieces of one medium", &packed(&whole, 1), &packed(&halves, 2), 4096);
        let mut within = stage();
        boundary("vessel", v(-1.5, -1.0, -1.0), v(1.5, 1.0, 1.0), &mut within, scenes::gray(0.3, 0.5, 0.0));
        let mut split = within.clone();
        boundary("whole", v(-1.0, -1.0, -1.0), v(1.0, 1.0, 1.0), &mut within, medium());
        for (low, high) in order {
            boundary("piece", v(-1.0, -1.0, low), v(1.0, 1.0, high), &mut split, medium());
        }
        check("two pieces in a vessel, whose faces they share", &packed(&within, 3), &packed(&split, 4), 1024);
    }
}

#[test]
fn boundaries_that_coincide_are_the_innermost_one() {
    // A box within a box of the same size, or of vacuum: what is inside alone counts.
    for (name, inner) in [("a medium", scenes::gray(2.0, 0.8, 0.3)), ("vacuum", scenes::gray(0.0, 0.0, 0.0))] {
        let mut alone = stage();
        boundary("inner", v(-1.0, -1.0, -1.0), v(1.0, 1.0, 0.999), &mut alone, inner.clone());
        let mut both = stage();
        boundary("outer", v(-1.0, -1.0, -1.0), v(1.0, 1.0, 1.0), &mut both, scenes::gray(1e-3, 0.5, 0.0));
        boundary("inner", v(-1.0, -1.0, -1.0), v(1.0, 1.0, 0.999), &mut both, inner.clone());
        check(&format!("{name} in a box with which it shares five faces"), &packed(&alone, 1), &packed(&both, 2), 1024);
        both.shapes.swap(1, 2);
        check(&format!("{name}, the boxes in the other order"), &packed(&alone, 1), &packed(&both, 3), 1024);
    }
}

#[test]
fn a_boundary_without_a_change_is_no_boundary() {
    let mut fog = foggy(scenes::gray(0.5, 0.9, 0.6), true);
    lamp(&mut fog, v(-1.0, 1.5, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0);
    let mut crossed = fog.clone();
    let medium = crossed.camera.medium.expect("the fog");
    for radius in [0.3, 0.6] {
        crossed.shapes.push(Shape::boundary("ball", scenes::ball(DVec3::ZERO, radius), medium));
    }
    crossed.shapes.push(Shape::boundary("box", scenes::cuboid(DMat4::from_scale(DVec3::splat(0.5))), medium));
    check("boundaries between the same media", &packed(&fog, 1), &packed(&crossed, 2), 1024);
}

#[test]
fn a_lamp_in_pieces_is_the_lamp() {
    let mut whole = foggy(scenes::gray(0.5, 0.9, 0.6), false);
    let mut pieces = whole.clone();
    lamp(&mut whole, v(-1.0, 1.5, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0);
    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        lamp(&mut pieces, v(-1.0 + f64::from(i), 1.5, -1.0 + f64::from(j)), DVec3::X, DVec3::Z);
    }
    check("a lamp in four pieces", &packed(&whole, 1), &packed(&pieces, 2), 1024);
    // A glowing ball as an analytic sphere and as a mesh of the same area.
    let mut sphere = foggy(scenes::gray(0.5, 0.9, 0.6), false);
    let mut mesh = sphere.clone();
    sphere.shapes.push(Shape::lamp("ball", scenes::ball(v(1.5, 0.5, 0.0), 0.4), v(3.0, 2.0, 1.0)));
    let mut facets = scenes::icosphere(3);
    facets.positions.iter_mut().for_each(|p| *p = *p * 0.4 + v(1.5, 0.5, 0.0));
    mesh.shapes.push(Shape::lamp("ball", Geometry::Mesh(facets), v(3.0, 2.0, 1.0)));
    check("a glowing ball of facets", &packed(&sphere, 3), &packed(&mesh, 4), 2048);
}

#[test]
fn light_is_not_sampled_in_vain_behind_glass() {
    let mut scene = foggy(scenes::gray(0.1, 0.9, 0.0), true);
    lamp(&mut scene, v(-0.5, 1.5, -0.5), DVec3::X, DVec3::Z);
    let milk = scene.add_medium(Medium::new("milk", v(1.0, 2.0, 4.0), v(0.9, 0.95, 0.8), Phase::Isotropic));
    let mut ball = Shape::boundary("ball", scenes::ball(v(0.0, 0.2, 0.0), 0.6), milk);
    ball.bsdf = Bsdf::Dielectric {
        int_ior: 1.5,
        ext_ior: 1.0,
        specular_reflectance: DVec3::ONE.into(),
        specular_transmittance: DVec3::ONE.into(),
    };
    scene.shapes.push(ball);
    let sealed = packed(&scene, 1);
    assert!(sealed.features.sealed);
    let mut sampled = packed(&scene, 2);
    sampled.media.iter_mut().for_each(|medium| medium.grids &= !MEDIUM_SEALED);
    sampled.features.sealed = false;
    check("milk in glass", &sealed, &sampled, 8192);
    // Were a medium sealed that is not, chance would still find all light.
    let mut open = foggy(scenes::gray(0.3, 0.9, 0.5), true);
    lamp(&mut open, v(-2.0, 1.5, -2.0), DVec3::X * 4.0, DVec3::Z * 4.0);
    let mut mistaken = packed(&open, 3);
    mistaken.media[1].grids |= MEDIUM_SEALED;
    mistaken.features.sealed = true;
    check("open fog taken for sealed", &packed(&open, 4), &mistaken, 4096);
    // A point light in the milk, or anywhere, is found by sampling alone.
    scene.lights.push(Light::Point { position: v(0.0, 0.2, 0.0), intensity: DVec3::ONE });
    assert!(!packed(&scene, 1).features.sealed);
    scene.lights.clear();
    scene.shapes.push(Shape::lamp("inside", scenes::ball(v(0.0, 0.2, 0.0), 0.1), DVec3::ONE));
    assert!(!packed(&scene, 1).features.sealed);
}
