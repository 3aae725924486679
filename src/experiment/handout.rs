//! What is left of an experiment as pieces that processes can be handed one by one, in whatever order they ask.
//!
//! A piece is a block of iterations of a run or of a reference, rendered into a file of its own ahead of those before it; or a run
//! as a whole: to put its blocks together, or where what ends it is only known on the way. A block is a function of scene, settings,
//! seed and its iterations alone, so that whoever renders it writes the same bits. Runs against the clock are handed out last, when
//! nothing else is rendered, and to one process a machine.

use super::cell::SceneContext;
use super::plan::{EstimatorPlan, Plan};
use super::reference::{Maker, Making, Truth};
use super::store::{SceneKey, Unit};
use super::work::{Got, Work};
use crate::error::Result;
use crate::render::files::Resolved;
use crate::render::{Budget, Engine, Observer, Silent, Stop};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A piece of work; scenes and estimators are numbered as in the plan.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Task {
    /// A block of a reference.
    ReferenceBlock {
        /// Of this scene.
        scene: usize,
        /// First iteration.
        first: u64,
        /// How many there are.
        count: u64,
    },
    /// A reference that the clock ends.
    Reference {
        /// Of this scene.
        scene: usize,
    },
    /// A block of a run.
    Block {
        /// In this scene.
        scene: usize,
        /// Of this estimator.
        estimator: usize,
        /// From 0.
        run: u32,
        /// First iteration.
        first: u64,
    },
    /// What is left of a run.
    Run {
        /// In this scene.
        scene: usize,
        /// Of this estimator.
        estimator: usize,
        /// From 0.
        run: u32,
    },
}

/// A task, and when it can be done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// What is to be done.
    pub task: Task,
    /// The pieces that have to be done before, by their numbers.
    pub after: Vec<usize>,
    /// Whether the clock runs: then nothing else is to be rendered on that machine.
    pub timed: bool,
}

/// What a process that asks is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// To do this piece, by its number.
    Piece(usize),
    /// To wait until another one is done.
    Wait,
    /// That nothing is left for it.
    Nothing,
}

/// Which pieces are given out and which are done.
#[derive(Clone, Debug)]
pub struct Handout {
    pieces: Vec<Piece>,
    waiting: BTreeSet<usize>,
    done: Vec<bool>,
}

impl Handout {
    /// Nothing is done yet.
    pub fn new(pieces: Vec<Piece>) -> Self {
        let (waiting, done) = ((0..pieces.len()).collect(), vec![false; pieces.len()]);
        Self { pieces, waiting, done }
    }

    /// All pieces, in the order in which they are offered.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// How many are done.
    pub fn count_done(&self) -> usize {
        self.done.iter().filter(|d| **d).count()
    }

    /// Gives the next piece out; `timed` says whether whoever asks may have one against the clock.
    pub fn next(&mut self, timed: bool) -> Next {
        let untimed_left = self.pieces.iter().zip(&self.done).any(|(p, done)| !p.timed && !done);
        let can = |i: &usize| {
            let piece = &self.pieces[*i];
            let in_turn = !piece.timed || timed && !untimed_left;
            in_turn && piece.after.iter().all(|before| self.done[*before])
        };
        if let Some(piece) = self.waiting.iter().copied().find(can) {
            self.waiting.remove(&piece);
            return Next::Piece(piece);
        }
        let may_come = self.waiting.iter().any(|i| timed || !self.pieces[*i].timed);
        if may_come { Next::Wait } else { Next::Nothing }
    }

    /// A piece is done.
    pub fn done(&mut self, piece: usize) {
        self.done[piece] = true;
    }
}

/// A process's part in it.
pub struct Hand<'a> {
    plan: &'a Plan,
    scenes: &'a [Scene],
    keys: &'a [SceneKey],
    out: &'a Path,
    cache: &'a Path,
    clock: &'a str,
    stop: &'a Stop,
    truths: BTreeMap<usize, Option<Truth>>,
    makings: BTreeMap<usize, Making>,
    /// What rendered the last block, which the next one is often of too.
    engine: Option<(Unit, Engine<'a>, Resolved)>,
}

