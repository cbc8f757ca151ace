//! The progressive loop: dispatch after dispatch into the film, until there are enough samples, the time is up, or somebody
//! interrupts.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::film::Film;
use super::{BLOCK_SAMPLES, Backend, BackendError, Block};

/// A dispatch should take at least this long, so that what surrounds it does not count...
const SHORTEST_DISPATCH: Duration = Duration::from_millis(500);
/// ...and at most this long, so that the program reacts to an interruption and to the time limit.
const LONGEST_DISPATCH: Duration = Duration::from_millis(1000);
/// Bytes of blocks that one dispatch may return: what it takes to double the dispatches ends here.
const DISPATCH_BYTES: usize = 256 << 20;
/// A render of fewer samples has as many in each pixel: what it takes to measure noise would not pay.
const LEAST_ALLOCATED: u32 = 2 * BLOCK_SAMPLES;
/// Samples on which noise is measured, and in renders of many samples.
const TRIAL: u32 = 2;
const LONG_TRIAL: u32 = 4;
const MANY_SAMPLES: u32 = 8 * BLOCK_SAMPLES;

/// What to render and for how long.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Samples of each pixel; the start is a multiple of [`BLOCK_SAMPLES`], and the range is not empty.
    pub samples: Range<u32>,
    /// Ends the render when it has taken this long, or as soon after as the running dispatch ends.
    pub time_limit: Option<Duration>,
    /// Whether pixels get more samples where there is noise, and fewer elsewhere, see [`super::allocation`]; from 32 samples on.
    pub allocate: bool,
}

/// How far a render has come, after each dispatch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Samples of each pixel that are done.
    pub done: u32,
    /// Samples of each pixel that were asked for.
    pub total: u32,
    /// Time since the start.
    pub elapsed: Duration,
}

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All samples are done.
    Finished,
    /// The time limit came first: a regular end.
    TimeLimit,
    /// Somebody raised the flag.
    Interrupted,
}

/// A render that has ended.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// All samples that were done, at least one block.
    pub film: Film,
    /// Why it ended.
    pub outcome: Outcome,
    /// How long it took.
    pub elapsed: Duration,
}

/// Renders `options.samples` for `pixels` pixels with `backend`, and tells `progress` after each dispatch.
///
/// Raising `interrupt` ends the render after the running dispatch. Dispatches begin with one block and double until they
/// take half a second; which samples they hold does not change the film. At least one block is rendered, whatever the
/// time limit and the flag say, so that there is an image.
pub fn render(
    backend: &mut dyn Backend,
    pixels: usize,
    options: &Options,
    interrupt: &AtomicBool,
    progress: &mut dyn FnMut(Progress),
) -> Result<Rendered, BackendError> {
    let start = Instant::now();
    render_by_clock(backend, pixels, options, interrupt, progress, &|| start.elapsed())
}

/// [`render`] with a clock that tells the time since the start.
fn render_by_clock(
    backend: &mut dyn Backend,
    pixels: usize,
    options: &Options,
    interrupt: &AtomicBool,
    progress: &mut dyn FnMut(Progress),
    clock: &dyn Fn() -> Duration,
) -> Result<Rendered, BackendError> {
    let Range { start: first, end } = options.samples;
    assert!(first < end, "a render has at least one sample");
    let total = end - first;
    let mut film = Film::new(pixels, first);
    let mut pace = Pace::new(pixels);
    let mut now = Duration::ZERO;
    let allocate = options.allocate && total >= LEAST_ALLOCATED;
    let trial = if total < MANY_SAMPLES { TRIAL } else { LONG_TRIAL };
    backend.allocate(if allocate { trial } else { 0 })?;
    let outcome = loop {
        let begin = film.range().end;
        let blocks = pace.blocks(options.time_limit.map(|limit| limit.saturating_sub(now)));
        let samples = begin..begin.saturating_add(blocks.saturating_mul(BLOCK_SAMPLES)).min(end);
        for block in backend.render(samples.clone())? {
            film.add(&block);
        }
        assert_eq!(film.range().end, samples.end, "a backend hands over all the blocks that it was asked for");
        let before = std::mem::replace(&mut now, clock());
        pace.learn(blocks, now.saturating_sub(before));
        progress(Progress { done: film.samples(), total, elapsed: now });
        if samples.end == end {
            break Outcome::Finished;
        }
        if interrupt.load(Ordering::SeqCst) {
            break Outcome::Interrupted;
        }
        if options.time_limit.is_some_and(|limit| now >= limit) {
            break Outcome::TimeLimit;
        }
    };
    Ok(Rendered { film, outcome, elapsed: now })
}

/// The size of the next dispatch.
struct Pace {
    /// Blocks in the next dispatch.
    next: u32,
    /// Blocks in the largest possible dispatch.
    most: u32,
    /// What a block took in the last dispatch.
    block_time: Option<Duration>,
}

