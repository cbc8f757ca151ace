//! Error against time: renders each scene with several budgets and seeds, scores the pictures against a reference, and writes
//! a CSV file, a Markdown table and a plot. Another renderer may take part, on the same scene files and in the same minutes.
//!
//!     cargo bench --bench time_to_error -- --make-references 4096
//!     cargo bench --bench time_to_error -- --peer mitsuba --python VENV/bin/python
//!
//! How it measures, and what the numbers mean: `docs/BENCHMARKS.md`.

mod arguments;
mod case;
mod error;
mod output;
mod page;
mod peer;
mod plot;
mod results;
mod tyndall_runs;

use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use tyndall::image::metrics;

use arguments::{Arguments, Peer};
use case::Case;
use error::{BenchError, write_text};
use peer::Mitsuba;
use results::{Record, Run};
use tyndall_runs::{Lever, OurDevice, start_up_child};

/// Seeds of the runs that are measured begin here. References use others: see `case`.
const FIRST_SEED: u32 = 1;

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), BenchError> {
    if let Some(scene) = &arguments.start_up {
        return start_up_child(scene, arguments);
    }
    if !arguments.under_cargo_bench {
        return Err(BenchError::Usage("run it as `cargo bench --bench time_to_error -- OPTIONS`".to_owned()));
    }
    let scenes = case::find_scenes(&arguments.scenes, &arguments.only)?;
    let device = OurDevice::open(&arguments.device)?;
    eprintln!("{} scenes on {}", scenes.len(), device.description());
    if let Some(spp) = arguments.make_references {
        for scene in &scenes {
            case::make_reference(&device, scene, arguments, spp)?;
        }
        return Ok(());
    }
    let mitsuba = match arguments.peer {
        Some(Peer::Mitsuba) => Some(Mitsuba::new(arguments)?),
        None => None,
    };

    let mut results = Results::default();
    for scene in &scenes {
        let case = Case::load(scene, arguments)?;
        measure(&case, &device, mitsuba.as_ref(), arguments, &mut results)?;
        // What was measured is kept, even if a later scene fails.
        publish(&results, &device, mitsuba.as_ref(), arguments)?;
    }
    Ok(())
}

/// What has been measured so far.
#[derive(Default)]
struct Results {
    records: Vec<Record>,
    /// What the other renderer could not do, one a line.
    failures: Vec<String>,
}

/// Measures one scene. The renderers take turns, seed by seed, so that whatever else the machine does meets all of them.
fn measure(
    case: &Case,
    device: &OurDevice,
    mitsuba: Option<&Mitsuba>,
    arguments: &Arguments,
    results: &mut Results,
) -> Result<(), BenchError> {
    let start_ups = device.start_ups(case, arguments)?;
    let mut configurations = mitsuba.map(|peer| peer.configurations(case)).unwrap_or_default();
    for seed in FIRST_SEED..FIRST_SEED + arguments.seeds {
        let first = seed == FIRST_SEED;
        let start_up = Some(if first { start_ups.cold } else { start_ups.warm });
        let levers = if arguments.levers { &Lever::LEVERS[..] } else { &[Lever::All] };
        for &lever in levers {
            for run in device.measure(case, seed, &arguments.budgets(), start_up, lever)? {
                results.records.push(score(case, "Tyndall", lever.name(), seed, first, run)?);
            }
        }
        let Some(peer) = mitsuba else { continue };
        let mut able = Vec::new();
        for configuration in configurations {
            match peer.measure(case, &configuration, seed, &arguments.budgets()) {
                Ok(runs) => {
                    for run in runs {
                        results.records.push(score(case, "Mitsuba", &configuration.to_string(), seed, first, run)?);
                    }
                    able.push(configuration);
                }
                // The rest can go on. The results say that this one is missing.
                Err(error) => {
                    eprintln!("{error}");
                    let text = error.to_string();
                    let cause: String = text.trim().lines().last().unwrap_or_default().chars().take(160).collect();
                    results.failures.push(format!("{}, {configuration}: {cause}", case.name));
                }
            }
        }
        configurations = able;
        // The next round begins with another one of them.
        if !configurations.is_empty() {
            configurations.rotate_left(1);
        }
    }
    Ok(())
}

/// Compares the picture of a run with the reference, and says how it went.
fn score(
    case: &Case,
    renderer: &'static str,
    configuration: &str,
    seed: u32,
    cold: bool,
    run: Run,
) -> Result<Record, BenchError> {
    let compared = metrics::compare(&run.image, &case.reference.image).map_err(|cause| BenchError::Metrics {
        what: format!("{renderer} ({configuration}) on {}", case.name),
        cause,
    })?;
    let own = case.reference.own_error;
    let record = Record {
        scene: case.name.clone(),
        renderer,
        configuration: configuration.to_owned(),
        budget: run.budget,
        seed,
        spp: run.spp,
        pixels: run.image.width * run.image.height,
        cold,
        start_up: run.start_up,
        time: run.time,
        rel_mse: compared.rel_mse,
        trimmed_rel_mse: compared.trimmed_rel_mse,
        mse: compared.mse,
        own_error: own,
        z: compared.mean.z,
    };
    eprintln!(
        "{:<16} {renderer} {configuration}, seed {seed}: {} spp, {:.3} CPU s, {:.3} s, relMSE {:.5}, z {:+.1}",
        record.scene, record.spp, record.time.cpu, record.time.wall, record.rel_mse, record.z,
    );
    Ok(record)
}

/// Writes all files anew.
fn publish(
    results: &Results,
    device: &OurDevice,
    mitsuba: Option<&Mitsuba>,
    arguments: &Arguments,
) -> Result<(), BenchError> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = arguments.output.clone().unwrap_or_else(|| root.join("docs/benchmarks"));
    std::fs::create_dir_all(&folder).map_err(|source| BenchError::Write { path: folder.clone(), source })?;

    let summaries = results::summarize(&results.records);
    let conditions = output::Conditions {
        device: device.description(),
        peer: mitsuba.map(|peer| peer.version.clone()),
        seeds: arguments.seeds,
        budgets: arguments.budgets().iter().map(ToString::to_string).collect(),
        failures: results.failures.clone(),
    };
    let table = output::markdown(&summaries, &conditions);
    write_text(&folder.join("time_to_error.csv"), &output::csv(&results.records))?;
    write_text(&folder.join("time_to_error.md"), &table)?;
    write_text(&folder.join("time_to_error.svg"), &plot::svg(&summaries)?)?;
    if arguments.output.is_none() {
        let path = root.join("docs/BENCHMARKS.md");
        let page = std::fs::read_to_string(&path).map_err(|source| BenchError::Read { path: path.clone(), source })?;
        let plot = "![CPU seconds against relMSE, a panel for each scene](benchmarks/time_to_error.svg)";
        let page = page::embed(&page, "time_to_error", &format!("{table}\n{plot}"))
            .ok_or_else(|| BenchError::Usage(format!("{} has no place for the table", path.display())))?;
        write_text(&path, &page)?;
    }
    Ok(())
}
