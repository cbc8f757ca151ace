//! The command line: one module for each command, and what they share.
//!
//! Standard output carries results only (the table of `compare`, the list of `devices`, the report of `check`); progress, warnings and errors go
//! to standard error. Errors are printed in one place, in `main`.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

use clap::Parser;

mod args;
mod backend;
mod check;
mod compare;
mod devices;
mod error;
mod interrupt;
mod progress;
mod render;
mod report;

use args::{Cli, Command};
pub use error::CliError;

/// Does what the command line asks for. A command line that cannot be understood ends the program with exit code 2.
pub fn run() -> Result<ExitCode, CliError> {
    let command = Cli::parse().command;
    log_to_stderr(matches!(&command, Command::Render(args) if args.quiet));
    match command {
        Command::Render(args) => render::run(&args),
        Command::Devices => devices::run(),
        Command::Compare(args) => compare::run(&args),
        Command::Check(args) => check::run(&args),
    }
}

/// Shows what the library reports on the way: warnings and errors, or errors alone.
fn log_to_stderr(quiet: bool) {
    let level = if quiet { tracing::Level::ERROR } else { tracing::Level::WARN };
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .without_time()
        .with_target(false)
        .init();
}

/// A line on standard error. If nobody reads it, nobody misses it.
pub fn say(line: Arguments) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Writes a result to standard output. A reader that has seen enough, such as `head`, is not an error.
fn print_result(text: &str) -> Result<(), CliError> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(CliError::Output(error)),
        _ => Ok(()),
    }
}
