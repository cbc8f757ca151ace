//! Every form of every kernel: its structs as the compiler laid them out, and that the device takes it.

mod common;

use common::{device, images, scenes, units};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Module, TypeInner};
use std::collections::BTreeSet;
use tyndall::gpu::shader::{SOURCES, ShaderSourceText, Variant, compile, expand};
use tyndall::gpu_struct;
use tyndall::pack::features::Features;
use tyndall::pack::layout::{
    Corners, Dispatch, Field, GpuStruct, Grid, Light, Medium, Params, Phase, Primitive, Surface, Texture,
};

/// A shared struct as Rust has it.
struct Expected {
    name: &'static str,
    fields: &'static [Field],
    size: usize,
}

fn expected<T: GpuStruct>() -> Expected {
    Expected { name: T::NAME, fields: T::FIELDS, size: size_of::<T>() }
}

fn shared_structs() -> Vec<Expected> {
    vec![
        expected::<Primitive>(),
        expected::<Surface>(),
        expected::<Medium>(),
        expected::<Phase>(),
        expected::<Corners>(),
        expected::<Texture>(),
        expected::<Grid>(),
        expected::<Light>(),
        expected::<Params>(),
        expected::<Dispatch>(),
    ]
}

/// Reads a kernel back and validates it.
fn reflect(source: &ShaderSourceText) -> Result<Module, String> {
    let words = compile(source).map_err(|error| error.to_string())?;
    let module = naga::front::spv::Frontend::new(words.into_iter(), &Default::default())
        .parse()
        .map_err(|error| format!("{}: naga cannot read it: {error}", source.name))?;
    Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .map_err(|error| format!("{}: {}", source.name, error.emit_to_string(&source.name)))?;
    Ok(module)
}

/// Compares the structs that a kernel uses with the declared ones, and returns the names of those it found.
fn check(module: &Module, structs: &[Expected]) -> Result<BTreeSet<&'static str>, String> {
    let mut found = BTreeSet::new();
    for (handle, ty) in module.types.iter() {
        let TypeInner::Struct { members, span } = &ty.inner else { continue };
        let Some(expected) = structs.iter().find(|one| ty.name.as_deref() == Some(one.name)) else { continue };
        // A copy in registers has no layout; only what lies in memory counts.
        if !in_memory(module, handle) {
            continue;
        }
        let Expected { name, fields, size } = expected;
        found.insert(*name);
        let got: Vec<(&str, &str, usize)> = members
            .iter()
            .map(|member| {
                let ty = glsl_name(&module.types[member.ty].inner);
                (member.name.as_deref().unwrap_or("?"), ty, member.offset as usize)
            })
            .collect();
        let want: Vec<(&str, &str, usize)> =
            fields.iter().map(|field| (field.name, field.glsl, field.offset)).collect();
        if got != want {
            return Err(format!("{name} is {got:?} in the kernel, {want:?} in Rust"));
        }
        if *span as usize != *size {
            return Err(format!("{name} has {span} bytes in the kernel, {size} in Rust"));
        }
        for (_, ty) in module.types.iter() {
            if let TypeInner::Array { base, stride, .. } = ty.inner
                && base == handle
                && stride as usize != *size
            {
                return Err(format!("an array of {name} has a stride of {stride} bytes, {size} in Rust"));
            }
        }
    }
    Ok(found)
}

/// Whether a struct is what a buffer or the push constants hold.
fn in_memory(module: &Module, handle: naga::Handle<naga::Type>) -> bool {
    let holds = |ty: naga::Handle<naga::Type>| match &module.types[ty].inner {
        TypeInner::Struct { members, .. } => members.iter().any(|member| {
            let inner = &module.types[member.ty].inner;
            member.ty == handle || matches!(inner, TypeInner::Array { base, .. } if *base == handle)
        }),
        _ => false,
    };
    module.global_variables.iter().any(|(_, global)| holds(global.ty))
}

fn glsl_name(inner: &TypeInner) -> &'static str {
    use naga::{Scalar, VectorSize};
    match inner {
        TypeInner::Scalar(Scalar::F32) => "float",
        TypeInner::Scalar(Scalar::U32) => "uint",
        TypeInner::Scalar(Scalar::I32) => "int",
        TypeInner::Vector { size: VectorSize::Bi, scalar: Scalar::F32 } => "vec2",
        TypeInner::Vector { size: VectorSize::Tri, scalar: Scalar::F32 } => "vec3",
        _ => "something else",
    }
}

/// The features of the scenes, each as needed and with everything on, and a deep tree.
fn features() -> Vec<Features> {
    let mut features: Vec<Features> = Vec::new();
    for (_, scene) in scenes::all() {
        let needed = scenes::pack(&scene, 1).features;
        let sharing = [4, 8].map(|sharers| Features { sharers, grids: false, masks: false, ..needed });
        features.extend([needed, needed.everything(), Features { walk_stack: 12, ..needed }]);
        features.extend(sharing);
    }
    features
}

/// The kernels that read their tables through descriptors: what naga can read.
fn kernels() -> Vec<ShaderSourceText> {
    let variant = |features| Variant {
        features,
        immediates: Vec::new(),
        workgroup: device().subgroup_size,
        buffer_reference: false,
    };
    let of_scenes = ["path_trace.comp", "connect.comp", "share.comp"];
    let mut kernels = Vec::new();
    for features in features() {
        // Without groups there is nothing to connect.
        let needed = if features.sharers == 0 { &of_scenes[..1] } else { &of_scenes[..] };
        kernels.extend(needed.iter().map(|name| expand(name, &variant(features)).expect("it expands")));
    }
    let others = SOURCES.iter().filter(|(name, _)| name.ends_with(".comp") && !of_scenes.contains(name));
    kernels.extend(others.map(|(name, _)| expand(name, &units::variant()).expect("it expands")));
    kernels
}

