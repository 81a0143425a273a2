//! Golden pictures: what the renderer drew when somebody last looked, for two small models of our own samples.
//!
//! A picture is compared over black and over white: mean and 99th percentile of FLIP, and the overlap of the silhouettes. To renew them:
//! `UPDATE_GOLDENS=all cargo test --test golden` (or names with commas between), then look at `git diff`; `UPDATE_GOLDENS=models` also
//! makes the two models anew from their photographs. A failing picture is left in `target/tmp/golden/` for comparison.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::software_renderer;
use glam::Vec3;
use image::{Rgba, RgbaImage};
use sphereboard::gpu::layout::Instance;
use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::metrics::{flip, over, silhouette, silhouette_iou};
use sphereboard::model::glb;
use sphereboard::raster::png;
use sphereboard::render::{Background, Camera, Renderer, Shot, Stage, Stand, Tree, WindParams};

/// How unlike a picture may be: at most so much FLIP, at least so much overlap.
#[derive(Debug, Clone, Copy)]
struct Limits {
    mean: f64,
    p99: f64,
    iou: f64,
}

/// The same driver gives the same bytes; the room is for another version of it. Damage of 1 px, 5 % or a hole is seen (tests below).
/// Set on: llvmpipe (LLVM 15.0.6, 256 bits), Mesa 22.3.6.
const SOFTWARE: Limits = Limits { mean: 0.003, p99: 0.05, iou: 0.998 };
/// A real GPU rounds edges and texture coordinates its own way, which moves single pixels of outlines and twigs.
/// Set by judgement: no GPU was at hand when these pictures were drawn.
const GPU: Limits = Limits { mean: 0.03, p99: 0.5, iou: 0.97 };

/// Which trees stand where.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Trees {
    Oak,
    Spruce,
    /// The spruce before the oak: one outline before another crown.
    Both,
}

/// One picture.
struct Case {
    name: &'static str,
    trees: Trees,
    stage: Stage,
    azimuth_deg: f32,
    elevation_deg: f32,
    background: Background,
    wind_m_s: f64,
}

const FRONT: Case = Case {
    name: "",
    trees: Trees::Oak,
    stage: Stage::Lit,
    azimuth_deg: 0.0,
    elevation_deg: 4.0,
    background: Background::Alpha,
    wind_m_s: 0.0,
};

const CASES: [Case; 10] = [
    Case { name: "unshaped", stage: Stage::Unshaped, ..FRONT },
    Case { name: "reshaped", stage: Stage::Reshaped, ..FRONT },
    Case { name: "antialiased", stage: Stage::Antialiased, ..FRONT },
    Case { name: "lit", ..FRONT },
    Case { name: "lit_45", azimuth_deg: 45.0, elevation_deg: 20.0, ..FRONT },
    Case { name: "lit_above", azimuth_deg: 20.0, elevation_deg: 80.0, ..FRONT },
    Case { name: "lit_sky", azimuth_deg: -30.0, elevation_deg: 12.0, background: Background::Sky, ..FRONT },
    Case { name: "wind", wind_m_s: 12.0, ..FRONT },
    Case { name: "needles", trees: Trees::Spruce, stage: Stage::Antialiased, ..FRONT },
    Case { name: "two", trees: Trees::Both, elevation_deg: 10.0, ..FRONT },
];

const SIZE_PX: [u32; 2] = [240, 240];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden")
}

/// Whether `UPDATE_GOLDENS` names it.
fn renewing(name: &str) -> bool {
    let asked = std::env::var("UPDATE_GOLDENS").unwrap_or_default();
    asked.split(',').any(|word| word == name || (word == "all" || word == "models") && name != "models")
}

/// A small model of a sample photograph, and its tree on the device.
fn tree(renderer: &Renderer, name: &str) -> Tree {
    let path = folder().join(name).with_extension("glb");
    if renewing("models") {
        let made = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
        let photo = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("photos/{name}.jpg"));
        let run = Command::new(env!("CARGO_BIN_EXE_sphereboard"))
            .args(["model", "--detail", "low", "--texture-size", "256", "--height-m", "10", "--out"])
            .args([made.path(), &photo])
            .output()
            .unwrap();
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        fs::copy(made.path().join(format!("{name}.glb")), &path).unwrap();
    }
    let bytes = fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}; UPDATE_GOLDENS=models makes it", path.display()));
    let model = glb::read(&bytes).unwrap_or_else(|e| panic!("{}: {e}; UPDATE_GOLDENS=models makes it anew", path.display()));
    renderer.upload(&model.parts()).unwrap().growing(model.about.growth)
}

/// Draws a case.
fn draw(renderer: &mut Renderer, [oak, spruce]: &[Tree; 2], case: &Case) -> RgbaImage {
    let at = |x: f32, z: f32| [Instance { position: [x, 0.0, z], ..Instance::IDENTITY }];
    let (middle, left, right) = (at(0.0, 0.0), at(-1.8, -3.0), at(2.0, 2.0));
    let (stands, target, distance_m) = match case.trees {
        Trees::Oak => (vec![Stand { tree: oak, instances: &middle }], Vec3::Y * 5.0, 22.5),
        Trees::Spruce => (vec![Stand { tree: spruce, instances: &middle }], Vec3::Y * 5.0, 22.5),
        Trees::Both => {
            (vec![Stand { tree: oak, instances: &left }, Stand { tree: spruce, instances: &right }], Vec3::Y * 4.8, 27.0)
        }
    };
    let camera = Camera::orbit(target, case.azimuth_deg.to_radians(), case.elevation_deg.to_radians(), distance_m);
    let shot = Shot {
        stage: case.stage,
        background: case.background,
        wind: WindParams { wind: case.wind_m_s, time: 1.3, ..WindParams::default() },
        ..Shot::new(camera, SIZE_PX)
    };
    renderer.picture(&shot, &stands).unwrap().color
}

