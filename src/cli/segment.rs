//! `sphereboard segment`: stops after the mask.

use std::path::PathBuf;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use serde_json::json;

use crate::Result;
use crate::model::pipeline::{DECODE, WRITE};
use crate::photo::{DecodeParams, SegmentParams, decode, segment};
use crate::raster::png;

use super::batch::{self, Batch, Job, Made, Plan, text_of};
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
    let batch = Batch::read(matches)?;
    let jobs = batch::jobs_of(matches.get_many::<PathBuf>("photos").unwrap_or_default());
    let settings = Settings {
        batch,
        params: options::read(matches)?,
        decode: options::read(matches)?,
        hints: HintOptions::read(matches, jobs.len())?,
        pixels: matches.get_flag("pixels"),
    };
    let suffixes: &[&str] = &[".mask.png", ".tree.png", ".json", ".pixels.png"];
    let plan = Plan {
        jobs: &jobs,
        masks: settings.hints.masks(),
        suffixes: if settings.pixels { suffixes } else { &suffixes[..3] },
        drawings: None,
        stages: STAGES.len(),
    };
    settings.batch.run(&plan, |job, step| settings.one(job, step))
}

/// What progress announces.
const STAGES: [&str; 3] = [DECODE, "segment", WRITE];

/// Everything but the photographs.
struct Settings {
    batch: Batch,
    params: SegmentParams,
    decode: DecodeParams,
    hints: HintOptions,
    pixels: bool,
}

impl Settings {
    fn one(&self, job: &Job, step: &dyn Fn(&str)) -> Result<Made> {
        let photo = decode::decode(&job.photos[0], &self.decode)?;
        let hints = self.hints.of(job.before, &self.decode)?;
        step(STAGES[0]);
        let segmentation = segment::segment(&photo, &self.params, &hints)?;
        step(STAGES[1]);
        let report = json!({
            "sphereboard": env!("CARGO_PKG_VERSION"),
            "source": text_of(&job.photos[0]),
            "parameters": {"segment": self.params, "decode": self.decode},
            "hints": self.hints.report(),
            "size_px": [photo.image.width(), photo.image.height()],
            "hue_deg": segmentation.hue_deg,
            "counts": {"crown_px": segmentation.crown.count(), "tree_px": segmentation.tree.count(), "gap_px": segmentation.gaps.count()},
            "warnings": segmentation.warnings,
        });
        let path = |suffix: &str| self.batch.path(job, suffix);
        let mut files =
            vec![(path(".mask.png"), png(&segmentation.crown.to_gray())?), (path(".tree.png"), png(&segmentation.tree.to_gray())?)];
        if self.pixels {
            files.push((path(".pixels.png"), png(&photo.image)?));
        }
        files.push((path(".json"), serde_json::to_vec_pretty(&report).expect("a JSON value serialises")));
        Ok(Made { files, warnings: segmentation.warnings, report })
    }
}
