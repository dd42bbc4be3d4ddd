//! Reading an environment by direction, in f64, on the CPU (`shaders/README.md`, "Environment look-up").

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

use super::{Environment, EquirectMap, ROUGH_LEVELS};

impl EquirectMap {
    /// A map whose texel at column `x`, row `y` is `texel(direction)`, the direction being that of the texel's centre.
    #[must_use]
    pub fn from_directions(width: u32, height: u32, texel: impl Fn(DVec3) -> DVec3) -> Self {
        let direction = |x: u32, y: u32| {
            let u = (f64::from(x) + 0.5) / f64::from(width);
            let v = (f64::from(y) + 0.5) / f64::from(height);
            direction_of(u, v)
        };
        let texels = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| texel(direction(x, y)).as_vec3().to_array())
            .collect();
        Self {
            width,
            height,
            texels,
        }
    }

    /// The radiance from `direction` (unit, the map's own space: before [`Environment::rotation`]): bilinear between texel
    /// centres, wrapping around the horizon, clamped at the poles.
    #[must_use]
    pub fn sample(&self, direction: DVec3) -> DVec3 {
        let u = 0.5 - direction.x.atan2(direction.z) / TAU;
        let v = direction.y.clamp(-1.0, 1.0).acos() / PI;
        let (x, y) = (
            u * f64::from(self.width) - 0.5,
            v * f64::from(self.height) - 0.5,
        );
        let (left, top) = (x.floor(), y.floor());
        let row = |y: f64| {
            self.texel(left, y)
                .lerp(self.texel(left + 1.0, y), x - left)
        };
        row(top).lerp(row(top + 1.0), y - top)
    }

    /// The texel at integer coordinates at most one texel outside of the map.
    fn texel(&self, x: f64, y: f64) -> DVec3 {
        let column = x.rem_euclid(f64::from(self.width)) as usize;
        let row = y.clamp(0.0, f64::from(self.height - 1)) as usize;
        let [r, g, b] = self.texels[row * self.width as usize + column];
        DVec3::new(f64::from(r), f64::from(g), f64::from(b))
    }
}

/// The unit direction that the point `(u, v)` of a map shows; both in [0, 1].
fn direction_of(u: f64, v: f64) -> DVec3 {
    let (sin_theta, cos_theta) = (PI * v).sin_cos();
    let (sin_phi, cos_phi) = (TAU * (0.5 - u)).sin_cos();
    DVec3::new(sin_theta * sin_phi, cos_theta, sin_theta * cos_phi)
}

impl Environment {
    /// What a mirror sees in `direction` (unit).
    #[must_use]
    pub fn sample_radiance(&self, direction: DVec3) -> DVec3 {
        self.radiance.sample(self.to_map(direction))
    }

    /// What a GGX lobe of `roughness` in [0, 1] gathers around `direction` (unit): linear between the two nearest levels.
    #[must_use]
    pub fn sample_rough(&self, direction: DVec3, roughness: f64) -> DVec3 {
        let direction = self.to_map(direction);
        let level = |k: usize| match k.checked_sub(1) {
            None => self.radiance.sample(direction),
            Some(k) => self.rough[k].sample(direction),
        };
        let position = roughness.clamp(0.0, 1.0) * ROUGH_LEVELS as f64;
        let below = (position as usize).min(ROUGH_LEVELS - 1);
        level(below).lerp(level(below + 1), position - below as f64)
    }

    /// What a white diffuse surface with this `normal` (unit) reflects: irradiance over pi.
    #[must_use]
    pub fn sample_irradiance(&self, normal: DVec3) -> DVec3 {
        self.irradiance.sample(self.to_map(normal))
    }

    /// A direction of the scene in the map's own space.
    fn to_map(&self, direction: DVec3) -> DVec3 {
        DMat3::from_rotation_y(-self.rotation) * direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every texel different: its column in red, its row in green.
    fn coordinates(width: u32, height: u32) -> EquirectMap {
        let texels = (0..height)
            .flat_map(|y| (0..width).map(move |x| [x as f32, y as f32, 0.0]))
            .collect();
        EquirectMap {
            width,
            height,
            texels,
        }
    }

    #[test]
    fn axes_land_where_the_convention_puts_them() {
        let map = coordinates(8, 4);
        // Fractional texel coordinates: u W - 0.5 and v H - 0.5.
        assert_eq!(map.sample(DVec3::Z), DVec3::new(3.5, 1.5, 0.0));
        assert_eq!(map.sample(DVec3::X), DVec3::new(1.5, 1.5, 0.0));
        assert_eq!(map.sample(DVec3::NEG_X), DVec3::new(5.5, 1.5, 0.0));
        // -Z lies on the seam, half way between the last column (7) and the first (0).
        assert_eq!(map.sample(DVec3::NEG_Z), DVec3::new(3.5, 1.5, 0.0));
        assert_eq!(map.sample(DVec3::Y).y, 0.0);
        assert_eq!(map.sample(DVec3::NEG_Y).y, 3.0);
    }

    #[test]
    fn seam_is_continuous() {
        let map = EquirectMap::from_directions(64, 32, |d| DVec3::splat(2.0 + d.x + 0.5 * d.z));
        let beside = |x: f64| map.sample(DVec3::new(x, 0.0, -1.0).normalize()).x;
        assert!((beside(1e-9) - beside(-1e-9)).abs() < 1e-6);
    }

    #[test]
    fn from_directions_is_the_inverse_of_sample() {
        let map = EquirectMap::from_directions(256, 128, |d| d + DVec3::ONE);
        for direction in [
            DVec3::new(0.3, 0.5, 0.8),
            DVec3::new(-0.9, -0.2, 0.1),
            DVec3::new(0.2, 0.1, -0.9),
        ] {
            let direction = direction.normalize();
            let error = (map.sample(direction) - direction - DVec3::ONE).length();
            assert!(error < 1e-3, "{direction}: {error}");
        }
    }

    #[test]
    fn rotation_turns_the_map_counter_clockwise_seen_from_above() {
        let map = EquirectMap::from_directions(128, 64, |d| DVec3::splat(d.z.max(0.0)));
        // What was in +Z is seen in +X after a quarter turn.
        let environment = Environment::new(map, std::f64::consts::FRAC_PI_2);
        for (value, name) in [
            (environment.sample_radiance(DVec3::X), "radiance"),
            (environment.sample_rough(DVec3::X, 0.0), "rough 0"),
        ] {
            assert!((value.x - 1.0).abs() < 2e-3, "{name}: {value}");
        }
        let towards = environment.sample_irradiance(DVec3::X).x;
        let away = environment.sample_irradiance(DVec3::NEG_X).x;
        assert!(towards > 0.6 && away < 0.02, "{towards} {away}");
    }

    #[test]
    fn roughness_blends_between_levels() {
        let map = EquirectMap::from_directions(64, 32, |d| DVec3::splat((3.0 * d.x).exp()));
        let environment = Environment::new(map, 0.3);
        let at = |roughness| environment.sample_rough(DVec3::X, roughness).x;
        let middle = 0.5 * (at(0.25) + at(0.5));
        assert!((at(0.375) - middle).abs() < 1e-12 * middle);
        assert!(at(0.0) > at(0.25) && at(0.25) > at(1.0));
        assert_eq!(at(2.0), at(1.0));
    }
}
