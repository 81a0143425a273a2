//! The circle closes: a tree is grown, photographed, modelled from its photograph, and the model held against the tree. Silhouettes of
//! the crowns, holes filled, in parallel projection and in metres: from the photographed side, and from 90° round.
//!
//! One photograph says nothing of a crown's depth. A sphere-board takes it to be round about its trunk, and stands in one piece, so that
//! its figures from the side are those of trees that are so; every preset is listed with what it reaches.

mod common;

use std::f32::consts::FRAC_PI_2;

use Found::{Automatically, ByTheExactMask};
use sphereboard::model::grown::grow_preset;
use sphereboard::model::pipeline::{self, ModelParams, Request, SizeParams, View};
use sphereboard::model::reference::{Asked, ReferenceTree};
use sphereboard::photo::{Hints, Photo};
use sphereboard::plant::presets::{PRESETS, preset};
use sphereboard::render::Renderer;
use sphereboard::report::circle::{agreement, surveyed_height_m};
use sphereboard::report::studio::{Photograph, Sitting, StudioParams, photograph};
use sphereboard::{Result, Seed};

/// Least IoU from the photographed side, and from 90°, that issue 4 asks for.
const ASKED: [f64; 2] = [0.85, 0.75];

/// How the crown was found in the photograph.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Found {
    Automatically,
    /// As `--mask P.crown.png` does it.
    ByTheExactMask,
}

