//! Given rays against a scene: traversal alone, and traversal with the rays that leave a hit; for tests and benches.

use bytemuck::{Pod, bytes_of, cast_slice};
use raytree_bvh::Bvh;
use raytree_scene::model::Scene;

use crate::{
    batch::TILE_PIXELS,
    device::Device,
    error::RenderError,
    pass::{Pass, Work},
    program::{Feature, Kernel, ProgramFeatures},
    settings::{Numerics, Shading},
    source::Limits,
    types::{Frame, ProbeHit, ProbeRay, SecondaryHit, SecondaryRay},
    upload::{GpuScene, first_corner},
};

/// Rays of a dispatch: 128 MiB of rays and hits at most, which every device binds.
const BATCH: usize = 1 << 20;

/// Lanes of the kernels' workgroups (`shaders/kernels/`).
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
    Prober::new(device, scene, bvh, features, Numerics::default())?.trace(rays)
}

/// A scene that rays are traced against in more than one go.
pub struct Prober<'d> {
    bulk: Bulk<'d>,
    /// Of each triangle, the corner that the device begins at.
    first_corners: Vec<u8>,
    /// How many of them are the scene's own.
    own: usize,
    /// Of each instance: the number of its first triangle, the same triangle's place in the scene, and whether it is mirrored.
    instances: Vec<(u32, u32, bool)>,
}

impl<'d> Prober<'d> {
    /// Uploads the scene, and makes the program: `numerics` counts, whatever `features` say of it.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn new(
        device: &'d Device,
        scene: &Scene,
        bvh: &Bvh,
        features: ProgramFeatures,
        numerics: Numerics,
    ) -> Result<Self, RenderError> {
        let geometry = &scene.geometry;
        let first_corners = geometry.triangles.iter().map(|triangle| {
            first_corner(triangle.vertices.map(|v| geometry.positions[v as usize])) as u8
        });
        Ok(Self {
            bulk: Bulk::new(device, Kernel::Probe, scene, bvh, features, numerics)?,
            first_corners: first_corners.collect(),
            own: scene.own_triangles(),
            instances: scene
                .instances
                .iter()
                .zip(scene.first_numbers())
                .map(|(instance, number)| {
                    let first = scene.meshes[instance.mesh as usize].triangles.start;
                    (number, first, instance.placement.mirrors())
                })
                .collect(),
        })
    }

    /// As [`probe`].
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn trace(&self, rays: &[ProbeRay]) -> Result<Vec<ProbeHit>, RenderError> {
        let mut hits = self.bulk.run("probe_rays", rays, "probe_hits")?;
        hits.iter_mut().for_each(|hit| self.turn_back(hit));
        Ok(hits)
    }

    /// Lays out rays on the device, in place of those before, for [`Self::run`].
    ///
    /// # Errors
    /// [`RenderError`].
    ///
    /// # Panics
    /// If there are more than a dispatch takes, 2^20.
    pub fn upload(&self, rays: &[ProbeRay]) -> Result<(), RenderError> {
        assert!(rays.len() <= BATCH, "{} rays at once", rays.len());
        self.bulk.upload("probe_rays", rays);
        // What is written waits for the next submission.
        self.bulk.device.queue.submit([]);
        Ok(self.bulk.device.wait()?)
    }

    /// Traces the first `count` rays uploaded, and waits for it: nothing but the dispatch, to be timed.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn run(&self, count: usize) -> Result<(), RenderError> {
        self.bulk.dispatch(count.min(BATCH));
        Ok(self.bulk.device.wait()?)
    }

    /// Which of the scene's triangles has this number, and whether it is seen mirrored.
    fn shown(&self, number: u32) -> (usize, bool) {
        if (number as usize) < self.own {
            return (number as usize, false);
        }
        let after = self
            .instances
            .partition_point(|&(first, _, _)| first <= number);
        let (first, triangle, mirrored) = self.instances[after - 1];
        ((number - first + triangle) as usize, mirrored)
    }

    /// From the device's order of a triangle's vertices to the scene's.
    fn turn_back(&self, hit: &mut ProbeHit) {
        if hit.triangle == u32::MAX {
            return;
        }
        let (triangle, mirrored) = self.shown(hit.triangle);
        // The other way round.
        let turned = match (self.first_corners[triangle], mirrored) {
            (1, true) => 2,
            (2, true) => 1,
            (first, _) => first,
        };
        // Rounding may leave less than nothing for the third.
        let third = (1.0 - hit.u - hit.v).max(0.0);
        (hit.u, hit.v) = match turned {
            1 => (third, hit.u),
            2 => (hit.v, third),
            _ => (hit.u, hit.v),
        };
    }
}

