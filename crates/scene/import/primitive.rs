//! Mesh primitives (glTF 2.0, 3.7.2) in their mesh's own space: triangles of all three kinds, with the attributes that the
//! scene needs, and nothing that no triangle uses.

use std::collections::{BTreeSet, HashMap};
use std::ops::AddAssign;

use glam::{DVec3, Vec2, Vec3, Vec4};
use gltf::json;
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::Checked::Valid;

use super::accessor::{Accessor, Usage};
use super::buffers::Buffers;
use super::document::Document;
use super::error::{Fault, Outcome, Warnings};
use super::extension;
use super::tangents;
use crate::model::TextureRef;
use crate::parallel::mapped;

/// A primitive's triangles. Attribute lists are as long as `positions` or empty.
#[derive(Clone, Debug, Default)]
pub(super) struct Primitive {
    pub(super) positions: Vec<DVec3>,
    /// Empty: flat shaded; vertices are then not shared.
    pub(super) normals: Vec<Vec3>,
    /// Empty unless the material has a normal map.
    pub(super) tangents: Vec<Vec4>,
    /// For each of the scene's UV sets.
    pub(super) uv_sets: Vec<Vec<Vec2>>,
    pub(super) colors: Vec<Vec4>,
    /// Never with a repeated vertex.
    pub(super) triangles: Vec<[u32; 3]>,
    /// How many triangles were left out.
    pub(super) dropped: Dropped,
}

/// How many triangles were left out, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Dropped {
    /// They have no area: a vertex is repeated, or all three lie on a line.
    pub(super) no_area: usize,
    /// A corner is infinite or not a number.
    pub(super) not_finite: usize,
}

impl AddAssign for Dropped {
    fn add_assign(&mut self, other: Self) {
        self.no_area += other.no_area;
        self.not_finite += other.not_finite;
    }
}

/// What the scene's materials ask of a primitive.
pub(super) struct Needs<'a> {
    /// The file's number of each UV set of the scene.
    pub(super) uv_sets: &'a [u32],
    /// Those of them that the primitive's own material reads.
    pub(super) reads: Vec<u32>,
    /// The normal map of the primitive's own material.
    pub(super) normal_map: Option<TextureRef>,
}

/// How many triangles a primitive makes and how many vertices it names, before any is read.
pub(super) struct Size {
    pub(super) triangles: u64,
    pub(super) vertices: u64,
}

/// The size of a primitive, or `None` if it draws no triangles.
pub(super) fn size(document: &Document, primitive: &json::mesh::Primitive) -> Option<Size> {
    let count =
        |accessor: json::Index<json::Accessor>| document.accessors[accessor.value()].count.0;
    let vertices = count(attribute(primitive, Semantic::Positions)?);
    let corners = primitive.indices.map_or(vertices, count);
    let triangles = match primitive.mode {
        Valid(Mode::Triangles) => corners / 3,
        Valid(Mode::TriangleStrip | Mode::TriangleFan) => corners.saturating_sub(2),
        _ => 0,
    };
    (triangles > 0).then_some(Size {
        triangles,
        vertices,
    })
}

/// Warns of a primitive that draws no triangles, and refuses one of unknown mode.
pub(super) fn explain_skipped(
    primitive: &json::mesh::Primitive,
    place: &str,
    warnings: &mut Warnings,
) -> Outcome<()> {
    match primitive.mode {
        Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) => {
            warnings.push(
                place,
                "has no POSITION attribute, or not enough vertices for a triangle; it is not drawn",
            );
        }
        Valid(Mode::Points) => warnings.push(place, "points are not drawn"),
        Valid(_) => warnings.push(place, "lines are not drawn"),
        _ => return Err(Fault::invalid(place, "its mode is not one of glTF 2.0")),
    }
    Ok(())
}

fn attribute(
    primitive: &json::mesh::Primitive,
    semantic: Semantic,
) -> Option<json::Index<json::Accessor>> {
    primitive.attributes.get(&Valid(semantic)).copied()
}

