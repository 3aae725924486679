//! What the command line takes: the one list of commands and options. `--help` comes from here.

use crate::transport::settings::{Connections, Layers, LightStarts, Tracking};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// A volumetric light transport research renderer: bidirectional estimators, compared under one weight.
#[derive(Parser, Debug)]
#[command(name = "tyndall", version, arg_required_else_help = true, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Run an experiment: render, measure, compare, and write a page of figures.
    Run(RunArgs),
    /// Tell how far an experiment has come: what is done, under way and left.
    Status(StatusArgs),
    /// Put the parts of an experiment that shards rendered together, and measure them.
    Merge(MergeArgs),
    /// Render a scene with one estimator.
    Render(RenderArgs),
    /// Find the pixels of an EXR with the largest samples, and replay those of a pixel: of one path every technique,
    /// density and weight.
    Explain(ExplainArgs),
    /// Measure an image against a reference.
    Compare(CompareArgs),
    /// Tell what is in a scene: shapes, triangles, materials, lights, extent, warnings.
    Info(InfoArgs),
    /// Turn a scene of Mitsuba 3, SmallUPBP or glTF into a scene file, which renders to the same pixels.
    Import(ImportArgs),
    /// Write figures and page again, from the results on disk.
    Report(ReportArgs),
    /// List techniques and presets.
    Techniques,
}

/// `tyndall info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// A scene file, its folder, or the name of a folder in scenes/.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// As JSON, for programs.
    #[arg(long)]
    pub json: bool,
}

/// `tyndall import`.
#[derive(Args, Debug)]
pub struct ImportArgs {
    /// A Mitsuba 3 scene (.xml), SmallUPBP's (.obj beside .mtl and .obj.aux) or glTF 2.0 (.gltf, .glb).
    #[arg(value_name = "IN")]
    pub scene: PathBuf,
    /// The scene file to write; its meshes and pictures go into a folder beside it.
    #[arg(value_name = "OUT.toml")]
    pub out: PathBuf,
    /// Write over a scene file that is there.
    #[arg(long)]
    pub force: bool,
}

/// An experiment, where its results are, and what is changed of it.
#[derive(Args, Debug)]
pub struct ExperimentArgs {
    /// The experiment file.
    #[arg(value_name = "EXPERIMENT.toml")]
    pub experiment: PathBuf,
    /// Folder of the results [default: results/<experiment>, in the current folder].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Folder where rendered references are kept [default: .references beside the folder of results].
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Threads to render with; timed runs are those of as many [default: one a processor].
    #[arg(long, value_name = "N", value_parser = super::parse::threads)]
    pub threads: Option<usize>,
    /// Change an entry of the experiment file, as in --set budget.spp=16 or --set estimator.pt.max_length=4.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
}

/// `tyndall run`.
#[derive(Args, Debug)]
pub struct RunArgs {
    /// Which experiment.
    #[command(flatten)]
    pub of: ExperimentArgs,
    /// Render a part of the runs only, such as 2/8 for the second of eight, and measure nothing: `tyndall merge` does.
    #[arg(long, value_name = "I/N", value_parser = super::parse::shard)]
    pub shard: Option<(u64, u64)>,
    /// Stream the image and what each technique adds to it to the viewer tev while it renders [default: 127.0.0.1:14158].
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = crate::render::tev::DEFAULT_ADDRESS,
          value_parser = super::parse::address)]
    pub tev: Option<String>,
}

/// `tyndall status`.
#[derive(Args, Debug)]
pub struct StatusArgs {
    /// Which experiment.
    #[command(flatten)]
    pub of: ExperimentArgs,
    /// Delete from the folder of results the runs of other settings, scene contents or rendering code, and the images of what was
    /// taken out of the experiment.
    #[arg(long)]
    pub prune: bool,
}

/// `tyndall merge`.
#[derive(Args, Debug)]
pub struct MergeArgs {
    /// Which experiment.
    #[command(flatten)]
    pub of: ExperimentArgs,
    /// Folders of results that shards made, if they have folders of their own.
    #[arg(value_name = "DIR")]
    pub from: Vec<PathBuf>,
}

