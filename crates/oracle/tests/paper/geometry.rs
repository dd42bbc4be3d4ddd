//! Closest hits: ties, edges, and the tree against brute force.

use raytree_oracle::{Hit, Oracle, Settings, Shading};
use raytree_scene::model::{Material, Scene};

use crate::build::*;

/// A sphere inside of another, and a floor through both: 4.6k triangles.
fn spheres() -> Build {
    let mut build = Build::before([0.25; 3]);
    let shell = build.material(pane([0.5; 3]));
    let solid = build.material(matte([0.5; 3]));
    build.sphere([0.1, 0.2, 0.0], 0.75, 48, 24, shell);
    build.sphere([0.0, 0.1, 0.0], 0.5, 48, 24, solid);
    build.floor(-0.125, 1.0, solid);
    build.point_light([0.5, 3.0, 1.0], 10.0);
    build
}

/// Evenly spread numbers in [-1, 1): the bits of a linear congruential generator (Knuth's MMIX).
fn random(state: &mut u64) -> f64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn random_vector(state: &mut u64) -> [f64; 3] {
    std::array::from_fn(|_| random(state))
}

/// Rays from everywhere to random points, and to vertices and middles of edges.
fn rays(scene: &Scene) -> Vec<([f64; 3], [f64; 3])> {
    let mut state = 1;
    let random_rays = (0..2000).map(|_| {
        (
            random_vector(&mut state).map(|k| 2.0 * k),
            random_vector(&mut state),
        )
    });
    let mut rays: Vec<_> = random_rays.collect();
    let position = |vertex: u32| scene.geometry.positions[vertex as usize].as_dvec3();
    for triangle in scene.geometry.triangles.iter().step_by(5) {
        let [a, b, _] = triangle.vertices.map(position);
        for target in [a, (a + b) * 0.5] {
            let origin = random_vector(&mut state).map(|k| 2.0 * k);
            rays.push((origin, (target - glam::DVec3::from(origin)).to_array()));
            // Axis-parallel too: rays that run in the planes of boxes.
            rays.push(((target + glam::DVec3::Y * 3.0).to_array(), DOWN));
        }
    }
    rays
}

#[test]
fn tree_and_brute_force_give_identical_hits() {
    let build = spheres();
    let (tree, brute) = (
        Oracle::with_tree(&build.scene),
        Oracle::brute_force(&build.scene),
    );
    let mut hits = 0;
    for (origin, direction) in rays(&build.scene) {
        let hit = tree.closest_hit(origin, direction, Shading::Pbr);
        assert_eq!(hit, brute.closest_hit(origin, direction, Shading::Pbr));
        hits += usize::from(hit.is_some());
        let occluded = |oracle: &Oracle| oracle.occluded(origin, direction, 1.0);
        assert_eq!(occluded(&tree), occluded(&brute));
    }
    assert!(hits > 2000, "{hits}");
}

#[test]
fn tree_and_brute_force_give_identical_pictures() {
    let build = spheres();
    let camera = looking([0.3, 2.0, 2.0], [-0.3, -2.0, -2.0]);
    let settings = Settings::new(12, 9);
    let picture = |oracle: Oracle| oracle.render(&camera, &settings);
    assert_eq!(
        picture(Oracle::with_tree(&build.scene)),
        picture(Oracle::brute_force(&build.scene))
    );
}

#[test]
fn no_ray_slips_through_a_closed_surface() {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(pane([1.0; 3]));
    build.sphere([0.1, 0.2, 0.3], 0.75, 48, 24, material);
    let oracle = build.oracle();
    let inside = glam::DVec3::new(0.15, 0.25, 0.2);
    let position = |vertex: u32| build.scene.geometry.positions[vertex as usize].as_dvec3();
    for triangle in &build.scene.geometry.triangles {
        let [a, b, c] = triangle.vertices.map(position);
        for target in [a, b, c, (a + b) * 0.5, (b + c) * 0.5, a * 0.3 + c * 0.7] {
            let direction = (target - inside).to_array();
            let hit = oracle.closest_hit(inside.to_array(), direction, Shading::Pbr);
            // Not exactly 1 everywhere: in f32 the sine of pi is not 0, so the lower pole's triangles overlap a little.
            assert!(
                hit.is_some_and(|hit| (hit.t - 1.0).abs() < 1e-7),
                "{target} {hit:?}"
            );
        }
    }
}

