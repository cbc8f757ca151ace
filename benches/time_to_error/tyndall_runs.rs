//! Tyndall's part: renders with the library as the program does, and takes the time.

use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};
use tyndall::gpu::{Device, DeviceChoice, Renderer};
use tyndall::image::Image;
use tyndall::pack::Packed;
use tyndall::pack::layout::MEDIUM_SEALED;
use tyndall::render::session::{self, Options};
use tyndall::render::{Backend, picture};
use tyndall::scene::{Crop, Scene};
use tyndall::seen::{Seen, with_seen};
use tyndall::{guide, pilot};

use super::arguments::Arguments;
use super::case::{Case, load_scene};
use super::error::BenchError;
use super::results::{Budget, Run, Time};

/// Samples after which even a budget in seconds ends.
const MOST_SAMPLES: u32 = 1 << 30;

/// What a picture is rendered without, to see what it is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lever {
    /// Nothing: as the program renders.
    All,
    /// Without the pilot run: no roulette by it, and no paths that pixels share.
    NoPilot,
    /// With paths of its own for each pixel.
    NoSharing,
    /// With the plain mean of what pixels share.
    NoReconstruction,
    /// With all lamps that the camera sees left to paths.
    NoSeen,
    /// With all primitives in the tree.
    NoImmediates,
    /// Without equiangular distances and directions past lamps.
    NoEquiangular,
    /// With light sampled in media that no shadow ray leaves.
    NoSeals,
    /// Without probes through glass.
    NoGuides,
    /// With the same number of samples in each pixel.
    NoAllocation,
}

impl Lever {
    /// All of them, the whole program first.
    pub const LEVERS: [Lever; 10] = [
        Lever::All,
        Lever::NoPilot,
        Lever::NoSharing,
        Lever::NoReconstruction,
        Lever::NoSeen,
        Lever::NoImmediates,
        Lever::NoEquiangular,
        Lever::NoSeals,
        Lever::NoGuides,
        Lever::NoAllocation,
    ];

    /// Its name in the results.
    pub fn name(self) -> &'static str {
        match self {
            Lever::All => "default",
            Lever::NoPilot => "no pilot",
            Lever::NoSharing => "no sharing",
            Lever::NoReconstruction => "no reconstruction",
            Lever::NoSeen => "lamps left to paths",
            Lever::NoImmediates => "all in the tree",
            Lever::NoEquiangular => "no equiangular",
            Lever::NoSeals => "no seals",
            Lever::NoGuides => "no guides",
            Lever::NoAllocation => "no allocation",
        }
    }

    /// The tables without it, or nothing if the scene had no use for it.
    fn pull(self, packed: Packed) -> Option<Packed> {
        let useful = match self {
            Lever::All | Lever::NoPilot | Lever::NoAllocation => true,
            Lever::NoSharing | Lever::NoReconstruction => pilot::can_share_paths(&packed),
            Lever::NoSeen => packed.primitives.iter().any(|primitive| primitive.light != 0),
            Lever::NoImmediates => packed.immediate_count > 0,
            Lever::NoEquiangular => packed.features.equiangular,
            Lever::NoSeals | Lever::NoGuides => packed.features.sealed,
        };
        let mut packed = match self {
            Lever::NoImmediates => packed.with_immediates(0),
            _ => packed,
        };
        match self {
            Lever::NoEquiangular => {
                packed.media.iter_mut().for_each(|medium| medium.equiangular = 0.0);
                packed.features.equiangular = false;
            }
            Lever::NoSeals => {
                packed.media.iter_mut().for_each(|medium| medium.grids &= !MEDIUM_SEALED);
                packed.features.sealed = false;
            }
            _ => {}
        }
        useful.then_some(packed)
    }
}

/// The device that is measured.
pub struct OurDevice {
    device: Arc<Device>,
}

/// What it takes to start: from the start of the program until the first sample is there.
pub struct StartUps {
    /// With all caches empty, as on the first render of a scene.
    pub cold: Time,
    /// With the caches that the first left.
    pub warm: Time,
}

impl OurDevice {
    /// Opens the device that `choice` names, as `tyndall render --device` does.
    pub fn open(choice: &str) -> Result<OurDevice, BenchError> {
        let choice = match (choice, choice.parse()) {
            ("auto", _) => DeviceChoice::Best,
            (_, Ok(index)) => DeviceChoice::Index(index),
            (name, Err(_)) => DeviceChoice::Name(name.to_owned()),
        };
        let device = Device::open(&choice).map_err(|error| BenchError::Usage(error.to_string()))?;
        Ok(OurDevice { device })
    }

    /// Name and driver.
    pub fn description(&self) -> String {
        format!("{} ({})", self.device.info.name, self.device.info.driver)
    }

