//! Speed of the kernel: samples and rays a second on each scene, compiled for just that scene, and compiled for more than it needs.
//! The difference is what [`Features::of`] saves.
//!
//!     cargo bench --bench kernels
//!     cargo bench --bench kernels -- --each --scene no-fog
//!
//! The variants take turns, and the fastest of their rounds counts: what else the machine does only ever slows down.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use clap::Parser;
use rustix::time::{ClockId, clock_gettime};
use tyndall::gpu::shader::Variant;
use tyndall::gpu::{Device, DeviceChoice, Renderer};
use tyndall::image::write_whole;
use tyndall::pack::Packed;
use tyndall::pack::features::Features;
use tyndall::reference::bindings::Tables;
use tyndall::reference::path::{path_answer, path_start};
use tyndall::reference::traverse;
use tyndall::render::{BLOCK_SAMPLES, Backend};
use tyndall::scene::{Film, mitsuba};

#[path = "time_to_error/page.rs"]
mod page;

/// Columns and rows of the grid of pixels on which rays are counted.
const COUNT_GRID: u32 = 16;
/// Samples of each of them.
const COUNT_SAMPLES: u32 = 4;

/// Samples a second of the kernels, and what the absence of features saves.
#[derive(Debug, Parser)]
#[command(name = "kernels")]
struct Arguments {
    /// Folder of scenes
    #[arg(long, value_name = "FOLDER", default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes"))]
    scenes: PathBuf,
    /// Only the scenes of these names; may be repeated
    #[arg(long = "scene", value_name = "NAME")]
    only: Vec<String>,
    /// Device, as `tyndall render --device` takes it
    #[arg(long, value_name = "NAME|INDEX", default_value = "auto")]
    device: String,
    /// Longest side of the pictures, in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..=8192))]
    size: u32,
    /// Samples for each pixel in one round
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=65536))]
    spp: u32,
    /// Rounds
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Also add features one at a time
    #[arg(long)]
    each: bool,
    /// Folder for the results [default: docs/benchmarks, and the table goes into docs/BENCHMARKS.md]
    #[arg(long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Cargo says so when it runs a benchmark.
    #[arg(long = "bench", hide = true)]
    under_cargo_bench: bool,
}

