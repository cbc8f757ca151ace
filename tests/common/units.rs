//! Running a unit kernel: an array of inputs in, an array of outputs out.

use super::{device, scenes};
use bytemuck::Pod;
use tyndall::gpu::buffer::Buffer;
use tyndall::gpu::kernel::Kernel;
use tyndall::gpu::shader::{Variant, compile_cached, expand};

/// How unit kernels and the SSBO form of the others are compiled.
pub fn variant() -> Variant {
    let features = scenes::pack(&scenes::gray_box(), 1, 1).features.everything();
    Variant { features, workgroup: device().subgroup_size, buffer_reference: false }
}

/// Runs `shaders/units/{name}.comp` on the inputs. `invocations` of it make `outputs` values.
pub fn run<I: Pod, O: Pod>(name: &str, inputs: &[I], invocations: usize, outputs: usize) -> Vec<O> {
    let device = device();
    let source = expand(&format!("units/{name}.comp"), &variant()).expect("the unit kernel expands");
    let code = compile_cached(&source).expect("the unit kernel compiles");
    let mut kernel = Kernel::new(device, &code, 2, 0).expect("the unit kernel loads");
    let input = Buffer::new(device, "inputs", inputs).expect("memory");
    let output = Buffer::zeroed::<O>(device, "outputs", outputs).expect("memory");
    let groups = (invocations as u32).div_ceil(device.subgroup_size);
    kernel.dispatch(&[&input, &output], &[], groups).expect("the unit kernel runs");
    output.read(outputs)
}

/// The same where each input makes one output.
pub fn map<I: Pod, O: Pod>(name: &str, inputs: &[I]) -> Vec<O> {
    run(name, inputs, inputs.len(), inputs.len())
}
