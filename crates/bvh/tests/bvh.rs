//! Trees over many shapes of input: each triangle in a leaf, boxes enclose, and the check notices when not.

use std::ops::Range;

use glam::{Vec3, vec3};
use raytree_bvh::{
    Bvh, CpuTraversal, Defect, INSTANCE, Placed, Preset, build, build_instanced, check,
    check_instanced,
};

const PRESETS: [Preset; 3] = [Preset::Fast, Preset::Balanced, Preset::Best];

/// Numbers in [0, 1) that are the same in every run (splitmix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as u32 as f32 / 2_f32.powi(32)
    }

    fn point(&mut self, size: f32) -> Vec3 {
        (vec3(self.next(), self.next(), self.next()) - 0.5) * size
    }
}

fn soup(count: usize, size: f32) -> Vec<[Vec3; 3]> {
    let mut numbers = Numbers(7);
    (0..count)
        .map(|_| {
            let at = numbers.point(2.0);
            [at, at + numbers.point(size), at + numbers.point(size)]
        })
        .collect()
}

fn assert_good(triangles: &[[Vec3; 3]]) {
    for preset in PRESETS {
        let bvh = build(triangles, preset).unwrap();
        assert_eq!(
            check(&bvh, triangles, preset == Preset::Best),
            Ok(()),
            "{preset:?}, {} triangles",
            triangles.len()
        );
        assert!(bvh.depth >= u32::from(!triangles.is_empty()));
        assert!(bvh.is_finite());
    }
}

#[test]
fn no_triangle_gives_no_node() {
    let bvh = build(&[], Preset::Balanced).unwrap();
    assert!(bvh.nodes.is_empty() && bvh.leaf_triangles.is_empty());
}

/// A node that is its own child, or that has children beyond the last node, is noticed.
#[test]
fn a_tree_without_end_is_noticed() {
    let good = build(&soup(1000, 0.1), Preset::Balanced).unwrap();
    assert!(good.is_finite());
    for children in [0, good.nodes.len() as u32] {
        let mut bad = good.clone();
        bad.nodes[0][4] = children;
        assert!(!bad.is_finite(), "{children}");
    }
}

#[test]
fn few_triangles() {
    for count in 1..=20 {
        assert_good(&soup(count, 0.3));
    }
}

#[test]
fn many_triangles() {
    assert_good(&soup(20_000, 0.05));
}

#[test]
fn long_slivers_that_overlap() {
    let mut numbers = Numbers(3);
    let slivers: Vec<_> = (0..2000)
        .map(|_| {
            let at = numbers.point(0.1);
            [
                at - vec3(1.0, 1.0, 1.0),
                at + vec3(1.0, 1.0, 1.0),
                at + vec3(1.0, 1.0, 1.0001),
            ]
        })
        .collect();
    assert_good(&slivers);
}

#[test]
fn triangles_in_one_place() {
    assert_good(&vec![
        [
            vec3(0.0, 0.0, 0.0),
            vec3(1.0, 0.0, 0.0),
            vec3(0.0, 1.0, 0.0)
        ];
        5000
    ]);
}

#[test]
fn a_flat_grid() {
    let grid: Vec<_> = (0..64)
        .flat_map(|x| (0..64).map(move |z| vec3(x as f32, 0.0, z as f32) / 64.0))
        .map(|at| [at, at + vec3(0.01, 0.0, 0.0), at + vec3(0.0, 0.0, 0.01)])
        .collect();
    assert_good(&grid);
}

/// The check itself must be able to fail.
#[test]
fn defects_are_found() {
    let triangles = soup(500, 0.1);
    let good = build(&triangles, Preset::Balanced).unwrap();

    let mut twice = good.clone();
    let lost = twice.leaf_triangles[3];
    twice.leaf_triangles[3] = twice.leaf_triangles[4];
    assert!(
        matches!(check(&twice, &triangles, true), Err(Defect::Missing(index)) if index == lost)
    );
    assert!(check(&twice, &triangles, false).is_err());

    let mut moved = triangles.clone();
    moved[100][0] += Vec3::splat(0.5);
    assert!(matches!(
        check(&good, &moved, false),
        Err(Defect::NotEnclosed { .. })
    ));

    let mut cut = good.clone();
    cut.leaf_triangles.truncate(10);
    assert!(matches!(
        check(&cut, &triangles, false),
        Err(Defect::Dangling(_))
    ));

    assert_eq!(
        check(&Bvh::default(), &triangles[..1], false),
        Err(Defect::Missing(0))
    );
}

/// By the signs of three volumes, in f64: how far along the ray, if at all.
fn crossing(origin: Vec3, direction: Vec3, triangle: [Vec3; 3]) -> Option<f64> {
    let [a, b, c] = triangle.map(|v| (v - origin).as_dvec3());
    let direction = direction.as_dvec3();
    let volumes = [(a, b), (b, c), (c, a)].map(|(p, q)| direction.dot(p.cross(q)));
    let inside = volumes.iter().all(|v| *v > 0.0) || volumes.iter().all(|v| *v < 0.0);
    let normal = (b - a).cross(c - a);
    let t = normal.dot(a) / normal.dot(direction);
    (inside && t > 0.0).then_some(t)
}

