//! `tyndall devices`: what `--device` can name.

use std::fmt::Write;
use std::process::ExitCode;

use super::backend;
use super::error::CliError;

/// Prints a line for each device: number, name, kind, driver, and why it cannot be used if so.
pub fn run() -> Result<ExitCode, CliError> {
    let mut text = String::new();
    for (index, device) in backend::list()?.iter().enumerate() {
        let doubt = device.unusable.as_ref().map_or(String::new(), |reason| format!("  [unusable: {reason}]"));
        writeln!(text, "{index:<9}  {}  ({}, {}){doubt}", device.info.name, device.kind, device.info.driver)
            .expect("a string takes any text");
    }
    writeln!(text, "reference  the CPU, in double precision").expect("a string takes any text");
    super::print_result(&text)?;
    Ok(ExitCode::SUCCESS)
}
