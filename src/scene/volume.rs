//! Fields in space: grids of voxels, those of Mitsuba's `.vol` files among them, and fog that thins out with height.

use std::fmt;
use std::sync::Arc;

use glam::{DMat4, DVec3};

use super::{Filter, Wrap};

/// A factor that depends on the place.
#[derive(Clone, Debug)]
pub enum Volume {
    /// Voxels in a box.
    Grid(GridVolume),
    /// A density that falls exponentially with height.
    Height(HeightVolume),
}

/// Voxels in a box: those of a medium's extinction coefficient end where the box ends, beyond which there is vacuum. Of the other
/// coefficients, `wrap` says what is beyond; emission ends with the box as well.
#[derive(Clone, Debug)]
pub struct GridVolume {
    /// The voxels.
    pub grid: Arc<Grid>,
    /// The unit cube, in which the voxel (i, j, k) has its centre at ((i + ½)/x, (j + ½)/y, (k + ½)/z), to world space.
    pub to_world: DMat4,
    /// Between voxels.
    pub filter: Filter,
    /// Beyond the box.
    pub wrap: Wrap,
}

/// The density exp(−h / `scale_height`) at the height h over `base`, and 1 below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightVolume {
    /// A point at the height 0, in world space.
    pub base: DVec3,
    /// Where height grows, a unit vector.
    pub up: DVec3,
    /// Height over which the density falls to 1/e, scene units, > 0.
    pub scale_height: f64,
}

/// What depends on the place in a medium: factors of its coefficients, 1 where they are `None`.
#[derive(Clone, Debug, Default)]
pub struct Volumes {
    /// Of `sigma_t`.
    pub sigma_t: Option<Volume>,
    /// Of `albedo`, in \[0, 1\] with it.
    pub albedo: Option<GridVolume>,
    /// Of `emission`.
    pub emission: Option<GridVolume>,
}

impl Volumes {
    /// Whether the medium is the same everywhere.
    pub fn is_empty(&self) -> bool {
        self.sigma_t.is_none() && self.albedo.is_none() && self.emission.is_none()
    }
}

/// Most voxels along a side.
pub const MAX_SIDE: usize = 1 << 15;

/// Voxels: finite and not negative, one or three numbers each, of which x grows fastest.
#[derive(Clone, PartialEq)]
pub struct Grid {
    resolution: [u32; 3],
    channels: u32,
    values: Vec<f32>,
}

impl fmt::Debug for Grid {
    /// The size and a hash of the voxels (FNV-1a), which stand for them in the name of a scene.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hash = self.values.iter().fold(0xcbf2_9ce4_8422_2325u64, |hash, value| {
            (hash ^ u64::from(value.to_bits())).wrapping_mul(0x0100_0000_01b3)
        });
        let [x, y, z] = self.resolution;
        write!(f, "Grid({x} x {y} x {z} x {}, {hash:016x})", self.channels)
    }
}

impl Grid {
    /// Voxels of a resolution, `channels` (1 or 3) numbers each, channels fastest, then x, y and z. The error says what is wrong.
    pub fn new(resolution: [usize; 3], channels: usize, values: Vec<f32>) -> Result<Grid, String> {
        let count = checked_count(resolution, channels)?;
        if values.len() != count {
            return Err(format!("there are {} numbers, {count} are needed", values.len()));
        }
        if let Some(index) = values.iter().position(|value| !(value.is_finite() && *value >= 0.0)) {
            let voxel = index / channels;
            let (x, y) = (voxel % resolution[0], voxel / resolution[0] % resolution[1]);
            let z = voxel / (resolution[0] * resolution[1]);
            return Err(format!("voxel ({x}, {y}, {z}) is {}; voxels must be finite and not negative", values[index]));
        }
        Ok(Grid { resolution: resolution.map(|side| side as u32), channels: channels as u32, values })
    }

    /// Voxels along x, y and z.
    pub fn resolution(&self) -> [u32; 3] {
        self.resolution
    }

    /// Numbers of a voxel, 1 or 3.
    pub fn channels(&self) -> u32 {
        self.channels
    }

    /// All numbers.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The largest number.
    pub fn max(&self) -> f32 {
        self.values.iter().copied().fold(0.0, f32::max)
    }

    /// A voxel in three channels.
    pub fn voxel(&self, x: u32, y: u32, z: u32) -> [f32; 3] {
        let [width, height, _] = self.resolution.map(|side| side as usize);
        let index = (z as usize * height + y as usize) * width + x as usize;
        match self.channels {
            1 => [self.values[index]; 3],
            _ => [0, 1, 2].map(|channel| self.values[3 * index + channel]),
        }
    }

