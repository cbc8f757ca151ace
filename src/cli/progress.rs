//! Progress of a render on standard error: a bar on a terminal, a line now and then elsewhere.

use std::fmt::Arguments;
use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use tyndall::render::session::Progress;

/// Time between two lines where there is no bar.
const LINE_INTERVAL: Duration = Duration::from_secs(10);

/// Whoever tells the user how far the render has come.
pub enum Reporter {
    /// Nobody.
    Quiet,
    /// Lines; the time of the last one.
    Lines(Duration),
    /// A bar.
    Bar(ProgressBar),
}

impl Reporter {
    /// Announces the render with `start`, a line, and reports on `total` samples from then on.
    pub fn start(quiet: bool, total: u32, start: Arguments) -> Self {
        if quiet {
            return Reporter::Quiet;
        }
        super::say(start);
        if !std::io::stderr().is_terminal() {
            return Reporter::Lines(Duration::ZERO);
        }
        let style = ProgressStyle::with_template("{wide_bar} {pos}/{len} spp  {elapsed} + {eta}")
            .expect("the template is well formed");
        let bar = ProgressBar::with_draw_target(Some(u64::from(total)), ProgressDrawTarget::stderr()).with_style(style);
        bar.tick();
        Reporter::Bar(bar)
    }

    /// Takes note of a dispatch.
    pub fn update(&mut self, progress: Progress) {
        match self {
            Reporter::Quiet => {}
            Reporter::Bar(bar) => bar.set_position(u64::from(progress.done)),
            Reporter::Lines(last) => {
                if progress.elapsed >= *last + LINE_INTERVAL && progress.done < progress.total {
                    *last = progress.elapsed;
                    let Progress { done, total, elapsed } = progress;
                    super::say(format_args!("{done} of {total} spp after {:.0} s", elapsed.as_secs_f64()));
                }
            }
        }
    }

    /// Removes the bar, so that whatever is printed next has a clear line.
    pub fn finish(self) {
        if let Reporter::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
