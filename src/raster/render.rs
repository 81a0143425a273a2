//! The software rasteriser: textured surfaces seen in parallel projection, as plain images (DESIGN §4, "Capture").
//!
//! The same bytes on every machine and any number of threads: rows are independent, and of two surfaces at one depth the first drawn
//! stays. In parallel projection the texture gradients are constant over a triangle, so its mip level is exact. Colours are averaged
//! in linear light.

use std::ops::Range;

use glam::{Vec2, Vec3, Vec4};
use image::{GrayImage, Luma, Rgba, RgbaImage};
use rayon::prelude::*;

use super::{ALPHA_CUTOFF, to_linear, to_srgb};
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

/// Samples per pixel and axis: 9 samples hide stairs at outlines and at the alpha test.
const SAMPLES: u32 = 3;

/// A texture as the rasteriser samples it, with its smaller sizes. Made once, it serves any number of pictures.
#[derive(Debug)]
pub struct Texture(MipChain);

impl Texture {
    /// `None` for a picture without texels.
    pub fn of(picture: &RgbaImage) -> Option<Self> {
        (picture.width() > 0 && picture.height() > 0).then(|| Self(MipChain::of(picture)))
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
    let mut facets: Vec<Facet> = Vec::new();
    for (number, (surface, material)) in surfaces.iter().enumerate() {
        check_surface(surface)?;
        let texture = textures[number].filter(|_| !surface.uvs.is_empty()).map(|texture| &texture.0);
        let corners: Vec<[u32; 3]> = surface.mesh.triangulated().collect();
        let projected = |t: &[u32; 3]| Facet::project(surface, material, number, *t, view, texture);
        facets.par_extend(corners.par_iter().with_min_len(1024).filter_map(projected));
    }
    let order = NearToFar::of(&facets, view.height_px);
    let shade = Shader { textures, materials: surfaces, light, slab_m: view.slab_m };
    let width = view.width_px as usize;
    let rows: Vec<Vec<Pixel>> =
        (0..view.height_px).into_par_iter().map(|y| draw_row(y, width, &facets, order.row(y), &shade)).collect();
    let mut capture = Capture {
        color: RgbaImage::new(view.width_px, view.height_px),
        depth_m: Vec::with_capacity(width * rows.len()),
        normal: Vec::with_capacity(width * rows.len()),
        coverage: GrayImage::new(view.width_px, view.height_px),
    };
    for (y, row) in rows.iter().enumerate() {
        for (x, pixel) in row.iter().enumerate() {
            let alpha = (255.0 * pixel.coverage).round() as u8;
            let [r, g, b] = pixel.color.to_array().map(to_srgb);
            capture.color.put_pixel(x as u32, y as u32, Rgba([r, g, b, alpha]));
            capture.coverage.put_pixel(x as u32, y as u32, Luma([alpha]));
            capture.depth_m.push(pixel.depth);
            capture.normal.push(pixel.normal);
        }
    }
    Ok(capture)
}

/// Which facets each row of pixels meets, nearest first: what lies behind is then seldom shaded.
struct NearToFar {
    /// Facets by number, row after row.
    facets: Vec<u32>,
    /// Where each row begins in `facets`, and where the last ends.
    begins: Vec<usize>,
}

impl NearToFar {
    fn of(facets: &[Facet], height_px: u32) -> Self {
        let nearest = |facet: &Facet| facet.corners.iter().map(|c| c.z).fold(f32::NEG_INFINITY, f32::max);
        let mut order: Vec<(f32, u32)> = facets.iter().map(nearest).zip(0..).collect();
        order.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let rows_of = |facet: &Facet| {
            let ys = facet.corners.map(|c| c.y / SAMPLES as f32);
            let (top, bottom) = (ys.into_iter().fold(f32::MAX, f32::min), ys.into_iter().fold(f32::MIN, f32::max));
            (top.floor().max(0.0) as usize).min(height_px as usize)
                ..((bottom.floor() + 1.0).max(0.0) as usize).min(height_px as usize)
        };
        let mut begins = vec![0; height_px as usize + 1];
        facets.iter().flat_map(rows_of).for_each(|row| begins[row + 1] += 1);
        (1..begins.len()).for_each(|row| begins[row] += begins[row - 1]);
        let mut next = begins.clone();
        let mut placed = vec![0; begins[height_px as usize]];
        for (_, number) in order {
            for row in rows_of(&facets[number as usize]) {
                placed[next[row]] = number;
                next[row] += 1;
            }
        }
        Self { facets: placed, begins }
    }

