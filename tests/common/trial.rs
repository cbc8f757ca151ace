//! Estimates of the renderer against expectations that a table knows: the procedure of all tests of truth.
//!
//! An estimate is the mean of 64 independent batches, and its standard error comes from their spread, never from single samples,
//! whose distribution may have a heavy tail. A pilot tells how many samples a case needs: a standard error of at most a seventh
//! of the bias worth catching, so that such a bias is seen in more than 95 % of all cases even by the strictest bound below. Seeds
//! are hashes of the case's name, so nobody picks them. A case fails where |z| exceeds the bound that the largest of all would
//! exceed once in a thousand runs (Šidák 1967), and a second estimate, of four times as many samples and another seed, is off
//! by more than three standard errors to the same side. All cases of a table together must also look like what they are:
//! the sum of z² and the mean of z see a bias that is far too small for a single case.

use super::images::batches;
use super::statistics::{chi_squared_tail, mean_and_error, sidak_bound};
use super::truth::{full, picked};
use std::fmt::Write;
use std::time::Instant;
use tyndall::scene::Scene;

/// Samples a pixel of the pilot.
const PILOT: u32 = 32;
/// Most samples a pixel.
const MOST: u32 = 1 << 17;
/// Relative error of f32 sums and tables.
const ROUNDING: f64 = 1e-5;

/// One expectation.
pub struct Case {
    /// The row and what of it; also decides on the seeds.
    pub name: String,
    /// The estimate is the sum of the mean radiances of these scenes, each times a weight.
    pub views: Vec<(f64, Scene)>,
    /// The colour channel.
    pub channel: usize,
    /// What it should be.
    pub expected: f64,
    /// Absolute error of that.
    pub error: f64,
    /// The bias that is worth catching.
    pub tolerance: f64,
    /// The estimator has no finite variance, so that neither the kurtosis of its batches nor its z-value can be expected to be
    /// normal. What is left of the procedure is the bound on z, and that the spread is below the tolerance.
    pub heavy_tailed: bool,
}

impl Case {
    /// A case of one scene, in the red channel.
    pub fn new(name: String, scene: Scene, (expected, error): (f64, f64), tolerance: f64) -> Case {
        Case { name, views: vec![(1.0, scene)], channel: 0, expected, error, tolerance, heavy_tailed: false }
    }
}

/// What came out of a case.
struct Outcome {
    name: String,
    z: f64,
    /// Whether z is a normal deviate: not where the expectation is below what could be resolved, or known all but exactly.
    statistical: bool,
    failure: Option<String>,
}

/// The seed of an attempt: the hash FNV-1a of the name.
fn seed(name: &str, attempt: u32) -> u32 {
    let hash = format!("{name}#{attempt}")
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    (hash >> 32 ^ hash) as u32
}

fn estimate(case: &Case, attempt: u32, spp: u32) -> Vec<f64> {
    let mut total = vec![0.0; super::images::BATCHES];
    for (view, (weight, scene)) in case.views.iter().enumerate() {
        let part = batches(scene, seed(&case.name, 1000 * attempt + view as u32), spp);
        total.iter_mut().zip(part).for_each(|(sum, batch)| *sum += weight * batch[case.channel]);
    }
    total
}

/// Kurtosis of the batches beyond that of a normal distribution.
fn excess_kurtosis(batches: &[f64]) -> f64 {
    let count = batches.len() as f64;
    let mean = batches.iter().sum::<f64>() / count;
    let moment = |power| batches.iter().map(|batch| (batch - mean).powi(power)).sum::<f64>() / count;
    moment(4) / moment(2).powi(2).max(1e-300) - 3.0
}

/// As many samples as the tolerance asks for; the estimate and its standard error, and how many samples a pixel there were.
fn resolve(case: &Case, attempt: u32, least: u32) -> Result<(f64, f64, u32), String> {
    let mut spp = least;
    for step in 0.. {
        let batches = estimate(case, 10 * attempt + step, spp);
        let (mean, deviation) = mean_and_error(&batches);
        let excess = 7.0 * deviation / case.tolerance;
        let tail = excess_kurtosis(&batches);
        // A handful of batches that got anything at all says little about the rest, unless all is far below the tolerance.
        if mean.is_finite() && excess <= 1.0 && (tail < 3.0 || excess < 0.1 || case.heavy_tailed) {
            return Ok((mean, deviation, spp));
        }
        if spp >= MOST || step > 8 || !mean.is_finite() {
            return Err(format!("{mean:.6} ± {deviation:.1e} is not resolved, kurtosis {tail:.1}, {spp} samples"));
        }
        let more = (1.1 * excess).powi(2).clamp(2.0, 64.0) * f64::from(spp);
        spp = (more as u32).next_multiple_of(16).min(MOST);
    }
    unreachable!("the loop ends by returning")
}

