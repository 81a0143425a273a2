//! Species that are grown and built beside the window while it goes on showing what it has: another method for all of them, or one whose
//! file was replaced.

use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use crate::grove::stock::{self, Stock};
use crate::grove::{Scene, SceneFile, lay_out};
use crate::model::reference::Asked;
use crate::plant::presets::preset;
use crate::repr::{METHODS, SoftwareCapture, SourceKind, TreeSource};
use crate::{Error, Result, Seed};

/// Between looks at species files.
const WATCH: Duration = Duration::from_millis(500);

/// What is to be built.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Order {
    /// How trees are drawn.
    pub method: String,
    /// Which of the scene's species.
    pub species: Vec<usize>,
}

/// What became of an order: trees in the place of others, and where they stand if their sizes differ.
pub struct Grown {
    /// For each species that was ordered, which trees of the stock are replaced and by what.
    pub stock: Vec<(std::ops::Range<usize>, Vec<Stock>)>,
    /// The scene laid out anew.
    pub scene: Option<Scene>,
}

/// Work that goes on.
pub struct Nursery {
    order: Order,
    begun: Instant,
    worker: JoinHandle<Result<Grown>>,
}

impl Nursery {
    /// Begins to build an order for a scene whose trees have been these.
    pub fn begin(order: Order, file: &SceneFile, stock: &[Stock]) -> Self {
        let (wanted, file) = (order.clone(), file.clone());
        let sizes: Vec<_> = stock.iter().map(|stock| stock.size.clone()).collect();
        let worker = std::thread::spawn(move || {
            let grow = |&number: &usize| {
                let entry = &file.species[number..=number];
                Ok((trees_of(&file, number), stock::stock(entry, file.stand_in(&wanted.method), &SoftwareCapture::new(), &|_| {})?))
            };
            let stock: Vec<(std::ops::Range<usize>, Vec<Stock>)> = wanted.species.iter().map(grow).collect::<Result<_>>()?;
            let mut now = sizes.clone();
            for (range, stock) in &stock {
                now.splice(range.clone(), stock.iter().map(|stock| stock.size.clone()));
            }
            let scene = (now != sizes).then(|| lay_out(&file, &now, &mut |_| {})).transpose()?;
            Ok(Grown { stock, scene })
        });
        Self { order, begun: Instant::now(), worker }
    }

    /// What is being built.
    pub fn order(&self) -> &Order {
        &self.order
    }

    /// For how many seconds already.
    pub fn seconds(&self) -> u64 {
        self.begun.elapsed().as_secs()
    }

    /// Whether [`Nursery::end`] would not wait.
    pub fn is_done(&self) -> bool {
        self.worker.is_finished()
    }

    /// What came of it.
    ///
    /// # Errors
    /// Those of [`stock::stock`] and [`lay_out`].
    pub fn end(self) -> (Order, Result<Grown>) {
        let died = |_| Err(Error::Internal { stage: "grove", what: format!("building {} broke off", self.order.method) });
        (self.order.clone(), self.worker.join().unwrap_or_else(died))
    }
}

/// Which trees of the stock are a species'.
pub fn trees_of(file: &SceneFile, species: usize) -> std::ops::Range<usize> {
    let count = |number: usize| {
        let entry = &file.species[number];
        if preset(&entry.source).is_some() { entry.variants as usize } else { 1 }
    };
    let first = (0..species).map(count).sum();
    first..first + count(species)
}

/// Methods that take all species of a scene; none where one is a file that cannot be built from, as baked trees are.
pub fn methods(file: &SceneFile) -> Vec<&'static str> {
    let kind = |source: &str| match preset(source) {
        Some(_) => Some(SourceKind::Grown),
        None => TreeSource::open(source, &Asked::default(), Seed(1)).ok().map(|(source, _)| source.kind()),
    };
    let kinds: Vec<_> = file.species.iter().map(|entry| kind(&entry.source)).collect();
    let takes = |kind: &Option<SourceKind>, accepted: &[SourceKind]| kind.is_some_and(|kind| accepted.contains(&kind));
    METHODS.iter().filter(|m| kinds.iter().all(|kind| takes(kind, m.accepts()))).map(|m| m.id()).collect()
}

/// What tells a file from the one that was there before: `None` where there is none.
type Stamp = Option<(SystemTime, u64)>;

/// Watches the files of a scene's species.
pub struct Watch {
    files: Vec<(usize, String, Stamp)>,
    looked: Instant,
}

impl Watch {
    /// Watches those of the species that are files; from before they are read, so that no replacement is missed.
    pub fn new(file: &SceneFile) -> Self {
        let watched = file.species.iter().enumerate().filter(|(_, entry)| preset(&entry.source).is_none());
        let files = watched.map(|(number, entry)| (number, entry.source.clone(), stamp(&entry.source))).collect();
        Self { files, looked: Instant::now() }
    }

    /// Species whose files have been replaced since the last look; at most twice a second. A file that is gone may come back.
    pub fn replaced(&mut self) -> Vec<usize> {
        if self.looked.elapsed() < WATCH {
            return vec![];
        }
        self.looked = Instant::now();
        let mut replaced = vec![];
        for (number, path, known) in &mut self.files {
            let now = stamp(path);
            if now.is_some() && now != *known {
                *known = now;
                replaced.push(*number);
            }
        }
        replaced
    }
}

fn stamp(path: &str) -> Stamp {
    let about = std::fs::metadata(path).ok()?;
    Some((about.modified().ok()?, about.len()))
}
