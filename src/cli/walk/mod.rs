//! `grove --interactive`: the scene in a window, to be flown through, its method switched, its culling looked at from outside.

mod flight;
mod frozen;
mod keys;
mod nursery;

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path as FilePath;

use glam::Vec2;

use super::window::keys::Binding;
use super::window::{Content, Pace, Request};
use crate::Result;
use crate::grove::drive::{self, Grove};
use crate::grove::stock::Stock;
use crate::grove::trail::Trail;
use crate::grove::{Scene, culling};
use crate::render::{Camera, Counted, LevelViewer, Renderer, Shot, Show, World};

use flight::Flight;
use keys::Action;
pub use keys::KEYS;
pub use nursery::Watch;
use nursery::{Grown, Nursery, Order};

/// Species that the text has lines for.
const MOST_LINES: usize = 6;

/// A grove, and who flies through it.
pub struct Walk {
    scene: Scene,
    stock: Vec<Stock>,
    grove: Option<Grove>,
    flight: Flight,
    trail: Trail,
    show: Show,
    /// Who culls and chooses levels instead of the picture's camera.
    frozen: Option<(Camera, LevelViewer)>,
    last: Option<Last>,
    seen: Seen,
    /// Methods that take the species.
    methods: Vec<&'static str>,
    /// The one that is shown.
    method: String,
    /// The one that was asked for last, whatever came of it, and whether it is still to be built.
    asked: (String, bool),
    /// Species whose files were replaced.
    stale: BTreeSet<usize>,
    nursery: Option<Nursery>,
    /// For how many seconds something has been built, as the text says.
    told_s: u64,
    watch: Watch,
    /// What came of what was built last.
    notice: String,
}

/// The last picture.
struct Last {
    camera: Camera,
    viewer: LevelViewer,
    time_s: f64,
    /// Whether the viewer was about to go on from there by himself.
    moving: bool,
    /// Whether he had moved: levels follow his speed, and a picture later he has none.
    moved: bool,
}

/// What the last picture showed.
#[derive(Debug, Clone, Default, PartialEq)]
struct Seen {
    trees: usize,
    near: usize,
    counted: Counted,
    /// At each level of each of the stock.
    shown: Vec<Vec<usize>>,
}

impl Walk {
    /// Through that scene, planted with these trees, whose files are watched.
    pub fn new(scene: Scene, (stock, watch): (Vec<Stock>, Watch)) -> Self {
        let file = &scene.file;
        Self {
            flight: Flight::new(&scene.path, file.camera.camera_speed_m_s as f32),
            methods: nursery::methods(file),
            method: file.method.clone(),
            asked: (file.method.clone(), false),
            watch,
            scene,
            stock,
            grove: None,
            trail: Trail::default(),
            show: Show::Picture,
            frozen: None,
            last: None,
            seen: Seen::default(),
            stale: BTreeSet::new(),
            nursery: None,
            told_s: 0,
            notice: String::new(),
        }
    }

    /// Asks for the method before or after the one that was asked for last.
    fn step(&mut self, back: bool) {
        let count = self.methods.len();
        if count == 0 {
            self.notice = "no other method takes all of these species".to_owned();
            return;
        }
        let next = match self.methods.iter().position(|id| *id == self.asked.0) {
            Some(now) => (now + if back { count - 1 } else { 1 }) % count,
            None if back => count - 1,
            None => 0,
        };
        self.ask(self.methods[next].to_owned());
    }

    fn ask(&mut self, method: String) {
        self.asked = (method, true);
        self.begin();
    }

    /// Begins with what is to be built, unless something is being built already.
    fn begin(&mut self) {
        if self.nursery.is_some() {
            return;
        }
        let switches = std::mem::take(&mut self.asked.1) && self.asked.0 != self.method;
        let order = if switches {
            Order { method: self.asked.0.clone(), species: (0..self.scene.file.species.len()).collect() }
        } else {
            Order { method: self.method.clone(), species: std::mem::take(&mut self.stale).into_iter().collect() }
        };
        if !order.species.is_empty() {
            self.told_s = 0;
            self.nursery = Some(Nursery::begin(order, &self.scene.file, &self.stock));
        }
    }

    /// Takes what is ready, unless something else was asked for in the meantime, and goes on with what is wanted now. True when something
    /// was ready.
    fn harvest(&mut self, renderer: &Renderer) -> bool {
        let Some(ready) = self.nursery.take_if(|nursery| nursery.is_done()) else { return false };
        let (order, grown) = ready.end();
        let anew = order.method == self.method;
        if anew || order.method == self.asked.0 {
            self.notice = match grown.and_then(|grown| self.replant(renderer, grown)) {
                Ok(()) if anew => format!("read anew: {}", self.names(&order.species)),
                Ok(()) => {
                    self.method = order.method;
                    String::new()
                }
                Err(error) if anew => format!("the old tree stays: {error}"),
                Err(error) => format!("{} stays: {error}", self.method),
            };
        }
        self.begin();
        true
    }

