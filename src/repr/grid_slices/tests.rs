//! Tests of [`super`].

use std::sync::LazyLock;

use glam::Vec3;
use proptest::prelude::*;

use super::foliage::{Depths, edges};
use super::plan::Plan;
use super::tables::DistanceRow;
use super::*;
use crate::Seed;
use crate::geom::{PolyMesh, Surface};
use crate::metrics;
use crate::model::Material;
use crate::model::grown::dress_preset;
use crate::model::reference::{Asked, ReferenceTree};
use crate::plant::presets::preset;
use crate::plant::{DeriveParams, draw};
use crate::raster::ALPHA_CUTOFF;
use crate::raster::View;
use crate::repr::Capture;
use crate::repr::{Settings, SoftwareCapture, Stats, TreeSource};

static CAPTURE: LazyLock<SoftwareCapture> = LazyLock::new(SoftwareCapture::default);

/// Square leaves of 0.2 m, one at each place, all facing the same way, none of the axes'.
fn leaves(places: &[Vec3]) -> Part {
    let normal = Vec3::new(0.6, 0.48, 0.64);
    let u = 0.1 * Vec3::new(0.8, -0.36, -0.48);
    let v = normal.cross(u);
    let positions: Vec<Vec3> = places.iter().flat_map(|p| [p - u - v, p + u - v, p + u + v, p - u + v]).collect();
    let quads = (0..places.len() as u32).map(|i| [0, 1, 2, 3].map(|c| 4 * i + c)).collect();
    let mesh = PolyMesh { positions, triangles: vec![], quads };
    let material = Material { name: "leaf".to_owned(), factor: [0.2, 0.6, 0.1, 1.0], two_sided: true, ..Material::default() };
    Part {
        name: "leaf".to_owned(),
        surface: Surface { normals: vec![normal; 4 * places.len()], mesh, ..Surface::default() },
        material,
        crown_center: None,
    }
}

/// A post of 0.2 × `height` × 0.2 m on the origin.
fn post(height: f32) -> Part {
    let mesh = PolyMesh {
        positions: [(-0.1, 0.1), (0.1, 0.1), (0.1, -0.1), (-0.1, -0.1)]
            .into_iter()
            .flat_map(|(x, z)| [Vec3::new(x, 0.0, z), Vec3::new(x, height, z)])
            .collect(),
        triangles: vec![],
        quads: (0..4u32).map(|i| [2 * i, (2 * i + 2) % 8, (2 * i + 3) % 8, 2 * i + 1]).collect(),
    };
    let material = Material { name: "bark".to_owned(), factor: [0.4, 0.2, 0.1, 1.0], ..Material::default() };
    Part { name: "wood".to_owned(), surface: Surface { mesh, ..Surface::default() }, material, crown_center: None }
}

fn source(parts: Vec<Part>) -> TreeSource {
    TreeSource::reference(ReferenceTree::new("test".to_owned(), parts, &Asked::default()).unwrap())
}

/// A post of 3 m with a ball of leaves of radius 1 m on it.
fn ball() -> TreeSource {
    let mut draws = Seed(5).keyed("ball", 0);
    let mut places = vec![];
    while places.len() < 600 {
        let p = Vec3::from([0; 3].map(|_| draws.signed() as f32));
        if p.length() <= 1.0 {
            places.push(0.9 * p + 2.5 * Vec3::Y);
        }
    }
    source(vec![post(3.0), leaves(&places)])
}

fn settings(texts: &[&str]) -> Settings {
    Settings::parse([&["size_px=64", "top_slices=0"], texts].concat()).unwrap()
}

fn job<'a>(source: &'a TreeSource, settings: &'a Settings) -> Job<'a> {
    Job { source, scope: Scope::Tree, settings, seed: Seed(1), capture: &*CAPTURE }
}

fn built(source: &TreeSource, texts: &[&str]) -> BuiltTree {
    let settings = settings(texts);
    let built = GridSlices.build(&job(source, &settings)).unwrap();
    built.check().unwrap();
    built
}

