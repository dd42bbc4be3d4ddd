//! obvhs's own traversal, on the CPU, of the very hierarchy that is uploaded: what the device's traversal is measured against
//! (`benches/traversal.rs`). No picture is made by it.

use glam::{UVec2, Vec3, Vec3A};
use obvhs::{
    cwbvh::{CwBvh, node::CwBvhNode},
    ray::{Ray, RayHit},
    rt_triangle::RtTriangle,
    traverse,
};

use crate::{Bvh, Node};

/// Entries of obvhs's own traversal stack, of which a level takes one.
const STACK: u32 = 32;

/// A hierarchy with its triangles, as obvhs likes them best: in leaf order, edges and normals computed in advance.
pub struct CpuTraversal {
    tree: CwBvh,
    triangles: Vec<RtTriangle>,
}

/// The closest hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CpuHit {
    /// Distance in the direction's length, 0 to the ray's `t_max`.
    pub t: f32,
    /// Index of the triangle, as they were given.
    pub triangle: u32,
}

impl CpuTraversal {
    /// The hierarchy over the triangles that it was built from.
    ///
    /// # Panics
    /// If the hierarchy is deeper than obvhs's stack, 32 levels, or has two levels.
    #[must_use]
    pub fn new(bvh: &Bvh, triangles: &[[Vec3; 3]]) -> Self {
        assert!(bvh.meshes.is_empty(), "obvhs knows no places of meshes");
        assert!(bvh.depth <= STACK, "obvhs can't walk {} levels", bvh.depth);
        let prepared = |&triangle: &u32| {
            let [v0, v1, v2] = triangles[triangle as usize].map(Vec3A::from);
            RtTriangle::new(v0, v1, v2)
        };
        let node = |&node: &Node| bytemuck::cast::<Node, CwBvhNode>(node);
        Self {
            triangles: bvh.leaf_triangles.iter().map(prepared).collect(),
            tree: CwBvh {
                nodes: bvh.nodes.iter().map(node).collect(),
                primitive_indices: bvh.leaf_triangles.clone(),
                ..CwBvh::default()
            },
        }
    }

    /// What a ray hits first at `0 <= t < t_max`, triangles seen from either side. Boxes that end before `t` = 1e-4 are passed by:
    /// obvhs's own constant.
    #[must_use]
    pub fn closest_hit(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<CpuHit> {
        let ray = Ray::new(origin.into(), direction.into(), 0.0, t_max);
        let mut hit = RayHit::none();
        let found = self.tree.ray_traverse(ray, &mut hit, |ray, leaf| {
            self.triangles[leaf].intersect(ray)
        });
        found.then(|| CpuHit {
            t: hit.t,
            triangle: self.tree.primitive_indices[hit.primitive_id as usize],
        })
    }

    /// Of each node that a ray visits, how many triangles it tests there; and the triangle that it hits: the closest, or with `any` the
    /// first that it finds.
    #[must_use]
    pub fn visits(
        &self,
        origin: Vec3,
        direction: Vec3,
        t_max: f32,
        any: bool,
    ) -> (Vec<u8>, Option<u32>) {
        let (mut visits, mut hit) = (Vec::new(), None);
        let mut ray = Ray::new(origin.into(), direction.into(), 0.0, t_max);
        let mut state = self.tree.new_traversal(ray.direction);
        let mut node;
        let tree = &self.tree;
        traverse!(
            tree,
            node,
            state,
            {
                visits.push(0);
                node.intersect_ray(&ray, state.oct_inv4)
            },
            {
                if let Some(tests) = visits.last_mut() {
                    *tests += 1;
                }
                let leaf = state.primitive_id as usize;
                let t = self.triangles[leaf].intersect(&ray);
                if t < ray.tmax {
                    ray.tmax = t;
                    hit = Some(tree.primitive_indices[leaf]);
                    if any {
                        break;
                    }
                }
            }
        );
        (visits, hit)
    }

    /// Whether a ray hits anything there: it ends at the first triangle found, closest or not.
    #[must_use]
    pub fn occluded(&self, origin: Vec3, direction: Vec3, t_max: f32) -> bool {
        let ray = Ray::new(origin.into(), direction.into(), 0.0, t_max);
        let miss = |ray: &Ray, leaf: usize| self.triangles[leaf].intersect(ray);
        !self.tree.ray_traverse_miss(ray, miss)
    }
}
