use std::sync::Arc;

use glam::Vec3;

use crate::geom::{Surface, Topology};
use crate::model::reference::{Asked, ReferenceTree};
use crate::model::{Material, Part, TrunkShape};
use crate::repr::{BuiltTree, Drawn, Order, Scope, Settings, SoftwareCapture, Stats, TreeSource, build};
use crate::{Error, Result, Seed};

/// Balls of small leaves: middle and radius, metres.
fn leaves(balls: &[([f32; 3], f32)]) -> Part {
    let mut surface = Surface::default();
    for (number, (middle, radius)) in balls.iter().enumerate() {
        for k in 0..700u64 {
            let mut draws = Seed(number as u64 + 1).keyed("leaf", k);
            let mut at = || Vec3::from([0; 3].map(|_| 2.0 * draws.unit() as f32 - 1.0));
            let (p, normal) = (at(), at().normalize_or(Vec3::Z));
            let p = Vec3::from(*middle) + radius * if p.length() > 1.0 { 0.95 * p.normalize() } else { p };
            let (u, v) = normal.any_orthonormal_pair();
            let first = surface.mesh.positions.len() as u32;
            surface.mesh.positions.extend([-u - v, u - v, u + v, v - u].map(|d| p + 0.08 * radius * d));
            surface.normals.extend([normal; 4]);
            surface.mesh.quads.push([0, 1, 2, 3].map(|k| first + k));
        }
    }
    let green = Material { name: "leaves".to_owned(), factor: [0.1, 0.4, 0.05, 1.0], two_sided: true, ..Material::default() };
    Part { name: "leaves".to_owned(), surface, material: green, crown_center: None }
}

fn trunk(height_m: f32) -> Part {
    TrunkShape { neck: Vec3::Y * height_m, tip: Vec3::Y * (height_m + 0.5), width_m: 0.25, bark: [90, 70, 50] }.build().part()
}

fn tree(parts: Vec<Part>) -> TreeSource {
    TreeSource::reference(ReferenceTree::new("tree".to_owned(), parts, &Asked::default()).unwrap())
}

fn board(source: &TreeSource, settings: &[&str]) -> Result<BuiltTree> {
    let settings = Settings::parse(["picture_px=160", "texture_size=64"].iter().chain(settings).copied())?;
    build(&Order { method: "sphere-board", trunk: None, settings: &settings, seed: Seed(1) }, source, &SoftwareCapture::new())
}

fn crowns(built: &BuiltTree, level: usize) -> Vec<&Part> {
    let parts = built.parts_at(built.levels[level].distance).map(|part| &part.part);
    parts.filter(|part| part.name.contains("crown")).collect()
}

#[test]
fn a_ball_becomes_a_ball_at_every_level_and_a_card_at_last() {
    let built = board(&tree(vec![leaves(&[([0.0, 3.0, 0.0], 1.0)]), trunk(2.0)]), &[]).unwrap();
    assert_eq!(built.levels.len(), 4);
    let polygons: Vec<usize> = (0..2).map(|level| crowns(&built, level)[0].surface.mesh.polygon_count()).collect();
    for (found, wanted) in polygons.iter().zip([2_200, 600]) {
        assert!((0.7..1.3).contains(&(*found as f64 / f64::from(wanted))), "{polygons:?}");
    }
    for level in 0..2 {
        let [crown] = crowns(&built, level)[..] else { panic!("one crown at level {level}") };
        let mesh = crown.surface.welded();
        assert!(Topology::of(&mesh).is_sphere());
        let volume = mesh.signed_volume() / (4.0 / 3.0 * std::f64::consts::PI);
        assert!((0.6..1.2).contains(&volume), "{volume} at level {level}");
        assert!((crown.crown_center.unwrap_or(Vec3::Y * 3.0) - Vec3::Y * 3.0).length() < 0.2);
    }
    // Growth is for the near ones; the far one and the cards have none.
    assert!(
        crowns(&built, 0)[0].crown_center.is_some()
            && built.parts_at(built.levels[2].distance).all(|part| part.part.crown_center.is_none())
    );
    let last: Vec<_> = built.parts_at(built.levels[3].distance).collect();
    assert!(last.len() == 2 && matches!(last[0].drawn, Drawn::Turned { upright: true, .. }));
    assert_eq!(Stats::at(&built, built.levels[3].distance).triangles, 4);
}

#[test]
fn clusters_that_stand_apart_become_crowns_of_their_own_where_they_stand() {
    // Two side by side as seen from the front, one of them two behind each other.
    let middles = [[-1.6, 3.0, 0.0], [1.6, 3.4, 1.5], [1.6, 3.4, -1.5]];
    let source = tree(vec![leaves(&middles.map(|middle| (middle, 0.8))), trunk(3.0)]);
    let built = board(&source, &[]).unwrap();
    let found = crowns(&built, 0);
    assert_eq!(found.len(), 3);
    for middle in middles {
        let near = found.iter().any(|crown| (crown.crown_center.unwrap() - Vec3::from(middle)).length() < 0.35);
        assert!(near, "{middle:?} among {:?}", found.iter().map(|crown| crown.crown_center).collect::<Vec<_>>());
    }
    // One photograph alone sees two, both over the foot of the trunk.
    let flat =
        crowns(&board(&source, &["depth=grown"]).unwrap(), 0).iter().map(|crown| crown.crown_center.unwrap()).collect::<Vec<_>>();
    assert!(flat.len() == 2 && flat.iter().all(|center| center.z.abs() < 0.1), "{flat:?}");
}

