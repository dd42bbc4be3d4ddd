//! Scenes and nodes (glTF 2.0, 3.5): which nodes are drawn, and where in the world. In f64 throughout.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde_json::Value;

use super::document::{Document, index, numbers};
use super::error::{Fault, Outcome};

/// A node of the scene.
pub(super) struct PlacedNode {
    /// Index into the file's nodes.
    pub(super) index: usize,
    /// From the node's space into world space.
    pub(super) world: DAffine3,
}

/// The nodes that the default scene reaches, in the order of the file. Checks the whole hierarchy.
pub(super) fn placed_nodes(document: &Document) -> Outcome<Vec<PlacedNode>> {
    let nodes = document.elements("nodes");
    let parents = parents(document, nodes)?;
    check_for_loops(document, nodes, &parents)?;

    let mut placed = Vec::new();
    let mut pending: Vec<(usize, DAffine3)> = Vec::new();
    for root in scene_roots(document, &parents)? {
        pending.push((root, DAffine3::IDENTITY));
        // A stack of our own: a chain of nodes may be as long as the file.
        while let Some((node, parent)) = pending.pop() {
            let world = parent * local_transform(document, node, &nodes[node])?;
            // Below this no product with a vertex can overflow.
            let largest = world
                .to_cols_array()
                .into_iter()
                .fold(0.0, |largest: f64, x| largest.max(x.abs()));
            if !(world.is_finite() && largest <= 1e30) {
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

fn local_transform(document: &Document, node: usize, json: &Value) -> Outcome<DAffine3> {
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
    Ok(DAffine3::from_scale_rotation_translation(
        scale,
        rotation / length,
        translation,
    ))
}

/// Column-major 4 by 4. Exporters leave rounding errors in the last row.
fn affine(matrix: &[f64; 16]) -> Option<DAffine3> {
    const TOLERANCE: f64 = 1e-4;
    let column = |at: usize| DVec3::new(matrix[at], matrix[at + 1], matrix[at + 2]);
    let last_row = [matrix[3], matrix[7], matrix[11], matrix[15] - 1.0];
    last_row
        .iter()
        .all(|x| x.abs() <= TOLERANCE)
        .then(|| DAffine3 {
            matrix3: DMat3::from_cols(column(0), column(4), column(8)),
            translation: column(12),
        })
}
