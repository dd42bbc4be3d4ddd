//! The regression net: each folder in `tests/golden/` is a picture that must not change unnoticed. The judge is the picture
//! committed there, which says nothing about being right: that is what `oracle` and `reference` are for.
//! How to add one and how to bless a change: `tests/golden/README.md`.
#![allow(clippy::print_stdout, reason = "what a test says is read by people")]

mod support;

use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

use libtest_mimic::{Arguments, Failed, Trial};
use raytree::{
    Background, Camera, Device, DeviceInfo, Picture, RenderSettings, Scene, Shading, ToneMap,
    WriteOptions,
};
use raytree_film::{quantise_u8, srgb_encode};
use serde::Deserialize;
use support::PINNED_DRIVER;

/// A pixel is as blessed if no channel is further off, of 255 steps: rounding to 8 bits turns a last-bit difference of
/// f32 into a whole step.
const STEPS: u8 = 1;

/// Share of the pixels that may differ by more on the pinned driver. lavapipe compiles for the CPU that it finds (vectors of
/// 256 or 512 bits, other instructions), so the last bit of a float can differ between machines, and a ray that meets an edge
/// falls to its other side. On one machine the pictures are the same byte for byte (`tests/repeat.rs`).
const MOVED_SHARE: f64 = 0.001;

/// Mean difference on any other driver, of the display's range. Measured on Mesa 22.3.6 against 25.0.7: see README.md.
const OTHER_DRIVER_MEAN: f64 = 1e-3;

/// A golden is looked at in reviews and kept in git forever.
const LARGEST_FILE: u64 = 64 << 10;
const LARGEST_SIDE: u32 = 160;

/// `settings.json`: what to render, and how to show it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Golden {
    /// What this picture watches over; for people.
    #[serde(rename = "shows")]
    _shows: String,
    /// A file under `assets/`.
    asset: String,
    /// By name; without one, the default.
    camera: Option<String>,
    /// A colour in place of what the scene says.
    background: Option<[f32; 3]>,
    width: u32,
    height: u32,
    samples: u32,
    shading: Model,
    tone: Tone,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Model {
    Pbr,
    Whitted,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Tone {
    None,
    Neutral,
}

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let folder = support::root().join("tests/golden");
    let folders = folders_in(&folder);
    let mut trials = vec![
        Trial::test(
            "comparison::another_picture_is_noticed",
            another_picture_is_noticed,
        ),
        Trial::test(
            "comparison::another_driver_is_held_to_the_mean",
            another_driver_is_held_to_the_mean,
        ),
        Trial::test(
            "comparison::blessing_needs_the_pinned_driver",
            blessing_needs_the_pinned_driver,
        ),
    ];
    let listed = folders.clone();
    trials.push(Trial::test("every_scene_has_one", move || {
        every_scene_has_one(&listed)
    }));
    // Not opened to list names.
    let device = if arguments.list {
        None
    } else {
        support::device()
    };
    for folder in folders {
        let test = Trial::test(format!("picture::{}", support::stem(&folder)), move || {
            device.map_or_else(|| Err("no device".into()), |device| run(device, &folder))
        });
        trials.push(test.with_ignored_flag(device.is_none() && !arguments.list));
    }
    libtest_mimic::run(&arguments, trials).exit_code()
}

fn folders_in(folder: &Path) -> Vec<PathBuf> {
    let entries =
        fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut folders: Vec<PathBuf> = entries
        .map(|entry| entry.expect("a readable entry").path())
        .filter(|path| path.is_dir())
        .collect();
    folders.sort();
    folders
}

fn run(device: &Device, folder: &Path) -> Result<(), Failed> {
    let name = support::stem(folder);
    let golden = read_golden(folder)?;
    let expected_path = folder.join("expected.png");
    let actual_path =
        support::artefact(&format!("golden-{name}-actual-{}.png", slug(device.info())));
    draw(device, &golden, &actual_path)?;
    let actual = Picture::read(&actual_path)?;

    let verdict = if expected_path.exists() {
        small_enough(&expected_path)?;
        let expected = Picture::read(&expected_path)?;
        judge(&expected, &actual, support::is_pinned(device.info())).map_err(|what| {
            match leave_difference(&expected, &actual, &name, device.info()) {
                Some(path) => format!("{what}; expected | actual | difference: {}", path.display()),
                None => what,
            }
        })
    } else {
        Err(format!(
            "there is no {}; what it would be: {}",
            expected_path.display(),
            actual_path.display()
        ))
    };
    let Err(what) = verdict else {
        fs::remove_file(&actual_path)?;
        return Ok(());
    };
    if !support::blessing() {
        let command =
            format!("RAYTREE_BLESS=1 cargo test --test golden -- --exact picture::{name}");
        return Err(format!("{what}\nIf this is how it should be: {command}").into());
    }
    bless(device.info(), &actual_path, &expected_path)?;
    Err(format!(
        "{what}\nblessed: {} is now what was rendered; look at it",
        expected_path.display()
    )
    .into())
}

