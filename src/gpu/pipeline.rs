//! Compute pipelines. A device keeps the last ones, since drivers take seconds to compile a kernel, and scenes that differ in numbers alone
//! have the same.

use super::{Error, check};
use ash::vk;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// A device keeps so many pipelines for kernels that are yet to be made.
const KEPT: usize = 16;

/// A compiled kernel with `buffer_count` storage buffers at the bindings 0, 1, … of set 0, and push constants. Its device outlives it.
pub(crate) struct Pipeline {
    raw: ash::Device,
    code: Vec<u32>,
    buffer_count: u32,
    push_size: u32,
    pub set_layout: vk::DescriptorSetLayout,
    pub layout: vk::PipelineLayout,
    pub pipeline: vk::Pipeline,
}

impl Pipeline {
    fn new(raw: &ash::Device, code: &[u32], buffer_count: u32, push_size: u32) -> Result<Pipeline, Error> {
        // Handles are null until they are made, and destroying a null handle does nothing, so a failure half way leaks nothing.
        let mut made = Pipeline {
            raw: raw.clone(),
            code: code.to_vec(),
            buffer_count,
            push_size,
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            pipeline: vk::Pipeline::null(),
        };
        let bindings: Vec<vk::DescriptorSetLayoutBinding> = (0..buffer_count)
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let set_info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: here and below, the structures outlive the calls and the handles belong to this device.
        made.set_layout =
            check("vkCreateDescriptorSetLayout", unsafe { raw.create_descriptor_set_layout(&set_info, None) })?;
        let range = vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(push_size);
        let ranges = if push_size > 0 { std::slice::from_ref(&range) } else { &[] };
        let set_layouts = [made.set_layout];
        let layout_info =
            vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts).push_constant_ranges(ranges);
        // SAFETY: as above.
        made.layout = check("vkCreatePipelineLayout", unsafe { raw.create_pipeline_layout(&layout_info, None) })?;
        let module_info = vk::ShaderModuleCreateInfo::default().code(code);
        // SAFETY: the code comes from glslang and is valid SPIR-V.
        let module = check("vkCreateShaderModule", unsafe { raw.create_shader_module(&module_info, None) })?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main");
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(made.layout);
        // SAFETY: as above; the module is no longer needed once the pipeline exists.
        let pipelines = unsafe {
            let result = raw.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
            raw.destroy_shader_module(module, None);
            result
        };
        made.pipeline = check("vkCreateComputePipelines", pipelines.map_err(|(_, result)| result))?[0];
        Ok(made)
    }

    fn is(&self, code: &[u32], buffer_count: u32, push_size: u32) -> bool {
        self.buffer_count == buffer_count && self.push_size == push_size && self.code == code
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: kernels hold their pipelines until their last dispatch has ended, and their device longer.
        unsafe {
            self.raw.destroy_pipeline(self.pipeline, None);
            self.raw.destroy_pipeline_layout(self.layout, None);
            self.raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// The pipelines that were asked for last, the latest at the end.
#[derive(Default)]
pub(crate) struct Pipelines(Mutex<VecDeque<Arc<Pipeline>>>);

impl Pipelines {
    /// One that is kept, or a new one. Drivers may put off the compilation to the first dispatch.
    pub fn get(
        &self,
        raw: &ash::Device,
        code: &[u32],
        buffer_count: u32,
        push_size: u32,
    ) -> Result<Arc<Pipeline>, Error> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let place = kept.iter().position(|pipeline| pipeline.is(code, buffer_count, push_size));
        let pipeline = match place.and_then(|place| kept.remove(place)) {
            Some(pipeline) => pipeline,
            None => Arc::new(Pipeline::new(raw, code, buffer_count, push_size)?),
        };
        kept.push_back(pipeline.clone());
        if kept.len() > KEPT {
            kept.pop_front();
        }
        Ok(pipeline)
    }

    /// Keeps none any longer.
    pub fn clear(&mut self) {
        self.0.get_mut().unwrap_or_else(PoisonError::into_inner).clear();
    }
}
