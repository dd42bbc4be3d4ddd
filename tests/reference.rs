//! The outside judge: POV-Ray's picture of the same scene.

#![allow(clippy::print_stdout, reason = "a test says what it measured")]

mod support;

use raytree::{CompareOptions, Limits, Picture, RenderSettings, compare};

/// 0.0005 and 0.2 % are what the issue asks for; an independent Embree program gets 0.00017 and 0.09 %.
const LIMITS: (f64, f64, f64) = (0.0005, 0.02, 0.002);

fn limits() -> Limits {
    let (mean, threshold, share) = LIMITS;
    Limits {
        max_mean: Some(mean),
        max_outliers: vec![(threshold, share)],
        ..Limits::default()
    }
}

#[test]
fn spheres_are_as_pov_ray_has_them() {
    let Some(folder) = support::shared("reference/spheres") else {
        return;
    };
    let Some(device) = support::device() else {
        return;
    };
    let scene = support::import(&folder.join("spheres.glb"));
    let settings = RenderSettings::new(640, 480, support::camera(&scene));
    let rendering = support::render(device, &scene, &settings);
    let ours = Picture::from(&rendering.film);
    let theirs = Picture::read(&folder.join("povray.exr")).unwrap();
    let options = CompareOptions {
        flip: false,
        ..limits().options(true)
    };
    let comparison = compare(&theirs, &ours, &options).unwrap();
    println!(
        "mean {:.6}, outliers {:?}",
        comparison.mean_abs, comparison.outliers
    );
    let broken = limits().check(&comparison);
    if !broken.is_empty() {
        let path = support::artefact("spheres-difference.png");
        raytree::difference_picture(&theirs, &ours)
            .unwrap()
            .write_png(&path)
            .unwrap();
        panic!("{broken:?}; see {}", path.display());
    }
}

/// The comparison has to be able to fail: half a stop of exposure, or a ball that is not there, is a different picture.
#[test]
fn a_wrong_picture_is_noticed() {
    let Some(folder) = support::shared("reference/spheres") else {
        return;
    };
    let theirs = Picture::read(&folder.join("povray.exr")).unwrap();
    let options = CompareOptions {
        flip: false,
        ..limits().options(true)
    };
    let mut dimmer = theirs.clone();
    dimmer.rgb.iter_mut().flatten().for_each(|c| *c *= 0.995);
    assert!(
        !limits()
            .check(&compare(&theirs, &dimmer, &options).unwrap())
            .is_empty()
    );
    let mut spot = theirs.clone();
    spot.rgb
        .iter_mut()
        .take(700)
        .for_each(|rgb| *rgb = [1.0, 0.0, 1.0]);
    assert!(
        !limits()
            .check(&compare(&theirs, &spot, &options).unwrap())
            .is_empty()
    );
}
