//! The atlas: every polygon's block drawn into one continuous chart, joined along cuts (She §3.2 asks for seams to be removed; how is ours).
//!
//! A texel knows its polygon and its place in it; it takes its colour from the block on its side of the cuts, and within a texel or so of
//! a cut from both. Everything is evaluated at the place itself: nothing is resampled twice.

use glam::{Vec2, Vec3, Vec4};
use image::RgbaImage;
use rayon::prelude::*;

use super::chart::{COPIES, Chart, USUAL_PART};
use super::cut::{Cut, blend};
use super::flat::laid_flat;
use super::gaps;
use super::grain::{self, Grain};
use super::measure::{self, Shaded};
use super::synth::{BlockSource, VirtualTexture, mean_color};
use crate::geom::{PolyMesh, Surface};
use crate::params::{ParamSet as _, PowerOfTwo};
use crate::photo::Exemplar;
use crate::raster::{ALPHA_CUTOFF, Layer};
use crate::{Error, Result};

crate::params! {
    /// How the atlas is baked.
    pub struct BakeParams {
        /// Side of the square atlas.
        texture_size: PowerOfTwo = PowerOfTwo(512), in 64..=4096, unit "texels", source "ours: keeps the model under 1 MB";
        /// Half the width of the strip along shared edges in which a cut between two blocks may run.
        seam_reach: u32 = 4, in 0..=32, unit "texels of the exemplar", source "ours: a third of a polygon at --detail medium";
        /// Half the width of the blend across a cut.
        seam_blend: f64 = 1.75, in 0.0..=8.0, unit "texels of the exemplar", source "ours: hides the step and keeps the grain";
    }
}

/// A crown's texture and the surface that carries it.
#[derive(Debug, Clone)]
pub struct Atlas {
    /// The crown with normals and texture coordinates; closed again when equal positions are merged.
    pub surface: Surface,
    /// sRGB, straight alpha; alpha 0 in sky gaps, with foliage colours underneath.
    pub image: RgbaImage,
    /// The same before blending: each block cut off at its polygon's border.
    pub before: RgbaImage,
    /// Mean colour step across polygon borders ÷ mean step between neighbouring texels of the exemplar (or, where the photograph is the
    /// texture, of the photograph) at the density at which the chart shows it, before blending.
    pub seam_before: f64,
    /// The same in the finished atlas, over polygon borders and cuts alike.
    pub seam_after: f64,
    /// Mean step between neighbouring texels inside polygons ÷ the same reference, before blending.
    pub contrast_before: f64,
    /// The same in the finished atlas, away from borders and cuts.
    pub contrast: f64,
    /// The part of the atlas that the alpha test removes.
    pub gap_fraction: f64,
}

/// Texels per metre at which one exemplar texel covers one texel of the atlas.
///
/// # Errors
/// [`Error::Untexturable`] for a mesh without area, [`Error::Parameter`] for a size that is not a power of two.
pub fn texels_per_m(mesh: &PolyMesh, params: &BakeParams) -> Result<f64> {
    params.validate()?;
    let (_, area) = laid_flat(mesh)?;
    Ok(USUAL_PART * f64::from(params.texture_size.0) / area.sqrt())
}

/// The bake parameters of each crown of one tree: the crowns share about the texels of one atlas by their surface areas, so that a tree of
/// many lobes is no larger than one of a single crown. Ours; a single crown keeps the whole atlas.
pub fn shares<'a>(meshes: impl Iterator<Item = &'a PolyMesh>, params: &BakeParams) -> Vec<BakeParams> {
    let areas: Vec<f64> = meshes.map(|mesh| laid_flat(mesh).map_or(0.0, |flat| flat.1)).collect();
    let total: f64 = areas.iter().sum();
    let side = |area: f64| {
        let even = f64::from(params.texture_size.0) * (area / total).sqrt();
        // Rounded to a power of two, rather down: two equal crowns get half the side each.
        2u32.pow((even.max(64.0).log2() + 0.4).floor() as u32).clamp(64, params.texture_size.0.max(64))
    };
    let alone = areas.len() == 1 || total.is_nan() || total <= 0.0;
    areas
        .iter()
        .map(|&area| if alone { params.clone() } else { BakeParams { texture_size: PowerOfTwo(side(area)), ..params.clone() } })
        .collect()
}

