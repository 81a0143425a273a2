//! Derivation: every module of a chain is rewritten at once (Lluch03 §3.1).
//!
//! Chunks of modules are rewritten in parallel, in two passes. The first chooses each module's rule and counts what it will make, so
//! that an explosive grammar is stopped before its chain takes memory; the second fills the new chain, every chunk its own stretch.
//! A module's random numbers are keyed by (seed, derivation, position): threads and chunks leave no trace.

use rayon::prelude::*;

use super::grammar::{Env, Expr, Grammar, Rule, SLACK, too_likely};
use super::module::{Chain, MOST_PARAMETERS, Previous, Symbol};
use super::neighbours::Neighbours;
use crate::params::ParamSet as _;
use crate::{Error, Result, Seed};

crate::params! {
    /// Limits of a derivation.
    pub struct DeriveParams {
        /// Most modules of a chain, brackets counted, and a quarter of the numbers in their parentheses.
        max_modules: u32 = 50_000_000, in 1..=1_000_000_000, unit "", source "ours: about 2 GB at two parameters a module";
    }
}

/// How far a derivation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Derivations done.
    pub step: u32,
    /// Derivations to do.
    pub steps: u32,
    /// Modules of the chain now.
    pub modules: usize,
}

/// Modules of one parallel task.
const CHUNK: usize = 8192;

/// Numbers in parentheses that a chain may hold for each allowed module.
const PARAMETERS_PER_MODULE: u64 = 4;

/// Most derivations (ours: nothing grows that long; a mistyped age should not run for days).
const MOST_STEPS: f64 = 1e6;

/// No rule: the module stays.
const KEEP: u16 = u16::MAX;

impl Grammar {
    /// Derives the axiom `age` times. A fraction rounds up, and the chain then remembers what its last derivation started from, so
    /// that the turtle can draw the age between (Truelsen §9.1). `progress` is called after every derivation; a chain that no rule
    /// can change ends it early.
    ///
    /// # Errors
    /// [`Error::TooManyModules`] before memory is taken for them; [`Error::Grammar`] with the rule's place for a division by zero,
    /// NaN, or likelihoods over 1; [`Error::Parameter`] for an age that is no number from 0 to a million.
    pub fn derive(&self, age: f64, params: &DeriveParams, seed: Seed, progress: &mut dyn FnMut(Progress)) -> Result<Chain> {
        params.validate()?;
        if !(0.0..=MOST_STEPS).contains(&age) {
            return Err(Error::Parameter { name: "age".into(), expected: format!("0 to {MOST_STEPS}"), found: age.to_string() });
        }
        let steps = age.ceil() as u32;
        let mut chain = self.axiom.clone();
        for step in 1..=steps {
            let numbers = (f64::from(step), f64::from(steps));
            let seed = Seed(seed.keyed("derive", u64::from(step)).bits());
            let keep = step == steps && age.fract() > 0.0;
            let (next, runs) = Step { grammar: self, chain: &chain, step, numbers, seed }.run(params, keep)?;
            let before = std::mem::replace(&mut chain, next);
            chain.previous = runs.map(|runs| Box::new(Previous { chain: before, runs }));
            progress(Progress { step, steps, modules: chain.len() });
            if self.is_final(&chain) {
                chain.steps = steps;
                break;
            }
        }
        Ok(chain)
    }

    /// Whether no further derivation can change the chain. Looks at the whole of a final chain, and at the beginning of any other.
    fn is_final(&self, chain: &Chain) -> bool {
        chain.symbols.iter().all(|symbol| self.of_symbol[symbol.index()].is_empty())
    }
}

/// One derivation of one chain.
struct Step<'g> {
    grammar: &'g Grammar,
    chain: &'g Chain,
    step: u32,
    /// `itNum` and `maxIt`.
    numbers: (f64, f64),
    /// The derivation's own seed.
    seed: Seed,
}

/// A stretch of the old chain.
#[derive(Clone, Copy)]
struct Chunk<'c> {
    start: usize,
    symbols: &'c [Symbol],
    params: &'c [f64],
}

/// What the first pass finds for a chunk.
struct Choice {
    /// A rule's number for each module, or [`KEEP`].
    rules: Vec<u16>,
    modules: u64,
    params: u64,
}

