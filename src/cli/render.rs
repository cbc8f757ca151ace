//! `tyndall render`: from a scene file to an image file.

use std::path::Path;
use std::process::ExitCode;

use tyndall::image::{self, exr, preview};
use tyndall::render::picture;
use tyndall::render::session::{self, Options, Outcome, Rendered};

use super::args::RenderArgs;
use super::error::{CliError, STOPPED_EARLY, invalid_samples};
use super::progress::Reporter;
use super::{backend, interrupt};

/// Renders the scene and writes the image:
/// 1. find out whether the image could be written;
/// 2. read the scene, and change it as the arguments say;
/// 3. open the device and render until done, out of time or interrupted;
/// 4. write the image, and the preview;
/// 5. tell how it went.
pub fn run(args: &RenderArgs) -> Result<ExitCode, CliError> {
    let output = args.output();
    check_paths(args, &output)?;

    let loaded = backend::load(&args.scene, &args.overrides)?;
    if !args.quiet {
        for warning in &loaded.warnings {
            super::say(format_args!("warning: {warning}"));
        }
    }
    let mut scene = loaded.scene;
    let spp = args.apply(&mut scene)?;

    let mut backend = backend::open(&args.device, &scene, args.seed, spp)?;
    let device = backend.device().clone();
    let crop = scene.film.crop;
    let pixels = crop.width as usize * crop.height as usize;
    // From here on a signal leads to an image. Before, it simply ends the program.
    let interrupt = interrupt::flag()?;
    let mut reporter = Reporter::start(
        args.quiet,
        spp,
        format_args!(
            "rendering {} on {} ({}): {}×{} pixels, {spp} spp",
            args.scene.display(),
            device.name,
            device.driver,
            crop.width,
            crop.height,
        ),
    );
    let options = Options { samples: 0..spp, time_limit: args.time_limit };
    let report = &mut |progress| reporter.update(progress);
    let rendered = session::render(&mut *backend, pixels, &options, &interrupt, report);
    reporter.finish();
    let rendered = rendered?;

    let image = picture::assemble(&scene, &rendered, &device, args.seed);
    exr::write(&output, &image)?;
    if let Some(path) = &args.preview {
        preview::write_png(path, &image)?;
    }

    if !args.quiet {
        super::say(format_args!("{}", summary(&rendered, &output)));
    }
    let counts = rendered.film.invalid();
    if counts.iter().any(|&count| count > 0) {
        return Err(CliError::InvalidSamples { counts, path: output });
    }
    Ok(match rendered.outcome {
        Outcome::Finished | Outcome::TimeLimit => ExitCode::SUCCESS,
        Outcome::Interrupted => ExitCode::from(STOPPED_EARLY),
    })
}

/// Hours of rendering should not end in an error that could be seen before, nor in the loss of the scene.
fn check_paths(args: &RenderArgs, output: &Path) -> Result<(), CliError> {
    image::check_writable(output)?;
    if let Some(preview) = &args.preview {
        image::check_writable(preview)?;
        if same_file(preview, output) {
            return Err(CliError::Usage(format!("image and preview are the same file {}", output.display())));
        }
    }
    for written in [Some(output), args.preview.as_deref()].into_iter().flatten() {
        if same_file(written, &args.scene) {
            return Err(CliError::Usage(format!("the image would overwrite the scene {}", args.scene.display())));
        }
    }
    Ok(())
}

/// Whether two paths name the same file, as far as one can tell before it exists.
fn same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// "out.exr: 64 spp in 3.20 s, 1.310 Msamples/s, relative standard error 3.4 %, no invalid samples".
fn summary(rendered: &Rendered, output: &Path) -> String {
    let Rendered { film, outcome, elapsed } = rendered;
    let seconds = elapsed.as_secs_f64();
    let samples = film.samples();
    let rate = 1e-6 * f64::from(samples) * film.pixels() as f64 / seconds.max(1e-9);
    let error = match film.relative_standard_error() {
        Some(error) => format!("{:.2} %", 100.0 * error),
        None => "unknown".to_owned(),
    };
    let outcome = match outcome {
        Outcome::Finished => "",
        Outcome::TimeLimit => " (time limit)",
        Outcome::Interrupted => " (interrupted)",
    };
    format!(
        "{}: {samples} spp{outcome} in {seconds:.2} s, {rate:.3} Msamples/s, relative standard error {error}, {}",
        output.display(),
        invalid_samples(&film.invalid()),
    )
}