/// A scene in which rays are followed to a surface and on from there, by the code that pictures are made by.
pub struct SecondaryProber<'d>(Bulk<'d>);

impl<'d> SecondaryProber<'d> {
    /// Uploads the scene, and makes the program: `numerics` counts, whatever `features` say of it.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn new(
        device: &'d Device,
        scene: &Scene,
        bvh: &Bvh,
        features: ProgramFeatures,
        numerics: Numerics,
    ) -> Result<Self, RenderError> {
        Bulk::new(device, Kernel::Secondary, scene, bvh, features, numerics).map(Self)
    }

    /// What each first ray hits, where the second one starts, and what that hits: the closest hits of radiance rays.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn trace(&self, rays: &[SecondaryRay]) -> Result<Vec<SecondaryHit>, RenderError> {
        self.0.run("secondary_rays", rays, "secondary_hits")
    }
}

/// A kernel that turns a list into another, element by element.
struct Bulk<'d> {
    device: &'d Device,
    pass: Pass,
    frame: Frame,
}

impl<'d> Bulk<'d> {
    fn new(
        device: &'d Device,
        kernel: Kernel,
        scene: &Scene,
        bvh: &Bvh,
        features: ProgramFeatures,
        numerics: Numerics,
    ) -> Result<Self, RenderError> {
        let features = features
            .with(Feature::Counters, false)
            .with(Feature::LongRays, false)
            .with_numerics(numerics);
        let shading = if features.has(Feature::Whitted) {
            Shading::Whitted
        } else {
            Shading::Pbr
        };
        let gpu_scene = GpuScene::new(scene, bvh, features, shading)?;
        let work = Work {
            slots: BATCH as u32,
            slot_bytes: 0,
        };
        let limits = Limits::for_depth(bvh.depth);
        let pass = Pass::new(device, kernel, features, limits, &gpu_scene, &work)?;
        let frame = Frame {
            tolerance: numerics.tolerance,
            ..gpu_scene.frame()
        };
        Ok(Self {
            device,
            pass,
            frame,
        })
    }

    fn run<I: Pod, O: Pod>(
        &self,
        input: &str,
        items: &[I],
        output: &str,
    ) -> Result<Vec<O>, RenderError> {
        let mut found = Vec::with_capacity(items.len());
        for batch in items.chunks(BATCH) {
            self.upload(input, batch);
            self.dispatch(batch.len());
            let size = batch.len() * size_of::<O>();
            let bytes = self.pass.read(self.device, output, size as u64)?;
            found.extend_from_slice(cast_slice::<u8, O>(&bytes));
        }
        Ok(found)
    }

    /// With what the kernel has to know of them.
    fn upload<I: Pod>(&self, input: &str, items: &[I]) {
        let frame = Frame {
            slot_count: items.len() as u32,
            ..self.frame
        };
        self.pass.write(self.device, "frame", bytes_of(&frame));
        self.pass.write(self.device, input, cast_slice(items));
    }

    fn dispatch(&self, count: usize) {
        let workgroups = (count as u32).div_ceil(WORKGROUP);
        self.pass.submit(self.device, workgroups);
    }
}