fn z_value(case: &Case, mean: f64, deviation: f64) -> f64 {
    let rounding = ROUNDING * case.expected;
    (mean - case.expected) / (deviation.powi(2) + case.error.powi(2) + rounding.powi(2)).sqrt().max(1e-300)
}

fn outcome(case: &Case, bound: f64) -> Outcome {
    let name = case.name.clone();
    let failed = |z, failure| Outcome { name: case.name.clone(), z, statistical: false, failure: Some(failure) };
    let (mean, deviation, spp) = match resolve(case, 1, PILOT) {
        Ok(found) => found,
        Err(why) => return failed(f64::INFINITY, why),
    };
    if case.expected < case.tolerance / 7.0 {
        // Below what can be resolved: no more than a bound.
        let off = (mean - case.expected).abs() > case.tolerance;
        let failure = off.then(|| format!("{mean:.3e}, expected {:.3e}", case.expected));
        return Outcome { name, z: 0.0, statistical: false, failure };
    }
    let z = z_value(case, mean, deviation);
    let statistical = !case.heavy_tailed && deviation > 3.0 * (case.error + ROUNDING * case.expected);
    if z.abs() <= bound {
        return Outcome { name, z, statistical, failure: None };
    }
    let first = format!("{mean:.6} ± {deviation:.1e}, expected {:.6}: z = {z:.2}", case.expected);
    let (mean, deviation, _) = match resolve(case, 2, (4 * spp).min(MOST)) {
        Ok(found) => found,
        Err(why) => return failed(z, why),
    };
    let again = z_value(case, mean, deviation);
    let failure = (again.abs() > 3.0 && again * z > 0.0)
        .then(|| format!("{first}, and again {mean:.6} ± {deviation:.1e}: z = {again:.2}"));
    Outcome { name, z: again, statistical, failure }
}

/// Runs all cases of a table: the words for people, and whether all is well.
///
/// `of_the_run` is how many cases the run has in all tables, for its bound.
fn run(table: &str, cases: &[Case], of_the_run: usize) -> Result<String, String> {
    let start = Instant::now();
    let bound = sidak_bound(of_the_run.max(cases.len()), 63.0);
    let outcomes: Vec<Outcome> = cases
        .iter()
        .map(|case| {
            let outcome = outcome(case, bound);
            let verdict = outcome.failure.as_deref().unwrap_or("right");
            eprintln!("{}: z = {:.2}, {verdict}, after {:.1} s", case.name, outcome.z, start.elapsed().as_secs_f64());
            outcome
        })
        .collect();
    let statistical: Vec<f64> = outcomes.iter().filter(|one| one.statistical).map(|one| one.z).collect();
    let (count, pooled) = (statistical.len() as f64, pooled(&statistical));
    let worst = outcomes.iter().max_by(|a, b| a.z.abs().total_cmp(&b.z.abs())).expect("a table has cases");
    let line = format!(
        "| {table} | {} | {:.2} ({}) | {bound:.2} | {:.1} / {count} ({:.2}) | {:+.2} | {:.0} |\n",
        outcomes.len(),
        worst.z.abs(),
        worst.name,
        pooled.squares,
        pooled.probability,
        pooled.lean,
        start.elapsed().as_secs_f64()
    );
    eprint!("{line}");
    let mut failures: String = outcomes.iter().filter_map(|one| one.failure.as_ref().map(|why| (&one.name, why))).fold(
        String::new(),
        |mut text, (name, why)| {
            writeln!(text, "{name}: {why}").expect("a string takes everything");
            text
        },
    );
    if let Err(why) = check_pooled(&statistical) {
        writeln!(failures, "{table}: {why}").expect("a string takes everything");
    }
    if failures.is_empty() { Ok(line) } else { Err(failures) }
}

