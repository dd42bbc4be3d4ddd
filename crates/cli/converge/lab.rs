//! Where settings are rendered, once with all that is counted, and then against the clock.

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use raytree::{
    Ahead, Device, Film, Picture, Prepared, ProgramFeatures, RenderError, RenderSettings, Rendered,
    Scene, SceneFeatures, build_bvh,
};
use raytree_converge::{Build, Bvh, Rays, Run, Setting};

use crate::cancel;
use crate::converge::cpu_time;
use crate::converge::settings::{preset, render_settings};
use crate::failure::Interrupted;
use crate::render::as_interruption;

/// Scene and device, with the hierarchies that were built so far.
pub struct Lab<'a> {
    pub scene: &'a Scene,
    pub device: &'a Device,
    /// Camera, size, and what a sweep does not vary.
    pub base: &'a RenderSettings,
    hierarchies: HashMap<&'static str, raytree::Bvh>,
}

/// What runs of the same setting have in common.
pub struct Counted {
    pub film: Film,
    pub rays: Rays,
    pub dropped: u64,
    pub fingerprint: u64,
    pub estimated_rmse: Option<f64>,
}

impl<'a> Lab<'a> {
    pub fn new(scene: &'a Scene, device: &'a Device, base: &'a RenderSettings) -> Self {
        Self {
            scene,
            device,
            base,
            hierarchies: HashMap::new(),
        }
    }

    /// Renders with counters on, which costs a few percent of time: not for the clock.
    pub fn counted(&mut self, setting: &Setting) -> anyhow::Result<Counted> {
        let settings = RenderSettings {
            counters: true,
            ..render_settings(self.base, setting)
        };
        let (rendered, _) = self.render(setting, &settings)?;
        let rays = rendered.counters.unwrap_or_default().rays;
        Ok(Counted {
            rays: Rays {
                primary: rays.primary,
                shadow: rays.shadow,
                reflection: rays.reflection,
                refraction: rays.refraction,
            },
            dropped: rendered.dropped.total(),
            fingerprint: fingerprint(&rendered.film),
            estimated_rmse: super::settings::estimated_rmse(&rendered),
            film: rendered.film,
        })
    }

    /// The picture alone.
    pub fn picture(&mut self, setting: &Setting) -> anyhow::Result<Picture> {
        let settings = render_settings(self.base, setting);
        let (rendered, _) = self.render(setting, &settings)?;
        Ok(Picture::from(&rendered.film))
    }

    /// The picture, unless rendering it takes longer than `limit`.
    pub fn picture_within(
        &mut self,
        setting: &Setting,
        limit: Duration,
    ) -> anyhow::Result<Option<Picture>> {
        let settings = render_settings(self.base, setting);
        let rendered = self.render_within(setting, &settings, Some(limit))?;
        Ok(rendered.map(|(rendered, _)| Picture::from(&rendered.film)))
    }

    /// Renders against the clock; also the picture's fingerprint.
    pub fn timed(
        &mut self,
        setting: &Setting,
        round: u32,
        session: u32,
    ) -> anyhow::Result<(Run, u64)> {
        let settings = render_settings(self.base, setting);
        let (rendered, times) = self.render(setting, &settings)?;
        let run = Run {
            setting: *setting,
            round,
            session,
            wall_s: times.wall.as_secs_f64(),
            cpu_s: times.cpu,
            prepare_s: (rendered.times.layout + rendered.times.program).as_secs_f64(),
            compile_s: rendered.times.compile.as_secs_f64(),
        };
        Ok((run, fingerprint(&rendered.film)))
    }

    /// Builds a hierarchy against the clock.
    pub fn build(&mut self, bvh: Bvh, round: u32) -> anyhow::Result<Build> {
        let started = Instant::now();
        let built = build_bvh(self.scene, preset(bvh))?;
        let wall_s = started.elapsed().as_secs_f64();
        self.hierarchies.insert(name(bvh), built);
        Ok(Build { bvh, round, wall_s })
    }

    fn render(
        &mut self,
        setting: &Setting,
        settings: &RenderSettings,
    ) -> anyhow::Result<(Rendered, Times)> {
        let rendered = self.render_within(setting, settings, None)?;
        // Without a limit only a signal ends it.
        rendered.ok_or_else(|| Interrupted.into())
    }

    /// Prepared anew for each run: what many settings keep on the device at once would be gigabytes. `None`: it took longer than
    /// `limit`.
    fn render_within(
        &mut self,
        setting: &Setting,
        settings: &RenderSettings,
        limit: Option<Duration>,
    ) -> anyhow::Result<Option<(Rendered, Times)>> {
        cancel::check()?;
        if !self.hierarchies.contains_key(name(setting.bvh)) {
            self.build(setting.bvh, 0)?;
        }
        let bvh = &self.hierarchies[name(setting.bvh)];
        let features = ProgramFeatures::of(&SceneFeatures::of(self.scene), settings);
        let ahead = Ahead::begin(self.device, features, settings);
        let mut prepared = Prepared::new(self.device, self.scene, bvh, settings, features)?;
        prepared.compile(ahead)?;

        let before = cpu_time::seconds();
        let started = Instant::now();
        let mut observer = |_| {
            let late = limit.is_some_and(|limit| started.elapsed() > limit);
            match late || cancel::requested() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        };
        let result = prepared.render(&mut observer);
        let wall = started.elapsed();
        let cpu = before
            .zip(cpu_time::seconds())
            .map(|(before, after)| after - before);
        match result {
            Ok(rendered) if limit.is_none_or(|limit| wall <= limit) => {
                Ok(Some((rendered, Times { wall, cpu })))
            }
            Ok(_) => Ok(None),
            Err(RenderError::Cancelled) if !cancel::requested() => Ok(None),
            Err(error) => Err(as_interruption(error)),
        }
    }
}

/// Of rendering and reading back.
struct Times {
    wall: Duration,
    cpu: Option<f64>,
}

fn name(bvh: Bvh) -> &'static str {
    match bvh {
        Bvh::Fast => "fast",
        Bvh::Balanced => "balanced",
        Bvh::Best => "best",
    }
}

/// Of a film's bits.
fn fingerprint(film: &Film) -> u64 {
    let mut hash = super::key::Hash::default();
    for channel in film.radiance.as_flattened().iter().chain(&film.alpha) {
        hash.add(&channel.to_bits().to_le_bytes());
    }
    hash.value()
}
