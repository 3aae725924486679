//! `mpirun -n 4 tyndall run`: rank 0 hands out what is left of an experiment piece by piece ([`crate::experiment::handout`]), all
//! ranks render, rank 0 measures. Images go through the folder of results, which all ranks have to see; messages say only who
//! does what. A rank that dies ends the run, since mpirun ends the others: what is on disk is kept, and the same
//! command goes on.
//!
//! MPI is called from the main thread alone. On rank 0 that one answers the others, and rendering has a thread of its own.

use super::args::RunArgs;
use super::folder::announce;
use super::progress::{Progress, clock};
use super::run::{alone, open, show};
use super::session::{Ending, STOPPED, pool, stop_saying};
use crate::error::{Error, Result};
use crate::experiment::handout::{Hand, Handout, Next, Task};
use crate::experiment::machine::{processors, usable};
use crate::experiment::plan::Plan;
use crate::experiment::run::{self, Options, Part, load_scenes};
use crate::experiment::store::{FOLDER, SceneKey, lock};
use crate::film::output::write_bytes;
use crate::render::files::{RENDERING, prepare_folder};
use crate::render::{Budget, Observer, Stop};
use crate::scene::Scene;
use ::mpi::topology::SimpleCommunicator;
use ::mpi::traits::{Communicator, Destination, MatchedReceiveVec, Source};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Between looks at messages: a rank that waits leaves the processor to those that render.
const LOOK: Duration = Duration::from_millis(2);
/// Between lines about the progress.
const INTERVAL: Duration = Duration::from_secs(10);
/// How long ranks get to end their iterations where a stop is asked for.
const GRACE: Duration = Duration::from_secs(3);
/// How long a rank looks for what rank 0 wrote: file systems over networks take their time.
const PATIENCE: Duration = Duration::from_secs(10);
/// What rank 0 writes, and the others look for.
const TOKEN: &str = "ranks";

/// Whether a launcher of MPI started this process.
pub fn are_launched() -> bool {
    ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"].iter().any(|name| std::env::var_os(name).is_some())
}

/// What rank 0 tells the others.
#[derive(Serialize, Deserialize)]
enum Order {
    /// To load the experiment; there is a file with these words in the folder of results.
    Load { token: String },
    /// To do this piece.
    Piece { piece: usize, task: Task, timed: bool },
    /// That nothing is left.
    Bye,
}

/// What a rank tells rank 0.
#[derive(Serialize, Deserialize)]
enum Report {
    /// It is ready, and would like something to do.
    Ready(Place),
    /// This piece is done.
    Done { piece: usize },
    /// Something is wrong.
    Failed { message: String },
    /// A stop was asked for.
    Stopped,
}

/// Where a rank runs.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Place {
    /// Names the code that renders.
    rendering: String,
    /// What its times depend on.
    clock: String,
    /// Whether it is the first one on its machine.
    first: bool,
    /// With which it renders beside others.
    threads: usize,
}

/// Runs the experiment with all ranks.
///
/// # Errors
/// As [`super::run::run`]; ranks that do not see the results, or were built from other code.
pub fn run(args: &RunArgs) -> Result<Ending> {
    let Some((universe, _)) = ::mpi::initialize_with_threading(::mpi::Threading::Funneled) else {
        return Err(Error::usage("MPI cannot be initialised: it was before"));
    };
    let world = universe.world();
    if world.size() == 1 {
        return alone(args);
    }
    let crew = Crew::new(args, &world)?;
    if world.rank() > 0 {
        return follow(args, &world, &crew);
    }
    let result = lead(args, &world, &crew);
    for rank in 1..world.size() {
        send(&world, rank, &Order::Bye);
    }
    result
}

/// The threads of a rank.
struct Crew {
    /// Beside the other ranks of the machine.
    shared: rayon::ThreadPool,
    /// Where it is the only one that renders.
    whole: rayon::ThreadPool,
    place: Place,
}

