//! A scene as bytes for the device: everything in f32 and in the shaders' layouts, nothing that the program does not read.

use bytemuck::{Zeroable, cast_slice};
use glam::{DVec3, Vec3};
use raytree_bvh::{Bvh, INSTANCE, Node};
use raytree_scene::{
    environment::EquirectMap,
    features::{transmits, whitted_transmits},
    model::{
        AlphaMode, Filter, Geometry, Light as SceneLight, LightKind, Material as SceneMaterial,
        Scene, TextureRef, Triangle, Wrap, srgb_to_linear,
    },
};

use crate::{
    attributes::{Attributes, VertexRecord},
    error::RenderError,
    instances::{self, InstanceRecord, MOST_INSTANCES},
    program::{Feature, ProgramFeatures},
    settings::Shading,
    solids::RankedMedia,
    table::Table,
    types::{
        ENVIRONMENT_LEVELS, EnvironmentLevel, Frame, LeafTriangle, Light, MATERIAL_TEXTURES, MEDIA,
        Material, Medium, SRGB_CODES, TextureUse,
    },
};

const LEAF_CULLED: u32 = 0x8000_0000;
const LEAF_TRANSPARENT: u32 = 0x4000_0000;

const MATERIAL_MASK: u32 = 1;
const MATERIAL_BLEND: u32 = 2;
const MATERIAL_UNLIT: u32 = 4;
const MATERIAL_KA: u32 = 8;
const MATERIAL_KD: u32 = 16;
const MATERIAL_KS: u32 = 32;
const MATERIAL_N: u32 = 64;
const MATERIAL_KT: u32 = 128;

const IOR_INFINITE: f32 = 1e30;

/// `LARGEST_RADIANCE` of `shaders/math.wgsl`: what is brighter is brought down to it.
pub(crate) const LARGEST_RADIANCE: f32 = 1e30;

/// Of a colour or coefficient of the book that multiplies light: a thousand times what has a meaning, and far from f32's limits.
pub(crate) const LARGEST_FACTOR: f32 = 1e6;

/// The dimmest channel of an attenuation colour: below, its logarithm means nothing.
const LEAST_ATTENUATION: f32 = 1e-6;

/// The tables whose size goes with the number of triangles, by their names in `shaders/bindings.wgsl`.
pub(crate) const GEOMETRY_TABLES: [&str; 7] = [
    "nodes",
    "leaf_vertices",
    "leaf_triangles",
    "leaf_materials",
    "leaf_nodes",
    "attributes",
    "instances",
];

/// The others.
const SMALL_TABLES: [&str; 5] = [
    "materials",
    "texture_uses",
    "texels",
    "environment",
    "lights",
];

fn tables() -> impl Iterator<Item = &'static str> {
    GEOMETRY_TABLES.into_iter().chain(SMALL_TABLES)
}

/// More media than a byte can name.
#[derive(Debug, thiserror::Error)]
#[error(
    "the scene has {0} different transparent media, more than the 255 that a ray can tell apart; merge materials whose index and attenuation are alike"
)]
pub struct TooManyMedia(usize);

/// The scene's tables, in the order of `shaders/bindings.wgsl`. What goes with the number of triangles is laid out when it is
/// asked for ([`Self::table`]), part by part; the rest is here.
#[derive(Debug)]
#[allow(missing_docs, reason = "explained in shaders/bindings.wgsl")]
pub struct GpuScene<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    attributes: Attributes<'a>,
    /// What a leaf's entry says of each material.
    leaf_flags: Vec<u32>,
    instances: Vec<InstanceRecord>,
    pub materials: Vec<Material>,
    pub texture_uses: Vec<[TextureUse; MATERIAL_TEXTURES]>,
    pub texels: Vec<u32>,
    pub environment: Vec<[f32; 4]>,
    pub lights: Vec<Light>,
    pub media: Vec<Medium>,
    pub environment_levels: [EnvironmentLevel; ENVIRONMENT_LEVELS],
}

