//! The `tyndall` program: see `tyndall --help`.

use std::process::ExitCode;

mod cli;

fn main() -> ExitCode {
    match cli::run() {
        Ok(code) => code,
        Err(error) => {
            cli::say(format_args!("error: {error}"));
            error.exit_code()
        }
    }
}
