//! Nodes, and what they carry: meshes, lights, cameras.

use glam::{DMat3, DQuat, DVec3};
use serde_json::{Value, json};

use super::{Gltf, MeshId, NodeId, number, numbers, push};

/// A node under construction. Its transform is scale, then rotation, then translation.
#[derive(Clone, Debug)]
pub struct Node(Value);

impl Node {
    /// A node that carries nothing yet.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self(json!({ "name": name }))
    }

    /// Moves it, metres.
    #[must_use]
    pub fn at(self, x: f64, y: f64, z: f64) -> Self {
        self.with("translation", numbers(&[x, y, z]))
    }

    /// Turns it about an axis, counter-clockwise seen from the axis' tip.
    #[must_use]
    pub fn turned(self, axis: DVec3, degrees: f64) -> Self {
        self.oriented(DQuat::from_axis_angle(
            axis.normalize(),
            degrees.to_radians(),
        ))
    }

    /// Turns it.
    #[must_use]
    pub fn oriented(self, rotation: DQuat) -> Self {
        self.with("rotation", numbers(&rotation.to_array()))
    }

    /// Scales it.
    #[must_use]
    pub fn scaled(self, x: f64, y: f64, z: f64) -> Self {
        self.with("scale", numbers(&[x, y, z]))
    }

    /// Any affine transform by its columns, in place of the other three.
    #[must_use]
    pub fn matrix(self, matrix: glam::DMat4) -> Self {
        self.with("matrix", numbers(&matrix.to_cols_array()))
    }

    /// Gives it a mesh.
    #[must_use]
    pub fn mesh(self, mesh: MeshId) -> Self {
        self.with("mesh", json!(mesh.0))
    }

    /// Hangs nodes under it.
    #[must_use]
    pub fn children(self, children: &[NodeId]) -> Self {
        self.with("children", children.iter().map(|child| child.0).collect())
    }

    fn with(mut self, key: &str, value: Value) -> Self {
        self.0[key] = value;
        self
    }
}

impl Gltf {
    /// Adds a node. One that no other node takes as a child stands at the root of the scene.
    pub fn node(&mut self, node: Node) -> NodeId {
        NodeId(push(&mut self.nodes, node.0))
    }

    /// Adds a node that carries a mesh.
    pub fn place(&mut self, name: &str, mesh: MeshId, x: f64, y: f64, z: f64) -> NodeId {
        self.node(Node::new(name).at(x, y, z).mesh(mesh))
    }

    /// Adds a camera for 4:3 pictures at `eye` that looks at `target`; vertical field of view in degrees.
    pub fn perspective(&mut self, name: &str, eye: DVec3, target: DVec3, yfov: f64) {
        let lens =
            json!({ "aspectRatio": 4.0 / 3.0, "yfov": number(yfov.to_radians()), "znear": 0.05 });
        self.camera(
            name,
            eye,
            target,
            json!({ "type": "perspective", "perspective": lens }),
        );
    }

    /// Adds a camera of parallel rays for 4:3 pictures, `height` metres high.
    pub fn orthographic(&mut self, name: &str, eye: DVec3, target: DVec3, height: f64) {
        let [xmag, ymag] = [height * 2.0 / 3.0, height / 2.0].map(number);
        let lens = json!({ "xmag": xmag, "ymag": ymag, "znear": 0.05, "zfar": 100.0 });
        self.camera(
            name,
            eye,
            target,
            json!({ "type": "orthographic", "orthographic": lens }),
        );
    }

    fn camera(&mut self, name: &str, eye: DVec3, target: DVec3, mut camera: Value) {
        camera["name"] = json!(name);
        let camera = push(&mut self.cameras, camera);
        let node = Node::new(name)
            .at(eye.x, eye.y, eye.z)
            .oriented(looking(target - eye));
        self.node(node.with("camera", json!(camera)));
    }

    /// Adds a point light; candela, metres.
    pub fn point_light(
        &mut self,
        name: &str,
        at: DVec3,
        color: [f64; 3],
        intensity: f64,
        range: Option<f64>,
    ) {
        let light = json!({ "type": "point" });
        self.light(
            name,
            Node::new(name).at(at.x, at.y, at.z),
            light,
            color,
            intensity,
            range,
        );
    }

    /// Adds a spot light that shines at `target`; candela, metres, half angles of the cone in degrees.
    #[expect(
        clippy::too_many_arguments,
        reason = "a light is that many numbers; a struct would only name them twice"
    )]
    pub fn spot_light(
        &mut self,
        name: &str,
        at: DVec3,
        target: DVec3,
        color: [f64; 3],
        intensity: f64,
        cone: [f64; 2],
        range: Option<f64>,
    ) {
        let [inner, outer] = cone.map(|angle| number(angle.to_radians()));
        let light =
            json!({ "type": "spot", "spot": { "innerConeAngle": inner, "outerConeAngle": outer } });
        let node = Node::new(name)
            .at(at.x, at.y, at.z)
            .oriented(looking(target - at));
        self.light(name, node, light, color, intensity, range);
    }

    /// Adds a directional light that travels along `direction`; lux.
    pub fn directional_light(
        &mut self,
        name: &str,
        direction: DVec3,
        color: [f64; 3],
        intensity: f64,
    ) {
        let node = Node::new(name).oriented(looking(direction));
        self.light(
            name,
            node,
            json!({ "type": "directional" }),
            color,
            intensity,
            None,
        );
    }

    fn light(
        &mut self,
        name: &str,
        node: Node,
        mut light: Value,
        color: [f64; 3],
        intensity: f64,
        range: Option<f64>,
    ) {
        light["name"] = json!(name);
        light["color"] = numbers(&color);
        light["intensity"] = number(intensity);
        if let Some(range) = range {
            light["range"] = number(range);
        }
        let light = push(&mut self.lights, light);
        self.node(node.with(
            "extensions",
            json!({ "KHR_lights_punctual": { "light": light } }),
        ));
    }

    pub(super) fn roots(&self) -> Vec<usize> {
        let children: Vec<u64> = self
            .nodes
            .iter()
            .filter_map(|node| node["children"].as_array())
            .flatten()
            .filter_map(Value::as_u64)
            .collect();
        (0..self.nodes.len())
            .filter(|&node| !children.contains(&(node as u64)))
            .collect()
    }
}

/// The rotation that turns glTF's line of sight, -Z, into `direction`, with +Y as near to up as can be.
fn looking(direction: DVec3) -> DQuat {
    let back = -direction.normalize();
    let up = if back.y.abs() > 0.999 {
        DVec3::Z
    } else {
        DVec3::Y
    };
    let right = up.cross(back).normalize();
    DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back))
}
