//! OpenVDB's files, format versions 222 to 224 (OpenVDB 3 to 12: `io/Archive.cc`, `io/Compression.h`, `tree/RootNode.h`,
//! `tree/InternalNode.h`, `tree/LeafNode.h`, `math/Maps.h`).

use std::collections::HashSet;
use std::io::Read;

use flate2::read::ZlibDecoder;
use glam::{DMat4, DVec3};
use half::f16;

use super::bytes::{Bytes, Cursor};
use super::{Leaf, Sparse, Tile, blosc, place};

const MAGIC: &[u8] = b" BDV\0\0\0\0";
/// Bits of a grid's compression.
const ZIP: u32 = 1;
const ACTIVE_ONLY: u32 = 2;
const BLOSC: u32 = 4;
/// Between a grid's name and the number that tells it from others of that name.
const NUMBERED: char = '\x1e';
const HALF: &str = "_HalfFloat";

/// A grid of a file.
pub(super) struct Entry {
    pub name: String,
    /// The name with a number, if there are several of it.
    unique: String,
    /// Of the tree, as "Tree_float_5_4_3".
    kind: String,
    /// Whose tree this grid shows, if not its own.
    parent: String,
    at: usize,
}

/// Whether bytes begin as such a file.
pub(in crate::scene) fn is_open(data: &[u8]) -> bool {
    data.starts_with(MAGIC)
}

/// The grids of a file.
pub(super) fn list(bytes: &Bytes) -> Result<Vec<Entry>, String> {
    let mut file = Cursor { bytes: bytes.clone(), at: MAGIC.len() };
    let version = file.u32()?;
    if !(222..=224).contains(&version) {
        return Err(bytes.error(8, format!("format version {version}; 222 to 224 are accepted (OpenVDB 3 and later)")));
    }
    // The library's version.
    file.take(8)?;
    if file.u8()? == 0 {
        return Err(bytes.error(20, "it was written to a stream and does not say where its grids are"));
    }
    // A name of the file that is unique.
    file.take(36)?;
    metadata(&mut file)?;
    let count = file.u32()?;
    let mut entries = Vec::new();
    for _ in 0..count {
        let unique = file.text()?;
        let name = unique.split(NUMBERED).next().unwrap_or_default().to_owned();
        let (kind, parent) = (file.text()?, file.text()?);
        let at = bytes.size(file.at)?;
        let end = bytes.size(file.at + 16)?;
        if end < file.at + 24 || at < file.at + 24 {
            return Err(file.error(format!("the grid {name:?} is before its own head")));
        }
        entries.push(Entry { name, unique, kind, parent, at });
        file.at = end;
    }
    Ok(entries)
}

/// What is said of a file or a grid: returns its class if there is one.
fn metadata(file: &mut Cursor) -> Result<Option<String>, String> {
    let mut class = None;
    for _ in 0..file.u32()? {
        let (name, kind) = (file.text()?, file.text()?);
        let size = file.u32()? as usize;
        let value = file.take(size)?;
        if name == "class" && kind == "string" {
            class = Some(String::from_utf8_lossy(value).into_owned());
        }
    }
    Ok(class)
}

/// The voxels of one of the grids.
pub(super) fn read(bytes: &Bytes, entries: &[Entry], index: usize) -> Result<Sparse, String> {
    let entry = &entries[index];
    let (mut file, mut compression, to_world) = head(bytes, entry)?;
    if !entry.parent.is_empty() {
        // A grid that shares its tree has its own transform, and nothing after it.
        let parent = entries.iter().find(|other| other.unique == entry.parent && other.parent.is_empty());
        let parent = parent.ok_or_else(|| {
            bytes.error(entry.at, format!("it shares the voxels of {:?}, which is not there", entry.parent))
        })?;
        (file, compression, _) = head(bytes, parent)?;
    }
    let half = entry.kind.ends_with(HALF);
    let channels = match entry.kind.trim_end_matches(HALF) {
        "Tree_float_5_4_3" => 1,
        "Tree_vec3s_5_4_3" => 3,
        kind => {
            let text = format!("its type is {kind}; Tree_float_5_4_3 and Tree_vec3s_5_4_3 are accepted");
            return Err(bytes.error(entry.at, text));
        }
    };
    if file.u32()? != 1 {
        return Err(file.error("a tree of several buffers"));
    }
    let sparse = Sparse { channels, background: [0.0; 3], tiles: Vec::new(), leaves: Vec::new(), to_world };
    let mut tree = Tree { file, half, compression, sparse };
    tree.topology()?;
    tree.voxels()?;
    Ok(tree.sparse)
}

