//! Every metric on pictures of trees with a known fault: each fault is noticed by the figures that should notice it.
//!
//! The pictures and our figures of them are left in `target/tmp/metrics/`, where `sphereboard-tools check-metrics` has NVIDIA's
//! flip-evaluator, scikit-image and OpenImageIO say theirs.

use std::fs;
use std::path::{Path, PathBuf};

use image::{Rgba, RgbaImage, imageops};
use serde_json::json;
use sphereboard::compare::BACKGROUNDS;
use sphereboard::metrics::{self, PIXELS_PER_DEGREE, silhouette};
use sphereboard::raster::png;

/// All figures of a pair, the first the truth.
#[derive(serde::Serialize)]
struct Found {
    /// Mean and 99th percentile over each background.
    flip: Vec<metrics::Flip>,
    /// Over each background.
    ssim: Vec<f64>,
    iou: f64,
    hausdorff_px: f64,
    area: f64,
    delta_e: f64,
    rms: f64,
}

impl Found {
    fn of(truth: &RgbaImage, test: &RgbaImage) -> Self {
        let over = BACKGROUNDS.map(|below| [truth, test].map(|picture| metrics::over(picture, below)));
        let [a, b] = [truth, test].map(silhouette);
        Self {
            flip: over.iter().map(|[a, b]| metrics::flip(a, b).unwrap()).collect(),
            ssim: over.iter().map(|[a, b]| metrics::ssim(a, b).unwrap()).collect(),
            iou: metrics::silhouette_iou(&a, &b).unwrap(),
            hausdorff_px: metrics::hausdorff_px(&a, &b).unwrap(),
            area: metrics::covered_area_error(&a, &b),
            delta_e: metrics::mean_color_difference(truth, test).unwrap(),
            rms: metrics::difference_of_pictures(truth, test, 0.0).unwrap().rms,
        }
    }

    fn flip(&self) -> f64 {
        self.flip.iter().map(|flip| flip.mean).sum::<f64>() / self.flip.len() as f64
    }
}

fn golden(name: &str) -> RgbaImage {
    image::open(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)).unwrap().into_rgba8()
}

/// Leaves a pair, each cut to the same size, and gives our figures.
fn leave(name: &str, truth: &RgbaImage, test: &RgbaImage) -> Found {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("metrics");
    fs::create_dir_all(&folder).unwrap();
    let files = [format!("{name}.truth.png"), format!("{name}.test.png")];
    for (file, picture) in files.iter().zip([truth, test]) {
        fs::write(folder.join(file), png(picture).unwrap()).unwrap();
    }
    let found = Found::of(truth, test);
    let row = json!({ "files": files, "pixels_per_degree": PIXELS_PER_DEGREE, "backgrounds": BACKGROUNDS, "ours": found });
    fs::write(folder.join(name).with_extension("json"), serde_json::to_string_pretty(&row).unwrap()).unwrap();
    found
}

