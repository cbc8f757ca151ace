//! What can go wrong, and the exit code that tells scripts which of it did.

use std::path::PathBuf;
use std::process::ExitCode;

use tyndall::image::ImageError;
use tyndall::image::metrics::MetricsError;
use tyndall::render::{BackendError, INVALID_CAUSES};

/// Exit code of a render that was interrupted: the image is written but has fewer samples than asked for.
pub const STOPPED_EARLY: u8 = 75;

/// The reasons for an exit code other than 0 and [`STOPPED_EARLY`].
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The arguments contradict each other or the scene.
    #[error("{0}")]
    Usage(String),
    /// The scene cannot be read or rendered; the message names file and line.
    #[error("{0}")]
    Scene(String),
    /// No device of the asked-for kind works.
    #[error("{0}")]
    NoDevice(String),
    /// The device failed while it rendered.
    #[error("{0}")]
    Backend(#[from] BackendError),
    /// Some samples were not what a sample can be. The image has been written.
    #[error("{}; {} has been written but is spoilt", invalid_samples(counts), path.display())]
    InvalidSamples {
        /// Number of samples for each of [`INVALID_CAUSES`].
        counts: [u64; INVALID_CAUSES.len()],
        /// The image.
        path: PathBuf,
    },
    /// A picture could not be read or written.
    #[error("{0}")]
    Image(#[from] ImageError),
    /// Two pictures cannot be compared.
    #[error("cannot compare: {0}")]
    Metrics(#[from] MetricsError),
    /// The results could not be printed.
    #[error("cannot write to standard output: {0}")]
    Output(std::io::Error),
    /// The handlers of SIGINT and SIGTERM could not be set.
    #[error("cannot handle signals: {0}")]
    Signals(std::io::Error),
}

impl CliError {
    /// 1 failed, 2 usage or scene, 69 no device, 74 input or output (the last two as in BSD's `sysexits.h`).
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            CliError::Usage(_) | CliError::Scene(_) => 2,
            CliError::Metrics(MetricsError::NotFinite { .. }) => 1,
            CliError::Metrics(_) => 2,
            CliError::NoDevice(_) => 69,
            CliError::Backend(_) | CliError::InvalidSamples { .. } | CliError::Signals(_) => 1,
            CliError::Image(_) | CliError::Output(_) => 74,
        })
    }
}

/// "3 invalid samples (2 with NaN radiance, 1 with negative radiance)".
pub fn invalid_samples(counts: &[u64; INVALID_CAUSES.len()]) -> String {
    let total: u64 = counts.iter().sum();
    let causes: Vec<String> = (counts.iter().zip(INVALID_CAUSES))
        .filter(|(count, _)| **count > 0)
        .map(|(count, cause)| format!("{count} with {cause}"))
        .collect();
    let plural = if total == 1 { "" } else { "s" };
    match total {
        0 => "no invalid samples".to_owned(),
        _ => format!("{total} invalid sample{plural} ({})", causes.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_samples_are_named_by_cause() {
        assert_eq!(invalid_samples(&[0; 3]), "no invalid samples");
        assert_eq!(invalid_samples(&[0, 1, 0]), "1 invalid sample (1 with infinite radiance)");
        let error = CliError::InvalidSamples { counts: [2, 0, 5], path: "a.exr".into() };
        let expected =
            "7 invalid samples (2 with NaN radiance, 5 with negative radiance); a.exr has been written but is spoilt";
        assert_eq!(error.to_string(), expected);
        assert_eq!(format!("{:?}", error.exit_code()), format!("{:?}", ExitCode::from(1)));
    }
}
