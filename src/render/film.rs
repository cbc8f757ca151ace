//! The film: sums of samples in double precision, and what can be said of them.

use super::{BLOCK_SAMPLES, Block, INVALID_CAUSES, RUN_SHIFTS, Shared, SharedSum};

/// Fraction of the film's mean below which a pixel's relative error is taken against this floor, as in
/// [`crate::image::metrics`].
const FLOOR: f64 = 0.1;

/// The sums of all samples so far.
///
/// Blocks are added one by one in ascending order, so the sums do not depend on how the range was cut into dispatches:
/// the same blocks give the same bits.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// First sample.
    first: u32,
    /// Sample behind the last one so far.
    end: u32,
    /// Samples of each pixel.
    counts: Vec<u32>,
    /// Σ radiance of each pixel.
    sums: Vec<[f64; 3]>,
    /// Σ radiance² of each pixel.
    squares: Vec<[f64; 3]>,
    /// Where pixels share paths, what was shared.
    shared: Option<SharedSums>,
    /// Samples found invalid, for each of [`INVALID_CAUSES`].
    invalid: [u64; INVALID_CAUSES.len()],
}

/// What the pixels shared, apart for each half and shift of the groups.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedSums {
    /// Pixels of a group.
    pub sharers: u32,
    /// For each half of the render and each shift of its groups.
    pub halves: [[SharedSum<f64>; RUN_SHIFTS as usize]; 2],
}

impl Film {
    /// An empty film of `pixels` pixels, whose first sample will be `first`.
    ///
    /// # Panics
    /// When `first` is not a multiple of [`BLOCK_SAMPLES`].
    pub fn new(pixels: usize, first: u32) -> Self {
        assert!(first.is_multiple_of(BLOCK_SAMPLES), "a film begins with a block");
        Film {
            first,
            end: first,
            counts: vec![0; pixels],
            sums: vec![[0.0; 3]; pixels],
            squares: vec![[0.0; 3]; pixels],
            shared: None,
            invalid: [0; _],
        }
    }

    /// Adds the block that follows the last one.
    ///
    /// # Panics
    /// When the block is not the next one, has no or too many samples, or is of another size: the order is part of what
    /// makes films reproducible, so a wrong one is a fault of the program. Nothing can follow a block of fewer than
    /// [`BLOCK_SAMPLES`] samples.
    pub fn add(&mut self, block: &Block) {
        assert_eq!(block.first, self.end, "blocks come in ascending order without gaps");
        assert!(block.first.is_multiple_of(BLOCK_SAMPLES), "nothing follows an incomplete block");
        assert!((1..=BLOCK_SAMPLES).contains(&block.count), "a block has 1 to {BLOCK_SAMPLES} samples");
        assert_eq!(block.sums.len(), self.sums.len(), "a block has a sum for each pixel");
        assert_eq!(block.squares.len(), self.squares.len(), "a block has a sum of squares for each pixel");
        assert_eq!(block.counts.len(), self.counts.len(), "a block has a number of samples for each pixel");
        self.counts.iter_mut().zip(&block.counts).for_each(|(total, count)| *total += count);
        accumulate(&mut self.sums, &block.sums);
        accumulate(&mut self.squares, &block.squares);
        if let Some(shared) = &block.shared {
            self.add_shared(shared);
        }
        for (total, invalid) in self.invalid.iter_mut().zip(block.invalid) {
            *total += invalid;
        }
        self.end += block.count;
    }

    fn add_shared(&mut self, shared: &Shared) {
        let pixels = self.pixels();
        let sums =
            self.shared.get_or_insert_with(|| SharedSums { sharers: shared.sharers, halves: Default::default() });
        assert_eq!(shared.sharers, sums.sharers, "groups do not change while a scene is rendered");
        for (total, sum) in sums.halves.as_flattened_mut().iter_mut().zip(shared.halves.as_flattened()) {
            if !sum.sums.is_empty() {
                total.sums.resize(pixels, [0.0; 3]);
                total.counts.resize(pixels, 0);
                accumulate(&mut total.sums, &sum.sums);
                total.counts.iter_mut().zip(&sum.counts).for_each(|(total, count)| *total += count);
            }
        }
    }

