//! What simplification promises of any foliage, and of bad foliage.

use glam::Vec3;
use proptest::prelude::*;

use super::foliage::{self, blades, surface_at, synthetic};
use super::simplify::{Blade, Collapse, simplify};
use super::{Forest, Resolution};
use crate::Seed;
use crate::geom::Surface;

fn quad(center: Vec3, right: Vec3, up: Vec3) -> Blade {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| center + 0.5 * (x * right + y * up));
    Blade { corners, normals: [right.cross(up).normalize_or(Vec3::Z); 4] }
}

fn checked(surface: &Surface) -> Result<(), String> {
    let texture = Some(std::sync::Arc::new(image::RgbaImage::new(1, 1)));
    let material = crate::model::Material { texture, ..Default::default() };
    crate::model::Part { name: String::new(), surface: surface.clone(), material, crown_center: None }.check()
}

fn area([a, b, c, d]: [Vec3; 4]) -> f32 {
    0.5 * (c - a).cross(d - b).length()
}

fn made(blades: &[Blade], collapse: &Collapse) -> [Vec3; 4] {
    collapse.corners.map(|c| blades[c.leaf as usize].corners[usize::from(c.corner)])
}

#[test]
fn two_leaves_side_by_side_become_one_over_both() {
    let pair = [quad(Vec3::ZERO, Vec3::X, Vec3::Y), quad(Vec3::X, Vec3::X, Vec3::Y)];
    let collapses = simplify(&pair, 1);
    assert_eq!(collapses.len(), 1);
    let leaf = made(&pair, &collapses[0]);
    assert!((area(leaf) - 2.0).abs() < 1e-5, "{leaf:?}");
    // The picture stands upright: its foot below, its left on the left.
    assert_eq!(leaf[0], Vec3::new(-0.5, -0.5, 0.0));
    assert_eq!(leaf[2], Vec3::new(1.5, 0.5, 0.0));
}

#[test]
fn the_nearest_and_most_alike_go_first() {
    let turned = quad(Vec3::new(0.3, 0.0, 0.0), Vec3::Y, Vec3::Z);
    let blades = [
        quad(Vec3::ZERO, Vec3::X, Vec3::Y),
        turned,
        quad(Vec3::new(0.3, 0.1, 0.0), Vec3::X, Vec3::Y),
        quad(Vec3::X * 9.0, Vec3::X, Vec3::Y),
    ];
    let first = simplify(&blades, 3)[0];
    assert_eq!([first.heir.min(first.absorbed), first.heir.max(first.absorbed)], [0, 2]);
}

#[test]
fn bad_leaves_do_no_harm() {
    let leaf = quad(Vec3::ZERO, Vec3::X, Vec3::Y);
    assert!(simplify(&[], 1).is_empty());
    assert!(simplify(&[leaf], 1).is_empty());
    assert!(simplify(&[leaf], 0).is_empty());
    let coincident = simplify(&[leaf; 500], 1);
    assert_eq!(coincident.len(), 499);
    let point = Blade { corners: [Vec3::ONE; 4], ..leaf };
    assert_eq!(simplify(&[point, leaf, point], 1).len(), 2);
    let mut broken = leaf;
    broken.corners[2].y = f32::NAN;
    let collapses = simplify(&[leaf, broken, leaf], 1);
    assert_eq!(collapses.len(), 1, "the broken one is left alone");
    assert!(collapses[0].heir != 1 && collapses[0].absorbed != 1);
    let huge = quad(Vec3::splat(1e30), 1e30 * Vec3::X, 1e30 * Vec3::Y);
    let _ = Forest::new(3, &simplify(&[leaf, huge, leaf], 1));
    let far: Vec<Blade> = (0..300).map(|i| quad(Vec3::X * (i as f32 * i as f32 * 1e4), Vec3::X, Vec3::Y)).collect();
    assert!(simplify(&far, 10).len() <= 290);
}

#[test]
fn a_crown_falls_into_compact_clusters_and_keeps_its_area() {
    let surface = synthetic(4000, Seed(3));
    let blades = blades(&surface);
    let collapses = simplify(&blades, 56);
    let forest = Forest::new(blades.len(), &collapses);
    assert_eq!(forest.clusters(), 56);
    let largest = (0..56).map(|g| forest.size(g)).max().unwrap();
    assert!(largest < 5 * 4000 / 56, "{largest}");
    let total = |s: &Surface| s.mesh.quads.iter().map(|q| area(q.map(|v| s.mesh.positions[v as usize]))).sum::<f32>();
    let mut resolution = Resolution::finest(&forest);
    for share in [0.6, 0.3, 0.1] {
        resolution.set_uniform(&forest, (share * 4000.0) as usize);
        let kept = total(&surface_at(&surface, &forest, &resolution)) / total(&surface);
        assert!((0.8..1.3).contains(&kept), "{kept} of the area at {share}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn any_foliage_makes_a_sound_forest(leaves in 1usize..400, seed in any::<u64>(), until in 1usize..40) {
        let surface = synthetic(leaves, Seed(seed));
        let blades = blades(&surface);
        let collapses = simplify(&blades, until);
        prop_assert_eq!(leaves - collapses.len(), until.min(leaves));
        let forest = Forest::new(leaves, &collapses);
        let mut resolution = Resolution::finest(&forest);
        prop_assert_eq!(&surface_at(&surface, &forest, &resolution), &surface, "level 0 is the original");
        let mut last = leaves + 1;
        for index in 0..=collapses.len() {
            resolution.set_uniform(&forest, leaves - index);
            prop_assert!(resolution.shown() < last, "fewer leaves at every step");
            last = resolution.shown();
        }
        let coarse = surface_at(&surface, &forest, &resolution);
        prop_assert_eq!(coarse.mesh.polygon_count(), forest.clusters());
        prop_assert!(checked(&coarse).is_ok());
        // No corner stands where none stood.
        for p in &coarse.mesh.positions {
            prop_assert!(surface.mesh.positions.contains(p));
        }
        // Every corner comes from an original of the same cluster, and every normal lies on the side that the leaf faces.
        for (i, collapse) in collapses.iter().enumerate() {
            let cluster = forest.changed_groups()[i];
            let places = made(&blades, collapse);
            let face = (places[2] - places[0]).cross(places[3] - places[1]);
            for c in collapse.corners {
                prop_assert!(forest.members(cluster).contains(&c.leaf));
                let normal = blades[c.leaf as usize].normals[usize::from(c.corner)];
                let side = if c.turned { -1.0 } else { 1.0 };
                prop_assert!(side * normal.dot(face) >= 0.0);
            }
        }
        prop_assert_eq!(simplify(&blades, until), collapses, "the same again");
    }
}

#[test]
fn triangles_are_leaves_with_a_corner_twice() {
    let mut surface = synthetic(40, Seed(1));
    let quads = std::mem::take(&mut surface.mesh.quads);
    surface.mesh.triangles = quads.iter().take(10).map(|q| [q[0], q[1], q[2]]).collect();
    surface.mesh.quads = quads[10..].to_vec();
    assert_eq!(foliage::corners(&surface.mesh, 3), [12, 13, 14, 14]);
    let forest = Forest::new(40, &simplify(&blades(&surface), 4));
    let mut resolution = Resolution::finest(&forest);
    assert_eq!(surface_at(&surface, &forest, &resolution), surface);
    resolution.set_uniform(&forest, 20);
    assert_eq!(surface_at(&surface, &forest, &resolution).mesh.polygon_count(), 20);
}
