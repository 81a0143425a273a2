//! Chains of modules, what an L-system rewrites (Lluch03 §3.1): a module is a symbol with parameters, `A(2,0.5)`; brackets are
//! modules too.
//!
//! Built for tens of millions of modules: one array of symbols, one of all parameters in the order of the modules. Since `F` and
//! `F(1)` are different symbols of one name, the symbol alone says how many parameters are a module's own.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use crate::Result;

/// A name together with a number of parameters; an index into an [`Alphabet`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Symbol(pub(super) u16);

impl Symbol {
    /// `[`, in every alphabet.
    pub const PUSH: Symbol = Symbol(0);
    /// `]`, in every alphabet.
    pub const POP: Symbol = Symbol(1);

    /// Its place in tables over the alphabet.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

/// Most parameters that a module can have (ours: more than any published grammar, few enough that chains stay small).
pub const MOST_PARAMETERS: usize = 16;

/// Most symbols of one alphabet (ours: a symbol takes two bytes of a chain).
pub const MOST_SYMBOLS: usize = u16::MAX as usize;

/// The symbols of a grammar, and of the chains that it makes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Alphabet {
    entries: Vec<(String, u8)>,
    numbers: BTreeMap<String, Vec<(u8, Symbol)>>,
}

impl Default for Alphabet {
    fn default() -> Self {
        let mut alphabet = Self { entries: vec![], numbers: BTreeMap::new() };
        alphabet.intern("[", 0);
        alphabet.intern("]", 0);
        alphabet
    }
}

impl Alphabet {
    /// The symbol `name` with `arity` parameters, made when it is new. `None` when the alphabet is full ([`MOST_SYMBOLS`]) or the
    /// parameters are more than [`MOST_PARAMETERS`].
    pub fn intern(&mut self, name: &str, arity: usize) -> Option<Symbol> {
        if let Some(symbol) = self.find(name, arity) {
            return Some(symbol);
        }
        if self.entries.len() >= MOST_SYMBOLS || arity > MOST_PARAMETERS {
            return None;
        }
        let (symbol, arity) = (Symbol(self.entries.len() as u16), arity as u8);
        self.entries.push((name.to_owned(), arity));
        self.numbers.entry(name.to_owned()).or_default().push((arity, symbol));
        Some(symbol)
    }

    /// The symbol `name` with `arity` parameters, when there is one.
    pub fn find(&self, name: &str, arity: usize) -> Option<Symbol> {
        self.numbers.get(name)?.iter().find(|(n, _)| usize::from(*n) == arity).map(|(_, symbol)| *symbol)
    }

    /// What a symbol is called.
    pub fn name(&self, symbol: Symbol) -> &str {
        self.entries.get(symbol.index()).map_or("?", |(name, _)| name)
    }

    /// How many parameters its modules have.
    pub fn arity(&self, symbol: Symbol) -> usize {
        self.entries.get(symbol.index()).map_or(0, |(_, arity)| usize::from(*arity))
    }

    /// How many symbols there are, brackets included.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Never: brackets are always there.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Every symbol.
    pub fn symbols(&self) -> impl Iterator<Item = Symbol> + use<> {
        (0..self.entries.len()).map(|i| Symbol(i as u16))
    }
}

/// One module of a chain, borrowed from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Module<'c> {
    /// Its symbol.
    pub symbol: Symbol,
    /// The symbol's name.
    pub name: &'c str,
    /// Its parameters.
    pub params: &'c [f64],
}

/// A chain of modules.
#[derive(Debug, Clone)]
pub struct Chain {
    pub(super) alphabet: Arc<Alphabet>,
    pub(super) symbols: Vec<Symbol>,
    pub(super) params: Vec<f64>,
    /// How many derivations made it.
    pub(super) steps: u32,
    /// What the last derivation started from, when the age lies between two derivations.
    pub(super) previous: Option<Box<Previous>>,
}

/// The chain before the last derivation.
#[derive(Debug, Clone)]
pub(super) struct Previous {
    pub chain: Chain,
    /// How many modules each of its modules became.
    pub runs: Vec<u32>,
}

impl Chain {
    /// An empty chain over an alphabet.
    pub fn new(alphabet: Arc<Alphabet>) -> Self {
        Self { alphabet, symbols: vec![], params: vec![], steps: 0, previous: None }
    }

