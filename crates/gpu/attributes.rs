//! What is interpolated over triangles: a record of attributes a vertex, vertices whose records are equal sharing one.

use glam::Vec4;
use rayon::prelude::*;
use raytree_scene::model::Geometry;

use crate::{
    program::{Feature, ProgramFeatures},
    table::Table,
    upload::LARGEST_FACTOR,
};

/// What the record of a vertex in the table `attributes` holds, in texels of four words.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl, Frame")]
pub struct VertexRecord {
    pub words: u32,
    pub uv_word: u32,
    pub color_word: u32,
    pub tangent_word: u32,
}

impl VertexRecord {
    /// Room for what a program with these features reads.
    fn new(geometry: &Geometry, features: ProgramFeatures) -> Self {
        let uv_sets = if features.has(Feature::Textures) {
            geometry.uv_sets.len() as u32
        } else {
            0
        };
        let uv_word = 1;
        let color_word = uv_word + uv_sets.div_ceil(2);
        let colors = features.has(Feature::VertexColors) && !geometry.colors.is_empty();
        let tangent_word = color_word + u32::from(colors);
        let tangents = features.has(Feature::NormalMaps) && !geometry.tangents.is_empty();
        Self {
            words: tangent_word + u32::from(tangents),
            uv_word,
            color_word,
            tangent_word,
        }
    }
}

/// The records of a geometry's vertices.
#[derive(Debug)]
pub(crate) struct Attributes<'a> {
    geometry: &'a Geometry,
    pub(crate) record: VertexRecord,
    /// `None` where each vertex has its own.
    shared: Option<Shared>,
}

/// Which records there are.
#[derive(Debug)]
struct Shared {
    /// A vertex that has each.
    vertices: Vec<u32>,
    /// That of each vertex.
    numbers: Vec<u32>,
}

impl<'a> Attributes<'a> {
    pub(crate) fn new(geometry: &'a Geometry, features: ProgramFeatures) -> Self {
        let mut attributes = Self {
            geometry,
            record: VertexRecord::new(geometry, features),
            shared: None,
        };
        // A mesh that shares its vertices has about one for two triangles, and few records to share.
        if geometry.positions.len() > geometry.triangles.len() {
            attributes.shared = Some(attributes.share());
        }
        attributes
    }

    /// The number of a vertex's record.
    pub(crate) fn number(&self, vertex: u32) -> u32 {
        let shared = self.shared.as_ref();
        shared.map_or(vertex, |shared| shared.numbers[vertex as usize])
    }

    pub(crate) fn table(&self) -> Table<'_> {
        let words = self.record.words as usize;
        let records = match &self.shared {
            Some(shared) => shared.vertices.len(),
            None => self.geometry.positions.len(),
        };
        Table::wide_of(words * records, move |texel| {
            let (record, word) = (texel / words, (texel % words) as u32);
            let shared = self.shared.as_ref();
            let vertex = shared.map_or(record, |shared| shared.vertices[record] as usize);
            self.texel(vertex, word)
        })
    }

    /// A texel of the record of a vertex.
    fn texel(&self, vertex: usize, word: u32) -> [u32; 4] {
        let Self {
            geometry, record, ..
        } = self;
        let texel = if word == 0 {
            geometry.normals[vertex].extend(0.0)
        } else if word < record.color_word {
            let first = 2 * (word - record.uv_word) as usize;
            let uv = |set: usize| {
                geometry
                    .uv_sets
                    .get(set)
                    .map_or([0.0; 2], |uv| uv[vertex].to_array())
            };
            let ([s, t], [u, v]) = (uv(first), uv(first + 1));
            Vec4::new(s, t, u, v)
        } else if word < record.tangent_word {
            geometry.colors[vertex].min(Vec4::splat(LARGEST_FACTOR))
        } else {
            geometry.tangents[vertex]
        };
        texel.to_array().map(f32::to_bits)
    }

    fn texels(&self, vertex: usize) -> impl Iterator<Item = [u32; 4]> {
        (0..self.record.words).map(move |word| self.texel(vertex, word))
    }

    /// Finds vertices with equal records. Two records whose hashes are equal may keep a third from being found: that costs bytes,
    /// nothing else.
    fn share(&self) -> Shared {
        let same = |a: usize, b: usize| self.texels(a).eq(self.texels(b));
        // Vertices of a flat triangle follow each other: only the first of such is looked for elsewhere.
        let continues = |vertex: usize| vertex > 0 && same(vertex - 1, vertex);
        // Hash above vertex: one comparison orders both.
        let vertices = (0..self.geometry.positions.len()).into_par_iter();
        let begins = vertices.filter(|&vertex| !continues(vertex));
        let mut keys: Vec<u64> = begins
            .map(|vertex| u64::from(self.hash(vertex)) << 32 | vertex as u64)
            .collect();
        keys.par_sort_unstable();
        let vertex = |key: u64| (key as u32) as usize;
        let equal = |a: &u64, b: &u64| a >> 32 == b >> 32 && same(vertex(*a), vertex(*b));
        // Of each vertex the first with its record.
        let mut firsts = vec![CONTINUES; self.geometry.positions.len()];
        for copies in keys.chunk_by(equal) {
            for &copy in copies {
                firsts[vertex(copy)] = copies[0] as u32;
            }
        }
        number(firsts)
    }

    /// FNV-1a over the words of a vertex's record.
    fn hash(&self, vertex: usize) -> u32 {
        let words = self.texels(vertex).flatten();
        let hash = words.fold(0xcbf2_9ce4_8422_2325_u64, |hash, word| {
            (hash ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3)
        });
        (hash >> 32) as u32
    }
}

