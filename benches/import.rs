//! Importing glTF: parsing, decoding images, resolving materials, transforming geometry.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use std::path::Path;

use criterion::{Criterion, Throughput};
use raytree::Scene;

/// A file, and the triangles and images that it has at least: the most triangles, the most features, the most images.
const FILES: [(&str, usize, usize); 3] = [
    ("whitted-1980.glb", 47_042, 0),
    ("everything.glb", 17_390, 5),
    ("cards.gltf", 30, 9),
];

fn import(path: &Path) -> Scene {
    raytree::import(path).unwrap_or_else(|error| panic!("{error}"))
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let mut group = support::group(&mut criterion, "import", 3);
    for (file, least_triangles, least_images) in FILES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("assets")
            .join(file);
        let mut scene = None;
        let triangles = import(&path).geometry.triangles.len();
        group.throughput(Throughput::Elements(triangles as u64));
        group.bench_function(support::stem(file), |bencher| {
            bencher.iter(|| scene = Some(import(&path)))
        });
        if let Some(scene) = scene {
            assert!(
                scene.geometry.triangles.len() >= least_triangles,
                "{file}: {triangles} triangles"
            );
            assert!(
                scene.images.len() >= least_images,
                "{file}: {} images",
                scene.images.len()
            );
            assert!(scene.warnings.is_empty(), "{file}: {:?}", scene.warnings);
        }
    }
    group.finish();
    criterion.final_summary();
}
