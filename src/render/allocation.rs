//! Which pixels get more samples than others.
//!
//! Noise gathers: on edges, in corners, in a cloud. If samples with the variance v go to a pixel in proportion to √v, the mean variance
//! over all pixels is the least that their number allows (Neyman 1934, "On the two different aspects of the representative method").
//! Here v is the scatter of a few samples of each pixel, relative to the brightness, tile by tile; and each tile gets a half, once, twice,
//! four or eight times the samples that are asked for, as many as these on average.
//!
//! The image stays unbiased: those few samples have random numbers of their own, and are not part of it (Kirk and Arvo 1991,
//! "Unbiased sampling techniques for image synthesis").

use super::Block;
use crate::pack::groups::group_margin;
use crate::pack::layout::TILE;
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Powers of two by which the number of samples may differ from what is asked for.
const LEVELS: Range<i32> = -1..4;
/// Fraction of the mean of all pixels that is added, in squares, to a pixel's brightness, as in [`crate::image::metrics`].
const FLOOR: f64 = 0.1;
/// The least gain that levels found on one half of each tile must have on the other half.
const LEAST_GAIN: f64 = 1.02;

/// The seed of the samples on which noise is measured.
pub fn trial_seed(seed: u32) -> u32 {
    seed ^ 0x7472_6961
}

/// How many samples the tiles of a crop window get.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Allocation {
    /// Of each tile, the power of two by which its number of samples is multiplied.
    levels: Vec<i32>,
}

impl Allocation {
    /// As many samples for all tiles as are asked for.
    pub fn uniform(crop: [u32; 2], sharers: u32) -> Self {
        let [columns, rows] = tile_grid(crop, sharers);
        Allocation { levels: vec![0; (columns * rows) as usize] }
    }

    /// More samples for tiles where a block has more noise; uniform, where little would be gained.
    ///
    /// # Panics
    /// When the block is not one of the crop window, or has already more samples in some pixels than in others.
    pub fn measured(block: &Block, crop: [u32; 2], sharers: u32) -> Self {
        assert_eq!(block.sums.len(), (crop[0] * crop[1]) as usize, "the block is of the crop window");
        assert!(block.count > 1, "one sample has no scatter");
        assert!(block.counts.iter().all(|&count| count == block.count), "all pixels are alike in the block");
        let halves = Noise::of_halves(block, crop, sharers);
        let [one, two] = &halves;
        // Noise of rare bright samples is not where it was seen: what one half shows says nothing of the other.
        let suited = gain(two, &levels(one)) + gain(one, &levels(two)) > 2.0 * LEAST_GAIN;
        if suited {
            Allocation { levels: levels(&Noise::of_both(&halves)) }
        } else {
            Allocation::uniform(crop, sharers)
        }
    }

    /// The levels that tiles have, each with the numbers of these tiles.
    pub fn tiles_by_level(&self) -> Vec<(Level, Vec<u32>)> {
        let of_level = |level: i32| (0..).zip(&self.levels).filter(move |(_, of_tile)| **of_tile == level);
        let with_tiles =
            LEVELS.map(|level| (Level(level), of_level(level).map(|(tile, _)| tile).collect::<Vec<u32>>()));
        with_tiles.filter(|(_, tiles)| !tiles.is_empty()).collect()
    }
}

/// A number of samples, as a power of two times that which is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level(i32);

impl Level {
    /// The samples of a tile with this level, where those of the range are asked for.
    pub fn samples(self, asked: &Range<u32>) -> Range<u32> {
        let of = |sample: u32| if self.0 < 0 { sample.div_ceil(1 << -self.0) } else { sample << self.0 };
        of(asked.start)..of(asked.end)
    }

    /// The first of the samples that were asked for to which a sample of a tile belongs.
    pub fn asked(self, sample: u32) -> u32 {
        if self.0 < 0 { sample << -self.0 } else { sample >> self.0 }
    }
}

/// Columns and rows of tiles that cover the crop window, wherever groups are shifted.
pub fn tile_grid(crop: [u32; 2], sharers: u32) -> [u32; 2] {
    let margin = group_margin(sharers);
    [0, 1].map(|k| (crop[k] + margin[k]).div_ceil(TILE))
}

/// Of each tile, or of one half of it, the pixels and the mean relative variance of their samples.
struct Noise {
    pixels: Vec<f64>,
    variance: Vec<f64>,
}

