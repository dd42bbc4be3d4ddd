//! A scene, its hierarchy and settings to a film: programs, buffers, and iterations until no pixel is unfinished.

use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use bytemuck::{bytes_of, cast_slice};
use raytree_bvh::Bvh;
use raytree_control::ErrorReport;
use raytree_film::{Aovs, Film};
use raytree_scene::{features::SceneFeatures, model::Scene};

use crate::{
    ahead::Ahead,
    batch::{Batch, TILE_PIXELS},
    device::Device,
    error::RenderError,
    pass::Pass,
    plan::{Plan, Room},
    program::{Feature, Kernel, ProgramFeatures},
    settings::RenderSettings,
    source::Limits,
    statistics::{Counters, Dropped},
    types::{Aov, Frame},
    upload::GpuScene,
    wavefront::{SlotsComing, Wavefront},
};

/// How far a render is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Share of the pixels that are finished, 0 to 1.
    pub finished: f64,
}

/// A picture with what it took.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture.
    pub film: Film,
    /// Rays and work, if counted.
    pub counters: Option<Counters>,
    /// What the picture lacks.
    pub dropped: Dropped,
    /// What the program has.
    pub features: ProgramFeatures,
    /// Where the time went.
    pub times: RenderTimes,
    /// How many iterations of tracing and shading it took.
    pub iterations: u32,
    /// What was achieved of a tolerance.
    pub error: Option<ErrorReport>,
}

/// Where a render's time went.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderTimes {
    /// The scene's small tables, and what the large ones share.
    pub layout: Duration,
    /// Assembly and pipelines of kernels, as far as they were not begun ahead, or are waited for; the large tables, made while they are uploaded.
    pub program: Duration,
    /// The first dispatches, in which the driver compiles; they render nothing.
    pub compile: Duration,
    /// Of these, each kernel's, in the order of [`Kernel::PICTURE`]. What was begun ahead counts from when it is waited for.
    pub kernels: [Duration; 3],
    /// All dispatches that render, and reading back.
    pub render: Duration,
}

