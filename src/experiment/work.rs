//! Renders a run block by block, from where it was left.
//!
//! A run is cut into blocks of iterations at places that depend on the image's size alone: at 16, 32, 64 … and then at even
//! distances. Each block is rendered into an empty film, which is added to those before it and written down
//! ([`super::store`]). So a run that was killed and goes on is the same to the bit as one in one go, and what is lost is the block that
//! was under way. Where the clock or the error ends a run, the number of iterations is written down with the state, and
//! does not change any more. A run that is asked for more than it was starts from its last state.

use super::machine::now;
use super::metrics::Metric;
use super::reference::Truth;
use super::store::{Held, Snapshot, State, Unit};
use crate::error::Result;
use crate::film::{Film, Image};
use crate::render::files::Resolved;
use crate::render::{Budget, Engine, Observer, Outcome, Stop};
use crate::scene::Scene;
use crate::transport::settings::Settings;
use std::time::Instant;

/// Iterations of the first block.
const FIRST_BLOCK: u64 = 16;
/// Samples of the longest block: iterations times pixels.
const LONGEST_BLOCK: u64 = 1 << 24;
/// A relMSE to be reached is looked at this many times while the number of iterations doubles.
const LOOKS: u64 = 16;

/// The end of the block that iteration `at` lies in, in an image of so many pixels.
pub fn block_end(at: u64, pixels: usize) -> u64 {
    let most = LONGEST_BLOCK / pixels.max(1) as u64;
    // A power of two, so that every power of two from the first block on ends a block.
    let longest = 1u64 << most.max(FIRST_BLOCK).ilog2();
    let doubled = (at + 1).next_power_of_two().max(FIRST_BLOCK);
    doubled.min((at / longest + 1) * longest)
}

/// Iterations after `at` until an image is kept.
fn until_snapshot(at: u64) -> u64 {
    (at + 1).next_power_of_two() - at
}

/// Whether the error is looked at after so many iterations.
fn is_look(iterations: u64) -> bool {
    iterations.is_multiple_of((1u64 << iterations.max(1).ilog2()).div_ceil(LOOKS))
}

/// The relMSE of an image less what the reference's noise adds to it.
///
/// # Errors
/// Images that cannot be compared.
pub fn relmse(image: &Image, truth: &Truth) -> Result<f64> {
    without_noise(Metric::RelMse, image, truth)
}

/// A metric of an image less what the reference's noise adds to it, where that is known.
///
/// # Errors
/// Images that cannot be compared.
pub fn without_noise(metric: Metric, image: &Image, truth: &Truth) -> Result<f64> {
    Ok(metric.measure(image, &truth.image)?.value - truth.noise(metric)?.unwrap_or(0.0))
}

/// A run to be rendered.
pub struct Work<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The scene file as the experiment names it.
    pub file: &'a str,
    /// With radii and counts as they were asked for.
    pub settings: Settings,
    /// How far.
    pub budget: Budget,
    /// What a relMSE is measured against.
    pub truth: Option<&'a Truth>,
    /// To stop early.
    pub stop: &'a Stop,
}

/// What came of it.
pub enum Got {
    /// Another process is at it.
    Busy,
    /// It was there, or was rendered; marked as partial where it was stopped, and then the block under way is not on disk.
    There(Box<State>),
}

impl<'a> Work<'a> {
    /// The state at the end of the budget, if it is on disk.
    pub fn find(&self, unit: &Unit) -> Option<State> {
        // The header tells in a moment what is not there.
        unit.peek(self.budget).filter(|h| h.is_done(self.budget))?;
        let empty = Film::new(&self.scene.camera, &self.settings);
        unit.load(self.budget, &empty, &mut |_| ()).filter(|s| s.is_done(self.budget))
    }

