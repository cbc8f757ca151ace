//! `tyndall compare`: a table of error measures.

use std::fmt::Write;
use std::process::ExitCode;

use tyndall::image::exr;
use tyndall::image::metrics::{Comparison, compare};

use super::args::CompareArgs;
use super::error::CliError;

/// Compares two images and prints the result.
pub fn run(args: &CompareArgs) -> Result<ExitCode, CliError> {
    let comparison = compare(&exr::read(&args.image)?, &exr::read(&args.reference)?)?;
    super::print_result(&table(&comparison))?;
    Ok(ExitCode::SUCCESS)
}

fn table(comparison: &Comparison) -> String {
    let mut text = String::new();
    let values =
        [("MSE", comparison.mse), ("relMSE", comparison.rel_mse), ("trimmed relMSE", comparison.trimmed_rel_mse)];
    for (name, value) in values {
        writeln!(text, "{name:<15} {value:>14.6e}").expect("a string takes any text");
    }
    writeln!(text, "{:<15} {:>12.3} %", "agree to 1e-3", 100.0 * comparison.agreement)
        .expect("a string takes any text");
    writeln!(text, "\n{:<15} {:>14} {:>14} {:>14} {:>10}", "channel", "mean", "reference", "difference", "z")
        .expect("a string takes any text");
    let [r, g, b] = comparison.channels;
    for (name, row) in [("R", r), ("G", g), ("B", b), ("mean", comparison.mean)] {
        let (mean, reference, difference, z) = (row.image, row.reference, row.difference, row.z);
        writeln!(text, "{name:<15} {mean:>14.6e} {reference:>14.6e} {difference:>14.6e} {z:>10.3}")
            .expect("a string takes any text");
    }
    text
}