    /// A chain from its text, `F(1)[+(30)F(0.5)]`: a letter with the digits behind it is a symbol (`C12`), as are `SAVE`, `RESTORE`
    /// and every sign of the turtle; spaces are free.
    ///
    /// # Errors
    /// [`crate::Error::Grammar`] with line and column: brackets that do not pair, parameters that are no finite numbers.
    pub fn parse(text: &str) -> Result<Self> {
        super::grammar::parse_chain(text)
    }

    /// Appends a module. The symbol must be of this chain's alphabet.
    ///
    /// # Panics
    /// When `params` are not as many as the symbol has: that is a mistake of the calling code, and the chain would be unreadable.
    pub fn push(&mut self, symbol: Symbol, params: &[f64]) {
        assert_eq!(params.len(), self.alphabet.arity(symbol), "parameters of {}", self.alphabet.name(symbol));
        self.symbols.push(symbol);
        self.params.extend_from_slice(params);
    }

    /// The names behind its symbols.
    pub fn alphabet(&self) -> &Arc<Alphabet> {
        &self.alphabet
    }

    /// How many modules, brackets counted.
    pub fn len(&self) -> usize {
        self.symbols.len()
    }

    /// Whether no module is left.
    pub fn is_empty(&self) -> bool {
        self.symbols.is_empty()
    }

    /// The symbols alone.
    pub fn symbols(&self) -> &[Symbol] {
        &self.symbols
    }

    /// The parameters of all modules, one after the other.
    pub fn params(&self) -> &[f64] {
        &self.params
    }

    /// How many derivations made it; 0 for an axiom and for a chain from text.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// Its modules, from the first.
    pub fn iter(&self) -> Modules<'_> {
        Modules { alphabet: &self.alphabet, symbols: self.symbols.iter(), params: &self.params }
    }
}

/// Two chains are equal when they read the same, whatever alphabets they use.
impl PartialEq for Chain {
    fn eq(&self, other: &Self) -> bool {
        let alike = |(a, b): (Module, Module)| a.name == b.name && a.params == b.params;
        self.len() == other.len() && self.iter().zip(other.iter()).all(alike)
    }
}

impl<'c> IntoIterator for &'c Chain {
    type Item = Module<'c>;
    type IntoIter = Modules<'c>;

    fn into_iter(self) -> Modules<'c> {
        self.iter()
    }
}

/// The modules of a chain in order.
#[derive(Debug, Clone)]
pub struct Modules<'c> {
    alphabet: &'c Alphabet,
    symbols: std::slice::Iter<'c, Symbol>,
    params: &'c [f64],
}

impl<'c> Iterator for Modules<'c> {
    type Item = Module<'c>;

    fn next(&mut self) -> Option<Module<'c>> {
        let symbol = *self.symbols.next()?;
        let (params, rest) = self.params.split_at(self.alphabet.arity(symbol));
        self.params = rest;
        Some(Module { symbol, name: self.alphabet.name(symbol), params })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.symbols.size_hint()
    }
}

impl ExactSizeIterator for Modules<'_> {}

/// The notation of the papers, `B(1)[B(0.5)]`; [`Chain::parse`] reads it back. A space stands where names would run into each other.
impl fmt::Display for Chain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut before: Option<Module> = None;
        for module in self {
            if before.is_some_and(|b| needs_space(b, module)) {
                f.write_str(" ")?;
            }
            f.write_str(module.name)?;
            for (i, value) in module.params.iter().enumerate() {
                write!(f, "{}{value}", if i == 0 { "(" } else { "," })?;
            }
            if !module.params.is_empty() {
                f.write_str(")")?;
            }
            before = Some(module);
        }
        Ok(())
    }
}

/// Whether two modules need a space between them: round words, and before digits that would join a letter.
fn needs_space(before: Module, after: Module) -> bool {
    let word = |m: Module| m.name.chars().filter(|c| c.is_alphabetic()).count() > 1;
    let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    let letter = before.name.chars().next_back().is_some_and(char::is_alphanumeric);
    let bracket = |m: Module| m.symbol <= Symbol::POP;
    let words = (word(before) || word(after)) && !bracket(before) && !bracket(after);
    words || (before.params.is_empty() && letter && digit(after.name.chars().next()))
}