impl<'g> Step<'g> {
    /// The new chain, and with `keep` how many modules each old one became.
    fn run(&self, limits: &DeriveParams, keep: bool) -> Result<(Chain, Option<Vec<u32>>)> {
        let context = self.grammar.rules.iter().any(Rule::has_context);
        let neighbours = context.then(|| Neighbours::of(self.chain, &self.grammar.ignored));
        let chunks = self.chunks();
        let choose = |chunk: &Chunk| self.choose(*chunk, neighbours.as_ref());
        // Collected chunk by chunk, so that the first error of the chain is the one reported.
        let choices: Vec<Choice> = chunks.par_iter().map(choose).collect::<Vec<_>>().into_iter().collect::<Result<_>>()?;
        self.check_limits(limits, &choices)?;

        let total = |count: fn(&Choice) -> u64| choices.iter().map(count).sum::<u64>() as usize;
        let mut symbols = vec![Symbol(0); total(|c| c.modules)];
        let mut params = vec![0.0; total(|c| c.params)];
        let targets = stretches(&mut symbols, &mut params, &choices);
        let fill = |((chunk, choice), target): ((&Chunk, &Choice), Stretch)| self.fill(*chunk, choice, target, neighbours.as_ref());
        let filled: Vec<Result<()>> = chunks.par_iter().zip(&choices).zip(targets).map(fill).collect();
        filled.into_iter().collect::<Result<()>>()?;
        let made = |rule: &u16| self.rule(*rule).map_or(1, |rule| rule.successor.len() as u32);
        let runs = keep.then(|| choices.iter().flat_map(|c| c.rules.iter().map(made)).collect());
        Ok((Chain { symbols, params, steps: self.step, ..Chain::new(self.chain.alphabet.clone()) }, runs))
    }

