//! Meshes that several nodes share: triangles that lie in a scene once, in a space of their own, and the places where they are
//! shown.

use std::borrow::Cow;
use std::ops::Range;

use glam::{DMat3, DVec3, Vec3, Vec4};

use crate::model::{Geometry, Scene, Triangle};

/// A mesh in the space of its own: the middle of its bounding box is the origin, the box's longest side is 1.
///
/// Its triangles and vertices lie in the scene's [`Geometry`] behind those of the scene's own, mesh after mesh; of its triangles
/// [`Triangle::node`] means nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SharedMesh {
    /// The file's name for it, or "mesh 3".
    pub name: String,
    /// In [`Geometry::triangles`].
    pub triangles: Range<u32>,
    /// In [`Geometry::positions`] and the lists of attributes.
    pub vertices: Range<u32>,
}

/// Where a node shows a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: u32,
    /// Index into [`Scene::nodes`].
    pub node: u32,
    /// From the mesh's space into scene space.
    pub placement: Placement,
    /// The box around it, scene space.
    pub bounds: (DVec3, DVec3),
}

/// An affine map into scene space, never singular: `point -> linear * point + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Its linear part.
    pub linear: DMat3,
    /// Where the mesh's origin goes.
    pub translation: DVec3,
}

impl Placement {
    /// A point of the mesh in scene space.
    #[must_use]
    pub fn point(&self, point: DVec3) -> DVec3 {
        self.linear * point + self.translation
    }

    /// It turns left into right.
    #[must_use]
    pub fn mirrors(&self) -> bool {
        self.linear.determinant() < 0.0
    }

    /// The inverse transpose, up to a positive factor: what normals are moved by.
    #[must_use]
    pub fn normal_matrix(&self) -> DMat3 {
        normal_matrix(&self.linear)
    }
}

/// The inverse transpose, up to a positive factor: the matrix of cofactors, which exists for singular matrices too.
pub(crate) fn normal_matrix(linear: &DMat3) -> DMat3 {
    let largest = linear
        .to_cols_array()
        .into_iter()
        .fold(0.0, |largest: f64, x| largest.max(x.abs()));
    if largest == 0.0 {
        return DMat3::ZERO;
    }
    // Products of tiny or huge entries would leave the range of f64.
    let DMat3 {
        x_axis: x,
        y_axis: y,
        z_axis: z,
    } = *linear * largest.recip();
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if linear.determinant() < 0.0 {
        -cofactors
    } else {
        cofactors
    }
}

/// A tangent of the file, moved by a map; its w by whether that mirrors. `normal` is the moved normal, across which any direction is
/// taken where nothing is left of the tangent.
pub(crate) fn placed_tangent(linear: &DMat3, mirrors: bool, tangent: Vec4, normal: Vec3) -> Vec4 {
    let moved = linear * tangent.truncate().as_dvec3();
    let direction = match moved.normalize_or_zero().as_vec3() {
        Vec3::ZERO => normal.any_orthonormal_vector(),
        direction => direction,
    };
    direction.extend(if mirrors { -tangent.w } else { tangent.w })
}

/// A mesh that more than one node shows, and what has become of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RepeatedMesh {
    /// The file's name for it, or "mesh 3".
    pub name: String,
    /// How many nodes show it.
    pub nodes: usize,
    /// Of how many triangles it is.
    pub triangles: usize,
    /// How many of the nodes share its memory.
    pub sharing: usize,
    /// Why the others have a copy each.
    pub copied: Option<WhyCopied>,
}

/// Why nodes that show one mesh do not share it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhyCopied {
    /// Whoever imported the scene wanted no sharing.
    Asked,
    /// A material of it is seen through, in part or everywhere.
    SeenThrough,
    /// What it would save is not worth the longer way that rays have.
    Small,
    /// Where the node puts it, it is flattened, stretched or shrunk too far.
    Placement,
}

impl WhyCopied {
    /// What a user reads.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            Self::Asked => "sharing was not asked for",
            Self::SeenThrough => "a material of it blends, has holes or transmits light",
            Self::Small => "copies cost less than the rays' longer way",
            Self::Placement => "nodes flatten, stretch or shrink it too far",
        }
    }
}

/// A triangle where it is seen.
pub(crate) struct PlacedTriangle {
    pub(crate) corners: [DVec3; 3],
    pub(crate) material: u32,
}

impl Scene {
    /// How many triangles are the scene's own: the first ones, which lie in scene space. Those behind them belong to meshes.
    #[must_use]
    pub fn own_triangles(&self) -> usize {
        match self.meshes.first() {
            Some(first) => first.triangles.start as usize,
            None => self.geometry.triangles.len(),
        }
    }

    /// How many triangles are seen, those of a mesh as often as it is.
    #[must_use]
    pub fn placed_triangles(&self) -> u64 {
        let shown = self
            .instances
            .iter()
            .map(|instance| u64::from(self.triangles_of(instance)));
        self.own_triangles() as u64 + shown.sum::<u64>()
    }

