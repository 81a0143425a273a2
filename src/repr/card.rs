//! Captured cards: a rectangle that shows what a box of the tree looks like from one side. Every method that shows pictures makes them
//! here, so that all are taken, cut out and lit alike.
//!
//! The picture holds base colour without light, bled under what is not there; its alpha is covered area, spread so that the alpha test
//! keeps as much of the surface as was covered. Beside it stand the captured normals in tangent space, so that a card is lit by the
//! same sun as the tree; their alpha, which glTF's viewers leave alone, tells foliage from wood, which light falls on otherwise.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::RgbaImage;
use rayon::prelude::*;

use crate::geom::{Bounds, PolyMesh, Surface};
use crate::model::{Material, Part, Wrap};
use crate::raster::{self, ALPHA_CUTOFF, Layer, View, to_linear, to_srgb};
use crate::{Error, Result};

use super::Capture;

/// A card to be taken.
#[derive(Debug, Clone)]
pub struct Card {
    /// What the part is called.
    pub name: String,
    /// Right, up and towards the viewer: unit vectors, right-handed.
    pub axes: [Vec3; 3],
    /// What is taken, in those axes, metres: a window to look through and, along the last axis, a slab to see.
    pub window: Bounds,
    /// Where the card stands along the last axis, metres.
    pub plane: f32,
    /// Texels of the picture, columns and rows.
    pub size_px: [u32; 2],
}

impl Card {
    /// Columns and rows of a picture of `window` whose longer side has `longest_px` texels, all texels square; at least 4 a side.
    pub fn size_px(window: Bounds, longest_px: u32) -> [u32; 2] {
        let size = window.size();
        let longest = size.x.max(size.y).max(1e-6);
        [size.x, size.y].map(|side| ((side / longest * longest_px as f32).round() as u32).clamp(4, longest_px.max(4)))
    }

    /// The rectangle, facing along the last axis, its picture upright.
    pub fn surface(&self) -> Surface {
        self.cropped([Vec2::ZERO, Vec2::ONE])
    }

    /// The same of its picture from `from` to `to` alone, texture coordinates.
    fn cropped(&self, [from, to]: [Vec2; 2]) -> Surface {
        let [right, up, toward] = self.axes;
        let uvs = vec![Vec2::new(from.x, to.y), to, Vec2::new(to.x, from.y), from];
        let (low, high) = (self.window.min.truncate(), self.window.max.truncate());
        let corner = |uv: &Vec2| {
            let at = low + Vec2::new(uv.x, 1.0 - uv.y) * (high - low);
            at.x * right + at.y * up + self.plane * toward
        };
        Surface {
            mesh: PolyMesh { positions: uvs.iter().map(corner).collect(), triangles: vec![], quads: vec![[0, 1, 2, 3]] },
            normals: vec![toward; 4],
            uvs,
            ..Surface::default()
        }
    }

    /// From where its picture is taken.
    pub fn view(&self) -> View {
        // Grown a little where the box is flat, so that the view has an extent.
        let least = 1e-4 * self.window.size().max_element().max(1e-2);
        let grow = 0.5 * (Vec3::splat(least) - self.window.size()).max(Vec3::ZERO);
        let window = Bounds { min: self.window.min - grow, max: self.window.max + grow };
        View::of_window(self.axes, window, self.size_px[0], self.size_px[1])
    }
}

/// The box around `points` in `axes`; `None` without any.
pub fn window_around(points: impl IntoIterator<Item = Vec3>, axes: [Vec3; 3]) -> Option<Bounds> {
    Bounds::of(points.into_iter().map(|p| Vec3::from(axes.map(|axis| axis.dot(p)))))
}

/// Texels taken at a time: what a picture is while it is taken needs some 50 bytes a texel.
const BATCH_TEXELS: u64 = 1 << 23;
/// Bytes that all pictures of a tree may take while it is built, normals and smaller sizes included: a bound on memory. What a user allows
/// is checked on what was built ([`super::limits`]).
const LIMIT_BYTES: u64 = 1 << 30;

