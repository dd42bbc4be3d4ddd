//! CPU seconds of all threads of this process.

use std::fs;

/// Seconds that the kernel has run this process's threads, by `/proc/self/task/*/schedstat`; the driver's and rayon's threads stay
/// as long as the process does, so none is missed. `None` where the system does not say: elsewhere than on Linux.
pub fn seconds() -> Option<f64> {
    let mut nanoseconds = 0;
    for task in fs::read_dir("/proc/self/task").ok()? {
        // A thread that ends meanwhile has nothing more to say.
        if let Ok(text) = fs::read_to_string(task.ok()?.path().join("schedstat")) {
            nanoseconds += text.split(' ').next()?.parse::<u64>().ok()?;
        }
    }
    // Kernels that don't keep count say 0.
    (nanoseconds > 0).then_some(nanoseconds as f64 * 1e-9)
}
