//! From a [`TreeModel`], or any list of parts, to the bytes of a GLB file.

use std::sync::Arc;

use gltf::json::{self, Index};
use image::RgbaImage;
use rayon::prelude::*;
use serde::Serialize;

use super::Part;
use super::writer::{Look, Writer, png};
use crate::model::{self, TreeModel, Wrap};
use crate::raster::{ALPHA_CUTOFF, to_linear};
use crate::{Error, Result};

/// Writes the model as a GLB file. Same model, same bytes.
///
/// # Errors
/// [`Error::Internal`] when the model breaks a promise ([`TreeModel::check`]).
pub fn write(model: &TreeModel) -> Result<Vec<u8>> {
    model.checked()?;
    let pictures = model.crowns.par_iter().map(|crown| png(&crown.texture)).collect::<Result<Vec<_>>>()?;
    let mut file = Writer::default();
    let mut parts = Vec::new();
    for (number, (crown, picture)) in model.crowns.iter().zip(&pictures).enumerate() {
        let name = format!("crown_{number}");
        let part = Part::Crown { center: crown.center };
        // Its chart stays within the image, with a gutter, so that nothing wraps.
        let texture = Some(file.texture(&name, picture, Wrap::Clamp));
        let look = Look { texture, alpha_cutoff: Some(ALPHA_CUTOFF), ..Look::default() };
        let material = file.material(&name, &look);
        parts.push(file.part(&name, &crown.surface, part, material)?);
    }
    if let Some(trunk) = &model.trunk {
        let [r, g, b] = trunk.bark.map(to_linear);
        let bark = Look { factor: [r, g, b, 1.0], ..Look::default() };
        let material = file.material("bark", &bark);
        parts.push(file.part("trunk", &trunk.surface, Part::Trunk {}, material)?);
    }
    file.finish(parts, &model.about, &model.about.program)
}

/// Writes parts as a GLB file, each with its own material, a picture that several share once. `about` becomes the file's
/// `extras.sphereboard`. Parts that are cut out or seen from both sides are foliage, all others wood. Same parts, same bytes.
///
/// # Errors
/// [`Error::Internal`] when a surface breaks a promise: nothing in it, lists of unlike length, corners beyond its vertices, numbers that
/// are not finite.
pub fn write_parts(parts: &[model::Part], about: &impl Serialize, program: &str) -> Result<Vec<u8>> {
    for part in parts {
        part.check().map_err(|what| Error::Internal { stage: "model::glb", what: format!("{}: {what}", part.name) })?;
    }
    let mut file = Writer::default();
    let pictures = Pictures::write(&mut file, parts.iter().map(|part| (part.name.as_str(), &part.material)))?;
    let mut nodes = Vec::new();
    for part in parts {
        let look = pictures.look(&part.material);
        let name = if part.material.name.is_empty() { &part.name } else { &part.material.name };
        let material = file.material(name, &look);
        let kind = if look.alpha_cutoff.is_some() || look.two_sided { Part::Leaves {} } else { Part::Wood {} };
        nodes.push(file.part(&part.name, &part.surface, kind, material)?);
    }
    file.finish(nodes, about, program)
}

/// The pictures of many materials in a file, each there once.
pub(super) struct Pictures<'a>(Vec<(&'a Arc<RgbaImage>, Wrap, Index<json::Texture>)>);

impl<'a> Pictures<'a> {
    /// Writes them.
    pub(super) fn write(file: &mut Writer, materials: impl IntoIterator<Item = (&'a str, &'a model::Material)>) -> Result<Self> {
        let mut wanted: Vec<(&Arc<RgbaImage>, Wrap, String)> = Vec::new();
        for (name, material) in materials {
            let normals = material.normal_texture.as_ref().map(|image| (image, format!("{name} normals")));
            for (image, name) in material.texture.as_ref().map(|image| (image, name.to_owned())).into_iter().chain(normals) {
                if !wanted.iter().any(|(known, wrap, _)| Arc::ptr_eq(known, image) && *wrap == material.wrap) {
                    wanted.push((image, material.wrap, name));
                }
            }
        }
        let encoded = wanted.par_iter().map(|(image, ..)| png(image)).collect::<Result<Vec<_>>>()?;
        let textures = wanted.into_iter().zip(&encoded);
        Ok(Self(textures.map(|((image, wrap, name), picture)| (image, wrap, file.texture(&name, picture, wrap))).collect()))
    }

    /// How the file says what `material` looks like.
    pub(super) fn look(&self, material: &model::Material) -> Look {
        let find = |image: &Arc<RgbaImage>| self.0.iter().find(|known| Arc::ptr_eq(known.0, image) && known.1 == material.wrap);
        let texture = |image: &Option<Arc<RgbaImage>>| image.as_ref().and_then(find).map(|known| known.2);
        Look {
            factor: material.factor,
            texture: texture(&material.texture),
            normal_texture: texture(&material.normal_texture),
            alpha_cutoff: material.alpha_cutoff,
            two_sided: material.two_sided,
        }
    }
}
