//! The circle over every preset: grown, photographed, modelled, held against the tree. Prints a table: intersection over union of the
//! crowns' silhouettes from the photographed side and from 90°, crown found automatically and given by the exact mask.
//!
//! `cargo run --release --example circle [SEEDS]`, by default the seeds 1 to 3; `make bench` writes it into `results/`.

use std::f32::consts::FRAC_PI_2;

use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::model::grown::grow_preset;
use sphereboard::model::pipeline::{self, ModelParams, Request, SizeParams, View};
use sphereboard::model::reference::{Asked, ReferenceTree};
use sphereboard::photo::{Hints, Photo};
use sphereboard::plant::presets::PRESETS;
use sphereboard::raster::Mask;
use sphereboard::render::Renderer;
use sphereboard::report::circle::{agreement, surveyed_height_m};
use sphereboard::report::studio::{Photograph, Sitting, photograph};
use sphereboard::{Result, Seed};

fn main() -> Result<()> {
    let seeds: u64 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(3);
    let mut renderer = Renderer::new(Gpu::open(&AdapterChoice::Auto)?)?;
    println!("| tree | seed | crown found | front | side | crown given | side |\n| --- | --: | --: | --: | --: | --: | --: |");
    for preset in &PRESETS {
        for seed in (1..=seeds).map(Seed) {
            let truth = ReferenceTree::new(preset.name.to_owned(), grow_preset(preset, seed)?.parts, &Asked::default())?;
            let taken = photograph(&mut renderer, &truth, None, &Sitting::default(), &|| ())?;
            let [(found, auto), (_, exact)] =
                [None, Some(&taken.crown)].map(|mask| figures(&mut renderer, &truth, &taken, mask.cloned()));
            println!("| {} | {} | {found} | {auto} | {exact} |", preset.name, seed.0);
        }
    }
    Ok(())
}

/// The IoU of the crown that was found with the exact one, and those of the model; why there is none, where there is none.
fn figures(renderer: &mut Renderer, truth: &ReferenceTree, taken: &Photograph, mask: Option<Mask>) -> (String, String) {
    let photo = Photo { image: taken.image.clone(), opaque: None };
    let view = View { photo, hints: Hints { mask, ..Hints::default() }, azimuth_rad: 0.0 };
    let params = ModelParams { size: SizeParams { height_m: surveyed_height_m(truth) }, ..ModelParams::default() };
    let request = Request { views: &[view], params: &params, height_is_given: true, seed: Seed(1), sources: vec![] };
    let measured = pipeline::run(&request, &|_| ()).and_then(|run| {
        let ious = agreement(renderer, truth, &run.model, 0.0, &[0.0, FRAC_PI_2])?;
        Ok((format!("{:.3}", run.views[0].segmentation.crown.iou(&taken.crown)), format!("{:.3} | {:.3}", ious[0], ious[1])))
    });
    measured.unwrap_or_else(|error| (String::new(), format!("{error} | ")))
}
