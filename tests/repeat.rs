//! The same command gives the same bytes on the same driver: again, in batches of any size, on any number of threads, as a
//! part of the picture. The judge is the renderer itself; what it must not do is differ. (By a program that could do more, too:
//! `tests/specialise.rs`.)
#![allow(clippy::print_stdout, reason = "what a test says is read by people")]

mod support;

use std::{env, fs, path::Path, process::Command};

use glam::Vec3;
use raytree::{Counters, Device, Film, Region, RenderSettings, Scene};

/// Where the child process leaves its film's words.
const CHILD_OUTPUT: &str = "RAYTREE_REPEAT_OUTPUT";

fn scene(file: &str) -> Scene {
    let mut scene = support::import(&support::root().join("assets").join(file));
    raytree::light_if_dark(&mut scene);
    scene
}

/// Two samples, all layers, counted; no multiple of a tile or a batch.
fn settings(scene: &Scene) -> RenderSettings {
    let mut settings = RenderSettings::new(99, 74, support::camera(scene));
    settings.samples = 2;
    settings.aovs = true;
    settings.counters = true;
    settings
}

/// A film's bits, layer by layer.
#[derive(Clone)]
struct Words(Vec<(&'static str, Vec<u32>)>);

impl Words {
    fn of(film: &Film) -> Self {
        let aovs = film.aovs.as_ref().expect("all layers were asked for");
        let words = |floats: &[f32]| {
            floats
                .iter()
                .map(|value| value.to_bits())
                .collect::<Vec<u32>>()
        };
        Self(vec![
            ("radiance", words(film.radiance.as_flattened())),
            ("alpha", words(&film.alpha)),
            ("depth", words(&aovs.depth)),
            ("position", words(aovs.position.as_flattened())),
            (
                "geometric normal",
                words(aovs.geometric_normal.as_flattened()),
            ),
            ("shading normal", words(aovs.shading_normal.as_flattened())),
            ("albedo", words(aovs.albedo.as_flattened())),
            ("material", aovs.material_id.clone()),
            ("node", aovs.node_id.clone()),
            ("rays", aovs.rays.clone()),
        ])
    }

    /// The part of a film of this width that `region` covers.
    fn crop(&self, width: u32, region: Region) -> Self {
        let pixels = self.0[1].1.len(); // alpha has one word a pixel
        let rows = region.y as usize..(region.y + region.height) as usize;
        Self(
            self.0
                .iter()
                .map(|(name, words)| {
                    let channels = words.len() / pixels;
                    let row = |y: usize| {
                        let start = channels * (y * width as usize + region.x as usize);
                        &words[start..start + channels * region.width as usize]
                    };
                    (*name, rows.clone().flat_map(row).copied().collect())
                })
                .collect(),
        )
    }

    fn write(&self, path: &Path) {
        let all: Vec<u32> = self
            .0
            .iter()
            .flat_map(|(_, words)| words)
            .copied()
            .collect();
        fs::write(path, bytemuck::cast_slice(&all)).expect("a writable folder");
    }

    /// A film of the same size, as [`Self::write`] left it.
    fn read_alike(&self, path: &Path) -> Self {
        let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let all: Vec<u32> = bytes
            .as_chunks()
            .0
            .iter()
            .map(|word| u32::from_ne_bytes(*word))
            .collect();
        let mut rest = all.as_slice();
        let mut take = |count: usize| {
            let (taken, left) = rest
                .split_at_checked(count)
                .expect("a film of the same size");
            rest = left;
            taken.to_vec()
        };
        let read = Self(
            self.0
                .iter()
                .map(|(name, words)| (*name, take(words.len())))
                .collect(),
        );
        assert!(rest.is_empty(), "the child's film is larger");
        read
    }

    /// Which layers differ in how many words, and by how much as floats; `None` if they are the same, bit for bit.
    fn difference(&self, other: &Self) -> Option<String> {
        let mut found = Vec::new();
        for ((name, ours), (_, theirs)) in self.0.iter().zip(&other.0) {
            let differing = || ours.iter().zip(theirs).filter(|(a, b)| a != b);
            if ours.len() != theirs.len() {
                found.push(format!(
                    "{name}: {} words, not {}",
                    theirs.len(),
                    ours.len()
                ));
            } else if let count @ 1.. = differing().count() {
                let by = |(a, b): (&u32, &u32)| (f32::from_bits(*a) - f32::from_bits(*b)).abs();
                let most = differing().map(by).fold(0.0, f32::max);
                found.push(format!(
                    "{name}: {count} of {} words differ, as floats by up to {most:e}",
                    ours.len()
                ));
            }
        }
        (!found.is_empty()).then(|| found.join("; "))
    }
}

fn assert_same(what: &str, expected: &Words, actual: &Words) {
    if let Some(difference) = expected.difference(actual) {
        panic!("{what}: {difference}");
    }
}

fn render(device: &Device, scene: &Scene, settings: &RenderSettings) -> (Words, Counters) {
    let rendering = support::render(device, scene, settings);
    (
        Words::of(&rendering.film),
        rendering.counters.expect("they were asked for"),
    )
}

#[test]
fn again_and_in_batches_of_any_size() {
    let Some(device) = support::device() else {
        return;
    };
    let scene = scene("everything.glb");
    let settings = settings(&scene);
    let (expected, counters) = render(device, &scene, &settings);
    for _ in 1..5 {
        let (again, counted) = render(device, &scene, &settings);
        assert_same("again", &expected, &again);
        assert_eq!(counters, counted);
    }
    for batch_pixels in [64, 1000, 1 << 17] {
        let (batched, counted) = render(
            device,
            &scene,
            &RenderSettings {
                batch_pixels: Some(batch_pixels),
                ..settings.clone()
            },
        );
        assert_same(&format!("batches of {batch_pixels}"), &expected, &batched);
        assert_eq!(counters, counted, "batches of {batch_pixels}");
    }
}

#[test]
fn on_any_number_of_threads() {
    let Some(device) = support::device() else {
        return;
    };
    let scene = scene("everything.glb");
    let (expected, _) = render(device, &scene, &settings(&scene));
    let folder = tempfile::tempdir().unwrap();
    for threads in ["0", "1", "2", "5"] {
        let output = folder.path().join(threads);
        let child = Command::new(env::current_exe().unwrap())
            .args([
                "--exact",
                "in_a_process_of_its_own",
                "--ignored",
                "--nocapture",
            ])
            // lavapipe's workers; the machine's cores if it is not said.
            .env("LP_NUM_THREADS", threads)
            .env(CHILD_OUTPUT, &output)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&child.stdout);
        assert!(
            child.status.success(),
            "{threads} threads: {said}{}",
            String::from_utf8_lossy(&child.stderr)
        );
        assert_same(
            &format!("{threads} threads"),
            &expected,
            &expected.read_alike(&output),
        );
    }
}

/// The other half of [`on_any_number_of_threads`]: the driver reads its environment once a process.
#[test]
#[ignore = "started by on_any_number_of_threads"]
fn in_a_process_of_its_own() {
    let Some(output) = env::var_os(CHILD_OUTPUT) else {
        return;
    };
    let device = support::device().expect("the parent has one");
    let scene = scene("everything.glb");
    let (words, _) = render(device, &scene, &settings(&scene));
    words.write(Path::new(&output));
}

#[test]
fn a_region_is_a_part_of_the_whole() {
    let Some(device) = support::device() else {
        return;
    };
    let scene = scene("everything.glb");
    let whole = settings(&scene);
    let (expected, _) = render(device, &scene, &whole);
    for (x, y, width, height) in [
        (0, 0, 99, 1),
        (13, 7, 41, 29),
        (98, 73, 1, 1),
        (50, 40, 49, 34),
    ] {
        let region = Region {
            x,
            y,
            width,
            height,
        };
        let (part, _) = render(
            device,
            &scene,
            &RenderSettings {
                region: Some(region),
                ..whole.clone()
            },
        );
        assert_same(
            &format!("{region:?}"),
            &expected.crop(whole.width, region),
            &part,
        );
    }
}

/// The ray stack is sized by the maximum depth: it must never be what ends a branch.
#[test]
fn the_ray_stack_holds_at_any_depth() {
    let Some(device) = support::device() else {
        return;
    };
    for file in ["facing-mirrors.glb", "glass-in-water.glb", "everything.glb"] {
        let scene = scene(file);
        let mut settings = RenderSettings::new(40, 30, support::camera(&scene));
        settings.counters = true;
        let mut secondary = Vec::new();
        for max_depth in [0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64] {
            settings.max_depth = max_depth;
            let counters = support::render(device, &scene, &settings).counters.unwrap();
            assert_eq!(
                counters.ended.storage, 0,
                "{file} at depth {max_depth}: {counters:?}"
            );
            secondary.push(counters.rays.reflection + counters.rays.refraction);
        }
        assert_eq!(secondary[0], 0, "{file}");
        assert!(
            secondary.is_sorted() && secondary[12] > secondary[2],
            "{file}: {secondary:?} rays"
        );
    }
}

/// A film that differs in one bit is not the same.
#[test]
fn a_bit_is_noticed() {
    let mut film = Film::new(8, 4);
    film.aovs = Some(raytree_film::Aovs::missed(32));
    let words = Words::of(&film);
    assert!(words.difference(&words.clone()).is_none());
    for layer in 0..words.0.len() {
        let mut other = words.clone();
        *other.0[layer].1.last_mut().unwrap() ^= 1;
        let difference = words.difference(&other).unwrap();
        assert!(difference.starts_with(words.0[layer].0), "{difference}");
    }
    let region = |width| Region {
        x: 0,
        y: 1,
        width,
        height: 2,
    };
    assert!(
        words
            .crop(8, region(4))
            .difference(&words.crop(8, region(5)))
            .is_some()
    );
}

/// The counter of branches that ended for lack of storage does count: ten more spheres of glass inside the sphere in the
/// water are more media than a ray can remember.
#[test]
fn more_nested_media_than_a_ray_remembers_are_counted() {
    let Some(device) = support::device() else {
        return;
    };
    let mut scene = scene("glass-in-water.glb");
    nest(&mut scene, "glass sphere", 10);
    let mut settings = RenderSettings::new(100, 75, support::camera(&scene));
    settings.counters = true;
    settings.max_depth = 16;
    let counters = support::render(device, &scene, &settings).counters.unwrap();
    assert!(counters.ended.storage > 0, "{counters:?}");
}

/// Puts `count` smaller copies of a node's mesh into it, each inside the one before.
fn nest(scene: &mut Scene, node: &str, count: i32) {
    let node = scene
        .nodes
        .iter()
        .position(|name| name == node)
        .expect("a node of this name") as u32;
    let geometry = &mut scene.geometry;
    let shell: Vec<_> = geometry
        .triangles
        .iter()
        .copied()
        .filter(|triangle| triangle.node == node)
        .collect();
    let corners = || shell.iter().flat_map(|triangle| triangle.vertices);
    let sum: Vec3 = corners()
        .map(|vertex| geometry.positions[vertex as usize])
        .sum();
    let middle = sum / (3 * shell.len()) as f32;
    for copy in 1..=count {
        let size = 0.9_f32.powi(copy);
        for triangle in &shell {
            let first = geometry.positions.len() as u32;
            for vertex in triangle.vertices.map(|vertex| vertex as usize) {
                geometry
                    .positions
                    .push(middle + size * (geometry.positions[vertex] - middle));
                geometry.normals.push(geometry.normals[vertex]);
                geometry
                    .uv_sets
                    .iter_mut()
                    .for_each(|set| set.push(set[vertex]));
            }
            geometry.triangles.push(raytree::model::Triangle {
                vertices: [first, first + 1, first + 2],
                ..*triangle
            });
        }
    }
}
