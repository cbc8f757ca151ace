//! Choosing a device and opening it.

use super::pipeline::Pipelines;
use super::{Error, check};
use crate::render::DeviceInfo;
use ash::{Entry, Instance, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::ffi::CStr;
use std::mem::ManuallyDrop;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Oldest lavapipe that compiles the kernels right: Mesa 22.3 renders wrong images.
const OLDEST_LAVAPIPE: u32 = 24;

/// Which device to render on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceChoice {
    /// A discrete GPU, else an integrated one, else any other, else a CPU.
    Best,
    /// By its number in the list of [`devices`].
    Index(usize),
    /// By a part of its name, in any case.
    Name(String),
}

/// One device of the system.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceDescription {
    /// Name and driver.
    pub info: DeviceInfo,
    /// "discrete GPU", "CPU", …
    pub kind: &'static str,
    /// Why it cannot be used, if so.
    pub unusable: Option<String>,
}

struct Loader {
    _entry: Entry,
    instance: Instance,
}

/// The loader lives as long as the process: devices of several renders and tests share it.
fn loader() -> Result<&'static Loader, Error> {
    static LOADER: OnceLock<Result<Loader, String>> = OnceLock::new();
    LOADER
        .get_or_init(|| open_loader().map_err(|error| error.to_string()))
        .as_ref()
        .map_err(|cause| Error::NoLoader(cause.clone()))
}

/// Tells lavapipe to use the widest vectors that the processor has. Mesa keeps compiled kernels in a cache whose key does not
/// hold the width, so each width gets a folder. Settings that the user made stay.
fn prepare_lavapipe() {
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx512f") && std::env::var_os("LP_NATIVE_VECTOR_WIDTH").is_none() {
        // SAFETY: called once, before the loader is opened, so before any driver reads the environment.
        unsafe { std::env::set_var("LP_NATIVE_VECTOR_WIDTH", "512") };
        if let (None, Some(cache)) = (std::env::var_os("MESA_SHADER_CACHE_DIR"), super::shader::cache_folder()) {
            // SAFETY: as above.
            unsafe { std::env::set_var("MESA_SHADER_CACHE_DIR", cache.join("mesa-512")) };
        }
    }
}

fn open_loader() -> Result<Loader, Error> {
    prepare_lavapipe();
    // SAFETY: the loader is the system's Vulkan library, and it is never closed.
    let entry = unsafe { Entry::load() }.map_err(|error| Error::NoLoader(error.to_string()))?;
    let application = vk::ApplicationInfo::default().application_name(c"tyndall").api_version(vk::API_VERSION_1_2);
    let layers: Vec<*const i8> = validation_layer(&entry).map(CStr::as_ptr).into_iter().collect();
    let info = vk::InstanceCreateInfo::default().application_info(&application).enabled_layer_names(&layers);
    // SAFETY: the structures outlive the call.
    let instance = check("vkCreateInstance", unsafe { entry.create_instance(&info, None) })?;
    Ok(Loader { _entry: entry, instance })
}

/// The validation layer, where `TYNDALL_VALIDATE` asks for it and it is installed. Its messages go to standard output.
fn validation_layer(entry: &Entry) -> Option<&'static CStr> {
    let name = c"VK_LAYER_KHRONOS_validation";
    std::env::var_os("TYNDALL_VALIDATE")?;
    // SAFETY: only queries.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }.ok()?;
    layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(name)).then_some(name)
}

struct Candidate {
    physical: vk::PhysicalDevice,
    description: DeviceDescription,
    rank: u32,
    queue_family: u32,
}

fn candidates(loader: &Loader) -> Result<Vec<Candidate>, Error> {
    // SAFETY: only queries of a valid instance.
    let physical = check("vkEnumeratePhysicalDevices", unsafe { loader.instance.enumerate_physical_devices() })?;
    Ok(physical.into_iter().map(|device| describe(loader, device)).collect())
}

fn describe(loader: &Loader, physical: vk::PhysicalDevice) -> Candidate {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut subgroups = vk::PhysicalDeviceSubgroupProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut subgroups);
    // SAFETY: only queries; a device older than 1.2 leaves structures that it does not know as they are.
    unsafe { loader.instance.get_physical_device_properties2(physical, &mut properties) };
    let properties = properties.properties;
    // SAFETY: only a query.
    let families = unsafe { loader.instance.get_physical_device_queue_family_properties(physical) };
    let queue_family = families.iter().position(|family| family.queue_flags.contains(vk::QueueFlags::COMPUTE));
    let text = |value: Result<&CStr, std::ffi::FromBytesUntilNulError>| {
        value.map(|text| text.to_string_lossy().into_owned()).unwrap_or_default()
    };
    let driver_text = format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str()));
    let (kind, rank) = match properties.device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => ("discrete GPU", 0),
        vk::PhysicalDeviceType::INTEGRATED_GPU => ("integrated GPU", 1),
        vk::PhysicalDeviceType::VIRTUAL_GPU => ("virtual GPU", 2),
        vk::PhysicalDeviceType::CPU => ("CPU", 4),
        _ => ("other", 3),
    };
    let mesa = mesa_major(&driver_text);
    let unusable = if properties.api_version < vk::API_VERSION_1_2 {
        let version = properties.api_version;
        Some(format!("Vulkan {}.{}, 1.2 is needed", vk::api_version_major(version), vk::api_version_minor(version)))
    } else if queue_family.is_none() {
        Some("no compute queue".to_owned())
    } else if !subgroups.supported_operations.contains(vk::SubgroupFeatureFlags::ARITHMETIC) {
        Some("no arithmetic across subgroups".to_owned())
    } else if driver.driver_id == vk::DriverId::MESA_LLVMPIPE && mesa.is_some_and(|major| major < OLDEST_LAVAPIPE) {
        Some(format!("this lavapipe renders wrong images, Mesa {OLDEST_LAVAPIPE} or newer is needed"))
    } else {
        None
    };
    Candidate {
        physical,
        description: DeviceDescription {
            info: DeviceInfo { name: text(properties.device_name_as_c_str()), driver: driver_text },
            kind,
            unusable,
        },
        rank,
        queue_family: queue_family.unwrap_or(0) as u32,
    }
}

