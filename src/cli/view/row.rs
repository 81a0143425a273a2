//! What `view` shows: trees in a row.

use glam::Vec3;

use super::keys::{self, Action};
use super::state::State;
use crate::Result;
use crate::cli::look::Look;
use crate::cli::subject::Subject;
use crate::cli::window::keys::Binding;
use crate::cli::window::{Content, Pace, Request};
use crate::geom::Bounds;
use crate::gpu::layout::Instance;
use crate::render::{Renderer, Shot, Stand, Tree, World};

/// Trees in a row, and who looks at them.
pub struct Row {
    look: Look,
    trees: Vec<Subject>,
    state: State,
    placed: Vec<(Tree, Instance)>,
}

impl Row {
    /// Those trees.
    ///
    /// # Errors
    /// Those of [`Look::orbit`].
    pub fn new(look: Look, trees: Vec<Subject>) -> Result<Self> {
        let points: Vec<Vec3> =
            trees.iter().zip(places(&trees)).flat_map(|(tree, at)| tree.points.iter().map(move |p| *p + at)).collect();
        let state = State::new(&look, look.orbit(&points, false)?);
        Ok(Self { look, trees, state, placed: vec![] })
    }
}

impl Content for Row {
    type Action = Action;
    const KEYS: &'static [Binding<Action>] = keys::KEYS;

    fn load(&mut self, renderer: &mut Renderer) -> Result<()> {
        let upload = |(tree, at): (&Subject, Vec3)| {
            Ok((renderer.upload_built(&tree.built)?, Instance { position: at.to_array(), ..Instance::IDENTITY }))
        };
        self.placed = self.trees.iter().zip(places(&self.trees)).map(upload).collect::<Result<_>>()?;
        Ok(())
    }

    fn act(&mut self, action: Action, _shift: bool) -> Request {
        self.state.act(action)
    }

    fn repeats(action: Action) -> bool {
        use Action::{Approach, Lift, LiftSun, Sidestep, Turn, TurnSun, Wind};
        matches!(action, Approach(_) | Lift(_) | LiftSun(_) | Sidestep(_) | Turn(_) | TurnSun(_) | Wind(_))
    }

    fn drag(&mut self, right_px: f64, down_px: f64) {
        // A third of a degree per pixel: a hand's width turns the tree half round.
        let radians = |px: f64| (px / 3.0).to_radians() as f32;
        self.state.turn(-radians(right_px), radians(down_px));
    }

    fn wheel(&mut self, notches: f32) {
        self.state.approach(0.9f32.powf(notches));
    }

    fn moves(&self) -> bool {
        self.state.moves()
    }

    fn shot(&mut self, size_px: [u32; 2], time_s: f64) -> Shot {
        self.state.shot(&self.look, size_px, time_s)
    }

    fn world<T>(&mut self, draw: impl FnOnce(World) -> T) -> T {
        let stand = |(tree, instance)| Stand { tree, instances: std::slice::from_ref(instance) };
        let stands: Vec<Stand> = self.placed.iter().map(|(tree, instance)| stand((tree, instance))).collect();
        draw(World::from(&stands))
    }

    fn words(&self, pace: Pace) -> (String, Vec<String>) {
        let triangles: usize = self.placed.iter().map(|(tree, _)| tree.triangles()).sum();
        let status = format!("{:.1} ms a frame, {triangles} triangles, {}", pace.ms, self.state.words());
        (status.clone(), vec![status])
    }
}

/// Where each tree stands: in a row along +X, none touching the next, their middle at the origin.
fn places(trees: &[Subject]) -> Vec<Vec3> {
    let bounds: Vec<Bounds> = trees.iter().map(|tree| tree.built.bounds).collect();
    let gap = 0.15 * bounds.iter().map(|b| b.size().x).fold(0.0, f32::max);
    let total: f32 = bounds.iter().map(|b| b.size().x).sum::<f32>() + gap * bounds.len().saturating_sub(1) as f32;
    let mut left = -0.5 * total;
    bounds
        .iter()
        .map(|b| {
            let at = left - b.min.x;
            left += b.size().x + gap;
            // One tree alone stands on the origin, as `render` has it.
            Vec3::X * if trees.len() == 1 { 0.0 } else { at }
        })
        .collect()
}
