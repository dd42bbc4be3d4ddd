//! `cargo run -p raytree-assets`: writes the scenes into `assets/`, or into the folder named as the only argument.
#![allow(clippy::print_stdout, reason = "a program that says what it wrote")]

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let folder = std::env::args_os()
        .nth(1)
        .map_or_else(raytree_assets::directory, PathBuf::from);
    std::fs::create_dir_all(&folder)?;
    for file in raytree_assets::files() {
        std::fs::write(folder.join(&file.name), &file.bytes)?;
        println!("{:>8} {}", file.bytes.len(), file.name);
    }
    Ok(())
}
