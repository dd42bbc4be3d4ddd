//! What a program for one scene gains on the program that can render anything: until the first ray when nothing is cached, and in
//! rendering. The scene needs next to nothing: opaque, without textures, one light.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

#[path = "../tests/support/alike.rs"]
#[allow(dead_code, reason = "nothing is counted here")]
mod alike;
#[path = "../tests/support/everything.rs"]
mod everything;

use std::process::Command;

use alike::{Alike, Words};
use everything::{everything, filled};
use raytree::{Device, ProgramFeatures, Scene};
use support::{
    Effort,
    findings::{Bar, Findings},
    frames::{Subject, prepared, rendered},
    turns::{Sides, Turn},
};

const SCENE: &str = "cornell.glb";
/// Pixels on the picture's side.
const SIDE: u32 = 512;
/// Twice as fast until the first ray.
const COLD_BAR: Bar = Bar::AtMost(0.5);
/// 1.2 times as fast, 1 / 1.2.
const RENDER_BAR: Bar = Bar::AtMost(0.833);
/// The argument by which this program asks another one of itself what a program takes that is in no cache.
const COLD: &str = "--cold";

/// The two programs.
#[derive(Clone, Copy)]
enum Program {
    Specialised,
    Everything,
}

impl Program {
    const ALL: [Self; 2] = [Self::Specialised, Self::Everything];

    fn name(self) -> &'static str {
        match self {
            Self::Specialised => "specialised",
            Self::Everything => "everything",
        }
    }

    /// The scene as it reads it, and its features.
    fn of(self, subject: &Subject) -> (Scene, ProgramFeatures) {
        let special = subject.features(&subject.settings);
        match self {
            Self::Specialised => (subject.scene.clone(), special),
            Self::Everything => (
                filled(subject.scene.clone()),
                everything(&subject.settings, special),
            ),
        }
    }
}

/// From scene and hierarchy to where the first ray could be traced.
fn until_first_ray(device: &Device, program: Program) -> Turn {
    let subject = Subject::of_file(SCENE, SIDE);
    let (scene, features) = program.of(&subject);
    let (turn, _) = Turn::of(|| {
        prepared(device, (&scene, &subject.bvh), &subject.settings, features);
    });
    turn
}

/// The same in a process whose driver finds nothing in its cache.
fn until_first_ray_cold(program: Program) -> Turn {
    let this = std::env::current_exe().unwrap_or_else(|error| panic!("{error}"));
    let output = Command::new(this)
        .args([COLD, program.name()])
        .env("MESA_SHADER_CACHE_DISABLE", "true")
        .output()
        .unwrap_or_else(|error| panic!("{error}"));
    let text = String::from_utf8_lossy(&output.stdout);
    let times = text.lines().last().and_then(|line| line.split_once(' '));
    let seconds = |text: &str| text.parse::<f64>().ok();
    let turn = times.and_then(|(cpu, wall)| Some((seconds(cpu)?, seconds(wall)?)));
    let (cpu, wall) = turn.unwrap_or_else(|| {
        panic!("{COLD}: {text}{}", String::from_utf8_lossy(&output.stderr));
    });
    Turn {
        cpu,
        wall,
        ..Turn::default()
    }
}

/// What [`until_first_ray_cold`] has asked for, if it has.
fn asked_for() -> Option<Program> {
    let mut arguments = std::env::args().skip_while(|argument| argument != COLD);
    let named = arguments.nth(1)?;
    Program::ALL
        .into_iter()
        .find(|program| program.name() == named)
}

/// Both programs in turn.
///
/// # Panics
/// If they do not give the same picture, or if it is not the oracle's.
fn rendering(device: &Device, rounds: usize) -> Sides {
    let subject = Subject::of_file(SCENE, SIDE);
    let made = Program::ALL.map(|program| program.of(&subject));
    let [ours, theirs] = made.each_ref().map(|(scene, features)| {
        prepared(device, (scene, &subject.bvh), &subject.settings, *features)
    });
    let expected = rendered(&ours).1;
    subject.expected().check(&expected);
    let words = Words::of(&expected);
    let render = |program| {
        let (turn, film) = rendered(program);
        let found = Alike::on(device).difference(&words, &Words::of(&film));
        assert_eq!(found, None, "the programs' pictures");
        turn
    };
    Sides::in_turn(rounds, || render(&ours), || render(&theirs))
}

fn main() {
    let device = support::device();
    if let Some(program) = asked_for() {
        let Turn { cpu, wall, .. } = until_first_ray(&device, program);
        println!("{cpu} {wall}");
        return;
    }
    if !support::cpu_time::available_for("specialised") {
        return;
    }
    let rounds = Effort::chosen().rounds();
    let mut findings = Findings::new(
        "specialised",
        "ours: the program for the scene; theirs: the one that can render anything",
    );
    let [cold, render] =
        ["cold", "render"].map(|part| format!("specialised/{}/{part}", support::stem(SCENE)));
    if support::wanted(&cold) {
        let cold_of = |program| move || until_first_ray_cold(program);
        let [ours, theirs] = Program::ALL.map(cold_of);
        findings.compare(
            &cold,
            &Sides::in_turn(rounds.min(3), ours, theirs),
            COLD_BAR,
        );
    }
    if support::wanted(&render) {
        findings.compare(&render, &rendering(&device, rounds), RENDER_BAR);
    }
    findings.finish();
}
