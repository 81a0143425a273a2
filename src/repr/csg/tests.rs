use std::collections::BTreeMap;

use super::*;
use crate::model::reference::{Asked, ReferenceTree};
use crate::model::{Material, Part};
use crate::repr::{Order, Settings, SoftwareCapture, build};
use crate::{Seed, geom::Surface};
use proptest::prelude::*;

fn one(shape: Shape, center: [f64; 3], half: [f64; 3]) -> Primitive {
    Primitive { shape, center: center.into(), half: half.into() }
}

fn solids(primitives: &[Primitive]) -> Vec<Solid> {
    primitives.iter().enumerate().map(|(k, one)| one.surface(12, 0.37 + 0.731 * k as f64)).collect()
}

/// Every edge is walked once each way.
fn open_edges(triangles: &[[usize; 3]]) -> usize {
    let mut walked: BTreeMap<(usize, usize), i32> = BTreeMap::new();
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *walked.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    walked.values().filter(|sum| **sum != 0).count()
}

fn volume(solid: &Solid) -> f64 {
    let at = |v: usize| solid.positions[v];
    solid.triangles.iter().map(|t| at(t[0]).dot(at(t[1]).cross(at(t[2]))) / 6.0).sum()
}

#[test]
fn every_primitive_is_closed_outward_and_fills_its_box_as_it_should() {
    use std::f64::consts::PI;
    let shares = [(Shape::Sphere, PI / 6.0), (Shape::Ellipsoid, PI / 6.0), (Shape::Cone, PI / 12.0), (Shape::Cylinder, PI / 4.0)];
    for (shape, share) in shares {
        let half = if shape == Shape::Sphere { [1.0; 3] } else { [1.0, 2.0, 0.5] };
        let primitive = one(shape, [0.3, 1.0, 0.0], half);
        let solid = primitive.surface(48, 0.1);
        assert_eq!(open_edges(&solid.triangles), 0);
        let found = volume(&solid) / (8.0 * half.iter().product::<f64>());
        assert!((found - share).abs() < 0.02, "{shape:?} {found}");
        let middle = DVec3::new(0.3, 0.9, 0.0);
        assert!(primitive.depth_of(middle) < 1.0 && primitive.depth_of(middle + 9.0) > 1.0);
        let front = [DVec3::X, DVec3::Y];
        assert!(primitive.covers(front, glam::DVec2::new(0.3, 0.9)) && !primitive.covers(front, glam::DVec2::new(3.0, 0.9)));
        assert!(primitive.covers([DVec3::X, DVec3::NEG_Z], glam::DVec2::new(0.4, 0.1)));
    }
}

#[test]
fn two_boxes_worth_of_overlap_are_counted_once() {
    // Two spheres of radius 1, a radius apart: the lens between them has 5π/12.
    let two = solids(&[one(Shape::Sphere, [0.0; 3], [1.0; 3]), one(Shape::Sphere, [1.0, 0.0, 0.0], [1.0; 3])]);
    let fine: Vec<Solid> = [0.0, 1.0].map(|x| one(Shape::Sphere, [x, 0.0, 0.0], [1.0; 3]).surface(40, 0.3 + x)).into();
    let joined = union::union(&fine);
    assert_eq!(open_edges(&joined.solid.triangles), 0);
    let expected = (8.0 / 3.0 - 5.0 / 12.0) * std::f64::consts::PI;
    assert!((volume(&joined.solid) / expected - 1.0).abs() < 0.02, "{} {expected}", volume(&joined.solid));
    // Apart they stay as they are; one inside another leaves nothing.
    let apart = union::union(&solids(&[one(Shape::Cone, [0.0; 3], [1.0; 3]), one(Shape::Cylinder, [5.0, 0.0, 0.0], [1.0; 3])]));
    assert_eq!(apart.of.iter().filter(|of| **of == 0).count(), 24);
    let inside = union::union(&solids(&[one(Shape::Sphere, [0.0; 3], [1.0; 3]), one(Shape::Cone, [0.05, 0.1, 0.0], [0.3; 3])]));
    assert!(inside.of.iter().all(|of| *of == 0) && inside.of.len() == two[0].triangles.len());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn any_union_is_closed_and_has_no_faces_inside(
        parts in prop::collection::vec((0usize..4, prop::array::uniform3(-1.0f64..1.0), prop::array::uniform3(0.3f64..1.2)), 2..6)
    ) {
        let primitives: Vec<Primitive> = parts
            .iter()
            .map(|(kind, center, half)| one(Shape::ALL[*kind], *center, if *kind == 1 { [half[0]; 3] } else { *half }))
            .collect();
        let joined = union::union(&solids(&primitives));
        prop_assert_eq!(open_edges(&joined.solid.triangles), 0);
        prop_assert!(volume(&joined.solid) > 0.0);
        for (t, of) in joined.solid.triangles.iter().zip(&joined.of) {
            for (other, primitive) in primitives.iter().enumerate().filter(|(other, _)| other != of) {
                // A twelve-cornered solid lies within the round one by up to a twentieth.
                let deepest = t.iter().map(|&v| primitive.depth_of(joined.solid.positions[v])).fold(f64::INFINITY, f64::min);
                prop_assert!(deepest > 0.75, "{} in {}: {}", of, other, deepest);
            }
        }
    }
}