/// A name, and what it changes in the features that a scene needs.
type FeatureSet = (&'static str, fn(Features) -> Features);

/// What is always measured.
const SETS: [FeatureSet; 2] = [("what the scene needs", |needed| needed), ("everything", Features::everything)];

/// What `--each` adds: the features whose code is large.
const EACH: [FeatureSet; 10] = [
    ("+ media", |needed| Features { media: true, ..needed }),
    ("+ media, chromatic", |needed| Features { media: true, chromatic: true, ..needed }),
    ("+ media, equiangular", |needed| Features { media: true, equiangular: true, ..needed }),
    ("+ media, mixtures of phase functions", |needed| Features { media: true, phases: true, ..needed }),
    ("+ boundaries", |needed| Features { boundaries: true, ..needed }),
    ("+ spheres", |needed| Features { spheres: true, ..needed }),
    ("+ environment maps", |needed| Features { envmaps: true, ..needed }),
    ("+ dielectric, conductor, plastic", |needed| Features {
        dielectric: true,
        conductor: true,
        plastic: true,
        ..needed
    }),
    ("+ textures", |needed| Features { textures: true, ..needed }),
    ("+ shading normals, masks", |needed| Features { shading_normals: true, masks: true, ..needed }),
];

/// The fastest round of a feature set on a scene.
struct Measured {
    scene: String,
    set: &'static str,
    rays_per_sample: f64,
    first_dispatch: f64,
    wall: f64,
    cpu: f64,
    samples: f64,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Every failure here ends the benchmark with a message, so that its type does not matter.
type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn run(arguments: &Arguments) -> Outcome<()> {
    if !arguments.under_cargo_bench {
        return Err("run it as `cargo bench --bench kernels -- OPTIONS`".into());
    }
    let choice = match (arguments.device.as_str(), arguments.device.parse()) {
        ("auto", _) => DeviceChoice::Best,
        (_, Ok(index)) => DeviceChoice::Index(index),
        (name, Err(_)) => DeviceChoice::Name(name.to_owned()),
    };
    let device = Device::open(&choice)?;
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(&arguments.scenes)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    paths.retain(|path| {
        let wanted = arguments.only.is_empty() || arguments.only.contains(&name_of(path));
        path.extension().is_some_and(|extension| extension == "xml") && wanted
    });
    paths.sort();
    if paths.is_empty() {
        return Err(format!("{} has none of the scenes", arguments.scenes.display()).into());
    }
    let mut measured = Vec::new();
    for path in paths {
        measured.extend(measure(&path, &device, arguments)?);
    }
    publish(&measured, &device, arguments)
}

/// Measures all feature sets on one scene.
fn measure(path: &Path, device: &Arc<Device>, arguments: &Arguments) -> Outcome<Vec<Measured>> {
    let mut scene = mitsuba::load(path, &[])?.scene;
    let Film { width, height, .. } = scene.film;
    let scale = f64::from(arguments.size) / f64::from(width.max(height));
    let side = |pixels: u32| (f64::from(pixels) * scale).round().max(1.0) as u32;
    scene.film = Film::new(side(width), side(height));
    let packed = Packed::new(&scene, 1)?;
    let rays_per_sample = count_rays(&packed, &scene.film);

    let mut sets = SETS.to_vec();
    if arguments.each {
        sets.extend(EACH);
    }
    // A set that changes nothing would be measured twice.
    let mut different: Vec<(FeatureSet, Features)> = Vec::new();
    for set in sets {
        let features = (set.1)(packed.features);
        if different.iter().all(|(_, other)| *other != features) {
            different.push((set, features));
        }
    }
    let mut variants = Vec::new();
    for ((set, _), features) in different {
        let variant = Variant {
            features,
            immediates: packed.immediates().to_vec(),
            workgroup: device.subgroup_size,
            buffer_reference: device.buffer_reference,
        };
        let mut renderer = Renderer::with_variant(device, &packed, &variant)?;
        let begin = Instant::now();
        renderer.render(0..1)?;
        variants.push((set, renderer, begin.elapsed().as_secs_f64(), (f64::INFINITY, f64::INFINITY)));
    }
    for round in 0..arguments.rounds {
        for (_, renderer, _, fastest) in &mut variants {
            // Other samples in each round, in whole blocks.
            let first = round * arguments.spp.next_multiple_of(BLOCK_SAMPLES);
            let (begin, begin_cpu) = (Instant::now(), cpu_time());
            renderer.render(first..first + arguments.spp)?;
            let (wall, cpu) = (begin.elapsed().as_secs_f64(), cpu_time() - begin_cpu);
            *fastest = (fastest.0.min(wall), fastest.1.min(cpu));
        }
    }
    let samples = f64::from(arguments.spp) * packed.pixel_count() as f64;
    let result = variants.into_iter().map(|(set, _, first_dispatch, (wall, cpu))| {
        let scene = name_of(path);
        eprintln!(
            "{scene}: {set}: {:.3} Msamples/s, {:.3} Msamples/CPU s",
            1e-6 * samples / wall,
            1e-6 * samples / cpu
        );
        Measured { scene, set, rays_per_sample, first_dispatch, wall, cpu, samples }
    });
    Ok(result.collect())
}

/// Mean number of rays that a sample asks for, counted by the CPU reference, which follows the same paths.
fn count_rays(packed: &Packed, film: &Film) -> f64 {
    let tables = Tables::new(packed);
    let (mut rays, mut samples) = (0u64, 0u64);
    for index in 0..COUNT_GRID * COUNT_GRID {
        let x = (index % COUNT_GRID * 2 + 1) * film.width / (2 * COUNT_GRID);
        let y = (index / COUNT_GRID * 2 + 1) * film.height / (2 * COUNT_GRID);
        for sample in 0..COUNT_SAMPLES {
            let mut path = path_start(&tables, y * film.width + x, sample);
            // The loop of `reference::trace`, with a counter.
            while path.alive || path.shadow {
                rays += 1;
                let hit = traverse(&tables, &path);
                path_answer(&tables, &mut path, &hit);
            }
            samples += 1;
        }
    }
    rays as f64 / samples as f64
}

/// Writes CSV and Markdown.
fn publish(measured: &[Measured], device: &Device, arguments: &Arguments) -> Outcome<()> {
    let mut csv = "scene,features,rays_per_sample,first_dispatch_s,samples,cpu_s,wall_s\n".to_owned();
    let mut table = format!(
        "Tyndall {} on {} ({}); pictures of at most {} pixels a side, {} spp, the fastest of {} rounds.\n\n\
         | scene | compiled for | rays/sample | Msamples/s | Msamples/CPU s | Mrays/CPU s | first dispatch, s | time |\n\
         |---|---|--:|--:|--:|--:|--:|--:|\n",
        env!("CARGO_PKG_VERSION"),
        device.info.name,
        device.info.driver,
        arguments.size,
        arguments.spp,
        arguments.rounds,
    );
    for row in measured {
        let Measured { scene, set, rays_per_sample, first_dispatch, wall, cpu, samples } = row;
        let needed = measured.iter().find(|other| other.scene == *scene).map_or(*cpu, |first| first.cpu);
        let rate = 1e-6 * samples / cpu;
        csv +=
            &format!("\"{scene}\",\"{set}\",{rays_per_sample:.3},{first_dispatch:.4},{samples},{cpu:.6},{wall:.6}\n");
        table += &format!(
            "| {scene} | {set} | {rays_per_sample:.1} | {:.3} | {rate:.3} | {:.2} | {first_dispatch:.2} | {:+.0} % |\n",
            1e-6 * samples / wall,
            rate * rays_per_sample,
            100.0 * (cpu / needed - 1.0),
        );
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = arguments.output.clone().unwrap_or_else(|| root.join("docs/benchmarks"));
    std::fs::create_dir_all(&folder)?;
    let write = |path: &Path, text: &str| write_whole(path, |file| std::io::Write::write_all(file, text.as_bytes()));
    write(&folder.join("kernels.csv"), &csv)?;
    write(&folder.join("kernels.md"), &table)?;
    if arguments.output.is_none() {
        let path = root.join("docs/BENCHMARKS.md");
        let page = std::fs::read_to_string(&path)?;
        let page = page::embed(&page, "kernels", &table).ok_or("docs/BENCHMARKS.md has no place for the table")?;
        write(&path, &page)?;
    }
    Ok(())
}

fn name_of(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Seconds that all cores have spent on this process.
fn cpu_time() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
