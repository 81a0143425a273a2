//! One contender: built and timed alone, then looked at from everywhere while its figures are reckoned. What fails is told where it
//! failed, and the rest goes on.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::render::{Renderer, Shot, Tree};
use crate::repr::{BuiltTree, REFERENCE_FOCAL_PX, Stats};
use crate::{Error, Result};

use super::contender::Contender;
use super::cost::Cost;
use super::motion;
use super::pictures::{self, Look};
use super::run::Hall;
use super::score::Figures;
use super::staging::{Seen, Stage};
use super::{Cell, MethodRun, Row};

/// Where contenders are looked at.
pub(super) struct Bench<'a> {
    pub renderer: &'a mut Renderer,
    pub hall: &'a Hall<'a>,
}

/// Pictures that are taken while figures of the first are still being reckoned: they wait in memory, and whoever has something to time waits
/// for all of them.
const AT_ONCE: usize = 8;

/// A built tree at a level.
struct Subject<'a> {
    id: &'a str,
    built: &'a BuiltTree,
    tree: &'a Tree,
    /// Told, by name and distance; `None` for the level that belongs there.
    level: Option<(&'a str, f32)>,
    /// Its cost at each of the plan's distances, or why there is none.
    costs: Vec<Result<Cost, String>>,
}

impl Subject<'_> {
    fn level_name(&self) -> Option<String> {
        self.level.map(|(name, _)| name.to_owned())
    }
}

