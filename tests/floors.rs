//! A module imports only from lower floors (DESIGN §3), and from a sibling only along an arrow of the data flow (DESIGN §2).
//!
//! Reads the source text: every path that starts with `crate::`, and every chain of `super::` that climbs out of its module.

use std::fs;
use std::path::{Path, PathBuf};

/// Every module of `src/` and its floor. Modules of later issues are listed where DESIGN §3 puts them.
const FLOORS: [(&str, u8); 20] = [
    ("error", 0),
    ("seed", 0),
    ("params", 0),
    ("files", 0),
    ("geom", 0),
    ("raster", 0),
    ("page", 0),
    ("photo", 1),
    ("plant", 1),
    ("metrics", 1),
    ("crown", 2),
    ("texture", 2),
    ("model", 3),
    ("repr", 4),
    ("gpu", 5),
    ("render", 6),
    ("compare", 7),
    ("grove", 7),
    ("report", 7),
    ("cli", 8),
];

/// Who may import from a sibling on the same floor: (importer, imported).
const ARROWS: [(&str, &str); 10] = [
    ("seed", "error"),
    ("params", "error"),
    ("files", "error"),
    ("geom", "error"),
    ("geom", "seed"),
    ("raster", "error"),
    ("raster", "geom"),
    ("page", "error"),
    ("report", "compare"),
    // What `auto` draws a grove with is what a comparison recommends.
    ("grove", "compare"),
];

/// What `lib.rs` offers at the root, and the module it comes from.
const AT_THE_ROOT: [(&str, &str); 6] =
    [("Error", "error"), ("Result", "error"), ("Warning", "error"), ("Seed", "seed"), ("params", "params"), ("choices", "params")];

/// The module that a name after `crate::` belongs to.
fn module_of(name: &str) -> &str {
    AT_THE_ROOT.iter().find(|(item, _)| *item == name).map_or(name, |(_, module)| module)
}

fn floor_of(module: &str) -> Result<u8, String> {
    let row = FLOORS.iter().find(|(name, _)| *name == module);
    row.map(|(_, floor)| *floor).ok_or_else(|| format!("`{module}` has no floor: give it one in FLOORS, where DESIGN §3 puts it"))
}

/// Why `importer` may not import `imported`; `Ok` when it may.
fn check(importer: &str, imported: &str) -> Result<(), String> {
    let (from, to) = (floor_of(importer)?, floor_of(imported)?);
    if importer == imported || to < from || ARROWS.contains(&(importer, imported)) {
        return Ok(());
    }
    Err(format!("`{importer}` (floor {from}) imports `{imported}` (floor {to}): only lower floors, or an arrow in ARROWS"))
}

/// The text without comments, so that documentation may name what code may not. Strings that hold `//` lose their rest: harmless.
fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// The modules that a source text names after `crate::`, as written: `crate::geom::Mesh`, `crate::{Error, photo::{a, b}}`.
fn imports(text: &str) -> Vec<String> {
    let text = without_comments(text);
    let path_ends = |before: &str| !before.ends_with(|c: char| c.is_alphanumeric() || c == '_');
    text.match_indices("crate::")
        .filter(|(at, _)| path_ends(&text[..*at]))
        .flat_map(|(at, found)| first_segments(&text[at + found.len()..]))
        .map(|name| module_of(&name).to_owned())
        .collect()
}

/// The first segments of a path, or of every path of a brace group.
fn first_segments(path: &str) -> Vec<String> {
    let identifier = |text: &str| text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let Some(group) = path.strip_prefix('{') else { return vec![identifier(path)] };
    let (mut depth, mut names, mut start) = (1, vec![], 0);
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 || (depth == 1 && c == ',') {
            names.push(identifier(&group[start..at]));
            start = at + 1;
        }
        if depth == 0 {
            break;
        }
    }
    names.retain(|name| !name.is_empty());
    names
}

/// The longest chain of `super::` outside the unit tests, which stand last and one module deeper.
fn longest_climb(text: &str) -> usize {
    let text = without_comments(text);
    let code = text.split("\nmod tests {").next().unwrap_or_default();
    (1..8).take_while(|n| code.contains(&"super::".repeat(*n))).count()
}

/// Every source file below `folder`, in order of name.
fn source_files(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).expect("a folder of src/").map(|e| e.expect("a readable entry").path()).collect();
    entries.sort();
    let below = |path: PathBuf| if path.is_dir() { source_files(&path) } else { vec![path] };
    entries.into_iter().flat_map(below).filter(|p| p.extension().is_some_and(|e| e == "rs")).collect()
}

/// What is wrong with one file of `src/`, given its path below it.
fn faults(path: &Path, text: &str) -> Vec<String> {
    let mut parts: Vec<String> = path.with_extension("").iter().map(|p| p.to_string_lossy().into_owned()).collect();
    parts.retain(|part| part != "mod");
    let mut faults: Vec<String> = imports(text).iter().filter_map(|name| check(&parts[0], name).err()).collect();
    if longest_climb(text) >= parts.len() {
        faults.push("`super::` reaches the root of the crate: write `crate::`, which this test can read".to_owned());
    }
    faults.into_iter().map(|fault| format!("src/{}: {fault}", path.display())).collect()
}

#[test]
fn modules_import_only_from_lower_floors() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = vec![];
    for file in source_files(&src) {
        let path = file.strip_prefix(&src).expect("a file of src/");
        if !["lib.rs", "main.rs"].iter().any(|root| path == Path::new(root)) {
            all.extend(faults(path, &fs::read_to_string(&file).expect("UTF-8 source")));
        }
    }
    assert!(all.is_empty(), "\n{}", all.join("\n"));
}

#[test]
fn the_table_and_lib_name_the_same_modules() {
    let lib = without_comments(include_str!("../src/lib.rs"));
    for module in lib.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')) {
        floor_of(module).unwrap();
    }
}

#[test]
fn imports_are_read_in_every_form() {
    let text = "use crate::{Error, Result, photo::{Photo, decode::{a, b}}, geom as g};\npub use crate::cli;\nfn f(x: crate::model::Tree) {}\n\
                // use crate::report;\n    $crate::choices!{}\nuse mycrate::render;\nuse crate::{\n    crown::Crown,\n    texture::*,\n};";
    assert_eq!(imports(text), ["error", "error", "photo", "geom", "cli", "model", "params", "crown", "texture"]);
}

#[test]
fn wrong_imports_are_noticed() {
    let found = |path: &str, text: &str| faults(Path::new(path), text).len();
    assert_eq!(found("geom/mesh.rs", "use crate::{Error, photo::Photo};"), 1, "a higher floor");
    assert_eq!(found("photo/mod.rs", "fn f() { crate::cli::run(); }"), 1, "a higher floor, without use");
    assert_eq!(found("crown/mod.rs", "use crate::texture::Atlas;"), 1, "a sibling without an arrow");
    assert_eq!(found("crown/mod.rs", "use super::texture::Atlas;"), 1, "past the check, over the root");
    assert_eq!(found("crown/star.rs", "use super::super::texture::Atlas;"), 1, "past the check, over the root");
    assert_eq!(found("crown/star.rs", "use crate::nowhere::X;"), 1, "a module without a floor");
    assert_eq!(found("crown/star.rs", "use super::Outline;\nuse crate::geom::Mesh;\nuse crate::crown::Y;"), 0);
    assert_eq!(found("seed.rs", "use crate::Result;\n#[cfg(test)]\nmod tests {\n    use super::*;\n}"), 0);
}
