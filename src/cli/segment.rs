//! `sphereboard segment`: stops after the mask.

use std::path::PathBuf;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use serde_json::json;

use crate::photo::{DecodeParams, SegmentParams, decode, segment};
use crate::raster::png;
use crate::{Result, files};

use super::batch::{self, Batch, Done, Job};
use super::hints::HintOptions;
use super::{Outcome, hints, options};

/// The command's arguments.
pub fn command() -> Command {
    let command = Command::new("segment")
        .about(
            "Cut the crown out of photographs: <stem>.mask.png (crown) and <stem>.tree.png (crown and trunk), 0 or 255 per pixel",
        )
        .arg(
            Arg::new("photos")
                .value_name("PHOTO")
                .required(true)
                .num_args(1..)
                .value_parser(value_parser!(PathBuf))
                .help("Photographs of one tree each: JPEG, PNG, WebP, TIFF or BMP"),
        )
        .arg(
            Arg::new("pixels")
                .long("pixels")
                .action(ArgAction::SetTrue)
                .help("Also write <stem>.pixels.png, the upright 8-bit pixels that were segmented"),
        );
    let command = hints::add(batch::add(command));
    let command = options::add::<SegmentParams>(command, "Segmentation (She §3.1, fig. 7)");
    options::add::<DecodeParams>(command, "Decoding")
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let params: SegmentParams = options::read(matches)?;
    let decode_params: DecodeParams = options::read(matches)?;
    let photos: Vec<&PathBuf> = matches.get_many("photos").unwrap_or_default().collect();
    let hints = HintOptions::read(matches, photos.len())?;
    let batch = Batch::read(matches)?;
    let pixels = matches.get_flag("pixels");
    batch.run(&batch::jobs_of(photos), 1, |job, step| {
        let done = one(job, &batch, &params, &decode_params, &hints, pixels);
        step("segmented");
        done
    })
}

fn one(
    job: &Job,
    batch: &Batch,
    params: &SegmentParams,
    decode_params: &DecodeParams,
    hints: &HintOptions,
    pixels: bool,
) -> Result<Done> {
    let photo = decode::decode(&job.photos[0], decode_params)?;
    let segmentation = segment::segment(&photo, params, &hints.of(job.before, decode_params)?)?;
    let report = json!({
        "sphereboard": env!("CARGO_PKG_VERSION"),
        "source": job.photos[0],
        "parameters": {"segment": params, "decode": decode_params},
        "hints": hints.report(),
        "size_px": [photo.image.width(), photo.image.height()],
        "hue_deg": segmentation.hue_deg,
        "counts": {"crown_px": segmentation.crown.count(), "tree_px": segmentation.tree.count(), "gap_px": segmentation.gaps.count()},
        "warnings": segmentation.warnings,
    });
    let path = |suffix: &str| batch.out.join(format!("{}{suffix}", job.stem));
    let mut outputs =
        vec![(path(".mask.png"), png(&segmentation.crown.to_gray())?), (path(".tree.png"), png(&segmentation.tree.to_gray())?)];
    if pixels {
        outputs.push((path(".pixels.png"), png(&photo.image)?));
    }
    outputs.push((path(".json"), serde_json::to_vec_pretty(&report).expect("a JSON value serialises")));
    files::write_all(&outputs)?;
    Ok(Done { outputs: outputs.into_iter().map(|o| o.0).collect(), warnings: segmentation.warnings, report })
}