/// Reads a primitive; [`size`] says that it has triangles.
pub(super) fn load(
    document: &Document,
    buffers: &Buffers<'_>,
    primitive: &json::mesh::Primitive,
    needs: &Needs<'_>,
    place: &str,
    warnings: &mut Warnings,
) -> Outcome<Primitive> {
    let attributes = Attributes::new(document, buffers, primitive, place)?;
    let Some(position) = attributes.get(Semantic::Positions, Usage::Position)? else {
        return Ok(Primitive::default());
    };
    let corners = corners(document, buffers, primitive, position.count, place)?;
    let (mut triangles, no_area) = triangles(primitive.mode, &corners, place, warnings);
    let mut dropped = drop_unusable(&mut triangles, &position)?;
    dropped.no_area += no_area;
    let normal = attributes.get(Semantic::Normals, Usage::Normal)?;

    // The file's number of each of our vertices. Flat shading needs a vertex of its own for every corner.
    let vertices = if normal.is_some() {
        share_vertices(&mut triangles, position.count)
    } else {
        unshare_vertices(&mut triangles)
    };

    let mut loaded = Primitive {
        triangles,
        dropped,
        ..Primitive::default()
    };
    let positions = position.gather(&vertices)?.into_iter();
    loaded.positions = positions.map(DVec3::from_array).collect();
    if let Some(normal) = &normal {
        // A normal without length becomes that of a triangle at the vertex.
        let mended = Mended::new("normals", "that of a triangle there is used", [0.0; 3]);
        let normals = mended.gather(normal, &vertices, place, warnings)?;
        loaded.normals = mapped(&normals, |&n| DVec3::from_array(n).as_vec3());
    }
    for &set in needs.uv_sets {
        let uv = attributes.get(Semantic::TexCoords(set), Usage::TexCoord)?;
        if uv.is_none() && needs.reads.contains(&set) {
            warnings.push(
                place,
                format!("has no TEXCOORD_{set}, which its material reads; (0, 0) is used"),
            );
        }
        loaded.uv_sets.push(match uv {
            Some(uv) => Mended::new("texture coordinates", "(0, 0) is used", [0.0; 2])
                .gather(&uv, &vertices, place, warnings)?
                .into_iter()
                .map(|[u, v]| Vec2::new(u as f32, v as f32))
                .collect(),
            None => vec![Vec2::ZERO; vertices.len()],
        });
    }
    if let Some(color) = attributes.get(Semantic::Colors(0), Usage::Color)? {
        loaded.colors = gather_colors(&color, &vertices, place, warnings)?;
    }
    if let Some(normal_map) = &needs.normal_map {
        let given = attributes.get(Semantic::Tangents, Usage::Tangent)?;
        match (given, normal) {
            (Some(tangent), Some(_)) => {
                loaded.tangents = gather_tangents(&tangent, &vertices, place, warnings)?;
            }
            // Tangents without normals are to be ignored (3.7.2.1).
            _ => loaded = with_tangents(loaded, normal_map),
        }
    }
    Ok(loaded)
}

/// A primitive's vertex attributes, all of the same length.
struct Attributes<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    primitive: &'a json::mesh::Primitive,
    quantized: bool,
}

impl<'a> Attributes<'a> {
    fn new(
        document: &'a Document,
        buffers: &'a Buffers<'_>,
        primitive: &'a json::mesh::Primitive,
        place: &str,
    ) -> Outcome<Self> {
        let mut counts = primitive
            .attributes
            .values()
            .map(|accessor| document.accessors[accessor.value()].count.0);
        let first = counts.next();
        if counts.any(|count| Some(count) != first) {
            return Err(Fault::invalid(place, "its attributes differ in length"));
        }
        let quantized = extension::is_used(document, "KHR_mesh_quantization");
        Ok(Self {
            document,
            buffers,
            primitive,
            quantized,
        })
    }

    fn get(&self, semantic: Semantic, usage: Usage) -> Outcome<Option<Accessor<'a>>> {
        let Some(index) = attribute(self.primitive, semantic) else {
            return Ok(None);
        };
        let accessor = Accessor::new(self.document, self.buffers, index.value())?;
        accessor.check_usage(usage, self.quantized)?;
        Ok(Some(accessor))
    }
}

