//! Given rays against a scene: traversal alone, for tests and benches.

use bytemuck::{Zeroable, bytes_of, cast_slice};
use raytree_bvh::Bvh;
use raytree_scene::model::Scene;

use crate::{
    batch::TILE_PIXELS,
    device::Device,
    error::RenderError,
    pass::{Pass, Work},
    program::{Feature, Kernel, ProgramFeatures},
    settings::Shading,
    source::Limits,
    types::{Frame, ProbeHit, ProbeRay},
    upload::GpuScene,
};

/// Rays of a dispatch: 48 MiB of rays and hits, which every device binds.
const BATCH: usize = 1 << 20;

/// Lanes of the kernel's workgroups (`shaders/kernels/probe.wgsl`).
const WORKGROUP: u32 = TILE_PIXELS;

/// Traces rays, origin and distances in scene space, and gives what each hits at `0 < t <= t_max`, in the same order.
///
/// With `shadow` 0 that is the closest hit, and the back of a single-sided opaque material is passed by; otherwise any hit, which
/// is a hit of an opaque material if there is one. Alpha masks are not looked up: that is up to who shades the hit. A
/// ray that meets nothing has `triangle` = [`u32::MAX`] and `t` = `t_max`. Directions need not have unit length; distances
/// are in their length.
///
/// A ray is walked to its end within one dispatch. Mesa before 25.0 cuts that short at 65,535 node visits and triangle
/// tests of 8 neighbouring rays together.
///
/// # Errors
/// [`RenderError`].
pub fn probe(
    device: &Device,
    scene: &Scene,
    bvh: &Bvh,
    features: ProgramFeatures,
    rays: &[ProbeRay],
) -> Result<Vec<ProbeHit>, RenderError> {
    let features = features.with(Feature::Counters, false);
    let shading = if features.has(Feature::Whitted) {
        Shading::Whitted
    } else {
        Shading::Pbr
    };
    let gpu_scene = GpuScene::new(scene, bvh, features, shading)?;
    let work = Work {
        slots: rays.len().min(BATCH) as u32,
        stack_items: 0,
        samples: &[],
    };
    let pass = Pass::new(
        device,
        Kernel::Probe,
        features,
        Limits::for_depth(bvh.depth),
        &gpu_scene,
        &work,
    )?;
    let mut hits = Vec::with_capacity(rays.len());
    for batch in rays.chunks(BATCH) {
        let slot_count = batch.len() as u32;
        let frame = Frame {
            slot_count,
            triangle_count: bvh.leaf_triangles.len() as u32,
            ..Frame::zeroed()
        };
        pass.write(device, "frame", bytes_of(&frame));
        pass.write(device, "probe_rays", cast_slice(batch));
        pass.submit(device, slot_count.div_ceil(WORKGROUP));
        let bytes = pass.read(
            device,
            "probe_hits",
            (batch.len() * size_of::<ProbeHit>()) as u64,
        )?;
        hits.extend_from_slice(cast_slice::<u8, ProbeHit>(&bytes));
    }
    Ok(hits)
}
