//! NanoVDB's files, version 32 (NanoVDB.h and PNanoVDB.h 32.4 to 32.9, OpenVDB 10 to 12): segments of packed grids, or bare grids.

use std::collections::HashSet;
use std::io::Read;

use flate2::read::ZlibDecoder;
use glam::{DMat3, DMat4, DVec3};

use super::bytes::Bytes;
use super::{Leaf, Sparse, Tile, blosc, place};

const MAGIC: [&[u8]; 3] = [b"NanoVDB0", b"NanoVDB1", b"NanoVDB2"];
/// Of the segments' and the grids' version number, the part that names the layout.
const MAJOR: u32 = 32;
const SEGMENT_HEAD: usize = 16;
const META: usize = 176;
const GRID_HEAD: usize = 672;
const TREE_HEAD: usize = 64;
/// Bytes that Blosc packed at once, at most.
const BLOSC_CHUNK: usize = 1 << 30;

/// Names of the types of values, by number.
const TYPES: [&str; 27] = [
    "unknown",
    "float",
    "double",
    "int16",
    "int32",
    "int64",
    "Vec3f",
    "Vec3d",
    "mask",
    "half",
    "uint32",
    "bool",
    "RGBA8",
    "Fp4",
    "Fp8",
    "Fp16",
    "FpN",
    "Vec4f",
    "Vec4d",
    "index",
    "on-index",
    "index mask",
    "on-index mask",
    "point index",
    "Vec3u8",
    "Vec3u16",
    "uint8",
];
/// Names of the classes of grids, by number.
const CLASSES: [&str; 10] = [
    "unknown",
    "level set",
    "fog volume",
    "staggered grid",
    "point index",
    "point data",
    "topology",
    "voxel volume",
    "index grid",
    "tensor grid",
];

/// Where a grid is in a file.
pub(super) struct Entry {
    pub name: String,
    at: usize,
    /// Bytes in the file.
    stored: usize,
    /// Bytes when unpacked.
    size: usize,
    codec: u16,
}

/// Whether bytes begin as such a file.
pub(in crate::scene) fn is_nano(data: &[u8]) -> bool {
    MAGIC.iter().any(|magic| data.starts_with(magic))
}

fn version(bytes: &Bytes, at: usize) -> Result<(), String> {
    let word = bytes.u32(at)?;
    let (major, minor, patch) = (word >> 21, word >> 10 & 0x7ff, word & 0x3ff);
    if major == MAJOR {
        Ok(())
    } else {
        Err(bytes.error(at, format!("version {major}.{minor}.{patch}; {MAJOR} is accepted")))
    }
}

/// The grids of a file.
pub(super) fn list(bytes: &Bytes) -> Result<Vec<Entry>, String> {
    let mut entries = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let magic = bytes.slice(at, 8)?;
        if magic == MAGIC[1] {
            at = bare(bytes, at, &mut entries)?;
        } else if is_nano(magic) {
            at = segment(bytes, at, &mut entries)?;
        } else {
            return Err(bytes.error(at, "neither a segment nor a grid of NanoVDB begins here"));
        }
    }
    Ok(entries)
}

/// A grid as it is in memory. Returns where it ends.
fn bare(bytes: &Bytes, at: usize, entries: &mut Vec<Entry>) -> Result<usize, String> {
    let head = bytes.part(at, GRID_HEAD)?;
    let size = head.size(32)?;
    if size < GRID_HEAD {
        return Err(head.error(32, format!("a grid of {size} bytes is too small for its head")));
    }
    bytes.slice(at, size)?;
    entries.push(Entry { name: text(head.slice(40, 256)?), at, stored: size, size, codec: 0 });
    Ok(at + size)
}

/// A segment: a head, what there is to know of each grid with its name, and the grids. Returns where it ends.
fn segment(bytes: &Bytes, at: usize, entries: &mut Vec<Entry>) -> Result<usize, String> {
    version(bytes, at + 8)?;
    let (count, codec) = (bytes.u16(at + 12)?, bytes.u16(at + 14)?);
    let first = entries.len();
    let mut next = at + SEGMENT_HEAD;
    for _ in 0..count {
        let meta = bytes.part(next, META)?;
        let length = meta.u32(136)? as usize;
        let name = text(bytes.slice(next + META, length)?);
        entries.push(Entry { name, at: 0, stored: meta.size(8)?, size: meta.size(0)?, codec });
        next += META + length;
    }
    for entry in &mut entries[first..] {
        entry.at = next;
        next += bytes.slice(next, entry.stored)?.len();
    }
    Ok(next)
}

/// The text before the first zero.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

/// The voxels of a grid.
pub(super) fn read(bytes: &Bytes, entry: &Entry) -> Result<Sparse, String> {
    let packed = bytes.part(entry.at, entry.stored)?;
    match entry.codec {
        0 => Tree::read(packed),
        1 => Tree::read(Bytes::unpacked(&inflate(&packed, entry)?, &entry.name)),
        2 => Tree::read(Bytes::unpacked(&unblosc(&packed, entry)?, &entry.name)),
        codec => Err(bytes.error(entry.at, format!("codec {codec}; none, ZIP (1) and BLOSC (2) are accepted"))),
    }
}

