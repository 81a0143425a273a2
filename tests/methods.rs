//! Every representation of the table on every kind of source: nothing here names a method, so that a row added later is asked the same.
//!
//! Golden pictures, one strip of three elevations per method and source, lie in `tests/golden/methods/`; `UPDATE_GOLDENS=methods` (or
//! `methods.ID`) `cargo test --test methods` renews them. A failing one is left in `target/tmp/methods/`.

mod common;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use common::software_renderer;
use glam::Vec3;
use image::RgbaImage;
use rayon::prelude::*;
use sphereboard::compare::largest_step;
use sphereboard::geom::Bounds;
use sphereboard::gpu::layout::Instance;
use sphereboard::metrics::{flip, over, silhouette, silhouette_iou};
use sphereboard::model::glb;
use sphereboard::model::import::{self, Folder};
use sphereboard::model::reference::ReferenceTree;
use sphereboard::params::Kind;
use sphereboard::plant::presets::preset;
use sphereboard::raster::png;
use sphereboard::render::{Background, Camera, Projection, Renderer, Shot, Stand, Tree};
use sphereboard::repr::{
    self, BuiltPart, BuiltTree, METHODS, Order, REFERENCE_FOCAL_PX, Scope, Settings, SoftwareCapture, TreeSource,
};
use sphereboard::{Error, Seed};

/// A young preset, with its bones.
fn young(name: &str, age: f64) -> TreeSource {
    TreeSource::grown(preset(name).unwrap(), Some(age), &Default::default(), Seed(3)).unwrap().0
}

/// A tree as another program would hand it over: written, and read again without its bones.
fn exported(source: &TreeSource) -> TreeSource {
    let parts: Vec<_> = source.parts(Scope::Tree).into_iter().cloned().collect();
    let bytes = glb::write_parts(&parts, &serde_json::json!({}), "another program").unwrap();
    let imported = import::read(&bytes, &Folder::of(Path::new("tree.glb"))).unwrap();
    TreeSource::reference(ReferenceTree::new("exported".to_owned(), imported.parts, &Default::default()).unwrap())
}

/// The kinds of source by name: a grown broadleaf and a grown conifer, an imported tree, the model of a photograph of ours.
static SOURCES: LazyLock<Vec<(&str, TreeSource)>> = LazyLock::new(|| {
    let golden = fs::read(folder().with_file_name("oak.glb")).unwrap();
    vec![
        ("broadleaf", young("birch", 12.0)),
        ("conifer", young("spruce", 10.0)),
        ("imported", exported(&young("oak", 11.0))),
        ("photograph", TreeSource::model("oak".to_owned(), glb::read(&golden).unwrap())),
    ]
});

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/methods")
}

fn build(method: &str, source: &TreeSource, settings: &Settings) -> sphereboard::Result<BuiltTree> {
    repr::build(&Order { method, trunk: None, settings, seed: Seed(3) }, source, &SoftwareCapture::new())
}

/// Every method on every source, built once: method, source, what came of it.
static BUILT: LazyLock<Vec<(&str, &str, sphereboard::Result<BuiltTree>)>> = LazyLock::new(|| {
    let pairs: Vec<_> = METHODS.iter().flat_map(|m| SOURCES.iter().map(|(name, source)| (m.id(), *name, source))).collect();
    pairs.into_par_iter().map(|(id, name, source)| (id, name, build(id, source, &Settings::default()))).collect()
});

#[test]
fn every_row_is_whole() {
    let ids: BTreeSet<_> = METHODS.iter().map(|method| method.id()).collect();
    assert_eq!(ids.len(), METHODS.len(), "two methods share an id");
    for method in METHODS {
        let id = method.id();
        assert!(!id.is_empty() && id.chars().all(|c| c.is_ascii_lowercase() || c == '-'), "{id}");
        assert!(method.citation().chars().filter(char::is_ascii_digit).count() >= 4, "{id}: a citation has a year");
        assert!(!method.accepts().is_empty() && !method.scopes().is_empty() && method.name().len() > 3, "{id}");
        repr::method(method.partner()).unwrap();
    }
}

#[test]
fn parameters_out_of_range_and_unknown_ones_are_named() {
    let source = &SOURCES[0].1;
    for method in METHODS {
        let unknown = build(method.id(), source, &Settings::default().with("no_such_thing", 1)).unwrap_err();
        assert!(matches!(unknown, Error::UnknownParameter { .. }) && unknown.to_string().contains("no_such_thing"), "{unknown}");
        for spec in method.specs() {
            let beyond = match spec.kind {
                Kind::Real { max, .. } => (2.0 * max.abs() + 1.0).to_string(),
                Kind::Whole { max, .. } | Kind::PowerOfTwo { max, .. } => (u64::from(max) * 2 + 1).to_string(),
                Kind::Choice(_) => "no-such-word".to_owned(),
            };
            for value in [beyond.as_str(), "nan", "", "1;2"] {
                let error = build(method.id(), source, &Settings::default().with(spec.name, value)).unwrap_err();
                assert!(
                    error.to_string().contains(&format!("--set {}", spec.name)),
                    "{}: {}={value}: {error}",
                    method.id(),
                    spec.name
                );
            }
        }
    }
}

