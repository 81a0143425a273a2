//! The text format of grammars (`.lsys`) and chains; [`super`] shows it.

use std::collections::BTreeMap;

use super::build::{Builder, intern};
use super::cursor::{Cursor, Place, is_word};
use super::expr::Expr;
use super::expr_parser::{self, Scope};
use super::{Grammar, Rule};
use crate::params::ParamSet as _;
use crate::plant::command::{Action, Command};
use crate::plant::module::{Alphabet, Chain, Symbol};
use crate::{Error, Result};

/// Signs that are symbols.
const SIGNS: &str = "+-&^\\/|$!'\"%{}.~@?[]";

/// What begins a line that is no rule.
const KEYWORDS: [&str; 8] = ["title", "define", "symbols", "ignore", "command", "turtle", "age", "axiom"];

/// Most brackets open at once in a right context: it is matched by recursion.
const DEEPEST_CONTEXT: usize = 32;

struct Parser<'t> {
    cursor: Cursor<'t>,
    builder: Builder,
    defines: BTreeMap<String, f64>,
}

/// Reads a whole grammar.
pub fn parse(text: &str) -> Result<Grammar> {
    let mut builder = Builder::default();
    builder.words = super::known_words();
    let mut parser =
        Parser { cursor: Cursor::new(text.strip_prefix('\u{feff}').unwrap_or(text)), builder, defines: BTreeMap::new() };
    loop {
        parser.cursor.skip_lines();
        if parser.cursor.peek().is_none() {
            break;
        }
        parser.statement()?;
        if !parser.cursor.at_end() {
            return Err(parser.cursor.error("the end of the line"));
        }
        parser.cursor.take(";");
    }
    parser.builder.finish(parser.cursor.place())
}

/// Reads a chain, with no rules to check it against.
pub fn parse_chain(text: &str, mut alphabet: Alphabet, words: &[String]) -> Result<Chain> {
    let mut cursor = Cursor::new(text);
    // A chain may stand on several lines.
    cursor.open = 1;
    let modules = read_modules(&mut cursor, words, &Scope { variables: &[], defines: &BTreeMap::new(), inside_rule: false })?;
    if !cursor.at_end() || cursor.peek().is_some() {
        return Err(cursor.error("a module"));
    }
    let (mut symbols, mut params) = (vec![], vec![]);
    for module in modules {
        symbols.push(intern(&mut alphabet, &module.name, module.arguments.len(), module.place)?);
        params.extend(module.arguments.iter().filter_map(Expr::constant));
    }
    Ok(Chain { symbols, params, ..Chain::new(alphabet.into()) })
}

/// A module as written, its name not yet looked up.
struct Written {
    name: String,
    place: Place,
    arguments: Vec<Expr>,
}

