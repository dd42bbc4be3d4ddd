//! Rendering to a tolerance: a few samples to see what branches bring, one of each pixel, and then, round by round, those that a
//! [`Sampler`] orders until the picture's error fits. A slot takes a single sample, whatever pixel it is of; a pixel's are added up here.

use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use bytemuck::cast_slice;
use glam::Vec3;
use raytree_control::{Negligible, Order, Sampled, Sampler, Tolerance};
use raytree_film::{Film, progressive_pattern};
use raytree_scene::model::Background;

use crate::{
    batch::{Batch, TILE_PIXELS, Tiling, spreading_stride},
    error::RenderError,
    plan::SLOT_WORDS,
    render::{Prepared, Progress, Taken},
    statistics::{Counters, Dropped},
    types::{Frame, Slot},
    wavefront::SlotsComing,
};

/// What is kept of a time limit for ending, for each pixel: what is said of its error, and the film. Measured on two cores.
const NANOSECONDS_TO_END: u64 = 150;

/// Of the same names in `shaders/tolerance.wgsl`.
pub(crate) const STORAGE_SHIFT: u32 = 20;
pub(crate) const COMMON_RAYS: u32 = 0xf_ffff;
pub(crate) const BUDGET_MOST: u32 = 0xff_ffff;

/// Of a workgroup.
const LANES: usize = TILE_PIXELS as usize;

/// Samples that are taken at once, and come back as slots.
enum Taking {
    /// The first of a batch's pixels.
    First(Batch, SlotsComing),
    Orders(Vec<Order>, SlotsComing),
}

/// Where in a pixel samples lie, as far as they were asked for.
#[derive(Default)]
struct Pattern(Vec<[f32; 2]>);

impl Pattern {
    /// Offset from the pixel's middle, pixels.
    fn offset(&mut self, sample: u32) -> [f32; 2] {
        if sample as usize >= self.0.len() {
            self.0 = progressive_pattern((sample + 1).next_power_of_two() + 1);
        }
        self.0[sample as usize]
    }
}

impl Prepared<'_> {
    /// The picture with as many samples and as much of their trees as the tolerance needs, or as there is time for.
    pub(crate) fn take_to_tolerance(
        &self,
        tolerance: Tolerance,
        counters: &mut Counters,
        observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Taken, RenderError> {
        let mut sampling = Sampling {
            prepared: self,
            sampler: self.sampler(tolerance),
            pattern: Pattern::default(),
            dropped: Dropped::default(),
            iterations: 0,
            before: None,
        };
        sampling.take(counters, observer)?;
        Ok(sampling.develop())
    }

    fn sampler(&self, tolerance: Tolerance) -> Sampler {
        let region = self.settings.visible_region();
        let size = (region.width, region.height);
        let tiling = self.plan.layout.tiling;
        // Where time may end it, tiles that follow each other lie apart, so that there is something of all of the picture.
        let stride = match self.settings.deadline {
            Some(_) => spreading_stride(tiling.tiles),
            None => 1,
        };
        let sequence = move || pixels_by_tile(tiling, stride);
        let bound = Vec3::from(self.plan.frame.branch_bound);
        // Its square may be beyond f32.
        let bound = (bound.as_dvec3().length() / 3.0_f64.sqrt()) as f32;
        let most = self.settings.samples;
        let alpha_counts = self.scene.surroundings.background == Background::Transparent;
        let sampler = Sampler::new(size, tolerance, most, bound, alpha_counts, sequence);
        match self.settings.deadline {
            Some(_) => sampler.stepwise(),
            None => sampler,
        }
    }
}

/// A picture in the making.
struct Sampling<'p> {
    prepared: &'p Prepared<'p>,
    sampler: Sampler,
    pattern: Pattern,
    dropped: Dropped,
    iterations: u32,
    /// What the device was told last: added up while it works on the next.
    before: Option<Taking>,
}