/// The root of a scene without triangles: whatever is traced there meets nothing, and no kernel has to ask.
const NO_CHILDREN: [Node; 1] = [[0; 20]];

impl<'a> GpuScene<'a> {
    /// Lays out `scene`, with its hierarchy, for a program with these features.
    ///
    /// # Errors
    /// [`TooManyMedia`].
    ///
    /// # Panics
    /// If the hierarchy is not as [`raytree_bvh::build`] leaves it: a traversal might not end ([`Bvh::is_finite`]).
    pub fn new(
        scene: &'a Scene,
        bvh: &'a Bvh,
        features: ProgramFeatures,
        shading: Shading,
    ) -> Result<Self, TooManyMedia> {
        assert!(bvh.is_finite(), "the hierarchy is none of raytree_bvh's");
        let materials = scene.materials.iter();
        let mut gpu = Self {
            scene,
            bvh,
            attributes: Attributes::new(&scene.geometry, features),
            leaf_flags: materials
                .map(|material| leaf_flags(material, shading))
                .collect(),
            instances: instances::records(scene, bvh),
            materials: Vec::new(),
            texture_uses: Vec::new(),
            texels: Vec::new(),
            environment: Vec::new(),
            lights: scene.lights.iter().map(light).collect(),
            media: Vec::new(),
            environment_levels: Default::default(),
        };
        gpu.add_materials(shading)?;
        if features.has(Feature::Textures) {
            gpu.add_textures();
        }
        gpu.add_environment();
        Ok(gpu)
    }

