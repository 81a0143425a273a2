//! Many photographs at once: names checked first, then all in parallel under one progress bar, then a summary. One that fails does not
//! stop the others.

use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::model::pipeline::WRITE;
use crate::{Error, Result, Warning, files};

use super::{options, say};

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

/// What one job made.
#[derive(Debug)]
pub struct Made {
    /// The files to write, with their bytes.
    pub files: Vec<(PathBuf, Vec<u8>)>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// The job's report, also one of the files.
    pub report: Value,
}

/// What one job wrote.
struct Done {
    /// The files, in the order they were made.
    outputs: Vec<PathBuf>,
    warnings: Vec<Warning>,
    report: Value,
}

/// What is to be done.
pub struct Plan<'a> {
    /// The outputs to make.
    pub jobs: &'a [Job],
    /// Files that are read besides the photographs.
    pub masks: &'a [PathBuf],
    /// What follows the stem in the names of a job's outputs.
    pub suffixes: &'a [&'a str],
    /// Folder for drawings, if wanted.
    pub drawings: Option<&'a Path>,
    /// Stages of one job, the last of them its writing.
    pub stages: usize,
}

/// Where to and how.
pub struct Batch {
    /// Output folder.
    pub out: PathBuf,
    /// Whether the summary is JSON on standard output.
    json: bool,
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
                .allow_negative_numbers(true)
                .help("Worker threads, 1 to 1024 [default: one per core]; the results do not depend on it"),
        )
}

impl Batch {
    /// Reads the options of [`add`] and sets up the worker threads, so it comes before anything that uses them.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a number of threads out of range, [`Error::Internal`] when there are worker threads already.
    pub fn read(matches: &ArgMatches) -> Result<Self> {
        if let Some(threads) = options::whole(matches, "threads", 1..=1024)? {
            let set_up = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
            set_up.map_err(|cause| Error::Internal { stage: "setting up --threads", what: cause.to_string() })?;
        }
        Ok(Self { out: matches.get_one::<PathBuf>("out").expect("clap requires it").clone(), json: matches.get_flag("json") })
    }

    /// Runs `work` for every job, writes what it made, and prints the summary. `work` gets a function to call after each stage.
    ///
    /// # Errors
    /// [`Error::SameStem`], [`Error::OverwritesInput`], those of [`files::ready_folder`] before any work is done; failures of single jobs only show in
    /// summary and exit code.
    pub fn run(&self, plan: &Plan, work: impl Fn(&Job, &dyn Fn(&str)) -> Result<Made> + Sync) -> Result<ExitCode> {
        refuse_equal_stems(plan.jobs)?;
        let inputs: Vec<PathBuf> = plan.jobs.iter().flat_map(|job| &job.photos).chain(plan.masks).cloned().collect();
        let outputs: Vec<PathBuf> =
            plan.jobs.iter().flat_map(|job| plan.suffixes.iter().map(|suffix| self.path(job, suffix))).collect();
        files::refuse_overwriting(outputs.iter().map(PathBuf::as_path), &inputs)?;
        let _folders =
            [Some(self.out.as_path()), plan.drawings].into_iter().flatten().map(files::ready_folder).collect::<Result<Vec<_>>>()?;

        let bar = progress_bar((plan.jobs.len() * plan.stages) as u64);
        let one = |job: &Job| {
            let step = |stage: &str| {
                bar.set_message(format!("{}: {stage}", job.stem));
                bar.inc(1);
            };
            let result = guarded(|| {
                let made = work(job, &step)?;
                // Again, since only now the names of the drawings are known.
                files::refuse_overwriting(made.files.iter().map(|(path, _)| path.as_path()), &inputs)?;
                files::write_all(&made.files)?;
                step(WRITE);
                let outputs = made.files.into_iter().map(|(path, _)| path).collect();
                Ok(Done { outputs, warnings: made.warnings, report: made.report })
            });
            if let Err(error) = &result {
                bar.suspend(|| say::err(&complaint(job, error)));
            }
            result
        };
        let results: Vec<Result<Done>> = plan.jobs.par_iter().map(one).collect();
        bar.finish_and_clear();
        let said = if self.json { print_json(plan.jobs, &results) } else { print_summary(plan.jobs, &results) };
        Ok(if said && results.iter().all(Result::is_ok) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    /// The file of that job in the output folder.
    pub fn path(&self, job: &Job, suffix: &str) -> PathBuf {
        self.out.join(format!("{}{suffix}", job.stem))
    }
}

/// Runs `work`; a panic, which is a mistake of ours, becomes the error of this photograph and does not end the others.
fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|panic| Err(Error::Internal { stage: "the run of one photograph", what: panic_message(&*panic) }))
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "it panicked".to_owned())
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

