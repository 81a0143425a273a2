//! From what a file says to a checked grammar: symbols without meaning, wrong arities, likelihoods over 1, rules never reached.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::cursor::Place;
use super::expr_parser::plural;
use super::{Grammar, Rule};
use crate::Result;
use crate::plant::command::Command;
use crate::plant::module::{Alphabet, Chain, MOST_PARAMETERS, MOST_SYMBOLS, Symbol};
use crate::plant::turtle::TurtleParams;
use crate::{Error, Warning};

/// A grammar while its file is being read.
#[derive(Default)]
pub struct Builder {
    pub title: String,
    pub alphabet: Alphabet,
    /// Symbols and parameters of the axiom, once it was read.
    pub axiom: Option<(Vec<Symbol>, Vec<f64>)>,
    pub rules: Vec<Rule>,
    /// Names that contexts do not see.
    pub ignored: BTreeSet<String>,
    pub commands: BTreeMap<String, Command>,
    /// Names that need neither rule nor command.
    pub declared: BTreeSet<String>,
    pub words: Vec<String>,
    pub turtle: TurtleParams,
    pub initial_age: Option<f64>,
    pub warnings: Vec<Warning>,
    /// Every symbol that stands in an axiom, a context or a successor, where it does so first.
    uses: Vec<(Symbol, Place)>,
    used: BTreeSet<Symbol>,
}

/// Most rules of a grammar: a derivation notes the rule of every module in two bytes.
const MOST_RULES: usize = u16::MAX as usize - 1;

/// How far over 1 a sum of likelihoods may be: 0.1 ten times is not exactly 1.
pub const SLACK: f64 = 1e-9;

impl Builder {
    /// The symbol for a module that stands at `place`.
    pub fn symbol(&mut self, name: &str, arity: usize, place: Place) -> Result<Symbol> {
        let symbol = intern(&mut self.alphabet, name, arity, place)?;
        if self.used.insert(symbol) {
            self.uses.push((symbol, place));
        }
        Ok(symbol)
    }

    /// Checks everything that needs the whole file.
    pub fn finish(mut self, end: Place) -> Result<Grammar> {
        let (symbols, params) = self.axiom.take().ok_or_else(|| end.error("an axiom", "none in the whole text"))?;
        self.uses.iter().try_for_each(|(symbol, place)| self.check_use(*symbol, *place))?;
        if let Some(rule) = self.rules.get(MOST_RULES) {
            return Err(rule.place.error(format!("at most {MOST_RULES} rules"), "more"));
        }
        self.rules.sort_by_key(|rule| (rule.symbol, std::cmp::Reverse(rule.sides())));
        for group in self.rules.chunk_by(|a, b| a.symbol == b.symbol) {
            check_group(group)?;
        }
        let of_symbol = self.alphabet.symbols().map(|symbol| {
            let start = self.rules.partition_point(|rule| rule.symbol < symbol);
            start..self.rules.partition_point(|rule| rule.symbol <= symbol)
        });
        let ignored = self.alphabet.symbols().map(|symbol| self.ignored.contains(self.alphabet.name(symbol)));
        Ok(Grammar {
            title: self.title,
            of_symbol: of_symbol.collect(),
            ignored: ignored.collect(),
            axiom: Chain { symbols, params, ..Chain::new(Arc::new(self.alphabet)) },
            rules: self.rules,
            commands: self.commands,
            words: self.words,
            turtle: self.turtle,
            initial_age: self.initial_age,
            warnings: self.warnings,
        })
    }

    /// A module must have a rule for its number of parameters, or a command, or a declaration.
    fn check_use(&self, symbol: Symbol, place: Place) -> Result<()> {
        if symbol <= Symbol::POP {
            return Ok(());
        }
        let (name, arity) = (self.alphabet.name(symbol), self.alphabet.arity(symbol));
        let found = |arity: usize| format!("`{name}` with {}", if arity == 0 { "none".to_owned() } else { arity.to_string() });
        let of_name = |rule: &&Rule| self.alphabet.name(rule.symbol) == name;
        if let Some(rule) = self.rules.iter().find(of_name) {
            let known = self.rules.iter().filter(of_name).any(|rule| rule.symbol == symbol);
            let wanted = plural(self.alphabet.arity(rule.symbol), "parameter");
            let expected = || format!("`{name}` with {wanted}, as in its rule in line {}", rule.place.line);
            return if known { Ok(()) } else { Err(place.error(expected(), found(arity))) };
        }
        if self.declared.contains(name) {
            return Ok(());
        }
        let Some(command) = self.commands.get(name).cloned().or_else(|| Command::builtin(name)) else {
            return Err(place.error("a symbol with a rule, a command or a declaration", format!("the undefined symbol `{name}`")));
        };
        let most = command.action.most_parameters();
        if arity <= most {
            Ok(())
        } else {
            Err(place.error(format!("at most {} of `{name}`", plural(most, "parameter")), found(arity)))
        }
    }
}

/// The symbol, or why there can be none.
pub fn intern(alphabet: &mut Alphabet, name: &str, arity: usize, place: Place) -> Result<Symbol> {
    alphabet.intern(name, arity).ok_or_else(|| match arity > MOST_PARAMETERS {
        true => place.error(format!("at most {MOST_PARAMETERS} parameters"), arity.to_string()),
        false => place.error(format!("at most {MOST_SYMBOLS} different symbols"), "more"),
    })
}

/// Rules of one symbol: likelihoods that always compete must not exceed 1, and no rule may stand behind one that always applies.
fn check_group(rules: &[Rule]) -> Result<()> {
    for (i, rule) in rules.iter().enumerate() {
        let rivals = || rules[..i].iter().filter(|r| r.left == rule.left && r.right == rule.right && r.condition.is_none());
        if let Some(first) = rivals().find(|r| r.likelihood.is_none()) {
            let expected = format!("a condition or a likelihood, since the rule in line {} always applies", first.place.line);
            return Err(rule.place.error(expected, "a rule that can never be reached"));
        }
        let likelihood = |r: &Rule| r.likelihood.as_ref().and_then(|l| l.constant()).unwrap_or(0.0);
        let sum: f64 = likelihood(rule) + rivals().map(likelihood).sum::<f64>();
        if rule.condition.is_none() && sum > 1.0 + SLACK {
            return Err(too_likely(rule.place, sum));
        }
    }
    Ok(())
}

/// The likelihoods of rules that fit one module sum to more than 1.
pub fn too_likely(place: Place, sum: f64) -> Error {
    place.error("likelihoods that sum to 1 at most", format!("a sum of {}", (sum * 1e6).round() / 1e6))
}
