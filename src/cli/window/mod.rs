//! A window's life: events in, frames out. Frames are drawn only when something changed. What it shows is a [`Content`]'s business.

pub mod keys;
mod overlay;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::{Arg, ArgMatches};
use glam::Vec2;
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::window::{Window, WindowId};

use super::{options, say};
use crate::gpu::{AdapterChoice, Gpu};
use crate::raster::png;
use crate::render::{Renderer, Shot, Window as Pane, World};
use crate::{Error, Result, files};
use keys::Binding;

/// From frame to frame while something moves.
const MOVING: Duration = Duration::from_millis(16);
/// Before a hidden window is tried again.
const HIDDEN: Duration = Duration::from_millis(200);
/// Between looks at what happens elsewhere.
const POLL: Duration = Duration::from_millis(200);
/// Frames farther apart say nothing of how many there are in a second.
const PAUSE: Duration = Duration::from_secs(2);

/// What a window shows, and what is done to it.
pub trait Content {
    /// What a key does.
    type Action: Copy + 'static;

    /// All keys.
    const KEYS: &'static [Binding<Self::Action>];

    /// Puts what is shown onto the device, once the window is open.
    fn load(&mut self, renderer: &mut Renderer) -> Result<()>;

    /// Does what a key says; `shift` is held with it.
    fn act(&mut self, action: Self::Action, shift: bool) -> Request;

    /// Whether a key that is held does so again and again, as the keyboard repeats it.
    fn repeats(_action: Self::Action) -> bool {
        false
    }

    /// A key is let go; `None` for all of them.
    fn let_go(&mut self, _action: Option<Self::Action>) {}

    /// Shift is pressed or let go.
    fn shift(&mut self, _held: bool) {}

    /// The mouse was dragged by so many pixels to the right and down.
    fn drag(&mut self, right_px: f64, down_px: f64);

    /// The wheel was turned away from the user by so many notches.
    fn wheel(&mut self, notches: f32);

    /// Whether [`Content::poll`] is to be called.
    fn polls(&self) -> bool {
        false
    }

    /// Looks at what happens elsewhere; true when that changes the picture or the text.
    fn poll(&mut self, _renderer: &Renderer) -> bool {
        false
    }

    /// Whether the picture moves by itself.
    fn moves(&self) -> bool;

    /// The picture to draw `time_s` after the window was opened.
    fn shot(&mut self, size_px: [u32; 2], time_s: f64) -> Shot;

    /// Gives what is drawn to `draw`.
    fn world<T>(&mut self, draw: impl FnOnce(World) -> T) -> T;

    /// A frame was drawn; true when the text says something else for it.
    fn drawn(&mut self, _renderer: &mut Renderer) -> bool {
        false
    }

    /// What the window's title says, and the lines above the keys.
    fn words(&self, pace: Pace) -> (String, Vec<String>);

    /// Lines over the last picture, pixels from its top left corner.
    fn strokes(&self, _shot: &Shot) -> Vec<[Vec2; 2]> {
        vec![]
    }
}

/// What is left to the window after a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Nothing but a new frame.
    Redraw,
    /// A picture to be saved.
    Screenshot,
    /// The text shown or hidden.
    Help,
    /// The end.
    Quit,
}

/// How long frames take.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pace {
    /// The last one, milliseconds.
    pub ms: f64,
    /// Of late, in a second; `None` while nothing moves.
    pub fps: Option<f64>,
}

/// How a window is opened.
pub struct Opening {
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Who draws.
    pub adapter: AdapterChoice,
    /// Folder for pictures that are saved.
    pub screenshots: PathBuf,
    /// Closes by itself after so many seconds.
    pub seconds: Option<u64>,
}

/// How long a window stays open unless somebody closes it, for [`seconds_of`].
pub fn seconds() -> Arg {
    Arg::new("seconds")
        .long("seconds")
        .value_name("N")
        .allow_negative_numbers(true)
        .help("Close the window by itself after this many seconds, 1 to 86400")
}

