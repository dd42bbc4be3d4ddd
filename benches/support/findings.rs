//! What a bench has found: lines for people as it goes, figures for the summary, and at the end which bars hold. A bar that does not
//! hold fails no bench, since machines differ.

use std::fmt;

use super::{
    leave,
    summary::{Record, Spread},
    turns::{Sides, TIMES},
};

/// What a figure has to keep to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bar {
    AtMost(f64),
    AtLeast(f64),
}

impl Bar {
    fn holds(self, figure: f64) -> bool {
        match self {
            Self::AtMost(most) => figure <= most,
            Self::AtLeast(least) => figure >= least,
        }
    }
}

impl fmt::Display for Bar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtMost(most) => write!(f, "at most {most}"),
            Self::AtLeast(least) => write!(f, "at least {least}"),
        }
    }
}

/// A figure with its bar.
struct Judged {
    name: String,
    spread: Spread,
    bar: Bar,
}

impl fmt::Display for Judged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Spread {
            median,
            least,
            most,
        } = self.spread;
        let digits = if median < 100.0 { 2 } else { 0 };
        let spread = format!("{median:.digits$} ({least:.digits$} to {most:.digits$})");
        let verdict = if self.bar.holds(median) {
            "holds"
        } else {
            "DOES NOT HOLD"
        };
        write!(f, "{spread:<28} bar {:<14} {verdict}", self.bar.to_string())
    }
}

/// What a bench has found so far.
pub struct Findings {
    bench: &'static str,
    records: Vec<Record>,
    judged: Vec<Judged>,
}

impl Findings {
    /// None yet. `head` says what is compared, and what with.
    pub fn new(bench: &'static str, head: &str) -> Self {
        println!("{head}");
        Self {
            bench,
            records: Vec::new(),
            judged: Vec::new(),
        }
    }

    /// Two sides, by the CPU and by the clock: milliseconds of both, and ours over theirs, which has to keep to the bar.
    pub fn compare(&mut self, name: &str, sides: &Sides, bar: Bar) {
        let extra = format!("{} rounds", sides.rounds());
        for (time, of) in TIMES {
            let name = format!("{name}/{time}");
            let (ours, theirs) = (sides.ours(of).times(1e3), sides.theirs(of).times(1e3));
            let ratio = sides.ratio(of);
            self.records.extend([
                ours.record(&name, "ms", &extra),
                ratio.record(&format!("{name} ratio"), "x", &extra),
            ]);
            let sides = format!("{:>9.1} {:>9.1} ms", ours.median, theirs.median);
            self.judge(name, &sides, ratio, bar);
        }
    }

    /// A figure that has to keep to a bar, and what a history is to keep of it.
    pub fn figure(&mut self, name: &str, figure: Spread, bar: Bar, record: Record) {
        self.aside(record);
        self.judge(name.to_owned(), "", figure, bar);
    }

    /// For the history alone.
    pub fn aside(&mut self, record: Record) {
        self.records.push(record);
    }

    fn judge(&mut self, name: String, sides: &str, spread: Spread, bar: Bar) {
        let judged = Judged { name, spread, bar };
        println!("{:<34} {sides:<22} {judged}", judged.name);
        self.judged.push(judged);
    }

    /// Which bars hold, and the figures for the summary.
    pub fn finish(self) {
        if !self.judged.is_empty() {
            println!("\n{}: bars", self.bench);
        }
        for judged in &self.judged {
            println!("  {:<34} {judged}", judged.name);
        }
        leave(self.bench, &self.records);
    }
}