impl Noise {
    /// Of two halves of the tiles, relative to the brightness of the whole tiles. The halves are pairs of columns in turn, so that a group
    /// of pixels that share paths, as the groups lie for the first samples, is in one half.
    fn of_halves(block: &Block, crop: [u32; 2], sharers: u32) -> [Noise; 2] {
        let [across, down] = tile_grid(crop, sharers);
        let margin = group_margin(sharers);
        let count = (across * down) as usize;
        let samples = f64::from(block.count);
        let mut pixels = [vec![0.0; count], vec![0.0; count]];
        let mut scatter = [vec![DVec3::ZERO; count], vec![DVec3::ZERO; count]];
        let mut sums = vec![DVec3::ZERO; count];
        for (pixel, (sum, squares)) in block.sums.iter().zip(&block.squares).enumerate() {
            // Where groups shift, a pixel is in one tile or the next one: it counts for that where it is on average.
            let [x, y] = [pixel as u32 % crop[0], pixel as u32 / crop[0]];
            let tile = ((y + margin[1] / 2) / TILE * across + (x + margin[0] / 2) / TILE) as usize;
            let half = (x / 2 % 2) as usize;
            let mean = Vec3::from(*sum).as_dvec3() / samples;
            pixels[half][tile] += 1.0;
            sums[tile] += mean;
            scatter[half][tile] += (Vec3::from(*squares).as_dvec3() / samples - mean * mean).max(DVec3::ZERO);
        }
        let floor = FLOOR * sums.iter().sum::<DVec3>().element_sum() / (3 * block.sums.len()) as f64;
        let brightness: Vec<DVec3> = (sums.iter().enumerate())
            .map(|(tile, sum)| {
                let mean = *sum / (pixels[0][tile] + pixels[1][tile]);
                mean * mean + floor * floor
            })
            .collect();
        let relative = |half: usize, tile: usize| {
            let variance = (scatter[half][tile] / brightness[tile]).element_sum() / pixels[half][tile];
            // Nothing of an empty half, in the dark, and where samples are not finite.
            if variance.is_finite() { variance } else { 0.0 }
        };
        let variance = [0, 1].map(|half| (0..count).map(|tile| relative(half, tile)).collect());
        let ([of_one, of_two], [one, two]) = (pixels, variance);
        [Noise { pixels: of_one, variance: one }, Noise { pixels: of_two, variance: two }]
    }

    fn of_both([one, two]: &[Noise; 2]) -> Noise {
        let pixels: Vec<f64> = one.pixels.iter().zip(&two.pixels).map(|(one, two)| one + two).collect();
        let variance = (0..pixels.len()).map(|tile| {
            let of = |half: &Noise| half.pixels[tile] * half.variance[tile];
            (of(one) + of(two)) / f64::max(pixels[tile], 1.0)
        });
        Noise { variance: variance.collect(), pixels }
    }
}

/// How much less the product of mean variance and number of samples is with levels; 0 without any variance.
fn gain(noise: &Noise, levels: &[i32]) -> f64 {
    let (mut before, mut after) = ([0.0; 2], [0.0; 2]);
    for (tile, level) in levels.iter().enumerate() {
        let (factor, pixels) = (2f64.powi(*level), noise.pixels[tile]);
        before[0] += pixels * noise.variance[tile];
        before[1] += pixels;
        after[0] += pixels * noise.variance[tile] / factor;
        after[1] += pixels * factor;
    }
    if after[0] > 0.0 { before[0] * before[1] / (after[0] * after[1]) } else { 0.0 }
}

