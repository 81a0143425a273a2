//! The run: the truth from everywhere, then contender by contender, several at once where the adapter is a processor.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError, RwLock, RwLockWriteGuard};
use std::thread;
use std::time::Instant;

use crate::render::Renderer;
use crate::repr::{self, METHODS};
use crate::{Error, Result};

use super::bench::Bench;
use super::budget::{self, Budget};
use super::contender::{Contender, Workshop};
use super::photograph::Photograph;
use super::pictures::{self, Look, TRUTH_FOLDER};
use super::plan::Plan;
use super::staging::{Seen, Stage};
use super::store::Store;
use super::{Comparison, TRUTH, motion, truth};

/// What is to be compared.
pub struct Request<'a> {
    /// With what contenders are built.
    pub shop: Workshop<'a>,
    /// The truth from the plan's photographed view.
    pub photograph: Option<&'a Photograph>,
    /// Who takes part, in this order.
    pub contenders: &'a [Contender],
    /// What is looked at.
    pub plan: &'a Plan,
    /// How the plan came about.
    pub budget: &'a Budget,
    /// Where pictures go.
    pub folder: &'a Path,
}

/// How far a run is.
pub struct Progress<'a> {
    /// What is being done.
    pub doing: &'a str,
    /// Pictures done, of all.
    pub done: usize,
    /// All of them.
    pub all: usize,
}

/// What the workers of a run share.
pub(super) struct Hall<'a> {
    pub request: &'a Request<'a>,
    pub stage: Stage,
    pub looks: Vec<Look>,
    /// The truth, look by look.
    pub truth: Vec<Seen>,
    /// How much the truth itself changes from frame to frame on the orbit.
    pub truth_flicker: f64,
    /// Whoever times something holds it alone; whoever draws or reckons shares it.
    quiet: RwLock<()>,
    done: AtomicUsize,
    told: &'a (dyn Fn(Progress) + Sync),
}

impl Hall<'_> {
    /// Nobody else works until this goes.
    pub fn alone(&self) -> RwLockWriteGuard<'_, ()> {
        self.quiet.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// Works beside others.
    pub fn shared<T>(&self, work: impl FnOnce() -> T) -> T {
        let _shared = self.quiet.read().unwrap_or_else(PoisonError::into_inner);
        work()
    }

    /// So many more pictures are done.
    pub fn tell(&self, doing: &str, more: usize) {
        let done = self.done.fetch_add(more, Ordering::Relaxed) + more;
        (self.told)(Progress { doing, done, all: (1 + self.request.contenders.len()) * self.looks.len() });
    }
}

/// Compares. `told` hears of every picture. Several `renderers` work side by side, one contender each.
///
/// # Errors
/// Those of the renderer and of files; what fails in one contender alone is told in its [`MethodRun::refused`](super::MethodRun::refused),
/// what fails in one picture in its [`Cell::failed`](super::Cell::failed).
pub fn run(
    renderers: &mut [Renderer],
    request: &Request,
    store: &mut Store,
    told: &(dyn Fn(Progress) + Sync),
) -> Result<Comparison> {
    let begun = Instant::now();
    let mut hall = Hall {
        request,
        stage: Stage { bounds: request.shop.source.box_of_all()? },
        looks: pictures::looks(request.plan),
        truth: vec![],
        truth_flicker: 0.0,
        quiet: RwLock::new(()),
        done: AtomicUsize::new(0),
        told,
    };
    let waiting: Vec<&Contender> = request.contenders.iter().filter(|of| store.finished(of.id()).is_none()).collect();
    hall.tell(TRUTH_FOLDER, (request.contenders.len() - waiting.len()) * hall.looks.len());
    if !waiting.is_empty() {
        take_truth(renderers, &mut hall)?;
        work(renderers, &hall, &waiting, &Mutex::new(&mut *store))?;
    }
    store.add_time(begun.elapsed().as_secs_f64())?;
    let mut comparison = Comparison {
        source: request.shop.source.name().to_owned(),
        height_m: hall.stage.height_m(),
        plan: request.plan.clone(),
        budget: Budget { taken_s: store.taken_s(), peak_mb: budget::peak_mb(), ..request.budget.clone() },
        methods: vec![],
        cells: vec![],
    };
    for contender in request.contenders {
        let (run, cells) = store.finished(contender.id()).expect("all are").clone();
        comparison.methods.push(run);
        comparison.cells.extend(cells);
    }
    Ok(comparison)
}

/// Every method that there is, by id.
pub fn every_method() -> Vec<String> {
    METHODS.iter().map(|method| method.id().to_owned()).collect()
}

/// The truth's pictures, each renderer some of them.
fn take_truth(renderers: &mut [Renderer], hall: &mut Hall) -> Result<()> {
    let built = Contender::Method(repr::method(TRUTH)?).build(&hall.request.shop)?;
    let trees = renderers.iter().map(|renderer| renderer.upload_built(&built)).collect::<Result<Vec<_>>>()?;
    let (next, here) = (AtomicUsize::new(0), &*hall);
    let take = |renderer: &mut Renderer, tree: &_| -> Result<Vec<(usize, Seen)>> {
        let mut taken = vec![];
        while let Some(look) = here.looks.get(next.fetch_add(1, Ordering::Relaxed)) {
            let seen = truth::take(renderer, &here.stage, tree, look, here.request.photograph)?;
            pictures::keep(here.request.folder, here.request.plan, TRUTH_FOLDER, look, &seen.color)?;
            here.tell(TRUTH_FOLDER, 1);
            taken.push((look.number, seen));
        }
        Ok(taken)
    };
    let mut taken: Vec<(usize, Seen)> = thread::scope(|scope| {
        let take = &take;
        let hands: Vec<_> =
            renderers.iter_mut().zip(&trees).map(|(renderer, tree)| scope.spawn(move || take(renderer, tree))).collect();
        let all = hands.into_iter().map(|hand| hand.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        all.collect::<Result<Vec<_>>>().map(|all| all.concat())
    })?;
    taken.sort_by_key(|(number, _)| *number);
    let plan = hall.request.plan;
    let orbit = motion::orbit(&mut renderers[0], &hall.stage, &trees[0], plan)?;
    hall.truth_flicker = motion::mean_step(&orbit)?;
    hall.truth = taken.into_iter().map(|(_, seen)| seen).collect();
    Ok(())
}

/// Each renderer takes one contender after the other, until none waits or a fault concerns them all.
fn work(renderers: &mut [Renderer], hall: &Hall, waiting: &[&Contender], store: &Mutex<&mut Store>) -> Result<()> {
    let next = AtomicUsize::new(0);
    let hand = |renderer: &mut Renderer| -> Result<()> {
        let mut bench = Bench { renderer, hall };
        while let Some(contender) = waiting.get(next.fetch_add(1, Ordering::Relaxed)) {
            let worked = bench.contender(contender);
            let (run, cells) = worked.inspect_err(|_| next.store(waiting.len(), Ordering::Relaxed))?;
            // What was kept before somebody panicked is whole.
            store.lock().unwrap_or_else(PoisonError::into_inner).keep(run, cells)?;
        }
        Ok::<(), Error>(())
    };
    thread::scope(|scope| {
        let hand = &hand;
        let hands: Vec<_> = renderers.iter_mut().map(|renderer| scope.spawn(move || hand(renderer))).collect();
        hands.into_iter().try_for_each(|hand| hand.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })
}