#[test]
fn structs_lie_in_memory_as_declared() {
    let structs = shared_structs();
    let mut seen = BTreeSet::new();
    for source in kernels() {
        let module = reflect(&source).unwrap_or_else(|why| panic!("{why}"));
        let found = check(&module, &structs).unwrap_or_else(|why| panic!("{}: {why}", source.name));
        if source.name == "path_trace.comp" {
            assert!(found.contains("Primitive") && found.contains("Params") && found.contains("Dispatch"), "{found:?}");
        }
        seen.extend(found);
    }
    assert_eq!(seen.len(), structs.len(), "only {seen:?} are used by any kernel");
}

gpu_struct! {
    /// As `Medium`, and more.
    pub struct Wrong {
        /// Extinction coefficient.
        sigma_t: glam::Vec3,
        /// Mean cosine.
        g: f32,
        /// Single-scattering albedo.
        albedo: glam::Vec3,
        /// Fills the sixteen bytes.
        unused: u32,
        /// One member too many.
        more: glam::Vec3,
        /// Fills the sixteen bytes.
        unused_2: u32,
    }
}

#[test]
fn a_struct_that_differs_is_noticed() {
    let source = expand("path_trace.comp", &units::variant()).expect("it expands");
    let module = reflect(&source).unwrap_or_else(|why| panic!("{why}"));
    let medium = || expected::<Medium>();
    assert!(check(&module, &[medium()]).expect("it is right").contains("Medium"));
    // A member more, another order, another type, another size.
    let longer = Expected { fields: Wrong::FIELDS, size: size_of::<Wrong>(), ..medium() };
    check(&module, &[longer]).expect_err("a member too many");
    let fields: &'static [Field] = Box::leak(Medium::FIELDS.iter().rev().copied().collect());
    check(&module, &[Expected { fields, ..medium() }]).expect_err("members in another order");
    let mut fields = Medium::FIELDS.to_vec();
    fields[1].glsl = "uint";
    check(&module, &[Expected { fields: fields.leak(), ..medium() }]).expect_err("another type");
    let mut fields = Medium::FIELDS.to_vec();
    fields[3].offset += 4;
    check(&module, &[Expected { fields: fields.leak(), ..medium() }]).expect_err("another offset");
    check(&module, &[Expected { size: 96, ..medium() }]).expect_err("another size");
}

#[test]
fn push_constants_begin_with_the_addresses() {
    for (name, offset) in [("path_trace.comp", 96), ("resolve.comp", 0)] {
        let source = expand(name, &units::variant()).expect("it expands");
        let module = reflect(&source).unwrap_or_else(|why| panic!("{why}"));
        let push = module
            .global_variables
            .iter()
            .find(|(_, global)| global.space == naga::AddressSpace::Immediate)
            .unwrap_or_else(|| panic!("{name} has push constants"));
        let TypeInner::Struct { members, span } = &module.types[push.1.ty].inner else { panic!("{name}: no block") };
        let work = members.iter().find(|member| member.name.as_deref() == Some("work")).expect("the dispatch");
        assert_eq!(work.offset, offset, "{name}");
        assert_eq!(module.types[work.ty].name.as_deref(), Some("Dispatch"), "{name}");
        assert_eq!(*span as usize, offset as usize + size_of::<Dispatch>(), "{name}");
    }
}

#[test]
fn both_forms_of_a_kernel_render_the_same_image() {
    let device = device();
    let mut rendered = 0;
    // As descriptors, lavapipe's compiler takes minutes for kernels that can do much, and no device of today needs that form: a
    // few scenes stand for all. Every kernel is compiled and validated in both forms above.
    let scenes = scenes::all().into_iter().filter(|(name, _)| ["gray box", "furnace", "glow"].contains(name));
    for (name, scene) in scenes {
        let packed = scenes::pack(&scene, 3);
        let mut forms = vec![packed.clone()];
        if name == "gray box" {
            // All of it in the tree.
            forms.push(packed.with_immediates(0));
        }
        for packed in &forms {
            let features = packed.features;
            let variant = |buffer_reference| Variant {
                features,
                immediates: packed.immediates().to_vec(),
                workgroup: device.subgroup_size,
                buffer_reference,
            };
            let descriptors = images::with_variant(packed, 16, &variant(false));
            assert!(images::average(&images::mean(&descriptors)).min_element() > 0.0, "{name} is black");
            if device.buffer_reference {
                let addresses = images::with_variant(packed, 16, &variant(true));
                assert!(descriptors == addresses, "{name}: the two forms of the kernel differ");
            }
            rendered += 1;
        }
    }
    assert_eq!(rendered, 4);
}

#[test]
fn a_kernel_that_is_wrong_does_not_compile() {
    let mut source = expand("resolve.comp", &units::variant()).expect("it expands");
    source.text = source.text.replace("push.work.tile_count", "push.work.no_such_member");
    let error = compile(&source).expect_err("a member that does not exist").to_string();
    assert!(error.contains("resolve.comp") && error.contains("no_such_member"), "{error}");
}
