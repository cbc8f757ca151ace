//! The files of `tests/data/vdb`, which OpenVDB 10.0.1 and its `nanovdb_convert` wrote (`make.py` there), packed by gzip.

use std::io::Read;
use std::path::Path;

use tyndall::scene::GridFile;

/// A file of the tests, unpacked.
pub fn data(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/vdb").join(format!("{name}.gz"));
    let packed = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(&*packed).read_to_end(&mut bytes).expect("it is packed by gzip");
    bytes
}

/// Reads bytes as a file of that name.
pub fn read(name: &str, bytes: &[u8], grid: Option<&str>) -> Result<GridFile, String> {
    let folder = tempfile::tempdir().expect("there is a folder for temporary files");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("it can be written");
    GridFile::read(&path, grid)
}
