//! The glTF 2.0 importer: a `.gltf` or `.glb` file becomes a [`Scene`], all its special cases resolved.
//!
//! Each chapter of the specification has its file here. Everything that comes from the file is checked before it is used: a
//! broken file is an [`ImportError`], never a panic, and memory stays in proportion to the file and to [`ImportOptions`].
//! The scene is shown at rest: skins, morph targets and animations are left out with a warning.

mod accessor;
mod buffers;
mod camera;
mod container;
mod document;
mod error;
mod extension;
mod frame;
mod geometry;
mod light;
mod material;
mod node;
mod primitive;
mod sharing;
mod tangents;
mod texture;
mod uri;

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use self::buffers::Buffers;
use self::document::{Document, index};
pub use self::error::ImportError;
use self::error::{Fault, Outcome, Warnings};
use self::geometry::{Instance, Layout};
use self::node::PlacedNode;
use self::primitive::{Dropped, Needs, Primitive, Size};
pub use self::sharing::Sharing;
use self::texture::TextureTable;
use crate::model::{Frame, Geometry, Material, Scene};

/// How large a scene may become. A small file may ask for much: it can show a mesh a million times, and compress an image
/// a thousandfold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImportOptions {
    /// Triangles of all instances together; those of a mesh that nodes share once.
    pub max_triangles: u64,
    /// Texels of all images together; each takes four bytes.
    pub max_texels: u64,
    /// Bytes of all buffers together.
    pub max_bytes: u64,
    /// Whether nodes may share the memory of their mesh.
    pub sharing: Sharing,
}

impl Default for ImportOptions {
    /// 16 Mi triangles, 256 Mi texels, 4 GiB.
    fn default() -> Self {
        Self {
            max_triangles: 1 << 24,
            max_texels: 1 << 28,
            max_bytes: 1 << 32,
            sharing: Sharing::default(),
        }
    }
}

/// Reads the default scene of a glTF file (`.gltf` with what it refers to, or `.glb`) with the default [`ImportOptions`].
///
/// # Errors
///
/// See [`ImportError`]. Nothing in a file makes it panic.
pub fn import(path: &Path) -> Result<Scene, ImportError> {
    import_with(path, &ImportOptions::default())
}

/// [`import`] with limits of the caller's choice.
///
/// # Errors
///
/// See [`ImportError`].
pub fn import_with(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::read(path)
        .map_err(|error| Fault::io("the scene file", error))
        .and_then(|file| import_bytes(&file, folder, options))
        .map_err(|fault| fault.in_file(path))
}

fn import_bytes(file: &[u8], folder: &Path, options: &ImportOptions) -> Outcome<Scene> {
    let mut warnings = Warnings::default();
    let container = container::split(file, &mut warnings)?;
    let document = Document::parse(container.json)?;
    extension::check(&document, &mut warnings)?;
    let nodes = node::placed_nodes(&document)?;
    texture::check_sources(&document)?;
    let buffers = Buffers::load(&document, container.binary, folder, options.max_bytes)?;
    accessor::check_all(&document, &buffers)?;

    let uses = primitive_uses(&document, &nodes, options, &mut warnings)?;
    let mut textures = TextureTable::default();
    let numbers = material_numbers(&uses);
    let (mut materials, uv_sets) = material::load(
        &document,
        numbers.keys().map(MaterialKey::index),
        &mut textures,
        &mut warnings,
    )?;
    let images = textures.decode_images(&document, &buffers, folder, options.max_texels)?;

    let primitives = load_primitives(
        &document,
        &buffers,
        &uses,
        &numbers,
        &materials,
        &uv_sets,
        &mut warnings,
    )?;
    let (node_names, instances) = place_instances(&document, &uses, &numbers, &primitives);
    let frame = frame::of_scene(&document, &nodes, &instances)?;
    let plan = sharing::Plan::new(
        &document,
        &uses,
        &instances,
        &materials,
        &frame,
        options.sharing,
    );
    plan.check(&document, &uses, &instances, options)?;
    let layout = Layout {
        uv_sets: uv_sets.len(),
        tangents: materials
            .iter()
            .any(|material| material.normal_texture.is_some()),
        colors: primitives
            .values()
            .any(|primitive| !primitive.colors.is_empty()),
    };
    let (mut geometry, mut dropped) = geometry::assemble(&instances, &plan.shared, &frame, &layout);
    let (meshes, placed, left_out) = plan.assemble(
        &document,
        (&uses, &instances),
        &frame,
        &layout,
        &mut geometry,
    );
    dropped += left_out;
    warn_of_losses(&document, &nodes, &geometry, dropped, &mut warnings);
    scale_lengths(&mut materials, &frame);
    let cameras = camera::load(&document, &nodes, &frame, &mut warnings)?;
    let lights = light::load(&document, &nodes, &frame, &mut warnings)?;
    Ok(Scene {
        frame,
        geometry,
        meshes,
        instances: placed,
        repeated: plan.repeated,
        materials,
        textures: textures.textures,
        images,
        lights,
        cameras,
        nodes: node_names,
        files: uri::files_beside(&document, folder),
        warnings: warnings.0,
        ..Scene::default()
    })
}

