//! Pictures, pixels and single rays.

use std::ops::{Add, AddAssign};

use raytree_scene::model::Camera;

use crate::intersect::{Hit, Ray};
use crate::media::Media;
use crate::radiance::Tracer;
use crate::surface::FirstHit;
use crate::vec::{Rgb, Vec3};
use crate::{Oracle, camera};

/// How many threads share a picture's rows.
const THREADS: usize = 2;

/// Which equation is solved at a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// glTF 2.0 appendix B.
    #[default]
    Pbr,
    /// Foley et al., eq. 14.32.
    Whitted,
}

/// What is rendered, and how far rays are followed.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Of the whole picture, pixels.
    pub width: u32,
    /// Of the whole picture, pixels.
    pub height: u32,
    /// The part of it that is rendered: left, top, width, height; pixels.
    pub window: (u32, u32, u32, u32),
    /// Each pixel's samples: offsets from its middle, pixels, to the right and down. At least one.
    pub samples: Vec<[f32; 2]>,
    /// A ray of this depth spawns none (camera rays have 0).
    pub max_depth: u32,
    /// A ray whose throughput is below this in every channel is not spawned.
    pub min_weight: f64,
    /// Which equation.
    pub shading: Shading,
}

impl Settings {
    /// The whole picture, one sample in the middle of each pixel, and the renderer's defaults.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            window: (0, 0, width, height),
            samples: vec![[0.0, 0.0]],
            max_depth: 8,
            min_weight: 1.0 / 256.0,
            shading: Shading::default(),
        }
    }
}

/// Rays by what they were for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rays {
    /// From the camera.
    pub primary: u64,
    /// Towards lights; one for each light that would contribute if nothing were in its way.
    pub shadow: u64,
    /// Mirrored at a surface.
    pub reflection: u64,
    /// Bent into or out of a solid, or straight on through a thin wall or past a BLEND surface.
    pub refraction: u64,
}

/// Why branches ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ended {
    /// Nothing was hit.
    pub miss: u64,
    /// The throughput was below the minimum.
    pub weight: u64,
    /// The depth was above the maximum.
    pub depth: u64,
    /// The stack of media was full.
    pub storage: u64,
}

/// What rendering took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rays traced.
    pub rays: Rays,
    /// Branches ended.
    pub ended: Ended,
}

impl Add for Counts {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            rays: Rays {
                primary: self.rays.primary + other.rays.primary,
                shadow: self.rays.shadow + other.rays.shadow,
                reflection: self.rays.reflection + other.rays.reflection,
                refraction: self.rays.refraction + other.rays.refraction,
            },
            ended: Ended {
                miss: self.ended.miss + other.ended.miss,
                weight: self.ended.weight + other.ended.weight,
                depth: self.ended.depth + other.ended.depth,
                storage: self.ended.storage + other.ended.storage,
            },
        }
    }
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// The rendered window, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Of the window, pixels.
    pub width: u32,
    /// Of the window, pixels.
    pub height: u32,
    /// Linear RGB, the mean of each pixel's samples.
    pub radiance: Vec<[f64; 3]>,
    /// Share of each pixel's samples that did not reach the background.
    pub alpha: Vec<f64>,
    /// Rays traced.
    pub rays: Rays,
    /// Branches ended.
    pub ended: Ended,
}

impl Picture {
    /// The radiance of a pixel of the window.
    #[must_use]
    pub fn at(&self, x: u32, y: u32) -> [f64; 3] {
        self.radiance[y as usize * self.width as usize + x as usize]
    }
}

/// A pixel's mean.
#[derive(Clone, Copy)]
struct Pixel {
    radiance: Rgb,
    alpha: f64,
}

