//! `sphereboard model`: photograph to GLB.

use std::path::{Path, PathBuf};

use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command, value_parser};
use serde_json::{Value, json};

use crate::crown::CrownParams;
use crate::model::glb;
use crate::model::pipeline::{self, ModelParams, ModelRun, Request, SizeParams, View};
use crate::photo::{DecodeParams, ExemplarParams, SegmentParams, SilhouetteParams, decode};
use crate::texture::{BakeParams, SynthParams};
use crate::{Error, Result, Seed, files, report};

use super::batch::{self, Batch, Done, Job};
use super::hints::HintOptions;
use super::{Outcome, hints, options};

/// The command's arguments.
pub fn command() -> Command {
    let command = Command::new("model")
        .about("Turn photographs of trees into small textured models: <stem>.glb and <stem>.json (parameters, counts, times, warnings)")
        .arg(
            Arg::new("photos")
                .value_name("PHOTO")
                .required_unless_present("views")
                .num_args(1..)
                .value_parser(value_parser!(PathBuf))
                .help("Photographs of one tree each: JPEG, PNG, WebP, TIFF or BMP"),
        )
        .arg(
            Arg::new("views")
                .long("views")
                .value_name("PHOTO@DEG")
                .num_args(1..)
                .conflicts_with("photos")
                .help("Several photographs of one tree, each with the direction it was taken from in degrees, counter-clockwise seen from above; the first becomes the front and gives name, scale and texture"),
        )
        .arg(
            Arg::new("debug-dir")
                .long("debug-dir")
                .value_name("DIR")
                .value_parser(value_parser!(PathBuf))
                .help("Draw every stage into this folder: mask steps, contour with feature points, point cloud, mesh, exemplar, texture with seams"),
        )
        .arg(
            Arg::new("seed")
                .long("seed")
                .value_name("N")
                .value_parser(value_parser!(u64))
                .default_value("1")
                .help("Seed of every random choice; same photograph, options and seed give the same bytes"),
        );
    let command = hints::add(batch::add(command));
    let command = options::add::<SizeParams>(command, "Size");
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
    let (jobs, azimuths_deg) = jobs(matches)?;
    let settings = Settings::read(matches, jobs.iter().map(|job| job.photos.len()).sum())?;
    if let Some(folder) = &settings.debug_dir {
        files::ready_folder(folder)?;
    }
    settings.batch.run(&jobs, pipeline::STAGES.len() as u64, |job, step| settings.one(job, &azimuths_deg, step))
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
}

impl Settings {
    fn read(matches: &ArgMatches, photos: usize) -> Result<Self> {
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
            },
            height_is_given: matches.value_source("height_m") == Some(ValueSource::CommandLine),
            hints: HintOptions::read(matches, photos)?,
            seed: Seed(*matches.get_one("seed").expect("clap gives the default")),
            debug_dir: matches.get_one("debug-dir").cloned(),
            batch: Batch::read(matches)?,
            decode,
        })
    }

    fn one(&self, job: &Job, azimuths_deg: &[f64], step: &dyn Fn(&str)) -> Result<Done> {
        let started = std::time::Instant::now();
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
        let decode_ms = started.elapsed().as_secs_f64() * 1e3;
        let request = Request {
            views: &views,
            params: &self.params,
            height_is_given: self.height_is_given,
            seed: self.seed,
            sources: job.photos.iter().filter_map(|p| p.file_name()).map(|name| name.to_string_lossy().into_owned()).collect(),
        };
        let run = pipeline::run(&request, step)?;
        let encoding = std::time::Instant::now();
        let glb = glb::write(&run.model)?;
        let encode_ms = encoding.elapsed().as_secs_f64() * 1e3;
        step("written");

        let mut report = self.report(job, azimuths_deg, &run, glb.len());
        let mut stages = vec![("decode", decode_ms)];
        stages.extend(run.stages_ms.iter().copied());
        stages.push(("encode", encode_ms));
        report["stages_ms"] =
            stages.iter().map(|&(stage, ms)| (stage.to_owned(), json!(ms))).collect::<serde_json::Map<_, _>>().into();
        report["total_ms"] = json!(started.elapsed().as_secs_f64() * 1e3);

        let path = |suffix: &str| self.batch.out.join(format!("{}{suffix}", job.stem));
        let json_bytes = serde_json::to_vec_pretty(&report).expect("a JSON value serialises");
        let mut outputs = vec![(path(".glb"), glb), (path(".json"), json_bytes)];
        if let Some(folder) = &self.debug_dir {
            outputs.extend(
                report::stages::draw(&views, &run)?.into_iter().map(|(name, png)| (debug_path(folder, &job.stem, &name), png)),
            );
        }
        files::write_all(&outputs)?;
        Ok(Done { outputs: outputs.into_iter().map(|o| o.0).collect(), warnings: run.warnings, report })
    }

    /// What `<stem>.json` holds, times excepted.
    fn report(&self, job: &Job, azimuths_deg: &[f64], run: &ModelRun, glb_bytes: usize) -> Value {
        json!({
            "sphereboard": env!("CARGO_PKG_VERSION"),
            "sources": job.photos,
            "azimuths_deg": azimuths_deg,
            "seed": self.seed,
            "height_is_given": self.height_is_given,
            "parameters": {
                "decode": self.decode, "segment": self.params.segment, "silhouette": self.params.silhouette, "crown": self.params.crown,
                "exemplar": self.params.exemplar, "texture": self.params.texture, "bake": self.params.bake, "size": self.params.size,
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
    parts.filter(|(path, degrees)| !path.as_os_str().is_empty() && degrees.abs() <= 360.0).ok_or_else(|| Error::Parameter {
        name: "--views".to_owned(),
        expected: "PHOTO@DEG with -360 ≤ DEG ≤ 360, for example a.jpg@0 b.jpg@90".to_owned(),
        found: text.to_owned(),
    })
}

fn debug_path(folder: &Path, stem: &str, name: &str) -> PathBuf {
    folder.join(format!("{stem}.{name}.png"))
}
