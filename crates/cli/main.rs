//! The program: parses its arguments, calls the library, reports. All work is the library's, `raytree`.

mod args;
mod cancel;
mod compare;
mod console;
mod converge;
mod describe;
mod devices;
mod failure;
mod inspect;
mod lighting;
mod outputs;
mod progress;
mod render;
mod report;
mod shader_cache;
mod stress;
mod summary;
mod values;
mod view;

use std::ffi::{OsStr, OsString};
use std::process::ExitCode;

use clap::{CommandFactory, Parser};

use crate::args::{Cli, Command};
use crate::console::Console;

fn main() -> ExitCode {
    shader_cache::use_own_folder();
    let cli = match Cli::try_parse_from(with_subcommand(std::env::args_os().collect())) {
        Ok(cli) => cli,
        Err(error) => return refuse(&error),
    };
    let console = Console::new(cli.quiet, cli.verbose);
    match run(&cli.command, console) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console.error(&error);
            ExitCode::from(failure::exit_code(&error))
        }
    }
}

fn run(command: &Command, console: Console) -> anyhow::Result<()> {
    console.start_log()?;
    match command {
        Command::Render(args) => render::run(args, console),
        Command::Inspect(args) => inspect::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Converge(args) => converge::run(args, console),
        Command::Stress(args) => stress::run(args, console),
        Command::Devices(args) => devices::run(args),
    }
}

/// Help and version go to stdout with exit code 0, usage errors to stderr with 2.
fn refuse(error: &clap::Error) -> ExitCode {
    // Whoever closed the pipe does not want to read it.
    let _ = error.print();
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(failure::USAGE))
}

/// `raytree scene.glb` is `raytree render scene.glb`, and `raytree -q --spp 4 scene.glb` is too.
fn with_subcommand(mut arguments: Vec<OsString>) -> Vec<OsString> {
    let first = arguments
        .iter()
        .skip(1)
        .find(|argument| !is_global(argument));
    let means_render = first.is_some_and(|first| match first.to_str() {
        Some(name) if is_subcommand(name) => false,
        Some("-h" | "--help" | "-V" | "--version") => false,
        Some(text) => text.starts_with('-') || looks_like_file(text),
        None => true,
    });
    if means_render {
        arguments.insert(1, "render".into());
    }
    arguments
}

/// Flags that may stand before a subcommand.
fn is_global(argument: &OsStr) -> bool {
    matches!(
        argument.to_str(),
        Some("-q" | "--quiet" | "-v" | "-vv" | "--verbose")
    )
}

fn is_subcommand(name: &str) -> bool {
    name == "help" || Cli::command().find_subcommand(name).is_some()
}

/// A mistyped subcommand should be called one, not a scene that is not there.
fn looks_like_file(text: &str) -> bool {
    let path = std::path::Path::new(text);
    path.extension().is_some() || path.components().count() > 1 || path.exists()
}
