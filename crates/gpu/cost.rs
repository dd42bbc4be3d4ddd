//! What a scene's program and buffers cost: all that can be said before a device is asked.

use std::collections::BTreeMap;

use naga::back::spv;
use raytree_bvh::Bvh;
use raytree_scene::model::Scene;

use crate::{
    error::RenderError,
    pass::binding_bytes,
    pipeline::bindings_of,
    plan::{Plan, Room, extra_items},
    program::{Kernel, ProgramError, ProgramFeatures, assemble},
    settings::RenderSettings,
    source::Limits,
    specialise::{SpecialiseError, validate},
    upload::{GEOMETRY_TABLES, GpuScene},
};

/// What rendering a scene takes besides time.
#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    /// Of its kernels together, as naga writes them: what the driver has to compile.
    pub spirv_words: usize,
    /// The program's buffers, in the order of their bindings.
    pub buffers: Vec<BufferCost>,
    /// Of the geometry's buffers, hierarchy included, for each triangle; 0 without triangles.
    pub triangle_bytes: f64,
    /// Entries of the traversal stack of a ray.
    pub traversal_stack: u32,
    /// Work items that a pixel may leave pending.
    pub ray_stack: u32,
    /// Of a pixel's state: its sum, its ray stack, and what faces in contact and a suspended traversal take.
    pub pixel_bytes: u64,
    /// Pixels that are rendered at once, and have a stack each.
    pub batch_pixels: u32,
}

/// A buffer that the program binds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BufferCost {
    /// Its name in `shaders/bindings.wgsl`.
    pub name: String,
    /// Its size.
    pub bytes: u64,
}

impl Cost {
    /// Of all buffers.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(|buffer| buffer.bytes).sum()
    }
}

/// What a picture of `scene` takes with these settings by a program with these features, first-hit layers left out.
///
/// # Errors
/// [`RenderError::Media`] of a scene with too many media, [`RenderError::Program`] where the shaders are broken.
pub fn cost(
    scene: &Scene,
    bvh: &Bvh,
    settings: &RenderSettings,
    features: ProgramFeatures,
) -> Result<Cost, RenderError> {
    let limits = Limits::for_depth(bvh.depth);
    let modules = Kernel::PICTURE
        .into_iter()
        .map(|kernel| assemble(kernel, features, limits))
        .collect::<Result<Vec<_>, _>>()?;
    let gpu_scene = GpuScene::new(scene, bvh, features, settings.shading)?;
    let plan = Plan::new(scene, &gpu_scene, bvh, settings, features, Room::CPU);
    let work = plan.work();
    let bindings: BTreeMap<_, _> = modules
        .iter()
        .flat_map(bindings_of)
        .map(|binding| (binding.place(), binding.name))
        .collect();
    let buffers: Vec<BufferCost> = bindings
        .into_values()
        .map(|name| BufferCost {
            bytes: binding_bytes(&name, &gpu_scene, &work),
            name,
        })
        .collect();
    let words = Kernel::PICTURE
        .iter()
        .zip(&modules)
        .map(|(&kernel, module)| spirv_words(kernel, module))
        .sum::<Result<usize, _>>()?;
    let geometry: u64 = buffers
        .iter()
        .filter(|buffer| GEOMETRY_TABLES.contains(&buffer.name.as_str()))
        .map(|buffer| buffer.bytes)
        .sum();
    let triangles = scene.placed_triangles();
    Ok(Cost {
        spirv_words: words,
        triangle_bytes: if triangles == 0 {
            0.0
        } else {
            geometry as f64 / triangles as f64
        },
        traversal_stack: limits.traversal_stack,
        ray_stack: plan.frame.stack_capacity + extra_items(features),
        pixel_bytes: work.slot_bytes,
        batch_pixels: work.slots,
        buffers,
    })
}

