//! `sphereboard model`: photograph to GLB.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use serde_json::{Value, json};

use crate::crown::CrownParams;
use crate::model::ProfileParams;
use crate::model::glb;
use crate::model::pipeline::{self, DECODE, ModelParams, ModelRun, PREVIEW, Request, STAGES, SizeParams, View, WRITE};
use crate::photo::{DecodeParams, ExemplarParams, SegmentParams, SilhouetteParams, decode};
use crate::raster::png;
use crate::texture::{BakeParams, SynthParams};
use crate::{Error, Result, Seed, Warning, report};

use super::batch::{self, Batch, Job, Made, Plan, texts_of};
use super::hints::HintOptions;
use super::preview::Previews;
use super::{Outcome, hints, look, options};

/// The command's arguments.
pub fn command() -> Command {
    let command = Command::new("model")
        .override_usage(
            "sphereboard model [OPTIONS] --out <DIR> <PHOTO>...\n       \
             sphereboard model [OPTIONS] --out <DIR> --views <PHOTO@DEG>...",
        )
        .about("Turn photographs of trees into small textured models: <stem>.glb, <stem>.json (parameters, counts, times, warnings) and <stem>.preview.png")
        .arg(
            Arg::new("photos")
                .value_name("PHOTO")
                .required_unless_present("views")
                .num_args(1..)
                .value_parser(value_parser!(PathBuf))
                .help("Photographs of one tree each: JPEG, PNG, WebP, TIFF or BMP"),
        );
    let command = batch::add(command)
        .arg(
            Arg::new("views")
                .long("views")
                .value_name("PHOTO@DEG")
                .num_args(1..)
                .conflicts_with("photos")
                .help(
                    "Several photographs of one tree, each with the direction it was taken from in °, counter-clockwise seen from above: \
                     90 stands on the right of what 0 shows; the first becomes the front and gives name, scale and texture",
                ),
        )
        .arg(
            Arg::new("debug-dir")
                .long("debug-dir")
                .value_name("DIR")
                .value_parser(value_parser!(PathBuf))
                .help("Draw every stage into this folder: mask steps, contour with feature points, point cloud, mesh, exemplar, texture with seams"),
        )
        .arg(
            options::seed("Seed of every random choice; same photograph, options and seed give the same bytes"),
        );
    let command = look::add_adapter(command).arg(
        Arg::new("no-preview")
            .long("no-preview")
            .action(ArgAction::SetTrue)
            .help("Do not draw <stem>.preview.png, the model from the front, the right and 45° above"),
    );
    let command = hints::add(command);
    let command = options::add::<SizeParams>(command, "Size");
    let command = options::add::<ProfileParams>(command, "Growth of the outline");
    let command = options::add::<CrownParams>(command, "Crown surface (She §3.1, fig. 8-9)");
    let command = options::add::<SynthParams>(command, "Texture (She §3.2, fig. 10-12)");
    let command = options::add::<BakeParams>(command, "Atlas");
    let command = options::add::<ExemplarParams>(command, "Exemplar (She §3.2)");
    let command = options::add::<SilhouetteParams>(command, "Outline (She §3.1, fig. 8a)");
    let command = options::add::<SegmentParams>(command, "Segmentation (She §3.1, fig. 7)");
    options::add::<DecodeParams>(command, "Decoding")
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let batch = Batch::read(matches)?;
    let (jobs, azimuths_deg) = jobs(matches)?;
    let settings = Settings::read(matches, batch, jobs.iter().map(|job| job.photos.len()).sum())?;
    let plan = Plan {
        jobs: &jobs,
        masks: settings.hints.masks(),
        suffixes: &[".glb", ".json", ".preview.png"],
        drawings: settings.debug_dir.as_deref(),
        stages: STAGES.len(),
    };
    settings.batch.run(&plan, |job, step| settings.one(job, &azimuths_deg, step))
}

/// Everything but the photographs.
struct Settings {
    batch: Batch,
    decode: DecodeParams,
    params: ModelParams,
    height_is_given: bool,
    hints: HintOptions,
    seed: Seed,
    debug_dir: Option<PathBuf>,
    /// `None` when nobody wants them.
    previews: Option<Previews>,
}

impl Settings {
    fn read(matches: &ArgMatches, batch: Batch, photos: usize) -> Result<Self> {
        let decode = options::read(matches)?;
        Ok(Self {
            params: ModelParams {
                segment: options::read(matches)?,
                silhouette: options::read(matches)?,
                crown: options::read(matches)?,
                exemplar: options::read(matches)?,
                texture: options::read(matches)?,
                bake: options::read(matches)?,
                size: options::read(matches)?,
                outline: options::read(matches)?,
            },
            height_is_given: matches.value_source("height_m") == Some(ValueSource::CommandLine),
            hints: HintOptions::read(matches, photos)?,
            seed: options::read_seed(matches)?,
            debug_dir: matches.get_one("debug-dir").cloned(),
            previews: match matches.get_flag("no-preview") {
                true => None,
                false => Some(Previews::new(look::adapter(matches))?),
            },
            batch,
            decode,
        })
    }