    fn row(&self, y: u32) -> &[u32] {
        &self.facets[self.begins[y as usize]..self.begins[y as usize + 1]]
    }
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

/// A triangle in sample coordinates: x right, y down, z towards the viewer in metres.
struct Facet {
    corners: [Vec3; 3],
    normals: [Vec3; 3],
    uvs: [Vec2; 3],
    /// Inverse of twice the signed area in samples².
    inverse_area: f32,
    surface: usize,
    /// Whether it has texture coordinates and a texture.
    textured: bool,
    /// Mip level at which one texel is about one sample.
    level: f32,
}

impl Facet {
    /// `None` for triangles that are turned away, outside the picture or its slab, degenerate or not finite.
    fn project(
        surface: &Surface,
        material: &Material,
        index: usize,
        triangle: [u32; 3],
        view: &View,
        texture: Option<&MipChain>,
    ) -> Option<Self> {
        let [right, up, toward] = view.axes;
        let middle = 0.5 * Vec2::new((SAMPLES * view.width_px) as f32, (SAMPLES * view.height_px) as f32);
        let samples_per_m = middle / view.half_size_m;
        let at = triangle.map(|v| v as usize);
        let mut corners = at.map(|v| {
            let p = surface.mesh.positions[v] - view.center;
            Vec3::new(middle.x + p.dot(right) * samples_per_m.x, middle.y - p.dot(up) * samples_per_m.y, p.dot(toward))
        });
        let [a, b, c] = corners.map(|p| p.truncate());
        let edge = 2.0 * middle;
        let beyond =
            |axis: usize, low: f32, high: f32| corners.iter().all(|p| p[axis] < low) || corners.iter().all(|p| p[axis] > high);
        // Most leaves of a small picture lie between its samples.
        let unsampled = |axis: usize| {
            let [a, b, c] = corners.map(|p| p[axis]);
            (a.min(b).min(c) - 0.5).ceil() > (a.max(b).max(c) - 0.5).floor()
        };
        if beyond(0, 0.0, edge.x)
            || beyond(1, 0.0, edge.y)
            || beyond(2, view.slab_m[0], view.slab_m[1])
            || unsampled(0)
            || unsampled(1)
        {
            return None;
        }
        // y points down, so an outward face has negative area here.
        let area = -(b - a).perp_dot(c - a);
        if !area.is_finite() || area.abs() < 1e-9 || (area < 0.0 && !material.two_sided) {
            return None;
        }
        let [p, q, r] = at.map(|v| surface.mesh.positions[v]);
        let face = (q - p).cross(r - p).normalize_or(toward);
        let turn = area.signum();
        let mut normals = at.map(|v| turn * surface.normals.get(v).copied().unwrap_or(face));
        let mut uvs = at.map(|v| surface.uvs.get(v).copied().unwrap_or_default());
        let level = texture.map_or(0.0, |t| {
            let size = Vec2::new(t.levels[0].width as f32, t.levels[0].height as f32);
            let texels = ((uvs[1] - uvs[0]) * size).perp_dot((uvs[2] - uvs[0]) * size).abs();
            0.5 * (texels / area.abs()).max(1e-6).log2()
        });
        if area < 0.0 {
            corners.swap(1, 2);
            normals.swap(1, 2);
            uvs.swap(1, 2);
        }
        Some(Self { corners, normals, uvs, inverse_area: 1.0 / area.abs(), surface: index, textured: texture.is_some(), level })
    }

