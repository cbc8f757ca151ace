//! Files: where they are found, their text, and lines and columns in it.

use std::path::PathBuf;
use std::sync::Arc;

use crate::scene::SceneError;
use crate::scene::error::Location;

/// The first of `folders` that has the file; the nearest one if none has it.
pub(super) fn find<'a>(name: &str, folders: impl Iterator<Item = &'a PathBuf>) -> PathBuf {
    let mut nearest = None;
    for folder in folders {
        let path = folder.join(name);
        if path.exists() {
            return path;
        }
        nearest.get_or_insert(path);
    }
    nearest.unwrap_or_else(|| PathBuf::from(name))
}

/// Bytes as text; a byte that is not UTF-8 is an error with its place.
pub(super) fn read_text<'a>(bytes: &'a [u8], file: &str) -> Result<&'a str, SceneError> {
    std::str::from_utf8(bytes).map_err(|error| {
        let good = std::str::from_utf8(&bytes[..error.valid_up_to()]).expect("valid up to here");
        Source::new(good, file).location(good.len()).error("the file is not UTF-8 text")
    })
}

/// A text with an index of its lines.
pub(super) struct Source<'a> {
    pub text: &'a str,
    file: Arc<str>,
    /// Byte offsets at which lines start.
    lines: Vec<usize>,
}

impl<'a> Source<'a> {
    /// `file` is what the text is called in messages.
    pub fn new(text: &'a str, file: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(offset, _)| offset + 1);
        Source { text, file: file.into(), lines: std::iter::once(0).chain(ends).collect() }
    }

    /// Line and column of a byte offset.
    pub fn location(&self, offset: usize) -> Location {
        let offset = offset.min(self.text.len());
        let line = self.lines.partition_point(|start| *start <= offset) - 1;
        let before = self.text.get(self.lines[line]..offset).unwrap_or_default();
        Location { file: self.file.clone(), line: line as u32 + 1, col: before.chars().count() as u32 + 1 }
    }

    /// The parser's complaint about text that is not XML.
    pub fn syntax_error(&self, error: &roxmltree::Error) -> SceneError {
        let pos = error.pos();
        let message = error.to_string();
        let message = message.strip_suffix(&format!(" at {pos}")).unwrap_or(&message);
        let at = Location { file: self.file.clone(), line: pos.row, col: pos.col };
        at.error(format!("not well-formed XML: {message}"))
    }
}
