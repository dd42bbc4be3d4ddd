//! Shapes in f64, counter-clockwise seen from outside. Vertices that lie in one place (the corners of a box, the seam of
//! a sphere) have equal positions to the last bit, so closed shapes stay closed in f32.

mod flat;
mod round;

use std::collections::BTreeMap;

use glam::{DAffine3, DVec2, DVec3, DVec4};

pub use flat::{cuboid, prism, quad, relief};
pub use round::{icosphere, lathe, uv_sphere};

/// Triangles and the attributes of their vertices; empty lists for attributes that it does not have.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// Metres.
    pub positions: Vec<DVec3>,
    /// Unit length.
    pub normals: Vec<DVec3>,
    /// glTF's: xyz along u, w the sign of the bitangent.
    pub tangents: Vec<DVec4>,
    /// Two sets; (0, 0) is a picture's upper left corner.
    pub uvs: [Vec<DVec2>; 2],
    /// Linear RGBA.
    pub colors: Vec<DVec4>,
    /// Indices of vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Of a surface without border: which side it faces.
    pub closed: Option<Orientation>,
}

/// Which side a closed surface faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Orientation {
    /// Away from what it encloses: a solid.
    Outward,
    /// Into what it encloses: a cavity in a solid.
    Inward,
}

impl Shape {
    /// Turned, scaled alike in all directions, moved.
    ///
    /// (Another scale would need other normals.)
    #[must_use]
    pub fn transformed(mut self, transform: DAffine3) -> Self {
        self.positions
            .iter_mut()
            .for_each(|p| *p = transform.transform_point3(*p));
        self.normals
            .iter_mut()
            .for_each(|n| *n = transform.transform_vector3(*n).normalize());
        for t in &mut self.tangents {
            *t = transform
                .transform_vector3(t.truncate())
                .normalize()
                .extend(t.w);
        }
        self
    }

    /// Moved.
    #[must_use]
    pub fn moved(self, x: f64, y: f64, z: f64) -> Self {
        self.transformed(DAffine3::from_translation(DVec3::new(x, y, z)))
    }

    /// Each vertex put elsewhere, with smooth normals to suit.
    #[must_use]
    pub fn bent(mut self, to: impl Fn(DVec3) -> DVec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p = to(*p));
        self.smoothed()
    }

    /// Turned inside out: a cavity.
    #[must_use]
    pub fn inverted(mut self) -> Self {
        self.normals.iter_mut().for_each(|n| *n = -*n);
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self.closed = self.closed.map(|side| match side {
            Orientation::Outward => Orientation::Inward,
            Orientation::Inward => Orientation::Outward,
        });
        self
    }

    /// Both in one. Closed if both are, which then must not touch. Both need the same attributes.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.tangents.extend(other.tangents);
        for (set, others) in self.uvs.iter_mut().zip(other.uvs) {
            set.extend(others);
        }
        self.colors.extend(other.colors);
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
        self.closed = self.closed.filter(|side| other.closed == Some(*side));
        self
    }

    /// The first uv set through a function.
    #[must_use]
    pub fn mapped(mut self, to: impl Fn(DVec2) -> DVec2) -> Self {
        self.uvs[0].iter_mut().for_each(|uv| *uv = to(*uv));
        self
    }

    /// The first uv set scaled.
    #[must_use]
    pub fn tiled(self, u: f64, v: f64) -> Self {
        self.mapped(|uv| uv * DVec2::new(u, v))
    }

    /// A second uv set, made from the first.
    #[must_use]
    pub fn second_uvs(mut self, from: impl Fn(DVec2) -> DVec2) -> Self {
        self.uvs[1] = self.uvs[0].iter().map(|&uv| from(uv)).collect();
        self
    }

    /// Without uv sets, for materials without textures.
    #[must_use]
    pub fn plain(mut self) -> Self {
        self.uvs = [vec![], vec![]];
        self
    }

    /// Vertex colours by place.
    #[must_use]
    pub fn painted(mut self, color: impl Fn(DVec3) -> DVec4) -> Self {
        self.colors = self.positions.iter().map(|&p| color(p)).collect();
        self
    }

    /// The same tangent at every vertex, u and v of the first uv set being right-handed with the normal.
    #[must_use]
    pub fn with_tangent(mut self, tangent: DVec3) -> Self {
        self.tangents = vec![tangent.extend(1.0); self.positions.len()];
        self
    }

    /// Normals averaged (by area) over all triangles that meet in a place.
    fn smoothed(mut self) -> Self {
        // Zero is added to make -0 into 0: one place, one key.
        let place = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
        let mut sums: BTreeMap<[u64; 3], DVec3> = BTreeMap::new();
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            for corner in [a, b, c] {
                *sums.entry(place(corner)).or_default() += (b - a).cross(c - a);
            }
        }
        self.normals = self
            .positions
            .iter()
            .map(|&p| sums[&place(p)].normalize_or(DVec3::Y))
            .collect();
        self
    }

    /// A vertex; its index.
    fn vertex(&mut self, position: DVec3, normal: DVec3, uv: DVec2) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs[0].push(uv);
        self.positions.len() as u32 - 1
    }

    /// A quadrilateral `a b c d`, counter-clockwise, as two triangles; those without area (at the pole of a sphere) are
    /// left out.
    fn quadrilateral(&mut self, [a, b, c, d]: [u32; 4]) {
        for t in [[a, b, c], [a, c, d]] {
            let [p, q, r] = t.map(|i| self.positions[i as usize]);
            if p != q && q != r && r != p {
                self.triangles.push(t);
            }
        }
    }
}
