//! The progress bar, on a terminal's stderr.

use std::borrow::Cow;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Steps of the bar.
const STEPS: u64 = 1000;

const TICK: Duration = Duration::from_millis(100);

/// A bar that goes away when it is dropped. Hidden, it does nothing.
pub struct Progress(Option<ProgressBar>);

impl Progress {
    pub fn new(shown: bool) -> Self {
        Self(shown.then(|| {
            let bar = ProgressBar::new_spinner().with_style(style("{spinner} {msg}"));
            bar.enable_steady_tick(TICK);
            bar
        }))
    }

    /// Something that takes as long as it takes.
    pub fn stage(&self, name: impl Into<Cow<'static, str>>) {
        if let Some(bar) = &self.0 {
            bar.set_message(name);
        }
    }

    /// Prints something without tearing the bar apart.
    pub fn aside(&self, print: impl FnOnce()) {
        match &self.0 {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }

    /// How much of the picture is there, 0 to 1.
    pub fn rendered(&self, share: f64) {
        let Some(bar) = &self.0 else { return };
        if bar.length().is_none() {
            bar.set_message("rendering");
            show_share(bar);
        }
        bar.set_position((share * STEPS as f64) as u64);
    }

    /// How much of all that is to be done is done, 0 to 1, whatever the stage is called.
    pub fn done(&self, share: f64) {
        let Some(bar) = &self.0 else { return };
        if bar.length().is_none() {
            show_share(bar);
        }
        bar.set_position((share * STEPS as f64) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}

fn show_share(bar: &ProgressBar) {
    bar.set_style(style("{msg} [{bar:40}] {percent:>3}%  {eta} left"));
    bar.set_length(STEPS);
    bar.reset_eta();
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
