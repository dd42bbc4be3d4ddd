//! The required judge: whole pictures of our own scenes, both shading models, against the f64 oracle. A pixel that differs
//! has to lie on an edge: somewhere where the oracle's own picture jumps within a thousandth of a pixel.

#![allow(clippy::print_stdout, reason = "a test says what it measured")]

mod support;

use raytree::{Device, RenderSettings, Scene, Shading, model::Camera};
use raytree_oracle::{Oracle, Settings, Shading as OracleShading};

const WIDTH: u32 = 200;
const HEIGHT: u32 = 150;

/// Largest difference of a channel, of radiance 1; above 1 it is relative. f32 against f64 through up to nine surfaces.
const TOLERANCE: f64 = 1e-3;

/// Share of the pixels that have to be that near.
const NEAR_SHARE: f64 = 0.999;

/// How far the oracle looks for the jump that explains a pixel, pixels. f32 has about 1e-7 of the scene's extent, which a
/// curved mirror or a ball of glass magnifies a hundredfold from bounce to bounce.
const EDGE_RADII: [f64; 3] = [1e-3, 1e-2, 5e-2];

/// A pixel that differs from the oracle's.
struct Outlier {
    x: u32,
    y: u32,
    ours: [f64; 3],
    theirs: [f64; 3],
}

impl Outlier {
    fn difference(&self) -> f64 {
        difference(self.ours, self.theirs)
    }
}

/// Of the channel that differs most; NaN if any is (`f64::max` would pass over it).
fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    let channels = [0, 1, 2].map(|k| (a[k] - b[k]).abs() / b[k].abs().max(1.0));
    channels.into_iter().fold(0.0, |largest, d| {
        if d > largest || d.is_nan() {
            d
        } else {
            largest
        }
    })
}

fn outliers(ours: &[[f32; 3]], theirs: &[[f64; 3]], width: u32) -> Vec<Outlier> {
    (0_u32..)
        .zip(ours.iter().zip(theirs))
        .map(|(index, (ours, theirs))| Outlier {
            x: index % width,
            y: index / width,
            ours: ours.map(f64::from),
            theirs: *theirs,
        })
        .filter(|pixel| pixel.difference().is_nan() || pixel.difference() > TOLERANCE)
        .collect()
}

/// The smallest neighbourhood in which the oracle's picture takes our value too.
fn explanation(
    oracle: &Oracle<'_>,
    camera: &Camera,
    settings: &Settings,
    pixel: &Outlier,
) -> Option<f64> {
    EDGE_RADII.into_iter().find(|&radius| {
        let spread = oracle.spread(camera, settings, pixel.x, pixel.y, radius);
        // A jump is wider than the tolerance, and reaches at least half way to our value.
        spread.width() > TOLERANCE
            && spread.contains(pixel.ours, 0.5 * pixel.difference().max(TOLERANCE))
    })
}

