//! The recursion: the light that comes back along a ray.

use crate::fresnel::{Dielectric, kept_on_side, reflected};
use crate::intersect::{Hit, Ray};
use crate::light::{Incident, incident};
use crate::media::{Full, Media};
use crate::render::{Counts, Settings, Shading};
use crate::surface::Surface;
use crate::vec::{Rgb, Vec3};
use crate::{Oracle, environment, material, pbr, whitted};

/// Walks ray trees, and counts.
pub(crate) struct Tracer<'a> {
    pub oracle: &'a Oracle<'a>,
    pub settings: &'a Settings,
    /// The solids that the camera is in.
    pub camera_media: Media,
    pub counts: Counts,
}

/// What a ray brings back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub radiance: Rgb,
    /// Share of the ray that reached the background straight on.
    pub transparency: f64,
}

impl Seen {
    const NOTHING: Self = Self {
        radiance: Rgb::ZERO,
        transparency: 0.0,
    };
}

/// How a ray came to be where it is.
#[derive(Clone, Debug)]
struct History {
    /// Product of all weights from the camera to here, absorption included.
    throughput: Rgb,
    /// The solids that the ray is in.
    media: Media,
    /// Camera ray: 0.
    depth: u32,
    /// From the camera, at most through BLEND surfaces.
    straight: bool,
}

/// What a spawned ray is counted as.
#[derive(Clone, Copy)]
enum RayKind {
    Reflection,
    Refraction,
}

/// A surface that a ray has arrived at, ready to be shaded.
pub(crate) struct Arrival<'s> {
    pub surface: Surface<'s>,
    pub dielectric: Dielectric,
    /// Where a reflected ray goes.
    pub wr: Vec3,
    /// Where a refracted ray goes; `None` in total internal reflection.
    pub wt: Option<Vec3>,
    history: History,
    /// The solids that a refracted ray is in.
    beyond: Result<Media, Full>,
}

impl Oracle<'_> {
    /// The closest hit that counts for radiance rays.
    pub(crate) fn closest(&self, ray: &Ray, shading: Shading) -> Option<Hit> {
        self.closest_before(ray, f64::INFINITY, |hit| {
            self.counts_for_radiance(hit, shading)
        })
    }

    /// The closest of the hits before `distance` that `counts` accepts; of equal ones, that of the lowest triangle index.
    pub(crate) fn closest_before(
        &self,
        ray: &Ray,
        distance: f64,
        counts: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        let mut closest: Option<Hit> = None;
        self.tree.walk(ray, distance, &mut |hit| {
            let nearer = hit.t < distance && closest.is_none_or(|other| hit.precedes(&other));
            if nearer && ray.leaving != Some(hit.triangle) && counts(&hit) {
                closest = Some(hit);
            }
            closest.map_or(distance, |hit| hit.t)
        });
        closest
    }

    fn counts_for_radiance(&self, hit: &Hit, shading: Shading) -> bool {
        let culled = hit.back && material::culls_backs(self.material(hit), shading);
        !culled && !self.is_cut_out(hit)
    }
}

impl<'a> Tracer<'a> {
    pub fn camera_ray(&mut self, ray: &Ray) -> Seen {
        self.counts.rays.primary += 1;
        let history = History {
            throughput: Rgb::ONE,
            media: self.camera_media.clone(),
            depth: 0,
            straight: true,
        };
        self.radiance(ray, history)
    }

    /// Whitted's function: the radiance that arrives at the ray's origin, against its direction (of unit length).
    fn radiance(&mut self, ray: &Ray, history: History) -> Seen {
        let shading = self.settings.shading;
        let Some(hit) = self.oracle.closest(ray, shading) else {
            self.counts.ended.miss += 1;
            let surroundings = &self.oracle.scene.surroundings;
            let background = environment::background(surroundings, ray.direction, history.straight);
            let absorption = history.media.transmittance(f64::INFINITY);
            return Seen {
                radiance: absorption * background,
                transparency: 1.0,
            };
        };
        let absorption = history.media.transmittance(hit.t);
        let throughput = history.throughput * absorption;
        let counts = |hit: &Hit| self.oracle.counts_for_radiance(hit, shading);
        let crossing = self
            .oracle
            .crossing(ray, &hit, &history.media, shading, counts);
        let mut surface = self.oracle.surface(ray, &crossing.face, shading);
        surface.spawn_offset = surface.spawn_offset.max(crossing.height);
        let history = History {
            throughput,
            ..history
        };
        let seen = match crossing.beyond {
            Ok(media) if crossing.hidden => {
                self.radiance(&surface.spawn(ray.direction), History { media, ..history })
            }
            beyond => self.blended(surface, beyond, history),
        };
        Seen {
            radiance: absorption * seen.radiance,
            ..seen
        }
    }

