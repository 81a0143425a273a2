//! L-systems: symbols, an axiom, and rules that rewrite modules in parallel (Lluch03 §3.1; Truelsen §3.1, §3.3).
//!
//! ```text
//! define R = 0.7                      # a number, for every expression below
//! symbols B                           # a terminal without a meaning for the turtle
//! ignore + -                          # not seen by contexts
//! command X = F(0.1)                  # what the turtle does at X
//! turtle turn_deg = 25                # a parameter of the turtle
//! age 6                               # derivations when nobody asks for another number
//! axiom A(1, 0.1)
//! A(l,w) : l > 0.1 -> F(l)[+(30)A(l*0.8, w*R)] : 0.6     # predecessor : condition -> successor : likelihood
//! B < A(l,w) > C(x) -> B                                 # between a left and a right context
//! ```
//!
//! A name is one letter with the digits behind it, one digit, one sign, or a longer word that `symbols` declares. Rules that fit the
//! same module: contexts go before none, then the order of the text. Likelihoods are chances: where they sum to less than 1, the rest
//! leaves the module as it is, or goes to a later rule without likelihood.

mod build;
mod cursor;
mod expr;
mod expr_parser;
mod text;
mod xml;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

pub(super) use build::{SLACK, too_likely};
pub(super) use expr::{Env, Expr};

use cursor::Place;

use super::command::Command;
use super::module::{Alphabet, Chain, Symbol};
use super::turtle::TurtleParams;
use crate::{Error, Result, Warning};

/// An L-system, checked: what it can make, it makes without surprises.
#[derive(Debug, Clone)]
pub struct Grammar {
    pub(super) title: String,
    pub(super) axiom: Chain,
    /// Sorted by symbol, then by precedence.
    pub(super) rules: Vec<Rule>,
    /// Which rules rewrite a symbol.
    pub(super) of_symbol: Vec<Range<usize>>,
    /// Which symbols contexts do not see.
    pub(super) ignored: Vec<bool>,
    pub(super) commands: BTreeMap<String, Command>,
    /// Names of more than one letter.
    pub(super) words: Vec<String>,
    pub(super) turtle: TurtleParams,
    pub(super) initial_age: Option<f64>,
    pub(super) warnings: Vec<Warning>,
}

/// One production.
#[derive(Debug, Clone)]
pub(super) struct Rule {
    pub place: Place,
    pub symbol: Symbol,
    /// What must stand before, nearest last; no brackets.
    pub left: Vec<Symbol>,
    /// What must stand behind, nearest first; brackets pair.
    pub right: Vec<Symbol>,
    pub condition: Option<Expr>,
    pub likelihood: Option<Expr>,
    pub successor: Vec<Symbol>,
    /// The successor's parameters, one module's behind the other's.
    pub arguments: Vec<Expr>,
}

impl Rule {
    /// Fits every module of its symbol, always.
    pub fn is_unconditional(&self) -> bool {
        !self.has_context() && self.condition.is_none() && self.likelihood.is_none()
    }

    pub fn has_context(&self) -> bool {
        !(self.left.is_empty() && self.right.is_empty())
    }

    /// How many sides of context it asks for: the more, the earlier it is tried.
    pub fn sides(&self) -> usize {
        usize::from(!self.left.is_empty()) + usize::from(!self.right.is_empty())
    }
}

impl Grammar {
    /// Reads an L-system in our text format (`.lsys`, above).
    ///
    /// # Errors
    /// [`Error::Grammar`] with line, column and what was expected.
    pub fn parse(text: &str) -> Result<Self> {
        text::parse(text)
    }

    /// Reads an L-system as Truelsen's appendix C writes it.
    ///
    /// # Errors
    /// [`Error::Grammar`] with line, column and what was expected.
    pub fn parse_xml(text: &str) -> Result<Self> {
        xml::parse(text)
    }

    /// What its author calls it; empty when there is no title.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The chain that everything begins with.
    pub fn axiom(&self) -> &Chain {
        &self.axiom
    }

    /// Its symbols.
    pub fn alphabet(&self) -> &Arc<Alphabet> {
        &self.axiom.alphabet
    }

    /// How many derivations its author asks for (`age`, INITAGE).
    pub fn initial_age(&self) -> Option<f64> {
        self.initial_age
    }

    /// The turtle's parameters: the defaults, and what the grammar sets.
    pub fn turtle(&self) -> &TurtleParams {
        &self.turtle
    }

    /// What a name means to the turtle; `None` means nothing is done.
    pub fn command(&self, name: &str) -> Option<Command> {
        self.commands.get(name).cloned().or_else(|| Command::builtin(name))
    }

    /// Oddities that were mended silently.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// A chain of this grammar from text, with its words and defined names.
    ///
    /// # Errors
    /// [`Error::Grammar`] with line and column.
    pub fn parse_chain(&self, text: &str) -> Result<Chain> {
        text::parse_chain(text, self.alphabet().as_ref().clone(), &self.words)
    }
}

/// A chain without a grammar: see [`Chain::parse`].
pub(super) fn parse_chain(text: &str) -> Result<Chain, Error> {
    text::parse_chain(text, Alphabet::default(), &known_words())
}

/// Names of several letters that need no declaration: those of the multichain (Lluch03 §5.3).
fn known_words() -> Vec<String> {
    vec!["SAVE".to_owned(), "RESTORE".to_owned()]
}
