//! The kernels that make a picture: a sample's camera rays, then iterations that trace the rays on a list, shade what they hit
//! and make the next list, until it is empty (`shaders/work_lists.wgsl`).

pub(crate) mod recorded_rays;

use std::{
    cell::Cell,
    time::{Duration, Instant},
};

use bytemuck::{bytes_of, cast_slice, pod_read_unaligned};
use wgpu::{
    BindGroup, Buffer, BufferDescriptor, BufferUsages, CommandEncoder, CommandEncoderDescriptor,
    ComputePass, ComputePassDescriptor,
};

use crate::{
    ahead::Ahead,
    batch::TILE_PIXELS,
    device::{Device, DeviceError},
    error::RenderError,
    pass::Work,
    pipeline::{Pipeline, Resources, Workgroups, mapped, read_back, submit},
    program::{Kernel, ProgramFeatures, assemble},
    source::Limits,
    statistics::{COUNTERS, Counters},
    types::{Frame, Slot, WorkList},
    upload::GpuScene,
};

/// Node visits and triangle tests after which a ray is left to the next iteration (`shaders/traverse.wgsl`). Mesa before 25.0 ends
/// all loops of a vector of 8 invocations after 65,535 iterations together, without a word; this keeps their sum below that.
pub(crate) const STEP_BUDGET: u32 = 4096;

/// The most steps of a ray in an iteration: it ends behind a node, which may have 24 triangles.
const MOST_STEPS: u64 = STEP_BUDGET as u64 + 32;

/// What the work that is submitted at once should take: long enough that waiting for it costs nothing, short enough to be
/// cancelled, and for the watchdogs of displays.
const AT_ONCE: std::ops::Range<Duration> = Duration::from_millis(40)..Duration::from_millis(160);

const MOST_ITERATIONS: u32 = 64;

/// Bytes that are read back after each submission: counters, and the length of the list.
const REPORT_BYTES: u64 = 4 * COUNTERS as u64 + size_of::<WorkList>() as u64;

/// The kernels of a picture with their resources.
pub(crate) struct Wavefront {
    camera_rays: Bound,
    trace_rays: Bound,
    shade_hits: Bound,
    resources: Resources,
    /// How many workgroups the next iteration has.
    arguments: Buffer,
    /// A list without entries.
    empty: Buffer,
    report: Buffer,
    most_iterations: u32,
    /// Iterations of the next submission: what fits [`AT_ONCE`], as far as is known.
    at_once: Cell<u32>,
}

/// A kernel, bound to read either list.
struct Bound {
    pipeline: Pipeline,
    groups: [Vec<BindGroup>; 2],
}

/// What a binding of the lists is called when kernels read list `reads` and write the other.
fn resource_name(binding: &str, reads: usize) -> String {
    let (list, which) = match binding {
        "list_in" => ("list", reads),
        "list_out" => ("list", 1 - reads),
        "queue_in" => ("queue", reads),
        "queue_out" => ("queue", 1 - reads),
        other => return other.to_owned(),
    };
    format!("{list}_{which}")
}