/// What is rendered and how: all that decides the samples.
#[derive(Args, Debug)]
pub struct SamplesArgs {
    /// A scene file, its folder, or the name of a folder in scenes/.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// A preset: see `tyndall techniques`.
    #[arg(long, value_name = "PRESET", default_value = "bpt", conflicts_with = "techniques")]
    pub estimator: String,
    /// Instead of a preset: techniques, separated by commas.
    #[arg(long, value_name = "A,B,C", value_delimiter = ',')]
    pub techniques: Vec<String>,
    /// How techniques are weighted.
    #[arg(long, value_enum, default_value_t = HeuristicArg::Balance)]
    pub heuristic: HeuristicArg,
    /// Which connections between subpaths are made.
    #[arg(long, value_enum, default_value_t = ConnectionsArg::Thinned)]
    pub connections: ConnectionsArg,
    /// Which lights light subpaths start on.
    #[arg(long, value_enum, default_value_t = LightStartsArg::Power)]
    pub light_starts: LightStartsArg,
    /// How flights and shadow rays go through media on grids whose extinction is grey.
    #[arg(long, value_enum, default_value_t = TrackingArg::Auto)]
    pub tracking: TrackingArg,
    /// How merges are made, as in --merge bb1d.radius=0.01 or --merge 'surf.paths={per_pixel=0.5}'.
    #[arg(long, value_name = "KEY=VALUE")]
    pub merge: Vec<String>,
    /// Samples per pixel [default: 16].
    #[arg(long, value_name = "N", value_parser = super::parse::spp)]
    pub spp: Option<u64>,
    /// Size of the image in pixels [default: the scene's].
    #[arg(long, value_name = "WxH", value_parser = super::parse::size)]
    pub size: Option<[u32; 2]>,
    /// Names the random numbers.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Shortest paths, in segments from light to lens [default: the scene's].
    #[arg(long, value_name = "K")]
    pub min_length: Option<u32>,
    /// Longest paths, in segments from light to lens [default: the scene's].
    #[arg(long, value_name = "K")]
    pub max_length: Option<u32>,
    /// Which paths count: all, media (at least one scattering in a medium), surfaces (none), or a light path
    /// expression from the lens to the light, such as ES*M(S|D|M)*L. E is the lens, S a specular event on a surface, D
    /// any other, M scattering in a medium, L the light, and . any of S, D and M.
    #[arg(long, value_name = "EXPR", default_value = "all")]
    pub paths: String,
    /// Threads to render with [default: one a processor].
    #[arg(long, value_name = "N", value_parser = super::parse::threads)]
    pub threads: Option<usize>,
}

/// `tyndall render`.
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// Which samples.
    #[command(flatten)]
    pub of: SamplesArgs,
    /// Time to render for, instead of --spp, such as 30s, 500ms, 5m or 1.5h. Pilots that choose radii count.
    #[arg(long, value_name = "TIME", value_parser = super::parse::duration, conflicts_with = "spp")]
    pub time: Option<f64>,
    /// Which contributions of techniques are kept as layers of the EXR.
    #[arg(long, value_enum, default_value_t = LayersArg::None)]
    pub layers: LayersArg,
    /// File to write, an EXR or a PNG [default: <scene>-<estimator>.exr].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Write a PNG beside the EXR.
    #[arg(long)]
    pub png: bool,
    /// Exposure of the PNG in stops.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true)]
    pub exposure: f32,
    /// Stream the image and what each technique adds to it to the viewer tev while it renders [default: 127.0.0.1:14158].
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = crate::render::tev::DEFAULT_ADDRESS,
          value_parser = super::parse::address)]
    pub tev: Option<String>,
}