/// Bakes the virtual texture of `mesh`, a crown that is star-shaped about `center`.
///
/// # Errors
/// [`Error::Untexturable`] when the mesh is flat or not the one that was textured; [`Error::Parameter`] for a size that is not a power of two.
pub fn bake(mesh: &PolyMesh, center: Vec3, texture: &VirtualTexture, exemplar: &Exemplar, params: &BakeParams) -> Result<Atlas> {
    params.validate()?;
    if texture.blocks.len() != mesh.polygon_count() {
        let found = format!("{} polygons but a texture for {}", mesh.polygon_count(), texture.blocks.len());
        return Err(Error::Untexturable { found });
    }
    let layer = Layer::from(exemplar);
    let sharp = layer.sharpened(SHARPENING);
    // An enlarged photograph has a coarser grain, so its seams need more room.
    let grain = exemplar.scale.max(1.0) as f32;
    let (chart, painter) =
        rayon::join(|| Chart::of(mesh, &texture.flat, center), || Painter::new(mesh, texture, &sharp, params, grain));
    let chart = chart?;
    let size = params.texture_size.0 as usize;
    let pieces = pieces(mesh, &chart, size as f32);
    let mut shaded = vec![None; size * size];
    shaded.par_chunks_mut(size * ROWS).enumerate().for_each(|(band, texels)| {
        let places = place_texels(&pieces, band * ROWS, size, texels.len());
        texels.iter_mut().zip(places).for_each(|(t, place)| *t = place.map(|(piece, w)| painter.texel(&pieces[piece as usize], w)));
    });
    gaps::keep_share(&mut shaded);
    let grown = |polygon: u32| texture.blocks[polygon as usize].source == BlockSource::Exemplar;
    gaps::open(&mut shaded, size, |s| grown(s.label), exemplar.gap_fraction);
    let exemplar_grain = Grain::of(&layer);
    let front_of = |polygon: u32| texture.blocks[polygon as usize].source.front().and_then(|number| texture.fronts.get(number));
    let expected = |s: &Shaded, polygon: u32, axis: usize| match front_of(polygon) {
        Some(front) => front.step(s.seen_m[axis]),
        _ => {
            let gain = texture.gains[polygon as usize].element_sum() / 3.0;
            f64::from(gain) * exemplar_grain.at(s.surface_m[axis] * texture.texels_per_m as f32)
        }
    };
    let mut figures = measure::steps(&shaded, size, expected);
    if (0.0..FULL_CONTRAST).contains(&figures.inside_after) {
        let missing = FULL_CONTRAST / figures.inside_after.max(1e-3) - 1.0;
        grain::strengthen(&mut shaded, size, missing.min(MOST_STRENGTHENING) as f32);
        figures = measure::steps(&shaded, size, expected);
    }
    let pictures = || rayon::join(|| finish(&shaded, size, |s| s.color), || finish(&shaded, size, |s| s.own));
    let (surface, (image, before)) = rayon::join(|| chart.surface(mesh), pictures);
    Ok(Atlas {
        surface,
        image,
        before,
        seam_before: figures.border_before,
        seam_after: figures.border_after,
        contrast_before: figures.inside_before,
        contrast: figures.inside_after,
        gap_fraction: gaps::share(&shaded),
    })
}

/// What sampling between texels takes from the finest grain, given back beforehand: measured, not a matter of taste.
pub(super) const SHARPENING: f32 = 0.16;

/// The part of its sources' texel contrast that an atlas is brought to where sampling and blending left less, and how far that may go.
const FULL_CONTRAST: f64 = 0.95;
const MOST_STRENGTHENING: f64 = 0.6;

/// Rows that one task draws.
const ROWS: usize = 16;

/// A triangle of the chart in atlas texels, y down.
struct Piece {
    at: [Vec2; 3],
    polygon: u32,
    /// Which corners of the polygon.
    corners: [usize; 3],
}

/// All polygons as triangles, first where they lie, then as they continue the square beyond its edges.
fn pieces(mesh: &PolyMesh, chart: &Chart, size: f32) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (c, copy) in COPIES.iter().enumerate() {
        for (p, polygon) in mesh.polygons().enumerate() {
            let at = chart.corners[p].map(|q| size * chart.uv(copy(q)));
            let (low, high) = (at.iter().copied().reduce(Vec2::min), at.iter().copied().reduce(Vec2::max));
            let seen = low.zip(high).is_some_and(|(l, h)| l.max_element() <= size && h.min_element() >= 0.0);
            if c == 0 || seen {
                let halves: &[[usize; 3]] = if polygon.len() == 4 { &[[0, 1, 2], [0, 2, 3]] } else { &[[0, 1, 2]] };
                pieces.extend(halves.iter().map(|k| Piece { at: k.map(|k| at[k]), polygon: p as u32, corners: *k }));
            }
        }
    }
    pieces
}