#[test]
fn seven_and_seven_slices_store_fourteen_pictures_and_a_level_draws_the_first_of_them() {
    let tree = built(&ball(), &[]);
    let counts: Vec<usize> = tree.levels.iter().map(|level| tree.parts_at(level.distance).count()).collect();
    assert_eq!(counts, [14, 10, 6, 2]);
    for (level, count) in tree.levels.iter().zip(counts) {
        // The early exit: behind the first that is not seen, none is.
        let seen: Vec<bool> = tree.parts.iter().map(|part| part.seen.share_at(level.distance) > 0.0).collect();
        assert!(seen.iter().position(|s| !s).unwrap_or(14) == count, "{}: {seen:?}", level.name);
        assert_eq!(Stats::at(&tree, level.distance).triangles, 2 * count);
    }
    // Colours and normals.
    assert_eq!(Stats::of_all(&tree).textures, 28);
    let star = built(&ball(), &["arrangement=star"]);
    let counts: Vec<usize> = star.levels.iter().map(|level| star.parts_at(level.distance).count()).collect();
    assert_eq!(counts, [14, 10, 6, 2]);
}

#[test]
fn eq_1_spaces_the_slices_and_their_slabs_leave_no_gap() {
    let (source, settings) = (ball(), settings(&[]));
    let plan = Plan::of(&job(&source, &settings), &settings.read().unwrap()).unwrap();
    let radius = plan.bounds.max.x.max(-plan.bounds.min.x).max(plan.bounds.max.z).max(-plan.bounds.min.z);
    let mut row: Vec<&Slice> = plan.slices.iter().filter(|slice| slice.card.name.starts_with("slice x")).collect();
    row.sort_by(|a, b| a.card.plane.total_cmp(&b.card.plane));
    assert_eq!(row.len(), 7);
    for pair in row.windows(2) {
        assert!((pair[1].card.plane - pair[0].card.plane - 2.0 * radius / 7.0).abs() < 1e-4);
        assert!(pair[0].card.window.max.z >= pair[1].card.window.min.z - 1e-4);
    }
    let base = row[3].card.window;
    assert!((base.min.z + radius / 4.0).abs() < 1e-4 && (base.max.z - radius / 4.0).abs() < 1e-4);
    assert!(row[0].card.window.min.z <= -radius && row[6].card.window.max.z >= radius);
    assert_eq!(plan.slices.iter().filter(|slice| slice.has_wood).count(), 2);
}

/// Whether a picture shows more red than green anywhere.
fn shows_wood(part: &BuiltPart) -> bool {
    let texture = part.part.material.texture.as_ref().unwrap();
    texture.pixels().any(|p| f32::from(p.0[3]) > 255.0 * ALPHA_CUTOFF && p.0[0] > p.0[1])
}

#[test]
fn only_the_base_pair_shows_wood() {
    let tree = built(&ball(), &[]);
    let with_wood: Vec<&str> = tree.parts.iter().filter(|p| shows_wood(p)).map(|p| p.part.name.as_str()).collect();
    assert_eq!(with_wood, ["slice z 0", "slice x 0"]);
    let settings = settings(&[]);
    let (source, scope) = (ball(), Scope::Foliage);
    let foliage = GridSlices.build(&Job { scope, ..job(&source, &settings) }).unwrap();
    assert!(!foliage.parts.iter().any(shows_wood));
}

#[test]
fn slices_fade_as_fig_17_has_it() {
    let tree = built(&ball(), &["beyond=vanish"]);
    let share =
        |name: &str, units: f32| tree.parts.iter().find(|p| p.part.name == name).unwrap().seen.share_at(units * HEIGHTS_PER_UNIT);
    for (name, far) in [("slice z 0", 200.0), ("slice x 1", 44.0), ("slice z -2", 32.0), ("slice x 3", 26.0)] {
        assert_eq!((share(name, far - 10.01), share(name, far)), (1.0, 0.0), "{name}");
        assert!((share(name, far - 4.0) - 0.4).abs() < 1e-3, "{name}");
    }
    let stays = built(&ball(), &[]);
    assert_eq!((stays.parts_at(1e6).count(), tree.parts_at(1e6).count()), (2, 0));
}

