//! Voxels of sparse volumes: NanoVDB's files `.nvdb` and OpenVDB's files `.vdb`, made dense.
//!
//! Both are trees of 8³ voxels in nodes of 16³ in nodes of 32³, where constant regions are tiles (Museth, "VDB: High-resolution
//! sparse volumes with dynamic topology", TOG 2013; Museth, "NanoVDB: A GPU-friendly and portable VDB data structure", SIGGRAPH
//! Talks 2021). A voxel is a node of the lattice: its value is the one at its own integer index.

mod blosc;
mod bytes;
mod nano;
mod open;

use glam::{DMat4, DVec3};

use super::volume::{Grid, MAX_SIDE};
use bytes::Bytes;
pub(super) use nano::is_nano;
pub(super) use open::is_open;

/// Numbers of a box that are accepted however few voxels of it are active: 256 MiB.
const ALWAYS: u64 = 1 << 26;
/// Beyond that, at least one voxel in so many must be active. A smaller share is a stray voxel far away from the others, or a damaged
/// file, and would take gigabytes for nothing.
const LEAST_SHARE: u64 = 256;

/// Reads a grid of a file `.nvdb`: that of a name, or the only one, or the one called "density". Also returns what takes the unit
/// cube to the file's world space. The error says what is wrong, and at which byte.
pub(super) fn read_nano(data: &[u8], name: Option<&str>) -> Result<(Grid, DMat4), String> {
    let bytes = Bytes::of_file(data);
    let entries = nano::list(&bytes)?;
    let names: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
    let entry = &entries[choose(&names, name)?];
    let about = |cause| format!("grid {:?}: {cause}", entry.name);
    nano::read(&bytes, entry).and_then(Sparse::dense).map_err(about)
}

/// The same for a file `.vdb`.
pub(super) fn read_open(data: &[u8], name: Option<&str>) -> Result<(Grid, DMat4), String> {
    let bytes = Bytes::of_file(data);
    let entries = open::list(&bytes)?;
    let names: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
    let index = choose(&names, name)?;
    let about = |cause| format!("grid {:?}: {cause}", names[index]);
    open::read(&bytes, &entries, index).and_then(Sparse::dense).map_err(about)
}

/// Which of the grids is meant.
fn choose(names: &[&str], wanted: Option<&str>) -> Result<usize, String> {
    let quoted: Vec<String> = names.iter().map(|name| format!("{name:?}")).collect();
    let list = quoted.join(", ");
    let found: Vec<usize> = (0..names.len()).filter(|k| names[*k] == wanted.unwrap_or("density")).collect();
    match (wanted, &found[..]) {
        _ if names.is_empty() => Err("it has no grids".to_owned()),
        (_, [one]) => Ok(*one),
        (Some(wanted), []) => Err(format!("it has no grid {wanted:?}; its grids: {list}")),
        (Some(wanted), _) => {
            Err(format!("it has {} grids called \"{wanted}\", of which one cannot be told", found.len()))
        }
        (None, _) if names.len() == 1 => Ok(0),
        (None, _) => Err(format!("which grid? Name one with <string name=\"grid\" value=\"…\"/>: {list}")),
    }
}

/// A constant region: a cube of voxels.
struct Tile {
    /// Its first voxel.
    origin: [i32; 3],
    /// Binary logarithm of the voxels along a side: 3, 7 or 12.
    log_side: u32,
    value: [f32; 3],
    active: bool,
}

/// 8³ voxels, of which z grows fastest.
struct Leaf {
    origin: [i32; 3],
    active: [u64; 8],
    /// 512 voxels of all channels.
    values: Vec<f32>,
}

/// What both formats hold. Tiles and leaves do not overlap.
struct Sparse {
    channels: usize,
    background: [f32; 3],
    tiles: Vec<Tile>,
    leaves: Vec<Leaf>,
    /// From voxel indices to the file's world space.
    to_world: DMat4,
}

/// First and last voxel.
#[derive(Clone, Copy)]
struct Range3 {
    first: [i64; 3],
    last: [i64; 3],
}

impl Range3 {
    const EMPTY: Range3 = Range3 { first: [i64::MAX; 3], last: [i64::MIN; 3] };

    fn cube(origin: [i32; 3], log_side: u32) -> Range3 {
        let first = origin.map(i64::from);
        Range3 { first, last: first.map(|k| k + (1 << log_side) - 1) }
    }

    fn grow(&mut self, other: Range3) {
        for k in 0..3 {
            self.first[k] = self.first[k].min(other.first[k]);
            self.last[k] = self.last[k].max(other.last[k]);
        }
    }
}

impl Leaf {
    fn is_active(&self, offset: usize) -> bool {
        self.active[offset / 64] >> (offset % 64) & 1 == 1
    }

    /// The smallest range of all active voxels.
    fn range(&self) -> Range3 {
        let mut range = Range3::EMPTY;
        for offset in (0..512).filter(|offset| self.is_active(*offset)) {
            range.grow(Range3::cube(place(self.origin, offset, 3, 0), 0));
        }
        range
    }
}

/// First voxel of the child at an offset in a node of 2^`log` children a side, each of 2^`log_child` voxels a side.
fn place(origin: [i32; 3], offset: usize, log: u32, log_child: u32) -> [i32; 3] {
    let mask = (1 << log) - 1;
    let at = [offset >> (2 * log), offset >> log & mask, offset & mask];
    [0, 1, 2].map(|k| origin[k] + ((at[k] as i32) << log_child))
}

