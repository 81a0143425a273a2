//! The exemplar: the most representative square of foliage (She §3.2, "texture sample of the crown"; how to choose it is ours).
//!
//! Windows are scored on a reduced picture by integral images: how well their histograms agree with the whole crown's, how much their
//! halves differ (shading, a branch, the rim), how much sky they show, and how large they are. Window in pixels of the photograph,
//! result in texels.

use glam::{Vec3, Vec4};
use image::{Rgba, RgbaImage};

use super::delight::{ReducedCrown, Shading, foliage_at};
use super::{Photo, exemplar_window};
use crate::raster::{ALPHA_CUTOFF, Layer, Mask, Rect, color_difference};
use crate::{Error, Result};

crate::params! {
    /// How the exemplar is chosen.
    pub struct ExemplarParams {
        /// How much of the photograph's own shading is flattened out of the texture, exemplar and `--front photo` alike, so that it can be lit anew.
        delight: f64 = 0.7, in 0.0..=1.0, unit "", source "ours: without any shading foliage looks like felt";
        /// Largest part of the exemplar that may be sky gaps; beyond it the shallowest gaps are closed.
        gap_limit: f64 = 0.35, in 0.0..=0.6, unit "", source "ours: with more gaps than that a crown falls apart";
    }
}

/// A square of foliage to synthesise from.
#[derive(Debug, Clone)]
pub struct Exemplar {
    /// sRGB pixels; alpha 0 where the sky shows through.
    pub image: RgbaImage,
    /// Where it was cut from the photograph, in its pixels.
    pub window_px: Rect,
    /// Exemplar texels per pixel of the photograph.
    pub scale: f64,
    /// The part of the crown's core that is sky gaps, at most the gap limit: what a texture grown from the exemplar should show.
    pub gap_fraction: f64,
    /// CIEDE2000 between the mean colour of its opaque texels and that of the crown's foliage.
    pub delta_e: f64,
}

/// Largest exemplar side, texels: more adds cost but no variety that a crown could show.
const MAX_SIDE: f64 = 512.0;

/// Most texels per pixel: beyond it enlarging adds nothing, and the baker interpolates as well.
const MAX_SCALE: f64 = 2.0;

/// Cuts the most representative square of foliage inside `crown`, resampled to `texels_per_px` texels per pixel of the photograph
/// (at most 2 texels per pixel and 512 texels a side: [`Exemplar::scale`] says what it became).
///
/// `gaps` are the sky gaps inside the crown; they become alpha 0 with foliage colours bled in. The mean colour is the crown's.
///
/// # Errors
/// [`Error::Exemplar`] when the crown without its gaps has fewer than four pixels or the masks are not of the photograph's size;
/// [`Error::Parameter`] for a scale that is not positive.
pub fn choose(photo: &Photo, crown: &Mask, gaps: &Mask, texels_per_px: f64, params: &ExemplarParams) -> Result<Exemplar> {
    let size = photo.image.dimensions();
    if [crown, gaps].iter().any(|m| (m.width(), m.height()) != size) {
        return Err(Error::Exemplar { found: "a mask of another size than the photograph".into() });
    }
    if !(texels_per_px.is_finite() && texels_per_px > 0.0) {
        let expected = "a positive number of texels".into();
        return Err(Error::Parameter { name: "texels per pixel".into(), expected, found: texels_per_px.to_string() });
    }
    let foliage_px = crown.as_raw().iter().zip(gaps.as_raw()).filter(|(c, g)| **c != 0 && **g == 0).count();
    let reduced = ReducedCrown::of(&photo.image, crown, gaps).filter(|_| foliage_px >= 4);
    let Some(reduced) = reduced else { return Err(Error::Exemplar { found: format!("{foliage_px} pixels of it") }) };
    let shading = Shading::of(&reduced, params.delight);
    let window_px = exemplar_window::find(&reduced, crown, &shading);
    let side = (f64::from(window_px.width) * texels_per_px.min(MAX_SCALE)).round().clamp(8.0, MAX_SIDE);
    let mut layer = cut(photo, crown, gaps, window_px, side as usize, &shading);
    limit_gaps(&mut layer, params.gap_limit);
    let foliage = encoded_mean(&photo.image, crown, gaps);
    if let Some(mean) = foliage {
        let weights: Vec<f32> = layer.texels.iter().map(|t| t.w).collect();
        layer.shift_mean(&weights, mean);
    }
    let byte = |v: f32| v.round().clamp(0.0, 255.0) as u8;
    let image = RgbaImage::from_fn(side as u32, side as u32, |x, y| {
        let t = layer.texels[y as usize * layer.width + x as usize];
        Rgba([byte(t.x), byte(t.y), byte(t.z), byte(255.0 * t.w)])
    });
    let gap_fraction = gaps_in_core(&reduced, crown, gaps).min(params.gap_limit);
    let delta_e = opaque_mean(&image).zip(foliage).map_or(0.0, |(a, b)| color_difference(a, b));
    Ok(Exemplar { image, window_px, scale: side / f64::from(window_px.width), gap_fraction, delta_e })
}

