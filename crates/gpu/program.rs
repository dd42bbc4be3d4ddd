//! Which program a scene needs: features of scene and settings to a specialised module.

use std::{
    collections::HashMap,
    sync::{LazyLock, Mutex, MutexGuard, PoisonError},
};

use naga::{Module, back::PipelineConstants};
use raytree_scene::features::SceneFeatures;
use raytree_scene::model::Projection;

use crate::{
    piece::Piece,
    settings::{Numerics, RenderSettings, Shading},
    source::{self, Limits, ShaderError},
    specialise::{SpecialiseError, specialise},
};

/// A kernel: an entry point under `shaders/kernels/`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// The picture's first kernel: a sample's camera rays.
    CameraRays,
    /// Its second: what rays hit.
    TraceRays,
    /// Its third: what comes of it.
    ShadeHits,
    /// First-hit layers.
    Aov,
    /// Given rays, for tests and benches.
    Probe,
    /// One function alone, for tests.
    Piece(Piece),
    /// Given rays and the rays that leave what they hit, for tests.
    Secondary,
}

impl Kernel {
    /// Those that a picture takes, in the order in which they run.
    pub const PICTURE: [Self; 3] = [Self::CameraRays, Self::TraceRays, Self::ShadeHits];

    /// The entry point's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::CameraRays => "camera_rays",
            Self::TraceRays => "trace_rays",
            Self::ShadeHits => "shade_hits",
            Self::Aov => "aov",
            Self::Probe => "probe",
            Self::Piece(piece) => piece.name(),
            Self::Secondary => "secondary",
        }
    }
}

macro_rules! features {
    ($($feature:ident $override_name:literal $label:literal $present:literal, $absent:literal,)*) => {
        /// What a program can contain; each is an override in `shaders/features.wgsl`.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs, reason = "explained in shaders/features.wgsl")]
        pub enum Feature { $($feature),* }

        impl Feature {
            /// All of them, in the order of `shaders/features.wgsl`.
            pub const ALL: &[Self] = &[$(Self::$feature),*];

            /// The override's name.
            #[must_use]
            pub fn override_name(self) -> &'static str {
                match self { $(Self::$feature => $override_name),* }
            }

            /// What a user reads.
            #[must_use]
            pub fn label(self) -> &'static str {
                match self { $(Self::$feature => $label),* }
            }

            /// Why a program has it, or has not.
            #[must_use]
            pub fn reason(self, present: bool) -> &'static str {
                match self { $(Self::$feature => if present { $present } else { $absent }),* }
            }
        }
    };
}