/// That, when it was said.
///
/// # Errors
/// [`Error::Hint`] for anything else than such a number.
pub fn seconds_of(matches: &ArgMatches) -> Result<Option<u64>> {
    options::whole(matches, "seconds", 1..=86_400)
}

/// Where events come from; asked for before any long work, so that a machine without a screen says so at once.
///
/// # Errors
/// [`Error::NoWindow`].
pub fn events() -> Result<EventLoop<()>> {
    EventLoop::new().map_err(|e| Error::NoWindow { what: e.to_string() })
}

/// Shows it until the window is closed.
///
/// # Errors
/// [`Error::NoWindow`]; those of [`Content::load`] and of drawing.
pub fn run(events: EventLoop<()>, opening: Opening, content: impl Content) -> Result<()> {
    let opened = Instant::now();
    let mut app = App {
        closes: opening.seconds.map(|seconds| opened + Duration::from_secs(seconds)),
        opening,
        content,
        opened,
        open: None,
        failed: None,
        help: true,
        stale: false,
        shift: false,
        cursor: None,
        dragging: false,
        saved: 0,
        frame: 0,
        next: None,
        polled: opened,
    };
    events.run_app(&mut app).map_err(|e| Error::NoWindow { what: e.to_string() })?;
    app.failed.map_or(Ok(()), Err)
}

/// The application that winit runs.
struct App<C> {
    opening: Opening,
    content: C,
    opened: Instant,
    closes: Option<Instant>,
    open: Option<Open>,
    failed: Option<Error>,
    /// Whether the text is shown.
    help: bool,
    /// Whether that was of another frame than the one that was drawn with it.
    stale: bool,
    shift: bool,
    cursor: Option<PhysicalPosition<f64>>,
    dragging: bool,
    saved: usize,
    /// Number of the frame.
    frame: u32,
    /// When to draw although nobody did anything.
    next: Option<Instant>,
    polled: Instant,
}

/// Everything that exists while the window is open.
struct Open {
    window: Arc<Window>,
    renderer: Renderer,
    pane: Pane,
    pace: Pace,
    shown: Option<Instant>,
}

impl Open {
    /// Takes note of a frame that was begun then and is shown now.
    fn shown(&mut self, begun: Instant) {
        let now = Instant::now();
        self.pace.ms = now.duration_since(begun).as_secs_f64() * 1e3;
        let since = self.shown.replace(now).map(|before| now - before).filter(|since| *since < PAUSE);
        self.pace.fps = since.map(|since| {
            let fps = 1.0 / since.as_secs_f64().max(1e-6);
            self.pace.fps.map_or(fps, |before| before + 0.15 * (fps - before))
        });
    }
}

impl<C: Content> App<C> {
    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<Open> {
        let [width, height] = self.opening.size_px;
        let attributes = Window::default_attributes().with_title("sphereboard").with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop.create_window(attributes).map_err(|e| Error::NoWindow { what: e.to_string() })?;
        let window = Arc::new(window);
        let mut renderer = Renderer::new(Gpu::open(&self.opening.adapter)?)?;
        let pane = Pane::new(&renderer, window.clone(), window.inner_size().into())?;
        self.content.load(&mut renderer)?;
        Ok(Open { window, renderer, pane, pace: Pace::default(), shown: None })
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
        Shot { frame: self.frame, ..self.content.shot(size_px, self.opened.elapsed().as_secs_f64()) }
    }

    /// Draws a frame; false when the window cannot be drawn into for now.
    fn draw(&mut self) -> Result<bool> {
        let Some(size_px) = self.open.as_ref().map(|open| open.pane.size_px()).filter(|size_px| !size_px.contains(&0)) else {
            return Ok(false);
        };
        let shot = self.shot(size_px);
        let Some(open) = &mut self.open else { return Ok(false) };
        let mut text = self.content.words(open.pace).1;
        text.extend(keys::lines(C::KEYS));
        let panel = self.help.then(|| overlay::panel(&text, (size_px[1] / 480).clamp(1, 4)));
        let over = overlay::stroked(panel, &self.content.strokes(&shot), size_px);
        let begun = Instant::now();
        let shown = self.content.world(|world| open.pane.show(&mut open.renderer, &shot, world, over.as_ref()))?;
        if shown {
            open.shown(begun);
            self.stale = self.content.drawn(&mut open.renderer) && self.help;
            open.window.set_title(&format!("sphereboard: {}", self.content.words(open.pace).0));
        }
        Ok(shown)
    }

