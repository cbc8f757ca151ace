//! Mitsuba 3's part: a child process for each configuration and seed, which renders the same scene file.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;
use tyndall::image::exr;

use super::arguments::Arguments;
use super::case::Case;
use super::error::BenchError;
use super::results::{Budget, Run, Time};

/// Depth at which roulette may begin in `volpathmis`, which loses energy when it begins early.
const VOLPATHMIS_RR_DEPTH: u32 = 64;

/// Mitsuba's samplers that are worth trying.
const SAMPLERS: [&str; 3] = ["independent", "multijitter", "ldsampler"];

/// Mitsuba in some Python.
pub struct Mitsuba {
    python: PathBuf,
    variants: Vec<String>,
    /// Only configurations whose name contains this.
    filter: String,
    /// Name and version.
    pub version: String,
    /// Pictures on their way, and the home that holds Mitsuba's cache: empty in the beginning.
    folder: TempDir,
}

/// How Mitsuba renders.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Configuration {
    variant: String,
    integrator: &'static str,
    sampler: &'static str,
    /// Lights are sampled in media; without, paths that scatter there find them by chance.
    sample_emitters: bool,
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Configuration { variant, integrator, sampler, sample_emitters } = self;
        write!(f, "{variant} {integrator} {sampler}")?;
        if *sample_emitters { Ok(()) } else { write!(f, " without emitter sampling") }
    }
}

impl Mitsuba {
    /// Finds out whether Mitsuba can be used at all.
    pub fn new(arguments: &Arguments) -> Result<Mitsuba, BenchError> {
        let failed = |cause: String| BenchError::Child { what: "the search for Mitsuba".to_owned(), cause };
        let mut mitsuba = Mitsuba {
            python: arguments.python.clone(),
            variants: arguments.variants.clone(),
            filter: arguments.configurations.clone(),
            version: String::new(),
            folder: tempfile::tempdir().map_err(|error| failed(error.to_string()))?,
        };
        let mut command = mitsuba.command();
        let answer = mitsuba.ask(command.arg("--version"), "the search for Mitsuba".to_owned())?;
        mitsuba.version = format!("Mitsuba {}", answer[0]["version"].as_str().unwrap_or("of unknown version"));
        Ok(mitsuba)
    }

    /// All configurations that are sensible for a scene.
    pub fn configurations(&self, case: &Case) -> Vec<Configuration> {
        let integrators: &[&str] = if case.has_media() { &["volpath", "volpathmis"] } else { &["path", "volpath"] };
        // Light sampling finds nothing behind glass, and takes time.
        let emitter_sampling: &[bool] = if case.has_media() && case.has_glass() { &[true, false] } else { &[true] };
        let mut configurations = Vec::new();
        for variant in &self.variants {
            for &integrator in integrators {
                for sampler in SAMPLERS {
                    for &sample_emitters in emitter_sampling {
                        let variant = variant.clone();
                        configurations.push(Configuration { variant, integrator, sampler, sample_emitters });
                    }
                }
            }
        }
        configurations.retain(|configuration| configuration.to_string().contains(&self.filter));
        configurations
    }

    /// One picture for each budget.
    pub fn measure(
        &self,
        case: &Case,
        configuration: &Configuration,
        seed: u32,
        budgets: &[Budget],
    ) -> Result<Vec<Run>, BenchError> {
        let film = &case.scene.film;
        let budget_texts: Vec<String> = budgets
            .iter()
            .map(|budget| match budget {
                Budget::Samples(spp) => format!("spp:{spp}"),
                Budget::Seconds(seconds) => format!("seconds:{seconds}"),
            })
            .collect();
        let mut command = self.command();
        command
            .arg("--scene")
            .arg(&case.path)
            .args(["--variant", &configuration.variant])
            .args(["--integrator", configuration.integrator])
            .args(["--sampler", configuration.sampler])
            .args(["--size", &format!("{}x{}", film.width, film.height)])
            .args(["--seed", &seed.to_string()])
            .args(["--budgets", &budget_texts.join(",")])
            .arg("--output")
            .arg(self.folder.path());
        if configuration.integrator == "volpathmis" {
            command.args(["--rr-depth", &VOLPATHMIS_RR_DEPTH.to_string()]);
        }
        if !configuration.sample_emitters {
            command.arg("--no-emitter-sampling");
        }
        let what = format!("Mitsuba ({configuration}) on {}", case.name);
        let answers = self.ask(&mut command, what.clone())?;
        if answers.len() != budgets.len() {
            let cause = format!("{} pictures for {} budgets", answers.len(), budgets.len());
            return Err(BenchError::Child { what, cause });
        }
        answers.iter().enumerate().map(|(budget, answer)| read_run(budget, answer, &what)).collect()
    }

    fn command(&self) -> Command {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/mitsuba_render.py");
        let mut command = Command::new(&self.python);
        // Dr.Jit keeps what it compiled in its user's home.
        command.arg(script).env("HOME", self.folder.path());
        command
    }

    /// Runs the child and returns the JSON values that it printed, one a line.
    fn ask(&self, command: &mut Command, what: String) -> Result<Vec<Value>, BenchError> {
        let failed = |cause: String| BenchError::Child { what, cause };
        let output = match command.output() {
            Ok(output) => output,
            Err(error) => return Err(failed(format!("{}: {error}", self.python.display()))),
        };
        let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        if !output.status.success() {
            let last: Vec<&str> = stderr.lines().rev().take(12).collect();
            return Err(failed(last.into_iter().rev().collect::<Vec<_>>().join("\n")));
        }
        // Mitsuba's own messages come on standard output as well.
        let answers: Vec<Value> = stdout.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        if answers.is_empty() { Err(failed(format!("it said {stdout:?}"))) } else { Ok(answers) }
    }
}

fn read_run(budget: usize, answer: &Value, what: &str) -> Result<Run, BenchError> {
    let number = |name: &str| {
        let missing =
            || BenchError::Child { what: what.to_owned(), cause: format!("its answer has no {name}: {answer}") };
        answer[name].as_f64().ok_or_else(missing)
    };
    let path = PathBuf::from(answer["image"].as_str().unwrap_or_default());
    let image = exr::read(&path)?;
    // Kept pictures would fill the disk in a long run. If this one stays, it goes with its folder.
    let _ = std::fs::remove_file(&path);
    Ok(Run {
        budget,
        spp: number("spp")? as u32,
        image,
        time: Time { wall: number("wall")?, cpu: number("cpu")? },
        start_up: Some(Time { wall: number("start_wall")?, cpu: number("start_cpu")? }),
    })
}
