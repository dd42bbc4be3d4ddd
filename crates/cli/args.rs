//! The command line: what there is to say, with its defaults. Only syntax and ranges are checked here.

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::NonEmptyStringValueParser;
use clap::{ArgAction, Args, Parser, Subcommand, ValueEnum};
use glam::{DVec3, Vec3};
use raytree::{Background, BitDepth, Preset, Region, RenderSettings, Shading, Tolerance, ToneMap};

use crate::converge::ConvergeArgs;
use crate::failure::Usage;
use crate::values::{self, CameraChoice, OutlierLimit, Size};

/// Renders glTF scenes by a deterministic, noise-free Whitted ray tree on any Vulkan device, by default the CPU.
///
/// `raytree scene.glb` renders to scene.png in the current folder, with a camera, light and size of its own where the file
/// names none.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100, after_help = EXIT_CODES)]
pub struct Cli {
    /// Print errors only.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,

    /// Print where the time went and what the program contained; twice: also the log (as RAYTREE_LOG=debug does).
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,

    #[command(subcommand)]
    pub command: Command,
}

const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 a comparison failed, or an output could not be written; 2 usage; 3 no device, or device lost; \
4 the scene, environment or picture can't be read; 5 a limit of the device or the program; 130 interrupted.";

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to PNG or OpenEXR.
    #[command(after_help = EXIT_CODES)]
    Render(Box<RenderArgs>),
    /// Show what a scene contains and what its program would contain; needs no device.
    Inspect(InspectArgs),
    /// Measure how much two pictures differ; fails if that is more than the limits given.
    Compare(CompareArgs),
    /// Measure error against run time over a sweep of settings: table, CSV, JSON and a diagram.
    #[command(after_help = EXIT_CODES)]
    Converge(Box<ConvergeArgs>),
    /// Run the suite of stiff and extreme cases, each judged by an answer on paper or by the f64 oracle; fails if a case does.
    #[command(after_help = EXIT_CODES)]
    Stress(StressArgs),
    /// List the devices that can render.
    Devices(DevicesArgs),
}

#[derive(Debug, Args)]
pub struct RenderArgs {
    /// A .gltf or .glb file.
    pub scene: PathBuf,

    #[command(flatten)]
    pub output: OutputArgs,
    #[command(flatten)]
    pub view: ViewArgs,
    #[command(flatten)]
    pub lighting: LightingArgs,
    #[command(flatten)]
    pub quality: QualityArgs,

    /// Count rays, node visits, triangle tests and why branches end.
    #[arg(long, help_heading = "Report")]
    pub counters: bool,
    /// Print settings, device, times and counters as one JSON object on stdout.
    #[arg(long, help_heading = "Report")]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub struct OutputArgs {
    /// Where the picture goes; may be given several times [default: the scene's name with .png, in the current folder].
    ///
    /// The ending decides: .png (tone-mapped sRGB) or .exr (linear radiance, with depth, position, normals, albedo, ids and
    /// rays per pixel as layers).
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,

    /// Stops by which to brighten; PNG only.
    #[arg(long, value_name = "STOPS", default_value = "0", allow_hyphen_values = true, value_parser = values::number(-64.0, 64.0))]
    pub exposure: f64,

    /// From radiance to the screen's range; PNG only.
    #[arg(long, value_enum, default_value_t = ToneMapChoice::Neutral)]
    pub tonemap: ToneMapChoice,

    /// Bits of a PNG's channels.
    #[arg(long, value_enum, value_name = "BITS", default_value_t = BitsChoice::Eight)]
    pub png_bits: BitsChoice,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "View")]
pub struct ViewArgs {
    /// Pixels across and down [default: as many as 960x720, to converge 160x120, in the camera's proportions].
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub size: Option<Size>,

    /// Render this part of the picture alone: pixels from its upper left corner.
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::region)]
    pub region: Option<Region>,

    /// A camera of the file by name or number (`raytree inspect` lists them), or `auto`: all of the scene, three-quarter
    /// from above [default: the first of the file, else auto].
    #[arg(long, value_name = "NAME|INDEX|auto", value_parser = values::camera)]
    pub camera: Option<CameraChoice>,

    /// A camera of your own, instead: where it is, metres, world space [default: where `auto` stands].
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = values::vector, conflicts_with = "camera")]
    pub eye: Option<DVec3>,

    /// What it looks at [default: the middle of the scene].
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = values::vector, conflicts_with = "camera")]
    pub target: Option<DVec3>,

    /// What is up [default: 0,1,0].
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = values::vector, conflicts_with = "camera")]
    pub up: Option<DVec3>,

    /// Its vertical field of view [default: 40].
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, value_parser = values::number(0.001, 179.9), conflicts_with = "camera")]
    pub fov: Option<f64>,
}

impl ViewArgs {
    /// Is there a camera on the command line itself?
    pub fn has_own_camera(&self) -> bool {
        self.eye.is_some() || self.target.is_some() || self.up.is_some() || self.fov.is_some()
    }
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Light")]
pub struct LightingArgs {
    /// Constant light from everywhere, linear [default: 0].
    #[arg(long, value_name = "R,G,B|GREY", allow_hyphen_values = true, value_parser = values::color)]
    pub ambient: Option<Vec3>,

