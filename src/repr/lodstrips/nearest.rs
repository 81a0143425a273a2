//! How a point lies to triangles: its distance, and whether it is inside what they enclose.

use glam::Vec3;

/// A triangle's corners.
pub type Corners = [Vec3; 3];

/// The point of a triangle that is nearest to `p` (Ericson, Real-Time Collision Detection, §5.1.5).
pub fn nearest_on([a, b, c]: Corners, p: Vec3) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + d1 / (d1 - d3) * ab;
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + d2 / (d2 - d6) * ac;
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    }
    let sum = va + vb + vc;
    if sum > 0.0 { a + vb / sum * ab + vc / sum * ac } else { a }
}

/// How large a triangle looks from `p`, as a share of all directions; signed by the side that is seen (Van Oosterom & Strackee 1983).
pub fn share_of_sight(corners: Corners, p: Vec3) -> f32 {
    let [a, b, c] = corners.map(|corner| corner - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    let angle = 2.0 * a.dot(b.cross(c)).atan2(below);
    angle / (4.0 * std::f32::consts::PI)
}

/// Whether `p` is enclosed by these triangles, or at most `reach_m` away from one.
#[cfg(test)]
pub fn holds(triangles: impl Iterator<Item = Corners>, p: Vec3, reach_m: f32) -> bool {
    let mut around = 0.0;
    for corners in triangles {
        if nearest_on(corners, p).distance_squared(p) <= reach_m * reach_m {
            return true;
        }
        around += share_of_sight(corners, p);
    }
    around.abs() > 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Seed;

    /// The faces of a tetrahedron with its corners at the origin and one metre along each axis.
    fn tetrahedron() -> Vec<Corners> {
        let [o, x, y, z] = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        vec![[o, y, x], [o, z, y], [o, x, z], [x, y, z]]
    }

    #[test]
    fn inside_and_outside() {
        let inside = |p| holds(tetrahedron().into_iter(), p, 0.0);
        assert!(inside(Vec3::splat(0.2)) && !inside(Vec3::splat(0.4)) && !inside(Vec3::splat(-0.01)));
        assert!(holds(tetrahedron().into_iter(), Vec3::splat(-0.01), 0.02));
    }

    #[test]
    fn the_nearest_point_is_no_farther_than_any_other() {
        let mut draws = Seed(2).keyed("nearest", 0);
        for _ in 0..2000 {
            let mut point = || Vec3::from([0; 3].map(|_: i32| draws.signed() as f32));
            let (corners @ [a, b, c], p) = ([point(), point(), point()], 2.0 * point());
            let nearest = nearest_on(corners, p);
            for i in 0..=10 {
                for j in 0..=(10 - i) {
                    let on = a + 0.1 * i as f32 * (b - a) + 0.1 * j as f32 * (c - a);
                    assert!(nearest.distance(p) <= on.distance(p) + 1e-5);
                }
            }
        }
    }
}
