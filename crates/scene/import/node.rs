//! Scenes and nodes (glTF 2.0, 3.5): which nodes are drawn, and where in the world. In f64 throughout.

use glam::{DMat3, DQuat, DVec3};
use serde_json::Value;

use super::document::{Document, index, numbers};
use super::error::{Fault, Outcome};
use crate::place::Place;

/// A node of the scene.
pub(super) struct PlacedNode {
    /// Index into the file's nodes.
    pub(super) index: usize,
    /// From the node's space into world space.
    pub(super) world: Transform,
}

/// An affine map into world space: `point -> linear * point + translation`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transform {
    pub(super) linear: DMat3,
    pub(super) translation: Place,
}

impl Transform {
    pub(super) const IDENTITY: Self = Self {
        linear: DMat3::IDENTITY,
        translation: Place::ORIGIN,
    };

    /// That of a child, whose own map is `linear` and `translation`.
    fn of_child(&self, linear: DMat3, translation: DVec3) -> Self {
        Self {
            linear: self.linear * linear,
            translation: self.translation.moved_by_product(&self.linear, translation),
        }
    }

    /// Are all its numbers at most `limit` in size? Never if one is NaN.
    fn is_within(&self, limit: f64) -> bool {
        let linear = self.linear.to_cols_array().into_iter();
        let mut numbers = linear.chain(self.translation.rounded().to_array());
        numbers.all(|number| number.abs() <= limit)
    }
}

/// The nodes that the default scene reaches, in the order of the file. Checks the whole hierarchy.
pub(super) fn placed_nodes(document: &Document) -> Outcome<Vec<PlacedNode>> {
    let nodes = document.elements("nodes");
    let parents = parents(document, nodes)?;
    check_for_loops(document, nodes, &parents)?;

    let mut placed = Vec::new();
    let mut pending: Vec<(usize, Transform)> = Vec::new();
    for root in scene_roots(document, &parents)? {
        pending.push((root, Transform::IDENTITY));
        // A stack of our own: a chain of nodes may be as long as the file.
        while let Some((node, parent)) = pending.pop() {
            let (linear, translation) = local_transform(document, node, &nodes[node])?;
            let world = parent.of_child(linear, translation);
            // Below this no product with a vertex can overflow.
            if !world.is_within(1e30) {
                return Err(Fault::invalid(
                    document.place("nodes", node),
                    "its place in the world is beyond 1e30 m",
                ));
            }
            placed.push(PlacedNode { index: node, world });
            pending.extend(children(&nodes[node]).map(|child| (child, world)));
        }
    }
    placed.sort_by_key(|node| node.index);
    Ok(placed)
}

fn children(node: &Value) -> impl Iterator<Item = usize> {
    let list = node
        .get("children")
        .and_then(Value::as_array)
        .map_or(&[][..], Vec::as_slice);
    list.iter()
        .filter_map(|child| child.as_u64()?.try_into().ok())
}

/// The parent of each node; an error if one has two.
fn parents(document: &Document, nodes: &[Value]) -> Outcome<Vec<Option<usize>>> {
    let mut parents = vec![None; nodes.len()];
    for (parent, node) in nodes.iter().enumerate() {
        for child in children(node) {
            if let Some(other) = parents[child].replace(parent) {
                let problem = format!("is a child of node {other} and again of node {parent}");
                return Err(Fault::invalid(document.place("nodes", child), problem));
            }
        }
    }
    Ok(parents)
}

/// With one parent at most, nodes that no root leads to go round in circles.
fn check_for_loops(document: &Document, nodes: &[Value], parents: &[Option<usize>]) -> Outcome<()> {
    let mut reached: Vec<bool> = parents.iter().map(Option::is_none).collect();
    let mut pending: Vec<usize> = (0..nodes.len()).filter(|&node| reached[node]).collect();
    while let Some(node) = pending.pop() {
        for child in children(&nodes[node]) {
            reached[child] = true;
            pending.push(child);
        }
    }
    match reached.iter().position(|reached| !reached) {
        Some(node) => Err(Fault::invalid(
            document.place("nodes", node),
            "is among its own descendants, or below such a loop",
        )),
        None => Ok(()),
    }
}

/// The roots of the default scene, else of the first scene; all nodes without a parent if the file has no scene.
fn scene_roots(document: &Document, parents: &[Option<usize>]) -> Outcome<Vec<usize>> {
    let scenes = document.elements("scenes");
    if scenes.is_empty() {
        return Ok((0..parents.len())
            .filter(|&node| parents[node].is_none())
            .collect());
    }
    let scene = index(document.json(), "scene").unwrap_or(0);
    let list = scenes[scene]
        .get("nodes")
        .and_then(Value::as_array)
        .map_or(&[][..], Vec::as_slice);
    let mut listed = vec![false; parents.len()];
    let mut roots = Vec::with_capacity(list.len());
    for root in list
        .iter()
        .filter_map(|root| usize::try_from(root.as_u64()?).ok())
    {
        let refuse = |problem| Err(Fault::invalid(document.place("nodes", root), problem));
        if parents[root].is_some() {
            return refuse("is listed as a root of the scene, but is another node's child");
        }
        if std::mem::replace(&mut listed[root], true) {
            return refuse("is listed twice as a root of the scene");
        }
        roots.push(root);
    }
    Ok(roots)
}

/// Linear part and translation.
fn local_transform(document: &Document, node: usize, json: &Value) -> Outcome<(DMat3, DVec3)> {
    let place = document.place("nodes", node);
    if let Some(matrix) = numbers::<16>(json, "matrix", &place)? {
        return affine(&matrix)
            .ok_or_else(|| Fault::invalid(place, "the last row of its matrix is not 0 0 0 1"));
    }
    let translation = numbers(json, "translation", &place)?.map_or(DVec3::ZERO, DVec3::from_array);
    let scale = numbers(json, "scale", &place)?.map_or(DVec3::ONE, DVec3::from_array);
    let rotation = numbers(json, "rotation", &place)?.map_or(DQuat::IDENTITY, DQuat::from_array);
    // Written with six digits it is not quite a unit quaternion.
    let length = rotation.length();
    if !(length.is_finite() && length > 1e-6) {
        return Err(Fault::invalid(
            place,
            "its rotation is not a unit quaternion",
        ));
    }
    let rotation = DMat3::from_quat(rotation / length);
    Ok((rotation * DMat3::from_diagonal(scale), translation))
}

/// Column-major 4 by 4. Exporters leave rounding errors in the last row.
fn affine(matrix: &[f64; 16]) -> Option<(DMat3, DVec3)> {
    const TOLERANCE: f64 = 1e-4;
    let column = |at: usize| DVec3::new(matrix[at], matrix[at + 1], matrix[at + 2]);
    let last_row = [matrix[3], matrix[7], matrix[11], matrix[15] - 1.0];
    last_row.iter().all(|x| x.abs() <= TOLERANCE).then(|| {
        let linear = DMat3::from_cols(column(0), column(4), column(8));
        (linear, column(12))
    })
}
