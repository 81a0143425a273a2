//! Triangles as the rasteriser meets them: projected once, sorted from near to far, drawn a band of rows at a time.
//!
//! What decides whether a sample is seen (`Facet`) is kept apart from what decides its colour (`Skin`): most of a crown is hidden, and
//! a band then reads little memory for it.

use std::ops::Range;

use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::{Light, Material, Texture, View};
use crate::geom::Surface;

/// Samples per pixel and axis: 9 samples hide stairs at outlines and at the alpha test.
const SAMPLES: usize = 3;

/// Rows of pixels that are drawn at once: few enough that their samples stay near the processor, so many that most triangles are met once.
pub(super) const BAND: u32 = 8;

/// All that a view may show, and where.
pub(super) struct Facets {
    /// As they lie in memory: by the band in which they begin, in each the nearest first.
    facets: Vec<Facet>,
    /// By [`Facet::number`].
    skins: Vec<Skin>,
    /// For each band of rows the places in `facets` of those it meets, nearest first: what lies behind is then seldom shaded.
    bands: Vec<Vec<u32>>,
}

impl Facets {
    pub fn of(surfaces: &[(&Surface, Material)], textures: &[Option<&Texture>], view: &View) -> Self {
        let (mut facets, mut skins): (Vec<Facet>, Vec<Skin>) = (Vec::new(), Vec::new());
        for (index, ((surface, material), texture)) in surfaces.iter().zip(textures).enumerate() {
            let texture = texture.filter(|_| !surface.uvs.is_empty());
            let corners: Vec<[u32; 3]> = surface.mesh.triangulated().collect();
            let projected = |t: &[u32; 3]| projected(surface, material, index, *t, view, texture);
            let (these, their): (Vec<Facet>, Vec<Skin>) = corners.par_iter().with_min_len(1024).filter_map(projected).unzip();
            facets.extend(these);
            skins.extend(their);
        }
        let mut order: Vec<(f32, u32)> = facets.iter().map(|facet| facet.nearest).zip(0..).collect();
        order.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let band_count = view.height_px.div_ceil(BAND) as usize;
        let mut next = vec![0; band_count + 1];
        facets.iter().for_each(|facet| next[facet.bands[0] as usize + 1] += 1);
        (1..next.len()).for_each(|band| next[band] += next[band - 1]);
        let mut numbers = vec![0; facets.len()];
        let mut bands = vec![vec![]; band_count];
        for (_, number) in order {
            let [first, last] = facets[number as usize].bands;
            let place: u32 = next[first as usize];
            next[first as usize] += 1;
            numbers[place as usize] = number;
            bands[first as usize..=last as usize].iter_mut().for_each(|band| band.push(place));
        }
        let facets = numbers.par_iter().map(|&number| Facet { number, ..facets[number as usize] }).collect();
        Self { facets, skins, bands }
    }