/// Texels for which there are [`LIMIT_BYTES`]: of a picture and its normals, 4 bytes each, and a third for their smaller sizes.
const LIMIT_TEXELS: u64 = LIMIT_BYTES * 3 / (8 * 4);

/// Refuses so many pictures of so many texels each, when they would take more than 1 GiB; `lower` names what to lower.
///
/// # Errors
/// [`Error::TooManyPictures`].
pub fn check_room(pictures: usize, texels_each: u64, lower: &'static str) -> Result<()> {
    let texels = (pictures as u64).saturating_mul(texels_each);
    if texels <= LIMIT_TEXELS { Ok(()) } else { Err(too_many(pictures, texels, LIMIT_TEXELS, lower)) }
}

/// Pictures that would take `texels`, where there is room for `room`.
pub fn too_many(pictures: usize, texels: u64, room: u64, lower: &'static str) -> Error {
    let mib = |texels: u64| (texels.saturating_mul(8) / 3).saturating_mul(4) >> 20;
    Error::TooManyPictures { limit_mib: mib(room), pictures, found_mib: mib(texels), lower }
}

/// Takes `cards` of `parts`: a part each, seen from both sides; `None` for one in which nothing is seen.
///
/// # Errors
/// [`Error::TooManyPictures`] when they would take more than 1 GiB, and those of [`Capture::take`].
pub fn captured(capture: &dyn Capture, parts: &[&Part], cards: &[Card]) -> Result<Vec<Option<Part>>> {
    let texels = |card: &Card| u64::from(card.size_px[0]) * u64::from(card.size_px[1]);
    let all = cards.iter().map(texels).sum::<u64>();
    check_room(cards.len(), all.div_ceil(cards.len().max(1) as u64), "texture_px or how many there are")?;
    let largest = cards.iter().map(texels).max().unwrap_or(1).max(1);
    let mut made = Vec::with_capacity(cards.len());
    for cards in cards.chunks((BATCH_TEXELS / largest).max(1) as usize) {
        let views: Vec<View> = cards.iter().map(Card::view).collect();
        let taken = capture.take(parts, &views)?;
        let leaves = leaves(capture, parts, &views, &taken)?;
        made.par_extend(cards.par_iter().zip(&taken).zip(&leaves).map(|((card, taken), leaf)| of_capture(card, taken, leaf)));
    }
    Ok(made)
}

/// Of each picture of `parts`, row by row, whether a pixel shows foliage ([`LEAF`]) or wood ([`WOOD`]): by what is nearest in it, as its
/// normal is. Foliage is what is cut out or seen from both sides, as in files (`model::glb`). All is foliage where there is nothing else to
/// tell it from.
///
/// # Errors
/// Those of [`Capture::take`].
pub fn leaves(capture: &dyn Capture, parts: &[&Part], views: &[View], taken: &[raster::Capture]) -> Result<Vec<Vec<u8>>> {
    let (cut, solid): (Vec<&Part>, Vec<&Part>) = parts.iter().partition(|part| is_foliage(&part.material));
    if solid.is_empty() || cut.is_empty() {
        return Ok(taken.iter().map(|taken| vec![LEAF; taken.depth_m.len()]).collect());
    }
    // Devices round depth according to what there is to see.
    let slack_m = |view: &View| 1e-4 * view.half_size_m.max_element();
    let wood = capture.take(&solid, views)?;
    let of = |((view, taken), wood): ((&View, &raster::Capture), &raster::Capture)| {
        let is_wood = |(nearest, wood): (&f32, &f32)| nearest.is_finite() && *wood >= nearest - slack_m(view);
        taken.depth_m.iter().zip(&wood.depth_m).map(|at| if is_wood(at) { WOOD } else { LEAF }).collect()
    };
    Ok(views.iter().zip(taken).zip(&wood).map(of).collect())
}

fn is_foliage(material: &Material) -> bool {
    material.alpha_cutoff.is_some() || material.two_sided
}

/// Alpha of a card's normals where it shows foliage.
pub const LEAF: u8 = 255;
/// And where it shows wood.
pub const WOOD: u8 = 0;

