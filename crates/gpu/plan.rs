//! How a picture is rendered: its layout in batches, what a pixel of a batch takes, and the frame that all kernels see.

use std::ops::ControlFlow;

use raytree_bvh::Bvh;
use raytree_control::Tolerance;
use raytree_film::sample_pattern;
use raytree_scene::model::{Background, Scene};

use crate::{
    adaptive::COMMON_RAYS,
    batch::{Batch, TILE_PIXELS, Tiling},
    branch_bound::branch_bound,
    camera::set_camera,
    device::Device,
    error::RenderError,
    pass::Work,
    program::{Feature, ProgramFeatures},
    render::Progress,
    settings::RenderSettings,
    solids::camera_media,
    source::Limits,
    types::Frame,
    upload::{GpuScene, in_range},
    wavefront::STEP_BUDGET,
};

/// Bytes of a word of the state.
pub(crate) const WORD_BYTES: u64 = 16;

/// What a slot takes in it beside its stack: of the same names in `shaders/state.wgsl`.
pub(crate) const SLOT_WORDS: u32 = 2;
pub(crate) const HIT_WORDS: u32 = 1;

/// A work item on the ray stack, at most; of the same name there.
pub(crate) const ITEM_WORDS: u32 = 4;

/// What a batch may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    /// Slots.
    pixels: u32,
    /// Their state.
    state_bytes: u64,
}

impl Room {
    /// What a processor's caches and memory can do with.
    pub(crate) const CPU: Self = Self {
        pixels: 1 << 16,
        state_bytes: 64 << 20,
    };

    /// A GPU has a hundred thousand lanes to fill, and waits as long for few rays as for many.
    const GPU: Self = Self {
        pixels: 1 << 20,
        state_bytes: 1 << 30,
    };

    pub(crate) fn of(device: &Device) -> Self {
        if device.info().cpu {
            return Self::CPU;
        }
        Self {
            state_bytes: Self::GPU.state_bytes.min(device.largest_binding()),
            ..Self::GPU
        }
    }
}

/// Of the same names in `shaders/ray_stack.wgsl`.
pub(crate) const ITEMS_TO_TRACE: u32 = 1;
pub(crate) const ITEMS_OF_LIGHTS: u32 = 1;

/// Words of 16 bytes; of the same name in `shaders/ray_stack.wgsl` and `shaders/traverse.wgsl`.
pub(crate) const CONTACT_WORDS: u32 = 5;
pub(crate) const TRAVERSAL_WORDS: u32 = 4;

/// Of the same name in `shaders/traversal_stack.wgsl`.
pub(crate) const STACK_VARIABLES: u32 = 4;

/// Slots and levels of a stack that an entry of a list can name (`shaders/work_lists.wgsl`).
pub(crate) const MOST_SLOTS: u32 = 1 << 20;
pub(crate) const MOST_LEVELS: u32 = CAMERA_LEVEL;

/// Times that the weight of a branch can halve, after it is that of the tolerance, before it does not matter: what is then left out for
/// want of room is 8,000 times less, and counted with the rest.
const HALVINGS_BELOW: f32 = 13.0;

/// .. and before it matters to no tolerance.
const MOST_HALVINGS: u32 = 40;

/// How often the weight of a branch can halve before it does not matter to a tolerance. Not more than it takes: the stack's size decides
/// how many pixels are worked on at once.
fn halvings(tolerance: Tolerance) -> u32 {
    let to_tolerance = -tolerance.allowed(0.0).min(1.0).log2();
    ((to_tolerance + HALVINGS_BELOW).ceil() as u32).min(MOST_HALVINGS)
}

/// What an entry names instead of a level for a camera ray; of the same name there.
pub(crate) const CAMERA_LEVEL: u32 = (1 << 10) - 1;

/// What is the same for all of a picture, for kernels that render none.
pub(crate) fn frame_of(
    scene: &Scene,
    gpu: &GpuScene,
    bvh: &Bvh,
    settings: &RenderSettings,
    features: ProgramFeatures,
) -> Frame {
    Plan::new(scene, gpu, bvh, settings, features, Room::CPU).frame
}