/// Renders a picture. `observer` is told of progress after each submission, and can end it.
///
/// # Errors
/// [`RenderError`]; [`RenderError::Cancelled`] if the observer said so.
pub fn render(
    device: &Device,
    scene: &Scene,
    bvh: &Bvh,
    settings: &RenderSettings,
    observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Rendered, RenderError> {
    let features = ProgramFeatures::of(&SceneFeatures::of(scene), settings);
    render_with(device, scene, bvh, settings, features, observer)
}

/// As [`render`], by a program with exactly these features: for checking that leaving out changes nothing.
///
/// # Errors
/// As [`render`].
pub fn render_with(
    device: &Device,
    scene: &Scene,
    bvh: &Bvh,
    settings: &RenderSettings,
    features: ProgramFeatures,
    observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Rendered, RenderError> {
    check(settings)?;
    let ahead = Ahead::begin(device, features, settings);
    render_ahead(device, scene, bvh, settings, (features, ahead), observer)
}

/// As [`render_with`], by programs some of which were begun before the hierarchy stood.
///
/// # Errors
/// As [`render`].
pub fn render_ahead(
    device: &Device,
    scene: &Scene,
    bvh: &Bvh,
    settings: &RenderSettings,
    (features, ahead): (ProgramFeatures, Ahead),
    observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Rendered, RenderError> {
    let mut prepared = Prepared::new(device, scene, bvh, settings, features)?;
    prepared.compile(ahead)?;
    prepared.render(observer)
}

/// A picture of which all is ready but the rays: [`render`] in its parts, for who times them.
pub struct Prepared<'p> {
    pub(crate) device: &'p Device,
    pub(crate) scene: &'p Scene,
    pub(crate) settings: &'p RenderSettings,
    pub(crate) features: ProgramFeatures,
    pub(crate) plan: Plan,
    pub(crate) wavefront: Wavefront,
    layers: Option<Pass>,
    times: RenderTimes,
}

impl<'p> Prepared<'p> {
    /// Lays out and uploads the scene, and makes the programs. Nothing is dispatched.
    ///
    /// # Errors
    /// As [`render`].
    pub fn new(
        device: &'p Device,
        scene: &'p Scene,
        bvh: &Bvh,
        settings: &'p RenderSettings,
        features: ProgramFeatures,
    ) -> Result<Self, RenderError> {
        check(settings)?;
        let mut times = RenderTimes::default();
        let started = Instant::now();
        let gpu_scene = GpuScene::new(scene, bvh, features, settings.shading)?;
        gpu_scene.check(device.highest_texture())?;
        times.layout = started.elapsed();

        let started = Instant::now();
        let limits = Limits::for_depth(bvh.depth);
        let room = Room::of(device);
        let plan = Plan::new(scene, &gpu_scene, bvh, settings, features, room);
        let wavefront = Wavefront::new(device, features, limits, &gpu_scene, &plan.work())?;
        let layers = settings
            .aovs
            .then(|| {
                Pass::new(
                    device,
                    Kernel::Aov,
                    // A single ray a pixel, within one dispatch.
                    features.with(Feature::LongRays, false),
                    limits,
                    &gpu_scene,
                    &plan.work(),
                )
            })
            .transpose()?;
        // What it takes of the host is not needed once all lies on the device.
        drop(gpu_scene);
        times.program = started.elapsed();
        Ok(Self {
            device,
            scene,
            settings,
            features,
            plan,
            wavefront,
            layers,
            times,
        })
    }

    /// The first dispatches, in which drivers compile. Before [`Self::render`], which would wait for them.
    ///
    /// # Errors
    /// [`RenderError::Device`].
    pub fn compile(&mut self, ahead: Ahead) -> Result<(), RenderError> {
        let (device, plan) = (self.device, &self.plan);
        let started = Instant::now();
        self.times.kernels = self.wavefront.warm_up(device, &plan.frame, ahead)?;
        if let Some(layers) = &self.layers {
            layers.warm_up(device, plan)?;
        }
        self.times.compile = started.elapsed();
        Ok(())
    }

    /// All dispatches that render, and reading back.
    ///
    /// # Errors
    /// As [`render`].
    pub fn render(
        &self,
        observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Rendered, RenderError> {
        let (device, plan, settings) = (self.device, &self.plan, self.settings);
        let mut times = self.times;
        let started = Instant::now();
        let mut counters = Counters::default();
        let taken = match settings.tolerance {
            Some(tolerance) => self.take_to_tolerance(tolerance, &mut counters, observer)?,
            None => self.take_evenly(&mut counters, observer)?,
        };
        times.render = started.elapsed();

        let Taken {
            mut film,
            rays,
            dropped,
            iterations,
            error,
        } = taken;
        if let Some(pass) = &self.layers {
            let started = Instant::now();
            film.aovs = Some(render_aovs(device, self.scene, pass, plan, rays)?);
            times.render += started.elapsed();
        }
        counters.set_dropped(dropped);
        Ok(Rendered {
            film,
            dropped,
            counters: settings.counters.then_some(counters),
            features: self.features,
            times,
            iterations,
            error,
        })
    }

    /// As many samples of each pixel as the settings say.
    fn take_evenly(
        &self,
        counters: &mut Counters,
        observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Taken, RenderError> {
        let (device, plan, settings) = (self.device, &self.plan, self.settings);
        let mut developed = Developed::of(settings);
        let mut iterations = 0;
        // A batch is developed while the device works on the next one.
        let mut finished: Option<(Batch, SlotsComing)> = None;
        for &batch in &plan.layout.batches {
            for sample in 0..settings.samples {
                let frame = plan.frame_of_sample(batch, sample);
                let progress = |finished: f64| {
                    let in_batch = (f64::from(sample) + finished) / f64::from(settings.samples);
                    plan.tell(observer, batch, in_batch)
                };
                let meanwhile = || match finished.take() {
                    Some((before, slots)) => developed.add(device, plan, before, &slots),
                    None => Ok(()),
                };
                iterations += self
                    .wavefront
                    .run(device, &frame, counters, progress, meanwhile)?;
            }
            finished = Some((batch, self.fetch(batch)));
        }
        if let Some((last, slots)) = finished {
            developed.add(device, plan, last, &slots)?;
        }
        let Developed {
            film,
            rays,
            dropped,
        } = developed;
        Ok(Taken {
            film,
            rays,
            dropped,
            iterations,
            error: None,
        })
    }

    /// Reads back once more what [`Self::render`] has left on the device: all of a picture that is a single batch, for timing that.
    ///
    /// # Errors
    /// [`RenderError::Device`].
    ///
    /// # Panics
    /// If the picture has more than one batch, of which the device keeps the last alone.
    pub fn read_back(&self) -> Result<Film, RenderError> {
        let &[batch] = self.plan.layout.batches.as_slice() else {
            panic!("the picture has {} batches", self.plan.layout.batches.len());
        };
        let mut developed = Developed::of(self.settings);
        let slots = self.fetch(batch);
        developed.add(self.device, &self.plan, batch, &slots)?;
        Ok(developed.film)
    }

    /// Begins to copy a batch's slots to the host, after all that was submitted.
    fn fetch(&self, batch: Batch) -> SlotsComing {
        let count = batch.tile_count * TILE_PIXELS;
        self.wavefront.fetch_slots(self.device, count)
    }
}

pub(crate) fn check(settings: &RenderSettings) -> Result<(), RenderError> {
    let region = settings.visible_region();
    let fail = |text: &str| Err(RenderError::Settings(text.to_owned()));
    if region.width == 0 || region.height == 0 {
        return fail("the region to render has no pixels; it must lie inside the picture");
    }
    if u64::from(region.width) * u64::from(region.height) > 1 << 28 {
        return fail(
            "the picture has more than 268 million pixels; render it in parts with --region",
        );
    }
    if settings.samples == 0 {
        return fail("a pixel needs at least one sample");
    }
    let most = match settings.tolerance {
        None => RenderSettings::MOST_EVEN_SAMPLES,
        Some(_) => RenderSettings::MOST_SAMPLES,
    };
    if settings.samples > most {
        return fail(&format!("a pixel can have at most {most} samples"));
    }
    if !(settings.min_weight >= 0.0 && settings.min_weight <= 1.0) {
        return fail("the least weight of a branch must lie between 0 and 1");
    }
    if settings.max_rays == 0 {
        return fail("a sample's tree needs room for at least its camera ray");
    }
    Ok(())
}

/// What has come of a picture's samples.
pub(crate) struct Taken {
    pub(crate) film: Film,
    /// Of each pixel.
    pub(crate) rays: Vec<u32>,
    pub(crate) dropped: Dropped,
    pub(crate) iterations: u32,
    pub(crate) error: Option<ErrorReport>,
}

/// What has come of finished batches.
struct Developed {
    film: Film,
    /// Traced for each pixel.
    rays: Vec<u32>,
    dropped: Dropped,
}

impl Developed {
    /// Black.
    fn of(settings: &RenderSettings) -> Self {
        let region = settings.visible_region();
        let film = Film::windowed(region.width, region.height, settings.window());
        Self {
            rays: vec![0; film.pixel_count()],
            dropped: Dropped::default(),
            film,
        }
    }

    /// Finished slots to pixels, when they have come.
    fn add(
        &mut self,
        device: &Device,
        plan: &Plan,
        batch: Batch,
        slots: &SlotsComing,
    ) -> Result<(), RenderError> {
        let share = f64::from(plan.sample_count).recip();
        Ok(slots.each(device, |index, slot| {
            // The others are not the picture's, and nothing is stored of them.
            if let Some(pixel) = plan.layout.tiling.pixel_of_slot(batch, index as u32) {
                self.dropped.add(&slot);
                let [r, g, b, alpha] = slot.radiance.map(|sum| (f64::from(sum) * share) as f32);
                self.film.radiance[pixel] = [r, g, b];
                self.film.alpha[pixel] = alpha.clamp(0.0, 1.0);
                self.rays[pixel] = slot.rays;
            }
        })?)
    }
}

impl Pass {
    /// A dispatch without pixels: drivers that compile at the first dispatch do it here.
    fn warm_up(&self, device: &Device, plan: &Plan) -> Result<(), RenderError> {
        let frame = Frame {
            window_size: [0, 0],
            tile_count: 1,
            tile_stride: 1,
            ..plan.frame
        };
        self.write(device, "frame", bytes_of(&frame));
        self.submit(device, 1);
        Ok(device.wait()?)
    }
}

/// The first-hit layers, by a program of their own: a picture without them does not carry their code.
fn render_aovs(
    device: &Device,
    scene: &Scene,
    pass: &Pass,
    plan: &Plan,
    rays: Vec<u32>,
) -> Result<Aovs, RenderError> {
    let mut aovs = Aovs::missed(rays.len());
    aovs.rays = rays;
    for &batch in &plan.layout.batches {
        pass.write(device, "frame", bytes_of(&plan.frame_of(batch)));
        pass.submit(device, batch.tile_count);
        let size = u64::from(batch.tile_count * TILE_PIXELS) * size_of::<Aov>() as u64;
        let bytes = pass.read(device, "aovs", size)?;
        let layers: &[Aov] = cast_slice(&bytes);
        for (layer, slot) in layers.iter().zip(0_u32..) {
            if let Some(pixel) = plan.layout.tiling.pixel_of_slot(batch, slot) {
                develop_aov(scene, layer, pixel, &mut aovs);
            }
        }
    }
    Ok(aovs)
}

fn develop_aov(scene: &Scene, layer: &Aov, pixel: usize, aovs: &mut Aovs) {
    if layer.material == u32::MAX {
        return;
    }
    let position = glam::Vec3::from(layer.position).as_dvec3();
    aovs.position[pixel] = scene.frame.to_world(position).as_vec3().to_array();
    aovs.depth[pixel] = (f64::from(layer.depth) / scene.frame.scale) as f32;
    aovs.geometric_normal[pixel] = layer.geometric_normal;
    aovs.shading_normal[pixel] = layer.shading_normal;
    aovs.albedo[pixel] = layer.albedo;
    aovs.material_id[pixel] = layer.material;
    aovs.node_id[pixel] = layer.node;
}
