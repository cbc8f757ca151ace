//! How far an image is from a reference.
//!
//! With x the image, r the reference, q one of `R G B`, and d = x − r:
//! - MSE: the mean of d² over pixels and channels.
//! - relMSE: the mean over pixels of (1/3) Σ_q d_q² / (r_q² + e²), where e is a tenth of the mean of r over all pixels and
//!   channels, so that dark pixels do not decide the sum (relative errors with such a term: Rousselle et al. 2011,
//!   "Adaptive Sampling and Reconstruction using Greedy Error Minimization").
//! - trimmed relMSE: the same over the 99 % of pixels with the smallest error, so that a few fireflies do not decide it.
//! - z of a channel: the mean difference in units of its own standard error, as it follows from the scatter of d over the image, with the noise
//!   of both images in it. That is std(t) / √n for the means t of n tiles; pixels that share paths have noise in common, so it is the largest
//!   for tiles of 1, 2, 4, … pixels on a side, as long as there are 64 ("blocking": Flyvbjerg and Petersen 1989, "Error estimates on averages of
//!   correlated data"). A |z| above 4 or so is a bias.
//! - agreement: the share of pixels in which every channel differs by at most a thousandth of the reference. Two renders along
//!   the same random numbers agree in nearly all pixels, two independent ones in nearly none.
//!
//! All sums are in double precision.

use super::Image;

/// Fraction of the reference's mean that is added (in square) to the denominator of relMSE.
const FLOOR: f64 = 0.1;

/// Relative difference up to which a pixel counts as agreeing.
const AGREEMENT: f64 = 1e-3;

/// The scatter of fewer tiles tells too little.
const LEAST_TILES: usize = 64;

/// The differences between an image and a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Mean square error.
    pub mse: f64,
    /// Mean relative square error.
    pub rel_mse: f64,
    /// Mean relative square error without the worst 1 % of pixels.
    pub trimmed_rel_mse: f64,
    /// Share of pixels that agree to a thousandth.
    pub agreement: f64,
    /// Of `R`, `G` and `B`.
    pub channels: [Difference; 3],
    /// Of the mean over the three channels.
    pub mean: Difference,
}

/// The mean difference of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Mean of the image.
    pub image: f64,
    /// Mean of the reference.
    pub reference: f64,
    /// Mean of image − reference.
    pub difference: f64,
    /// The mean difference divided by its standard error; 0 if both are 0, infinite if only the latter is.
    pub z: f64,
}

/// Images that cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MetricsError {
    /// The two differ in size.
    #[error("the image has {}×{} pixels but the reference {}×{}", image.0, image.1, reference.0, reference.1)]
    Size {
        /// Width and height of the image.
        image: (usize, usize),
        /// Width and height of the reference.
        reference: (usize, usize),
    },
    /// There are no pixels.
    #[error("the images have no pixels")]
    Empty,
    /// One of the two lacks red, green or blue.
    #[error("the {which} has no channel {channel}")]
    MissingChannel {
        /// "image" or "reference".
        which: &'static str,
        /// The name of the channel.
        channel: &'static str,
    },
    /// A sample is not a number that one could compare.
    #[error("the {which} is {value} at pixel ({x}, {y}), channel {channel}")]
    NotFinite {
        /// "image" or "reference".
        which: &'static str,
        /// The name of the channel.
        channel: &'static str,
        /// Column, from the left edge of the image.
        x: usize,
        /// Row, from the top edge of the image.
        y: usize,
        /// NaN or an infinity.
        value: f32,
    },
}

