//! The same drive with another method: what the one gains over the other, and what is seen of it (Rebollo §V: fewer polygons, the same look).
//! Image error is FLIP over the pixels of trees, which are those where either picture differs from the scene without any.

use image::{DynamicImage, Rgba, RgbaImage};
use serde::Serialize;

use super::drive::{self, Frame, Grove};
use super::record::quantile;
use super::scene::Scene;
use super::stock::Stock;
use crate::Result;
use crate::metrics::flip_map;
use crate::render::Renderer;

/// Bytes of a colour that differ by no more than that are the same.
const SAME: u8 = 3;

/// What a drive comes to beside the same drive with another method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Against {
    /// The other method.
    pub method: String,
    /// Median milliseconds of its frames.
    pub median_ms: f64,
    /// And its frames a second.
    pub fps: f64,
    /// Its median triangles of trees.
    pub triangles: f64,
    /// How many times as fast as it the drive was.
    pub gain: f64,
    /// How many times fewer triangles the drive had.
    pub saved: f64,
    /// Mean FLIP over the pixels of trees, the other method being the truth: mean of all pictures, where there are any.
    pub flip: Option<f64>,
    /// Each of them.
    pub pictures: Vec<Compared>,
}

/// A frame drawn with both.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Which frame.
    pub frame: u32,
    /// Mean FLIP over the pixels of trees.
    pub flip: f64,
    /// The other method's picture, seen from the page.
    pub file: String,
}

impl Against {
    /// In a sentence.
    pub fn sentence(&self) -> String {
        let Self { method, fps, gain, saved, flip, .. } = self;
        let seen = flip.map_or_else(String::new, |flip| format!("; FLIP over the pixels of trees {flip:.4}"));
        let share = if *saved > 0.0 { gain / saved } else { 0.0 };
        format!(
            "{gain:.2} times as fast as {method} ({fps:.1} frames a second) with {saved:.2} times fewer triangles, {share:.2} of that{seen}"
        )
    }
}

/// Pictures of frames, with trees and without.
pub struct Pictures {
    frames: Vec<u32>,
    trees: Vec<RgbaImage>,
    bare: Vec<RgbaImage>,
}

impl Pictures {
    /// Takes them.
    ///
    /// # Errors
    /// Those of [`Renderer::picture`].
    pub fn take(renderer: &mut Renderer, grove: &mut Grove, scene: &Scene, frames: Vec<u32>) -> Result<Self> {
        let mut own = Self { frames, trees: vec![], bare: vec![] };
        for frame in &own.frames {
            own.trees.push(drive::picture(renderer, grove, scene, *frame)?.color);
            own.bare.push(drive::bare(renderer, grove, scene, *frame)?.color);
        }
        Ok(own)
    }
}

/// Drives the path again with what another method built, and takes the same pictures. With what it came to are those pictures; their
/// files have no names yet. `told` hears of each frame.
///
/// # Errors
/// Those of [`Grove::plant`], [`drive::drive`] and [`drive::picture`].
pub fn drive_against(
    renderer: &mut Renderer,
    scene: &Scene,
    (method, stock): (&str, &[Stock]),
    (frames, pictures): (&[Frame], &Pictures),
    told: &mut dyn FnMut(),
) -> Result<(Against, Vec<RgbaImage>)> {
    let mut grove = Grove::plant(renderer, scene, stock)?;
    let mut theirs = vec![];
    drive::drive(renderer, &mut grove, scene, &mut |_, frame| {
        theirs.push(frame);
        told();
        true
    })?;
    let (mut compared, mut truths) = (vec![], vec![]);
    for ((frame, ours), bare) in pictures.frames.iter().zip(&pictures.trees).zip(&pictures.bare) {
        let truth = drive::picture(renderer, &mut grove, scene, *frame)?.color;
        compared.push(Compared { frame: *frame, flip: tree_flip(&truth, ours, bare)?, file: String::new() });
        truths.push(truth);
    }
    let median = |frames: &[Frame], of: &dyn Fn(&Frame) -> f64| quantile(frames.iter().map(of).collect(), 0.5);
    let ms = |frames: &[Frame]| median(frames, &|frame| frame.ms);
    let triangles = |frames: &[Frame]| median(frames, &|frame| frame.counted.triangles as f64);
    let ratio = |a: f64, b: f64| if b > 0.0 { a / b } else { 1.0 };
    let mean = compared.iter().map(|compared: &Compared| compared.flip).sum::<f64>() / compared.len() as f64;
    let against = Against {
        method: method.to_owned(),
        median_ms: ms(&theirs),
        fps: ratio(1e3, ms(&theirs)),
        triangles: triangles(&theirs),
        gain: ratio(ms(&theirs), ms(frames)),
        saved: ratio(triangles(&theirs), triangles(frames)),
        flip: (!compared.is_empty()).then_some(mean),
        pictures: compared,
    };
    Ok((against, truths))
}

/// Mean FLIP over the pixels where either picture shows a tree, which is where it differs from the scene without any; 0 where there is none.
///
/// # Errors
/// Those of [`flip_map`].
pub fn tree_flip(truth: &RgbaImage, test: &RgbaImage, bare: &RgbaImage) -> Result<f64> {
    let plain = |picture: &RgbaImage| DynamicImage::ImageRgba8(picture.clone()).into_rgb8();
    let errors = flip_map(&plain(truth), &plain(test))?;
    let differs = |a: &Rgba<u8>, b: &Rgba<u8>| (0..3).any(|channel| a[channel].abs_diff(b[channel]) > SAME);
    let is_tree = truth.pixels().zip(test.pixels()).zip(bare.pixels()).map(|((t, s), b)| differs(t, b) || differs(s, b));
    let of_trees: Vec<f64> = errors.iter().zip(is_tree).filter(|(_, tree)| *tree).map(|(error, _)| f64::from(*error)).collect();
    Ok(of_trees.iter().sum::<f64>() / of_trees.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_count_over_the_pixels_of_trees_alone() {
        let bare = RgbaImage::from_pixel(64, 64, Rgba([90, 140, 200, 255]));
        let tree = |width: u32, color: [u8; 4]| {
            let mut picture = bare.clone();
            (0..64 * width).for_each(|i| picture.put_pixel(i % width, i / width, Rgba(color)));
            picture
        };
        let (green, brown) = (tree(16, [30, 90, 20, 255]), tree(16, [90, 60, 20, 255]));
        assert_eq!(tree_flip(&green, &green, &bare).unwrap(), 0.0);
        assert_eq!(tree_flip(&bare, &bare, &bare).unwrap(), 0.0);
        let of_trees = tree_flip(&green, &brown, &bare).unwrap();
        let plain = |picture: &RgbaImage| DynamicImage::ImageRgba8(picture.clone()).into_rgb8();
        let of_all = crate::metrics::flip(&plain(&green), &plain(&brown)).unwrap().mean;
        // A quarter of the picture is tree; a little error spills over.
        assert!(of_trees > 3.0 * of_all && of_trees < 4.0 * of_all, "{of_trees} {of_all}");
        // Trees that only one of them shows count too.
        assert!(tree_flip(&green, &tree(32, [30, 90, 20, 255]), &bare).unwrap() > 0.1);
    }
}