/// What zlib packed: its size comes first.
fn inflate(packed: &Bytes, entry: &Entry) -> Result<Vec<u8>, String> {
    let data = packed.slice(8, packed.size(0)?)?;
    let mut unpacked = Vec::new();
    let limit = (entry.size as u64).saturating_add(1);
    let read = ZlibDecoder::new(data).take(limit).read_to_end(&mut unpacked);
    read.map_err(|error| packed.error(8, format!("codec ZIP: {error}")))?;
    if unpacked.len() != entry.size {
        return Err(packed.error(8, format!("codec ZIP: it does not unpack to the {} bytes of the grid", entry.size)));
    }
    Ok(unpacked)
}

/// What Blosc packed: pieces of a GiB, each after its size.
fn unblosc(packed: &Bytes, entry: &Entry) -> Result<Vec<u8>, String> {
    let (mut unpacked, mut at) = (Vec::new(), 0);
    while unpacked.len() < entry.size {
        let data = packed.slice(at + 8, packed.size(at)?)?;
        let wanted = (entry.size - unpacked.len()).min(BLOSC_CHUNK);
        let piece = blosc::unpack(data, wanted).map_err(|cause| packed.error(at, format!("codec BLOSC: {cause}")))?;
        unpacked.extend(piece);
        at += 8 + data.len();
    }
    Ok(unpacked)
}

/// From indices to world space.
fn transform(bytes: &Bytes) -> Result<DMat4, String> {
    // The map begins at byte 296, with the same in single precision; then come a matrix in rows, its inverse, and a shift.
    let number = |k: usize| bytes.f64(296 + 88 + 8 * k);
    let mut rows = [0.0; 9];
    for (k, entry) in rows.iter_mut().enumerate() {
        *entry = number(k)?;
    }
    let shift = DVec3::new(number(18)?, number(19)?, number(20)?);
    Ok(DMat4::from_translation(shift) * DMat4::from_mat3(DMat3::from_cols_array(&rows).transpose()))
}

/// What a leaf holds.
#[derive(Clone, Copy, PartialEq)]
enum Values {
    /// Numbers of 32 bits, one or three a voxel.
    Float(usize),
    /// Codes of 2^k bits, between a least value and steps of a quantum.
    Codes(u32),
    /// The same, where each leaf has its own k.
    AnyCodes,
}

/// A grid with the layout of its nodes.
struct Tree<'a> {
    bytes: Bytes<'a>,
    values: Values,
    channels: usize,
    /// Where the tables of the nodes of 32³ and 16³ begin, bytes.
    tables: [usize; 2],
    /// Of an entry of these tables, bytes.
    stride: usize,
    /// Where a leaf's values begin, bytes.
    leaf_table: usize,
    /// Nodes of each of the three levels that the bytes still have room for. A node that is used twice would let a small file ask for
    /// any amount of work.
    room: [usize; 3],
}

impl<'a> Tree<'a> {
    /// Reads a whole grid: what it is, where it is, how its nodes are laid out (`pnanovdb_grid_type_constants`), and the nodes.
    fn read(bytes: Bytes<'a>) -> Result<Sparse, String> {
        if !is_nano(bytes.slice(0, 8)?) {
            return Err(bytes.error(0, "no grid of NanoVDB begins here"));
        }
        version(&bytes, 16)?;
        let (class, kind) = (bytes.u32(632)?, bytes.u32(636)?);
        if !matches!(class, 0 | 2 | 7) {
            let name = CLASSES.get(class as usize).copied().unwrap_or("grid of an unknown class");
            return Err(bytes.error(632, format!("it is a {name}; fog volumes are accepted")));
        }
        let values = match kind {
            1 => Values::Float(1),
            6 => Values::Float(3),
            13..=15 => Values::Codes(kind - 11),
            16 => Values::AnyCodes,
            _ => {
                let name = TYPES.get(kind as usize).copied().unwrap_or("of an unknown type");
                let text = format!("its values are {name}; float, Vec3f, Fp4, Fp8, Fp16 and FpN are accepted");
                return Err(bytes.error(636, text));
            }
        };
        let to_world = transform(&bytes)?;
        let vector = values == Values::Float(3);
        let (upper, lower) = if vector { (532_544, 66_624) } else { (270_400, 33_856) };
        let leaf = match values {
            Values::Float(1) => 2144,
            Values::Float(_) => 6272,
            Values::Codes(log) => 96 + (64 << log),
            Values::AnyCodes => 96 + 64,
        };
        let mut tree = Tree {
            values,
            channels: if vector { 3 } else { 1 },
            tables: [8256, 1088],
            stride: if vector { 16 } else { 8 },
            leaf_table: if vector { 128 } else { 96 },
            room: [upper, lower, leaf].map(|size| bytes.len() / size),
            bytes,
        };
        let mut sparse =
            Sparse { channels: tree.channels, background: [0.0; 3], tiles: Vec::new(), leaves: Vec::new(), to_world };
        tree.root(&mut sparse)?;
        Ok(sparse)
    }

