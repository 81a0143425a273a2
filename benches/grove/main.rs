//! What groves cost, beside the papers' figures and what was asked for. Parts, any of which may be named (all of them otherwise):
//!
//! * `she-540`, `she-fig18`, `lluch-200`, `truelsen-10k`, `rebollo-100`, `million`: the scenes of the bars;
//! * `alone`, or `alone:METHOD`: each method alone on the same scene, against the number of trees and against image error;
//! * `tour`: Truelsen's fig. 30–32 and table 3, by batch, with levels and culling on and off;
//! * `behind`: twice as many trees behind the camera, in turns.
//!
//! `cargo bench --bench grove -- she-540 tour`. Each runs in a process of its own, so that its memory is its own, for half a minute or so
//! (`GROVE_SECONDS=n` for each drive; `GROVE_ADAPTER=name`). What was measured stays in `target/render-bench/grove/` until it is measured
//! anew; the report of all of it goes to `target/render-bench/grove.{md,csv}` and `grove*.svg`, which `make bench` puts into `results/`.

mod alone;
mod bars;
mod behind;
mod report;
mod site;
mod tour;

use std::process::Command;

use sphereboard::repr::METHODS;
use sphereboard::{Error, Result};

fn main() -> Result<()> {
    // Cargo itself adds `--bench`.
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    if let [flag, job] = &words[..]
        && flag == "--job"
    {
        return run(job);
    }
    let jobs = jobs(&words)?;
    for (number, job) in jobs.iter().enumerate() {
        eprintln!("{} of {}: {job}", number + 1, jobs.len());
        let myself = std::env::current_exe().map_err(|cause| Error::Read { path: "this program".into(), cause })?;
        match Command::new(myself).args(["--job", job]).status() {
            Ok(status) if status.success() => {}
            other => eprintln!("{job} was not measured: {other:?}"),
        }
    }
    report::write()
}

/// Everything that `words` ask for, in order.
fn jobs(words: &[String]) -> Result<Vec<String>> {
    let mut all: Vec<String> = bars::BARS.iter().map(bars::Bar::job).collect();
    all.extend(METHODS.iter().map(|method| format!("alone:{}", method.id())));
    all.extend(["tour", "behind"].map(str::to_owned));
    let asked = |job: &&String| words.is_empty() || words.iter().any(|word| *job == word || job.split(':').next() == Some(word));
    let chosen: Vec<String> = all.iter().filter(asked).cloned().collect();
    match words.iter().find(|word| !all.iter().any(|job| job == *word || job.split(':').next() == Some(word))) {
        Some(word) => Err(Error::Parameter {
            name: "a part".to_owned(),
            expected: format!("some of {}", all.join(", ")),
            found: word.clone(),
        }),
        None => Ok(chosen),
    }
}

fn run(job: &str) -> Result<()> {
    match job.split_once(':').unwrap_or((job, "")) {
        ("alone", method) => alone::run(job, method),
        ("tour", _) => tour::run(job),
        ("behind", _) => behind::run(job),
        (preset, trees) => bars::run(job, preset, trees.parse().ok()),
    }
}