/// Levels near λ √v with the largest λ for which there are no more samples than are asked for.
fn levels(noise: &Noise) -> Vec<i32> {
    let weights: Vec<f64> = noise.variance.iter().map(|variance| variance.sqrt()).collect();
    let nearest = |lambda: f64, weight: &f64| {
        let level = (lambda * weight).log2().round();
        level.clamp(f64::from(LEVELS.start), f64::from(LEVELS.end - 1)) as i32
    };
    let all = |lambda: f64| weights.iter().map(|weight| nearest(lambda, weight)).collect::<Vec<i32>>();
    let too_many = |levels: &[i32]| {
        let more = levels.iter().zip(&noise.pixels).map(|(level, pixels)| (2f64.powi(*level) - 1.0) * pixels);
        more.sum::<f64>() > 0.0
    };
    let least = weights.iter().copied().filter(|&weight| weight > 0.0).reduce(f64::min);
    let Some(least) = least else { return vec![0; weights.len()] };
    // At the one end all tiles have the lowest level, at the other all that have noise the highest one.
    let (mut low, mut high) = (0.0, 2f64.powi(LEVELS.end) / least);
    if !too_many(&all(high)) {
        return all(high);
    }
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if too_many(&all(middle)) {
            high = middle;
        } else {
            low = middle;
        }
    }
    all(low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::rng::{pcg4d, to_unit};

    const CROP: [u32; 2] = [60, 44];

    /// Two samples of each pixel, of which `sample` makes one from a pixel's place and a random number.
    fn block(seed: u32, sample: impl Fn([u32; 2], f64) -> f64) -> Block {
        let mut block = Block::new(0..2, (CROP[0] * CROP[1]) as usize, 0);
        for pixel in 0..CROP[0] * CROP[1] {
            let index = pixel as usize;
            for number in 0..2 {
                let random = to_unit(pcg4d([seed, pixel, number, 0])).x;
                let value = sample([pixel % CROP[0], pixel / CROP[0]], random) as f32;
                for q in 0..3 {
                    block.sums[index][q] += value;
                    block.squares[index][q] += value * value;
                }
            }
            block.counts[index] = 2;
        }
        block
    }

    /// The multiplier of a pixel's number of samples.
    fn factor(allocation: &Allocation, [x, y]: [u32; 2]) -> f64 {
        2f64.powi(allocation.levels[(y / TILE * tile_grid(CROP, 0)[0] + x / TILE) as usize])
    }

    fn mean_factor(allocation: &Allocation) -> f64 {
        let pixels = (0..CROP[0] * CROP[1]).map(|pixel| [pixel % CROP[0], pixel / CROP[0]]);
        pixels.map(|pixel| factor(allocation, pixel)).sum::<f64>() / f64::from(CROP[0] * CROP[1])
    }

    /// A quarter of the image has four times the standard deviation.
    fn noisy_quarter([x, y]: [u32; 2], random: f64) -> f64 {
        let noisy = x < CROP[0] / 2 && y < CROP[1] / 2;
        1.0 + (random - 0.5) * if noisy { 0.8 } else { 0.2 }
    }

    #[test]
    fn noise_gets_more_samples_and_their_number_stays() {
        let allocation = Allocation::measured(&block(1, noisy_quarter), CROP, 0);
        assert!(factor(&allocation, [4, 4]) >= 2.0 && factor(&allocation, [50, 36]) <= 0.5, "{allocation:?}");
        let mean = mean_factor(&allocation);
        assert!((0.9..=1.0).contains(&mean), "{mean} times the samples that were asked for");
    }

    #[test]
    fn noise_counts_relative_to_brightness() {
        // Half of the image is a hundred times brighter, and its noise with it.
        let bright = |[x, _]: [u32; 2], random: f64| (0.9 + 0.2 * random) * if x < 32 { 100.0 } else { 1.0 };
        let allocation = Allocation::measured(&block(2, bright), CROP, 0);
        assert!(factor(&allocation, [60 - 1, 4]) <= factor(&allocation, [4, 4]), "{allocation:?}");
        let darker = |[x, y]: [u32; 2], random: f64| noisy_quarter([x, y], random) * if y < 22 { 0.9 } else { 1.0 };
        assert!(factor(&Allocation::measured(&block(3, darker), CROP, 0), [4, 4]) >= 2.0);
    }

    #[test]
    fn what_is_alike_everywhere_and_what_is_black_stays_uniform() {
        let uniform = Allocation::uniform(CROP, 0);
        assert_eq!(Allocation::measured(&block(4, |_, random| 0.5 + random), CROP, 0), uniform);
        assert_eq!(Allocation::measured(&block(5, |_, _| 0.0), CROP, 0), uniform);
        assert_ne!(Allocation::measured(&block(4, noisy_quarter), CROP, 0), uniform);
    }

    #[test]
    fn rare_bright_samples_are_not_chased() {
        // One sample in five hundred, wherever it falls: where the first ones were says nothing of the next ones.
        let spikes = |_: [u32; 2], random: f64| if random < 0.002 { 100.0 } else { 1.0 };
        assert_eq!(Allocation::measured(&block(6, spikes), CROP, 0), Allocation::uniform(CROP, 0));
    }

    #[test]
    fn invalid_samples_are_no_reason_for_more() {
        let spoilt =
            |[x, y]: [u32; 2], random: f64| if [x, y] == [30, 30] { f64::NAN } else { noisy_quarter([x, y], random) };
        // The mean of all is not finite, so that nothing is known.
        assert_eq!(Allocation::measured(&block(7, spoilt), CROP, 0), Allocation::uniform(CROP, 0));
    }

    #[test]
    fn each_tile_has_one_level() {
        for sharers in [0, 4, 8] {
            let allocation = Allocation::measured(&block(8, noisy_quarter), CROP, sharers);
            let mut tiles: Vec<u32> = allocation.tiles_by_level().into_iter().flat_map(|(_, tiles)| tiles).collect();
            tiles.sort_unstable();
            let [columns, rows] = tile_grid(CROP, sharers);
            assert_eq!(tiles, (0..columns * rows).collect::<Vec<u32>>());
            assert!(allocation.tiles_by_level().len() > 1, "{allocation:?}");
        }
    }

    #[test]
    fn samples_do_not_depend_on_the_cut() {
        for level in LEVELS.map(Level) {
            let whole = level.samples(&(16..75));
            let (first, second) = (level.samples(&(16..48)), level.samples(&(48..75)));
            assert_eq!((first.start, first.end, second.end), (whole.start, second.start, whole.end));
            assert!(whole.clone().all(|sample| (16..75).contains(&level.asked(sample))), "{level:?}");
            assert!(first.clone().all(|sample| level.asked(sample) < 48), "{level:?}");
        }
        assert_eq!(Level(1).samples(&(16..32)), 32..64);
        assert_eq!(Level(-1).samples(&(16..31)), 8..16);
    }
}
