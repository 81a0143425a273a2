//! Grown trees: what the presets promise, and `sphereboard grow` from the outside.

use std::path::Path;

use assert_cmd::Command;
use rayon::prelude::*;
use sphereboard::geom::Bounds;
use sphereboard::model::grown::{GrownTree, grow_preset};
use sphereboard::model::reference::{Asked, ReferenceTree};
use sphereboard::model::{Part, bounds, glb, obj};
use sphereboard::plant::mesh::{LeafParams, WoodParams};
use sphereboard::plant::presets::{PRESETS, Preset, preset};
use sphereboard::plant::{BoneKind, DeriveParams, Skeleton, draw};
use sphereboard::{Seed, files};

fn skeleton(preset: &Preset, age: f64, seed: u64) -> Skeleton {
    let grammar = preset.grammar().unwrap();
    let chain = grammar.derive(age, &DeriveParams::default(), Seed(seed), &mut |_| {}).unwrap();
    draw(&chain, &grammar, grammar.turtle(), Seed(seed), age).unwrap()
}

fn grown_up(preset: &Preset) -> f64 {
    preset.grammar().unwrap().initial_age().unwrap()
}

#[test]
fn presets_keep_what_they_promise_whatever_the_seed() {
    assert!(PRESETS.len() >= 8);
    for preset in &PRESETS {
        for seed in [1, 2, 77] {
            let which = format!("{} of seed {seed}", preset.name);
            let bones = skeleton(preset, grown_up(preset), seed).bones;
            assert_eq!(bones.iter().filter(|bone| bone.kind == BoneKind::Leaf).count(), preset.leaves, "{which}");
            let b = Bounds::of(bones.iter().flat_map(|bone| [bone.start, bone.end()])).unwrap();
            let height = f64::from(b.max.y);
            assert!((height / preset.height_m - 1.0).abs() < 0.1, "{which} is {height} m high");
            assert!(b.min.y > -0.4, "{which} reaches {} m into the ground", -b.min.y);
            let (width, depth) = (b.size().x, b.size().z);
            assert!((0.6..1.7).contains(&(width / depth)), "{which}: {width} × {depth} m");
            assert!(b.center().with_y(0.0).length() < 0.25 * width.max(depth), "{which} stands beside its foot");
        }
    }
}

#[test]
fn the_largest_preset_is_meshed_soundly() {
    for name in ["yew", "juniper"] {
        let tree = grow_preset(preset(name).unwrap(), Seed(1)).unwrap();
        assert!(tree.parts.len() == 2 && tree.parts.iter().all(|part| part.check().is_ok()), "{name}");
        assert_eq!(tree.parts[1].surface.mesh.quads.len(), tree.leaf_bones.len());
    }
}

#[test]
fn presets_are_grown_up_at_their_age_and_not_before() {
    for preset in &PRESETS {
        let age = grown_up(preset);
        let bones = |age| skeleton(preset, age, 1).bones.len();
        assert_eq!(bones(age), bones(age + 3.0), "{} goes on growing", preset.name);
        assert!(bones(age - 4.0) < bones(age), "{} was grown up before", preset.name);
    }
}

/// Age is continuous: a tenth of a derivation changes the height by little.
#[test]
fn a_birch_grows_without_leaps() {
    let birch = preset("birch").unwrap();
    let height = |age: f64| skeleton(birch, age, 1).bones.iter().map(|bone| bone.end().y).fold(0.0, f32::max);
    let heights: Vec<f32> = (80..100).map(|tenths| height(f64::from(tenths) / 10.0)).collect();
    // The turtle's noise goes by place in the chain, which a derivation changes: that moves a tip by some decimetres.
    assert!(heights.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.4), "{heights:?}");
    assert!(heights[19] > heights[0] + 0.6, "{heights:?}");
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_one_another_tree() {
    let acacia = preset("acacia").unwrap();
    let bytes = |seed| glb::write_parts(&grow_preset(acacia, Seed(seed)).unwrap().parts, &"about", "test").unwrap();
    let first = bytes(5);
    assert!(first == bytes(5), "same seed");
    assert!(first != bytes(6), "another seed");
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(|| bytes(5));
    assert!(first == alone, "one thread");
}

/// Box, leaves and pictures of what was read back, compared with what was written.
fn compare(tree: &GrownTree, path: &Path) {
    let read = ReferenceTree::open(path, &Asked::default()).unwrap();
    let parts: Vec<Part> = read.parts().cloned().collect();
    let (written, found) = (bounds(&tree.parts).unwrap(), bounds(&parts).unwrap());
    assert!((written.min - found.min).abs().max_element() < 1e-5 && (written.max - found.max).abs().max_element() < 1e-5);
    assert_eq!((read.leaf_quads(), read.wood.len(), read.foliage.len()), (tree.leaf_bones.len(), 1, 1));
    // Two leaves that happen to cross in their middles are read as one: of the willow's 16,184 there is one such pair.
    let apart = tree.leaf_bones.len() - read.leaves.len();
    assert!(apart <= 1, "{} leaves were written, {} read", tree.leaf_bones.len(), read.leaves.len());
    for (part, name) in [(&read.wood[0], "wood"), (&read.foliage[0], "leaves")] {
        let original = tree.parts.iter().find(|p| p.name == name).unwrap();
        assert!(part.material.texture == original.material.texture, "{name}: the picture");
        assert_eq!(part.material.alpha_cutoff, original.material.alpha_cutoff, "{name}");
        assert_eq!(part.surface.mesh.triangulated().count(), original.surface.mesh.triangulated().count(), "{name}");
    }
}

