//! What can go wrong in a benchmark.

use std::path::{Path, PathBuf};

use tyndall::image::{ImageError, metrics::MetricsError, write_whole};

/// A benchmark that could not be run.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The arguments, or the folder of scenes, are not as they should be.
    #[error("{0}")]
    Usage(String),
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which one.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Which one.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A picture cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A picture cannot be compared with the reference.
    #[error("{what}: {cause}")]
    Metrics {
        /// Whose picture.
        what: String,
        /// Why not.
        cause: MetricsError,
    },
    /// Tyndall cannot render the scene.
    #[error("{scene}: {cause}")]
    Render {
        /// Which scene.
        scene: String,
        /// What it said.
        cause: String,
    },
    /// The other renderer, or a child process of ours, failed.
    #[error("{what} failed: {cause}")]
    Child {
        /// What was to be done.
        what: String,
        /// The last of what it said.
        cause: String,
    },
    /// The plot cannot be drawn.
    #[error("the plot cannot be drawn: {0}")]
    Plot(String),
}

/// Writes a text file, whole or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<(), BenchError> {
    Ok(write_whole(path, |file| std::io::Write::write_all(file, text.as_bytes()))?)
}
