//! Tree representations (DESIGN §4): every stand-in for a tree is built from the same [`TreeSource`] by the same call, and comes out as
//! the same plain data, [`BuiltTree`]. Nothing here knows how it is drawn.
//!
//! [`METHODS`] is the only list of them: the command line, the comparison, the groves and the tests walk it. Adding a method is one file
//! with a [`Representation`] and one row; only a new way of drawing is a new [`Drawn`].

mod billboard;
mod billboard_cloud;
pub mod box_hierarchy;
mod built;
mod capture;
pub mod card;
mod crossed_planes;
mod csg;
pub mod file;
mod geometry;
pub mod grid_slices;
pub mod levels;
pub mod limits;
pub mod lodf;
pub mod lodstrips;
mod meshopt;
pub mod multichain;
mod octahedral;
mod pick;
mod settings;
mod slices;
mod source;
mod sphere_board;
mod stats;
#[cfg(test)]
mod trial;
pub mod vdf;

use std::time::Instant;

use rayon::prelude::*;

use crate::{Error, Result, Seed};

pub use built::{BuiltPart, BuiltTree, Drawn, Facing, Fade, Level, Octahedral, REFERENCE_FOCAL_PX, Seen};
pub use capture::{Capture, SoftwareCapture};
pub use settings::{Settings, Switch, tabled};
pub use source::{SourceKind, TreeSource, open_model};
pub use stats::Stats;

/// Every method, in the order in which they are listed and compared.
#[rustfmt::skip]
pub const METHODS: &[&dyn Representation] = &[
    &geometry::Geometry,
    &billboard::Billboard,
    &crossed_planes::CrossedPlanes,
    &slices::Slices,
    &grid_slices::GridSlices,
    &box_hierarchy::BoxHierarchy,
    &csg::Csg,
    &sphere_board::SphereBoard,
    &octahedral::OctahedralImpostor,
    &billboard_cloud::BillboardCloud,
    &meshopt::Meshopt,
    &lodf::Lodf,
    &vdf::Vdf,
    &lodstrips::LodstripsWood,
    &multichain::Multichain,
];

/// How much of a tree a method builds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// All of it.
    Tree,
    /// The leaves; another method builds the wood.
    Foliage,
    /// Trunk and branches; another method builds the leaves.
    Wood,
}

/// What a method gets to build from.
pub struct Job<'a> {
    /// The tree.
    pub source: &'a TreeSource,
    /// How much of it.
    pub scope: Scope,
    /// What was set; [`Settings::read`] makes the method's own table of it.
    pub settings: &'a Settings,
    /// Of every random number.
    pub seed: Seed,
    /// Takes pictures of the source.
    pub capture: &'a dyn Capture,
}

/// What an update of a built tree has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dirty {
    /// Only the parts from the first number up to before the second.
    Parts(usize, usize),
    /// Everything.
    All,
}

/// One way to stand for a tree. Stateless.
pub trait Representation: Sync {
    /// The word for it on the command line, in files and tables: lower case with hyphens.
    fn id(&self) -> &'static str;

    /// What it is called.
    fn name(&self) -> &'static str;

    /// Where it comes from: paper with section and figure.
    fn citation(&self) -> &'static str;

    /// What it does with how much of a tree; the first is what it does unasked.
    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Tree]
    }

    /// Kinds of source that it takes.
    fn accepts(&self) -> &'static [SourceKind];

    /// Its parameters with meanings, units, ranges, defaults and sources.
    fn specs(&self) -> Vec<crate::params::ParamSpec>;

    /// Who builds the wood where this builds only the leaves, unless another is asked for; `geometry` does where that cannot.
    fn partner(&self) -> &'static str {
        "geometry"
    }

    /// Why it cannot take `source`, beyond its kind; `None` when it can.
    fn refuses(&self, _source: &TreeSource) -> Option<String> {
        None
    }

    /// Builds it.
    ///
    /// # Errors
    /// [`Error::Parameter`] or [`Error::UnknownParameter`] for settings out of range, [`Error::NotApplicable`] for a source that it cannot
    /// take, and the method's own.
    fn build(&self, job: &Job) -> Result<BuiltTree>;

    /// Brings `built` up to date with a source that has grown on (Truelsen §9.2); unless a method knows better, all of it is built anew.
    /// `turn` counts the calls, from 0: a method that does only a part of the work in each knows by it what comes next.
    ///
    /// # Errors
    /// As [`Representation::build`].
    fn update(&self, built: &mut BuiltTree, job: &Job, _turn: usize) -> Result<Dirty> {
        *built = self.build(job)?;
        Ok(Dirty::All)
    }
}

/// The method of that name.
///
/// # Errors
/// [`Error::UnknownMethod`] names those there are.
pub fn method(id: &str) -> Result<&'static dyn Representation> {
    METHODS.iter().copied().find(|method| method.id() == id).ok_or_else(|| Error::UnknownMethod {
        known: METHODS.iter().map(|method| method.id()).collect::<Vec<_>>().join(", "),
        found: id.to_owned(),
    })
}

