//! Geometry level by level (Lluch03 §5.4): a vector with the geometry of each level, filled when a level is first asked for.
//!
//! All levels' shapes stand one after the other in one array, so that level of detail `n` is a prefix of it: drawing another level moves
//! one number.

use super::{Multichain, Step};
use crate::{Error, Result};

/// Who draws a multichain: a turtle whose state can be kept and set back.
pub trait LevelTurtle {
    /// Everything that a bracket would keep, and which shape the next one stands on.
    type State: Clone;
    /// What it draws: a bone, a mesh, …
    type Shape;

    /// A branch begins, with this many brackets open round it in the original chain. Position and heading stay.
    fn begin(&mut self, depth: u32);
    /// Reads one module: `stored` is its place in the chain at hand, `position` its place in the original chain (the same, unless the
    /// multichain came as a stream), by which noise may be keyed. Appends what it draws to `shapes`, which holds all earlier shapes.
    ///
    /// # Errors
    /// The turtle's own.
    fn read(&mut self, stored: u32, position: u32, shapes: &mut Vec<Self::Shape>) -> Result<()>;
    /// SAVE.
    fn save(&self) -> Self::State;
    /// RESTORE.
    fn restore(&mut self, state: &Self::State);
}

/// The levels of a multichain that have been drawn so far.
#[derive(Debug)]
pub struct Levels<T: LevelTurtle> {
    turtle: T,
    /// Where the turtle stood at the foot of the tree.
    foot: T::State,
    /// By the number of their SAVE.
    saved: Vec<T::State>,
    shapes: Vec<T::Shape>,
    /// Where each drawn level ends in `shapes`.
    ends: Vec<usize>,
}

impl<T: LevelTurtle> Levels<T> {
    /// Nothing is drawn yet. `turtle` stands at the foot of the tree.
    pub fn new(turtle: T) -> Self {
        Self { foot: turtle.save(), turtle, saved: vec![], shapes: vec![], ends: vec![] }
    }

    /// How many levels have been drawn.
    pub fn drawn(&self) -> usize {
        self.ends.len()
    }

    /// The turtle, for example to ask what it warns of.
    pub fn turtle(&self) -> &T {
        &self.turtle
    }

    /// Level of detail `n` of `chain`, which must be the same (or grown by further levels) on every call: the shapes of the first `n`
    /// levels in order of output. Draws what is missing; all levels for `n` beyond the last.
    ///
    /// # Errors
    /// The turtle's; the levels before the faulty one stay.
    pub fn first(&mut self, chain: &Multichain, n: usize) -> Result<&[T::Shape]> {
        let n = n.min(chain.levels());
        while self.drawn() < n {
            let (shapes, saved) = (self.shapes.len(), self.saved.len());
            if let Err(error) = chain.level(self.drawn() + 1).iter().try_for_each(|step| self.draw(step)) {
                self.shapes.truncate(shapes);
                self.saved.truncate(saved);
                return Err(error);
            }
            self.ends.push(self.shapes.len());
        }
        Ok(&self.shapes[..self.end_of(n)])
    }

    /// What level `n` adds: element `n` of the paper's vector. Nothing outside `1..=levels()`.
    ///
    /// # Errors
    /// As [`first`](Self::first).
    pub fn level(&mut self, chain: &Multichain, n: usize) -> Result<&[T::Shape]> {
        self.first(chain, n)?;
        Ok(&self.shapes[self.end_of(n.saturating_sub(1))..self.end_of(n)])
    }

    /// Where level `n`'s shapes end, if that has been drawn; of the last drawn one otherwise.
    pub fn end_of(&self, n: usize) -> usize {
        n.min(self.drawn()).checked_sub(1).map_or(0, |last| self.ends[last])
    }

    fn draw(&mut self, step: &Step) -> Result<()> {
        match step.restore {
            Some(number) => {
                let what = || format!("state {number} is restored before it is saved");
                let state = self.saved.get(number as usize).ok_or_else(|| Error::Internal { stage: "multichain", what: what() })?;
                self.turtle.restore(state);
            }
            None if self.drawn() == 0 && self.shapes.is_empty() => self.turtle.restore(&self.foot),
            None => {}
        }
        self.turtle.begin(step.depth);
        for (stored, position) in step.modules.clone().zip(step.position..) {
            self.turtle.read(stored, position, &mut self.shapes)?;
        }
        if step.save.is_some() {
            self.saved.push(self.turtle.save());
        }
        Ok(())
    }
}
