//! Context in a bracketed chain (Prusinkiewicz & Lindenmayer 1990, §1.8): the left context of a module is the path from the root to
//! it, the right context what grows on from it; side branches that a rule does not name are skipped.

use super::grammar::Rule;
use super::module::{Chain, Symbol};

const NONE: u32 = u32::MAX;

/// For each module of a chain what contexts need, found in one pass.
pub(super) struct Neighbours<'i> {
    /// The module that it grows on, ignored ones left out.
    before: Vec<u32>,
    /// The next module of its branch, ignored ones and side branches left out; for `[` the first one inside.
    after: Vec<u32>,
    /// For `[`: where its `]` stands.
    partner: Vec<u32>,
    /// Where its parameters begin.
    params: Vec<u32>,
    ignored: &'i [bool],
}

impl<'i> Neighbours<'i> {
    pub fn of(chain: &Chain, ignored: &'i [bool]) -> Self {
        let count = chain.len();
        let (mut before, mut partner, mut params) = (vec![NONE; count], vec![NONE; count], vec![0; count]);
        let (mut last, mut offset, mut opened) = (NONE, 0, vec![]);
        for (i, symbol) in chain.symbols.iter().enumerate() {
            (before[i], params[i]) = (last, offset);
            offset += chain.alphabet.arity(*symbol) as u32;
            match *symbol {
                Symbol::PUSH => opened.push((i, last)),
                Symbol::POP => {
                    if let Some((open, path)) = opened.pop() {
                        partner[open] = i as u32;
                        last = path;
                    }
                }
                symbol if ignored[symbol.index()] => {}
                _ => last = i as u32,
            }
        }
        Self { before, after: after(chain, ignored), partner, params, ignored }
    }

    /// Whether the rule's contexts stand round module `at`; then `bound` holds the variables of left context, module, right context.
    pub fn bind(&self, chain: &Chain, rule: &Rule, at: usize, own: &[f64], bound: &mut Vec<f64>) -> bool {
        let (mut here, mut path) = (at, vec![]);
        for wanted in rule.left.iter().rev() {
            here = self.before[here] as usize;
            if chain.symbols.get(here) != Some(wanted) {
                return false;
            }
            path.push(here);
        }
        path.iter().rev().for_each(|module| self.push_params(chain, *module, bound));
        bound.extend_from_slice(own);
        self.fits_right(chain, &rule.right, at + 1, bound)
    }

    fn push_params(&self, chain: &Chain, module: usize, bound: &mut Vec<f64>) {
        let start = self.params[module] as usize;
        bound.extend_from_slice(&chain.params[start..start + chain.alphabet.arity(chain.symbols[module])]);
    }

    /// Matches `pattern` from module `at` on, which is not the first. A bracket in the pattern must find a side branch that it fits, among those that
    /// begin there; side branches before a wanted symbol are skipped.
    fn fits_right(&self, chain: &Chain, pattern: &[Symbol], mut at: usize, bound: &mut Vec<f64>) -> bool {
        let mut pattern = pattern;
        while let Some((wanted, rest)) = pattern.split_first() {
            if *wanted == Symbol::PUSH {
                let end = closing(rest);
                let Some(behind) = self.branch(chain, &rest[..end], at, bound) else { return false };
                (at, pattern) = (behind, rest.get(end + 1..).unwrap_or_default());
                continue;
            }
            let found = self.after[at - 1] as usize;
            if chain.symbols.get(found) != Some(wanted) {
                return false;
            }
            self.push_params(chain, found, bound);
            (at, pattern) = (found + 1, rest);
        }
        true
    }

    /// The end of the first side branch from `at` on that fits `inside`.
    fn branch(&self, chain: &Chain, inside: &[Symbol], mut at: usize, bound: &mut Vec<f64>) -> Option<usize> {
        loop {
            match *chain.symbols.get(at)? {
                Symbol::PUSH if self.partner[at] != NONE => {
                    let (behind, before) = (self.partner[at] as usize + 1, bound.len());
                    if self.fits_right(chain, inside, at + 1, bound) {
                        return Some(behind);
                    }
                    bound.truncate(before);
                    at = behind;
                }
                symbol if symbol > Symbol::POP && self.ignored[symbol.index()] => at += 1,
                _ => return None,
            }
        }
    }
}

/// What [`Neighbours::after`] holds, read backwards.
fn after(chain: &Chain, ignored: &[bool]) -> Vec<u32> {
    let mut after = vec![NONE; chain.len()];
    let (mut next, mut outside) = (NONE, vec![]);
    for (i, symbol) in chain.symbols.iter().enumerate().rev() {
        after[i] = next;
        match *symbol {
            Symbol::POP => {
                outside.push(next);
                next = NONE;
            }
            Symbol::PUSH => next = outside.pop().unwrap_or(NONE),
            symbol if ignored[symbol.index()] => {}
            _ => next = i as u32,
        }
    }
    after
}

/// Where the bracket closes that opened before `pattern`.
fn closing(pattern: &[Symbol]) -> usize {
    let mut depth = 0;
    let close = pattern.iter().position(|symbol| {
        match *symbol {
            Symbol::PUSH => depth += 1,
            Symbol::POP => depth -= 1,
            _ => {}
        }
        depth < 0
    });
    close.unwrap_or(pattern.len())
}
