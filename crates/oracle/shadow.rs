//! Shadow rays: "Shadow" in `shaders/README.md`.

use crate::intersect::Ray;
use crate::media::{Full, Media};
use crate::render::Shading;
use crate::surface::Surface;
use crate::vec::Rgb;
use crate::{Oracle, whitted};

impl Oracle<'_> {
    /// `S`: the share of light that gets along `ray` (of unit length) from `distance` to its origin, which lies in
    /// `media`. Fails where more solids are nested than the stack of media holds.
    ///
    /// Behind each surface a new ray starts, as for refracted rays: so an edge that two triangles share is one surface.
    pub(crate) fn visibility(
        &self,
        ray: &Ray,
        mut distance: f64,
        media: &Media,
        shading: Shading,
    ) -> Result<Rgb, Full> {
        let (mut ray, mut media) = (*ray, media.clone());
        let mut remaining = Rgb::ONE;
        // A straight line meets a triangle once at most: whatever rounding says, this comes to an end.
        let mut crossed = Vec::new();
        while let Some(hit) = self.closest_before(&ray, distance, |hit| {
            !crossed.contains(&hit.triangle) && !self.is_cut_out(hit)
        }) {
            crossed.push(hit.triangle);
            let crossing = self.crossing(&ray, &hit, &media, shading, |hit| !self.is_cut_out(hit));
            let mut surface = self.surface(&ray, &crossing.face, shading);
            surface.spawn_offset = surface.spawn_offset.max(crossing.height);
            let through = transmittance(&surface, shading);
            let share = if crossing.hidden {
                Rgb::ONE
            } else {
                Rgb::splat(1.0 - surface.alpha) + surface.alpha * through
            };
            remaining = remaining * media.transmittance(hit.t) * share;
            if remaining.is_zero() {
                return Ok(Rgb::ZERO);
            }
            // Where no refracted ray would get through, light that passes does so beside the surface.
            if crossing.hidden || !through.is_zero() {
                media = crossing.beyond?;
            }
            ray = surface.spawn(ray.direction);
            crossed.push(crossing.face.triangle);
            distance -= hit.t;
        }
        Ok(remaining * media.transmittance(distance))
    }
}

/// `T`: the share of light that passes the surface itself.
fn transmittance(surface: &Surface, shading: Shading) -> Rgb {
    match shading {
        _ if surface.material.unlit => Rgb::ZERO,
        Shading::Pbr => (1.0 - surface.metallic) * surface.transmission * surface.base,
        Shading::Whitted => whitted::Coefficients::of(surface).kt,
    }
}