    /// The surface over what is behind it, by its alpha.
    fn blended(
        &mut self,
        surface: Surface<'a>,
        beyond: Result<Media, Full>,
        history: History,
    ) -> Seen {
        let alpha = surface.alpha;
        let behind = self.straight_on(&surface, &history);
        let throughput = alpha * history.throughput;
        let in_front = if alpha > 0.0 {
            self.shaded(
                surface,
                beyond,
                History {
                    throughput,
                    straight: false,
                    ..history
                },
            )
        } else {
            Rgb::ZERO
        };
        Seen {
            radiance: alpha * in_front + (1.0 - alpha) * behind.radiance,
            transparency: (1.0 - alpha) * behind.transparency,
        }
    }

    /// What is seen past a surface that does not cover all.
    fn straight_on(&mut self, surface: &Surface, history: &History) -> Seen {
        let ray = surface.spawn(-surface.wo);
        let weight = Rgb::splat(1.0 - surface.alpha);
        let media = || Ok(history.media.clone());
        self.branch(RayKind::Refraction, &ray, weight, history, media)
    }

    /// `L`: what leaves the surface towards where the ray came from.
    fn shaded(
        &mut self,
        surface: Surface<'a>,
        beyond: Result<Media, Full>,
        history: History,
    ) -> Rgb {
        if surface.material.unlit {
            return surface.base;
        }
        let interface = surface.interface(&history.media, &beyond);
        let wt = interface
            .refracted(surface.wo, surface.ns)
            .map(|bent| match surface.medium {
                Some(_) => kept_on_side(bent, -surface.ng),
                None => -surface.wo,
            });
        let arrival = Arrival {
            dielectric: surface.dielectric(interface),
            wr: reflected(surface.wo, surface.ns, surface.ng),
            wt,
            surface,
            history,
            beyond,
        };
        match self.settings.shading {
            Shading::Pbr => pbr::radiance(self, &arrival),
            Shading::Whitted => whitted::radiance(self, &arrival),
        }
    }

    /// Sum over the lights of `S Ip response(wi)`.
    pub fn direct(&mut self, arrival: &Arrival, response: impl Fn(Vec3) -> Rgb) -> Rgb {
        let lights = &self.oracle.scene.lights;
        let mut sum = Rgb::ZERO;
        for light in lights {
            let Some(Incident {
                wi,
                irradiance,
                distance,
            }) = incident(light, arrival.surface.position)
            else {
                continue;
            };
            if arrival.surface.ns.dot(wi) <= 0.0 || arrival.surface.ng.dot(wi) <= 0.0 {
                continue;
            }
            let unshadowed = irradiance * response(wi);
            if !unshadowed.is_zero() {
                sum += self.visibility(arrival, wi, distance) * unshadowed;
            }
        }
        sum
    }

    fn visibility(&mut self, arrival: &Arrival, wi: Vec3, distance: f64) -> Rgb {
        self.counts.rays.shadow += 1;
        let ray = arrival.surface.spawn(wi);
        let media = &arrival.history.media;
        self.oracle
            .visibility(&ray, distance, media, self.settings.shading)
            .unwrap_or_else(|Full| {
                self.counts.ended.storage += 1;
                Rgb::ZERO
            })
    }

    /// `weight Ir`.
    pub fn reflection(&mut self, arrival: &Arrival, weight: Rgb) -> Rgb {
        let Arrival {
            surface, history, ..
        } = arrival;
        let ray = surface.spawn(arrival.wr);
        let media = || Ok(history.media.clone());
        weight
            * self
                .branch(RayKind::Reflection, &ray, weight, history, media)
                .radiance
    }

    /// `weight It`; nothing in total internal reflection.
    pub fn refraction(&mut self, arrival: &Arrival, weight: Rgb) -> Rgb {
        let Arrival {
            surface, history, ..
        } = arrival;
        let Some(wt) = arrival.wt else {
            return Rgb::ZERO;
        };
        let ray = surface.spawn(wt);
        let media = || arrival.beyond.clone();
        weight
            * self
                .branch(RayKind::Refraction, &ray, weight, history, media)
                .radiance
    }

    /// What a spawned ray of `weight` brings back (not yet weighted), unless the branch ends before it begins: "Where
    /// branches end" in `shaders/README.md`.
    fn branch(
        &mut self,
        kind: RayKind,
        ray: &Ray,
        weight: Rgb,
        parent: &History,
        media: impl FnOnce() -> Result<Media, Full>,
    ) -> Seen {
        let throughput = parent.throughput * weight;
        if throughput.is_zero() {
            return Seen::NOTHING;
        }
        if throughput.largest() < self.settings.min_weight {
            self.counts.ended.weight += 1;
            return Seen::NOTHING;
        }
        if parent.depth >= self.settings.max_depth {
            self.counts.ended.depth += 1;
            return Seen::NOTHING;
        }
        let Ok(media) = media() else {
            self.counts.ended.storage += 1;
            return Seen::NOTHING;
        };
        match kind {
            RayKind::Reflection => self.counts.rays.reflection += 1,
            RayKind::Refraction => self.counts.rays.refraction += 1,
        }
        let depth = parent.depth + 1;
        self.radiance(
            ray,
            History {
                throughput,
                media,
                depth,
                straight: parent.straight,
            },
        )
    }
}