/// Measures how far `image` is from `reference`.
pub fn compare(image: &Image, reference: &Image) -> Result<Comparison, MetricsError> {
    let (size, reference_size) = ((image.width, image.height), (reference.width, reference.height));
    if size != reference_size {
        return Err(MetricsError::Size { image: size, reference: reference_size });
    }
    let pixels = image.width * image.height;
    if pixels == 0 {
        return Err(MetricsError::Empty);
    }
    let x = finite_rgb(image, "image")?;
    let r = finite_rgb(reference, "reference")?;

    let reference_mean = r.iter().map(|channel| mean(channel.iter().map(|&v| f64::from(v)))).sum::<f64>() / 3.0;
    let floor = (FLOOR * reference_mean).powi(2);
    let mut square_sum = 0.0;
    let mut relative: Vec<f64> = (0..pixels)
        .map(|pixel| {
            let mut sum = 0.0;
            for q in 0..3 {
                let reference = f64::from(r[q][pixel]);
                let square = (f64::from(x[q][pixel]) - reference).powi(2);
                square_sum += square;
                // Black on a black reference is no error; anything else there is an infinite one.
                if square > 0.0 {
                    sum += square / (reference.powi(2) + floor);
                }
            }
            sum / 3.0
        })
        .collect();
    let rel_mse = mean(relative.iter().copied());
    relative.sort_unstable_by(f64::total_cmp);
    let kept = (99 * pixels).div_ceil(100);

    let agrees = |pixel: &usize| {
        (0..3).all(|q| {
            let reference = f64::from(r[q][*pixel]);
            (f64::from(x[q][*pixel]) - reference).abs() <= AGREEMENT * reference.abs()
        })
    };
    let triple = |images: &[&[f32]; 3], pixel: usize| images.map(|channel| f64::from(channel[pixel]));
    let average = |images: &[&[f32]; 3], pixel| triple(images, pixel).iter().sum::<f64>() / 3.0;
    Ok(Comparison {
        mse: square_sum / (3 * pixels) as f64,
        rel_mse,
        trimmed_rel_mse: mean(relative[..kept].iter().copied()),
        agreement: (0..pixels).filter(agrees).count() as f64 / pixels as f64,
        channels: [0, 1, 2].map(|q| difference(image.width, pixels, |p| f64::from(x[q][p]), |p| f64::from(r[q][p]))),
        mean: difference(image.width, pixels, |p| average(&x, p), |p| average(&r, p)),
    })
}

/// The mean difference of one channel and its significance, for rows of so many pixels.
fn difference(
    width: usize,
    pixels: usize,
    image: impl Fn(usize) -> f64,
    reference: impl Fn(usize) -> f64,
) -> Difference {
    let differences: Vec<f64> = (0..pixels).map(|pixel| image(pixel) - reference(pixel)).collect();
    let mean_difference = mean(differences.iter().copied());
    let z = if mean_difference == 0.0 { 0.0 } else { mean_difference / standard_error(&differences, width) };
    Difference {
        image: mean((0..pixels).map(&image)),
        reference: mean((0..pixels).map(&reference)),
        difference: mean_difference,
        z,
    }
}

/// The standard error of the mean of an image's pixels, which may depend on their neighbours.
fn standard_error(pixels: &[f64], width: usize) -> f64 {
    let height = pixels.len() / width;
    let mut largest = 0.0f64;
    let mut side = 1;
    // With one pixel there is no scatter to be seen.
    while side == 1 || (width / side) * (height / side) >= LEAST_TILES {
        let (columns, rows) = (width / side, height / side);
        let tile = |index: usize| {
            let (left, top) = (index % columns * side, index / columns * side);
            (top..top + side).map(|y| mean(pixels[y * width + left..][..side].iter().copied())).sum::<f64>()
                / side as f64
        };
        let tiles: Vec<f64> = (0..columns * rows).map(tile).collect();
        let average = mean(tiles.iter().copied());
        let squares: f64 = tiles.iter().map(|tile| (tile - average).powi(2)).sum();
        let variance = squares / (tiles.len().max(2) - 1) as f64;
        largest = largest.max((variance / tiles.len() as f64).sqrt());
        side *= 2;
    }
    largest
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

fn finite_rgb<'a>(image: &'a Image, which: &'static str) -> Result<[&'a [f32]; 3], MetricsError> {
    let rgb = image.rgb().map_err(|channel| MetricsError::MissingChannel { which, channel })?;
    for (channel, samples) in ["R", "G", "B"].into_iter().zip(rgb) {
        if let Some(pixel) = samples.iter().position(|value| !value.is_finite()) {
            let (x, y) = (pixel % image.width, pixel / image.width);
            return Err(MetricsError::NotFinite { which, channel, x, y, value: samples[pixel] });
        }
    }
    Ok(rgb)
}
