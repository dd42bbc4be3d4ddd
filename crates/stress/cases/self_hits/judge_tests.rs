use raytree_gpu::types::LEAVING_ALONG;

use super::*;
use crate::{cases::self_hits::rays, meshes::ellipsoid};

/// What a perfect device finds, but for `change`, which gets the first hit, and then again the whole.
fn find(
    judge: &Judge<'_>,
    ray: &SecondaryRay,
    move_start: impl Fn(DVec3, DVec3) -> DVec3,
) -> Option<SecondaryHit> {
    let (origin, direction) = (vec(ray.origin), vec(ray.direction));
    let first = judge
        .oracle
        .closest_hit(origin.to_array(), direction.to_array(), Shading::Pbr)?;
    let [a, b, c] = judge.corners(first.triangle);
    let front = (b - a).cross(c - a).normalize();
    let ng = if first.back { -front } else { front };
    let (right, up) = ng.any_orthonormal_pair();
    let next = match ray.leaving {
        LEAVING_ALONG => vec(ray.next),
        LEAVING_MIRRORED => direction - 2.0 * direction.dot(ng) * ng,
        _ => {
            let next = vec(ray.next);
            next.x * right + next.y * up + next.z * ng
        }
    }
    .as_vec3();
    let point = origin + first.t * direction;
    let side = ng.dot(next.as_dvec3()).signum();
    let start = move_start(point + 1e-13 * side * ng, ng);
    let second = judge.oracle.closest_hit_leaving(
        first.triangle,
        start.to_array(),
        next.as_dvec3().to_array(),
        Shading::Pbr,
    );
    Some(SecondaryHit {
        position: point.as_vec3().to_array(),
        triangle: first.triangle as u32,
        origin: start.as_vec3().to_array(),
        direction: next.to_array(),
        t: second.map_or(1e30, |hit| hit.t as f32),
        next_triangle: second.map_or(u32::MAX, |hit| hit.triangle as u32),
        ng: ng.as_vec3().to_array(),
        ..SecondaryHit::default()
    })
}

fn tally(move_start: impl Fn(DVec3, DVec3) -> DVec3 + Copy) -> Tally {
    let mesh = ellipsoid("a ball", Vec3::new(0.3, -0.2, 0.1), Vec3::splat(0.7), 12);
    let judge = Judge::new(&mesh.scene);
    let mut tally = Tally::default();
    for ray in rays::all_over(&mesh, 4000) {
        if let Some(hit) = find(&judge, &ray, move_start) {
            judge.judge(&ray, &hit, &mut tally);
        }
    }
    tally
}

#[test]
fn what_the_oracle_says_is_right() {
    let tally = tally(|start, _| start);
    assert!(tally.pairs > 3900);
    assert_eq!(
        (tally.false_hits, tally.missed, tally.wrong_side),
        (0, 0, 0),
        "{tally:?}"
    );
    assert!(tally.start < 0.5, "{tally:?}");
}

/// A ray that starts a little below its facet hits the facets around it, or misses those that it should hit.
#[test]
fn a_start_on_the_wrong_side_is_noticed() {
    for depth in [1e-4, 1e-5, 2e-6] {
        let tally = tally(|start, ng| start - depth * ng);
        assert!(tally.false_hits + tally.missed > 3, "{depth}: {tally:?}");
    }
}

#[test]
fn a_start_far_off_is_noticed() {
    let tally = tally(|start, ng| start + 1e-3 * ng.any_orthonormal_vector());
    assert!(tally.start > 10.0, "{tally:?}");
}

/// Neither a hit too many nor one too few is excused.
#[test]
fn a_wrong_second_hit_is_noticed() {
    let mesh = ellipsoid("a ball", Vec3::ZERO, Vec3::splat(0.7), 12);
    let judge = Judge::new(&mesh.scene);
    let (mut hits, mut missed, mut invented) = (0, Tally::default(), Tally::default());
    for ray in rays::all_over(&mesh, 2000) {
        let Some(hit) = find(&judge, &ray, |start, _| start) else {
            continue;
        };
        if hit.next_triangle == u32::MAX {
            let next_triangle = (hit.triangle + 5) % mesh.scene.geometry.triangles.len() as u32;
            let wrong = SecondaryHit {
                next_triangle,
                t: 1e-3,
                ..hit
            };
            judge.judge(&ray, &wrong, &mut invented);
        } else {
            hits += 1;
            let wrong = SecondaryHit {
                next_triangle: u32::MAX,
                t: 1e30,
                ..hit
            };
            judge.judge(&ray, &wrong, &mut missed);
        }
    }
    assert!(hits > 300 && invented.pairs > 300);
    assert!(missed.missed as f64 > 0.95 * f64::from(hits), "{missed:?}");
    assert!(
        invented.false_hits as f64 > 0.95 * invented.pairs as f64,
        "{invented:?}"
    );
}

#[test]
fn a_direction_into_the_facet_is_noticed() {
    let mesh = ellipsoid("a ball", Vec3::ZERO, Vec3::splat(0.7), 12);
    let judge = Judge::new(&mesh.scene);
    let mut tally = Tally::default();
    for ray in rays::all_over(&mesh, 200) {
        if let Some(hit) = find(&judge, &ray, |start, _| start) {
            let direction = hit.direction.map(|d| -d);
            judge.judge(&ray, &SecondaryHit { direction, ..hit }, &mut tally);
        }
    }
    assert_eq!(tally.wrong_side, tally.pairs);
}

#[test]
fn nothing_that_leaves_is_no_figure() {
    assert!(Tally::default().of_pairs(0).is_nan());
}

#[test]
fn no_start_is_farther_than_none() {
    let mut tally = Tally::default();
    for start in [0.5, f64::NAN, 0.7] {
        tally.add(Tally {
            start,
            ..Tally::default()
        });
    }
    assert!(tally.start.is_nan());
}
