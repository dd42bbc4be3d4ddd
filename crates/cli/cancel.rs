//! Ctrl-C and requests to terminate. The first one ends the program between two steps, or after [`GRACE`] if a step takes
//! longer (a driver that compiles can't be stopped); the second at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use std::{process, thread};

use crate::console;
use crate::failure::{INTERRUPTED, Interrupted};

const GRACE: Duration = Duration::from_secs(2);

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// A file that is being written is finished first: nothing is lost without that, but a hidden file would stay behind.
static WRITING: AtomicBool = AtomicBool::new(false);

/// From now on signals are requests.
pub fn watch() -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            end();
        }
        thread::spawn(exit_after_grace);
    })
}

fn exit_after_grace() {
    thread::sleep(GRACE);
    while WRITING.load(Ordering::SeqCst) {
        thread::sleep(GRACE / 10);
    }
    end();
}

fn end() {
    console::to_stderr(format_args!("Error: {Interrupted}"));
    process::exit(INTERRUPTED.into());
}

pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// Between two steps: shall there be another one?
pub fn check() -> Result<(), Interrupted> {
    if requested() {
        Err(Interrupted)
    } else {
        Ok(())
    }
}

/// Writes something, unless the program is about to end.
pub fn while_writing<T>(write: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    WRITING.store(true, Ordering::SeqCst);
    let result = check().map_err(Into::into).and_then(|()| write());
    WRITING.store(false, Ordering::SeqCst);
    result
}
