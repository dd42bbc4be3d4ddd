//! What a tolerance is worth: whether it is kept and how good the estimate of the error is (`tolerance/kept`), what a picture takes at equal
//! error beside the best of many fixed settings (`tolerance/cost`), and what it takes where there is nothing to gain
//! (`tolerance/diffuse`).
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

#[path = "tolerance/cost.rs"]
mod cost;
#[path = "tolerance/kept.rs"]
mod kept;
#[path = "../tests/support/reference.rs"]
mod reference;
#[path = "tolerance/subjects.rs"]
mod subjects;
mod support;

use raytree::{Device, Picture, Tolerance};
use support::{
    Effort,
    findings::{Bar, Findings},
    frames::{Subject, rendered},
    turns::Sides,
};

const TOLERANCES: [f32; 3] = [1e-1, 1e-2, 1e-3];

/// Of a scene without ray trees, with a sample a pixel: what a tolerance may add.
const DIFFUSE_BAR: Bar = Bar::AtMost(1.03);

fn main() {
    let effort = Effort::chosen();
    let device = support::device();
    let mut findings = Findings::new(
        "tolerance",
        "to a tolerance, CPU time over that of fixed settings with the same error",
    );
    let tolerances: &[f32] = match effort {
        Effort::Test => &TOLERANCES[..1],
        Effort::Quick => &TOLERANCES[..2],
        Effort::Full => &TOLERANCES,
    };
    let (mut kept, mut costs) = (Vec::new(), Vec::new());
    for (name, path, is_ours) in subjects::files(effort) {
        let wanted = |part: &str| support::wanted(&format!("tolerance/{part}/{name}"));
        let (is_kept, is_cost) = (wanted("kept"), is_ours && wanted("cost"));
        if !is_kept && !is_cost {
            continue;
        }
        let subject = subjects::read(name, &path);
        if is_kept {
            kept.extend(kept::pictures(&device, &subject, is_ours, tolerances));
        }
        if is_cost {
            costs.extend(cost::outcomes(&device, &subject, tolerances, effort));
        }
    }
    if !kept.is_empty() {
        kept::tell(&kept, &mut findings);
    }
    if !costs.is_empty() {
        cost::tell(&costs, &mut findings);
    }
    if support::wanted("tolerance/diffuse") {
        findings.compare("tolerance/diffuse", &diffuse(&device, effort), DIFFUSE_BAR);
    }
    findings.finish();
}

/// A tolerance that a sample of each pixel keeps, against a sample of each pixel.
///
/// # Panics
/// If it takes more, or the pictures differ by more than a tenth of that.
fn diffuse(device: &Device, effort: Effort) -> Sides {
    let subject = Subject::of_file("cornell.glb", 512);
    let to_tolerance = Tolerance::absolute(TOLERANCES[0]);
    let settings = subject.settings.clone().to_tolerance(to_tolerance);
    let ours = subject.prepared(device, &settings);
    let theirs = subject.prepared(device, &subject.settings);
    let film = rendered(&ours).1;
    let samples = film.estimates.as_ref().map(|found| &found.samples);
    assert!(samples.is_some_and(|samples| samples.iter().all(|&count| count == 1)));
    let plain = Picture::from(&rendered(&theirs).1);
    let difference = reference::rmse(&plain, &Picture::from(&film));
    assert!(difference < 0.1 * f64::from(TOLERANCES[0]), "{difference}");
    let render = |ready| rendered(ready).0;
    Sides::in_turn(4 * effort.rounds(), || render(&ours), || render(&theirs))
}
