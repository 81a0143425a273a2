//! The run: methods one after the other, each built, looked at from everywhere and timed.

use std::path::Path;
use std::time::Duration;

use glam::{Vec3, Vec4};
use image::{Rgba, RgbaImage};
use rayon::prelude::*;

use crate::raster::{PngEffort, png_with, to_linear, to_srgb};
use crate::render::{Renderer, Shot, Tree};
use crate::repr::{
    self, BuiltTree, Capture, METHODS, Order, REFERENCE_FOCAL_PX, Representation, Settings, Stats, TreeSource, tabled,
};
use crate::{Result, Seed, files};

use super::cost::Cost;
use super::motion::{self, Motion};
use super::plan::{Plan, View};
use super::score::Figures;
use super::staging::{Seen, Stage};
use super::store::Store;
use super::{Cell, Comparison, MethodRun, Row, TRUTH};

/// What is to be compared.
pub struct Request<'a> {
    /// The tree.
    pub source: &'a TreeSource,
    /// Methods by id, in this order; [`TRUTH`] is always looked at.
    pub methods: &'a [String],
    /// What is looked at.
    pub plan: &'a Plan,
    /// Of every random number.
    pub seed: Seed,
    /// Takes pictures for methods.
    pub capture: &'a dyn Capture,
    /// Whether each method's levels are looked at by themselves too, wherever they would be drawn.
    pub levels: bool,
    /// Milliseconds to time each distance for.
    pub timing_ms: u64,
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

/// Compares. `told` hears of every picture.
///
/// # Errors
/// Those of the renderer and of files; what fails in one method alone is told in its [`MethodRun::refused`].
pub fn run(renderer: &mut Renderer, request: &Request, store: &mut Store, told: &dyn Fn(Progress)) -> Result<Comparison> {
    let stage = Stage { bounds: request.source.box_of_all()? };
    let truth = Truth::take(renderer, request, &stage)?;
    let mut bench = Bench { renderer, request, stage, truth };
    let all = request.methods.len() * request.plan.pictures();
    let mut comparison = Comparison {
        source: request.source.name().to_owned(),
        height_m: stage.height_m(),
        plan: request.plan.clone(),
        methods: vec![],
        cells: vec![],
    };
    for (number, id) in request.methods.iter().enumerate() {
        let method = repr::method(id)?;
        if store.finished(id).is_none() {
            let say = |done: usize| told(Progress { doing: id, done: number * request.plan.pictures() + done, all });
            let (run, cells) = bench.method(method, &say);
            store.keep(run, cells)?;
        }
        let (run, cells) = store.finished(id).expect("just kept").clone();
        comparison.methods.push(run);
        comparison.cells.extend(cells);
    }
    Ok(comparison)
}

/// Every method that there is, by id.
pub fn every_method() -> Vec<String> {
    METHODS.iter().map(|method| method.id().to_owned()).collect()
}

/// The tree itself from everywhere, each pixel the mean of several: what a picture would show if pixels were points.
struct Truth(Vec<Seen>);

impl Truth {
    fn take(renderer: &mut Renderer, request: &Request, stage: &Stage) -> Result<Self> {
        let built = build(request, repr::method(TRUTH)?)?;
        let tree = renderer.upload_built(&built)?;
        let seen = looks(request.plan).map(|look| {
            let shot = stage.shot(look.view, look.height_px, request.plan.suns[look.sun], None);
            let [side, _] = shot.size_px;
            let by = finer(look.height_px);
            let large = Shot { size_px: [side * by; 2], ..shot };
            let seen = coarser(&stage.see(renderer, &tree, &large)?, by);
            keep_picture(request, TRUTH_FOLDER, &look, &seen)?;
            Ok(seen)
        });
        seen.collect::<Result<_>>().map(Self)
    }
}

/// Folder of the truth's pictures.
const TRUTH_FOLDER: &str = "truth";

/// One picture to be taken.
#[derive(Clone, Copy)]
struct Look {
    number: usize,
    view_number: usize,
    view: View,
    height_px: f32,
    sun: usize,
}