impl Bench<'_> {
    /// One contender with its cells.
    ///
    /// # Errors
    /// [`Error::Device`] when the device is of no use any more: no fault of the contender's.
    pub fn contender(&mut self, contender: &Contender) -> Result<(MethodRun, Vec<Cell>)> {
        let (name, citation) = contender.told();
        let mut run = MethodRun { method: contender.id().to_owned(), name, citation, ..MethodRun::default() };
        let mut cells = vec![];
        if let Err(why) = self.fill(contender, &mut run, &mut cells) {
            self.renderer.gpu.wait()?;
            run.refused = Some(why.to_string());
            self.hall.tell(contender.id(), self.hall.looks.len());
        }
        Ok((run, cells))
    }

    fn fill(&mut self, contender: &Contender, run: &mut MethodRun, cells: &mut Vec<Cell>) -> Result<()> {
        let plan = self.hall.request.plan;
        run.parameters = contender.parameters()?;
        // Alone, so that nobody's work is in anybody's milliseconds.
        let alone = self.hall.alone();
        let begun = Instant::now();
        let built = contender.build(&self.hall.request.shop)?;
        let all = Stats::of_all(&built);
        run.build_ms = built.build_ms;
        run.spent.build_s = begun.elapsed().as_secs_f64();
        run.memory_bytes = all.texture_bytes + all.geometry_bytes;
        run.warnings = built.warnings.iter().map(|warning| warning.message.clone()).collect();
        run.levels = built.levels.iter().map(|level| (level.name.clone(), level.distance)).collect();
        let tree = self.renderer.upload_built(&built)?;
        let by_themselves = if plan.levels && run.levels.len() > 1 { run.levels.clone() } else { vec![] };
        let levels = by_themselves.iter().map(|(name, distance)| Some((name.as_str(), *distance)));
        let mut subjects = vec![];
        for level in [None].into_iter().chain(levels) {
            let mut subject = Subject { id: contender.id(), built: &built, tree: &tree, level, costs: vec![] };
            for &height_px in &plan.heights_px {
                let cost = self.cost(&subject, height_px).or_else(|why| self.told(why))?;
                subject.costs.push(cost);
            }
            subjects.push(subject);
        }
        run.spent.timing_s = begun.elapsed().as_secs_f64() - run.spent.build_s;
        drop(alone);
        match self.hall.shared(&mut run.spent.files_s, || contender.disk_bytes(&built, &self.hall.request.shop)) {
            Ok(bytes) => run.disk_bytes = bytes,
            Err(why) => run.warnings.push(format!("no file of it could be written: {why}")),
        }
        subjects.iter().try_for_each(|subject| self.look(subject, run, cells))?;
        let hall = self.hall;
        match hall.shared(&mut run.spent.motion_s, || {
            motion::measure(self.renderer, &hall.stage, (&built, &tree), plan, &hall.true_motion)
        }) {
            Ok((motion, strips)) => {
                run.motion = Some(motion);
                let folder = self.hall.request.folder.join("pictures").join(contender.id());
                for (name, strip) in strips {
                    pictures::write(&folder.join(name), &strip)?;
                }
            }
            Err(why) => {
                self.renderer.gpu.wait()?;
                run.warnings.push(format!("not looked at in motion: {why}"));
            }
        }
        Ok(())
    }

    /// Why something has failed, in words; the device's own end is nobody's failure.
    fn told<T>(&self, why: Error) -> Result<Result<T, String>> {
        self.renderer.gpu.wait()?;
        Ok(Err(why.to_string()))
    }

    /// What the subject costs there, all but its overdraw.
    fn cost(&mut self, subject: &Subject, height_px: f32) -> Result<Result<Cost, String>> {
        let budget = Duration::from_millis(self.hall.request.plan.timing_ms);
        let told = subject.level.map(|(_, distance)| distance);
        Cost::measure(self.renderer, &self.hall.stage, (subject.built, subject.tree), height_px, told, budget).map(Ok)
    }

    /// Looks at a subject from everywhere, distance by distance.
    fn look(&mut self, subject: &Subject, run: &mut MethodRun, cells: &mut Vec<Cell>) -> Result<()> {
        let hall = self.hall;
        let plan = hall.request.plan;
        for (number, &height_px) in plan.heights_px.iter().enumerate() {
            // Levels are looked at from fewer places: there are many of them.
            let counts = |look: &&Look| subject.level.is_none() || look.sun_number == 0 && plan.is_first(look.view_number);
            let here: Vec<&Look> = hall.looks.iter().filter(|look| look.height_px == height_px).filter(counts).collect();
            let (mut judged, mut overdraw) = (vec![], 0.0);
            for some in here.chunks(AT_ONCE) {
                let shaded = judged.is_empty().then_some(&mut overdraw);
                judged.extend(hall.shared(&mut run.spent.pictures_s, || self.judge(subject, some, shaded))?);
            }
            let worked: Vec<Figures> = judged.iter().filter(|cell| cell.failed.is_none()).map(|cell| cell.error).collect();
            let cost = subject.costs[number].clone().map(|cost| Cost { overdraw, ..cost });
            let first = judged.iter().find_map(|cell| cell.failed.as_deref());
            let pictures = first.map(|why| format!("{} of {} pictures: {why}", judged.len() - worked.len(), judged.len()));
            let timing = cost.as_ref().err().map(|why| format!("its cost: {why}"));
            let failed: Vec<String> = pictures.into_iter().chain(timing).collect();
            run.rows.push(Row {
                method: subject.id.to_owned(),
                level: subject.level_name(),
                height_px,
                error: Figures::mean(&worked),
                cost: cost.unwrap_or_default(),
                failed: (!failed.is_empty()).then(|| failed.join("; ")),
            });
            cells.extend(judged);
        }
        Ok(())
    }

    /// The cells of some looks, and the overdraw of the first where that is wanted. Figures are reckoned while the next picture is drawn.
    fn judge(&mut self, subject: &Subject, looks: &[&Look], overdraw: Option<&mut f64>) -> Result<Vec<Cell>> {
        let (renderer, hall) = (&mut *self.renderer, self.hall);
        let stage = &hall.stage;
        let cell = |look: &Look| Cell {
            method: subject.id.to_owned(),
            level: subject.level_name(),
            view: look.view_number,
            height_px: look.height_px,
            sun: look.sun_number,
            error: Figures::default(),
            failed: None,
        };
        let cells = Mutex::new(looks.iter().map(|look| cell(look)).collect::<Vec<_>>());
        let overdraw = Mutex::new(overdraw);
        // What concerns the whole run: a full disk.
        let fault = Mutex::new(Ok(()));
        let kept = |judged: Result<Figures>, i: usize| {
            let mut cells = cells.lock().expect("nobody panics with it");
            match judged {
                Ok(error) => cells[i].error = error,
                Err(why) => cells[i].failed = Some(why.to_string()),
            }
        };
        rayon::in_place_scope(|scope| -> Result<()> {
            for (i, &look) in looks.iter().enumerate() {
                let told = subject.level.map(|(_, distance)| distance);
                let shot = stage.shot_of(look, told);
                let seen = match see(stage, renderer, subject, look.height_px, &shot) {
                    Ok(seen) => seen,
                    Err(why) => {
                        renderer.gpu.wait()?;
                        kept(Err(why), i);
                        continue;
                    }
                };
                let (kept, fault, overdraw) = (&kept, &fault, &overdraw);
                scope.spawn(move |_| {
                    let wanted = if i == 0 { overdraw.lock().expect("nobody panics with it").take() } else { None };
                    if let Some(overdraw) = wanted {
                        let distance = told.unwrap_or(REFERENCE_FOCAL_PX / look.height_px);
                        *overdraw = super::cost::overdraw(subject.built, distance, &shot.camera, shot.size_px[0], &seen);
                    }
                    kept(Figures::of(&hall.truth[look.number], &seen, stage.height_m()), i);
                    if subject.level.is_none() {
                        let written = pictures::keep(hall.request.folder, hall.request.plan, subject.id, look, &seen.color);
                        if written.is_err() {
                            *fault.lock().expect("nobody panics with it") = written;
                        }
                        hall.tell(subject.id, 1);
                    }
                });
            }
            Ok(())
        })?;
        fault.into_inner().expect("nobody panics with it")?;
        Ok(cells.into_inner().expect("nobody panics with it"))
    }
}

/// A picture of a subject.
fn see(stage: &Stage, renderer: &mut Renderer, subject: &Subject, height_px: f32, shot: &Shot) -> Result<Seen> {
    // What tests call so breaks there: no tree that can be built does.
    if cfg!(test) && subject.id == "broken-at-32" && height_px == 32.0 {
        return Err(Error::Internal { stage: "compare::bench", what: "as tests asked for".to_owned() });
    }
    stage.see(renderer, subject.tree, shot)
}