features! {
    Orthographic "HAS_ORTHOGRAPHIC" "orthographic camera"
        "the camera is orthographic", "the camera is perspective",
    Culling "HAS_CULLING" "back-face culling"
        "backs of single-sided opaque materials are not seen", "no material is single-sided and opaque",
    Mask "HAS_MASK" "alpha masks"
        "a material cuts holes by alpha", "no material cuts holes by alpha",
    Blend "HAS_BLEND" "alpha blending"
        "a material blends by alpha", "no material blends by alpha",
    Unlit "HAS_UNLIT" "unlit materials"
        "a material is unlit", "no material is unlit",
    Textures "HAS_TEXTURES" "textures"
        "a material reads an image that shows", "no material reads an image that shows",
    NormalMaps "HAS_NORMAL_MAPS" "normal maps"
        "a material has a normal map", "no material has a normal map that bends anything",
    VertexColors "HAS_VERTEX_COLORS" "vertex colours"
        "vertices have colours that show", "vertices have no colours, or white ones",
    Branches "HAS_BRANCHES" "ray trees"
        "a hit can spawn rays", "no hit spawns rays",
    Reflection "HAS_REFLECTION" "reflected rays"
        "a surface is smooth enough to mirror", "every surface is too rough to mirror, or the depth is 0",
    Transmission "HAS_TRANSMISSION" "transmitted rays"
        "a material transmits light", "no material transmits light",
    Solids "HAS_SOLIDS" "refraction in solids"
        "a material that transmits bounds a volume", "no material that transmits bounds a volume",
    Absorption "HAS_ABSORPTION" "absorption in solids"
        "a solid absorbs", "no solid absorbs",
    Priorities "HAS_PRIORITIES" "priorities of solids"
        "solids differ in priority", "no two solids differ in priority",
    Contact "HAS_CONTACT" "faces of solids that coincide"
        "faces of solids lie in one place with others", "no solid's face lies in one place with another",
    StraightOn "HAS_STRAIGHT_ON" "rays that go straight on"
        "light can pass a surface as it came", "no ray passes a surface as it came",
    TransparentShadows "HAS_TRANSPARENT_SHADOWS" "transparent shadows"
        "what blends, transmits or has holes may lie before a light", "nothing that lets light through lies before a light",
    Lights "HAS_LIGHTS" "punctual lights"
        "there is a punctual light", "there is no punctual light that shines",
    ManyLights "HAS_MANY_LIGHTS" "more than one light"
        "there is more than one light", "there is one light or none",
    Environment "HAS_ENVIRONMENT" "environment map"
        "there is an environment map", "there is no environment map, or a black one",
    Whitted "HAS_WHITTED" "the book's shading model"
        "--shading whitted", "--shading pbr",
    Instances "HAS_INSTANCES" "shared meshes"
        "nodes share a mesh", "no nodes share a mesh",
    LongRays "HAS_LONG_RAYS" "rays that take several iterations"
        "there are triangles enough for one ray to keep a device busy", "there are too few triangles for a ray to take long",
    Tolerance "HAS_TOLERANCE" "error control"
        "a tolerance was asked for", "no tolerance was asked for",
    Counters "HAS_COUNTERS" "counters"
        "counting was asked for", "counting was not asked for",
    Watertight "HAS_WATERTIGHT" "watertight triangles"
        "robust numerics", "the book's numerics",
    PaddedBoxes "HAS_PADDED_BOXES" "padded boxes"
        "robust numerics", "the book's numerics",
    ErrorBounds "HAS_ERROR_BOUNDS" "error bounds"
        "robust numerics", "the book's numerics",
}

/// The set of features that a program has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ProgramFeatures(u32);

impl ProgramFeatures {
    /// Every feature: the program that can render anything.
    #[must_use]
    pub fn everything() -> Self {
        Feature::ALL
            .iter()
            .fold(Self::default(), |set, &feature| set.with(feature, true))
    }

    /// What this scene needs with these settings.
    #[must_use]
    pub fn of(scene: &SceneFeatures, settings: &RenderSettings) -> Self {
        let whitted = settings.shading == Shading::Whitted;
        let transmission = scene.transmission || (whitted && scene.whitted_transmission);
        let solids = scene.solids || (whitted && scene.whitted_transmission);
        let transparent_shadows = scene.lights > 0 && (transmission || scene.blend || scene.mask);
        // At depth 0 branches are spawned only to be counted as ended.
        let reflection =
            (whitted || scene.mirrors) && (settings.max_depth > 0 || settings.counters);
        Self::default()
            .with(
                Feature::Orthographic,
                matches!(settings.camera.projection, Projection::Orthographic { .. }),
            )
            .with(Feature::Culling, scene.culling)
            .with(Feature::Mask, scene.mask)
            .with(Feature::Blend, scene.blend)
            .with(Feature::Unlit, scene.unlit)
            .with(Feature::Textures, scene.textures)
            .with(Feature::NormalMaps, scene.normal_maps)
            .with(Feature::VertexColors, scene.vertex_colors)
            .with(Feature::Branches, reflection || transmission || scene.blend)
            // Eq. 14.32 reflects at every surface with ks above zero, however rough.
            .with(Feature::Reflection, reflection)
            .with(Feature::Transmission, transmission)
            .with(Feature::Solids, solids)
            .with(Feature::Priorities, solids && scene.priorities)
            .with(Feature::Contact, solids && scene.contact)
            .with(Feature::StraightOn, solids || transparent_shadows)
            .with(Feature::Absorption, solids && scene.absorption)
            .with(Feature::TransparentShadows, transparent_shadows)
            .with(Feature::Lights, scene.lights > 0)
            .with(Feature::ManyLights, scene.lights > 1)
            .with(Feature::Environment, scene.environment)
            .with(Feature::Whitted, whitted)
            .with(Feature::Instances, scene.instances)
            .with(Feature::LongRays, scene.many_triangles)
            .with(Feature::Tolerance, settings.tolerance.is_some())
            .with(Feature::Counters, settings.counters)
            .with_numerics(settings.numerics)
    }

