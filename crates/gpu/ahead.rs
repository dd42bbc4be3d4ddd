//! What a picture needs of the driver, begun while its hierarchy is built: its state is cleared, its pipelines are created. And
//! lavapipe compiles a kernel at its first dispatch, on the thread of the device's queue; so that the largest is compiled by then,
//! another device of the same name dispatches it before all else, and the driver's cache on disk hands the result over.

use std::{
    collections::hash_map::DefaultHasher,
    fs::File,
    hash::{Hash, Hasher},
    panic::resume_unwind,
    path::PathBuf,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread::{self, JoinHandle, ThreadId},
};

use raytree_bvh::Bvh;
use raytree_scene::model::Scene;
use wgpu::Buffer;

use crate::{
    device::{Device, DeviceInfo},
    error::RenderError,
    pass::{READABLE, Work},
    pipeline::{Pipeline, buffer_bytes, new_buffer},
    plan::{HIT_WORDS, ITEM_WORDS, Layout, Room, SLOT_WORDS, WORD_BYTES},
    program::{Kernel, ProgramFeatures, assemble},
    render::check,
    settings::{RenderSettings, Shading},
    source::{Limits, SOURCE_FILES},
    upload::GpuScene,
    wavefront::begin_compiling,
};

/// The kernel that takes longest. It knows nothing of the hierarchy, so it is the same whatever the [`Limits`] are.
const LARGEST: Kernel = Kernel::ShadeHits;

/// Pipelines that are being created, and the state for them.
#[derive(Debug)]
pub(crate) struct CreatedAhead {
    features: ProgramFeatures,
    limits: Limits,
    /// Cleared already: a processor's driver takes 40 ms for that.
    state: Option<Buffer>,
    thread: JoinHandle<Result<PicturePipelines, RenderError>>,
}

/// Those of [`Kernel::PICTURE`], in its order.
pub(crate) type PicturePipelines = [Pipeline; 3];

/// What was begun ahead.
#[derive(Debug)]
pub struct Ahead {
    /// Who does it.
    thread: Option<ThreadId>,
    /// The device on which the largest kernel is being compiled, when it has been dispatched there.
    compiling: Arc<Mutex<Option<Device>>>,
    /// The file that says that all is compiled, to be left when it is.
    mark: Option<PathBuf>,
    device: Device,
}

impl Ahead {
    /// Begins what pictures with these features need. The driver compiles if it is one that does so at the first dispatch and keeps what it
    /// has compiled, and if neither this device nor, by the mark that is left in its cache, another process has had it compiled.
    #[must_use]
    pub fn begin(device: &Device, features: ProgramFeatures, settings: &RenderSettings) -> Self {
        let compiling = Arc::default();
        let mut place = None;
        let mut mark = None;
        // If not, who renders is told; nothing is made of what may be beyond all bounds.
        let can_render = check(settings).is_ok();
        if can_render
            && compiles_when_dispatched(device.info())
            && locked(&device.compiled).insert(features)
        {
            mark = mark_of(device.info(), features);
            if !mark.as_ref().is_some_and(|mark| mark.exists()) {
                place = Some(Arc::clone(&compiling));
            }
        }
        Self {
            thread: can_render
                .then(|| begin(device, features, settings, place))
                .flatten(),
            compiling,
            mark,
            device: device.clone(),
        }
    }

    /// Waits until the thread is done, if it was not waited for where its pipelines were taken.
    fn join(&self) {
        let ours = |created: &CreatedAhead| Some(created.thread.thread().id()) == self.thread;
        if let Some(created) = take_created(&self.device, ours) {
            // A panic there has said so itself; rendering goes on without.
            let _ = created.thread.join();
        }
    }

    /// Waits until the largest kernel is compiled, and in the driver's cache.
    pub(crate) fn wait(&mut self) {
        self.join();
        let compiling = locked(&self.compiling).take();
        // The cache has been written when the device has been dropped.
        let compiled = compiling.is_some_and(|device| device.wait().is_ok());
        if !compiled {
            // It is compiled ahead again: no harm.
            self.mark = None;
        }
    }

    /// Leaves the mark, when all kernels of the picture have been dispatched.
    pub(crate) fn finish(mut self) {
        if let Some(mark) = self.mark.take() {
            drop(File::create(mark));
        }
    }
}

