//! How far apart two trees lie where both are seen: what stereo and occlusion notice.

use super::comparable;
use crate::Result;

/// Root mean square of the difference of two depth pictures (metres, row by row, infinite where nothing is) over the pixels in which both
/// have something; `None` where there is none.
///
/// # Errors
/// [`Error::UnlikeSizes`](crate::Error::UnlikeSizes).
pub fn depth_rms_m(a: &[f32], b: &[f32]) -> Result<Option<f64>> {
    comparable((a.len() as u32, 1), (b.len() as u32, 1))?;
    let (mut squares, mut count) = (0.0, 0usize);
    for (a, b) in a.iter().zip(b).filter(|(a, b)| a.is_finite() && b.is_finite()) {
        squares += (f64::from(*a) - f64::from(*b)).powi(2);
        count += 1;
    }
    Ok((count > 0).then(|| (squares / count as f64).sqrt()))
}

#[cfg(test)]
mod tests {
    #[test]
    fn only_common_pixels_count() {
        let inf = f32::INFINITY;
        assert_eq!(super::depth_rms_m(&[1.0, 2.0, inf, 9.0], &[4.0, inf, 1.0, 5.0]).unwrap(), Some(12.5f64.sqrt()));
        assert_eq!(super::depth_rms_m(&[1.0, inf], &[inf, 1.0]).unwrap(), None);
        assert!(super::depth_rms_m(&[1.0], &[1.0, 2.0]).is_err());
    }
}
