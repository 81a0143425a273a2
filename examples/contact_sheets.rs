//! Contact sheets of every photograph in `photos/` and, where present, `../shared/photos/{single,pairs}`, into `results/local/sheets`:
//! photograph | mask | mesh from the front | textured from the front, side and 45° above.
//!
//! `cargo run --release --example contact_sheets [FOLDER] [PHOTO...]`; `make sheets` runs it without arguments.

use std::path::{Path, PathBuf};

use image::RgbImage;
use rayon::prelude::*;
use sphereboard::model::pipeline::{self, ModelParams, Request, View};
use sphereboard::photo::{DecodeParams, Hints, decode};
use sphereboard::raster::png;
use sphereboard::report::{draw, sheet};
use sphereboard::{Result, Seed, files};

/// Height of a row, and rows per sheet.
const ROW_PX: u32 = 300;
const ROWS: usize = 6;

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let out = arguments.next().unwrap_or_else(|| "results/local/sheets".into());
    let named: Vec<PathBuf> = arguments.collect();
    let _folder = files::ready_folder(&out)?;
    let groups = if named.is_empty() { groups() } else { vec![("named".to_owned(), named)] };
    for (group, photos) in groups {
        let rows: Vec<(String, Result<RgbImage>)> =
            photos.par_iter().map(|photo| (photo.display().to_string(), row(photo))).collect();
        let mut drawn = Vec::new();
        for (name, row) in rows {
            match row {
                Ok(row) => {
                    println!("{group} {:>2}.{}: {name}", drawn.len() / ROWS + 1, drawn.len() % ROWS + 1);
                    drawn.push(row);
                }
                Err(error) => println!("{group} not modelled: {name}: {error}"),
            }
        }
        for (number, rows) in drawn.chunks(ROWS).enumerate() {
            let path = out.join(format!("{group}-{:02}.png", number + 1));
            files::write_whole(&path, &png(&draw::stacked(rows, 6))?)?;
            println!("{}", path.display());
        }
    }
    Ok(())
}

fn row(path: &Path) -> Result<RgbImage> {
    let photo = decode::decode(path, &DecodeParams::default())?;
    let views = [View { photo, hints: Hints::default(), azimuth_rad: 0.0 }];
    let request = Request {
        views: &views,
        params: &ModelParams::default(),
        height_is_given: false,
        seed: Seed(1),
        sources: vec![path.display().to_string()],
    };
    let run = pipeline::run(&request, &|_| ())?;
    sheet::row(&views[0].photo.image, &run, ROW_PX)
}

/// The folders, each with its photographs in order.
fn groups() -> Vec<(String, Vec<PathBuf>)> {
    let shared = files::shared_folder();
    if shared.is_none() {
        println!("SKIPPED: the shared photographs are not there; set SPHEREBOARD_SHARED");
    }
    let shared = shared
        .into_iter()
        .flat_map(|s| [("single".to_owned(), s.join("photos/single")), ("pairs".to_owned(), s.join("photos/pairs"))]);
    std::iter::once(("own".to_owned(), PathBuf::from("photos")))
        .chain(shared)
        .map(|(name, folder)| (name, photographs(&folder)))
        .collect()
}

fn photographs(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    let is_photo = |path: &PathBuf| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        (extension == "jpg" || extension == "png") && !["_mask", "_crown", "_gaps"].iter().any(|end| stem.ends_with(end))
    };
    paths.retain(is_photo);
    paths.sort();
    paths
}
