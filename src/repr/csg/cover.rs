//! The tree's foliage over the joined primitives: a square of it, repeated without a seam, laid flat onto each face from the nearest of 26
//! directions, so that nowhere a texel is stretched by more than a quarter; and bark on the trunk in the same way.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use image::RgbaImage;
use image::imageops::{FilterType, resize};

use super::union::Joined;
use crate::Result;
use crate::geom::Surface;
use crate::model::{Material, Part, Wrap};
use crate::photo::{ExemplarParams, exemplar};
use crate::raster::ALPHA_CUTOFF;
use crate::repr::Job;
use crate::repr::sphere_board::picture::Picture;
use crate::repr::sphere_board::subject::bark as mean_bark;
use crate::seed::Draws;

/// Corners at which normals differ by more are edges, cosine.
const SMOOTH: f64 = 0.6;

/// The crown and the trunk of what was joined; the first `crown` solids are the crown's. `bark` is a square of it and its side in metres;
/// without, the trunk is of one colour.
pub(super) fn parts(
    job: &Job,
    joined: &Joined,
    crown: usize,
    picture: &Picture,
    bark: Option<(RgbaImage, f64)>,
    side: u32,
) -> Result<Vec<Part>> {
    // Solids have no holes: each gap would come again with every tile.
    let params = ExemplarParams { delight: 0.0, gap_limit: 0.0 };
    let sample = exemplar::choose(&picture.photo, &picture.crown, &picture.gaps, 1.0, &params)?;
    let tile = endless(&sample.image, side, job.seed.keyed("csg tile", 0));
    let tile_m = 2.0 * f64::from(sample.window_px.width) * picture.metres_per_px;
    let of = |wanted: &dyn Fn(usize) -> bool, tile_m: Option<f64>| surface(joined, wanted, tile_m);
    let bark_seen = bark.map(|(picture, width_m)| (endless(&picture, side / 2, job.seed.keyed("csg tile", 1)), 2.0 * width_m));
    let foliage = Material {
        name: "foliage".to_owned(),
        texture: Some(Arc::new(tile)),
        wrap: Wrap::Repeat,
        alpha_cutoff: Some(ALPHA_CUTOFF),
        ..Material::default()
    };
    let leaves = of(&|solid| solid < crown, Some(tile_m));
    let trunk = of(&|solid| solid >= crown, bark_seen.as_ref().map(|seen| seen.1));
    let wood = match bark_seen {
        Some((tile, _)) => Material { texture: Some(Arc::new(tile)), wrap: Wrap::Repeat, ..Material::default() },
        None => Material { factor: mean_bark(job), ..Material::default() },
    };
    let wood = Material { name: "bark".to_owned(), ..wood };
    let part = |name: &str, surface, material| Part { name: name.to_owned(), surface, material, crown_center: None };
    let parts = vec![part("crown", leaves, foliage), part("trunk", trunk, wood)];
    Ok(parts.into_iter().filter(|part| part.surface.mesh.polygon_count() > 0).collect())
}

/// Patches along each side of a tile, how wide each is in its distance from the next, and how many of these distances a sample has.
const PATCHES: u32 = 4;
const PATCH: f32 = 1.35;
const PATCHES_PER_SAMPLE: u32 = 2;

/// A square that goes on without a seam, twice as wide as the sample: patches from anywhere in it, laid side by side, that run into one
/// another. Where they do, means would be flat: their differences from the mean colour are scaled to keep their variance (Heitz & Neyret
/// 2018, "High-performance by-example noise using a histogram-preserving blending operator", §3).
fn endless(sample: &RgbaImage, side: u32, mut draws: Draws) -> RgbaImage {
    let apart = (side / PATCHES).max(1);
    let sample = resize(sample, PATCHES_PER_SAMPLE * apart, PATCHES_PER_SAMPLE * apart, FilterType::Triangle);
    let color = |texel: &image::Rgba<u8>| Vec3::from([texel[0], texel[1], texel[2]].map(f32::from));
    let mean = sample.pixels().map(color).sum::<Vec3>() / (sample.width() * sample.height()) as f32;
    let reach = (PATCH * apart as f32).ceil() as u32;
    let free = f64::from(sample.width().saturating_sub(reach));
    let mut offset = || (draws.unit() * free) as u32;
    let offsets: Vec<[u32; 2]> = (0..PATCHES * PATCHES).map(|_| [offset(), offset()]).collect();
    // From nothing at a patch's edge to all where its neighbour ends.
    let ramp = |at: u32| {
        let within = (at as f32 + 0.5).min(reach as f32 - at as f32 - 0.5);
        (within / (reach - apart).max(1) as f32).clamp(0.0, 1.0)
    };
    let side = PATCHES * apart;
    RgbaImage::from_fn(side, side, |x, y| {
        let (mut sum, mut squares, mut whole) = (Vec3::ZERO, 0.0, 0.0);
        for (number, [left, top]) in offsets.iter().enumerate() {
            let number = number as u32;
            let at = |p: u32, patch: u32| (p + side - patch * apart) % side;
            let (u, v) = (at(x, number % PATCHES), at(y, number / PATCHES));
            if u < reach && v < reach {
                let weight = ramp(u) * ramp(v);
                let texel = sample.get_pixel((left + u).min(sample.width() - 1), (top + v).min(sample.height() - 1));
                sum += weight * (color(texel) - mean);
                (squares, whole) = (squares + weight * weight, whole + weight);
            }
        }
        let blended: Vec3 = if whole > 0.0 { mean + sum / f32::sqrt(squares) } else { mean };
        let [r, g, b] = blended.to_array().map(|v| v.round().clamp(0.0, 255.0) as u8);
        image::Rgba([r, g, b, 255])
    })
}

