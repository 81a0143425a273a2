//! What a renderer draws and a glTF file holds: a surface and what it is made of. Sphere-boards, grown trees and imported files all
//! come down to a list of these.

use std::sync::Arc;

use glam::Vec3;
use image::RgbaImage;

use super::{ModelCrown, TreeModel, Trunk};
use crate::geom::{Bounds, Surface};
use crate::raster::{self, ALPHA_CUTOFF, Wrap, to_linear};

/// One surface of one material.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// What the file calls it, for messages.
    pub name: String,
    /// Polygons with normals; texture coordinates where the material has a texture.
    pub surface: Surface,
    /// What it is made of.
    pub material: Material,
    /// The centre of a sphere-board crown, whose outline grows when drawn (She §3.3); `None` for everything else.
    pub crown_center: Option<Vec3>,
}

/// How a surface looks: the part of glTF's material that a tree needs.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// What the file calls it; empty when it does not say.
    pub name: String,
    /// Multiplies the texture, or is the colour without one: linear light, straight alpha.
    pub factor: [f32; 4],
    /// Base colour, sRGB with straight alpha. Shared, since many parts of a file may use one picture.
    pub texture: Option<Arc<RgbaImage>>,
    /// Normals in tangent space as glTF has them: right, up and out of the surface in red, green and blue, 0.5 + 0.5 n.
    pub normal_texture: Option<Arc<RgbaImage>>,
    /// How the textures go on outside 0..1.
    pub wrap: Wrap,
    /// Texels of less alpha are not there; `None` for an opaque surface.
    pub alpha_cutoff: Option<f32>,
    /// Whether the back of a polygon is seen too.
    pub two_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            factor: [1.0; 4],
            texture: None,
            normal_texture: None,
            wrap: Wrap::Repeat,
            alpha_cutoff: None,
            two_sided: false,
        }
    }
}

impl Part {
    /// Checks what a file or a renderer relies on: polygons there, lists of equal length, corners that exist, finite numbers, unit
    /// normals, texture coordinates where there is a texture.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn check(&self) -> Result<(), String> {
        super::check_surface(&self.surface, self.material.texture.is_some())
    }
}

impl Material {
    /// The same as the software rasteriser takes it.
    pub fn raster(&self) -> raster::Material<'_> {
        raster::Material {
            texture: self.texture.as_deref(),
            wrap: self.wrap,
            factor: self.factor,
            alpha_cutoff: self.alpha_cutoff.unwrap_or(0.0),
            two_sided: self.two_sided,
        }
    }
}

impl TreeModel {
    /// The model as a renderer takes it: crowns, then the trunk.
    pub fn parts(&self) -> Vec<Part> {
        let crowns = self.crowns.iter().enumerate().map(|(number, crown)| crown.part(number));
        crowns.chain(self.trunk.as_ref().map(Trunk::part)).collect()
    }
}

impl ModelCrown {
    /// As a renderer takes it; the how manieth crown it is gives its name.
    pub fn part(&self, number: usize) -> Part {
        let material = Material {
            name: "foliage".to_owned(),
            texture: Some(Arc::new(self.texture.clone())),
            wrap: Wrap::Clamp,
            alpha_cutoff: Some(ALPHA_CUTOFF),
            ..Material::default()
        };
        Part { name: format!("crown_{number}"), surface: self.surface.clone(), material, crown_center: Some(self.center) }
    }
}

impl Trunk {
    /// As a renderer takes it.
    pub fn part(&self) -> Part {
        let [r, g, b] = self.bark.map(to_linear);
        let material = Material { name: "bark".to_owned(), factor: [r, g, b, 1.0], ..Material::default() };
        Part { name: "trunk".to_owned(), surface: self.surface.clone(), material, crown_center: None }
    }
}

/// The box around all parts, `None` when there is nothing.
pub fn bounds(parts: &[Part]) -> Option<Bounds> {
    Bounds::of(parts.iter().flat_map(|part| part.surface.mesh.positions.iter().copied()))
}