/// A tree of many small leaves in a ball, and a trunk.
fn round_tree() -> TreeSource {
    let leaf = |k: usize| {
        let mut draws = Seed(1).keyed("leaf", k as u64);
        let mut at = || 2.0 * draws.unit() as f32 - 1.0;
        let p = glam::Vec3::new(at(), at(), at());
        let p = if p.length() > 1.0 { p.normalize() * 0.9 } else { p };
        (p + glam::Vec3::new(0.0, 3.0, 0.0), glam::Vec3::new(at(), at(), at()).normalize_or(glam::Vec3::Z))
    };
    let mut surface = Surface::default();
    for (p, normal) in (0..1500).map(leaf) {
        let (u, v) = normal.any_orthonormal_pair();
        let first = surface.mesh.positions.len() as u32;
        surface.mesh.positions.extend([-u - v, u - v, u + v, v - u].map(|d| p + 0.06 * d));
        surface.normals.extend([normal; 4]);
        surface.mesh.quads.push([0, 1, 2, 3].map(|k| first + k));
    }
    let green = Material { name: "leaves".to_owned(), factor: [0.1, 0.4, 0.05, 1.0], two_sided: true, ..Material::default() };
    let leaves = Part { name: "leaves".to_owned(), surface, material: green, crown_center: None };
    let shape = crate::model::TrunkShape { neck: glam::Vec3::Y * 2.0, tip: glam::Vec3::Y * 3.0, width_m: 0.25, bark: [90, 70, 50] };
    let tree = ReferenceTree::new("ball".to_owned(), vec![leaves, shape.build().part()], &Asked::default()).unwrap();
    TreeSource::reference(tree)
}

#[test]
fn a_ball_of_leaves_becomes_a_closed_ball_on_a_trunk_evenly_covered() {
    let source = round_tree();
    let order = Order { method: "csg", trunk: None, settings: &Settings::default(), seed: Seed(1) };
    let built = build(&order, &source, &SoftwareCapture::new()).unwrap();
    let mut all = Surface::default();
    for part in &built.parts {
        all.append(Surface { uvs: vec![], ..part.part.surface.clone() });
    }
    let welded = all.welded();
    let triangles: Vec<[usize; 3]> = welded.triangles.iter().map(|t| t.map(|v| v as usize)).collect();
    assert_eq!(open_edges(&triangles), 0);
    let bounds = welded.bounds().unwrap();
    assert!(bounds.min.y.abs() < 0.05 && (bounds.max.y - 4.0).abs() < 0.25 && (bounds.max.x - 1.0).abs() < 0.25, "{bounds:?}");
    // Texels per metre, on the least and the most stretched face.
    let crown = &built.parts[0].part.surface;
    let density = crown.mesh.triangles.iter().filter_map(|t| {
        let [a, b, c] = t.map(|v| (crown.mesh.positions[v as usize], crown.uvs[v as usize]));
        let (space, tile) = ((b.0 - a.0).cross(c.0 - a.0).length(), (b.1 - a.1).perp_dot(c.1 - a.1).abs());
        (space > 1e-4).then(|| (tile / space).sqrt())
    });
    let (least, most) = density.fold((f32::MAX, 0f32), |(least, most), d| (least.min(d), most.max(d)));
    assert!(most / least < 1.15, "{least} {most}");
    let names: Vec<&str> = built.parts.iter().map(|part| part.part.name.as_str()).collect();
    assert_eq!(names, ["crown", "trunk"]);
}
