//! Why a scene cannot be used: one error type, and the places in files that it points to.

use std::fmt;
use std::sync::Arc;

/// Why a scene file cannot be rendered.
///
/// Every variant but the first says where the fault is as `file:line:col`, with lines and columns that count from 1.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The scene file itself cannot be read.
    #[error("{file}: cannot read the scene: {cause}")]
    Unreadable {
        /// The path as it was given.
        file: String,
        /// What the operating system says.
        cause: std::io::Error,
    },
    /// A fault in the scene description.
    #[error("{file}:{line}:{col}: {message}")]
    Invalid {
        /// Scene file, or the file that it includes.
        file: String,
        /// Line, from 1.
        line: u32,
        /// Column in characters, from 1.
        col: u32,
        /// What is wrong, and what is accepted instead.
        message: String,
    },
    /// A fault in a file that the scene names, such as a mesh.
    #[error("{file}:{line}:{col}: {message} (used at {used_at})")]
    Asset {
        /// The mesh file.
        file: String,
        /// Line, from 1.
        line: u32,
        /// Column in bytes, from 1.
        col: u32,
        /// What is wrong, and what is accepted instead.
        message: String,
        /// `file:line:col` of the element in the scene that names the file.
        used_at: String,
    },
    /// A `-D name=value` that the scene has no use for.
    #[error("-D {name}: {message}")]
    Override {
        /// The name that was to be overridden.
        name: String,
        /// What is wrong, and which names there are.
        message: String,
    },
}

/// A place in a scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Location {
    /// The file as it is called in messages.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub col: u32,
}

impl Location {
    /// The error that something at this place is wrong.
    pub fn error(&self, message: impl Into<String>) -> SceneError {
        SceneError::Invalid { file: self.file.to_string(), line: self.line, col: self.col, message: message.into() }
    }

    /// A warning about this place, in the form of an error message.
    pub fn warning(&self, message: impl fmt::Display) -> String {
        format!("{self}: {message}")
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.col)
    }
}