    /// The state at the end of the budget, rendered as far as it is not there.
    ///
    /// # Errors
    /// Settings that make no sense, and states that cannot be written.
    pub fn complete(&self, unit: &Unit, name: &str, observer: &mut dyn Observer) -> Result<Got> {
        let Some(held) = unit.lock()? else { return Ok(Got::Busy) };
        let empty = Film::new(&self.scene.camera, &self.settings);
        // Another process may have come to the end since.
        let found = unit.load(self.budget, &empty, &mut |line| observer.note(line));
        let found = self.take_over(&held, found, &empty)?;
        if let Some(state) = found.as_ref().filter(|s| s.is_done(self.budget)) {
            return Ok(Got::There(Box::new(state.clone())));
        }
        let there = found.as_ref().map_or(0, |s| s.outcome.film.iterations());
        let from = if there > 0 { format!(", from {there} spp") } else { String::new() };
        observer.begin(&format!("{name}{from}"), self.budget);
        let state = self.render(&held, found, &empty, observer);
        observer.end();
        Ok(Got::There(Box::new(state?)))
    }

    /// Blocks that were rendered ahead ([`Self::block`]) and come next are added to what was found; these are then in a
    /// state on disk.
    fn take_over(&self, held: &Held, mut found: Option<State>, empty: &Film) -> Result<Option<State>> {
        let Budget::Spp(spp) = self.budget else { return Ok(found) };
        let mut added = false;
        loop {
            let at = found.as_ref().map_or(0, |s| s.outcome.film.iterations());
            let ahead = if at < spp { held.unit().ahead(at, self.end_of_block(at), empty) } else { None };
            let Some(mut block) = ahead else { break };
            let mut state = match found.map(taken_up) {
                None => block,
                Some(mut state) => {
                    state.outcome.append(&mut block.outcome);
                    // These sort as texts.
                    state.rendered = state.rendered.max(block.rendered);
                    state
                }
            };
            let (iterations, seconds) = (state.outcome.film.iterations(), state.outcome.seconds);
            if iterations == spp {
                state.ended = Some(self.budget);
            } else if iterations.is_power_of_two() {
                let image = state.outcome.film.image();
                state.snapshots.push(Snapshot { iterations, seconds, image });
            }
            (found, added) = (Some(state), true);
        }
        if let Some(state) = found.as_ref().filter(|_| added) {
            held.save(state)?;
        }
        Ok(found)
    }

    /// The end of the block that iteration `at` lies in, or of the budget, where that comes first.
    pub fn end_of_block(&self, at: u64) -> u64 {
        let crop = self.scene.camera.crop();
        let end = block_end(at, crop.width() as usize * crop.height() as usize);
        if let Budget::Spp(spp) = self.budget { end.min(spp) } else { end }
    }

    /// What renders this run, and its settings with radii and counts as they were chosen.
    ///
    /// # Errors
    /// Settings that make no sense.
    pub fn engine(&self) -> Result<(Engine<'a>, Resolved)> {
        let start = Instant::now();
        let settings = self.settings.pinned(self.scene);
        let chosen = start.elapsed().as_secs_f64();
        let mut engine = Engine::new(self.scene, settings)?;
        engine.setup += chosen;
        Ok((engine, Resolved::new(self.file, self.scene, &settings)))
    }

