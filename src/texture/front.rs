//! Photographs as textures: what the polygons that faced a camera show, and how its brightness runs on round the crown.
//!
//! Ours (She textures every polygon from the sample): with `--front photo` the tree on the map is recognisably the tree in the picture.

use glam::{DVec2, Vec2, Vec3, Vec4};
use image::RgbImage;

use super::SynthParams;
use super::bake::SHARPENING;
use super::flat::FlatMesh;
use super::grain::Grain;
use crate::geom::PolyMesh;
use crate::photo::delight::{ReducedCrown, Shading, foliage_at};
use crate::photo::exemplar::encoded_mean;
use crate::raster::{Layer, Mask};

/// A photograph of the crown, and where object space lies in it: parallel projection.
#[derive(Debug, Clone, Copy)]
pub struct Front<'a> {
    /// 8-bit sRGB.
    pub image: &'a RgbImage,
    /// The crown.
    pub crown: &'a Mask,
    /// Sky gaps inside it.
    pub gaps: &'a Mask,
    /// Metres per pixel.
    pub metres_per_px: f64,
    /// Where the origin of object space lies, pixels.
    pub foot_px: DVec2,
    /// What the photographer had on the right, above and before him: unit vectors of object space, the last towards him.
    pub axes: [Vec3; 3],
    /// Encoded sRGB that its foliage is brought to on average, so that photographs of another exposure agree; `None` for its own.
    pub mean: Option<Vec3>,
    /// The part of the photograph's shading to take out, as for the exemplar, so that front and back agree.
    pub delight: f64,
}

/// The front, resampled to the atlas's density and delighted.
pub(super) struct FrontLayer {
    /// Encoded sRGB 0..=255 with foliage bled over gaps and beyond the rim; alpha 0 in gaps.
    layer: Layer,
    /// Of the photograph itself, before sharpening.
    grain: Grain,
    /// 1 where the photograph shows this crown, well inside its rim.
    usable: Layer,
    origin_px: DVec2,
    texels_per_px: f64,
    foot_px: DVec2,
    metres_per_px: f64,
    axes: [Vec3; 3],
}

/// The fronts of one crown.
#[derive(Default)]
pub(super) struct Fronts {
    layers: Vec<FrontLayer>,
}

impl FrontLayer {
    /// `None` when the crown is empty or the scale says nothing.
    pub(super) fn of(front: &Front, texels_per_m: f64) -> Option<Self> {
        let (crown, gaps) = (front.crown, front.gaps);
        let size = front.image.dimensions();
        if [crown, gaps].iter().any(|m| (m.width(), m.height()) != size)
            || !(front.metres_per_px > 0.0 && front.foot_px.is_finite())
        {
            return None;
        }
        let reduced = ReducedCrown::of(front.image, crown, gaps).filter(|r| r.mean().is_some())?;
        let shading = Shading::of(&reduced, front.delight);
        // More texels than pixels would be empty; more than 4096 would be cut from a crown no atlas can hold.
        let longest = f64::from(reduced.bounds.width.max(reduced.bounds.height));
        let texels_per_px = (texels_per_m * front.metres_per_px).clamp(1e-6, 2.0).min(4096.0 / longest);
        let texels = |px: u32| ((f64::from(px) * texels_per_px).ceil() as usize).max(1);
        let (width, height) = (texels(reduced.bounds.width), texels(reduced.bounds.height));
        let origin_px = DVec2::new(f64::from(reduced.bounds.x), f64::from(reduced.bounds.y));
        let (origin, extent) = (origin_px.to_array(), [width as f64 / texels_per_px, height as f64 / texels_per_px]);
        let inside = Layer::area_average(width, height, origin, extent, |x, y| {
            Vec4::new(0.0, f32::from(crown.get(x, y) && gaps.get(x, y)), 0.0, f32::from(crown.get(x, y)))
        });
        let averaged = Layer::area_average(width, height, origin, extent, |x, y| foliage_at(front.image, crown, gaps, x, y));
        let averaged = shading.removed(averaged, origin, extent);
        // Two texels inwards the rim no longer mixes with the sky.
        let deep = inside.low_pass(1);
        let mut layer = averaged.straightened();
        layer.texels.iter_mut().zip(&deep.texels).filter(|(_, d)| d.w <= 0.85).for_each(|(t, _)| t.w = 0.0);
        if layer.texels.iter().all(|t| t.w == 0.0) {
            return None;
        }
        layer.bleed();
        for (t, i) in layer.texels.iter_mut().zip(&inside.texels) {
            t.w = 1.0 - if i.w > 0.0 { i.y / i.w } else { 0.0 };
        }
        let usable = Layer { texels: deep.texels.iter().map(|t| Vec4::splat(f32::from(t.w > 0.9))).collect(), ..deep };
        // Taking the shading out in linear light brightens the encoded mean; the exemplar has the photograph's, and so has the front.
        if let Some(mean) = front.mean.or_else(|| encoded_mean(front.image, crown, gaps)) {
            let weights: Vec<f32> = layer.texels.iter().zip(&usable.texels).map(|(t, u)| t.w * u.w).collect();
            layer.shift_mean(&weights, mean);
        }
        let seen = layer.texels.iter().zip(&usable.texels).map(|(t, u)| t.truncate().extend(t.w * u.w));
        let grain = Grain::of(&Layer { width, height, texels: seen.collect() });
        let layer = layer.sharpened(SHARPENING);
        let Front { foot_px, metres_per_px, axes, .. } = *front;
        Some(Self { layer, grain, usable, origin_px, texels_per_px, foot_px, metres_per_px, axes })
    }

