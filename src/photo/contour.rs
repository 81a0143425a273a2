//! The outer contour of a mask, to a fraction of a pixel.
//!
//! Ours: imageproc's border following runs through pixel centres, half a pixel inside the region, which shrinks an eight-pixel crown by
//! a fifth. This one walks the cracks between inside and outside pixels and takes their midpoints: exact on straight edges.

use glam::{DVec2, IVec2};

use crate::raster::Mask;

/// The outer contours of all pieces of at least `least` of the area of the largest, which is the first; each closed, without repeating its
/// first point; midpoints of pixel edges, inside on the right hand (clockwise as the picture shows it). Pixels that touch at a corner are
/// connected. None for an empty mask.
pub fn contours(mask: &Mask, least: f64) -> Vec<Vec<DVec2>> {
    let (width, height) = (mask.width() as usize, mask.height() as usize);
    let data = mask.as_raw();
    // Every outer contour has a topmost pixel edge, walked left to right; marking those edges finds each contour once.
    let mut walked = vec![false; data.len()];
    let mut found = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let at = y * width + x;
            if data[at] != 0 && !walked[at] && (y == 0 || data[at - width] == 0) {
                let contour = walk_cracks(mask, IVec2::new(x as i32, y as i32), &mut walked);
                let area = signed_area(&contour);
                // Of the rims of holes, which are walked too, the area is negative.
                if area > 0.0 {
                    found.push((area, contour));
                }
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let enough = found.first().map_or(0.0, |largest| least * largest.0);
    found.into_iter().take_while(|(area, _)| *area >= enough).map(|piece| piece.1).collect()
}

/// Area of a closed polygon, positive when it runs clockwise as seen with y down. Square units of the points.
pub fn signed_area(contour: &[DVec2]) -> f64 {
    contour.iter().enumerate().map(|(i, p)| p.perp_dot(contour[(i + 1) % contour.len()])).sum::<f64>() * 0.5
}

/// Walks the cracks with the region on the right, from the top edge of pixel `start`, and marks the top edges it passes.
fn walk_cracks(mask: &Mask, start: IVec2, walked: &mut [bool]) -> Vec<DVec2> {
    let inside = |p: IVec2| mask.get(p.x.into(), p.y.into());
    let (mut corner, mut step) = (start, IVec2::X);
    let mut contour = Vec::new();
    loop {
        contour.push(corner.as_dvec2() + step.as_dvec2() * 0.5);
        if step == IVec2::X {
            walked[corner.y as usize * mask.width() as usize + corner.x as usize] = true;
        }
        corner += step;
        // The two pixels ahead of the corner, left and right of the direction of walk.
        let left_hand = IVec2::new(step.y, -step.x);
        let pixel = |side: IVec2| corner + (step + side - IVec2::ONE) / 2;
        step = if inside(pixel(left_hand)) {
            left_hand
        } else if inside(pixel(-left_hand)) {
            step
        } else {
            -left_hand
        };
        if corner == start && step == IVec2::X {
            return contour;
        }
    }
}

/// A closed contour averaged with a Gaussian along its length, so that the staircase of pixels does not show. `sigma` in points.
pub fn smooth_closed(contour: &[DVec2], sigma: f64) -> Vec<DVec2> {
    let n = contour.len();
    let reach = ((3.0 * sigma).ceil() as usize).min(n.saturating_sub(1) / 2);
    let weight = |k: usize| (-0.5 * (k as f64 / sigma.max(1e-9)).powi(2)).exp();
    let weights: Vec<f64> = (0..=reach).map(weight).collect();
    let total = 2.0 * weights.iter().sum::<f64>() - 1.0;
    let point = |i: usize| {
        let sides = (1..=reach).map(|k| weights[k] * (contour[(i + k) % n] + contour[(i + n - k) % n]));
        (contour[i] + sides.sum::<DVec2>()) / total
    };
    (0..n).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn largest_contour(mask: &Mask) -> Vec<DVec2> {
        contours(mask, 1.0).into_iter().next().unwrap_or_default()
    }

    use crate::raster::fill_polygon;
    use proptest::prelude::*;

    #[test]
    fn a_rectangle_has_its_own_area_less_the_cut_corners() {
        let mask = Mask::from_fn(12, 9, |x, y| (2..10).contains(&x) && (3..8).contains(&y));
        let contour = largest_contour(&mask);
        assert_eq!(contour.len(), 2 * (8 + 5));
        assert!((signed_area(&contour) - (40.0 - 4.0 * 0.125)).abs() < 1e-12);
    }

    #[test]
    fn the_largest_region_wins_and_holes_do_not_count() {
        let mask = Mask::from_fn(30, 20, |x, y| {
            (x < 3 && y < 3) || ((10..28).contains(&x) && y > 1 && !(15..20).contains(&x)) || (y == 2 && x > 9)
        });
        let contour = largest_contour(&mask);
        assert!(contour.iter().all(|p| p.x >= 9.9));
        assert!(largest_contour(&Mask::new(5, 5)).is_empty());
        assert_eq!(largest_contour(&Mask::from_fn(1, 1, |_, _| true)).len(), 4);
    }

    /// The 8-connected region that the contour bounds and all that it encloses: what the outside, walked through sides only, cannot reach.
    fn region_without_holes(mask: &Mask, contour: &[DVec2]) -> Mask {
        let (width, height) = (i64::from(mask.width()), i64::from(mask.height()));
        let flood = |starts: Vec<(i64, i64)>, open: &dyn Fn(i64, i64) -> bool, reach: &[(i64, i64)]| {
            let mut seen = std::collections::BTreeSet::new();
            let mut next = starts;
            while let Some((x, y)) = next.pop() {
                let near = (-1..=width).contains(&x) && (-1..=height).contains(&y) && open(x, y);
                if near && seen.insert((x, y)) {
                    next.extend(reach.iter().map(|(dx, dy)| (x + dx, y + dy)));
                }
            }
            seen
        };
        let sides = [(1, 0), (-1, 0), (0, 1), (0, -1)];
        let around = [sides, [(1, 1), (-1, 1), (1, -1), (-1, -1)]].concat();
        let start = contour.iter().flat_map(|p| [(p.x.floor() as i64, p.y.floor() as i64)]).filter(|&(x, y)| mask.get(x, y));
        let region = flood(start.take(1).collect(), &|x, y| mask.get(x, y), &around);
        let outside = flood(vec![(-1, -1)], &|x, y| !region.contains(&(x, y)), &sides);
        Mask::from_fn(mask.width(), mask.height(), |x, y| !outside.contains(&(x.into(), y.into())))
    }

    proptest! {
        #[test]
        fn filling_the_contour_gives_the_region_without_holes(bits in proptest::collection::vec(any::<bool>(), 64)) {
            let mask = Mask::from_fn(8, 8, |x, y| bits[(y * 8 + x) as usize]);
            let contour = largest_contour(&mask);
            let mut filled = Mask::new(8, 8);
            fill_polygon(&mut filled, &contour);
            prop_assert_eq!(filled, region_without_holes(&mask, &contour));
        }
    }
}