/// The vertices in the order in which the primitive names them.
fn corners(
    document: &Document,
    buffers: &Buffers<'_>,
    primitive: &json::mesh::Primitive,
    vertex_count: usize,
    place: &str,
) -> Outcome<Vec<u32>> {
    let Some(index) = primitive.indices else {
        return Ok((0..vertex_count as u32).collect());
    };
    let accessor = Accessor::new(document, buffers, index.value())?;
    accessor.check_usage(Usage::Indices, false)?;
    let indices = accessor.indices()?;
    match indices.iter().max() {
        Some(&largest) if largest == accessor.restart_index() => Err(Fault::invalid(
            place,
            format!("index {largest} is reserved for primitive restart, which glTF does not have"),
        )),
        Some(&largest) if largest as usize >= vertex_count => Err(Fault::invalid(
            place,
            format!("index {largest}, but there are {vertex_count} vertices"),
        )),
        _ => Ok(indices),
    }
}

/// The triangles of a list, strip or fan, all counter-clockwise, without those that repeat a vertex (strips are stitched
/// together by such), and how many these were.
fn triangles(
    mode: json::validation::Checked<Mode>,
    corners: &[u32],
    place: &str,
    warnings: &mut Warnings,
) -> (Vec<[u32; 3]>, usize) {
    let proper = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    let (all, triangles): (usize, Vec<[u32; 3]>) = match mode {
        Valid(Mode::TriangleStrip) => {
            let strip = corners.windows(3).enumerate();
            let in_order = |(at, w): (usize, &[u32])| {
                if at % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[0], w[2], w[1]]
                }
            };
            (strip.len(), strip.map(in_order).filter(proper).collect())
        }
        Valid(Mode::TriangleFan) => {
            let rim = corners.get(1..).unwrap_or_default().windows(2);
            (
                rim.len(),
                rim.map(|w| [w[0], w[1], corners[0]])
                    .filter(proper)
                    .collect(),
            )
        }
        _ => {
            let (list, rest) = corners.as_chunks::<3>();
            if !rest.is_empty() {
                warnings.push(
                    place,
                    format!(
                        "its last triangle has only {} vertices and is not drawn",
                        rest.len()
                    ),
                );
            }
            (list.len(), list.iter().copied().filter(proper).collect())
        }
    };
    let degenerate = all - triangles.len();
    (triangles, degenerate)
}

/// Renumbers the vertices that the triangles use, in the order of the file; returns the file's number of each.
fn share_vertices(triangles: &mut [[u32; 3]], vertex_count: usize) -> Vec<u32> {
    const UNUSED: u32 = u32::MAX;
    let mut number = vec![UNUSED; vertex_count];
    for &corner in triangles.as_flattened() {
        number[corner as usize] = 0;
    }
    let mut used = Vec::with_capacity(vertex_count);
    for (vertex, number) in number
        .iter_mut()
        .enumerate()
        .filter(|(_, number)| **number != UNUSED)
    {
        *number = used.len() as u32;
        used.push(vertex as u32);
    }
    for corner in triangles.as_flattened_mut() {
        *corner = number[*corner as usize];
    }
    used
}

/// Gives each corner its own vertex; returns the file's number of each.
fn unshare_vertices(triangles: &mut [[u32; 3]]) -> Vec<u32> {
    let vertices = triangles.as_flattened().to_vec();
    for (number, corner) in triangles.as_flattened_mut().iter_mut().enumerate() {
        *corner = number as u32;
    }
    vertices
}

/// Takes out the triangles that can't be hit, wherever they are placed: neither they nor their corners count for anything, the
/// scene's extent least of all.
fn drop_unusable(triangles: &mut Vec<[u32; 3]>, position: &Accessor<'_>) -> Outcome<Dropped> {
    let corners = position.gather(triangles.as_flattened())?;
    let found = mapped(corners.as_chunks::<3>().0, |&corners| {
        let [a, b, c] = corners.map(DVec3::from_array);
        let finite = a.is_finite() && b.is_finite() && c.is_finite();
        (finite, (b - a).cross(c - a) != DVec3::ZERO)
    });
    let mut dropped = Dropped::default();
    let mut found = found.into_iter();
    triangles.retain(|_| {
        let (finite, has_area) = found.next().unwrap_or((true, true));
        dropped.not_finite += usize::from(!finite);
        dropped.no_area += usize::from(finite && !has_area);
        finite && has_area
    });
    Ok(dropped)
}

/// A vertex attribute that the picture can do without where it is infinite or not a number.
struct Mended<const N: usize> {
    name: &'static str,
    remedy: &'static str,
    instead: [f64; N],
}

impl<const N: usize> Mended<N> {
    fn new(name: &'static str, remedy: &'static str, instead: [f64; N]) -> Self {
        Self {
            name,
            remedy,
            instead,
        }
    }

