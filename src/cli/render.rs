//! `tyndall render`: from a scene file to an image file.

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use tyndall::image::{self, exr, preview};
use tyndall::render::film::Film;
use tyndall::render::session::{self, Options, Outcome, Rendered};
use tyndall::render::{Backend, aov, moments, picture};
use tyndall::scene::Scene;

use super::args::RenderArgs;
use super::error::{CliError, STOPPED_EARLY, invalid_samples};
use super::progress::Reporter;
use super::{backend, interrupt};

/// Renders the scene and writes the image:
/// 1. find out whether the image could be written;
/// 2. read the scene, change it as the arguments say, and tell whether it is doubtful;
/// 3. open the device and render until done, out of time or interrupted;
/// 4. write the image, and the preview;
/// 5. tell how it went.
pub fn run(args: &RenderArgs) -> Result<ExitCode, CliError> {
    let output = args.output();
    check_paths(args, &output)?;

    let loaded = backend::load(&args.scene, &args.overrides)?;
    let mut warn = |warning: &str| {
        if !args.quiet {
            super::say(format_args!("warning: {warning}"));
        }
    };
    loaded.warnings.iter().for_each(|warning| warn(warning));
    let mut scene = loaded.scene;
    let spp = args.apply(&mut scene)?;

    if !args.quiet {
        doubts(args, &scene);
    }

    let mut backend = backend::open(&args.device, &scene, args.seed, !args.no_pilot, !args.no_sharing, &mut warn)?;
    // From here on a signal leads to an image. Before, it simply ends the program.
    let interrupt = interrupt::flag()?;
    render(args, &scene, spp, &mut *backend, &interrupt, &output)
}

/// Steps 3 to 5 of [`run`], on a device that is open.
fn render(
    args: &RenderArgs,
    scene: &Scene,
    spp: u32,
    backend: &mut dyn Backend,
    interrupt: &AtomicBool,
    output: &Path,
) -> Result<ExitCode, CliError> {
    let device = backend.device().clone();
    let crop = scene.film.crop;
    let pixels = crop.width as usize * crop.height as usize;
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
    let allocate = !args.no_allocation && scene.moments.is_none();
    let options = Options { samples: 0..spp, time_limit: args.time_limit, allocate };
    let rendered = session::render(backend, pixels, &options, interrupt, &mut |progress| reporter.update(progress));
    reporter.finish();
    let rendered = rendered?;

    let image = picture::assemble(scene, &rendered, &device, args.seed);
    if let Some(path) = &args.preview {
        preview::write_png(path, &image)?;
    }
    let further = further_channels(args, scene, &rendered.film)?;
    exr::write(output, &picture::finish(image, scene.film.pixel_format.colors, further))?;

    if !args.quiet {
        super::say(format_args!("{}", summary(&rendered, output)));
    }
    let counts = rendered.film.invalid();
    if counts.iter().any(|&count| count > 0) {
        return Err(CliError::InvalidSamples { counts, path: output.to_owned() });
    }
    Ok(match rendered.outcome {
        Outcome::Finished | Outcome::TimeLimit => ExitCode::SUCCESS,
        Outcome::Interrupted => ExitCode::from(STOPPED_EARLY),
    })
}

/// Channels that the scene asks for beside the radiance.
fn further_channels(args: &RenderArgs, scene: &Scene, film: &Film) -> Result<Vec<(String, Vec<f32>)>, CliError> {
    let alpha = scene.film.pixel_format.alpha;
    let mut channels = Vec::new();
    if !scene.aovs.is_empty() || alpha {
        let samples = film.samples().min(aov::AOV_SAMPLES);
        channels = aov::render(&backend::pack(scene, args.seed)?, &scene.aovs, alpha, samples);
    }
    if let Some(name) = &scene.moments {
        channels.extend(moments::channels(film, name));
    }
    Ok(channels)
}

/// Says that there are doubts about the scene, and where to read them.
fn doubts(args: &RenderArgs, scene: &Scene) {
    let count = tyndall::scene::check::doubts(scene).len();
    let plural = if count == 1 { "" } else { "s" };
    if count > 0 {
        let path = args.scene.display();
        super::say(format_args!("warning: {count} doubt{plural} about the scene; `tyndall check {path}` lists them"));
    }
}