impl<'a> Hand<'a> {
    /// With the plan's scenes and what names their contents.
    pub fn new(
        plan: &'a Plan,
        (scenes, keys): (&'a [Scene], &'a [SceneKey]),
        (out, cache): (&'a Path, &'a Path),
        clock: &'a str,
        stop: &'a Stop,
    ) -> Self {
        let (truths, makings) = (BTreeMap::new(), BTreeMap::new());
        Self { plan, scenes, keys, out, cache, clock, stop, truths, makings, engine: None }
    }

    /// What is not on disk yet.
    ///
    /// # Errors
    /// Settings that make no sense; folders that cannot be read or made.
    pub fn pieces(&mut self) -> Result<Vec<Piece>> {
        let mut pieces = Vec::new();
        for scene in 0..self.scenes.len() {
            let from = pieces.len();
            self.pieces_of_reference(scene, &mut pieces)?;
            let reference: Vec<usize> = (from..pieces.len()).collect();
            for (estimator, entry) in self.plan.estimators.iter().enumerate() {
                for run in 0..self.plan.runs {
                    self.pieces_of_run((scene, estimator, run), entry, &reference, &mut pieces)?;
                }
            }
        }
        Ok(pieces)
    }

    fn pieces_of_reference(&mut self, scene: usize, pieces: &mut Vec<Piece>) -> Result<()> {
        let Some(making) = self.maker(&mut Silent).making(
            &self.plan.scenes[scene],
            &self.scenes[scene],
            &self.keys[scene],
        )?
        else {
            return Ok(());
        };
        let mut add = |task, timed| pieces.push(Piece { task, after: Vec::new(), timed });
        match making.missing(&self.scenes[scene])? {
            None => add(Task::Reference { scene }, true),
            Some(blocks) => {
                for (first, count) in blocks {
                    add(Task::ReferenceBlock { scene, first, count }, false);
                }
            }
        }
        self.makings.insert(scene, making);
        Ok(())
    }

    fn pieces_of_run(
        &self,
        (scene, estimator, run): (usize, usize, u32),
        entry: &EstimatorPlan,
        reference: &[usize],
        pieces: &mut Vec<Piece>,
    ) -> Result<()> {
        let mut timed = entry.budget.is_timed();
        let mut after = Vec::new();
        match entry.budget {
            Budget::Seconds(_) => {}
            // It is named by its reference too, so that nothing is known of it before.
            Budget::RelMse { .. } => {
                after = reference.to_vec();
                timed |= after.iter().any(|i| pieces[*i].timed);
            }
            Budget::Spp(spp) => {
                let (unit, work) = self.unit(scene, estimator, run, None)?;
                let header = unit.peek(work.budget);
                if header.as_ref().is_some_and(|h| h.is_done(work.budget)) {
                    return Ok(());
                }
                let from = header.map_or(0, |h| h.iterations);
                let there = unit.blocks_ahead();
                let mut first = from;
                while first < spp {
                    let end = work.end_of_block(first);
                    // A run of one block needs no file for it.
                    if !there.contains(&(first, end)) && (from, spp) != (first, end) {
                        after.push(pieces.len());
                        let task = Task::Block { scene, estimator, run, first };
                        pieces.push(Piece { task, after: Vec::new(), timed: false });
                    }
                    first = end;
                }
            }
        }
        pieces.push(Piece { task: Task::Run { scene, estimator, run }, after, timed });
        Ok(())
    }