    /// What the pixels of a band show, row by row, `width` in each.
    pub fn band<'a>(&'a self, band: usize, width: usize, shader: &Shader) -> impl Iterator<Item = Pixel> + use<'a> {
        let across = width * SAMPLES;
        let count = across * SAMPLES * BAND as usize;
        let mut depths = vec![f32::NEG_INFINITY; count];
        let mut samples = vec![Sample { color: Vec3::ZERO, weights: [0.0; 3], facet: 0 }; count];
        let top = band * BAND as usize * SAMPLES;
        for &place in &self.bands[band] {
            let facet = &self.facets[place as usize];
            let first = (facet.top.max(0.0) as u32 as usize).max(top);
            let last = (facet.bottom.max(0.0) as u32 as usize).min(top + BAND as usize * SAMPLES - 1);
            for row in first..=last {
                let y = row as f32 + 0.5;
                if y < facet.top || y > facet.bottom {
                    continue;
                }
                for x in facet.span(y, across) {
                    let at = (row - top) * across + x;
                    if facet.bound < depths[at] {
                        continue;
                    }
                    let Some(w) = facet.weights(Vec2::new(x as f32 + 0.5, y)) else { continue };
                    let depth = w[0] * facet.corners[0].z + w[1] * facet.corners[1].z + w[2] * facet.corners[2].z;
                    if (depth > depths[at] || depth == depths[at] && facet.number < samples[at].facet)
                        && (shader.slab_m[0]..=shader.slab_m[1]).contains(&depth)
                        && let Some(color) = shader.shade(&self.skins[facet.number as usize], w)
                    {
                        depths[at] = depth;
                        samples[at] = Sample { color, weights: w, facet: facet.number };
                    }
                }
            }
        }
        let pixels = (0..BAND as usize).flat_map(move |y| (0..width).map(move |x| y * SAMPLES * across + x * SAMPLES));
        pixels.map(move |first| self.resolved(first, across, &depths, &samples))
    }

    /// The pixel whose first sample is `first`.
    fn resolved(&self, first: usize, across: usize, depths: &[f32], samples: &[Sample]) -> Pixel {
        let mut pixel = Pixel { color: Vec3::ZERO, depth: f32::NEG_INFINITY, normal: Vec3::ZERO, coverage: 0.0 };
        let (mut hits, mut nearest) = (0.0, None);
        for at in (0..SAMPLES).flat_map(|s| (0..SAMPLES).map(move |i| first + s * across + i)) {
            if depths[at] > f32::NEG_INFINITY {
                hits += 1.0;
                pixel.color += samples[at].color;
            }
            if depths[at] > pixel.depth {
                (pixel.depth, nearest) = (depths[at], Some(&samples[at]));
            }
        }
        if let Some(sample) = nearest {
            pixel.normal = self.skins[sample.facet as usize].normal(sample.weights);
            pixel.color /= hits;
            pixel.coverage = hits / (SAMPLES * SAMPLES) as f32;
        }
        pixel
    }
}

/// What one sample shows.
#[derive(Clone, Copy)]
struct Sample {
    color: Vec3,
    /// Where on its facet it lies.
    weights: [f32; 3],
    /// By number, so that of two at one depth the first stays.
    facet: u32,
}

/// What a pixel shows.
pub(super) struct Pixel {
    /// Linear light.
    pub color: Vec3,
    /// Metres towards the viewer.
    pub depth: f32,
    pub normal: Vec3,
    /// Covered part.
    pub coverage: f32,
}

/// Where a triangle is, in sample coordinates: x right, y down, z towards the viewer in metres.
struct Facet {
    corners: [Vec3; 3],
    /// Inverse of twice the area in samples².
    inverse_area: f32,
    top: f32,
    bottom: f32,
    /// The depth of its nearest corner, and what no sample's depth exceeds however it was rounded.
    nearest: f32,
    bound: f32,
    /// The first and the last band that it may meet.
    bands: [u32; 2],
    /// In the order in which triangles are drawn.
    number: u32,
}

/// What a triangle shows.
struct Skin {
    normals: [Vec3; 3],
    uvs: [Vec2; 3],
    surface: u32,
    /// Whether it has texture coordinates and a texture.
    textured: bool,
    /// Mip level at which one texel is about one sample.
    level: f32,
}