/// What to build, as a user says it.
#[derive(Debug, Clone)]
pub struct Order<'a> {
    /// The method.
    pub method: &'a str,
    /// Who builds the wood; `None` for the method's own choice.
    pub trunk: Option<&'a str>,
    /// Parameters of the method by name; those of the wood's method with `trunk.` before them.
    pub settings: &'a Settings,
    /// Of every random number.
    pub seed: Seed,
}

/// Builds what was ordered from `source`: the method, joined with another for the wood or the leaves where it builds only one of them.
///
/// # Errors
/// [`Error::UnknownMethod`], [`Error::TreeTooLarge`], [`Error::NotApplicable`] with the reason, those of [`Representation::build`], and
/// [`Error::Internal`] when what was built breaks a promise ([`BuiltTree::check`]).
pub fn build(order: &Order, source: &TreeSource, capture: &dyn Capture) -> Result<BuiltTree> {
    let begun = Instant::now();
    let main = method(order.method)?;
    let tasks = tasks(order, source)?;
    let halves = tasks.par_iter().map(|task| task.method.build(&task.job(order, source, capture)));
    let built = halves.collect::<Result<Vec<_>>>()?.into_iter().reduce(BuiltTree::joined);
    let built = built.ok_or_else(|| Error::Internal { stage: "repr", what: format!("{}: nothing to do", main.id()) })?;
    built.check().map_err(|what| Error::Internal { stage: "repr", what: format!("{}: {what}", main.id()) })?;
    Ok(BuiltTree { method: main.id().to_owned(), build_ms: begun.elapsed().as_secs_f64() * 1e3, ..built })
}

/// What one method does for an order.
pub(crate) struct Task {
    /// The method.
    pub method: &'static dyn Representation,
    /// What it builds of the tree.
    pub scope: Scope,
    /// Its own parameters.
    pub settings: Settings,
}

impl Task {
    /// What the method gets for it.
    pub fn job<'a>(&'a self, order: &Order, source: &'a TreeSource, capture: &'a dyn Capture) -> Job<'a> {
        Job { source, scope: self.scope, settings: &self.settings, seed: order.seed, capture }
    }
}

/// Who builds what of `source`, the leaves before the wood. Everything that can be known to be wrong with an order before work is spent on
/// it is refused here, whatever is made of it.
///
/// # Errors
/// Those of [`build`] but the methods' own.
pub(crate) fn tasks(order: &Order, source: &TreeSource) -> Result<Vec<Task>> {
    let main = method(order.method)?;
    limits::check_source(source)?;
    let (own, for_trunk) = order.settings.split("trunk.");
    let scopes = main.scopes();
    let task = |method: &'static dyn Representation, scope, settings: Settings| {
        takes(method, source)?;
        settings.check(method)?;
        Ok(Task { method, scope, settings })
    };
    if scopes.contains(&Scope::Foliage) && (order.trunk.is_some() || scopes[0] == Scope::Foliage) {
        let partner = wood_method(main, order.trunk, source)?;
        return Ok(vec![task(main, Scope::Foliage, own)?, task(partner, Scope::Wood, for_trunk)?]);
    }
    if order.trunk.is_some() || !for_trunk.is_empty() {
        let why = format!("it builds {}", if scopes[0] == Scope::Wood { "the wood itself" } else { "the whole tree" });
        return Err(Error::NotApplicable { method: main.id(), source_name: "--trunk".to_owned(), why });
    }
    if scopes[0] == Scope::Wood {
        return Ok(vec![task(method("geometry")?, Scope::Foliage, Settings::default())?, task(main, Scope::Wood, own)?]);
    }
    Ok(vec![task(main, Scope::Tree, own)?])
}

/// Who builds the wood of `source` beside `main`, which builds its leaves.
///
/// # Errors
/// [`Error::UnknownMethod`] for one that is asked for and not there, or builds no wood.
fn wood_method(main: &dyn Representation, asked: Option<&str>, source: &TreeSource) -> Result<&'static dyn Representation> {
    let partner = match asked {
        Some(id) => method(id)?,
        None => method(main.partner()).and_then(|own| if takes(own, source).is_ok() { Ok(own) } else { method("geometry") })?,
    };
    if partner.scopes().contains(&Scope::Wood) {
        return Ok(partner);
    }
    Err(Error::UnknownMethod { known: ids_of(Scope::Wood), found: partner.id().to_owned() })
}

/// Whether `method` takes `source`.
///
/// # Errors
/// [`Error::NotApplicable`] with the reason when it does not.
pub fn takes(method: &dyn Representation, source: &TreeSource) -> Result<()> {
    let kind = source.kind();
    let why = if method.accepts().contains(&kind) {
        method.refuses(source)
    } else {
        let kinds = method.accepts().iter().map(|kind| kind.words()).collect::<Vec<_>>().join(" or ");
        Some(format!("it needs {kinds}, and this is {}", kind.words()))
    };
    why.map_or(Ok(()), |why| Err(not_applicable(method, source, why)))
}

/// That `method` cannot take `source`, and why.
fn not_applicable(method: &dyn Representation, source: &TreeSource, why: String) -> Error {
    Error::NotApplicable { method: method.id(), source_name: source.name().to_owned(), why }
}

fn ids_of(scope: Scope) -> String {
    METHODS.iter().filter(|m| m.scopes().contains(&scope)).map(|m| m.id()).collect::<Vec<_>>().join(", ")
}
