//! Two sides in turn, so that whatever else the machine does hits both; what each turn took, and ratios made round by round.

use std::time::Instant;

use criterion::measurement::Measurement;

use super::{
    cpu_time::{CpuTime, waiting_for_cores},
    summary::Spread,
};

/// What some work took, seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turn {
    /// Of all threads together.
    pub cpu: f64,
    /// Of all threads together: could run, but others had the cores.
    pub waited: f64,
    pub wall: f64,
}

/// One of a turn's times.
pub type Seconds = fn(&Turn) -> f64;

/// Both, by their names.
pub const TIMES: [(&str, Seconds); 2] = [("cpu", |turn| turn.cpu), ("wall", |turn| turn.wall)];

impl Turn {
    /// Does the work; what it took, and what it made.
    pub fn of<T>(work: impl FnOnce() -> T) -> (Self, T) {
        let waiting = waiting_for_cores();
        let (clock, started) = (CpuTime.start(), Instant::now());
        let made = work();
        let wall = started.elapsed().as_secs_f64();
        let cpu = CpuTime.end(clock) as f64 * 1e-9;
        let waited = waiting_for_cores().saturating_sub(waiting) as f64 * 1e-9;
        (Self { cpu, waited, wall }, made)
    }
}

impl std::iter::Sum for Turn {
    fn sum<I: Iterator<Item = Self>>(turns: I) -> Self {
        turns.fold(Self::default(), |sum, turn| Self {
            cpu: sum.cpu + turn.cpu,
            waited: sum.waited + turn.waited,
            wall: sum.wall + turn.wall,
        })
    }
}

/// Turns of two sides, round by round.
pub struct Sides(Vec<[Turn; 2]>);

impl Sides {
    /// # Panics
    /// Without rounds.
    pub fn in_turn(
        rounds: usize,
        mut ours: impl FnMut() -> Turn,
        mut theirs: impl FnMut() -> Turn,
    ) -> Self {
        assert!(rounds > 0);
        Self((0..rounds).map(|_| [ours(), theirs()]).collect())
    }

    pub fn rounds(&self) -> usize {
        self.0.len()
    }

    /// Of our side alone.
    pub fn our_turns(&self) -> impl Iterator<Item = &Turn> {
        self.0.iter().map(|[ours, _]| ours)
    }

    pub fn ours(&self, of: Seconds) -> Spread {
        Spread::of(self.0.iter().map(|[ours, _]| of(ours)))
    }

    pub fn theirs(&self, of: Seconds) -> Spread {
        Spread::of(self.0.iter().map(|[_, theirs]| of(theirs)))
    }

    /// Ours over theirs: less is better.
    pub fn ratio(&self, of: Seconds) -> Spread {
        Spread::of(self.0.iter().map(|[ours, theirs]| of(ours) / of(theirs)))
    }
}