/// The card that shows what was taken, and which of its pixels are [`leaves`]; `None` where nothing is seen.
pub fn of_capture(card: &Card, taken: &raster::Capture, leaves: &[u8]) -> Option<Part> {
    let (texture, mut normals) = rayon::join(|| cut_out(taken), || tangent_normals(taken, card.axes));
    let texture = Some(Arc::new(texture?));
    let mut kinds = Layer::from_fn(card.size_px[0] as usize, card.size_px[1] as usize, |x, y| {
        let at = y * card.size_px[0] as usize + x;
        Vec3::splat(f32::from(leaves[at])).extend(f32::from(u8::from(taken.depth_m[at].is_finite())))
    });
    kinds.bleed();
    normals.pixels_mut().zip(&kinds.texels).for_each(|(normal, kind)| normal[3] = kind.x.round() as u8);
    let normal_texture = Some(Arc::new(normals));
    let material = Material {
        name: card.name.clone(),
        texture,
        normal_texture,
        wrap: Wrap::Clamp,
        alpha_cutoff: Some(ALPHA_CUTOFF),
        two_sided: true,
        ..Material::default()
    };
    Some(Part { name: card.name.clone(), surface: card.cropped(painted(&taken.coverage)), material, crown_center: None })
}

/// Part of a picture's longer side that is kept around what is painted: its smaller sizes spread what they show.
const MARGIN: f32 = 1.0 / 64.0;

/// Where anything is painted, in texture coordinates, with a margin: a card has no pixels to shade where nothing is.
fn painted(coverage: &image::GrayImage) -> [Vec2; 2] {
    let (width, height) = coverage.dimensions();
    let size = Vec2::new(width as f32, height as f32);
    let there = coverage.enumerate_pixels().filter(|(.., area)| area.0[0] > 0).map(|(x, y, _)| Vec2::new(x as f32, y as f32));
    let Some([low, high]) = there.map(|at| [at, at]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) else {
        return [Vec2::ZERO, Vec2::ONE];
    };
    let margin = MARGIN * size.max_element() + 1.0;
    [(low - margin).max(Vec2::ZERO) / size, (high + 1.0 + margin).min(size) / size]
}

/// The picture, its colours bled under what is not there, its alpha such that [`ALPHA_CUTOFF`] leaves as many texels as were covered;
/// `None` where nothing is seen.
pub fn cut_out(taken: &raster::Capture) -> Option<RgbaImage> {
    let (width, height) = taken.color.dimensions();
    let alphas = spread(taken.coverage.as_raw())?;
    let mut layer = Layer::from_fn(width as usize, height as usize, |x, y| {
        let [r, g, b, a] = taken.color.get_pixel(x as u32, y as u32).0;
        Vec3::from([r, g, b].map(to_linear)).extend(f32::from(a) / 255.0)
    });
    layer.bleed();
    Some(picture(width, height, |at| {
        let [r, g, b] = layer.texels[at].truncate().to_array().map(to_srgb);
        [r, g, b, alphas[at]]
    }))
}

/// A picture of what `texel` gives for each place, row by row from the top left.
fn picture(width: u32, height: u32, texel: impl Fn(usize) -> [u8; 4] + Sync) -> RgbaImage {
    let mut picture = RgbaImage::new(width, height);
    picture.par_chunks_exact_mut(4).enumerate().with_min_len(256).for_each(|(at, out)| out.copy_from_slice(&texel(at)));
    picture
}

/// Alpha for covered areas (0..=255): rising with them, and such that as many texels come to lie above the cutoff as were covered in all.
/// `None` where nothing is covered.
fn spread(coverage: &[u8]) -> Option<Vec<u8>> {
    let covered = coverage.iter().map(|a| u64::from(*a)).sum::<u64>() as f64 / 255.0;
    if covered <= 0.0 {
        return None;
    }
    // There are few different areas; which of two equal texels goes first is decided by their places.
    let rank = |(at, area): (usize, &u8)| f32::from(*area) + (at as u32).wrapping_mul(0x9E37_79B1) as f32 / 4_294_967_296.0;
    let mut ranks: Vec<f32> = coverage.iter().enumerate().map(rank).collect();
    let last = (covered.round() as usize).clamp(1, ranks.len()) - 1;
    let bend = *ranks.clone().select_nth_unstable_by(last, |a, b| b.total_cmp(a)).1;
    let cutoff = (255.0 * ALPHA_CUTOFF).ceil();
    for rank in &mut ranks {
        *rank = if *rank < bend {
            rank.floor() / bend * (cutoff - 1.0)
        } else {
            cutoff + (*rank - bend) / (256.0 - bend) * (255.0 - cutoff)
        };
    }
    Some(ranks.into_iter().map(|alpha| alpha as u8).collect())
}

