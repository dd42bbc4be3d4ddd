//! Scenes whose picture is known on paper. Each file holds one subject; [`build`] makes scenes by hand.

mod alpha;
mod build;
mod environment;
mod geometry;
mod limits;
mod pbr;
mod pictures;
mod refraction;
mod shadows;
mod surface;
mod textures;
mod whitted;