impl Drop for Ahead {
    /// Waits until all is done: also where there is no picture after all, since a process must not end while a thread compiles.
    fn drop(&mut self) {
        self.wait();
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Unless the hierarchy is uncommonly deep, a picture takes these. `compiling`: where to leave the device that compiles the largest kernel.
fn begin(
    device: &Device,
    features: ProgramFeatures,
    settings: &RenderSettings,
    compiling: Option<Arc<Mutex<Option<Device>>>>,
) -> Option<ThreadId> {
    let limits = Limits::for_depth(0);
    let state = begin_clearing(device, features, settings, limits);
    let on = device.clone();
    let creating = move || {
        let Some(place) = compiling else {
            return create_in_parallel(&on, features, limits);
        };
        // First: all else is done before that is compiled. That keeps one core busy, and what else there is to do another.
        match compile_largest(on.info(), features) {
            Ok(device) => *locked(&place) = Some(device),
            // Whoever renders meets it again, and reports it.
            Err(error) => tracing::debug!(%error, "compiling ahead failed"),
        }
        create_pipelines(&on, features, limits)
    };
    let name = "create ahead".to_owned();
    let thread = thread::Builder::new().name(name).spawn(creating).ok()?;
    let id = thread.thread().id();
    all_created(device).push(CreatedAhead {
        features,
        limits,
        state,
        thread,
    });
    Some(id)
}

/// The state of a picture, which a processor clears meanwhile. A GPU has no time to spare for that, but memory that is wanted elsewhere.
fn begin_clearing(
    device: &Device,
    features: ProgramFeatures,
    settings: &RenderSettings,
    limits: Limits,
) -> Option<Buffer> {
    if !device.info().cpu {
        return None;
    }
    let layout = Layout::new(settings, features, limits, Room::of(device));
    let bytes = layout.work().state_bytes();
    // Where it is refused, whoever renders meets that again.
    let state = new_buffer(device, "state", bytes, READABLE).ok()?;
    let mut encoder = device.device.create_command_encoder(&Default::default());
    encoder.clear_buffer(&state, 0, None);
    device.queue.submit([encoder.finish()]);
    Some(state)
}

/// The picture's pipelines: those that were begun ahead, if they are the same, and then its state, if it has `state_bytes`.
pub(crate) fn begun_ahead(
    device: &Device,
    features: ProgramFeatures,
    limits: Limits,
    state_bytes: u64,
) -> Result<(PicturePipelines, Option<Buffer>), RenderError> {
    let same = |created: &CreatedAhead| created.features == features && created.limits == limits;
    if let Some(created) = take_created(device, same) {
        let right = |state: &Buffer| state.size() == buffer_bytes(state_bytes);
        let state = created.state.filter(right);
        // An error may be another's on the same device: where it is not, it comes again.
        if let Ok(Ok(pipelines)) = created.thread.join() {
            return Ok((pipelines, state));
        }
    }
    Ok((create_pipelines(device, features, limits)?, None))
}

fn take_created(
    device: &Device,
    wanted: impl FnMut(&CreatedAhead) -> bool,
) -> Option<CreatedAhead> {
    let mut all = all_created(device);
    let found = all.iter().position(wanted)?;
    Some(all.swap_remove(found))
}

fn all_created(device: &Device) -> MutexGuard<'_, Vec<CreatedAhead>> {
    locked(&device.created)
}

fn create_pipelines(
    device: &Device,
    features: ProgramFeatures,
    limits: Limits,
) -> Result<PicturePipelines, RenderError> {
    let create = |kernel| create_pipeline(device, kernel, features, limits);
    let [camera_rays, trace_rays, shade_hits] = Kernel::PICTURE.map(create);
    Ok([camera_rays?, trace_rays?, shade_hits?])
}

/// The largest takes longer than the others together.
fn create_in_parallel(
    device: &Device,
    features: ProgramFeatures,
    limits: Limits,
) -> Result<PicturePipelines, RenderError> {
    let create = |kernel| create_pipeline(device, kernel, features, limits);
    let [camera_rays, trace_rays, shade_hits] = Kernel::PICTURE;
    let create_others = || (create(camera_rays), create(trace_rays));
    thread::scope(|scope| {
        let thread = thread::Builder::new().spawn_scoped(scope, create_others);
        let shade_hits = create(shade_hits);
        let (camera_rays, trace_rays) = match thread {
            Ok(thread) => thread.join().unwrap_or_else(|panic| resume_unwind(panic)),
            Err(_) => create_others(),
        };
        Ok([camera_rays?, trace_rays?, shade_hits?])
    })
}

fn create_pipeline(
    device: &Device,
    kernel: Kernel,
    features: ProgramFeatures,
    limits: Limits,
) -> Result<Pipeline, RenderError> {
    let module = assemble(kernel, features, limits)?;
    Ok(Pipeline::new(device, kernel, module)?)
}

/// .. and keeps what it has compiled.
fn compiles_when_dispatched(info: &DeviceInfo) -> bool {
    info.name.contains("llvmpipe") && !cache_is_off()
}

/// The file that says, in the driver's cache, that the kernel for these features lies there: finding out by compiling ahead takes a second
/// device and pipeline, 70 ms of a processor. Where the driver has thrown it away since, it is compiled at its dispatch.
fn mark_of(info: &DeviceInfo, features: ProgramFeatures) -> Option<PathBuf> {
    let folder = std::env::var_os("MESA_SHADER_CACHE_DIR")?;
    let mut hasher = DefaultHasher::new();
    env!("CARGO_PKG_VERSION").hash(&mut hasher);
    info.name.hash(&mut hasher);
    info.driver.hash(&mut hasher);
    features.hash(&mut hasher);
    for file in SOURCE_FILES {
        file.text.hash(&mut hasher);
    }
    Some(PathBuf::from(folder).join(format!("raytree-compiled-{:016x}", hasher.finish())))
}

/// Mesa's own switches, the newer and the older one.
fn cache_is_off() -> bool {
    ["MESA_SHADER_CACHE_DISABLE", "MESA_GLSL_CACHE_DISABLE"]
        .into_iter()
        .filter_map(|name| std::env::var(name).ok())
        .any(|value| {
            matches!(
                value.to_lowercase().as_str(),
                "1" | "true" | "t" | "yes" | "y"
            )
        })
}

/// The device that is at it.
fn compile_largest(info: &DeviceInfo, features: ProgramFeatures) -> Result<Device, RenderError> {
    let device = Device::like(info)?;
    let work = Work {
        slots: 64,
        slot_bytes: WORD_BYTES * u64::from(SLOT_WORDS + HIT_WORDS + ITEM_WORDS),
    };
    let (scene, bvh) = (Scene::default(), Bvh::default());
    let nothing = GpuScene::new(&scene, &bvh, features, Shading::default())?;
    let pipeline = create_pipeline(&device, LARGEST, features, Limits::for_depth(0))?;
    begin_compiling(&device, pipeline, (&nothing, &work))?;
    Ok(device)
}
