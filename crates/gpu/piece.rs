//! Single functions of the shaders, called with given arguments: for tests that know their answers in f64.

use bytemuck::{bytes_of, cast_slice};
use raytree_scene::{features::SceneFeatures, model::Scene};

use crate::{
    batch::TILE_PIXELS,
    device::Device,
    error::RenderError,
    hierarchy::build_bvh,
    pass::{Pass, Work},
    plan::frame_of,
    program::{Feature, Kernel, ProgramFeatures},
    settings::RenderSettings,
    source::Limits,
    types::Frame,
    upload::GpuScene,
};

/// Calls of a dispatch.
const BATCH: usize = 1 << 18;

/// The arguments of a call, 32 bits each: what they mean is said at the entry points in `shaders/kernels/pieces.wgsl`.
pub type PieceCall = [u32; 24];

/// What a call gave, likewise.
pub type PieceResult = [u32; 16];

macro_rules! pieces {
    ($($piece:ident $entry_point:literal,)*) => {
        /// A function that can be called alone; each is an entry point of `shaders/kernels/pieces.wgsl`, which says what its
        /// arguments and results are.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs, reason = "explained in shaders/kernels/pieces.wgsl")]
        pub enum Piece { $($piece),* }

        impl Piece {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$piece),*];

            /// The entry point's name.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$piece => $entry_point),* }
            }
        }
    };
}

pieces! {
    Triangle "piece_triangle",
    Boxes "piece_boxes",
    Leaving "piece_leaving",
    Interface "piece_interface",
    Media "piece_media",
    Functions "piece_functions",
    Highlights "piece_highlights",
    Camera "piece_camera",
    Light "piece_light",
    Environment "piece_environment",
    Texture "piece_texture",
    Record "piece_record",
}

/// A picture's own and a little more; all that there are where whole entries of tables are read.
fn features_of(piece: Piece, scene: &Scene, settings: &RenderSettings) -> ProgramFeatures {
    if piece == Piece::Record {
        return ProgramFeatures::everything();
    }
    [
        Feature::Branches,
        Feature::Reflection,
        Feature::Transmission,
        Feature::Solids,
        Feature::Textures,
    ]
    .into_iter()
    .fold(
        ProgramFeatures::of(&SceneFeatures::of(scene), settings),
        |set, feature| set.with(feature, true),
    )
}

/// Calls `piece` once for each element of `calls`, with the buffers that a picture of `scene` with `settings` would have. The program
/// has what such a picture's would have, and always refraction and textures, which a scene without triangles does not show.
///
/// # Errors
/// [`RenderError`].
pub fn evaluate(
    device: &Device,
    piece: Piece,
    scene: &Scene,
    settings: &RenderSettings,
    calls: &[PieceCall],
) -> Result<Vec<PieceResult>, RenderError> {
    let features = features_of(piece, scene, settings);
    let bvh = build_bvh(scene, raytree_bvh::Preset::default())?;
    let gpu_scene = GpuScene::new(scene, &bvh, features, settings.shading)?;
    let work = Work {
        slots: calls.len().min(BATCH) as u32,
        slot_bytes: 0,
    };
    let pass = Pass::new(
        device,
        Kernel::Piece(piece),
        features,
        Limits::for_depth(bvh.depth),
        &gpu_scene,
        &work,
    )?;
    let frame = frame_of(scene, &gpu_scene, &bvh, settings, features);
    let mut results = Vec::with_capacity(calls.len());
    for batch in calls.chunks(BATCH) {
        let slot_count = batch.len() as u32;
        let frame = Frame {
            slot_count,
            ..frame
        };
        pass.write(device, "frame", bytes_of(&frame));
        pass.write(device, "piece_arguments", cast_slice(batch));
        pass.submit(device, slot_count.div_ceil(TILE_PIXELS));
        let size = (batch.len() * size_of::<PieceResult>()) as u64;
        let bytes = pass.read(device, "piece_results", size)?;
        results.extend_from_slice(cast_slice::<u8, PieceResult>(&bytes));
    }
    Ok(results)
}
