//! The turtle: reads a chain and leaves a skeleton (Lluch03 §3.2; Truelsen §3.1.2; Prusinkiewicz & Lindenmayer 1990, §1.5).
//!
//! It starts at the origin, heading up (+Y) with its upper side to +Z, so that in a plain drawing +X is right. Metres and degrees.
//! A turtle can also be led by hand, command by command: [`Turtle`].

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};

use super::command::{Action, Command};
use super::grammar::Grammar;
use super::growth;
use super::module::{Chain, Module};
use super::skeleton::{Bone, BoneKind, Branch, Polygon, Skeleton};
use crate::params::ParamSet as _;
use crate::{Error, Result, Seed};

crate::params! {
    /// How chains are drawn; a grammar may set its own values (`turtle turn_deg = 25`).
    pub struct TurtleParams {
        /// Length of a step without parameter, F.
        step_m: f64 = 1.0, in 0.0..=1000.0, unit "m", source "ours: one unit";
        /// Angle of a rotation without parameter.
        turn_deg: f64 = 22.5, in -360.0..=360.0, unit "°", source "Prusinkiewicz & Lindenmayer 1990, fig. 1.24d";
        /// Factor on every length of wood and on every jump.
        length_scale: f64 = 1.0, in 0.0001..=10000.0, unit "", source "ours: the plant as written";
        /// Factor on every radius.
        radius_scale: f64 = 1.0, in 0.0001..=10000.0, unit "", source "ours: the plant as written";
        /// Radius of the trunk before any `!`.
        trunk_radius_m: f64 = 0.05, in 0.0..=100.0, unit "m", source "ours: a thin trunk for steps of a metre";
        /// Factor on the radius at every `[`, for as long as no `!` has set a width.
        branch_radius: f64 = 0.7, in 0.0..=1.0, unit "", source "Truelsen §3.2: each branch a bit thinner; 1/√2 keeps the cross-section";
        /// Factor on the width at a `!` without parameter.
        width_factor: f64 = 0.7, in 0.0..=10.0, unit "", source "Prusinkiewicz & Lindenmayer 1990, §1.6.3, which leaves it open";
        /// Factor on lengths at a `"` without parameter.
        length_factor: f64 = 0.9, in 0.0..=10.0, unit "", source "ours: a tenth shorter";
        /// Length of a leaf of size 1.
        leaf_length_m: f64 = 0.1, in 0.0..=100.0, unit "m", source "ours: a common leaf";
        /// Width of a leaf over its length.
        leaf_aspect: f64 = 0.6, in 0.01..=10.0, unit "", source "ours: an ovate leaf";
        /// Standard deviation of a normal noise on every rotation.
        turn_noise_deg: f64 = 0.0, in 0.0..=90.0, unit "°", source "Truelsen §3.1.1, which gives no size";
        /// Standard deviation of a normal noise on every length, as a fraction of it.
        length_noise: f64 = 0.0, in 0.0..=1.0, unit "", source "Truelsen §3.1.1, which gives no size";
        /// How strongly every step bends towards the tropism's direction: radians at a right angle to it.
        tropism: f64 = 0.0, in -10.0..=10.0, unit "", source "Prusinkiewicz & Lindenmayer 1990, §2.1: e";
        /// The tropism's direction, x.
        tropism_x: f64 = 0.0, in -1.0..=1.0, unit "", source "Prusinkiewicz & Lindenmayer 1990, fig. 2.8: gravity";
        /// The tropism's direction, y.
        tropism_y: f64 = -1.0, in -1.0..=1.0, unit "", source "Prusinkiewicz & Lindenmayer 1990, fig. 2.8: gravity";
        /// The tropism's direction, z.
        tropism_z: f64 = 0.0, in -1.0..=1.0, unit "", source "Prusinkiewicz & Lindenmayer 1990, fig. 2.8: gravity";
    }
}

/// Reads `chain` with the grammar's command table. `age` matters only for a chain that [`Grammar::derive`] made for an age between
/// two derivations: what the last one made is then drawn as far as it has come (Truelsen §9.1).
///
/// # Errors
/// [`Error::Turtle`] with the module: a `]` or `}` without partner, a length or width that is negative or not finite, a plant larger
/// than numbers reach. [`Error::Parameter`] for parameters out of range, or a tropism without direction.
pub fn draw(chain: &Chain, grammar: &Grammar, params: &TurtleParams, seed: Seed, age: f64) -> Result<Skeleton> {
    let mut turtle = Turtle::new(params, seed)?;
    let commands = commands(chain, grammar);
    match &chain.previous {
        Some(previous) if age < f64::from(chain.steps) => {
            let done = (age - f64::from(chain.steps.saturating_sub(1))).clamp(0.0, 1.0);
            growth::draw_between(&mut turtle, chain, previous, &commands, done)?;
        }
        _ => {
            for (position, module) in chain.iter().enumerate() {
                turtle.obey(&commands[module.symbol.index()], module, position as u64, Growth::DONE)?;
            }
        }
    }
    turtle.finish(chain.len() as u64)
}

