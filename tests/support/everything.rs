//! The program that can render anything, for what should not depend on being specialised; `benches/specialised.rs` uses it too.

use glam::Vec4;
use raytree::{Feature, ProgramFeatures, RenderSettings, Scene};
use raytree_scene::environment::EquirectMap;
use raytree_stress::scenes::unfiltered;

/// Every feature but those that say what was asked for rather than what a scene needs. Numerics are those of every picture.
pub fn everything(settings: &RenderSettings, special: ProgramFeatures) -> ProgramFeatures {
    let asked = [
        Feature::Orthographic,
        Feature::Whitted,
        Feature::Tolerance,
        Feature::Counters,
    ];
    let all = ProgramFeatures::everything().with_numerics(settings.numerics);
    asked
        .into_iter()
        .fold(all, |set, feature| set.with(feature, special.has(feature)))
}

/// The scene with what a program with everything reads without asking, in a form that changes nothing: white vertex colours, and a
/// black environment where there is none.
pub fn filled(mut scene: Scene) -> Scene {
    let dark = EquirectMap {
        width: 1,
        height: 1,
        texels: vec![[0.0; 3]],
    };
    let environment = &mut scene.surroundings.environment;
    environment.get_or_insert_with(|| unfiltered(dark));
    if scene.geometry.colors.is_empty() {
        scene.geometry.colors = vec![Vec4::ONE; scene.geometry.positions.len()];
    }
    scene
}
