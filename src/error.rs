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
    // Segmentation.
    /// Too few pixels to hold a crown.
    #[error("the picture has {width}×{height} pixels, but a crown needs at least 16×16; give a larger photograph")]
    PictureTooSmall {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Sky only, or one colour.
    #[error(
        "the picture shows nothing but {what}, and a tree is expected; give a photograph of one tree, or its crown with --mask FILE"
    )]
    NothingToSee {
        /// What fills it: "sky", "one colour".
        what: &'static str,
    },
    /// Nothing in the picture looks like leaves.
    #[error(
        "no foliage found{within}: the dominant hue is {hue_deg:.0}° ({name}); if that is the crown's colour, give --hue LO..HI around it, \
         or draw the crown and give --mask FILE"
    )]
    NoFoliage {
        /// Where or in which range was looked, with a leading space; may be empty.
        within: String,
        /// The hue that most of the coloured pixels have, degrees.
        hue_deg: f64,
        /// Its name.
        name: &'static str,
    },
    /// Bare branches.
    #[error(
        "the tree seems to be leafless: twigs against the sky, and no crown of foliage above the ground; give a photograph in leaf, \
         or draw the crown and give --mask FILE"
    )]
    Leafless,
    /// A mask that does not fit the photograph.
    #[error(
        "the mask has {found_width}×{found_height} pixels, but the photograph has {width}×{height}; give a mask of the photograph's size"
    )]
    MaskSize {
        /// The photograph's columns.
        width: u32,
        /// The photograph's rows.
        height: u32,
        /// The mask's columns.
        found_width: u32,
        /// The mask's rows.
        found_height: u32,
    },
    /// A hint that contradicts the picture or itself.
    #[error("{flag} must be {expected}, but is {found}; correct it or leave it out")]
    Hint {
        /// The option.
        flag: &'static str,
        /// What it may be.
        expected: String,
        /// What it is.
        found: String,
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
