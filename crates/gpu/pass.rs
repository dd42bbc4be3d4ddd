//! A kernel with its buffers, ready to be dispatched.

use bytemuck::cast_slice;
use wgpu::{BindGroup, BufferUsages, CommandEncoderDescriptor};

use crate::{
    device::{Device, DeviceError},
    error::RenderError,
    piece::{PieceCall, PieceResult},
    pipeline::{Buffers, Pipeline, read_back},
    program::{Kernel, ProgramFeatures, assemble},
    source::Limits,
    statistics::COUNTERS,
    types::{
        Aov, Frame, MAX_SAMPLES, MEDIA, Medium, ProbeHit, ProbeRay, SecondaryHit, SecondaryRay,
        Slot,
    },
    upload::GpuScene,
};

/// A work item on the ray stack (`shaders/ray_stack.wgsl`).
pub(crate) const ITEM_BYTES: u64 = 64;

/// What a kernel is to do at once: sizes and contents of the buffers that are not the scene's.
pub(crate) struct Work<'a> {
    /// Pixels or rays.
    pub(crate) slots: u32,
    /// What a slot's share of the ray stack takes.
    pub(crate) slot_bytes: u64,
    /// Offsets from the middle of a pixel.
    pub(crate) samples: &'a [[f32; 2]],
}

/// A kernel with its buffers: those that its program still names, no others.
pub(crate) struct Pass {
    pipeline: Pipeline,
    buffers: Buffers,
    groups: Vec<BindGroup>,
}

impl Pass {
    pub(crate) fn new(
        device: &Device,
        kernel: Kernel,
        features: ProgramFeatures,
        limits: Limits,
        gpu_scene: &GpuScene,
        work: &Work<'_>,
    ) -> Result<Self, RenderError> {
        let module = assemble(kernel, features, limits)?;
        let pipeline = Pipeline::new(device, kernel, module)?;
        let slots = u64::from(work.slots);
        let readable = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let mut buffers = Buffers::default();
        for binding in pipeline.bindings() {
            let name = binding.name.as_str();
            match name {
                "frame" => buffers.reserve(
                    device,
                    name,
                    size_of::<Frame>() as u64,
                    BufferUsages::UNIFORM,
                )?,
                "samples" => {
                    buffers.upload_uniform(
                        device,
                        name,
                        cast_slice(work.samples),
                        u64::from(MAX_SAMPLES) * 8,
                    )?;
                }
                "media" => {
                    buffers.upload_uniform(
                        device,
                        name,
                        cast_slice(&gpu_scene.media),
                        (MEDIA * size_of::<Medium>()) as u64,
                    )?;
                }
                "slots" => {
                    buffers.reserve(device, name, slots * size_of::<Slot>() as u64, readable)?
                }
                "ray_stack" => {
                    buffers.reserve(
                        device,
                        name,
                        slots * work.slot_bytes,
                        BufferUsages::STORAGE,
                    )?;
                }
                "counters" => buffers.reserve(device, name, 4 * COUNTERS as u64, readable)?,
                "aovs" => {
                    buffers.reserve(device, name, slots * size_of::<Aov>() as u64, readable)?
                }
                "probe_rays" => {
                    buffers.reserve(
                        device,
                        name,
                        slots * size_of::<ProbeRay>() as u64,
                        BufferUsages::STORAGE,
                    )?;
                }
                "probe_hits" => {
                    buffers.reserve(device, name, slots * size_of::<ProbeHit>() as u64, readable)?
                }
                "piece_arguments" => buffers.reserve(
                    device,
                    name,
                    slots * size_of::<PieceCall>() as u64,
                    BufferUsages::STORAGE,
                )?,
                "piece_results" => {
                    buffers.reserve(
                        device,
                        name,
                        slots * size_of::<PieceResult>() as u64,
                        readable,
                    )?;
                }
                "secondary_rays" => {
                    let size = slots * size_of::<SecondaryRay>() as u64;
                    buffers.reserve(device, name, size, BufferUsages::STORAGE)?;
                }
                "secondary_hits" => {
                    let size = slots * size_of::<SecondaryHit>() as u64;
                    buffers.reserve(device, name, size, readable)?;
                }
                _ => {
                    let bytes = gpu_scene.bytes(name).unwrap_or_default();
                    buffers.upload(device, name, bytes)?;
                }
            }
        }
        let groups = pipeline.bind(device, &buffers);
        device.check()?;
        Ok(Self {
            pipeline,
            buffers,
            groups,
        })
    }

    /// Writes to the start of a buffer, before the next dispatch.
    pub(crate) fn write(&self, device: &Device, name: &str, bytes: &[u8]) {
        device.queue.write_buffer(self.buffers.get(name), 0, bytes);
    }

    /// Dispatches, without waiting for it.
    pub(crate) fn submit(&self, device: &Device, workgroups: u32) {
        let mut encoder = device
            .device
            .create_command_encoder(&CommandEncoderDescriptor::default());
        self.pipeline
            .dispatch(&mut encoder, &self.groups, workgroups);
        device.queue.submit([encoder.finish()]);
    }

    /// Waits for all dispatches, then the first `size` bytes of a buffer.
    pub(crate) fn read(
        &self,
        device: &Device,
        name: &str,
        size: u64,
    ) -> Result<Vec<u8>, DeviceError> {
        read_back(device, self.buffers.get(name), size)
    }
}
