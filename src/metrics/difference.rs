//! Sample by sample: the figures that OpenImageIO's `idiff` prints, computed as it does. `python_tools` checks that they agree.

use image::RgbaImage;

use super::comparable;
use crate::{Error, Result};

/// Figures of the differences of all samples.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Difference {
    /// Mean of the absolute differences.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Largest absolute difference; infinite where only one of two samples is finite.
    pub max: f64,
    /// Pixels of which a sample differs by more than the threshold.
    pub over: usize,
}

/// Differences of two pictures of `channels` samples a pixel. Two samples that are both infinite or both no number do not differ; where
/// only one is, the pixel counts as over the threshold, and neither mean nor root mean square takes it in (`idiff` then has no mean at all).
///
/// # Errors
/// [`Error::UnlikeSizes`] for lists of two lengths, of none, or of no whole number of pixels.
pub fn difference(a: &[f32], b: &[f32], channels: usize, threshold: f64) -> Result<Difference> {
    if a.is_empty() || a.len() != b.len() || channels == 0 || !a.len().is_multiple_of(channels) {
        return Err(Error::UnlikeSizes { a: [a.len() as u32, 1], b: [b.len() as u32, 1] });
    }
    let (mut sum, mut squares, mut max, mut over) = (0.0, 0.0, 0.0f64, 0);
    for (one, two) in a.chunks_exact(channels).zip(b.chunks_exact(channels)) {
        let mut largest = 0.0f64;
        for (&a, &b) in one.iter().zip(two) {
            let d = match (a.is_finite(), b.is_finite()) {
                (true, true) => (f64::from(a) - f64::from(b)).abs(),
                (false, false) if a.is_nan() == b.is_nan() && a.is_infinite() == b.is_infinite() => 0.0,
                _ => f64::INFINITY,
            };
            if d.is_finite() {
                sum += d;
                squares += d * d;
            }
            largest = largest.max(d);
        }
        max = max.max(largest);
        over += usize::from(largest > threshold);
    }
    let samples = a.len() as f64;
    Ok(Difference { mean: sum / samples, rms: (squares / samples).sqrt(), max, over })
}

/// The same of two 8-bit pictures, straight alpha and all, as they are stored; 255 counts as 1.
///
/// # Errors
/// [`Error::UnlikeSizes`].
pub fn difference_of_pictures(a: &RgbaImage, b: &RgbaImage, threshold: f64) -> Result<Difference> {
    comparable(a.dimensions(), b.dimensions())?;
    let samples = |picture: &RgbaImage| -> Vec<f32> { picture.as_raw().iter().map(|&v| f32::from(v) / 255.0).collect() };
    difference(&samples(a), &samples(b), 4, threshold)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_worked_example() {
        let found = difference(&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.5, 2.0, 1.0], 2, 0.5).unwrap();
        assert_eq!(found, Difference { mean: 2.5 / 4.0, rms: (4.25f64 / 4.0).sqrt(), max: 2.0, over: 1 });
    }

    #[test]
    fn nothing_against_nothing_is_alike_and_nothing_against_something_is_not() {
        let inf = f32::INFINITY;
        let same = difference(&[inf, f32::NAN, 1.0], &[inf, f32::NAN, 1.0], 1, 0.0).unwrap();
        assert_eq!(same, Difference { mean: 0.0, rms: 0.0, max: 0.0, over: 0 });
        let other = difference(&[inf, f32::NAN, 1.0, 1.0], &[1.0, inf, inf, 2.0], 1, 2.0).unwrap();
        assert_eq!(other, Difference { mean: 0.25, rms: 0.5, max: f64::INFINITY, over: 3 });
    }

    #[test]
    fn lists_that_do_not_match_are_refused() {
        for (a, b, channels) in [(2, 3, 1), (0, 0, 1), (3, 3, 2), (3, 3, 0)] {
            assert!(difference(&vec![0.0; a], &vec![0.0; b], channels, 0.0).is_err(), "{a} {b} {channels}");
        }
    }
}
