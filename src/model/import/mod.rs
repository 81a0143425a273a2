//! Trees of any other program: glTF 2.0 (.glb, .gltf) and OBJ with MTL, to the [`Part`]s that a renderer draws. The content decides,
//! never the file's name.
//!
//! Nothing is moved, turned or scaled: what the file calls 1 is read as a metre.

mod folder;
mod gltf;
mod picture;

use std::path::Path;

use serde_json::Value;

use super::{Part, TreeModel, glb};
use crate::{Error, Result, Warning, files};

pub use folder::Folder;

/// What a file holds.
#[derive(Debug, Clone)]
pub struct Imported {
    /// Its surfaces in world space; at least one, each with at least one polygon.
    pub parts: Vec<Part>,
    /// The whole model, when `sphereboard model` wrote the file: the parts are then those of [`TreeModel::parts`].
    pub tree_model: Option<TreeModel>,
    /// What was left out or read otherwise than the file says.
    pub warnings: Vec<Warning>,
}

/// Reads a model file with all that belongs to it in its folder.
///
/// # Errors
/// Those of [`files::read_whole`], and [`Error::InFile`] around those of [`read`].
pub fn open(path: &Path) -> Result<Imported> {
    let bytes = files::read_whole(path, u64::MAX)?;
    read(&bytes, &Folder::of(path)).map_err(|cause| Error::InFile { path: path.to_owned(), cause: Box::new(cause) })
}

/// Reads the bytes of a model file; what else it names lies in `folder`.
///
/// # Errors
/// [`Error::NotAModel`], [`Error::BrokenModel`], [`Error::GltfExtension`] or [`Error::EmptyModel`].
pub fn read(bytes: &[u8], folder: &Folder) -> Result<Imported> {
    let mut warnings = Warnings::default();
    let (parts, tree_model) = match kind_of(bytes) {
        Kind::Gltf => {
            let file = gltf::File::open(bytes)?;
            match file.own_extras().and_then(|extras| own_model(bytes, extras, &mut warnings)) {
                Some(model) => (model.parts(), Some(model)),
                None => (file.parts(folder, &mut warnings)?, None),
            }
        }
        Kind::Other(found) => return Err(Error::NotAModel { found }),
    };
    if parts.is_empty() {
        let why = if warnings.list.is_empty() { String::new() } else { format!(" ({})", warnings.list[0].message) };
        return Err(Error::EmptyModel { why });
    }
    Ok(Imported { parts, tree_model, warnings: warnings.list })
}

/// Our own model, if it is still as we wrote it.
fn own_model(bytes: &[u8], extras: &Value, warnings: &mut Warnings) -> Option<TreeModel> {
    // What a tree model alone says of itself; other files of ours say other things.
    extras.get("feature_points")?;
    match glb::read(bytes) {
        Ok(model) => Some(model),
        Err(error) => {
            warnings.add("changed-model", format!("a sphereboard model that was changed is read as any other mesh: {error}"));
            None
        }
    }
}

enum Kind {
    Gltf,
    Other(&'static str),
}

/// What the first bytes say.
fn kind_of(bytes: &[u8]) -> Kind {
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    match start {
        _ if bytes.starts_with(b"glTF") => Kind::Gltf,
        [b'{', ..] => Kind::Gltf,
        [] => Kind::Other("nothing"),
        _ => Kind::Other("something else"),
    }
}

/// The most warnings that a file can earn; a damaged one might have a million.
const MOST_WARNINGS: usize = 40;

/// Warnings without repetition.
#[derive(Debug, Default)]
struct Warnings {
    list: Vec<Warning>,
}

impl Warnings {
    fn add(&mut self, code: &str, message: String) {
        let warning = Warning::new(code, message);
        if self.list.len() < MOST_WARNINGS && !self.list.contains(&warning) {
            self.list.push(warning);
        }
    }

    /// A texture that its surfaces go without.
    fn missing_texture(&mut self, name: &str, why: &str) {
        self.add("missing-texture", format!("the texture {name} {why}; its surfaces are drawn in plain colour, without cut-outs"));
    }
}
