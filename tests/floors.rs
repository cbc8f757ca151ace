//! The floors of the program: who may know whom. Read from the source text.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use tyndall::gpu::shader::SOURCES;

/// A file of the program: its path from the root, with slashes, and its text.
type Source = (String, String);

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn sources(folder: &str) -> Vec<Source> {
    let mut found = Vec::new();
    let mut folders = vec![PathBuf::from(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).expect("the folder exists") {
            let path = folder.join(entry.expect("it can be read").file_name());
            if root().join(&path).is_dir() {
                folders.push(path);
            } else {
                let text = std::fs::read_to_string(root().join(&path)).expect("it is text");
                found.push((path.to_string_lossy().replace('\\', "/"), text));
            }
        }
    }
    assert!(!found.is_empty(), "{folder} is empty");
    found
}

/// The lines of code: comments do not count.
fn code(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(|line| line.split("//").next().unwrap_or_default())
}

/// Whether a module is named as `crate::name` or within `crate::{…}` or `tyndall::…`.
fn names_module(text: &str, module: &str) -> bool {
    let joined: String = code(text).collect::<Vec<_>>().join("\n").split_whitespace().collect();
    ["crate::", "tyndall::"].iter().any(|head| {
        joined.split(head).skip(1).any(|rest| {
            let path = rest.split(';').next().unwrap_or_default();
            let named = |path: &str| path.strip_prefix(module).is_some_and(|rest| !rest.starts_with(is_word));
            named(path) || path.strip_prefix('{').is_some_and(|list| list.split(['{', ',', '}']).any(named))
        })
    })
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn contains_word(text: &str, word: &str) -> bool {
    code(text).any(|line| line.split(|c| !is_word(c)).any(|token| token == word))
}

/// Modules and what they must not name.
const FORBIDDEN: &[(&str, &[&str])] = &[
    ("src/gpu/", &["scene", "reference"]),
    ("src/reference/", &["gpu", "scene"]),
    ("src/scene/", &["pack", "gpu", "reference", "render"]),
    ("src/pack/", &["gpu", "reference", "image"]),
    ("src/image/", &["gpu", "reference", "pack", "render", "scene"]),
];

fn upward_imports(sources: &[Source]) -> Vec<String> {
    let mut found = Vec::new();
    for (path, text) in sources {
        for (_, modules) in FORBIDDEN.iter().filter(|(folder, _)| path.starts_with(folder)) {
            let named = modules.iter().filter(|module| names_module(text, module));
            found.extend(named.map(|module| format!("{path} names {module}")));
        }
    }
    found
}

fn unsafe_outside_gpu(sources: &[Source]) -> Vec<String> {
    let outside = sources.iter().filter(|(path, _)| !path.starts_with("src/gpu/"));
    outside.filter(|(_, text)| contains_word(text, "unsafe")).map(|(path, _)| format!("{path}: unsafe")).collect()
}

/// What a file of `shaders/lib` may include beside the generated files and constants.
const MAY_INCLUDE: &[(&str, &[&str])] = &[
    ("sampler", &["rng"]),
    ("microfacet", &["math", "warp"]),
    ("bsdf", &["math", "warp", "microfacet"]),
    ("principled", &["bsdf", "math", "warp", "microfacet"]),
    ("light", &["math", "warp"]),
    ("sky", &["math"]),
    ("phase", &["math"]),
    ("outlook", &["math"]),
    ("filter", &["math"]),
    ("film", &["math"]),
    ("medium", &["math"]),
    ("grid", &["math", "rng"]),
    ("path_state", &["math", "sampler", "medium", "light", "grid", "path_open"]),
    ("path_open", &["math", "equiangular"]),
    ("path_surface", &["path_state", "math", "texture", "bsdf"]),
    ("equiangular", &["math"]),
    ("path_vertex", &["path_state", "path_surface", "warp", "ray", "phase", "bsdf", "principled"]),
    ("toward_light", &["math"]),
    ("path_aim", &["path_state", "path_vertex", "light", "toward_light"]),
    ("path_lights", &["path_state", "path_vertex", "path_aim", "light", "sky", "grid", "texture"]),
    ("path_flight", &["path_state", "path_aim", "equiangular", "ray", "light", "grid"]),
    ("path_rays", &["path_state", "path_surface", "path_flight", "ray"]),
    ("path_shadow", &["path_state", "path_flight", "path_surface"]),
    ("path_share", &["path_state", "path_vertex", "path_rays", "path_flight", "path_aim"]),
    ("guide", &["math", "warp"]),
    ("path_probe", &["path_state", "path_vertex", "bsdf", "guide"]),
    ("path_walk", &["path_rays", "bvh"]),
    (
        "path",
        &[
            "path_state",
            "path_vertex",
            "path_lights",
            "path_rays",
            "path_flight",
            "path_shadow",
            "path_share",
            "path_probe",
            "camera",
            "filter",
            "film",
            "outlook",
        ],
    ),
];
const ALL_MAY_INCLUDE: &[&str] = &["constants", "layout", "features", "immediates", "sobol"];

fn concepts_that_call_concepts(sources: &[Source]) -> Vec<String> {
    let mut found = Vec::new();
    for (path, text) in sources {
        let Some(concept) = path.strip_prefix("shaders/lib/").and_then(|name| name.strip_suffix(".glsl")) else {
            continue;
        };
        let allowed = MAY_INCLUDE.iter().find(|(name, _)| *name == concept).map_or(&[][..], |(_, allowed)| allowed);
        for line in text.lines().filter_map(|line| line.trim().strip_prefix("#include")) {
            let include = line.trim().trim_matches('"').trim_start_matches("lib/").trim_end_matches(".glsl");
            if !allowed.contains(&include) && !ALL_MAY_INCLUDE.contains(&include) {
                found.push(format!("{path} includes {include}"));
            }
        }
    }
    found
}

#[test]
fn imports_go_downwards() {
    assert_eq!(upward_imports(&sources("src")), Vec::<String>::new());
}

#[test]
fn unsafe_code_is_in_gpu_alone() {
    assert_eq!(unsafe_outside_gpu(&sources("src")), Vec::<String>::new());
}

#[test]
fn no_concept_of_the_kernels_calls_another() {
    assert_eq!(concepts_that_call_concepts(&sources("shaders")), Vec::<String>::new());
}

#[test]
fn every_shader_file_is_part_of_the_program() {
    let files: BTreeSet<String> =
        sources("shaders").into_iter().map(|(path, _)| path["shaders/".len()..].to_owned()).collect();
    let embedded: BTreeSet<String> = SOURCES.iter().map(|(name, _)| (*name).to_owned()).collect();
    assert_eq!(files, embedded);
}

#[test]
fn every_concept_has_a_mirror_and_a_unit_kernel() {
    let names = |folder: &str, end: &str| -> BTreeSet<String> {
        let files = sources(folder).into_iter().map(|(path, _)| path[folder.len() + 1..].to_owned());
        files.filter_map(|name| name.strip_suffix(end).map(str::to_owned)).collect()
    };
    let without = |mut all: BTreeSet<String>, some: &[&str]| {
        some.iter().for_each(|name| assert!(all.remove(*name), "{name} does not exist"));
        all
    };
    // How rays go in step decides nothing.
    let concepts = without(names("shaders/lib", ".glsl"), &["constants", "path_walk"]);
    assert_eq!(without(names("src/reference", ".rs"), &["mod"]), concepts, "mirrors of concepts");
    // The path and its bindings are tested as a whole, by images.
    assert_eq!(
        names("shaders/units", ".comp"),
        without(
            concepts,
            &[
                "path",
                "path_aim",
                "path_flight",
                "path_lights",
                "path_open",
                "path_probe",
                "path_rays",
                "path_shadow",
                "path_share",
                "path_state",
                "path_surface",
                "path_vertex",
                "bindings"
            ]
        ),
        "unit kernels of concepts"
    );
}

#[test]
fn the_checks_see_what_they_should() {
    let made_up = |path: &str, text: &str| vec![(path.to_owned(), text.to_owned())];
    let imports = |path: &str, text: &str| upward_imports(&made_up(path, text)).len();
    assert_eq!(imports("src/gpu/new.rs", "use crate::scene::Scene;"), 1);
    assert_eq!(imports("src/gpu/new.rs", "use crate::{\n    pack::Packed,\n    scene::Scene,\n};"), 1);
    assert_eq!(imports("src/gpu/new.rs", "fn f(scene: &crate::scene::Scene) {}"), 1);
    assert_eq!(imports("src/reference/new.rs", "use crate::gpu::Device;"), 1);
    assert_eq!(imports("src/reference/new.rs", "use crate::pack::Packed; // not crate::gpu"), 0);
    assert_eq!(imports("src/gpu/new.rs", "use crate::scene_like::Thing;"), 0);
    assert_eq!(unsafe_outside_gpu(&made_up("src/pack/new.rs", "fn f() { unsafe { g() } }")).len(), 1);
    assert_eq!(
        unsafe_outside_gpu(&made_up("src/pack/new.rs", "// this would be unsafe\nfn unsafe_like() {}")).len(),
        0
    );
    assert_eq!(unsafe_outside_gpu(&made_up("src/gpu/new.rs", "fn f() { unsafe { g() } }")).len(), 0);
    let includes = |path: &str, text: &str| concepts_that_call_concepts(&made_up(path, text)).len();
    assert_eq!(includes("shaders/lib/phase.glsl", "#include \"lib/warp.glsl\"\n"), 1);
    assert_eq!(includes("shaders/lib/phase.glsl", "#include \"lib/constants.glsl\"\n"), 0);
    assert_eq!(includes("shaders/lib/light.glsl", "#include \"lib/warp.glsl\"\n"), 0);
}
