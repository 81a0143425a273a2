//! The photographs of `photos/` are what `sphereboard photograph` takes: each is taken anew, four times smaller, and compared with the
//! committed one reduced. Other drivers draw a few leaves otherwise, and JPEG has its noise.

mod common;

use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use image::{GrayImage, RgbImage, imageops};
use sphereboard::metrics::flip;
use sphereboard::raster::Mask;

/// Most that a person sees between the two, FLIP's mean: 0.065 to 0.085 on the machine where they were taken, since a sample sees other
/// levels of the leaves' pictures; another tree gives more than twice as much as is allowed.
const LARGEST_FLIP: f64 = 0.11;
/// Least intersection over union of the masks: 0.93 for the birch, whose leaves are smaller than the reduced pixels, to 0.99.
const LEAST_IOU: f64 = 0.90;
/// How many times smaller.
const SMALLER: u32 = 4;

fn photos() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("photos")
}

fn photograph(arguments: &[&str]) -> Output {
    Command::cargo_bin("sphereboard").unwrap().arg("photograph").args(arguments).output().unwrap()
}

/// Name and arguments of every photograph.
fn listed() -> Vec<(String, Vec<String>)> {
    let text = std::fs::read_to_string(photos().join("photos.list")).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
    let words = lines.map(|line| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>());
    words.map(|words| (words[0].clone(), words[1..].to_vec())).collect()
}

fn color(path: &Path) -> RgbImage {
    image::open(path).unwrap().into_rgb8()
}

fn mask(path: &Path) -> GrayImage {
    let mask = image::open(path).unwrap().into_luma8();
    assert!(mask.pixels().all(|p| p[0] == 0 || p[0] == 255), "{}", path.display());
    mask
}

#[test]
fn the_committed_photographs_are_what_the_list_says() {
    if common::software_gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let listed = listed();
    assert_eq!(listed.len(), 6);
    let mut before: Option<RgbImage> = None;
    for (name, arguments) in &listed {
        let old = color(&photos().join(format!("{name}.jpg")));
        let (width, height) = (old.width() / SMALLER, old.height() / SMALLER);
        let out = folder.path().join(format!("{name}.jpg"));
        let (size, out_text) = (format!("{width}x{height}"), out.to_str().unwrap());
        let mut words: Vec<&str> = arguments.iter().map(String::as_str).collect();
        words.extend(["--size", &size, "--supersampling", "4", "--grain", "0", "--adapter", "software", "--out", out_text]);
        let output = photograph(&words);
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let new = color(&out);
        let seen = flip(&imageops::resize(&old, width, height, imageops::FilterType::Triangle), &new).unwrap();
        println!("{name}: FLIP {:.3}", seen.mean);
        assert!(seen.mean < LARGEST_FLIP, "{name}: FLIP {:.3}", seen.mean);
        if let Some(other) = before.replace(new) {
            let unlike = flip(&imageops::resize(&old, width, height, imageops::FilterType::Triangle), &other).unwrap();
            assert!(unlike.mean > 2.0 * LARGEST_FLIP, "{name}: FLIP {:.3} with another photograph", unlike.mean);
        }
        for kind in ["crown", "tree"] {
            let old = mask(&photos().join(format!("{name}.{kind}.png")));
            let old = imageops::resize(&old, width, height, imageops::FilterType::Triangle);
            let iou = Mask::from_gray(&old).iou(&Mask::from_gray(&mask(&out.with_extension(format!("{kind}.png")))));
            println!("{name}: {kind} IoU {iou:.3}");
            assert!(iou > LEAST_IOU, "{name}: {kind} IoU {iou:.3}");
        }
    }
}

#[test]
fn the_committed_photographs_are_small_files_with_masks_that_fit_them() {
    for (name, _) in listed() {
        let path = photos().join(format!("{name}.jpg"));
        assert!(std::fs::metadata(&path).unwrap().len() <= 400 << 10, "{name}");
        let size = color(&path).dimensions();
        let [tree, crown] = ["tree", "crown"].map(|kind| mask(&path.with_extension(format!("{kind}.png"))));
        assert_eq!((tree.dimensions(), crown.dimensions()), (size, size), "{name}");
        let (tree, crown) = (Mask::from_gray(&tree), Mask::from_gray(&crown));
        assert!(crown == crown.without_holes(), "{name}: the crown's holes are filled");
        let both = tree.zip(&crown, |t, c| t && c).count();
        assert!(both * 10 > crown.count() * 7, "{name}: most of the crown is tree");
    }
}

#[test]
fn what_cannot_be_photographed_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("p.jpg");
    let out = out.to_str().unwrap();
    for (arguments, code, expected) in [
        (&["no-such-tree", "--out", out][..], 2, "expected a preset (oak, "),
        (&["juniper", "--out", "p.png"], 2, "ends in .jpg"),
        (&["juniper", "--out", out, "--azimuth-deg", "east"], 2, "--azimuth-deg must be an angle from -360 to 360°"),
        (&["juniper", "--out", out, "--lens-mm", "1"], 2, "--lens-mm must be 10 to 1200 mm"),
        (&["juniper", "--out", out, "--quality", "0"], 2, "--quality must be a whole number from 1 to 100"),
    ] {
        let output = photograph(arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{message}");
        assert!(message.contains(expected) && message.lines().count() == 1, "{message}");
    }
    if common::software_gpu().is_some() {
        let output = photograph(&["juniper", "--adapter", "software", "--elevation-deg", "-40", "--out", out]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && message.contains("below the ground"), "{message}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is written");
}
