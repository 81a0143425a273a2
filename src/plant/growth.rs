//! Ages between two derivations (Truelsen §9.1, which asks for it; ours).
//!
//! Each module of the older chain is drawn together with what it became, `done` of the way from 0 to 1:
//!
//! * kept as it was: as it is; kept with other parameters: with parameters between;
//! * became several modules: their axis is as long as the old module at 0 and as long as written at 1, and bends as it grows; what
//!   stands in brackets sprouts from nothing; a leaf that is gone shrinks away.
//!
//! So a plant at age 3 and one a moment older look alike, and so do one at almost 4 and one at 4.

use super::command::{Action, Command};
use super::module::{Chain, Module, Previous, Symbol};
use super::turtle::{Growth, Turtle};
use crate::Result;

/// What one module became.
struct Birth<'c> {
    old: Module<'c>,
    new: &'c [(Module<'c>, u64)],
    /// Nothing grows on behind it on its axis.
    is_last: bool,
}

/// Draws `chain`, which the last derivation made from `previous`, as it is when that derivation is `done` of the way.
pub(super) fn draw_between(turtle: &mut Turtle, chain: &Chain, previous: &Previous, commands: &[Command], done: f64) -> Result<()> {
    let mut modules = chain.iter().zip(0u64..);
    let mut old = previous.chain.iter().peekable();
    let mut runs = previous.runs.iter();
    let mut new = vec![];
    while let (Some(module), Some(run)) = (old.next(), runs.next()) {
        new.clear();
        new.extend(modules.by_ref().take(*run as usize));
        let is_last = old.peek().is_none_or(|next| next.symbol == Symbol::POP);
        Birth { old: module, new: &new, is_last }.draw(turtle, commands, done)?;
    }
    Ok(())
}

impl Birth<'_> {
    fn draw(&self, turtle: &mut Turtle, commands: &[Command], done: f64) -> Result<()> {
        let command = |module: &Module| &commands[module.symbol.index()];
        if let [(module, key)] = self.new
            && module.symbol == self.old.symbol
        {
            let between = |(a, b): (&f64, &f64)| a + (b - a) * done;
            let params: Vec<f64> = self.old.params.iter().zip(module.params).map(between).collect();
            return turtle.obey(command(module), Module { params: &params, ..*module }, *key, Growth::DONE);
        }
        let key = self.new.first().map_or(0, |(_, key)| *key);
        let was_leaf = command(&self.old).action == Action::Leaf;
        let becomes_leaf = self.new.iter().any(|(m, _)| command(m).action == Action::Leaf);
        let old_length = self.length(turtle, &self.old, commands);
        let new_length = self.axis_length(turtle, commands);
        if new_length == 0.0 && old_length > 0.0 || was_leaf && !becomes_leaf {
            let shrinking = Growth { length: 1.0 - done, size: if was_leaf { 1.0 - done } else { 1.0 }, angle: 1.0 };
            turtle.obey(command(&self.old), self.old, key, shrinking)?;
        }
        let axis = Growth {
            length: if new_length > 0.0 { (old_length + (new_length - old_length) * done) / new_length } else { 1.0 },
            angle: if old_length == 0.0 && self.is_last { 1.0 } else { done },
            size: if old_length > 0.0 || was_leaf { 1.0 } else { done },
        };
        let sprout = Growth { length: done, angle: 1.0, size: done };
        let mut depth = 0u32;
        for (module, key) in self.new {
            let growth = if depth == 0 { axis } else { sprout };
            turtle.obey(command(module), *module, *key, growth)?;
            match module.symbol {
                Symbol::PUSH => depth += 1,
                Symbol::POP => depth = depth.saturating_sub(1),
                _ => {}
            }
        }
        Ok(())
    }

    /// How far a module moves the turtle, before scaling.
    fn length(&self, turtle: &Turtle, module: &Module, commands: &[Command]) -> f64 {
        let command = &commands[module.symbol.index()];
        let forward = [Action::Forward, Action::Jump, Action::ForwardPlain, Action::JumpPlain].contains(&command.action);
        let args = if module.params.is_empty() { command.defaults.as_slice() } else { module.params };
        if forward { args.first().copied().unwrap_or(turtle.step_m()) } else { 0.0 }
    }

    /// The same for the new modules outside brackets.
    fn axis_length(&self, turtle: &Turtle, commands: &[Command]) -> f64 {
        let (mut depth, mut sum) = (0i64, 0.0);
        for (module, _) in self.new {
            match module.symbol {
                Symbol::PUSH => depth += 1,
                Symbol::POP => depth -= 1,
                _ if depth == 0 => sum += self.length(turtle, module, commands),
                _ => {}
            }
        }
        sum
    }
}
