//! The photograph as a texture: what the polygons that faced the camera show, and how its brightness runs on round the crown.
//!
//! Ours (She textures every polygon from the sample): with `--front photo` the tree on the map is recognisably the tree in the picture.

use glam::{DVec2, Vec3, Vec4};
use image::RgbImage;

use super::SynthParams;
use super::bake::SHARPENING;
use super::flat::FlatMesh;
use super::grain::Grain;
use crate::geom::PolyMesh;
use crate::photo::delight::{ReducedCrown, Shading, foliage_at};
use crate::photo::exemplar::encoded_mean;
use crate::raster::{Layer, Mask};

/// The photograph of the crown's front, and where object space lies in it: parallel projection along −Z.
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
        if let Some(mean) = encoded_mean(front.image, crown, gaps) {
            let weights: Vec<f32> = layer.texels.iter().zip(&usable.texels).map(|(t, u)| t.w * u.w).collect();
            layer.shift_mean(&weights, mean);
        }
        let seen = layer.texels.iter().zip(&usable.texels).map(|(t, u)| t.truncate().extend(t.w * u.w));
        let grain = Grain::of(&Layer { width, height, texels: seen.collect() });
        let layer = layer.sharpened(SHARPENING);
        Some(Self { layer, grain, usable, origin_px, texels_per_px, foot_px: front.foot_px, metres_per_px: front.metres_per_px })
    }

    /// Mean colour step in the photograph between places that are so far apart in it.
    pub(super) fn step(&self, distance_m: f32) -> f64 {
        self.grain.at(distance_m * (self.texels_per_px / self.metres_per_px) as f32)
    }

    fn texel(&self, p: Vec3) -> (f32, f32) {
        let px = self.foot_px + DVec2::new(f64::from(p.x), -f64::from(p.y)) / self.metres_per_px;
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

    /// Which polygons take their texture from the photograph: those whose smoothed normal faces the camera and whose corners and middle
    /// it shows.
    pub(super) fn polygons(&self, mesh: &PolyMesh, flat: &FlatMesh, params: &SynthParams) -> Vec<bool> {
        let normals = smoothed_normals(flat);
        let least = (params.front_angle_deg as f32).to_radians().cos();
        mesh.polygons()
            .enumerate()
            .map(|(p, polygon)| {
                let corners = || polygon.iter().map(|&v| mesh.positions[v as usize]);
                let middle = corners().sum::<Vec3>() / polygon.len() as f32;
                normals[p].z > least && flat.flats[p].normal.z > 0.75 * least && corners().chain([middle]).all(|c| self.shows(c))
            })
            .collect()
    }

    /// Per polygon and channel, how much brighter than `mean` the texture is: known where the photograph is used, and running on from
    /// there over the neighbours, fading to 1, so that no band shows where the photograph ends.
    pub(super) fn gains(&self, mesh: &PolyMesh, flat: &FlatMesh, facing: &[bool], mean: Vec3) -> Vec<Vec3> {
        let local = |(p, polygon): (usize, &[u32])| if facing[p] { self.log_gain(mesh, polygon, mean) } else { Vec3::ZERO };
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

    /// Logarithm of what the photograph shows of a polygon over `mean`, bounded to 0.4..=2.5.
    fn log_gain(&self, mesh: &PolyMesh, polygon: &[u32], mean: Vec3) -> Vec3 {
        let corners = polygon.iter().map(|&v| mesh.positions[v as usize]);
        let middle = corners.clone().sum::<Vec3>() / polygon.len() as f32;
        let sum: Vec4 = corners.chain([middle]).map(|c| self.sample(c)).map(|t| (t.w * t.truncate()).extend(t.w)).sum();
        let local = if sum.w > 0.1 { sum.truncate() / sum.w } else { mean };
        (local.max(Vec3::ONE) / mean.max(Vec3::ONE)).clamp(Vec3::splat(0.4), Vec3::splat(2.5)).map(f32::ln)
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