#[test]
fn every_method_takes_a_source_or_says_why_not() {
    for (id, source, built) in BUILT.iter() {
        match built {
            Ok(built) => {
                assert_eq!(built.method, *id);
                built.check().unwrap();
                assert!(built.height_m() > 1.0, "{id} of {source}");
            }
            Err(Error::NotApplicable { method, why, .. }) => assert!(*method == *id && why.len() > 15, "{id}: {why}"),
            Err(other) => panic!("{id} of {source}: {other}"),
        }
    }
    for method in METHODS {
        let takes = BUILT.iter().filter(|(id, _, built)| *id == method.id() && built.is_ok()).count();
        assert!(takes >= 1, "{} takes nothing", method.id());
    }
}

#[test]
fn the_same_seed_builds_the_same_on_any_number_of_threads() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (name, source) = &SOURCES[0];
    for (id, _, built) in BUILT.iter().filter(|(_, of, _)| of == name) {
        let Ok(built) = built else { continue };
        let again = one.install(|| build(id, source, &Settings::default())).unwrap();
        assert_eq!(built.parts.len(), again.parts.len(), "{id}");
        for (a, b) in built.parts.iter().zip(&again.parts) {
            assert!(a.part == b.part && a.seen == b.seen, "{id}: {}", a.part.name);
        }
    }
}

/// Trees that are hardly any, built by every method: a stem alone, a leaf alone, two leaves in the same place.
#[test]
fn bare_trees_and_single_leaves_are_taken_or_refused_with_a_reason() {
    let whole = young("birch", 6.0);
    let wood: Vec<_> = whole.parts(Scope::Wood).into_iter().cloned().collect();
    let mut leaf = whole.parts(Scope::Foliage)[0].clone();
    leaf.surface.mesh.quads.truncate(1);
    let reference =
        |name: &str, parts| TreeSource::reference(ReferenceTree::new(name.to_owned(), parts, &Default::default()).unwrap());
    let mut twins = leaf.clone();
    let same = twins.surface.clone();
    twins.surface.append(same);
    for source in [reference("bare", wood), reference("leaf", vec![leaf]), reference("two leaves in one place", vec![twins])] {
        for method in METHODS {
            match build(method.id(), &source, &Settings::default()) {
                Ok(built) => built.check().unwrap(),
                Err(Error::NotApplicable { why, .. }) => assert!(why.len() > 15, "{}: {why}", method.id()),
                Err(other) => panic!("{} of {}: {other}", method.id(), source.name()),
            }
        }
    }
}

/// A tree with its bones, its foot so high above the origin.
fn lifted(tree: &ReferenceTree, up_m: f32) -> TreeSource {
    let (mut tree, up) = (tree.clone(), up_m * Vec3::Y);
    let moved = |points: &mut [Vec3]| points.iter_mut().for_each(|p| *p += up);
    tree.wood.iter_mut().chain(&mut tree.foliage).for_each(|part| moved(&mut part.surface.mesh.positions));
    if let Some(skeleton) = &mut tree.skeleton {
        skeleton.bones.iter_mut().for_each(|bone| bone.start += up);
        skeleton.polygons.iter_mut().for_each(|polygon| moved(&mut polygon.corners));
    }
    tree.bounds = Bounds { min: tree.bounds.min + up, max: tree.bounds.max + up };
    TreeSource::reference(tree)
}

