//! More samples where there is noise: the kernels against the reference, and that it changes no expectation.

mod common;

use common::images::{self, Image};
use common::scenes::{self, pack, v};
use common::statistics::mean_and_error;
use common::{device, images::average};
use glam::DVec3;
use std::ops::Range;
use tyndall::pack::Packed;
use tyndall::render::film::Film;
use tyndall::render::{Backend, Block, reconstruct};
use tyndall::scene::{self, Light, ReconstructionFilter, Scene, Shape};
use tyndall::seen::{Seen, with_seen};
use tyndall::{gpu, pilot, reference};

/// No multiples of a tile's side.
const WIDTH: u32 = 45;
const HEIGHT: u32 = 37;
const TRIAL: u32 = 2;

/// A cloud before a sky and a lamp, whose pixels share their paths or do not, and one with a filter.
fn cases() -> Vec<(&'static str, Scene, Packed)> {
    let mut cloud = Scene::new(scenes::camera(4.0), scene::Film::new(WIDTH, HEIGHT));
    let mist = cloud.add_medium(scenes::gray(3.0, 0.8, 0.5));
    cloud.shapes.push(Shape::boundary("mist", scenes::ball(v(-0.3, 0.2, 0.0), 0.6), mist));
    let quad = scenes::quad(v(0.6, -0.9, 0.0), DVec3::X * 0.3, DVec3::Y * 0.3);
    cloud.shapes.push(Shape::lamp("lamp", quad, v(3.0, 2.0, 1.0)));
    cloud.lights.push(Light::Constant { radiance: v(0.5, 0.7, 0.9) });
    let mut wide = cloud.clone();
    wide.film.filter = ReconstructionFilter::Gaussian { stddev: 0.5 };
    let scenes = [("a cloud", cloud.clone(), 0), ("a shared cloud", cloud, 8), ("a filter", wide, 4)];
    let cases = scenes.map(|(name, mut scene, sharers)| {
        scene.film = scene::Film { filter: scene.film.filter, ..scene::Film::new(WIDTH, HEIGHT) };
        let mut packed = pack(&scene, 3);
        pilot::run(&mut packed, false);
        packed.features.sharers = sharers;
        (name, scene, packed)
    });
    cases.into()
}

fn on_device(packed: &Packed) -> gpu::Renderer {
    gpu::Renderer::new(device(), packed).expect("the kernels compile")
}

fn render(backend: &mut dyn Backend, trial: u32, samples: Range<u32>) -> Vec<Block> {
    backend.allocate(trial).expect("it renders");
    backend.render(samples).expect("it renders")
}

/// The image, and the samples of each pixel.
fn film(blocks: &[Block]) -> (Image, Vec<u32>) {
    let mut film = Film::new(blocks[0].sums.len(), 0);
    for block in blocks {
        assert_eq!(block.invalid, [0; 3], "samples of block {} are invalid", block.first);
        film.add(block);
    }
    (film.mean().into_iter().map(DVec3::from).collect(), film.counts().to_vec())
}

#[test]
fn device_and_reference_share_out_samples_alike() {
    for (name, _, packed) in cases() {
        let (device, counts) = film(&render(&mut on_device(&packed), TRIAL, 0..16));
        let (reference, by_reference) = film(&render(&mut reference::Renderer::new(packed), TRIAL, 0..16));
        assert!(counts.iter().min() < counts.iter().max(), "{name}: some pixels get more samples");
        // A tile whose noise lies between two levels may get either one.
        let alike: Vec<usize> = (0..counts.len()).filter(|&pixel| counts[pixel] == by_reference[pixel]).collect();
        assert!(alike.len() * 20 > counts.len() * 19, "{name}: {} of {} pixels are alike", alike.len(), counts.len());
        let of = |image: &Image| alike.iter().map(|&pixel| image[pixel]).collect::<Image>();
        images::compare(&of(&device), &of(&reference)).unwrap_or_else(|why| panic!("{name}: {why}"));
        // The planted fault: the mean over the samples that were asked for.
        let wrong: Image = device.iter().zip(&counts).map(|(pixel, count)| *pixel * f64::from(*count) / 16.0).collect();
        assert!(images::compare(&of(&wrong), &of(&reference)).is_err(), "{name}");
    }
}

#[test]
fn there_are_as_many_samples_as_were_asked_for() {
    for (name, _, packed) in cases() {
        let (_, counts) = film(&render(&mut on_device(&packed), TRIAL, 0..32));
        let mean = counts.iter().sum::<u32>() as f64 / counts.len() as f64;
        assert!((27.0..=32.8).contains(&mean), "{name}: {mean} samples on average");
        // And again all alike.
        let (_, counts) = film(&render(&mut on_device(&packed), 0, 0..32));
        assert!(counts.iter().all(|&count| count == 32), "{name}");
    }
}

#[test]
fn the_cut_and_what_was_before_change_no_bit() {
    for (name, _, packed) in cases() {
        let mut device = on_device(&packed);
        let whole = render(&mut device, TRIAL, 0..44);
        let mut parts = render(&mut device, TRIAL, 0..16);
        parts.extend(device.render(16..44).expect("it renders"));
        assert!(whole == parts, "{name}: the cut shows");
        let uniform = render(&mut device, 0, 0..44);
        assert!(
            uniform == on_device(&packed).render(0..44).expect("it renders"),
            "{name}: an earlier allocation shows"
        );
        assert!(uniform != whole, "{name}: the comparison sees an allocation");
    }
}

#[test]
fn the_expectation_stays() {
    for (name, scene, packed) in cases() {
        let mut seen_packed = packed.clone();
        let seen = Seen::find(&mut seen_packed);
        let mut differences = Vec::new();
        let uniform = average(&images::on_device(&packed, 2048));
        for seed in 100..124 {
            let mut packed = seen_packed.clone();
            packed.params.seed = seed;
            let mut backend = with_seen(on_device(&packed), seen.clone());
            let mut film = Film::new(packed.pixel_count(), 0);
            render(&mut *backend, TRIAL, 0..32).iter().for_each(|block| film.add(block));
            let image: Image = reconstruct::image(&film, scene.film.width).into_iter().map(DVec3::from).collect();
            differences.push((average(&image) - uniform).element_sum() / uniform.element_sum());
        }
        let (mean, error) = mean_and_error(&differences);
        eprintln!("{name}: {mean:.5} ± {error:.5}");
        // The mean over all pixels of 2048 samples is better known than that of 24 times 32.
        assert!(mean.abs() < 4.0 * error && error < 4e-3, "{name}: {mean} ± {error}");
        assert!((mean + 0.02).abs() > 4.0 * error, "{name}: 2 % would be seen");
    }
}
