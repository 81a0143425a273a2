//! The software rasteriser: textured surfaces seen in parallel projection, as plain images (DESIGN §4, "Capture").
//!
//! The same bytes on every machine and any number of threads: rows are independent, and of two surfaces at one depth the first drawn
//! stays. In parallel projection the texture gradients are constant over a triangle, so its mip level is exact. Colours are averaged
//! in linear light.

use glam::{Vec2, Vec3};
use image::{GrayImage, RgbaImage};
use rayon::prelude::*;

use super::facet::{BAND, Facets, Shader};
use super::{ALPHA_CUTOFF, Texture, to_linear, to_srgb};
use crate::geom::{Bounds, Surface};
use crate::{Error, Result};

/// A parallel projection onto a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Right, up and towards the viewer: unit vectors of object space, right-handed.
    pub axes: [Vec3; 3],
    /// What appears in the middle of the picture, metres.
    pub center: Vec3,
    /// Half the width and half the height of the picture, metres.
    pub half_size_m: Vec2,
    /// What is seen lies between these distances from the centre towards the viewer, metres (Truelsen §5.1, eq. 1: near and far cut a
    /// slab out of the tree).
    pub slab_m: [f32; 2],
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
}

impl View {
    /// No slab: everything is seen.
    pub const ALL: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

    /// Right, up and towards the viewer for one who stands round +Y by `azimuth_rad` (0 on +Z, π/2 on +X) and `elevation_rad` above the
    /// horizon; at π/2 he looks straight down.
    pub fn axes_from(azimuth_rad: f32, elevation_rad: f32) -> [Vec3; 3] {
        let ((sa, ca), (se, ce)) = (azimuth_rad.sin_cos(), elevation_rad.sin_cos());
        let (right, toward) = (Vec3::new(ca, 0.0, -sa), Vec3::new(sa * ce, se, ca * ce));
        [right, toward.cross(right), toward]
    }

    /// The view along these axes that shows just what lies in the box `window`, given in right, up, toward.
    pub fn of_window(axes: [Vec3; 3], window: Bounds, width_px: u32, height_px: u32) -> Self {
        let (middle, half) = (window.center(), 0.5 * window.size());
        let center = axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z;
        Self { axes, center, half_size_m: half.truncate(), slab_m: [-half.z, half.z], width_px, height_px }
    }

    /// The view from that side that shows all of `points` with a margin of 4 %, as wide as high in metres.
    pub fn around(
        points: impl IntoIterator<Item = Vec3>,
        azimuth_rad: f32,
        elevation_rad: f32,
        width_px: u32,
        height_px: u32,
    ) -> Self {
        let axes = Self::axes_from(azimuth_rad, elevation_rad);
        let aspect = width_px.max(1) as f32 / height_px.max(1) as f32;
        let view = |center, half_height: f32| Self {
            axes,
            center,
            half_size_m: half_height * Vec2::new(aspect, 1.0),
            slab_m: Self::ALL,
            width_px,
            height_px,
        };
        let seen = Bounds::of(points.into_iter().map(|p| Vec3::from(axes.map(|axis| axis.dot(p)))));
        let Some((middle, half)) = seen.map(|b| (b.center(), 0.5 * b.size())) else { return view(Vec3::ZERO, 1.0) };
        let center = axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z;
        view(center, (1.04 * half.y.max(half.x / aspect)).max(1e-3))
    }

    /// Whether a picture can be taken.
    ///
    /// # Errors
    /// [`Error::View`] for one without extent or above 16,384 pixels.
    pub fn check(&self) -> Result<()> {
        let size = 1..=16_384u32;
        let finite = self.axes.iter().chain([&self.center]).all(|v| v.is_finite()) && self.half_size_m.is_finite();
        let sized = size.contains(&self.width_px) && size.contains(&self.height_px) && self.half_size_m.min_element() > 0.0;
        if sized && finite && self.slab_m.iter().all(|m| !m.is_nan()) {
            return Ok(());
        }
        let half = self.half_size_m;
        let found = format!("{}×{} pixels of half-size {} × {} m", self.width_px, self.height_px, half.x, half.y);
        Err(Error::View { found })
    }
}

/// What a surface is made of.
#[derive(Debug, Clone, Copy)]
pub struct Material<'a> {
    /// Base colour, sRGB with straight alpha.
    pub texture: Option<&'a RgbaImage>,
    /// How the texture goes on outside 0..1.
    pub wrap: Wrap,
    /// Multiplies the texture, or is the colour without one; linear light, straight alpha.
    pub factor: [f32; 4],
    /// Texels of less alpha are not there.
    pub alpha_cutoff: f32,
    /// Whether faces turned away from the viewer are drawn, with their normal turned round.
    pub two_sided: bool,
}

/// How a texture goes on outside 0..1, in both directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wrap {
    /// The last texel goes on.
    Clamp,
    /// It starts anew.
    Repeat,
}

