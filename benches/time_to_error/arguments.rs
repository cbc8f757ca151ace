//! The arguments, and the budgets that they name.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};

use super::results::Budget;

/// Error against time, of Tyndall and of other renderers on the same scene files.
#[derive(Debug, Parser)]
#[command(name = "time_to_error")]
pub struct Arguments {
    /// Folder of scenes; `refs/NAME.exr` and `refs/NAME.json` in it are the references
    #[arg(long, value_name = "FOLDER", default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes"))]
    pub scenes: PathBuf,
    /// Only the scenes of these names; may be repeated
    #[arg(long = "scene", value_name = "NAME")]
    pub only: Vec<String>,
    /// Budgets: samples for each pixel. Squares suit the samplers of other renderers
    #[arg(long, value_name = "N,N,…", value_delimiter = ',', default_values_t = [4, 16, 64, 256],
          value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub spp: Vec<u32>,
    /// Budgets in seconds, instead of --spp
    #[arg(long, value_name = "S,S,…", value_delimiter = ',', value_parser = parse_seconds)]
    pub seconds: Vec<f64>,
    /// Pictures for each scene, budget and configuration
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub seeds: u32,
    /// Device, as `tyndall render --device` takes it
    #[arg(long, value_name = "NAME|INDEX", default_value = "auto")]
    pub device: String,
    /// Render references with this many samples a pixel, and measure nothing
    #[arg(long, value_name = "SPP", value_parser = clap::value_parser!(u32).range(64..=1 << 24))]
    pub make_references: Option<u32>,
    /// Longest side of the references that are made, in pixels; they have the shape of the scene's film
    #[arg(long, value_name = "PIXELS", default_value_t = 128, value_parser = clap::value_parser!(u32).range(16..=8192))]
    pub reference_size: u32,
    /// Also render without each part that lowers the error or the time, to see what it is worth
    #[arg(long)]
    pub levers: bool,
    /// Another renderer that takes part
    #[arg(long, value_name = "NAME")]
    pub peer: Option<Peer>,
    /// The Python that has the other renderer: see benches/peers/setup-mitsuba.sh
    #[arg(long, value_name = "PATH", default_value = "python3")]
    pub python: PathBuf,
    /// Variants of the other renderer
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_values_t = ["llvm_ad_rgb".to_owned()])]
    pub variants: Vec<String>,
    /// Only configurations of the other renderer whose name contains this
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub configurations: String,
    /// Folder for the results [default: docs/benchmarks, and the table goes into docs/BENCHMARKS.md]
    #[arg(long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Cargo says so when it runs a benchmark.
    #[arg(long = "bench", hide = true)]
    pub under_cargo_bench: bool,
    /// What a child process does: start, render one sample, and end.
    #[arg(long, hide = true, value_name = "SCENE.xml")]
    pub start_up: Option<PathBuf>,
}

/// Other renderers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Peer {
    /// Mitsuba 3.
    Mitsuba,
}

impl Arguments {
    /// The budgets in the order in which they were named.
    pub fn budgets(&self) -> Vec<Budget> {
        if self.seconds.is_empty() {
            self.spp.iter().map(|&spp| Budget::Samples(spp)).collect()
        } else {
            self.seconds.iter().map(|&seconds| Budget::Seconds(seconds)).collect()
        }
    }
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse::<f64>().map_err(|error| error.to_string())?;
    if seconds > 0.0 && seconds <= 86_400.0 { Ok(seconds) } else { Err("seconds lie between 0 and 86400".to_owned()) }
}