    /// Forgets what was shared: the image is then the mean.
    pub fn forget_shared(&mut self) {
        self.shared = None;
    }

    /// What the pixels have shared so far, if they share paths.
    pub fn shared(&self) -> Option<&SharedSums> {
        self.shared.as_ref()
    }

    /// The samples in the film.
    pub fn range(&self) -> std::ops::Range<u32> {
        self.first..self.end
    }

    /// Samples in each pixel; where some have more than others, on average.
    pub fn samples(&self) -> u32 {
        self.end - self.first
    }

    /// Samples of each pixel.
    pub fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.sums.len()
    }

    /// Samples found invalid so far, for each of [`INVALID_CAUSES`]. They are in the sums.
    pub fn invalid(&self) -> [u64; INVALID_CAUSES.len()] {
        self.invalid
    }

    /// The image: the mean of each pixel's samples.
    ///
    /// # Panics
    /// When the film is empty.
    pub fn mean(&self) -> Vec<[f64; 3]> {
        self.check();
        self.sums.iter().zip(&self.counts).map(|(sum, &count)| sum.map(|sum| sum / f64::from(count))).collect()
    }

    /// The variance of [`Film::mean`]: the sample variance divided by the number of samples. A single sample shows no
    /// scatter, and its variance is given as 0. The squares were summed in single precision within a block, so the
    /// difference that defines the variance can come out below 0 by rounding, and is then 0 as well.
    ///
    /// # Panics
    /// When the film is empty.
    pub fn variance(&self) -> Vec<[f64; 3]> {
        self.check();
        let variance = |sum: f64, squares: f64, count: f64| {
            let scatter = squares - sum * sum / count;
            // Written so that NaN, the mark of an invalid sample, stays NaN.
            if scatter < 0.0 { 0.0 } else { scatter / ((count - 1.0).max(1.0) * count) }
        };
        if self.samples() == 1 {
            return vec![[0.0; 3]; self.pixels()];
        }
        let pixels = self.sums.iter().zip(&self.squares).zip(&self.counts);
        let of_pixel = |((sum, squares), &count): ((&[f64; 3], &[f64; 3]), &u32)| {
            [0, 1, 2].map(|q| variance(sum[q], squares[q], f64::from(count)))
        };
        pixels.map(of_pixel).collect()
    }

    /// An estimate of the relative error of the image from the scatter of its samples: the mean over pixels and channels
    /// of standard error / √(x² + e²), where x is the pixel and e a tenth of the film's mean. Samples are taken as
    /// independent, so stratified ones are better than this says. `None` if there are fewer than two samples, or if the
    /// image is black or not finite.
    pub fn relative_standard_error(&self) -> Option<f64> {
        if self.samples() < 2 {
            return None;
        }
        let values = (3 * self.pixels()) as f64;
        let mean = self.mean();
        let floor = (FLOOR * mean.iter().flatten().sum::<f64>() / values).powi(2);
        let variance = self.variance();
        let pairs = mean.iter().flatten().zip(variance.iter().flatten());
        let sum: f64 = pairs.map(|(x, variance)| (variance / (x * x + floor)).sqrt()).sum();
        Some(sum / values).filter(|error| error.is_finite())
    }

    fn check(&self) {
        assert!(self.samples() > 0, "an empty film has no image");
    }
}