impl Pace {
    fn new(pixels: usize) -> Self {
        let most = DISPATCH_BYTES / (Block::bytes_of_pixel(0) * pixels.max(1));
        Pace { next: 1, most: u32::try_from(most).unwrap_or(u32::MAX).max(1), block_time: None }
    }

    /// Blocks in the next dispatch if `remaining` time is left: no more than are expected to fit, but at least one.
    fn blocks(&self, remaining: Option<Duration>) -> u32 {
        let (Some(remaining), Some(block_time)) = (remaining, self.block_time) else { return self.next };
        let fitting = remaining.as_nanos() / block_time.as_nanos().max(1);
        self.next.min(u32::try_from(fitting).unwrap_or(u32::MAX).max(1))
    }

    fn learn(&mut self, blocks: u32, elapsed: Duration) {
        self.block_time = Some(elapsed / blocks);
        // A dispatch that was cut short by the end of the time or of the samples says nothing about larger ones.
        if elapsed > LONGEST_DISPATCH {
            self.next = (blocks / 2).max(1);
        } else if elapsed < SHORTEST_DISPATCH && blocks == self.next {
            self.next = self.next.saturating_mul(2).min(self.most);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::{Cell, RefCell};

    use super::super::DeviceInfo;
    use super::*;

    const PIXELS: usize = 3;

    /// Renders numbers that depend on the sample alone, on a clock of its own.
    struct Mock<'a> {
        device: DeviceInfo,
        clock: &'a Cell<Duration>,
        block_time: Duration,
        dispatches: &'a RefCell<Vec<Range<u32>>>,
        trials: &'a RefCell<Vec<u32>>,
        during: &'a dyn Fn(&Range<u32>) -> Result<(), BackendError>,
        invalid: [u64; 3],
    }

    impl Backend for Mock<'_> {
        fn device(&self) -> &DeviceInfo {
            &self.device
        }

        fn render(&mut self, samples: Range<u32>) -> Result<Vec<Block>, BackendError> {
            (self.during)(&samples)?;
            self.dispatches.borrow_mut().push(samples.clone());
            let mut blocks = Vec::new();
            for first in samples.clone().step_by(BLOCK_SAMPLES as usize) {
                let count = BLOCK_SAMPLES.min(samples.end - first);
                let value = |pixel: usize| 1.0 / (1.0 + first as f32 + pixel as f32);
                let sums = (0..PIXELS).map(|pixel| [value(pixel), 2.0 * value(pixel), 0.1]).collect();
                let squares = (0..PIXELS).map(|pixel| [value(pixel), 3.0, 0.2]).collect();
                let counts = vec![count; PIXELS];
                blocks.push(Block { first, count, counts, sums, squares, invalid: self.invalid, ..Block::default() });
                self.clock.set(self.clock.get() + self.block_time);
            }
            Ok(blocks)
        }

        fn allocate(&mut self, trial: u32) -> Result<(), BackendError> {
            self.trials.borrow_mut().push(trial);
            Ok(())
        }
    }

    struct Run {
        result: Result<Rendered, BackendError>,
        dispatches: Vec<Range<u32>>,
        trials: Vec<u32>,
        progress: Vec<Progress>,
    }

    fn run(
        options: Options,
        block_time: Duration,
        invalid: [u64; 3],
        interrupt: &AtomicBool,
        during: &dyn Fn(&Range<u32>) -> Result<(), BackendError>,
    ) -> Run {
        let (clock, dispatches, trials) = (Cell::new(Duration::ZERO), RefCell::default(), RefCell::default());
        let device = DeviceInfo { name: "mock".into(), driver: "none".into() };
        let mut mock =
            Mock { device, clock: &clock, block_time, dispatches: &dispatches, trials: &trials, during, invalid };
        let mut progress = Vec::new();
        let result =
            render_by_clock(&mut mock, PIXELS, &options, interrupt, &mut |p| progress.push(p), &|| clock.get());
        Run { result, dispatches: dispatches.into_inner(), trials: trials.into_inner(), progress }
    }

    fn plain(options: Options, block_time: Duration) -> Run {
        run(options, block_time, [0; 3], &AtomicBool::new(false), &|_| Ok(()))
    }

    fn blocks_of(dispatches: &[Range<u32>]) -> Vec<u32> {
        dispatches.iter().map(|samples| samples.len().div_ceil(BLOCK_SAMPLES as usize) as u32).collect()
    }

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn dispatches_double_up_to_half_a_second() {
        let run = plain(Options { samples: 0..16 * 60 + 5, time_limit: None, allocate: false }, 100 * MS);
        let rendered = run.result.unwrap();
        assert_eq!(rendered.outcome, Outcome::Finished);
        // 100, 200, 400 ms, then 800 ms, which is between half a second and a second. The last block has 5 samples.
        assert_eq!(blocks_of(&run.dispatches), [1, 2, 4, 8, 8, 8, 8, 8, 8, 6]);
        assert_eq!(rendered.film.range(), 0..16 * 60 + 5);
        assert_eq!(rendered.elapsed, 6100 * MS);
        assert_eq!(run.progress.len(), run.dispatches.len());
        assert_eq!(run.progress[1], Progress { done: 48, total: 965, elapsed: 300 * MS });
        assert_eq!(run.progress.last().unwrap().done, 965);
    }

