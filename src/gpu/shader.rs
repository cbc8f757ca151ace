//! From GLSL to SPIR-V: includes, generated files, the compiler, and a cache.

use super::Error;
use super::prune::prune;
use crate::pack::{features::Features, immediate, layout};
use glslang::{
    Compiler, CompilerOptions, Shader, ShaderInput, ShaderSource, ShaderStage, SpirvVersion, Target, VulkanVersion,
};
use sha2::{Digest, Sha256};
use std::collections::HashSet;
use std::io::Write;
use std::path::PathBuf;

macro_rules! sources {
    ($($name:literal),* $(,)?) => {
        /// The files under `shaders/`, by their path there.
        pub const SOURCES: &[(&str, &str)] = &[$(($name, include_str!(concat!("../../shaders/", $name)))),*];
    };
}

sources! {
    "connect.comp",
    "path_trace.comp",
    "resolve.comp",
    "share.comp",
    "lib/bindings.glsl",
    "lib/bsdf.glsl",
    "lib/bvh.glsl",
    "lib/camera.glsl",
    "lib/constants.glsl",
    "lib/equiangular.glsl",
    "lib/film.glsl",
    "lib/filter.glsl",
    "lib/grid.glsl",
    "lib/light.glsl",
    "lib/math.glsl",
    "lib/medium.glsl",
    "lib/microfacet.glsl",
    "lib/outlook.glsl",
    "lib/path.glsl",
    "lib/path_aim.glsl",
    "lib/path_flight.glsl",
    "lib/path_lights.glsl",
    "lib/path_open.glsl",
    "lib/path_rays.glsl",
    "lib/path_shadow.glsl",
    "lib/path_share.glsl",
    "lib/path_state.glsl",
    "lib/path_surface.glsl",
    "lib/path_vertex.glsl",
    "lib/path_walk.glsl",
    "lib/phase.glsl",
    "lib/principled.glsl",
    "lib/ray.glsl",
    "lib/rng.glsl",
    "lib/sampler.glsl",
    "lib/sky.glsl",
    "lib/texture.glsl",
    "lib/toward_light.glsl",
    "lib/guide.glsl",
    "lib/path_probe.glsl",
    "lib/warp.glsl",
    "units/bsdf.comp",
    "units/bvh.comp",
    "units/camera.comp",
    "units/equiangular.comp",
    "units/film.comp",
    "units/filter.comp",
    "units/grid.comp",
    "units/light.comp",
    "units/math.comp",
    "units/medium.comp",
    "units/microfacet.comp",
    "units/outlook.comp",
    "units/phase.comp",
    "units/principled.comp",
    "units/ray.comp",
    "units/rng.comp",
    "units/sampler.comp",
    "units/sky.comp",
    "units/texture.comp",
    "units/toward_light.comp",
    "units/guide.comp",
    "units/warp.comp",
}

/// A kernel before it is compiled.
#[derive(Clone, Debug)]
pub struct ShaderSourceText {
    /// Its file under `shaders/`.
    pub name: String,
    /// All in one, with `#line` directives that name the files.
    pub text: String,
}

/// How a kernel is compiled.
#[derive(Clone, Debug)]
pub struct Variant {
    /// The scene's needs.
    pub features: Features,
    /// Primitives that are part of the kernel: see [`crate::pack::immediate`].
    pub immediates: Vec<layout::Primitive>,
    /// Invocations of a workgroup.
    pub workgroup: u32,
    /// Tables are read through addresses instead of descriptors.
    pub buffer_reference: bool,
}

/// Expands a kernel of this crate, or of the folder that `TYNDALL_SHADERS` names: for work on the kernels without building anew.
pub fn expand(name: &str, variant: &Variant) -> Result<ShaderSourceText, Error> {
    if let Some(folder) = std::env::var_os("TYNDALL_SHADERS") {
        return expand_with(name, variant, &|path| std::fs::read_to_string(PathBuf::from(&folder).join(path)).ok());
    }
    expand_with(name, variant, &|path| {
        SOURCES.iter().find(|(file, _)| *file == path).map(|(_, text)| (*text).to_owned())
    })
}