/// Their tree of table 2 as our turtle draws it: where the length of a unit is from.
#[test]
fn a_unit_is_what_their_simple_tree_says() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/plant/truelsen/simple_tree.xml");
    let grammar = crate::plant::Grammar::parse_xml(&std::fs::read_to_string(path).unwrap()).unwrap();
    let chain = grammar.derive(4.0, &DeriveParams::default(), Seed(0), &mut |_| {}).unwrap();
    let skeleton = draw(&chain, &grammar, grammar.turtle(), Seed(0), 4.0).unwrap();
    let clothing =
        crate::model::grown::Clothing::painted(crate::plant::mesh::BarkKind::Smooth, crate::plant::mesh::LeafKind::Oval, Seed(0));
    let (wood, leaf) = Default::default();
    let height = crate::model::grown::GrownTree::new(&skeleton, &clothing, &wood, &leaf, Seed(0)).unwrap().height_m();
    let units_high = f64::from(crate::repr::REFERENCE_FOCAL_PX * 15f32.to_radians().tan() / 384.0 / HEIGHTS_PER_UNIT);
    assert!((height - units_high).abs() < 0.05, "{height} {units_high}");
}

#[test]
fn baked_noise_takes_as_much_as_the_cutoff_rises_and_changes_nothing_before() {
    let there = |tree: &BuiltTree, cutoff: f32| -> usize {
        let pictures = tree.parts[2..].iter().map(|p| p.part.material.texture.clone().unwrap());
        pictures.map(|t| t.pixels().filter(|p| f32::from(p.0[3]) >= 255.0 * cutoff).count()).sum()
    };
    let source = ball();
    let (noisy, plain) = (built(&source, &["dissolve=noise"]), built(&source, &["dissolve=hashed"]));
    let all = there(&plain, 0.5) as f32;
    assert_eq!(there(&noisy, 0.5), there(&plain, 0.5));
    for share in [0.25, 0.5, 0.75] {
        let left = there(&noisy, 1.0 - 0.5 * share) as f32 / all;
        assert!((left - share).abs() < 0.03, "{share}: {left}");
    }
    assert!(noisy.parts[2..].iter().all(|p| p.seen.fade == crate::repr::Fade::Alpha));
}

#[test]
fn levels_that_would_end_in_the_wrong_order_are_refused_by_name() {
    let (source, settings) = (ball(), settings(&["level_3_far=50"]));
    let error = GridSlices.build(&job(&source, &settings)).unwrap_err().to_string();
    assert!(error.contains("--level-3-far") && error.contains("44"), "{error}");
}

#[test]
fn a_bare_tree_shows_its_base_pair_and_says_so_and_one_leaf_is_enough() {
    let bare = built(&source(vec![post(2.0)]), &[]);
    assert_eq!((bare.parts.len(), bare.warnings.len()), (2, 1));
    for texts in [&["placement=adaptive", "top_slices=2"][..], &["arrangement=star"], &[]] {
        let one = built(&source(vec![leaves(&[Vec3::Y])]), texts);
        assert!(!one.parts.is_empty(), "{texts:?}");
    }
}

#[test]
fn a_level_slice_is_seen_from_above_alone() {
    let tree = built(&ball(), &["top_slices=1"]);
    let top = tree.parts.iter().find(|p| p.part.name == "slice top 0").unwrap();
    let share = |elevation_deg: f32| {
        let (s, c) = elevation_deg.to_radians().sin_cos();
        top.seen.share_toward(Vec3::new(c, s, 0.0))
    };
    assert_eq!((share(0.0), share(39.0), share(61.0), share(90.0), share(-90.0)), (0.0, 0.0, 1.0, 1.0, 1.0));
    let upright = tree.parts[0].seen;
    assert_eq!((upright.share_toward(Vec3::X), upright.share_toward(Vec3::Y), upright.share_toward(-Vec3::Y)), (1.0, 0.0, 1.0));
    let height = top.part.surface.mesh.positions[0].y;
    assert!((height - 2.5).abs() < 0.1, "{height}");
}

