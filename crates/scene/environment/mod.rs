//! Environment maps: light from all around by direction, with the prefiltered levels that rough surfaces read.
//!
//! How a direction becomes a texel: `shaders/README.md`, "Environment look-up" (OpenEXR's latitude-longitude convention).

mod load;
mod load_exr;
mod lookup;
mod prefilter;
mod resample;

pub(crate) use load::LARGEST_RADIANCE;
pub use load::{EnvironmentError, EnvironmentProblem, LoadedMap, MAX_SIDE, load_environment};

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

impl Environment {
    /// The environment of a radiance map, with its prefiltered levels computed: tens of milliseconds for a map of
    /// 1024 x 512, and bit for bit the same however many threads there are. `rotation`: [`Environment::rotation`].
    #[must_use]
    pub fn new(radiance: EquirectMap, rotation: f64) -> Self {
        let source = prefilter::source(&radiance);
        Self {
            rough: std::array::from_fn(|level| prefilter::rough_level(&source, level)),
            irradiance: prefilter::irradiance(&source),
            radiance,
            rotation,
        }
    }

    /// No light comes from anywhere.
    #[must_use]
    pub fn is_black(&self) -> bool {
        let maps = [&self.radiance, &self.irradiance];
        maps.into_iter()
            .chain(&self.rough)
            .all(|map| map.texels.as_flattened().iter().all(|&value| value == 0.0))
    }
}
