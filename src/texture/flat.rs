//! Polygons laid flat, and the rigid motions that unfold one into its neighbour's plane (She §3.2, fig. 11a). Metres.

use glam::{Affine2, Mat2, Vec2, Vec3};

use crate::geom::{Edges, PolyMesh};
use crate::{Error, Result};

/// One polygon in its own plane: corner 0 at the origin, corner 1 on +x, counter-clockwise seen from outside the crown.
#[derive(Debug, Clone, Copy)]
pub struct Flat {
    /// The corners; a triangle repeats its last one. A quad is unfolded along its diagonal 0–2, so that every edge keeps its length.
    pub corners: [Vec2; 4],
    /// 3 or 4.
    pub count: usize,
    /// Object-space directions of x and y, and the place of the origin.
    frame: [Vec3; 3],
    /// Direction of "up the crown" in the plane; `None` where the polygon lies level.
    pub up: Option<Vec2>,
    /// Unit normal, outward.
    pub normal: Vec3,
    /// Area, m².
    pub area: f32,
}

impl Flat {
    fn of(points: &[Vec3]) -> Self {
        let (a, b, c) = (points[0], points[1], points[2]);
        let cross: Vec3 = (1..points.len() - 1).map(|k| (points[k] - a).cross(points[k + 1] - a)).sum();
        let normal = (b - a).cross(c - a).normalize_or(cross.normalize_or(Vec3::Y));
        let x = (b - a).normalize_or(normal.any_orthonormal_vector());
        let y = normal.cross(x);
        let lay = |p: Vec3| Vec2::new((p - a).dot(x), (p - a).dot(y));
        let (b2, c2) = (lay(b), lay(c));
        let last = points.get(3).map_or(c2, |&d| unfold(Vec2::ZERO, c2, a.distance(d), c.distance(d), a.distance(c)));
        let rise = Vec3::Y - Vec3::Y.dot(normal) * normal;
        let up = (rise.length() > 0.2).then(|| Vec2::new(rise.dot(x), rise.dot(y)).normalize_or(Vec2::Y));
        let mean_normal = cross.normalize_or(normal);
        Self {
            corners: [Vec2::ZERO, b2, c2, last],
            count: points.len(),
            frame: [x, y, a],
            up,
            normal: mean_normal,
            area: 0.5 * cross.length(),
        }
    }

    /// The corners that are there.
    pub fn corners(&self) -> &[Vec2] {
        &self.corners[..self.count]
    }

    /// Middle of the corners.
    pub fn middle(&self) -> Vec2 {
        self.corners().iter().sum::<Vec2>() / self.count as f32
    }

    /// Back to object space, in the plane of the first three corners.
    pub fn lift(&self, p: Vec2) -> Vec3 {
        self.frame[2] + p.x * self.frame[0] + p.y * self.frame[1]
    }
}

/// The fourth corner of a quad laid flat: at distances `ad` and `cd` from `a` and `c`, left of the line from `a` to `c`.
fn unfold(a: Vec2, c: Vec2, ad: f32, cd: f32, ac: f32) -> Vec2 {
    let along = if ac > 0.0 { (ac * ac + ad * ad - cd * cd) / (2.0 * ac) } else { 0.0 };
    let aside = (ad * ad - along * along).max(0.0).sqrt();
    let direction = (c - a).normalize_or(Vec2::X);
    a + along * direction + aside * direction.perp()
}

/// A polygon's neighbour across one edge.
#[derive(Debug, Clone, Copy)]
pub struct Hinge {
    /// The polygon over there.
    pub polygon: usize,
    /// Takes this polygon's plane into the neighbour's, the shared edge onto itself (She fig. 11a).
    pub unfolded: Affine2,
}

/// All polygons laid flat, and their hinges.
#[derive(Debug, Clone)]
pub struct FlatMesh {
    /// One per polygon.
    pub flats: Vec<Flat>,
    /// Per polygon, per corner `k`: what lies across the edge from `k` to the next corner.
    pub hinges: Vec<[Option<Hinge>; 4]>,
    /// Surface, m².
    pub area: f64,
}

impl FlatMesh {
    /// Lays every polygon flat.
    ///
    /// # Errors
    /// [`Error::Untexturable`] for a mesh without polygons or area, or with polygons over vertices that are not finite or not there.
    pub fn of(mesh: &PolyMesh) -> Result<Self> {
        let (flats, area) = laid_flat(mesh)?;
        let edges = Edges::of(mesh);
        let hinges = mesh.polygons().enumerate().map(|(p, polygon)| {
            let mut hinges = [None; 4];
            for (k, &a) in polygon.iter().enumerate() {
                let b = polygon[(k + 1) % polygon.len()];
                hinges[k] = edges.across(a, b, p).filter(|&q| q != p).and_then(|q| {
                    let there = mesh.polygon(q);
                    let at = |v: u32| there.iter().position(|&w| w == v).map(|i| flats[q].corners[i]);
                    let here = [flats[p].corners[k], flats[p].corners[(k + 1) % polygon.len()]];
                    Some(Hinge { polygon: q, unfolded: edge_to_edge(here, [at(a)?, at(b)?]) })
                });
            }
            hinges
        });
        let hinges = hinges.collect();
        Ok(Self { flats, hinges, area })
    }
}

