//! What was measured, and what follows from it. Pure computation: `tests/benchmarks.rs` checks it.

use std::fmt;

use tyndall::image::Image;

/// How much a renderer may do for one picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// Samples for each pixel.
    Samples(u32),
    /// Seconds on the clock, compiling not counted.
    Seconds(f64),
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Budget::Samples(spp) => write!(f, "{spp} spp"),
            Budget::Seconds(seconds) => write!(f, "{seconds} s"),
        }
    }
}

/// Two clocks, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Time {
    /// On the wall.
    pub wall: f64,
    /// Of all cores together.
    pub cpu: f64,
}

/// A picture as it comes from a renderer.
pub struct Run {
    /// Index of the budget.
    pub budget: usize,
    /// Samples of each pixel that were taken.
    pub spp: u32,
    /// The picture.
    pub image: Image,
    /// Rendering alone.
    pub time: Time,
    /// Starting, reading the scene and compiling.
    pub start_up: Option<Time>,
}

/// How far a reference is from the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnError {
    /// Its relMSE.
    pub rel_mse: f64,
    /// Its relMSE without the worst 1 % of pixels, where that is known.
    pub trimmed_rel_mse: Option<f64>,
    /// Its MSE.
    pub mse: f64,
}

/// One picture, scored.
#[derive(Clone, Debug)]
pub struct Record {
    /// Of which scene.
    pub scene: String,
    /// By whom.
    pub renderer: &'static str,
    /// With which settings.
    pub configuration: String,
    /// Index of the budget.
    pub budget: usize,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Samples of each pixel.
    pub spp: u32,
    /// Pixels of the picture.
    pub pixels: usize,
    /// All caches were empty at the start.
    pub cold: bool,
    /// Starting, reading the scene and compiling.
    pub start_up: Option<Time>,
    /// Rendering alone.
    pub time: Time,
    /// Against the reference, whose own error is in it.
    pub rel_mse: f64,
    /// The same without the worst 1 % of pixels.
    pub trimmed_rel_mse: f64,
    /// Against the reference, whose own error is in it.
    pub mse: f64,
    /// Of the reference.
    pub own_error: OwnError,
    /// Mean difference from the reference in standard errors.
    pub z: f64,
}

/// Measures of error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Mean relative square error.
    RelMse,
    /// The same without the worst 1 % of pixels.
    Trimmed,
    /// Mean square error.
    Mse,
}

/// Which of the two times counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// All cores together.
    Cpu,
    /// All cores together, and the first start.
    CpuWithColdStart,
    /// On the wall.
    Wall,
}

/// The pictures of one budget, over all seeds.
#[derive(Clone, Debug)]
pub struct Point {
    /// Index of the budget.
    pub budget: usize,
    /// Mean time of rendering alone.
    pub time: Time,
    /// Mean error in the order of [`Measure`], without the reference's own; `None` where the reference is too noisy to tell.
    pub errors: [Option<f64>; 3],
    /// Standard error of the mean relMSE, relative to it; 0 with one seed, which cannot tell.
    pub spread: f64,
}

/// All pictures of one scene by one renderer with one configuration.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Of which scene.
    pub scene: String,
    /// By whom.
    pub renderer: &'static str,
    /// With which settings.
    pub configuration: String,
    /// In the order of the budgets.
    pub points: Vec<Point>,
    /// Millions of samples a second of all cores together, over all pictures.
    pub msamples_per_cpu_second: f64,
    /// Millions of samples a second on the wall, over all pictures.
    pub msamples_per_second: f64,
    /// The first start, with empty caches.
    pub cold_start: Option<Time>,
    /// Mean of the later starts.
    pub warm_start: Option<Time>,
    /// Mean of the pictures' z: the noise that they share with the reference alone makes it about ±1.
    pub mean_z: f64,
}

/// A comparison of two summaries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// Error × time of the other divided by ours: above 1, ours is better.
    pub value: f64,
    /// The same at the largest of these budgets alone, where fixed costs of a render count least.
    pub at_largest: f64,
    /// Relative standard error of `value`, from the scatter over the seeds.
    pub spread: f64,
    /// Budgets that both have.
    pub budgets: usize,
}

/// The measured error must be twice that of the reference, so that what is left is at least as large as what is taken away...
const CLEAR: f64 = 2.0;
/// ...or ten times, where nothing can be taken away, for then the rest is in the figure.
const CLEAR_UNKNOWN: f64 = 10.0;

/// A mean z beyond this is no chance: the pictures are biased, or their samples too few to have met what is rare and bright. Either
/// way their error is larger than it seems.
const CREDIBLE_Z: f64 = 4.0;

impl Point {
    /// From the pictures of one budget, of which there is at least one.
    fn of(records: &[&Record]) -> Point {
        let mean = |value: &dyn Fn(&Record) -> f64| {
            records.iter().map(|record| value(record)).sum::<f64>() / records.len() as f64
        };
        let own = records[0].own_error;
        let raw = mean(&|record| record.rel_mse);
        let raw_trimmed = mean(&|record| record.trimmed_rel_mse);
        let clear = |raw: f64, own: f64| (raw > CLEAR * own).then_some(raw - own);
        let trimmed = match own.trimmed_rel_mse {
            Some(own) => clear(raw_trimmed, own),
            None => (raw > CLEAR_UNKNOWN * own.rel_mse).then_some(raw_trimmed),
        };
        let deviations: f64 = records.iter().map(|record| (record.rel_mse - raw).powi(2)).sum();
        let count = records.len() as f64;
        let standard_error = if count > 1.0 { (deviations / (count - 1.0) / count).sqrt() } else { 0.0 };
        Point {
            budget: records[0].budget,
            time: Time { wall: mean(&|record| record.time.wall), cpu: mean(&|record| record.time.cpu) },
            errors: [clear(raw, own.rel_mse), trimmed, clear(mean(&|record| record.mse), own.mse)],
            spread: standard_error / (raw - own.rel_mse).max(f64::MIN_POSITIVE),
        }
    }
}

