//! Rectangles round flat sets of points, and their places in one square picture.

use std::f32::consts::FRAC_PI_2;

use glam::{Vec2, Vec3};

/// Turns that are tried for the tightest rectangle.
const TURNS: usize = 48;

/// The tightest rectangle (of [`TURNS`]) in the plane across `normal` round `points`: right and up such that right × up = normal and it
/// is no higher than wide, its lower left corner in these axes, and its size. A line or a point gets a little extent.
pub fn tight(points: &[Vec3], normal: Vec3) -> ([Vec3; 2], Vec2, Vec2) {
    let (u, v) = normal.any_orthonormal_pair();
    let (u, v) = if u.cross(v).dot(normal) > 0.0 { (u, v) } else { (v, u) };
    let flat: Vec<Vec2> = points.iter().map(|p| Vec2::new(u.dot(*p), v.dot(*p))).collect();
    let at = |turn: usize| {
        let right = Vec2::from_angle(FRAC_PI_2 * turn as f32 / TURNS as f32);
        let (low, high) = flat
            .iter()
            .map(|p| Vec2::new(right.dot(*p), right.perp_dot(*p)))
            .fold((Vec2::splat(f32::MAX), Vec2::splat(f32::MIN)), |(low, high), p| (low.min(p), high.max(p)));
        (right, low, high - low)
    };
    let best = (0..TURNS).map(at).min_by(|a, b| a.2.element_product().total_cmp(&b.2.element_product()));
    let (right, low, size) = best.unwrap_or((Vec2::X, Vec2::ZERO, Vec2::ZERO));
    let (right, up) = (right.x * u + right.y * v, right.x * v - right.y * u);
    let size = size.max(Vec2::splat(1e-3 * size.max_element().max(1e-2)));
    if size.x >= size.y {
        return ([right, up], low, size);
    }
    // Turned by a quarter: right becomes the old up, up the old left.
    ([up, -right], Vec2::new(low.y, -low.x - size.x), Vec2::new(size.y, size.x))
}

/// Places of rectangles in a square of 1: the lower left corner of each, and how large a unit of their sizes is there. Between them, and
/// along the edges, `gap` is left free.
pub fn packed(sizes: &[Vec2], gap: f32) -> (Vec<Vec2>, f32) {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|&a, &b| sizes[b].y.total_cmp(&sizes[a].y).then(a.cmp(&b)));
    let area: f32 = sizes.iter().map(|size| size.element_product()).sum();
    let (mut fits, mut too_large) = (0.0, 1.0 / area.sqrt().max(1e-9));
    let mut best = vec![Vec2::splat(gap); sizes.len()];
    for _ in 0..24 {
        let scale = 0.5 * (fits + too_large);
        match shelved(sizes, &order, scale, gap) {
            Some(places) => (best, fits) = (places, scale),
            None => too_large = scale,
        }
    }
    (best, fits)
}

/// Rectangles in rows, highest first, each row as high as its first.
fn shelved(sizes: &[Vec2], order: &[usize], scale: f32, gap: f32) -> Option<Vec<Vec2>> {
    let mut places = vec![Vec2::ZERO; sizes.len()];
    let (mut at, mut row) = (Vec2::splat(gap), 0.0);
    for &number in order {
        let size = scale * sizes[number];
        if at.x + size.x + gap > 1.0 {
            at = Vec2::new(gap, at.y + row + gap);
            row = 0.0;
        }
        row = f32::max(row, size.y);
        if at.x + size.x + gap > 1.0 || at.y + size.y + gap > 1.0 {
            return None;
        }
        places[number] = at;
        at.x += size.x + gap;
    }
    Some(places)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slanted_rectangle_is_found() {
        let normal = Vec3::new(1.0, 2.0, -0.5).normalize();
        let (u, v) = normal.any_orthonormal_pair();
        let (along, across) = ((0.6 * u + 0.8 * v), (0.8 * u - 0.6 * v));
        for (a, b) in [(3.0, 1.0), (1.0, 3.0)] {
            let corners = [(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)].map(|(x, y)| x * along + y * across + Vec3::splat(7.0));
            let ([right, up], low, size) = tight(&corners, normal);
            assert!((right.cross(up) - normal).length() < 1e-5);
            assert!(size.x < 3.1 && size.y < 1.2 && size.x >= size.y, "{size}");
            for p in corners {
                let inside = Vec2::new(right.dot(p), up.dot(p)) - low;
                assert!(inside.min_element() > -1e-4 && (size - inside).min_element() > -1e-4, "{inside} of {size}");
            }
        }
        assert!(tight(&[Vec3::ONE], Vec3::Y).2.min_element() > 0.0);
    }

    #[test]
    fn rectangles_keep_apart_and_fill_the_square() {
        let sizes: Vec<Vec2> = (0..60).map(|i| Vec2::new(2.0 + (i % 7) as f32, 1.0 + (i % 5) as f32 * 0.2)).collect();
        let (places, scale) = packed(&sizes, 0.002);
        let boxes: Vec<(Vec2, Vec2)> = places.iter().zip(&sizes).map(|(at, size)| (*at, *at + scale * *size)).collect();
        for (i, (low, high)) in boxes.iter().enumerate() {
            assert!(low.min_element() >= 0.002 - 1e-6 && high.max_element() <= 0.998 + 1e-6);
            for (other_low, other_high) in &boxes[i + 1..] {
                let apart = (*other_low - *high).max(*low - *other_high).max_element();
                assert!(apart > 0.0015, "{apart}");
            }
        }
        let filled: f32 = sizes.iter().map(|size| scale * scale * size.element_product()).sum();
        assert!(filled > 0.75, "{filled}");
        assert_eq!(packed(&[], 0.01).0.len(), 0);
    }
}