/// `tyndall explain`.
#[derive(Args, Debug)]
pub struct ExplainArgs {
    /// The render whose samples are replayed: all --spp of them. Instead of a scene and options, an EXR that `tyndall run` or
    /// `tyndall render` wrote stands for all of them.
    #[command(flatten)]
    pub of: SamplesArgs,
    /// The pixel: column and row from 0 at the top left. Of an EXR with outliers (runs of experiments and renders with
    /// --layers families have them), the pixels with the largest samples are listed without it.
    #[arg(long, value_name = "X,Y", value_parser = super::parse::pixel)]
    pub pixel: Option<[u32; 2]>,
    /// Replay this sample of the pixel only, from 0 [default: all; of an EXR with outliers, the largest].
    #[arg(long, value_name = "N")]
    pub sample: Option<u64>,
    /// How many pixels of an EXR are listed.
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub top: usize,
    /// Which of the paths that contribute is told about, from 1 for the largest contribution.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = super::parse::ordinal)]
    pub path: usize,
    /// How many paths are listed.
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub most: usize,
}

/// `--heuristic`.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeuristicArg {
    /// Proportional to their densities.
    Balance,
    /// Proportional to the squares of their densities.
    Power,
}

/// `--connections`.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConnectionsArg {
    /// A share of them in media that scatter light many times.
    Thinned,
    /// All with all.
    All,
}

impl From<ConnectionsArg> for Connections {
    fn from(arg: ConnectionsArg) -> Self {
        match arg {
            ConnectionsArg::Thinned => Self::Thinned,
            ConnectionsArg::All => Self::All,
        }
    }
}

/// `--light-starts`.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightStartsArg {
    /// In proportion to the lights' powers.
    Power,
    /// By what the subpaths of each light bring to the image, as a pilot sees it.
    Pilot,
}

impl From<LightStartsArg> for LightStarts {
    fn from(arg: LightStartsArg) -> Self {
        match arg {
            LightStartsArg::Power => Self::Power,
            LightStartsArg::Pilot => Self::Pilot,
        }
    }
}

/// `--tracking`.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackingArg {
    /// Delta where the techniques are hit and nee, else exact.
    Auto,
    /// By their optical depths, cell by cell.
    Exact,
    /// Delta and ratio tracking, for hit and nee alone.
    Delta,
}

impl From<TrackingArg> for Tracking {
    fn from(arg: TrackingArg) -> Self {
        match arg {
            TrackingArg::Auto => Self::Auto,
            TrackingArg::Exact => Self::Exact,
            TrackingArg::Delta => Self::Delta,
        }
    }
}

/// `--layers`.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayersArg {
    /// None.
    None,
    /// Of each technique, weighted and unweighted.
    Families,
    /// Of each technique and each (s, t), weighted and unweighted.
    All,
}

impl From<LayersArg> for Layers {
    fn from(arg: LayersArg) -> Self {
        match arg {
            LayersArg::None => Self::None,
            LayersArg::Families => Self::Families,
            LayersArg::All => Self::All,
        }
    }
}

/// `tyndall compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// The image.
    #[arg(value_name = "IMAGE.exr")]
    pub image: PathBuf,
    /// What it is measured against.
    #[arg(value_name = "REFERENCE.exr")]
    pub reference: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// `tyndall report`.
#[derive(Args, Debug)]
pub struct ReportArgs {
    /// A folder of results.
    #[arg(value_name = "DIR")]
    pub dir: PathBuf,
    /// Show the images of all scenes at this exposure, in stops [default: those of the experiment file].
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = super::parse::stops)]
    pub exposure: Option<f32>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_list_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn nonsense_is_refused() {
        for line in [
            "render s --spp 0",
            "render s --spp -3",
            "render s --spp 4 --time 3s",
            "render s --time 0s",
            "render s --time soon",
            "render s --size 3",
            "render s --size 0x5",
            "render s --threads 0",
            "render s --estimator pt --techniques nee",
            "render",
            "compare a.exr",
            "run e --shard 0/4",
            "run e --shard 5/4",
            "run e --shard 2",
            "run e --tev nowhere",
            "frobnicate",
        ] {
            let words = std::iter::once("tyndall").chain(line.split(' '));
            let error = Cli::try_parse_from(words).expect_err(line);
            assert_eq!(error.exit_code(), 2, "{line}");
        }
    }

    #[test]
    fn negative_exposures_are_numbers() {
        let cli = Cli::try_parse_from(["tyndall", "render", "s", "--exposure", "-1.5"]).unwrap();
        let Command::Render(args) = cli.command else { panic!("not a render") };
        assert_eq!(args.exposure, -1.5);
    }
}