/// For each texel of a band, the first piece that covers its centre and the barycentric weights there.
fn place_texels(pieces: &[Piece], top: usize, size: usize, count: usize) -> Vec<Option<(u32, [f32; 3])>> {
    let mut places = vec![None; count];
    let bottom = top + count / size;
    for (number, piece) in pieces.iter().enumerate() {
        let [a, b, c] = piece.at;
        let area = (b - a).perp_dot(c - a);
        let (low, high) = (a.min(b).min(c) - 0.5, a.max(b).max(c) - 0.5);
        if area == 0.0 || high.y < top as f32 || low.y >= bottom as f32 || high.x < 0.0 {
            continue;
        }
        let rows = (low.y.ceil().max(top as f32) as usize)..(high.y.floor() as usize + 1).min(bottom);
        for y in rows {
            for x in (low.x.ceil().max(0.0) as usize)..(high.x.floor() as usize + 1).min(size) {
                let slot = &mut places[(y - top) * size + x];
                let q = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let w = [(c - b).perp_dot(q - b) / area, (a - c).perp_dot(q - c) / area, (b - a).perp_dot(q - a) / area];
                // The slack closes the hairline between neighbours; the first one keeps the texel.
                if slot.is_none() && w.iter().all(|w| *w >= -1e-4) {
                    *slot = Some((number as u32, w));
                }
            }
        }
    }
    places
}

/// What colour a place on a polygon has.
struct Painter<'a> {
    mesh: &'a PolyMesh,
    texture: &'a VirtualTexture,
    layer: &'a Layer,
    density: f32,
    blend: f32,
    mean: Vec3,
    variance: f32,
    vertex_gains: Vec<Vec3>,
    borders: Vec<[Option<Border>; 4]>,
}

/// A cut and the edge along which it runs.
struct Border {
    cut: Cut,
    /// The edge's first corner.
    from: Vec2,
    /// Times the way from there: the part of the edge, and the distance into the polygon in texels.
    along: Vec2,
    inward: Vec2,
    /// How far into the polygon the neighbour's block shows.
    deepest: f32,
}

impl<'a> Painter<'a> {
    fn new(mesh: &'a PolyMesh, texture: &'a VirtualTexture, layer: &'a Layer, params: &BakeParams, grain: f32) -> Self {
        let mean = mean_color(layer);
        let variance = layer.texels.iter().map(|t| (t.truncate() - mean).length_squared()).sum::<f32>() / layer.texels.len() as f32;
        let mut sums = vec![Vec4::ZERO; mesh.positions.len()];
        for (p, polygon) in mesh.polygons().enumerate() {
            polygon.iter().for_each(|&v| sums[v as usize] += texture.gains[p].extend(1.0));
        }
        let vertex_gains = sums.iter().map(|s| s.truncate() / s.w.max(1.0)).collect();
        let (density, blend) = (texture.texels_per_m as f32, (params.seam_blend as f32 * grain).max(0.01));
        let mut painter = Self { mesh, texture, layer, density, blend, mean, variance, vertex_gains, borders: Vec::new() };
        let cuts = painter.find_cuts((params.seam_reach as f32 * grain).round() as i32);
        painter.borders = cuts.into_iter().enumerate().map(|(p, cuts)| painter.borders_of(p, cuts)).collect();
        painter
    }

    /// A cut for every edge between blocks that do not continue each other, as both sides see it.
    fn find_cuts(&self, reach: i32) -> Vec<[Option<Cut>; 4]> {
        let hinges = &self.texture.flat.hinges;
        let mut cuts: Vec<[Option<Cut>; 4]> = (0..hinges.len())
            .into_par_iter()
            .map(|p| std::array::from_fn(|k| hinges[p][k].filter(|h| p < h.polygon).and_then(|h| self.cut(p, k, h.polygon, reach))))
            .collect();
        for p in 0..hinges.len() {
            for k in 0..4 {
                let Some(hinge) = hinges[p][k].filter(|h| p < h.polygon) else { continue };
                let back = hinges[hinge.polygon].iter().position(|h| {
                    h.is_some_and(|h| {
                        h.polygon == p && {
                            let there = hinge.unfolded.transform_point2(self.texture.flat.flats[p].corners[k]);
                            h.unfolded.transform_point2(there).distance(self.texture.flat.flats[p].corners[k]) * self.density < 0.5
                        }
                    })
                });
                if let (Some(back), Some(cut)) = (back, cuts[p][k].as_ref().map(Cut::reversed)) {
                    cuts[hinge.polygon][back] = Some(cut);
                }
            }
        }
        cuts
    }

