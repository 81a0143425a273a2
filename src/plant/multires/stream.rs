//! A multichain as bytes (Lluch03 §5: "we only transmit, interpret and render a limited-length prefix"): any prefix is a tree.
//!
//! After `SBMC` and the format's version, 1, there are only these, each a LEB128 number with what follows it:
//!
//! | number | followed by | means |
//! | --- | --- | --- |
//! | 0 | | the end |
//! | 1 | state | RESTORE, and a new level |
//! | 2 | state | RESTORE within a level, behind a tail |
//! | 3 | brackets, distance | a branch: `[` behind the one before, and its first module's original position, counted from the end of the step before it (zigzag) |
//! | 4 | | SAVE; states are numbered from 0 |
//! | 5 | parameters, length, name | a symbol; symbols are numbered from 0 |
//! | 6 + s | parameters, 8 bytes each | a module of symbol s; numbers are little-endian `f64`s |
//!
//! Branch records stand for what the original brackets told (the paper's chain loses it); with them, a stream received whole draws
//! exactly what the original chain draws.

use std::collections::BTreeMap;

use super::weighted::MOST_BRACKETS;
use super::{Multichain, Step};
use crate::{Error, Result};

const MAGIC: &[u8] = b"SBMC\x01";
const END: u64 = 0;
const LEVEL: u64 = 1;
const BACK: u64 = 2;
const BRANCH: u64 = 3;
const SAVE: u64 = 4;
const SYMBOL: u64 = 5;
const MODULE: u64 = 6;

/// Longest name of a symbol, bytes, and most parameters (ours: ample, and a hostile stream cannot ask for more).
const LONGEST: u64 = 255;

/// A module as a stream carries it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Word<'a> {
    /// The symbol.
    pub name: &'a str,
    /// Its parameters.
    pub params: &'a [f64],
}

/// The bytes of a multichain. `word` gives the modules by place, as in [`Step::modules`].
///
/// # Errors
/// [`Error::UnreadableChain`] for a name or a list of parameters longer than 255.
pub fn write<'a>(chain: &Multichain, word: impl Fn(u32) -> Word<'a>) -> Result<Vec<u8>> {
    let mut bytes = MAGIC.to_vec();
    let mut symbols: BTreeMap<(&str, usize), u64> = BTreeMap::new();
    let (mut level_ends, mut expected) = (chain.ends.iter().peekable(), 0i64);
    for (number, step) in (0u32..).zip(chain.steps()) {
        if let Some(state) = step.restore {
            let begins = level_ends.next_if(|&&end| end == number).is_some();
            put(&mut bytes, if begins { LEVEL } else { BACK });
            put(&mut bytes, u64::from(state));
        }
        put(&mut bytes, BRANCH);
        put(&mut bytes, u64::from(step.brackets));
        let distance = i64::from(step.position) - expected;
        put(&mut bytes, ((distance << 1) ^ (distance >> 63)) as u64);
        expected = i64::from(step.position) + step.modules.len() as i64;
        for (stored, position) in step.modules.clone().zip(step.position..) {
            let Word { name, params } = word(stored);
            if name.len().max(params.len()) as u64 > LONGEST {
                return Err(Error::UnreadableChain {
                    position: position as usize,
                    what: "has a name or parameters longer than 255",
                });
            }
            let next = symbols.len() as u64;
            let symbol = *symbols.entry((name, params.len())).or_insert_with(|| {
                [SYMBOL, params.len() as u64, name.len() as u64].into_iter().for_each(|n| put(&mut bytes, n));
                bytes.extend_from_slice(name.as_bytes());
                next
            });
            put(&mut bytes, MODULE + symbol);
            params.iter().for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
        }
        if step.save.is_some() {
            put(&mut bytes, SAVE);
        }
    }
    put(&mut bytes, END);
    Ok(bytes)
}

/// Appends a number, seven bits a byte, lowest first.
fn put(bytes: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

/// How a stream stands after the bytes received so far. Only the first is the whole tree; the others are trees as well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reception {
    /// Everything has come.
    Whole,
    /// More is to come; the last byte ends a module.
    BetweenModules,
    /// More is to come; the last `bytes` bytes, from byte `offset`, are the beginning of something and wait for its rest.
    MidModule {
        /// Where it begins, counted from 0.
        offset: usize,
        /// How much of it is there.
        bytes: usize,
    },
}

