//! CPU seconds of all threads of this process as something that criterion measures: with two cores that others use too,
//! they tell more than the clock on the wall.

use std::fs;

use criterion::{
    Throughput,
    measurement::{Measurement, ValueFormatter, WallTime},
};

/// Nanoseconds that the kernel has run this process's threads, by `/proc/self/task/*/schedstat`; the driver's and rayon's
/// threads stay as long as the process does, so none is missed. Linux only.
pub struct CpuTime;

/// Whether this system says how long it has run us.
pub fn available() -> bool {
    of_this_thread() > 0
}

/// The same, for a bench that can't do without; says so where it has to.
pub fn available_for(bench: &str) -> bool {
    let available = available();
    if !available {
        println!("{bench}: left out, /proc/self/task/*/schedstat is not there");
    }
    available
}

fn total() -> Option<u64> {
    sum_of_threads(0)
}

/// Nanoseconds that this process's threads could have run but had no core, which others had: without those, they would have been CPU
/// seconds by about as much.
pub fn waiting_for_cores() -> u64 {
    sum_of_threads(1).unwrap_or_default()
}

/// Sum of a field of `schedstat`: 0, nanoseconds run; 1, nanoseconds waiting to run.
fn sum_of_threads(field: usize) -> Option<u64> {
    let mut sum = 0;
    for task in fs::read_dir("/proc/self/task").ok()? {
        // A thread that ends meanwhile has nothing more to say.
        if let Ok(text) = fs::read_to_string(task.ok()?.path().join("schedstat")) {
            sum += text.split(' ').nth(field)?.parse::<u64>().ok()?;
        }
    }
    Some(sum)
}

/// Nanoseconds that the kernel has run the thread that asks: for threads that end before [`CpuTime`] is read, which does not count
/// them. 0 where the system does not say.
pub fn of_this_thread() -> u64 {
    // The kernel counts at ticks, milliseconds apart, and whenever it takes up another thread.
    std::thread::yield_now();
    let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let run = text.split(' ').next().unwrap_or_default();
    run.parse().unwrap_or(0)
}

/// Nanoseconds of the processes that this one has started and waited for, in steps of 10 ms: `cutime` and `cstime` of proc(5), in
/// ticks of which user space is told 100 a second on every Linux. 0 where the system does not say.
pub fn of_children() -> u64 {
    const TICK: u64 = 10_000_000;
    let text = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The program's name, in brackets, may hold anything; fields are counted from the state behind it, the third.
    let behind = text.rsplit_once(") ").map_or("", |(_, behind)| behind);
    let fields = behind.split(' ').skip(16 - 3).take(2);
    let ticks = fields.filter_map(|field| field.parse::<u64>().ok());
    TICK * ticks.sum::<u64>()
}

impl Measurement for CpuTime {
    type Intermediate = u64;
    type Value = u64;

    fn start(&self) -> u64 {
        total().unwrap_or_default()
    }

    fn end(&self, start: u64) -> u64 {
        // Never 0, which criterion can't divide by.
        total().unwrap_or_default().saturating_sub(start).max(1)
    }

    fn add(&self, a: &u64, b: &u64) -> u64 {
        a + b
    }

    fn zero(&self) -> u64 {
        0
    }

    fn to_f64(&self, value: &u64) -> f64 {
        *value as f64
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        &Formatter
    }
}

/// Nanoseconds, as wall time is shown.
struct Formatter;

impl ValueFormatter for Formatter {
    fn scale_values(&self, typical: f64, values: &mut [f64]) -> &'static str {
        WallTime.formatter().scale_values(typical, values)
    }

    fn scale_throughputs(
        &self,
        typical: f64,
        throughput: &Throughput,
        values: &mut [f64],
    ) -> &'static str {
        WallTime
            .formatter()
            .scale_throughputs(typical, throughput, values)
    }

    fn scale_for_machines(&self, values: &mut [f64]) -> &'static str {
        WallTime.formatter().scale_for_machines(values)
    }
}
