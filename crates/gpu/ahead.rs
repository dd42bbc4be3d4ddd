//! What a picture needs of the driver, begun while its hierarchy is built. On a thread, its pipelines are created. And lavapipe
//! compiles a kernel at its first dispatch, on the thread of the device's queue; so that the largest is compiled by then, another device
//! of the same name dispatches it first, and the driver's cache on disk hands the result over.

use std::{
    collections::hash_map::DefaultHasher,
    fs::File,
    hash::{Hash, Hasher},
    path::PathBuf,
    sync::{MutexGuard, PoisonError},
    thread::{self, JoinHandle, ThreadId},
};

use raytree_bvh::Bvh;
use raytree_scene::model::Scene;

use crate::{
    device::{Device, DeviceInfo},
    error::RenderError,
    pass::Work,
    pipeline::Pipeline,
    plan::{HIT_WORDS, ITEM_WORDS, SLOT_WORDS, WORD_BYTES},
    program::{Kernel, ProgramFeatures, assemble},
    settings::Shading,
    source::{Limits, SOURCE_FILES},
    upload::GpuScene,
    wavefront::compile,
};

/// The kernel that takes longest. It knows nothing of the hierarchy, so it is the same whatever the [`Limits`] are.
const LARGEST: Kernel = Kernel::ShadeHits;

/// Pipelines that are being created.
#[derive(Debug)]
pub(crate) struct CreatedAhead {
    features: ProgramFeatures,
    limits: Limits,
    thread: JoinHandle<Result<PicturePipelines, RenderError>>,
}

/// Those of [`Kernel::PICTURE`], in its order.
pub(crate) type PicturePipelines = [Pipeline; 3];

/// What was begun ahead.
#[derive(Debug)]
pub struct Ahead {
    /// A kernel that is being compiled.
    compiling: Option<JoinHandle<()>>,
    /// Who creates pipelines on the device.
    creating: Option<ThreadId>,
    device: Device,
}

impl Ahead {
    /// Begins what pictures with these features need. The driver compiles if it is one that does so at the first dispatch and keeps what it
    /// has compiled, and if neither this device nor, by the mark that is left in its cache, another process has had it compiled.
    #[must_use]
    pub fn begin(device: &Device, features: ProgramFeatures) -> Self {
        Self {
            creating: begin_pipelines(device, features),
            compiling: begin_compiling(device, features),
            device: device.clone(),
        }
    }
}

impl Drop for Ahead {
    /// Waits until all is done: also where there is no picture after all, since a process must not end while a thread compiles.
    fn drop(&mut self) {
        // A panic there has said so itself; rendering goes on without.
        if let Some(compiling) = self.compiling.take() {
            let _ = compiling.join();
        }
        let ours = |created: &CreatedAhead| Some(created.thread.thread().id()) == self.creating;
        if let Some(created) = take_created(&self.device, ours) {
            let _ = created.thread.join();
        }
    }
}

/// Unless the hierarchy is uncommonly deep, a picture takes these.
fn begin_pipelines(device: &Device, features: ProgramFeatures) -> Option<ThreadId> {
    let limits = Limits::for_depth(0);
    let on = device.clone();
    let creating = move || create_pipelines(&on, features, limits);
    let name = "create ahead".to_owned();
    let thread = thread::Builder::new().name(name).spawn(creating).ok()?;
    let id = thread.thread().id();
    all_created(device).push(CreatedAhead {
        features,
        limits,
        thread,
    });
    Some(id)
}

/// The picture's pipelines: those that were begun ahead, if they are the same.
pub(crate) fn picture_pipelines(
    device: &Device,
    features: ProgramFeatures,
    limits: Limits,
) -> Result<PicturePipelines, RenderError> {
    let same = |created: &CreatedAhead| created.features == features && created.limits == limits;
    if let Some(created) = take_created(device, same) {
        // An error may be another's on the same device: where it is not, it comes again.
        if let Ok(Ok(pipelines)) = created.thread.join() {
            return Ok(pipelines);
        }
    }
    create_pipelines(device, features, limits)
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
    device
        .created
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
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

fn create_pipeline(
    device: &Device,
    kernel: Kernel,
    features: ProgramFeatures,
    limits: Limits,
) -> Result<Pipeline, RenderError> {
    let module = assemble(kernel, features, limits)?;
    Ok(Pipeline::new(device, kernel, module)?)
}

fn begin_compiling(device: &Device, features: ProgramFeatures) -> Option<JoinHandle<()>> {
    if !device.info().name.contains("llvmpipe") || cache_is_off() {
        return None;
    }
    let first = device
        .compiled
        .lock()
        .is_ok_and(|mut compiled| compiled.insert(features));
    if !first {
        return None;
    }
    let info = device.info().clone();
    let mark = mark(&info, features);
    if mark.as_ref().is_some_and(|mark| mark.exists()) {
        return None;
    }
    let compiling = move || match compile_largest(&info, features) {
        // Without a mark it is compiled ahead again: no harm.
        Ok(()) => drop(mark.map(File::create)),
        // Whoever renders meets it again, and reports it.
        Err(error) => tracing::debug!(%error, "compiling ahead failed"),
    };
    let name = "compile ahead".to_owned();
    thread::Builder::new().name(name).spawn(compiling).ok()
}

/// The file that says, in the driver's cache, that the kernel for these features lies there: finding out by compiling ahead takes a second
/// device and pipeline, 70 ms of a processor. Where the driver has thrown it away since, it is compiled at its dispatch.
fn mark(info: &DeviceInfo, features: ProgramFeatures) -> Option<PathBuf> {
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

/// On a device that ends with this function, so that the driver's cache has been written then.
fn compile_largest(info: &DeviceInfo, features: ProgramFeatures) -> Result<(), RenderError> {
    let device = Device::like(info)?;
    let work = Work {
        slots: 64,
        slot_bytes: WORD_BYTES * u64::from(SLOT_WORDS + HIT_WORDS + ITEM_WORDS),
        samples: &[],
    };
    let (scene, bvh) = (Scene::default(), Bvh::default());
    let nothing = GpuScene::new(&scene, &bvh, features, Shading::default())?;
    let pipeline = create_pipeline(&device, LARGEST, features, Limits::for_depth(0))?;
    compile(&device, pipeline, (&nothing, &work))
}