/// Compression and transform of a grid, and where its tree begins.
fn head<'a>(bytes: &Bytes<'a>, entry: &Entry) -> Result<(Cursor<'a>, u32, DMat4), String> {
    let mut file = Cursor { bytes: bytes.clone(), at: entry.at };
    let compression = file.u32()?;
    if compression & !(ZIP | ACTIVE_ONLY | BLOSC) != 0 {
        return Err(bytes.error(entry.at, format!("compression {compression:#x}; bits 0 to 2 are known")));
    }
    let class = metadata(&mut file)?.unwrap_or_else(|| "unknown".to_owned());
    if !matches!(class.as_str(), "unknown" | "fog volume") {
        return Err(bytes.error(entry.at, format!("it is a {class}; fog volumes are accepted")));
    }
    let to_world = transform(&mut file)?;
    Ok((file, compression, to_world))
}

/// From indices to world space.
fn transform(file: &mut Cursor) -> Result<DMat4, String> {
    let start = file.at;
    let kind = file.text()?;
    // After translation and scale come numbers that follow from the scale.
    let mut vector = || file.f64s::<3>().map(DVec3::from_array);
    Ok(match kind.as_str() {
        "UniformScaleMap" | "ScaleMap" => {
            let scale = vector()?;
            file.take(4 * 24)?;
            DMat4::from_scale(scale)
        }
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => {
            let (shift, scale) = (vector()?, vector()?);
            file.take(4 * 24)?;
            DMat4::from_translation(shift) * DMat4::from_scale(scale)
        }
        "TranslationMap" => DMat4::from_translation(vector()?),
        // Rows of a matrix that acts on rows.
        "AffineMap" | "UnitaryMap" => DMat4::from_cols_array(&file.f64s::<16>()?),
        _ => return Err(file.bytes.error(start, format!("its transform is a {kind}; affine ones are accepted"))),
    })
}

/// Bits of a node, of which z grows fastest.
struct Mask<'a>(&'a [u8]);

impl Mask<'_> {
    fn get(&self, offset: usize) -> bool {
        self.0[offset / 8] >> (offset % 8) & 1 == 1
    }

    fn count(&self) -> usize {
        self.0.iter().map(|byte| byte.count_ones() as usize).sum()
    }
}

/// A tree that is being read.
struct Tree<'a> {
    file: Cursor<'a>,
    half: bool,
    compression: u32,
    sparse: Sparse,
}

impl<'a> Tree<'a> {
    /// A value in full precision.
    fn value(&mut self) -> Result<[f32; 3], String> {
        let mut value = [0.0; 3];
        for number in &mut value[..self.sparse.channels] {
            *number = f32::from_le_bytes(self.file.array()?);
        }
        Ok(value)
    }

