//! Scenes and their references.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use tyndall::image::metrics::{self, Comparison};
use tyndall::image::{Image, exr};
use tyndall::scene::mitsuba;
use tyndall::scene::{Bsdf, Film, Scene};

use super::arguments::Arguments;
use super::error::{BenchError, write_text};
use super::results::{Budget, OwnError};
use super::tyndall_runs::{Lever, OurDevice};

/// Seeds of the two halves of a reference, far from those of the measured runs.
const REFERENCE_SEEDS: [u32; 2] = [1_000_003, 2_000_003];

/// Two halves of a reference whose means differ by more than this, in standard errors, are not of one scene.
const LARGEST_Z: f64 = 5.0;

/// A scene to be measured.
pub struct Case {
    /// The name of its file, without extension.
    pub name: String,
    /// Its file.
    pub path: PathBuf,
    /// The scene, with a film as large as the reference.
    pub scene: Scene,
    /// What the picture should be.
    pub reference: Reference,
}

/// What a picture should be.
pub struct Reference {
    /// The converged picture.
    pub image: Image,
    /// How far it is itself from the truth.
    pub own_error: OwnError,
}

impl Case {
    /// Reads a scene and its reference.
    pub fn load(path: &Path, arguments: &Arguments) -> Result<Case, BenchError> {
        let name = name_of(path);
        let image_path = reference_path(arguments, &name, "exr");
        if !image_path.exists() {
            return Err(BenchError::Usage(format!(
                "{name} has no reference {}; --make-references renders it",
                image_path.display()
            )));
        }
        let image = exr::read(&image_path)?;
        let own_error = read_own_error(&reference_path(arguments, &name, "json"))?;
        let mut scene = load_scene(path)?;
        scene.film = Film::new(image.width as u32, image.height as u32);
        Ok(Case { name, path: path.to_owned(), scene, reference: Reference { image, own_error } })
    }

    /// Whether any medium is in the scene.
    pub fn has_media(&self) -> bool {
        !self.scene.media.is_empty()
    }

    /// Whether a surface refracts light: rays towards a light do not get through.
    pub fn has_glass(&self) -> bool {
        let refracts = |bsdf: &Bsdf| matches!(bsdf, Bsdf::Dielectric { .. } | Bsdf::RoughDielectric { .. });
        self.scene.shapes.iter().any(|shape| refracts(&shape.bsdf))
    }
}

/// The scene files of a folder in the order of their names, or those of the given names.
pub fn find_scenes(folder: &Path, only: &[String]) -> Result<Vec<PathBuf>, BenchError> {
    let read = |source| BenchError::Read { path: folder.to_owned(), source };
    let mut scenes = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(read)? {
        let path = entry.map_err(read)?.path();
        let wanted = only.is_empty() || only.contains(&name_of(&path));
        if path.extension().is_some_and(|extension| extension == "xml") && wanted {
            scenes.push(path);
        }
    }
    scenes.sort();
    if let Some(missing) = only.iter().find(|name| !scenes.iter().any(|path| name_of(path) == **name)) {
        return Err(BenchError::Usage(format!("{} has no scene {missing}.xml", folder.display())));
    }
    if scenes.is_empty() {
        return Err(BenchError::Usage(format!("{} has no scenes", folder.display())));
    }
    Ok(scenes)
}

/// Reads a scene file. What the reader has to remark is of no interest here: `tyndall check` says it.
pub fn load_scene(path: &Path) -> Result<Scene, BenchError> {
    let loaded = mitsuba::load(path, &[]);
    Ok(loaded.map_err(|error| BenchError::Render { scene: name_of(path), cause: error.to_string() })?.scene)
}

