//! SIGINT and SIGTERM: the first asks for an early but regular end, the second ends the program at once.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::error::CliError;

/// A flag that the first of the two signals raises. Once it is up, either signal has its default effect.
pub fn flag() -> Result<Arc<AtomicBool>, CliError> {
    let interrupt = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // Handlers run in the order of their registration, so the first signal finds the flag down.
        flag::register_conditional_default(signal, Arc::clone(&interrupt)).map_err(CliError::Signals)?;
        flag::register(signal, Arc::clone(&interrupt)).map_err(CliError::Signals)?;
    }
    Ok(interrupt)
}
