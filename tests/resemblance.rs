//! Models look like their photographs: drawn from the photograph's viewpoint, the silhouette is that of the mask and the unlit colour
//! that of the crown.

mod common;

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use sphereboard::model::pipeline::{self, ModelParams, ModelRun, Request, View};
use sphereboard::photo::{DecodeParams, Hints, decode};
use sphereboard::report::resemblance::{Resemblance, measure};
use sphereboard::{Seed, files};

/// Least intersection over union of the silhouettes, outline grown.
const LEAST_IOU: f64 = 0.90;
/// Largest CIEDE2000 between the crowns' means.
const LARGEST_DELTA_E: f64 = 5.0;

fn model(path: &Path) -> Option<(View, ModelRun)> {
    let view = View { photo: decode::decode(path, &DecodeParams::default()).ok()?, hints: Hints::default(), azimuth_rad: 0.0 };
    let request = Request {
        views: std::slice::from_ref(&view),
        params: &ModelParams::default(),
        height_is_given: false,
        seed: Seed(1),
        sources: vec![],
    };
    let run = pipeline::run(&request, &|_| ()).ok()?;
    Some((view, run))
}

fn photographs(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    let is_photo = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let ends = |endings: &[&str]| endings.iter().any(|end| name.ends_with(end));
        ends(&[".jpg", ".png"]) && !ends(&["_mask.png", "_crown.png", "_gaps.png", ".tree.png", ".crown.png"])
    };
    paths.retain(is_photo);
    paths.sort();
    paths
}

/// Every photograph of a folder that can be modelled, by name.
fn resemblances(folder: &Path) -> Option<Vec<(String, Resemblance)>> {
    let mut renderer = common::software_renderer()?;
    let runs: Vec<_> = photographs(folder).into_par_iter().filter_map(|path| Some((path.clone(), model(&path)?))).collect();
    let measured = |(path, (view, run)): (PathBuf, (View, ModelRun))| {
        (path.file_stem().unwrap().to_string_lossy().into_owned(), measure(&mut renderer, &view.photo, &run).unwrap())
    };
    Some(runs.into_iter().map(measured).collect())
}

fn check(found: &[(String, Resemblance)]) {
    let unlike = |r: &Resemblance| r.iou < LEAST_IOU || r.delta_e > LARGEST_DELTA_E;
    let faults: Vec<String> = found
        .iter()
        .filter(|(_, r)| unlike(r))
        .map(|(name, r)| format!("{name}: IoU {:.3}, ΔE2000 {:.2}", r.iou, r.delta_e))
        .collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn models_of_the_samples_look_like_them() {
    if let Some(found) = resemblances(Path::new("photos")) {
        assert!(found.len() >= 2, "too few samples could be modelled");
        check(&found);
    }
}

#[test]
fn models_of_the_shared_photographs_look_like_them() {
    let Some(shared) = files::shared_folder() else {
        return eprintln!("SKIPPED: the shared photographs are not there; set SPHEREBOARD_SHARED");
    };
    if let Some(found) = resemblances(&shared.join("photos/single")) {
        assert!(found.len() >= 40, "only {} photographs could be modelled", found.len());
        check(&found);
    }
}

#[test]
fn a_model_of_another_photograph_is_noticed() {
    let Some(mut renderer) = common::software_renderer() else { return };
    let mut runs: Vec<_> = photographs(Path::new("photos")).iter().filter_map(|path| model(path)).collect();
    let ((photo, mut first), (_, second)) = (runs.remove(0), runs.remove(0));
    first.model = second.model;
    let seen = measure(&mut renderer, &photo.photo, &first).unwrap();
    assert!(seen.iou < LEAST_IOU, "IoU {:.3} for the wrong tree", seen.iou);
}