    /// Mean colour step in the photograph between places that are so far apart in it.
    pub(super) fn step(&self, distance_m: f32) -> f64 {
        self.grain.at(distance_m * (self.texels_per_px / self.metres_per_px) as f32)
    }

    fn texel(&self, p: Vec3) -> (f32, f32) {
        let [right, up, _] = self.axes;
        let px = self.foot_px + DVec2::new(f64::from(p.dot(right)), -f64::from(p.dot(up))) / self.metres_per_px;
        let at = (px - self.origin_px) * self.texels_per_px;
        (at.x as f32, at.y as f32)
    }

    /// What the photograph shows of a place, continued beyond the rim by the nearest foliage.
    pub(super) fn sample(&self, p: Vec3) -> Vec4 {
        let (x, y) = self.texel(p);
        self.layer.sharp(x.clamp(0.0, self.layer.width as f32), y.clamp(0.0, self.layer.height as f32))
    }

    fn shows(&self, p: Vec3) -> bool {
        let (x, y) = self.texel(p);
        x >= 0.0
            && y >= 0.0
            && (x as usize) < self.usable.width
            && (y as usize) < self.usable.height
            && self.usable.texels[y as usize * self.usable.width + x as usize].w > 0.5
    }

    /// A step on the surface as the photographer saw it, metres.
    pub(super) fn seen(&self, step: Vec3) -> f32 {
        Vec2::new(step.dot(self.axes[0]), step.dot(self.axes[1])).length()
    }

    /// Logarithm of what the photograph shows of a polygon over `mean`, bounded to 0.4..=2.5.
    fn log_gain(&self, mesh: &PolyMesh, polygon: &[u32], mean: Vec3) -> Vec3 {
        let corners = polygon.iter().map(|&v| mesh.positions[v as usize]);
        let middle = corners.clone().sum::<Vec3>() / polygon.len() as f32;
        let sum: Vec4 = corners.chain([middle]).map(|c| self.sample(c)).map(|t| (t.w * t.truncate()).extend(t.w)).sum();
        let local = if sum.w > 0.1 { sum.truncate() / sum.w } else { mean };
        (local.max(Vec3::ONE) / mean.max(Vec3::ONE)).clamp(Vec3::splat(0.4), Vec3::splat(2.5)).map(f32::ln)
    }
}

