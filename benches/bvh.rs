//! Building hierarchies by each preset, over a terrain of 100,352 triangles.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use criterion::{Criterion, Throughput};
use glam::Vec3;
use raytree::{Bvh, Preset};

/// Squares along a side.
const SIDE: u32 = 224;

/// The sum of sines that a terrain is: steep and flat, long and short triangles, the same every time.
fn terrain() -> Vec<[Vec3; 3]> {
    let vertex = |column: u32, row: u32| {
        let (x, z) = (column as f32 / SIDE as f32, row as f32 / SIDE as f32);
        let height = 0.1 * (9.0 * x + 4.0 * z).sin()
            + 0.03 * (31.0 * x * z).cos()
            + 0.005 * (170.0 * (x - z)).sin();
        Vec3::new(x, height, z)
    };
    let squares = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (column, row)));
    squares
        .flat_map(|(column, row)| {
            let corners =
                [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(c, r)| vertex(column + c, row + r));
            [
                [corners[0], corners[1], corners[2]],
                [corners[2], corners[1], corners[3]],
            ]
        })
        .collect()
}

fn main() {
    let triangles = terrain();
    let mut criterion = Criterion::default().configure_from_args();
    let mut group = support::group(&mut criterion, "bvh", 4);
    group.throughput(Throughput::Elements(triangles.len() as u64));
    for (name, preset) in [
        ("fast", Preset::Fast),
        ("balanced", Preset::Balanced),
        ("best", Preset::Best),
    ] {
        let mut built: Option<Bvh> = None;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                built = Some(
                    raytree_bvh::build(&triangles, preset)
                        .unwrap_or_else(|error| panic!("{error}")),
                );
            });
        });
        // A filter on the command line may have left it out.
        if let Some(bvh) = &built {
            raytree_bvh::check(bvh, &triangles, preset == Preset::Best)
                .unwrap_or_else(|defect| panic!("{name}: {defect}"));
        }
    }
    group.finish();
    criterion.final_summary();
}
