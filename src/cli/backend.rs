//! The only place that knows which loaders and renderers there are.

use std::path::Path;

use tyndall::gpu::{self, Device, DeviceChoice, DeviceDescription};
use tyndall::pack::Packed;
use tyndall::reference;
use tyndall::render::{Backend, BackendError};
use tyndall::scene::Scene;
use tyndall::scene::mitsuba::{self, Loaded};
use tyndall::seen::{Seen, with_seen};
use tyndall::{guide, pilot};

use super::error::CliError;

/// Reads a scene file, with parameters set as in `overrides`.
pub fn load(path: &Path, overrides: &[(String, String)]) -> Result<Loaded, CliError> {
    mitsuba::load(path, overrides).map_err(|error| CliError::Scene(error.to_string()))
}

/// Opens the device that `choice` names ("auto" for the best one, a part of its name, its number in [`list`], or "reference"
/// for the CPU) and prepares it for the crop window of `scene`, after a pilot run if `with_pilot`, by which
/// pixels may share their paths if `sharing`. Warnings go to `warn`.
pub fn open(
    choice: &str,
    scene: &Scene,
    seed: u32,
    with_pilot: bool,
    sharing: bool,
    warn: &mut dyn FnMut(&str),
) -> Result<Box<dyn Backend>, CliError> {
    let mut packed = Packed::new(scene, seed).map_err(|error| CliError::Scene(error.to_string()))?;
    guide::run(&mut packed);
    let mut seen = None;
    if with_pilot {
        // Second moments are those of paths that belong to one pixel and bring all of its light.
        let moments = scene.moments.is_some();
        pilot::run(&mut packed, sharing && !moments);
        seen = if moments { None } else { Seen::find(&mut packed) };
    }
    packed.warnings.iter().for_each(|warning| warn(warning));
    if choice == "reference" {
        return Ok(with_seen(reference::Renderer::new(packed), seen));
    }
    let choice = match (choice, choice.parse()) {
        ("auto", _) => DeviceChoice::Best,
        (_, Ok(index)) => DeviceChoice::Index(index),
        (name, Err(_)) => DeviceChoice::Name(name.to_owned()),
    };
    let device = Device::open(&choice).map_err(device_error)?;
    Ok(with_seen(gpu::Renderer::new(&device, &packed).map_err(device_error)?, seen))
}

/// The tables of a scene, as [`open`] would upload them.
pub fn pack(scene: &Scene, seed: u32) -> Result<Packed, CliError> {
    Packed::new(scene, seed).map_err(|error| CliError::Scene(error.to_string()))
}

/// Bytes on the device and on the host that rendering takes beside the tables.
pub fn working_memory(crop: [u32; 2], sharers: u32) -> (u64, u64) {
    gpu::Renderer::working_memory(crop, sharers)
}

/// The Vulkan devices, in the order of their numbers. An empty list is not an error.
pub fn list() -> Result<Vec<DeviceDescription>, CliError> {
    gpu::devices().map_err(device_error)
}

fn device_error(error: gpu::Error) -> CliError {
    match error {
        gpu::Error::NoLoader(_) | gpu::Error::NoDevice(_) => CliError::NoDevice(error.to_string()),
        other => CliError::Backend(BackendError { device: "the device".to_owned(), cause: other.to_string() }),
    }
}