    /// Decodes a file of Mitsuba's binary format, version 3 with 32-bit numbers (its manual, plugin `gridvolume`): the letters `VOL`, a
    /// byte 3, then as little-endian words the type 1, the voxels along x, y and z, the channels, six numbers of the bounding box,
    /// and the voxels. Also returns the box, lower and upper corner. The error says what is wrong with the file.
    pub fn decode(bytes: &[u8]) -> Result<(Grid, [DVec3; 2]), String> {
        const HEAD: usize = 48;
        if !bytes.starts_with(b"VOL") {
            return Err("it does not begin with the letters \"VOL\"".to_owned());
        }
        if bytes.len() < HEAD {
            return Err(format!("it ends after {} bytes, within its head of {HEAD}", bytes.len()));
        }
        if bytes[3] != 3 {
            return Err(format!("it has version {}; version 3 is accepted", bytes[3]));
        }
        let word = |index: usize| {
            let at = 4 + 4 * index;
            i32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        };
        if word(0) != 1 {
            return Err(format!("its voxels are of type {}; type 1, 32-bit numbers, is accepted", word(0)));
        }
        let side = |index: usize| usize::try_from(word(index)).map_err(|_| format!("its size is {}", word(index)));
        let (resolution, channels) = ([side(1)?, side(2)?, side(3)?], side(4)?);
        let count = checked_count(resolution, channels)?;
        if bytes.len() - HEAD != 4 * count {
            let [x, y, z] = resolution;
            return Err(format!(
                "{x} x {y} x {z} voxels of {channels} channels take {} bytes, but {} follow its head",
                4 * count,
                bytes.len() - HEAD
            ));
        }
        let corner =
            |first: usize| DVec3::from_array([0, 1, 2].map(|k| f64::from(f32::from_bits(word(first + k) as u32))));
        let bounds = [corner(5), corner(8)];
        if !bounds[0].is_finite() || !bounds[1].is_finite() || bounds[0].cmpge(bounds[1]).any() {
            return Err(format!("its bounding box from {} to {} is empty", bounds[0], bounds[1]));
        }
        let numbers = bytes[HEAD..].chunks_exact(4);
        let values = numbers.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        Ok((Grid::new(resolution, channels, values)?, bounds))
    }

    /// The bytes of such a file, with a bounding box.
    pub fn encode(&self, bounds: [DVec3; 2]) -> Vec<u8> {
        let mut bytes = b"VOL\x03".to_vec();
        let [x, y, z] = self.resolution;
        [1, x, y, z, self.channels].iter().for_each(|word| bytes.extend(word.to_le_bytes()));
        bounds.iter().flat_map(|corner| corner.to_array()).for_each(|side| bytes.extend((side as f32).to_le_bytes()));
        self.values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        bytes
    }
}

/// How many numbers there are; an error for sizes that a grid cannot have.
fn checked_count(resolution: [usize; 3], channels: usize) -> Result<usize, String> {
    let [x, y, z] = resolution;
    if !(channels == 1 || channels == 3) {
        return Err(format!("its voxels have {channels} channels; 1 and 3 are accepted"));
    }
    if resolution.iter().any(|side| !(1..=MAX_SIDE).contains(side)) {
        return Err(format!("it has {x} x {y} x {z} voxels; 1 to {MAX_SIDE} along each side are accepted"));
    }
    let count = x.checked_mul(y).and_then(|n| n.checked_mul(z)).and_then(|n| n.checked_mul(channels));
    count.filter(|count| u32::try_from(*count).is_ok()).ok_or_else(|| {
        format!(
            "{x} x {y} x {z} voxels of {channels} channels are more numbers than the {} that a scene can hold",
            u32::MAX
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> Grid {
        Grid::new([2, 3, 1], 1, vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]).unwrap()
    }

    #[test]
    fn files_are_read_as_they_are_written() {
        let bounds = [DVec3::new(-1.0, 0.0, 2.0), DVec3::new(3.0, 2.0, 5.0)];
        assert_eq!(Grid::decode(&small().encode(bounds)), Ok((small(), bounds)));
        assert_eq!(small().voxel(1, 2, 0), [5.0; 3]);
        let rgb = Grid::new([1, 1, 2], 3, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
        assert_eq!(Grid::decode(&rgb.encode(bounds)).unwrap().0.voxel(0, 0, 1), [4.0, 5.0, 6.0]);
    }

    #[test]
    fn files_that_are_wrong_are_refused_with_the_reason() {
        let good = small().encode([DVec3::ZERO, DVec3::ONE]);
        let refused = |change: &dyn Fn(&mut Vec<u8>)| {
            let mut bytes = good.clone();
            change(&mut bytes);
            Grid::decode(&bytes).expect_err("it is wrong")
        };
        let word = |index: usize, value: u32| {
            move |bytes: &mut Vec<u8>| bytes[4 + 4 * index..8 + 4 * index].copy_from_slice(&value.to_le_bytes())
        };
        let cases: [(String, &str); 11] = [
            (refused(&|bytes| bytes[0] = b'v'), "does not begin with the letters"),
            (refused(&|bytes| bytes.truncate(40)), "ends after 40 bytes"),
            (refused(&|bytes| bytes[3] = 2), "version 2"),
            (refused(&word(0, 2)), "type 2"),
            (refused(&word(4, 2)), "2 channels"),
            (refused(&word(1, u32::MAX)), "size is -1"),
            (refused(&word(1, 0)), "0 x 3 x 1 voxels"),
            (refused(&|bytes| [1, 2, 3].iter().for_each(|k| word(*k, 32768)(bytes))), "more numbers than"),
            (refused(&|bytes| bytes.truncate(bytes.len() - 1)), "take 24 bytes, but 23 follow"),
            (refused(&word(5, 2f32.to_bits())), "bounding box"),
            (refused(&word(11 + 3, f32::NAN.to_bits())), "voxel (1, 1, 0) is NaN"),
        ];
        for (got, expected) in cases {
            assert!(got.contains(expected), "{got}");
        }
        assert!(refused(&word(11, (-1f32).to_bits())).contains("voxel (0, 0, 0) is -1"));
    }
}
