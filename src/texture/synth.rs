//! The virtual texture: polygons in breadth-first order, each extended from its one synthesised neighbour or matched with several
//! (She §3.2, fig. 10–12).

use std::collections::VecDeque;

use glam::{Affine2, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::flat::{Flat, FlatMesh};
use super::front::{Front, Fronts};
use super::matching::{ALPHA, Matcher, Sample, upright};
use crate::geom::PolyMesh;
use crate::photo::Exemplar;
use crate::raster::Layer;
use crate::{Error, Result, Seed};

crate::choices! {
    /// Where the polygons that faced the camera take their texture from.
    pub enum FrontChoice {
        /// The photograph itself.
        Photo = "photo",
        /// The exemplar, as for all others: the paper's way.
        Synth = "synth",
    }
}

crate::params! {
    /// How the texture is grown over the crown.
    pub struct SynthParams {
        /// Texture of the polygons that faced the camera.
        front: FrontChoice = FrontChoice::Photo, unit "", source "ours: the tree on the map should be the tree in the picture";
        /// Largest angle between a polygon's normal and the camera at which it takes the photograph's texture.
        front_angle_deg: f64 = 52.0, in 5.0..=80.0, unit "°", source "ours: beyond it the photograph would be stretched more than 1.6 times";
        /// Largest lean of a block of texture from upright; one that leans further is matched anew.
        block_lean_deg: f64 = 25.0, in 0.0..=180.0, unit "°", source "ours: leaves hang, so their texture must not lie on its side";
    }
}

/// Where a polygon's block lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockSource {
    /// In a photograph (parallel projection), `--front photo`: its number.
    Front(u8),
    /// In the exemplar.
    Exemplar,
}

impl BlockSource {
    /// Which photograph.
    pub fn front(self) -> Option<u8> {
        match self {
            Self::Front(number) => Some(number),
            Self::Exemplar => None,
        }
    }
}

/// One polygon's part of the virtual texture.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    /// Which picture it is in.
    pub source: BlockSource,
    /// Texture coordinates of the polygon's corners, exemplar texels (zero for [`BlockSource::Front`]); a triangle repeats its last.
    pub corners: [Vec2; 4],
    /// Synthesised neighbours at its turn (She fig. 10).
    pub cv: u8,
    /// From the polygon's plane, metres, to exemplar texels.
    pub(super) map: Affine2,
}

/// How the polygons came by their texture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Counts {
    /// Taken from the photograph.
    pub front: usize,
    /// CV 0: placed by the seed.
    pub started: usize,
    /// CV 1: extended across the shared edge.
    pub extended: usize,
    /// CV 1, but the extension would have left the exemplar or leaned too far: matched.
    pub rematched: usize,
    /// CV 2, 3 and 4: matched with all neighbours.
    pub matched: [usize; 3],
}

/// Texture coordinates for every polygon.
pub struct VirtualTexture {
    /// Exemplar texels per metre.
    pub texels_per_m: f64,
    /// One per polygon, triangles first.
    pub blocks: Vec<Block>,
    /// How they came about.
    pub counts: Counts,
    pub(super) flat: FlatMesh,
    pub(super) fronts: Fronts,
    /// Brightness of each polygon against the exemplar's mean.
    pub(super) gains: Vec<Vec3>,
}

/// Texels between the samples along a shared edge, and from the edge to the samples on either side.
const SPACING: f32 = 1.5;
const ASIDE: f32 = 1.0;

/// Grows the texture over `mesh`.
///
/// `texels_per_m` is the exemplar's own density: its scale (texels per pixel) over the photograph's metres per pixel.
/// `fronts`, at most 255 of them, are used when `params.front` says so. Same mesh, exemplar and seed give the same blocks.
///
/// # Errors
/// [`Error::Untexturable`] for a mesh without area or with broken polygons, [`Error::Exemplar`] for an empty exemplar,
/// [`Error::Parameter`] for a density that is not positive.
pub fn synthesize(
    mesh: &PolyMesh,
    exemplar: &Exemplar,
    texels_per_m: f64,
    fronts: &[Front],
    params: &SynthParams,
    seed: Seed,
) -> Result<VirtualTexture> {
    if exemplar.image.width() < 2 || exemplar.image.height() < 2 {
        return Err(Error::Exemplar { found: "an exemplar of less than 2×2 texels".into() });
    }
    if !(texels_per_m.is_finite() && texels_per_m > 0.0) {
        let expected = "a positive number".into();
        return Err(Error::Parameter { name: "texels per metre".into(), expected, found: texels_per_m.to_string() });
    }
    let flat = FlatMesh::of(mesh)?;
    let layer = Layer::from(exemplar);
    let used = if params.front == FrontChoice::Photo { fronts } else { &[] };
    let fronts = Fronts::of(&used[..used.len().min(255)], texels_per_m);
    let facing = fronts.polygons(mesh, &flat, params);
    let gains = fronts.gains(mesh, &flat, &facing, mean_color(&layer));
    let density = texels_per_m as f32;
    let reach = flat.flats.iter().flat_map(|f| f.corners().iter().map(|c| c.distance(f.middle()))).fold(0.0, f32::max) * density;
    let matcher = Matcher::new(&layer, reach + SPACING + ASIDE, exemplar.gap_fraction as f32);
    let mut grower = Grower { flat: &flat, layer: &layer, fronts: &fronts, gains: &gains, matcher, density, params, seed };
    // Inside the pool from the start: the many short waves must not each wake it.
    let (blocks, counts) = rayon::scope(|_| grower.grow(&facing));
    Ok(VirtualTexture { texels_per_m, blocks, counts, flat, fronts, gains })
}