    /// A value of a tile or of the background.
    fn value(&self, at: usize) -> Result<[f32; 3], String> {
        match self.channels {
            1 => Ok([self.bytes.f32(at)?; 3]),
            _ => Ok([self.bytes.f32(at)?, self.bytes.f32(at + 4)?, self.bytes.f32(at + 8)?]),
        }
    }

    /// Counts a node.
    fn visit(&mut self, level: usize, at: usize) -> Result<(), String> {
        let left = self.room[level].checked_sub(1);
        self.room[level] =
            left.ok_or_else(|| self.bytes.error(at, "more nodes than the grid has room for: some overlap"))?;
        Ok(())
    }

    fn root(&mut self, sparse: &mut Sparse) -> Result<(), String> {
        let root = self.bytes.moved(GRID_HEAD, self.bytes.i64(GRID_HEAD + 24)?)?;
        if root < GRID_HEAD + TREE_HEAD {
            return Err(self.bytes.error(GRID_HEAD + 24, "the root is within the grid's head"));
        }
        sparse.background = self.value(root + 28)?;
        let count = self.bytes.u32(root + 24)? as usize;
        // Three values and two statistics follow the background, up to a multiple of 32 bytes.
        let first = root + if self.channels == 3 { 96 } else { 64 };
        let mut places = HashSet::new();
        for index in 0..count {
            let tile = first + 32 * index;
            let key = self.bytes.u64(tile)?;
            // 20 bits of each coordinate, that of x first.
            let origin = [42, 21, 0].map(|shift| ((key >> shift) as u32) << 12).map(|k| k as i32);
            if !places.insert(origin) {
                return Err(self.bytes.error(tile, "two of the root's children are at the same place"));
            }
            match self.bytes.i64(tile + 8)? {
                0 => {
                    let (value, active) = (self.value(tile + 20)?, self.bytes.u32(tile + 16)? != 0);
                    push(sparse, Tile { origin, log_side: 12, value, active });
                }
                child => self.inner(self.bytes.moved(root, child)?, origin, 0, sparse)?,
            }
        }
        Ok(())
    }

    /// A node of 32³ (level 0) or 16³ (level 1).
    fn inner(&mut self, at: usize, origin: [i32; 3], level: usize, sparse: &mut Sparse) -> Result<(), String> {
        self.visit(level, at)?;
        let (log, log_child) = if level == 0 { (5, 7) } else { (4, 3) };
        let count = 1usize << (3 * log);
        let active = self.bytes.slice(at + 32, count / 8)?;
        let children = self.bytes.slice(at + 32 + count / 8, count / 8)?;
        let bit = |mask: &[u8], offset: usize| mask[offset / 8] >> (offset % 8) & 1 == 1;
        for offset in 0..count {
            let entry = at + self.tables[level] + self.stride * offset;
            let origin = place(origin, offset, log, log_child);
            if bit(children, offset) {
                let child = self.bytes.moved(at, self.bytes.i64(entry)?)?;
                if level == 0 { self.inner(child, origin, 1, sparse)? } else { self.leaf(child, origin, sparse)? }
            } else {
                let value = self.value(entry)?;
                push(sparse, Tile { origin, log_side: log_child, value, active: bit(active, offset) });
            }
        }
        Ok(())
    }

    fn leaf(&mut self, at: usize, origin: [i32; 3], sparse: &mut Sparse) -> Result<(), String> {
        self.visit(2, at)?;
        let mut active = [0; 8];
        for (k, word) in active.iter_mut().enumerate() {
            *word = self.bytes.u64(at + 16 + 8 * k)?;
        }
        let table = at + self.leaf_table;
        let log = match self.values {
            Values::Float(channels) => {
                let data = self.bytes.slice(table, 512 * 4 * channels)?.chunks_exact(4);
                let values = data.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
                sparse.leaves.push(Leaf { origin, active, values });
                return Ok(());
            }
            Values::Codes(log) => log,
            // The three highest bits of the flags, which are a byte after the size of the leaf's box.
            Values::AnyCodes => self.bytes.u32(at + 12)? >> 29,
        };
        if log > 4 {
            return Err(self.bytes.error(at + 12, format!("codes of {} bits; 1 to 16 are accepted", 1u32 << log)));
        }
        let (least, quantum) = (self.bytes.f32(at + 80)?, self.bytes.f32(at + 84)?);
        let codes = self.bytes.slice(table, 64 << log)?;
        let bits = 1usize << log;
        let code = |index: usize| {
            let (first, shift) = (index * bits / 8, index * bits % 8);
            let high = if bits == 16 { u16::from(codes[first + 1]) << 8 } else { 0 };
            (high | u16::from(codes[first])) >> shift & (u16::MAX >> (16 - bits))
        };
        let values = (0..512).map(|index| f32::from(code(index)) * quantum + least).collect();
        sparse.leaves.push(Leaf { origin, active, values });
        Ok(())
    }
}

/// Adds a tile, unless there is nothing to see of it.
fn push(sparse: &mut Sparse, tile: Tile) {
    if tile.active || tile.value[..sparse.channels] != sparse.background[..sparse.channels] {
        sparse.tiles.push(tile);
    }
}
