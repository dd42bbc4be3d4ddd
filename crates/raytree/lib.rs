//! Renders glTF scenes by a deterministic, noise-free Whitted ray tree on any Vulkan device, by default the CPU.
//!
//! Scene in, picture out:
//!
//! ```no_run
//! use std::path::Path;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut scene = raytree::import(Path::new("assets/whitted-1980.glb"))?;
//! raytree::light_if_dark(&mut scene);
//! let camera = raytree::default_camera(&scene);
//! let (width, height) = raytree::default_size(&camera);
//! let device = raytree::Device::open(&raytree::DeviceChoice::default())?;
//! let settings = raytree::RenderSettings::new(width, height, camera);
//! let picture = raytree::render(&device, &scene, raytree::Preset::default(), &settings, &mut raytree::unobserved)?;
//! picture.film.write(Path::new("picture.png"), &raytree::WriteOptions::default())?;
//! # Ok(())
//! # }
//! ```
//!
//! This crate is a facade: what it exports lives in the rooms behind it, `scene`, `bvh`, `film` and `gpu`. It prints
//! nothing, never ends the process, and reports what is wrong with files, settings and devices as errors.

mod opening;

use std::{
    ops::ControlFlow,
    path::Path,
    time::{Duration, Instant},
};

use glam::Vec3;

pub use opening::Opening;
pub use raytree_bvh::{Bvh, BvhError, Preset};
pub use raytree_film::{
    BitDepth, BrokenLimit, CompareError, CompareOptions, Comparison, Film, FilmError, Format,
    Limits, Picture, ToneMap, WriteOptions, compare, difference_picture, sample_pattern,
    srgb_decode, write_whole,
};
pub use raytree_gpu::{
    Ahead, BufferCost, Cost, Counters, Device, DeviceChoice, DeviceError, DeviceInfo, Dropped,
    ErrorReport, Feature, Kernel, Numerics, Prepared, ProgramFeatures, Progress, Region,
    RenderError, RenderSettings, RenderTimes, Rendered, Shading, Tolerance, build_bvh, cost,
    list_devices,
};
use raytree_gpu::{assemble_ahead, render_ahead};
pub use raytree_scene::{
    default_view::{ViewError, default_size, frame_scene, look_at},
    environment::{Environment, EnvironmentError, load_environment},
    features::SceneFeatures,
    import::{
        ImportError, ImportOptions, Sharing, import as import_unsimplified,
        import_with as import_unsimplified_with,
    },
    instances::{RepeatedMesh, WhyCopied},
    model,
    model::{Background, Camera, Scene},
    simplify::simplify,
    studio::add_studio,
};

/// A rendered scene: the film, what it took, and where the time went.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The picture, linear.
    pub film: Film,
    /// Rays and work, if the settings ask for them.
    pub counters: Option<Counters>,
    /// What the picture lacks.
    pub dropped: Dropped,
    /// What the program contained.
    pub features: ProgramFeatures,
    /// Time to build the hierarchy.
    pub bvh_time: Duration,
    /// Time for which the device was waited for, after that.
    pub device_time: Duration,
    /// Time in the device's hands.
    pub times: RenderTimes,
    /// Iterations of tracing and shading that rendered.
    pub iterations: u32,
    /// What was achieved of the settings' tolerance, if they have one.
    pub error: Option<ErrorReport>,
}

impl Rendering {
    fn of(rendered: Rendered, bvh_time: Duration, device_time: Duration) -> Self {
        let Rendered {
            film,
            counters,
            dropped,
            features,
            times,
            iterations,
            error,
        } = rendered;
        Self {
            film,
            counters,
            dropped,
            features,
            bvh_time,
            device_time,
            times,
            iterations,
            error,
        }
    }
}

/// Reads the default scene of a glTF file, `.gltf` or `.glb`, without what can't show ([`simplify`]): so it takes the smallest
/// program and the fewest bytes. [`import_unsimplified`] is for who wants to see what the file says.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path) -> Result<Scene, ImportError> {
    import_with(path, &ImportOptions::default())
}