/// A picture's layout in batches, and what a slot takes.
pub(crate) struct Layout {
    pub(crate) tiling: Tiling,
    pub(crate) batches: Vec<Batch>,
    /// Slots that can be worked on at once.
    pub(crate) slots: u32,
    slot_bytes: u64,
    stack_capacity: u32,
    item_words: u32,
    beside_stack_words: u32,
    /// Slots may take what they are ordered to, not the pixels of tiles.
    orders: bool,
}

impl Layout {
    /// Of the scene it takes no more than what its features are, and the limits that its hierarchy needs.
    pub(crate) fn new(
        settings: &RenderSettings,
        features: ProgramFeatures,
        limits: Limits,
        room: Room,
    ) -> Self {
        let region = settings.visible_region();
        let tiling = Tiling::new(region.width, region.height);
        // Depth first: each level of the tree leaves all children but one pending. Trees too deep for an entry's bits lose branches,
        // which are counted.
        let waiting = features.children().saturating_sub(1);
        let depth = match settings.tolerance {
            // The heaviest child is traced last: others wait once for each time that the weight halves (`heaviest_first`).
            Some(tolerance) => settings.max_depth.min(halvings(tolerance)),
            None => settings.max_depth,
        };
        let stack_capacity = waiting
            .saturating_mul(depth)
            .saturating_add(1)
            .min(MOST_LEVELS - extra_items(features));
        let item_words = item_words(features);
        let mut beside_stack_words = 0;
        if features.has(Feature::Contact) {
            beside_stack_words += CONTACT_WORDS;
        }
        if features.has(Feature::LongRays) {
            let below = limits.traversal_stack - STACK_VARIABLES;
            beside_stack_words += TRAVERSAL_WORDS + below.div_ceil(2);
        }
        let stack_words = (stack_capacity + extra_items(features)) * item_words;
        let slot_words = SLOT_WORDS + HIT_WORDS + stack_words + beside_stack_words;
        let slot_bytes = WORD_BYTES * u64::from(slot_words);
        let batch_pixels = settings.batch_pixels.unwrap_or(room.pixels).min(MOST_SLOTS);
        let slots = (room.state_bytes / slot_bytes).min(u64::from(batch_pixels)) as u32;
        let tiles_at_once = (slots / TILE_PIXELS).max(1);
        Self {
            tiling,
            batches: tiling.batches(tiles_at_once),
            slots: tiles_at_once * TILE_PIXELS,
            slot_bytes,
            stack_capacity,
            item_words,
            beside_stack_words,
            orders: settings.tolerance.is_some(),
        }
    }

    /// Slots that there have to be.
    fn needed(&self) -> u32 {
        let tiles = self.batches.iter().map(|batch| batch.tile_count);
        if self.orders {
            self.slots
        } else {
            tiles.max().unwrap_or(0) * TILE_PIXELS
        }
    }

    /// What is done at once.
    pub(crate) fn work(&self) -> Work {
        Work {
            slots: self.needed(),
            slot_bytes: self.slot_bytes,
        }
    }
}

/// A picture's layout, and the frame that its batches share.
pub(crate) struct Plan {
    pub(crate) frame: Frame,
    pub(crate) layout: Layout,
    /// Where they lie, from the middle of a pixel; none to a tolerance.
    pub(crate) samples: Vec<[f32; 2]>,
    pub(crate) sample_count: u32,
}

