//! Geometry level by level (Lluch03 §5.4): a vector with the geometry of each level, filled when a level is first asked for.
//!
//! The turtle keeps what it draws in order of output, and the vector says where each level ends in it. So level of detail `n` is a prefix,
//! and drawing another level moves one number.

use super::{Multichain, Step};
use crate::{Error, Result};

/// Who draws a multichain: a turtle whose state can be kept and set back.
pub trait LevelTurtle {
    /// Everything that a bracket would keep, and what the next wood stands on.
    type State: Clone;
    /// How much has been drawn.
    type Mark: Copy;

    /// A branch begins, or goes on after others, behind this many `[` of the original chain. They will not be closed: what follows a
    /// branch is a RESTORE.
    fn begin(&mut self, brackets: u32);
    /// Reads one module: `stored` is its place in the chain at hand, `position` its place in the original chain (the same, unless the
    /// multichain came as a stream), by which noise may be keyed.
    ///
    /// # Errors
    /// The turtle's own.
    fn read(&mut self, stored: u32, position: u32) -> Result<()>;
    /// SAVE.
    fn save(&self) -> Self::State;
    /// RESTORE.
    fn restore(&mut self, state: &Self::State);
    /// How much has been drawn so far.
    fn mark(&self) -> Self::Mark;
    /// Forgets what has been drawn since.
    fn rewind(&mut self, mark: Self::Mark);
}

/// The levels of a multichain that have been drawn so far.
#[derive(Debug)]
pub struct Levels<T: LevelTurtle> {
    turtle: T,
    /// Where the turtle stood at the foot of the tree.
    foot: T::State,
    /// By the number of their SAVE.
    saved: Vec<T::State>,
    /// How much had been drawn before level 1, and after each level.
    marks: Vec<T::Mark>,
}

impl<T: LevelTurtle> Levels<T> {
    /// Nothing is drawn yet. `turtle` stands at the foot of the tree.
    pub fn new(turtle: T) -> Self {
        Self { foot: turtle.save(), marks: vec![turtle.mark()], turtle, saved: vec![] }
    }

    /// How many levels have been drawn.
    pub fn drawn(&self) -> usize {
        self.marks.len() - 1
    }

    /// The turtle, with all that it has drawn.
    pub fn turtle(&self) -> &T {
        &self.turtle
    }

    /// How much level of detail `n` is of what the turtle has drawn: its first `n` levels. Draws what is missing; all levels for `n` beyond
    /// the last. `chain` must be the same on every call, or grown by whole levels.
    ///
    /// # Errors
    /// The turtle's; the levels before the faulty one stay.
    pub fn first(&mut self, chain: &Multichain, n: usize) -> Result<T::Mark> {
        let n = n.min(chain.levels());
        while self.drawn() < n {
            let (mark, saved) = (self.turtle.mark(), self.saved.len());
            if let Err(error) = chain.level(self.drawn() + 1).iter().enumerate().try_for_each(|(s, step)| self.draw(s, step)) {
                self.turtle.rewind(mark);
                self.saved.truncate(saved);
                return Err(error);
            }
            self.marks.push(self.turtle.mark());
        }
        Ok(self.marks[n])
    }

    /// Draws step `s` of the next level.
    fn draw(&mut self, s: usize, step: &Step) -> Result<()> {
        let missing =
            |number| Error::Internal { stage: "multichain", what: format!("state {number} is restored before it is saved") };
        match step.restore {
            Some(number) => self.turtle.restore(self.saved.get(number as usize).ok_or_else(|| missing(number))?),
            None if s == 0 => self.turtle.restore(&self.foot),
            None => {}
        }
        self.turtle.begin(step.brackets);
        for (stored, position) in step.modules.clone().zip(step.position..) {
            self.turtle.read(stored, position)?;
        }
        if step.save.is_some() {
            self.saved.push(self.turtle.save());
        }
        Ok(())
    }
}
