//! The Vulkan device: choosing it, compiling kernels for it, running them. The only place with `unsafe` code.

use std::path::PathBuf;

pub mod buffer;
pub mod device;
pub mod kernel;
mod pipeline;
mod prune;
pub mod renderer;
pub mod shader;

pub use device::{Device, DeviceChoice, DeviceDescription, devices};
pub use renderer::Renderer;

/// What can go wrong with a device.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The Vulkan loader is missing or unusable.
    #[error("no Vulkan loader: {0} (on Debian and Ubuntu: apt install libvulkan1 mesa-vulkan-drivers)")]
    NoLoader(String),
    /// Nothing to render on.
    #[error("no usable Vulkan device{0} (`tyndall devices` lists all; --device reference renders on the CPU)")]
    NoDevice(String),
    /// A call to Vulkan failed.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// Which call.
        call: &'static str,
        /// Vulkan's answer.
        result: ash::vk::Result,
    },
    /// No memory for a buffer.
    #[error("no device memory for {name} ({size} bytes): {cause}")]
    Memory {
        /// What it is for.
        name: String,
        /// Bytes.
        size: u64,
        /// The allocator's answer.
        cause: String,
    },
    /// A buffer that the device cannot bind.
    #[error(
        "{name} take {size} bytes, more than the {limit} that this device can bind: a smaller grid of voxels or image fits, and a \
         device whose buffers have addresses has no such limit"
    )]
    TooLarge {
        /// What it is for.
        name: String,
        /// Bytes.
        size: u64,
        /// The device's limit.
        limit: u64,
    },
    /// A kernel does not compile.
    #[error("{name}: {log}")]
    Shader {
        /// The kernel.
        name: String,
        /// The compiler's messages, with file and line.
        log: String,
    },
    /// A kernel includes a file that does not exist.
    #[error("{file}:{line}: no shader file \"{include}\"")]
    Include {
        /// Who includes.
        file: String,
        /// Where.
        line: usize,
        /// What.
        include: String,
    },
    /// The cache of compiled kernels cannot be written.
    #[error("{path}: {cause}")]
    Cache {
        /// Which file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
}

/// Names the call in the error of a Vulkan result.
pub(crate) fn check<T>(call: &'static str, result: Result<T, ash::vk::Result>) -> Result<T, Error> {
    result.map_err(|result| Error::Vulkan { call, result })
}
