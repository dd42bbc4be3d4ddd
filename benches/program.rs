//! Making programs: parsing the shaders, specialising them for a scene, and what the device does before the first ray.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use std::time::Duration;

use criterion::Criterion;
use raytree::{
    Device, Feature, Preset, ProgramFeatures, Region, RenderSettings, RenderTimes, Scene,
    SceneFeatures,
};
use raytree_gpu::{
    Kernel, assemble, bindings_of,
    source::{Limits, parse},
};

/// A scene whose program is small, and one whose program has nearly everything.
const SCENES: [&str; 2] = ["cornell.glb", "everything.glb"];

/// A scene, and settings for a picture that costs next to nothing.
struct Subject {
    name: &'static str,
    scene: Scene,
    settings: RenderSettings,
}

impl Subject {
    fn new(file: &'static str) -> Self {
        let scene = support::scene(file);
        let mut settings = RenderSettings::new(256, 192, raytree::default_camera(&scene));
        settings.region = Some(Region {
            x: 128,
            y: 96,
            width: 8,
            height: 8,
        });
        Self {
            name: support::stem(file),
            scene,
            settings,
        }
    }

    fn features(&self) -> ProgramFeatures {
        ProgramFeatures::of(&SceneFeatures::of(&self.scene), &self.settings)
    }
}

fn without_device(criterion: &mut Criterion, subjects: &[Subject]) {
    let limits = Limits::for_depth(16);
    let mut group = support::group(criterion, "program", 2);
    group.bench_function("parse", |bencher| {
        bencher.iter(|| {
            let module = parse(limits).unwrap_or_else(|error| panic!("{error}"));
            assert!(module.entry_points.len() >= 3, "kernels are missing");
            module
        });
    });
    for subject in subjects {
        let features = subject.features();
        let mut programs = Vec::new();
        group.bench_function(format!("assemble/{}", subject.name), |bencher| {
            bencher.iter(|| {
                programs = Kernel::PICTURE
                    .map(|kernel| {
                        assemble(kernel, features, limits).unwrap_or_else(|error| panic!("{error}"))
                    })
                    .to_vec();
            });
        });
        if !programs.is_empty() {
            let bindings: Vec<_> = programs.iter().flat_map(bindings_of).collect();
            let has = |name: &str| bindings.iter().any(|binding| binding.name == name);
            assert!(
                has("frame") && has("state") && has("lights"),
                "{bindings:?}"
            );
            let textured = features.has(Feature::Textures);
            assert_eq!(has("texels"), textured, "{}: {bindings:?}", subject.name);
        }
    }
    group.finish();
}

/// A name, and which time it is.
type Part = (&'static str, fn(&RenderTimes) -> Duration);

/// The parts of a tiny picture that a renderer reports: `create` is assembly, pipeline creation and upload, `first-dispatch`
/// the driver's compiler, or its cache.
fn on_device(criterion: &mut Criterion, device: &Device, subjects: &[Subject]) {
    let parts: [Part; 2] = [
        ("create", |times| times.program),
        ("first-dispatch", |times| times.compile),
    ];
    let mut group = support::group(criterion, "program", 2);
    for (part, time) in parts {
        for Subject {
            name,
            scene,
            settings,
        } in subjects
        {
            let bvh = raytree::build_bvh(scene, Preset::default())
                .unwrap_or_else(|error| panic!("{error}"));
            group.bench_function(format!("{part}/{name}"), |bencher| {
                bencher.iter_custom(|count| {
                    let mut total = Duration::ZERO;
                    for _ in 0..count {
                        let rendered = raytree_gpu::render(
                            device,
                            scene,
                            &bvh,
                            settings,
                            &mut raytree::unobserved,
                        )
                        .unwrap_or_else(|error| panic!("{error}"));
                        assert!(
                            rendered.film.radiance.iter().any(|rgb| rgb[1] > 0.0),
                            "{name} is black"
                        );
                        total += time(&rendered.times);
                    }
                    total
                });
            });
        }
    }
    group.finish();
}

fn main() {
    let subjects = SCENES.map(Subject::new);
    let mut criterion = Criterion::default().configure_from_args();
    without_device(&mut criterion, &subjects);
    on_device(&mut criterion, &support::device(), &subjects);
    criterion.final_summary();
}
