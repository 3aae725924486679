//! What the commands that render have in common: threads, and Ctrl-C.

use crate::error::{Error, Result};
use crate::render::Stop;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// All was done.
    Done,
    /// It was stopped; what was there is written, marked as partial.
    Stopped,
}

impl From<&Stop> for Ending {
    fn from(stop: &Stop) -> Self {
        if stop.requested() { Self::Stopped } else { Self::Done }
    }
}

/// The exit code of a process that Ctrl-C ended, as shells have it: 128 + SIGINT.
pub const STOPPED: u8 = 130;

/// A stop that Ctrl-C (or the system's wish to end the process) asks for. The second one ends the process at once.
pub fn stop_on_interrupt() -> Result<Stop> {
    stop_saying(Some("stopping after this iteration; once more to end at once"))
}

/// As [`stop_on_interrupt`], with other words or none.
pub fn stop_saying(words: Option<&'static str>) -> Result<Stop> {
    let stop = Stop::default();
    let asked = stop.clone();
    ctrlc::set_handler(move || {
        if asked.requested() {
            std::process::exit(STOPPED.into());
        }
        asked.request();
        if let Some(words) = words {
            eprintln!("{words}");
        }
    })
    .map_err(|e| Error::usage(format!("cannot watch for Ctrl-C: {e}")))?;
    Ok(stop)
}

/// Runs `work` in a pool of so many threads, or of one a processor.
pub fn with_threads<T: Send>(threads: Option<usize>, work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    pool(threads)?.install(work)
}

/// So many threads, or one a processor.
pub fn pool(threads: Option<usize>) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
        .map_err(|e| Error::usage(format!("cannot start the threads: {e}")))
}

/// Prints to the standard output. A reader that has gone away (`| head`) is no error.
pub fn print(text: impl std::fmt::Display) -> Result<()> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    match write!(out, "{text}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::io("standard output", "write to it", &e))
        }
        _ => Ok(()),
    }
}