/// Mean of the encoded sRGB values that the alpha test keeps, 0..=255.
pub fn opaque_mean(image: &RgbaImage) -> Option<Vec3> {
    let opaque = image.pixels().filter(|p| f32::from(p[3]) >= 255.0 * ALPHA_CUTOFF);
    let sum: glam::DVec4 = opaque.map(|p| glam::DVec4::new(p[0].into(), p[1].into(), p[2].into(), 1.0)).sum();
    (sum.w > 0.0).then(|| (sum.truncate() / sum.w).as_vec3())
}

/// The window as `side` × `side` texels: encoded sRGB 0..=255 in `xyz`, bled over the gaps, and the part that is foliage in `w`.
fn cut(photo: &Photo, crown: &Mask, gaps: &Mask, window: Rect, side: usize, shading: &Shading) -> Layer {
    let there = |x: i64, y: i64| Vec4::splat(f32::from(crown.get(x, y) && !gaps.get(x, y)));
    let (origin, extent) = ([f64::from(window.x), f64::from(window.y)], [f64::from(window.width); 2]);
    // Fewer pixels than texels: average pixel by pixel, then interpolate sharply between them.
    let n = side.min(window.width as usize);
    let average = Layer::area_average(n, n, origin, extent, |x, y| foliage_at(&photo.image, crown, gaps, x, y));
    let mut colors = shading.removed(average, origin, extent).straightened();
    colors.bleed();
    let alphas = Layer::area_average(n, n, origin, extent, there);
    if n == side {
        return Layer::from_fn(n, n, |x, y| colors.texels[y * n + x].truncate().extend(alphas.texels[y * n + x].w));
    }
    let step = n as f32 / side as f32;
    Layer::from_fn(side, side, |x, y| {
        let (x, y) = ((x as f32 + 0.5) * step, (y as f32 + 0.5) * step);
        colors.sharp(x, y).truncate().clamp(Vec3::ZERO, Vec3::splat(255.0)).extend(alphas.bilinear(x, y).w)
    })
}

/// How far from its outline the core of a crown begins, as a part of its bounding box's smaller side. Nearer, the spaces between twigs
/// belong to the outline rather than to the foliage.
const RIM: f64 = 0.06;

/// The part of the crown's core that is sky gaps.
fn gaps_in_core(reduced: &ReducedCrown, crown: &Mask, gaps: &Mask) -> f64 {
    let (width, height) = (reduced.foliage.width, reduced.foliage.height);
    let (crown, gaps) = (reduced.cover(crown), reduced.cover(gaps));
    let solid = Layer::from_fn(width, height, |x, y| Vec4::splat(crown[y * width + x]));
    let soft = solid.low_pass((RIM * width.min(height) as f64).ceil() as usize);
    let sum =
        |cover: &[f32]| -> f64 { cover.iter().zip(&soft.texels).filter(|(_, s)| s.w > 0.97).map(|(&c, _)| f64::from(c)).sum() };
    let core = sum(&crown);
    if core > 0.0 { (sum(&gaps) / core).clamp(0.0, 1.0) } else { 0.0 }
}

/// Closes the shallowest gaps until at most `limit` of the texels are transparent: those with most foliage around them.
fn limit_gaps(layer: &mut Layer, limit: f64) {
    let mut open: Vec<usize> = (0..layer.texels.len()).filter(|&i| layer.texels[i].w < ALPHA_CUTOFF).collect();
    let keep = (limit * layer.texels.len() as f64) as usize;
    if open.len() <= keep {
        return;
    }
    let around = layer.low_pass((layer.width / 32).max(1));
    open.sort_by(|&a, &b| around.texels[a].w.total_cmp(&around.texels[b].w).then(a.cmp(&b)));
    open[keep..].iter().for_each(|&i| layer.texels[i].w = 1.0);
}

/// Mean of the encoded sRGB values of the crown's foliage.
pub fn encoded_mean(image: &image::RgbImage, crown: &Mask, gaps: &Mask) -> Option<Vec3> {
    let (mut sum, mut count) = ([0u64; 3], 0u64);
    for ((pixel, &c), &g) in image.pixels().zip(crown.as_raw()).zip(gaps.as_raw()) {
        if c != 0 && g == 0 {
            count += 1;
            sum.iter_mut().zip(pixel.0).for_each(|(s, v)| *s += u64::from(v));
        }
    }
    (count > 0).then(|| Vec3::from(sum.map(|s| s as f32 / count as f32)))
}

/// The exemplar as a layer to sample from: encoded sRGB 0..=255 in `xyz`, alpha 0..=1 in `w`.
impl From<&Exemplar> for Layer {
    fn from(exemplar: &Exemplar) -> Self {
        let (width, height) = (exemplar.image.width() as usize, exemplar.image.height() as usize);
        let texel = |p: &Rgba<u8>| Vec4::new(f32::from(p[0]), f32::from(p[1]), f32::from(p[2]), f32::from(p[3]) / 255.0);
        Layer { width, height, texels: exemplar.image.pixels().map(texel).collect() }
    }
}

#[cfg(test)]
#[path = "exemplar_tests.rs"]
mod tests;
