//! What goes to the terminal, and how much of it. Nothing here fails because somebody stopped reading.

use std::fmt::Display;
use std::io::{self, ErrorKind, IsTerminal, Write};

use raytree::model::Warning;
use serde_json::Value;
use tracing_subscriber::EnvFilter;

use crate::failure::Usage;

/// The environment variable that sets the log's filter, in tracing-subscriber's syntax.
const LOG_VARIABLE: &str = "RAYTREE_LOG";

/// Stderr, as loud as the user wants it.
#[derive(Clone, Copy, Debug)]
pub struct Console {
    quiet: bool,
    verbosity: u8,
}

impl Console {
    pub fn new(quiet: bool, verbosity: u8) -> Self {
        Self { quiet, verbosity }
    }

    /// Starts the log if it was asked for; wgpu's and the drivers' own messages stay out of it.
    pub fn start_log(self) -> anyhow::Result<()> {
        let filter = match std::env::var(LOG_VARIABLE) {
            Ok(filter) => filter,
            Err(_) if self.verbosity >= 2 => "raytree=debug".to_owned(),
            Err(_) => return Ok(()),
        };
        let filter = EnvFilter::builder().parse(&filter).map_err(|error| {
            Usage(format!(
                "{LOG_VARIABLE}={filter}: {error}; write RAYTREE_LOG=debug, say"
            ))
        })?;
        tracing_subscriber::fmt()
            .with_env_filter(filter)
            .with_writer(io::stderr)
            .with_ansi(io::stderr().is_terminal())
            .init();
        Ok(())
    }

    pub fn is_verbose(self) -> bool {
        self.verbosity >= 1
    }

    /// Progress is for people who watch; a log would tear it apart.
    pub fn shows_progress(self) -> bool {
        !self.quiet && self.verbosity < 2 && io::stderr().is_terminal()
    }

    /// A line for people.
    pub fn say(self, line: impl Display) {
        if !self.quiet {
            to_stderr(line);
        }
    }

    /// What the importer left out or mended.
    pub fn warn(self, warnings: &[Warning]) {
        for warning in warnings {
            self.say(format_args!("warning: {warning}"));
        }
    }

    /// Why the program ends, in one line. The library's errors say all there is to say themselves, their sources included.
    pub fn error(self, error: &anyhow::Error) {
        let line = error.to_string().replace('\n', " ");
        to_stderr(format_args!("Error: {line}"));
    }
}

/// A line for people, even if they want quiet.
pub fn to_stderr(line: impl Display) {
    // If nobody can be told, there is nobody to tell.
    let _ = writeln!(io::stderr(), "{line}");
}

/// Results go to stdout. That their reader has seen enough is no error.
pub fn print(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    let written = stdout.write_all(text.as_bytes());
    match written.and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result.map_err(|error| {
            let message = format!("standard output can't be written to: {error}");
            io::Error::new(error.kind(), message)
        }),
    }
}

/// One object on stdout.
pub fn print_json(value: &Value) -> io::Result<()> {
    print(&format!("{value:#}\n"))
}