/// obvhs on our nodes finds what trying every triangle finds.
#[test]
fn the_cpu_hits_what_is_hit() {
    let triangles = soup(300, 0.5);
    let mut numbers = Numbers(5);
    for preset in PRESETS {
        let cpu = CpuTraversal::new(&build(&triangles, preset).unwrap(), &triangles);
        let mut hits = 0;
        for _ in 0..500 {
            let (origin, direction) = (numbers.point(3.0), numbers.point(1.0).normalize());
            let tried = triangles
                .iter()
                .zip(0_u32..)
                .filter_map(|(triangle, index)| {
                    Some((crossing(origin, direction, *triangle)?, index))
                });
            let nearest = tried.min_by(|a, b| a.0.total_cmp(&b.0));
            let found = cpu.closest_hit(origin, direction, f32::MAX);
            assert_eq!(found.map(|hit| hit.triangle), nearest.map(|hit| hit.1));
            assert_eq!(cpu.occluded(origin, direction, f32::MAX), nearest.is_some());
            if let Some((t, _)) = nearest {
                assert!(
                    cpu.closest_hit(origin, direction, 0.99 * t as f32)
                        .is_none()
                );
                assert!(!cpu.occluded(origin, direction, 0.99 * t as f32));
                hits += 1;
            }
        }
        assert!((50..500).contains(&hits), "{hits} of 500 rays hit");
    }
}

/// Least and greatest corner.
type Box = (Vec3, Vec3);

/// Triangles of the scene's own, then those of two meshes, and boxes of where these are.
fn two_levels() -> (Vec<[Vec3; 3]>, [Range<u32>; 2], Vec<Box>) {
    let mut triangles = soup(700, 0.1);
    triangles.extend(soup(3000, 0.05));
    triangles.extend(soup(5, 0.4));
    let mut numbers = Numbers(11);
    let boxes = (0..200).map(|_| {
        let corner = numbers.point(4.0);
        (corner, corner + (numbers.point(0.5) + 0.5))
    });
    (triangles, [700..3700, 3700..3705], boxes.collect())
}

/// Each triangle in a leaf of its own hierarchy, each instance in one of the scene's; all boxes enclose.
#[test]
fn two_levels_are_good() {
    let (triangles, meshes, instances) = two_levels();
    for (own, instances) in [(700, instances.as_slice()), (0, &instances[..1])] {
        let placed = Placed {
            own,
            meshes: &meshes,
            instances,
        };
        let corners = |index: usize| triangles[index];
        for preset in PRESETS {
            let bvh = build_instanced(placed, corners, preset).unwrap();
            let split = preset == Preset::Best;
            assert_eq!(check_instanced(&bvh, placed, corners, split), Ok(()));
            assert!(bvh.is_finite());
            assert_eq!(
                (bvh.meshes.len(), bvh.own_leaves()),
                (2, own + instances.len())
            );
            let mesh = build(&triangles[700..3700], preset).unwrap();
            assert!(bvh.depth > mesh.depth + 2);
        }
    }
}

#[test]
fn defects_of_two_levels_are_found() {
    let (triangles, meshes, instances) = two_levels();
    let placed = Placed {
        own: 700,
        meshes: &meshes,
        instances: &instances,
    };
    let good = build_instanced(placed, |index| triangles[index], Preset::Balanced).unwrap();
    let faults = |bvh: &Bvh, triangles: &[[Vec3; 3]], instances: &[Box]| {
        let placed = Placed {
            instances,
            ..placed
        };
        check_instanced(bvh, placed, |index| triangles[index], false).is_err()
    };
    assert!(!faults(&good, &triangles, &instances));
    // A box that grows, and a triangle of a mesh that moves, are not enclosed.
    let mut grown = instances.clone();
    grown[50].1 += 0.3;
    assert!(faults(&good, &triangles, &grown));
    let mut moved = triangles.clone();
    moved[2000][1] += 0.5;
    assert!(faults(&good, &moved, &instances));
    // Another instance's entry, or another mesh's triangle.
    let mut twice = good.clone();
    let place = twice
        .leaf_triangles
        .iter()
        .position(|entry| entry & INSTANCE != 0)
        .unwrap();
    let other = twice
        .leaf_triangles
        .iter()
        .rposition(|entry| entry & INSTANCE != 0)
        .unwrap();
    twice.leaf_triangles[place] = twice.leaf_triangles[other];
    assert!(faults(&twice, &triangles, &instances));
    // An instance in a mesh would be walked without end.
    let mut endless = good.clone();
    *endless.leaf_triangles.last_mut().unwrap() = INSTANCE;
    assert!(good.is_finite() && !endless.is_finite());
}
