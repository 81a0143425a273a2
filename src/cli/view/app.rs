//! The window's life: events in, frames out. Frames are drawn only when something changed.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::{Window, WindowId};

use super::state::{Request, State};
use super::{keys, overlay};
use crate::cli::look::Look;
use crate::cli::say;
use crate::cli::subject::Subject;
use crate::geom::Bounds;
use crate::gpu::layout::Instance;
use crate::raster::png;
use crate::render::{Renderer, Shot, Stand, Tree, Window as Pane};
use crate::{Error, Result, files};

/// From frame to frame while the wind blows.
const MOVING: Duration = Duration::from_millis(16);
/// Before a hidden window is tried again.
const HIDDEN: Duration = Duration::from_millis(200);

/// The application that winit runs.
pub struct App {
    look: Look,
    trees: Vec<Subject>,
    screenshots: PathBuf,
    opened: Instant,
    closes: Option<Instant>,
    state: State,
    open: Option<Open>,
    failed: Option<Error>,
    cursor: Option<PhysicalPosition<f64>>,
    dragging: bool,
    saved: usize,
    /// Number of the frame.
    frame: u32,
    /// When to draw although nobody did anything.
    next: Option<Instant>,
}

/// Everything that exists while the window is open.
struct Open {
    window: Arc<Window>,
    renderer: Renderer,
    pane: Pane,
    placed: Vec<(Tree, Instance)>,
    frame_ms: f64,
}

impl App {
    /// An application that will open a window onto those trees.
    pub fn new(look: Look, trees: Vec<Subject>, screenshots: PathBuf, seconds: Option<u64>) -> Result<Self> {
        let points: Vec<Vec3> =
            trees.iter().zip(places(&trees)).flat_map(|(tree, at)| tree.points.iter().map(move |p| *p + at)).collect();
        let state = State::new(&look, look.orbit(&points, false)?);
        let opened = Instant::now();
        let closes = seconds.map(|seconds| opened + Duration::from_secs(seconds));
        Ok(Self {
            look,
            trees,
            screenshots,
            opened,
            closes,
            state,
            open: None,
            failed: None,
            cursor: None,
            dragging: false,
            saved: 0,
            frame: 0,
            next: None,
        })
    }

