//! The formats of files of voxels: Mitsuba's `.vol`, NanoVDB's `.nvdb` and OpenVDB's `.vdb`.

use std::path::Path;
use std::sync::Arc;

use glam::DMat4;

use super::vdb;
use super::volume::Grid;

/// Voxels of a file, and their place.
#[derive(Clone, Debug)]
pub struct GridFile {
    /// The voxels.
    pub grid: Arc<Grid>,
    /// From the unit cube to where the file has its voxels: the bounding box of a `.vol`, and for the other formats the box around the
    /// active voxels, [least − ½, greatest + ½] in voxel indices, by the file's transform from indices to world space.
    pub to_world: DMat4,
    /// Whether the file's place is where its voxels are if nothing else is said: so it is for `.nvdb` and `.vdb`.
    pub places_itself: bool,
}

impl GridFile {
    /// Reads a file, by its name's ending: `.nvdb` (NanoVDB 32), `.vdb` (OpenVDB, format versions 222 to 224), or Mitsuba's `.vol`.
    /// `grid` names one of several grids; without a name it is the only one, or the one called "density". The error says what is
    /// wrong with the file.
    pub fn read(path: &Path, grid: Option<&str>) -> Result<GridFile, String> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
        let nano = vdb::is_nano(&bytes);
        let open = vdb::is_open(&bytes);
        let sparse = |read: Result<(Grid, DMat4), String>| {
            let (grid, to_world) = read?;
            Ok(GridFile { grid: Arc::new(grid), to_world, places_itself: true })
        };
        match (ending.as_str(), nano, open) {
            ("nvdb", true, _) => sparse(vdb::read_nano(&bytes, grid)),
            ("vdb", _, true) => sparse(vdb::read_open(&bytes, grid)),
            (_, _, true) => Err("it is an OpenVDB file; its name should end in .vdb".to_owned()),
            (_, true, _) => Err("it is a NanoVDB file; its name should end in .nvdb".to_owned()),
            ("nvdb", ..) => Err("byte 0: it does not begin with \"NanoVDB0\", \"NanoVDB1\" or \"NanoVDB2\"".to_owned()),
            ("vdb", ..) => Err("byte 0: it does not begin with the letters \" BDV\" of OpenVDB".to_owned()),
            _ if grid.is_some() => {
                Err("it has one grid without a name; only .nvdb and .vdb files have names".to_owned())
            }
            _ => {
                let (grid, [low, high]) = Grid::decode(&bytes)?;
                let to_world = DMat4::from_translation(low) * DMat4::from_scale(high - low);
                Ok(GridFile { grid: Arc::new(grid), to_world, places_itself: false })
            }
        }
    }
}