impl Sparse {
    /// All voxels in the smallest box around the active ones, and what takes the unit cube to the file's world space.
    fn dense(self) -> Result<(Grid, DMat4), String> {
        let mut range = Range3::EMPTY;
        self.tiles
            .iter()
            .filter(|tile| tile.active)
            .for_each(|tile| range.grow(Range3::cube(tile.origin, tile.log_side)));
        self.leaves.iter().for_each(|leaf| range.grow(leaf.range()));
        if range.first[0] > range.last[0] {
            return Err("it has no active voxels".to_owned());
        }
        let size = [0, 1, 2].map(|k| (range.last[k] - range.first[k] + 1) as u64);
        let count = self.room(size)?;
        let first = DVec3::from_array(range.first.map(|k| k as f64)) - 0.5;
        let cube = DMat4::from_translation(first) * DMat4::from_scale(DVec3::from_array(size.map(|side| side as f64)));
        let to_world = self.to_world * cube;
        let determinant = to_world.determinant();
        if !to_world.is_finite() || !determinant.is_finite() || determinant.abs() < f64::MIN_POSITIVE {
            return Err(format!("its transform has no inverse: {}", self.to_world));
        }
        let mut values: Vec<f32> = Vec::new();
        if values.try_reserve_exact(count).is_err() {
            let [x, y, z] = size;
            return Err(format!("there is no memory for its {x} x {y} x {z} voxels of {} channels", self.channels));
        }
        let background = &self.background[..self.channels];
        for _ in 0..count / self.channels {
            values.extend_from_slice(background);
        }
        self.fill(range, size, &mut values);
        Ok((Grid::new(size.map(|side| side as usize), self.channels, values)?, to_world))
    }

    /// How many numbers a box of so many voxels has; an error if that is more than can be, or than is worth it.
    fn room(&self, size: [u64; 3]) -> Result<usize, String> {
        let [x, y, z] = size;
        let count = x.checked_mul(y).and_then(|n| n.checked_mul(z)).and_then(|n| n.checked_mul(self.channels as u64));
        let fits = size.iter().all(|side| *side <= MAX_SIDE as u64);
        let Some(count) = count.filter(|count| fits && u32::try_from(*count).is_ok()) else {
            let gib = x as f64 * y as f64 * z as f64 * self.channels as f64 * 4.0 / f64::from(1 << 30);
            return Err(format!(
                "its active voxels fill a box of {x} x {y} x {z} with {} channels, {gib:.1} GiB without gaps; at most \
                 {MAX_SIDE} along each side and {} numbers (16 GiB) are accepted: resample it, or cut it into pieces",
                self.channels,
                u32::MAX
            ));
        };
        let active = self.active();
        if count > ALWAYS && count / self.channels as u64 > active.saturating_mul(LEAST_SHARE) {
            return Err(format!(
                "its {active} active voxels are scattered over a box of {x} x {y} x {z}, {:.1} GiB without gaps; at least one in \
                 {LEAST_SHARE} must be active: remove stray voxels, or cut it into pieces",
                count as f64 * 4.0 / f64::from(1 << 30)
            ));
        }
        Ok(count as usize)
    }

    /// How many voxels are active.
    fn active(&self) -> u64 {
        let tiles = self.tiles.iter().filter(|tile| tile.active).map(|tile| 1u64 << (3 * tile.log_side));
        let leaves =
            self.leaves.iter().map(|leaf| leaf.active.iter().map(|word| u64::from(word.count_ones())).sum::<u64>());
        tiles.sum::<u64>() + leaves.sum::<u64>()
    }

    /// Writes tiles and leaves, as far as they are in the range.
    fn fill(&self, range: Range3, size: [u64; 3], values: &mut [f32]) {
        let channels = self.channels;
        let index = |at: [i64; 3]| {
            let [x, y, z] = [0, 1, 2].map(|k| (at[k] - range.first[k]) as u64);
            ((z * size[1] + y) * size[0] + x) as usize * channels
        };
        let rows = |cube: Range3| {
            let first = [0, 1, 2].map(|k| cube.first[k].max(range.first[k]));
            let last = [0, 1, 2].map(|k| cube.last[k].min(range.last[k]));
            let places = (first[2]..=last[2]).flat_map(move |z| (first[1]..=last[1]).map(move |y| [first[0], y, z]));
            places.map(move |place| (place, last[0])).filter(move |_| first[0] <= last[0])
        };
        for tile in &self.tiles {
            for (place, last) in rows(Range3::cube(tile.origin, tile.log_side)) {
                let begin = index(place);
                let row = &mut values[begin..begin + (last - place[0] + 1) as usize * channels];
                row.chunks_exact_mut(channels).for_each(|voxel| voxel.copy_from_slice(&tile.value[..channels]));
            }
        }
        for leaf in &self.leaves {
            for (place, last) in rows(Range3::cube(leaf.origin, 3)) {
                let [_, y, z] = [0, 1, 2].map(|k| (place[k] - i64::from(leaf.origin[k])) as usize);
                for x in place[0]..=last {
                    let from = ((x - i64::from(leaf.origin[0])) as usize * 64 + y * 8 + z) * channels;
                    let to = index([x, place[1], place[2]]);
                    values[to..to + channels].copy_from_slice(&leaf.values[from..from + channels]);
                }
            }
        }
    }
}