    /// Between which samples of a row of them, `across` long, it may lie: a little wide, since [`Facet::weights`] decides.
    fn span(&self, y: f32, across: usize) -> Range<usize> {
        let [a, b, c] = self.corners.map(|p| p.truncate());
        let (mut left, mut right) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        // Counter-clockwise with y downwards: the inside is on the left of an edge that runs down.
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let (low, high) = (p.y.min(q.y), p.y.max(q.y));
            if high - low < 1e-3 || y < low || y > high {
                continue;
            }
            let x = p.x + (y - p.y) / (q.y - p.y) * (q.x - p.x);
            if q.y > p.y { left = left.max(x - 1.0) } else { right = right.min(x + 1.0) }
        }
        let first = (left - 0.5).ceil().max(0.0) as usize;
        first..((right - 0.5).floor() + 1.0).clamp(first as f32, across.max(first) as f32) as usize
    }

    /// Barycentric weights of a sample, `None` outside.
    fn weights(&self, at: Vec2) -> Option<[f32; 3]> {
        let [a, b, c] = self.corners.map(|p| p.truncate());
        let u = -(c - b).perp_dot(at - b) * self.inverse_area;
        let v = -(a - c).perp_dot(at - c) * self.inverse_area;
        let w = 1.0 - u - v;
        (u >= 0.0 && v >= 0.0 && w >= 0.0).then_some([u, v, w])
    }
}

struct Shader<'a> {
    textures: &'a [Option<&'a Texture>],
    materials: &'a [(&'a Surface, Material<'a>)],
    light: Option<&'a Light>,
    slab_m: [f32; 2],
}

impl Shader<'_> {
    /// Linear colour and normal, `None` where the alpha test fails.
    fn shade(&self, facet: &Facet, [u, v, w]: [f32; 3]) -> Option<(Vec3, Vec3)> {
        let material = &self.materials[facet.surface].1;
        let mut color = Vec4::from_array(material.factor);
        if let Some(Texture(texture)) = self.textures[facet.surface].filter(|_| facet.textured) {
            let uv = u * facet.uvs[0] + v * facet.uvs[1] + w * facet.uvs[2];
            color *= texture.sample(uv, facet.level, material.wrap);
        }
        if color.w < material.alpha_cutoff {
            return None;
        }
        let normal = (u * facet.normals[0] + v * facet.normals[1] + w * facet.normals[2]).normalize_or(Vec3::Y);
        let lit =
            self.light.map_or(1.0, |l| l.ambient + (1.0 - l.ambient) * normal.dot(l.toward_sun.normalize_or(Vec3::Y)).max(0.0));
        Some((lit * color.truncate(), normal))
    }
}

#[derive(Clone, Copy)]
struct Pixel {
    color: Vec3,
    depth: f32,
    normal: Vec3,
    coverage: f32,
}

/// What one sample shows.
#[derive(Clone, Copy)]
struct Sample {
    depth: f32,
    color: Vec3,
    normal: Vec3,
    /// By number, so that of two at one depth the first stays.
    facet: u32,
}

fn draw_row(y: u32, width: usize, facets: &[Facet], near_to_far: &[u32], shader: &Shader) -> Vec<Pixel> {
    let empty = Sample { depth: f32::NEG_INFINITY, color: Vec3::ZERO, normal: Vec3::ZERO, facet: 0 };
    let across = width * SAMPLES as usize;
    let mut samples = vec![empty; across * SAMPLES as usize];
    let top = y * SAMPLES;
    for &number in near_to_far {
        let facet = &facets[number as usize];
        let [a, b, c] = facet.corners;
        for s in 0..SAMPLES as usize {
            let y = top as f32 + s as f32 + 0.5;
            if y < a.y.min(b.y).min(c.y) || y > a.y.max(b.y).max(c.y) {
                continue;
            }
            for x in facet.span(y, across) {
                let Some(w) = facet.weights(Vec2::new(x as f32 + 0.5, y)) else { continue };
                let depth = w[0] * a.z + w[1] * b.z + w[2] * c.z;
                let sample = &mut samples[s * across + x];
                if (depth > sample.depth || depth == sample.depth && number < sample.facet)
                    && (shader.slab_m[0]..=shader.slab_m[1]).contains(&depth)
                    && let Some((color, normal)) = shader.shade(facet, w)
                {
                    *sample = Sample { depth, color, normal, facet: number };
                }
            }
        }
    }
    let resolve = |x: usize| {
        let block = (0..SAMPLES as usize).flat_map(|s| &samples[s * across + x * SAMPLES as usize..][..SAMPLES as usize]);
        let mut pixel = Pixel { color: Vec3::ZERO, depth: f32::NEG_INFINITY, normal: Vec3::ZERO, coverage: 0.0 };
        let mut hits = 0.0;
        for &Sample { depth, color, normal, .. } in block.filter(|s| s.depth > f32::NEG_INFINITY) {
            hits += 1.0;
            pixel.color += color;
            if depth > pixel.depth {
                (pixel.depth, pixel.normal) = (depth, normal);
            }
        }
        if hits > 0.0 {
            pixel.color /= hits;
            pixel.coverage = hits / (SAMPLES * SAMPLES) as f32;
        }
        pixel
    };
    (0..width).map(resolve).collect()
}

