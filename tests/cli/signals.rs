//! Runs that end before their end.

use std::fs;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::harness::{Folder, Run};

#[test]
fn an_interrupt_ends_a_render_and_leaves_the_old_picture() {
    need_device!();
    for signal in ["-INT", "-TERM"] {
        let folder = Folder::new();
        fs::write(folder.at("a.png"), "the old picture").unwrap();
        let before = folder.entries();
        let child = start(&folder, "@cornell.glb --size 640x480 --spp 8192 -o a.png");
        thread::sleep(Duration::from_millis(1500));
        send(&child, signal);
        let run = Run::of(child.wait_with_output().unwrap()).failed(130, &["interrupted"]);
        assert_eq!(run.stdout, "");
        assert_eq!(folder.read("a.png"), b"the old picture");
        assert_eq!(folder.entries(), before, "nothing stays behind");
    }
}

#[test]
fn a_kill_at_any_moment_leaves_the_old_picture_or_the_new_one() {
    need_device!();
    let folder = Folder::new();
    let arguments = "@cornell.glb --size 320x240 -o a.png";
    // The driver compiles in the first run, and not again.
    folder.run(arguments).succeeded();
    let started = Instant::now();
    folder.run(arguments).succeeded();
    let duration = started.elapsed();
    let new = folder.read("a.png");
    let mut killed = 0;
    for round in 0..12 {
        fs::write(folder.at("a.png"), "the old picture").unwrap();
        let mut child = start(&folder, arguments);
        thread::sleep(duration * round / 10);
        child.kill().unwrap();
        killed += u32::from(child.wait().unwrap().code().is_none());
        let there = folder.read("a.png");
        assert!(
            there == b"the old picture" || there == new,
            "half a file after {round}/10 of the time"
        );
    }
    assert!(killed > 0, "no kill came in time");
}

fn start(folder: &Folder, arguments: &str) -> Child {
    folder
        .command(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn send(child: &Child, signal: &str) {
    assert!(
        Command::new("kill")
            .args([signal, &child.id().to_string()])
            .status()
            .unwrap()
            .success()
    );
}

#[test]
fn whoever_stops_reading_is_not_told_off() {
    let folder = Folder::new();
    for arguments in ["inspect @everything.glb", "inspect @everything.glb --json"] {
        let mut child = start(&folder, arguments);
        drop(child.stdout.take());
        let run = Run::of(child.wait_with_output().unwrap());
        assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    }
}
