//! Prints the table of intersection over union of our crowns with masks drawn by people.
//!
//! `cargo run --release --example eval_segmentation -- METHOD FOLDER_OF_PAIRS [OUT_DIR]`; the folder holds `PAIRS.csv`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;
use sphereboard::params::ParamSet;
use sphereboard::photo::{Hints, Photo, SegmentParams, segment::segment};
use sphereboard::raster::Mask;

struct Row {
    image: PathBuf,
    masks: Vec<PathBuf>,
}

fn pairs(folder: &Path) -> Vec<Row> {
    let table = std::fs::read_to_string(folder.join("PAIRS.csv")).expect("PAIRS.csv in the folder");
    let rows = table.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
    let wanted = |r: &Vec<&str>| ["human", "exact-alpha", "drawn"].contains(&r[3]) && r[4] == "yes" && r[5] == "yes";
    rows.filter(wanted)
        .map(|r| Row {
            image: folder.join(r[0]),
            masks: r[1..3].iter().filter(|m| !m.is_empty()).map(|m| folder.join(m)).collect(),
        })
        .collect()
}

/// Pictures of a folder whose crown lies in another as `<stem>_crown.png`.
fn drawn(photos: &Path, masks: &Path) -> Vec<Row> {
    let mut files: Vec<_> = std::fs::read_dir(photos).expect("a folder").map(|e| e.expect("readable").path()).collect();
    files.sort();
    files
        .into_iter()
        .map(|image| {
            let stem = image.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            Row { image, masks: vec![masks.join(format!("{stem}_crown.png"))] }
        })
        .filter(|r| r.masks[0].exists())
        .collect()
}

/// 0 for a mask of another size.
fn same_size_iou(a: &Mask, b: &Mask) -> f64 {
    if (a.width(), a.height()) == (b.width(), b.height()) { a.iou(b) } else { 0.0 }
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let mut params = SegmentParams::default();
    params.set("method", &args[0]).expect("auto or hsv");
    let folder = Path::new(&args[1]);
    let rows = if folder.join("PAIRS.csv").exists() { pairs(folder) } else { drawn(folder, Path::new(&args[2])) };
    let out = args.get(3).map(PathBuf::from);
    let results: Vec<(String, f64, String)> = rows
        .par_iter()
        .map(|row| {
            let name = row.image.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let photo = Photo { image: image::open(&row.image).expect("a picture").to_rgb8(), opaque: None };
            let start = Instant::now();
            let result = segment(&photo, &params, &Hints::default());
            let ms = start.elapsed().as_secs_f64() * 1e3;
            match result {
                Ok(s) => {
                    let best = row
                        .masks
                        .iter()
                        .map(|m| same_size_iou(&Mask::from_gray(&image::open(m).expect("a mask").to_luma8()), &s.crown))
                        .fold(0.0, f64::max);
                    if let Some(out) = &out {
                        std::fs::create_dir_all(out).expect("a folder for the masks");
                        photo.image.save(out.join(format!("{name}.photo.png"))).expect("a written photo");
                        s.crown.to_gray().save(out.join(format!("{name}.mask.png"))).expect("a written mask");
                        s.tree.to_gray().save(out.join(format!("{name}.tree.png"))).expect("a written mask");
                    }
                    (name, best, format!("{ms:.0} ms {:?}", s.warnings.iter().map(|w| &w.code).collect::<Vec<_>>()))
                }
                Err(e) => (name, 0.0, e.to_string()),
            }
        })
        .collect();
    let mut ious: Vec<f64> = results.iter().map(|r| r.1).collect();
    for (name, iou, note) in &results {
        println!("{iou:.3}  {name:40} {note}");
    }
    ious.sort_by(f64::total_cmp);
    let n = ious.len().max(1);
    let low = ious.iter().filter(|&&v| v < 0.5).count();
    println!("mean {:.3}  median {:.3}  below 0.5: {low} of {}", ious.iter().sum::<f64>() / n as f64, ious[n / 2], ious.len());
}