#[test]
fn every_side_shows_its_own_picture() {
    let source = tree(two_sided_ball());
    let share_of_red = |built: &BuiltTree| {
        let texture: Arc<_> = crowns(built, 0)[0].material.texture.clone().unwrap();
        texture.pixels().filter(|p| p.0[0] > p.0[1]).count() as f64 / texture.pixels().len() as f64
    };
    let (one, all) = (board(&source, &["above=grown"]).unwrap(), board(&source, &["azimuths=4", "above=grown"]).unwrap());
    // Some of the back shows through gaps of the front.
    assert!(share_of_red(&one) < 0.15 && (0.3..0.7).contains(&share_of_red(&all)), "{} {}", share_of_red(&one), share_of_red(&all));
}

/// Green in front, red behind.
fn two_sided_ball() -> Vec<Part> {
    let mut parts = vec![leaves(&[([0.0, 3.0, 0.0], 1.0)]), leaves(&[([0.0, 3.0, 0.0], 1.0)])];
    for (part, side) in parts.iter_mut().zip([1.0f32, -1.0]) {
        let mesh = &mut part.surface.mesh;
        let middle = |q: &[u32; 4]| q.iter().map(|&v| mesh.positions[v as usize].z).sum::<f32>();
        mesh.quads = mesh.quads.iter().copied().filter(|q| side * middle(q) > 0.0).collect();
    }
    parts[1].material.factor = [0.5, 0.02, 0.02, 1.0];
    parts
}

#[test]
fn from_afar_every_side_sees_one_closed_surface_with_its_own_picture() {
    let built = board(&tree(two_sided_ball()), &[]).unwrap();
    let far: Vec<_> = built.parts_at(built.levels[2].distance).collect();
    assert_eq!(far.len(), 3 * 4 + 1);
    for part in &far {
        assert!(Topology::of(&part.part.surface.welded()).is_sphere(), "{}", part.part.name);
    }
    let toward =
        |azimuth: f32, elevation: f32| Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
    for step in 0..2000 {
        let (azimuth, elevation) = (0.37 * step as f32, (step as f32 / 1000.0 - 1.0).asin());
        let shares: Vec<f32> = far.iter().map(|part| part.seen.share_toward(toward(azimuth, elevation))).collect();
        let whole = shares.iter().filter(|share| **share > 0.999).count();
        assert!(whole >= 1 && shares.iter().filter(|share| **share > 0.0).count() <= 5, "{azimuth} {elevation}: {shares:?}");
    }
    let red_from = |azimuth: f32| {
        let seen = far.iter().find(|part| part.seen.share_toward(toward(azimuth, 0.0)) > 0.999).unwrap();
        let texture = seen.part.material.texture.clone().unwrap();
        let there = || texture.pixels().filter(|p| p.0[3] >= 128);
        there().filter(|p| p.0[0] > p.0[1]).count() as f64 / there().count() as f64
    };
    let [front, back] = [red_from(0.0), red_from(std::f32::consts::PI)];
    // Some of the other side shows through gaps.
    assert!(front < 0.3 && back > 0.7, "{front} {back}");
    // What only the front's photograph tells of has one texture, as the paper has it.
    let grown = board(&tree(two_sided_ball()), &["above=grown"]).unwrap();
    assert_eq!(crowns(&grown, 2).len(), 1);
}

#[test]
fn a_model_is_itself_in_front_and_its_coarser_self_behind() {
    let source = tree(vec![leaves(&[([0.0, 3.0, 0.0], 1.0)]), trunk(2.0)]);
    let built = board(&source, &[]).unwrap();
    let crown = crowns(&built, 0)[0].clone();
    let texture = (*crown.material.texture.clone().unwrap()).clone();
    let model = crate::model::TreeModel {
        crowns: vec![crate::model::ModelCrown { surface: crown.surface.clone(), texture, center: crown.crown_center.unwrap() }],
        trunk: None,
        about: serde_json::from_value(serde_json::json!({
            "format": 2, "program": "test", "seed": 1, "sources": [], "height_m": 4.0, "height_guessed": false, "parameters": {},
            "feature_points": [], "exemplar_window_px": null, "gap_fraction": 0.0,
            "growth": {"profile": "broadleaf", "min_m": 0.01, "max_m": 0.1, "spacing_m": 0.1},
        }))
        .unwrap(),
    };
    let source = TreeSource::model("model".to_owned(), model);
    let built = board(&source, &[]).unwrap();
    assert_eq!(crowns(&built, 0)[0].surface, source.parts(Scope::Foliage)[0].surface);
    assert!((400..800).contains(&crowns(&built, 1)[0].surface.mesh.polygon_count()));
}

#[test]
fn bare_trees_are_refused_and_single_leaves_do_not_panic() {
    assert!(matches!(board(&tree(vec![trunk(2.0)]), &[]), Err(Error::NotApplicable { .. })));
    let mut one = leaves(&[([0.0, 3.0, 0.0], 1.0)]);
    for count in [1, 2, 3] {
        one.surface.mesh.quads.truncate(count);
        // Too little for a crown is said to be so.
        assert!(!matches!(board(&tree(vec![one.clone()]), &[]), Err(Error::Internal { .. })), "{count}");
    }
}