/// The command of every symbol of the chain.
fn commands(chain: &Chain, grammar: &Grammar) -> Vec<Command> {
    let nothing = || Command { action: Action::Nothing, defaults: vec![] };
    let alphabet = chain.alphabet();
    alphabet.symbols().map(|symbol| grammar.command(alphabet.name(symbol)).unwrap_or_else(nothing)).collect()
}

/// How much of itself a module is while it grows in: factors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// On lengths and jumps.
    pub length: f64,
    /// On angles.
    pub angle: f64,
    /// On radii, and on the size of leaves.
    pub size: f64,
}

impl Growth {
    /// Fully grown.
    pub const DONE: Growth = Growth { length: 1.0, angle: 1.0, size: 1.0 };
}

/// Where the turtle is and how it draws: all that brackets keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    position: DVec3,
    orientation: DQuat,
    radius_m: f64,
    /// Radius at the end of the wood behind; `None` where a branch begins.
    last_radius_m: Option<f32>,
    /// A `!` was met: brackets no longer thin.
    width_is_set: bool,
    length_factor: f64,
    tropism: f64,
    bone: Option<u32>,
    depth: u32,
    tint: u16,
}

/// A turtle on its way.
#[derive(Debug, Clone)]
pub struct Turtle {
    params: TurtleParams,
    tropism: DVec3,
    seed: Seed,
    state: State,
    /// What open brackets keep, and their branches.
    stack: Vec<(State, usize)>,
    branch: usize,
    saved: BTreeMap<u64, State>,
    /// Polygons not closed yet.
    outlines: Vec<Vec<DVec3>>,
    /// Brackets opened since a `%`.
    cut: Option<u32>,
    /// The last bone may still be prolonged: nothing has happened since.
    straight: bool,
    skeleton: Skeleton,
}

