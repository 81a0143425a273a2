//! Truelsen's XML (§6.1.1, appendix C): a flat list of elements, every symbol one character, everything in attributes.
//!
//! ```xml
//! <LSYSTEM DESC="Stochastic AB" INITAGE="2">
//!   <VARIABLE CHAR="A" DESC=""/>          a symbol that is rewritten
//!   <CONSTANT CHAR="+" DESC=""/>          one that is not
//!   <INITIATOR START="A"/>
//!   <PRODUCTION P="A" S="A+A" LIKELIHOOD="0.9"/>
//!   <COMMAND SYMBOL="+" CMD="R" ARG="40,50,-60"/>     F, R, [, ] or L, and its numbers
//! </LSYSTEM>
//! ```
//!
//! Only the command table gives a symbol a meaning for the turtle. Brackets need no declaration.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::{Attribute, Document, Node};

use super::build::{Builder, intern};
use super::cursor::Place;
use super::expr::Expr;
use super::{Grammar, Rule};
use crate::plant::command::{Action, Command};
use crate::plant::module::Symbol;
use crate::{Result, Warning};

/// What an element may say: its name, attributes that it needs, attributes that it may have.
const ELEMENTS: [(&str, &[&str], &[&str]); 5] = [
    ("VARIABLE", &["CHAR"], &["DESC"]),
    ("CONSTANT", &["CHAR"], &["DESC"]),
    ("INITIATOR", &["START"], &["DESC"]),
    ("PRODUCTION", &["P", "S"], &["DESC", "LIKELIHOOD"]),
    ("COMMAND", &["SYMBOL", "CMD"], &["DESC", "ARG"]),
];