    /// The table called `name` in `shaders/bindings.wgsl`; `None` if there is none of that name.
    #[must_use]
    pub fn table(&self, name: &str) -> Option<Table<'_>> {
        let wide = Table::wide;
        let leaves = self.bvh.leaf_triangles.len();
        let triangle = |leaf| self.triangle(leaf);
        Some(match name {
            "nodes" if self.bvh.nodes.is_empty() => wide(cast_slice(&NO_CHILDREN)),
            "nodes" => wide(cast_slice(&self.bvh.nodes)),
            "leaf_vertices" => Table::wide_of(leaves, |leaf| self.leaf_vertices(leaf)),
            "leaf_triangles" => {
                Table::wide_of::<4>(leaves, |leaf| bytemuck::cast(self.leaf_triangle(leaf)))
            }
            "leaf_materials" => {
                Table::narrow_of(leaves, move |leaf| triangle(leaf).map_or(0, |t| t.material))
            }
            "leaf_nodes" => {
                Table::narrow_of(leaves, move |leaf| triangle(leaf).map_or(0, |t| t.node))
            }
            "attributes" => self.attributes.table(),
            "instances" => wide(cast_slice(self.instances.as_flattened())),
            "materials" => wide(cast_slice(&self.materials)),
            "texture_uses" => wide(cast_slice(self.texture_uses.as_flattened())),
            "texels" => Table::narrow(&self.texels),
            "environment" => wide(cast_slice(&self.environment)),
            "lights" => wide(cast_slice(&self.lights)),
            _ => return None,
        })
    }

    /// Does a device with textures of at most `highest` rows have room for each table?
    ///
    /// # Errors
    /// [`RenderError::TooLarge`] if not.
    pub(crate) fn check(&self, highest: u32) -> Result<(), RenderError> {
        if self.instances.len() > MOST_INSTANCES {
            let size = size_of::<InstanceRecord>() as u64;
            return Err(RenderError::TooLarge {
                buffer: "instances".to_owned(),
                bytes: self.instances.len() as u64 * size,
                limit: MOST_INSTANCES as u64 * size,
            });
        }
        tables()
            .filter_map(|name| Some((name, self.table(name)?)))
            .try_for_each(|(name, table)| table.check(name, highest))
    }

    /// What kernels have to know of the tables; all else is zero.
    pub(crate) fn frame(&self) -> Frame {
        let vertex = self.attributes.record;
        Frame {
            vertex_words: vertex.words,
            uv_word: vertex.uv_word,
            color_word: vertex.color_word,
            tangent_word: vertex.tangent_word,
            texture_kinds: self.texture_kinds(),
            environment: self.environment_levels,
            ..Frame::zeroed()
        }
    }

    /// What the record of a vertex holds.
    #[must_use]
    pub fn vertex(&self) -> VertexRecord {
        self.attributes.record
    }

    /// Entry `leaf` of `leaf_triangles`.
    #[must_use]
    pub fn leaf_triangle(&self, leaf: usize) -> LeafTriangle {
        let Some(triangle) = self.triangle(leaf) else {
            return LeafTriangle::zeroed();
        };
        let vertices = turned(&self.scene.geometry, triangle.vertices);
        LeafTriangle {
            vertices: vertices.map(|vertex| self.attributes.number(vertex)),
            entry: self.bvh.leaf_triangles[leaf] | self.leaf_flags[triangle.material as usize],
        }
    }

    /// Entry `leaf` of `leaf_vertices`: corners and normal.
    fn leaf_vertices(&self, leaf: usize) -> [u32; 12] {
        let geometry = &self.scene.geometry;
        let Some(triangle) = self.triangle(leaf) else {
            return instances::leaf(self.bvh.leaf_triangles[leaf] & !INSTANCE);
        };
        let vertices = turned(geometry, triangle.vertices);
        let [a, b, c] = vertices.map(|vertex| geometry.positions[vertex as usize]);
        bytemuck::cast([a, b, c, unit_normal([a, b, c])].map(|vector| vector.to_array()))
    }

    /// `None`: the leaf is a place of a mesh.
    fn triangle(&self, leaf: usize) -> Option<Triangle> {
        let entry = self.bvh.leaf_triangles[leaf];
        (entry & INSTANCE == 0).then(|| self.scene.geometry.triangles[entry as usize])
    }

    /// Which of the textures that a material can have some material has, a bit each.
    fn texture_kinds(&self) -> u32 {
        let kinds = self
            .texture_uses
            .iter()
            .flat_map(|uses| uses.iter().zip(0..));
        kinds
            .filter(|(used, _)| used.offset != TextureUse::NONE.offset)
            .fold(0, |kinds, (_, kind)| kinds | 1 << kind)
    }

    fn add_materials(&mut self, shading: Shading) -> Result<(), TooManyMedia> {
        let scene = self.scene;
        let ranked = RankedMedia::of(scene, shading);
        let materials = scene.materials.iter().zip(&ranked.rank_of_material);
        self.materials = materials
            .map(|(source, rank)| Material {
                medium: rank.map_or(0, |rank| rank + 1),
                ..material(source, shading)
            })
            .collect();
        self.media = ranked.media;
        if self.media.len() > MEDIA {
            return Err(TooManyMedia(self.media.len()));
        }
        Ok(())
    }

    fn add_textures(&mut self) {
        let scene = self.scene;
        let mut offsets = Vec::with_capacity(scene.images.len());
        for image in &scene.images {
            offsets.push(self.texels.len() as u32);
            self.texels
                .extend(image.texels.iter().map(|&texel| u32::from_le_bytes(texel)));
        }
        let uses = scene.materials.iter().map(|source| {
            // In the order of `shaders/types.wgsl`.
            source.texture_slots().map(|texture| {
                texture.map_or(TextureUse::NONE, |texture| {
                    texture_use(scene, &offsets, texture)
                })
            })
        });
        self.texture_uses = uses.collect();
    }

    fn add_environment(&mut self) {
        let Some(environment) = &self.scene.surroundings.environment else {
            return;
        };
        let levels = std::iter::once(&environment.radiance)
            .chain(&environment.rough)
            .chain([&environment.irradiance]);
        for (slot, map) in self.environment_levels.iter_mut().zip(levels) {
            *slot = append_map(&mut self.environment, map);
        }
    }
}

