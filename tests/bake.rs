//! Built trees in files: what any method builds comes back bit for bit and draws the same pixels; damaged files do no harm.
//!
//! The files are left in `target/tmp/bake/` for the Khronos validator and the browser (`tests/js/`), with a picture of each from the
//! front as the browser takes it.

mod common;

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use glam::{Vec2, Vec3};
use image::{Rgba, RgbaImage};
use proptest::prelude::*;
use sphereboard::geom::{Bounds, PolyMesh, Surface};
use sphereboard::gpu::layout::Instance;
use sphereboard::metrics::{flip, over};
use sphereboard::model::reference::Asked;
use sphereboard::model::{Material, Part, Wrap, glb};
use sphereboard::plant::presets::preset;
use sphereboard::render::{Background, Camera, Renderer, Shot, Stand};
use sphereboard::repr::file::{self, Origin};
use sphereboard::repr::{
    self, BuiltPart, BuiltTree, Drawn, Facing, Level, METHODS, Octahedral, Order, Representation, Seen, Settings, SoftwareCapture,
    TreeSource,
};
use sphereboard::{Error, Seed, files};

/// A young tree, small, but with wood, leaves and bones; and for methods that do not take it, the model of a photograph.
fn sources() -> [TreeSource; 2] {
    let young = TreeSource::grown(preset("birch").unwrap(), Some(12.0), &Asked::default(), Seed(1)).unwrap().0;
    let oak = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/oak.glb")).unwrap();
    [young, TreeSource::model("oak".to_owned(), glb::read(&oak).unwrap())]
}

fn origin() -> Origin {
    Origin { source: "test".to_owned(), trunk: None, parameters: [("a".to_owned(), "1".to_owned())].into(), seed: Seed(u64::MAX) }
}

/// Everything that a file keeps, in words: floats are told so that they read back to the same bits.
fn told(built: &BuiltTree) -> String {
    let BuiltTree { method, bounds, parts, levels, growth, .. } = built;
    let picture = |image: &Option<Arc<RgbaImage>>| image.as_ref().map(|image| (image.dimensions(), image.as_raw().clone()));
    let part = |BuiltPart { part, drawn, seen }: &BuiltPart| {
        let m = &part.material;
        // Without a picture nothing is wrapped.
        let wrap = (m.texture.is_some() || m.normal_texture.is_some()).then_some(m.wrap);
        let material = (&m.name, m.factor, picture(&m.texture), picture(&m.normal_texture), wrap, m.alpha_cutoff, m.two_sided);
        format!("{:?}", (&part.name, &part.surface, material, part.crown_center, drawn, seen))
    };
    format!("{:?}\n{}", (method, bounds, levels, growth), parts.iter().map(part).collect::<Vec<_>>().join("\n"))
}

/// Pictures that several parts share are shared again.
fn pictures(built: &BuiltTree) -> usize {
    let parts = built.parts.iter();
    let all = parts.flat_map(|part| [&part.part.material.texture, &part.part.material.normal_texture]).flatten();
    all.map(Arc::as_ptr).collect::<std::collections::BTreeSet<_>>().len()
}

/// Leaves a file, and what we draw of it, for the checks by other programs.
fn keep(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("bake");
    std::fs::create_dir_all(&folder).unwrap();
    files::write_whole(&folder.join(name), bytes).unwrap();
    folder.join(name)
}

/// Writes, reads, compares, and writes again.
fn round_trip(name: &str, built: &BuiltTree) -> BuiltTree {
    let bytes = file::write(built, &origin()).unwrap_or_else(|e| panic!("{name}: {e}"));
    let (again, from) = file::read(&bytes).expect("it is marked").unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(from, origin());
    assert!(told(&again) == told(built), "{name}: another tree came back");
    assert_eq!(pictures(&again), pictures(built), "{name}: shared pictures");
    assert!(file::write(&again, &origin()).unwrap() == bytes, "{name}: other bytes the second time");
    keep(&format!("{name}.glb"), &bytes);
    again
}

fn drawn(renderer: &mut Renderer, built: &BuiltTree, distance: f32) -> RgbaImage {
    let tree = renderer.upload_built(built).unwrap();
    let camera = Camera::orbit(built.bounds.center(), 0.5, 0.2, distance * built.height_m());
    let shot = Shot { background: Background::Black, ..Shot::new(camera, [96, 96]) };
    renderer.picture(&shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }]).unwrap().color
}

