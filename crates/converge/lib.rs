//! Error against run time, as solvers of differential equations are judged: which settings are measured ([`Sweep`]), what is
//! kept of them ([`Journal`]), what follows ([`Summary`]: medians with spreads, Pareto front, order of convergence, time to an
//! error), and how it is told ([`table`], [`csv`], [`svg`], [`png`]).
//!
//! Nothing here renders or knows of scenes and devices: numbers come in, tables and diagrams go out. Run times are told with
//! their spread or not at all, errors only where the reference can tell them ([`Reference::limit`]).

mod chart;
mod measurement;
mod setting;
mod statistics;
mod summary;
mod sweep;
mod table;
#[cfg(test)]
mod test_summary;

pub use chart::{ChartError, png, svg};
pub use measurement::{
    Build, Errors, Journal, MadeBy, Metric, OracleCheck, Picture, RESOLVED, Rays, Record,
    Reference, Run, line,
};
pub use setting::{Bvh, Knob, Model, Setting, SettingError};
pub use statistics::{Order, Spread, TimeTo, order_of_convergence, pareto_front, time_to_error};
pub use summary::{
    Clock, MeasuredLadder, Point, ShownErrors, Subject, Summary, TimeToError, Truth,
};
pub use sweep::{Ladder, MOST_SETTINGS, Sweep, SweepError, Values};
pub use table::{csv, table};
