//! From point cloud to closed surface: spherical Delaunay, disturbance that keeps every triangle facing outward, pairs into quads
//! (She §3.1, fig. 9).

use glam::{DVec3, Vec3};

use super::cloud::{self, Cloud};
use super::hull::Hull;
use super::{Crown, CrownParams};
use crate::geom::{PolyMesh, QuadRules, pair_into_quads, sphere_delaunay};
use crate::{Error, Result, Seed};

/// Smallest determinant of a triangle's three directions from the centre: above what rounding to 32 bits can turn over.
const FACING: f64 = 1e-7;
/// Largest corner of a quad.
const CORNER_DEG: f64 = 165.0;
/// How often a disturbance is halved before it is given up.
const HALVINGS: usize = 5;

/// The surface of one crown with about `polygons` polygons; `index` tells the crowns of one tree apart.
pub(super) fn crown(hull: &Hull, polygons: usize, params: &CrownParams, seed: Seed, index: usize) -> Result<Crown> {
    let points = cloud::cloud(hull, polygons, params);
    let center = hull.center.as_vec3();
    let smooth = cloud::placed(&points.points, hull.center);
    let triangles = triangulate(&points, &smooth, center)?;
    let disturbed = disturb(&points, &triangles, hull, &points.displacements(seed, index));
    let mesh = PolyMesh { positions: disturbed.clone(), triangles, quads: vec![] };
    let rules = QuadRules { fold_rad: params.quad_fold_deg.to_radians(), corner_rad: CORNER_DEG.to_radians() };
    let mesh = pair_into_quads(&mesh, &[&smooth, &disturbed], rules);
    Ok(Crown { mesh, center, cloud: smooth, disturbed })
}

/// Joins the points in the conformal chart. Should a triangle there face inward in space, which takes an outline whose two sides differ
/// wildly, the directions from the centre themselves are triangulated: never wrong, though its triangles may be long.
fn triangulate(points: &Cloud, smooth: &[Vec3], center: Vec3) -> Result<Vec<[u32; 3]>> {
    let charted = sphere_delaunay(&points.chart)?;
    if charted.iter().all(|&t| faces_outward(smooth, center, t)) {
        return Ok(charted);
    }
    let directions: Vec<DVec3> = smooth.iter().map(|p| (p - center).as_dvec3().normalize()).collect();
    let triangles = sphere_delaunay(&directions)?;
    if triangles.iter().all(|&t| faces_outward(smooth, center, t)) {
        return Ok(triangles);
    }
    Err(Error::Internal { stage: "crown surface", what: "the crown is not star-shaped about its centre".to_owned() })
}

/// Displaces every point, and halves the displacement of those whose triangles would turn inward until none does.
fn disturb(points: &Cloud, triangles: &[[u32; 3]], hull: &Hull, displacements: &[DVec3]) -> Vec<Vec3> {
    let center = hull.center.as_vec3();
    let mut scale = vec![1.0; displacements.len()];
    for round in 0.. {
        let moved: Vec<DVec3> = (0..scale.len()).map(|i| points.points[i] + scale[i] * displacements[i]).collect();
        let positions = cloud::placed(&moved, hull.center);
        let mut turned = vec![false; scale.len()];
        triangles.iter().filter(|&&t| !faces_outward(&positions, center, t)).flatten().for_each(|&v| turned[v as usize] = true);
        if !turned.contains(&true) {
            return positions;
        }
        // A triangle whose corners all stand still faces outward again, so this ends.
        let next = |s: f64| if round < HALVINGS { 0.5 * s } else { 0.0 };
        scale.iter_mut().zip(&turned).filter(|(_, t)| **t).for_each(|(s, _)| *s = next(*s));
    }
    unreachable!("the loop returns")
}

/// Whether the triangle is seen from its inner side by `center`.
fn faces_outward(positions: &[Vec3], center: Vec3, triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|i| (positions[i as usize].as_dvec3() - center.as_dvec3()).normalize_or_zero());
    a.dot(b.cross(c)) > FACING
}