    /// What went wrong while the window was open, if anything.
    pub fn outcome(self) -> Result<()> {
        self.failed.map_or(Ok(()), Err)
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<Open> {
        let [width, height] = self.look.size_px;
        let attributes = Window::default_attributes().with_title("sphereboard").with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop.create_window(attributes).map_err(|e| Error::NoWindow { what: e.to_string() })?;
        let window = Arc::new(window);
        let renderer = self.look.renderer()?;
        let pane = Pane::new(&renderer, window.clone(), window.inner_size().into())?;
        let upload = |(tree, at): (&Subject, Vec3)| {
            Ok((renderer.upload_built(&tree.built)?, Instance { position: at.to_array(), ..Instance::IDENTITY }))
        };
        let placed = self.trees.iter().zip(places(&self.trees)).map(upload).collect::<Result<_>>()?;
        Ok(Open { window, renderer, pane, placed, frame_ms: 0.0 })
    }

    /// Ends with an error.
    fn fail(&mut self, event_loop: &ActiveEventLoop, error: Error) {
        self.failed = Some(error);
        self.open = None;
        event_loop.exit();
    }

    /// The picture of this moment.
    fn shot(&mut self, size_px: [u32; 2]) -> Shot {
        self.frame = self.frame.wrapping_add(1);
        Shot { frame: self.frame, ..self.state.shot(&self.look, size_px, self.opened.elapsed().as_secs_f64()) }
    }

    /// Draws a frame; false when the window cannot be drawn into for now.
    fn draw(&mut self) -> Result<bool> {
        let Some(size_px) = self.open.as_ref().map(|open| open.pane.size_px()).filter(|size_px| !size_px.contains(&0)) else {
            return Ok(false);
        };
        let shot = self.shot(size_px);
        let Some(open) = &mut self.open else { return Ok(false) };
        let triangles: usize = open.placed.iter().map(|(tree, _)| tree.triangles()).sum();
        let status = format!("{:.1} ms a frame, {triangles} triangles, {}", open.frame_ms, self.state.words());
        let text: Vec<String> = std::iter::once(status.clone()).chain(keys::lines()).collect();
        let panel = self.state.help.then(|| overlay::panel(&text, (size_px[1] / 480).clamp(1, 4)));
        let start = Instant::now();
        let shown = open.pane.show(&mut open.renderer, &shot, &stands(&open.placed), panel.as_ref())?;
        if shown {
            open.frame_ms = start.elapsed().as_secs_f64() * 1e3;
            open.window.set_title(&format!("sphereboard: {status}"));
        }
        Ok(shown)
    }

    /// Draws, and says when to draw next: soon while something moves, later while the window is hidden.
    fn draw_and_go_on(&mut self) -> Result<()> {
        let shown = self.draw()?;
        let pause = if shown { MOVING } else { HIDDEN };
        self.next = (self.state.moves() || !shown).then(|| Instant::now() + pause);
        Ok(())
    }

    /// Saves what is shown, without the text.
    fn save(&mut self) -> Result<()> {
        let Some(size_px) = self.open.as_ref().map(|open| open.pane.size_px().map(|side| side.max(1))) else { return Ok(()) };
        let shot = self.shot(size_px);
        let Some(open) = &mut self.open else { return Ok(()) };
        let picture = open.renderer.picture(&shot, &stands(&open.placed))?;
        let path = loop {
            self.saved += 1;
            let path = self.screenshots.join(format!("sphereboard-{:03}.png", self.saved));
            if !path.exists() {
                break path;
            }
        };
        files::write_whole(&path, &png(&picture.color)?)?;
        say::out(&path.display().to_string());
        Ok(())
    }

    fn act(&mut self, event_loop: &ActiveEventLoop, action: keys::Action) {
        let done = match self.state.act(action) {
            Request::Redraw => Ok(()),
            Request::Screenshot => self.save(),
            Request::Quit => {
                event_loop.exit();
                Ok(())
            }
        };
        // A picture that cannot be saved is no reason to close the window.
        if let Err(error) = done {
            say::err(&format!("sphereboard: {error}"));
        }
        self.redraw();
    }

    fn redraw(&self) {
        if let Some(open) = &self.open {
            open.window.request_redraw();
        }
    }

    fn drag(&mut self, to: PhysicalPosition<f64>) {
        if let Some(from) = self.cursor.replace(to).filter(|_| self.dragging) {
            // A third of a degree per pixel: a hand's width turns the tree half round.
            let radians = |px: f64| (px / 3.0).to_radians() as f32;
            self.state.turn(-radians(to.x - from.x), radians(to.y - from.y));
            self.redraw();
        }
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_none() {
            match self.open(event_loop) {
                Ok(open) => self.open = Some(open),
                Err(error) => self.fail(event_loop, error),
            }
            self.redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => {
                if let Some(open) = &mut self.open {
                    open.pane.resize(&open.renderer, size.into());
                }
                self.redraw();
            }
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.draw_and_go_on() {
                    self.fail(event_loop, error);
                }
            }
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                if let Some(action) = keys::action_of(&event.logical_key) {
                    self.act(event_loop, action);
                }
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => self.dragging = state == ElementState::Pressed,
            WindowEvent::CursorMoved { position, .. } => self.drag(position),
            WindowEvent::MouseWheel { delta, .. } => {
                let notches = match delta {
                    MouseScrollDelta::LineDelta(_, y) => y,
                    MouseScrollDelta::PixelDelta(p) => p.y as f32 / 40.0,
                };
                self.state.approach(0.9f32.powf(notches));
                self.redraw();
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let now = Instant::now();
        if self.closes.is_some_and(|at| now >= at) {
            return event_loop.exit();
        }
        if self.next.is_some_and(|at| now >= at) {
            self.next = None;
            self.redraw();
        }
        let wake = self.closes.into_iter().chain(self.next).min();
        event_loop.set_control_flow(wake.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }
}

fn stands(placed: &[(Tree, Instance)]) -> Vec<Stand<'_>> {
    placed.iter().map(|(tree, instance)| Stand { tree, instances: std::slice::from_ref(instance) }).collect()
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
