//! Environment maps: light from all around by direction, with the prefiltered levels that rough surfaces read.

/// An equirectangular (latitude-longitude) map of radiance, linear RGB, rows from +Y (top) to -Y.
#[derive(Clone, PartialEq)]
pub struct EquirectMap {
    /// Texels, at least 1.
    pub width: u32,
    /// Texels, at least 1.
    pub height: u32,
    /// `width * height` texels, finite and not negative.
    pub texels: Vec<[f32; 3]>,
}

impl std::fmt::Debug for EquirectMap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "EquirectMap({}x{})", self.width, self.height)
    }
}

/// How many prefiltered levels there are: roughness 1/4, 2/4, 3/4, 1.
pub const ROUGH_LEVELS: usize = 4;

/// Light from all around.
#[derive(Clone, Debug)]
pub struct Environment {
    /// What was measured or painted; what a mirror sees.
    pub radiance: EquirectMap,
    /// `rough[k]`: what a GGX lobe of roughness `(k + 1) / ROUGH_LEVELS` gathers around a direction (split-sum
    /// approximation, Karis 2013: normal = view = reflected direction).
    pub rough: [EquirectMap; ROUGH_LEVELS],
    /// Irradiance over pi around a normal: what a white diffuse surface reflects.
    pub irradiance: EquirectMap,
    /// Turns the map about +Y, radians, counter-clockwise seen from above.
    pub rotation: f64,
}
