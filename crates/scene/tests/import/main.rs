//! The glTF importer against files whose scene can be worked out by hand, against the files in ../shared, and against files
//! that are broken in every way that we could think of. The oracle shares the importer, so nothing else would see its mistakes.

mod broken;
mod builder;
mod corpus;
mod geometry;
mod instances;
mod materials;
mod nodes;
mod views;