impl Crew {
    fn new(args: &RunArgs, world: &SimpleCommunicator) -> Result<Self> {
        let node = world.split_shared(world.rank());
        let mine = usable();
        // mpirun may have bound this rank to some of them; else they are shared out.
        let threads =
            args.of.threads.unwrap_or_else(|| mine.min((processors() / node.size() as usize).max(1)));
        let (shared, whole) = (pool(Some(threads))?, pool(args.of.threads)?);
        if world.rank() == 0 && args.of.threads.is_none() && mine < processors() {
            eprintln!(
                "rank 0 may use {mine} of {} processors: timed runs use no more (mpirun --bind-to none gives them all)",
                processors()
            );
        }
        let place = Place {
            rendering: RENDERING.to_owned(),
            clock: whole.install(run::clock),
            first: node.rank() == 0,
            threads,
        };
        Ok(Self { shared, whole, place })
    }
}

/// The experiment as every rank loads it.
struct Loaded {
    plan: Plan,
    scenes: Vec<Scene>,
    keys: Vec<SceneKey>,
    out: PathBuf,
    cache: PathBuf,
}

impl Loaded {
    fn new(args: &RunArgs) -> Result<Self> {
        let (plan, out, cache) = open(&args.of)?;
        let scenes = load_scenes(&plan)?;
        let keys = scenes.iter().map(SceneKey::new).collect::<Result<_>>()?;
        Ok(Self { plan, scenes, keys, out, cache })
    }

    fn hand<'a>(&'a self, crew: &'a Crew, stop: &'a Stop) -> Hand<'a> {
        let scenes = (&self.scenes[..], &self.keys[..]);
        Hand::new(&self.plan, scenes, (&self.out, &self.cache), &crew.place.clock, stop)
    }

    fn token(&self) -> PathBuf {
        self.out.join(FOLDER).join(TOKEN)
    }
}

/// Warnings of a rank; how far it is, rank 0 tells.
struct Notes(i32);

impl Observer for Notes {
    fn begin(&mut self, _: &str, _: Budget) {}
    fn advance(&mut self, _: u64, _: f64) {}
    fn end(&mut self) {}
    fn note(&mut self, line: &str) {
        eprintln!("rank {}: {line}", self.0);
    }
}

/// Does a piece with the threads for it.
fn perform(hand: &mut Hand, crew: &Crew, stop: &Stop, rank: i32, order: &Order) -> Option<Report> {
    let Order::Piece { piece, task, timed } = order else { return None };
    let threads = if *timed { &crew.whole } else { &crew.shared };
    let done = threads.install(|| hand.perform(task, &mut Notes(rank)));
    Some(match done {
        _ if stop.requested() => Report::Stopped,
        Ok(()) => Report::Done { piece: *piece },
        Err(e) => Report::Failed { message: e.to_string() },
    })
}

fn send(world: &SimpleCommunicator, rank: i32, message: &impl Serialize) {
    let bytes = serde_json::to_vec(message).expect("messages have a JSON form");
    world.process_at_rank(rank).send(&bytes[..]);
}

fn parse<T: for<'a> Deserialize<'a>>(bytes: &[u8]) -> Result<T> {
    serde_json::from_slice(bytes).map_err(|e| {
        Error::usage(format!(
            "a message of another rank makes no sense ({e}): all have to be the same program"
        ))
    })
}

/// A rank that does what rank 0 says.
fn follow(args: &RunArgs, world: &SimpleCommunicator, crew: &Crew) -> Result<Ending> {
    let stop = stop_saying(None)?;
    let root = world.process_at_rank(0);
    let order = || loop {
        if let Some(message) = root.immediate_matched_probe() {
            return parse::<Order>(&message.matched_receive_vec::<u8>().0);
        }
        std::thread::sleep(LOOK);
    };
    let Order::Load { token } = order()? else { return Ok(Ending::Done) };
    let loaded = match Loaded::new(args).and_then(|loaded| sees(&loaded, &token).map(|()| loaded)) {
        Ok(loaded) => loaded,
        Err(e) => {
            send(world, 0, &Report::Failed { message: e.to_string() });
            // Rank 0 says it, and ends all.
            while !matches!(order()?, Order::Bye) {}
            return Ok(Ending::Done);
        }
    };
    let mut hand = loaded.hand(crew, &stop);
    send(world, 0, &Report::Ready(crew.place.clone()));
    while let Some(report) = perform(&mut hand, crew, &stop, world.rank(), &order()?) {
        send(world, 0, &report);
    }
    Ok(Ending::from(&stop))
}