/// A path in JSON, which holds no other bytes than Unicode.
pub fn text_of(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// Several paths in JSON.
pub fn texts_of(paths: &[PathBuf]) -> Vec<String> {
    paths.iter().map(|path| text_of(path)).collect()
}

fn name_of(job: &Job) -> String {
    texts_of(&job.photos).join(" + ")
}

/// The error with the photograph's name, unless it says the name itself.
fn complaint(job: &Job, error: &Error) -> String {
    let message = error.to_string();
    if job.photos.iter().any(|photo| message.contains(&text_of(photo))) { message } else { format!("{}: {message}", name_of(job)) }
}

fn refuse_equal_stems(jobs: &[Job]) -> Result<()> {
    let mut seen: BTreeMap<String, &Job> = BTreeMap::new();
    for job in jobs {
        // Two names that differ only in case are one file on some systems.
        if let Some(first) = seen.insert(job.stem.to_lowercase(), job) {
            if first.photos == job.photos {
                return Err(Error::Usage { what: format!("{} was given twice", name_of(job)), remedy: "give it once" });
            }
            return Err(Error::SameStem { stem: job.stem.clone(), first: first.photos[0].clone(), second: job.photos[0].clone() });
        }
    }
    Ok(())
}

/// A bar that tells how far the work is and how long it still takes.
pub fn progress_bar(length: u64) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{bar:32} {percent:>3} %  {eta} left  {wide_msg}").expect("the template is a constant");
    ProgressBar::new(length).with_style(style)
}

/// Files written to standard output, warnings and failures to standard error. False when the former failed.
fn print_summary(jobs: &[Job], results: &[Result<Done>]) -> bool {
    let mut said = true;
    for (job, result) in jobs.iter().zip(results) {
        let Ok(done) = result else { continue };
        for warning in &done.warnings {
            say::err(&format!("{}: warning: {}", name_of(job), warning.message));
        }
        said &= say::out(&texts_of(&done.outputs).join("  "));
    }
    let failed: Vec<String> = jobs.iter().zip(results).filter(|(_, r)| r.is_err()).map(|(job, _)| name_of(job)).collect();
    if !failed.is_empty() {
        say::err(&format!("{} of {} failed: {}", failed.len(), jobs.len(), failed.join(", ")));
    }
    said
}

fn print_json(jobs: &[Job], results: &[Result<Done>]) -> bool {
    let row = |(job, result): (&Job, &Result<Done>)| {
        let photos = texts_of(&job.photos);
        match result {
            Ok(done) => {
                json!({"stem": job.stem, "photos": photos, "ok": true, "outputs": texts_of(&done.outputs), "report": done.report})
            }
            Err(error) => json!({"stem": job.stem, "photos": photos, "ok": false, "error": error.to_string()}),
        }
    };
    let rows: Vec<Value> = jobs.iter().zip(results).map(row).collect();
    let failed = results.iter().filter(|r| r.is_err()).count();
    let version = env!("CARGO_PKG_VERSION");
    say::out(&format!("{:#}", json!({"sphereboard": version, "done": rows.len() - failed, "failed": failed, "photos": rows})))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_of_its_photograph() {
        let lost: Result<()> = guarded(|| panic!("index {} out of bounds", 7));
        let message = lost.unwrap_err().to_string();
        assert!(message.contains("index 7 out of bounds") && message.contains("please report"), "{message}");
        assert_eq!(guarded(|| Ok(7)).unwrap(), 7);
    }

    #[test]
    fn a_complaint_names_its_photograph_once() {
        let job = Job { stem: "a".to_owned(), photos: vec!["x/a.jpg".into(), "x/b.jpg".into()], before: 0 };
        assert!(complaint(&job, &Error::Leafless).starts_with("x/a.jpg + x/b.jpg: the tree seems"));
        let missing = Error::NoSuchFile { path: "x/b.jpg".into() };
        assert_eq!(complaint(&job, &missing), missing.to_string());
    }
}