/// What every method makes of a source, as a file can hold it; the table decides which there are. That is all of it, with one exception:
/// where leaves go one by one ([`Drawn::Forest`]) a file holds plain levels in their stead. So those files are compared with these levels, and
/// the levels with the leaves that they stand for in [`plain_levels_draw_like_the_leaves_that_go_one_by_one`].
fn all_built() -> &'static [(&'static dyn Representation, BuiltTree)] {
    static BUILT: OnceLock<Vec<(&'static dyn Representation, BuiltTree)>> = OnceLock::new();
    BUILT.get_or_init(|| {
        let (sources, settings, capture) = (sources(), Settings::default(), SoftwareCapture::new());
        let build = |method: &&'static dyn Representation| {
            let order = Order { method: method.id(), trunk: None, settings: &settings, seed: Seed(1) };
            sources.iter().find_map(|source| match repr::build(&order, source, &capture) {
                // What glTF can hold of it.
                Ok(built) => Some((*method, built.plain())),
                Err(Error::NotApplicable { .. }) => None,
                Err(error) => panic!("{}: {error}", method.id()),
            })
        };
        METHODS.iter().filter_map(build).collect()
    })
}

#[test]
fn what_any_method_builds_survives_its_file_bit_for_bit() {
    assert_eq!(all_built().len(), METHODS.len(), "every row of the table builds one of the sources");
    for (method, built) in all_built() {
        round_trip(method.id(), built);
    }
}

#[test]
fn a_file_draws_the_same_pixels_as_what_was_built() {
    let Some(mut renderer) = common::software_renderer() else { return };
    for (method, built) in all_built() {
        let again = round_trip(&format!("drawn-{}", method.id()), built);
        // Levels change by the size on the screen, and this picture is small.
        let far = built.levels.last().unwrap().distance / 6.5;
        for distance in [1.5, 3.0, far.clamp(1.5, 8.0)] {
            let (a, b) = (drawn(&mut renderer, built, distance), drawn(&mut renderer, &again, distance));
            assert!(a == b, "{} at {distance} heights", method.id());
            assert!(a.pixels().any(|p| p[0] > 20), "{} at {distance} heights shows nothing", method.id());
        }
    }
}

#[test]
fn plain_levels_draw_like_the_leaves_that_go_one_by_one() {
    let Some(mut renderer) = common::software_renderer() else { return };
    let (sources, settings, capture) = (sources(), Settings::default(), SoftwareCapture::new());
    let mut forests = 0;
    for method in METHODS {
        let order = Order { method: method.id(), trunk: None, settings: &settings, seed: Seed(1) };
        let Ok(built) = repr::build(&order, &sources[0], &capture) else { continue };
        if !built.parts.iter().any(|part| matches!(part.drawn, Drawn::Forest(_))) {
            continue;
        }
        forests += 1;
        let plain = built.clone().plain();
        for level in &built.levels {
            let mut at = |tree: &BuiltTree| {
                let tree = renderer.upload_built(tree).unwrap();
                let camera = Camera::orbit(built.bounds.center(), 0.5, 0.2, 2.5 * built.height_m());
                let shot =
                    Shot { background: Background::Alpha, level_distance: Some(level.distance), ..Shot::new(camera, [192; 2]) };
                renderer.picture(&shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }]).unwrap().color
            };
            let (forest, levels) = (at(&built), at(&plain));
            let covered = |picture: &RgbaImage| picture.pixels().filter(|p| p[3] > 127).count() as f64;
            // In each cluster one leaf is about to go, in its own way: what counts is what is seen of both from where they are seen.
            let small = |picture: &RgbaImage| image::imageops::thumbnail(&over(picture, [0; 3]), 48, 48);
            let unlike = flip(&small(&forest), &small(&levels)).unwrap();
            let share = covered(&levels) / covered(&forest);
            println!("{}, {}: covers {share:.3} of what the leaves do, {unlike:?}", method.id(), level.name);
            assert!((share - 1.0).abs() < 0.03 && unlike.mean < 0.04, "{}, {}: {share:.3}, {unlike:?}", method.id(), level.name);
        }
    }
    assert!(forests >= 1, "no method has such leaves");
}

