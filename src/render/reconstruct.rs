//! The image behind samples whose noise pixels have in common.
//!
//! Where pixels share paths ([`crate::reference::path_share`]), the pixels of a group get their light from the same second vertices, so
//! that most of the noise of what they share is the same for all of them, while from one run of samples to the next the groups lie
//! elsewhere. So what a group says of the differences between its pixels is worth far more than what it says of their mean. With a
//! covariance of the noise of a group's sample of
//!
//! C = s u uᵀ + diag(u d u),
//!
//! where u is the expected shared radiance, d the relative variance of the noise that each pixel has alone, and s that of what the group
//! has in common, the best linear estimate of the image I (Aitken 1935, "On least squares and linear combinations of observations") is
//! the solution of
//!
//! Σ_groups n C⁻¹ I = Σ_groups C⁻¹ x,
//!
//! where x is the sum of n samples. Gradient-domain rendering (Lehtinen et al. 2013; Kettunen et al. 2015) solves such a system for
//! differences of neighbours with one weight for all; here groups of pixels are the observations, and the weights are measured.
//!
//! The estimate is unbiased as long as the weights do not depend on the samples that they weigh. A render therefore has two halves with
//! random numbers of their own: the weights of each half are measured on the other one.

use super::SharedSum;
use super::film::{Film, SharedSums};
use crate::pack::groups::{first_of_shift, group_offset, group_size};
use glam::DVec3;
use std::ops::{Add, AddAssign, Mul};

/// A pixel is taken to share at least this part of the mean of all.
const FLOOR: f64 = 0.05;
/// The least variance of a pixel's own noise, over its median.
const LEAST_NOISE: f64 = 0.1;
/// Weights of neighbours in the mean of variances: binomial, of a standard deviation of one pixel.
const KERNEL: [f64; 5] = [1.0, 4.0, 6.0, 4.0, 1.0];
/// The solution's residual over that of the start, and the most steps for it.
const TOLERANCE: f64 = 1e-3;
const MOST_STEPS: usize = 200;

/// The image of a film with so many columns: the mean of each pixel's samples, where pixels share paths with the shared part as above.
/// Fewer samples than two runs of each half (16), or samples that are not finite, leave the mean.
///
/// # Panics
/// When the film is empty.
pub fn image(film: &Film, width: u32) -> Vec<[f64; 3]> {
    let mut image = film.mean();
    let Some(shared) = film.shared() else { return image };
    let Some(changes) = changes(shared, width as usize) else { return image };
    for (pixel, change) in image.iter_mut().zip(changes) {
        *pixel = (DVec3::from(*pixel) + change).to_array();
    }
    image
}

/// By how much the shared part differs from its mean, if it is known better.
fn changes(shared: &SharedSums, width: usize) -> Option<Vec<DVec3>> {
    let halves = shared.halves.each_ref().map(|half| Half::of(half, shared.sharers, width));
    let [one, two] = [halves[0].as_ref()?, halves[1].as_ref()?];
    let (by_one, by_two) = rayon::join(|| Weights::of(one), || Weights::of(two));
    let (by_one, by_two) = (by_one?, by_two?);
    let change = |half: &Half, weights: &Weights| -> Vec<DVec3> {
        let changed = solve(half, weights).into_iter().zip(&half.mean).map(|(better, mean)| better - *mean);
        let samples = half.samples.iter().zip(one.samples.iter().zip(&two.samples));
        changed.zip(samples).map(|(change, (own, (one, two)))| change * (own / (one + two))).collect()
    };
    let (first, second) = rayon::join(|| change(one, &by_two), || change(two, &by_one));
    Some(first.into_iter().zip(second).map(|(a, b)| a + b).collect())
}

/// The samples of a half whose groups lay alike.
struct Observation<'a> {
    /// Of each pixel; the same for the pixels of a group.
    samples: Vec<f64>,
    sums: &'a [[f64; 3]],
    /// Of each pixel.
    group: Vec<u32>,
    group_count: usize,
}