impl Sampling<'_> {
    /// Each pixel's first sample, batch by batch.
    fn take_all(
        &mut self,
        negligible: Negligible,
        counters: &mut Counters,
        observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<(), RenderError> {
        let plan = &self.prepared.plan;
        // Some pixels will need more.
        let observer = &mut |Progress { finished }| {
            observer(Progress {
                finished: 0.5 * finished,
            })
        };
        for &batch in &plan.layout.batches {
            let frame = Frame {
                negligible: negligible.code(),
                ..plan.frame_of(batch)
            };
            let slots = self.run(frame, counters, |finished| {
                plan.tell(observer, batch, finished)
            })?;
            self.before = Some(Taking::First(batch, slots));
        }
        match self.before.take() {
            Some(last) => self.add_up(&last),
            None => Ok(()),
        }
    }

    /// What the sampler asks for, until that is nothing.
    fn take(
        &mut self,
        counters: &mut Counters,
        observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<(), RenderError> {
        let region = self.prepared.settings.visible_region();
        let pixels = u64::from(region.width) * u64::from(region.height);
        let mut pace = Pace::of(self.prepared.settings.deadline, pixels);
        loop {
            self.sampler.decide();
            if let Some(negligible) = self.sampler.takes_all() {
                self.take_all(negligible, counters, observer)?;
                continue;
            }
            let most = pace.affordable(self.prepared.plan.layout.slots as usize);
            let orders = if most == 0 {
                Vec::new()
            } else {
                self.sampler.next_orders(most)
            };
            if orders.is_empty() {
                let Some(taking) = self.before.take() else {
                    return Ok(());
                };
                self.add_up(&taking)?;
                continue;
            }
            let started = Instant::now();
            let frame = self.place(&orders);
            let finished = self.sampler.finished();
            let progress = |_| match observer(Progress { finished }) {
                ControlFlow::Break(()) => Err(RenderError::Cancelled),
                ControlFlow::Continue(()) => Ok(()),
            };
            let slots = self.run(frame, counters, progress)?;
            pace.took(orders.len(), started.elapsed());
            self.before = Some(Taking::Orders(orders, slots));
        }
    }

    /// Has the device take samples, and adds up those before.
    fn run(
        &mut self,
        frame: Frame,
        counters: &mut Counters,
        progress: impl FnMut(f64) -> Result<(), RenderError>,
    ) -> Result<SlotsComing, RenderError> {
        let Prepared {
            device, wavefront, ..
        } = self.prepared;
        let frame = with_scale(frame, &self.sampler);
        let meanwhile = || match self.before.take() {
            Some(taking) => self.add_up(&taking),
            None => Ok(()),
        };
        let iterations = wavefront.run(device, &frame, counters, progress, meanwhile)?;
        self.iterations += iterations;
        Ok(wavefront.fetch_slots(device, frame.slot_count))
    }

    /// Hands orders to the device; the frame in which they are carried out.
    fn place(&mut self, orders: &[Order]) -> Frame {
        let Prepared {
            device,
            wavefront,
            plan,
            ..
        } = self.prepared;
        let placing = Placing::of(orders.len());
        let words: Vec<[[u32; 4]; SLOT_WORDS as usize]> = (0..orders.len())
            .map(|slot| {
                let order = orders[placing.order_of(slot)];
                let [x, y] = self.pattern.offset(order.sample).map(f32::to_bits);
                [[order.pixel, x, y, order.negligible.code()], [0; 4]]
            })
            .collect();
        wavefront.write(device, "state", cast_slice(&words));
        Frame {
            slot_count: (orders.len() as u32).next_multiple_of(TILE_PIXELS),
            order_count: orders.len() as u32,
            ..plan.frame
        }
    }

    /// Waits for samples and adds them up, each pixel's in their order.
    fn add_up(&mut self, taking: &Taking) -> Result<(), RenderError> {
        let Prepared { device, plan, .. } = self.prepared;
        let dropped = &mut self.dropped;
        match taking {
            Taking::First(batch, slots) => {
                let mut first = self.sampler.first_samples();
                slots.each(device, |slot, found| {
                    if let Some(pixel) = plan.layout.tiling.pixel_of_slot(*batch, slot as u32) {
                        first.take(pixel, sampled(found, dropped));
                    }
                })?;
            }
            Taking::Orders(orders, slots) => {
                let placing = Placing::of(orders.len());
                let mut found = vec![Slot::default(); orders.len()];
                slots.each(device, |slot, come| {
                    if slot < orders.len() {
                        found[placing.order_of(slot)] = come;
                    }
                })?;
                // The picture lacks nothing of what is not shown.
                let mut unseen = Dropped::default();
                let dropped = if self.sampler.is_trying() {
                    &mut unseen
                } else {
                    dropped
                };
                for (order, slot) in orders.iter().zip(found) {
                    self.sampler.take(order, sampled(slot, dropped));
                }
            }
        }
        Ok(())
    }

    fn develop(self) -> Taken {
        let settings = self.prepared.settings;
        let region = settings.visible_region();
        let finished = self.sampler.finish();
        let film = Film {
            radiance: finished.radiance,
            alpha: finished.alpha,
            estimates: Some(finished.estimates),
            ..Film::windowed(region.width, region.height, settings.window())
        };
        Taken {
            film,
            rays: finished.rays,
            dropped: self.dropped,
            iterations: self.iterations,
            error: Some(finished.report),
        }
    }
}

/// By what branches are judged, as far as is known.
fn with_scale(frame: Frame, sampler: &Sampler) -> Frame {
    let bound = Vec3::from(frame.branch_bound);
    Frame {
        branch_bound: (sampler.branch_scale() * bound).to_array(),
        branch_mean: (sampler.branch_mean() * bound).to_array(),
        light_share: if sampler.is_trying() { 0.0 } else { 1.0 },
        ..frame
    }
}

/// What a slot says of its sample, as `packed_counts` of shaders/tolerance.wgsl has it.
fn sampled(slot: Slot, dropped: &mut Dropped) -> Sampled {
    dropped.storage += u64::from(slot.common_rays >> STORAGE_SHIFT);
    dropped.budget += u64::from(slot.dropped_storage & BUDGET_MOST);
    let [r, g, b, alpha] = slot.radiance;
    Sampled {
        radiance: [r, g, b, alpha.clamp(0.0, 1.0)],
        lost: f32::from_bits(slot.dropped_budget),
        rays: slot.rays,
    }
}

/// The window's pixels tile by tile, so that neighbours are taken together; `stride` tiles from one to the next.
fn pixels_by_tile(tiling: Tiling, stride: u32) -> Vec<u32> {
    let all = Batch {
        first_tile: 0,
        tile_count: tiling.tiles,
        stride,
    };
    (0..tiling.tiles * TILE_PIXELS)
        .filter_map(|slot| tiling.pixel_of_slot(all, slot))
        .map(|pixel| pixel as u32)
        .collect()
}

/// Which order a slot takes: whole workgroups change places, so that consecutive ones take pixels that lie apart, as tiles do where
/// there are no orders.
#[derive(Clone, Copy)]
struct Placing {
    /// Workgroups all of whose slots have orders.
    whole: usize,
    stride: usize,
}

impl Placing {
    fn of(orders: usize) -> Self {
        let whole = orders / LANES;
        Self {
            whole,
            stride: spreading_stride(whole as u32) as usize,
        }
    }

    fn order_of(self, slot: usize) -> usize {
        let (workgroup, lane) = (slot / LANES, slot % LANES);
        if workgroup >= self.whole {
            return slot;
        }
        workgroup * self.stride % self.whole * LANES + lane
    }
}

/// How many samples fit into the time that is left.
struct Pace {
    /// When the last samples have to be back.
    deadline: Option<Instant>,
    /// Seconds a sample, as of late.
    each: Option<f64>,
}

/// Samples that are taken while nothing is known of their pace.
const FIRST_SAMPLES: usize = 4096;

/// Fewer are not worth the while.
const FEWEST_SAMPLES: usize = 256;

/// As many take hardly longer than one.
const FEW_SAMPLES: usize = 2048;

impl Pace {
    fn of(deadline: Option<Instant>, pixels: u64) -> Self {
        let to_end = Duration::from_nanos(NANOSECONDS_TO_END * pixels);
        Self {
            deadline: deadline.map(|deadline| deadline.checked_sub(to_end).unwrap_or(deadline)),
            each: None,
        }
    }

    /// At most `most`; 0 when time is up.
    fn affordable(&self, most: usize) -> usize {
        let Some(deadline) = self.deadline else {
            return most;
        };
        let left = deadline.saturating_duration_since(Instant::now());
        let Some(each) = self.each else {
            return most.min(FIRST_SAMPLES);
        };
        // Half of what fits: samples may take longer than those before.
        let fit = (0.5 * left.as_secs_f64() / each) as usize;
        if fit < FEWEST_SAMPLES {
            0
        } else {
            fit.min(most)
        }
    }

    fn took(&mut self, samples: usize, time: Duration) {
        // Of few samples it is the time that any take, however few.
        self.each = Some(time.as_secs_f64() / samples.max(FEW_SAMPLES) as f64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_order_has_one_slot() {
        for count in [1, 63, 64, 65, 128, 1000, 4096, 10_007] {
            let placing = Placing::of(count);
            let mut taken: Vec<usize> = (0..count).map(|slot| placing.order_of(slot)).collect();
            taken.sort_unstable();
            assert!(taken.into_iter().eq(0..count), "{count}");
        }
    }

    #[test]
    fn every_pixel_comes_once() {
        for stride in [1, 3] {
            let mut pixels = pixels_by_tile(Tiling::new(13, 9), stride);
            pixels.sort_unstable();
            assert!(pixels.into_iter().eq(0..13 * 9), "{stride}");
        }
    }
}
