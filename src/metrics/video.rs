//! ColorVideoVDP (Mantiuk et al. 2024, "ColorVideoVDP: A visual difference predictor for image, video and display distortions"): how much
//! worse a film looks than another, flicker and jumps included; through the crate `colorvideovdp`, model v0.5.7.
//!
//! Of the film that `tests/metrics.rs` leaves, the authors' own program (the Python package `cvvdp` 0.5.7) says 5.496884, as we do to the last
//! digit of a 32-bit float. It is no part of `make test`: it needs PyTorch, 5 GB, and three minutes for 16 frames.

use colorvideovdp::{Color, Cvvdp, DisplayModel, Image, Options};
use image::RgbImage;

use super::comparable;
use crate::{Error, Result};

/// Frames a second for which films are judged.
pub const FRAMES_PER_SECOND: f32 = 30.0;
/// Where they are looked at: a screen of 30 inches with 3,840 pixels and 200 cd/m² in an office, seen from twice its height.
const DISPLAY: &str = "standard_4k";

/// Quality of a film beside the true one, in just-objectionable differences: 10 where none sees a difference, 1 less where three of four
/// viewers would choose the other, below 0 for films that have nothing in common.
///
/// # Errors
/// [`Error::UnlikeSizes`] for frames of other sizes, and for films of other lengths (told as width 1) or without frames.
pub fn film_quality_jod(truth: &[RgbImage], test: &[RgbImage]) -> Result<f64> {
    comparable((1, truth.len() as u32), (1, test.len() as u32))?;
    let size = truth[0].dimensions();
    truth.iter().chain(test).try_for_each(|frame| comparable(size, frame.dimensions()))?;
    let judged = || -> colorvideovdp::Result<f64> {
        let films = [truth, test].map(|film| film.iter().map(decoded).collect::<colorvideovdp::Result<Vec<_>>>());
        let [truth, test] = films;
        let metric = Cvvdp::new(DisplayModel::from_name(DISPLAY)?, Options::default())?;
        Ok(f64::from(metric.predict_video(&test?, &truth?, FRAMES_PER_SECOND, Color::Srgb)?.jod))
    };
    judged().map_err(|e| Error::Internal { stage: "metrics::video", what: e.to_string() })
}

fn decoded(frame: &RgbImage) -> colorvideovdp::Result<Image> {
    let samples = frame.as_raw().iter().map(|&v| f32::from(v) / 255.0).collect();
    Image::new(frame.width() as usize, frame.height() as usize, 3, samples)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// Stripes that drift by a pixel a frame; one frame of them `jumps` by some more.
    fn film(jump: u32) -> Vec<RgbImage> {
        let frame = |n: u32| {
            let moved = n + if n == 5 { jump } else { 0 };
            RgbImage::from_fn(48, 40, |x, y| Rgb([if ((x + moved) / 4).is_multiple_of(2) { 50 } else { 140 }, (4 * y) as u8, 60]))
        };
        (0..10).map(frame).collect()
    }

    #[test]
    fn a_jump_costs_and_a_larger_one_costs_more() {
        let [same, small, large] = [0, 1, 4].map(|jump| film_quality_jod(&film(0), &film(jump)).unwrap());
        assert!(same == 10.0 && small < 9.9 && large < small - 0.1, "{same} {small} {large}");
    }

    #[test]
    fn films_that_cannot_be_compared_are_refused() {
        let refused = |a: &[RgbImage], b: &[RgbImage]| film_quality_jod(a, b).is_err();
        assert!(refused(&film(0), &film(0)[1..]) && refused(&[], &[]));
        assert!(refused(&[RgbImage::new(8, 8), RgbImage::new(8, 9)], &[RgbImage::new(8, 8), RgbImage::new(8, 8)]));
    }
}
