//! Images of tiny scenes, and how far two are apart.

use super::device;
use glam::DVec3;
use tyndall::gpu;
use tyndall::gpu::shader::Variant;
use tyndall::pack::Packed;
use tyndall::reference;
use tyndall::render::film::Film;
use tyndall::render::{Backend, Block, reconstruct};

/// Mean radiance of each pixel.
pub type Image = Vec<DVec3>;

/// Mean over the samples of all blocks. Samples that are not valid fail the test.
pub fn mean(blocks: &[Block]) -> Image {
    let samples: u32 = blocks.iter().map(|block| block.count).sum();
    let mut image = vec![DVec3::ZERO; blocks[0].sums.len()];
    for block in blocks {
        assert_eq!(block.invalid, [0; 3], "samples of block {} are invalid", block.first);
        for (pixel, sum) in image.iter_mut().zip(&block.sums) {
            *pixel += DVec3::from_array(sum.map(f64::from)) / f64::from(samples);
        }
    }
    image
}

/// As the program renders it.
pub fn on_device(packed: &Packed, spp: u32) -> Image {
    let mut renderer = gpu::Renderer::new(device(), packed).expect("the kernels compile");
    mean(&renderer.render(0..spp).expect("it renders"))
}

/// As the program renders it, with what pixels share put together as a whole.
pub fn reconstructed(packed: &Packed, width: u32, spp: u32) -> Image {
    let mut renderer = gpu::Renderer::new(device(), packed).expect("the kernels compile");
    let mut film = Film::new(packed.pixel_count(), 0);
    for block in renderer.render(0..spp).expect("it renders") {
        assert_eq!(block.invalid, [0; 3], "samples of block {} are invalid", block.first);
        film.add(&block);
    }
    assert!(film.shared().is_some(), "the pixels share paths");
    reconstruct::image(&film, width).into_iter().map(DVec3::from).collect()
}

/// With a kernel in another form.
pub fn with_variant(packed: &Packed, spp: u32, variant: &Variant) -> Vec<Block> {
    let mut renderer = gpu::Renderer::with_variant(device(), packed, variant).expect("the kernels compile");
    renderer.render(0..spp).expect("it renders")
}

/// By the reference.
pub fn by_reference(packed: &Packed, spp: u32) -> Image {
    mean(&reference::Renderer::new(packed.clone()).render(0..spp).expect("it renders"))
}

/// Mean over all pixels.
pub fn average(image: &Image) -> DVec3 {
    image.iter().sum::<DVec3>() / image.len() as f64
}

/// Why two images of the same paths are not the same, if so: a share of at least 98 % of the pixels must agree to a
/// relative 1e-3, and the means to 5e-3 (paths on which rounding turned a decision are independent samples).
pub fn compare(one: &Image, two: &Image) -> Result<f64, String> {
    let agrees = |(a, b): (&DVec3, &DVec3)| (*a - *b).abs().cmple(a.abs().max(b.abs()) * 1e-3 + 1e-9).all();
    let share = one.iter().zip(two).filter(|pair| agrees(*pair)).count() as f64 / one.len() as f64;
    if share < 0.98 {
        return Err(format!("only {:.2} % of the pixels agree", share * 100.0));
    }
    let (a, b) = (average(one), average(two));
    if (a - b).abs().cmpgt(a.max(b) * 5e-3).any() {
        return Err(format!("the means are {a} and {b}"));
    }
    Ok(share)
}

/// Independent estimates of what all pixels of a scene have in common: the pixels, dealt out to 64 batches. Each pixel has its own
/// random shift of the sampler's points, while two samples of a pixel may share one and are no independent estimates.
pub fn batches(scene: &tyndall::scene::Scene, seed: u32, spp: u32) -> Vec<DVec3> {
    batches_of(&super::scenes::pack(scene, seed), spp)
}

/// The same, of a scene's tables.
pub fn batches_of(packed: &Packed, spp: u32) -> Vec<DVec3> {
    let image = on_device(packed, spp);
    assert!(image.len().is_multiple_of(BATCHES) && image.len() > BATCHES, "each batch has as many pixels");
    let pixels = (image.len() / BATCHES) as f64;
    (0..BATCHES).map(|first| image.iter().skip(first).step_by(BATCHES).sum::<DVec3>() / pixels).collect()
}

/// How many estimates [`batches`] returns.
pub const BATCHES: usize = 64;
