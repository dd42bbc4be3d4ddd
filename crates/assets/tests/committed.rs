//! The committed files are what the program writes.

use std::collections::BTreeSet;

#[test]
fn assets_are_as_written_by_this_program() {
    let folder = raytree_assets::directory();
    for file in raytree_assets::files() {
        let path = folder.join(&file.name);
        let committed =
            std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(
            committed == file.bytes,
            "{} differs: `cargo run -p raytree-assets` writes it anew",
            file.name
        );
    }
}

#[test]
fn no_file_is_left_over_and_all_are_small() {
    let mut expected: BTreeSet<String> = raytree_assets::files()
        .into_iter()
        .map(|file| file.name)
        .collect();
    expected.insert("README.md".to_owned());
    let mut total = 0;
    for entry in std::fs::read_dir(raytree_assets::directory()).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        assert!(
            expected.remove(&name),
            "assets/{name} is not written by this program"
        );
        total += entry.metadata().unwrap().len();
    }
    assert!(expected.is_empty(), "missing: {expected:?}");
    assert!(total < 4 << 20, "assets/ has {total} bytes");
}