fn accumulate(totals: &mut [[f64; 3]], values: &[[f32; 3]]) {
    for (total, value) in totals.iter_mut().zip(values) {
        for q in 0..3 {
            total[q] += f64::from(value[q]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of one pixel whose samples are `samples`.
    fn block(first: u32, samples: &[f32]) -> Block {
        let sum = samples.iter().sum::<f32>();
        let squares = samples.iter().map(|s| s * s).sum::<f32>();
        let (sums, squares) = (vec![[sum, 2.0 * sum, 0.0]], vec![[squares, 4.0 * squares, 0.0]]);
        let count = samples.len() as u32;
        Block { first, count, counts: vec![count], sums, squares, ..Block::default() }
    }

    #[test]
    fn mean_and_variance_are_those_of_the_samples() {
        // 16 times (1, 3) and then (1, 2, 3): mean 2; Σ(x − 2)² = 16 + 2 = 18 over 19 samples.
        let mut film = Film::new(1, 0);
        film.add(&block(0, &[1.0, 3.0].repeat(8)));
        film.add(&block(16, &[1.0, 2.0, 3.0]));
        assert_eq!(film.range(), 0..19);
        assert_eq!(film.mean(), [[2.0, 4.0, 0.0]]);
        let variance = film.variance()[0];
        let expected = 18.0 / 18.0 / 19.0;
        assert!((variance[0] - expected).abs() < 1e-12 && (variance[1] - 4.0 * expected).abs() < 1e-12, "{variance:?}");
        assert_eq!(variance[2], 0.0);
        // Standard error over √(x² + e²) of the channels, with e = 0.1 · 2.
        let relative = |x: f64, variance: f64| (variance / (x * x + 0.04)).sqrt();
        let expected = (relative(2.0, expected) + relative(4.0, 4.0 * expected)) / 3.0;
        assert!((film.relative_standard_error().unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn one_sample_has_no_variance() {
        let mut film = Film::new(1, 32);
        film.add(&block(32, &[5.0]));
        assert_eq!(film.variance(), [[0.0; 3]]);
        assert_eq!(film.relative_standard_error(), None);
    }

    #[test]
    fn rounding_does_not_make_a_variance_negative() {
        // 16 equal samples whose square rounds down in single precision.
        let mut film = Film::new(1, 0);
        film.add(&block(0, &[0.1; 16]));
        assert!(film.variance()[0].iter().all(|&variance| (0.0..1e-7).contains(&variance)));
        // The sum of squares one part in 10 million too small.
        let spoilt = Block { squares: vec![[16.0 * (1.0 - 1e-6), 0.0, 0.0]], ..block(0, &[1.0; 16]) };
        let mut film = Film::new(1, 0);
        film.add(&spoilt);
        assert_eq!(film.variance()[0][0], 0.0);
    }

    #[test]
    fn invalid_samples_are_counted_and_seen() {
        let mut film = Film::new(1, 0);
        film.add(&Block { invalid: [1, 0, 2], ..block(0, &[f32::NAN; 16]) });
        film.add(&Block { invalid: [1, 3, 0], ..block(16, &[1.0; 16]) });
        assert_eq!(film.invalid(), [2, 3, 2]);
        assert!(film.mean()[0][0].is_nan() && film.variance()[0][0].is_nan());
        assert_eq!(film.relative_standard_error(), None);
    }

    #[test]
    fn fifty_thousand_samples_lose_nothing() {
        // In single precision 2^24 + 1 = 2^24; in double precision the small blocks still count.
        let mut film = Film::new(1, 0);
        film.add(&block(0, &[2f32.powi(24); 16]));
        for index in 1..3126 {
            film.add(&block(16 * index, &[1.0 / 16.0; 16]));
        }
        assert_eq!(film.mean()[0][0] * 50016.0, 2f64.powi(28) + 3125.0);
    }

    #[test]
    #[should_panic(expected = "ascending order without gaps")]
    fn a_gap_is_refused() {
        Film::new(1, 0).add(&block(16, &[1.0; 16]));
    }

    #[test]
    #[should_panic(expected = "ascending order without gaps")]
    fn a_repeated_block_is_refused() {
        let mut film = Film::new(1, 0);
        film.add(&block(0, &[1.0; 16]));
        film.add(&block(0, &[1.0; 16]));
    }

    #[test]
    #[should_panic(expected = "nothing follows an incomplete block")]
    fn nothing_follows_an_incomplete_block() {
        let mut film = Film::new(1, 0);
        film.add(&block(0, &[1.0; 4]));
        film.add(&block(4, &[1.0; 16]));
    }

    #[test]
    #[should_panic(expected = "a sum for each pixel")]
    fn another_size_is_refused() {
        Film::new(2, 0).add(&block(0, &[1.0; 16]));
    }
}