    /// Puts what was built onto the device; where that fails everything stays as it was.
    fn replant(&mut self, renderer: &Renderer, grown: Grown) -> Result<()> {
        let old = self.exchange(grown.stock);
        match Grove::plant(renderer, grown.scene.as_ref().unwrap_or(&self.scene), &self.stock) {
            Ok(grove) => {
                self.grove = Some(grove);
                self.scene = grown.scene.unwrap_or_else(|| self.scene.clone());
                Ok(())
            }
            Err(error) => {
                self.exchange(old);
                Err(error)
            }
        }
    }

    /// Puts these trees in the place of others, and gives those.
    fn exchange(&mut self, trees: Vec<(Range<usize>, Vec<Stock>)>) -> Vec<(Range<usize>, Vec<Stock>)> {
        trees.into_iter().map(|(range, stock)| (range.clone(), self.stock.splice(range, stock).collect())).collect()
    }

    /// What the scene's file calls these species.
    fn names(&self, species: &[usize]) -> String {
        species.iter().map(|number| &*self.scene.file.species[*number].source).collect::<Vec<_>>().join(", ")
    }

    fn freeze(&mut self) {
        self.frozen = match self.frozen {
            Some(_) => None,
            None => self.last.as_ref().map(|last| (last.camera, last.viewer)),
        };
        // What the camera did meanwhile is no speed.
        self.trail = Trail::default();
    }

    /// How many trees are at which level, a line for each species, its variants together.
    fn levels(&self) -> Vec<String> {
        let Some(grove) = &self.grove else { return vec![] };
        let mut of_species: Vec<(&str, Vec<(&str, usize)>)> = vec![];
        for ((stock, levels), shown) in self.stock.iter().zip(grove.levels()).zip(&self.seen.shown) {
            let row = match of_species.iter().position(|(name, _)| *name == stock.size.name) {
                Some(row) => row,
                None => {
                    of_species.push((&stock.size.name, vec![]));
                    of_species.len() - 1
                }
            };
            for (level, trees) in levels.into_iter().zip(shown) {
                let counts = &mut of_species[row].1;
                match counts.iter_mut().find(|(name, _)| *name == level) {
                    Some((_, count)) => *count += trees,
                    None => counts.push((level, *trees)),
                }
            }
        }
        let words = |(name, counts): &(&str, Vec<(&str, usize)>)| {
            let name = FilePath::new(name).file_stem().map_or_else(|| (*name).into(), |stem| stem.to_string_lossy());
            let counts: Vec<String> = counts.iter().map(|(level, count)| format!("{level} {count}")).collect();
            format!("{name}: {}", counts.join(", "))
        };
        let more = of_species.len().saturating_sub(MOST_LINES);
        let more = (more > 0).then(|| format!("and {more} more species"));
        of_species.iter().take(MOST_LINES).map(words).chain(more).collect()
    }

    /// What is being built, or what came of it.
    fn news(&self) -> Option<String> {
        match &self.nursery {
            Some(nursery) if nursery.order().method == self.method => {
                Some(format!("reading anew: {}, {} s", self.names(&nursery.order().species), self.told_s))
            }
            Some(nursery) => {
                let building = &nursery.order().method;
                let then = if *building == self.asked.0 { String::new() } else { format!("; then {}", self.asked.0) };
                Some(format!("building {building}, {} s{then}", self.told_s))
            }
            None => Some(self.notice.clone()).filter(|notice| !notice.is_empty()),
        }
    }
}

impl Content for Walk {
    type Action = Action;
    const KEYS: &'static [Binding<Action>] = KEYS;

    fn load(&mut self, renderer: &mut Renderer) -> Result<()> {
        let mut grove = Grove::plant(renderer, &self.scene, &self.stock)?;
        self.notice = culling::choose(renderer, &mut grove, &mut self.scene)?.sentence();
        self.grove = Some(grove);
        Ok(())
    }

    fn act(&mut self, action: Action, shift: bool) -> Request {
        match action {
            Action::Fly(way) => self.flight.press(way, &self.scene.ground),
            Action::Path => {
                self.flight.follow_or_stay();
                self.trail = Trail::default();
            }
            Action::Method => self.step(shift),
            Action::SceneMethod => self.ask(self.scene.file.method.clone()),
            Action::Freeze => self.freeze(),
            Action::Show(show) => self.show = if self.show == show { Show::Picture } else { show },
            Action::Screenshot => return Request::Screenshot,
            Action::Help => return Request::Help,
            Action::Quit => return Request::Quit,
        }
        Request::Redraw
    }

    fn let_go(&mut self, action: Option<Action>) {
        match action {
            Some(Action::Fly(way)) => self.flight.release(Some(way)),
            Some(_) => {}
            None => self.flight.release(None),
        }
    }

    fn shift(&mut self, held: bool) {
        self.flight.hurry(held);
    }