/// The major version in a driver's "… Mesa 25.0.7 …".
fn mesa_major(driver: &str) -> Option<u32> {
    let version = driver.split("Mesa ").nth(1)?;
    version.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// All devices of the system, usable or not.
pub fn devices() -> Result<Vec<DeviceDescription>, Error> {
    Ok(candidates(loader()?)?.into_iter().map(|candidate| candidate.description).collect())
}

/// An open device with one compute queue. Kernels and buffers share it.
pub struct Device {
    pub(crate) raw: ash::Device,
    allocator: ManuallyDrop<Mutex<Allocator>>,
    queue: Mutex<vk::Queue>,
    pub(crate) pipelines: Pipelines,
    pub(crate) queue_family: u32,
    /// Name and driver.
    pub info: DeviceInfo,
    /// Invocations that run in step; workgroups have this size.
    pub subgroup_size: u32,
    /// Buffers have addresses that kernels can use, and kernels know words of 64 bits.
    pub buffer_reference: bool,
    /// Host memory and device memory are one.
    pub is_cpu: bool,
    /// Bytes of a buffer that a kernel can reach through a descriptor; by address there is no limit.
    pub max_binding: u64,
}

impl Device {
    /// Opens the device that is chosen.
    pub fn open(choice: &DeviceChoice) -> Result<Arc<Device>, Error> {
        let loader = loader()?;
        let candidate = select(candidates(loader)?, choice)?;
        let mut subgroups = vk::PhysicalDeviceSubgroupProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut subgroups);
        let mut supported = vk::PhysicalDeviceVulkan12Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut supported);
        // SAFETY: only queries; the device knows Vulkan 1.2.
        unsafe {
            loader.instance.get_physical_device_properties2(candidate.physical, &mut properties);
            loader.instance.get_physical_device_features2(candidate.physical, &mut features);
        }
        let is_cpu = properties.properties.device_type == vk::PhysicalDeviceType::CPU;
        let max_binding = u64::from(properties.properties.limits.max_storage_buffer_range);
        let int64 = features.features.shader_int64;
        let buffer_reference = supported.buffer_device_address == vk::TRUE && int64 == vk::TRUE;
        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(candidate.queue_family)
            .queue_priorities(&priorities)];
        let mut wanted = vk::PhysicalDeviceVulkan12Features::default().buffer_device_address(buffer_reference);
        let basic = vk::PhysicalDeviceFeatures::default().shader_int64(buffer_reference);
        let info =
            vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_features(&basic).push_next(&mut wanted);
        // SAFETY: the structures outlive the call, and only supported features are asked for.
        let raw = check("vkCreateDevice", unsafe { loader.instance.create_device(candidate.physical, &info, None) })?;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: loader.instance.clone(),
            device: raw.clone(),
            physical_device: candidate.physical,
            debug_settings: Default::default(),
            buffer_device_address: buffer_reference,
            allocation_sizes: Default::default(),
        })
        .map_err(|cause| Error::Memory {
            name: "the allocator".to_owned(),
            size: 0,
            cause: cause.to_string(),
        })?;
        // SAFETY: the queue was asked for above.
        let queue = unsafe { raw.get_device_queue(candidate.queue_family, 0) };
        Ok(Arc::new(Device {
            raw,
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            queue: Mutex::new(queue),
            pipelines: Pipelines::default(),
            queue_family: candidate.queue_family,
            info: candidate.description.info,
            subgroup_size: subgroups.subgroup_size.clamp(8, 128),
            buffer_reference,
            is_cpu,
            max_binding,
        }))
    }

    pub(crate) fn allocator(&self) -> MutexGuard<'_, Allocator> {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn queue(&self) -> MutexGuard<'_, vk::Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: buffers and kernels hold the device by Arc, so nothing of it is in use; pipelines and the allocator go before the device.
        unsafe {
            let _ = self.raw.device_wait_idle();
            self.pipelines.clear();
            ManuallyDrop::drop(&mut self.allocator);
            self.raw.destroy_device(None);
        }
    }
}

fn select(candidates: Vec<Candidate>, choice: &DeviceChoice) -> Result<Candidate, Error> {
    let chosen = match choice {
        DeviceChoice::Best => {
            let usable = candidates.into_iter().filter(|candidate| candidate.description.unusable.is_none());
            return usable.min_by_key(|candidate| candidate.rank).ok_or(Error::NoDevice(String::new()));
        }
        DeviceChoice::Index(index) => candidates.into_iter().nth(*index),
        DeviceChoice::Name(part) => {
            let part = part.to_lowercase();
            candidates.into_iter().find(|candidate| candidate.description.info.name.to_lowercase().contains(&part))
        }
    };
    let asked = match choice {
        DeviceChoice::Index(index) => format!(" number {index}"),
        DeviceChoice::Name(name) => format!(" named \"{name}\""),
        DeviceChoice::Best => String::new(),
    };
    let chosen = chosen.ok_or_else(|| Error::NoDevice(asked.clone()))?;
    match &chosen.description.unusable {
        Some(reason) => Err(Error::NoDevice(format!("{asked}: {}: {reason}", chosen.description.info.name))),
        None => Ok(chosen),
    }
}
