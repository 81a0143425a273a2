//! The tree's foliage over the joined primitives: a square of it, repeated without a seam, laid flat onto each face from the nearest of 26
//! directions, so that nowhere a texel is stretched by more than a quarter.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use image::RgbaImage;

use super::union::Joined;
use crate::Result;
use crate::geom::Surface;
use crate::model::{Material, Part, Wrap};
use crate::photo::{ExemplarParams, exemplar};
use crate::raster::ALPHA_CUTOFF;
use crate::repr::Job;
use crate::repr::sphere_board::picture::Picture;
use crate::repr::sphere_board::subject::bark;

/// Corners at which normals differ by more are edges, cosine.
const SMOOTH: f64 = 0.6;

/// The crown and the trunk of what was joined; the first `crown` solids are the crown's.
pub(super) fn parts(job: &Job, joined: &Joined, crown: usize, picture: &Picture, side: u32) -> Result<Vec<Part>> {
    let params = ExemplarParams { delight: 0.0, ..ExemplarParams::default() };
    let sample = exemplar::choose(&picture.photo, &picture.crown, &picture.gaps, 1.0, &params)?;
    // Mirrored both ways it goes on without a seam.
    let tile = mirrored(&sample.image, side);
    let tile_m = 2.0 * f64::from(sample.window_px.width) * picture.metres_per_px;
    let of = |wanted: &dyn Fn(usize) -> bool, tile_m: Option<f64>| surface(joined, wanted, tile_m);
    let foliage = Material {
        name: "foliage".to_owned(),
        texture: Some(Arc::new(tile)),
        wrap: Wrap::Repeat,
        alpha_cutoff: Some(ALPHA_CUTOFF),
        ..Material::default()
    };
    let leaves = of(&|solid| solid < crown, Some(tile_m));
    let trunk = of(&|solid| solid >= crown, None);
    let wood = Material { name: "bark".to_owned(), factor: bark(job), ..Material::default() };
    let part = |name: &str, surface, material| Part { name: name.to_owned(), surface, material, crown_center: None };
    let parts = vec![part("crown", leaves, foliage), part("trunk", trunk, wood)];
    Ok(parts.into_iter().filter(|part| part.surface.mesh.polygon_count() > 0).collect())
}

fn mirrored(image: &RgbaImage, side: u32) -> RgbaImage {
    let half = (side / 2).max(1);
    let small = image::imageops::resize(image, half, half, image::imageops::FilterType::Triangle);
    RgbaImage::from_fn(2 * half, 2 * half, |x, y| *small.get_pixel(x.min(2 * half - 1 - x), y.min(2 * half - 1 - y)))
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
