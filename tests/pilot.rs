//! Roulette by a pilot: the kernel against the reference, and that the pilot changes no expectation, whatever it says.

mod common;

use common::random::Random;
use common::statistics::mean_and_error;
use common::tolerances::comparison;
use common::units::{run, vec4, widen};
use common::{images, scenes};
use glam::DVec3;
use tyndall::pack::Packed;
use tyndall::pilot;
use tyndall::reference::outlook::{Outlook, keep_by_outlook, outlook_cell};
use tyndall::scene::{Film, Scene};

/// Large enough for a pilot.
const SIDE: u32 = 64;

/// With a pilot, which only scenes with a tree have.
fn piloted(scene: &Scene) -> Packed {
    let mut packed = scenes::pack(scene, 3).with_immediates(0);
    pilot::run(&mut packed, false);
    packed
}

fn large(mut scene: Scene) -> Scene {
    scene.film = Film::new(SIDE, SIDE);
    scene
}

/// Scenes with surfaces, media, both, and light from all over.
fn cases() -> Vec<(&'static str, Scene)> {
    let names = ["gray box", "nested media", "glow", "surfaces", "mixed phases"];
    let all = scenes::all().into_iter().filter(|(name, _)| names.contains(name));
    let cases: Vec<_> = all.map(|(name, scene)| (name, large(scene))).collect();
    assert_eq!(cases.len(), names.len());
    cases
}

#[test]
fn cells_and_probabilities_are_those_of_the_reference() {
    let mut random = Random(5);
    let mut inputs = Vec::new();
    for k in 0..2000 {
        let place = random.in_cube() * 10.0 + 6.0;
        let axis = random.direction();
        let [throughput, focus, worth] = [0, 1, 2].map(|_| random.in_cube().abs() * random.log_between(1e-3, 1e3));
        inputs.push(vec4(&[place.x, place.y, place.z, f64::from(k % 3) - 0.5]));
        inputs.extend([axis, throughput, focus, worth].map(|vector| vec4(&vector.to_array())));
    }
    let count = inputs.len() / 5;
    let outputs: Vec<[f32; 4]> = run("outlook", &inputs, &[], count, count);
    let mut keep = comparison("keep_by_outlook");
    let mut between = 0;
    for (input, output) in inputs.chunks(5).zip(&outputs) {
        let [place, axis, throughput, focus, worth] = [0, 1, 2, 3, 4].map(|k| widen(&input[k][..3]));
        assert_eq!(output[1].to_bits(), outlook_cell(place, input[0][3] > 0.0, axis), "{input:?}");
        let expected = keep_by_outlook(&Outlook { mean: DVec3::ZERO, worth }, throughput, focus);
        between += usize::from(expected > 0.3 && expected < 1.0);
        keep.scalar(format!("{input:?}"), output[0], expected);
    }
    assert!(between > 100, "{between} probabilities are not at an end");
    keep.finish();
}

#[test]
fn device_and_reference_follow_the_same_paths() {
    for (name, scene) in cases() {
        let packed = piloted(&scene);
        assert!(packed.features.pilot, "{name} has a pilot");
        let (device, reference) = (images::on_device(&packed, 4), images::by_reference(&packed, 4));
        let share = images::compare(&device, &reference).unwrap_or_else(|why| panic!("{name}: {why}"));
        eprintln!("{name}: {:.2} % of the pixels agree", share * 100.0);
    }
}

/// z-values of the mean difference of two images, and the largest relative standard error.
fn differences(one: &[DVec3], two: &[DVec3]) -> ([f64; 3], f64) {
    let brightness = one.iter().sum::<DVec3>() / one.len() as f64;
    let mut coarsest = 0.0f64;
    let z = std::array::from_fn(|channel| {
        let differences: Vec<f64> = one.iter().zip(two).map(|(a, b)| a[channel] - b[channel]).collect();
        let (mean, error) = mean_and_error(&differences);
        coarsest = coarsest.max(error / brightness[channel]);
        mean / error
    });
    (z, coarsest)
}

#[test]
fn a_pilot_changes_no_expectation_even_if_it_lies() {
    for (name, scene) in cases() {
        let truth = images::on_device(&scenes::pack(&scene, 4), 32);
        let honest = piloted(&scene);
        let mut liar = honest.clone();
        let (first, end) = (liar.params.first_cell as usize, liar.params.first_block as usize);
        for (index, cell) in liar.values[first..end].chunks_mut(8).enumerate().filter(|(_, cell)| cell[3] >= 0.0) {
            cell[..3].iter_mut().for_each(|mean| *mean *= (index % 3) as f32);
            cell[3..6].iter_mut().for_each(|worth| *worth *= 0.1);
        }
        assert!(liar.values != honest.values);
        for (kind, packed) in [("honest", honest), ("lying", liar)] {
            let image = images::on_device(&packed, 32);
            let (z, coarsest) = differences(&image, &truth);
            eprintln!("{name}, {kind}: z = {z:.2?}, standard errors below {:.2} %", coarsest * 100.0);
            assert!(z.iter().all(|z| z.abs() < 4.0), "{name}, {kind}: z = {z:?}");
            let brighter: Vec<DVec3> = image.iter().map(|pixel| *pixel * 1.05).collect();
            let (z, _) = differences(&brighter, &truth);
            assert!(z.iter().any(|z| z.abs() > 4.0), "{name}, {kind}: 5 % more would be seen, z = {z:?}");
        }
    }
}

#[test]
fn little_images_and_short_paths_have_no_pilot() {
    let mut little = scenes::gray_box();
    little.film = Film::new(16, 16);
    let mut short = large(scenes::gray_box());
    short.integrator.max_depth = Some(3);
    let mut black = large(scenes::gray_box());
    black.lights.clear();
    black.shapes.iter_mut().for_each(|shape| shape.emission = None);
    for (name, scene) in [("little", little), ("short", short), ("black", black)] {
        let packed = piloted(&scene);
        assert!(!packed.features.pilot && packed.values == scenes::pack(&scene, 3).values, "{name}");
    }
    let mut without_tree = scenes::pack(&large(scenes::gray_box()), 3);
    pilot::run(&mut without_tree, false);
    assert!(!without_tree.features.tree && !without_tree.features.pilot);
}
