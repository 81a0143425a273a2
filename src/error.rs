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
    // -- silhouette and crown --
    /// A crown mask without pixels, or with too few for an outline.
    #[error("the crown mask needs at least {needed} connected pixels, but has {found}; mark the crown with --rect or --mask")]
    CrownTooSmall {
        /// Smallest number of pixels that has an outline worth modelling.
        needed: usize,
        /// What there is.
        found: usize,
    },
    /// Two masks of one photograph that do not match.
    #[error("the {what} has {}×{} pixels, but {}×{} were expected; give masks of the photograph's own size", found.0, found.1, expected.0, expected.1)]
    MaskSize {
        /// Which mask.
        what: &'static str,
        /// Width and height expected.
        expected: (u32, u32),
        /// Width and height found.
        found: (u32, u32),
    },
    /// An outline that encloses nothing.
    #[error("view {view} of the tree has no usable outline: {why}; check its mask")]
    Outline {
        /// Which view, from 0.
        view: usize,
        /// What is wrong.
        why: String,
    },
    /// A result that breaks the library's own promise: a bug, not a user's mistake.
    #[error("internal check failed in {stage}: {what}; please report this with the photograph and the parameters")]
    Internal {
        /// Where.
        stage: &'static str,
        /// Which promise.
        what: String,
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