    /// The same set with the program's part of these numerics.
    #[must_use]
    pub fn with_numerics(self, numerics: Numerics) -> Self {
        self.with(Feature::Watertight, numerics.watertight)
            .with(Feature::PaddedBoxes, numerics.padded_boxes)
            .with(Feature::ErrorBounds, numerics.error_bounds)
    }

    /// The same set with or without `feature`.
    #[must_use]
    pub fn with(self, feature: Feature, present: bool) -> Self {
        let bit = 1 << feature as u32;
        Self(if present { self.0 | bit } else { self.0 & !bit })
    }

    /// Is it in the set?
    #[must_use]
    pub fn has(self, feature: Feature) -> bool {
        self.0 & (1 << feature as u32) != 0
    }

    /// Those in, and those left out.
    #[must_use]
    pub fn used_and_left_out(self) -> (Vec<Feature>, Vec<Feature>) {
        Feature::ALL.iter().partition(|feature| self.has(**feature))
    }

    /// What users read: labels of those in, and of those left out.
    #[must_use]
    pub fn labels(self) -> (Vec<&'static str>, Vec<&'static str>) {
        let (used, left_out) = self.used_and_left_out();
        let labels = |features: Vec<Feature>| features.into_iter().map(Feature::label).collect();
        (labels(used), labels(left_out))
    }

    /// How many rays a hit can spawn: what the ray stack is sized by.
    #[must_use]
    pub fn children(self) -> u32 {
        [Feature::Reflection, Feature::Transmission, Feature::Blend]
            .into_iter()
            .map(|f| u32::from(self.has(f)))
            .sum()
    }

    /// The value of every override.
    #[must_use]
    pub fn constants(self) -> PipelineConstants {
        Feature::ALL
            .iter()
            .map(|&feature| {
                (
                    feature.override_name().to_owned(),
                    f64::from(u8::from(self.has(feature))),
                )
            })
            .collect()
    }
}

/// The shaders could not be made into a program. Only a bug in `shaders/` can cause it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProgramError {
    /// They don't parse.
    #[error(transparent)]
    Parse(#[from] ShaderError),
    /// They can't be specialised.
    #[error(transparent)]
    Specialise(#[from] SpecialiseError),
}

/// The module of `kernel` with just these features.
///
/// # Errors
/// [`ProgramError`], which is a bug in the shaders.
pub fn assemble(
    kernel: Kernel,
    features: ProgramFeatures,
    limits: Limits,
) -> Result<Module, ProgramError> {
    if let Some(module) = assembled().get(&(kernel.name(), features, limits)) {
        return Ok(module.clone());
    }
    let module = source::parsed(limits)?;
    Ok(specialise(&module, kernel.name(), &features.constants())?)
}

/// Assembles what a picture will take, unless its hierarchy is uncommonly deep: 30 to 50 ms that need neither device nor hierarchy,
/// for who has to wait for these. [`assemble`] finds it then, until others are assembled ahead.
pub fn assemble_ahead(features: ProgramFeatures) {
    let limits = Limits::for_depth(0);
    assembled().retain(|(_, before, _), _| *before == features);
    for kernel in Kernel::PICTURE {
        // Who renders meets an error again, and reports it.
        if let Ok(module) = assemble(kernel, features, limits) {
            assembled().insert((kernel.name(), features, limits), module);
        }
    }
}

/// Kernels that were assembled ahead, by their names.
type Assembled = HashMap<(&'static str, ProgramFeatures, Limits), Module>;

fn assembled() -> MutexGuard<'static, Assembled> {
    static ASSEMBLED: LazyLock<Mutex<Assembled>> = LazyLock::new(Mutex::default);
    ASSEMBLED.lock().unwrap_or_else(PoisonError::into_inner)
}
