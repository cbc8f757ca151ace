//! The only place that knows which loaders and renderers there are.
//!
//! TEMPORARY: everything below stands in for `scene::mitsuba::load`, `pack`, `gpu` and `reference`, and is to be replaced
//! by calls of them. The signatures stay.

use std::ops::Range;
use std::path::Path;
use std::time::Duration;

use tyndall::render::{BLOCK_SAMPLES, Backend, BackendError, Block, DeviceInfo};
use tyndall::scene::{Camera, Film, Scene};

use super::error::CliError;

/// A scene, and what its file said that is not followed.
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// For the user.
    pub warnings: Vec<String>,
}

/// Reads a scene file, with parameters set as in `overrides`.
pub fn load(path: &Path, _overrides: &[(String, String)]) -> Result<Loaded, CliError> {
    let scene_error = |cause: String| CliError::Scene(format!("{}: {cause}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| scene_error(error.to_string()))?;
    if !text.contains("</scene>") {
        return Err(scene_error("not a scene".to_owned()));
    }
    let camera = Camera::look_at(glam::DVec3::Z, glam::DVec3::ZERO, glam::DVec3::Y, 40.0);
    let scene = Scene { sample_count: 4, ..Scene::new(camera, Film::new(16, 16)) };
    Ok(Loaded { scene, warnings: Vec::new() })
}

/// Opens the device that `choice` names ("auto" for the first usable one, a part of its name, its number in [`list`], or
/// "reference" for the CPU) and prepares it for the crop window of `scene` and for samples `0..spp`.
pub fn open(choice: &str, scene: &Scene, seed: u32, _spp: u32) -> Result<Box<dyn Backend>, CliError> {
    if !["auto", "0", "reference"].contains(&choice) {
        return Err(CliError::NoDevice(format!("no device is called {choice}; see `tyndall devices`")));
    }
    let info = DeviceInfo { name: "stand-in".to_owned(), driver: "none".to_owned() };
    Ok(Box::new(StandIn { info, film: scene.film, seed }))
}

/// The Vulkan devices that can render, in the order of their numbers. An empty list is not an error.
pub fn list() -> Result<Vec<DeviceInfo>, CliError> {
    Ok(vec![DeviceInfo { name: "stand-in".to_owned(), driver: "none".to_owned() }])
}

struct StandIn {
    info: DeviceInfo,
    film: Film,
    seed: u32,
}

impl Backend for StandIn {
    fn device(&self) -> &DeviceInfo {
        &self.info
    }

    fn render(&mut self, samples: Range<u32>) -> Result<Vec<Block>, BackendError> {
        let crop = self.film.crop;
        let mut blocks = Vec::new();
        for first in samples.clone().step_by(BLOCK_SAMPLES as usize) {
            let count = BLOCK_SAMPLES.min(samples.end - first);
            let value = |index: u32| {
                let (x, y) = (crop.x + index % crop.width, crop.y + index / crop.width);
                let key = (y * 65536 + x) ^ self.seed.wrapping_mul(0x9e37_79b9) ^ first.wrapping_mul(0x85eb_ca6b);
                let hash = key.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
                (hash >> 8) as f32 / 16_777_216.0
            };
            let pixels = 0..crop.width * crop.height;
            let sums = pixels.clone().map(|i| [count as f32 * value(i); 3]).collect();
            let squares = pixels.map(|i| [count as f32 * value(i) * value(i) * 1.1; 3]).collect();
            blocks.push(Block { first, count, sums, squares, invalid: [0; 3] });
            let samples = u64::from(crop.width * crop.height * count);
            std::thread::sleep(Duration::from_nanos(200 * samples));
        }
        Ok(blocks)
    }
}