/// `None` for triangles that are turned away, outside the picture or its slab, degenerate or not finite.
fn projected(
    surface: &Surface,
    material: &Material,
    index: usize,
    triangle: [u32; 3],
    view: &View,
    texture: Option<&Texture>,
) -> Option<(Facet, Skin)> {
    let [right, up, toward] = view.axes;
    let middle = 0.5 * Vec2::new((SAMPLES as u32 * view.width_px) as f32, (SAMPLES as u32 * view.height_px) as f32);
    let samples_per_m = middle / view.half_size_m;
    let at = triangle.map(|v| v as usize);
    let mut corners = at.map(|v| {
        let p = surface.mesh.positions[v] - view.center;
        Vec3::new(middle.x + p.dot(right) * samples_per_m.x, middle.y - p.dot(up) * samples_per_m.y, p.dot(toward))
    });
    let [a, b, c] = corners.map(|p| p.truncate());
    let (least, most) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
    let edge = 2.0 * middle;
    if most.x < 0.0
        || least.x > edge.x
        || most.y < 0.0
        || least.y > edge.y
        || most.z < view.slab_m[0]
        || least.z > view.slab_m[1]
        // Most leaves of a small picture lie between its samples.
        || (least.x - 0.5).ceil() > (most.x - 0.5).floor()
        || (least.y - 0.5).ceil() > (most.y - 0.5).floor()
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
        let texels = ((uvs[1] - uvs[0]) * t.size()).perp_dot((uvs[2] - uvs[0]) * t.size()).abs();
        0.5 * (texels / area.abs()).max(1e-6).log2()
    });
    if area < 0.0 {
        corners.swap(1, 2);
        normals.swap(1, 2);
        uvs.swap(1, 2);
    }
    let band = |y: f32| (y.max(0.0) as u32 / (SAMPLES as u32 * BAND)).min((view.height_px - 1) / BAND);
    let facet = Facet {
        corners,
        inverse_area: 1.0 / area.abs(),
        top: least.y,
        bottom: most.y,
        nearest: most.z,
        bound: most.z + 1e-6 * least.z.abs().max(most.z.abs()),
        bands: [band(least.y), band(most.y)],
        number: 0,
    };
    Some((facet, Skin { normals, uvs, surface: index as u32, textured: texture.is_some(), level }))
}

/// Facets no wider than so many samples are looked at whole: finding their edges would cost more.
const NARROW: f32 = 4.0;

impl Facet {
    /// Between which samples of a row of them, `across` long, it may lie: a little wide, since [`Facet::weights`] decides.
    fn span(&self, y: f32, across: usize) -> Range<usize> {
        let [a, b, c] = self.corners.map(|p| p.truncate());
        let (mut left, mut right) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        if right - left > NARROW {
            // Counter-clockwise with y downwards: the inside is on the left of an edge that runs down.
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let (low, high) = (p.y.min(q.y), p.y.max(q.y));
                if high - low < 1e-3 || y < low || y > high {
                    continue;
                }
                let x = p.x + (y - p.y) / (q.y - p.y) * (q.x - p.x);
                if q.y > p.y { left = left.max(x - 1.0) } else { right = right.min(x + 1.0) }
            }
        }
        // Truncated, which is quicker than rounding up: a little less than the half is added, so that no sample on the rim is lost.
        (left + 0.49).max(0.0) as u32 as usize..((right + 0.5).max(0.0) as u32 as usize).min(across)
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

impl Skin {
    fn normal(&self, [u, v, w]: [f32; 3]) -> Vec3 {
        (u * self.normals[0] + v * self.normals[1] + w * self.normals[2]).normalize_or(Vec3::Y)
    }
}

/// What turns places on triangles into colours.
pub(super) struct Shader<'a> {
    pub textures: &'a [Option<&'a Texture>],
    pub materials: &'a [(&'a Surface, Material<'a>)],
    pub light: Option<&'a Light>,
    /// Nothing nearer or farther is seen: [`View::slab_m`].
    pub slab_m: [f32; 2],
}

impl Shader<'_> {
    /// Linear colour, `None` where the alpha test fails.
    fn shade(&self, skin: &Skin, weights: [f32; 3]) -> Option<Vec3> {
        let surface = skin.surface as usize;
        let material = &self.materials[surface].1;
        let mut color = Vec4::from_array(material.factor);
        if let Some(texture) = self.textures[surface].filter(|_| skin.textured) {
            let [u, v, w] = weights;
            color *= texture.sample(u * skin.uvs[0] + v * skin.uvs[1] + w * skin.uvs[2], skin.level, material.wrap);
        }
        if color.w < material.alpha_cutoff {
            return None;
        }
        let lit = self
            .light
            .map_or(1.0, |l| l.ambient + (1.0 - l.ambient) * skin.normal(weights).dot(l.toward_sun.normalize_or(Vec3::Y)).max(0.0));
        Some(lit * color.truncate())
    }
}