    #[test]
    fn dispatches_stay_small_on_a_slow_device() {
        let run = plain(Options { samples: 0..16 * 4, time_limit: None, allocate: false }, 1500 * MS);
        assert_eq!(blocks_of(&run.dispatches), [1, 1, 1, 1]);
    }

    #[test]
    fn dispatches_shrink_when_a_device_slows_down() {
        let mut pace = Pace::new(PIXELS);
        pace.next = 8;
        pace.learn(8, 1200 * MS);
        assert_eq!(pace.next, 4);
    }

    #[test]
    fn dispatches_fit_in_memory() {
        let mut pace = Pace::new(1 << 20);
        for _ in 0..10 {
            pace.learn(pace.next, MS);
        }
        assert_eq!(pace.next as usize, DISPATCH_BYTES / (Block::bytes_of_pixel(0) << 20));
        assert_eq!(Pace::new(1 << 30).most, 1);
    }

    #[test]
    fn the_time_limit_ends_a_render() {
        let options = Options { samples: 0..16_000_000, time_limit: Some(3000 * MS), allocate: false };
        let run = plain(options, 100 * MS);
        let rendered = run.result.unwrap();
        assert_eq!(rendered.outcome, Outcome::TimeLimit);
        // 1 + 2 + 4 + 8 + 8 blocks take 2.3 s, and 7 of the next 8 still fit.
        assert_eq!(blocks_of(&run.dispatches), [1, 2, 4, 8, 8, 7]);
        assert_eq!(rendered.elapsed, 3000 * MS);
        assert_eq!(rendered.film.samples(), 30 * 16);
    }

    #[test]
    fn a_time_limit_shorter_than_a_block_gives_an_image() {
        let run = plain(Options { samples: 0..160, time_limit: Some(MS), allocate: false }, 100 * MS);
        let rendered = run.result.unwrap();
        assert_eq!((rendered.outcome, rendered.film.samples()), (Outcome::TimeLimit, 16));
    }

    #[test]
    fn a_render_that_ends_at_the_limit_is_finished() {
        let run = plain(Options { samples: 0..16, time_limit: Some(100 * MS), allocate: false }, 100 * MS);
        assert_eq!(run.result.unwrap().outcome, Outcome::Finished);
    }

    #[test]
    fn the_flag_ends_a_render_after_the_dispatch() {
        let flag = AtomicBool::new(false);
        let raise = |samples: &Range<u32>| {
            // The third dispatch.
            flag.store(samples.start == 48, Ordering::SeqCst);
            Ok(())
        };
        let run = run(Options { samples: 0..1600, time_limit: None, allocate: false }, 100 * MS, [0; 3], &flag, &raise);
        let rendered = run.result.unwrap();
        assert_eq!(rendered.outcome, Outcome::Interrupted);
        assert_eq!(blocks_of(&run.dispatches), [1, 2, 4]);
        assert_eq!(rendered.film.range(), 0..112);
    }

    #[test]
    fn noise_is_measured_where_it_pays() {
        for (samples, allocate, trial) in [(31, true, 0), (32, true, 2), (128, true, 4), (128, false, 0)] {
            let run = plain(Options { samples: 16..16 + samples, time_limit: None, allocate }, MS);
            assert_eq!(run.trials, [trial], "{samples} samples");
        }
    }

    #[test]
    fn invalid_samples_add_up() {
        let flag = AtomicBool::new(false);
        let run =
            run(Options { samples: 0..160, time_limit: None, allocate: false }, MS, [1, 0, 5], &flag, &|_| Ok(()));
        assert_eq!(run.result.unwrap().film.invalid(), [10, 0, 50]);
    }

    #[test]
    fn a_device_that_fails_ends_the_render() {
        let fail = |samples: &Range<u32>| match samples.start {
            16 => Err(BackendError { device: "mock".into(), cause: "lost".into() }),
            _ => Ok(()),
        };
        let flag = AtomicBool::new(false);
        let run = run(Options { samples: 0..160, time_limit: None, allocate: false }, MS, [0; 3], &flag, &fail);
        assert_eq!(run.result.unwrap_err().to_string(), "mock failed: lost");
    }

    #[test]
    fn the_film_does_not_depend_on_the_cut() {
        let film = |block_time| {
            let run = plain(Options { samples: 32..16 * 70 + 9, time_limit: None, allocate: false }, block_time);
            (run.dispatches.len(), run.result.unwrap().film)
        };
        let (many, fine) = film(2000 * MS);
        let (few, coarse) = film(MS);
        assert!(many > 3 * few, "the two renders are cut alike: {many} and {few} dispatches");
        assert_eq!(fine, coarse);
        let other =
            plain(Options { samples: 32..16 * 70 + 8, time_limit: None, allocate: false }, MS).result.unwrap().film;
        assert_ne!(fine, other, "the comparison sees one sample");
    }
}
