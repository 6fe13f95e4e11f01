//! Progress on standard error, where that is a terminal.

use brdfit::fit::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal as _;
use std::time::Duration;

/// A line that shows the stage of a fit and its cost, and goes away at the end.
pub struct Bar {
    bar: ProgressBar,
    title: String,
}

impl Bar {
    /// A line titled `title`; hidden if `quiet` or not on a terminal.
    pub fn new(title: String, quiet: bool) -> Self {
        let shown = !quiet && std::io::stderr().is_terminal();
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(None, target);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}  [{elapsed}]") {
            bar.set_style(style);
        }
        if shown {
            bar.enable_steady_tick(Duration::from_millis(120));
        }
        bar.set_message(format!("{title}: reading"));
        Self { bar, title }
    }

    /// Removes the line.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Progress for Bar {
    fn stage(&self, name: &str) {
        self.bar.set_message(format!("{}: {name}", self.title));
    }

    fn iteration(&self, iteration: u64, cost: f64) {
        self.bar.set_message(format!("{}: iteration {iteration}, cost {cost:.6e}", self.title));
    }
}