/// Every picture of a plan, in order: distance by distance, light by light, view by view.
fn looks(plan: &Plan) -> impl Iterator<Item = Look> + '_ {
    let each = move |(height_px, sun): (f32, usize)| (0..plan.views.len()).map(move |view_number| (height_px, sun, view_number));
    let lights = plan.heights_px.iter().flat_map(|&height_px| (0..plan.suns.len()).map(move |sun| (height_px, sun)));
    lights.flat_map(each).enumerate().map(|(number, (height_px, sun, view_number))| Look {
        number,
        view_number,
        view: plan.views[view_number],
        height_px,
        sun,
    })
}

fn build(request: &Request, method: &dyn Representation) -> Result<BuiltTree> {
    let order = Order { method: method.id(), trunk: None, settings: &Settings::default(), seed: request.seed };
    repr::build(&order, request.source, request.capture)
}

/// Where methods are looked at.
struct Bench<'a> {
    renderer: &'a mut Renderer,
    request: &'a Request<'a>,
    stage: Stage,
    truth: Truth,
}

/// A built tree at a level.
struct Subject<'a> {
    built: &'a BuiltTree,
    tree: &'a Tree,
    /// Told, by name and distance; `None` for the level that belongs there.
    level: Option<(&'a str, f32)>,
}

impl Bench<'_> {
    /// One method; what goes wrong is told, and the rest goes on.
    fn method(&mut self, method: &dyn Representation, told: &dyn Fn(usize)) -> (MethodRun, Vec<Cell>) {
        let mut run = MethodRun {
            method: method.id().to_owned(),
            name: method.name().to_owned(),
            citation: method.citation().to_owned(),
            refused: None,
            parameters: vec![],
            build_ms: 0.0,
            memory_bytes: 0,
            disk_bytes: 0,
            levels: vec![],
            motion: Motion::default(),
            warnings: vec![],
            rows: vec![],
        };
        let mut cells = vec![];
        if let Err(why) = self.fill(method, &mut run, &mut cells, told) {
            run.refused = Some(why.to_string());
        }
        (run, cells)
    }

    fn fill(
        &mut self,
        method: &dyn Representation,
        run: &mut MethodRun,
        cells: &mut Vec<Cell>,
        told: &dyn Fn(usize),
    ) -> Result<()> {
        let settings = Settings::default();
        run.parameters = tabled(method, &settings)?.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        let built = build(self.request, method)?;
        let all = Stats::of_all(&built);
        run.build_ms = built.build_ms;
        run.memory_bytes = all.texture_bytes + all.geometry_bytes;
        run.warnings = built.warnings.iter().map(|warning| warning.message.clone()).collect();
        run.levels = built.levels.iter().map(|level| (level.name.clone(), level.distance)).collect();
        let tree = self.renderer.upload_built(&built)?;
        let by_themselves = if self.request.levels && run.levels.len() > 1 { run.levels.clone() } else { vec![] };
        let levels = by_themselves.iter().map(|(name, distance)| Some((name.as_str(), *distance)));
        for level in [None].into_iter().chain(levels) {
            let subject = Subject { built: &built, tree: &tree, level };
            self.look(&subject, run, cells, told)?;
        }
        let sun = self.request.plan.suns[0];
        run.motion = Motion {
            flicker: motion::orbit(self.renderer, &self.stage, &tree, sun)?,
            popping: motion::dolly(self.renderer, &self.stage, &tree, sun)?,
        };
        Ok(())
    }

    /// Looks at a subject from everywhere, distance by distance.
    fn look(&mut self, subject: &Subject, run: &mut MethodRun, cells: &mut Vec<Cell>, told: &dyn Fn(usize)) -> Result<()> {
        let plan = self.request.plan;
        let each = plan.views.len() * plan.suns.len();
        for (number, &height_px) in plan.heights_px.iter().enumerate() {
            let here: Vec<Look> = looks(plan).skip(number * each).take(each).collect();
            let mut seen = vec![];
            for look in &here {
                let shot = self.stage.shot(look.view, height_px, plan.suns[look.sun], subject.level.map(|(_, distance)| distance));
                let picture = self.stage.see(self.renderer, subject.tree, &shot)?;
                if subject.level.is_none() {
                    keep_picture(self.request, &run.method, look, &picture)?;
                    told(look.number);
                }
                seen.push(picture);
            }
            let judged = here.par_iter().zip(&seen).map(|(look, seen)| {
                let error = Figures::of(&self.truth.0[look.number], seen, self.stage.height_m())?;
                let level = subject.level.map(|(name, _)| name.to_owned());
                Ok(Cell { method: run.method.clone(), level, view: look.view_number, height_px, sun: look.sun, error })
            });
            let judged: Vec<Cell> = judged.collect::<Result<_>>()?;
            let error = Figures::mean(&judged.iter().map(|cell| cell.error).collect::<Vec<_>>());
            let cost = self.cost(subject, height_px, &seen[0])?;
            let level = subject.level.map(|(name, _)| name.to_owned());
            run.rows.push(Row { method: run.method.clone(), level, height_px, error, cost, failed: None });
            cells.extend(judged);
        }
        Ok(())
    }

    /// What the subject costs there; `seen` is the first picture of that distance.
    fn cost(&mut self, subject: &Subject, height_px: f32, seen: &Seen) -> Result<Cost> {
        let budget = Duration::from_millis(self.request.timing_ms);
        let told = subject.level.map(|(_, distance)| distance);
        let cost = Cost::measure(self.renderer, &self.stage, (subject.built, subject.tree), height_px, told, budget)?;
        let distance = told.unwrap_or(REFERENCE_FOCAL_PX / height_px);
        let (camera, side_px) = self.stage.camera(self.request.plan.views[0], height_px);
        Ok(cost.seen(subject.built, distance, &camera, side_px, seen))
    }
}

