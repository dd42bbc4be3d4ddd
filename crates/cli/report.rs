//! What a render was asked for, what it did and what it took, as one JSON object.

use std::path::{Path, PathBuf};
use std::time::Duration;

use raytree::model::{Frame, Surroundings, Warning};
use raytree::{
    Background, Counters, DeviceInfo, Dropped, ErrorReport, Kernel, RenderSettings, Rendering,
    Scene, Tolerance,
};
use serde_json::{Value, json};

use crate::args::{BitsChoice, LightingArgs, RenderArgs, spelled};
use crate::describe;

/// How much the file holds; what the program adds to it does not count.
#[derive(Clone, Copy, Debug)]
pub struct Contents {
    pub triangles: usize,
    pub materials: usize,
    pub textures: usize,
    pub lights: usize,
}

impl Contents {
    pub fn of(scene: &Scene) -> Self {
        Self {
            triangles: scene.placed_triangles() as usize,
            materials: scene.materials.len(),
            textures: scene.textures.len(),
            lights: scene.lights.len(),
        }
    }
}

/// What the library does not time itself.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    /// Scene and environment into memory.
    pub import: Duration,
    /// What the scene needs, and its kernels from the shaders' text.
    pub assemble: Duration,
    /// Pictures into files.
    pub write: Duration,
    /// All of it, opening the device included.
    pub total: Duration,
}

/// A finished render.
pub struct Report<'a> {
    pub args: &'a RenderArgs,
    pub contents: Contents,
    pub warnings: &'a [Warning],
    pub surroundings: &'a Surroundings,
    pub frame: Frame,
    /// Lit by the built-in studio.
    pub studio: bool,
    pub device: &'a DeviceInfo,
    pub settings: &'a RenderSettings,
    pub rendering: &'a Rendering,
    pub outputs: &'a [PathBuf],
    pub times: Times,
}

impl Report<'_> {
    /// The object that `--json` prints.
    pub fn json(&self) -> Value {
        let Contents {
            triangles,
            materials,
            textures,
            lights,
        } = self.contents;
        let (used, left_out) = self.rendering.features.labels();
        let outputs: Vec<String> = self.outputs.iter().map(|path| text(path)).collect();
        let warnings: Vec<String> = self.warnings.iter().map(Warning::to_string).collect();
        json!({
            "scene": {
                "file": text(&self.args.scene),
                "triangles": triangles,
                "materials": materials,
                "textures": textures,
                "lights": lights,
            },
            "device": { "name": self.device.name, "driver": self.device.driver },
            "settings": self.settings_json(),
            "features": { "used": used, "left_out": left_out },
            "time_ms": self.times_json(),
            "compile_ms": self.compile_json(),
            "counters": self.rendering.counters.as_ref().map(counters_json),
            "dropped": dropped_json(self.rendering.dropped),
            "error": self.rendering.error.as_ref().map(error_json),
            "outputs": outputs,
            "warnings": warnings,
        })
    }

    fn settings_json(&self) -> Value {
        let (args, settings) = (self.args, self.settings);
        let region = settings.visible_region();
        json!({
            "width": settings.width,
            "height": settings.height,
            "region": [region.x, region.y, region.width, region.height],
            "camera": describe::camera_json(&settings.camera, &self.frame),
            "depth": settings.max_depth,
            "spp": settings.samples,
            "min_weight": number(settings.min_weight),
            "tolerance": args.quality.tolerance.map(tolerance_json),
            "time_budget_ms": args.quality.time_budget.map(milliseconds),
            "max_rays": settings.max_rays,
            "shading": spelled(args.quality.shading),
            "ambient": describe::color_json(self.surroundings.ambient),
            "environment": environment_json(&args.lighting, self.studio),
            "background": background_json(self.surroundings.background),
            "exposure": args.output.exposure,
            "tonemap": spelled(args.output.tonemap),
            "png_bits": settings_bits(args),
            "device": args.quality.device,
            "bvh": spelled(args.quality.bvh),
            "batch": settings.batch_pixels,
            "layers": settings.aovs,
            "counters": settings.counters,
        })
    }

    /// What everything took, in the order in which it was done; they add up to the total.
    pub fn stages(&self) -> Vec<(&'static str, Duration)> {
        let (times, rendering) = (self.times, self.rendering.times);
        let mut stages = vec![
            ("import", times.import),
            ("assemble", times.assemble),
            ("bvh", self.rendering.bvh_time),
            ("device", self.rendering.device_time),
            ("layout", rendering.layout),
            ("program", rendering.program),
            ("compile", rendering.compile),
            ("render", rendering.render),
            ("write", times.write),
        ];
        let known: Duration = stages.iter().map(|(_, time)| *time).sum();
        stages.push(("other", times.total.saturating_sub(known)));
        stages
    }

    fn times_json(&self) -> Value {
        let total = ("total", self.times.total);
        let stages = self.stages().into_iter().chain([total]);
        stages
            .map(|(name, time)| (name, milliseconds(time)))
            .collect()
    }

    fn compile_json(&self) -> Value {
        let kernels = Kernel::PICTURE.iter().zip(self.rendering.times.kernels);
        kernels
            .map(|(kernel, time)| (kernel.name(), milliseconds(time)))
            .collect()
    }
}

