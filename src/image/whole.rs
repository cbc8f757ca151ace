//! Files that appear whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::ImageError;

/// Writes a file so that a reader sees either the old contents or all of the new ones, whatever happens in between.
///
/// `write` fills a temporary file in the same directory, which is then flushed to the disk and renamed. The file has the
/// permissions of any newly created file; a symbolic link is followed and stays. A target that exists and is not a
/// regular file (`/dev/null`, say) is an error, because the renaming would replace it.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<(), ImageError> {
    try_write(path, write).map_err(|source| ImageError::Write { path: path.to_owned(), source })
}

/// Finds out whether [`write_whole`] could write `path`, and leaves nothing behind.
pub fn check_writable(path: &Path) -> Result<(), ImageError> {
    let attempt = || temporary_file(&resolve(path)?).map(drop);
    attempt().map_err(|source| ImageError::Write { path: path.to_owned(), source })
}

fn try_write(path: &Path, write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> io::Result<()> {
    let target = resolve(path)?;
    let mut temporary = temporary_file(&target)?;
    let mut buffered = BufWriter::new(temporary.as_file_mut());
    write(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    temporary.as_file().sync_all()?;
    temporary.persist(&target).map_err(|failure| failure.error)?;
    // The new name is an entry of the directory, which has to reach the disk as well. Not every file system can flush
    // a directory, and the file itself is safe by now.
    #[cfg(unix)]
    if let Ok(directory) = File::open(directory_of(&target)) {
        let _ = directory.sync_all();
    }
    Ok(())
}

/// The file that is to be replaced: `path` with symbolic links followed.
fn resolve(path: &Path) -> io::Result<PathBuf> {
    match fs::metadata(path) {
        Ok(existing) if existing.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(existing) if !existing.is_file() => Err(io::Error::other("not a regular file")),
        Ok(_) => fs::canonicalize(path),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(path.to_owned()),
        Err(error) => Err(error),
    }
}

/// An empty file beside `target`, which vanishes unless it is renamed.
fn temporary_file(target: &Path) -> io::Result<NamedTempFile> {
    if target.file_name().is_none() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not the name of a file"));
    }
    let directory = directory_of(target);
    if !directory.is_dir() {
        return Err(io::Error::new(io::ErrorKind::NotFound, format!("there is no directory {}", directory.display())));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".tyndall-").suffix(".tmp");
    // Temporary files are private by default; the umask turns 0666 into what an ordinary new file has.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    // The message names the temporary file, which means nothing to the user: keep the cause alone.
    builder.tempfile_in(directory).map_err(|error| io::Error::from(error.kind()))
}

fn directory_of(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}