/// What went wrong at a module; the caller knows which.
type Fault = (&'static str, String);

impl Turtle {
    /// A turtle at the origin.
    ///
    /// # Errors
    /// [`Error::Parameter`] for parameters out of range, or a tropism without direction.
    pub fn new(params: &TurtleParams, seed: Seed) -> Result<Self> {
        params.validate()?;
        let tropism = DVec3::new(params.tropism_x, params.tropism_y, params.tropism_z);
        if tropism.length() < 1e-6 {
            let (name, expected) = ("--tropism-x, -y, -z".to_owned(), "a direction, not all 0".to_owned());
            return Err(Error::Parameter { name, expected, found: "0, 0, 0".to_owned() });
        }
        let state = State {
            position: DVec3::ZERO,
            orientation: DQuat::IDENTITY,
            radius_m: params.trunk_radius_m,
            last_radius_m: None,
            width_is_set: false,
            length_factor: 1.0,
            tropism: params.tropism,
            bone: None,
            depth: 0,
            tint: 0,
        };
        let whole = Branch { parent: None, level: 0, bones: 0..0, polygons: 0..0 };
        let skeleton = Skeleton { branches: vec![whole], ..Skeleton::default() };
        Ok(Self {
            params: params.clone(),
            tropism: tropism.normalize(),
            seed,
            state,
            stack: vec![],
            branch: 0,
            saved: BTreeMap::new(),
            outlines: vec![],
            cut: None,
            straight: false,
            skeleton,
        })
    }

    /// Length of a step without parameter, metres.
    pub fn step_m(&self) -> f64 {
        self.params.step_m
    }

    /// Obeys one module. `key` chooses its noise: usually its position in the chain.
    ///
    /// # Errors
    /// [`Error::Turtle`].
    pub fn obey(&mut self, command: &Command, module: Module, key: u64, growth: Growth) -> Result<()> {
        let args = if module.params.is_empty() { &command.defaults } else { module.params };
        self.act(command.action, args, key, growth).map_err(|fault| error(key, module.name, fault))
    }

    /// What was drawn; brackets still open end here.
    ///
    /// # Errors
    /// [`Error::Turtle`] for a polygon that was never closed.
    pub fn finish(mut self, modules: u64) -> Result<Skeleton> {
        if !self.outlines.is_empty() {
            return Err(error(modules.saturating_sub(1), "the end", ("a `}` for every `{`", "an open polygon".to_owned())));
        }
        while let Some((_, parent)) = self.stack.pop() {
            self.close_branch(parent);
        }
        self.close_branch(0);
        Ok(self.skeleton)
    }

    fn act(&mut self, action: Action, args: &[f64], key: u64, growth: Growth) -> Result<(), Fault> {
        if let Some(bad) = args.iter().find(|v| !v.is_finite()) {
            return Err(("finite parameters", bad.to_string()));
        }
        if self.cut.is_some() && !self.cut_ends(action) {
            return Ok(());
        }
        if action != Action::Nothing && action != Action::Forward {
            self.straight = false;
        }
        let turn = |default: f64| args.first().copied().unwrap_or(default);
        let degrees = turn(self.params.turn_deg);
        match action {
            Action::Nothing => {}
            Action::Forward => self.step(args, key, growth, true, true)?,
            Action::Jump => self.step(args, key, growth, false, true)?,
            Action::ForwardPlain => self.step(args, key, growth, true, false)?,
            Action::JumpPlain => self.step(args, key, growth, false, false)?,
            Action::TurnLeft => self.rotate(DVec3::Z, degrees, key, growth),
            Action::TurnRight => self.rotate(DVec3::NEG_Z, degrees, key, growth),
            Action::PitchDown => self.rotate(DVec3::NEG_X, degrees, key, growth),
            Action::PitchUp => self.rotate(DVec3::X, degrees, key, growth),
            Action::RollLeft => self.rotate(DVec3::NEG_Y, degrees, key, growth),
            Action::RollRight => self.rotate(DVec3::Y, degrees, key, growth),
            Action::TurnAround => self.rotate(DVec3::Z, 180.0, key, Growth { angle: growth.angle, ..Growth::DONE }),
            Action::Rotate => self.rotate_thrice(args, key, growth),
            Action::Level => self.level(),
            Action::Push => self.push(),
            Action::Pop => self.pop()?,
            Action::Cut => self.cut = Some(0),
            Action::Width => self.width(args.first().copied())?,
            Action::Lengthen => self.state.length_factor *= at_least_zero(turn(self.params.length_factor))?,
            Action::Tint => self.state.tint = args.first().map_or(self.state.tint.saturating_add(1), |v| *v as u16),
            Action::Tropism => self.state.tropism = bounded_tropism(turn(self.params.tropism))?,
            Action::Leaf => self.leaf(args, growth)?,
            Action::OpenPolygon => self.outlines.push(vec![]),
            Action::Corner => self.corner(),
            Action::ClosePolygon => self.close_polygon()?,
            Action::Save => drop(self.saved.insert(turn(0.0) as u64, self.state)),
            Action::Restore => {
                let found = || ("the number of a SAVE before it", turn(0.0).to_string());
                self.state = *self.saved.get(&(turn(0.0) as u64)).ok_or_else(found)?;
            }
        }
        Ok(())
    }

    /// After a `%`: whether this action is obeyed again.
    fn cut_ends(&mut self, action: Action) -> bool {
        match (action, &mut self.cut) {
            (Action::Push, Some(open)) => *open += 1,
            (Action::Pop, Some(open)) if *open > 0 => *open -= 1,
            (Action::Pop | Action::Restore, cut) => {
                *cut = None;
                return true;
            }
            _ => {}
        }
        false
    }

    fn step(&mut self, args: &[f64], key: u64, growth: Growth, wood: bool, corner: bool) -> Result<(), Fault> {
        let length = at_least_zero(args.first().copied().unwrap_or(self.params.step_m))?;
        let noise = (1.0 + self.params.length_noise * self.noise(key, 3, self.params.length_noise)).max(0.1);
        let length = length * noise * growth.length * self.state.length_factor * self.params.length_scale;
        let start = self.state.position;
        let end = start + self.heading() * length;
        if !(end.as_vec3().is_finite() && (length as f32).is_finite()) {
            return Err(("a plant within the range of numbers", format!("a step of {length} m")));
        }
        self.state.position = end;
        if let Some(outline) = self.outlines.last_mut().filter(|_| corner) {
            add_corner(outline, end);
        } else if wood && length > 0.0 {
            self.wood(start, length, growth);
        }
        if wood {
            self.bend();
        }
        Ok(())
    }

    /// Adds a bone, or prolongs the last one where the wood goes straight on (Truelsen §3.1.2: F increases the bone's length).
    fn wood(&mut self, start: DVec3, length: f64, growth: Growth) {
        let radius = (self.state.radius_m * self.params.radius_scale * growth.size) as f32;
        let prolongs = |last: &&mut Bone| last.start_radius_m == radius && last.end_radius_m == radius;
        if let Some(last) = self.skeleton.bones.last_mut().filter(|_| self.straight).filter(prolongs) {
            last.length_m += length as f32;
            return;
        }
        let kind = if self.state.depth == 0 { BoneKind::Trunk } else { BoneKind::Branch };
        let start_radius_m = self.state.last_radius_m.unwrap_or(radius);
        self.bone(Bone { start_radius_m, end_radius_m: radius, length_m: length as f32, ..self.blank(kind, start) });
        self.state.bone = Some(self.skeleton.bones.len() as u32 - 1);
        self.state.last_radius_m = Some(radius);
        self.straight = true;
    }

    fn blank(&self, kind: BoneKind, start: DVec3) -> Bone {
        Bone {
            parent: self.state.bone,
            kind,
            start: start.as_vec3(),
            orientation: self.state.orientation.as_quat().normalize(),
            length_m: 0.0,
            start_radius_m: 0.0,
            end_radius_m: 0.0,
            depth: self.state.depth,
            tint: self.state.tint,
        }
    }

    fn bone(&mut self, bone: Bone) {
        self.skeleton.bones.push(bone);
    }

    fn heading(&self) -> DVec3 {
        self.state.orientation * DVec3::Y
    }

    fn rotate(&mut self, axis: DVec3, degrees: f64, key: u64, growth: Growth) {
        let noise = self.params.turn_noise_deg * self.noise(key, 0, self.params.turn_noise_deg);
        self.rotate_exactly(axis, (degrees + noise) * growth.angle);
    }

    fn rotate_exactly(&mut self, axis: DVec3, degrees: f64) {
        // Whole turns cost precision, and nothing else.
        let turn = DQuat::from_axis_angle(axis, (degrees % 360.0).to_radians());
        self.state.orientation = (self.state.orientation * turn).normalize();
    }

    fn rotate_thrice(&mut self, args: &[f64], key: u64, growth: Growth) {
        let angles = [args.first(), args.get(1), args.get(2)].map(|a| a.copied().unwrap_or(0.0));
        for (i, axis) in [(2, DVec3::Y), (1, DVec3::NEG_X), (0, DVec3::Z)] {
            let noise = self.params.turn_noise_deg * self.noise(key, i as u64, self.params.turn_noise_deg);
            self.rotate_exactly(axis, (angles[i] + noise) * growth.angle);
        }
    }

    /// `$`: the left vector becomes horizontal (Prusinkiewicz & Lindenmayer 1990, §2.3). A vertical heading has no such roll.
    fn level(&mut self) {
        let heading = self.heading();
        let left = DVec3::Y.cross(heading);
        if left.length() > 1e-9 {
            let left = left.normalize();
            let up = heading.cross(left).normalize();
            let frame = glam::DMat3::from_cols(-left, heading, up);
            self.state.orientation = DQuat::from_mat3(&frame).normalize();
        }
    }

    /// The tropism turns the heading towards its direction, never past it.
    fn bend(&mut self) {
        if self.state.tropism == 0.0 {
            return;
        }
        let goal = self.tropism * self.state.tropism.signum();
        let heading = self.heading();
        let axis = heading.cross(goal);
        if axis.length() > 1e-9 {
            let angle = (self.state.tropism.abs() * axis.length()).min(heading.angle_between(goal));
            self.state.orientation = (DQuat::from_axis_angle(axis.normalize(), angle) * self.state.orientation).normalize();
            self.straight = false;
        }
    }

    fn push(&mut self) {
        self.stack.push((self.state, self.branch));
        self.thin();
        let (bones, polygons) = (self.skeleton.bones.len() as u32, self.skeleton.polygons.len() as u32);
        let parent = Some(self.branch as u32);
        self.branch = self.skeleton.branches.len();
        let level = self.state.depth;
        self.skeleton.branches.push(Branch { parent, level, bones: bones..bones, polygons: polygons..polygons });
    }

    /// What a bracket changes for the wood behind it.
    fn thin(&mut self) {
        self.state.depth += 1;
        self.state.last_radius_m = None;
        if !self.state.width_is_set {
            self.state.radius_m *= self.params.branch_radius;
        }
    }

    fn pop(&mut self) -> Result<(), Fault> {
        let (state, parent) = self.stack.pop().ok_or_else(|| ("a `[` before this bracket", "none".to_owned()))?;
        self.close_branch(parent);
        self.state = state;
        Ok(())
    }

    fn close_branch(&mut self, parent: usize) {
        let branch = &mut self.skeleton.branches[self.branch];
        branch.bones.end = self.skeleton.bones.len() as u32;
        branch.polygons.end = self.skeleton.polygons.len() as u32;
        self.branch = parent;
    }

    fn width(&mut self, width: Option<f64>) -> Result<(), Fault> {
        self.state.radius_m = match width {
            Some(width) => at_least_zero(width)? / 2.0,
            None => self.state.radius_m * self.params.width_factor,
        };
        if !((self.state.radius_m * self.params.radius_scale) as f32).is_finite() {
            return Err(("a plant within the range of numbers", format!("a radius of {} m", self.state.radius_m)));
        }
        self.state.width_is_set = true;
        Ok(())
    }

    fn leaf(&mut self, args: &[f64], growth: Growth) -> Result<(), Fault> {
        let size = at_least_zero(args.first().copied().unwrap_or(1.0))? * growth.size;
        let aspect = at_least_zero(args.get(1).copied().unwrap_or(self.params.leaf_aspect))?;
        let length_m = (size * self.params.leaf_length_m) as f32;
        let half_width = length_m * (aspect / 2.0) as f32;
        if !(length_m.is_finite() && half_width.is_finite()) {
            return Err(("a plant within the range of numbers", format!("a leaf of size {size}")));
        }
        if length_m > 0.0 {
            self.bone(Bone { length_m, start_radius_m: half_width, ..self.blank(BoneKind::Leaf, self.state.position) });
        }
        Ok(())
    }

    fn corner(&mut self) {
        let position = self.state.position;
        if let Some(outline) = self.outlines.last_mut() {
            add_corner(outline, position);
        }
    }

    fn close_polygon(&mut self) -> Result<(), Fault> {
        let mut outline = self.outlines.pop().ok_or_else(|| ("a `{` before it", "none".to_owned()))?;
        if outline.len() > 1 && outline.first() == outline.last() {
            outline.pop();
        }
        if outline.len() >= 3 {
            let State { bone: parent, depth, tint, .. } = self.state;
            let corners = outline.iter().map(|c| c.as_vec3()).collect();
            self.skeleton.polygons.push(Polygon { parent, corners, depth, tint });
        }
        Ok(())
    }

    /// A normal random number that belongs to the module and its `which`th noise (Box & Muller 1958); 0 where none is asked for.
    fn noise(&self, key: u64, which: u64, deviation: f64) -> f64 {
        if deviation == 0.0 {
            return 0.0;
        }
        let mut draws = self.seed.keyed("turtle", key.wrapping_mul(4).wrapping_add(which));
        let (radius, angle) = (1.0 - draws.unit(), draws.unit() * std::f64::consts::TAU);
        (-2.0 * radius.ln()).sqrt() * angle.cos()
    }
}

/// What a multichain asks for, whose branches are not bracketed (Lluch03 §5.4; `multires`).
impl Turtle {
    /// A branch begins behind this many brackets, which will not be closed, or (0) goes on after others.
    pub(super) fn enter(&mut self, brackets: u32) {
        self.straight = false;
        (0..brackets).for_each(|_| self.thin());
    }

    pub(super) fn state(&self) -> State {
        self.state
    }

    /// Goes on from an earlier state; what is open is dropped.
    pub(super) fn go_back(&mut self, state: State) {
        self.state = state;
        (self.cut, self.straight, self.branch) = (None, false, 0);
        self.stack.clear();
        self.outlines.clear();
    }

    /// What has been drawn; its branches mean nothing.
    pub(super) fn so_far(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Keeps only the first bones and polygons.
    pub(super) fn forget(&mut self, bones: usize, polygons: usize) {
        self.skeleton.bones.truncate(bones);
        self.skeleton.polygons.truncate(polygons);
    }
}

/// A corner that lies where the last one does is the same corner.
fn add_corner(outline: &mut Vec<DVec3>, at: DVec3) {
    if outline.last() != Some(&at) {
        outline.push(at);
    }
}

fn at_least_zero(value: f64) -> Result<f64, Fault> {
    if value >= 0.0 { Ok(value) } else { Err(("a number of at least 0", value.to_string())) }
}

fn bounded_tropism(value: f64) -> Result<f64, Fault> {
    if value.abs() <= 10.0 { Ok(value) } else { Err(("a tropism from -10 to 10", value.to_string())) }
}

/// The error at a module.
fn error(module: u64, name: &str, (expected, found): Fault) -> Error {
    Error::Turtle { module, name: name.to_owned(), expected, found }
}
