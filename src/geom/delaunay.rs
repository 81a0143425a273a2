//! Spherical Delaunay triangulation by stereographic projection (She §3.1, fig. 9c, leaves the method open).
//!
//! Projecting the sphere from one of its own points onto a plane sends circles to circles, and circles through that point to straight
//! lines. So the planar Delaunay triangulation of the other points, closed by a fan from the convex hull to the projection point, is
//! the triangulation of the sphere in which no circumcircle contains a point.

use glam::{DVec2, DVec3};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation as _};

use crate::{Error, Result};

struct Projected {
    index: u32,
    position: Point2<f64>,
}

impl HasPosition for Projected {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// Triangles over unit `directions`, counter-clockwise seen from outside the sphere; the first direction is the projection point.
/// With four points or more that are not all on one circle the result is closed and has genus 0.
///
/// # Errors
/// [`Error::Internal`] when there are fewer than four distinct directions or two of them coincide.
pub fn sphere_delaunay(directions: &[DVec3]) -> Result<Vec<[u32; 3]>> {
    let broken = |what: String| Error::Internal { stage: "sphere_delaunay", what };
    let Some((&pole, rest)) = directions.split_first().filter(|(_, rest)| rest.len() >= 3) else {
        return Err(broken(format!("{} directions, at least 4 are needed", directions.len())));
    };
    // With u × v = −pole, counter-clockwise in the plane is counter-clockwise from outside.
    let u = pole.any_orthonormal_vector();
    let v = u.cross(pole);
    let project = |d: DVec3| {
        // 1 − d·pole, without its cancellation near the pole.
        let height = 0.5 * (d - pole).length_squared();
        DVec2::new(d.dot(u), d.dot(v)) / height
    };
    let points = rest.iter().zip(1u32..).map(|(&d, index)| {
        let p = project(d);
        Projected { index, position: Point2::new(p.x, p.y) }
    });
    let plane = DelaunayTriangulation::<Projected>::bulk_load(points.collect())
        .map_err(|e| broken(format!("a direction has no usable projection ({e})")))?;
    if plane.num_vertices() != rest.len() || plane.num_inner_faces() == 0 {
        return Err(broken(format!("only {} of {} directions are distinct", plane.num_vertices(), rest.len())));
    }
    let mut triangles: Vec<[u32; 3]> = plane.inner_faces().map(|f| f.vertices().map(|v| v.data().index)).collect();
    // Hull edges have the outer face on one side; the fan walks each against its inner triangle.
    triangles.extend(plane.convex_hull().map(|edge| {
        let inner = if edge.is_outer_edge() { edge.rev() } else { edge };
        [inner.to().data().index, inner.from().data().index, 0]
    }));
    // Spade's face order depends on its insertion order; ours must not.
    triangles.iter_mut().for_each(|t| {
        let first = (0..3).min_by_key(|&k| t[k]).expect("three corners");
        t.rotate_left(first);
    });
    triangles.sort_unstable();
    Ok(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Seed;
    use crate::geom::{PolyMesh, Topology};
    use proptest::prelude::*;

    fn random_directions(n: u64, seed: u64) -> Vec<DVec3> {
        let direction = |i| {
            let mut draws = Seed(seed).keyed("directions", i);
            DVec3::new(draws.signed(), draws.signed(), draws.signed()).normalize_or(DVec3::Y)
        };
        (0..n).map(direction).collect()
    }

    proptest! {
        #[test]
        fn random_directions_give_a_closed_convex_sphere(n in 5u64..80, seed: u64) {
            let directions = random_directions(n, seed);
            let triangles = sphere_delaunay(&directions).unwrap();
            let mesh = PolyMesh { positions: directions.iter().map(|d| d.as_vec3()).collect(), triangles, quads: vec![] };
            prop_assert!(Topology::of(&mesh).is_sphere());
            // The spherical Delaunay triangulation is the convex hull: every point lies below every triangle's plane.
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| directions[i as usize]);
                let normal = (b - a).cross(c - a).normalize();
                prop_assert!(directions.iter().all(|d| (*d - a).dot(normal) < 1e-9));
            }
        }
    }

    #[test]
    fn too_few_or_equal_directions_are_refused() {
        assert!(sphere_delaunay(&[DVec3::X, DVec3::Y, DVec3::Z]).is_err());
        assert!(sphere_delaunay(&[DVec3::X, DVec3::Y, DVec3::Z, DVec3::Z, -DVec3::Z]).is_err());
        assert!(sphere_delaunay(&[DVec3::X, DVec3::X, DVec3::Z, DVec3::Y, -DVec3::Z]).is_err());
    }
}