/// Which corner of a triangle lies opposite to its longest edge; the first of equals. From there the edges are the two shorter
/// ones, which for a needle are not nearly parallel: their cross product and all that is divided by it keep their digits.
pub(crate) fn first_corner(corners: [Vec3; 3]) -> usize {
    let opposite = |k: usize| {
        let [a, b] = [1, 2].map(|step| corners[(k + step) % 3].as_dvec3());
        a.distance_squared(b)
    };
    (1..3).fold(0, |best, k| {
        if opposite(k) > opposite(best) {
            k
        } else {
            best
        }
    })
}

/// The same triangle, begun at its [`first_corner`].
fn turned(geometry: &Geometry, vertices: [u32; 3]) -> [u32; 3] {
    let first = first_corner(vertices.map(|vertex| geometry.positions[vertex as usize]));
    [0, 1, 2].map(|k| vertices[(first + k) % 3])
}

/// Unit, out of the front; zero for a triangle without area, which no ray hits. Differences of f32 are exact in f64 unless they
/// lie very far apart, so that it is right to the last bit even for slivers, whose cross product in f32 may point anywhere.
fn unit_normal(corners: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    // Scaled first: products of tiny edges may underflow.
    let scale = e1.abs().max(e2.abs()).max_element().max(f64::MIN_POSITIVE);
    (e1 / scale).cross(e2 / scale).normalize_or_zero().as_vec3()
}

fn append_map(colors: &mut Vec<[f32; 4]>, map: &EquirectMap) -> EnvironmentLevel {
    let level = EnvironmentLevel {
        offset: colors.len() as u32,
        width: map.width,
        height: map.height,
        unused: 0,
    };
    colors.extend(map.texels.iter().map(|texel| {
        let [r, g, b] = texel.map(|channel| channel.min(LARGEST_RADIANCE));
        [r, g, b, 0.0]
    }));
    level
}

fn leaf_flags(material: &SceneMaterial, shading: Shading) -> u32 {
    let whitted = shading == Shading::Whitted && whitted_transmits(material);
    let transmits = transmits(material) || whitted;
    let culled = !material.double_sided && !transmits;
    let transparent = transmits || material.alpha_mode != AlphaMode::Opaque;
    (u32::from(culled) * LEAF_CULLED) | (u32::from(transparent) * LEAF_TRANSPARENT)
}

fn ior(source: &SceneMaterial, shading: Shading) -> f32 {
    let authored = source
        .whitted
        .and_then(|k| k.ior)
        .filter(|_| shading == Shading::Whitted);
    let ior = authored.unwrap_or(source.ior);
    if ior.is_finite() { ior } else { IOR_INFINITE }
}

/// What fills the solid that the material bounds, if it bounds one.
pub(crate) fn medium(source: &SceneMaterial, shading: Shading) -> Option<Medium> {
    let whitted = shading == Shading::Whitted && whitted_transmits(source);
    if !(whitted || (transmits(source) && source.volume.is_some())) {
        return None;
    }
    let absorption = source.volume.map_or(Vec3::ZERO, |volume| {
        let color = volume.attenuation_color.max(Vec3::splat(LEAST_ATTENUATION));
        let distance = volume.attenuation_distance;
        Vec3::from_array(
            color
                .to_array()
                .map(|c| (-f64::from(c).ln() / distance).max(0.0) as f32),
        )
    });
    Some(Medium {
        absorption: absorption.to_array(),
        ior: ior(source, shading),
        // In the same order, from 0.
        priority: source.priority.cast_unsigned() ^ (1 << 31),
        ..Medium::default()
    })
}