/// A birch of that age, 8 at most.
fn birch(age: f64) -> TreeSource {
    let preset = preset("birch").unwrap();
    let grammar = preset.grammar().unwrap();
    let chain = grammar.derive(age, &DeriveParams::default(), Seed(3), &mut |_| {}).unwrap();
    let skeleton = draw(&chain, &grammar, grammar.turtle(), Seed(3), age).unwrap();
    source(dress_preset(preset, &skeleton, Seed(3)).unwrap().parts)
}

#[test]
fn a_growing_tree_comes_to_be_what_a_fresh_build_of_it_is_two_slices_at_a_time() {
    let settings = settings(&["size_px=64"]);
    let (young, old) = (birch(6.0), birch(8.0));
    let mut tree = GridSlices.build(&job(&young, &settings)).unwrap();
    let fresh = GridSlices.build(&job(&old, &settings)).unwrap();
    assert_ne!(tree.parts[0].part, fresh.parts[0].part);
    // Begins in the middle: turns go on over many ages.
    for turn in 5..12 {
        let before = tree.clone();
        let dirty = GridSlices.update(&mut tree, &job(&old, &settings), turn).unwrap();
        tree.check().unwrap();
        if let Dirty::Parts(from, to) = dirty {
            assert!(to - from <= 2);
            let same = |i: &usize| tree.parts[*i].part == before.parts[*i].part;
            assert!((0..tree.parts.len()).filter(|i| !(from..to).contains(i)).all(|i| same(&i)));
        }
    }
    assert_eq!(tree.parts.len(), fresh.parts.len());
    for (is, should) in tree.parts.iter().zip(&fresh.parts) {
        assert!(is.part == should.part && is.seen == should.seen && is.drawn == should.drawn, "{}", should.part.name);
    }
    assert_eq!((tree.bounds, &tree.levels), (fresh.bounds, &fresh.levels));
}

#[test]
fn slices_that_come_and_go_in_an_update_find_their_places() {
    let settings = settings(&["slices_per_update=3"]);
    let (full, bare) = (ball(), source(vec![post(3.0)]));
    for (from, to) in [(&full, &bare), (&bare, &full)] {
        let mut tree = GridSlices.build(&job(from, &settings)).unwrap();
        for turn in 0..5 {
            GridSlices.update(&mut tree, &job(to, &settings), turn).unwrap();
        }
        let fresh = GridSlices.build(&job(to, &settings)).unwrap();
        let names = |tree: &BuiltTree| tree.parts.iter().map(|p| p.part.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&tree), names(&fresh));
        assert!(tree.parts.iter().zip(&fresh.parts).all(|(a, b)| a.part == b.part));
    }
}

#[test]
fn tables_have_the_shape_of_theirs() {
    let (source, settings) = (ball(), settings(&[]));
    let tree = GridSlices.build(&job(&source, &settings)).unwrap();
    let rows = tables::against_distance(&tree, &tables::TABLE_2_UNITS);
    for DistanceRow { units, distance, stats, lookups } in &rows {
        println!(
            "{units} units, {distance:.1} heights: {} triangles, {} calls, {lookups:.0} look-ups",
            stats.triangles, stats.draw_calls
        );
    }
    // All fourteen are there up to 16 units, fading at 19, and cost ever less as they get smaller.
    assert!(rows.iter().all(|row| row.stats.triangles == 28));
    assert!(rows.windows(2).all(|pair| pair[1].lookups < pair[0].lookups));
    let sizes = tables::against_size(&job(&source, &settings), &[128, 64]).unwrap();
    for (size_px, stats) in &sizes {
        println!("{size_px} px: {} textures, {} bytes", stats.textures, stats.texture_bytes);
    }
    let [(_, large), (_, small)] = &sizes[..] else { panic!("two rows") };
    let ratio = large.texture_bytes as f64 / small.texture_bytes as f64;
    assert!((3.8..4.2).contains(&ratio), "{ratio}");
}