/// The triangles of the solids that are wanted, with normals and, where a tile has a size, places on it.
fn surface(joined: &Joined, wanted: &dyn Fn(usize) -> bool, tile_m: Option<f64>) -> Surface {
    let positions = &joined.solid.positions;
    let normal = |t: &[usize; 3]| {
        let [a, b, c] = t.map(|v| positions[v]);
        (b - a).cross(c - a)
    };
    // Per vertex and solid: where two solids meet there is an edge.
    let mut around: BTreeMap<(usize, usize), Vec<DVec3>> = BTreeMap::new();
    for (t, of) in joined.solid.triangles.iter().zip(&joined.of) {
        t.iter().for_each(|&v| around.entry((v, *of)).or_default().push(normal(t)));
    }
    let mut surface = Surface::default();
    let mut numbers: BTreeMap<(usize, [u32; 3], usize), u32> = BTreeMap::new();
    for (t, of) in joined.solid.triangles.iter().zip(&joined.of).filter(|(_, of)| wanted(**of)) {
        let at = t.map(|v| positions[v].as_vec3());
        // What the smaller numbers of a file cannot tell apart is no triangle.
        if at[0] == at[1] || at[1] == at[2] || at[2] == at[0] {
            continue;
        }
        let own = normal(t).normalize_or(DVec3::Y);
        let facing = nearest_direction(own);
        let corner = t.map(|v| {
            let alike = around[&(v, *of)].iter().filter(|n| n.normalize_or_zero().dot(own) > SMOOTH);
            let smooth = alike.sum::<DVec3>().normalize_or(own).as_vec3();
            *numbers.entry((v, smooth.to_array().map(f32::to_bits), tile_m.map_or(0, |_| facing))).or_insert_with(|| {
                surface.mesh.positions.push(positions[v].as_vec3());
                surface.normals.push(smooth.normalize_or(Vec3::Y));
                if let Some(tile_m) = tile_m {
                    surface.uvs.push(laid(positions[v], facing, tile_m));
                }
                surface.normals.len() as u32 - 1
            })
        });
        surface.mesh.triangles.push(corner);
    }
    surface
}

/// The 26 directions to the faces, edges and corners of a cube, numbered.
fn direction(number: usize) -> DVec3 {
    let axis = |k: usize| (k % 3) as f64 - 1.0;
    DVec3::new(axis(number), axis(number / 3), axis(number / 9)).normalize_or(DVec3::Y)
}

fn nearest_direction(normal: DVec3) -> usize {
    let numbers = (0..27).filter(|&number| number != 13);
    numbers.max_by(|&a, &b| direction(a).dot(normal).total_cmp(&direction(b).dot(normal))).unwrap_or(14)
}

/// A place on the tile, upright, as one sees it who looks against the direction.
fn laid(place: DVec3, facing: usize, tile_m: f64) -> Vec2 {
    let toward = direction(facing);
    let right = DVec3::Y.cross(toward).normalize_or(DVec3::X);
    let up = toward.cross(right);
    // Another part of the tile for each direction, so that its middle does not repeat.
    let shift = facing as f64 * 0.37;
    Vec2::new((place.dot(right) / tile_m + shift) as f32, (-place.dot(up) / tile_m + 0.61 * shift) as f32)
}