/// Expands a kernel whose files come from `find`; the generated ones are added.
pub fn expand_with(
    name: &str,
    variant: &Variant,
    find: &dyn Fn(&str) -> Option<String>,
) -> Result<ShaderSourceText, Error> {
    let generated = |path: &str| match path {
        "lib/layout.glsl" => Some(layout::glsl()),
        "lib/features.glsl" => Some(variant.features.glsl()),
        "lib/immediates.glsl" => Some(immediate::glsl(&variant.immediates)),
        _ => find(path),
    };
    let mut head = String::from("#version 460\n#extension GL_GOOGLE_cpp_style_line_directive : require\n");
    head += "#extension GL_EXT_control_flow_attributes : require\n";
    head += "#extension GL_KHR_shader_subgroup_arithmetic : require\n";
    head += &format!("#define WORKGROUP {}u\n", variant.workgroup);
    if variant.buffer_reference {
        head += "#define USE_BUFFER_REFERENCE\n#extension GL_EXT_buffer_reference : require\n#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require\n";
    }
    let mut expansion = Expansion { find: &generated, seen: HashSet::new(), text: head };
    expansion.append(name, ("(the program)", 0))?;
    Ok(ShaderSourceText { name: name.to_owned(), text: expansion.text })
}

struct Expansion<'a> {
    find: &'a dyn Fn(&str) -> Option<String>,
    seen: HashSet<String>,
    text: String,
}

impl Expansion<'_> {
    fn append(&mut self, name: &str, from: (&str, usize)) -> Result<(), Error> {
        if !self.seen.insert(name.to_owned()) {
            return Ok(());
        }
        let source = (self.find)(name).ok_or_else(|| Error::Include {
            file: from.0.to_owned(),
            line: from.1,
            include: name.to_owned(),
        })?;
        self.text += &format!("#line 1 \"{name}\"\n");
        for (index, line) in source.lines().enumerate() {
            let number = index + 1;
            if let Some(include) = line.trim().strip_prefix("#include \"").and_then(|rest| rest.strip_suffix('"')) {
                self.append(include, (name, number))?;
                self.text += &format!("#line {} \"{name}\"\n", number + 1);
            } else if line.starts_with("#version") || line.starts_with("#extension") {
                // These stand at the head of the whole text.
                self.text.push('\n');
            } else {
                self.text += line;
                self.text.push('\n');
            }
        }
        Ok(())
    }
}

/// Compiles a kernel to SPIR-V 1.3, the newest that naga reads completely, without what its constants rule out.
pub fn compile(source: &ShaderSourceText) -> Result<Vec<u32>, Error> {
    prune(&translate(source)?).map_err(|log| Error::Shader { name: source.name.clone(), log })
}

/// The same without leaving anything out.
pub(super) fn translate(source: &ShaderSourceText) -> Result<Vec<u32>, Error> {
    let failed = |log: String| Error::Shader { name: source.name.clone(), log };
    let compiler = Compiler::acquire().ok_or_else(|| failed("glslang does not start".to_owned()))?;
    let text = ShaderSource::from(source.text.as_str());
    let options = CompilerOptions {
        target: Target::Vulkan { version: VulkanVersion::Vulkan1_2, spirv_version: SpirvVersion::SPIRV1_3 },
        ..Default::default()
    };
    let defines: Option<&[(&str, Option<&str>)]> = None;
    let input = ShaderInput::new(&text, ShaderStage::Compute, &options, defines, None)
        .map_err(|error| failed(error.to_string()))?;
    let shader = Shader::new(compiler, input).parse().map_err(|error| failed(error.to_string()))?;
    shader.compile().map_err(|error| failed(error.to_string()))
}

/// Compiles a kernel, or takes it from the cache if the very same text was compiled before by the same program.
pub fn compile_cached(source: &ShaderSourceText) -> Result<Vec<u32>, Error> {
    let Some(folder) = cache_folder().map(|folder| folder.join("spirv")) else { return compile(source) };
    let pass = include_str!("prune.rs");
    let key = Sha256::digest(format!("{} {pass} {}", env!("CARGO_PKG_VERSION"), source.text));
    let name: String = key.iter().map(|byte| format!("{byte:02x}")).collect();
    let path = folder.join(name + ".spv");
    if let Ok(bytes) = std::fs::read(&path)
        && bytes.len() % 4 == 0
        && bytes.starts_with(&0x0723_0203u32.to_le_bytes())
    {
        return Ok(bytemuck::pod_collect_to_vec(&bytes));
    }
    let words = compile(source)?;
    // A cache that cannot be written costs time, not the render.
    if let Err(error) = write_whole(&folder, &path, bytemuck::cast_slice(&words)) {
        tracing::warn!("{}: {error}", path.display());
    }
    Ok(words)
}

fn write_whole(folder: &std::path::Path, path: &std::path::Path, bytes: &[u8]) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    file.write_all(bytes)?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// `$XDG_CACHE_HOME/tyndall`, or `~/.cache/tyndall`.
pub fn cache_folder() -> Option<PathBuf> {
    let base = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from).filter(|path| path.is_absolute());
    base.or_else(|| std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache")))
        .map(|base| base.join("tyndall"))
}