proptest! {
    #[test]
    fn settled_planes_are_nearer_to_the_foliage_and_stay_in_order(
        depths in prop::collection::vec(-1.0f32..1.0, 1..60), side in 1usize..4,
    ) {
        let places: Vec<Vec3> = depths.iter().map(|d| Vec3::new(0.0, 1.0, *d)).collect();
        let part = leaves(&places);
        let foliage = Depths::of(&[&part], Vec3::Z);
        let uniform: Vec<f32> = (0..=2 * side).map(|i| (i as f32 - side as f32) / (side as f32 + 0.5)).collect();
        let mut planes = uniform.clone();
        foliage.settle(&mut planes, side);
        let mesh = &part.surface.mesh;
        let middles: Vec<f32> = mesh.triangulated().map(|t| t.map(|v| mesh.positions[v as usize].z).iter().sum::<f32>() / 3.0).collect();
        let error = |planes: &[f32]| -> f32 {
            middles.iter().map(|m| planes.iter().map(|p| (m - p).powi(2)).fold(f32::MAX, f32::min)).sum()
        };
        prop_assert!(error(&planes) <= error(&uniform) + 1e-4);
        prop_assert!(planes.is_sorted() && planes[side] == 0.0);
        prop_assert!(edges(&planes, -2.0, 2.0).windows(2).all(|pair| pair[0][1] == pair[1][0]));
    }
}

/// How alike a tree's stand-in and the tree are, without light, over `views` (azimuth and elevation, °): silhouettes' intersection over union,
/// and mean FLIP over grey.
fn likeness(source: &TreeSource, tree: &BuiltTree, views: &[(f32, f32)], side_px: u32) -> (f64, f64) {
    let slices: Vec<&Part> = tree.parts.iter().filter(|p| p.seen.share_toward(Vec3::Z) > 0.0).map(|p| &p.part).collect();
    let views: Vec<View> = views
        .iter()
        .map(|(az, el)| View::around(source.points(Scope::Tree), az.to_radians(), el.to_radians(), side_px, side_px))
        .collect();
    let (is, should) = (CAPTURE.take(&slices, &views).unwrap(), CAPTURE.take(&source.parts(Scope::Tree), &views).unwrap());
    let pairs = is.iter().zip(&should).map(|(a, b)| {
        let iou = metrics::silhouette_iou(&metrics::silhouette(&a.color), &metrics::silhouette(&b.color)).unwrap();
        let grey = |picture: &crate::raster::Capture| metrics::over(&picture.color, [128; 3]);
        (iou, metrics::flip(&grey(b), &grey(a)).unwrap().mean)
    });
    let (iou, flip) = pairs.fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
    (iou / views.len() as f64, flip / views.len() as f64)
}

#[test]
fn slices_placed_where_the_foliage_is_come_nearer_to_the_tree() {
    let source = birch(9.0);
    let views: Vec<(f32, f32)> = (0..4).flat_map(|i| [(10.0 + 20.0 * i as f32, 0.0), (20.0 * i as f32, 30.0)]).collect();
    let of = |texts: &[&str]| {
        let tree = built(&source, texts);
        let (iou, flip) = likeness(&source, &tree, &views, 120);
        (iou, flip, Stats::of_all(&tree).texture_bytes)
    };
    let (uniform, adaptive) = (of(&["size_px=128"]), of(&["size_px=128", "placement=adaptive"]));
    println!("uniform {uniform:?}, adaptive {adaptive:?}: silhouette IoU, mean FLIP, bytes");
    assert!(adaptive.0 > uniform.0 && adaptive.1 < uniform.1 && adaptive.2 < uniform.2);
}
