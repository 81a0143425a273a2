//! Trees of any other program: glTF 2.0 (.glb, .gltf) and OBJ with MTL, to the [`Part`]s that a renderer draws. The content decides,
//! never the file's name.
//!
//! Nothing is moved, turned or scaled: what the file calls 1 is read as a metre.

mod folder;
mod gltf;
mod mtl;
mod obj;
pub(super) mod picture;
mod text;

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
        Kind::Obj => (obj::parts(bytes, folder, &mut warnings)?, None),
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

fn broken_in(format: &'static str, what: impl Into<String>) -> Error {
    Error::BrokenModel { format, what: what.into() }
}

enum Kind {
    Gltf,
    Obj,
    Other(&'static str),
}

/// What the first bytes say.
fn kind_of(bytes: &[u8]) -> Kind {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    match text {
        [b'g', b'l', b'T', b'F', ..] | [b'{', ..] => Kind::Gltf,
        [] => Kind::Other("nothing (0 bytes)"),
        [b'K', b'a', b'y', b'd', b'a', b'r', b'a', ..] => Kind::Other("an FBX model"),
        [b'p', b'l', b'y', b'\n' | b'\r', ..] => Kind::Other("a PLY model"),
        [b'<', ..] => Kind::Other("XML (perhaps a Collada model)"),
        [b'P', b'K', 3, 4, ..] => Kind::Other("a ZIP archive (perhaps USDZ)"),
        [b'B', b'L', b'E', b'N', b'D', b'E', b'R', ..] => Kind::Other("a Blender file"),
        _ if image::guess_format(text).is_ok() => Kind::Other("a picture"),
        _ => kind_of_text(text),
    }
}

/// OBJ has no mark of its own: its first line that is no comment begins with one of its keywords.
fn kind_of_text(text: &[u8]) -> Kind {
    const KEYWORDS: [&[u8]; 12] = [b"v", b"vn", b"vt", b"vp", b"f", b"l", b"p", b"o", b"g", b"s", b"usemtl", b"mtllib"];
    let mut words =
        text.split(|&byte| byte == b'\n').filter_map(|line| line.split(u8::is_ascii_whitespace).find(|w| !w.is_empty()));
    match words.find(|word| !word.starts_with(b"#")) {
        Some(word) if KEYWORDS.contains(&word) => Kind::Obj,
        Some(b"newmtl") => Kind::Other("an MTL material library, which belongs to an OBJ file"),
        Some(b"solid") => Kind::Other("an STL model"),
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
