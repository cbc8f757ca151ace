//! Running a unit kernel: arrays of inputs in, an array of outputs out.

use super::{device, scenes};
use bytemuck::Pod;
use glam::{DVec3, Vec3};
use tyndall::gpu::buffer::Buffer;
use tyndall::gpu::kernel::Kernel;
use tyndall::gpu::shader::{Variant, compile_cached, expand};

/// How unit kernels are compiled.
pub fn variant() -> Variant {
    let features = scenes::pack(&scenes::gray_box(), 1).features.everything();
    Variant { features, immediates: Vec::new(), workgroup: device().subgroup_size, buffer_reference: false }
}

/// Runs `invocations` of `shaders/units/{name}.comp` on the inputs and other tables, and returns its outputs.
pub fn run<I: Pod, O: Pod>(name: &str, inputs: &[I], tables: &[&[u8]], invocations: usize, outputs: usize) -> Vec<O> {
    run_variant(name, &variant(), inputs, tables, invocations, outputs)
}

/// The same, compiled in another way.
pub fn run_variant<I: Pod, O: Pod>(
    name: &str,
    variant: &Variant,
    inputs: &[I],
    tables: &[&[u8]],
    invocations: usize,
    outputs: usize,
) -> Vec<O> {
    let device = device();
    let source = expand(&format!("units/{name}.comp"), variant).expect("the unit kernel expands");
    let code = compile_cached(&source).expect("the unit kernel compiles");
    let mut kernel = Kernel::new(device, &code, 2 + tables.len() as u32, 0).expect("the unit kernel loads");
    let mut buffers = vec![Buffer::new(device, "inputs", inputs).expect("memory")];
    buffers.extend(tables.iter().map(|table| Buffer::new(device, "table", table).expect("memory")));
    buffers.push(Buffer::zeroed::<O>(device, "outputs", outputs).expect("memory"));
    let bound: Vec<&Buffer> = buffers.iter().collect();
    kernel.dispatch(&bound, &[], (invocations as u32).div_ceil(variant.workgroup)).expect("the unit kernel runs");
    buffers[buffers.len() - 1].read(outputs)
}

/// Numbers as the kernel's four-component vectors, the last filled up with zeros.
pub fn vec4(values: &[f64]) -> [f32; 4] {
    let mut vector = [0.0; 4];
    vector.iter_mut().zip(values).for_each(|(to, from)| *to = *from as f32);
    vector
}

/// A vector of single precision, widened.
pub fn widen(numbers: &[f32]) -> DVec3 {
    Vec3::from_slice(numbers).as_dvec3()
}
