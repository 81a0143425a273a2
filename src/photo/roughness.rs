//! How rough a crown's outline is: what its turning points leave out (She §3.1), and what growth puts back when it is drawn (§3.3).
//! Pixels of the photograph.

use glam::DVec2;

use super::contour::smooth_closed;

/// Measures of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roughness {
    /// Height over width.
    pub slenderness: f64,
    /// From the 5th to the 95th percentile of the distances between the outline and itself smoothed, pixels.
    pub depth_px: f64,
    /// Along the smoothed outline from one tuft to the next, pixels.
    pub spacing_px: f64,
}

/// Standard deviation of the smoothing along the outline, of the crown's height: a few times the tolerance of the turning points, so that
/// boughs, which the surface has, are not counted.
const SMOOTHING: f64 = 0.03;
/// An outline is thinned to so many points; more tell nothing new.
const POINTS: usize = 4000;

impl Roughness {
    /// Of a closed contour, clockwise as the picture shows it. All zero for one without extent.
    pub fn of(contour: &[DVec2]) -> Self {
        let points: Vec<DVec2> = contour.iter().copied().step_by(contour.len().div_ceil(POINTS).max(1)).collect();
        let (low, high) = points.iter().fold((DVec2::MAX, DVec2::MIN), |(low, high), p| (low.min(*p), high.max(*p)));
        let size = high - low;
        if points.len() < 8 || size.min_element() <= 0.0 {
            return Self { slenderness: 0.0, depth_px: 0.0, spacing_px: 0.0 };
        }
        let sigma = SMOOTHING * size.y * points.len() as f64 / perimeter(&points);
        let smooth = smooth_closed(&points, sigma);
        let n = smooth.len();
        let outward = |i: usize| {
            let along = (smooth[(i + 1) % n] - smooth[(i + n - 1) % n]).normalize_or_zero();
            // Inside lies on the right hand; y runs down.
            DVec2::new(along.y, -along.x).dot(points[i] - smooth[i])
        };
        let offsets: Vec<f64> = (0..n).map(outward).collect();
        let mut sorted = offsets.clone();
        sorted.sort_by(f64::total_cmp);
        let at = |part: f64| sorted[(part * (n - 1) as f64) as usize];
        let middle = at(0.5);
        let crossings = (0..n).filter(|&i| (offsets[i] > middle) != (offsets[(i + 1) % n] > middle)).count();
        Self {
            slenderness: size.y / size.x,
            depth_px: at(0.95) - at(0.05),
            spacing_px: perimeter(&smooth) / (0.5 * crossings as f64).max(1.0),
        }
    }
}

fn perimeter(points: &[DVec2]) -> f64 {
    (0..points.len()).map(|i| points[i].distance(points[(i + 1) % points.len()])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ellipse with `waves` round lobes of the given depth.
    fn lobed(waves: f64, depth: f64) -> Vec<DVec2> {
        let point = |i: usize| {
            let turn = std::f64::consts::TAU * i as f64 / 3000.0;
            (1.0 + 0.5 * depth * (waves * turn).cos()) * DVec2::new(100.0 * turn.cos(), 200.0 * turn.sin())
        };
        (0..3000).map(point).collect()
    }

    #[test]
    fn depth_and_spacing_of_known_lobes_come_back() {
        let rough = Roughness::of(&lobed(60.0, 0.04));
        assert!((rough.slenderness - 2.0).abs() < 0.05);
        // 4 % of 100 to 200 pixels, and what the smoothing leaves of a wave of 16 pixels.
        assert!((3.5..8.0).contains(&rough.depth_px), "{rough:?}");
        assert!((rough.spacing_px - 969.0 / 60.0).abs() < 3.0, "{rough:?}");
        let smooth = Roughness::of(&lobed(60.0, 0.0));
        assert!(smooth.depth_px < 0.3 * rough.depth_px, "{smooth:?}");
    }

    #[test]
    fn outlines_without_extent_have_no_roughness() {
        for contour in [vec![], vec![DVec2::ONE; 20], vec![DVec2::X, DVec2::Y]] {
            assert_eq!(Roughness::of(&contour).depth_px, 0.0);
        }
    }
}
