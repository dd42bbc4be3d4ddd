//! The rays that a picture traces, read back from the device iteration by iteration: for benches, which give them to a bare
//! traversal to see what the rest of a frame costs, and for tests.

use bytemuck::{Pod, cast_slice};
use glam::{DVec3, Vec3};
use wgpu::{Buffer, BufferDescriptor, BufferUsages, CommandEncoder, CommandEncoderDescriptor};

use super::{Wavefront, resource_name};
use crate::{
    batch::{Batch, TILE_PIXELS},
    device::{Device, DeviceError},
    error::RenderError,
    piece::{Piece, PieceCall, PieceResult, evaluate},
    pipeline::mapped,
    plan::{CAMERA_LEVEL, HIT_WORDS, ITEM_WORDS, MOST_SLOTS, SLOT_WORDS, WORD_BYTES},
    program::Feature,
    render::Prepared,
    statistics::Counters,
    types::{Frame, ProbeHit, ProbeRay, WorkList},
};

// Of the same names in `work_lists.wgsl` and `ray_stack.wgsl` under `shaders/`.
pub(crate) const ENTRY_SUSPENDED: u32 = 1 << 30;
pub(crate) const ITEM_KIND: u32 = 3;
pub(crate) const SHADOW: u32 = 1;
pub(crate) const LIGHTS: u32 = 2;

/// Where a ray ends that ends nowhere; of the same name in `shaders/math.wgsl`.
pub(crate) const T_MAX: f32 = 1e30;

/// How far behind a hole a ray goes on that does not know what it has passed, in lengths of the scene's diagonal.
const BEHIND_HOLES: f64 = 1e-6;

/// Of the state.
type Word = [u32; WORD_BYTES as usize / 4];

type Item = [Word; ITEM_WORDS as usize];

/// The rays of a picture, and what they have hit.
#[derive(Clone, Debug, Default)]
pub struct RecordedRays {
    /// In the order in which they were traced. A ray that goes on behind what it passes - a hole in a mask, glass on the way to a
    /// light - is traversed anew: so it is another one here, where counters count it once.
    ///
    /// They begin at `t` = 0, as probes do: a camera ray that began before that is moved back to begin before the whole scene,
    /// and one that goes on behind a hole is moved to a little behind it. Both are rounded by that.
    pub rays: Vec<ProbeRay>,
    /// The triangle that each has hit, [`u32::MAX`] for none.
    pub triangles: Vec<u32>,
    /// What the picture has counted, if its settings ask for that.
    pub counters: Counters,
}

impl RecordedRays {
    /// How many of the rays have hit something else than in these hits of theirs: another triangle, or, of shadow rays, which end at
    /// any, something rather than nothing.
    #[must_use]
    pub fn other_hits(&self, hits: &[ProbeHit]) -> usize {
        let found = hits.iter().zip(&self.triangles);
        let other = |(ray, (hit, triangle)): &(&ProbeRay, (&ProbeHit, &u32))| {
            if ray.shadow == 0 {
                hit.triangle != **triangle
            } else {
                (hit.triangle == u32::MAX) != (**triangle == u32::MAX)
            }
        };
        self.rays.iter().zip(found).filter(other).count()
    }
}

