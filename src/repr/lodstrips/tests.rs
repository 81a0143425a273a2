//! Every level of a small tree is walked.

use std::collections::BTreeMap;
use std::f32::consts::{FRAC_PI_2, TAU};

use glam::Vec3;
use proptest::prelude::*;

use super::nearest::holds;
use super::wood::{Joint, Wood};
use super::*;
use crate::Seed;
use crate::geom::{PolyMesh, Surface};
use crate::model::grown::preset_skeleton;
use crate::model::reference::Asked;
use crate::plant::mesh::{WoodParams, wood as wood_mesh};
use crate::plant::presets::preset;
use crate::repr::{Order, Settings, SoftwareCapture, Stats, TreeSource, build};

/// The wood of a young acacia: more than a dozen branches on branches.
fn young() -> Surface {
    let skeleton = preset_skeleton(preset("acacia").unwrap(), Some(6.0), Seed(1)).unwrap();
    let surface = wood_mesh::wood(&skeleton, &WoodParams::default(), Seed(1));
    assert!((500..20_000).contains(&surface.mesh.polygon_count()), "{}", surface.mesh.polygon_count());
    surface
}

fn normal(surface: &Surface, t: [u32; 3]) -> Vec3 {
    let [a, b, c] = t.map(|v| surface.mesh.positions[v as usize]);
    (b - a).cross(c - a)
}

/// A triangle with its smallest corner first.
fn turned(t: [u32; 3]) -> [u32; 3] {
    let first = (0..3).min_by_key(|&k| t[k]).unwrap();
    [t[first], t[(first + 1) % 3], t[(first + 2) % 3]]
}

#[test]
fn strips_hold_at_every_level() {
    let model = Lodstrips::of(&young());
    let count = model.surface.mesh.positions.len();
    let mut extraction = model.extraction();
    // The triangles by themselves, each followed through its collapses.
    let mut own = model.surface.mesh.triangles.clone();
    let position = |v: u32| model.surface.mesh.positions[v as usize];
    let solid =
        |t: &[u32; 3]| position(t[0]) != position(t[1]) && position(t[1]) != position(t[2]) && position(t[2]) != position(t[0]);
    for (number, level) in model.levels.iter().enumerate() {
        extraction.go_to(number);
        for t in own.iter_mut().filter(|t| solid(t)) {
            let before = normal(&model.surface, *t);
            while let Some(k) = (0..3).find(|&k| t[k] >= level.vertices) {
                t[k] = model.targets[t[k] as usize];
            }
            assert!(!solid(t) || normal(&model.surface, *t).dot(before) > 0.0, "a triangle turns over at level {number}");
        }
        assert!(extraction.strips().iter().flatten().all(|v| *v < level.vertices), "level {number} uses vertices that are gone");
        let mut expected: Vec<[u32; 3]> = own.iter().filter(|t| solid(t)).map(|t| turned(*t)).collect();
        assert_eq!(expected.len(), level.triangles as usize);
        // Comparing lists takes long: at every tenth level.
        if number % 10 == 0 || number + 1 == model.levels.len() {
            let mut got: Vec<[u32; 3]> = extraction.triangles().into_iter().map(turned).collect();
            got.sort_unstable();
            expected.sort_unstable();
            assert_eq!(got, expected, "level {number}");
        }
    }
    let last = model.levels.last().unwrap();
    assert!(last.triangles < model.levels[0].triangles / 20, "{last:?} of {:?}", model.levels[0]);
    assert!(model.levels.windows(2).all(|pair| pair[1].triangles < pair[0].triangles && pair[1].error_m >= pair[0].error_m));
    // And back again.
    extraction.go_to(0);
    assert_eq!(extraction.strips(), model.extraction().strips());
    assert!(count > last.vertices as usize);
}

#[test]
fn no_branch_comes_loose_at_any_level() {
    let surface = young();
    let model = Lodstrips::of(&surface);
    // Pieces and joints of the mesh, in the model's numbers: a place is known by where it is.
    let (own, mut wood) = (Wood::of(&surface), Wood::of(&model.surface));
    let key = |p: Vec3| p.to_array().map(f32::to_bits);
    let known: BTreeMap<[u32; 3], usize> = wood.places.iter().map(|p| key(*p)).zip(0..).collect();
    let there = |place: u32| known[&key(own.places[place as usize])];
    let piece = |piece: u32| wood.piece_of[there(own.corners(own.pieces[piece as usize][0])[0])];
    let renamed = |joint: &Joint| Joint { parent: piece(joint.parent), place: there(joint.place) as u32, ..*joint };
    let mut joints = vec![None; wood.pieces.len()];
    own.joints.iter().zip(0..).for_each(|(joint, of)| joints[piece(of) as usize] = joint.as_ref().map(renamed));
    wood.joints = joints;
    let standing = wood.joints.iter().flatten().count();
    assert!(
        wood.pieces.len() > 12 && standing + 1 == wood.pieces.len(),
        "{standing} of {} pieces stand in another",
        wood.pieces.len()
    );
    let mut broken = BTreeMap::new();
    for (number, level) in model.levels.iter().enumerate() {
        for t in 0..wood.triangles.len() {
            while let Some(k) = (0..3).find(|&k| wood.triangles[t][k] >= level.vertices) {
                let v = wood.triangles[t][k];
                wood.triangles[t][k] = model.targets[v as usize];
            }
            let [a, b, c] = wood.corners(t as u32);
            wood.alive[t] = a != b && b != c && c != a;
        }
        if number % 7 != 0 && number + 1 != model.levels.len() {
            continue;
        }
        for (piece, joint) in wood.joints.iter().enumerate() {
            let Some(joint) = joint else { continue };
            if wood.triangles_of(piece as u32).next().is_none() {
                continue;
            }
            let foot_stays = wood.triangles_of(piece as u32).any(|t| wood.corners(t).contains(&joint.place));
            if !foot_stays || !holds(wood.triangles_of(joint.parent).map(|t| wood.points(t)), joint.at, joint.reach_m) {
                broken.entry(piece).or_insert(number);
            }
        }
    }
    assert!(broken.is_empty(), "{} pieces come loose: {broken:?}", broken.len());
}

