//! Storage buffers.

use super::{Device, Error, check};
use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

/// A buffer of values of one type in memory that host and device share.
pub struct Buffer {
    device: Arc<Device>,
    raw: vk::Buffer,
    allocation: Option<Allocation>,
    size: u64,
    name: String,
}

impl Buffer {
    /// A buffer with these values. An empty table gets one zeroed entry: Vulkan has no empty buffers.
    pub fn new<T: Pod>(device: &Arc<Device>, name: &str, values: &[T]) -> Result<Buffer, Error> {
        let mut buffer = Buffer::zeroed::<T>(device, name, values.len())?;
        buffer.write(values);
        Ok(buffer)
    }

    /// A buffer for `count` values, all bits 0.
    pub fn zeroed<T: Pod>(device: &Arc<Device>, name: &str, count: usize) -> Result<Buffer, Error> {
        let size = (count.max(1) * size_of::<T>()) as u64;
        let mut usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        if device.buffer_reference {
            usage |= vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        }
        let info = vk::BufferCreateInfo::default().size(size).usage(usage).sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: the structure outlives the call.
        let raw = check("vkCreateBuffer", unsafe { device.raw.create_buffer(&info, None) })?;
        // From here on, dropping the buffer cleans up.
        let mut buffer = Buffer { device: device.clone(), raw, allocation: None, size, name: name.to_owned() };
        // SAFETY: the buffer is valid.
        let requirements = unsafe { device.raw.get_buffer_memory_requirements(raw) };
        let allocation = device
            .allocator()
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                // Host visible; gpu-allocator prefers memory that is also fast for the device.
                location: MemoryLocation::CpuToGpu,
                linear: true,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|cause| Error::Memory { name: name.to_owned(), size, cause: cause.to_string() })?;
        // SAFETY: the memory was made for this buffer.
        check("vkBindBufferMemory", unsafe {
            device.raw.bind_buffer_memory(raw, allocation.memory(), allocation.offset())
        })?;
        buffer.allocation = Some(allocation);
        buffer.bytes_mut().fill(0);
        Ok(buffer)
    }

    /// Overwrites the first values.
    pub fn write<T: Pod>(&mut self, values: &[T]) {
        self.write_behind(0, values);
    }

    /// Overwrites the values behind the first so many bytes.
    pub fn write_behind<T: Pod>(&mut self, first: usize, values: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        self.bytes_mut()[first..first + bytes.len()].copy_from_slice(bytes);
    }

    /// The first `count` values.
    pub fn read<T: Pod>(&self, count: usize) -> Vec<T> {
        let bytes = self.allocation.as_ref().and_then(Allocation::mapped_slice).expect("the memory is host visible");
        bytemuck::pod_collect_to_vec(&bytes[..count * size_of::<T>()])
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        let bytes =
            self.allocation.as_mut().and_then(Allocation::mapped_slice_mut).expect("the memory is host visible");
        &mut bytes[..self.size as usize]
    }

    /// Bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// What it is for.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn raw(&self) -> vk::Buffer {
        self.raw
    }

    /// Where the device finds it. Only with [`Device::buffer_reference`].
    pub(crate) fn address(&self) -> vk::DeviceAddress {
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.raw);
        // SAFETY: the buffer was made with SHADER_DEVICE_ADDRESS where the device has the feature.
        unsafe { self.device.raw.get_buffer_device_address(&info) }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if let Some(allocation) = self.allocation.take()
            && let Err(error) = self.device.allocator().free(allocation)
        {
            tracing::warn!("{}: {error}", self.name);
        }
        // SAFETY: kernels wait for the end of each dispatch, so the device does not use the buffer.
        unsafe { self.device.raw.destroy_buffer(self.raw, None) };
    }
}
