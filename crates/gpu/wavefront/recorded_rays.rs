//! The rays that a picture traces, read back from the device iteration by iteration: for benches, which give them to a bare
//! traversal to see what the rest of a frame costs, and for tests.

use bytemuck::{bytes_of, cast_slice};
use glam::{DVec3, Vec3};
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, CommandEncoder, CommandEncoderDescriptor,
    ComputePassDescriptor,
};

use super::{Wavefront, resource_name};
use crate::{
    batch::TILE_PIXELS,
    device::{Device, DeviceError},
    error::RenderError,
    pass::ITEM_BYTES,
    pipeline::{Workgroups, mapped},
    program::Feature,
    render::{MOST_LEVELS, MOST_SLOTS, Prepared, STACK_PLANE},
    statistics::Counters,
    types::{Frame, ProbeRay, WorkList},
};

// Of the same names in `state.wgsl`, `work_lists.wgsl` and `ray_stack.wgsl` under `shaders/`.
pub(crate) const HIT_PLANE: u32 = 2;
pub(crate) const ENTRY_SUSPENDED: u32 = 1 << 30;
pub(crate) const ITEM_KIND: u32 = 3;
pub(crate) const SHADOW: u32 = 1;
pub(crate) const LIGHTS: u32 = 2;

/// Where a ray ends that ends nowhere; of the same name in `shaders/math.wgsl`.
pub(crate) const T_MAX: f32 = 1e30;

/// A slot's word in a plane of the state.
type Word = [u32; 4];

/// Its bytes.
const WORD: u32 = size_of::<Word>() as u32;

/// Words, and so planes, of an item.
const ITEM_WORDS: u32 = ITEM_BYTES as u32 / WORD;

/// The rays of a picture, and what they have hit.
#[derive(Clone, Debug, Default)]
pub struct RecordedRays {
    /// In the order in which they were traced. A ray that goes on behind what it passes - a hole in a mask, glass on the way to a
    /// light - is traversed anew: so it is another one here, where counters count it once.
    ///
    /// They begin at `t` = 0, as probes do: a camera ray that began before that is moved back to begin before the whole scene,
    /// and one that goes on behind a hole is moved to there. Both are rounded by that.
    pub rays: Vec<ProbeRay>,
    /// The triangle that each has hit, [`u32::MAX`] for none.
    pub triangles: Vec<u32>,
    /// What the picture has counted, if its settings ask for that.
    pub counters: Counters,
}

impl Prepared<'_> {
    /// Renders the picture one iteration at a time, and reads back what each traces. Takes seconds, and memory for every ray.
    ///
    /// # Errors
    /// As [`render`](crate::render).
    ///
    /// # Panics
    /// If the program gathers faces in contact: that takes further traversals, which are not recorded.
    pub fn recorded_rays(&self) -> Result<RecordedRays, RenderError> {
        assert!(!self.features.has(Feature::Contact), "faces in contact");
        let mut recorder = Recorder {
            device: self.device,
            wavefront: &self.wavefront,
            bounds: self.scene.geometry.bounds().unwrap_or_default(),
            ray_of_slot: Vec::new(),
            recorded: RecordedRays::default(),
        };
        for &batch in &self.plan.batches {
            for sample in 0..self.settings.samples {
                recorder.run(&Frame {
                    sample,
                    ..self.plan.frame_of(batch)
                })?;
            }
        }
        Ok(recorder.recorded)
    }
}

/// A picture's recording so far.
struct Recorder<'p> {
    device: &'p Device,
    wavefront: &'p Wavefront,
    /// Corners of the scene's box.
    bounds: (DVec3, DVec3),
    /// The ray that each slot has traced last.
    ray_of_slot: Vec<usize>,
    recorded: RecordedRays,
}