/// Reads a whole grammar.
pub fn parse(text: &str) -> Result<Grammar> {
    let document = Document::parse(text).map_err(|error| {
        let at = error.pos();
        let place = Place { line: at.row, column: at.col };
        // The reader says where as well; once is enough.
        let why = error.to_string();
        place.error("well-formed XML", why.rsplit_once(" at ").map_or(why.as_str(), |(why, _)| why))
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "LSYSTEM" {
        return Err(at_node(root).error("the element LSYSTEM", format!("the element {}", root.tag_name().name())));
    }
    let mut reader = Reader::default();
    reader.attributes_of_root(root)?;
    let elements: Vec<Node> = root.children().filter(|n| n.is_element()).collect();
    root.children().try_for_each(check_node)?;
    for &element in elements.iter().filter(|e| matches!(name(**e), "VARIABLE" | "CONSTANT")) {
        reader.declaration(element)?;
    }
    for &element in elements.iter().filter(|e| name(**e) == "COMMAND") {
        reader.command(element)?;
    }
    for &element in &elements {
        match name(element) {
            "INITIATOR" => reader.initiator(element)?,
            "PRODUCTION" => reader.production(element)?,
            _ => {}
        }
    }
    reader.finish(at_node(root))
}

fn name<'n>(node: Node<'n, '_>) -> &'n str {
    node.tag_name().name()
}

fn at_offset(node: Node, offset: usize) -> Place {
    let at = node.document().text_pos_at(offset);
    Place { line: at.row, column: at.col }
}

fn at_node(node: Node) -> Place {
    at_offset(node, node.range().start)
}

fn at_value(node: Node, attribute: Attribute) -> Place {
    at_offset(node, attribute.range_value().start)
}

/// An element of the table with its attributes, a comment or white space.
fn check_node(node: Node) -> Result<()> {
    if node.is_text() {
        let text = node.text().unwrap_or_default();
        let blank = text.len() - text.trim_start().len();
        let stray = || at_offset(node, node.range().start + blank).error("an element", format!("the text `{}`", text.trim()));
        return if text.trim().is_empty() { Ok(()) } else { Err(stray()) };
    }
    if !node.is_element() {
        return Ok(());
    }
    let Some((_, needed, allowed)) = ELEMENTS.iter().find(|e| e.0 == name(node)) else {
        let known: Vec<&str> = ELEMENTS.iter().map(|e| e.0).collect();
        return Err(at_node(node).error(format!("one of the elements {}", known.join(", ")), format!("`{}`", name(node))));
    };
    for attribute in node.attributes() {
        if !needed.contains(&attribute.name()) && !allowed.contains(&attribute.name()) {
            let known = [*needed, *allowed].concat().join(", ");
            let place = at_offset(node, attribute.range().start);
            return Err(place.error(format!("one of the attributes {known}"), format!("`{}`", attribute.name())));
        }
    }
    if let Some(missing) = needed.iter().find(|a| !node.has_attribute(**a)) {
        return Err(at_node(node).error(format!("the attribute {missing}"), format!("{} without it", name(node))));
    }
    match node.children().find(|n| n.is_element() || n.text().is_some_and(|t| n.is_text() && !t.trim().is_empty())) {
        Some(inside) => Err(at_node(inside).error(format!("nothing inside {}", name(node)), "something")),
        None => Ok(()),
    }
}

/// An attribute that [`check_node`] found to be there.
fn value<'n>(node: Node<'n, '_>, name: &str) -> (&'n str, Place) {
    node.attribute_node(name).map_or(("", at_node(node)), |a| (a.value(), at_value(node, a)))
}

/// The one character that names a symbol.
fn character(node: Node, attribute: &str) -> Result<(char, Place)> {
    let (text, place) = value(node, attribute);
    let mut characters = text.chars();
    match (characters.next(), characters.next()) {
        (Some(c), None) if !c.is_whitespace() => Ok((c, place)),
        _ => Err(place.error("a symbol of one character", format!("{text:?}"))),
    }
}

#[derive(Default)]
struct Reader {
    builder: Builder,
    variables: BTreeSet<char>,
    constants: BTreeMap<char, bool>,
    /// Symbols that stand for a bracket.
    brackets: BTreeMap<char, Symbol>,
    commands: BTreeMap<char, Command>,
}

impl Reader {
    fn attributes_of_root(&mut self, root: Node) -> Result<()> {
        for attribute in root.attributes() {
            let place = at_value(root, attribute);
            match attribute.name() {
                "DESC" => self.builder.title = attribute.value().to_owned(),
                "INITAGE" => {
                    let age = attribute.value().trim().parse::<f64>().ok().filter(|age| age.is_finite() && *age >= 0.0);
                    let age = age.ok_or_else(|| place.error("an age of at least 0", format!("{:?}", attribute.value())))?;
                    self.builder.initial_age = Some(age);
                }
                other => {
                    let place = at_offset(root, attribute.range().start);
                    return Err(place.error("one of the attributes DESC, INITAGE", format!("`{other}`")));
                }
            }
        }
        Ok(())
    }

    fn declaration(&mut self, node: Node) -> Result<()> {
        let (symbol, place) = character(node, "CHAR")?;
        if self.variables.contains(&symbol) || self.constants.contains_key(&symbol) {
            return Err(place.error("a symbol not declared yet", format!("`{symbol}` again")));
        }
        match name(node) {
            "VARIABLE" => drop(self.variables.insert(symbol)),
            _ => drop(self.constants.insert(symbol, false)),
        }
        Ok(())
    }

    fn command(&mut self, node: Node) -> Result<()> {
        let (symbol, place) = character(node, "SYMBOL")?;
        let (word, at) = value(node, "CMD");
        let (action, most) = match word {
            "F" => (Action::Forward, 1),
            "R" => (Action::Rotate, 3),
            "L" => (Action::Leaf, 1),
            "[" => (Action::Push, 0),
            "]" => (Action::Pop, 0),
            _ => return Err(at.error("one of the commands F, R, [, ], L", format!("{word:?}"))),
        };
        let (text, at) = value(node, "ARG");
        let numbers = text.split(',').map(str::trim).filter(|_| !text.trim().is_empty());
        let numbers = numbers.map(|n| n.parse::<f64>().ok().filter(|v| v.is_finite()));
        let defaults: Option<Vec<f64>> = numbers.collect();
        let defaults = defaults.ok_or_else(|| at.error("numbers with commas between them", format!("{text:?}")))?;
        if defaults.len() > most || (action == Action::Rotate && defaults.is_empty()) {
            let expected =
                if action == Action::Rotate { "1 to 3 angles for R".to_owned() } else { format!("at most {most} for {word}") };
            return Err(at.error(expected, format!("{} numbers", defaults.len())));
        }
        match action {
            Action::Push => drop(self.brackets.insert(symbol, Symbol::PUSH)),
            Action::Pop => drop(self.brackets.insert(symbol, Symbol::POP)),
            _ if matches!(symbol, '[' | ']') => return Err(at.error("a bracket's own command", format!("{word:?}"))),
            _ => {}
        }
        match self.commands.insert(symbol, Command { action, defaults }) {
            None => Ok(()),
            Some(_) => Err(place.error("one command for a symbol", format!("a second one for `{symbol}`"))),
        }
    }

    fn initiator(&mut self, node: Node) -> Result<()> {
        let symbols = self.sequence(node, "START")?;
        if symbols.is_empty() {
            return Err(value(node, "START").1.error("a symbol", "none"));
        }
        match self.builder.axiom.replace((symbols, vec![])) {
            None => Ok(()),
            Some(_) => Err(at_node(node).error("one INITIATOR", "a second one")),
        }
    }

    fn production(&mut self, node: Node) -> Result<()> {
        let (predecessor, place) = character(node, "P")?;
        if self.brackets.contains_key(&predecessor) || matches!(predecessor, '[' | ']') {
            return Err(place.error("a symbol other than a bracket", format!("`{predecessor}`")));
        }
        match self.constants.get_mut(&predecessor) {
            // Truelsen's "Simple tree" does it.
            Some(warned @ false) => {
                *warned = true;
                let message =
                    format!("line {}: the CONSTANT `{predecessor}` has a PRODUCTION; it is taken for a VARIABLE", place.line);
                self.builder.warnings.push(Warning::new("constant-with-production", message));
            }
            None if !self.variables.contains(&predecessor) => {
                return Err(place.error("a symbol declared as VARIABLE", format!("the undefined symbol `{predecessor}`")));
            }
            _ => {}
        }
        let successor = self.sequence(node, "S")?;
        let likelihood = node.attribute_node("LIKELIHOOD").map(|a| {
            let number = a.value().trim().parse::<f64>().ok().filter(|p| (0.0..=1.0).contains(p));
            number.ok_or_else(|| at_value(node, a).error("a likelihood from 0 to 1", format!("{:?}", a.value())))
        });
        self.builder.rules.push(Rule {
            place,
            symbol: intern(&mut self.builder.alphabet, &predecessor.to_string(), 0, place)?,
            left: vec![],
            right: vec![],
            condition: None,
            likelihood: likelihood.transpose()?.map(Expr::Number),
            successor,
            arguments: vec![],
        });
        Ok(())
    }

    /// The symbols of an attribute; white space does not count.
    fn sequence(&mut self, node: Node, attribute: &str) -> Result<Vec<Symbol>> {
        let (text, start) = value(node, attribute);
        let (mut symbols, mut opened) = (vec![], vec![]);
        for (i, c) in text.chars().enumerate().filter(|(_, c)| !c.is_whitespace()) {
            let place = Place { column: start.column + i as u32, ..start };
            let symbol = match (self.brackets.get(&c), c) {
                (Some(bracket), _) => *bracket,
                (None, '[') => Symbol::PUSH,
                (None, ']') => Symbol::POP,
                _ => self.declared(c, place)?,
            };
            match symbol {
                Symbol::PUSH => opened.push(place),
                Symbol::POP if opened.pop().is_none() => {
                    return Err(place.error("a symbol, or a `[` before this bracket", format!("`{c}`")));
                }
                _ => {}
            }
            symbols.push(symbol);
        }
        match opened.pop() {
            Some(place) => Err(place.error("a `]` for this bracket", "none")),
            None => Ok(symbols),
        }
    }

    fn declared(&mut self, c: char, place: Place) -> Result<Symbol> {
        if self.variables.contains(&c) || self.constants.contains_key(&c) || self.commands.contains_key(&c) {
            return self.builder.symbol(&c.to_string(), 0, place);
        }
        Err(place.error("a symbol declared as VARIABLE or CONSTANT, or one with a COMMAND", format!("the undefined symbol `{c}`")))
    }

    fn finish(mut self, root: Place) -> Result<Grammar> {
        let is_bracket = |c: &&char| matches!(c, '[' | ']') || self.brackets.contains_key(c);
        for c in self.variables.iter().chain(self.constants.keys()).filter(|c| !is_bracket(c)) {
            self.builder.declared.insert(c.to_string());
            self.builder.commands.insert(c.to_string(), Command { action: Action::Nothing, defaults: vec![] });
        }
        for (c, command) in self.commands {
            if !matches!(command.action, Action::Push | Action::Pop) {
                self.builder.declared.insert(c.to_string());
                self.builder.commands.insert(c.to_string(), command);
            }
        }
        // Ours: his steps are a tenth of a unit, and a trunk is thinner than a step is long.
        self.builder.turtle.trunk_radius_m = 0.02;
        self.builder.finish(root)
    }
}