/// Takes a stream piece by piece, and holds the tree that has come so far.
#[derive(Debug, Clone, Default)]
pub struct Receiver {
    chain: Multichain,
    /// Name, and number of parameters.
    symbols: Vec<(String, usize)>,
    /// Symbol, and where its parameters begin.
    modules: Vec<(u32, usize)>,
    params: Vec<f64>,
    /// A RESTORE whose branch has not come yet, and whether a level begins there.
    restore: Option<(u32, bool)>,
    /// Bytes that have been understood, and those behind them that have not.
    understood: usize,
    waiting: Vec<u8>,
    ended: bool,
}

impl Receiver {
    /// Reads a stream, or any beginning of one.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn read(bytes: &[u8]) -> Result<Self> {
        let mut receiver = Self::default();
        receiver.push(bytes)?;
        Ok(receiver)
    }

    /// Takes the next bytes. A piece may end anywhere.
    ///
    /// # Errors
    /// [`Error::BrokenStream`] for bytes that no multichain's stream can hold; what came before them stays.
    pub fn push(&mut self, bytes: &[u8]) -> Result<()> {
        self.waiting.extend_from_slice(bytes);
        let waiting = std::mem::take(&mut self.waiting);
        let mut cursor = Cursor { bytes: &waiting, at: 0 };
        let mut outcome = Ok(());
        let mut done = 0;
        while outcome.is_ok() && done < waiting.len() {
            match self.take(&mut cursor) {
                Ok(()) => done = cursor.at,
                Err(Stop::Cut) => break,
                Err(Stop::Wrong(what)) => outcome = Err(Error::BrokenStream { offset: self.understood + done, what }),
            }
        }
        self.understood += done;
        self.waiting = waiting[done..].to_vec();
        outcome
    }

    /// How the stream stands.
    pub fn reception(&self) -> Reception {
        match (self.ended, self.waiting.len()) {
            (true, _) => Reception::Whole,
            (false, 0) => Reception::BetweenModules,
            (false, bytes) => Reception::MidModule { offset: self.understood, bytes },
        }
    }

    /// The tree that has come so far. Its last level may lack branches or modules until [`whole_levels`](Self::whole_levels) counts it.
    pub fn chain(&self) -> &Multichain {
        &self.chain
    }

    /// How many levels have come to their end.
    pub fn whole_levels(&self) -> usize {
        let begun = self.restore.is_some_and(|(_, begins)| begins);
        if self.ended || begun { self.chain.levels() } else { self.chain.levels().saturating_sub(1) }
    }

    /// How many modules have come.
    pub fn modules(&self) -> usize {
        self.modules.len()
    }

    /// A module, by its place in [`Step::modules`]. `None` beyond what has come.
    pub fn word(&self, stored: u32) -> Option<Word<'_>> {
        let (symbol, begin) = *self.modules.get(stored as usize)?;
        let (name, arity) = &self.symbols[symbol as usize];
        Some(Word { name, params: &self.params[begin..begin + arity] })
    }

    /// Takes one element; changes nothing when it is not all there, or wrong.
    fn take(&mut self, cursor: &mut Cursor) -> Result<(), Stop> {
        if self.understood == 0 && cursor.at == 0 {
            return cursor.magic();
        }
        if self.ended {
            return Err(Stop::Wrong("follows the end"));
        }
        match cursor.number()? {
            END if self.restore.is_some() => Err(Stop::Wrong("ends the stream where a branch is due")),
            END => {
                self.ended = true;
                Ok(())
            }
            kind @ (LEVEL | BACK) => self.take_restore(cursor.number()?, kind == LEVEL),
            BRANCH => self.take_branch(cursor.number()?, cursor.number()?),
            SAVE => self.take_save(),
            SYMBOL => self.take_symbol(cursor),
            module => self.take_module(module - MODULE, cursor),
        }
    }

    fn take_restore(&mut self, state: u64, begins: bool) -> Result<(), Stop> {
        if state >= self.chain.saves() as u64 {
            return Err(Stop::Wrong("restores a state that was never saved"));
        }
        if self.restore.replace((state as u32, begins)).is_some() {
            return Err(Stop::Wrong("restores two states at once"));
        }
        Ok(())
    }

    fn take_branch(&mut self, brackets: u64, distance: u64) -> Result<(), Stop> {
        if brackets > u64::from(MOST_BRACKETS) {
            return Err(Stop::Wrong("opens more brackets than a branch can have"));
        }
        let expected = self.chain.steps.last().map_or(0, |s| i64::from(s.position) + s.modules.len() as i64);
        let distance = (distance >> 1) as i64 ^ -((distance & 1) as i64);
        let position = expected.checked_add(distance).and_then(|p| u32::try_from(p).ok());
        let position = position.ok_or(Stop::Wrong("gives a branch a place outside every chain"))?;
        let begins = self.chain.ends.is_empty() || self.restore.is_some_and(|(_, begins)| begins);
        let modules = self.modules.len() as u32..self.modules.len() as u32;
        let restore = self.restore.take().map(|(state, _)| state);
        self.chain.steps.push(Step { restore, brackets: brackets as u32, position, modules, save: None });
        let end = self.chain.steps.len() as u32;
        match self.chain.ends.last_mut() {
            Some(last) if !begins => *last = end,
            _ => self.chain.ends.push(end),
        }
        Ok(())
    }

    /// The branch that elements belong to.
    fn branch(&mut self) -> Result<&mut Step, Stop> {
        let due = Stop::Wrong("stands where a branch is due");
        if self.restore.is_some() { Err(due) } else { self.chain.steps.last_mut().ok_or(due) }
    }

    fn take_save(&mut self) -> Result<(), Stop> {
        let (state, step) = (self.chain.saves() as u32, self.chain.steps.len() as u32);
        if self.branch()?.save.replace(state).is_some() {
            return Err(Stop::Wrong("saves a branch twice"));
        }
        self.chain.saved_by.push(step - 1);
        Ok(())
    }

    fn take_symbol(&mut self, cursor: &mut Cursor) -> Result<(), Stop> {
        let (arity, length) = (cursor.number()?, cursor.number()?);
        if arity.max(length) > LONGEST {
            return Err(Stop::Wrong("begins a symbol with more than 255 bytes or parameters"));
        }
        let name =
            std::str::from_utf8(cursor.bytes(length as usize)?).map_err(|_| Stop::Wrong("begins a name that is not UTF-8"))?;
        self.symbols.push((name.to_owned(), arity as usize));
        Ok(())
    }

    fn take_module(&mut self, symbol: u64, cursor: &mut Cursor) -> Result<(), Stop> {
        let index = usize::try_from(symbol).ok().filter(|&s| s < self.symbols.len());
        let index = index.ok_or(Stop::Wrong("has a symbol that was never introduced"))?;
        let values = cursor.bytes(8 * self.symbols[index].1)?;
        let step = self.branch()?;
        if step.save.is_some() {
            return Err(Stop::Wrong("is a module behind its branch's SAVE"));
        }
        let end = step.modules.end.checked_add(1).filter(|_| step.position.checked_add(step.modules.len() as u32 + 1).is_some());
        step.modules.end = end.ok_or(Stop::Wrong("is one module more than can be counted"))?;
        self.modules.push((index as u32, self.params.len()));
        self.params.extend(values.as_chunks().0.iter().map(|&eight| f64::from_le_bytes(eight)));
        Ok(())
    }
}

/// Why no element was taken.
enum Stop {
    /// The bytes end within it.
    Cut,
    /// It is none, for this reason.
    Wrong(&'static str),
}

struct Cursor<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl<'b> Cursor<'b> {
    fn magic(&mut self) -> Result<(), Stop> {
        let there = self.bytes.len().min(MAGIC.len());
        if self.bytes[..there] != MAGIC[..there] {
            return Err(Stop::Wrong("does not begin a multichain of version 1"));
        }
        self.bytes(MAGIC.len()).map(drop)
    }

    fn bytes(&mut self, count: usize) -> Result<&'b [u8], Stop> {
        let bytes = self.bytes.get(self.at..).and_then(|rest| rest.get(..count)).ok_or(Stop::Cut)?;
        self.at += count;
        Ok(bytes)
    }

    fn number(&mut self) -> Result<u64, Stop> {
        let mut number = 0u64;
        for shift in (0..64).step_by(7) {
            let byte = self.bytes(1)?[0];
            let bits = u64::from(byte & 0x7f);
            if bits << shift >> shift != bits {
                break;
            }
            number |= bits << shift;
            if byte < 0x80 {
                return Ok(number);
            }
        }
        Err(Stop::Wrong("begins a number of more than 64 bits"))
    }
}