/// Of how many pixels along each side one of the truth is the mean: enough for leaves that are far smaller than it. With four for a tree of
/// 16 pixels its thin parts were missing, a third of some trees.
pub fn finer(height_px: f32) -> u32 {
    ((512.0 / height_px).ceil() as u32).clamp(2, 32)
}

/// Each pixel the mean of `by` × `by`: colours by what is there, depth over what is there where that is half or more.
pub fn coarser(seen: &Seen, by: u32) -> Seen {
    let (width, height) = (seen.color.width() / by, seen.color.height() / by);
    let mut depth_m = Vec::with_capacity((width * height) as usize);
    let color = RgbaImage::from_fn(width, height, |x, y| {
        let (mut sum, mut way, mut there) = (Vec4::ZERO, 0.0, 0);
        for (i, j) in (0..by * by).map(|k| (x * by + k % by, y * by + k / by)) {
            let [r, g, b, a] = seen.color.get_pixel(i, j).0;
            let alpha = f32::from(a) / 255.0;
            sum += (alpha * Vec3::from([r, g, b].map(to_linear))).extend(alpha);
            let depth = seen.depth_m[(j * seen.color.width() + i) as usize];
            if depth.is_finite() {
                (way, there) = (way + depth, there + 1);
            }
        }
        depth_m.push(if 2 * there >= by * by { way / there as f32 } else { f32::INFINITY });
        let [r, g, b] = (sum.truncate() / sum.w.max(1e-6)).to_array().map(to_srgb);
        Rgba([r, g, b, (255.0 * sum.w / (by * by) as f32).round() as u8])
    });
    Seen { color, depth_m }
}

/// Whether a look's picture goes into the report: of each elevation the first azimuth.
pub fn is_kept(plan: &Plan, view_number: usize) -> bool {
    let elevation_deg = plan.views[view_number].elevation_deg;
    plan.views[..view_number].iter().all(|view| view.elevation_deg != elevation_deg)
}

/// Where the picture of a look lies within the folder of a comparison.
pub fn picture_path(method: &str, view: View, height_px: f32, sun: usize) -> String {
    format!("pictures/{method}/{}", picture_file(view, height_px, sun))
}

/// Its name within the method's folder.
pub fn picture_file(view: View, height_px: f32, sun: usize) -> String {
    format!("e{:.0}_h{height_px:.0}_s{sun}.png", view.elevation_deg)
}

fn keep_picture(request: &Request, method: &str, look: &Look, seen: &Seen) -> Result<()> {
    if !is_kept(request.plan, look.view_number) {
        return Ok(());
    }
    let path = request.folder.join(picture_path(method, look.view, look.height_px, look.sun));
    let _folder = files::ready_folder(path.parent().unwrap_or(request.folder))?;
    files::write_whole(&path, &png_with(&seen.color, PngEffort::Small)?)
}
