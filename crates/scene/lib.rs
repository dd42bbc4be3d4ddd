//! WHAT is rendered: the scene model, the glTF importer and environment maps. Knows nothing of how it is rendered.

pub mod environment;
pub mod model;