impl Observation<'_> {
    /// `shift` is one of those of the groups.
    fn of(sum: &SharedSum<f64>, shift: u32, sharers: u32, width: usize) -> Observation<'_> {
        let [columns, rows] = group_size(sharers).map(|side| side as usize);
        let [dx, dy] = group_offset(sharers, first_of_shift(shift)).map(|shift| shift as usize);
        let across = (width + dx).div_ceil(columns);
        let group = |pixel: usize| (((pixel / width + dy) / rows) * across + (pixel % width + dx) / columns) as u32;
        let group_count = across * (sum.sums.len() / width + dy).div_ceil(rows);
        let group = (0..sum.sums.len()).map(group).collect();
        let samples = sum.counts.iter().map(|&count| f64::from(count)).collect();
        Observation { samples, sums: &sum.sums, group, group_count }
    }

    /// Sum over the pixels of each group.
    fn group_sums<T: Copy + Default + AddAssign>(&self, of_pixel: impl Fn(usize) -> T) -> Vec<T> {
        let mut sums = vec![T::default(); self.group_count];
        for (pixel, group) in self.group.iter().enumerate() {
            sums[*group as usize] += of_pixel(pixel);
        }
        sums
    }
}

/// One half of a render.
struct Half<'a> {
    /// Of each pixel.
    samples: Vec<f64>,
    /// Of each pixel, how many observations have samples of it.
    observed: Vec<f64>,
    observations: Vec<Observation<'a>>,
    mean: Vec<DVec3>,
    width: usize,
}

impl Half<'_> {
    /// Nothing, if the groups of a pixel lay in one way only, or if a sample is not finite.
    fn of(sums: &[SharedSum<f64>], sharers: u32, width: usize) -> Option<Half<'_>> {
        let observations: Vec<Observation> = (0..)
            .zip(sums)
            .filter(|(_, sum)| !sum.sums.is_empty())
            .map(|(shift, sum)| Observation::of(sum, shift, sharers, width))
            .collect();
        let pixels = observations.first()?.sums.len();
        let (mut samples, mut observed, mut mean) = (vec![0.0; pixels], vec![0.0; pixels], vec![DVec3::ZERO; pixels]);
        for observation in &observations {
            for (pixel, &count) in observation.samples.iter().enumerate() {
                samples[pixel] += count;
                observed[pixel] += f64::from(count > 0.0);
                mean[pixel] += DVec3::from_array(observation.sums[pixel]);
            }
        }
        mean.iter_mut().zip(&samples).for_each(|(mean, samples)| *mean /= *samples);
        let usable = observed.iter().all(|&observed| observed > 1.0) && mean.iter().all(|mean| mean.is_finite());
        usable.then_some(Half { samples, observed, observations, mean, width })
    }
}

/// The model of the noise.
struct Weights {
    /// u.
    expected: Vec<DVec3>,
    /// d, as 1 / d.
    precision: Vec<f64>,
    /// s.
    common: f64,
}

impl Weights {
    /// Measured on the scatter of the observations of a half about their mean. Nothing, if there is no scatter.
    fn of(half: &Half) -> Option<Weights> {
        let pixels = half.mean.len();
        let average = half.mean.iter().sum::<DVec3>() / pixels as f64;
        let floor = FLOOR * average.max(DVec3::splat(FLOOR * average.max_element()));
        if floor.cmple(DVec3::ZERO).any() {
            return None;
        }
        // Of neighbours together: a rare bright sample would make its pixel seem one whose noise is always large, and the noise of
        // groups in the other half would be taken from it alone.
        let positive: Vec<DVec3> = half.mean.iter().map(|mean| mean.max(DVec3::ZERO)).collect();
        let expected: Vec<DVec3> = blurred(&positive, half.width).into_iter().map(|mean| mean + floor).collect();
        // Relative variances of one sample: of each pixel's own noise, and of all noise.
        let (mut own, mut all) = (vec![0.0; pixels], 0.0);
        for observation in &half.observations {
            let scatter_of = |pixel: usize| {
                let (count, sum) = (observation.samples[pixel], DVec3::from_array(observation.sums[pixel]));
                let scatter = ((sum / count - half.mean[pixel]) / expected[pixel]).element_sum() / 3.0;
                if count > 0.0 { scatter } else { 0.0 }
            };
            let scatter: Vec<f64> = (0..pixels).map(scatter_of).collect();
            let scale = |pixel: usize| observation.samples[pixel] / (half.observed[pixel] - 1.0);
            let squares = scatter.iter().enumerate().map(|(pixel, scatter)| scale(pixel) * scatter * scatter);
            all += squares.sum::<f64>() / pixels as f64;
            let members = observation.group_sums(|_| 1.0);
            let sums = observation.group_sums(|pixel| scatter[pixel]);
            for (pixel, group) in observation.group.iter().enumerate() {
                let members = members[*group as usize];
                let alone = scatter[pixel] - sums[*group as usize] / members;
                own[pixel] += scale(pixel) * alone * alone * members / f64::max(members - 1.0, 1.0);
            }
        }
        let mut own = blurred(&own, half.width);
        let least = LEAST_NOISE * median(&own);
        own.iter_mut().for_each(|own| *own += least);
        let common = (all - own.iter().sum::<f64>() / pixels as f64).max(0.0);
        let known = least > 0.0 && common.is_finite();
        known.then(|| Weights { expected, precision: own.iter().map(|own| own.recip()).collect(), common })
    }
}