impl Default for Material<'_> {
    fn default() -> Self {
        Self { texture: None, wrap: Wrap::Clamp, factor: [1.0; 4], alpha_cutoff: ALPHA_CUTOFF, two_sided: false }
    }
}

/// A sun and a sky for previews: a face turned to the sun keeps its base colour, one in shade keeps `ambient` of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Towards the sun; any length but zero.
    pub toward_sun: Vec3,
    /// Part of the light that comes from everywhere, 0..=1.
    pub ambient: f32,
}

/// What a view shows, row by row from the top left.
#[derive(Debug, Clone)]
pub struct Capture {
    /// sRGB with straight alpha; alpha is the covered part of the pixel.
    pub color: RgbaImage,
    /// Distance towards the viewer from the plane through the view's centre, metres; negative infinity where nothing is.
    pub depth_m: Vec<f32>,
    /// Unit normal in object space; zero where nothing is.
    pub normal: Vec<Vec3>,
    /// Covered part of the pixel, 0..=255.
    pub coverage: GrayImage,
}

impl Capture {
    /// The colour over a plain background (sRGB), blended in linear light.
    pub fn over(&self, background: [u8; 3]) -> RgbaImage {
        let mut image = self.color.clone();
        for p in image.pixels_mut() {
            let a = f32::from(p[3]) / 255.0;
            for (c, b) in p.0[..3].iter_mut().zip(background) {
                *c = to_srgb(a * to_linear(*c) + (1.0 - a) * to_linear(b));
            }
            p[3] = 255;
        }
        image
    }
}

/// Draws `surfaces`; of two at one depth the first stays.
///
/// # Errors
/// [`Error::View`] for a picture without extent or above 16,384 pixels; [`Error::Surface`] when a polygon names a vertex that is not
/// there, or when normals or texture coordinates are neither absent nor one per vertex.
pub fn render(surfaces: &[(&Surface, Material)], view: &View, light: Option<&Light>) -> Result<Capture> {
    let textures: Vec<Option<Texture>> = surfaces.iter().map(|(_, material)| material.texture.and_then(Texture::of)).collect();
    render_with(surfaces, &textures.iter().map(Option::as_ref).collect::<Vec<_>>(), view, light)
}

/// As [`render`], with the textures of the surfaces already made.
///
/// # Errors
/// Those of [`render`].
///
/// # Panics
/// When there are fewer textures than surfaces.
pub fn render_with(
    surfaces: &[(&Surface, Material)],
    textures: &[Option<&Texture>],
    view: &View,
    light: Option<&Light>,
) -> Result<Capture> {
    view.check()?;
    surfaces.iter().try_for_each(|(surface, _)| check_surface(surface))?;
    let facets = Facets::of(surfaces, textures, view);
    let shader = Shader { textures, materials: surfaces, light, slab_m: view.slab_m };
    let width = view.width_px as usize;
    let pixels = width * view.height_px as usize;
    let mut capture = Capture {
        color: RgbaImage::new(view.width_px, view.height_px),
        depth_m: vec![f32::NEG_INFINITY; pixels],
        normal: vec![Vec3::ZERO; pixels],
        coverage: GrayImage::new(view.width_px, view.height_px),
    };
    let band = width * BAND as usize;
    let colors = capture.color.par_chunks_mut(4 * band);
    let depths = capture.depth_m.par_chunks_mut(band);
    let normals = capture.normal.par_chunks_mut(band);
    let coverages = capture.coverage.par_chunks_mut(band);
    colors.zip(depths).zip(normals).zip(coverages).enumerate().for_each(|(number, (((colors, depths), normals), coverages))| {
        for (at, pixel) in facets.band(number, width, &shader).take(depths.len()).enumerate() {
            let [r, g, b] = pixel.color.to_array().map(to_srgb);
            coverages[at] = (255.0 * pixel.coverage).round() as u8;
            colors[4 * at..4 * at + 4].copy_from_slice(&[r, g, b, coverages[at]]);
            (depths[at], normals[at]) = (pixel.depth, pixel.normal);
        }
    });
    Ok(capture)
}

fn check_surface(surface: &Surface) -> Result<()> {
    let n = surface.mesh.positions.len();
    let per_vertex = |count: usize| count == 0 || count == n;
    if !per_vertex(surface.normals.len()) || !per_vertex(surface.uvs.len()) {
        let found = format!("{n} vertices with {} normals and {} texture coordinates", surface.normals.len(), surface.uvs.len());
        return Err(Error::Surface { found });
    }
    match surface.mesh.polygons().flatten().find(|&&v| v as usize >= n) {
        Some(v) => Err(Error::Surface { found: format!("a polygon over vertex {v} of {n}") }),
        None => Ok(()),
    }
}

#[cfg(test)]
#[path = "render_tests.rs"]
mod tests;