    /// Light from all around: an equirectangular .hdr or .exr (or .png, .jpg).
    #[arg(long, value_name = "FILE")]
    pub env: Option<PathBuf>,

    /// Turns it about +Y, counter-clockwise seen from above.
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_hyphen_values = true, value_parser = values::number(-1e6, 1e6), requires = "env")]
    pub env_rotation: f64,

    /// Multiplies it.
    #[arg(long, value_name = "FACTOR", default_value = "1", allow_hyphen_values = true, value_parser = values::number(0.0, 1e6), requires = "env")]
    pub env_strength: f64,

    /// What the camera sees behind the scene: the environment (black without one), nothing (alpha 0), or a colour, sRGB as
    /// #rrggbb or linear as r,g,b [default: env, or the studio's grey].
    #[arg(long, value_name = "env|transparent|#rrggbb|R,G,B", allow_hyphen_values = true, value_parser = values::background)]
    pub background: Option<Background>,

    /// Add the built-in studio: a neutral environment and a key light [default: only for scenes without any light].
    #[arg(long, overrides_with = "no_studio", conflicts_with = "env")]
    pub studio: bool,

    /// Leave scenes without light dark.
    #[arg(long, overrides_with = "studio")]
    pub no_studio: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Quality")]
pub struct QualityArgs {
    /// How far the picture may be off, root mean square over its pixels, in linear radiance (the screen's white is 1) or in percent of each
    /// pixel's own: pixels get the samples that it takes, and from ray trees is left out what can't matter.
    ///
    /// The picture meant is that of endless samples and depth. An .exr has layers of what each pixel is said to be off by. --spp, --depth,
    /// --min-weight and --max-rays are then limits.
    #[arg(long, value_name = "ERROR|PERCENT%", allow_hyphen_values = true, value_parser = values::tolerance)]
    pub tolerance: Option<Tolerance>,

    /// End after this time, all told, with the best picture by then; with --tolerance, before that if it is kept. As in 2s or 500ms.
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = values::duration)]
    pub time_budget: Option<Duration>,

    /// Levels of the ray tree below the camera's ray [default: 8; with a tolerance or a time budget 256].
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::integer(0, 65536))]
    pub depth: Option<u32>,

    /// Samples a pixel: stratified, always the same; more than one are filtered [default: 1; at most 8192]. With a tolerance or a time
    /// budget: the most of any pixel, which has 1, 5, 9, 17, .. of them [default: 131073].
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::integer(1, RenderSettings::MOST_SAMPLES))]
    pub spp: Option<u32>,

    /// A branch that weighs less in every channel is dropped [default: 1/256, a step of 8 bits; with a tolerance or a time budget 0].
    #[arg(long, value_name = "WEIGHT", allow_hyphen_values = true, value_parser = values::number(0.0, 1.0))]
    pub min_weight: Option<f64>,

    /// The most rays of a sample's tree, shadow rays left out; a tree of half as many is always whole [default: 65536; with a tolerance or a
    /// time budget fewer, 256 for 0.01].
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::integer(1, 1 << 30))]
    pub max_rays: Option<u32>,

    /// glTF's model, or eq. 14.32 of Foley et al. as written.
    #[arg(long, value_enum, default_value_t = ShadingChoice::Pbr)]
    pub shading: ShadingChoice,

    /// How long to build the hierarchy for faster rays.
    #[arg(long, value_enum, value_name = "PRESET", default_value_t = BvhChoice::Balanced)]
    pub bvh: BvhChoice,

    /// The CPU, the first GPU, or one of `raytree devices` by number or part of its name.
    #[arg(long, value_name = "cpu|gpu|INDEX|NAME", default_value = "cpu", value_parser = NonEmptyStringValueParser::new())]
    pub device: String,

    /// Pixels worked on at once; changes memory and the steps of progress, never the picture
    /// [default: up to 65536 on a CPU, 1048576 on a GPU].
    #[arg(long, value_name = "PIXELS", allow_hyphen_values = true, value_parser = values::integer(1, 1 << 24))]
    pub batch: Option<u32>,
}

impl QualityArgs {
    /// What is refused of arguments that go together.
    pub fn check(&self) -> Result<(), Usage> {
        let is_controlled = self.tolerance.is_some() || self.time_budget.is_some();
        let most = RenderSettings::MOST_EVEN_SAMPLES;
        match self.spp {
            Some(samples) if samples > most && !is_controlled => Err(Usage(format!(
                "--spp: at most {most} of each pixel; --tolerance gives more to those that need them"
            ))),
            _ => Ok(()),
        }
    }
}

