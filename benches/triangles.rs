//! How rendering time grows with triangles: the same hills from the same place, cut ten times as fine.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use raytree::Film;
use support::{
    Effort,
    findings::{Bar, Findings},
    frames::{Subject, rendered},
    rays,
    turns::Sides,
};

/// Pixels on the picture's side.
const SIDE: u32 = 512;
/// Squares along a side of the hills: 999,698 triangles, and 100,352.
const FINE: u32 = 707;
const COARSE: u32 = 224;
/// Ten times as many triangles are about one level of the hierarchy more, of some six; the rest is for caches.
const BAR: Bar = Bar::AtMost(1.6);
/// How far the two pictures may lie apart in the mean of all channels: facets differ, hills don't.
const MEAN_DIFFERENCE: f64 = 0.02;

fn hills(name: &'static str, side: u32) -> Subject {
    Subject::new(name, rays::terrain_of(side).lit(), SIDE)
}

/// # Panics
/// If they show something else.
fn check_alike(fine: &Film, coarse: &Film) {
    let channels = |film: &Film| film.radiance.as_flattened().to_vec();
    let (fine, coarse) = (channels(fine), channels(coarse));
    let apart: f64 = fine
        .iter()
        .zip(&coarse)
        .map(|(fine, coarse)| f64::from((fine - coarse).abs()))
        .sum();
    let mean = apart / fine.len() as f64;
    assert!(mean < MEAN_DIFFERENCE, "the pictures differ by {mean}");
}

fn main() {
    const NAME: &str = "triangles/tenfold";
    if !support::cpu_time::available_for("triangles") {
        return;
    }
    if !support::wanted(NAME) {
        return;
    }
    let device = support::device();
    let mut findings = Findings::new(
        "triangles",
        "ours: rendering 999,698 triangles; theirs: 100,352",
    );
    let (fine, coarse) = (hills("fine", FINE), hills("coarse", COARSE));
    let prepared = [&fine, &coarse].map(|subject| subject.prepared(&device, &subject.settings));
    let [ours, theirs] = prepared.each_ref().map(|prepared| rendered(prepared).1);
    coarse.expected().check(&theirs);
    check_alike(&ours, &theirs);
    let sides = Sides::in_turn(
        Effort::chosen().rounds(),
        || rendered(&prepared[0]).0,
        || rendered(&prepared[1]).0,
    );
    findings.compare(NAME, &sides, BAR);
    findings.finish();
}