fn read_golden(folder: &Path) -> Result<Golden, Failed> {
    let path = folder.join("settings.json");
    let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let golden: Golden =
        serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))?;
    if golden.width.max(golden.height) > LARGEST_SIDE {
        return Err(format!("{}: larger than {LARGEST_SIDE} pixels", path.display()).into());
    }
    Ok(golden)
}

/// Renders to a PNG file, as the program would.
fn draw(device: &Device, golden: &Golden, path: &Path) -> Result<(), Failed> {
    let mut scene = support::import(&support::root().join("assets").join(&golden.asset));
    raytree::light_if_dark(&mut scene);
    if let Some(color) = golden.background {
        scene.surroundings.background = Background::Color(color.into());
    }
    let mut settings = RenderSettings::new(golden.width, golden.height, camera(&scene, golden)?);
    settings.samples = golden.samples;
    settings.shading = match golden.shading {
        Model::Pbr => Shading::Pbr,
        Model::Whitted => Shading::Whitted,
    };
    // These are the programs that the oracle's test has already had compiled: half the time of a fresh run of all tests.
    settings.counters = true;
    let tone = match golden.tone {
        Tone::None => ToneMap::None,
        Tone::Neutral => ToneMap::Neutral,
    };
    let rendering = support::render(device, &scene, &settings);
    Ok(rendering.film.write(
        path,
        &WriteOptions {
            tone,
            ..WriteOptions::default()
        },
    )?)
}

fn camera(scene: &Scene, golden: &Golden) -> Result<Camera, Failed> {
    let Some(name) = &golden.camera else {
        return Ok(support::camera(scene));
    };
    let found = scene.cameras.iter().find(|camera| camera.name == *name);
    Ok(found
        .cloned()
        .ok_or_else(|| format!("{} has no camera '{name}'", golden.asset))?)
}

fn judge(expected: &Picture, actual: &Picture, pinned: bool) -> Result<(), String> {
    let (size, wanted) = (
        (actual.width, actual.height),
        (expected.width, expected.height),
    );
    if size != wanted {
        return Err(format!(
            "the picture is {}x{}, not {}x{}",
            size.0, size.1, wanted.0, wanted.1
        ));
    }
    if pinned {
        judge_near_exact(expected, actual)
    } else {
        judge_mean(expected, actual)
    }
}

fn judge_near_exact(expected: &Picture, actual: &Picture) -> Result<(), String> {
    let largest = |(a, b): ([u8; 3], [u8; 3])| {
        [0, 1, 2]
            .map(|k| a[k].abs_diff(b[k]))
            .into_iter()
            .max()
            .unwrap_or(0)
    };
    let differences: Vec<u8> = steps(expected).zip(steps(actual)).map(largest).collect();
    let moved = differences
        .iter()
        .filter(|difference| **difference > STEPS)
        .count();
    if moved as f64 <= MOVED_SHARE * differences.len() as f64 {
        return Ok(());
    }
    let most = differences.iter().max().copied().unwrap_or(0);
    Err(format!(
        "{moved} of {} pixels differ by more than {STEPS} step of 255, up to {most}",
        differences.len()
    ))
}

fn judge_mean(expected: &Picture, actual: &Picture) -> Result<(), String> {
    let pairs = steps(expected).flatten().zip(steps(actual).flatten());
    let sum: f64 = pairs.map(|(a, b)| f64::from(a.abs_diff(b)) / 255.0).sum();
    let mean = sum / (3 * expected.rgb.len()) as f64;
    println!("mean difference to the pinned driver's picture: {mean:.6} of the display's range");
    if mean <= OTHER_DRIVER_MEAN {
        return Ok(());
    }
    Err(format!(
        "the mean difference is {mean:.5} of the display's range, more than {OTHER_DRIVER_MEAN}"
    ))
}

/// The picture as its file has it.
fn steps(picture: &Picture) -> impl Iterator<Item = [u8; 3]> {
    picture
        .rgb
        .iter()
        .map(|rgb| rgb.map(|c| quantise_u8(srgb_encode(c))))
}

/// `None` where the sizes differ: the message says that.
fn leave_difference(
    expected: &Picture,
    actual: &Picture,
    name: &str,
    device: &DeviceInfo,
) -> Option<PathBuf> {
    let path = support::artefact(&format!("golden-{name}-difference-{}.png", slug(device)));
    raytree::difference_picture(expected, actual)
        .ok()?
        .write_png(&path)
        .ok()?;
    Some(path)
}

/// Adapter and driver as a part of a file's name.
fn slug(device: &DeviceInfo) -> String {
    let text = format!("{} {}", device.name, device.driver);
    let words = text
        .split(|c: char| !c.is_ascii_alphanumeric() && c != '.')
        .filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-")
}

