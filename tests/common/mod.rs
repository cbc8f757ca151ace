//! What the tests share: the device, unit kernels, tiny scenes, and images.

#![allow(dead_code, reason = "each test file uses a part of this")]

pub mod comparison;
pub mod fields;
pub mod images;
pub mod phases;
pub mod random;
pub mod scenes;
pub mod statistics;
pub mod surfaces;
pub mod tolerances;
pub mod trial;
pub mod truth;
pub mod units;
pub mod vdb_files;

use std::sync::{Arc, OnceLock};
use tyndall::gpu::{Device, DeviceChoice};

/// The device of all tests. Without one they fail.
pub fn device() -> &'static Arc<Device> {
    static DEVICE: OnceLock<Arc<Device>> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let device = Device::open(&DeviceChoice::Best).expect("the tests need a Vulkan device");
        eprintln!("device: {} ({})", device.info.name, device.info.driver);
        device
    })
}