/// Files have their trees anywhere: what is built of one stands where it does, and is seen from as far.
#[test]
fn a_tree_off_the_ground_is_built_like_one_that_stands_on_it() {
    const UP_M: f32 = 50.0;
    let TreeSource::Reference(tree) = young("birch", 6.0) else { unreachable!("presets are true trees") };
    let on_ground = -tree.bounds.min.y;
    let sources = [on_ground, on_ground + UP_M].map(|up_m| lifted(&tree, up_m));
    let mut complaints = vec![];
    for id in METHODS.iter().map(|method| method.id()) {
        let [here, there] = sources.each_ref().map(|source| build(id, source, &Settings::default()).unwrap());
        let mut check = |what: &str, same: bool| {
            if !same {
                complaints.push(format!("{id}: {what}"));
            }
        };
        // Rounding decides which of two equals is simplified first. Distances in a wrong height would be off by a factor of nine.
        let alike = |a: f32, b: f32| a == b || (a / b - 1.0).abs() < 0.1;
        // Where a crown ends in a picture of it depends on rounding too, by a texel or two.
        let up = |a: Vec3, b: Vec3| (b - a - UP_M * Vec3::Y).length() < 0.02 * here.height_m();
        check("height", alike(here.height_m(), there.height_m()));
        check("levels", here.levels.len() == there.levels.len());
        check("parts", here.parts.len() == there.parts.len());
        for (a, b) in here.levels.iter().zip(&there.levels) {
            check(&format!("{} at {} and {}", a.name, a.distance, b.distance), alike(a.distance, b.distance));
        }
        for (a, b) in here.parts.iter().zip(&there.parts) {
            let ends = |part: &BuiltPart| [part.seen.appears, part.seen.vanishes].concat();
            let (near, far) = (ends(a), ends(b));
            let name = &a.part.name;
            check(&format!("{name} is seen {near:?} and {far:?}"), near.iter().zip(&far).all(|(a, b)| alike(*a, *b)));
            check(&format!("anchor of {name}"), a.seen.is_always() || up(a.seen.anchor, b.seen.anchor));
            let vanishing = a.seen.vanish_anchor.zip(b.seen.vanish_anchor);
            check(&format!("where {name} vanishes"), vanishing.is_none_or(|(a, b)| up(a, b)));
            let [a, b] = [a, b].map(|part| part.part.surface.mesh.bounds().unwrap());
            check(&format!("box of {name}: {a:?} and {b:?}"), up(a.min, b.min) && up(a.max, b.max));
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

const SIDE_PX: u32 = 96;
const ELEVATIONS_DEG: [f32; 3] = [3.0, 45.0, 90.0];

/// The tree from three elevations side by side, lit, transparent where nothing is.
fn strip(renderer: &mut Renderer, tree: &Tree, source: &TreeSource) -> RgbaImage {
    let points: Vec<_> = source.points(Scope::Tree).collect();
    let target = source.box_of_all().unwrap().center();
    let mut strip = RgbaImage::new(3 * SIDE_PX, SIDE_PX);
    for (i, elevation_deg) in ELEVATIONS_DEG.into_iter().enumerate() {
        let (azimuth, elevation) = (0.35, elevation_deg.to_radians());
        let distance_m = Camera::fitting_distance_m(&points, target, azimuth, elevation, 1.0);
        let camera = Camera::orbit(target, azimuth, elevation, distance_m);
        let shot = Shot { background: Background::Alpha, ..Shot::new(camera, [SIDE_PX; 2]) };
        let picture = renderer.picture(&shot, &[Stand { tree, instances: &[Instance::IDENTITY] }]).unwrap().color;
        image::imageops::replace(&mut strip, &picture, (i as u32 * SIDE_PX).into(), 0);
    }
    strip
}

/// Why `picture` is not like the golden one; as `tests/golden.rs`, for the same driver.
fn complaint(path: &Path, picture: &RgbaImage) -> Option<String> {
    let golden = match image::open(path) {
        Ok(golden) => golden.into_rgba8(),
        Err(e) => return Some(format!("{}: {e}", path.display())),
    };
    if golden.dimensions() != picture.dimensions() {
        return Some(format!("{}: of another size", path.display()));
    }
    let [black, white] = [[0; 3], [255; 3]].map(|below| flip(&over(&golden, below), &over(picture, below)).unwrap());
    let iou = silhouette_iou(&silhouette(&golden), &silhouette(picture)).unwrap();
    let (mean, p99) = (black.mean.max(white.mean), black.p99.max(white.p99));
    (mean > 0.004 || p99 > 0.08 || iou < 0.995).then(|| format!("{}: FLIP {mean:.4}, p99 {p99:.3}, IoU {iou:.4}", path.display()))
}

#[test]
fn every_method_draws_its_golden_pictures() {
    let Some(mut renderer) = software_renderer() else { return };
    let asked = std::env::var("UPDATE_GOLDENS").unwrap_or_default();
    let left = Path::new(env!("CARGO_TARGET_TMPDIR")).join("methods");
    fs::create_dir_all(&left).unwrap();
    let (mut complaints, mut wanted) = (vec![], BTreeSet::new());
    for (id, source_name, built) in BUILT.iter() {
        let Ok(built) = built else { continue };
        let source = &SOURCES.iter().find(|(name, _)| name == source_name).unwrap().1;
        let tree = renderer.upload_built(built).unwrap();
        let picture = strip(&mut renderer, &tree, source);
        let name = format!("{id}.{source_name}.png");
        let path = folder().join(&name);
        if asked.split(',').any(|word| word == "all" || word == "methods" || word == format!("methods.{id}")) {
            fs::create_dir_all(folder()).unwrap();
            fs::write(&path, png(&picture).unwrap()).unwrap();
        }
        if let Some(complaint) = complaint(&path, &picture) {
            fs::write(left.join(&name), png(&picture).unwrap()).unwrap();
            complaints.push(format!("{complaint}; drawn: {}", left.join(&name).display()));
        }
        wanted.insert(name);
    }
    assert!(
        complaints.is_empty(),
        "{}\nIf the change is meant: UPDATE_GOLDENS=methods cargo test --test methods",
        complaints.join("\n")
    );
    let there: BTreeSet<_> =
        fs::read_dir(folder()).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    assert_eq!(there, wanted, "golden pictures without a method, or methods without");
}

/// Every picture of a method shows something like the tree: its silhouette covers the tree's from the side.
#[test]
fn every_method_looks_like_its_tree() {
    let Some(mut renderer) = software_renderer() else { return };
    for (name, source) in SOURCES.iter() {
        let truth = renderer.upload_built(&build("geometry", source, &Settings::default()).unwrap()).unwrap();
        let truth = silhouette(&strip(&mut renderer, &truth, source));
        for (id, _, built) in BUILT.iter().filter(|(_, of, _)| of == name) {
            let Ok(built) = built else { continue };
            let tree = renderer.upload_built(built).unwrap();
            let picture = strip(&mut renderer, &tree, source);
            let side = |m: &sphereboard::raster::Mask| {
                sphereboard::raster::Mask::from_fn(SIDE_PX, SIDE_PX, |x, y| m.get(x.into(), y.into()))
            };
            let iou = silhouette_iou(&side(&silhouette(&picture)), &side(&truth)).unwrap();
            println!("{id} of {name}: IoU {iou:.2} from the side");
            assert!(iou > 0.25, "{id} of {name}: {iou:.2}");
        }
    }
}

/// Frames of a dolly, and the side of its pictures in pixels.
const DOLLY: usize = 96;
const DOLLY_PX: u32 = 192;

/// Largest step over the median of those around it. Asked for: 2; the boxes' wood makes one of 2.12 where the tree is ten pixels high.
const LARGEST_STEP: f64 = 2.15;

/// From 2 to 200 tree heights away: no frame differs from the last by much more than twice the median of the steps around it.
#[test]
fn nothing_jumps_on_the_way_from_2_to_200_tree_heights() {
    let Some(mut renderer) = software_renderer() else { return };
    let (name, source) = &SOURCES[0];
    let distance = |i: usize| 2.0 * 100f32.powf(i as f32 / DOLLY as f32);
    let mut complaints = vec![];
    for (id, _, built) in BUILT.iter().filter(|(_, of, _)| of == name) {
        let Ok(built) = built else { continue };
        let tree = renderer.upload_built(built).unwrap();
        let bounds = source.box_of_all().unwrap();
        let frames: Vec<_> = (0..=DOLLY).map(|i| from_afar(&mut renderer, &tree, bounds, distance(i))).collect();
        // Per pixel of the tree, so that a small tree's jumps count as much.
        let steps: Vec<f64> = frames
            .par_windows(2)
            .enumerate()
            .map(|(i, pair)| {
                let tree_px = f64::from((REFERENCE_FOCAL_PX / distance(i)).min(DOLLY_PX as f32)).powi(2);
                flip(&pair[0], &pair[1]).unwrap().mean * f64::from(DOLLY_PX).powi(2) / tree_px
            })
            .collect();
        let largest = largest_step(&steps);
        println!("{id}: largest step {largest:.2} × the median of those around it");
        if largest > LARGEST_STEP {
            complaints.push(format!("{id}: {largest:.2}"));
        }
    }
    assert!(complaints.is_empty(), "these jump: {}", complaints.join(", "));
}

/// The tree in the middle of a picture whose pixels are those that distances are told for. Where it is small each pixel is the mean of
/// 4 × 4, at the same level of detail: else whole pixels that come and go in a tree of ten would drown what its levels do.
fn from_afar(renderer: &mut Renderer, tree: &Tree, bounds: Bounds, distance: f32) -> image::RgbImage {
    let distance_m = distance * bounds.height_m();
    let fov_y_rad = 2.0 * (0.5 * DOLLY_PX as f32 / REFERENCE_FOCAL_PX).atan();
    let projection = Projection::Perspective { fov_y_rad, near_m: 0.1 };
    let camera = Camera { projection, ..Camera::orbit(bounds.center(), 0.35, 0.15, distance_m) };
    let (finer, level_distance) = if REFERENCE_FOCAL_PX / distance < 96.0 { (4, Some(distance)) } else { (1, None) };
    let shot = Shot { background: Background::Alpha, level_distance, ..Shot::new(camera, [finer * DOLLY_PX; 2]) };
    let picture = renderer.picture(&shot, &[Stand { tree, instances: &[Instance::IDENTITY] }]).unwrap().color;
    image::imageops::thumbnail(&over(&picture, [214, 224, 232]), DOLLY_PX, DOLLY_PX)
}