/// A primitive with triangles, shown by a node.
struct Use<'a> {
    node: &'a PlacedNode,
    mesh: usize,
    primitive: usize,
    material: MaterialKey,
}

/// The file's materials in their order, then glTF's default one.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum MaterialKey {
    OfFile(usize),
    Default,
}

impl MaterialKey {
    fn index(&self) -> Option<usize> {
        match *self {
            Self::OfFile(index) => Some(index),
            Self::Default => None,
        }
    }
}

/// Which primitives the scene shows, in the order of the nodes. Refuses scenes beyond the limits before reading any of it.
fn primitive_uses<'a>(
    document: &Document,
    nodes: &'a [PlacedNode],
    options: &ImportOptions,
    warnings: &mut Warnings,
) -> Outcome<Vec<Use<'a>>> {
    let mut uses = Vec::new();
    let mut meshes = BTreeMap::new();
    // Of each primitive once, or as often as it is shown where nothing may be shared.
    let (mut triangles, mut vertices) = (0_u64, 0_u64);
    for node in nodes {
        let Some(mesh) = index(&document.elements("nodes")[node.index], "mesh") else {
            continue;
        };
        let mut is_new = false;
        let primitives = match meshes.entry(mesh) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => {
                is_new = true;
                let primitives = drawn_primitives(document, mesh, warnings)?;
                vertices = primitives
                    .iter()
                    .fold(vertices, |sum, (_, size)| sum.saturating_add(size.vertices));
                new.insert(primitives)
            }
        };
        for &(primitive, ref size) in primitives.iter() {
            if is_new || options.sharing == Sharing::Never {
                triangles = triangles.saturating_add(size.triangles);
            }
            // Primitives may share vertices that most of them do not use; looking through them all takes time.
            if triangles > options.max_triangles
                || vertices > options.max_triangles.saturating_mul(16)
                || uses.len() as u64 >= options.max_triangles
            {
                return Err(too_many_triangles(
                    document,
                    node.index,
                    options.max_triangles,
                ));
            }
            let material = document.meshes[mesh].primitives[primitive].material;
            let material = material.map_or(MaterialKey::Default, |index| {
                MaterialKey::OfFile(index.value())
            });
            uses.push(Use {
                node,
                mesh,
                primitive,
                material,
            });
        }
    }
    Ok(uses)
}

fn too_many_triangles(document: &Document, node: usize, limit: u64) -> Fault {
    let problem = format!(
        "the scene has more than {limit} triangles; simplify it, or split it into several files"
    );
    Fault::limit(document.place("nodes", node), problem)
}

/// The primitives of a mesh that have triangles, by number, and their sizes. Warns of the others.
fn drawn_primitives(
    document: &Document,
    mesh: usize,
    warnings: &mut Warnings,
) -> Outcome<Vec<(usize, Size)>> {
    let mut drawn = Vec::new();
    for (number, primitive) in document.meshes[mesh].primitives.iter().enumerate() {
        match primitive::size(document, primitive) {
            Some(size) => drawn.push((number, size)),
            None => primitive::explain_skipped(
                primitive,
                &primitive_place(document, mesh, number),
                warnings,
            )?,
        }
    }
    Ok(drawn)
}