fn judge(device: &Device, name: &str, scene: &Scene, shading: Shading) -> Vec<String> {
    let camera = support::camera(scene);
    let mut settings = RenderSettings::new(WIDTH, HEIGHT, camera.clone());
    settings.shading = shading;
    settings.counters = true;
    let ours = support::render(device, scene, &settings);

    let oracle = Oracle::new(scene);
    let mut oracle_settings = Settings::new(WIDTH, HEIGHT);
    oracle_settings.shading = match shading {
        Shading::Pbr => OracleShading::Pbr,
        Shading::Whitted => OracleShading::Whitted,
    };
    let theirs = oracle.render(&camera, &oracle_settings);

    let found = outliers(&ours.film.radiance, &theirs.radiance, WIDTH);
    let near = 1.0 - found.len() as f64 / f64::from(WIDTH * HEIGHT);
    let mut unexplained = Vec::new();
    for pixel in &found {
        if std::env::var_os("RAYTREE_VERBOSE").is_some() {
            println!(
                "  ({}, {}): ours {:.4?}, oracle {:.4?}",
                pixel.x, pixel.y, pixel.ours, pixel.theirs
            );
        }
        if explanation(&oracle, &camera, &oracle_settings, pixel).is_none() {
            let hit = oracle.first_hit(&camera, &oracle_settings, pixel.x, pixel.y);
            let node = hit.map_or("background", |hit| scene.nodes[hit.node].as_str());
            unexplained.push(format!(
                "{name} {shading:?}: pixel ({}, {}) on {node}: ours {:.5?}, oracle {:.5?}",
                pixel.x, pixel.y, pixel.ours, pixel.theirs
            ));
        }
    }
    let alpha = ours.film.alpha.iter().zip(&theirs.alpha);
    let alpha_off = alpha
        .filter(|(a, b)| (f64::from(**a) - **b).abs() > TOLERANCE)
        .count();
    println!(
        "{name:16} {shading:7?}: {:.3} % within {TOLERANCE}, {} outliers, {} not explained by an edge, {alpha_off} alpha, storage {}",
        100.0 * near,
        found.len(),
        unexplained.len(),
        ours.counters.unwrap_or_default().ended.storage,
    );
    let mut faults = unexplained;
    if near < NEAR_SHARE {
        let path = support::write(&ours.film, &format!("{name}-{shading:?}-ours.png"));
        let mut film = ours.film.clone();
        film.radiance = theirs
            .radiance
            .iter()
            .map(|rgb| rgb.map(|c| c as f32))
            .collect();
        support::write(&film, &format!("{name}-{shading:?}-oracle.png"));
        faults.push(format!(
            "{name} {shading:?}: only {:.3} % near; see {}",
            100.0 * near,
            path.display()
        ));
    }
    if alpha_off as f64 > (1.0 - NEAR_SHARE) * f64::from(WIDTH * HEIGHT) {
        faults.push(format!(
            "{name} {shading:?}: alpha differs in {alpha_off} pixels"
        ));
    }
    if ours.counters.unwrap_or_default().ended.storage > 0 {
        faults.push(format!(
            "{name} {shading:?}: branches ended for lack of storage"
        ));
    }
    faults
}

fn judge_all(shading: Shading) {
    let Some(device) = support::device() else {
        return;
    };
    let only = std::env::var("RAYTREE_ONLY").unwrap_or_default();
    let mut faults = Vec::new();
    for path in support::own_scenes()
        .iter()
        .filter(|path| support::stem(path).contains(&only))
    {
        let mut scene = support::import(path);
        raytree::light_if_dark(&mut scene);
        faults.extend(judge(device, &support::stem(path), &scene, shading));
    }
    assert!(
        faults.is_empty(),
        "{} faults:\n{}",
        faults.len(),
        faults.join("\n")
    );
}

#[test]
fn own_scenes_pbr() {
    judge_all(Shading::Pbr);
}

#[test]
fn own_scenes_whitted() {
    judge_all(Shading::Whitted);
}

/// The comparison has to be able to fail.
#[test]
fn a_different_picture_is_an_outlier() {
    let theirs = [[0.5, 0.5, 0.5], [10.0, 1.0, 0.0]];
    assert!(outliers(&[[0.5, 0.5009, 0.5], [10.009, 1.0, 0.0]], &theirs, 2).is_empty());
    assert_eq!(
        outliers(&[[0.5, 0.5011, 0.5], [10.0, 1.0, 0.0]], &theirs, 2).len(),
        1
    );
    assert_eq!(
        outliers(&[[0.5, 0.5, 0.5], [10.02, 1.0, 0.0]], &theirs, 2).len(),
        1
    );
    assert_eq!(
        outliers(
            &[[f32::NAN, 0.5, 0.5], [f32::INFINITY, 1.0, 0.0]],
            &theirs,
            2
        )
        .len(),
        2
    );
}
