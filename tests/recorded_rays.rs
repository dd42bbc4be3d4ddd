//! The rays that are read back from a frame (`Prepared::recorded_rays`) are those that it traced: as many as its counters say, and
//! a bare traversal of them finds what the frame found.

mod support;

use raytree::{Feature, Preset, ProgramFeatures, RenderSettings, SceneFeatures};
use raytree_gpu::{Ahead, Prepared, Prober};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 72;

/// Rays that may find something else, since a bare traversal does not know which triangle they leave, and begins some a rounding
/// beside.
const OTHER_HITS: f64 = 1e-4;

#[test]
fn recorded_rays_are_those_that_were_traced() {
    let Some(device) = support::device() else {
        return;
    };
    let mut recorded_scenes = 0;
    for path in support::own_scenes() {
        let name = support::stem(&path);
        let mut scene = support::import(&path);
        raytree::light_if_dark(&mut scene);
        let settings = RenderSettings {
            counters: true,
            // Several batches.
            batch_pixels: Some(2048),
            ..RenderSettings::new(WIDTH, HEIGHT, support::camera(&scene))
        };
        let features = ProgramFeatures::of(&SceneFeatures::of(&scene), &settings);
        if features.has(Feature::Contact) {
            continue;
        }
        let bvh = raytree::build_bvh(&scene, Preset::default()).unwrap();
        let ahead = Ahead::begin(device, features, &settings);
        let mut prepared = Prepared::new(device, &scene, &bvh, &settings, features).unwrap();
        prepared.compile(ahead).unwrap();
        let recorded = prepared.recorded_rays().unwrap();
        let rendered = prepared.render(&mut raytree::unobserved).unwrap();

        // What slots have dropped is added up by who renders alone.
        let counters = rendered.counters.unwrap();
        assert_eq!(recorded.counters.rays, counters.rays, "{name}");
        let (rays, counted) = (recorded.rays.len() as u64, counters.rays.total());
        if features.has(Feature::Mask) || features.has(Feature::StraightOn) {
            assert!(rays >= counted, "{name}: {rays} rays, {counted} counted");
        } else {
            assert_eq!(rays, counted, "{name}");
        }

        let prober = Prober::new(device, &scene, &bvh, features, settings.numerics).unwrap();
        let bare = prober.trace(&recorded.rays).unwrap();
        let other = recorded.other_hits(&bare);
        assert!(
            other as f64 <= OTHER_HITS * rays as f64,
            "{name}: {other} of {rays} rays find something else"
        );
        recorded_scenes += 1;
    }
    assert!(recorded_scenes >= 5, "{recorded_scenes} scenes");
}