/// Mean with the neighbours, by [`KERNEL`] in both directions; beyond the edge there are none.
fn blurred<T>(values: &[T], width: usize) -> Vec<T>
where
    T: Copy + Default + Add<Output = T> + Mul<f64, Output = T>,
{
    let height = values.len() / width;
    let reach = KERNEL.len() / 2;
    let along = |values: &[T], step: usize, length: usize, place: &dyn Fn(usize) -> usize| -> Vec<T> {
        (0..values.len())
            .map(|index| {
                let at = place(index);
                let (mut sum, mut weights) = (T::default(), 0.0);
                for k in at.saturating_sub(reach)..(at + reach + 1).min(length) {
                    let weight = KERNEL[k + reach - at];
                    sum = sum + values[index + k * step - at * step] * weight;
                    weights += weight;
                }
                sum * (1.0 / weights)
            })
            .collect()
    };
    let rows = along(values, 1, width, &|index| index % width);
    along(&rows, width, height, &|index| index / width)
}

fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The best linear estimate of the image of a half, by conjugate gradients from its mean, preconditioned by the diagonal.
fn solve(half: &Half, weights: &Weights) -> Vec<DVec3> {
    let system = System::of(half, weights);
    let ratio = |a: DVec3, b: DVec3| DVec3::select(b.cmpgt(DVec3::ZERO), a / b, DVec3::ZERO);
    let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| *a * *b).sum::<DVec3>();
    // In units of what is expected.
    let mut image: Vec<DVec3> =
        half.mean.iter().zip(&weights.expected).map(|(mean, expected)| *mean / *expected).collect();
    let applied = system.apply(&image);
    let mut residual: Vec<DVec3> = system.right_side().into_iter().zip(applied).map(|(b, a)| b - a).collect();
    let precondition = |residual: &[DVec3]| -> Vec<DVec3> {
        residual.iter().zip(&system.diagonal).map(|(residual, diagonal)| *residual / *diagonal).collect()
    };
    let mut conditioned = precondition(&residual);
    let mut direction = conditioned.clone();
    let mut square = dot(&residual, &conditioned);
    let enough = square * TOLERANCE * TOLERANCE;
    for _ in 0..MOST_STEPS {
        if square.cmple(enough).all() {
            break;
        }
        let applied = system.apply(&direction);
        let step = ratio(square, dot(&direction, &applied));
        for (image, direction) in image.iter_mut().zip(&direction) {
            *image += step * *direction;
        }
        for (residual, applied) in residual.iter_mut().zip(&applied) {
            *residual -= step * *applied;
        }
        conditioned = precondition(&residual);
        let next = dot(&residual, &conditioned);
        let turn = ratio(next, square);
        for (direction, conditioned) in direction.iter_mut().zip(&conditioned) {
            *direction = *conditioned + turn * *direction;
        }
        square = next;
    }
    image.iter().zip(&weights.expected).map(|(image, expected)| *image * *expected).collect()
}

/// Σ n C⁻¹ over the groups of all observations. By Sherman and Morrison's formula, with w = 1 / d in units of what is expected,
/// C⁻¹ = diag(w) − b w wᵀ where b = s / (1 + s Σ w) for each group.
struct System<'a> {
    half: &'a Half<'a>,
    weights: &'a Weights,
    /// b of each group of each observation.
    removed: Vec<Vec<f64>>,
    diagonal: Vec<f64>,
}

