//! What a frame costs beside its rays, and whether it keeps the cores busy. Rendering alone: uploaded and compiled it is before.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use raytree::{Device, Feature, ProgramFeatures, RenderSettings};
use raytree_gpu::{Prober, RecordedRays, types::ProbeRay};
use support::{
    Effort, cpu_time,
    findings::{Bar, Findings},
    frames::{Subject, rendered},
    rays,
    summary::Spread,
    turns::{Sides, Turn},
};

/// Pixels on a picture's side.
const SIDE: u32 = 512;
/// Rays of a bare traversal's dispatch: the most that a prober takes.
const AT_ONCE: usize = 1 << 20;
/// What a frame may take of a bare traversal of its rays.
const FRAME_BAR: Bar = Bar::AtMost(1.5);
/// Cores that a frame has to keep busy of two.
const CORES_BAR: Bar = Bar::AtLeast(1.8);
/// Seconds of a frame that keeps cores busy: in shorter ones, beginning and end weigh.
const LONG: f64 = 0.5;
/// Rays that may hit something else in a bare traversal, which knows not what they have just left, and begins them a rounding
/// beside.
const OTHER_HITS: f64 = 1e-4;

/// A name, and what makes its subject.
type Make = (&'static str, fn() -> Subject);

const SUBJECTS: [Make; 4] = [
    ("spheres", || {
        Subject::new("spheres", rays::spheres().lit(), SIDE)
    }),
    ("whitted-1980", || {
        Subject::of_file("whitted-1980.glb", SIDE)
    }),
    ("cornell", || Subject::of_file("cornell.glb", SIDE)),
    ("book", || Subject::of_file("book.glb", SIDE)),
];

/// Whether each traversal is a ray that the counters count: none goes on behind what it has passed.
fn counts_are_equal(features: ProgramFeatures) -> bool {
    !features.has(Feature::Mask) && !features.has(Feature::StraightOn)
}

/// The rays of the subject's picture.
fn recorded(device: &Device, subject: &Subject) -> RecordedRays {
    let settings = RenderSettings {
        counters: true,
        ..subject.settings.clone()
    };
    let recorded = subject
        .prepared(device, &settings)
        .recorded_rays()
        .unwrap_or_else(|error| panic!("{error}"));
    let (found, counted) = (recorded.rays.len() as u64, recorded.counters.rays.total());
    let right = if counts_are_equal(subject.features(&settings)) {
        found == counted
    } else {
        found >= counted
    };
    assert!(right, "{}: {found} rays, {counted} counted", subject.name);
    recorded
}

/// # Panics
/// If the bare traversal finds something else than the frame did.
fn check(subject: &Subject, prober: &Prober<'_>, recorded: &RecordedRays) {
    let hits = prober
        .trace(&recorded.rays)
        .unwrap_or_else(|error| panic!("{error}"));
    let other = recorded.other_hits(&hits);
    let (name, all) = (&subject.name, recorded.rays.len());
    assert!(
        other as f64 <= OTHER_HITS * all as f64,
        "{name}: {other} of {all} rays hit something else in a bare traversal"
    );
    let met = hits.iter().filter(|hit| hit.triangle != u32::MAX).count();
    assert!(
        5 * met > all,
        "{name}: only {met} of {all} rays hit anything"
    );
    println!("{name}: {all} rays, {met} of them hit, {other} something else than in the frame");
}

/// The dispatches alone.
fn bare(prober: &Prober<'_>, rays: &[ProbeRay]) -> Turn {
    let turn = |rays: &[ProbeRay]| {
        prober
            .upload(rays)
            .unwrap_or_else(|error| panic!("{error}"));
        let (turn, run) = Turn::of(|| prober.run(rays.len()));
        run.unwrap_or_else(|error| panic!("{error}"));
        turn
    };
    rays.chunks(AT_ONCE).map(turn).sum()
}

/// A whole frame against a bare traversal of its rays.
fn compare(device: &Device, subject: &Subject, rounds: usize) -> Sides {
    let recorded = recorded(device, subject);
    let features = subject.features(&subject.settings);
    let prober = Prober::new(
        device,
        &subject.scene,
        &subject.bvh,
        features,
        subject.settings.numerics,
    )
    .unwrap_or_else(|error| panic!("{error}"));
    check(subject, &prober, &recorded);
    let frame = subject.prepared(device, &subject.settings);
    let (_, film) = rendered(&frame);
    subject.expected().check(&film);
    Sides::in_turn(
        rounds,
        || {
            let (turn, again) = rendered(&frame);
            assert!(again.radiance == film.radiance, "another picture");
            turn
        },
        || bare(&prober, &recorded.rays),
    )
}

/// Frames of so many samples that they take [`LONG`].
fn long_frames(device: &Device, subject: &Subject, rounds: usize) -> Vec<Turn> {
    let (first, film) = rendered(&subject.prepared(device, &subject.settings));
    subject.expected().check(&film);
    let settings = RenderSettings {
        samples: (1.2 * LONG / first.wall).ceil() as u32,
        ..subject.settings.clone()
    };
    let frame = subject.prepared(device, &settings);
    (0..rounds).map(|_| rendered(&frame).0).collect()
}

/// What one subject is measured by.
fn measure(device: &Device, subject: &Subject, rounds: usize, findings: &mut Findings) {
    let name = &subject.name;
    let [rays, cores] = ["rays", "cores"].map(|what| format!("frame/{what}/{name}"));
    let sides = support::wanted(&rays).then(|| compare(device, subject, rounds));
    if let Some(sides) = &sides {
        findings.compare(&rays, sides, FRAME_BAR);
    }
    if support::wanted(&cores) {
        let turns = sides
            .map(|sides| sides.our_turns().copied().collect())
            .filter(|turns: &Vec<Turn>| turns.iter().all(|turn| turn.wall >= LONG))
            .unwrap_or_else(|| long_frames(device, subject, rounds));
        show_cores(&cores, &turns, findings);
    }
}

/// CPU seconds a second; and with those that threads waited for a core: what it might be on a machine that does nothing else.
fn show_cores(name: &str, turns: &[Turn], findings: &mut Findings) {
    let ran = |turn: &Turn| turn.cpu / turn.wall;
    let wanted = |turn: &Turn| (turn.cpu + turn.waited) / turn.wall;
    for (name, cores) in [
        (name.to_owned(), Spread::of(turns.iter().map(ran))),
        (
            format!("{name}/wanted"),
            Spread::of(turns.iter().map(wanted)),
        ),
    ] {
        // Of a history less has to be better.
        let extra = format!("{} rounds", turns.len());
        let record = cores.inverse().record(&name, "s a CPU s", &extra);
        findings.figure(&name, cores, CORES_BAR, record);
    }
}

fn main() {
    if !cpu_time::available_for("frame") {
        return;
    }
    let rounds = Effort::chosen().rounds();
    let device = support::device();
    let mut findings = Findings::new(
        "frame",
        "ours: rendering a frame; theirs: a bare traversal of its rays; cores: CPU seconds a second",
    );
    for (name, subject) in SUBJECTS {
        let names = ["rays", "cores"].map(|what| format!("frame/{what}/{name}"));
        if names.iter().any(|name| support::wanted(name)) {
            measure(&device, &subject(), rounds, &mut findings);
        }
    }
    findings.finish();
}
