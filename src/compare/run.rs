//! The run: the truth from everywhere, then contender by contender, several at once where the adapter is a processor.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError, RwLock, RwLockWriteGuard};
use std::thread;
use std::time::Instant;

use crate::render::{Renderer, Tree};
use crate::repr::{self, METHODS};
use crate::{Error, Result};

use super::bench::Bench;
use super::budget::{self, Budget, Spent};
use super::contender::{Contender, Workshop};
use super::film::{self, Frame};
use super::motion::TrueMotion;
use super::photograph::Photograph;
use super::pictures::{self, Look, TRUTH_FOLDER};
use super::plan::Plan;
use super::staging::{Seen, Stage};
use super::store::Store;
use super::{Comparison, TRUTH, truth};

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
    /// The truth in motion.
    pub true_motion: TrueMotion,
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

    /// Works beside others, and adds what it took to `seconds`.
    pub fn shared<T>(&self, seconds: &mut f64, work: impl FnOnce() -> T) -> T {
        let _shared = self.quiet.read().unwrap_or_else(PoisonError::into_inner);
        let begun = Instant::now();
        let done = work();
        *seconds += begun.elapsed().as_secs_f64();
        done
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
        true_motion: TrueMotion::default(),
        quiet: RwLock::new(()),
        done: AtomicUsize::new(0),
        told,
    };
    let waiting: Vec<&Contender> = request.contenders.iter().filter(|of| store.finished(of.id()).is_none()).collect();
    hall.tell(TRUTH_FOLDER, (request.contenders.len() - waiting.len()) * hall.looks.len());
    let mut truth_s = 0.0;
    if !waiting.is_empty() {
        take_truth(renderers, &mut hall)?;
        truth_s = begun.elapsed().as_secs_f64();
        work(renderers, &hall, &waiting, &Mutex::new(&mut *store))?;
    }
    store.add_time(begun.elapsed().as_secs_f64())?;
    let finished: Vec<_> = request.contenders.iter().map(|of| store.finished(of.id()).expect("all are").clone()).collect();
    let (methods, cells): (Vec<_>, Vec<_>) = finished.into_iter().unzip();
    let spent = Spent::of_all(truth_s, methods.iter().map(|run| &run.spent), renderers.len()).of(store.taken_s());
    Ok(Comparison {
        source: request.shop.source.name().to_owned(),
        height_m: hall.stage.height_m(),
        plan: request.plan.clone(),
        budget: Budget { taken_s: store.taken_s(), spent, peak_mb: budget::peak_mb(), ..request.budget.clone() },
        methods,
        cells: cells.concat(),
    })
}

/// Every method that there is, by id.
pub fn every_method() -> Vec<String> {
    METHODS.iter().map(|method| method.id().to_owned()).collect()
}

/// The truth's pictures and films, each renderer some of them.
fn take_truth(renderers: &mut [Renderer], hall: &mut Hall) -> Result<()> {
    let built = Contender::Method(repr::method(TRUTH)?).build(&hall.request.shop)?;
    let trees = renderers.iter().map(|renderer| renderer.upload_built(&built)).collect::<Result<Vec<_>>>()?;
    let mut hands: Hands = renderers.iter_mut().zip(&trees).collect();
    let (here, plan) = (&*hall, hall.request.plan);
    let looks = side_by_side(&mut hands, here.looks.len(), |renderer, tree, i| {
        let look = &here.looks[i];
        let seen = truth::take(renderer, &here.stage, tree, look, here.request.photograph)?;
        pictures::keep(here.request.folder, plan, TRUTH_FOLDER, look, &seen.color)?;
        here.tell(TRUTH_FOLDER, 1);
        Ok(seen)
    })?;
    let mut film = |frames: Vec<Frame>| {
        side_by_side(&mut hands, frames.len(), |renderer, tree, i| frames[i].take_true(renderer, &here.stage, tree))
    };
    let true_motion = TrueMotion::of(film(film::orbit(&here.stage, plan))?, film(film::dolly(&here.stage, plan))?)?;
    for (name, strip) in true_motion.strips() {
        pictures::write(&here.request.folder.join("pictures").join(TRUTH_FOLDER).join(name), &strip)?;
    }
    (hall.truth, hall.true_motion) = (looks, true_motion);
    Ok(())
}

/// Renderers, each with the tree that it draws.
type Hands<'a> = Vec<(&'a mut Renderer, &'a Tree)>;

/// What `take` takes, number by number; whoever is free takes the next.
fn side_by_side<T: Send>(
    hands: &mut Hands,
    count: usize,
    take: impl Fn(&mut Renderer, &Tree, usize) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let (next, take) = (&AtomicUsize::new(0), &take);
    let some = |renderer: &mut Renderer, tree: &Tree| -> Result<Vec<(usize, T)>> {
        let numbers = std::iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed)).take_while(|number| *number < count);
        numbers.map(|number| Ok((number, take(renderer, tree, number)?))).collect()
    };
    let mut taken: Vec<(usize, T)> = thread::scope(|scope| {
        let working: Vec<_> = hands.iter_mut().map(|(renderer, tree)| scope.spawn(|| some(renderer, tree))).collect();
        let all = working.into_iter().map(|hand| hand.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        all.collect::<Result<Vec<_>>>().map(|all| all.into_iter().flatten().collect())
    })?;
    taken.sort_by_key(|(number, _)| *number);
    Ok(taken.into_iter().map(|(_, one)| one).collect())
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