/// [`import`] with limits of the caller's choice, and with a say in whether nodes share the memory of their mesh.
///
/// # Errors
/// [`ImportError`].
pub fn import_with(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let mut scene = import_unsimplified_with(path, options)?;
    simplify(&mut scene);
    Ok(scene)
}

/// An observer that lets a render run to its end.
pub fn unobserved(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Renders a picture of a scene: builds its hierarchy, makes the program that it needs, walks its ray trees. `observer`
/// hears of progress and can end it.
///
/// # Errors
/// [`RenderError`].
pub fn render(
    device: &Device,
    scene: &Scene,
    preset: Preset,
    settings: &RenderSettings,
    observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Rendering, RenderError> {
    let features = ProgramFeatures::of(&SceneFeatures::of(scene), settings);
    render_with_features(device, scene, preset, settings, features, observer)
}

/// As [`render`], with the features that [`assemble_for`] has found.
///
/// # Errors
/// [`RenderError`].
pub fn render_with_features(
    device: &Device,
    scene: &Scene,
    preset: Preset,
    settings: &RenderSettings,
    features: ProgramFeatures,
    observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Rendering, RenderError> {
    let ahead = Ahead::begin(device, features, settings);
    let (built, bvh_time) = timed(|| build_bvh(scene, preset));
    let prepared = (features, ahead);
    let rendered = render_ahead(device, scene, &built?, settings, prepared, observer)?;
    Ok(Rendering::of(rendered, bvh_time, Duration::ZERO))
}

/// As [`render_with_features`], by a device that may still be opening: the hierarchy is built meanwhile. Also the device.
///
/// # Errors
/// [`RenderError`].
pub fn render_when_open(
    mut opening: Opening,
    scene: &Scene,
    preset: Preset,
    settings: &RenderSettings,
    features: ProgramFeatures,
    observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<(Device, Rendering), RenderError> {
    opening.prepare(features, settings)?;
    let (built, bvh_time) = timed(|| build_bvh(scene, preset));
    let bvh = built?;
    let (opened, device_time) = timed(|| opening.wait());
    let (device, ahead) = opened?;
    let ahead = ahead.unwrap_or_else(|| Ahead::begin(&device, features, settings));
    let prepared = (features, ahead);
    let rendered = render_ahead(&device, scene, &bvh, settings, prepared, observer)?;
    Ok((device, Rendering::of(rendered, bvh_time, device_time)))
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let started = Instant::now();
    (work(), started.elapsed())
}

/// What the picture's program will have. It is assembled already, which needs no device: worth it while one opens.
#[must_use]
pub fn assemble_for(scene: &Scene, settings: &RenderSettings) -> ProgramFeatures {
    let features = ProgramFeatures::of(&SceneFeatures::of(scene), settings);
    assemble_ahead(features);
    features
}

/// Gives a scene without lights, environment and ambient light the built-in studio: a neutral environment and a key light that
/// casts shadows; whether it did. Emissive surfaces do not count as lights: they shine, but light nothing.
pub fn light_if_dark(scene: &mut Scene) -> bool {
    let surroundings = &scene.surroundings;
    let dark = scene.lights.is_empty()
        && surroundings.environment.is_none()
        && surroundings.ambient == Vec3::ZERO;
    if dark {
        add_studio(scene);
    }
    dark
}

/// The file's first camera; without one, a view of the whole scene, three-quarter from above.
#[must_use]
pub fn default_camera(scene: &Scene) -> Camera {
    scene
        .cameras
        .first()
        .cloned()
        .unwrap_or_else(|| framing_camera(scene, 4.0 / 3.0))
}

/// A view of the whole scene, three-quarter from above, for pictures of this aspect (width over height).
#[must_use]
pub fn framing_camera(scene: &Scene, aspect: f64) -> Camera {
    let (min, max) = scene.bounds().unwrap_or_default();
    frame_scene(min, max, aspect)
}
