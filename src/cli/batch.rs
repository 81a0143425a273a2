//! Many photographs at once: names checked first, then all in parallel under one progress bar, then a summary. One that fails does not
//! stop the others.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use serde::Serialize;
use serde_json::Value;

use crate::{Error, Result, Warning, files};

/// One output name and the photographs it is made from (several only for `--views`).
#[derive(Debug, Clone)]
pub struct Job {
    /// File name of the outputs, without extension.
    pub stem: String,
    /// The photographs.
    pub photos: Vec<PathBuf>,
    /// How many photographs of the run come before these.
    pub before: usize,
}

/// What one job wrote.
#[derive(Debug, Serialize)]
pub struct Done {
    /// The files, in the order they were made.
    pub outputs: Vec<PathBuf>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// The job's report, also written as `<stem>.json`.
    pub report: Value,
}

/// Where to and how.
pub struct Batch {
    /// Output folder.
    pub out: PathBuf,
    /// Whether the summary is JSON on standard output.
    pub json: bool,
}

/// Adds the options that every command over photographs has.
pub fn add(command: Command) -> Command {
    command
        .arg(
            Arg::new("out")
                .long("out")
                .value_name("DIR")
                .required(true)
                .value_parser(value_parser!(PathBuf))
                .help("Folder for the results; made where it is missing"),
        )
        .arg(Arg::new("json").long("json").action(ArgAction::SetTrue).help("Print the summary as JSON on standard output"))
        .arg(
            Arg::new("threads")
                .long("threads")
                .value_name("N")
                .value_parser(value_parser!(u16).range(1..=1024))
                .help("Worker threads [default: one per core]; the results do not depend on it"),
        )
}

impl Batch {
    /// Reads the options of [`add`] and sets up the worker threads.
    ///
    /// # Errors
    /// [`Error::Write`] when the folder cannot be written to.
    pub fn read(matches: &ArgMatches) -> Result<Self> {
        if let Some(&threads) = matches.get_one::<u16>("threads") {
            // Fails only when a pool exists already, which one process of ours never has at this point.
            let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
        }
        Ok(Self { out: matches.get_one::<PathBuf>("out").expect("clap requires it").clone(), json: matches.get_flag("json") })
    }

    /// Runs `work` for every job, `steps` progress steps each, and prints the summary. `work` gets a function to call after each step.
    ///
    /// # Errors
    /// [`Error::SameStem`], [`Error::Write`] before any work is done; failures of single jobs only show in summary and exit code.
    pub fn run(&self, jobs: &[Job], steps: u64, work: impl Fn(&Job, &dyn Fn(&str)) -> Result<Done> + Sync) -> Result<ExitCode> {
        refuse_equal_stems(jobs)?;
        files::ready_folder(&self.out)?;
        let bar = progress_bar(jobs.len() as u64 * steps);
        let results: Vec<Result<Done>> = jobs
            .par_iter()
            .map(|job| {
                let result = work(job, &|step| {
                    bar.set_message(format!("{}: {step}", job.stem));
                    bar.inc(1);
                });
                if let Err(error) = &result {
                    bar.suspend(|| eprintln!("{}: {error}", name_of(job)));
                }
                result
            })
            .collect();
        bar.finish_and_clear();
        if self.json {
            print_json(jobs, &results)
        } else {
            print_summary(jobs, &results)
        }
        Ok(if results.iter().all(Result::is_ok) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

/// The photographs as jobs, each named after its file.
pub fn jobs_of<'a>(photos: impl IntoIterator<Item = &'a PathBuf>) -> Vec<Job> {
    photos
        .into_iter()
        .enumerate()
        .map(|(before, photo)| Job { stem: stem_of(photo), photos: vec![photo.clone()], before })
        .collect()
}

/// The file's name without its extension.
pub fn stem_of(photo: &Path) -> String {
    photo.file_stem().map_or_else(|| "photo".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

fn name_of(job: &Job) -> String {
    job.photos.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(" + ")
}

fn refuse_equal_stems(jobs: &[Job]) -> Result<()> {
    let mut seen: BTreeMap<String, &Job> = BTreeMap::new();
    for job in jobs {
        // Two names that differ only in case are one file on some systems.
        if let Some(first) = seen.insert(job.stem.to_lowercase(), job) {
            return Err(Error::SameStem { stem: job.stem.clone(), first: first.photos[0].clone(), second: job.photos[0].clone() });
        }
    }
    Ok(())
}

fn progress_bar(length: u64) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{bar:32} {percent:>3} %  {eta} left  {wide_msg}").expect("the template is a constant");
    ProgressBar::new(length).with_style(style)
}

fn print_summary(jobs: &[Job], results: &[Result<Done>]) {
    for (job, result) in jobs.iter().zip(results) {
        let Ok(done) = result else { continue };
        for warning in &done.warnings {
            eprintln!("{}: warning: {}", name_of(job), warning.message);
        }
        println!("{}", done.outputs.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join("  "));
    }
    let failed: Vec<String> = jobs.iter().zip(results).filter(|(_, r)| r.is_err()).map(|(job, _)| name_of(job)).collect();
    if !failed.is_empty() {
        eprintln!("{} of {} failed: {}", failed.len(), jobs.len(), failed.join(", "));
    }
}

fn print_json(jobs: &[Job], results: &[Result<Done>]) {
    let rows: Vec<Value> = jobs
        .iter()
        .zip(results)
        .map(|(job, result)| match result {
            Ok(done) => serde_json::json!({"stem": job.stem, "photos": job.photos, "ok": true, "outputs": done.outputs, "report": done.report}),
            Err(error) => serde_json::json!({"stem": job.stem, "photos": job.photos, "ok": false, "error": error.to_string()}),
        })
        .collect();
    let failed = results.iter().filter(|r| r.is_err()).count();
    println!(
        "{:#}",
        serde_json::json!({"sphereboard": env!("CARGO_PKG_VERSION"), "done": rows.len() - failed, "failed": failed, "photos": rows})
    );
}
