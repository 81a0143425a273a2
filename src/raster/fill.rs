//! Filling polygons into a [`Mask`]: a pixel is inside when its centre is. Pixels, x right, y down, pixel centres at +0.5.

use glam::DVec2;

use super::Mask;

/// Adds the pixels whose centre lies in the triangle, whatever its orientation. Parts outside the image are ignored.
pub fn fill_triangle(mask: &mut Mask, corners: [DVec2; 3]) {
    fill_polygon(mask, &corners);
}

/// Adds the pixels whose centre lies inside the closed polygon by the even-odd rule. Parts outside the image are ignored.
pub fn fill_polygon(mask: &mut Mask, corners: &[DVec2]) {
    let width = mask.width() as usize;
    let top = corners.iter().fold(f64::INFINITY, |m, p| m.min(p.y));
    let bottom = corners.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p.y));
    let rows = first_center(top)..first_center(bottom).min(mask.height() as usize);
    let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); rows.len()];
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
        // Half-open in y, so that a corner on a row's centre line counts once.
        for y in first_center(low.y)..first_center(high.y).min(rows.end) {
            let t = (y as f64 + 0.5 - low.y) / (high.y - low.y);
            crossings[y - rows.start].push(low.x + t * (high.x - low.x));
        }
    }
    for (y, xs) in rows.zip(&mut crossings) {
        xs.sort_by(f64::total_cmp);
        for pair in xs.chunks_exact(2) {
            let (from, to) = (first_center(pair[0]), first_center(pair[1]).min(width));
            if from < to {
                mask.as_raw_mut()[y * width + from..y * width + to].fill(255);
            }
        }
    }
}

/// The first pixel whose centre is at or after `v`, not below 0.
fn first_center(v: f64) -> usize {
    (v - 0.5).ceil().max(0.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_fill_their_square_without_overlap_or_gap() {
        let corner = |x: f64, y: f64| DVec2::new(x, y);
        let (a, b, c, d) = (corner(1.0, 1.0), corner(6.0, 1.0), corner(6.0, 6.0), corner(1.0, 6.0));
        let (mut one, mut two) = (Mask::new(8, 7), Mask::new(8, 7));
        fill_triangle(&mut one, [a, b, c]);
        fill_triangle(&mut two, [c, d, a]);
        assert_eq!(one.count() + two.count(), 25);
        assert_eq!(one.zip(&two, |p, q| p || q).count(), 25);
    }

    #[test]
    fn what_lies_outside_the_image_is_cut_off() {
        let mut mask = Mask::new(4, 4);
        let far = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, y)| DVec2::new(x, y));
        fill_polygon(&mut mask, &far);
        assert_eq!(mask.count(), 16);
        fill_polygon(&mut mask, &[]);
    }
}
