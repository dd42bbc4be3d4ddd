//! What comes after the last ray: a picture from the device's memory to the host's, and from there into files.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use std::path::Path;

use criterion::{Criterion, Throughput};
use raytree::{Film, Format, Picture, RenderSettings, WriteOptions};
use support::frames::{Subject, rendered};

/// Pixels on the picture's side.
const SIDE: u32 = 512;
/// Half a step of 8 bits, in linear radiance, where steps are largest: at 1.
const HALF_STEP: f32 = 0.005;

/// All of it in one batch, so that all of it is on the device.
fn settings(subject: &Subject) -> RenderSettings {
    RenderSettings {
        batch_pixels: Some(SIDE * SIDE),
        ..subject.settings.clone()
    }
}

fn read_back(criterion: &mut Criterion, subject: &Subject) -> Film {
    let device = support::device();
    let settings = settings(subject);
    let prepared = subject.prepared(&device, &settings);
    let (_, film) = rendered(&prepared);
    subject.expected().check(&film);
    let mut group = support::group(criterion, "output", 2);
    group.throughput(Throughput::Elements(u64::from(SIDE * SIDE)));
    group.bench_function("read-back", |bencher| {
        bencher.iter(|| {
            let again = prepared.read_back();
            again.unwrap_or_else(|error| panic!("{error}"))
        });
    });
    let again = prepared.read_back();
    assert!(again.unwrap_or_else(|error| panic!("{error}")) == film);
    group.finish();
    film
}

fn write(criterion: &mut Criterion, film: &Film) {
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let mut group = support::group(criterion, "output", 2);
    group.throughput(Throughput::Elements(u64::from(SIDE * SIDE)));
    for ending in ["png", "exr"] {
        let path = folder.path().join("film").with_extension(ending);
        let write = || {
            film.write(&path, &WriteOptions::default())
                .unwrap_or_else(|error| panic!("{error}"));
        };
        group.bench_function(format!("write/{ending}"), |bencher| bencher.iter(write));
        write();
        check(&path, film);
    }
    group.finish();
}

/// # Panics
/// If the file holds another picture: radiance as it is in an EXR, what a screen shows of it in a PNG.
fn check(path: &Path, film: &Film) {
    let picture = Picture::read(path).unwrap_or_else(|error| panic!("{error}"));
    let (tolerance, shown) = match Format::of_path(path) {
        Ok(Format::Exr) => (0.0, film.radiance.clone()),
        _ => {
            let tone = WriteOptions::default().tone;
            let shown = film.radiance.iter().map(|&color| tone.apply(color));
            (HALF_STEP, shown.collect())
        }
    };
    let (read, shown) = (picture.rgb.as_flattened(), shown.as_flattened());
    assert_eq!(read.len(), shown.len());
    let far = |(read, shown): &(&f32, &f32)| (*read - *shown).abs() > tolerance;
    let wrong = read.iter().zip(shown).filter(far).count();
    assert_eq!(wrong, 0, "{}: channels that are wrong", path.display());
}

fn main() {
    let subject = Subject::of_file("cornell.glb", SIDE);
    let mut criterion = Criterion::default().configure_from_args();
    let film = read_back(&mut criterion, &subject);
    write(&mut criterion, &film);
    criterion.final_summary();
}