impl Prepared<'_> {
    /// Renders the picture one iteration at a time, and reads back what each traces. Takes seconds, and memory for every ray.
    ///
    /// # Errors
    /// As [`render`](crate::render()).
    ///
    /// # Panics
    /// If the program gathers faces in contact: that takes further traversals, which are not recorded. With a tolerance, which orders
    /// samples as it goes.
    pub fn recorded_rays(&self) -> Result<RecordedRays, RenderError> {
        assert!(!self.features.has(Feature::Contact), "faces in contact");
        assert!(!self.features.has(Feature::Tolerance), "a tolerance");
        let staging = BufferDescriptor {
            label: Some("recorded rays"),
            size: self.wavefront.resources.buffer("state").size(),
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        };
        let mut recorder = Recorder {
            device: self.device,
            wavefront: &self.wavefront,
            staging: self.device.device.create_buffer(&staging),
            bounds: self.scene.bounds().unwrap_or_default(),
            ray_of_slot: Vec::new(),
            camera_rays: Vec::new(),
            recorded: RecordedRays::default(),
        };
        for &batch in &self.plan.layout.batches {
            for sample in 0..self.settings.samples {
                recorder.camera_rays = self.camera_rays(batch, sample)?;
                recorder.run(&self.plan.frame_of_sample(batch, sample))?;
            }
        }
        Ok(recorder.recorded)
    }

    /// The ray that each slot of a batch begins with, by the device's own function: nothing is stored of it there.
    fn camera_rays(&self, batch: Batch, sample: u32) -> Result<Vec<ProbeRay>, RenderError> {
        let (plan, settings) = (&self.plan, self.settings);
        let region = settings.visible_region();
        let [x, y] = plan.samples[sample as usize].map(f32::to_bits);
        let call = |slot: u32| -> PieceCall {
            // Slots beyond the window begin with none; any will do.
            let pixel = plan
                .layout
                .tiling
                .pixel_of_slot(batch, slot)
                .unwrap_or_default() as u32;
            let [column, row] = [pixel % region.width, pixel / region.width];
            let mut call = PieceCall::default();
            call[..4].copy_from_slice(&[region.x + column, region.y + row, x, y]);
            call
        };
        let calls: Vec<PieceCall> = (0..batch.tile_count * TILE_PIXELS).map(call).collect();
        let found = evaluate(self.device, Piece::Camera, self.scene, settings, &calls)?;
        let bounds = self.scene.bounds().unwrap_or_default();
        let t_min = plan.frame.start_t;
        let begun = |result: PieceResult| {
            let vector = |k: usize| [result[k], result[k + 1], result[k + 2]].map(f32::from_bits);
            begun_at_zero(vector(0).into(), vector(3).into(), [t_min, T_MAX], bounds)
        };
        Ok(found.into_iter().map(begun).collect())
    }
}

/// An entry of a list.
struct Traced {
    /// Where it lies.
    place: usize,
    ray: Option<usize>,
}

/// A picture's recording so far.
struct Recorder<'p> {
    device: &'p Device,
    wavefront: &'p Wavefront,
    /// For reading back: as large as the state.
    staging: Buffer,
    /// Corners of the scene's box.
    bounds: (DVec3, DVec3),
    /// The ray that each slot has traced last.
    ray_of_slot: Vec<usize>,
    /// The ray that each slot begins with.
    camera_rays: Vec<ProbeRay>,
    recorded: RecordedRays,
}

impl Recorder<'_> {
    /// Records a sample of each pixel of a batch: as [`Wavefront::run`] goes about it, but for looking in between.
    fn run(&mut self, frame: &Frame) -> Result<(), RenderError> {
        let (device, wavefront) = (self.device, self.wavefront);
        let encoder = wavefront.begin(device, frame);
        self.ray_of_slot = vec![0; frame.slot_count as usize];
        let mut reads = 0;
        let mut length = self.report(encoder, reads)?;
        while length > 0 {
            let traced = self.begin(frame, reads)?;
            let mut encoder = wavefront.recording(device);
            wavefront.iterate(&mut encoder, reads);
            reads = 1 - reads;
            length = self.report(encoder, reads)?;
            self.end(frame, &traced)?;
        }
        Ok(())
    }

    fn report(&mut self, encoder: CommandEncoder, reads: usize) -> Result<u32, DeviceError> {
        let (device, wavefront) = (self.device, self.wavefront);
        let sent = wavefront.send(device, encoder, 1, reads);
        let done = wavefront.hear_of(device, &sent, &mut self.recorded.counters)?;
        Ok(done.left)
    }

    /// Before the iteration that reads list `reads`: where its entries lie, and which ray is traced for each, if any.
    fn begin(&mut self, frame: &Frame, reads: usize) -> Result<Vec<Traced>, DeviceError> {
        let list = resource_name("list_in", reads);
        let list = self.read(&list, 0, 1, |lists: &[WorkList]| lists[0])?;
        let queue = resource_name("queue_in", reads);
        let entries: Vec<(usize, u32)> = self.read(&queue, 0, frame.slot_count, |queue| {
            let places = list.places();
            places.map(|place| (place, queue[place])).collect()
        })?;
        let stored = |level: &u32| *level != CAMERA_LEVEL;
        let levels = || entries.iter().map(|entry| level(entry.1)).filter(stored);
        let lowest = levels().min().unwrap_or(0);
        let count = levels().max().unwrap_or(0) + 1 - lowest;
        // Level by level, those of all slots side by side.
        let of_level = frame.slot_count * frame.item_words;
        let items: Vec<Item> = self.read(
            "state",
            frame.slot_count * (SLOT_WORDS + HIT_WORDS) + lowest * of_level,
            count * of_level,
            |words: &[Word]| {
                let item = |&(_, entry): &(usize, u32)| {
                    let mut item = Item::default();
                    if level(entry) != CAMERA_LEVEL {
                        let above = ((level(entry) - lowest) * frame.slot_count) as usize;
                        let used = frame.item_words as usize;
                        item[..used]
                            .copy_from_slice(&words[(above + slot(entry)) * used..][..used]);
                    }
                    item
                };
                entries.iter().map(item).collect()
            },
        )?;
        let traced = entries.into_iter().zip(items);
        Ok(traced
            .map(|((place, entry), item)| Traced {
                place,
                ray: self.trace(entry, item),
            })
            .collect())
    }

    /// The ray of an entry: a new one, unless its traversal goes on; none if it has only lights left to sum up.
    fn trace(&mut self, entry: u32, item: Item) -> Option<usize> {
        let begins = level(entry) == CAMERA_LEVEL;
        if !begins && item[1][3] & ITEM_KIND == LIGHTS {
            return None;
        }
        let rays = &mut self.recorded.rays;
        if entry & ENTRY_SUSPENDED == 0 {
            self.ray_of_slot[slot(entry)] = rays.len();
            rays.push(if begins {
                self.camera_rays[slot(entry)]
            } else {
                ray_of(item, self.bounds)
            });
            self.recorded.triangles.push(u32::MAX);
        }
        Some(self.ray_of_slot[slot(entry)])
    }

    /// After it: what they have hit, or hit so far.
    fn end(&mut self, frame: &Frame, traced: &[Traced]) -> Result<(), DeviceError> {
        let first = frame.slot_count * SLOT_WORDS;
        let hits = self.read("state", first, frame.slot_count, <[Word]>::to_vec)?;
        for traced in traced {
            if let Some(ray) = traced.ray {
                self.recorded.triangles[ray] = hits[traced.place][1];
            }
        }
        Ok(())
    }

    /// What `take` makes of the `count` elements from the one at `first` on, when everything submitted before is done.
    fn read<T: Pod, R>(
        &self,
        buffer: &str,
        first: u32,
        count: u32,
        take: impl FnOnce(&[T]) -> R,
    ) -> Result<R, DeviceError> {
        let bytes = |elements: u32| u64::from(elements) * size_of::<T>() as u64;
        let (device, staging) = (self.device, &self.staging);
        let from = self.wavefront.resources.buffer(buffer);
        let mut encoder = device
            .device
            .create_command_encoder(&CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(from, bytes(first), staging, 0, bytes(count));
        let index = device.queue.submit([encoder.finish()]);
        let part = staging.slice(..bytes(count));
        mapped(device, part, &index, |bytes| take(cast_slice(bytes)))
    }
}

