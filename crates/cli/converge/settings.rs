//! From a point of the sweep to what the library renders by, and back to what it says of its own error.

use raytree::{Preset, RenderSettings, Shading};
use raytree_converge::{Bvh, Model, Setting};

use crate::failure::Usage;

// tolerance: true as soon as `render_settings` below can pass one on; the default sweep then has a ladder of it.
pub const HAS_TOLERANCE: bool = false;

/// The settings of one point; camera, size, and what a sweep does not vary are those of `base`.
pub fn render_settings(base: &RenderSettings, setting: &Setting) -> Result<RenderSettings, Usage> {
    // tolerance: `RenderSettings::tolerance` from it, with `samples` as the most that a pixel may have.
    if setting.tolerance.is_some() && !HAS_TOLERANCE {
        let problem = "this version renders to no tolerance yet; sweep spp instead";
        return Err(Usage(format!("tolerance: {problem}")));
    }
    Ok(RenderSettings {
        samples: setting.spp,
        max_depth: setting.depth,
        min_weight: setting.min_weight as f32,
        shading: match setting.shading {
            Model::Pbr => Shading::Pbr,
            Model::Whitted => Shading::Whitted,
        },
        ..base.clone()
    })
}

/// What the renderer says that its picture's error is.
pub fn estimated_rmse(_rendered: &raytree::Rendered) -> Option<f64> {
    // tolerance: from the rendering's report of its error.
    None
}

/// How a point's hierarchy is built.
pub fn preset(bvh: Bvh) -> Preset {
    match bvh {
        Bvh::Fast => Preset::Fast,
        Bvh::Balanced => Preset::Balanced,
        Bvh::Best => Preset::Best,
    }
}