    /// Draws, and says when to draw next: soon while something moves, later while the window is hidden.
    fn draw_and_go_on(&mut self) -> Result<()> {
        let shown = self.draw()?;
        let pause = if shown { MOVING } else { HIDDEN };
        self.next = (self.content.moves() || self.stale || !shown).then(|| Instant::now() + pause);
        Ok(())
    }

    /// Saves what is shown, without the text.
    fn save(&mut self) -> Result<()> {
        let Some(size_px) = self.open.as_ref().map(|open| open.pane.size_px().map(|side| side.max(1))) else { return Ok(()) };
        let shot = self.shot(size_px);
        let Some(open) = &mut self.open else { return Ok(()) };
        let picture = self.content.world(|world| open.renderer.picture(&shot, world))?;
        let path = loop {
            self.saved += 1;
            let path = self.opening.screenshots.join(format!("sphereboard-{:03}.png", self.saved));
            if !path.exists() {
                break path;
            }
        };
        files::write_whole(&path, &png(&picture.color)?)?;
        say::out(&path.display().to_string());
        Ok(())
    }

    fn key(&mut self, event_loop: &ActiveEventLoop, event: &KeyEvent) {
        let Some(action) = keys::action_of(C::KEYS, &event.logical_key) else { return };
        if event.state == ElementState::Released {
            return self.content.let_go(Some(action));
        }
        if event.repeat && !C::repeats(action) {
            return;
        }
        let done = match self.content.act(action, self.shift) {
            Request::Redraw => Ok(()),
            Request::Screenshot => self.save(),
            Request::Help => {
                self.help = !self.help;
                Ok(())
            }
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
            self.content.drag(to.x - from.x, to.y - from.y);
            self.redraw();
        }
    }

    /// Asks what happens elsewhere, now and then.
    fn poll(&mut self) {
        if self.polled.elapsed() >= POLL {
            self.polled = Instant::now();
            if self.open.as_ref().is_some_and(|open| self.content.poll(&open.renderer)) {
                self.redraw();
            }
        }
    }
}

impl<C: Content> ApplicationHandler for App<C> {
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
            // A window that gets the keyboard is told of the keys that are down, and may be told of the same press once more.
            WindowEvent::KeyboardInput { is_synthetic: true, event: KeyEvent { state: ElementState::Pressed, .. }, .. } => {}
            WindowEvent::KeyboardInput { event, .. } => self.key(event_loop, &event),
            WindowEvent::ModifiersChanged(modifiers) => {
                self.shift = modifiers.state().shift_key();
                self.content.shift(self.shift);
            }
            // Keys that are let go while another window has the keyboard are not told.
            WindowEvent::Focused(false) => self.content.let_go(None),
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => self.dragging = state == ElementState::Pressed,
            WindowEvent::CursorMoved { position, .. } => self.drag(position),
            WindowEvent::MouseWheel { delta, .. } => {
                self.content.wheel(match delta {
                    MouseScrollDelta::LineDelta(_, y) => y,
                    MouseScrollDelta::PixelDelta(p) => p.y as f32 / 40.0,
                });
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
        if self.content.polls() {
            self.poll();
        }
        if self.next.is_some_and(|at| now >= at) {
            self.next = None;
            self.redraw();
        }
        let poll = self.content.polls().then(|| self.polled + POLL);
        let wake = self.closes.into_iter().chain(self.next).chain(poll).min();
        event_loop.set_control_flow(wake.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }
}