proptest! {
    #[test]
    fn packing_keeps_every_triangle(strip in prop::collection::vec(0u32..4, 0..40)) {
        let sorted = |strip: &[u32]| {
            let mut all: Vec<[u32; 3]> = triangles_of(strip).map(turned).collect();
            all.sort_unstable();
            all
        };
        let short = packed(&strip);
        prop_assert_eq!(sorted(&short), sorted(&strip));
        prop_assert!(short.len() <= strip.len());
    }
}

#[test]
fn meshes_that_are_no_trees_do_not_fail() {
    let triangle = |positions: Vec<Vec3>, triangles: Vec<[u32; 3]>| Surface {
        normals: vec![Vec3::Z; positions.len()],
        mesh: PolyMesh { positions, triangles, quads: vec![] },
        ..Surface::default()
    };
    let corners = || vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    for (surface, least) in [
        (Surface::default(), 0),
        (triangle(corners(), vec![[0, 1, 2]]), 1),
        (triangle(vec![Vec3::ONE; 3], vec![[0, 1, 2]]), 0),
        // An edge of three triangles.
        (triangle(corners(), vec![[0, 1, 2], [0, 1, 3], [1, 0, 2]]), 1),
        (triangle(vec![Vec3::ZERO, Vec3::X, Vec3::NAN], vec![[0, 1, 2]]), 1),
    ] {
        let model = Lodstrips::of(&surface);
        let mut extraction = model.extraction();
        extraction.go_to(model.levels.len() - 1);
        assert!(extraction.triangles().len() >= least);
    }
}

#[test]
fn levels_relieve_each_other_and_a_tree_without_wood_is_no_error() {
    let (source, _) = TreeSource::open("acacia", &Asked::default(), Seed(1)).unwrap();
    let settings = Settings::default();
    let order = Order { method: "lodstrips", trunk: None, settings: &settings, seed: Seed(1) };
    let tree = build(&order, &source, &SoftwareCapture::default()).unwrap();
    let stats = Stats::of_levels(&tree);
    let leaves = 2 * 8064;
    let shares: Vec<f32> =
        stats.iter().map(|(_, s)| (s.triangles - leaves) as f32 / (stats[0].1.triangles - leaves) as f32).collect();
    assert!(shares.iter().zip(SHARES).all(|(got, asked)| *got <= asked + 1e-3 && *got > 0.9 * asked), "{shares:?}");
    let TreeSource::Reference(mut bare) = source else { unreachable!("presets are true trees") };
    bare.wood.clear();
    let tree = build(&order, &TreeSource::Reference(bare), &SoftwareCapture::default()).unwrap();
    assert_eq!(tree.warnings[0].code, "no-wood");
}

#[test]
fn beside_plain_simplification() {
    let compared = measure::compare(&young(), Seed(1));
    println!("{compared:#?}");
    assert!(compared.levels[0].iter().all(|of| of.hausdorff_m < 1e-4), "level 0 is the surface itself");
    for [ours, theirs] in &compared.levels[1..] {
        assert!(ours.triangles.abs_diff(theirs.triangles) < ours.triangles / 4 + 8);
        assert!(ours.mean_m <= 2.0 * theirs.mean_m + 1e-4, "{ours:?} is much worse than {theirs:?}");
        assert!(ours.swell_m <= 1.5 * theirs.swell_m + 1e-4, "webs stand off the surface: {ours:?}");
    }
}

#[test]
fn a_bent_twig_grows_no_web() {
    // A quarter of a circle of a metre, a centimetre thick, with three sides.
    let rings = 16u32;
    let corner = |ring: u32, side: u32| {
        let (along, round) = (ring as f32 / rings as f32 * FRAC_PI_2, side as f32 / 3.0 * TAU);
        let out = Vec3::new(along.cos(), along.sin(), 0.0);
        out * (1.0 + 0.005 * round.cos()) + Vec3::Z * (0.005 * round.sin())
    };
    let positions: Vec<Vec3> = (0..=rings).flat_map(|ring| (0..3).map(move |side| corner(ring, side))).collect();
    let belt = |ring: u32| {
        (0..3).flat_map(move |side| {
            let [a, b] = [3 * ring + side, 3 * ring + (side + 1) % 3];
            [[a, b, b + 3], [a, b + 3, a + 3]]
        })
    };
    let end = 3 * rings;
    let triangles: Vec<[u32; 3]> = (0..rings).flat_map(belt).chain([[2, 1, 0], [end, end + 1, end + 2]]).collect();
    let normals = vec![Vec3::Z; positions.len()];
    let model = Lodstrips::of(&Surface { normals, mesh: PolyMesh { positions, triangles, quads: vec![] }, ..Surface::default() });
    let mut extraction = model.extraction();
    let mut area = |level: usize| -> f32 {
        extraction.go_to(level);
        extraction.triangles().into_iter().map(|t| 0.5 * normal(&model.surface, t).length()).sum()
    };
    let whole = area(0);
    for level in (0..model.levels.len()).take_while(|level| 4 * model.levels[*level].triangles >= model.levels[0].triangles) {
        let left = area(level);
        assert!(left < 1.3 * whole, "{left} m² of {whole} m² with {} triangles", model.levels[level].triangles);
    }
}