impl Summary {
    /// Whether it is Tyndall as it is, and neither another renderer nor a part of it left out.
    pub fn is_ours(&self) -> bool {
        self.renderer == "Tyndall" && self.configuration == "default"
    }

    fn of(records: &[&Record]) -> Summary {
        let budgets = records.iter().map(|record| record.budget).max().map_or(0, |last| last + 1);
        let of_budget = |budget| records.iter().copied().filter(|record| record.budget == budget).collect::<Vec<_>>();
        let points =
            (0..budgets).map(of_budget).filter(|records| !records.is_empty()).map(|records| Point::of(&records));
        let starts = |cold: bool| -> Option<Time> {
            let times: Vec<Time> =
                records.iter().filter(|record| record.cold == cold).filter_map(|record| record.start_up).collect();
            let mean = |value: fn(&Time) -> f64| times.iter().map(value).sum::<f64>() / times.len() as f64;
            (!times.is_empty()).then(|| Time { wall: mean(|time| time.wall), cpu: mean(|time| time.cpu) })
        };
        let sum = |value: &dyn Fn(&Record) -> f64| records.iter().map(|record| value(record)).sum::<f64>();
        let msamples = 1e-6 * sum(&|record| f64::from(record.spp) * record.pixels as f64);
        Summary {
            scene: records[0].scene.clone(),
            renderer: records[0].renderer,
            configuration: records[0].configuration.clone(),
            points: points.collect(),
            msamples_per_cpu_second: msamples / sum(&|record| record.time.cpu),
            msamples_per_second: msamples / sum(&|record| record.time.wall),
            cold_start: starts(true),
            warm_start: starts(false),
            mean_z: sum(&|record| record.z) / records.len() as f64,
        }
    }

    /// Whether the mean of the pictures is that of the reference, as far as one can tell.
    pub fn is_credible(&self) -> bool {
        self.mean_z.abs() <= CREDIBLE_Z
    }

    /// Error × seconds at each budget whose error is known, with the budget.
    fn products(&self, measure: Measure, clock: Clock) -> Vec<(usize, f64)> {
        let start = self.cold_start.unwrap_or_default().cpu;
        let seconds = |time: Time| match clock {
            Clock::Cpu => time.cpu,
            Clock::CpuWithColdStart => time.cpu + start,
            Clock::Wall => time.wall,
        };
        let product = |point: &Point| Some((point.budget, point.errors[measure as usize]? * seconds(point.time)));
        self.points.iter().filter_map(product).collect()
    }

    /// Error × seconds: the geometric mean over the budgets. Were the error exactly in inverse proportion to the number of
    /// samples, it would be the same at each of them.
    pub fn figure(&self, measure: Measure, clock: Clock) -> Option<f64> {
        geometric_mean(self.products(measure, clock).into_iter().map(|(_, product)| product))
    }

    /// How many times the figure of `other` is larger, over the budgets that both have.
    pub fn ratio(&self, other: &Summary, measure: Measure, clock: Clock) -> Option<Ratio> {
        let ours = self.products(measure, clock);
        let quotients: Vec<(usize, f64)> = other
            .products(measure, clock)
            .into_iter()
            .filter_map(|(budget, theirs)| {
                let (_, ours) = ours.iter().find(|(ours, _)| *ours == budget)?;
                Some((budget, theirs / ours))
            })
            .collect();
        let value = geometric_mean(quotients.iter().map(|(_, quotient)| *quotient))?;
        let (_, at_largest) = *quotients.last()?;
        let spread = |summary: &Summary| -> f64 {
            let common = |point: &&Point| quotients.iter().any(|(budget, _)| *budget == point.budget);
            summary.points.iter().filter(common).map(|point| point.spread.powi(2)).sum()
        };
        let spread = (spread(self) + spread(other)).sqrt() / quotients.len() as f64;
        Some(Ratio { value, at_largest, spread, budgets: quotients.len() })
    }

    /// The strongest of the credible others on this scene, for this measure and clock, by the number that `by` takes from the
    /// ratio. `None` if this one is not credible itself.
    pub fn strongest<'a>(
        &self,
        all: &'a [Summary],
        (measure, clock): (Measure, Clock),
        by: fn(&Ratio) -> f64,
    ) -> Option<(&'a Summary, Ratio)> {
        all.iter()
            .filter(|other| other.scene == self.scene && other.renderer != self.renderer)
            .filter(|other| self.is_credible() && other.is_credible())
            .filter_map(|other| Some((other, self.ratio(other, measure, clock)?)))
            .min_by(|(_, a), (_, b)| by(a).total_cmp(&by(b)))
    }
}

/// Puts together what belongs together, in the order in which it was measured.
pub fn summarize(records: &[Record]) -> Vec<Summary> {
    let mut groups: Vec<Vec<&Record>> = Vec::new();
    for record in records {
        let same = |group: &&mut Vec<&Record>| {
            let first = group[0];
            (&first.scene, first.renderer, &first.configuration)
                == (&record.scene, record.renderer, &record.configuration)
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.push(record),
            None => groups.push(vec![record]),
        }
    }
    groups.iter().map(|group| Summary::of(group)).collect()
}

/// `None` of nothing.
pub fn geometric_mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0u32);
    for value in values {
        sum += value.ln();
        count += 1;
    }
    (count > 0).then(|| (sum / f64::from(count)).exp())
}
