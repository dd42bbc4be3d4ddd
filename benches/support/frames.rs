//! Frames to be rendered more than once: scene, hierarchy and settings, with what has to come out.

use raytree::{
    Bvh, Camera, Device, Film, Preset, ProgramFeatures, RenderSettings, Scene, SceneFeatures,
};
use raytree_gpu::{Ahead, Prepared};

use super::{Expected, turns::Turn};

/// A scene from a camera, with its hierarchy.
pub struct Subject {
    pub name: String,
    pub scene: Scene,
    pub bvh: Bvh,
    /// A square picture of one sample a pixel.
    pub settings: RenderSettings,
}

impl Subject {
    pub fn new(name: impl Into<String>, (scene, camera): (Scene, Camera), side: u32) -> Self {
        let bvh =
            raytree::build_bvh(&scene, Preset::default()).unwrap_or_else(|error| panic!("{error}"));
        Self {
            name: name.into(),
            settings: RenderSettings::new(side, side, camera),
            scene,
            bvh,
        }
    }

    /// A scene of ours as its first camera shows it.
    pub fn of_file(file: &'static str, side: u32) -> Self {
        let scene = super::scene(file);
        let camera = raytree::default_camera(&scene);
        Self::new(super::stem(file), (scene, camera), side)
    }

    /// What a picture of it needs.
    pub fn features(&self, settings: &RenderSettings) -> ProgramFeatures {
        ProgramFeatures::of(&SceneFeatures::of(&self.scene), settings)
    }

    /// Uploaded and compiled.
    pub fn prepared<'p>(
        &'p self,
        device: &'p Device,
        settings: &'p RenderSettings,
    ) -> Prepared<'p> {
        prepared(
            device,
            (&self.scene, &self.bvh),
            settings,
            self.features(settings),
        )
    }

    /// What the oracle says of its picture.
    pub fn expected(&self) -> Expected {
        Expected::new(&self.scene, &self.settings)
    }
}

/// A picture by a program with these features, uploaded and compiled.
pub fn prepared<'p>(
    device: &'p Device,
    (scene, bvh): (&'p Scene, &Bvh),
    settings: &'p RenderSettings,
    features: ProgramFeatures,
) -> Prepared<'p> {
    let ahead = Ahead::begin(device, features, settings);
    let mut prepared = Prepared::new(device, scene, bvh, settings, features)
        .unwrap_or_else(|error| panic!("{error}"));
    prepared
        .compile(ahead)
        .unwrap_or_else(|error| panic!("{error}"));
    prepared
}

/// All dispatches and reading back, and the picture.
pub fn rendered(prepared: &Prepared<'_>) -> (Turn, Film) {
    Turn::of(|| {
        let rendered = prepared.render(&mut raytree::unobserved);
        rendered.unwrap_or_else(|error| panic!("{error}")).film
    })
}