    fn one(&self, job: &Job, azimuths_deg: &[f64], step: &dyn Fn(&str)) -> Result<Made> {
        let started = Instant::now();
        let views: Vec<View> = job
            .photos
            .iter()
            .enumerate()
            .map(|(i, path)| {
                let photo = decode::decode(path, &self.decode)?;
                let hints = self.hints.of(job.before + i, &self.decode)?;
                Ok(View { photo, hints, azimuth_rad: azimuths_deg.get(i).copied().unwrap_or(0.0).to_radians() })
            })
            .collect::<Result<_>>()?;
        let mut stages_ms = vec![(DECODE, ms_since(started))];
        step(DECODE);
        let request = Request {
            views: &views,
            params: &self.params,
            height_is_given: self.height_is_given,
            seed: self.seed,
            sources: job.photos.iter().filter_map(|p| p.file_name()).map(|name| name.to_string_lossy().into_owned()).collect(),
        };
        let mut run = pipeline::run(&request, step).map_err(|error| match error {
            Error::InView { view, cause } => Error::InFile { path: job.photos[view].clone(), cause },
            of_all => of_all,
        })?;
        stages_ms.extend(&run.stages_ms);

        let previewing = Instant::now();
        let preview = match self.previews.as_ref().map(|previews| previews.draw(run.model.clone())) {
            Some(Ok(picture)) => Some((self.batch.path(job, ".preview.png"), png(&picture)?)),
            Some(Err(cause)) => {
                run.warnings.push(Warning::new("no-preview", format!("no preview was drawn, the model is whole: {cause}")));
                None
            }
            None => None,
        };
        stages_ms.push((PREVIEW, ms_since(previewing)));
        step(PREVIEW);

        let writing = Instant::now();
        let glb = glb::write(&run.model)?;
        let drawings = match &self.debug_dir {
            Some(folder) => drawings(folder, &job.stem, &views, &run)?,
            None => vec![],
        };
        let mut report = self.report(job, azimuths_deg, &run, glb.len());
        // The report is one of the files, so it cannot time the last step: storing them.
        stages_ms.push((WRITE, ms_since(writing)));
        report["stages_ms"] = stages_ms.iter().map(|(stage, ms)| json!({"stage": stage, "ms": ms})).collect();
        report["total_ms"] = json!(ms_since(started));

        let json_bytes = serde_json::to_vec_pretty(&report).expect("a JSON value serialises");
        let own = [(self.batch.path(job, ".glb"), glb), (self.batch.path(job, ".json"), json_bytes)];
        Ok(Made { files: own.into_iter().chain(preview).chain(drawings).collect(), warnings: run.warnings, report })
    }

    /// What `<stem>.json` holds, times excepted.
    fn report(&self, job: &Job, azimuths_deg: &[f64], run: &ModelRun, glb_bytes: usize) -> Value {
        json!({
            "sphereboard": env!("CARGO_PKG_VERSION"),
            "sources": texts_of(&job.photos),
            "azimuths_deg": azimuths_deg,
            "seed": self.seed,
            "height_is_given": self.height_is_given,
            "parameters": {
                "decode": self.decode, "segment": self.params.segment, "silhouette": self.params.silhouette, "crown": self.params.crown,
                "exemplar": self.params.exemplar, "texture": self.params.texture, "bake": self.params.bake, "size": self.params.size,
                "outline": self.params.outline,
            },
            "hints": self.hints.report(),
            "glb_bytes": glb_bytes,
            "counts": run.counts(),
            "measures": run.measures(),
            "warnings": run.warnings,
        })
    }
}

/// One job per photograph, or one for all of `--views`, with the azimuth of each of its photographs.
fn jobs(matches: &ArgMatches) -> Result<(Vec<Job>, Vec<f64>)> {
    let Some(views) = matches.get_many::<String>("views") else {
        return Ok((batch::jobs_of(matches.get_many::<PathBuf>("photos").unwrap_or_default()), vec![0.0]));
    };
    let (photos, azimuths): (Vec<PathBuf>, Vec<f64>) =
        views.map(|text| view(text)).collect::<Result<Vec<_>>>()?.into_iter().unzip();
    Ok((vec![Job { stem: batch::stem_of(&photos[0]), photos, before: 0 }], azimuths))
}

fn view(text: &str) -> Result<(PathBuf, f64)> {
    let parts = text.rsplit_once('@').and_then(|(path, degrees)| Some((PathBuf::from(path), degrees.parse::<f64>().ok()?)));
    parts.filter(|(path, degrees)| !path.as_os_str().is_empty() && degrees.abs() <= 360.0).ok_or_else(|| Error::Hint {
        flag: "--views",
        expected: "PHOTO@DEG with -360 ≤ DEG ≤ 360, for example a.jpg@0 b.jpg@90".to_owned(),
        found: text.to_owned(),
    })
}

/// The drawings of every stage, as files.
fn drawings(folder: &Path, stem: &str, views: &[View], run: &ModelRun) -> Result<Vec<(PathBuf, Vec<u8>)>> {
    let file = |(name, png): (String, Vec<u8>)| (folder.join(format!("{stem}.{name}.png")), png);
    Ok(report::stages::draw(views, run)?.into_iter().map(file).collect())
}

fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