/// Renders a reference: two halves with different seeds, whose mean is the picture. With a and b the halves and m their mean,
/// a − m = (a − b)/2 has the variance of m itself, so that the measures of a against m are those of m against the truth.
pub fn make_reference(device: &OurDevice, path: &Path, arguments: &Arguments, spp: u32) -> Result<(), BenchError> {
    let name = name_of(path);
    let mut scene = load_scene(path)?;
    let Film { width, height, .. } = scene.film;
    let scale = f64::from(arguments.reference_size) / f64::from(width.max(height));
    let side = |pixels: u32| (f64::from(pixels) * scale).round().max(1.0) as u32;
    scene.film = Film::new(side(width), side(height));

    let half = spp.div_ceil(2);
    let mut halves = Vec::new();
    for seed in REFERENCE_SEEDS {
        eprintln!("{name}: {half} spp with seed {seed}");
        // As simply as can be: with nothing that a measurement is about to judge.
        let ready = device.renderer(&name, &scene, seed, Lever::NoPilot)?;
        let mut renderer = ready.expect("every scene can do without a pilot");
        let (image, _, _) = renderer.render(Budget::Samples(half))?;
        halves.push(image);
    }
    let mean = average(&halves[0], &halves[1]);
    let compared = |a: &Image, b: &Image| {
        metrics::compare(a, b).map_err(|cause| BenchError::Metrics { what: format!("the reference of {name}"), cause })
    };
    let z = compared(&halves[0], &halves[1])?.mean.z;
    if z.abs() > LARGEST_Z {
        let cause = format!("the two halves of the reference differ by {z:.1} standard errors");
        return Err(BenchError::Render { scene: name, cause });
    }
    let Comparison { mse, rel_mse, trimmed_rel_mse, .. } = compared(&halves[0], &mean)?;
    let facts = json!({
        "scene": name,
        "renderer": format!("tyndall {}", env!("CARGO_PKG_VERSION")),
        "device": device.description(),
        "spp": 2 * half,
        "seeds": REFERENCE_SEEDS,
        "res": [mean.width, mean.height],
        "ref_mse": mse,
        "ref_relmse": rel_mse,
        "ref_trimmed_relmse": trimmed_rel_mse,
        "z": z,
    });
    let folder = arguments.scenes.join("refs");
    std::fs::create_dir_all(&folder).map_err(|source| BenchError::Write { path: folder, source })?;
    exr::write(&reference_path(arguments, &name, "exr"), &mean)?;
    write_text(&reference_path(arguments, &name, "json"), &format!("{facts:#}\n"))?;
    eprintln!("{name}: relMSE of the reference itself {rel_mse:.2e}, the halves differ by z = {z:+.1}");
    Ok(())
}

/// The mean of two pictures of one size: `R`, `G`, `B` alone.
fn average(a: &Image, b: &Image) -> Image {
    let mut mean = Image::new(a.width, a.height);
    for name in ["R", "G", "B"] {
        let samples = |image: &Image| image.channel(name).expect("a render has red, green and blue").to_vec();
        mean.push(name, samples(a).iter().zip(samples(b)).map(|(a, b)| 0.5 * (a + b)).collect());
    }
    mean
}

fn name_of(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

fn reference_path(arguments: &Arguments, name: &str, extension: &str) -> PathBuf {
    // A name can hold dots, so `with_extension` does not do.
    arguments.scenes.join("refs").join(format!("{name}.{extension}"))
}

/// What a reference's companion says about its own error. The trimmed one may be missing.
fn read_own_error(path: &Path) -> Result<OwnError, BenchError> {
    let text = std::fs::read_to_string(path).map_err(|source| BenchError::Read { path: path.to_owned(), source })?;
    let facts: Value = serde_json::from_str(&text)
        .map_err(|error| BenchError::Usage(format!("{} is not JSON: {error}", path.display())))?;
    let number = |name: &str| {
        let value = facts[name].as_f64().filter(|value| *value >= 0.0);
        value.ok_or_else(|| BenchError::Usage(format!("{} has no number {name}", path.display())))
    };
    Ok(OwnError {
        rel_mse: number("ref_relmse")?,
        trimmed_rel_mse: number("ref_trimmed_relmse").ok(),
        mse: number("ref_mse")?,
    })
}
