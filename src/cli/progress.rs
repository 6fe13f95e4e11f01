//! A progress line on standard error, shown if that is a terminal.

use brdfit::progress::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// A line that shows the number of the current fit, its stage and cost, and the time left. It disappears at the end.
pub struct Bar {
    bar: ProgressBar,
    now: Arc<Mutex<Now>>,
}

/// The current state of the command.
#[derive(Default)]
struct Now {
    /// Number of fits in all.
    fits: u32,
    /// Number of fits done or given up.
    past: u32,
    /// Number of fits done.
    done: u32,
    /// Time from the start of the command to the end of the last fit, reading included.
    took: Duration,
    title: String,
    stage: String,
}

impl Now {
    fn text(&self) -> String {
        let Self { fits, past, title, stage, .. } = self;
        if *fits > 1 {
            format!("[{}/{fits}] {title}: {stage}", (past + 1).min(*fits))
        } else {
            format!("{title}: {stage}")
        }
    }

    /// Estimated time for the remaining fits, from the mean of those done. `None` if none is done yet.
    fn left(&self, elapsed: Duration) -> Option<Duration> {
        let each = self.took.checked_div(self.done)?;
        let expected = each.saturating_mul(self.fits.saturating_sub(self.past));
        Some(expected.saturating_sub(elapsed.saturating_sub(self.took)))
    }
}

impl Bar {
    /// Makes a line for this number of fits, hidden if `quiet` or if standard error is not a terminal.
    pub fn new(fits: usize, quiet: bool) -> Self {
        let shown = !quiet && std::io::stderr().is_terminal();
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(None, target);
        let fits = u32::try_from(fits).unwrap_or(u32::MAX);
        let now = Arc::new(Mutex::new(Now { fits, ..Now::default() }));
        if let Ok(style) = ProgressStyle::with_template("{spinner} {wide_msg} {elapsed}{left}") {
            let now = Arc::clone(&now);
            bar.set_style(style.with_key("left", move |state: &ProgressState, text: &mut dyn Write| {
                let now = now.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some(left) = now.left(state.elapsed()) {
                    // A line that cannot be shown does no harm.
                    let _ = write!(text, ", {} left", rough(left));
                }
            }));
        }
        if shown {
            bar.enable_steady_tick(Duration::from_millis(120));
        }
        Self { bar, now }
    }

    /// Says that the next input begins.
    pub fn begin(&self, path: &Path) {
        self.change(|now| {
            now.title = path.display().to_string();
            "reading".clone_into(&mut now.stage);
        });
    }

    /// Says that a fit is done.
    pub fn fitted(&self) {
        let elapsed = self.bar.elapsed();
        self.change(|now| {
            now.past += 1;
            now.done += 1;
            now.took = elapsed;
        });
    }

    /// Says that all fits of the inputs so far are done or given up; `past` is their number.
    pub fn passed(&self, past: usize) {
        self.change(|now| now.past = u32::try_from(past).unwrap_or(u32::MAX));
    }

    /// Hides the line while `print` runs.
    pub fn aside<R>(&self, print: impl FnOnce() -> R) -> R {
        self.bar.suspend(print)
    }

    /// Removes the line.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    fn change(&self, change: impl FnOnce(&mut Now)) {
        let mut now = self.now.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut now);
        let text = now.text();
        // Drawing computes the time left, which needs the lock.
        drop(now);
        self.bar.set_message(text);
    }
}

impl Progress for Bar {
    fn stage(&self, name: &str) {
        self.change(|now| name.clone_into(&mut now.stage));
    }

    fn iteration(&self, iteration: u64, cost: f64) {
        self.change(|now| now.stage = format!("fitting, iteration {iteration}, cost {cost:.6e}"));
    }
}

/// A progress line that appears only if the work takes long.
pub struct Late {
    path: PathBuf,
    started: Instant,
    bar: OnceLock<Bar>,
}

impl Late {
    /// A line about the work on this file.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), started: Instant::now(), bar: OnceLock::new() }
    }

    /// The line, if it is time to show it.
    fn bar(&self) -> Option<&Bar> {
        const LONG: Duration = Duration::from_secs(2);
        let begin = || {
            let bar = Bar::new(1, false);
            bar.begin(&self.path);
            bar
        };
        (self.started.elapsed() > LONG).then(|| self.bar.get_or_init(begin))
    }

    /// Removes the line.
    pub fn finish(&self) {
        if let Some(bar) = self.bar.get() {
            bar.finish();
        }
    }
}

impl Progress for Late {
    fn stage(&self, name: &str) {
        if let Some(bar) = self.bar() {
            bar.stage(name);
        }
    }

    fn iteration(&self, iteration: u64, cost: f64) {
        if let Some(bar) = self.bar() {
            bar.iteration(iteration, cost);
        }
    }
}

/// A time rounded so that it can be read at a glance.
fn rough(time: Duration) -> String {
    match time.as_secs() {
        seconds @ 0..100 => format!("{seconds} s"),
        seconds @ 100..6000 => format!("{} min", seconds.div_ceil(60)),
        seconds => format!("{} h", seconds.div_ceil(3600)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_the_fits_done() {
        let seconds = Duration::from_secs;
        let mut now = Now { fits: 20, title: "a.binary".to_owned(), ..Now::default() };
        assert_eq!(now.left(seconds(3)), None, "nothing is known before the first is done");
        // Five took 10 s, two were given up: 13 are left, one of them begun 1 s ago.
        (now.past, now.done, now.took) = (7, 5, seconds(10));
        assert_eq!(now.left(seconds(11)), Some(seconds(25)));
        assert_eq!(now.left(seconds(1000)), Some(seconds(0)), "late, but not negative");
        "searching".clone_into(&mut now.stage);
        assert_eq!(now.text(), "[8/20] a.binary: searching");
    }

    #[test]
    fn times_are_rough() {
        for (seconds, text) in [(0, "0 s"), (99, "99 s"), (100, "2 min"), (5999, "100 min"), (6000, "2 h")] {
            assert_eq!(rough(Duration::from_secs(seconds)), text);
        }
    }
}