impl Plan {
    pub(crate) fn new(
        scene: &Scene,
        gpu: &GpuScene,
        bvh: &Bvh,
        settings: &RenderSettings,
        features: ProgramFeatures,
        room: Room,
    ) -> Self {
        let region = settings.visible_region();
        let layout = Layout::new(settings, features, Limits::for_depth(bvh.depth), room);
        let samples = match settings.tolerance {
            // Orders say where.
            Some(_) => Vec::new(),
            None => sample_pattern(settings.samples),
        };
        let mut frame = Frame {
            max_depth: settings.max_depth,
            light_count: scene.lights.len() as u32,
            min_weight: settings.min_weight,
            max_rays: most_rays(settings),
            ambient: in_range(scene.surroundings.ambient).to_array(),
            picture_size: [settings.width as f32, settings.height as f32],
            window_origin: [region.x, region.y],
            window_size: [region.width, region.height],
            tile_columns: layout.tiling.columns,
            stack_capacity: layout.stack_capacity,
            item_words: layout.item_words,
            beside_stack_words: layout.beside_stack_words,
            step_budget: STEP_BUDGET,
            tolerance: settings.numerics.tolerance,
            ..gpu.frame()
        };
        if features.has(Feature::Solids) {
            frame.camera_media = camera_media(scene, settings.shading, &settings.camera);
        }
        if features.has(Feature::Tolerance) {
            frame.branch_bound = branch_bound(scene, settings).to_array();
        }
        let rotation = scene
            .surroundings
            .environment
            .as_ref()
            .map_or(0.0, |environment| environment.rotation);
        frame.rotation_cos = rotation.cos() as f32;
        frame.rotation_sin = rotation.sin() as f32;
        set_background(&mut frame, scene.surroundings.background);
        set_camera(&mut frame, &settings.camera, settings, scene.bounds());
        Self {
            frame,
            layout,
            samples,
            sample_count: settings.samples,
        }
    }

    pub(crate) fn work(&self) -> Work {
        self.layout.work()
    }

    /// Tells how far the picture is when of a batch the share `in_batch` is finished.
    pub(crate) fn tell(
        &self,
        observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
        batch: Batch,
        in_batch: f64,
    ) -> Result<(), RenderError> {
        let tiles = f64::from(batch.first_tile) + f64::from(batch.tile_count) * in_batch;
        let finished = tiles / f64::from(self.layout.tiling.tiles);
        match observer(Progress { finished }) {
            ControlFlow::Break(()) => Err(RenderError::Cancelled),
            ControlFlow::Continue(()) => Ok(()),
        }
    }

    /// For a sample of each pixel of a batch.
    pub(crate) fn frame_of_sample(&self, batch: Batch, sample: u32) -> Frame {
        Frame {
            sample,
            sample_offset: self.samples[sample as usize],
            ..self.frame_of(batch)
        }
    }

    pub(crate) fn frame_of(&self, batch: Batch) -> Frame {
        Frame {
            first_tile: batch.first_tile,
            tile_count: batch.tile_count,
            tile_stride: batch.stride,
            slot_count: batch.tile_count * TILE_PIXELS,
            ..self.frame
        }
    }
}

/// As in `shaders/ray_stack.wgsl`.
pub(crate) fn extra_items(features: ProgramFeatures) -> u32 {
    if features.has(Feature::ManyLights) {
        ITEMS_TO_TRACE + ITEMS_OF_LIGHTS
    } else {
        ITEMS_TO_TRACE
    }
}

/// Words of a stacked item that are in use: its last one holds the ray's media, and where it goes on behind a hole.
fn item_words(features: ProgramFeatures) -> u32 {
    if features.has(Feature::Solids) || features.has(Feature::Mask) {
        ITEM_WORDS
    } else {
        ITEM_WORDS - 1
    }
}

/// Of a sample that is taken to a tolerance, the half of them that is common is counted in fewer bits.
fn most_rays(settings: &RenderSettings) -> u32 {
    match settings.tolerance {
        Some(_) => settings.max_rays.min(2 * COMMON_RAYS),
        None => settings.max_rays,
    }
}

fn set_background(frame: &mut Frame, background: Background) {
    (frame.background_kind, frame.background) = match background {
        Background::Environment => (0, [0.0; 3]),
        Background::Color(color) => (1, in_range(color).to_array()),
        Background::Transparent => (2, [0.0; 3]),
    };
}