impl Oracle<'_> {
    /// Renders the window; the same picture every time, though on more than one thread.
    #[must_use]
    pub fn render(&self, camera: &Camera, settings: &Settings) -> Picture {
        let (_, top, width, height) = settings.window;
        let every_other_row = |first: usize| -> Vec<(Vec<Pixel>, Counts)> {
            let rows = (top..top + height).skip(first).step_by(THREADS);
            rows.map(|y| self.row(camera, settings, y)).collect()
        };
        let mut interleaved: Vec<_> = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..THREADS)
                .map(|first| scope.spawn(move || every_other_row(first)))
                .collect();
            let rows = workers.into_iter().map(|worker| match worker.join() {
                Ok(rows) => rows.into_iter(),
                Err(panic) => std::panic::resume_unwind(panic),
            });
            rows.collect()
        });

        let mut counts = Counts::default();
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height as usize {
            if let Some((row, row_counts)) = interleaved[y % THREADS].next() {
                pixels.extend(row);
                counts += row_counts;
            }
        }
        Picture {
            width,
            height,
            radiance: pixels
                .iter()
                .map(|pixel| pixel.radiance.to_array())
                .collect(),
            alpha: pixels.iter().map(|pixel| pixel.alpha).collect(),
            rays: counts.rays,
            ended: counts.ended,
        }
    }

    /// The radiance of pixel `(x, y)` of the whole picture.
    #[must_use]
    pub fn radiance(&self, camera: &Camera, settings: &Settings, x: u32, y: u32) -> [f64; 3] {
        self.shifted_radiance(camera, settings, (x, y), [0.0, 0.0])
            .to_array()
    }

    /// What the first sample of pixel `(x, y)` of the whole picture sees first.
    #[must_use]
    pub fn first_hit(
        &self,
        camera: &Camera,
        settings: &Settings,
        x: u32,
        y: u32,
    ) -> Option<FirstHit> {
        let sample = settings.samples.first()?;
        let ray = sample_ray(camera, settings, (x, y), *sample, [0.0, 0.0]);
        self.first_hit_of(&ray, settings.shading)
    }

    /// The closest hit along `origin + t direction`, `t > 0`, of a surface that radiance rays see: neither cut out nor
    /// culled.
    #[must_use]
    pub fn closest_hit(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        shading: Shading,
    ) -> Option<Hit> {
        self.closest(&Ray::new(origin.into(), direction.into()), shading)
    }

    /// Whether any surface, opaque or not, culled or not, but not cut out, is met at `0 < t < t_max`.
    #[must_use]
    pub fn occluded(&self, origin: [f64; 3], direction: [f64; 3], t_max: f64) -> bool {
        const END: f64 = -1.0;
        let ray = Ray::new(origin.into(), direction.into());
        let mut occluded = false;
        self.tree.walk(&ray, t_max, &mut |hit| {
            occluded = hit.t < t_max && !self.is_cut_out(&hit);
            if occluded { END } else { t_max }
        });
        occluded
    }

    /// Share of light, per channel, that gets from `origin` (outside of all solids) as far as `distance` (which may be
    /// infinite) in `direction`, not bent. Black where solids are nested too deep.
    #[must_use]
    pub fn visibility_along(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        distance: f64,
        shading: Shading,
    ) -> [f64; 3] {
        let direction = Vec3::from(direction).normalized();
        let ray = Ray::new(origin.into(), direction);
        let share = self.visibility(&ray, distance, &Media::default(), shading);
        share.unwrap_or(Rgb::ZERO).to_array()
    }

    /// The radiance of a pixel with all samples moved by `shift`, pixels.
    pub(crate) fn shifted_radiance(
        &self,
        camera: &Camera,
        settings: &Settings,
        pixel: (u32, u32),
        shift: [f64; 2],
    ) -> Rgb {
        self.pixel(&mut self.tracer(camera, settings), camera, pixel, shift)
            .radiance
    }

    fn tracer<'a>(&'a self, camera: &Camera, settings: &'a Settings) -> Tracer<'a> {
        Tracer {
            oracle: self,
            settings,
            camera_media: self.camera_media(camera, settings.shading),
            counts: Counts::default(),
        }
    }

    fn row(&self, camera: &Camera, settings: &Settings, y: u32) -> (Vec<Pixel>, Counts) {
        let (left, _, width, _) = settings.window;
        let mut tracer = self.tracer(camera, settings);
        let row = (left..left + width)
            .map(|x| self.pixel(&mut tracer, camera, (x, y), [0.0, 0.0]))
            .collect();
        (row, tracer.counts)
    }

    fn pixel(
        &self,
        tracer: &mut Tracer,
        camera: &Camera,
        pixel: (u32, u32),
        shift: [f64; 2],
    ) -> Pixel {
        let settings = tracer.settings;
        let mut sum = Pixel {
            radiance: Rgb::ZERO,
            alpha: 0.0,
        };
        for &sample in &settings.samples {
            let seen = tracer.camera_ray(&sample_ray(camera, settings, pixel, sample, shift));
            sum.radiance += seen.radiance;
            sum.alpha += 1.0 - seen.transparency;
        }
        let count = settings.samples.len().max(1) as f64;
        Pixel {
            radiance: sum.radiance * (1.0 / count),
            alpha: sum.alpha / count,
        }
    }
}

fn sample_ray(
    camera: &Camera,
    settings: &Settings,
    (x, y): (u32, u32),
    [sx, sy]: [f32; 2],
    [dx, dy]: [f64; 2],
) -> Ray {
    let px = f64::from(x) + 0.5 + f64::from(sx) + dx;
    let py = f64::from(y) + 0.5 + f64::from(sy) + dy;
    camera::ray(camera, (settings.width, settings.height), px, py)
}