fn material(source: &SceneMaterial, shading: Shading) -> Material {
    let mut flags = 0;
    let mut alpha_cutoff = 0.0;
    match source.alpha_mode {
        AlphaMode::Opaque => {}
        AlphaMode::Mask { cutoff } => {
            flags |= MATERIAL_MASK;
            alpha_cutoff = cutoff;
        }
        AlphaMode::Blend => flags |= MATERIAL_BLEND,
    }
    if source.unlit {
        flags |= MATERIAL_UNLIT;
    }
    let whitted = source.whitted.unwrap_or_default();
    let factor = |given: Option<f32>| given.unwrap_or_default().min(LARGEST_FACTOR);
    let factors = |given: Option<Vec3>| given.unwrap_or_default().min(Vec3::splat(LARGEST_FACTOR));
    for (flag, given) in [
        (MATERIAL_KA, whitted.ka.is_some()),
        (MATERIAL_KD, whitted.kd.is_some()),
        (MATERIAL_KS, whitted.ks.is_some()),
        (MATERIAL_N, whitted.n.is_some()),
        (MATERIAL_KT, whitted.kt.is_some()),
    ] {
        flags |= if given { flag } else { 0 };
    }
    Material {
        base_color: source.base_color.to_array(),
        emissive: in_range(source.emissive).to_array(),
        alpha_cutoff,
        specular_color: source.specular_color.to_array(),
        specular: source.specular,
        metallic: source.metallic,
        roughness: source.roughness,
        transmission: if source.unlit {
            0.0
        } else {
            source.transmission
        },
        ior: ior(source, shading),
        normal_scale: source.normal_scale,
        occlusion_strength: source.occlusion_strength,
        flags,
        medium: 0,
        whitted_ks: factors(whitted.ks).to_array(),
        whitted_n: whitted.n.unwrap_or_default(),
        whitted_kt: factors(whitted.kt).to_array(),
        whitted_ka: factor(whitted.ka),
        whitted_kd: factor(whitted.kd),
        unused_0: 0,
        unused_1: 0,
        unused_2: 0,
    }
}

fn texture_use(scene: &Scene, images: &[u32], source: &TextureRef) -> TextureUse {
    let [a, b, c, d, e, f] = source.transform;
    let texture = scene.textures[source.texture as usize];
    let image = &scene.images[texture.image as usize];
    let nearest = u32::from(texture.filter == Filter::Nearest) << 4;
    let srgb = u32::from(texture.srgb) << 5;
    TextureUse {
        row_u: [a, b, c],
        offset: images[texture.image as usize],
        row_v: [d, e, f],
        uv_set: source.uv_set,
        width: image.width,
        height: image.height,
        flags: wrap(texture.wrap_u) | (wrap(texture.wrap_v) << 2) | nearest | srgb,
        unused: 0,
    }
}

fn wrap(mode: Wrap) -> u32 {
    match mode {
        Wrap::Repeat => 0,
        Wrap::MirroredRepeat => 1,
        Wrap::ClampToEdge => 2,
    }
}

/// Of each code of 8 bits, for `decoded_srgb` of the shaders.
pub(crate) fn decoded_srgb() -> [f32; SRGB_CODES] {
    std::array::from_fn(|code| srgb_to_linear(code as u8))
}

/// Brought down to the largest radiance that is computed with.
pub(crate) fn in_range(radiance: Vec3) -> Vec3 {
    radiance.min(Vec3::splat(LARGEST_RADIANCE))
}