fn primitive_place(document: &Document, mesh: usize, primitive: usize) -> String {
    format!("{}, primitive {primitive}", document.place("meshes", mesh))
}

/// The scene's number of each material that is used.
fn material_numbers(uses: &[Use<'_>]) -> BTreeMap<MaterialKey, u32> {
    let used: BTreeSet<MaterialKey> = uses.iter().map(|used| used.material).collect();
    used.into_iter().zip(0..).collect()
}

/// Each used primitive, read once however often it is shown. By mesh and number within it.
fn load_primitives(
    document: &Document,
    buffers: &Buffers<'_>,
    uses: &[Use<'_>],
    numbers: &BTreeMap<MaterialKey, u32>,
    materials: &[Material],
    uv_sets: &[u32],
    warnings: &mut Warnings,
) -> Outcome<BTreeMap<(usize, usize), Primitive>> {
    let mut primitives = BTreeMap::new();
    for used in uses {
        let key = (used.mesh, used.primitive);
        if primitives.contains_key(&key) {
            continue;
        }
        let material = &materials[numbers[&used.material] as usize];
        let needs = Needs {
            uv_sets,
            reads: material
                .texture_refs()
                .map(|texture| uv_sets[texture.uv_set as usize])
                .collect(),
            normal_map: material.normal_texture,
        };
        let json = &document.meshes[used.mesh].primitives[used.primitive];
        let place = primitive_place(document, used.mesh, used.primitive);
        primitives.insert(
            key,
            primitive::load(document, buffers, json, &needs, &place, warnings)?,
        );
    }
    Ok(primitives)
}

/// All instances, and the names of the nodes that carry them.
fn place_instances<'a>(
    document: &Document,
    uses: &[Use<'_>],
    numbers: &BTreeMap<MaterialKey, u32>,
    primitives: &'a BTreeMap<(usize, usize), Primitive>,
) -> (Vec<String>, Vec<Instance<'a>>) {
    let (mut names, mut last) = (Vec::new(), None);
    let mut instances = Vec::with_capacity(uses.len());
    for used in uses {
        let node = used.node.index;
        if last.replace(node) != Some(node) {
            names.push(
                document
                    .name("nodes", node)
                    .map_or_else(|| document.number("nodes", node), str::to_owned),
            );
        }
        instances.push(Instance {
            primitive: &primitives[&(used.mesh, used.primitive)],
            world: used.node.world,
            material: numbers[&used.material],
            node: names.len() as u32 - 1,
        });
    }
    (names, instances)
}

/// What only a look at the whole shows.
fn warn_of_losses(
    document: &Document,
    nodes: &[PlacedNode],
    geometry: &Geometry,
    dropped: Dropped,
    warnings: &mut Warnings,
) {
    for (count, what) in [
        (dropped.no_area, "triangles have no area"),
        (
            dropped.not_finite,
            "triangles have a corner that is infinite or not a number",
        ),
    ] {
        if count > 0 {
            warnings.push("meshes", format!("{count} {what} and are left out"));
        }
    }
    if geometry.triangles.is_empty() {
        warnings.push("the scene", "has no triangles");
    }
    let has = |field: &str| {
        nodes
            .iter()
            .any(|node| document.elements("nodes")[node.index].get(field).is_some())
    };
    if !document.elements("animations").is_empty() {
        warnings.push("animations", "not supported: the scene is shown at rest");
    }
    if has("skin") {
        warnings.push(
            "skins",
            "not supported: skinned meshes are shown as their nodes place them",
        );
    }
    let morphs = |mesh: &gltf::json::Mesh| {
        mesh.primitives
            .iter()
            .any(|primitive| primitive.targets.is_some())
    };
    if document.meshes.iter().any(morphs) {
        warnings.push(
            "morph targets",
            "not supported: meshes are shown undeformed",
        );
    }
}

/// Lengths in materials, from metres into scene space.
fn scale_lengths(materials: &mut [Material], frame: &Frame) {
    for volume in materials
        .iter_mut()
        .filter_map(|material| material.volume.as_mut())
    {
        volume.attenuation_distance *= frame.scale;
    }
}
