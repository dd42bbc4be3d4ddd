//! Compiling ahead: lavapipe compiles a kernel at its first dispatch, on the thread of the device's queue. So that the largest
//! kernel is compiled while hierarchy, buffers and the other kernels are made, another device of the same name dispatches it
//! first; the driver's cache on disk hands the result over.

use std::thread::{self, JoinHandle};

use raytree_bvh::Bvh;
use raytree_scene::model::Scene;

use crate::{
    device::{Device, DeviceInfo},
    error::RenderError,
    pass::Work,
    plan::{ITEM_WORDS, SLOT_WORDS, WORD_BYTES},
    program::{Kernel, ProgramFeatures},
    settings::Shading,
    source::Limits,
    upload::GpuScene,
    wavefront::compile,
};

/// The kernel that takes longest. It knows nothing of the hierarchy, so it is the same whatever the [`Limits`] are.
const LARGEST: Kernel = Kernel::ShadeHits;

/// A kernel that is being compiled.
#[derive(Debug)]
pub struct Ahead(Option<JoinHandle<()>>);

impl Ahead {
    /// Begins to compile what pictures with these features need, if the driver is one that compiles so and keeps what it has
    /// compiled, and if this device has not yet asked for it.
    #[must_use]
    pub fn begin(device: &Device, features: ProgramFeatures) -> Self {
        if !device.info().name.contains("llvmpipe") || cache_is_off() {
            return Self(None);
        }
        let first = device
            .compiled
            .lock()
            .is_ok_and(|mut compiled| compiled.insert(features));
        if !first {
            return Self(None);
        }
        let info = device.info().clone();
        let compiling = move || {
            if let Err(error) = compile_largest(&info, features) {
                // Whoever renders meets it again, and reports it.
                tracing::debug!(%error, "compiling ahead failed");
            }
        };
        let name = "compile ahead".to_owned();
        Self(thread::Builder::new().name(name).spawn(compiling).ok())
    }
}

impl Drop for Ahead {
    /// Waits until it is done: also where there is no picture after all, since a process must not end while a thread compiles.
    fn drop(&mut self) {
        if let Some(thread) = self.0.take() {
            // A panic there has said so itself; rendering goes on without.
            let _ = thread.join();
        }
    }
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
        slot_bytes: WORD_BYTES * u64::from(SLOT_WORDS + ITEM_WORDS),
        samples: &[],
    };
    let (scene, bvh) = (Scene::default(), Bvh::default());
    let nothing = GpuScene::new(&scene, &bvh, features, Shading::default())?;
    let given = (&nothing, &work);
    compile(&device, LARGEST, features, Limits::for_depth(0), given)
}