/// Mean of the opaque texels, encoded sRGB 0..=255.
pub(super) fn mean_color(layer: &Layer) -> Vec3 {
    let sum: Vec4 = layer.texels.iter().map(|t| (t.w * t.truncate()).extend(t.w)).sum();
    if sum.w > 0.0 { sum.truncate() / sum.w } else { Vec3::splat(128.0) }
}

struct Grower<'a> {
    flat: &'a FlatMesh,
    layer: &'a Layer,
    fronts: &'a Fronts,
    gains: &'a [Vec3],
    matcher: Matcher,
    density: f32,
    params: &'a SynthParams,
    seed: Seed,
}

/// How a polygon came by its block.
enum How {
    Started,
    Extended,
    Rematched,
    Matched(usize),
}

/// Blocks placed at once: each sees how often the exemplar was used before them, but not by each other.
const AT_ONCE: usize = 32;

impl Grower<'_> {
    fn grow(&mut self, facing: &[Option<u8>]) -> (Vec<Block>, Counts) {
        let n = self.flat.flats.len();
        let mut blocks: Vec<Option<Block>> = vec![None; n];
        let mut counts = Counts { front: facing.iter().flatten().count(), ..Counts::default() };
        for (block, number) in blocks.iter_mut().zip(facing).filter_map(|(block, number)| Some((block, (*number)?))) {
            *block = Some(Block { source: BlockSource::Front(number), corners: [Vec2::ZERO; 4], cv: 0, map: Affine2::IDENTITY });
        }
        let facing: Vec<bool> = facing.iter().map(Option::is_some).collect();
        for wave in self.waves(&facing) {
            for together in wave.chunks(AT_ONCE) {
                let placed: Vec<(Block, How)> = together.par_iter().map(|&p| self.place(p, &blocks)).collect();
                for (&p, (block, how)) in together.iter().zip(placed) {
                    let flat = &self.flat.flats[p];
                    self.matcher.note(block.map.transform_point2(flat.middle()), flat.area);
                    blocks[p] = Some(block);
                    match how {
                        How::Started => counts.started += 1,
                        How::Extended => counts.extended += 1,
                        How::Rematched => counts.rematched += 1,
                        How::Matched(cv) => counts.matched[cv.min(4) - 2] += 1,
                    }
                }
            }
        }
        (blocks.into_iter().map(|b| b.expect("every polygon is in one wave")).collect(), counts)
    }

    /// The polygons that do not face the camera, breadth first, in waves: a polygon's wave comes after those of all neighbours before it in
    /// that order, so that a wave's polygons do not touch and can be placed at once without anything else being known to them.
    fn waves(&self, facing: &[bool]) -> Vec<Vec<usize>> {
        let n = self.flat.flats.len();
        let mut queue: VecDeque<usize> = (0..n).filter(|&p| facing[p]).collect();
        let mut queued = facing.to_vec();
        let mut wave_of: Vec<Option<usize>> = vec![None; n];
        let mut waves: Vec<Vec<usize>> = Vec::new();
        // The start, then whatever the edges did not reach.
        let first = self.seed.keyed("texture-start", 0).below(n);
        for start in std::iter::once(first).chain(0..n) {
            if queue.is_empty() && !std::mem::replace(&mut queued[start], true) {
                queue.push_back(start);
            }
            while let Some(p) = queue.pop_front() {
                let neighbors = || self.flat.hinges[p].iter().flatten().map(|h| h.polygon);
                if !facing[p] {
                    let wave = neighbors().filter_map(|q| wave_of[q]).max().map_or(0, |w| w + 1);
                    wave_of[p] = Some(wave);
                    waves.resize_with(waves.len().max(wave + 1), Vec::new);
                    waves[wave].push(p);
                }
                queue.extend(neighbors().filter(|&q| !std::mem::replace(&mut queued[q], true)));
            }
        }
        waves
    }

    /// One polygon's block, given what is synthesised so far.
    fn place(&self, p: usize, blocks: &[Option<Block>]) -> (Block, How) {
        let flat = &self.flat.flats[p];
        let hinges = self.flat.hinges[p].iter().enumerate();
        let known: Vec<(usize, Affine2, &Block)> =
            hinges.filter_map(|(k, h)| h.and_then(|h| blocks[h.polygon].as_ref().map(|b| (k, b.map * h.unfolded, b)))).collect();
        let extensions: Vec<Affine2> = known.iter().filter(|k| k.2.source == BlockSource::Exemplar).map(|k| k.1).collect();
        let mut draws = self.seed.keyed("texture-block", p as u64);
        let up = flat.up.unwrap_or_else(|| extensions.first().map_or(Vec2::Y, carried_up));
        let jitter = (4.0 * draws.signed() as f32).to_radians();
        let (map, how) = match (known.len(), extensions.first()) {
            (0, _) => (self.start(flat, up, jitter, [draws.unit(), draws.unit()]), How::Started),
            (1, Some(&extended)) if self.allowed(flat, up, extended) => (extended, How::Extended),
            (cv, _) => {
                let how = if cv == 1 { How::Rematched } else { How::Matched(cv) };
                (self.matched(p, &known, &extensions, up, jitter), how)
            }
        };
        let corners = flat.corners.map(|c| map.transform_point2(c));
        (Block { source: BlockSource::Exemplar, corners, cv: known.len() as u8, map }, how)
    }

    fn start(&self, flat: &Flat, up: Vec2, jitter: f32, draw: [f64; 2]) -> Affine2 {
        let linear = upright(up, jitter, self.density);
        let [xs, ys] = self.matcher.places(flat, linear);
        let within = |(from, to): (i64, i64), t: f64| from as f32 + (t * (to - from) as f64) as f32;
        Affine2::from_mat2_translation(linear, Vec2::new(within(xs, draw[0]), within(ys, draw[1])) - linear * flat.middle())
    }

    /// Whether an extension stays inside the exemplar and near upright.
    fn allowed(&self, flat: &Flat, up: Vec2, map: Affine2) -> bool {
        let inside = |c: &Vec2| {
            let t = map.transform_point2(*c);
            t.x >= 0.0 && t.y >= 0.0 && t.x <= self.layer.width as f32 && t.y <= self.layer.height as f32
        };
        let upright = (map.matrix2 * up).normalize_or(Vec2::ZERO).dot(-Vec2::Y);
        flat.corners().iter().all(inside) && upright >= (self.params.block_lean_deg as f32).to_radians().cos()
    }

    /// The block that agrees best with the neighbours: searched, or one neighbour's extension where that is better still.
    fn matched(&self, p: usize, known: &[(usize, Affine2, &Block)], extensions: &[Affine2], up: Vec2, jitter: f32) -> Affine2 {
        let flat = &self.flat.flats[p];
        let border: Vec<Sample> = known.iter().flat_map(|k| self.border(p, k.0, k.1, k.2)).collect();
        // Dealt out, so that the first few already speak for the whole border and poor candidates are dropped early.
        let stride = (border.len() / 8) | 1;
        let samples: Vec<Sample> = (0..stride).flat_map(|i| border.iter().skip(i).step_by(stride)).copied().collect();
        let (mut best, mut least) = self.matcher.best(flat, &samples, up, jitter, self.density);
        for &extended in extensions.iter().filter(|e| self.allowed(flat, up, **e)) {
            let cost = self.matcher.cost_of(flat, &samples, extended);
            if cost < least {
                (best, least) = (extended, cost);
            }
        }
        best
    }

    /// What the neighbour across edge `k` shows along it, in this polygon's plane.
    fn border(&self, p: usize, k: usize, map: Affine2, block: &Block) -> Vec<Sample> {
        let flat = &self.flat.flats[p];
        let (a, b) = (flat.corners[k], flat.corners[(k + 1) % flat.count]);
        let length = a.distance(b) * self.density;
        let n = ((length / SPACING).ceil() as usize).clamp(1, 12);
        let inward = (b - a).normalize_or(Vec2::X).perp() * (ASIDE / self.density);
        let neighbor = self.flat.hinges[p][k].map_or(p, |h| h.polygon);
        let front = block.source.front().and_then(|number| self.fronts.get(number));
        let shown = |at: Vec2| match front {
            Some(front) => {
                let t = front.sample(flat.lift(at));
                (t.truncate() / self.gains[neighbor]).extend(t.w)
            }
            _ => {
                let t = map.transform_point2(at);
                self.layer.bilinear(t.x, t.y)
            }
        };
        let sample = |at: Vec2| {
            let t = shown(at);
            Sample { at, shown: t.truncate().extend(ALPHA * t.w) }
        };
        (0..n).flat_map(|i| [1.0, -1.0].map(|side| sample(a.lerp(b, (i as f32 + 0.5) / n as f32) + side * inward))).collect()
    }
}

/// The direction in the polygon's plane that a map shows upright.
fn carried_up(map: &Affine2) -> Vec2 {
    (map.matrix2.inverse() * -Vec2::Y).normalize_or(Vec2::Y)
}

#[cfg(test)]
#[path = "synth_tests.rs"]
mod tests;