#[test]
fn what_is_written_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    PRESETS.par_iter().for_each(|preset| {
        let tree = grow_preset(preset, Seed(1)).unwrap();
        let path = folder.path().join(format!("a {}.glb", preset.name));
        files::write_whole(&path, &glb::write_parts(&tree.parts, &"about", "test").unwrap()).unwrap();
        compare(&tree, &path);
        let path = folder.path().join(format!("a {}.obj", preset.name));
        files::write_all(&obj::write(&tree.parts, &path).unwrap()).unwrap();
        compare(&tree, &path);
    });
}

#[test]
fn nothing_to_draw_is_an_error() {
    let acacia = preset("acacia").unwrap();
    let clothing = sphereboard::model::grown::Clothing::painted(acacia.bark, acacia.leaf, Seed(1));
    let nothing = GrownTree::new(&Skeleton::default(), &clothing, &WoodParams::default(), &LeafParams::default(), Seed(1));
    assert!(nothing.unwrap_err().to_string().contains("nothing grew"));
}

fn grow(arguments: &[&str], folder: &Path) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_sphereboard")).arg("grow").args(arguments).current_dir(folder).output().unwrap()
}

#[test]
fn the_command_writes_a_tree_and_its_report() {
    let folder = tempfile::tempdir().unwrap();
    let ran = grow(&["acacia", "--age", "12.5", "--seed", "4", "--out", "t.glb", "--json"], folder.path());
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let report: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    let beside: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.path().join("t.json")).unwrap()).unwrap();
    assert_eq!(report, beside);
    assert_eq!((&report["age"], &report["seed"], &report["parameters"]["leaf_kind"]), (&12.5.into(), &4.into(), &"feather".into()));
    assert_eq!(&std::fs::read(folder.path().join("t.glb")).unwrap()[..4], b"glTF");

    let listed = String::from_utf8(grow(&["--list"], folder.path()).stdout).unwrap();
    assert!(PRESETS.iter().all(|p| listed.contains(p.name) && listed.contains(p.common)), "{listed}");
}

#[test]
fn the_command_reads_l_systems_and_pictures_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("twig.lsys"), "age 3\naxiom A\nA -> F[+L]{.+F.+F.}A\n").unwrap();
    image::RgbaImage::from_pixel(8, 8, image::Rgba([200, 10, 10, 255])).save(path("red.png")).unwrap();
    let ran = grow(&["twig.lsys", "--leaf-texture", "red.png", "--out", "new/twig.obj"], folder.path());
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let obj = std::fs::read_to_string(path("new/twig.obj")).unwrap();
    assert!(obj.contains("usemtl leaf") && obj.contains("usemtl blade") && obj.contains("mtllib twig.mtl"));
    let red = image::open(path("new/twig_leaves.png")).unwrap().into_rgb8();
    assert_eq!((red.dimensions(), red.get_pixel(3, 3).0), ((8, 8), [200, 10, 10]));
}

#[test]
fn mistakes_are_said_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.lsys"), "axiom A\nA -> F[+A\n").unwrap();
    std::fs::write(folder.path().join("none.lsys"), "symbols X\naxiom X\n").unwrap();
    std::fs::write(folder.path().join("text.png"), "no picture").unwrap();
    let cases: [(&[&str], i32, &str); 8] = [
        (&["oka", "--out", "t.glb"], 2, "expected a preset (oak, lime"),
        (&["oak", "--out", "t.fbx"], 2, "--out must be a file name that ends in .glb or .obj"),
        (&["oak"], 2, "must be given, but is missing"),
        (&["oak", "--age", "-1", "--out", "t.glb"], 2, "--age must be a number of derivations"),
        (&["bad.lsys", "--out", "t.glb"], 2, "line 2, column"),
        (&["none.lsys", "--out", "t.glb"], 1, "nothing grew"),
        (&["oak", "--age", "3", "--bark-texture", "text.png", "--out", "t.glb"], 1, "text.png is no PNG"),
        (&["oak", "--max-modules", "1000", "--out", "t.glb"], 1, "raise --max-modules"),
    ];
    for (arguments, code, message) in cases {
        let ran = grow(arguments, folder.path());
        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert_eq!(ran.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(message) && said.trim().lines().count() == 1, "{arguments:?}: {said}");
        assert!(!folder.path().join("t.glb").exists(), "{arguments:?} wrote something");
    }
}
