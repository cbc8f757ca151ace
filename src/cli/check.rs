//! `tyndall check`: what is in a scene, and what is doubtful about it.

use std::process::ExitCode;

use tyndall::scene::check;

use super::args::CheckArgs;
use super::error::CliError;
use super::{backend, report};

/// Reads a scene, makes its tables, and prints the report. A scene that cannot be rendered is an error; one that is only
/// doubtful is not, unless it was asked for.
pub fn run(args: &CheckArgs) -> Result<ExitCode, CliError> {
    let loaded = backend::load(&args.scene, &args.overrides)?;
    let packed = backend::pack(&loaded.scene, 0)?;
    let warnings = [loaded.warnings, packed.warnings.clone()].concat();
    let doubts = check::doubts(&loaded.scene);
    let scene = args.scene.display().to_string();
    let report = report::of(&scene, &loaded.scene, &packed, &warnings, &doubts);
    let text = if args.json { format!("{report:#}\n") } else { report::text(&report) };
    super::print_result(&text)?;
    let doubtful = !(warnings.is_empty() && doubts.is_empty());
    Ok(if args.strict && doubtful { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}
