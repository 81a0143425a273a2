//! Scenes that come with the program: the groves of the papers, and one larger than any of theirs.

use crate::{Error, Result};

use super::SceneFile;

/// A scene that comes with the program.
#[derive(Debug, Clone, Copy)]
pub struct Preset {
    /// What the command line calls it.
    pub name: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// Its file.
    pub text: &'static str,
}

/// All of them, in the order of the table.
pub const PRESETS: [Preset; 6] = [
    Preset { name: "she-540", source: "She §3.5, fig. 19", text: include_str!("../presets/she-540.toml") },
    Preset { name: "she-fig18", source: "She §3.5, fig. 18", text: include_str!("../presets/she-fig18.toml") },
    Preset { name: "lluch-200", source: "Lluch 2004 §5, fig. 10", text: include_str!("../presets/lluch-200.toml") },
    Preset { name: "truelsen-10k", source: "Truelsen §7, fig. 30–32", text: include_str!("../presets/truelsen-10k.toml") },
    Preset { name: "rebollo-100", source: "Rebollo §V, fig. 12–14", text: include_str!("../presets/rebollo-100.toml") },
    Preset { name: "million", source: "ours", text: include_str!("../presets/million.toml") },
];

/// The scene of that name.
///
/// # Errors
/// [`Error::Parameter`] with the names there are.
pub fn preset(name: &str) -> Result<SceneFile> {
    let found = PRESETS.iter().find(|preset| preset.name == name).ok_or_else(|| Error::Parameter {
        name: "--preset".to_owned(),
        expected: format!("one of {}", PRESETS.map(|preset| preset.name).join(", ")),
        found: name.to_owned(),
    })?;
    SceneFile::parse(found.text)
}