    /// Renders the block that starts with iteration `first` ahead of those before it, into a file of its own. Needs no
    /// lock: whoever renders the same block writes the same. Nothing is written where it was stopped.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn block(&self, unit: &Unit, engine: &mut Engine, resolved: &Resolved, first: u64) -> Result<()> {
        let mut outcome = engine.nothing_yet();
        if first > 0 {
            // What it took to set up is in the first block.
            (outcome.seconds, outcome.setup) = (0.0, 0.0);
        }
        let resolved = resolved.clone();
        let mut block = State { outcome, resolved, snapshots: Vec::new(), ended: None, rendered: None };
        let end = self.end_of_block(first);
        let mut at = first;
        while at < end {
            if self.stop.requested() {
                return Ok(());
            }
            engine.iterations(at, until_snapshot(at).min(end - at), &mut block.outcome);
            at = first + block.outcome.film.iterations();
            // Powers of two within a block are in the first one; who adds it to the others sees to its end.
            if at.is_power_of_two() && at < end {
                let Outcome { film, seconds, .. } = &block.outcome;
                let snapshot = Snapshot { iterations: at, seconds: *seconds, image: film.image() };
                block.snapshots.push(snapshot);
            }
        }
        block.rendered = Some(now());
        unit.save_ahead(first, end, &block)
    }

    fn render(
        &self,
        held: &Held,
        found: Option<State>,
        empty: &Film,
        observer: &mut dyn Observer,
    ) -> Result<State> {
        let (mut engine, resolved) = self.engine()?;
        let mut block = engine.nothing_yet();
        let mut state = match found {
            Some(state) => taken_up(state),
            None => {
                let outcome = block.clone();
                State { outcome, resolved, snapshots: Vec::new(), ended: None, rendered: None }
            }
        };
        // What it took to set up is in the first state.
        (block.seconds, block.setup) = (0.0, 0.0);
        let pixels = block.film.size().0 * block.film.size().1;
        while state.ended.is_none() && self.goes_on(&state.outcome, &block) {
            if self.stop.requested() {
                state.outcome.append(&mut block);
                (state.outcome.partial, state.rendered) = (true, Some(now()));
                return Ok(state);
            }
            let at = state.outcome.film.iterations() + block.film.iterations();
            let room = self.budget.room(state.outcome.spent() + block.spent());
            let most = room.min(until_snapshot(at)).min(block_end(at, pixels) - at);
            engine.iterations(at, most, &mut block);
            let done = state.outcome.film.iterations() + block.film.iterations();
            let seconds = state.outcome.seconds + block.seconds;
            observer.advance(done, seconds);
            observer.look(&|| {
                let mut film = state.outcome.film.clone();
                film.append(&block.film);
                film
            });
            let reached = self.is_reached(&state.outcome, &block)?;
            if reached || !self.goes_on(&state.outcome, &block) {
                state.ended = Some(self.budget);
            }
            if state.ended.is_none() && done.is_power_of_two() {
                let image = state.outcome.film.image_with(&block.film);
                state.snapshots.push(Snapshot { iterations: done, seconds, image });
            }
            if state.ended.is_some() || done == block_end(at, pixels) {
                state.outcome.append(&mut block);
                state.rendered = Some(now());
                held.save(&state)?;
                state = self.take_over(held, Some(state), empty)?.expect("what was there is there");
            }
        }
        observer.last(&|| state.outcome.film.clone());
        Ok(state)
    }

    fn goes_on(&self, before: &Outcome, block: &Outcome) -> bool {
        self.budget.goes_on(before.spent() + block.spent())
    }

    /// Whether the relMSE is reached that ends it.
    fn is_reached(&self, before: &Outcome, block: &Outcome) -> Result<bool> {
        let Budget::RelMse { target, .. } = self.budget else { return Ok(false) };
        let Some(truth) = self.truth else { return Ok(false) };
        if !is_look(before.film.iterations() + block.film.iterations()) {
            return Ok(false);
        }
        Ok(relmse(&before.film.image_with(&block.film), truth)? <= target)
    }
}

/// A state from which more is asked for than it was made for.
fn taken_up(mut state: State) -> State {
    let (iterations, seconds) = (state.outcome.film.iterations(), state.outcome.seconds);
    // Its end is now on the way.
    if state.ended.take().is_some() && iterations.is_power_of_two() {
        let image = state.outcome.film.image();
        state.snapshots.push(Snapshot { iterations, seconds, image });
    }
    state
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_end_at_powers_of_two_and_are_not_too_long() {
        for pixels in [1, 64, 512 * 512, 1 << 20, 1 << 26] {
            let mut ends = vec![0];
            while ends[ends.len() - 1] < 5000 {
                let at = ends[ends.len() - 1];
                let end = block_end(at, pixels);
                assert!(end > at && (end - at <= 16 || (end - at) * pixels as u64 <= LONGEST_BLOCK));
                assert!((at..end).all(|i| block_end(i, pixels) == end), "the same from within");
                ends.push(end);
            }
            assert!((4..12).all(|k| ends.contains(&(1 << k))), "{pixels}: {ends:?}");
        }
    }

    #[test]
    fn the_error_is_looked_at_often_enough() {
        let looks: Vec<u64> = (1..=70).filter(|n| is_look(*n)).collect();
        assert!((1..=32).all(|n| looks.contains(&n)));
        assert_eq!(looks.iter().filter(|n| **n > 32).copied().collect::<Vec<_>>()[..3], [34, 36, 38]);
        assert!(looks.contains(&64) && looks.contains(&68) && !looks.contains(&66));
    }
}