impl Parser<'_> {
    fn statement(&mut self) -> Result<()> {
        let Some(keyword) = self.keyword() else { return self.rule() };
        match keyword {
            "title" => self.builder.title = self.rest_of_line(),
            "define" => self.define()?,
            "symbols" => self.symbols()?,
            "ignore" => self.ignore()?,
            "command" => self.command()?,
            "turtle" => self.turtle()?,
            "age" => self.age()?,
            _ => self.axiom()?,
        }
        Ok(())
    }

    /// Takes a keyword with the `:` or `=` that may stand behind it.
    fn keyword(&mut self) -> Option<&'static str> {
        let rest = self.cursor.rest();
        let word = KEYWORDS.into_iter().find(|word| {
            let behind = rest.strip_prefix(word).and_then(|r| r.chars().next());
            behind.is_some_and(|c| c.is_whitespace() || c == ':' || c == '=')
        })?;
        self.cursor.take(word);
        if !self.cursor.take(":") {
            self.cursor.take("=");
        }
        Some(word)
    }

    fn rest_of_line(&mut self) -> String {
        self.cursor.skip_space();
        self.cursor.take_while(|c| c != '\n' && c != '#').trim().to_owned()
    }

    /// `define NAME = expression`
    fn define(&mut self) -> Result<()> {
        self.cursor.skip_space();
        let (place, name) = (self.cursor.place(), self.cursor.take_while(is_word));
        if !name.starts_with(|c: char| c.is_alphabetic() || c == '_') {
            return Err(place.error("a name", self.cursor.found()));
        }
        if self.defines.contains_key(name) || matches!(name, "itNum" | "maxIt" | "true" | "false") {
            return Err(place.error("a new name", format!("`{name}`, which has a value already")));
        }
        self.cursor.take("=");
        let value = expr_parser::parse_number(&mut self.cursor, &self.defines)?;
        self.defines.insert(name.to_owned(), value);
        Ok(())
    }

    /// `symbols B Leaf`
    fn symbols(&mut self) -> Result<()> {
        while !self.cursor.at_end() {
            let place = self.cursor.place();
            let word = self.cursor.take_while(is_word);
            if word.starts_with('_') || (word.chars().count() > 1 && !word.starts_with(char::is_alphabetic)) {
                return Err(place.error("a name that begins with a letter", format!("`{word}`")));
            }
            let name = if word.is_empty() { read_name(&mut self.cursor, &[])? } else { word.to_owned() };
            if name.chars().count() > 1 && !self.builder.words.contains(&name) {
                self.builder.words.push(name.clone());
            }
            self.builder.declared.insert(name);
            self.cursor.take(",");
        }
        Ok(())
    }

    /// `ignore + - F`
    fn ignore(&mut self) -> Result<()> {
        while !self.cursor.at_end() {
            let place = self.cursor.place();
            let name = read_name(&mut self.cursor, &self.builder.words)?;
            if name == "[" || name == "]" {
                return Err(place.error("symbols other than brackets", format!("`{name}`")));
            }
            self.builder.ignored.insert(name);
            self.cursor.take(",");
        }
        Ok(())
    }

    /// `command X = F(0.1)`
    fn command(&mut self) -> Result<()> {
        self.cursor.skip_space();
        let place = self.cursor.place();
        let name = read_name(&mut self.cursor, &self.builder.words)?;
        if !self.cursor.take("=") {
            return Err(self.cursor.error("`=`"));
        }
        self.cursor.skip_space();
        let (at, found) = (self.cursor.place(), self.cursor.found());
        let word = self.cursor.take_while(is_word);
        let word = if word.is_empty() { self.cursor.bump().map(String::from).unwrap_or_default() } else { word.to_owned() };
        let action = Action::from_word(&word);
        let action = action.ok_or_else(|| at.error(format!("one of {}", Action::words().collect::<Vec<_>>().join(" ")), found))?;
        let brackets = [("[", Action::Push), ("]", Action::Pop)];
        if brackets.iter().any(|(n, a)| (name == *n) != (action == *a)) {
            return Err(place.error("brackets to begin and end branches, and nothing else to do so", format!("`{name}`")));
        }
        let defaults = self.numbers()?;
        if defaults.len() > action.most_parameters() {
            let most = expr_parser::plural(action.most_parameters(), "parameter");
            return Err(at.error(format!("at most {most} of `{word}`"), defaults.len().to_string()));
        }
        self.builder.commands.insert(name, Command { action, defaults });
        Ok(())
    }

    /// `(0.1, 2)`, or nothing.
    fn numbers(&mut self) -> Result<Vec<f64>> {
        self.cursor.skip_space();
        if self.cursor.peek() != Some('(') {
            return Ok(vec![]);
        }
        let scope = Scope { variables: &[], defines: &self.defines, inside_rule: false };
        Ok(expr_parser::arguments(&mut self.cursor, &scope, 0)?.iter().filter_map(Expr::constant).collect())
    }

    /// `turtle turn_deg = 25`
    fn turtle(&mut self) -> Result<()> {
        self.cursor.skip_space();
        let (place, name) = (self.cursor.place(), self.cursor.take_while(|c| is_word(c) || c == '-').replace('-', "_"));
        self.cursor.take("=");
        let value = expr_parser::parse_number(&mut self.cursor, &self.defines)?;
        self.builder.turtle.set(&name, &value.to_string()).map_err(|error| match error {
            Error::UnknownParameter { name, known } => place.error(format!("one of {known}"), format!("`{name}`")),
            Error::Parameter { expected, found, .. } => place.error(format!("{name} of {expected}"), found),
            other => other,
        })
    }

    /// `age 6`
    fn age(&mut self) -> Result<()> {
        self.cursor.skip_space();
        let place = self.cursor.place();
        let age = expr_parser::parse_number(&mut self.cursor, &self.defines)?;
        if age < 0.0 {
            return Err(place.error("an age of at least 0", age.to_string()));
        }
        self.builder.initial_age = Some(age);
        Ok(())
    }

    fn axiom(&mut self) -> Result<()> {
        let place = self.cursor.place();
        let scope = Scope { variables: &[], defines: &self.defines, inside_rule: false };
        let modules = read_modules(&mut self.cursor, &self.builder.words, &scope)?;
        if modules.is_empty() {
            return Err(self.cursor.error("a module"));
        }
        let (symbols, arguments) = self.intern_all(modules)?;
        let chain = (symbols, arguments.iter().filter_map(Expr::constant).collect());
        match self.builder.axiom.replace(chain) {
            None => Ok(()),
            Some(_) => Err(place.error("one axiom", "a second one")),
        }
    }

    fn intern_all(&mut self, modules: Vec<Written>) -> Result<(Vec<Symbol>, Vec<Expr>)> {
        let (mut symbols, mut arguments) = (vec![], vec![]);
        for module in modules {
            symbols.push(self.builder.symbol(&module.name, module.arguments.len(), module.place)?);
            arguments.extend(module.arguments);
        }
        Ok((symbols, arguments))
    }

    /// `left < predecessor > right : condition -> successor : likelihood`
    fn rule(&mut self) -> Result<()> {
        let mut variables = vec![];
        let mut place = self.cursor.place();
        let mut left = vec![];
        let mut own = self.pattern(&mut variables)?;
        if self.cursor.take("<") {
            left = self.intern_pattern(own)?;
            self.cursor.skip_space();
            place = self.cursor.place();
            own = self.pattern(&mut variables)?;
        }
        let right = if self.cursor.take(">") { self.pattern(&mut variables)? } else { vec![] };
        let right = self.intern_pattern(right)?;
        let symbol = self.predecessor(&own, place)?;
        let brackets = |symbols: &[Symbol]| symbols.iter().any(|s| *s <= Symbol::POP);
        if brackets(&left) || symbol <= Symbol::POP {
            return Err(place.error("symbols other than brackets, which no rule rewrites and no left context needs", "a bracket"));
        }
        let condition = self.condition(&variables)?;
        if !self.cursor.take_arrow() {
            return Err(self.cursor.error("an arrow `->`"));
        }
        let scope = Scope { variables: &variables, defines: &self.defines, inside_rule: true };
        let modules = read_modules(&mut self.cursor, &self.builder.words, &scope)?;
        let (successor, arguments) = self.intern_all(modules)?;
        let likelihood = self.likelihood(&variables)?;
        self.builder.rules.push(Rule { place, symbol, left, right, condition, likelihood, successor, arguments });
        Ok(())
    }

    /// Modules with names for their parameters, as they stand before an arrow.
    fn pattern(&mut self, variables: &mut Vec<String>) -> Result<Vec<(String, usize, Place)>> {
        let (mut modules, mut opened) = (vec![], vec![]);
        loop {
            self.cursor.skip_space();
            if !at_symbol(&self.cursor) {
                break;
            }
            let place = self.cursor.place();
            let name = read_name(&mut self.cursor, &self.builder.words)?;
            pair(&name, place, &mut opened)?;
            if opened.len() > DEEPEST_CONTEXT {
                return Err(place.error(format!("at most {DEEPEST_CONTEXT} brackets open in a context"), "more"));
            }
            let before = variables.len();
            if self.cursor.take("(") {
                self.formal_parameters(variables)?;
            }
            modules.push((name, variables.len() - before, place));
        }
        match opened.pop() {
            Some(place) => Err(place.error("a `]` for this bracket", "none")),
            None => Ok(modules),
        }
    }

    fn formal_parameters(&mut self, variables: &mut Vec<String>) -> Result<()> {
        loop {
            self.cursor.skip_space();
            let (place, name) = (self.cursor.place(), self.cursor.take_while(is_word));
            if !name.starts_with(|c: char| c.is_alphabetic() || c == '_') {
                return Err(place
                    .error("a name for the parameter", if name.is_empty() { self.cursor.found() } else { format!("`{name}`") }));
            }
            if variables.iter().any(|v| v == name) || self.defines.contains_key(name) || matches!(name, "itNum" | "maxIt") {
                return Err(place.error("a name not used yet", format!("`{name}`")));
            }
            variables.push(name.to_owned());
            if self.cursor.take(")") {
                return Ok(());
            }
            if !self.cursor.take(",") {
                return Err(self.cursor.error("`,` or `)`"));
            }
        }
    }

    fn intern_pattern(&mut self, modules: Vec<(String, usize, Place)>) -> Result<Vec<Symbol>> {
        modules.into_iter().map(|(name, arity, place)| self.builder.symbol(&name, arity, place)).collect()
    }

    fn predecessor(&mut self, modules: &[(String, usize, Place)], place: Place) -> Result<Symbol> {
        match modules {
            [(name, arity, place)] => intern(&mut self.builder.alphabet, name, *arity, *place),
            [] => Err(self.cursor.error(format!("a symbol to rewrite, or one of {}", KEYWORDS.join(", ")))),
            more => {
                let names: Vec<&str> = more.iter().map(|m| m.0.as_str()).collect();
                let expected = "one symbol to rewrite (names of several letters are declared first: `symbols NAME`)";
                Err(place.error(expected, format!("{} of them, {}", more.len(), names.join(" "))))
            }
        }
    }

    /// `: l > 0.1`, or `: *`, or nothing.
    fn condition(&mut self, variables: &[String]) -> Result<Option<Expr>> {
        if !self.cursor.take(":") || self.cursor.take("*") {
            return Ok(None);
        }
        self.cursor.skip_space();
        let place = self.cursor.place();
        let condition = expr_parser::parse(&mut self.cursor, &Scope { variables, defines: &self.defines, inside_rule: true })?;
        match condition.constant() {
            Some(value) if value != 0.0 && value != 1.0 => {
                Err(place.error("a condition (a likelihood stands behind the successor)", value.to_string()))
            }
            _ => Ok(Some(condition)),
        }
    }

    /// `: 0.6`, or nothing.
    fn likelihood(&mut self, variables: &[String]) -> Result<Option<Expr>> {
        if !self.cursor.take(":") {
            return Ok(None);
        }
        self.cursor.skip_space();
        let place = self.cursor.place();
        let likelihood = expr_parser::parse(&mut self.cursor, &Scope { variables, defines: &self.defines, inside_rule: true })?;
        match likelihood.constant() {
            Some(value) if !(0.0..=1.0).contains(&value) => Err(place.error("a likelihood from 0 to 1", value.to_string())),
            _ => Ok(Some(likelihood)),
        }
    }
}

