//! Building hierarchies by each preset, over a terrain of 100,352 triangles.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use criterion::{Criterion, Throughput};
use raytree::{Bvh, Preset};

/// Squares along a side.
const SIDE: u32 = 224;

fn main() {
    let triangles = support::rays::hills(SIDE);
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