    fn triangles_of(&self, instance: &Instance) -> u32 {
        let range = &self.meshes[instance.mesh as usize].triangles;
        range.end - range.start
    }

    /// The number of the first triangle of each instance where all have been copied ([`Self::copied`]): how triangles that are
    /// seen are told apart.
    #[must_use]
    pub fn first_numbers(&self) -> Vec<u32> {
        let mut next = self.own_triangles() as u32;
        let number = |instance: &Instance| {
            let first = next;
            next = next.wrapping_add(self.triangles_of(instance));
            first
        };
        self.instances.iter().map(number).collect()
    }

    /// The box around all that is seen, scene space: its least and its greatest corner. `None` without triangles.
    #[must_use]
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let own = self.geometry.bounds_of(0..self.own_triangles());
        let shown = self.instances.iter().map(|instance| instance.bounds);
        own.into_iter()
            .chain(shown)
            .reduce(|(min, max), (low, high)| (min.min(low), max.max(high)))
    }

    /// A triangle of the scene's own.
    pub(crate) fn own_triangle(&self, index: usize) -> PlacedTriangle {
        self.triangle_by(index, |point| point)
    }

    /// The triangles of an instance, each where it is seen.
    pub(crate) fn triangles_placed_by(
        &self,
        instance: &Instance,
    ) -> impl Iterator<Item = PlacedTriangle> {
        let range = self.meshes[instance.mesh as usize].triangles.clone();
        let placement = instance.placement;
        range.map(move |index| self.triangle_by(index as usize, |point| placement.point(point)))
    }

    fn triangle_by(&self, index: usize, place: impl Fn(DVec3) -> DVec3) -> PlacedTriangle {
        let triangle = self.geometry.triangles[index];
        let corner = |vertex: u32| place(self.geometry.positions[vertex as usize].as_dvec3());
        PlacedTriangle {
            corners: triangle.vertices.map(corner),
            material: triangle.material,
        }
    }

    /// The same scene with a copy of a mesh for each node that shows it, in the order of [`Self::instances`] behind the scene's own
    /// triangles: for who wants to go through plain triangles.
    ///
    /// It may take far more memory.
    #[must_use]
    pub fn copied(&self) -> Cow<'_, Self> {
        if self.meshes.is_empty() {
            return Cow::Borrowed(self);
        }
        let own = Range {
            start: 0,
            end: self.meshes[0].vertices.start as usize,
        };
        let geometry = &self.geometry;
        let mut copy = Self {
            geometry: Geometry {
                positions: geometry.positions[own.clone()].to_vec(),
                normals: part(&geometry.normals, &own),
                tangents: part(&geometry.tangents, &own),
                uv_sets: geometry.uv_sets.iter().map(|set| part(set, &own)).collect(),
                colors: part(&geometry.colors, &own),
                triangles: geometry.triangles[..self.own_triangles()].to_vec(),
            },
            meshes: Vec::new(),
            instances: Vec::new(),
            ..self.without_geometry()
        };
        for instance in &self.instances {
            copy.geometry.add(self, instance);
        }
        Cow::Owned(copy)
    }

    /// All but what there may be much of.
    fn without_geometry(&self) -> Self {
        Self {
            frame: self.frame,
            geometry: Geometry::default(),
            meshes: Vec::new(),
            instances: Vec::new(),
            repeated: self.repeated.clone(),
            materials: self.materials.clone(),
            textures: self.textures.clone(),
            images: self.images.clone(),
            lights: self.lights.clone(),
            cameras: self.cameras.clone(),
            nodes: self.nodes.clone(),
            surroundings: self.surroundings.clone(),
            files: self.files.clone(),
            warnings: self.warnings.clone(),
        }
    }
}

fn part<T: Clone>(list: &[T], range: &Range<usize>) -> Vec<T> {
    // Lists of attributes that nothing reads are empty.
    list.get(range.clone()).map_or_else(Vec::new, <[T]>::to_vec)
}

