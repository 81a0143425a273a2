//! From a [`TreeModel`], or any list of parts, to the bytes of a GLB file.

use std::sync::Arc;

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
        let look = Look { factor: [1.0; 4], texture, alpha_cutoff: Some(ALPHA_CUTOFF), two_sided: false };
        let material = file.material(&name, &look);
        parts.push(file.part(&name, &crown.surface, part, material)?);
    }
    if let Some(trunk) = &model.trunk {
        let [r, g, b] = trunk.bark.map(to_linear);
        let bark = Look { factor: [r, g, b, 1.0], texture: None, alpha_cutoff: None, two_sided: false };
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
    let mut pictures: Vec<(&Arc<RgbaImage>, Wrap, &str)> = Vec::new();
    let same = |a: &(&Arc<RgbaImage>, Wrap, &str), image: &Arc<RgbaImage>, wrap| Arc::ptr_eq(a.0, image) && a.1 == wrap;
    for part in parts {
        if let Some(image) = &part.material.texture
            && !pictures.iter().any(|known| same(known, image, part.material.wrap))
        {
            pictures.push((image, part.material.wrap, &part.name));
        }
    }
    let encoded = pictures.par_iter().map(|(image, _, _)| png(image)).collect::<Result<Vec<_>>>()?;
    let mut file = Writer::default();
    let textures: Vec<_> =
        pictures.iter().zip(&encoded).map(|((_, wrap, name), picture)| file.texture(name, picture, *wrap)).collect();
    let mut nodes = Vec::new();
    for part in parts {
        let model::Material { name, factor, texture, wrap, alpha_cutoff, two_sided, .. } = &part.material;
        let known = texture.as_ref().and_then(|image| pictures.iter().position(|known| same(known, image, *wrap)));
        let look =
            Look { factor: *factor, texture: known.map(|i| textures[i]), alpha_cutoff: *alpha_cutoff, two_sided: *two_sided };
        let material = file.material(if name.is_empty() { &part.name } else { name }, &look);
        let kind = if alpha_cutoff.is_some() || *two_sided { Part::Leaves {} } else { Part::Wood {} };
        nodes.push(file.part(&part.name, &part.surface, kind, material)?);
    }
    file.finish(nodes, about, program)
}
