//! A kernel and how to run it.

use super::buffer::Buffer;
use super::pipeline::Pipeline;
use super::{Device, Error, check};
use ash::vk;
use std::sync::Arc;

/// A compiled kernel with `buffer_count` storage buffers at the bindings 0, 1, … of set 0, and push constants.
pub struct Kernel {
    // Dropped before the device.
    pipeline: Arc<Pipeline>,
    device: Arc<Device>,
    pool: vk::DescriptorPool,
    set: vk::DescriptorSet,
    commands: vk::CommandPool,
    command: vk::CommandBuffer,
    fence: vk::Fence,
    buffer_count: u32,
}

impl Kernel {
    /// Makes the kernel, with a pipeline that the device still has or a new one. Drivers may put off its compilation to the first dispatch.
    pub fn new(device: &Arc<Device>, code: &[u32], buffer_count: u32, push_size: u32) -> Result<Kernel, Error> {
        // Handles are null until they are made, and destroying a null handle does nothing, so a failure half way leaks nothing.
        let mut kernel = Kernel {
            pipeline: device.pipelines.get(&device.raw, code, buffer_count, push_size)?,
            device: device.clone(),
            pool: vk::DescriptorPool::null(),
            set: vk::DescriptorSet::null(),
            commands: vk::CommandPool::null(),
            command: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            buffer_count,
        };
        kernel.make_descriptors()?;
        kernel.make_commands()?;
        Ok(kernel)
    }

    fn make_descriptors(&mut self) -> Result<(), Error> {
        let raw = &self.device.raw;
        let sizes = [vk::DescriptorPoolSize::default()
            .ty(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(self.buffer_count.max(1))];
        let pool_info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: here and below, the structures outlive the calls and the handles belong to this device.
        self.pool = check("vkCreateDescriptorPool", unsafe { raw.create_descriptor_pool(&pool_info, None) })?;
        let layouts = [self.pipeline.set_layout];
        let set_info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pool).set_layouts(&layouts);
        // SAFETY: as above.
        self.set = check("vkAllocateDescriptorSets", unsafe { raw.allocate_descriptor_sets(&set_info) })?[0];
        Ok(())
    }

    fn make_commands(&mut self) -> Result<(), Error> {
        let raw = &self.device.raw;
        let pool_info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER)
            .queue_family_index(self.device.queue_family);
        // SAFETY: as above.
        self.commands = check("vkCreateCommandPool", unsafe { raw.create_command_pool(&pool_info, None) })?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.commands).command_buffer_count(1);
        // SAFETY: as above.
        self.command = check("vkAllocateCommandBuffers", unsafe { raw.allocate_command_buffers(&info) })?[0];
        // SAFETY: as above.
        self.fence = check("vkCreateFence", unsafe { raw.create_fence(&vk::FenceCreateInfo::default(), None) })?;
        Ok(())
    }

    /// Runs `groups` workgroups on these buffers and waits for the end.
    pub fn dispatch(&mut self, buffers: &[&Buffer], push: &[u8], groups: u32) -> Result<(), Error> {
        assert_eq!(buffers.len(), self.buffer_count as usize, "the kernel's bindings");
        let raw = &self.device.raw;
        let infos: Vec<[vk::DescriptorBufferInfo; 1]> = buffers
            .iter()
            .map(|buffer| {
                // What is larger is read by address.
                let range =
                    if buffer.size() > self.device.max_binding { self.device.max_binding } else { vk::WHOLE_SIZE };
                [vk::DescriptorBufferInfo::default().buffer(buffer.raw()).range(range)]
            })
            .collect();
        let writes: Vec<vk::WriteDescriptorSet> = (0..)
            .zip(&infos)
            .map(|(binding, info)| {
                vk::WriteDescriptorSet::default()
                    .dst_set(self.set)
                    .dst_binding(binding)
                    .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                    .buffer_info(info)
            })
            .collect();
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        let done = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::SHADER_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ | vk::AccessFlags::SHADER_READ)];
        let commands = [self.command];
        let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
        // SAFETY: nothing else uses this kernel's set, commands and fence (`&mut self`), the last dispatch has ended, the buffers
        // live to the end of this one, and the queue is locked while work is handed to it.
        unsafe {
            raw.update_descriptor_sets(&writes, &[]);
            check("vkBeginCommandBuffer", raw.begin_command_buffer(self.command, &begin))?;
            raw.cmd_bind_pipeline(self.command, vk::PipelineBindPoint::COMPUTE, self.pipeline.pipeline);
            raw.cmd_bind_descriptor_sets(
                self.command,
                vk::PipelineBindPoint::COMPUTE,
                self.pipeline.layout,
                0,
                &[self.set],
                &[],
            );
            if !push.is_empty() {
                raw.cmd_push_constants(self.command, self.pipeline.layout, vk::ShaderStageFlags::COMPUTE, 0, push);
            }
            raw.cmd_dispatch(self.command, groups, 1, 1);
            raw.cmd_pipeline_barrier(
                self.command,
                vk::PipelineStageFlags::COMPUTE_SHADER,
                vk::PipelineStageFlags::HOST | vk::PipelineStageFlags::COMPUTE_SHADER,
                vk::DependencyFlags::empty(),
                &done,
                &[],
                &[],
            );
            check("vkEndCommandBuffer", raw.end_command_buffer(self.command))?;
            check("vkResetFences", raw.reset_fences(&[self.fence]))?;
            check("vkQueueSubmit", raw.queue_submit(*self.device.queue(), &submit, self.fence))?;
            check("vkWaitForFences", raw.wait_for_fences(&[self.fence], true, u64::MAX))
        }
    }
}

impl Drop for Kernel {
    fn drop(&mut self) {
        let raw = &self.device.raw;
        // SAFETY: each dispatch waits for its end, so nothing is in use.
        unsafe {
            raw.destroy_fence(self.fence, None);
            raw.destroy_command_pool(self.commands, None);
            raw.destroy_descriptor_pool(self.pool, None);
        }
    }
}
