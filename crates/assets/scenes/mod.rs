//! The scenes, one file each. `assets/README.md` says what a right picture of each shows.

mod book;
mod cards;
mod cornell;
mod critical_prism;
mod everything;
mod facing_mirrors;
mod glass_in_water;
mod materials;
mod ten_lights;
mod whitted_1980;

use glam::DVec3;

use crate::gltf::{Container, Gltf};

/// All scenes, and the files that each is written as.
#[must_use]
pub fn all() -> Vec<(Gltf, Container)> {
    vec![
        (whitted_1980::scene(), Container::Glb),
        (cornell::scene(), Container::Glb),
        (glass_in_water::scene(), Container::Glb),
        (facing_mirrors::scene(), Container::Glb),
        (critical_prism::scene(), Container::Glb),
        (cards::scene(), Container::Separate),
        (ten_lights::scene(), Container::Glb),
        (materials::scene(), Container::Embedded),
        (everything::scene(), Container::Glb),
        (book::scene(), Container::Glb),
    ]
}

const WHITE: [f64; 3] = [1.0; 3];

const fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}
