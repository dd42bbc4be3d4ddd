//! WHAT is rendered: the scene model, the glTF importer and environment maps. Knows nothing of how it is rendered.

mod contact;
pub mod default_view;
pub mod environment;
pub mod features;
pub mod import;
pub mod instances;
pub mod model;
mod parallel;
pub mod place;
mod shown;
pub mod simplify;
pub mod studio;
#[cfg(test)]
mod test_scenes;