/// The figures of two pictures: over black and over white the worse of both.
fn figures(golden: &RgbaImage, picture: &RgbaImage) -> Limits {
    let [black, white] = [[0; 3], [255; 3]].map(|below| flip(&over(golden, below), &over(picture, below)).unwrap());
    let iou = silhouette_iou(&silhouette(golden), &silhouette(picture)).unwrap();
    Limits { mean: black.mean.max(white.mean), p99: black.p99.max(white.p99), iou }
}

/// Compares a picture with the golden one of that path; the complaint when it is not like it.
fn judge(path: &Path, picture: &RgbaImage, limits: Limits) -> Result<(), String> {
    let golden = image::open(path).map_err(|e| format!("{}: {e}", path.display()))?.into_rgba8();
    if golden.dimensions() != picture.dimensions() {
        return Err(format!("{} has {:?} pixels, the picture {:?}", path.display(), golden.dimensions(), picture.dimensions()));
    }
    let found = figures(&golden, picture);
    let fine = found.mean <= limits.mean && found.p99 <= limits.p99 && found.iou >= limits.iou;
    if fine { Ok(()) } else { Err(format!("{}: {found:?} against {limits:?}", path.display())) }
}

/// Draws every case and compares, or renews what `UPDATE_GOLDENS` names.
fn compare_all(mut renderer: Renderer, limits: Limits, renew: bool) {
    let info = &renderer.gpu.info;
    let about = format!("{}, {} {}", info.name, info.driver, info.driver_info);
    let trees = ["oak", "spruce"].map(|name| tree(&renderer, name));
    let left = Path::new(env!("CARGO_TARGET_TMPDIR")).join("golden");
    fs::create_dir_all(&left).unwrap();
    let mut complaints = vec![];
    for case in &CASES {
        let picture = draw(&mut renderer, &trees, case);
        let path = folder().join(case.name).with_extension("png");
        if renew && renewing(case.name) {
            fs::write(&path, png(&picture).unwrap()).unwrap();
        }
        if let Err(complaint) = judge(&path, &picture, limits) {
            let drawn = left.join(case.name).with_extension("png");
            fs::write(&drawn, png(&picture).unwrap()).unwrap();
            complaints.push(format!("{complaint}; drawn: {}", drawn.display()));
        }
    }
    assert!(
        complaints.is_empty(),
        "on {about}:\n{}\nIf the change is meant: UPDATE_GOLDENS=all cargo test --test golden",
        complaints.join("\n")
    );
}

#[test]
fn the_software_driver_draws_the_golden_pictures() {
    if let Some(renderer) = software_renderer() {
        compare_all(renderer, SOFTWARE, true);
    }
}

#[test]
fn a_real_gpu_draws_nearly_the_same() {
    match Gpu::open(&AdapterChoice::Gpu) {
        Ok(gpu) => compare_all(Renderer::new(gpu).unwrap(), GPU, false),
        Err(_) => eprintln!("SKIPPED: no real GPU here; the pictures were compared on the software driver"),
    }
}

/// A golden picture as it is in the repository.
fn golden(name: &str) -> (PathBuf, RgbaImage) {
    let path = folder().join(name).with_extension("png");
    let picture = image::open(&path).unwrap().into_rgba8();
    (path, picture)
}

#[test]
fn a_damaged_picture_fails() {
    for name in ["unshaped", "lit", "lit_sky", "two", "needles"] {
        let (path, picture) = golden(name);
        judge(&path, &picture, SOFTWARE).unwrap();
        let [width, height] = SIZE_PX;
        let shifted = RgbaImage::from_fn(width, height, |x, y| *picture.get_pixel(x.saturating_sub(1), y));
        let mut darker = picture.clone();
        darker.pixels_mut().for_each(|Rgba([r, g, b, _])| [r, g, b].into_iter().for_each(|v| *v = (0.95 * f32::from(*v)) as u8));
        let mut holed = picture.clone();
        (0..16).for_each(|y| (0..16).for_each(|x| holed.put_pixel(112 + x, 100 + y, Rgba([0; 4]))));
        for (damage, damaged) in [("shifted by 1 px", shifted), ("5 % darker", darker), ("with a hole of 16 px", holed)] {
            println!("{name} {damage}: {:?}", figures(&picture, &damaged));
            assert!(judge(&path, &damaged, SOFTWARE).is_err(), "{name} {damage} passes: {:?}", figures(&picture, &damaged));
        }
    }
}

#[test]
fn a_missing_unreadable_or_wrong_sized_golden_fails() {
    let (path, picture) = golden("lit");
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let complaint = |path: &Path| judge(path, &picture, GPU).unwrap_err();
    assert!(complaint(&folder.path().join("none.png")).contains("none.png"));
    let broken = folder.path().join("broken.png");
    let bytes = fs::read(path).unwrap();
    fs::write(&broken, &bytes[..bytes.len() / 2]).unwrap();
    assert!(complaint(&broken).contains("broken.png"));
    let small = folder.path().join("small.png");
    image::imageops::thumbnail(&picture, 120, 120).save(&small).unwrap();
    assert!(complaint(&small).contains("(120, 120)"));
}

#[test]
fn every_golden_picture_has_its_case() {
    let mut names: Vec<String> = fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "png"))
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let mut wanted: Vec<_> = CASES.iter().map(|case| case.name).collect();
    wanted.sort_unstable();
    assert_eq!(names, wanted);
}