/// Captured normals in the frame of the card; out of it where nothing is.
pub fn tangent_normals(taken: &raster::Capture, axes: [Vec3; 3]) -> RgbaImage {
    let (width, height) = taken.color.dimensions();
    let mut layer = Layer::from_fn(width as usize, height as usize, |x, y| {
        let n = taken.normal[y * width as usize + x];
        Vec3::from(axes.map(|axis| axis.dot(n))).extend(f32::from(u8::from(n != Vec3::ZERO)))
    });
    layer.bleed();
    picture(width, height, |at| {
        let n = layer.texels[at].truncate().normalize_or(Vec3::Z);
        let [r, g, b] = (255.0 * (0.5 + 0.5 * n)).to_array().map(|v| v.round() as u8);
        [r, g, b, 255]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repr::SoftwareCapture;

    fn leaf(at: Vec3, turned: Vec3) -> Part {
        let (u, v) = turned.any_orthonormal_pair();
        let positions = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| at + 0.5 * (x * u + y * v)).to_vec();
        let mesh = PolyMesh { positions, triangles: vec![], quads: vec![[0, 1, 2, 3]] };
        let material = Material { factor: [0.2, 0.6, 0.1, 1.0], two_sided: true, ..Material::default() };
        Part {
            name: "leaf".to_owned(),
            surface: Surface { normals: vec![turned; 4], mesh, ..Surface::default() },
            material,
            crown_center: None,
        }
    }

    fn front(window: Bounds, size_px: [u32; 2]) -> Card {
        Card { name: "card".to_owned(), axes: View::axes_from(0.0, 0.0), window, plane: 0.0, size_px }
    }

    #[test]
    fn a_card_shows_its_slab_and_its_normals() {
        let tilted = Vec3::new(0.6, 0.0, 0.8);
        let (near, far) = (leaf(Vec3::ZERO, tilted), leaf(Vec3::new(0.0, 0.0, -3.0), Vec3::Z));
        let window = Bounds { min: Vec3::new(-1.0, -1.0, -1.0), max: Vec3::ONE };
        let taken = captured(&SoftwareCapture::new(), &[&near, &far], &[front(window, [32, 32])]).unwrap();
        let part = taken[0].as_ref().unwrap();
        part.check().unwrap();
        let normals = part.material.normal_texture.as_ref().unwrap();
        let n = Vec3::from_slice(&normals.get_pixel(16, 16).0[..3].iter().map(|v| f32::from(*v) / 127.5 - 1.0).collect::<Vec<_>>());
        assert!((n - tilted).length() < 0.02, "{n}");
        // Only the near leaf lies in the slab: 0.8 m wide as seen, not 1 m.
        let texture = part.material.texture.as_ref().unwrap();
        let there = texture.pixels().filter(|p| f32::from(p.0[3]) >= 255.0 * ALPHA_CUTOFF).count() as f32 / 1024.0;
        assert!((there - 0.2).abs() < 0.02, "{there}");
        assert_eq!(texture.get_pixel(0, 0).0[..3], texture.get_pixel(16, 16).0[..3], "bled");
    }

    #[test]
    fn wood_is_told_from_the_leaves_before_and_behind_it() {
        let mut limb = leaf(Vec3::ZERO, Vec3::Z);
        limb.material.two_sided = false;
        let (before, behind) = (leaf(Vec3::new(0.5, 0.0, 0.4), Vec3::Z), leaf(Vec3::new(-0.5, 0.0, -0.4), Vec3::Z));
        let window = Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE };
        let taken = captured(&SoftwareCapture::new(), &[&limb, &before, &behind], &[front(window, [32, 32])]).unwrap();
        let normals = taken[0].as_ref().unwrap().material.normal_texture.clone().unwrap();
        let kinds = [3, 12, 20].map(|x| normals.get_pixel(x, 16).0[3]);
        assert_eq!(kinds, [LEAF, WOOD, LEAF]);
    }

    #[test]
    fn thin_things_keep_their_area_at_the_alpha_test() {
        let leaves: Vec<Part> = (0..40)
            .map(|i| {
                let mut part = leaf(Vec3::new(-1.0 + 0.05 * i as f32, 0.0, 0.0), Vec3::Z);
                part.surface
                    .mesh
                    .positions
                    .iter_mut()
                    .for_each(|p| p.x = -1.0 + 0.05 * i as f32 + 0.02 * (p.x + 1.0 - 0.05 * i as f32));
                part
            })
            .collect();
        let window = Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE };
        let parts: Vec<&Part> = leaves.iter().collect();
        let taken = captured(&SoftwareCapture::new(), &parts, &[front(window, [16, 16])]).unwrap();
        let texture = taken[0].as_ref().unwrap().material.texture.as_ref().unwrap();
        let there = texture.pixels().filter(|p| f32::from(p.0[3]) >= 255.0 * ALPHA_CUTOFF).count() as f32 / 256.0;
        // 40 strips of 0.02 m × 1 m in 4 m².
        assert!((there - 0.2).abs() < 0.06, "{there}");
    }

    #[test]
    fn a_card_ends_where_its_picture_does() {
        let part = leaf(Vec3::new(1.0, 1.5, 0.0), Vec3::Z);
        let window = Bounds { min: Vec3::new(-2.0, -2.0, -1.0), max: Vec3::new(2.0, 2.0, 1.0) };
        let taken = captured(&SoftwareCapture::new(), &[&part], &[front(window, [256, 256])]).unwrap();
        let Surface { mesh, uvs, .. } = &taken[0].as_ref().unwrap().surface;
        let bounds = Bounds::of(mesh.positions.iter().copied()).unwrap();
        assert!((bounds.min - Vec3::new(0.5, 1.0, 0.0)).abs().max_element() < 0.1, "{bounds:?}");
        assert!((bounds.max - Vec3::new(1.5, 2.0, 0.0)).abs().max_element() < 0.1 && bounds.max.y <= 2.0, "{bounds:?}");
        // What it shows stays where it was.
        for (at, uv) in mesh.positions.iter().zip(uvs) {
            assert!((Vec2::new(4.0 * uv.x - 2.0, 2.0 - 4.0 * uv.y) - at.truncate()).length() < 1e-5);
        }
    }

    #[test]
    fn many_pictures_are_taken_in_order_and_too_many_are_refused() {
        let part = leaf(Vec3::ZERO, Vec3::Z);
        let window = Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE };
        let cards: Vec<Card> = (1..=5).map(|k| front(window, [4 * k, 4])).collect();
        let taken = captured(&SoftwareCapture::new(), &[&part], &cards).unwrap();
        let widths: Vec<u32> = taken.iter().flatten().map(|part| part.material.texture.as_ref().unwrap().width()).collect();
        assert_eq!(widths, [4, 8, 12, 16, 20]);
        let refused = captured(&SoftwareCapture::new(), &[&part], &vec![front(window, [2048, 2048]); 40]).unwrap_err();
        assert!(refused.to_string().contains("texture_px"), "{refused}");
    }

    #[test]
    fn an_empty_window_gives_no_card_and_a_flat_one_does_not_fail() {
        let part = leaf(Vec3::ZERO, Vec3::Z);
        let aside = Bounds { min: Vec3::splat(5.0), max: Vec3::splat(6.0) };
        let flat = Bounds { min: Vec3::new(-1.0, -1.0, 0.0), max: Vec3::new(1.0, 1.0, 0.0) };
        let taken = captured(&SoftwareCapture::new(), &[&part], &[front(aside, [8, 8]), front(flat, [8, 8])]).unwrap();
        assert!(taken[0].is_none() && taken[1].is_some());
    }
}