/// Every polygon by itself, and the area of all, m².
///
/// # Errors
/// As [`FlatMesh::of`].
pub(super) fn laid_flat(mesh: &PolyMesh) -> Result<(Vec<Flat>, f64)> {
    let untexturable = |found: &str| Err(Error::Untexturable { found: found.to_owned() });
    if mesh.polygons().flatten().any(|&v| mesh.positions.get(v as usize).is_none_or(|p| !p.is_finite())) {
        return untexturable("polygons over vertices that are missing or not finite");
    }
    let corners = |polygon: &[u32]| polygon.iter().map(|&v| mesh.positions[v as usize]).collect::<Vec<_>>();
    let flats: Vec<Flat> = mesh.polygons().map(|p| Flat::of(&corners(p))).collect();
    let area: f64 = flats.iter().map(|f| f64::from(f.area)).sum();
    if area.is_finite() && area > 1e-12 { Ok((flats, area)) } else { untexturable("no polygons of any area") }
}

/// The rigid motion that lays one segment on another of the same length, middle on middle.
fn edge_to_edge(from: [Vec2; 2], to: [Vec2; 2]) -> Affine2 {
    let (a, b) = ((from[1] - from[0]).normalize_or(Vec2::X), (to[1] - to[0]).normalize_or(Vec2::X));
    let turn = Mat2::from_cols(Vec2::new(a.dot(b), a.perp_dot(b)), Vec2::new(-a.perp_dot(b), a.dot(b)));
    Affine2::from_mat2_translation(turn, 0.5 * (to[0] + to[1]) - turn * (0.5 * (from[0] + from[1])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::test_shapes::lumpy_ball;

    #[test]
    fn flattening_keeps_every_edge_and_the_diagonal_that_splits_quads() {
        let mesh = lumpy_ball(12, 1.5);
        let flat = FlatMesh::of(&mesh).unwrap();
        for (p, polygon) in mesh.polygons().enumerate() {
            let at = |k: usize| mesh.positions[polygon[k % polygon.len()] as usize];
            let laid = |k: usize| flat.flats[p].corners[k % polygon.len()];
            let pairs = (0..polygon.len()).map(|k| (k, k + 1)).chain([(0, 2)]);
            pairs.for_each(|(i, j)| assert!((at(i).distance(at(j)) - laid(i).distance(laid(j))).abs() < 1e-4, "polygon {p}"));
        }
    }

    #[test]
    fn unfolding_lays_the_shared_edge_on_itself_and_the_polygons_on_either_side() {
        let flat = FlatMesh::of(&lumpy_ball(12, 1.0)).unwrap();
        for (p, hinges) in flat.hinges.iter().enumerate() {
            for (k, hinge) in hinges.iter().enumerate().take(flat.flats[p].count) {
                let hinge = hinge.expect("the ball is closed");
                let back = flat.hinges[hinge.polygon].iter().flatten().find(|h| h.polygon == p).unwrap();
                let corner = flat.flats[p].corners[k];
                let there = hinge.unfolded.transform_point2(corner);
                assert!((back.unfolded.transform_point2(there) - corner).length() < 1e-4);
                assert!((hinge.unfolded.matrix2.determinant() - 1.0).abs() < 1e-4, "no mirroring");
                assert!(flat.flats[hinge.polygon].corners().iter().any(|c| c.distance(there) < 1e-4));
                let (mine, theirs) = (hinge.unfolded.transform_point2(flat.flats[p].middle()), flat.flats[hinge.polygon].middle());
                let next = hinge.unfolded.transform_point2(flat.flats[p].corners[(k + 1) % flat.flats[p].count]);
                let side = |q: Vec2| (next - there).perp_dot(q - there);
                assert!(side(mine) > 0.0 && side(theirs) < 0.0, "folded out, not over");
            }
        }
    }

    #[test]
    fn a_level_polygon_has_no_up_and_a_wall_points_up() {
        let level = Flat::of(&[Vec3::ZERO, Vec3::Z, Vec3::X]);
        assert!(level.up.is_none() && level.normal.y > 0.99);
        let wall = Flat::of(&[Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
        assert!((wall.up.unwrap() - Vec2::Y).length() < 1e-6);
        assert!((wall.lift(Vec2::new(0.5, 0.25)) - Vec3::new(0.5, 0.25, 0.0)).length() < 1e-6);
    }
}