    /// The attribute of the vertices, all finite; warns of how many were not.
    fn gather(
        &self,
        attribute: &Accessor<'_>,
        vertices: &[u32],
        place: &str,
        warnings: &mut Warnings,
    ) -> Outcome<Vec<[f64; N]>> {
        let mut values = attribute.gather(vertices)?;
        let finite = mapped(&values, |value: &[f64; N]| {
            value.iter().all(|x| x.is_finite())
        });
        if !finite.contains(&false) {
            return Ok(values);
        }
        // Flat shading has vertices several times over.
        let mut mended = BTreeSet::new();
        for (value, &vertex) in values.iter_mut().zip(vertices) {
            if value.iter().any(|x| !x.is_finite()) {
                *value = self.instead;
                mended.insert(vertex);
            }
        }
        if !mended.is_empty() {
            let (count, name, remedy) = (mended.len(), self.name, self.remedy);
            warnings.push(
                place,
                format!("{count} of its {name} are infinite or not a number; {remedy}"),
            );
        }
        Ok(values)
    }
}

fn gather_colors(
    color: &Accessor<'_>,
    vertices: &[u32],
    place: &str,
    warnings: &mut Warnings,
) -> Outcome<Vec<Vec4>> {
    const NAME: &str = "colours";
    const REMEDY: &str = "white is used";
    let opaque = |[r, g, b]: [f64; 3]| Vec4::new(r as f32, g as f32, b as f32, 1.0);
    Ok(match color.components {
        3 => Mended::new(NAME, REMEDY, [1.0; 3])
            .gather(color, vertices, place, warnings)?
            .into_iter()
            .map(opaque)
            .collect(),
        _ => Mended::new(NAME, REMEDY, [1.0; 4])
            .gather(color, vertices, place, warnings)?
            .into_iter()
            .map(|c: [f64; 4]| Vec4::from_array(c.map(|x| x as f32)))
            .collect(),
    })
}

fn gather_tangents(
    tangent: &Accessor<'_>,
    vertices: &[u32],
    place: &str,
    warnings: &mut Warnings,
) -> Outcome<Vec<Vec4>> {
    // Exactly +1 or -1, whatever quantisation or a careless exporter made of it.
    let sign = |w: f64| if w < 0.0 { -1.0 } else { 1.0 };
    let mended = Mended::new("tangents", "any direction is used", [0.0, 0.0, 0.0, 1.0]);
    let gathered = mended
        .gather(tangent, vertices, place, warnings)?
        .into_iter();
    Ok(gathered
        .map(|[x, y, z, w]: [f64; 4]| Vec4::new(x as f32, y as f32, z as f32, sign(w)))
        .collect())
}

/// Adds tangents by MikkTSpace. They belong to corners: a vertex whose corners differ is split.
fn with_tangents(primitive: Primitive, normal_map: &TextureRef) -> Primitive {
    let corner_tangents = tangents::generate(&primitive, normal_map);
    let mut numbers: HashMap<(u32, [u32; 4]), u32> =
        HashMap::with_capacity(primitive.positions.len());
    let (mut sources, mut split_tangents, mut split_triangles) =
        (Vec::new(), Vec::new(), primitive.triangles.clone());
    for (corner, tangent) in split_triangles
        .as_flattened_mut()
        .iter_mut()
        .zip(corner_tangents)
    {
        let vertex = *corner;
        *corner = *numbers
            .entry((vertex, tangent.to_array().map(f32::to_bits)))
            .or_insert_with(|| {
                sources.push(vertex as usize);
                split_tangents.push(tangent);
                sources.len() as u32 - 1
            });
    }
    Primitive {
        positions: select(&primitive.positions, &sources),
        normals: select(&primitive.normals, &sources),
        tangents: split_tangents,
        uv_sets: primitive
            .uv_sets
            .iter()
            .map(|set| select(set, &sources))
            .collect(),
        colors: select(&primitive.colors, &sources),
        triangles: split_triangles,
        dropped: primitive.dropped,
    }
}

/// The values at `sources`; none where the attribute is absent.
fn select<T: Copy>(values: &[T], sources: &[usize]) -> Vec<T> {
    if values.is_empty() {
        Vec::new()
    } else {
        sources.iter().map(|&source| values[source]).collect()
    }
}
