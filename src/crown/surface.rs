//! From point cloud to closed surface: spherical Delaunay, disturbance that keeps every triangle facing outward, pairs into quads
//! (She §3.1, fig. 9).

use glam::{DVec3, Vec3};

use super::cloud::{self, Cloud};
use super::hull::Hull;
use super::{Crown, CrownParams};
use crate::geom::{PolyMesh, QuadRules, pair_into_quads, sphere_delaunay};
use crate::{Error, Result, Seed};

/// Smallest determinant of a triangle's three directions from the centre. It is taken of the rounded positions, so that any positive
/// value would do; this much keeps the triangle from vanishing.
const FACING: f64 = 1e-9;
/// Largest corner of a quad.
const CORNER_DEG: f64 = 165.0;
/// Largest deviation from the wanted number of polygons that is not worth a second attempt.
const TOLERANCE: f64 = 0.08;
/// How often a disturbance is halved before it is given up.
const HALVINGS: usize = 5;

/// The surface of one crown with about `polygons` polygons; `index` tells the crowns of one tree apart.
pub(super) fn crown(hull: &Hull, polygons: usize, params: &CrownParams, seed: Seed, index: usize) -> Result<Crown> {
    let rules = QuadRules { fold_rad: params.quad_fold_deg.to_radians(), corner_rad: CORNER_DEG.to_radians() };
    let mut smooth = Smooth::new(hull, polygons, params)?;
    let excess = pair_into_quads(&smooth.mesh, &[&smooth.mesh.positions], rules).polygon_count() as f64 / polygons.max(1) as f64;
    if (excess - 1.0).abs() > TOLERANCE {
        // How many pairs stay triangles shows only afterwards; once it is known, aim off by as much.
        smooth = Smooth::new(hull, (polygons as f64 / excess) as usize, params)?;
    }
    let displacements = smooth.points.displacements(seed, index, params);
    let disturbed = disturb(&smooth.points, &smooth.mesh.triangles, hull, &displacements);
    let cloud = smooth.mesh.positions.clone();
    let mesh = PolyMesh { positions: disturbed.clone(), ..smooth.mesh };
    Ok(Crown { mesh: pair_into_quads(&mesh, &[&cloud, &disturbed], rules), center: hull.center.as_vec3(), cloud, disturbed })
}

/// The undisturbed surface (She fig. 9c), all triangles.
struct Smooth {
    points: Cloud,
    mesh: PolyMesh,
}

impl Smooth {
    fn new(hull: &Hull, polygons: usize, params: &CrownParams) -> Result<Self> {
        let points = cloud::cloud(hull, polygons, params);
        let positions = cloud::placed(&points.points, hull.center);
        let triangles = triangulate(&points, &positions, hull.center.as_vec3())?;
        Ok(Self { points, mesh: PolyMesh { positions, triangles, quads: vec![] } })
    }
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