    fn cut(&self, p: usize, k: usize, neighbor: usize, reach: i32) -> Option<Cut> {
        let flats = &self.texture.flat.flats;
        let (flat, other) = (&flats[p], &flats[neighbor]);
        let (a, b) = (flat.corners[k], flat.corners[(k + 1) % flat.count]);
        let length = a.distance(b);
        if length * self.density < 1e-3 || self.continues(p, k, neighbor, a, b) {
            return None;
        }
        let columns = ((length * self.density).ceil() as usize).clamp(1, 4096);
        // No deeper than a good third of the thinner polygon, so that opposite cuts do not meet.
        let deep = 0.4 * flat.area.min(other.area) / length * self.density;
        let inward = (b - a).perp() / length;
        let difference = |c: usize, r: i32| {
            let at = a.lerp(b, (c as f32 + 0.5) / columns as f32) + inward * (r as f32 / self.density);
            let place = flat.lift(at);
            (self.shown(p, at, place, Vec3::ONE) - self.beyond(p, k, at, place, Vec3::ONE)).length_squared()
        };
        Some(Cut::cheapest(columns, reach.min(deep as i32), difference))
    }

    fn borders_of(&self, p: usize, cuts: [Option<Cut>; 4]) -> [Option<Border>; 4] {
        let flat = &self.texture.flat.flats[p];
        let mut k = 0..;
        cuts.map(|cut| {
            let k = k.next().unwrap_or(0);
            cut.map(|cut| {
                let (from, to) = (flat.corners[k], flat.corners[(k + 1) % flat.count]);
                let (way, length) = (to - from, from.distance(to));
                let deepest = cut.depth.iter().copied().fold(0.0, f32::max) + self.blend;
                Border { cut, from, along: way / (length * length), inward: way.perp() * (self.density / length), deepest }
            })
        })
    }

    /// Whether the neighbour's block goes on where this one ends.
    fn continues(&self, p: usize, k: usize, neighbor: usize, a: Vec2, b: Vec2) -> bool {
        let (mine, theirs) = (&self.texture.blocks[p], &self.texture.blocks[neighbor]);
        let Some(hinge) = self.texture.flat.hinges[p][k] else { return false };
        match (mine.source, theirs.source) {
            (BlockSource::Front(one), BlockSource::Front(other)) => one == other,
            (BlockSource::Exemplar, BlockSource::Exemplar) => {
                let extended = theirs.map * hinge.unfolded;
                [a, b].iter().all(|&q| mine.map.transform_point2(q).distance(extended.transform_point2(q)) < 0.1)
            }
            _ => false,
        }
    }

    /// What polygon `p`'s block shows at a place of its plane; alpha × 255.
    fn shown(&self, p: usize, at: Vec2, place: Vec3, gain: Vec3) -> Vec4 {
        let block = &self.texture.blocks[p];
        match block.source.front().and_then(|number| self.texture.fronts.get(number)) {
            Some(front) => front.sample(place),
            _ => {
                let t = block.map.transform_point2(at);
                let t = self.layer.sharp(t.x, t.y);
                (gain * t.truncate()).extend(t.w)
            }
        }
    }

    /// What the block across edge `k` shows at a place of `p`'s plane.
    fn beyond(&self, p: usize, k: usize, at: Vec2, place: Vec3, gain: Vec3) -> Vec4 {
        match self.texture.flat.hinges[p][k] {
            Some(hinge) => self.shown(hinge.polygon, hinge.unfolded.transform_point2(at), place, gain),
            None => self.shown(p, at, place, gain),
        }
    }

