//! Tangents where a normal map needs them and the file has none: MikkTSpace (Mikkelsen 2008), as glTF 2.0, 3.7.2.1 asks.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec3, Vec2, Vec3, Vec4};

use super::primitive::Primitive;
use crate::model::TextureRef;

/// A tangent for every corner of every triangle. Follows the normal map's own texture coordinates, its transform included:
/// a map that is turned on the surface turns its tangents with it.
pub(super) fn generate(primitive: &Primitive, normal_map: &TextureRef) -> Vec<Vec4> {
    let flat_normals = if primitive.normals.is_empty() {
        flat_normals(primitive)
    } else {
        Vec::new()
    };
    let mut mesh = Mesh {
        triangles: &primitive.triangles,
        positions: primitive
            .positions
            .iter()
            .map(|position| position.as_vec3())
            .collect(),
        normals: if primitive.normals.is_empty() {
            &flat_normals
        } else {
            &primitive.normals
        },
        uvs: primitive.uv_sets[normal_map.uv_set as usize]
            .iter()
            .map(|&uv| transformed(uv, &normal_map.transform))
            .collect(),
        tangents: vec![Vec4::ZERO; primitive.triangles.len() * 3],
    };
    // It fails only by lack of memory or for more faces than fit in its index type; the zeros below then stand.
    if let Err(error) = generate_tangents(&mut mesh) {
        tracing::warn!(?error, "MikkTSpace failed; tangents are arbitrary");
    }
    let Mesh {
        mut tangents,
        normals,
        ..
    } = mesh;
    for (tangent, &corner) in tangents.iter_mut().zip(primitive.triangles.as_flattened()) {
        // Where the texture coordinates have no direction any tangent is as good as another.
        if !(tangent.truncate().length_squared() > 0.5 && tangent.is_finite()) {
            let normal = normals[corner as usize].normalize_or(Vec3::Z);
            *tangent = normal.any_orthonormal_vector().extend(1.0);
        }
    }
    tangents
}

fn flat_normals(primitive: &Primitive) -> Vec<Vec3> {
    let mut normals = vec![Vec3::Z; primitive.positions.len()];
    for triangle in &primitive.triangles {
        let [a, b, c] = triangle.map(|vertex| primitive.positions[vertex as usize]);
        let normal = (b - a).cross(c - a).normalize_or(DVec3::Z).as_vec3();
        triangle
            .iter()
            .for_each(|&vertex| normals[vertex as usize] = normal);
    }
    normals
}

fn transformed(uv: Vec2, m: &[f32; 6]) -> Vec2 {
    Vec2::new(
        m[0] * uv.x + m[1] * uv.y + m[2],
        m[3] * uv.x + m[4] * uv.y + m[5],
    )
}

struct Mesh<'a> {
    triangles: &'a [[u32; 3]],
    positions: Vec<Vec3>,
    normals: &'a [Vec3],
    uvs: Vec<Vec2>,
    /// For each corner.
    tangents: Vec<Vec4>,
}

impl Mesh<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.triangles[face][corner] as usize
    }
}

impl Geometry for Mesh<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.normals[self.vertex(face, corner)].to_array()
    }

    /// A normal map's green points up in the image, which is where glTF's v decreases (3.8.2, 3.9.3).
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.uvs[self.vertex(face, corner)];
        [uv.x, -uv.y]
    }

    fn set_tangent(&mut self, tangent_space: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(space) = tangent_space {
            self.tangents[face * 3 + corner] = Vec4::from_array(space.tangent_encoded());
        }
    }
}
