//! What can go wrong, as types: one variant per cause, each saying what was expected, what was found and what to do.

use std::path::PathBuf;

/// The library's result type.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Every failure of the library. The command line prints `Display` after the name of the photograph.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter outside its range, or of the wrong kind.
    #[error("{name} must be {expected}, but is {found}; give a value in that range")]
    Parameter {
        /// The parameter as the command line spells it.
        name: String,
        /// Its range or its choices.
        expected: String,
        /// The offending value.
        found: String,
    },
    /// A parameter name that no table holds.
    #[error("there is no parameter {name}; known here are {known}")]
    UnknownParameter {
        /// What was asked for.
        name: String,
        /// The names of the table.
        known: String,
    },
    /// A file that could not be read.
    #[error("cannot read {path}: {cause}; check the path and its permissions")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// A file that could not be written. Nothing is left behind.
    #[error("cannot write {path}: {cause}; check free space and permissions, or give another --out")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// Two photographs whose outputs would have one name.
    #[error("{first} and {second} would both be written as {stem}.*; rename one of them, or run them into two folders with --out")]
    SameStem {
        /// The common file name without extension.
        stem: String,
        /// The photograph named first.
        first: PathBuf,
        /// The photograph named later.
        second: PathBuf,
    },
    /// Options that cannot be used together.
    #[error("{what}; {remedy}")]
    Usage {
        /// What does not fit.
        what: String,
        /// What to do instead.
        remedy: &'static str,
    },
    /// A result that breaks the library's own promise: a bug, not a user's mistake.
    #[error("internal check failed in {stage}: {what}; please report this with the photograph and the parameters")]
    Internal {
        /// Where.
        stage: &'static str,
        /// Which promise.
        what: String,
    },
    // Rasteriser, exemplar and texture.
    /// A view that cannot be drawn.
    #[error(
        "a view needs 1 to 16384 pixels a side, a finite direction and a positive half-height, but has {found}; give another size"
    )]
    View {
        /// Its size.
        found: String,
    },
    /// A surface whose arrays do not belong together.
    #[error("a surface needs polygons over its own vertices and one normal and texture coordinate per vertex, but has {found}")]
    Surface {
        /// What does not fit.
        found: String,
    },
    /// A crown without foliage to cut an exemplar from.
    #[error(
        "the texture needs at least 2×2 pixels of foliage inside the crown, but there is {found}; mark the crown with --mask or --rect"
    )]
    NoFoliage {
        /// What there is instead.
        found: String,
    },
    /// A crown mesh that cannot be textured.
    #[error("the texture needs a closed crown mesh around its centre, but has {found}; try --detail medium or another seed")]
    Untexturable {
        /// What there is instead.
        found: String,
    },
}

/// Something a user should know about a result that was produced all the same.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Warning {
    /// Stable word for machines, for example `crown-cut-by-frame`.
    pub code: String,
    /// One sentence for people.
    pub message: String,
}

impl Warning {
    /// A warning with its code and sentence.
    pub fn new(code: &str, message: impl Into<String>) -> Self {
        Self { code: code.to_owned(), message: message.into() }
    }
}
