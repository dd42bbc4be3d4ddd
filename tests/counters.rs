//! The work that our own scenes take, without any clock: rays by kind, node visits, triangle tests, iterations, and the bytes of each
//! buffer, compared with `tests/counters.json` to the last one. A change that makes the algorithm worse, or better, has to say so:
//!
//!     RAYTREE_BLESS=1 cargo test --test counters
//!
//! rewrites the file, and still fails. What git says has changed belongs in the commit's message.

mod support;

use std::{collections::BTreeMap, fs, path::PathBuf};

use raytree::{
    Counters, Device, DeviceInfo, Preset, ProgramFeatures, RenderSettings, Scene, SceneFeatures,
    Shading,
};
use support::PINNED_DRIVER;

const WIDTH: u32 = 96;
const HEIGHT: u32 = 72;
const MAX_DEPTH: u32 = 8;

/// On any other driver a float's last bit differs, and rays at edges meet other things: share of a number, and rays that are few
/// whatever the number.
const OTHER_DRIVER_SHARE: f64 = 0.01;
const OTHER_DRIVER_FEW: u64 = 50;

/// What the names of buffers begin with, whose sizes need no device and are the same on each.
const BYTES: &str = "bytes.";

/// Numbers by their names.
type Numbers = BTreeMap<String, u64>;

/// The numbers of each scene and shading model.
type All = BTreeMap<String, Numbers>;

/// How alike numbers have to be.
#[derive(Clone, Copy, PartialEq)]
enum Judge {
    /// The driver that they were blessed on.
    Pinned,
    /// Another one.
    Other,
    /// No device: buffers only.
    Buffers,
}

impl Judge {
    fn of(device: Option<&DeviceInfo>) -> Self {
        match device {
            Some(info) if support::is_pinned(info) => Self::Pinned,
            Some(_) => Self::Other,
            None => Self::Buffers,
        }
    }

    fn accepts(self, name: &str, kept: Option<u64>, found: Option<u64>) -> bool {
        let buffer = name.starts_with(BYTES);
        match (self, kept, found) {
            (Self::Buffers, ..) if !buffer => true,
            (Self::Other, Some(kept), Some(found)) if !buffer => {
                let few = (OTHER_DRIVER_SHARE * kept as f64) as u64 + OTHER_DRIVER_FEW;
                kept.abs_diff(found) <= few
            }
            _ => kept == found,
        }
    }

    /// A line for each number that is another, is not kept, or is not there any more.
    fn differences(self, kept: &All, found: &All) -> Vec<String> {
        let (kept, found) = (flat(kept), flat(found));
        let mut names: Vec<_> = kept.keys().chain(found.keys()).collect();
        names.sort();
        names.dedup();
        let differs = |name: &&&(String, String)| {
            let (kept, found) = (kept.get(**name), found.get(**name));
            !self.accepts(&name.1, kept.copied(), found.copied())
        };
        let names = names.iter().filter(differs);
        names
            .map(|name| line(name, kept.get(*name), found.get(*name)))
            .collect()
    }
}

fn flat(all: &All) -> BTreeMap<(String, String), u64> {
    let numbers = all.iter().flat_map(|(scene, numbers)| {
        let named = move |(name, &number): (&String, &u64)| ((scene.clone(), name.clone()), number);
        numbers.iter().map(named)
    });
    numbers.collect()
}

fn line((scene, name): &(String, String), kept: Option<&u64>, found: Option<&u64>) -> String {
    let show = |number: Option<&u64>| number.map_or("none".to_owned(), u64::to_string);
    let percent = match (kept, found) {
        (Some(&kept), Some(&found)) if kept > 0 => {
            format!(" ({:+.2} %)", 100.0 * (found as f64 / kept as f64 - 1.0))
        }
        _ => String::new(),
    };
    format!(
        "{scene}: {name}: {} -> {}{percent}",
        show(kept),
        show(found)
    )
}

fn settings(scene: &Scene, shading: Shading) -> RenderSettings {
    RenderSettings {
        shading,
        max_depth: MAX_DEPTH,
        counters: true,
        ..RenderSettings::new(WIDTH, HEIGHT, support::camera(scene))
    }
}

fn buffers(scene: &Scene, settings: &RenderSettings) -> Numbers {
    let bvh = raytree::build_bvh(scene, Preset::default()).expect("few triangles");
    let features = ProgramFeatures::of(&SceneFeatures::of(scene), settings);
    let cost = raytree::cost(scene, &bvh, settings, features).expect("a scene of ours");
    let buffers = cost.buffers.into_iter();
    buffers
        .map(|buffer| (format!("{BYTES}{}", buffer.name), buffer.bytes))
        .collect()
}