/// Looks for what rank 0 wrote into the folder of results.
fn sees(loaded: &Loaded, token: &str) -> Result<()> {
    let (path, start) = (loaded.token(), Instant::now());
    while !std::fs::read_to_string(&path).is_ok_and(|found| found == token) {
        if start.elapsed() > PATIENCE {
            let message =
                "rank 0 wrote this file and it is not to be seen here: all ranks need the same file system";
            return Err(Error::file(&path, message));
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    Ok(())
}

/// Rank 0: hands out, renders too, and measures.
fn lead(args: &RunArgs, world: &SimpleCommunicator, crew: &Crew) -> Result<Ending> {
    if args.shard.is_some() || args.tev.is_some() {
        return Err(Error::usage("with several ranks there is neither --shard nor --tev"));
    }
    let stop = stop_saying(Some(
        "told to stop (mpirun does so where a rank died): what is done is kept, and the same command goes on from there",
    ))?;
    let loaded = Loaded::new(args)?;
    announce(&args.of, &loaded.plan, &loaded.out);
    let cells = loaded.out.join(FOLDER);
    prepare_folder(&cells)?;
    let Some(_lock) = lock(&cells)? else {
        return Err(Error::file(
            &loaded.out,
            "other ranks are at these results: wait for them, or give --out",
        ));
    };
    let token = format!("{} {:?}", std::process::id(), std::time::SystemTime::now());
    write_bytes(&loaded.token(), token.as_bytes())?;
    for rank in 1..world.size() {
        send(world, rank, &Order::Load { token: token.clone() });
    }
    let pieces = crew.whole.install(|| loaded.hand(crew, &stop).pieces())?;
    let (orders, inbox) = channel();
    let (outbox, reports) = channel();
    let ended = std::thread::scope(|scope| {
        scope.spawn(|| render(&loaded, crew, &stop, inbox, outbox));
        let mut table = Table::new(world, crew, Handout::new(pieces), orders, reports);
        table.serve(&stop)
    });
    let _ = std::fs::remove_file(loaded.token());
    if ended? == Ending::Stopped {
        eprintln!("stopped; what is done is in {}", loaded.out.display());
        world.abort(STOPPED.into());
    }
    finish(&loaded, crew, &stop)
}

/// Renders on rank 0.
fn render(loaded: &Loaded, crew: &Crew, stop: &Stop, orders: Receiver<Order>, reports: Sender<Report>) {
    let mut hand = loaded.hand(crew, stop);
    for order in orders {
        let Some(report) = perform(&mut hand, crew, stop, 0, &order) else { return };
        if reports.send(report).is_err() {
            return;
        }
    }
}

/// Measures what is there, which is all of it, and writes the page.
fn finish(loaded: &Loaded, crew: &Crew, stop: &Stop) -> Result<Ending> {
    let Loaded { plan, out, cache, .. } = loaded;
    let options = Options { out, cache, stop, part: Part::All };
    let results = crew.whole.install(|| run::run(plan, &options, &mut Progress::new()))?;
    show(Path::new(out), &results)?;
    Ok(Ending::from(stop))
}

/// Who does what.
struct Table<'a> {
    world: &'a SimpleCommunicator,
    handout: Handout,
    orders: Sender<Order>,
    reports: Receiver<Report>,
    /// By rank, once it is ready: rank 0 always is.
    places: Vec<Option<Place>>,
    /// Ranks without anything to do.
    idle: VecDeque<i32>,
    /// Ranks that are at something.
    busy: usize,
    failed: Option<Error>,
    start: Instant,
    last_line: Instant,
}

impl<'a> Table<'a> {
    fn new(
        world: &'a SimpleCommunicator,
        crew: &Crew,
        handout: Handout,
        orders: Sender<Order>,
        reports: Receiver<Report>,
    ) -> Self {
        let mut places = vec![None; world.size() as usize];
        places[0] = Some(crew.place.clone());
        let (start, last_line) = (Instant::now(), Instant::now());
        eprintln!(
            "{} ranks, {} threads on rank 0: {} pieces are left",
            world.size(),
            crew.place.threads,
            handout.pieces().len()
        );
        let busy = world.size() as usize - 1;
        let idle = VecDeque::from([0]);
        Self { world, handout, orders, reports, places, idle, busy, failed: None, start, last_line }
    }

    /// Hands out until nothing is left, something is wrong or a stop is asked for.
    fn serve(&mut self, stop: &Stop) -> Result<Ending> {
        let mut asked: Option<Instant> = None;
        loop {
            while let Some((rank, report)) = self.next_report()? {
                self.take(rank, report, stop);
            }
            if stop.requested() {
                let since = *asked.get_or_insert_with(Instant::now);
                if self.busy == 0 || since.elapsed() > GRACE {
                    return Ok(Ending::Stopped);
                }
            } else if self.failed.is_none() {
                self.feed();
            }
            if self.busy == 0 && !stop.requested() {
                return self.failed.take().map_or(Ok(Ending::Done), Err);
            }
            std::thread::sleep(LOOK);
        }
    }

    fn next_report(&self) -> Result<Option<(i32, Report)>> {
        match self.reports.try_recv() {
            Ok(report) => return Ok(Some((0, report))),
            Err(TryRecvError::Disconnected) => return Err(Error::usage("the rendering of rank 0 broke off")),
            Err(TryRecvError::Empty) => {}
        }
        let Some(message) = self.world.any_process().immediate_matched_probe() else { return Ok(None) };
        let (bytes, status) = message.matched_receive_vec::<u8>();
        Ok(Some((status.source_rank(), parse(&bytes)?)))
    }

    fn take(&mut self, rank: i32, report: Report, stop: &Stop) {
        self.busy -= 1;
        self.idle.push_back(rank);
        match report {
            Report::Ready(place) if place.rendering != RENDERING => {
                self.fail(rank, "was built from other code than rank 0: all have to be the same program");
            }
            Report::Ready(place) => {
                let here = self.places[0].as_ref().map(|p| &p.clock);
                if place.first && here != Some(&place.clock) && self.timed_left() {
                    eprintln!(
                        "rank {rank} is on another kind of machine ({}): it takes no part in timed runs",
                        place.clock
                    );
                }
                self.places[rank as usize] = Some(place);
            }
            Report::Done { piece } => {
                self.handout.done(piece);
                self.say();
            }
            Report::Failed { message } => self.fail(rank, &message),
            Report::Stopped => stop.request(),
        }
    }

    fn fail(&mut self, rank: i32, message: &str) {
        if self.failed.is_none() {
            self.failed = Some(Error::usage(format!("rank {rank}: {message}")));
            if self.busy > 0 {
                eprintln!("rank {rank} cannot go on: the others end what they are at");
            }
        }
    }

    fn timed_left(&self) -> bool {
        self.handout.pieces().iter().any(|p| p.timed)
    }

    /// Gives those that have nothing to do something, as far as there is something for them.
    fn feed(&mut self) {
        for _ in 0..self.idle.len() {
            let Some(rank) = self.idle.pop_front() else { return };
            let here = self.places[0].as_ref().map(|p| p.clock.clone());
            let may = |p: &Place| p.first && Some(&p.clock) == here.as_ref();
            let timed = self.places[rank as usize].as_ref().is_some_and(may);
            let Next::Piece(piece) = self.handout.next(timed) else {
                self.idle.push_back(rank);
                continue;
            };
            let given = &self.handout.pieces()[piece];
            let order = Order::Piece { piece, task: given.task.clone(), timed: given.timed };
            if rank == 0 {
                self.orders.send(order).expect("the thread that renders listens");
            } else {
                send(self.world, rank, &order);
            }
            self.busy += 1;
        }
    }

    fn say(&mut self) {
        let (done, all) = (self.handout.count_done(), self.handout.pieces().len());
        if self.last_line.elapsed() >= INTERVAL || done == all {
            self.last_line = Instant::now();
            let seconds = self.start.elapsed().as_secs_f64();
            let left = seconds * (all - done) as f64 / done as f64;
            eprintln!("{done} of {all} pieces, {}, about {} left", clock(seconds), clock(left));
        }
    }
}