/// A vertex with the record of the one before it.
const CONTINUES: u32 = u32::MAX;

/// From the first vertex with each vertex's record, or [`CONTINUES`], to the numbers of the records: in the order of these.
fn number(mut firsts: Vec<u32>) -> Shared {
    let mut vertices = Vec::new();
    for vertex in 0..firsts.len() {
        let first = firsts[vertex];
        firsts[vertex] = if first == CONTINUES {
            firsts[vertex - 1]
        } else if first as usize == vertex {
            vertices.push(first);
            vertices.len() as u32 - 1
        } else {
            firsts[first as usize]
        };
    }
    Shared {
        vertices,
        numbers: firsts,
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};
    use raytree_scene::model::Triangle;

    use super::*;

    /// Vertices of all attributes, each of a few values, in an order without rhyme; as many triangles as given.
    fn geometry(triangles: usize) -> Geometry {
        let mut geometry = Geometry {
            uv_sets: vec![Vec::new(); 3],
            ..Geometry::default()
        };
        for vertex in 0..600_u32 {
            let value = |of: u32| (vertex.wrapping_mul(2_654_435_761) >> 20) as f32 % of as f32;
            // Zero has two signs, and no two records differ in less.
            let zero = if vertex % 2 == 0 { 0.0 } else { -0.0 };
            geometry.positions.push(Vec3::splat(vertex as f32));
            geometry.normals.push(Vec3::new(value(3), 0.5, zero));
            geometry.tangents.push(Vec4::splat(value(2)));
            geometry.colors.push(Vec4::splat(1e6 + value(5)));
            for uv_set in &mut geometry.uv_sets {
                uv_set.push(Vec2::new(value(4), 7.0));
            }
        }
        let triangle = Triangle {
            vertices: [0, 1, 2],
            material: 0,
            node: 0,
        };
        geometry.triangles = vec![triangle; triangles];
        geometry
    }

    fn record<'a>(table: &'a [u32], attributes: &Attributes<'_>, vertex: u32) -> &'a [u32] {
        let words = 4 * attributes.record.words as usize;
        &table[attributes.number(vertex) as usize * words..][..words]
    }

    /// The more triangles, the fewer vertices a triangle: above one, records are shared.
    #[test]
    fn each_vertex_finds_its_own_values() {
        let features = ProgramFeatures::everything();
        let (flat, smooth) = (geometry(200), geometry(600));
        let shared = Attributes::new(&flat, features);
        let own = Attributes::new(&smooth, features);
        assert_eq!(shared.record.words, 5);
        let (shared_table, own_table) = (shared.table(), own.table());
        let (few, all) = (shared_table.contents(), own_table.contents());
        assert_eq!(all.len(), 600 * 20);
        assert!(few.len() < all.len() / 2);
        for vertex in 0..600 {
            let found = record(&few, &shared, vertex);
            assert_eq!(found, record(&all, &own, vertex), "vertex {vertex}");
        }
    }

    #[test]
    fn no_two_records_are_the_same() {
        let geometry = geometry(200);
        let attributes = Attributes::new(&geometry, ProgramFeatures::everything());
        let table = attributes.table();
        let contents = table.contents();
        let mut records: Vec<&[u32]> = contents.chunks(20).collect();
        let count = records.len();
        records.sort_unstable();
        records.dedup();
        assert_eq!(records.len(), count);
    }
}