impl Fronts {
    pub(super) fn of(fronts: &[Front], texels_per_m: f64) -> Self {
        Self { layers: fronts.iter().filter_map(|front| FrontLayer::of(front, texels_per_m)).collect() }
    }

    pub(super) fn get(&self, number: u8) -> Option<&FrontLayer> {
        self.layers.get(usize::from(number))
    }

    /// Which photograph each polygon takes its texture from: of those to which its smoothed normal turns and that show its corners and
    /// middle, the one that it faces most.
    pub(super) fn polygons(&self, mesh: &PolyMesh, flat: &FlatMesh, params: &SynthParams) -> Vec<Option<u8>> {
        let normals = if self.layers.is_empty() { vec![] } else { smoothed_normals(flat) };
        let least = (params.front_angle_deg as f32).to_radians().cos();
        let front = |(p, polygon): (usize, &[u32])| {
            let corners = || polygon.iter().map(|&v| mesh.positions[v as usize]);
            let middle = corners().sum::<Vec3>() / polygon.len() as f32;
            let faced = (0..).zip(&self.layers).filter_map(|(number, front)| {
                let toward = normals[p].dot(front.axes[2]);
                let faces = toward > least && flat.flats[p].normal.dot(front.axes[2]) > 0.75 * least;
                (faces && corners().chain([middle]).all(|c| front.shows(c))).then_some((number, toward))
            });
            faced.reduce(|best, next| if next.1 > best.1 { next } else { best }).map(|best| best.0)
        };
        mesh.polygons().enumerate().map(front).collect()
    }

    /// Per polygon and channel, how much brighter than `mean` the texture is: known where a photograph is used, and running on from
    /// there over the neighbours, fading to 1, so that no band shows where the photographs end.
    pub(super) fn gains(&self, mesh: &PolyMesh, flat: &FlatMesh, facing: &[Option<u8>], mean: Vec3) -> Vec<Vec3> {
        if self.layers.is_empty() {
            return vec![Vec3::ONE; flat.flats.len()];
        }
        let local = |(p, polygon): (usize, &[u32])| {
            facing[p].and_then(|number| self.get(number)).map_or(Vec3::ZERO, |front| front.log_gain(mesh, polygon, mean))
        };
        let facing: Vec<bool> = facing.iter().map(Option::is_some).collect();
        let mut log: Vec<Vec3> = mesh.polygons().enumerate().map(local).collect();
        // Rounds that reach about a third of the way round; the photograph's own polygons are only smoothed.
        let rounds = (1.2 * (log.len() as f32).sqrt()) as usize;
        let fade = 1.0 - 1.0 / (0.3 * log.len() as f32).max(2.0);
        for round in 0..rounds {
            let next = |p: usize| {
                if facing[p] && round >= SMOOTHING {
                    return log[p];
                }
                let around = flat.hinges[p].iter().flatten().filter(|h| !facing[p] || facing[h.polygon]);
                let (sum, n) = around.fold((log[p], 1.0), |(s, n), h| (s + log[h.polygon], n + 1.0));
                fade * sum / n
            };
            log = (0..log.len()).map(next).collect();
        }
        log.iter().map(|l| l.map(f32::exp)).collect()
    }
}

/// Rounds in which the photograph's own polygons average with each other: single leaves are no shading.
const SMOOTHING: usize = 4;

/// Normals averaged twice with the neighbours', so that the disturbed surface has one rim and no islands.
fn smoothed_normals(flat: &FlatMesh) -> Vec<Vec3> {
    let mut normals: Vec<Vec3> = flat.flats.iter().map(|f| f.area * f.normal).collect();
    for _ in 0..2 {
        normals = (0..normals.len())
            .map(|p| normals[p] + flat.hinges[p].iter().flatten().map(|h| normals[h.polygon]).sum::<Vec3>())
            .collect();
    }
    normals.iter().map(|n| n.normalize_or(Vec3::Y)).collect()
}