fn work(device: &Device, scene: &Scene, settings: &RenderSettings) -> Numbers {
    let rendering = support::render(device, scene, settings);
    let Counters {
        rays,
        node_visits,
        triangle_tests,
        ended,
    } = rendering.counters.expect("they were asked for");
    let numbers = [
        ("rays.primary", rays.primary),
        ("rays.shadow", rays.shadow),
        ("rays.reflection", rays.reflection),
        ("rays.refraction", rays.refraction),
        ("node_visits", node_visits),
        ("triangle_tests", triangle_tests),
        ("ended.miss", ended.miss),
        ("ended.depth", ended.depth),
        ("ended.weight", ended.weight),
        ("ended.storage", ended.storage),
        ("ended.budget", ended.budget),
        ("iterations", u64::from(rendering.iterations)),
    ];
    numbers
        .into_iter()
        .map(|(name, number)| (name.to_owned(), number))
        .collect()
}

fn measure(device: Option<&Device>) -> All {
    let mut all = All::new();
    for path in support::own_scenes() {
        let mut scene = support::import(&path);
        raytree::light_if_dark(&mut scene);
        for (model, shading) in [("pbr", Shading::Pbr), ("whitted", Shading::Whitted)] {
            let settings = settings(&scene, shading);
            let mut numbers = buffers(&scene, &settings);
            if let Some(device) = device {
                numbers.extend(work(device, &scene, &settings));
            }
            all.insert(format!("{}/{model}", support::stem(&path)), numbers);
        }
    }
    all
}

fn kept_in() -> PathBuf {
    support::root().join("tests/counters.json")
}

/// Nothing, if nothing is kept yet.
fn kept() -> All {
    let text = fs::read_to_string(kept_in()).unwrap_or_else(|_| "{}".to_owned());
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("tests/counters.json: {error}"))
}

/// A line a number, so that differences read well.
fn bless(judge: Judge, found: &All) -> String {
    if judge != Judge::Pinned {
        return format!("not blessed: that takes {PINNED_DRIVER}; ./setup.sh installs it");
    }
    let text = serde_json::to_string_pretty(found).expect("numbers");
    fs::write(kept_in(), text + "\n").expect("a writable checkout");
    "blessed: tests/counters.json is now what was counted; look at it".to_owned()
}

#[test]
fn work_is_as_kept() {
    let device = support::device();
    let judge = Judge::of(device.map(Device::info));
    let found = measure(device);
    let differences = judge.differences(&kept(), &found);
    if differences.is_empty() {
        return;
    }
    let what_now = if support::blessing() {
        bless(judge, &found)
    } else {
        "If this is how it should be: RAYTREE_BLESS=1 cargo test --test counters".to_owned()
    };
    panic!(
        "{} numbers differ (kept -> counted):\n{}\n{what_now}",
        differences.len(),
        differences.join("\n")
    );
}

fn one_scene(visits: u64, bytes: u64) -> All {
    let numbers = [("node_visits", visits), ("bytes.nodes", bytes)];
    let numbers = numbers.map(|(name, number)| (name.to_owned(), number));
    All::from([("ball/pbr".to_owned(), Numbers::from(numbers))])
}

/// The comparison has to be able to fail: by one, by a number or a scene more or less.
#[test]
fn a_changed_number_is_noticed() {
    let kept = one_scene(1000, 80);
    let differences = |found: &All| Judge::Pinned.differences(&kept, found);
    assert!(differences(&kept).is_empty());
    assert_eq!(
        differences(&one_scene(1001, 80)),
        ["ball/pbr: node_visits: 1000 -> 1001 (+0.10 %)"]
    );
    let mut fewer = kept.clone();
    fewer
        .get_mut("ball/pbr")
        .expect("there")
        .remove("bytes.nodes");
    assert_eq!(differences(&fewer), ["ball/pbr: bytes.nodes: 80 -> none"]);
    let mut more = kept.clone();
    more.insert(
        "box/pbr".to_owned(),
        Numbers::from([("node_visits".to_owned(), 0)]),
    );
    assert_eq!(differences(&more), ["box/pbr: node_visits: none -> 0"]);
    assert_eq!(differences(&All::new()).len(), 2);
}

#[test]
fn another_driver_is_held_to_about_the_same_work_and_the_same_buffers() {
    let kept = one_scene(100_000, 80);
    let count = |found: All| Judge::Other.differences(&kept, &found).len();
    assert_eq!(count(one_scene(101_050, 80)), 0);
    assert_eq!(count(one_scene(98_950, 80)), 0);
    assert_eq!(count(one_scene(101_051, 80)), 1);
    assert_eq!(count(one_scene(100_000, 81)), 1);
    assert_eq!(count(All::new()), 2);
}

#[test]
fn without_a_device_buffers_are_compared() {
    let mut found = one_scene(0, 80);
    found
        .get_mut("ball/pbr")
        .expect("there")
        .remove("node_visits");
    let kept = |bytes| one_scene(1000, bytes);
    assert!(Judge::Buffers.differences(&kept(80), &found).is_empty());
    assert_eq!(Judge::Buffers.differences(&kept(96), &found).len(), 1);
    assert!(bless(Judge::Buffers, &found).starts_with("not blessed"));
}