#[test]
fn planted_faults_are_noticed_by_the_figures_that_should() {
    let oak = golden("lit.png");
    let same = leave("same", &oak, &oak);
    assert!(same.flip() == 0.0 && same.ssim == [1.0; 2] && same.iou == 1.0 && same.hausdorff_px == 0.0, "the same picture");
    assert!(same.area == 0.0 && same.delta_e == 0.0 && same.rms == 0.0, "the same picture");

    let shifted = RgbaImage::from_fn(oak.width(), oak.height(), |x, y| *oak.get_pixel(x.saturating_sub(1), y));
    let shifted = leave("shifted", &oak, &shifted);
    assert!(shifted.flip() > 0.02 && shifted.ssim.iter().all(|&s| s < 0.95), "{}", shifted.flip());
    assert!(shifted.iou < 0.995 && shifted.hausdorff_px >= 1.0 && shifted.delta_e < 0.1, "{} {}", shifted.iou, shifted.delta_e);

    let mut darker = oak.clone();
    darker
        .pixels_mut()
        .for_each(|Rgba([r, g, b, _])| [r, g, b].into_iter().for_each(|v| *v = (0.95 * f32::from(*v)).round() as u8));
    let darker = leave("darker", &oak, &darker);
    assert!(darker.flip() > 0.005 && darker.delta_e > 0.8 && darker.rms > 0.003, "{} {}", darker.flip(), darker.delta_e);
    assert!(darker.iou == 1.0 && darker.hausdorff_px == 0.0, "being darker moves no outline");

    let mirrored = leave("mirrored", &oak, &imageops::flip_horizontal(&oak));
    assert!(mirrored.flip() > 0.05 && mirrored.iou < 0.9 && mirrored.hausdorff_px > 10.0, "{} {}", mirrored.flip(), mirrored.iou);
    assert!(mirrored.delta_e < 0.01 && mirrored.area == 0.0, "a mirror changes no tone and no area");

    // A branch that sticks out: the leftmost tenth of the crown at some height.
    let mut missing = oak.clone();
    (0..70).flat_map(|x| (140..185).map(move |y| (x, y))).for_each(|(x, y)| missing.put_pixel(x, y, Rgba([0; 4])));
    let missing = leave("branch_missing", &oak, &missing);
    assert!(missing.hausdorff_px > 5.0 && missing.area < -0.02 && missing.iou < 0.98, "{} {}", missing.hausdorff_px, missing.area);
    assert!(missing.flip() > 0.005 && missing.flip.iter().all(|flip| flip.p99 > 4.0 * flip.mean), "{}", missing.flip());
}

/// No faults but what stand-ins really look like: silhouettes frayed, tones off, windows that hold little.
#[test]
fn stand_ins_are_left_for_others_to_judge() {
    leave("view", &golden("lit.png"), &golden("lit_45.png"));
    leave("not_smoothed", &golden("antialiased.png"), &golden("reshaped.png"));
    for (truth, test) in [("geometry.broadleaf", "octahedral.broadleaf"), ("geometry.conifer", "billboard.conifer")] {
        let [a, b] = [truth, test].map(|name| golden(&format!("methods/{name}.png")));
        let found = leave(&test.replace('.', "_"), &a, &b);
        assert!(found.flip() > 0.0 && found.iou > 0.2, "{test}: {} {}", found.flip(), found.iou);
    }
}

/// The oak drifts by a pixel a frame; in the other film it pops once and is darker from then on. Left for ColorVideoVDP's own program.
#[test]
fn a_film_that_pops_is_left_with_our_quality_of_it() {
    let oak = metrics::over(&golden("lit.png"), BACKGROUNDS[0]);
    let frame = |shift: u32| imageops::crop_imm(&oak, shift, 20, 200, 200).to_image();
    let truth: Vec<_> = (0..16).map(frame).collect();
    let mut popping: Vec<_> = (0..16).map(|n| frame(if n == 8 { 20 } else { n })).collect();
    popping[9..].iter_mut().flat_map(|frame| frame.pixels_mut()).for_each(|p| p.0 = p.0.map(|v| (0.9 * f32::from(v)) as u8));
    let jod = metrics::film_quality_jod(&truth, &popping).unwrap();
    // What the Python package `cvvdp` 0.5.7 said of these frames on 22 Nov 2026.
    assert!((jod - 5.496_884).abs() < 1e-4, "{jod}");
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("film");
    fs::create_dir_all(&folder).unwrap();
    for (name, film) in [("truth", &truth), ("test", &popping)] {
        for (number, frame) in film.iter().enumerate() {
            let bytes = png(&image::DynamicImage::from(frame.clone()).into_rgba8()).unwrap();
            fs::write(folder.join(format!("{name}_{number:02}.png")), bytes).unwrap();
        }
    }
    fs::write(folder.join("film.json"), json!({ "jod": jod, "frames_per_second": metrics::FRAMES_PER_SECOND }).to_string())
        .unwrap();
}
