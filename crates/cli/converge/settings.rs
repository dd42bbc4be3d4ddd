//! From a point of the sweep to what the library renders by, and back to what it says of its own error.

use raytree::{Preset, RenderSettings, Shading, Tolerance};
use raytree_converge::{Bvh, Model, Setting};

/// The settings of one point; camera, size, and what a sweep does not vary are those of `base`.
pub fn render_settings(base: &RenderSettings, setting: &Setting) -> RenderSettings {
    let base = RenderSettings {
        shading: match setting.shading {
            Model::Pbr => Shading::Pbr,
            Model::Whitted => Shading::Whitted,
        },
        ..base.clone()
    };
    match setting.tolerance {
        Some(error) => base.to_tolerance(Tolerance::absolute(error as f32)),
        None => RenderSettings {
            samples: setting.spp,
            max_depth: setting.depth,
            min_weight: setting.min_weight as f32,
            ..base
        },
    }
}

/// What the renderer says that its picture's error is.
pub fn estimated_rmse(rendered: &raytree::Rendered) -> Option<f64> {
    rendered.error.map(|error| error.estimated_rmse)
}

/// How a point's hierarchy is built.
pub fn preset(bvh: Bvh) -> Preset {
    match bvh {
        Bvh::Fast => Preset::Fast,
        Bvh::Balanced => Preset::Balanced,
        Bvh::Best => Preset::Best,
    }
}