fn bless(device: &DeviceInfo, actual: &Path, expected: &Path) -> Result<(), Failed> {
    if !support::is_pinned(device) {
        return Err(format!(
            "goldens are blessed on {PINNED_DRIVER} alone, and this is {}; ./setup.sh installs it, RAYTREE_DEVICE chooses it",
            device.driver
        )
        .into());
    }
    small_enough(actual)?;
    fs::copy(actual, expected)?;
    Ok(())
}

fn small_enough(path: &Path) -> Result<(), Failed> {
    let size = fs::metadata(path)?.len();
    if size > LARGEST_FILE {
        let most = LARGEST_FILE >> 10;
        return Err(format!(
            "{} has {size} bytes, more than {most} KiB; render fewer pixels",
            path.display()
        )
        .into());
    }
    Ok(())
}

/// A new scene gets its picture, or this fails.
fn every_scene_has_one(folders: &[PathBuf]) -> Result<(), Failed> {
    let goldens = folders
        .iter()
        .map(|folder| read_golden(folder))
        .collect::<Result<Vec<_>, _>>()?;
    let missing: Vec<PathBuf> = support::own_scenes()
        .into_iter()
        .filter(|scene| {
            !goldens.iter().any(|golden| {
                scene
                    .file_name()
                    .is_some_and(|file| file == golden.asset.as_str())
            })
        })
        .collect();
    if missing.is_empty() {
        Ok(())
    } else {
        Err(format!("no golden shows {missing:?}").into())
    }
}

fn grey(width: u32, height: u32, value: f32) -> Picture {
    let mut film = raytree::Film::new(width, height);
    film.radiance.fill([value; 3]);
    Picture::from(&film)
}

/// A picture's encoded value `count` pixels long moved by `steps` of 255.
fn moved(picture: &Picture, count: usize, steps: f32) -> Picture {
    let mut moved = picture.clone();
    for rgb in moved.rgb.iter_mut().take(count) {
        rgb[1] = raytree::srgb_decode(srgb_encode(rgb[1]) + steps / 255.0);
    }
    moved
}

/// The comparison has to be able to fail: by a pixel too many, by a step too many, by its size, by a NaN.
fn another_picture_is_noticed() -> Result<(), Failed> {
    let picture = grey(100, 100, 0.5);
    let accepted = |other: &Picture| judge(&picture, other, true).is_ok();
    assert!(accepted(&picture));
    assert!(
        accepted(&moved(&picture, 10_000, 1.0)),
        "one step everywhere"
    );
    assert!(
        accepted(&moved(&picture, 10, 60.0)),
        "a tenth of a percent of the pixels"
    );
    assert!(
        !accepted(&moved(&picture, 11, 2.0)),
        "one pixel more, by two steps"
    );
    assert!(
        !accepted(&moved(&picture, 10_000, -2.0)),
        "two steps everywhere"
    );
    assert!(!accepted(&grey(100, 99, 0.5)), "another size");
    assert!(!accepted(&grey(100, 100, f32::NAN)), "no number");
    Ok(())
}

fn another_driver_is_held_to_the_mean() -> Result<(), Failed> {
    let picture = grey(100, 100, 0.5);
    let accepted = |other: &Picture| judge(&picture, other, false).is_ok();
    // One of three channels by 30 steps in 2.5 % of the pixels: 0.00098; in 2.6 %: 0.00102.
    assert!(accepted(&moved(&picture, 250, 30.0)));
    assert!(!accepted(&moved(&picture, 260, 30.0)));
    assert!(!accepted(&grey(99, 100, 0.5)));
    Ok(())
}

fn blessing_needs_the_pinned_driver() -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let (actual, expected) = (
        folder.path().join("actual.png"),
        folder.path().join("expected.png"),
    );
    fs::write(&actual, "new")?;
    let bless_on = |driver: &str| {
        let device = DeviceInfo {
            name: "llvmpipe (LLVM 19.1.4, 256 bits)".into(),
            driver: driver.into(),
            cpu: true,
        };
        bless(&device, &actual, &expected).is_ok()
    };
    for other in [
        "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)",
        "llvmpipe Mesa 25.0.70",
        "llvmpipe Mesa 25.0.7.1",
        "NVIDIA 570.86",
    ] {
        assert!(!bless_on(other) && !expected.exists(), "{other}");
    }
    assert!(bless_on("llvmpipe Mesa 25.0.7-2~bpo12+1 (LLVM 19.1.7)"));
    assert_eq!(fs::read_to_string(&expected)?, "new");
    fs::write(&actual, vec![0; LARGEST_FILE as usize + 1])?;
    assert!(!bless_on("llvmpipe Mesa 25.0.7"), "too large a file");
    Ok(())
}
