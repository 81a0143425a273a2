//! What everything is held against: the tree itself from everywhere, each pixel the mean of several: what a picture would show if pixels
//! were points.

use glam::{Vec3, Vec4};
use image::{Rgba, RgbaImage};

use crate::Result;
use crate::raster::{to_linear, to_srgb};
use crate::render::{Renderer, Shot, Tree};

use super::photograph::Photograph;
use super::pictures::Look;
use super::staging::{Seen, Stage};

/// The tree itself from where `look` looks: of a photograph the photograph, where that is its own view.
///
/// # Errors
/// Those of the renderer.
pub fn take(renderer: &mut Renderer, stage: &Stage, tree: &Tree, look: &Look, photograph: Option<&Photograph>) -> Result<Seen> {
    let seen = see(renderer, stage, tree, &stage.shot_of(look, None), look.height_px)?;
    // A photograph has no depth: the model's counts.
    Ok(match photograph.filter(|_| look.photographed) {
        Some(photograph) => Seen { color: photograph.seen(stage, look.height_px), ..seen },
        None => seen,
    })
}

/// What a shot shows of a tree that is so high in it, each pixel the mean of several.
///
/// # Errors
/// Those of the renderer.
pub fn see(renderer: &mut Renderer, stage: &Stage, tree: &Tree, shot: &Shot, height_px: f32) -> Result<Seen> {
    // Of a picture that is large itself, as many as there is room for.
    let fits = |by: &u32| renderer.takes(shot.size_px.map(|side| side.saturating_mul(*by)));
    let by = (1..=finer(height_px)).rev().find(fits).unwrap_or(1);
    let large = Shot { size_px: shot.size_px.map(|side| side * by), ..shot.clone() };
    Ok(coarser(&stage.see(renderer, tree, &large)?, by))
}

/// Of how many pixels along each side one of the truth is the mean: enough for leaves that are far smaller than it. With four for a tree of
/// 16 pixels its thin parts were missing, a third of some trees.
pub fn finer(height_px: f32) -> u32 {
    ((512.0 / height_px).ceil() as u32).clamp(2, 32)
}

/// Each pixel the mean of `by` × `by`: colours by what is there, depth over what is there where that is half or more.
pub fn coarser(seen: &Seen, by: u32) -> Seen {
    let (width, height) = (seen.color.width() / by, seen.color.height() / by);
    let mut depth_m = Vec::with_capacity((width * height) as usize);
    let color = RgbaImage::from_fn(width, height, |x, y| {
        let (mut sum, mut way, mut there) = (Vec4::ZERO, 0.0, 0);
        for (i, j) in (0..by * by).map(|k| (x * by + k % by, y * by + k / by)) {
            let [r, g, b, a] = seen.color.get_pixel(i, j).0;
            let alpha = f32::from(a) / 255.0;
            sum += (alpha * Vec3::from([r, g, b].map(to_linear))).extend(alpha);
            let depth = seen.depth_m[(j * seen.color.width() + i) as usize];
            if depth.is_finite() {
                (way, there) = (way + depth, there + 1);
            }
        }
        depth_m.push(if 2 * there >= by * by { way / there as f32 } else { f32::INFINITY });
        let [r, g, b] = (sum.truncate() / sum.w.max(1e-6)).to_array().map(to_srgb);
        Rgba([r, g, b, (255.0 * sum.w / (by * by) as f32).round() as u8])
    });
    Seen { color, depth_m }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_covered_pixel_is_half_there_and_as_far_as_what_is_there() {
        let color = RgbaImage::from_fn(4, 2, |x, _| if x < 1 { Rgba([200, 100, 0, 255]) } else { Rgba([0; 4]) });
        let depth_m = color.pixels().map(|p| if p.0[3] > 0 { 7.0 } else { f32::INFINITY }).collect();
        let seen = coarser(&Seen { color, depth_m }, 2);
        assert_eq!(seen.color.get_pixel(0, 0).0, [200, 100, 0, 128]);
        assert_eq!((seen.depth_m[0], seen.depth_m[1]), (7.0, f32::INFINITY));
    }
}