impl System<'_> {
    fn of<'a>(half: &'a Half<'a>, weights: &'a Weights) -> System<'a> {
        let mut diagonal = vec![0.0; half.mean.len()];
        let mut removed = Vec::new();
        for observation in &half.observations {
            let sums = observation.group_sums(|pixel| weights.precision[pixel]);
            let of_groups: Vec<f64> = sums.iter().map(|sum| weights.common / (1.0 + weights.common * sum)).collect();
            let of_pixels = observation.group.iter().zip(&observation.samples).zip(&weights.precision);
            for (diagonal, ((group, samples), w)) in diagonal.iter_mut().zip(of_pixels) {
                *diagonal += samples * w * (1.0 - of_groups[*group as usize] * w);
            }
            removed.push(of_groups);
        }
        System { half, weights, removed, diagonal }
    }

    /// Adds C⁻¹ times the pixels' values, for each group of an observation.
    fn add(&self, observation: usize, value: impl Fn(usize) -> DVec3, sum: &mut [DVec3]) {
        let (removed, observation) = (&self.removed[observation], &self.half.observations[observation]);
        let w = &self.weights.precision;
        let groups = observation.group_sums(|pixel| w[pixel] * value(pixel));
        for (pixel, (sum, group)) in sum.iter_mut().zip(&observation.group).enumerate() {
            let group = *group as usize;
            *sum += w[pixel] * (value(pixel) - removed[group] * groups[group]);
        }
    }

    fn apply(&self, image: &[DVec3]) -> Vec<DVec3> {
        let mut result = vec![DVec3::ZERO; image.len()];
        for (index, observation) in self.half.observations.iter().enumerate() {
            self.add(index, |pixel| image[pixel] * observation.samples[pixel], &mut result);
        }
        result
    }

    fn right_side(&self) -> Vec<DVec3> {
        let mut result = vec![DVec3::ZERO; self.half.mean.len()];
        for (index, observation) in self.half.observations.iter().enumerate() {
            let value = |pixel: usize| DVec3::from_array(observation.sums[pixel]) / self.weights.expected[pixel];
            self.add(index, value, &mut result);
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pack::groups::groups;
    use crate::reference::rng::{pcg4d, to_unit};
    use crate::render::{Block, RUN_SAMPLES, Run};

    const WIDTH: usize = 24;
    const HEIGHT: usize = 18;

    /// Bright and dark halves, and a gradient.
    fn truth() -> Vec<DVec3> {
        let pixel = |index: usize| {
            let (x, y) = (index % WIDTH, index / WIDTH);
            DVec3::new(1.0, 0.5, 0.1) * (if x < WIDTH / 2 { 1.0 } else { 0.2 }) * (1.0 + 0.05 * y as f64)
        };
        (0..WIDTH * HEIGHT).map(pixel).collect()
    }

    /// A film of 64 samples. In each run the pixels of a group have noise in common and noise of their own, each with the given
    /// relative standard deviations and of mean 0.
    fn film(seed: u32, sharers: u32, common: f64, own: f64) -> Film {
        film_with(seed, sharers, common, own, |_| 0.0, |_| 1)
    }

    /// The same with something more that depends on a random number of its own for each group or pixel of a run, and with a multiple of
    /// the samples for each group.
    fn film_with(
        seed: u32,
        sharers: u32,
        common: f64,
        own: f64,
        more: impl Fn(f64) -> f64,
        times: impl Fn(u32) -> u32,
    ) -> Film {
        let noise = |a: u32, b: u32, c: u32| (to_unit(pcg4d([seed, a, b, c])) - 0.5) * 12f64.sqrt();
        let truth = truth();
        let mut film = Film::new(WIDTH * HEIGHT, 0);
        for first in (0..64).step_by(16) {
            let mut block = Block::new(first..first + 16, WIDTH * HEIGHT, sharers);
            for sample in (first..first + 16).step_by(RUN_SAMPLES as usize) {
                for (number, group) in (0..).zip(groups([WIDTH as u32, HEIGHT as u32], sharers, sample)) {
                    for [x, y] in group {
                        let pixel = y as usize * WIDTH + x as usize;
                        for time in 0..times(number) {
                            let part = sample + 1000 * time;
                            let [group, single] = [noise(part, number, 1), noise(part, pixel as u32, 2)];
                            let together = (group.truncate() + more(group.w)) * common;
                            let alone = (single.truncate() + more(single.w)) * own;
                            let sum = (truth[pixel] * (1.0 + together + alone) * 4.0).as_vec3().to_array();
                            let run = Run { first: sample, count: RUN_SAMPLES, sum, squares: sum, shared: sum };
                            block.add_run(pixel, &run);
                        }
                    }
                }
            }
            film.add(&block);
        }
        film
    }

    /// Mean square of the relative error.
    fn error(image: &[[f64; 3]]) -> f64 {
        let relative = |(pixel, truth): (&[f64; 3], &DVec3)| ((DVec3::from(*pixel) - *truth) / *truth).length_squared();
        image.iter().zip(&truth()).map(relative).sum::<f64>() / image.len() as f64
    }

    #[test]
    fn noise_in_common_is_told_from_the_image() {
        for sharers in [4, 8] {
            let film = film(1, sharers, 0.3, 0.1);
            let (plain, better) = (error(&film.mean()), error(&image(&film, WIDTH as u32)));
            assert!(better < 0.4 * plain, "{sharers}: {better} is not far below {plain}");
        }
    }

    /// Some groups have twice or six times the samples of others.
    fn uneven(group: u32) -> u32 {
        [1, 2, 1, 6][group as usize % 4]
    }

    #[test]
    fn groups_of_more_samples_count_for_more() {
        let film = film_with(7, 8, 0.3, 0.1, |_| 0.0, uneven);
        assert!(film.counts().iter().min() < film.counts().iter().max());
        let (plain, better) = (error(&film.mean()), error(&image(&film, WIDTH as u32)));
        assert!(better < 0.4 * plain, "{better} is not far below {plain}");
    }

    #[test]
    fn the_mean_over_many_films_is_the_image() {
        // Noise as large as the image, so that weights that depend on it would show.
        let films = 300;
        for times in [|_| 1, uneven as fn(u32) -> u32] {
            let mut deviations = [vec![], vec![]];
            for seed in 0..films {
                let film = film_with(seed, 8, 0.5, 0.3, |_| 0.0, times);
                for (deviations, image) in deviations.iter_mut().zip([image(&film, WIDTH as u32), film.mean()]) {
                    let relative =
                        |(pixel, truth): (&[f64; 3], &DVec3)| (DVec3::from(*pixel) / *truth - 1.0).element_sum();
                    let sum = image.iter().zip(&truth()).map(relative).sum::<f64>();
                    deviations.push(sum / (3 * WIDTH * HEIGHT) as f64);
                }
            }
            for deviations in deviations {
                let count = f64::from(films);
                let mean = deviations.iter().sum::<f64>() / count;
                let error = (deviations.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / count / (count - 1.0)).sqrt();
                assert!(mean.abs() < 4.0 * error && error < 2e-3, "{mean} ± {error}");
            }
        }
    }

    #[test]
    fn rare_bright_samples_do_not_mislead_the_weights() {
        // One in a hundred.
        let bright = |random: f64| if random > 0.49 * 12f64.sqrt() { 100.0 } else { 0.0 };
        let film = film_with(6, 8, 0.3, 0.1, bright, |_| 1);
        let (plain, better) = (error(&film.mean()), error(&image(&film, WIDTH as u32)));
        assert!(better < 0.7 * plain, "{better} is not far below {plain}");
    }

    #[test]
    fn noise_of_their_own_leaves_the_mean() {
        let film = film(3, 8, 0.0, 0.3);
        let (plain, better) = (error(&film.mean()), error(&image(&film, WIDTH as u32)));
        assert!((better / plain - 1.0).abs() < 0.02, "{better} instead of {plain}");
    }

    #[test]
    fn what_has_no_scatter_or_is_not_finite_stays() {
        let film_without = film(4, 8, 0.0, 0.0);
        assert_eq!(image(&film_without, WIDTH as u32), film_without.mean());
        let mut film = film(5, 8, 0.3, 0.1);
        let mut block = Block::new(64..80, WIDTH * HEIGHT, 8);
        for pixel in 0..WIDTH * HEIGHT {
            let shared = [if pixel == 7 { f32::NAN } else { 0.0 }; 3];
            block.add_run(pixel, &Run { first: 64, count: 16, sum: shared, squares: shared, shared });
        }
        block.invalid = [1, 0, 0];
        film.add(&block);
        let image = image(&film, WIDTH as u32);
        assert!(image[7][0].is_nan() && image[8] == film.mean()[8]);
    }

    #[test]
    fn few_samples_leave_the_mean() {
        let mut short = Film::new(WIDTH * HEIGHT, 0);
        let mut block = Block::new(0..8, WIDTH * HEIGHT, 4);
        for pixel in 0..WIDTH * HEIGHT {
            for first in [0, 4] {
                let one = [1.0 + pixel as f32; 3];
                block.add_run(pixel, &Run { first, count: 4, sum: one, squares: one, shared: one });
            }
        }
        short.add(&block);
        assert_eq!(image(&short, WIDTH as u32), short.mean());
    }
}
