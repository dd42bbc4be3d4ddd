//! The program as its users meet it: what it prints, what it writes, how it ends.

#[path = "../support/mod.rs"]
mod support;

#[macro_use]
mod harness;

mod compare;
mod converge;
mod errors;
mod inspect;
mod render;
mod repeat;
mod shader_cache;
mod signals;
mod stress;
mod tolerance;
mod view;