#[derive(Debug, Args)]
pub struct InspectArgs {
    /// A .gltf or .glb file.
    pub scene: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct StressArgs {
    /// Run these cases alone: names, separated by commas.
    #[arg(long, value_name = "CASES", value_delimiter = ',')]
    pub only: Vec<String>,

    /// Print the names of the cases and what they try, and run none.
    #[arg(long, conflicts_with_all = ["only", "json", "markdown", "beside_book"])]
    pub list: bool,

    /// Run each case a second time as the book has it, and show what comes out beside ours: rays start in the hit point, and hits
    /// nearer than this are ignored, scene units (about the scene's extent) [default: 1e-4, which does best].
    #[arg(long, value_name = "TOLERANCE", num_args = 0..=1, require_equals = true, value_parser = values::number(0.0, 1.0))]
    pub beside_book: Option<Option<f64>>,

    /// Print one JSON object.
    #[arg(long, conflicts_with = "markdown")]
    pub json: bool,

    /// Print a table in Markdown.
    #[arg(long)]
    pub markdown: bool,

    /// The CPU, the first GPU, or one of `raytree devices` by number or part of its name.
    #[arg(long, value_name = "cpu|gpu|INDEX|NAME", default_value = "cpu", value_parser = NonEmptyStringValueParser::new())]
    pub device: String,
}

#[derive(Debug, Args)]
pub struct DevicesArgs {
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// All differences are in linear radiance, white = 1. Pictures of different sizes can't be compared: exit code 1.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The picture as it should be, PNG or EXR.
    pub expected: PathBuf,
    /// The picture as it is, PNG or EXR.
    pub actual: PathBuf,

    /// Clip both to [0, 1] first.
    #[arg(long)]
    pub clip: bool,
    /// Report the share of pixels that are off by more than this; may be given several times [default: 0.02].
    #[arg(long, value_name = "T", allow_hyphen_values = true, value_parser = values::number(0.0, 1e9))]
    pub threshold: Vec<f64>,
    /// Leave out FLIP, which takes ten times longer than all the rest.
    #[arg(long)]
    pub no_flip: bool,
    /// Write expected, actual and difference side by side; the difference is black below 0.0001, pale yellow at 1.
    #[arg(long, value_name = "FILE.png")]
    pub diff: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,

    #[command(flatten)]
    pub limits: LimitArgs,
}

#[derive(Debug, Args)]
#[command(
    next_help_heading = "Limits (exit code 1 if one is broken; pixels with NaN or infinity break any)"
)]
pub struct LimitArgs {
    /// Mean absolute difference.
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::number(0.0, 1e9))]
    pub max_mean: Option<f64>,
    /// Root of the mean squared difference.
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::number(0.0, 1e9))]
    pub max_rmse: Option<f64>,
    /// Largest difference of any channel of any pixel.
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::number(0.0, 1e9))]
    pub max_abs: Option<f64>,
    /// 99th percentile of the pixels' largest differences.
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::number(0.0, 1e9))]
    pub max_p99: Option<f64>,
    /// Largest difference in alpha.
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::number(0.0, 1.0))]
    pub max_alpha: Option<f64>,
    /// Mean FLIP, 0 to 1.
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::number(0.0, 1.0), conflicts_with = "no_flip")]
    pub max_flip: Option<f64>,
    /// Share (0 to 1) of pixels off by more than a threshold; may be given several times.
    #[arg(long, value_name = "THRESHOLD:SHARE", allow_hyphen_values = true, value_parser = values::outlier_limit)]
    pub max_outliers: Vec<OutlierLimit>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ShadingChoice {
    Pbr,
    Whitted,
}

impl From<ShadingChoice> for Shading {
    fn from(choice: ShadingChoice) -> Self {
        match choice {
            ShadingChoice::Pbr => Self::Pbr,
            ShadingChoice::Whitted => Self::Whitted,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BvhChoice {
    Fast,
    Balanced,
    Best,
}

impl From<BvhChoice> for Preset {
    fn from(choice: BvhChoice) -> Self {
        match choice {
            BvhChoice::Fast => Self::Fast,
            BvhChoice::Balanced => Self::Balanced,
            BvhChoice::Best => Self::Best,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ToneMapChoice {
    /// Clip to [0, 1].
    None,
    /// Khronos PBR Neutral: base colours as authored.
    Neutral,
    /// Soft, film-like.
    Agx,
    /// Strong contrast, saturated.
    Aces,
}

impl From<ToneMapChoice> for ToneMap {
    fn from(choice: ToneMapChoice) -> Self {
        match choice {
            ToneMapChoice::None => Self::None,
            ToneMapChoice::Neutral => Self::Neutral,
            ToneMapChoice::Agx => Self::Agx,
            ToneMapChoice::Aces => Self::Aces,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BitsChoice {
    #[value(name = "8")]
    Eight,
    #[value(name = "16")]
    Sixteen,
}

impl From<BitsChoice> for BitDepth {
    fn from(choice: BitsChoice) -> Self {
        match choice {
            BitsChoice::Eight => Self::Eight,
            BitsChoice::Sixteen => Self::Sixteen,
        }
    }
}

/// How a choice is spelled on the command line.
pub fn spelled(choice: impl ValueEnum) -> String {
    choice
        .to_possible_value()
        .map_or_else(String::new, |value| value.get_name().to_owned())
}
