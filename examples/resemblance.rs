//! Every photograph beside its model drawn from the photograph's viewpoint: contact sheets and a table of silhouette IoU and ΔE2000.
//!
//! `cargo run --release --example resemblance [FOLDER] [PHOTO...]`, by default the photographs of `photos/` and, where present,
//! `../shared/photos/single` into `results/local/resemblance`; `make sheets` runs it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::model::pipeline::{self, ModelParams, ModelRun, Request, View};
use sphereboard::photo::{DecodeParams, Hints, decode};
use sphereboard::raster::png;
use sphereboard::render::Renderer;
use sphereboard::report::{draw, resemblance};
use sphereboard::{Result, Seed, files};

/// Rows per sheet.
const ROWS: usize = 4;

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let out = arguments.next().unwrap_or_else(|| "results/local/resemblance".into());
    let mut photos: Vec<PathBuf> = arguments.collect();
    if photos.is_empty() {
        photos = photographs(Path::new("photos"));
        match files::shared_folder() {
            Some(shared) => photos.extend(photographs(&shared.join("photos/single"))),
            None => println!("SKIPPED: the shared photographs are not there; set SPHEREBOARD_SHARED"),
        }
    }
    let _folder = files::ready_folder(&out)?;
    let runs: Vec<Result<(View, ModelRun)>> = photos.par_iter().map(|path| model(path)).collect();
    let mut renderer = Renderer::new(Gpu::open(&AdapterChoice::Software)?)?;
    let mut table = String::from("photograph,silhouette_iou,silhouette_iou_with_gaps,silhouette_iou_unshaped,delta_e2000\n");
    let mut pictures = Vec::new();
    for (path, run) in photos.iter().zip(runs) {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        match run {
            Ok((view, run)) => {
                let seen = resemblance::measure(&mut renderer, &view.photo, &run)?;
                println!(
                    "{:>2}.{} {name}: IoU {:.3} (with gaps {:.3}, unshaped {:.3}), ΔE2000 {:.2}",
                    pictures.len() / ROWS + 1,
                    pictures.len() % ROWS + 1,
                    seen.iou,
                    seen.iou_with_gaps,
                    seen.iou_unshaped,
                    seen.delta_e
                );
                let _ = writeln!(
                    table,
                    "{name},{:.4},{:.4},{:.4},{:.3}",
                    seen.iou, seen.iou_with_gaps, seen.iou_unshaped, seen.delta_e
                );
                pictures.push(seen.picture);
            }
            Err(error) => println!("not modelled: {name}: {error}"),
        }
    }
    for (number, rows) in pictures.chunks(ROWS).enumerate() {
        files::write_whole(&out.join(format!("{:02}.png", number + 1)), &png(&draw::stacked(rows, 6))?)?;
    }
    files::write_whole(&out.join("resemblance.csv"), table.as_bytes())
}

fn model(path: &Path) -> Result<(View, ModelRun)> {
    let view = View { photo: decode::decode(path, &DecodeParams::default())?, hints: Hints::default(), azimuth_rad: 0.0 };
    let request = Request {
        views: std::slice::from_ref(&view),
        params: &ModelParams::default(),
        height_is_given: false,
        seed: Seed(1),
        sources: vec![path.display().to_string()],
    };
    let run = pipeline::run(&request, &|_| ())?;
    Ok((view, run))
}

fn photographs(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("jpg")));
    paths.sort();
    paths
}
