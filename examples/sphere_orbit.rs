//! Walks round far sphere-boards: how much they flicker where the picture taken from one side gives way to the next, and how much worse they
//! are between two of those sides than on them.
//!
//! `cargo run --release --example sphere_orbit OUT.csv [--presets a,b] [--methods a,b] [--heights 96,48] [--set key=value]… [--film DIR]`:
//! a quarter round each tree in steps of 2° at 12°, 45° and 70° above the horizon. `flicker` is the mean FLIP from frame to frame over the
//! truth's, `worst` the largest of its steps over the truth's same step; `flip` is against the truth, within 10° of an axis (where pictures
//! are taken), from 10° to 35° off and beyond. `--set` is for the sphere-board; `--film` gets every third frame, the truth's above.

use std::fmt::Write as _;
use std::path::PathBuf;

use image::{RgbImage, imageops};
use rayon::prelude::*;
use sphereboard::compare::{Figures, Plan, Profile, Seen, Stage, View, Views, coarser, finer};
use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::metrics::flip;
use sphereboard::model::reference::Asked;
use sphereboard::raster::{PngEffort, png_with};
use sphereboard::render::{Renderer, Shot};
use sphereboard::report::draw;
use sphereboard::repr::{self, Order, Settings, SoftwareCapture, TreeSource};
use sphereboard::{Result, Seed, files};

const STEP_DEG: f32 = 2.0;
const FRAMES: usize = 46;
const ELEVATIONS_DEG: [f32; 3] = [12.0, 45.0, 70.0];
/// Degrees off the axes: on them, between, and where two of them are as far.
const OFF_DEG: [f32; 3] = [10.0, 35.0, 45.1];

fn main() -> Result<()> {
    let mut words = std::env::args().skip(1);
    let out: PathBuf = words.next().expect("OUT.csv").into();
    let own = |all: &[&str]| all.iter().map(|s| (*s).to_owned()).collect::<Vec<String>>();
    let (mut presets, mut methods) = (own(&["oak", "birch", "spruce"]), own(&["sphere-board", "grid-slices"]));
    let (mut heights_px, mut settings, mut film) = (vec![96.0f32, 48.0], vec![], None);
    while let Some(word) = words.next() {
        let value = words.next().expect("a value after each option");
        let list = || value.split(',').map(str::to_owned).collect::<Vec<_>>();
        match word.as_str() {
            "--presets" => presets = list(),
            "--methods" => methods = list(),
            "--heights" => heights_px = list().iter().map(|h| h.parse().expect("pixels")).collect(),
            "--set" => settings.push(value),
            "--film" => film = Some(PathBuf::from(value)),
            _ => panic!("no option {word}"),
        }
    }
    let mut renderer = Renderer::new(Gpu::open(&AdapterChoice::Auto)?)?;
    let plan = Plan::new(Profile::Full, Views::Default, 128);
    let mut table = "preset,method,height_px,elevation_deg,flicker,worst,worst_at_deg,flip_on,flip_off,flip_between\n".to_owned();
    for preset in &presets {
        let (source, _) = TreeSource::open(preset, &Asked::default(), Seed(1))?;
        let stage = Stage { bounds: source.box_of_all()? };
        let built = |method: &str| {
            let set: &[String] = if method == "sphere-board" { &settings } else { &[] };
            let settings = Settings::parse(set.iter().map(String::as_str))?;
            repr::build(&Order { method, trunk: None, settings: &settings, seed: Seed(1) }, &source, &SoftwareCapture::new())
        };
        let mut walks = |method: &str, truth: bool| -> Result<Vec<Vec<Seen>>> {
            let tree = renderer.upload_built(&built(method)?)?;
            let mut walk = |height_px: f32, elevation_deg: f32| -> Result<Vec<Seen>> {
                let by = if truth { finer(height_px) } else { 1 };
                let view = |i: usize| View { azimuth_deg: STEP_DEG * i as f32, elevation_deg };
                // One window and angle for all frames: those that hold the tree from its widest side.
                let widest = (0..FRAMES).map(|i| stage.camera(view(i), height_px)).max_by_key(|(_, side)| *side);
                let (camera, side_px) = widest.expect("there are frames");
                let frame = |i: usize| {
                    let mut shot = stage.shot(view(i), height_px, plan.suns[0], None);
                    (shot.size_px, shot.camera.projection) = ([side_px * by; 2], camera.projection);
                    let seen = stage.see(&mut renderer, &tree, &Shot { ..shot })?;
                    Ok(if by > 1 { coarser(&seen, by) } else { seen })
                };
                (0..FRAMES).map(frame).collect()
            };
            heights_px.iter().flat_map(|&h| ELEVATIONS_DEG.map(|e| (h, e))).map(|(h, e)| walk(h, e)).collect()
        };
        let truths = walks("geometry", true)?;
        for method in &methods {
            let walks = walks(method, false)?;
            let places = heights_px.iter().flat_map(|&h| ELEVATIONS_DEG.map(|e| (h, e)));
            for ((height_px, elevation_deg), (truth, walk)) in places.zip(truths.iter().zip(&walks)) {
                let (of_truth, steps) = (steps(truth)?, steps(walk)?);
                let mean = |list: &[f64]| list.iter().sum::<f64>() / list.len() as f64;
                let worst =
                    steps.iter().zip(&of_truth).map(|(s, t)| s / t.max(1e-3)).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
                let (at, worst) = worst.expect("there are steps");
                let figures: Vec<f64> = truth
                    .par_iter()
                    .zip(walk)
                    .map(|(truth, test)| Figures::of(truth, test, stage.height_m()).map(|figures| figures.flip))
                    .collect::<Result<_>>()?;
                let off_deg = |i: usize| (STEP_DEG * i as f32).min(90.0 - STEP_DEG * i as f32);
                let within = |from: f32, to: f32| {
                    mean(&(0..FRAMES).filter(|&i| (from..to).contains(&off_deg(i))).map(|i| figures[i]).collect::<Vec<_>>())
                };
                let [on, off, between] = OFF_DEG;
                let _ = writeln!(
                    table,
                    "{preset},{method},{height_px},{elevation_deg},{:.3},{worst:.2},{:.0},{:.4},{:.4},{:.4}",
                    mean(&steps) / mean(&of_truth),
                    STEP_DEG * (at as f32 + 0.5),
                    within(0.0, on),
                    within(on, off),
                    within(off, between),
                );
                if let Some(folder) = &film {
                    let _folder = files::ready_folder(folder)?;
                    let row = |frames: &[Seen]| {
                        let panel = |seen: &Seen| {
                            let picture = seen.over(0);
                            imageops::resize(&picture, 2 * picture.width(), 2 * picture.height(), imageops::FilterType::Nearest)
                        };
                        draw::side_by_side(&frames.iter().step_by(3).map(panel).collect::<Vec<_>>(), 2)
                    };
                    let rows: Vec<RgbImage> = [truth, walk].into_iter().map(|frames| row(frames)).collect();
                    let name = format!("{preset}_{method}_{height_px}_{elevation_deg}.png");
                    files::write_whole(&folder.join(name), &png_with(&draw::stacked(&rows, 2), PngEffort::Small)?)?;
                }
            }
        }
        print!("{table}");
    }
    files::write_whole(&out, table.as_bytes())
}

/// FLIP from frame to frame.
fn steps(frames: &[Seen]) -> Result<Vec<f64>> {
    let frames: Vec<RgbImage> = frames.iter().map(|seen| seen.over(0)).collect();
    frames.par_windows(2).map(|pair| Ok(flip(&pair[0], &pair[1])?.mean)).collect()
}