    /// The average over a texel: where the chart squeezes the surface, of several samples.
    fn texel(&self, piece: &Piece, w: [f32; 3]) -> Shaded {
        let flat = &self.texture.flat.flats[piece.polygon as usize];
        let front = self.texture.blocks[piece.polygon as usize].source.front().and_then(|number| self.texture.fronts.get(number));
        let [a, b, c] = piece.at;
        let [p, q, r] = piece.corners.map(|k| flat.corners[k] * self.density);
        let area = (b - a).perp_dot(c - a);
        // Exemplar texels per atlas texel along x and y, and the change of the weights.
        let at = piece.corners.map(|k| self.mesh.positions[self.mesh.polygon(piece.polygon as usize)[k] as usize]);
        let along = |step: Vec2| {
            let v = step.perp_dot(c - a) / area;
            let w = (b - a).perp_dot(step) / area;
            let step = (at[1] - at[0]) * v + (at[2] - at[0]) * w;
            let seen_m = front.map_or(step.truncate().length(), |front| front.seen(step));
            (((q - p) * v + (r - p) * w).length(), [-v - w, v, w], seen_m)
        };
        let ((x_stretch, dx, x_seen_m), (y_stretch, dy, y_seen_m)) = (along(Vec2::X), along(Vec2::Y));
        let samples = |stretch: f32| if stretch.is_finite() { ((stretch - 0.35).ceil() as usize).clamp(1, 4) } else { 1 };
        let (nx, ny) = (samples(x_stretch), samples(y_stretch));
        let mut texel = self.shade(piece, w);
        (texel.surface_m, texel.seen_m) = (Vec2::new(x_stretch, y_stretch) / self.density, Vec2::new(x_seen_m, y_seen_m));
        if nx * ny == 1 {
            return texel;
        }
        let (mut own, mut color) = (Vec4::ZERO, Vec4::ZERO);
        let part = |i: usize, n: usize| (i as f32 + 0.5) / n as f32 - 0.5;
        for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))) {
            let s = self.shade(piece, std::array::from_fn(|k| w[k] + part(i, nx) * dx[k] + part(j, ny) * dy[k]));
            own += s.own;
            color += s.color;
        }
        texel.own = own / (nx * ny) as f32;
        texel.color = color / (nx * ny) as f32;
        texel
    }

    fn shade(&self, piece: &Piece, w: [f32; 3]) -> Shaded {
        let p = piece.polygon as usize;
        let flat = &self.texture.flat.flats[p];
        let polygon = self.mesh.polygon(p);
        let (mut at, mut place, mut gain) = (Vec2::ZERO, Vec3::ZERO, Vec3::ZERO);
        for (&k, w) in piece.corners.iter().zip(w) {
            at += w * flat.corners[k];
            place += w * self.mesh.positions[polygon[k] as usize];
            gain += w * self.vertex_gains[polygon[k] as usize];
        }
        let own = self.shown(p, at, place, gain);
        let mut parts = [(0.0, Vec4::ZERO); 5];
        let (mut count, mut label, mut strongest) = (1, piece.polygon, 0.0);
        let mut left = 1.0;
        for k in 0..flat.count {
            let Some(border) = &self.borders[p][k] else { continue };
            let aside = border.inward.dot(at - border.from);
            if aside >= border.deepest {
                continue;
            }
            let depth = border.cut.at(border.along.dot(at - border.from));
            let t = (0.5 - 0.5 * (aside - depth) / self.blend).clamp(0.0, 1.0);
            let share = t * t * (3.0 - 2.0 * t);
            if share > 0.0 {
                parts[count] = (share, self.beyond(p, k, at, place, gain));
                count += 1;
                left *= 1.0 - share;
                if share > strongest {
                    (label, strongest) = (self.texture.flat.hinges[p][k].map_or(piece.polygon, |h| h.polygon as u32), share);
                }
            }
        }
        parts[0] = (left, own);
        if left >= strongest {
            label = piece.polygon;
        }
        let color = if count == 1 { own } else { blend(&parts[..count], (gain * self.mean).extend(1.0), self.variance) };
        Shaded { polygon: piece.polygon, label, own, color, ..Shaded::default() }
    }
}

/// To 8 bits, colours bled under whatever the alpha test removes and over texels that no polygon covers.
fn finish(shaded: &[Option<Shaded>], size: usize, shown: impl Fn(&Shaded) -> Vec4 + Sync) -> RgbaImage {
    let mut layer = Layer::from_fn(size, size, |x, y| {
        let color = shaded[y * size + x].as_ref().map(&shown);
        color.map_or(Vec4::ZERO, |c| c.truncate().extend(f32::from(c.w >= ALPHA_CUTOFF)))
    });
    layer.bleed();
    let byte = |v: f32| (v + 0.5).clamp(0.0, 255.0) as u8;
    let mut image = RgbaImage::new(size as u32, size as u32);
    image.par_chunks_mut(4 * size).enumerate().for_each(|(y, row)| {
        for (x, texel) in row.as_chunks_mut().0.iter_mut().enumerate() {
            let i = y * size + x;
            let (t, alpha) = (layer.texels[i], shaded[i].as_ref().map_or(1.0, |s| shown(s).w));
            *texel = [byte(t.x), byte(t.y), byte(t.z), byte(255.0 * alpha)];
        }
    });
    image
}

#[cfg(test)]
#[path = "bake_tests.rs"]
mod tests;
