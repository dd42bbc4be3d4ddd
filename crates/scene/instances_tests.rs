use glam::{DQuat, Vec2, dvec3, vec3};

use super::*;

fn points(count: usize) -> Vec<DVec3> {
    let mut state = 1_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24) - 0.4
    };
    let mut point = || dvec3(random(), random(), random());
    (0..count).map(|_| point() * dvec3(1.0, 3.0, 0.2)).collect()
}

/// Whatever the map, and however many points: the same bits.
#[test]
fn the_box_around_all_is_found_at_few() {
    let maps = [
        DMat3::IDENTITY,
        DMat3::from_quat(DQuat::from_rotation_x(0.7) * DQuat::from_rotation_z(2.0)),
        DMat3::from_cols(
            dvec3(1.0, 2.0, 3.0),
            dvec3(0.0, 1e-5, 1.0),
            dvec3(4.0, 0.5, -1e3),
        ),
        DMat3::ZERO,
    ];
    for count in [1, 15, 16, 17, 300, 5000] {
        let points = points(count);
        let blocks = Blocks::of(&points);
        for linear in &maps {
            let offset = dvec3(0.3, -1e3, 7.0);
            let expected = points
                .iter()
                .map(|&point| linear * point + offset)
                .fold(EMPTY, |bounds, point| around(bounds, (point, point)));
            assert_eq!(blocks.bounds(linear, offset), expected, "{count} points");
        }
    }
    assert_eq!(Blocks::of(&[]).bounds(&maps[0], DVec3::ONE), EMPTY);
}

/// A triangle of the scene's own, and a mesh of one triangle that two nodes show, one of them mirrored.
fn scene() -> Scene {
    let geometry = Geometry {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ZERO, Vec3::X, Vec3::Z],
        normals: vec![
            Vec3::Z,
            Vec3::Z,
            Vec3::Z,
            Vec3::NEG_Y,
            Vec3::NEG_Y,
            Vec3::NEG_Y,
        ],
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 6],
        uv_sets: vec![(0..6).map(|k| Vec2::splat(k as f32)).collect()],
        colors: Vec::new(),
        triangles: vec![
            Triangle {
                vertices: [0, 1, 2],
                material: 0,
                node: 0,
            },
            Triangle {
                vertices: [3, 4, 5],
                material: 1,
                node: 0,
            },
        ],
    };
    let mut scene = Scene {
        geometry,
        ..Scene::default()
    };
    scene.meshes = vec![SharedMesh {
        name: "one".to_owned(),
        triangles: 1..2,
        vertices: 3..6,
    }];
    let instance = |node, linear, translation| {
        let placement = Placement {
            linear,
            translation,
        };
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Z].map(|corner| placement.point(corner));
        Instance {
            mesh: 0,
            node,
            placement,
            bounds: corners
                .into_iter()
                .fold(EMPTY, |bounds, p| around(bounds, (p, p))),
        }
    };
    scene.instances = vec![
        instance(
            1,
            DMat3::from_diagonal(dvec3(2.0, 1.0, 1.0)),
            dvec3(0.0, 5.0, 0.0),
        ),
        instance(2, DMat3::from_diagonal(dvec3(-1.0, 1.0, 1.0)), DVec3::ZERO),
    ];
    scene
}

#[test]
fn copies_lie_where_they_are_seen() {
    let scene = scene();
    let copied = scene.copied();
    let geometry = &copied.geometry;
    assert!(copied.meshes.is_empty() && copied.instances.is_empty());
    assert_eq!(copied.placed_triangles(), scene.placed_triangles());
    assert_eq!(scene.first_numbers(), [1, 2]);
    assert_eq!(geometry.triangles.len(), 3);
    let corners = |k: usize| {
        let triangle = geometry.triangles[k];
        triangle
            .vertices
            .map(|vertex| geometry.positions[vertex as usize])
    };
    assert_eq!(corners(0), [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(
        corners(1),
        [
            vec3(0.0, 5.0, 0.0),
            vec3(2.0, 5.0, 0.0),
            vec3(0.0, 5.0, 1.0)
        ]
    );
    // Mirrored: counter-clockwise again, as the normal has it.
    assert_eq!(corners(2), [Vec3::ZERO, Vec3::Z, Vec3::NEG_X]);
    for triangle in &geometry.triangles[1..] {
        let [a, b, c] = triangle.vertices.map(|v| geometry.positions[v as usize]);
        let normal = geometry.normals[triangle.vertices[0] as usize];
        assert!((b - a).cross(c - a).dot(normal) > 0.0);
    }
    assert_eq!(geometry.tangents[3], Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert_eq!(geometry.tangents[6], Vec4::new(-1.0, 0.0, 0.0, -1.0));
    assert_eq!(geometry.uv_sets[0][6..], [3.0, 4.0, 5.0].map(Vec2::splat));
    let nodes: Vec<u32> = geometry.triangles.iter().map(|t| t.node).collect();
    assert_eq!(nodes, [0, 1, 2]);
    assert_eq!(scene.bounds(), copied.bounds());
    assert_eq!(
        scene.bounds(),
        Some((dvec3(-1.0, 0.0, 0.0), dvec3(2.0, 5.0, 1.0)))
    );
}

#[test]
fn a_scene_without_meshes_is_its_own_copy() {
    let scene = Scene::default();
    assert!(matches!(scene.copied(), Cow::Borrowed(_)));
    assert_eq!((scene.placed_triangles(), scene.bounds()), (0, None));
}
