//! Single functions of the shaders, called alone (`shaders/kernels/pieces.wgsl`) with drawn arguments, each against its twin in f64,
//! written from the paper or the contract, not from the WGSL.
//!
//! Arguments come from proptest's strategies by a fixed seed, so every run tries the same; all calls of a property are one
//! dispatch, and what fails is shrunk call by call.

mod support;

#[path = "properties/geometry.rs"]
mod geometry;
#[path = "properties/lookups.rs"]
mod lookups;
#[path = "properties/optics.rs"]
mod optics;
#[path = "properties/tables.rs"]
mod tables;
#[path = "properties/trial.rs"]
mod trial;