    fn maker<'o>(&self, observer: &'o mut dyn Observer) -> Maker<'o>
    where
        'a: 'o,
    {
        Maker { cache: self.cache, stop: self.stop, observer, frozen: false }
    }

    fn unit<'t>(
        &self,
        scene: usize,
        estimator: usize,
        run: u32,
        truth: Option<&'t Truth>,
    ) -> Result<(Unit, Work<'t>)>
    where
        'a: 't,
    {
        let context = SceneContext {
            plan: self.plan,
            entry: &self.plan.scenes[scene],
            scene: &self.scenes[scene],
            truth,
            out: self.out,
            key: &self.keys[scene],
            clock: self.clock,
            frozen: false,
            stop: self.stop,
        };
        context.unit(&self.plan.estimators[estimator], run)
    }

    /// Does a task. Where a stop is asked for, what is on disk is what was there before.
    ///
    /// # Errors
    /// Files that cannot be written or read.
    pub fn perform(&mut self, task: &Task, observer: &mut dyn Observer) -> Result<()> {
        match *task {
            Task::ReferenceBlock { scene, first, count } => {
                if !self.makings.contains_key(&scene) {
                    let (entry, loaded) = (&self.plan.scenes[scene], &self.scenes[scene]);
                    let making = self.maker(observer).making(entry, loaded, &self.keys[scene])?;
                    self.makings.extend(making.map(|m| (scene, m)));
                }
                let making = &self.makings[&scene];
                making.ahead(&self.scenes[scene], first, count, self.stop, observer)
            }
            Task::Reference { scene } => self.truth(scene, observer).map(drop),
            Task::Block { scene, estimator, run, first } => {
                let (unit, work) = self.unit(scene, estimator, run, None)?;
                if self.engine.as_ref().is_none_or(|(of, ..)| *of != unit) {
                    let (engine, resolved) = work.engine()?;
                    self.engine = Some((unit, engine, resolved));
                }
                let (unit, engine, resolved) = self.engine.as_mut().expect("it was made above");
                work.block(unit, engine, resolved, first)
            }
            Task::Run { scene, estimator, run } => {
                let budget = self.plan.estimators[estimator].budget;
                let measured = matches!(budget, Budget::RelMse { .. });
                if measured {
                    self.truth(scene, observer)?;
                }
                let truth = if measured { self.truths[&scene].as_ref() } else { None };
                let (unit, work) = self.unit(scene, estimator, run, truth)?;
                if !unit.peek(work.budget).is_some_and(|h| h.is_done(work.budget)) {
                    // Who else is at it will come to its end.
                    let (Got::Busy | Got::There(_)) = work.complete(&unit, "", observer)?;
                }
                Ok(())
            }
        }
    }

    /// Obtains the reference of a scene, once.
    fn truth(&mut self, scene: usize, observer: &mut dyn Observer) -> Result<()> {
        if !self.truths.contains_key(&scene) {
            let (entry, loaded) = (&self.plan.scenes[scene], &self.scenes[scene]);
            let truth = self.maker(observer).obtain(entry, loaded, &self.keys[scene])?;
            self.truths.insert(scene, truth);
        }
        Ok(())
    }

    /// What a task is called in messages.
    pub fn name(&self, task: &Task) -> String {
        let scene = |i: usize| &self.plan.scenes[i].key;
        let run_of = |s: usize, e: usize, run: u32| {
            format!("{}: {}, run {} of {}", scene(s), self.plan.estimators[e].key, run + 1, self.plan.runs)
        };
        match *task {
            Task::ReferenceBlock { scene: s, first, count } => {
                format!("{}: reference, iterations {first} to {}", scene(s), first + count)
            }
            Task::Reference { scene: s } => format!("{}: reference", scene(s)),
            Task::Block { scene, estimator, run, first } => {
                format!("{}, from iteration {first}", run_of(scene, estimator, run))
            }
            Task::Run { scene, estimator, run } => run_of(scene, estimator, run),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(number: u32, after: &[usize], timed: bool) -> Piece {
        let task = Task::Run { scene: 0, estimator: 0, run: number };
        Piece { task, after: after.to_vec(), timed }
    }

    #[test]
    fn pieces_come_in_their_order_and_timed_ones_last() {
        let pieces = [(&[][..], true), (&[], false), (&[], false), (&[1, 2], false)];
        let numbered = (0..).zip(pieces);
        let mut handout = Handout::new(numbered.map(|(i, (after, timed))| piece(i, after, timed)).collect());
        assert_eq!([true, false].map(|timed| handout.next(timed)), [1, 2].map(Next::Piece));
        assert_eq!(handout.next(true), Next::Wait, "what puts them together needs both");
        handout.done(2);
        assert_eq!(handout.next(false), Next::Wait);
        handout.done(1);
        assert_eq!(handout.next(false), Next::Piece(3));
        assert_eq!(handout.next(true), Next::Wait, "the clock does not run beside others");
        assert_eq!(handout.next(false), Next::Nothing, "what is left is against the clock");
        handout.done(3);
        assert_eq!((handout.next(true), handout.next(true)), (Next::Piece(0), Next::Nothing));
        handout.done(0);
        assert_eq!(handout.count_done(), handout.pieces().len());
    }
}