fn slot(entry: u32) -> usize {
    (entry % MOST_SLOTS) as usize
}

fn level(entry: u32) -> u32 {
    (entry / MOST_SLOTS) & CAMERA_LEVEL
}

/// The ray of an item as `store_item` leaves it (`shaders/ray_stack.wgsl`), begun at `t` = 0.
fn ray_of([a, b, c, d]: Item, bounds: (DVec3, DVec3)) -> ProbeRay {
    let vector = |word: Word| Vec3::from_array([word[0], word[1], word[2]].map(f32::from_bits));
    let (origin, direction) = (vector(a), vector(b));
    let shadow = b[3] & ITEM_KIND == SHADOW;
    let t_max = if shadow { f32::from_bits(c[3]) } else { T_MAX };
    let ray = begun_at_zero(origin, direction, [f32::from_bits(d[2]), t_max], bounds);
    ProbeRay {
        shadow: u32::from(shadow),
        ..ray
    }
}

/// A ray between two places along it, as one that begins at `t` = 0.
fn begun_at_zero(
    origin: Vec3,
    direction: Vec3,
    [t_min, t_max]: [f32; 2],
    bounds: (DVec3, DVec3),
) -> ProbeRay {
    let start = if t_min < 0.0 {
        t_min.max(before(origin, direction, bounds)).min(0.0)
    } else if t_min > 0.0 {
        t_min + (BEHIND_HOLES * (bounds.1 - bounds.0).length()) as f32
    } else {
        0.0
    };
    ProbeRay {
        origin: (origin + start * direction).to_array(),
        t_max: if t_max < T_MAX { t_max - start } else { t_max },
        direction: direction.to_array(),
        shadow: 0,
    }
}

/// A distance along a ray before which there is nothing of a box.
fn before(origin: Vec3, direction: Vec3, (min, max): (DVec3, DVec3)) -> f32 {
    let nearest = DVec3::select(direction.cmpge(Vec3::ZERO), min, max);
    let distance = direction.as_dvec3().dot(nearest - origin.as_dvec3());
    (distance - 1e-3 * (max - min).length()) as f32
}
