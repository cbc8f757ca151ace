//! Tests of hypotheses.

/// log Γ(x) for x > 0: Stirling's series after moving x upwards.
fn ln_gamma(x: f64) -> f64 {
    let (mut x, mut shift) = (x, 0.0);
    while x < 15.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let series = 1.0 / (12.0 * x) - 1.0 / (360.0 * x.powi(3)) + 1.0 / (1260.0 * x.powi(5));
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * std::f64::consts::PI).ln() + series + shift
}

/// Probability that χ² with `freedom` degrees exceeds x: the incomplete gamma function by its series, or beyond its
/// middle by its continued fraction (Abramowitz and Stegun 6.5.29 and 6.5.31).
pub fn chi_squared_tail(x: f64, freedom: f64) -> f64 {
    let (a, x) = (freedom / 2.0, x / 2.0);
    if x <= 0.0 {
        return 1.0;
    }
    let factor = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        1.0 - factor * sum
    } else {
        let fraction = (1..500).rev().fold(x, |rest, k| {
            let k = f64::from(k);
            x + (k - a) / (1.0 + k / rest)
        });
        factor / fraction
    }
}

/// Probability that |t| of Student's distribution exceeds `t`: Simpson's rule on its density.
pub fn student_tails(t: f64, freedom: f64) -> f64 {
    let norm =
        (ln_gamma((freedom + 1.0) / 2.0) - ln_gamma(freedom / 2.0)).exp() / (freedom * std::f64::consts::PI).sqrt();
    let density = |x: f64| norm * (1.0 + x * x / freedom).powf(-(freedom + 1.0) / 2.0);
    let steps = 4000;
    let width = t / f64::from(steps);
    let inner: f64 = (1..steps).map(|k| density(f64::from(k) * width) * if k % 2 == 1 { 4.0 } else { 2.0 }).sum();
    1.0 - 2.0 * (density(0.0) + density(t) + inner) * width / 3.0
}

/// The |t| that the largest of `tests` independent ones exceeds with a probability of 1e-3 (Šidák 1967).
pub fn sidak_bound(tests: usize, freedom: f64) -> f64 {
    let each = 1.0 - (1.0 - 1e-3f64).powf(1.0 / tests as f64);
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..100 {
        let middle = (low + high) / 2.0;
        if student_tails(middle, freedom) > each { low = middle } else { high = middle }
    }
    high
}

/// Whether numbers in \[0, 1) are spread evenly over `bins`; the error has the probability of what was seen.
pub fn check_uniform(numbers: impl IntoIterator<Item = f64>, bins: usize) -> Result<f64, String> {
    let mut counts = vec![0u64; bins];
    for number in numbers {
        let bin = number * bins as f64;
        if !(-1e-3..=bins as f64 + 1e-3).contains(&bin) {
            return Err(format!("{number} is outside of the distribution"));
        }
        counts[(bin.max(0.0) as usize).min(bins - 1)] += 1;
    }
    let expected = counts.iter().sum::<u64>() as f64 / bins as f64;
    assert!(expected > 20.0, "too few numbers for {bins} bins");
    let chi_squared: f64 = counts.iter().map(|&count| (count as f64 - expected).powi(2) / expected).sum();
    let probability = chi_squared_tail(chi_squared, bins as f64 - 1.0);
    // The seeds are fixed, so this is no lottery: a right sampler that passes once passes always.
    if probability < 1e-4 {
        return Err(format!("chi² = {chi_squared:.1} in {bins} bins, whose probability is {probability:e}"));
    }
    Ok(probability)
}

/// Mean and its standard error from the means of independent batches.
pub fn mean_and_error(batches: &[f64]) -> (f64, f64) {
    let count = batches.len() as f64;
    let mean = batches.iter().sum::<f64>() / count;
    let variance = batches.iter().map(|batch| (batch - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, (variance / count).sqrt())
}
