//! OBJ files: parts as text, with their materials (MTL) and pictures (PNG) beside them. Metres; quads stay quads.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::RgbaImage;

use super::Part;
use crate::raster::{PngEffort, png_with, to_srgb};
use crate::{Error, Result};

/// The files of an OBJ export: `path` itself, and beside it `<stem>.mtl` and a `<stem>_<part>.png` per picture. Same parts, same bytes.
///
/// Cut-outs are said twice, in the alpha of `map_Kd` and by `map_d`: programs look for either.
///
/// # Errors
/// [`Error::Internal`] when a surface breaks a promise ([`Part::check`]).
pub fn write(parts: &[Part], path: &Path) -> Result<Vec<(PathBuf, Vec<u8>)>> {
    let stem = path.file_stem().map_or_else(|| "tree".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let mut obj = format!("# sphereboard {}, metres, +Y up\nmtllib {stem}.mtl\n", env!("CARGO_PKG_VERSION"));
    let mut mtl = String::new();
    let mut pictures: Vec<(&Arc<RgbaImage>, String)> = Vec::new();
    let mut before = Counts::default();
    for part in parts {
        part.check().map_err(|what| Error::Internal { stage: "model::obj", what: format!("{}: {what}", part.name) })?;
        let picture = part.material.texture.as_ref().map(|image| match pictures.iter().find(|known| Arc::ptr_eq(known.0, image)) {
            Some((_, name)) => name.clone(),
            None => {
                let name = format!("{stem}_{}.png", part.name);
                pictures.push((image, name.clone()));
                name
            }
        });
        material(&mut mtl, part, picture.as_deref());
        surface(&mut obj, part, &mut before);
    }
    let mut files = vec![(path.to_owned(), obj.into_bytes()), (path.with_file_name(format!("{stem}.mtl")), mtl.into_bytes())];
    for (image, name) in pictures {
        files.push((path.with_file_name(name), png_with(image.as_ref(), PngEffort::Small)?));
    }
    Ok(files)
}

/// How many vertices and texture coordinates were written: OBJ numbers them through the whole file, from 1.
#[derive(Default)]
struct Counts {
    vertices: usize,
    uvs: usize,
}

// Writing to a string cannot fail, hence the discarded results below.

fn material(mtl: &mut String, part: &Part, picture: Option<&str>) {
    let [r, g, b, alpha] = part.material.factor;
    let [r, g, b] = [r, g, b].map(|c| f32::from(to_srgb(c)) / 255.0);
    let _ = writeln!(mtl, "newmtl {}\nKd {r} {g} {b}\nKs 0 0 0\nd {alpha}\nillum 1", name_of(part));
    if let Some(picture) = picture {
        let _ = writeln!(mtl, "map_Kd {picture}");
        if part.material.alpha_cutoff.is_some() {
            let _ = writeln!(mtl, "map_d {picture}");
        }
    }
    mtl.push('\n');
}

fn name_of(part: &Part) -> &str {
    if part.material.name.is_empty() { &part.name } else { &part.material.name }
}

fn surface(obj: &mut String, part: &Part, before: &mut Counts) {
    let surface = &part.surface;
    let _ = writeln!(obj, "o {}\nusemtl {}", part.name, name_of(part));
    for p in &surface.mesh.positions {
        let _ = writeln!(obj, "v {} {} {}", p.x, p.y, p.z);
    }
    for t in &surface.uvs {
        // An OBJ picture starts at its lower left corner.
        let _ = writeln!(obj, "vt {} {}", t.x, 1.0 - t.y);
    }
    for n in &surface.normals {
        let _ = writeln!(obj, "vn {} {} {}", n.x, n.y, n.z);
    }
    for polygon in surface.mesh.polygons() {
        obj.push('f');
        for &corner in polygon {
            let (vertex, uv) = (before.vertices + corner as usize + 1, before.uvs + corner as usize + 1);
            let _ =
                if surface.uvs.is_empty() { write!(obj, " {vertex}//{vertex}") } else { write!(obj, " {vertex}/{uv}/{vertex}") };
        }
        obj.push('\n');
    }
    before.vertices += surface.mesh.positions.len();
    before.uvs += surface.uvs.len();
}
