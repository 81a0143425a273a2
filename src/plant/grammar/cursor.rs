//! A place in a grammar's text, and the errors that name it.

use crate::Error;

/// Line and column, from 1; columns count characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Place {
    pub line: u32,
    pub column: u32,
}

impl Place {
    /// What is wrong here.
    pub fn error(self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::Grammar { line: self.line, column: self.column, expected: expected.into(), found: found.into() }
    }
}

/// Reads a text character by character. `#` begins a comment; a line's end is white space only inside parentheses and brackets.
#[derive(Debug, Clone)]
pub struct Cursor<'t> {
    rest: &'t str,
    place: Place,
    /// How many parentheses and brackets are open: inside them a new line is nothing but space.
    pub open: u32,
}

impl<'t> Cursor<'t> {
    pub fn new(text: &'t str) -> Self {
        Self { rest: text, place: Place { line: 1, column: 1 }, open: 0 }
    }

    pub fn place(&self) -> Place {
        self.place
    }

    pub fn rest(&self) -> &'t str {
        self.rest
    }

    pub fn peek(&self) -> Option<char> {
        self.rest.chars().next()
    }

    /// Takes one character as it is.
    pub fn bump(&mut self) -> Option<char> {
        let c = self.peek()?;
        self.rest = &self.rest[c.len_utf8()..];
        self.place = match c {
            '\n' => Place { line: self.place.line + 1, column: 1 },
            _ => Place { column: self.place.column + 1, ..self.place },
        };
        Some(c)
    }

    /// Past white space and comments, to the end of the line or of the statement.
    pub fn skip_space(&mut self) {
        loop {
            match self.peek() {
                Some('#') => {
                    while self.peek().is_some_and(|c| c != '\n') {
                        self.bump();
                    }
                }
                Some('\n') if self.open == 0 => return,
                Some(c) if c.is_whitespace() => {
                    self.bump();
                }
                _ => return,
            }
        }
    }

    /// Past white space, comments and empty lines.
    pub fn skip_lines(&mut self) {
        let open = std::mem::replace(&mut self.open, 1);
        self.skip_space();
        self.open = open;
    }

    /// Takes `token` when it stands next, after white space.
    pub fn take(&mut self, token: &str) -> bool {
        self.skip_space();
        let found = self.rest.starts_with(token);
        if found {
            for _ in token.chars() {
                self.bump();
            }
        }
        found
    }

    /// Takes the characters that fit.
    pub fn take_while(&mut self, fits: impl Fn(char) -> bool) -> &'t str {
        let before = self.rest;
        while self.peek().is_some_and(&fits) {
            self.bump();
        }
        &before[..before.len() - self.rest.len()]
    }

    /// An arrow stands next: `->`, `→`.
    pub fn at_arrow(&self) -> bool {
        self.rest.starts_with("->") || self.rest.starts_with('→')
    }

    pub fn take_arrow(&mut self) -> bool {
        self.take("->") || self.take("→")
    }

    /// A statement ends here.
    pub fn at_end(&mut self) -> bool {
        self.skip_space();
        matches!(self.peek(), None | Some('\n' | ';'))
    }

    /// What stands next, for a message.
    pub fn found(&mut self) -> String {
        self.skip_space();
        match self.peek() {
            None => "the end of the text".to_owned(),
            Some('\n') => "the end of the line".to_owned(),
            Some(_) if self.at_arrow() => "an arrow".to_owned(),
            Some(c) if is_word(c) => format!("`{}`", self.rest.chars().take_while(|c| is_word(*c)).take(24).collect::<String>()),
            Some(c) => format!("`{}`", c.escape_debug()),
        }
    }

    /// An error at the next thing that is no white space.
    pub fn error(&mut self, expected: impl Into<String>) -> Error {
        let found = self.found();
        self.place.error(expected, found)
    }
}

/// Letters, digits and the underscore: what numbers and the names in expressions are made of.
pub fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}
