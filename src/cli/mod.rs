//! The command line: one file a subcommand. They parse, call and print.

pub mod args;
pub mod compare;
pub mod explain;
pub mod folder;
pub mod import;
pub mod info;
pub mod merge;
pub mod parse;
pub mod progress;
#[cfg(feature = "mpi")]
pub mod ranks;
pub mod render;
pub mod run;
pub mod session;
pub mod status;
pub mod techniques;

use crate::error::{Error, Result};
use crate::experiment::results::{self, Origin};
use args::{Cli, Command, CompareArgs, ReportArgs};
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory, FromArgMatches};
use session::{Ending, STOPPED, print};
use std::process::ExitCode;

/// The exit code where the user's input is wrong.
const WRONG_INPUT: u8 = 2;

/// Runs the program with the arguments of the process.
pub fn main() -> ExitCode {
    let matches = Cli::command().get_matches();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|e| e.exit());
    let given = matches.subcommand().map_or_else(Vec::new, |(_, matches)| given(matches));
    match run(&cli.command, &given) {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::Stopped) => ExitCode::from(STOPPED),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(WRONG_INPUT)
        }
    }
}

/// What stands on the command line, by the names of the fields.
fn given(matches: &ArgMatches) -> Vec<String> {
    let said = |id: &&str| matches.value_source(id) == Some(ValueSource::CommandLine);
    // Structs of arguments have names among these too, which begin with a capital.
    let own = |id: &&str| id.starts_with(char::is_lowercase);
    matches.ids().map(clap::Id::as_str).filter(own).filter(said).map(str::to_owned).collect()
}

fn run(command: &Command, given: &[String]) -> Result<Ending> {
    match command {
        Command::Run(args) => run::run(args),
        Command::Status(args) => status::run(args),
        Command::Merge(args) => merge::run(args),
        Command::Render(args) => render::run(args),
        Command::Explain(args) => explain::run(args, given),
        Command::Compare(args) => compare(args),
        Command::Info(args) => info::run(args),
        Command::Import(args) => import::run(args),
        Command::Report(args) => report(args),
        Command::Techniques => print(techniques::text()).map(|()| Ending::Done),
    }
}

fn compare(args: &CompareArgs) -> Result<Ending> {
    let comparison = compare::compare_files(&args.image, &args.reference)?;
    if args.json {
        let json = serde_json::to_string_pretty(&comparison).map_err(|e| Error::usage(e.to_string()))?;
        print(format!("{json}\n"))?;
    } else {
        print(comparison)?;
    }
    Ok(Ending::Done)
}

fn report(args: &ReportArgs) -> Result<Ending> {
    let report = crate::report::report_at(&args.dir, args.exposure)?;
    if let Some(origin) = results::read(&args.dir)?.source.filter(Origin::has_changed) {
        let here = std::env::current_dir().unwrap_or_default();
        let file = origin.file.strip_prefix(here).unwrap_or(&origin.file).display();
        eprintln!(
            "warning: {file} has changed since: `tyndall run {file}` takes that up and renders only what is missing"
        );
    }
    for problem in &report.problems {
        eprintln!("warning: {problem}");
    }
    print(format!("{}\n", report.page.display()))?;
    Ok(Ending::Done)
}