impl Recorder<'_> {
    /// Records a sample of each pixel of a batch: as [`Wavefront::run`] goes about it, but for looking in between.
    fn run(&mut self, frame: &Frame) -> Result<(), RenderError> {
        let (device, wavefront) = (self.device, self.wavefront);
        wavefront.write(device, "frame", bytes_of(frame));
        wavefront.write(device, "list_0", bytes_of(&WorkList::EMPTY));
        let mut encoder = wavefront.recording(device);
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        let workgroups = Workgroups::Count(frame.slot_count / TILE_PIXELS);
        wavefront.camera_rays.dispatch(&mut pass, 1, workgroups);
        drop(pass);
        self.ray_of_slot = vec![0; frame.slot_count as usize];
        let mut reads = 0;
        let mut length = self.report(encoder, reads)?;
        while length > 0 {
            let traced = self.begin(frame, reads, length)?;
            let mut encoder = wavefront.recording(device);
            wavefront.iterate(&mut encoder, reads);
            reads = 1 - reads;
            length = self.report(encoder, reads)?;
            self.end(frame, &traced)?;
        }
        Ok(())
    }

    fn report(&mut self, encoder: CommandEncoder, reads: usize) -> Result<u32, DeviceError> {
        let counters = &mut self.recorded.counters;
        let reported = self
            .wavefront
            .report(self.device, encoder, reads, counters)?;
        Ok(reported.0)
    }

    /// Before the iteration that reads list `reads`: which ray is traced for each of its entries, if any.
    fn begin(
        &mut self,
        frame: &Frame,
        reads: usize,
        length: u32,
    ) -> Result<Vec<Option<usize>>, DeviceError> {
        let resources = &self.wavefront.resources;
        let queue = resources.buffer(&resource_name("queue_in", reads));
        let entries = read(self.device, queue, 0, 4 * length)?;
        let entries: &[u32] = cast_slice(&entries);
        let (lowest, highest) = entries
            .iter()
            .map(|entry| level(*entry))
            .fold((u32::MAX, 0), |(lowest, highest), level| {
                (lowest.min(level), highest.max(level))
            });
        let stride = frame.slot_count;
        let state = read(
            self.device,
            resources.buffer("state"),
            plane(STACK_PLANE + lowest * ITEM_WORDS, frame),
            (highest + 1 - lowest) * ITEM_WORDS * stride * WORD,
        )?;
        let state: &[Word] = cast_slice(&state);
        let item = |entry: u32| {
            let plane = (level(entry) - lowest) * ITEM_WORDS;
            std::array::from_fn(|word| {
                state[(plane + word as u32) as usize * stride as usize + slot(entry)]
            })
        };
        let traced = entries.iter().map(|&entry| self.trace(entry, item(entry)));
        Ok(traced.collect())
    }

    /// The ray of an entry: a new one, unless its traversal goes on; none if it has only lights left to sum up.
    fn trace(&mut self, entry: u32, item: [Word; ITEM_WORDS as usize]) -> Option<usize> {
        if item[1][3] & ITEM_KIND == LIGHTS {
            return None;
        }
        let rays = &mut self.recorded.rays;
        if entry & ENTRY_SUSPENDED == 0 {
            self.ray_of_slot[slot(entry)] = rays.len();
            rays.push(ray_of(item, self.bounds));
            self.recorded.triangles.push(u32::MAX);
        }
        Some(self.ray_of_slot[slot(entry)])
    }

    /// After it: what they have hit, or hit so far.
    fn end(&mut self, frame: &Frame, traced: &[Option<usize>]) -> Result<(), DeviceError> {
        let state = self.wavefront.resources.buffer("state");
        let bytes = WORD * traced.len() as u32;
        let hits = read(self.device, state, plane(HIT_PLANE, frame), bytes)?;
        for (ray, hit) in traced.iter().zip(cast_slice::<u8, Word>(&hits)) {
            if let Some(ray) = *ray {
                self.recorded.triangles[ray] = hit[1];
            }
        }
        Ok(())
    }
}

fn slot(entry: u32) -> usize {
    (entry % MOST_SLOTS) as usize
}

fn level(entry: u32) -> u32 {
    entry / MOST_SLOTS % MOST_LEVELS
}

/// The ray of an item as `store_item` leaves it (`shaders/ray_stack.wgsl`), begun at `t` = 0.
fn ray_of([a, b, c, d]: [Word; ITEM_WORDS as usize], bounds: (DVec3, DVec3)) -> ProbeRay {
    let vector = |word: Word| Vec3::from_array([word[0], word[1], word[2]].map(f32::from_bits));
    let (origin, direction) = (vector(a), vector(b));
    let shadow = b[3] & ITEM_KIND == SHADOW;
    let t_max = if shadow { f32::from_bits(c[3]) } else { T_MAX };
    let t_min = f32::from_bits(d[2]);
    let start = if t_min < 0.0 {
        t_min.max(before(origin, direction, bounds)).min(0.0)
    } else {
        t_min
    };
    ProbeRay {
        origin: (origin + start * direction).to_array(),
        t_max: if t_max < T_MAX { t_max - start } else { t_max },
        direction: direction.to_array(),
        shadow: u32::from(shadow),
    }
}

/// A distance along a ray before which there is nothing of a box.
fn before(origin: Vec3, direction: Vec3, (min, max): (DVec3, DVec3)) -> f32 {
    let nearest = DVec3::select(direction.cmpge(Vec3::ZERO).into(), min, max);
    let distance = direction.as_dvec3().dot(nearest - origin.as_dvec3());
    (distance - 1e-3 * (max - min).length()) as f32
}

/// Where a plane of the state begins, bytes.
fn plane(plane: u32, frame: &Frame) -> u64 {
    u64::from(plane) * u64::from(frame.slot_count) * u64::from(WORD)
}

/// A part of a buffer, when everything submitted before is done.
fn read(device: &Device, buffer: &Buffer, first: u64, bytes: u32) -> Result<Vec<u8>, DeviceError> {
    let bytes = u64::from(bytes);
    let staging = device.device.create_buffer(&BufferDescriptor {
        label: Some("read back"),
        size: bytes,
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device
        .device
        .create_command_encoder(&CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, first, &staging, 0, bytes);
    device.queue.submit([encoder.finish()]);
    mapped(device, &staging)
}