/// A tree, how its crown was found, and the IoU from both sides that its model reached when this was written.
type Row = (&'static str, u64, Found, [f64; 2]);

/// Trees that reach [`ASKED`].
const REACH_WHAT_IS_ASKED: [Row; 6] = [
    ("lime", 2, Automatically, [0.901, 0.789]),
    ("lime", 5, Automatically, [0.882, 0.783]),
    ("juniper", 1, ByTheExactMask, [0.886, 0.830]),
    ("yew", 1, ByTheExactMask, [0.895, 0.784]),
    ("birch", 4, ByTheExactMask, [0.880, 0.787]),
    ("willow", 1, ByTheExactMask, [0.879, 0.779]),
];

/// The first seed of every other preset, and why.
const DO_NOT: [Row; 6] = [
    // One-sided limbs.
    ("oak", 1, ByTheExactMask, [0.803, 0.684]),
    // Standing off its foot to one side in depth, which a photograph does not show.
    ("poplar", 1, ByTheExactMask, [0.855, 0.654]),
    // Another birch than the one above: its crown is deeper on one side.
    ("birch", 1, ByTheExactMask, [0.856, 0.654]),
    // Whorls with the sky between them.
    ("spruce", 1, ByTheExactMask, [0.780, 0.730]),
    // A plate, seen from below: its near edge hides its height.
    ("acacia", 1, ByTheExactMask, [0.667, 0.562]),
    // Several crowns, of which one photograph does not show the depth.
    ("pine", 1, ByTheExactMask, [0.351, 0.332]),
];

/// Model against tree: IoU from the photographed side and from 90°.
fn ious(renderer: &mut Renderer, truth: &ReferenceTree, taken: Photograph, taken_from_rad: f32, found: Found) -> Result<Vec<f64>> {
    let mask = (found == ByTheExactMask).then_some(taken.crown);
    let photo = Photo { image: taken.image, opaque: None };
    let view = View { photo, hints: Hints { mask, ..Hints::default() }, azimuth_rad: 0.0 };
    let size = SizeParams { height_m: surveyed_height_m(renderer, truth, taken_from_rad)? };
    let params = ModelParams { size, ..ModelParams::default() };
    let request = Request { views: &[view], params: &params, height_is_given: true, seed: Seed(1), sources: vec![] };
    let model = pipeline::run(&request, &|_| ())?.model;
    agreement(renderer, truth, &model, taken_from_rad, &[taken_from_rad, taken_from_rad + FRAC_PI_2])
}

/// Once round the circle.
fn round(renderer: &mut Renderer, name: &str, seed: u64, found: Found) -> Vec<f64> {
    let parts = grow_preset(preset(name).unwrap(), Seed(seed)).unwrap().parts;
    let truth = ReferenceTree::new(name.to_owned(), parts, &Asked::default()).unwrap();
    let params = StudioParams { supersampling: 2, lens_mm: 85.0, ..StudioParams::default() };
    let sitting = Sitting { size_px: [600, 780], params, ..Sitting::default() };
    let taken = photograph(renderer, &truth, None, &sitting, &|| ()).unwrap();
    ious(renderer, &truth, taken, 0.0, found).unwrap()
}

/// Every row within 0.03 of its figures, or better; other drivers place a few pixels otherwise.
fn check(rows: &[Row]) -> Option<Vec<Vec<f64>>> {
    let mut renderer = common::software_renderer()?;
    let measured: Vec<Vec<f64>> = rows.iter().map(|(name, seed, found, _)| round(&mut renderer, name, *seed, *found)).collect();
    let mut faults = vec![];
    for ((name, seed, found, known), now) in rows.iter().zip(&measured) {
        println!("{name} {seed} {found:?}: {:.3} from the front, {:.3} from the side", now[0], now[1]);
        if now.iter().zip(known).any(|(now, known)| *now < known - 0.03) {
            faults.push(format!("{name} {seed}: {now:.3?}, was {known:.3?}"));
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    Some(measured)
}

#[test]
fn models_of_round_trees_agree_with_the_trees() {
    let Some(measured) = check(&REACH_WHAT_IS_ASKED) else { return };
    let reached = |ious: &Vec<f64>| ious.iter().zip(ASKED).all(|(iou, asked)| *iou >= asked);
    assert!(measured.iter().all(reached), "{measured:.3?}");
}

#[test]
fn models_of_other_trees_agree_as_well_as_they_did() {
    let listed = |name: &str| REACH_WHAT_IS_ASKED.iter().chain(&DO_NOT).any(|row| row.0 == name);
    assert!(PRESETS.iter().all(|preset| listed(preset.name)), "a preset is not listed");
    check(&DO_NOT);
}

/// From where the photograph is taken is the model's front: round a tree that is not round, only that azimuth fits.
#[test]
fn the_azimuth_of_the_photograph_counts() {
    let Some(mut renderer) = common::software_renderer() else { return };
    let parts = grow_preset(preset("birch").unwrap(), Seed(1)).unwrap().parts;
    let truth = ReferenceTree::new("birch".to_owned(), parts, &Asked::default()).unwrap();
    let params = StudioParams { supersampling: 2, lens_mm: 85.0, ..StudioParams::default() };
    let sitting = Sitting { size_px: [400, 520], azimuth_rad: 2.0, params, ..Sitting::default() };
    let mut against = |azimuth_rad| {
        let taken = photograph(&mut renderer, &truth, None, &sitting, &|| ()).unwrap();
        ious(&mut renderer, &truth, taken, azimuth_rad, ByTheExactMask).unwrap()[0]
    };
    let (right, wrong) = (against(2.0), against(0.0));
    assert!(right > 0.8 && wrong < right - 0.1, "{right:.3} {wrong:.3}");
}

#[test]
fn a_model_of_another_tree_is_noticed() {
    let Some(mut renderer) = common::software_renderer() else { return };
    let tree = |name: &str| {
        let parts = grow_preset(preset(name).unwrap(), Seed(1)).unwrap().parts;
        ReferenceTree::new(name.to_owned(), parts, &Asked::default()).unwrap()
    };
    let (lime, juniper) = (tree("lime"), tree("juniper"));
    let params = StudioParams { supersampling: 1, ..StudioParams::default() };
    let sitting = Sitting { size_px: [300, 390], params, ..Sitting::default() };
    let taken = photograph(&mut renderer, &juniper, None, &sitting, &|| ()).unwrap();
    let ious = ious(&mut renderer, &lime, taken, 0.0, ByTheExactMask).unwrap();
    assert!(ious[0] < 0.7, "{ious:?}");
}