/// A texture in linear light and its box-filtered halvings; colours are weighted by alpha, so that hidden ones do not bleed in.
#[derive(Debug)]
struct MipChain {
    levels: Vec<Level>,
}

#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    texels: Vec<Vec4>,
}

impl MipChain {
    fn of(image: &RgbaImage) -> Self {
        let texel = |p: &Rgba<u8>| Vec4::new(to_linear(p[0]), to_linear(p[1]), to_linear(p[2]), f32::from(p[3]) / 255.0);
        let base =
            Level { width: image.width() as usize, height: image.height() as usize, texels: image.pixels().map(texel).collect() };
        let mut levels = vec![base];
        while let Some(next) = levels.last().and_then(Level::halved) {
            levels.push(next);
        }
        Self { levels }
    }

    /// Bilinear in each of the two nearest levels, linear between them.
    fn sample(&self, uv: Vec2, level: f32, wrap: Wrap) -> Vec4 {
        let level = level.clamp(0.0, (self.levels.len() - 1) as f32);
        let (fine, part) = (level as usize, level.fract());
        let near = self.levels[fine].sample(uv, wrap);
        if part == 0.0 { near } else { near.lerp(self.levels[fine + 1].sample(uv, wrap), part) }
    }
}

impl Level {
    fn halved(&self) -> Option<Self> {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        if (width, height) == (self.width, self.height) {
            return None;
        }
        let texel = |i: usize| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let (x1, y1) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
            let four = [(x, y), (x1, y), (x, y1), (x1, y1)].map(|(x, y)| self.texels[y * self.width + x]);
            let alpha: f32 = four.iter().map(|t| t.w).sum();
            let weight = |t: &Vec4| if alpha > 0.0 { t.w / alpha } else { 0.25 };
            four.iter().map(|t| weight(t) * t.truncate()).sum::<Vec3>().extend(0.25 * alpha)
        };
        Some(Self { width, height, texels: (0..width * height).map(texel).collect() })
    }

    fn sample(&self, uv: Vec2, wrap: Wrap) -> Vec4 {
        let (x, y) = (uv.x * self.width as f32 - 0.5, uv.y * self.height as f32 - 0.5);
        if !(x.is_finite() && y.is_finite()) {
            return Vec4::ZERO;
        }
        let column = |i: f32, n: usize| match wrap {
            Wrap::Clamp => (i.max(0.0) as usize).min(n - 1),
            Wrap::Repeat => (i.rem_euclid(n as f32) as usize).min(n - 1),
        };
        let (x0, y0) = (x.floor(), y.floor());
        let at = |dx: f32, dy: f32| self.texels[column(y0 + dy, self.height) * self.width + column(x0 + dx, self.width)];
        let (fx, fy) = (x - x0, y - y0);
        at(0.0, 0.0).lerp(at(1.0, 0.0), fx).lerp(at(0.0, 1.0).lerp(at(1.0, 1.0), fx), fy)
    }
}

#[cfg(test)]
#[path = "render_tests.rs"]
mod tests;
