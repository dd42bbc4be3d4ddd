//! What to render of a scene, and how.

use std::time::Instant;

use raytree_control::Tolerance;
use raytree_film::Window;
use raytree_scene::model::Camera;

/// How surfaces turn light into radiance (shaders/README.md).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// glTF 2.0 appendix B and its ratified extensions.
    #[default]
    Pbr,
    /// Eq. 14.32 of Foley et al., as written.
    Whitted,
}

/// What is done against rounding. Pictures have all of it; parts are left out to measure what they do and what they cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numerics {
    /// Triangles by edge functions that neighbours share (Woop, Benthin and Wald 2013); else by Moeller and Trumbore 1997.
    pub watertight: bool,
    /// Boxes widened by the rounding of their test (Ize 2013).
    pub padded_boxes: bool,
    /// Rays start off the surface by the bound of its error (pbrt 4ed, 6.8); else they start in the computed hit point, and hits
    /// nearer than the tolerance are ignored.
    pub error_bounds: bool,
    /// Without error bounds: scene units, which are about the scene's extent; at least 0.
    pub tolerance: f32,
}

impl Default for Numerics {
    fn default() -> Self {
        Self {
            watertight: true,
            padded_boxes: true,
            error_bounds: true,
            tolerance: 0.0,
        }
    }
}

impl Numerics {
    /// A fixed tolerance and nothing else (Foley et al., 14.7), `tolerance` in scene units.
    #[must_use]
    pub fn book(tolerance: f32) -> Self {
        Self {
            watertight: false,
            padded_boxes: false,
            error_bounds: false,
            tolerance,
        }
    }
}

/// The part of the picture that is rendered, pixels from its upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// At least 1.
    pub width: u32,
    /// At least 1.
    pub height: u32,
}

/// Everything about a picture that is not the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Pixels across the whole picture.
    pub width: u32,
    /// Pixels down the whole picture.
    pub height: u32,
    /// `None`: all of it.
    pub region: Option<Region>,
    /// Scene space.
    pub camera: Camera,
    /// Samples a pixel, at least 1; with a tolerance, the most of any.
    pub samples: u32,
    /// How far the picture may be off: it decides what is left out of ray trees, and how many samples a pixel takes. `None`: all that
    /// [`Self::min_weight`] and [`Self::max_depth`] leave, [`Self::samples`] times.
    pub tolerance: Option<Tolerance>,
    /// With a tolerance: until when there is time, after which the picture is what it is by then.
    pub deadline: Option<Instant>,
    /// Levels of the ray tree below the camera ray.
    pub max_depth: u32,
    /// A branch whose throughput is below this in every channel is dropped; 0 to 1. See [`Self::MIN_WEIGHT`].
    pub min_weight: f32,
    /// The most rays of a sample's tree (camera, reflected and refracted ones; the shadow rays of their hits come on top), at
    /// least 1. Trees of glass among mirrors double at every level: this bounds their time. A tree of half as many is always
    /// whole; of a larger one the branches that weigh least are cut off and counted in [`Dropped`](crate::Dropped).
    pub max_rays: u32,
    /// Which model.
    pub shading: Shading,
    /// What is done against rounding: all, but for measurements.
    pub numerics: Numerics,
    /// Also render the first-hit layers.
    pub aovs: bool,
    /// Count rays, node visits, triangle tests and why branches end. Costs a few percent.
    pub counters: bool,
    /// The most pixels that are worked on at once; `None`: as many as suit the device (65,536 of a CPU, 1,048,576 of a GPU). Only memory
    /// and the steps of progress depend on it, never the picture.
    pub batch_pixels: Option<u32>,
}

/// Trees that double at every level are few in most pictures, but all other samples wait for them: they may be cut (where their branches
/// weigh least) at a number of rays that rises as the tolerance falls. What they lose is estimated with the rest. Of `everything` at
/// 0.01 (160x120) trees of 256, 1,024 and 4,096 rays take 3, 11 and 16 s, and all keep it; at 0.001 (64x48) trees of 810 are off by 0.0012,
/// those of 4,057 by 0.00098, and so are those of 6,430.
fn tolerance_rays(tolerance: Tolerance) -> u32 {
    let error = tolerance.allowed(0.1).max(1e-6);
    let (coarse, fine) = (25.6 / error.sqrt(), 256.0 * (0.01 / error).powf(1.2));
    coarse.max(fine).clamp(64.0, 65_536.0) as u32
}

impl RenderSettings {
    /// Samples that a pixel can have where all have as many: the device adds them up in f32.
    pub const MOST_EVEN_SAMPLES: u32 = 8192;

    /// Samples that a pixel takes at most to keep a tolerance. A highlight of radiance 1,000 that is smaller than a pixel takes tens of
    /// thousands for 0.001 (`materials`).
    pub const MOST_SAMPLES: u32 = (1 << 17) + 1;

    /// Depth to which branches are followed that matter to a tolerance, unless ..: a ray that glass has caught weighs the same for ever, and
    /// all others wait for it. Halls of mirrors need more: those of 0.99 1,200 levels for 0.001.
    pub const TOLERANCE_DEPTH: u32 = 256;

    /// The least weight of a branch unless ..: one step of an 8-bit channel, as in POV-Ray (its `adc_bailout` is 1/255). What that leaves out
    /// of our ten scenes is a fortieth of what one sample a pixel is off by, and less; 1/1000 takes up to half as many rays again
    /// (benches/README.md, "The least weight").
    pub const MIN_WEIGHT: f32 = 1.0 / 256.0;

    /// As [`Self::new`], to a tolerance: what it needs of samples, depth and rays, and no branch ends because of its weight alone.
    #[must_use]
    pub fn to_tolerance(self, tolerance: Tolerance) -> Self {
        Self {
            samples: Self::MOST_SAMPLES,
            max_depth: Self::TOLERANCE_DEPTH,
            min_weight: 0.0,
            max_rays: tolerance_rays(tolerance),
            tolerance: Some(tolerance),
            ..self
        }
    }

    /// Depth 8, one sample in the middle of each pixel, weights down to [`Self::MIN_WEIGHT`], 65,536 rays a sample, the whole picture.
    #[must_use]
    pub fn new(width: u32, height: u32, camera: Camera) -> Self {
        Self {
            width,
            height,
            region: None,
            camera,
            samples: 1,
            tolerance: None,
            deadline: None,
            max_depth: 8,
            min_weight: Self::MIN_WEIGHT,
            max_rays: 1 << 16,
            shading: Shading::Pbr,
            numerics: Numerics::default(),
            aovs: false,
            counters: false,
            batch_pixels: None,
        }
    }

    /// The rendered part, clipped to the picture.
    #[must_use]
    pub fn visible_region(&self) -> Region {
        let whole = Region {
            x: 0,
            y: 0,
            width: self.width,
            height: self.height,
        };
        self.region.map_or(whole, |region| {
            let x = region.x.min(self.width);
            let y = region.y.min(self.height);
            Region {
                x,
                y,
                width: region.width.min(self.width - x),
                height: region.height.min(self.height - y),
            }
        })
    }

    pub(crate) fn window(&self) -> Window {
        let region = self.visible_region();
        Window {
            full_width: self.width,
            full_height: self.height,
            x: region.x,
            y: region.y,
        }
    }
}
