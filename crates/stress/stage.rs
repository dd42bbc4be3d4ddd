//! What a case works with: the device, and the table that it fills.

use std::{ops::ControlFlow, time::Instant};

use raytree_bvh::{Bvh, BvhError, Preset};
use raytree_film::FilmError;
use raytree_gpu::{
    Device, Numerics, Piece, PieceCall, PieceResult, Prober, ProgramFeatures, RenderError,
    RenderSettings, Rendered, SecondaryProber, build_bvh, evaluate, render,
    types::{ProbeHit, ProbeRay},
};
use raytree_scene::{
    environment::EnvironmentError, features::SceneFeatures, import::ImportError, model::Scene,
};

use crate::report::{Limit, Row};

/// A case could not be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StressError {
    /// The renderer refused.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// There is no hierarchy for the scene.
    #[error(transparent)]
    Bvh(#[from] BvhError),
    /// A file that the case made can't be read.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// A picture that the case made can't be written or read.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// An environment map that the case made can't be read.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// A file that the case made can't be written.
    #[error("a scene of the suite can't be written to a temporary folder: {0}")]
    Io(#[from] std::io::Error),
}

/// A running case.
pub struct Stage<'a> {
    device: &'a Device,
    case: &'static str,
    numerics: Numerics,
    observer: &'a mut dyn FnMut(&Row),
    rows: Vec<Row>,
    rays: u64,
    started: Instant,
}

impl<'a> Stage<'a> {
    pub(crate) fn new(
        device: &'a Device,
        case: &'static str,
        numerics: Numerics,
        observer: &'a mut dyn FnMut(&Row),
    ) -> Self {
        Self {
            device,
            case,
            numerics,
            observer,
            rows: Vec::new(),
            rays: 0,
            started: Instant::now(),
        }
    }

    pub(crate) fn into_rows(self) -> Vec<Row> {
        self.rows
    }

    /// What renders.
    #[must_use]
    pub fn device(&self) -> &'a Device {
        self.device
    }

    /// What is done against rounding: all, or in a run for comparison what the book does. For cases that bring their own device
    /// code; [`Self::render`] and the probers see to it.
    #[must_use]
    pub fn numerics(&self) -> Numerics {
        self.numerics
    }

    /// Renders, and counts the rays for the next row.
    ///
    /// # Errors
    /// [`StressError`].
    pub fn render(
        &mut self,
        scene: &Scene,
        settings: &RenderSettings,
    ) -> Result<Rendered, StressError> {
        let bvh = build_bvh(scene, Preset::default())?;
        let settings = RenderSettings {
            counters: true,
            numerics: self.numerics,
            ..settings.clone()
        };
        let unobserved = &mut |_| ControlFlow::Continue(());
        let rendered = render(self.device, scene, &bvh, &settings, unobserved)?;
        self.rays += rendered
            .counters
            .as_ref()
            .map_or(0, |counters| counters.rays.total());
        Ok(rendered)
    }

    /// A scene to trace rays against in more than one go, by a program with all that its geometry needs. Rays are for the caller
    /// to count.
    ///
    /// # Errors
    /// [`StressError`].
    pub fn prober(&self, scene: &Scene) -> Result<Prober<'a>, StressError> {
        let bvh = build_bvh(scene, Preset::default())?;
        Ok(Prober::new(
            self.device,
            scene,
            &bvh,
            features(scene),
            self.numerics,
        )?)
    }

    /// As [`Self::prober`], to follow rays that leave a hit.
    ///
    /// # Errors
    /// [`StressError`].
    pub fn secondary_prober(&self, scene: &Scene) -> Result<SecondaryProber<'a>, StressError> {
        let bvh = build_bvh(scene, Preset::default())?;
        Ok(SecondaryProber::new(
            self.device,
            scene,
            &bvh,
            features(scene),
            self.numerics,
        )?)
    }

    /// What each ray hits, by a program with all that the scene's geometry needs. Counts the rays for the next row.
    ///
    /// # Errors
    /// [`StressError`].
    pub fn probe(
        &mut self,
        scene: &Scene,
        bvh: &Bvh,
        rays: &[ProbeRay],
    ) -> Result<Vec<ProbeHit>, StressError> {
        let prober = Prober::new(self.device, scene, bvh, features(scene), self.numerics)?;
        let hits = prober.trace(rays)?;
        self.count_rays(rays.len() as u64);
        Ok(hits)
    }

    /// What a single function of the shaders makes of each call, with the buffers of a picture of `scene` with `settings`. Counts
    /// the calls as rays for the next row.
    ///
    /// # Errors
    /// [`StressError`].
    pub fn evaluate(
        &mut self,
        piece: Piece,
        scene: &Scene,
        settings: &RenderSettings,
        calls: &[PieceCall],
    ) -> Result<Vec<PieceResult>, StressError> {
        let results = evaluate(self.device, piece, scene, settings, calls)?;
        self.count_rays(calls.len() as u64);
        Ok(results)
    }

    /// Rays that ran outside of [`Self::render`] and [`Self::probe`].
    pub fn count_rays(&mut self, rays: u64) {
        self.rays += rays;
    }

    /// Adds a row: what was tried since the last one, what came out, and what it is held to.
    pub fn record(&mut self, parameter: impl Into<String>, measured: f64, limit: Limit) {
        self.push(parameter.into(), measured, limit, None);
    }

    /// As [`Self::record`], with a remark.
    pub fn record_with(
        &mut self,
        parameter: impl Into<String>,
        measured: f64,
        limit: Limit,
        note: impl Into<String>,
    ) {
        self.push(parameter.into(), measured, limit, Some(note.into()));
    }

    /// Adds a row for what could not be measured: it fails.
    pub fn fail(&mut self, parameter: impl Into<String>, why: impl Into<String>) {
        self.push(
            parameter.into(),
            f64::NAN,
            Limit::AtMost(0.0),
            Some(why.into()),
        );
    }

    fn push(&mut self, parameter: String, measured: f64, limit: Limit, note: Option<String>) {
        let row = Row {
            case: self.case,
            parameter,
            measured,
            book: None,
            limit,
            rays: std::mem::take(&mut self.rays),
            seconds: self.started.elapsed().as_secs_f64(),
            note,
        };
        self.started = Instant::now();
        (self.observer)(&row);
        self.rows.push(row);
    }
}

/// What rays without a camera need of a scene.
fn features(scene: &Scene) -> ProgramFeatures {
    let camera =
        raytree_scene::default_view::frame_scene(glam::DVec3::NEG_ONE, glam::DVec3::ONE, 1.0);
    let settings = RenderSettings::new(1, 1, camera);
    ProgramFeatures::of(&SceneFeatures::of(scene), &settings)
}
