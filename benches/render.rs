//! Whole frames, from scene and hierarchy to film: wall time, the part of it that renders, and CPU seconds.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use std::time::Duration;

use criterion::{Criterion, Throughput, measurement::Measurement};
use raytree::{Bvh, Device, Preset, RenderSettings, Rendered, Scene};
use support::{Expected, cpu_time};

const SCENES: [&str; 3] = ["whitted-1980.glb", "cornell.glb", "cards.gltf"];
const WIDTH: u32 = 256;
const HEIGHT: u32 = 192;

/// All that a frame needs, and what it has to show.
struct Frame {
    name: &'static str,
    scene: Scene,
    bvh: Bvh,
    settings: RenderSettings,
    expected: Expected,
}

impl Frame {
    fn new(file: &'static str) -> Self {
        let scene = support::scene(file);
        let bvh =
            raytree::build_bvh(&scene, Preset::default()).unwrap_or_else(|error| panic!("{error}"));
        let settings = RenderSettings::new(WIDTH, HEIGHT, raytree::default_camera(&scene));
        let expected = Expected::new(&scene, &settings);
        Self {
            name: support::stem(file),
            scene,
            bvh,
            settings,
            expected,
        }
    }

    fn render(&self, device: &Device) -> Rendered {
        raytree_gpu::render(
            device,
            &self.scene,
            &self.bvh,
            &self.settings,
            &mut raytree::unobserved,
        )
        .unwrap_or_else(|error| panic!("{error}"))
    }
}

/// The whole of it, by whatever `criterion` measures.
fn whole<M: Measurement>(
    criterion: &mut Criterion<M>,
    group: &str,
    device: &Device,
    frames: &[Frame],
) {
    let mut group = support::group(criterion, group, 4);
    group.throughput(Throughput::Elements(u64::from(WIDTH * HEIGHT)));
    for frame in frames {
        // Dropped, and so checked, after the clock has stopped.
        group.bench_function(frame.name, |bencher| {
            bencher.iter_with_large_drop(|| Checked::new(frame, device))
        });
    }
    group.finish();
}

/// A frame that is checked when it is dropped.
struct Checked<'f>(&'f Frame, Rendered);

impl<'f> Checked<'f> {
    fn new(frame: &'f Frame, device: &Device) -> Self {
        Self(frame, frame.render(device))
    }
}

impl Drop for Checked<'_> {
    fn drop(&mut self) {
        self.0.expected.check(&self.1.film);
    }
}

/// What is left of a frame when its program stands: dispatches and reading back.
fn dispatches(criterion: &mut Criterion, device: &Device, frames: &[Frame]) {
    let mut group = support::group(criterion, "dispatch", 4);
    group.throughput(Throughput::Elements(u64::from(WIDTH * HEIGHT)));
    for frame in frames {
        group.bench_function(frame.name, |bencher| {
            bencher.iter_custom(|count| {
                let mut total = Duration::ZERO;
                for _ in 0..count {
                    let rendered = frame.render(device);
                    frame.expected.check(&rendered.film);
                    total += rendered.times.render;
                }
                total
            });
        });
    }
    group.finish();
}

fn main() {
    let device = support::device();
    let frames = SCENES.map(Frame::new);
    let mut criterion = Criterion::default().configure_from_args();
    whole(&mut criterion, "render", &device, &frames);
    dispatches(&mut criterion, &device, &frames);
    criterion.final_summary();
    if cpu_time::available_for("render-cpu") {
        let mut criterion = Criterion::default()
            .with_measurement(cpu_time::CpuTime)
            .configure_from_args();
        whole(&mut criterion, "render-cpu", &device, &frames);
        criterion.final_summary();
    }
}