impl Geometry {
    /// A copy of what an instance shows.
    fn add(&mut self, scene: &Scene, instance: &Instance) {
        let from = &scene.geometry;
        let mesh = &scene.meshes[instance.mesh as usize];
        let vertices = mesh.vertices.start as usize..mesh.vertices.end as usize;
        let Placement { linear, .. } = instance.placement;
        let (mirrors, normals) = (
            instance.placement.mirrors(),
            instance.placement.normal_matrix(),
        );
        let first = self.positions.len() as u32;
        let place = |point: &Vec3| instance.placement.point(point.as_dvec3()).as_vec3();
        self.positions
            .extend(from.positions[vertices.clone()].iter().map(place));
        let begin = self.normals.len();
        self.normals.extend(
            part(&from.normals, &vertices)
                .iter()
                .map(|normal| (normals * normal.as_dvec3()).normalize_or_zero().as_vec3()),
        );
        let tangents = part(&from.tangents, &vertices);
        for (tangent, k) in tangents.into_iter().zip(begin..) {
            let moved = placed_tangent(&linear, mirrors, tangent, self.normals[k]);
            self.tangents.push(moved);
        }
        for (set, values) in self.uv_sets.iter_mut().zip(&from.uv_sets) {
            set.extend(part(values, &vertices));
        }
        self.colors.extend(part(&from.colors, &vertices));
        let copied = |triangle: &Triangle| {
            let [a, b, c] = triangle
                .vertices
                .map(|vertex| first + vertex - mesh.vertices.start);
            Triangle {
                vertices: if mirrors { [a, c, b] } else { [a, b, c] },
                material: triangle.material,
                node: instance.node,
            }
        };
        let triangles = mesh.triangles.start as usize..mesh.triangles.end as usize;
        self.triangles
            .extend(from.triangles[triangles].iter().map(copied));
    }
}

/// Points with boxes around neighbours, boxes around these, and so on: the box around all of them, however they are turned, then takes
/// a look at few.
pub(crate) struct Blocks<'p> {
    points: &'p [DVec3],
    /// From blocks of points up to one box around all.
    levels: Vec<Vec<Bounds>>,
}

/// Least and greatest corner of a box.
pub(crate) type Bounds = (DVec3, DVec3);

/// Points, or boxes, of a box.
const BLOCK: usize = 16;

/// A box that nothing is in: min above max.
pub(crate) const EMPTY: Bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);

fn around((min, max): Bounds, (low, high): Bounds) -> Bounds {
    (min.min(low), max.max(high))
}

impl<'p> Blocks<'p> {
    pub(crate) fn of(points: &'p [DVec3]) -> Self {
        let join = |block: &[Bounds]| block.iter().copied().fold(EMPTY, around);
        let single = |block: &[DVec3]| {
            block
                .iter()
                .map(|&point| (point, point))
                .fold(EMPTY, around)
        };
        let mut levels: Vec<Vec<Bounds>> = vec![points.chunks(BLOCK).map(single).collect()];
        while let Some(level) = levels.last().filter(|level| level.len() > 1) {
            let next = level.chunks(BLOCK).map(join).collect();
            levels.push(next);
        }
        Self { points, levels }
    }

    /// The box around `linear * point + offset` of all points, to the bit as if each had been looked at.
    pub(crate) fn bounds(&self, linear: &DMat3, offset: DVec3) -> Bounds {
        if self.points.is_empty() {
            return EMPTY;
        }
        let reach = |axis: usize, sign: f64| {
            let support = Support {
                blocks: self,
                row: linear.row(axis),
                offset: offset[axis],
                sign,
            };
            let mut best = f64::NEG_INFINITY;
            support.look(self.levels.len() - 1, 0, &mut best);
            sign * best
        };
        let reaches = |sign: f64| DVec3::from_array([0, 1, 2].map(|axis| reach(axis, sign)));
        (reaches(-1.0), reaches(1.0))
    }
}

/// Which point goes furthest up, or down, an axis?
struct Support<'b> {
    blocks: &'b Blocks<'b>,
    row: DVec3,
    offset: f64,
    /// 1: up.
    sign: f64,
}

impl Support<'_> {
    /// As a product of matrix and vector has it, and the sum: the same roundings.
    fn value(&self, point: DVec3) -> f64 {
        let along = self.row.x * point.x + self.row.y * point.y + self.row.z * point.z;
        self.sign * (along + self.offset)
    }

    /// No value of a point in the box is above, by far more than rounding.
    fn bound(&self, (min, max): Bounds) -> f64 {
        let (middle, half) = (0.5 * min + 0.5 * max, 0.5 * max - 0.5 * min);
        let slack = self.row.abs().dot(min.abs().max(max.abs())) + self.offset.abs();
        self.value(middle) + self.row.abs().dot(half) + 1e-14 * slack
    }

    fn look(&self, level: usize, index: usize, best: &mut f64) {
        let range = |count: usize| index * BLOCK..count.min((index + 1) * BLOCK);
        if level == 0 {
            let points = &self.blocks.points[range(self.blocks.points.len())];
            *best = points
                .iter()
                .fold(*best, |best, &point| best.max(self.value(point)));
            return;
        }
        let below = &self.blocks.levels[level - 1];
        let mut children = [(f64::NEG_INFINITY, 0); BLOCK];
        for (child, place) in children.iter_mut().zip(range(below.len())) {
            *child = (self.bound(below[place]), place);
        }
        // The most promising first: most of the others are then not looked at.
        children.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        for (bound, place) in children {
            if bound > *best {
                self.look(level - 1, place, best);
            }
        }
    }
}

#[cfg(test)]
#[path = "instances_tests.rs"]
mod tests;