    fn mask(&mut self, log: u32) -> Result<Mask<'a>, String> {
        self.file.take(1 << (3 * log - 3)).map(Mask)
    }

    /// The root, the inner nodes, and the places of the leaves.
    fn topology(&mut self) -> Result<(), String> {
        self.sparse.background = self.value()?;
        let (tiles, children) = (self.file.u32()?, self.file.u32()?);
        let mut places = HashSet::new();
        for _ in 0..tiles {
            let origin = self.origin(&mut places)?;
            let (value, active) = (self.value()?, self.file.u8()? != 0);
            self.push(Tile { origin, log_side: 12, value, active });
        }
        for _ in 0..children {
            let origin = self.origin(&mut places)?;
            self.inner(origin, 5, 7)?;
        }
        Ok(())
    }

    /// Where a child of the root is.
    fn origin(&mut self, places: &mut HashSet<[i32; 3]>) -> Result<[i32; 3], String> {
        let start = self.file.at;
        let origin = self.file.place()?;
        if origin.iter().any(|k| k % 4096 != 0) || !places.insert(origin) {
            return Err(self
                .file
                .bytes
                .error(start, format!("a child of the root is at {origin:?}, as another or out of step")));
        }
        Ok(origin)
    }

    /// A node of 2^`log` children a side, each of 2^`log_child` voxels a side.
    fn inner(&mut self, origin: [i32; 3], log: u32, log_child: u32) -> Result<(), String> {
        let (children, active) = (self.mask(log)?, self.mask(log)?);
        let values = self.values(&active, log)?;
        let channels = self.sparse.channels;
        let count = 1usize << (3 * log);
        for offset in (0..count).filter(|offset| !children.get(*offset)) {
            let mut value = [0.0; 3];
            value[..channels].copy_from_slice(&values[channels * offset..channels * (offset + 1)]);
            let origin = place(origin, offset, log, log_child);
            self.push(Tile { origin, log_side: log_child, value, active: active.get(offset) });
        }
        for offset in (0..count).filter(|offset| children.get(*offset)) {
            let origin = place(origin, offset, log, log_child);
            if log == 5 {
                self.inner(origin, 4, 3)?;
            } else {
                let mask = self.mask(3)?;
                let mut active = [0; 8];
                for (word, bytes) in active.iter_mut().zip(mask.0.chunks_exact(8)) {
                    *word = bytes.iter().rev().fold(0u64, |word, byte| word << 8 | u64::from(*byte));
                }
                self.sparse.leaves.push(Leaf { origin, active, values: Vec::new() });
            }
        }
        Ok(())
    }

    /// The voxels of the leaves, which come after all nodes in the same order.
    fn voxels(&mut self) -> Result<(), String> {
        for index in 0..self.sparse.leaves.len() {
            let mask = self.mask(3)?;
            self.sparse.leaves[index].values = self.values(&mask, 3)?;
        }
        Ok(())
    }

    /// Adds a tile, unless there is nothing to see of it.
    fn push(&mut self, tile: Tile) {
        if tile.active || tile.value[..self.sparse.channels] != self.sparse.background[..self.sparse.channels] {
            self.sparse.tiles.push(tile);
        }
    }

    /// All values of a node, whose inactive ones may be left out.
    fn values(&mut self, active: &Mask, log: u32) -> Result<Vec<f32>, String> {
        let start = self.file.at;
        let kept = self.file.u8()?;
        if kept > 6 {
            return Err(self
                .file
                .bytes
                .error(start, format!("inactive values are left out in way {kept}; 0 to 6 are known")));
        }
        // 0: all are the background, 1: its negative, 2: a value, 3: both of the former, 4: a value and the background, 5: two values;
        // from 3 to 5 a mask tells which. 6: none is left out.
        let background = self.sparse.background;
        let mut inactive = [if kept == 0 { background } else { background.map(|k| -k) }, background];
        if matches!(kept, 2 | 4 | 5) {
            inactive[0] = self.value()?;
        }
        if kept == 5 {
            inactive[1] = self.value()?;
        }
        let second = if matches!(kept, 3..=5) { Some(self.mask(log)?) } else { None };
        let all = 1usize << (3 * log);
        let channels = self.sparse.channels;
        let count = if self.compression & ACTIVE_ONLY != 0 && kept != 6 { active.count() } else { all };
        let stored = self.numbers(count * channels)?;
        if count == all {
            return Ok(stored);
        }
        let mut values = Vec::with_capacity(all * channels);
        let mut voxels = stored.chunks_exact(channels);
        for offset in 0..all {
            let value = if active.get(offset) {
                voxels.next().expect("as many were read as are active")
            } else {
                &inactive[usize::from(second.as_ref().is_some_and(|mask| mask.get(offset)))][..channels]
            };
            values.extend_from_slice(value);
        }
        Ok(values)
    }

    /// So many numbers, packed or not.
    fn numbers(&mut self, count: usize) -> Result<Vec<f32>, String> {
        // Nothing at all stands for no numbers of half precision, and a size of 0 for none of full precision.
        if self.half && count == 0 {
            return Ok(Vec::new());
        }
        let bytes = self.unpacked(count * if self.half { 2 } else { 4 })?;
        Ok(if self.half {
            bytes.chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]]).to_f32()).collect()
        } else {
            bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
        })
    }

    /// So many bytes.
    fn unpacked(&mut self, wanted: usize) -> Result<Vec<u8>, String> {
        if self.compression & (ZIP | BLOSC) == 0 {
            return Ok(self.file.take(wanted)?.to_vec());
        }
        let start = self.file.at;
        let error = |file: &Cursor, cause: String| file.bytes.error(start, cause);
        let size = self.file.i64()?;
        let length = usize::try_from(size.unsigned_abs()).map_err(|_| error(&self.file, format!("{size} bytes")))?;
        let data = self.file.take(length)?;
        if size <= 0 {
            // What packing would have made larger is stored as it is.
            return if length == wanted {
                Ok(data.to_vec())
            } else {
                Err(error(&self.file, format!("{length} bytes are stored, {wanted} are needed")))
            };
        }
        if self.compression & BLOSC != 0 {
            return blosc::unpack(data, wanted).map_err(|cause| error(&self.file, format!("codec BLOSC: {cause}")));
        }
        let mut unpacked = Vec::new();
        let read = ZlibDecoder::new(data).take(wanted as u64 + 1).read_to_end(&mut unpacked);
        read.map_err(|cause| error(&self.file, format!("codec ZIP: {cause}")))?;
        if unpacked.len() != wanted {
            return Err(error(&self.file, format!("codec ZIP: it does not unpack to {wanted} bytes")));
        }
        Ok(unpacked)
    }
}
