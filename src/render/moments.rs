//! Second moments of samples, as Mitsuba's `moment` integrator records them.

use super::film::Film;

/// The channels `m2_NAME.R`, `.G` and `.B`: the mean of the squares of each pixel's samples.
///
/// They are means of samples that all have the weight 1; the film must have no filter with negative lobes, and pixels must not share
/// their paths, which would make of a sample a mean over several.
///
/// # Panics
/// When the film is empty.
pub fn channels(film: &Film, name: &str) -> Vec<(String, Vec<f32>)> {
    let count = f64::from(film.samples());
    let pixels = film.mean().into_iter().zip(film.variance());
    // The variance of the mean of n samples is (E[x²] − E[x]²) / (n − 1). Of one sample it is 0.
    let moments: Vec<[f64; 3]> =
        pixels.map(|(mean, variance)| [0, 1, 2].map(|q| variance[q] * (count - 1.0) + mean[q] * mean[q])).collect();
    let channel = |q: usize| moments.iter().map(|moment| moment[q] as f32).collect();
    ["R", "G", "B"].into_iter().enumerate().map(|(q, color)| (format!("m2_{name}.{color}"), channel(q))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Block;

    /// A film of one pixel with samples in blocks of 16.
    fn film(samples: &[f32]) -> Film {
        let mut film = Film::new(1, 0);
        for (index, samples) in samples.chunks(16).enumerate() {
            let sum = samples.iter().sum::<f32>();
            let squares = samples.iter().map(|sample| sample * sample).sum::<f32>();
            film.add(&Block {
                first: 16 * index as u32,
                count: samples.len() as u32,
                counts: vec![samples.len() as u32],
                sums: vec![[sum, 2.0 * sum, -sum]],
                squares: vec![[squares, 4.0 * squares, squares]],
                ..Block::default()
            });
        }
        film
    }

    #[test]
    fn means_of_squares_are_those_of_the_samples() {
        // Blocks of different sums: squares of sums would not do.
        let samples: Vec<f32> = (0..37).map(|k| if k < 16 { 0.5 } else { (k % 5) as f32 }).collect();
        let expected = samples.iter().map(|sample| f64::from(sample * sample)).sum::<f64>() / 37.0;
        let found = channels(&film(&samples), "inner");
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["m2_inner.R", "m2_inner.G", "m2_inner.B"]);
        for ((_, values), factor) in found.iter().zip([1.0, 4.0, 1.0]) {
            let agrees = |expected: f64| (f64::from(values[0]) - expected).abs() < 1e-6 * expected;
            assert!(agrees(factor * expected) && !agrees(factor * expected * 37.0 / 36.0), "{values:?}");
        }
    }

    #[test]
    fn one_sample_is_its_own_moment() {
        assert_eq!(channels(&film(&[3.0]), "a")[0].1, [9.0]);
    }
}
