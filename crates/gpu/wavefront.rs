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
    ComputePass, ComputePassDescriptor, SubmissionIndex,
};

use crate::{
    ahead::{Ahead, begun_ahead},
    batch::TILE_PIXELS,
    device::{Device, DeviceError},
    error::RenderError,
    pass::Work,
    pipeline::{ComingBack, Pipeline, Resources, Workgroups, mapped, submit},
    program::{Feature, ProgramFeatures},
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
/// cancelled, and for the watchdogs of displays. Two such are under way at a time, and how many iterations the next one has is decided
/// by the one before the last: so the range spans a factor of 4, or the number would swing.
const AT_ONCE: std::ops::Range<Duration> = Duration::from_millis(40)..Duration::from_millis(160);

const MOST_ITERATIONS: u32 = 64;

/// Iterations of a run's first submission; each further one has twice as many. How many a run takes is not known, and those over a list
/// that is empty are not free.
const FIRST_ITERATIONS: u32 = 8;

/// Bytes that are read back after each submission: counters, and the list with the lengths of its parts.
const REPORT_BYTES: u64 = 4 * COUNTERS as u64 + size_of::<WorkList>() as u64;

/// How many workgroups a dispatch has, in three dimensions: the beginning of a [`WorkList`].
const ARGUMENTS_BYTES: u64 = 12;

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
    /// What submissions report, in turn: while the device works on one, the host hears of the one before.
    reports: [Buffer; 2],
    /// What was submitted last and not heard of.
    in_flight: Cell<Option<InFlight>>,
    /// Which of the reports it does not use.
    free_report: Cell<usize>,
    most_iterations: u32,
    /// Iterations of a submission at most: what fits [`AT_ONCE`], as far as is known.
    at_once: Cell<u32>,
}

/// Iterations that the device is at work on.
struct InFlight {
    index: SubmissionIndex,
    iterations: u32,
    /// Which of the two reports is theirs.
    report: usize,
}