    fn drag(&mut self, right_px: f64, down_px: f64) {
        // A fifth of a degree per pixel; what is under the hand follows it.
        let radians = |px: f64| (px / 5.0).to_radians() as f32;
        self.flight.turn(-radians(right_px), radians(down_px));
    }

    fn wheel(&mut self, notches: f32) {
        self.flight.speed_up(1.25f32.powf(notches));
    }

    fn polls(&self) -> bool {
        true
    }

    fn poll(&mut self, renderer: &Renderer) -> bool {
        self.stale.extend(self.watch.replaced());
        if self.nursery.is_none() && !self.stale.is_empty() {
            self.begin();
            return true;
        }
        let told_s = self.nursery.as_ref().map_or(0, Nursery::seconds);
        self.harvest(renderer) || std::mem::replace(&mut self.told_s, told_s) != told_s
    }

    fn moves(&self) -> bool {
        let blows = self.scene.file.stage.wind_m_s > 0.0;
        blows || self.flight.moves() || self.last.as_ref().is_some_and(|last| last.moved)
    }

    fn shot(&mut self, size_px: [u32; 2], time_s: f64) -> Shot {
        // Nobody has flown while no picture was drawn because nothing moved.
        let step_s = self.last.as_ref().filter(|last| last.moving).map_or(0.0, |last| time_s - last.time_s);
        self.flight.advance(step_s as f32, &self.scene.path, &self.scene.ground);
        let look = self.flight.look();
        let viewer = match self.frozen {
            Some((_, viewer)) => viewer,
            None => self.trail.follow(look.eye, time_s as f32, &self.scene.file.levels),
        };
        let shot = Shot { size_px, show: self.show, ..drive::shot(&self.scene, look, time_s as f32, viewer, 0) };
        let moved = self.last.as_ref().is_some_and(|last| last.camera != shot.camera);
        self.last = Some(Last { camera: shot.camera, viewer, time_s, moving: self.flight.moves(), moved });
        shot
    }

    fn world<T>(&mut self, draw: impl FnOnce(World) -> T) -> T {
        let frozen = self.frozen.map(|(camera, _)| camera);
        draw(self.grove.as_mut().map_or_else(World::default, |grove| grove.world(&self.scene.file.culling, frozen)))
    }

    fn drawn(&mut self, renderer: &mut Renderer) -> bool {
        // While it moves, numbers of trees that the device culls are at most so many: nobody waits for them.
        let still = !self.moves();
        let Some(grove) = &mut self.grove else { return false };
        if still && let Err(error) = grove.tally(renderer) {
            self.notice = error.to_string();
        }
        let crowd = grove.crowd();
        let seen = Seen { trees: crowd.trees_seen(), near: crowd.trees_near(), counted: renderer.counted(), shown: grove.shown() };
        let differs = seen != self.seen;
        self.seen = seen;
        differs
    }

    fn words(&self, pace: Pace) -> (String, Vec<String>) {
        let Seen { trees, near, counted: Counted { draws, triangles }, .. } = self.seen;
        let trees = format!("{trees} of {} trees in the picture, {near} near", self.scene.planted.len());
        let cost = format!("{triangles} triangles, {draws} draws");
        let scenes = if self.method == self.scene.file.method { " (the scene's)" } else { "" };
        let frozen = self.frozen.map(|_| "culling frozen: the lines bound what it sees".to_owned());
        let news = self.news();
        let title = [
            Some(format!("{:.1} ms a frame", pace.ms)),
            Some(trees.clone()),
            Some(cost.clone()),
            Some(self.method.clone()),
            Some(self.flight.words()),
            frozen.clone(),
            news.clone(),
        ];
        let fps = pace.fps.map_or_else(|| "still".to_owned(), |fps| format!("{fps:.1} fps"));
        let mut lines = vec![format!("{fps}, {:.1} ms a frame", pace.ms), trees, cost];
        lines.extend(self.levels());
        lines.extend([format!("method: {}{scenes}", self.method), self.flight.words()]);
        lines.extend(frozen.into_iter().chain(news).flat_map(|text| wrapped(&text)));
        (title.into_iter().flatten().collect::<Vec<_>>().join("; "), lines)
    }

    fn strokes(&self, shot: &Shot) -> Vec<[Vec2; 2]> {
        let far_m = self.scene.ground.bounds().size().length();
        self.frozen.map_or_else(Vec::new, |(camera, _)| frozen::strokes(&camera, far_m, shot))
    }
}

/// Lines of a text of which no line is longer than the longest of the keys' unless a word is.
fn wrapped(text: &str) -> Vec<String> {
    const LONGEST: usize = 46;
    let mut lines: Vec<String> = vec![];
    for word in text.split_whitespace() {
        match lines.last_mut().filter(|line| line.chars().count() + 1 + word.chars().count() <= LONGEST) {
            Some(line) => line.extend([" ", word]),
            None => lines.push(word.to_owned()),
        }
    }
    lines
}