#[test]
fn a_stand_in_is_no_source() {
    let path = keep("no-source.glb", &file::write(&everything(), &origin()).unwrap());
    let refused = TreeSource::open(path.to_str().unwrap(), &Asked::default(), Seed(1)).unwrap_err().to_string();
    assert!(refused.contains("is already a stand-in (none of test); name its source instead"), "{refused}");
}

/// A card of one texture, with everything about it that a file has to keep.
fn card(name: &str, texture: &Arc<RgbaImage>, at: Vec3) -> Part {
    let positions = [(-1.0, 0.0), (1.0, 0.0), (1.0, 2.0), (-1.0, 2.0)].map(|(x, y)| at + Vec3::new(x, y, 0.0)).to_vec();
    let uvs = [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(Vec2::from).to_vec();
    let normal = Arc::new(RgbaImage::from_fn(5, 3, |x, y| Rgba([128 + x as u8, 127 - y as u8, 250, 255])));
    Part {
        name: name.to_owned(),
        surface: Surface {
            mesh: PolyMesh { positions, triangles: vec![], quads: vec![[0, 1, 2, 3]] },
            normals: vec![Vec3::Z; 4],
            uvs,
            colors: vec![[0.1, 0.2, 0.3, 1.0]; 4],
        },
        material: Material {
            name: String::new(),
            factor: [0.1, 0.7, 1.0, 0.9],
            texture: Some(texture.clone()),
            normal_texture: Some(normal),
            wrap: Wrap::Clamp,
            alpha_cutoff: Some(0.4),
            two_sided: true,
        },
        crown_center: Some(at),
    }
}

/// Levels, a part that two of them share, one that is between them, turned cards, an impostor.
fn everything() -> BuiltTree {
    let texture = Arc::new(RgbaImage::from_fn(8, 8, |x, y| Rgba([40, 20 * x as u8, 10, if x + y > 4 { 255 } else { 0 }])));
    let toward = |axis: Vec3| Facing::Toward { axis, cosines: [0.7, 0.75], level: true, both_sides: false };
    let turned = Drawn::Turned { pivot: Vec3::new(0.0, 0.1, 0.3), upright: true };
    let between = |near, far| Seen::between(Vec3::Y, near, far, 0.15);
    let atlas = Drawn::Octahedral(Octahedral { grid: 4, center: Vec3::Y, radius_m: 1.1 });
    let part = |name: &str, drawn, seen| BuiltPart { part: card(name, &texture, Vec3::X), drawn, seen };
    let parts = vec![
        part("near", Drawn::Still, between(0.0, 5.0)),
        part("both", Drawn::Still, between(0.0, 20.0)),
        part("passing", Drawn::Still, between(6.0, 9.0)),
        part("front", turned.clone(), Seen { facing: toward(Vec3::Z), ..between(5.0, 20.0) }),
        part("back", turned, Seen { facing: toward(-Vec3::Z), ..between(5.0, 20.0) }),
        part("far", atlas, between(20.0, f32::MAX)),
    ];
    let bounds = Bounds { min: Vec3::new(-1.0, 0.0, -1.0), max: Vec3::new(2.0, 2.0, 1.0) };
    let level = |name: &str, distance| Level { name: name.to_owned(), distance };
    let levels = vec![level("fine", 2.0), level("middle", 12.5), level("coarse", 50.1)];
    BuiltTree { method: "none".to_owned(), levels, ..BuiltTree::new(bounds, parts) }
}

fn json_of(bytes: &[u8]) -> serde_json::Value {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

#[test]
fn levels_and_what_gltf_cannot_say_survive() {
    let built = everything();
    round_trip("everything", &built);
    let json = json_of(&file::write(&built, &origin()).unwrap());
    let names = |scene: usize| -> Vec<String> {
        let child = |node: &serde_json::Value| json["nodes"][node.as_u64().unwrap() as usize].clone();
        let mut group = child(&json["scenes"][scene]["nodes"][0]);
        if group["name"] == "tree" {
            group = child(&group["children"][0]);
        }
        group["children"].as_array().unwrap().iter().map(|node| child(node)["name"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(json["scene"], 0);
    assert_eq!(names(0), ["near", "both"]);
    assert_eq!(names(1), ["both", "front"], "of cards that turn, the front one");
    assert_eq!(names(2), ["far"], "a card in its place");
    assert_eq!(names(3), ["passing", "back", "far", "far normals"]);
    let finest = json["nodes"].as_array().unwrap().iter().find(|node| node["name"] == "fine").unwrap();
    assert_eq!(finest["extensions"]["MSFT_lod"]["ids"].as_array().unwrap().len(), 2);
    let covers: Vec<f64> =
        finest["extras"]["MSFT_screencoverage"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!(covers.len() == 3 && covers.is_sorted_by(|a, b| a > b) && covers.iter().all(|c| (0.0..=1.0).contains(c)), "{covers:?}");
    assert_eq!(json["meshes"].as_array().unwrap().len(), 6 + 2, "each part once, the impostor's card and normals");
}

#[test]
fn one_level_is_seen_from_everywhere() {
    let middle = file::one_level(everything(), 1);
    assert_eq!(middle.parts.iter().map(|part| part.part.name.as_str()).collect::<Vec<_>>(), ["both", "front", "back"]);
    assert!(middle.parts.iter().all(|part| part.seen.share_at(0.0) == 1.0 && part.seen.share_at(1e6) == 1.0));
    round_trip("middle", &middle);
}

#[test]
fn a_tree_that_breaks_a_promise_is_not_written() {
    let broken = |damage: fn(&mut BuiltTree)| {
        let mut built = everything();
        damage(&mut built);
        file::write(&built, &origin()).unwrap_err().to_string()
    };
    assert!(broken(|b| b.parts.clear()).contains("nothing was built"));
    assert!(broken(|b| b.parts[0].seen.appears[0] = f32::NAN).contains("no rising distances"));
    assert!(broken(|b| b.parts[3].drawn = Drawn::Turned { pivot: Vec3::NAN, upright: true }).contains("not finite"));
    assert!(broken(|b| b.bounds.max.y = f32::INFINITY).contains("not finite"));
    assert!(broken(|b| b.parts[0].part.material.texture = Some(Arc::default())).contains("a picture"));
}

#[test]
fn a_changed_file_is_told_from_a_sound_one() {
    let bytes = file::write(&everything(), &origin()).unwrap();
    let patched = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).unwrap_or_else(|| panic!("{from}"));
        let mut patched = bytes.clone();
        patched[at..at + to.len()].copy_from_slice(to.as_bytes());
        file::read(&patched).expect("it is marked").unwrap_err()
    };
    assert!(matches!(patched(r#""format":1"#, r#""format":2"#), Error::GlbVersion { found: 2, .. }));
    assert!(patched(r#""quads":1"#, r#""quads":2"#).to_string().contains("triangles"));
    assert!(patched(r#""number":0"#, r#""number":5"#).to_string().contains("missing"));
    assert!(patched(r#""parts":6"#, r#""parts":7"#).to_string().contains("missing"));
    assert!(patched(r#""radius_m":1.1"#, r#""radius_m":-.1"#).to_string().len() > 10);
    assert!(file::read(b"glTF").is_none() && file::read(b"").is_none());
    assert!(file::read(&bytes[..bytes.len() - 1]).unwrap().is_err());
    // Read as any other mesh, it shows its finest level.
    let parts = sphereboard::model::import::read(&bytes, &Default::default()).unwrap().parts;
    assert_eq!(parts.len(), 2);
}

/// The places of all numbers of the JSON.
fn numbers(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let end = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let (mut found, mut at) = (vec![], 20);
    while at < end {
        let length = bytes[at..end].iter().take_while(|b| b.is_ascii_digit()).count();
        if length > 0 && b":,[-".contains(&bytes[at - 1]) {
            found.push(at..at + length);
        }
        at += length.max(1);
    }
    found
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, ..ProptestConfig::default() })]

    /// Flipped bytes and other numbers, also huge ones: an answer, no panic, no heap of memory.
    #[test]
    fn damage_does_no_harm(flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..3),
                           which in any::<prop::sample::Index>(), value in prop_oneof![0..20u64, any::<u64>()], cut in any::<prop::sample::Index>()) {
        static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
        let mut bytes = BYTES.get_or_init(|| file::write(&everything(), &origin()).unwrap()).clone();
        let place = which.get(&numbers(&bytes)).clone();
        // As many digits as there were, so that lengths stay true.
        let digits = format!("{:0>width$}", value.to_string(), width = place.len());
        if flips.is_empty() {
            let digits = if place.len() > 1 { digits.trim_start_matches('0') } else { &digits };
            let text = format!("{:<width$}", &digits[..digits.len().min(place.len())], width = place.len());
            bytes[place].copy_from_slice(text.as_bytes());
        }
        for (at, with) in &flips {
            let at = at.index(bytes.len());
            bytes[at] ^= with;
        }
        if let Some(Ok((built, _))) = file::read(&bytes) {
            prop_assert!(built.check().is_ok());
        }
        if let Some(Ok((built, _))) = file::read(&bytes[..cut.index(bytes.len())]) {
            prop_assert!(built.check().is_ok());
        }
    }
}

/// Runs `sphereboard`; exit code, standard output and standard error.
fn sphereboard(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = assert_cmd::Command::cargo_bin("sphereboard").unwrap().args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn the_command_writes_a_file_and_says_what_it_costs() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("t.glb");
    let (code, table, said) = sphereboard(&["bake", "juniper", "--method", "crossed-planes", "--out", out.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{said}");
    for word in ["level", "polygons", "texture MB", "built in", "bytes"] {
        assert!(table.contains(word), "{word} in {table}");
    }
    let (built, origin) = file::read(&std::fs::read(&out).unwrap()).unwrap().unwrap();
    assert_eq!((built.method.as_str(), origin.source.as_str(), origin.seed), ("crossed-planes", "juniper", Seed(1)));
    assert_eq!(origin.parameters.len(), METHODS.iter().find(|m| m.id() == "crossed-planes").unwrap().specs().len());
    let (_, json, _) = sphereboard(&["methods", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["methods"].as_array().unwrap().len(), METHODS.len());
}

#[test]
fn mistakes_are_told_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("t.glb");
    let out = out.to_str().unwrap();
    let stream = folder.path().join("stream");
    let stream = ["juniper", "--method", "box-hierarchy", "--stream", stream.to_str().unwrap()];
    let streamed = |rest: &[&'static str]| [&stream[..], rest].concat();
    let cases: [(&[&str], &str); 12] = [
        (&["juniper", "--method", "crossed-plane", "--out", out], "expected a method (geometry, "),
        (&["junipr", "--method", "geometry", "--out", out], "but found junipr"),
        (
            &["juniper", "--method", "crossed-planes", "--set", "planes=99", "--out", out],
            "--set planes must be a whole number from 2 to 8, but is 99",
        ),
        (
            &["juniper", "--method", "box-hierarchy", "--trunk", "lodstrips", "--set", "trunk.error_px=-1", "--out", out],
            "--set trunk.error_px must be",
        ),
        (
            &["juniper", "--method", "box-hierarchy", "--trunk", "lodstrips", "--set", "trunk.plane=1", "--out", out],
            "there is no parameter trunk.plane",
        ),
        (&streamed(&["--trunk", "billboard"]), "expected a method ("),
        (&streamed(&["--trunk", "lodf"]), "but found lodf"),
        (&streamed(&["--texture-budget-mb", "0.01"]), "or raise --texture-budget-mb"),
        (&["juniper", "--method", "crossed-planes", "--set", "plane=2", "--out", out], "there is no parameter plane"),
        (
            &["juniper", "--method", "crossed-planes", "--texture-budget-mb", "0.5", "--out", out],
            "with --set, or raise --texture-budget-mb",
        ),
        (&["juniper", "--method", "geometry", "--levels", "9", "--out", out], "all, or one of 0 (all)"),
        (&["juniper", "--method", "geometry", "--out", "t.obj"], "a file *.glb"),
    ];
    for (arguments, words) in cases {
        let (code, _, said) = sphereboard(&[&["bake"], arguments].concat());
        assert_eq!(code, Some(2), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
        assert_eq!(said.lines().filter(|line| line.starts_with("sphereboard:")).count(), 1, "{said}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