/// Whether a symbol stands next.
fn at_symbol(cursor: &Cursor) -> bool {
    !cursor.at_arrow() && cursor.peek().is_some_and(|c| c.is_alphanumeric() || SIGNS.contains(c))
}

/// Takes a symbol's name: the longest declared word, else a letter with its digits, one digit or one sign.
fn read_name(cursor: &mut Cursor, words: &[String]) -> Result<String> {
    cursor.skip_space();
    if !at_symbol(cursor) {
        return Err(cursor.error("a symbol"));
    }
    let word = words.iter().filter(|w| cursor.rest().starts_with(w.as_str())).max_by_key(|w| w.len());
    if let Some(word) = word {
        cursor.take(word);
        return Ok(word.clone());
    }
    let first = cursor.bump().expect("a symbol stands next");
    let digits = if first.is_alphabetic() { cursor.take_while(|c| c.is_ascii_digit()) } else { "" };
    Ok(format!("{first}{digits}"))
}

/// Keeps the brackets that are open; a closing one must find its partner.
fn pair(name: &str, place: Place, opened: &mut Vec<Place>) -> Result<()> {
    match name {
        "[" => opened.push(place),
        "]" => drop(opened.pop().ok_or_else(|| place.error("a symbol, or a `[` before this bracket", "`]`"))?),
        _ => {}
    }
    Ok(())
}

/// Modules up to whatever is none; brackets pair, and lines may break inside them.
fn read_modules(cursor: &mut Cursor, words: &[String], scope: &Scope) -> Result<Vec<Written>> {
    let (mut modules, mut opened) = (vec![], vec![]);
    let outside = cursor.open;
    loop {
        cursor.open = outside + opened.len() as u32;
        cursor.skip_space();
        if !at_symbol(cursor) {
            break;
        }
        let place = cursor.place();
        let name = read_name(cursor, words)?;
        pair(&name, place, &mut opened)?;
        cursor.open = outside + opened.len() as u32;
        cursor.skip_space();
        let arguments = if cursor.peek() == Some('(') { expr_parser::arguments(cursor, scope, 0)? } else { vec![] };
        if (name == "[" || name == "]") && !arguments.is_empty() {
            return Err(place.error("a bracket without parameters", "some"));
        }
        modules.push(Written { name, place, arguments });
    }
    let Some(place) = opened.pop() else { return Ok(modules) };
    let found = cursor.found();
    cursor.open = outside;
    Err(cursor.place().error(format!("a module, or `]` for the `[` in line {}, column {}", place.line, place.column), found))
}