    fn rule(&self, number: u16) -> Option<&'g Rule> {
        if number == KEEP { None } else { self.grammar.rules.get(usize::from(number)) }
    }

    /// Cuts the chain up. Where a chunk's parameters begin is the sum of all arities before it.
    fn chunks(&self) -> Vec<Chunk<'g>> {
        let Chain { alphabet, symbols, params, .. } = self.chain;
        let arity: Vec<usize> = alphabet.symbols().map(|s| alphabet.arity(s)).collect();
        let counts: Vec<usize> = symbols.par_chunks(CHUNK).map(|c| c.iter().map(|s| arity[s.index()]).sum()).collect();
        let mut rest = params.as_slice();
        let cut = |(i, (symbols, count)): (usize, (&'g [Symbol], &usize))| {
            let (params, behind) = rest.split_at(*count);
            rest = behind;
            Chunk { start: i * CHUNK, symbols, params }
        };
        symbols.chunks(CHUNK).zip(&counts).enumerate().map(cut).collect()
    }

    fn check_limits(&self, limits: &DeriveParams, choices: &[Choice]) -> Result<()> {
        let limit = u64::from(limits.max_modules);
        let sum = |count: fn(&Choice) -> u64| choices.iter().map(count).fold(0, u64::saturating_add);
        let modules = ("modules", sum(|c| c.modules), limit);
        let params = ("parameters", sum(|c| c.params), limit * PARAMETERS_PER_MODULE);
        match [modules, params].into_iter().find(|(_, found, limit)| found > limit) {
            Some((what, found, limit)) => Err(Error::TooManyModules { step: self.step, what, found, limit }),
            None => Ok(()),
        }
    }

    /// First pass: which rule rewrites each module, and how much comes of it.
    fn choose(&self, chunk: Chunk, neighbours: Option<&Neighbours>) -> Result<Choice> {
        let alphabet = &self.chain.alphabet;
        let mut choice = Choice { rules: Vec::with_capacity(chunk.symbols.len()), modules: 0, params: 0 };
        let mut rest = chunk.params;
        for (i, symbol) in chunk.symbols.iter().enumerate() {
            let (own, behind) = rest.split_at(alphabet.arity(*symbol));
            rest = behind;
            let rules = self.grammar.of_symbol[symbol.index()].clone();
            let number = match &self.grammar.rules[rules.clone()] {
                [] => KEEP,
                [first, ..] if first.is_unconditional() => rules.start as u16,
                _ => self.compete(rules, chunk.start + i, own, neighbours)?,
            };
            choice.rules.push(number);
            let made = self.rule(number).map_or((1, own.len()), |rule| (rule.successor.len(), rule.arguments.len()));
            choice.modules = choice.modules.saturating_add(made.0 as u64);
            choice.params = choice.params.saturating_add(made.1 as u64);
        }
        Ok(choice)
    }

    /// Which of several rules rewrites a module: the first that fits without likelihood, or one drawn among those with likelihood
    /// that stand before it and ask for as much context.
    fn compete(&self, rules: std::ops::Range<usize>, at: usize, own: &[f64], neighbours: Option<&Neighbours>) -> Result<u16> {
        let (mut drawn, mut sum, mut chosen, mut sides) = (None, 0.0, None, usize::MAX);
        let mut bound = Vec::new();
        for number in rules {
            let rule = &self.grammar.rules[number];
            if sum > 0.0 && rule.sides() < sides {
                break;
            }
            let Some(variables) = self.bind(rule, at, own, neighbours, &mut bound) else { continue };
            let mut env = Env::new(variables, self.numbers, self.seed, at as u64);
            if drawn.is_none() {
                drawn = Some(env.draws.unit());
            } else {
                env.draws.unit();
            }
            let evaluate = |expr| self.evaluate(expr, &mut env, rule);
            if rule.condition.as_ref().map_or(Ok(1.0), evaluate)? == 0.0 {
                continue;
            }
            let Some(likelihood) = &rule.likelihood else { return Ok(chosen.unwrap_or(number as u16)) };
            let likelihood = self.evaluate(likelihood, &mut env, rule)?;
            if !(0.0..=1.0).contains(&likelihood) {
                return Err(rule.place.error("a likelihood from 0 to 1", likelihood.to_string()));
            }
            (sum, sides) = (sum + likelihood, rule.sides());
            if sum > 1.0 + SLACK {
                return Err(too_likely(rule.place, sum));
            }
            if chosen.is_none() && drawn.is_some_and(|d| d < sum) {
                chosen = Some(number as u16);
            }
        }
        Ok(chosen.unwrap_or(KEEP))
    }

    /// The rule's variables, when its contexts fit: left context, own, right context.
    fn bind<'v>(
        &self,
        rule: &Rule,
        at: usize,
        own: &'v [f64],
        neighbours: Option<&Neighbours>,
        bound: &'v mut Vec<f64>,
    ) -> Option<&'v [f64]> {
        if !rule.has_context() {
            return Some(own);
        }
        bound.clear();
        neighbours?.bind(self.chain, rule, at, own, bound).then_some(bound.as_slice())
    }

    /// A value, or where and why there is none.
    fn evaluate(&self, expr: &Expr, env: &mut Env, rule: &Rule) -> Result<f64> {
        let before = env.draws.clone();
        let value = expr.value(env);
        if value.is_finite() {
            return Ok(value);
        }
        env.draws = before;
        let (place, why) = expr.fault(env).unwrap_or((None, "no number".to_owned()));
        let found = format!("{why} in derivation {}", self.step);
        Err(place.unwrap_or(rule.place).error("a finite number", found))
    }

    /// Second pass: writes what a chunk becomes.
    fn fill(&self, chunk: Chunk, choice: &Choice, target: Stretch, neighbours: Option<&Neighbours>) -> Result<()> {
        let alphabet = &self.chain.alphabet;
        let Stretch { mut symbols, mut params } = target;
        let (mut rest, mut bound) = (chunk.params, Vec::with_capacity(MOST_PARAMETERS));
        for (i, (symbol, number)) in chunk.symbols.iter().zip(&choice.rules).enumerate() {
            let (own, behind) = rest.split_at(alphabet.arity(*symbol));
            rest = behind;
            let Some(rule) = self.rule(*number) else {
                symbols = put(symbols, &[*symbol]);
                params = put(params, own);
                continue;
            };
            symbols = put(symbols, &rule.successor);
            if rule.arguments.is_empty() {
                continue;
            }
            let at = chunk.start + i;
            // The first pass found the contexts, so this finds them again.
            let Some(variables) = self.bind(rule, at, own, neighbours, &mut bound) else { continue };
            let mut env = Env::new(variables, self.numbers, self.seed, at as u64);
            // The first number chose the rule.
            env.draws.unit();
            let (here, behind) = params.split_at_mut(rule.arguments.len());
            for (slot, argument) in here.iter_mut().zip(&rule.arguments) {
                *slot = self.evaluate(argument, &mut env, rule)?;
            }
            params = behind;
        }
        Ok(())
    }
}

/// Where a chunk's successors go.
struct Stretch<'t> {
    symbols: &'t mut [Symbol],
    params: &'t mut [f64],
}

fn stretches<'t>(mut symbols: &'t mut [Symbol], mut params: &'t mut [f64], choices: &[Choice]) -> Vec<Stretch<'t>> {
    let cut = |choice: &Choice| {
        let (s, more_symbols) = std::mem::take(&mut symbols).split_at_mut(choice.modules as usize);
        let (p, more_params) = std::mem::take(&mut params).split_at_mut(choice.params as usize);
        (symbols, params) = (more_symbols, more_params);
        Stretch { symbols: s, params: p }
    };
    choices.iter().map(cut).collect()
}

/// Writes `values` at the beginning of `target`; what is behind them.
fn put<'t, T: Copy>(target: &'t mut [T], values: &[T]) -> &'t mut [T] {
    let (here, behind) = target.split_at_mut(values.len());
    here.copy_from_slice(values);
    behind
}