fn spirv_words(kernel: Kernel, module: &naga::Module) -> Result<usize, ProgramError> {
    let failed = |message: String| SpecialiseError {
        kernel: kernel.name().to_owned(),
        message,
    };
    let info = validate(module).map_err(failed)?;
    let words = spv::write_vec(module, &info, &spv::Options::default(), None)
        .map_err(|error| failed(error.to_string()))?;
    Ok(words.len())
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use raytree_bvh::Preset;
    use raytree_scene::{
        default_view::frame_scene,
        features::SceneFeatures,
        model::{Material, Triangle},
    };

    use super::*;
    use crate::build_bvh;

    /// Triangles one above the other, which share no vertex and have one normal.
    fn triangles(count: u32) -> Scene {
        scene_of((0..count).map(|k| {
            let corners = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + Vec3::Z * k as f32);
            (corners, [Vec3::Z; 3])
        }))
    }

    /// Triangles by their corners' positions and normals.
    fn scene_of(triangles: impl IntoIterator<Item = ([Vec3; 3], [Vec3; 3])>) -> Scene {
        let mut scene = Scene::default();
        scene.materials.push(Material {
            metallic: 0.0,
            roughness: 0.0,
            ..Material::default()
        });
        for (corners, normals) in triangles {
            let first = scene.geometry.positions.len() as u32;
            scene.geometry.positions.extend(corners);
            scene.geometry.normals.extend(normals);
            scene.geometry.triangles.push(Triangle {
                vertices: [0, 1, 2].map(|corner| first + corner),
                material: 0,
                node: 0,
            });
        }
        scene
    }

    fn settings(size: u32) -> RenderSettings {
        RenderSettings::new(size, size, frame_scene(DVec3::ZERO, DVec3::ONE, 1.0))
    }

    fn features_of(scene: &Scene, settings: &RenderSettings) -> ProgramFeatures {
        ProgramFeatures::of(&SceneFeatures::of(scene), settings)
    }

    fn cost_of(scene: &Scene, settings: &RenderSettings) -> Cost {
        cost(
            scene,
            &build_bvh(scene, Preset::default()).unwrap(),
            settings,
            features_of(scene, settings),
        )
        .unwrap()
    }

    #[test]
    fn a_buffer_costs_what_is_uploaded() {
        let scene = triangles(10);
        let found = cost_of(&scene, &settings(64));
        let bytes = |name: &str| {
            let buffer = found.buffers.iter().find(|buffer| buffer.name == name);
            buffer.map(|buffer| buffer.bytes)
        };
        assert_eq!(bytes("leaf_vertices"), Some(10 * 48));
        assert_eq!(bytes("leaf_triangles"), Some(10 * 16));
        assert_eq!(bytes("leaf_materials"), Some(10 * 4));
        assert_eq!(bytes("attributes"), Some(16), "one normal");
        assert_eq!(bytes("texels"), None);
        assert_eq!(bytes("leaf_nodes"), None);
        let geometry = (10 * (48 + 16 + 4) + 16) as f64 + bytes("nodes").unwrap() as f64;
        assert_eq!(found.triangle_bytes, geometry / 10.0);
        assert_eq!(bytes("state"), Some(64 * 64 * found.pixel_bytes));
        assert!(found.bytes() > geometry as u64);
    }

    /// The most that opaque geometry without textures may take, bytes a triangle: of a scene so large that the rests of the tables' last
    /// rows, 128 KiB each at most, count for nothing.
    const MOST: f64 = 100.0;

    /// Triangles of a soup.
    const MANY: u32 = 200_000;

    /// Anywhere and of any shape: the worst that a hierarchy can be over.
    fn soup(count: u32) -> Vec<[Vec3; 3]> {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut point = || Vec3::new(random(), random(), random());
        let triangle = |_| {
            let place = point();
            [(); 3].map(|()| place + 0.02 * point())
        };
        (0..count).map(triangle).collect()
    }

    fn flat([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
        [(b - a).cross(c - a).normalize(); 3]
    }

    #[test]
    fn a_flat_soup_is_small() {
        let scene = scene_of(
            soup(MANY)
                .into_iter()
                .map(|corners| (corners, flat(corners))),
        );
        let found = cost_of(&scene, &settings(64)).triangle_bytes;
        assert!(found <= MOST, "{found} bytes a triangle");
    }

    /// All first corners before all second ones: equal normals lie far apart.
    #[test]
    fn a_flat_soup_in_any_order_is_small() {
        let soup = soup(MANY);
        let mut scene = scene_of([]);
        for corner in 0..3 {
            let places = soup.iter().map(|corners| corners[corner]);
            scene.geometry.positions.extend(places);
            let normals = soup.iter().map(|&corners| flat(corners)[corner]);
            scene.geometry.normals.extend(normals);
        }
        let count = soup.len() as u32;
        scene.geometry.triangles = (0..count)
            .map(|k| Triangle {
                vertices: [k, count + k, 2 * count + k],
                material: 0,
                node: 0,
            })
            .collect();
        let found = cost_of(&scene, &settings(64)).triangle_bytes;
        assert!(found <= MOST, "{found} bytes a triangle");
    }

    /// A wavy square of shared vertices, each with a normal of its own.
    #[test]
    fn a_mesh_that_shares_vertices_is_small() {
        const SIDE: u32 = 316;
        let mut scene = scene_of([]);
        for vertex in 0..(SIDE + 1) * (SIDE + 1) {
            let (x, y) = ((vertex % (SIDE + 1)) as f32, (vertex / (SIDE + 1)) as f32);
            let position = Vec3::new(x, y, (0.1 * x).sin() + (0.07 * y).cos());
            scene.geometry.positions.push(position);
            scene
                .geometry
                .normals
                .push(Vec3::new(x, y, 99.0).normalize());
        }
        for square in 0..SIDE * SIDE {
            let first = square / SIDE * (SIDE + 1) + square % SIDE;
            let [a, b, c, d] = [first, first + 1, first + SIDE + 2, first + SIDE + 1];
            for vertices in [[a, b, c], [a, c, d]] {
                scene.geometry.triangles.push(Triangle {
                    vertices,
                    material: 0,
                    node: 0,
                });
            }
        }
        let found = cost_of(&scene, &settings(64)).triangle_bytes;
        assert!(found <= MOST, "{found} bytes a triangle");
    }

    #[test]
    fn what_is_needed_costs_more() {
        let opaque = triangles(1);
        let mut glass = opaque.clone();
        glass.materials[0].transmission = 1.0;
        let settings = settings(64);
        assert!(features_of(&glass, &settings) != features_of(&opaque, &settings));
        let (opaque, glass_cost) = (cost_of(&opaque, &settings), cost_of(&glass, &settings));
        assert!(glass_cost.spirv_words > opaque.spirv_words);
        let deeper = RenderSettings {
            max_depth: settings.max_depth + 10,
            ..settings
        };
        assert!(cost_of(&glass, &deeper).ray_stack > glass_cost.ray_stack);
    }

    #[test]
    fn nothing_costs_nothing_a_triangle() {
        let found = cost_of(&Scene::default(), &settings(8));
        assert_eq!(found.triangle_bytes, 0.0);
    }
}