    /// Prepares a scene, or nothing if it has no use for the lever. The first sample is rendered as well, for drivers compile when they
    /// first run a kernel.
    pub fn renderer<'a>(
        &self,
        name: &'a str,
        scene: &'a Scene,
        seed: u32,
        lever: Lever,
    ) -> Result<Option<Ready<'a>>, BenchError> {
        let error = |cause: String| BenchError::Render { scene: name.to_owned(), cause };
        let packed = Packed::new(scene, seed).map_err(|cause| error(cause.to_string()))?;
        let Some(mut packed) = lever.pull(packed) else { return Ok(None) };
        let (begin, begin_cpu) = (Instant::now(), cpu_time());
        let mut seen = None;
        if lever != Lever::NoGuides {
            guide::run(&mut packed);
        }
        if lever != Lever::NoPilot {
            pilot::run(&mut packed, lever != Lever::NoSharing);
            seen = if lever == Lever::NoSeen { None } else { Seen::find(&mut packed) };
        }
        let pilot = Time { wall: begin.elapsed().as_secs_f64(), cpu: cpu_time() - begin_cpu };
        let renderer = Renderer::new(&self.device, &packed).map_err(|cause| error(cause.to_string()))?;
        let mut backend = with_seen(renderer, seen);
        backend.render(0..1).map_err(|cause| error(cause.to_string()))?;
        Ok(Some(Ready { name, scene, seed, lever, backend, pilot }))
    }

    /// One picture for each budget.
    pub fn measure(
        &self,
        case: &Case,
        seed: u32,
        budgets: &[Budget],
        start_up: Option<Time>,
        lever: Lever,
    ) -> Result<Vec<Run>, BenchError> {
        let Some(mut renderer) = self.renderer(&case.name, &case.scene, seed, lever)? else { return Ok(Vec::new()) };
        let run = |(index, &budget): (usize, &Budget)| {
            let (image, spp, time) = renderer.render(budget)?;
            Ok(Run { budget: index, spp, image, time, start_up })
        };
        budgets.iter().enumerate().map(run).collect()
    }

    /// Measures two starts of a process of its own: all that a render costs beside its samples.
    pub fn start_ups(&self, case: &Case, arguments: &Arguments) -> Result<StartUps, BenchError> {
        let what = || format!("a start with {}", case.name);
        let failed = |cause: String| BenchError::Child { what: what(), cause };
        let caches = tempfile::tempdir().map_err(|error| failed(error.to_string()))?;
        let program = std::env::current_exe().map_err(|error| failed(error.to_string()))?;
        let start = || {
            let begin = Instant::now();
            let output = Command::new(&program)
                .args(["--device", &arguments.device, "--start-up"])
                .arg(&case.path)
                .env("XDG_CACHE_HOME", caches.path())
                .env("MESA_SHADER_CACHE_DIR", caches.path().join("mesa"))
                .output()
                .map_err(|error| failed(error.to_string()))?;
            let wall = begin.elapsed().as_secs_f64();
            if !output.status.success() {
                return Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()));
            }
            let text = String::from_utf8_lossy(&output.stdout);
            let cpu = text.trim().parse().map_err(|_| failed(format!("it said {text:?}")))?;
            Ok(Time { wall, cpu })
        };
        Ok(StartUps { cold: start()?, warm: start()? })
    }
}

/// What the child process of [`OurDevice::start_ups`] does: renders one sample of one pixel, and prints the CPU time of its life.
pub fn start_up_child(path: &Path, arguments: &Arguments) -> Result<(), BenchError> {
    let mut scene = load_scene(path)?;
    scene.film.crop = Crop { x: scene.film.width / 2, y: scene.film.height / 2, width: 1, height: 1 };
    OurDevice::open(&arguments.device)?.renderer("the scene", &scene, 0, Lever::All)?;
    println!("{}", cpu_time());
    Ok(())
}

/// A scene on the device, compiled.
pub struct Ready<'a> {
    name: &'a str,
    scene: &'a Scene,
    seed: u32,
    lever: Lever,
    backend: Box<dyn Backend>,
    /// What the pilot run took.
    pilot: Time,
}

impl Ready<'_> {
    /// Renders a picture, and returns it with the samples of each pixel and the time that they took, the pilot's included.
    pub fn render(&mut self, budget: Budget) -> Result<(Image, u32, Time), BenchError> {
        let allocate = self.lever != Lever::NoAllocation;
        let options = match budget {
            Budget::Samples(spp) => Options { samples: 0..spp, time_limit: None, allocate },
            Budget::Seconds(seconds) => {
                Options { samples: 0..MOST_SAMPLES, time_limit: Some(Duration::from_secs_f64(seconds)), allocate }
            }
        };
        let error = |cause: String| BenchError::Render { scene: self.name.to_owned(), cause };
        let crop = self.scene.film.crop;
        let pixels = crop.width as usize * crop.height as usize;
        let (begin, begin_cpu) = (Instant::now(), cpu_time());
        let mut rendered = session::render(&mut *self.backend, pixels, &options, &AtomicBool::new(false), &mut |_| {})
            .map_err(|cause| error(cause.to_string()))?;
        if self.lever == Lever::NoReconstruction {
            rendered.film.forget_shared();
        }
        let image = picture::assemble(self.scene, &rendered, self.backend.device(), self.seed);
        let (wall, cpu) = (begin.elapsed().as_secs_f64(), cpu_time() - begin_cpu);
        let time = Time { wall: wall + self.pilot.wall, cpu: cpu + self.pilot.cpu };
        let invalid: u64 = rendered.film.invalid().iter().sum();
        if invalid > 0 {
            return Err(error(format!("{invalid} samples are not finite")));
        }
        Ok((image, rendered.film.samples(), time))
    }
}

/// Seconds that all cores have spent on this process.
fn cpu_time() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
