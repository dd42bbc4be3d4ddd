//! Compiling ahead: lavapipe compiles a kernel at its first dispatch, on the thread of the device's queue. So that the largest
//! kernel is compiled while hierarchy, buffers and the other kernels are made, another device of the same adapter dispatches it
//! first; the driver's cache on disk hands the result over.

use std::thread::{self, JoinHandle};

use crate::{
    device::Device,
    error::RenderError,
    pass::{ITEM_BYTES, Work},
    program::{Kernel, ProgramFeatures},
    render::STACK_PLANE,
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
    /// Begins to compile what pictures with these features need, if the driver is one that compiles so, and keeps what it has
    /// compiled.
    #[must_use]
    pub fn begin(device: &Device, features: ProgramFeatures) -> Self {
        if !device.info().name.contains("llvmpipe") || cache_is_off() {
            return Self(None);
        }
        let Ok(twin) = device.twin() else {
            return Self(None);
        };
        let compiling = move || {
            if let Err(error) = compile_largest(&twin, features) {
                // Whoever renders meets it again, and reports it.
                tracing::debug!(%error, "compiling ahead failed");
            }
        };
        let name = "compile ahead".to_owned();
        Self(thread::Builder::new().name(name).spawn(compiling).ok())
    }

    /// Nothing is compiled ahead.
    #[must_use]
    pub fn nothing() -> Self {
        Self(None)
    }

    /// Waits until it is done.
    pub(crate) fn wait(self) {
        if let Some(thread) = self.0 {
            // A panic there has said so itself; rendering goes on without.
            let _ = thread.join();
        }
    }
}

/// Mesa's own switch.
fn cache_is_off() -> bool {
    std::env::var("MESA_SHADER_CACHE_DISABLE")
        .is_ok_and(|value| matches!(value.to_lowercase().as_str(), "1" | "true" | "yes" | "y"))
}

fn compile_largest(device: &Device, features: ProgramFeatures) -> Result<(), RenderError> {
    let work = Work {
        slots: 64,
        slot_bytes: ITEM_BYTES + 16 * u64::from(STACK_PLANE),
        samples: &[],
    };
    let given = (&GpuScene::default(), &work);
    compile(device, LARGEST, features, Limits::for_depth(0), given)
}