fn environment_json(args: &LightingArgs, studio: bool) -> Value {
    match &args.env {
        Some(file) => json!({
            "file": text(file),
            "rotation": args.env_rotation,
            "strength": args.env_strength,
        }),
        None if studio => json!("studio"),
        None => Value::Null,
    }
}

fn background_json(background: Background) -> Value {
    match background {
        Background::Environment => json!("env"),
        Background::Transparent => json!("transparent"),
        Background::Color(color) => describe::color_json(color),
    }
}

fn settings_bits(args: &RenderArgs) -> u32 {
    match args.output.png_bits {
        BitsChoice::Eight => 8,
        BitsChoice::Sixteen => 16,
    }
}

fn counters_json(counters: &Counters) -> Value {
    let Counters { rays, ended, .. } = counters;
    json!({
        "rays": {
            "primary": rays.primary,
            "shadow": rays.shadow,
            "reflection": rays.reflection,
            "refraction": rays.refraction,
        },
        "node_visits": counters.node_visits,
        "triangle_tests": counters.triangle_tests,
        "ended": {
            "miss": ended.miss,
            "depth": ended.depth,
            "weight": ended.weight,
            "tolerance": ended.tolerance,
            "storage": ended.storage,
            "budget": ended.budget,
        },
    })
}

fn dropped_json(dropped: Dropped) -> Value {
    json!({ "storage": dropped.storage, "budget": dropped.budget })
}

fn tolerance_json(tolerance: Tolerance) -> Value {
    json!({ "absolute": number(tolerance.absolute), "relative": number(tolerance.relative) })
}

/// What was achieved, beside what was asked for.
fn error_json(error: &ErrorReport) -> Value {
    json!({
        "estimated_rmse": error.estimated_rmse,
        "dropped_rmse": error.lost_rmse,
        "dropped_bound_rmse": error.lost_bound_rmse,
        "sampling_rmse": error.sampling_rmse,
        "largest": error.largest,
        "samples": error.samples,
        "most_samples": error.most_samples,
        "in_tolerances": error.in_tolerances,
        "keeps_tolerance": error.keeps_tolerance(),
        "unsampled_pixels": error.unsampled,
    })
}

/// With the digits that the user wrote, not those of the nearest f32.
fn number(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// JSON has no other bytes than UTF-8.
fn text(path: &Path) -> String {
    path.display().to_string()
}

/// To the microsecond.
pub fn milliseconds(duration: Duration) -> f64 {
    duration.as_micros() as f64 / 1e3
}