impl Bound {
    fn new(
        device: &Device,
        kernel: Kernel,
        features: ProgramFeatures,
        limits: Limits,
        resources: &mut Resources,
        (gpu_scene, work): (&GpuScene, &Work<'_>),
    ) -> Result<Self, RenderError> {
        let module = assemble(kernel, features, limits)?;
        let pipeline = Pipeline::new(device, kernel, module)?;
        for reads in [0, 1] {
            for binding in pipeline.bindings() {
                let called = resource_name(&binding.name, reads);
                resources.provide(device, &binding.name, &called, gpu_scene, work)?;
            }
        }
        let groups =
            [0, 1].map(|reads| pipeline.bind(device, resources, |name| resource_name(name, reads)));
        Ok(Self { pipeline, groups })
    }

    /// Records a dispatch that reads list `reads`.
    fn dispatch(&self, pass: &mut ComputePass<'_>, reads: usize, workgroups: Workgroups<'_>) {
        self.pipeline
            .dispatch(pass, &self.groups[reads], workgroups);
    }

    fn dispatch_once(&self, device: &Device) {
        submit(device, |pass| self.dispatch(pass, 0, Workgroups::Count(1)));
    }
}

/// Compiles a kernel, on drivers that do so at the first dispatch.
pub(crate) fn compile(
    device: &Device,
    kernel: Kernel,
    features: ProgramFeatures,
    limits: Limits,
    given: (&GpuScene, &Work<'_>),
) -> Result<(), RenderError> {
    let mut resources = Resources::default();
    let bound = Bound::new(device, kernel, features, limits, &mut resources, given)?;
    // Its buffers hold zeros: no work.
    bound.dispatch_once(device);
    Ok(device.wait()?)
}

impl Wavefront {
    pub(crate) fn new(
        device: &Device,
        features: ProgramFeatures,
        limits: Limits,
        gpu_scene: &GpuScene,
        work: &Work<'_>,
    ) -> Result<Self, RenderError> {
        let mut resources = Resources::default();
        let mut bound = |kernel| {
            let given = (gpu_scene, work);
            Bound::new(device, kernel, features, limits, &mut resources, given)
        };
        let [camera_rays, trace_rays, shade_hits] = Kernel::PICTURE.map(&mut bound);
        let (camera_rays, trace_rays, shade_hits) = (camera_rays?, trace_rays?, shade_hits?);
        let buffer = |label, size, usage| {
            device.device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size,
                usage: usage | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let list_bytes = size_of::<WorkList>() as u64;
        let empty = buffer("empty", list_bytes, BufferUsages::COPY_SRC);
        device
            .queue
            .write_buffer(&empty, 0, bytes_of(&WorkList::EMPTY));
        device.check()?;
        // The device counts in 32 bits.
        let countable = u64::from(u32::MAX) / (MOST_STEPS * u64::from(work.slots.max(1)));
        let most_iterations = countable.clamp(1, u64::from(MOST_ITERATIONS)) as u32;
        Ok(Self {
            camera_rays,
            trace_rays,
            shade_hits,
            arguments: buffer("arguments", list_bytes, BufferUsages::INDIRECT),
            empty,
            report: buffer("report", REPORT_BYTES, BufferUsages::MAP_READ),
            most_iterations,
            at_once: Cell::new(most_iterations.min(4)),
            resources,
        })
    }

    fn write(&self, device: &Device, name: &str, bytes: &[u8]) {
        let buffer = self.resources.buffer(name);
        device.queue.write_buffer(buffer, 0, bytes);
    }

    /// A dispatch of each kernel that does nothing: drivers that compile at the first dispatch do it here.
    pub(crate) fn warm_up(
        &self,
        device: &Device,
        frame: &Frame,
        ahead: Ahead,
    ) -> Result<(), DeviceError> {
        let nothing = Frame {
            slot_count: 0,
            tile_count: 1,
            tile_stride: 1,
            ..*frame
        };
        self.write(device, "frame", bytes_of(&nothing));
        self.write(device, "list_0", bytes_of(&WorkList::EMPTY));
        self.write(device, "list_1", bytes_of(&WorkList::EMPTY));
        self.camera_rays.dispatch_once(device);
        self.trace_rays.dispatch_once(device);
        device.wait()?;
        drop(ahead);
        self.shade_hits.dispatch_once(device);
        device.wait()
    }

    /// Renders a sample of each pixel of a batch. `observer` is told after each submission which share of the pixels is finished.
    /// How many iterations it took.
    pub(crate) fn run(
        &self,
        device: &Device,
        frame: &Frame,
        counters: &mut Counters,
        mut observer: impl FnMut(f64) -> Result<(), RenderError>,
    ) -> Result<u32, RenderError> {
        self.write(device, "frame", bytes_of(frame));
        self.write(device, "list_0", bytes_of(&WorkList::EMPTY));
        let mut encoder = self.recording(device);
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        let workgroups = Workgroups::Count(frame.slot_count / TILE_PIXELS);
        self.camera_rays.dispatch(&mut pass, 1, workgroups);
        drop(pass);
        let mut reads = 0;
        let mut at_once = self.at_once.get();
        let mut iterations = 0;
        loop {
            let started = Instant::now();
            for _ in 0..at_once {
                self.iterate(&mut encoder, reads);
                reads = 1 - reads;
            }
            let (left, done) = self.report(device, encoder, reads, counters)?;
            iterations += done;
            observer(1.0 - f64::from(left) / f64::from(frame.slot_count))?;
            if left == 0 {
                return Ok(iterations);
            }
            let took = started.elapsed();
            if took < AT_ONCE.start {
                at_once = (2 * at_once).min(self.most_iterations);
            } else if took > AT_ONCE.end {
                at_once = (at_once / 2).max(1);
            }
            self.at_once.set(at_once);
            encoder = self.recording(device);
        }
    }

    /// Begins to record what is counted together.
    fn recording(&self, device: &Device) -> CommandEncoder {
        let mut encoder = device
            .device
            .create_command_encoder(&CommandEncoderDescriptor::default());
        encoder.clear_buffer(self.resources.buffer("counters"), 0, None);
        encoder
    }

    /// Records the tracing and shading of list `reads`.
    fn iterate(&self, encoder: &mut CommandEncoder, reads: usize) {
        let list = |binding| self.resources.buffer(&resource_name(binding, reads));
        let size = size_of::<WorkList>() as u64;
        encoder.copy_buffer_to_buffer(list("list_in"), 0, &self.arguments, 0, size);
        // Not by a kernel: over an empty list none runs.
        encoder.copy_buffer_to_buffer(&self.empty, 0, list("list_out"), 0, size);
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        for kernel in [&self.trace_rays, &self.shade_hits] {
            kernel.dispatch(&mut pass, reads, Workgroups::Listed(&self.arguments));
        }
    }

    /// Submits, waits, and adds up the counters: how many slots have a ray left, and how many iterations had rays to trace.
    fn report(
        &self,
        device: &Device,
        mut encoder: CommandEncoder,
        reads: usize,
        counters: &mut Counters,
    ) -> Result<(u32, u32), DeviceError> {
        let counted = 4 * COUNTERS as u64;
        let list = self.resources.buffer(&resource_name("list_in", reads));
        let size = size_of::<WorkList>() as u64;
        let counts = self.resources.buffer("counters");
        encoder.copy_buffer_to_buffer(counts, 0, &self.report, 0, counted);
        encoder.copy_buffer_to_buffer(list, 0, &self.report, counted, size);
        device.queue.submit([encoder.finish()]);
        let bytes = mapped(device, &self.report)?;
        let (counts, list) = bytes.split_at(counted as usize);
        let list: WorkList = pod_read_unaligned(list);
        Ok((list.length, counters.add(cast_slice(counts))))
    }

    /// Waits for all dispatches, then a batch's slots: the first two planes (`shaders/state.wgsl`).
    pub(crate) fn slots(&self, device: &Device, count: u32) -> Result<Vec<Slot>, DeviceError> {
        let state = self.resources.buffer("state");
        let bytes = read_back(device, state, u64::from(count) * size_of::<Slot>() as u64)?;
        let words: &[[u32; 4]] = cast_slice(&bytes);
        let (radiance, counts) = words.split_at(count as usize);
        Ok(radiance
            .iter()
            .zip(counts)
            .map(|(radiance, counts)| Slot {
                radiance: radiance.map(f32::from_bits),
                rays: counts[0],
                common_rays: counts[1],
                dropped_storage: counts[2],
                dropped_budget: counts[3],
            })
            .collect())
    }
}
