//! What a comparison has finished, on disk: a run that was stopped goes on where it was. One line of JSON per method in
//! `finished.jsonl`, written when all of the method is done; `identity.json` says of which comparison.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::{Error, Result, files};

use super::{Cell, MethodRun, Plan};

/// What must be the same for finished parts to be of use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Name and version of the program.
    pub program: String,
    /// The program's commit: another may build or draw otherwise.
    pub commit: String,
    /// The tree, and a digest of its file where it has one.
    pub source: String,
    /// What is looked at.
    pub plan: Plan,
    /// Seed of every random number.
    pub seed: u64,
    /// Settings of methods that are not the defaults.
    pub settings: Vec<String>,
    /// Adapter and driver.
    pub adapter: String,
}

/// One finished method.
#[derive(Serialize, Deserialize)]
struct Finished {
    run: MethodRun,
    cells: Vec<Cell>,
}

/// A folder with what is finished.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    finished: Vec<(MethodRun, Vec<Cell>)>,
    taken_s: f64,
}

impl Store {
    /// Opens the folder of a comparison, or begins one in it.
    ///
    /// # Errors
    /// [`Error::OtherComparison`] when another one's results lie there and `anew` does not say to drop them; those of [`files`].
    pub fn open(folder: &Path, identity: &Identity, anew: bool) -> Result<Self> {
        let [known, list, times] = ["identity.json", "finished.jsonl", TIMES].map(|name| folder.join(name));
        let text =
            serde_json::to_string_pretty(identity).map_err(|e| Error::Internal { stage: "compare::store", what: e.to_string() })?;
        let mut store = Self { folder: folder.to_owned(), finished: vec![], taken_s: 0.0 };
        match fs::read_to_string(&known) {
            Ok(found) if found == text => store.read(&list),
            Ok(_) if !anew => return Err(Error::OtherComparison { folder: folder.to_owned() }),
            _ => {
                // Nothing finished may stand under another name than its own.
                for old in [list, times].into_iter().filter(|old| old.exists()) {
                    fs::remove_file(&old).map_err(|cause| Error::Write { path: old.clone(), cause })?;
                }
                files::write_whole(&known, text.as_bytes())?;
            }
        }
        Ok(store)
    }

    /// Reads what is whole; a line that was cut short by the end of a run is left out.
    fn read(&mut self, list: &Path) {
        let text = fs::read_to_string(list).unwrap_or_default();
        let whole = text.lines().filter_map(|line| serde_json::from_str::<Finished>(line).ok());
        let times = fs::read_to_string(self.folder.join(TIMES)).unwrap_or_default();
        self.taken_s = times.lines().filter_map(|line| line.parse::<f64>().ok()).sum();
        self.finished = whole.map(|finished| (finished.run, finished.cells)).collect();
    }

    /// What is finished of a method.
    pub fn finished(&self, method: &str) -> Option<&(MethodRun, Vec<Cell>)> {
        self.finished.iter().find(|(run, _)| run.method == method)
    }

    /// Keeps a method for good.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn keep(&mut self, run: MethodRun, cells: Vec<Cell>) -> Result<()> {
        let list = self.folder.join("finished.jsonl");
        let finished = Finished { run, cells };
        let line =
            serde_json::to_string(&finished).map_err(|e| Error::Internal { stage: "compare::store", what: e.to_string() })?;
        append(&list, &line)?;
        self.finished.push((finished.run, finished.cells));
        Ok(())
    }

    /// Notes that a run has taken so long.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn add_time(&mut self, seconds: f64) -> Result<()> {
        self.taken_s += seconds;
        append(&self.folder.join(TIMES), &format!("{seconds:.3}"))
    }

    /// Seconds of all runs that came to their end.
    pub fn taken_s(&self) -> f64 {
        self.taken_s
    }
}

/// A line for each run that came to its end: its seconds.
const TIMES: &str = "times.txt";

fn append(path: &Path, line: &str) -> Result<()> {
    let add = || -> std::io::Result<()> {
        // A line cut short by the end of an earlier run must not swallow this one.
        let begins = fs::read(path).map_or(true, |bytes| bytes.last().is_none_or(|last| *last == b'\n'));
        let mut file = fs::OpenOptions::new().create(true).append(true).open(path)?;
        file.write_all(format!("{}{line}\n", if begins { "" } else { "\n" }).as_bytes())?;
        file.sync_data()
    };
    add().map_err(|cause| Error::Write { path: path.to_owned(), cause })
}
