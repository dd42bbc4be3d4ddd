//! What there is to say to `raytree converge`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use raytree_converge::{Clock, Values};

use crate::args::{LightingArgs, QualityArgs, ViewArgs};
use crate::values;

/// Renders the scene in many ways, several times each in turn, and holds every picture against a reference. Without --size the
/// picture is about as large as 160x120: the default sweep then takes a minute on two cores, the reference included.
#[derive(Debug, Args)]
pub struct ConvergeArgs {
    /// A .gltf or .glb file.
    pub scene: PathBuf,

    /// The folder for converge.csv, .json, .svg and .png, and for the measurements, from which a second run goes on [default:
    /// SCENE-converge, in the current folder].
    #[arg(short, long, value_name = "FOLDER", help_heading = "Output")]
    pub output: Option<PathBuf>,

    /// Also write each point's picture beside the reference and their difference, to errors/ in that folder.
    #[arg(long, help_heading = "Output")]
    pub errors: bool,

    /// Print one JSON object on stdout instead of the table.
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    /// What to vary: spp, depth, min-weight, tolerance, bvh or shading; given several times, every combination is measured
    /// [default: ladders of all of them but shading about the settings below]. A tolerance (absolute) decides samples, depth, weights and rays
    /// by itself.
    #[arg(long, value_name = "KEY=A,B,C", value_parser = sweep_values, help_heading = "Measurement")]
    pub sweep: Vec<Values>,

    /// How often each setting is timed, in turn with all others; medians are told with least and most.
    #[arg(long, value_name = "N", default_value = "5", allow_hyphen_values = true, value_parser = values::integer(2, 1000), help_heading = "Measurement")]
    pub repeat: u32,

    /// By which clock settings are compared: CPU seconds of all threads (on a GPU, of the host alone), or time that passes.
    #[arg(long, value_enum, value_name = "CLOCK", default_value_t = ClockChoice::Cpu, help_heading = "Measurement")]
    pub time: ClockChoice,

    /// Forget measurements that are in the folder already.
    #[arg(long, help_heading = "Measurement")]
    pub fresh: bool,

    /// The truth, PNG or EXR; given twice, the mean of both, which tells its own error too [default: made, and kept in the
    /// user's cache].
    #[arg(long, value_name = "FILE", help_heading = "Reference")]
    pub reference: Vec<PathBuf>,

    /// At least so many samples a pixel for each of the two references [default: 3.5 times the sweep's most].
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::integer(4, 4096), conflicts_with = "reference", help_heading = "Reference")]
    pub reference_spp: Option<u32>,

    /// Whether the f64 oracle makes one of the two: where it is quick enough, else it checks some rows; always; or not at all.
    #[arg(long, value_enum, default_value_t = OracleChoice::Auto, conflicts_with = "reference", help_heading = "Reference")]
    pub oracle: OracleChoice,

    #[command(flatten)]
    pub view: ViewArgs,
    #[command(flatten)]
    pub lighting: LightingArgs,
    #[command(flatten)]
    pub quality: QualityArgs,
}

/// When the oracle renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OracleChoice {
    Auto,
    Always,
    Never,
}

/// By which clock settings are compared.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ClockChoice {
    Cpu,
    Wall,
}

impl From<ClockChoice> for Clock {
    fn from(choice: ClockChoice) -> Self {
        match choice {
            ClockChoice::Cpu => Self::Cpu,
            ClockChoice::Wall => Self::Wall,
        }
    }
}

fn sweep_values(text: &str) -> Result<Values, String> {
    Values::parse(text).map_err(|error| error.to_string())
}
