//! HOW a scene is rendered: the device, the program that the scene needs, its buffers, and the dispatches that walk the ray
//! trees. The shaders are in `shaders/`, what they compute is in `shaders/README.md`.
//!
//! Everything up to [`Device`] works without one: [`assemble`] gives a specialised naga module, [`GpuScene`] the bytes.

mod adaptive;
#[cfg(test)]
mod agreement;
mod ahead;
mod attributes;
mod batch;
mod branch_bound;
mod camera;
mod cost;
mod device;
mod error;
mod hierarchy;
mod instances;
mod pass;
mod piece;
mod pipeline;
mod plan;
mod probe;
mod program;
mod render;
mod settings;
mod solids;
mod statistics;
mod table;
mod upload;
mod wavefront;

pub mod source;
pub mod specialise;
pub mod types;

pub use ahead::Ahead;
pub use attributes::VertexRecord;
pub use branch_bound::branch_bound;
pub use cost::{BufferCost, Cost, cost};
pub use device::{Device, DeviceChoice, DeviceError, DeviceInfo, list_devices};
pub use error::RenderError;
pub use hierarchy::build_bvh;
pub use piece::{Piece, PieceCall, PieceResult, evaluate};
pub use pipeline::{Binding, bindings_of};
pub use probe::{Prober, SecondaryProber, probe};
pub use program::{Feature, Kernel, ProgramError, ProgramFeatures, assemble, assemble_ahead};
pub use raytree_control::{ErrorReport, Tolerance};
pub use render::{Prepared, Progress, RenderTimes, Rendered, render, render_ahead, render_with};
pub use settings::{Numerics, Region, RenderSettings, Shading};
pub use statistics::{Counters, Dropped, EndCounts, RayCounts};
pub use table::{TABLE_WIDTH, Table};
pub use upload::{GpuScene, TooManyMedia};
pub use wavefront::recorded_rays::RecordedRays;
