//! A kernel with its buffers, ready to be dispatched.

use bytemuck::cast_slice;
use wgpu::{BindGroup, BufferUsages};

use crate::{
    device::{Device, DeviceError},
    error::RenderError,
    piece::{PieceCall, PieceResult},
    pipeline::{Pipeline, Resources, Workgroups, read_back, submit},
    program::{Kernel, ProgramFeatures, assemble},
    source::Limits,
    statistics::COUNTERS,
    types::{
        Aov, Frame, MEDIA, Medium, ProbeHit, ProbeRay, SRGB_CODES, SecondaryHit, SecondaryRay,
        WorkList,
    },
    upload::{GpuScene, decoded_srgb},
};

/// What a kernel is to do at once: sizes and contents of the buffers that are not the scene's.
pub(crate) struct Work {
    /// Pixels or rays.
    pub(crate) slots: u32,
    /// What a slot's share of `state` takes.
    pub(crate) slot_bytes: u64,
}

impl Work {
    /// What `state` takes.
    pub(crate) fn state_bytes(&self) -> u64 {
        u64::from(self.slots) * self.slot_bytes
    }
}

/// What kernels write and the host reads.
pub(crate) const READABLE: BufferUsages = BufferUsages::STORAGE.union(BufferUsages::COPY_SRC);

/// What a binding takes on the device, bytes.
pub(crate) fn binding_bytes(name: &str, gpu_scene: &GpuScene, work: &Work) -> u64 {
    let slots = u64::from(work.slots);
    let each = |size: usize| slots * size as u64;
    match name {
        "frame" => size_of::<Frame>() as u64,
        "media" => (MEDIA * size_of::<Medium>()) as u64,
        "decoded_srgb" => 4 * SRGB_CODES as u64,
        "state" => work.state_bytes(),
        "list_in" | "list_out" => size_of::<WorkList>() as u64,
        "queue_in" | "queue_out" => 4 * slots,
        "counters" => 4 * COUNTERS as u64,
        "aovs" => each(size_of::<Aov>()),
        "probe_rays" => each(size_of::<ProbeRay>()),
        "probe_hits" => each(size_of::<ProbeHit>()),
        "piece_arguments" => each(size_of::<PieceCall>()),
        "piece_results" => each(size_of::<PieceResult>()),
        "secondary_rays" => each(size_of::<SecondaryRay>()),
        "secondary_hits" => each(size_of::<SecondaryHit>()),
        _ => gpu_scene
            .table(name)
            .map_or(0, |table| table.device_bytes()),
    }
}

impl Resources {
    /// Adds what the binding called `name` needs, as `called`, unless it is there.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`].
    pub(crate) fn provide(
        &mut self,
        device: &Device,
        name: &str,
        called: &str,
        gpu_scene: &GpuScene,
        work: &Work,
    ) -> Result<(), RenderError> {
        if self.has(called) {
            return Ok(());
        }
        let size = binding_bytes(name, gpu_scene, work);
        match name {
            "frame" => self.reserve(device, called, size, BufferUsages::UNIFORM),
            "media" => self.upload_uniform(device, called, cast_slice(&gpu_scene.media), size),
            "decoded_srgb" => {
                self.upload_uniform(device, called, cast_slice(&decoded_srgb()), size)
            }
            "state" | "counters" | "aovs" | "probe_hits" | "piece_results" | "secondary_hits"
            | "list_in" | "list_out" | "queue_in" | "queue_out" => {
                self.reserve(device, called, size, READABLE)
            }
            "probe_rays" | "piece_arguments" | "secondary_rays" => {
                self.reserve(device, called, size, BufferUsages::STORAGE)
            }
            _ => gpu_scene
                .table(name)
                .map_or(Ok(()), |table| self.add_table(device, called, &table)),
        }
    }
}

/// A kernel with its buffers: those that its program still names, no others.
pub(crate) struct Pass {
    pipeline: Pipeline,
    resources: Resources,
    groups: Vec<BindGroup>,
}

impl Pass {
    pub(crate) fn new(
        device: &Device,
        kernel: Kernel,
        features: ProgramFeatures,
        limits: Limits,
        gpu_scene: &GpuScene,
        work: &Work,
    ) -> Result<Self, RenderError> {
        let module = assemble(kernel, features, limits)?;
        let pipeline = Pipeline::new(device, kernel, module)?;
        let mut resources = Resources::default();
        for binding in pipeline.bindings() {
            let name = binding.name.as_str();
            resources.provide(device, name, name, gpu_scene, work)?;
        }
        let groups = pipeline.bind(device, &resources, str::to_owned);
        device.check()?;
        Ok(Self {
            pipeline,
            resources,
            groups,
        })
    }

    /// Writes to the start of a buffer, before the next dispatch.
    pub(crate) fn write(&self, device: &Device, name: &str, bytes: &[u8]) {
        device
            .queue
            .write_buffer(self.resources.buffer(name), 0, bytes);
    }

    /// Dispatches, without waiting for it.
    pub(crate) fn submit(&self, device: &Device, workgroups: u32) {
        let workgroups = Workgroups::Count(workgroups);
        submit(device, |pass| {
            self.pipeline.dispatch(pass, &self.groups, workgroups);
        });
    }

    /// Waits for all dispatches, then the first `size` bytes of a buffer.
    pub(crate) fn read(
        &self,
        device: &Device,
        name: &str,
        size: u64,
    ) -> Result<Vec<u8>, DeviceError> {
        read_back(device, self.resources.buffer(name), size)
    }
}