struct Pooled {
    squares: f64,
    /// That the sum of squares is as large or larger.
    probability: f64,
    /// The sum of z over the square root of their number.
    lean: f64,
}

/// All z-values of a table together. Squares of Student's t with 63 degrees of freedom have the mean 63/61.
fn pooled(z: &[f64]) -> Pooled {
    let squares = z.iter().map(|z| z * z).sum::<f64>() * 61.0 / 63.0;
    let lean = z.iter().sum::<f64>() / (z.len() as f64).sqrt().max(1.0);
    Pooled { squares, probability: if z.is_empty() { 1.0 } else { chi_squared_tail(squares, z.len() as f64) }, lean }
}

fn check_pooled(z: &[f64]) -> Result<(), String> {
    let Pooled { squares, probability, lean } = pooled(z);
    if z.len() < 4 {
        return Ok(());
    }
    if lean.abs() > 3.5 {
        return Err(format!("the z-values lean to one side: {lean:.2}"));
    }
    if !(2e-4..1.0 - 2e-4).contains(&probability) {
        return Err(format!(
            "the squares of the z-values add up to {squares:.1}, whose probability is {probability:e}"
        ));
    }
    Ok(())
}

/// Tests all cases of a table, and writes the table's line to `target/truth`.
///
/// # Panics
/// Where a case or the table as a whole fails.
pub fn judge(table: &str, cases: &[Case], of_the_run: usize) {
    let line = run(table, cases, of_the_run).unwrap_or_else(|failures| panic!("table {table}:\n{failures}"));
    record(table, &line);
}

/// Writes a line of the table of results to `target/truth`, unless rows were picked.
pub fn record(table: &str, line: &str) {
    if picked().is_some() {
        return;
    }
    let folder = format!("{}/target/truth/{}", env!("CARGO_MANIFEST_DIR"), if full() { "full" } else { "core" });
    std::fs::create_dir_all(&folder).expect("the folder of results can be made");
    std::fs::write(format!("{folder}/{}.md", table.replace(' ', "_")), line).expect("the result can be written");
}

/// The cases must fail: their scenes, or what is expected of them, were made wrong, by much more than the tolerance. So three times
/// the tolerance, with a ninth of the samples, has to do.
///
/// # Panics
/// Where one of them passes.
pub fn must_reject(cases: &[Case]) {
    for case in cases {
        let Case { name, views, .. } = case;
        let tolerance = 3.0 * case.tolerance;
        let coarse = Case { name: name.clone(), views: views.clone(), tolerance, ..*case };
        let outcome = outcome(&coarse, sidak_bound(1000, 63.0));
        assert!(outcome.failure.is_some(), "{}: a planted fault passes with z = {:.2}", case.name, outcome.z);
    }
}

/// A small bias of all cases, which none of them shows alone, is seen in all of them together.
pub fn check_that_pooling_sees_a_small_bias() {
    let mut random = super::random::Random(1);
    let deviates: Vec<f64> = (0..60).map(|_| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0).collect();
    check_pooled(&deviates).expect("normal deviates");
    let shifted: Vec<f64> = deviates.iter().map(|z| z + 0.7).collect();
    check_pooled(&shifted).expect_err("a bias of a tenth of the tolerance in all cases");
    let halved: Vec<f64> = deviates.iter().map(|z| z * 0.5).collect();
    check_pooled(&halved).expect_err("error bars of twice the size");
}

/// Nodes and weights of Gauss's quadrature on \[0, 1\] (Newton's method on Legendre's polynomial).
pub fn gauss(count: usize) -> Vec<(f64, f64)> {
    let legendre = |x: f64| {
        let (mut before, mut now) = (1.0, x);
        for k in 2..=count {
            let k = k as f64;
            (before, now) = (now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k);
        }
        (now, count as f64 * (x * now - before) / (x * x - 1.0))
    };
    (0..count)
        .map(|k| {
            let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (count as f64 + 0.5)).cos();
            for _ in 0..20 {
                let (value, slope) = legendre(x);
                x -= value / slope;
            }
            let slope = legendre(x).1;
            ((1.0 + x) / 2.0, 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}