/// Hours of rendering should not end in an error that could be seen before, nor in the loss of the scene.
fn check_paths(args: &RenderArgs, output: &Path) -> Result<(), CliError> {
    image::check_writable(output)?;
    if !output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr")) {
        return Err(CliError::Usage(format!(
            "the image {} does not end in .exr: images are OpenEXR files; --preview OUT.png writes a PNG as well",
            output.display()
        )));
    }
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

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use clap::Parser;
    use glam::DVec3;
    use tyndall::render::{BackendError, Block, DeviceInfo};
    use tyndall::scene::{Camera, Film};

    use super::super::args::{Cli, Command};
    use super::*;

    /// A device whose every sample is `value`, and which says that `invalid` of a block were invalid.
    struct Flat {
        device: DeviceInfo,
        value: f32,
        invalid: [u64; 3],
        lost: bool,
    }

    impl Backend for Flat {
        fn device(&self) -> &DeviceInfo {
            &self.device
        }

        fn render(&mut self, samples: Range<u32>) -> Result<Vec<Block>, BackendError> {
            if self.lost {
                return Err(BackendError { device: "flat".to_owned(), cause: "lost".to_owned() });
            }
            let block = |first: u32| {
                let count = 16.min(samples.end - first);
                let sum = vec![[count as f32 * self.value; 3]; 6];
                let (counts, invalid) = (vec![count; 6], self.invalid);
                Block { first, count, counts, squares: sum.clone(), sums: sum, invalid, ..Block::default() }
            };
            Ok(samples.clone().step_by(16).map(block).collect())
        }

        fn allocate(&mut self, _trial: u32) -> Result<(), BackendError> {
            Ok(())
        }
    }

    /// Renders 3×2 pixels into a file and returns its path as well, in a directory that goes with it.
    fn render_flat(
        value: f32,
        invalid: [u64; 3],
        lost: bool,
        interrupted: bool,
    ) -> (Result<ExitCode, CliError>, std::path::PathBuf, tempfile::TempDir) {
        let directory = tempfile::tempdir().unwrap();
        let output = directory.path().join("a.exr");
        let Command::Render(args) = Cli::try_parse_from(["tyndall", "render", "a.xml", "-q"]).unwrap().command else {
            unreachable!()
        };
        let scene = Scene::new(Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, 40.0), Film::new(3, 2));
        let device = DeviceInfo { name: "flat".to_owned(), driver: "none".to_owned() };
        let mut backend = Flat { device, value, invalid, lost };
        let result = render(&args, &scene, 40, &mut backend, &AtomicBool::new(interrupted), &output);
        (result, output, directory)
    }

    /// Exit codes can be printed but not compared.
    fn code(result: Result<ExitCode, CliError>) -> String {
        format!("{:?}", result.unwrap_or_else(|error| error.exit_code()))
    }

    #[test]
    fn a_good_render_succeeds() {
        let (result, output, _directory) = render_flat(0.5, [0; 3], false, false);
        assert_eq!(code(result), format!("{:?}", ExitCode::SUCCESS));
        assert_eq!(exr::read(&output).unwrap().channel("G"), Some([0.5; 6].as_slice()));
    }

    #[test]
    fn an_interrupted_render_writes_what_it_has() {
        let (result, output, _directory) = render_flat(0.5, [0; 3], false, true);
        assert_eq!(code(result), format!("{:?}", ExitCode::from(75)));
        assert_eq!(exr::read(&output).unwrap().channel("sampleCount"), Some([16.0; 6].as_slice()));
    }

    #[test]
    fn invalid_samples_fail_the_render_after_the_image_is_written() {
        for interrupted in [false, true] {
            let (result, output, _directory) = render_flat(f32::NAN, [2, 0, 0], false, interrupted);
            let blocks = if interrupted { 1 } else { 3 };
            assert!(matches!(result, Err(CliError::InvalidSamples { counts, .. }) if counts == [2 * blocks, 0, 0]));
            assert_eq!(code(result), format!("{:?}", ExitCode::from(1)));
            assert!(exr::read(&output).unwrap().channel("R").unwrap()[0].is_nan());
        }
    }

    #[test]
    fn a_lost_device_fails_the_render() {
        let (result, output, _directory) = render_flat(0.5, [0; 3], true, false);
        assert_eq!(code(result), format!("{:?}", ExitCode::from(1)));
        assert!(!output.exists());
    }
}