fn light(source: &SceneLight) -> Light {
    let largest = f64::from(LARGEST_RADIANCE);
    let intensity = source.intensity.min(DVec3::splat(largest));
    let nearest = (intensity.max_element().max(1.0) / largest).sqrt() as f32;
    let intensity = intensity.as_vec3().to_array();
    let inverse = |range: f64| {
        if range.is_finite() {
            range.recip() as f32
        } else {
            0.0
        }
    };
    match source.kind {
        LightKind::Directional { direction } => Light {
            kind: 0,
            direction: direction.as_vec3().to_array(),
            intensity,
            ..Light::default()
        },
        LightKind::Point { position, range } => Light {
            kind: 1,
            position: position.as_vec3().to_array(),
            inverse_range: inverse(range),
            intensity,
            nearest,
            ..Light::default()
        },
        LightKind::Spot {
            position,
            direction,
            range,
            inner_cone_angle,
            outer_cone_angle,
        } => Light {
            kind: 2,
            position: position.as_vec3().to_array(),
            direction: direction.as_vec3().to_array(),
            inverse_range: inverse(range),
            intensity,
            spot_scale: (inner_cone_angle.cos() - outer_cone_angle.cos())
                .max(1e-9)
                .recip() as f32,
            spot_cos_outer: outer_cone_angle.cos() as f32,
            nearest,
            ..Light::default()
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known before anything is uploaded: the first table that does not fit a device with textures of one row.
    #[test]
    fn a_scene_that_is_too_large_is_refused() {
        let triangle = Triangle {
            vertices: [0, 1, 2],
            material: 0,
            node: 0,
        };
        let scene = Scene {
            geometry: Geometry {
                triangles: vec![triangle; 3000],
                normals: vec![Vec3::Z; 3],
                ..geometry()
            },
            materials: vec![SceneMaterial::default()],
            ..Scene::default()
        };
        let bvh = crate::build_bvh(&scene, raytree_bvh::Preset::Fast).unwrap();
        let features = ProgramFeatures::everything();
        let gpu = GpuScene::new(&scene, &bvh, features, Shading::Pbr).unwrap();
        assert!(gpu.check(2).is_ok());
        let Err(RenderError::TooLarge { buffer, bytes, .. }) = gpu.check(1) else {
            panic!("9,000 texels fit into 8,192");
        };
        assert_eq!((buffer.as_str(), bytes), ("leaf_vertices", 2 * 8192 * 16));
    }

    #[test]
    fn each_table_is_checked() {
        let (scene, bvh) = (Scene::default(), Bvh::default());
        let features = ProgramFeatures::everything();
        let gpu = GpuScene::new(&scene, &bvh, features, Shading::Pbr).unwrap();
        assert!(tables().all(|name| gpu.table(name).is_some()));
    }

    const NEEDLE: [Vec3; 3] = [
        Vec3::new(0.1, 0.2, 0.3),
        Vec3::new(0.9, 0.7, 0.8),
        Vec3::new(0.9, 0.7, 0.800_01),
    ];

    fn geometry() -> Geometry {
        Geometry {
            positions: NEEDLE.to_vec(),
            ..Geometry::default()
        }
    }

    /// The longest edge is that from 0 to 2, whatever the triangle begins with.
    #[test]
    fn a_triangle_begins_opposite_to_its_longest_edge() {
        for turn in 0..3 {
            let vertices = [0, 1, 2].map(|k| (k + turn) % 3);
            assert_eq!(turned(&geometry(), vertices), [1, 2, 0]);
        }
        assert_eq!(first_corner([Vec3::ZERO; 3]), 0);
    }

    /// Its short edge runs along z: the normal lies across that, and across the long edge.
    #[test]
    fn a_sliver_has_the_normal_that_its_corners_give_it() {
        let normal = unit_normal(NEEDLE).to_array().map(f64::from);
        let long = NEEDLE[1].as_dvec3() - NEEDLE[0].as_dvec3();
        let across = long.x.hypot(long.y);
        for (ours, expected) in normal
            .into_iter()
            .zip([long.y / across, -long.x / across, 0.0])
        {
            assert!((ours - expected).abs() < 1e-7, "{normal:?}");
        }
        assert_eq!(unit_normal([NEEDLE[0], NEEDLE[1], NEEDLE[1]]), Vec3::ZERO);
    }

    #[test]
    fn a_tiny_triangle_has_a_normal() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|corner| 1e-30 * corner);
        assert_eq!(unit_normal(corners), Vec3::Z);
    }
}