#[test]
fn an_edge_that_triangles_share_shades_once() {
    // Two panes side by side, slanted so that nothing is exact, and light through the diagonal of each and the edge
    // between.
    let mut build = Build::before([0.0; 3]);
    let material = build.material(pane([0.5; 3]));
    let corner = |x: f32, y: f32| [x, 0.3 * x + 0.7 * y + 0.1, y - 0.2 * x];
    for k in 0..2 {
        let (left, right) = (0.37 * k as f32 - 0.41, 0.37 * (k + 1) as f32 - 0.41);
        let corners = [
            corner(left, 0.5),
            corner(right, 0.5),
            corner(right, -0.5),
            corner(left, -0.5),
        ];
        build.quad(corners, material);
    }
    let oracle = build.oracle();
    let position = |i: usize| build.scene.geometry.positions[i].as_dvec3();
    let mut state = 7;
    for (a, b) in [(0, 2), (1, 2), (4, 6)] {
        for k in 1..500 {
            let target = position(a).lerp(position(b), f64::from(k) / 500.0);
            let origin = glam::DVec3::from(random_vector(&mut state)) + glam::DVec3::Y * 3.0;
            let direction = (target - origin).to_array();
            let visible =
                oracle.visibility_along(origin.to_array(), direction, f64::INFINITY, Shading::Pbr);
            assert_grey(visible, 0.5);
        }
    }
}

#[test]
fn of_equal_hits_the_lower_index_wins() {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(unlit([1.0; 3]));
    for _ in 0..40 {
        build.floor(0.0, 1.0, material);
    }
    for oracle in [
        Oracle::with_tree(&build.scene),
        Oracle::brute_force(&build.scene),
    ] {
        // On the diagonal, which both triangles of each square share.
        let Some(Hit { t, triangle, .. }) = oracle.closest_hit([0.0, 1.0, 0.0], DOWN, Shading::Pbr)
        else {
            panic!("missed");
        };
        assert_eq!((t, triangle), (1.0, 0));
    }
}

#[test]
fn thousands_of_triangles_in_one_place_make_a_tree() {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(unlit([1.0; 3]));
    for _ in 0..4000 {
        build.floor(0.0, 1.0, material);
    }
    let hit = build
        .oracle()
        .closest_hit([0.3, 1.0, 0.1], DOWN, Shading::Pbr);
    assert!(hit.is_some_and(|hit| hit.triangle < 2));
}

#[test]
fn shadow_rays_through_slivers_and_grazing_ones_come_to_an_end() {
    // Needles a millionth as wide as long, side by side in one plane, and light that grazes them.
    let mut build = Build::before([0.0; 3]);
    let material = build.material(pane([0.5; 3]));
    for k in 0..200 {
        let (x, dx) = (k as f32 * 1e-6, 1e-6);
        build.quad(
            [
                [x, 0.0, 1.0],
                [x + dx, 0.0, 1.0],
                [x + dx, 0.0, -1.0],
                [x, 0.0, -1.0],
            ],
            material,
        );
    }
    let oracle = build.oracle();
    for height in [1.0, 1e-3, 1e-6, 1e-9, 1e-12] {
        let origin = [1.0, height, 0.1];
        let towards_the_middle = [1e-4 - origin[0], -height, 0.0];
        let visible = oracle.visibility_along(origin, towards_the_middle, 2.0, Shading::Pbr);
        assert_eq!(visible, [0.5; 3], "{height}");
    }
}

#[test]
fn a_needle_reflects_a_ray_once() {
    // A single flat triangle, a millionth as wide as long: its normal is all rounding, and still nothing of it is in the
    // reflected ray's way.
    let mut state = 3;
    for _ in 0..1000 {
        let mut build = Build::before([1.0; 3]);
        let material = build.material(Material {
            double_sided: true,
            ..mirror([1.0; 3])
        });
        let [a, along, across, origin] =
            std::array::from_fn(|_| glam::DVec3::from(random_vector(&mut state)));
        let corners = [a, a + along, a + along * 0.5 + across * 1e-6]
            .map(|corner| corner.as_vec3().to_array());
        build.quad([corners[0], corners[1], corners[2], corners[2]], material);
        build.scene.geometry.normals.fill(glam::Vec3::ZERO);
        let middle = corners
            .iter()
            .map(|&corner| glam::Vec3::from(corner).as_dvec3() / 3.0)
            .sum::<glam::DVec3>();
        let camera = looking(origin.to_array(), (middle - origin).to_array());
        let picture = build.oracle().render(&camera, &one_ray());
        assert!(
            picture.rays.reflection <= 1,
            "{corners:?} {:?}",
            picture.rays
        );
    }
}