/// What is known of iterations that are done.
struct Done {
    /// Slots that have a ray left.
    left: u32,
    /// How many iterations had rays to trace.
    iterations: u32,
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
        pipeline: Pipeline,
        resources: &mut Resources,
        (gpu_scene, work): (&GpuScene, &Work),
    ) -> Result<Self, RenderError> {
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

/// Has drivers that compile a kernel at its first dispatch begin with it, on the thread of the device's queue.
pub(crate) fn begin_compiling(
    device: &Device,
    pipeline: Pipeline,
    given: (&GpuScene, &Work),
) -> Result<(), RenderError> {
    let mut resources = Resources::default();
    let bound = Bound::new(device, pipeline, &mut resources, given)?;
    // Its buffers hold zeros: no work.
    bound.dispatch_once(device);
    Ok(device.check()?)
}

impl Wavefront {
    pub(crate) fn new(
        device: &Device,
        features: ProgramFeatures,
        limits: Limits,
        gpu_scene: &GpuScene,
        work: &Work,
    ) -> Result<Self, RenderError> {
        let mut resources = Resources::default();
        let (pipelines, state) = begun_ahead(device, features, limits, work.state_bytes())?;
        if let Some(state) = state {
            resources.add_buffer("state", state);
        }
        let mut bound = |pipeline| {
            let given = (gpu_scene, work);
            Bound::new(device, pipeline, &mut resources, given)
        };
        let [camera_rays, trace_rays, shade_hits] = pipelines.map(&mut bound);
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
        // The device counts steps, if it does, in 32 bits.
        let countable = if features.has(Feature::Counters) {
            u64::from(u32::MAX) / (MOST_STEPS * u64::from(work.slots.max(1)))
        } else {
            u64::from(MOST_ITERATIONS)
        };
        let most_iterations = countable.clamp(1, u64::from(MOST_ITERATIONS)) as u32;
        Ok(Self {
            camera_rays,
            trace_rays,
            shade_hits,
            arguments: buffer("arguments", ARGUMENTS_BYTES, BufferUsages::INDIRECT),
            empty,
            reports: [(); 2].map(|()| buffer("report", REPORT_BYTES, BufferUsages::MAP_READ)),
            in_flight: Cell::new(None),
            free_report: Cell::new(0),
            most_iterations,
            at_once: Cell::new(most_iterations.min(4)),
            resources,
        })
    }

    /// Writes to the start of a buffer, before what is submitted next.
    pub(crate) fn write(&self, device: &Device, name: &str, bytes: &[u8]) {
        let buffer = self.resources.buffer(name);
        device.queue.write_buffer(buffer, 0, bytes);
    }

    /// A dispatch of each kernel that does nothing: drivers that compile at the first dispatch do it here. What each took.
    pub(crate) fn warm_up(
        &self,
        device: &Device,
        frame: &Frame,
        mut ahead: Ahead,
    ) -> Result<[Duration; 3], DeviceError> {
        let nothing = Frame {
            slot_count: 0,
            tile_count: 1,
            tile_stride: 1,
            ..*frame
        };
        self.write(device, "frame", bytes_of(&nothing));
        self.write(device, "list_0", bytes_of(&WorkList::EMPTY));
        self.write(device, "list_1", bytes_of(&WorkList::EMPTY));
        let timed = |kernel: &Bound, begun: Option<&mut Ahead>| {
            let started = Instant::now();
            if let Some(ahead) = begun {
                ahead.wait();
            }
            kernel.dispatch_once(device);
            device.wait()?;
            Ok(started.elapsed())
        };
        let took = [
            timed(&self.camera_rays, None)?,
            timed(&self.trace_rays, None)?,
            timed(&self.shade_hits, Some(&mut ahead))?,
        ];
        ahead.finish();
        Ok(took)
    }

    /// Renders a sample of each pixel of a batch. `observer` is told after each submission which share of the pixels is finished;
    /// `meanwhile` is called while the device works. How many iterations it took.
    ///
    /// Two submissions are under way at any time, so that the device need not wait for the host. So the last of them was submitted
    /// before it was known that there is nothing left to do: it does nothing, and is heard of in the next run.
    pub(crate) fn run(
        &self,
        device: &Device,
        frame: &Frame,
        counters: &mut Counters,
        mut observer: impl FnMut(f64) -> Result<(), RenderError>,
        mut meanwhile: impl FnMut() -> Result<(), RenderError>,
    ) -> Result<u32, RenderError> {
        let mut encoder = self.begin(device, frame);
        let mut reads = 0;
        let mut iterations = 0;
        let mut is_ours = false;
        let mut since = Instant::now();
        let mut at_once = FIRST_ITERATIONS / 2;
        loop {
            at_once = (2 * at_once).min(self.at_once.get());
            for _ in 0..at_once {
                self.iterate(&mut encoder, reads);
                reads = 1 - reads;
            }
            let earlier = self.submit(device, encoder, at_once, reads);
            meanwhile()?;
            if let Some(earlier) = earlier {
                // Of a run that was cancelled, there may be something to count, but not here.
                let mut foreign = Counters::default();
                let counters = if is_ours {
                    &mut *counters
                } else {
                    &mut foreign
                };
                let done = self.hear_of(device, &earlier, counters)?;
                if is_ours {
                    iterations += done.iterations;
                    observer(1.0 - f64::from(done.left) / f64::from(frame.slot_count))?;
                    if done.left == 0 {
                        return Ok(iterations);
                    }
                    self.adapt(since.elapsed(), earlier.iterations);
                    since = Instant::now();
                }
            }
            is_ours = true;
            encoder = self.recording(device);
        }
    }

    /// Records the camera rays of a batch, which make the first list.
    fn begin(&self, device: &Device, frame: &Frame) -> CommandEncoder {
        self.write(device, "frame", bytes_of(frame));
        self.write(device, "list_0", bytes_of(&WorkList::EMPTY));
        let mut encoder = self.recording(device);
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        let workgroups = Workgroups::Count(frame.slot_count / TILE_PIXELS);
        self.camera_rays.dispatch(&mut pass, 1, workgroups);
        drop(pass);
        encoder
    }

    /// Chooses how many iterations to submit at once at most, after so many took so long.
    fn adapt(&self, took: Duration, iterations: u32) {
        let at_once = self.at_once.get();
        if took < AT_ONCE.start && iterations >= at_once {
            self.at_once.set((2 * at_once).min(self.most_iterations));
        } else if took > AT_ONCE.end {
            self.at_once.set((at_once / 2).max(1));
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
        encoder.copy_buffer_to_buffer(list("list_in"), 0, &self.arguments, 0, ARGUMENTS_BYTES);
        // Not by a kernel: over an empty list none runs.
        encoder.copy_buffer_to_buffer(&self.empty, 0, list("list_out"), 0, size);
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        for kernel in [&self.trace_rays, &self.shade_hits] {
            kernel.dispatch(&mut pass, reads, Workgroups::Listed(&self.arguments));
        }
    }

    /// Submits iterations after which kernels read list `reads`. The result: what was submitted before.
    fn submit(
        &self,
        device: &Device,
        encoder: CommandEncoder,
        iterations: u32,
        reads: usize,
    ) -> Option<InFlight> {
        let submitted = self.send(device, encoder, iterations, reads);
        self.free_report.set(1 - submitted.report);
        self.in_flight.replace(Some(submitted))
    }

    /// Submits iterations, with the report that is free.
    fn send(
        &self,
        device: &Device,
        mut encoder: CommandEncoder,
        iterations: u32,
        reads: usize,
    ) -> InFlight {
        let report = self.free_report.get();
        let to = &self.reports[report];
        let counted = 4 * COUNTERS as u64;
        let list = self.resources.buffer(&resource_name("list_in", reads));
        let size = size_of::<WorkList>() as u64;
        let counts = self.resources.buffer("counters");
        encoder.copy_buffer_to_buffer(counts, 0, to, 0, counted);
        encoder.copy_buffer_to_buffer(list, 0, to, counted, size);
        let index = device.queue.submit([encoder.finish()]);
        InFlight {
            index,
            iterations,
            report,
        }
    }

    /// Waits for a submission, and adds up its counters.
    fn hear_of(
        &self,
        device: &Device,
        earlier: &InFlight,
        counters: &mut Counters,
    ) -> Result<Done, DeviceError> {
        let report = &self.reports[earlier.report];
        mapped(device, report.slice(..), &earlier.index, |bytes| {
            let (counts, list) = bytes.split_at(4 * COUNTERS);
            let list: WorkList = pod_read_unaligned(list);
            Done {
                left: list.length(),
                iterations: counters.add(cast_slice(counts)),
            }
        })
    }

    /// Begins to copy a batch's slots to the host, after all that was submitted.
    pub(crate) fn fetch_slots(&self, device: &Device, count: u32) -> SlotsComing {
        let state = self.resources.buffer("state");
        let size = u64::from(count) * size_of::<Slot>() as u64;
        SlotsComing(ComingBack::begin(device, state, size))
    }
}

/// Slots on their way to the host.
pub(crate) struct SlotsComing(ComingBack);

impl SlotsComing {
    /// Waits until they are there, and gives them one after the other.
    pub(crate) fn each(
        &self,
        device: &Device,
        mut take: impl FnMut(usize, Slot),
    ) -> Result<(), DeviceError> {
        self.0.wait(device, |bytes| {
            for (index, &slot) in cast_slice(bytes).iter().enumerate() {
                take(index, slot);
            }
        })
    }
}
