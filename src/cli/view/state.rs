//! What the window shows: where the viewer stands, what is switched on. Knows nothing of windows, so that it can be tested.

use glam::Vec3;

use super::keys::Action;
use crate::cli::look::{Look, Orbit, toward};
use crate::cli::window::Request;
use crate::render::{Background, Camera, GrowthChoice, Shot, Show, Stage};

/// A person's eye above the ground, metres.
const EYE_M: f32 = 1.7;

/// One step, metres.
const STEP_M: f32 = 0.5;

/// What the window shows.
#[derive(Debug, Clone)]
pub struct State {
    home: Orbit,
    orbit: Orbit,
    /// Where a walker stands and looks, once somebody walks.
    walker: Option<Walker>,
    /// Azimuth and elevation, °.
    sun_deg: [f32; 2],
    stage: Stage,
    show: Show,
    background: Background,
    grows: bool,
    wind_m_per_s: f64,
}

#[derive(Debug, Clone, Copy)]
struct Walker {
    eye: Vec3,
    azimuth_rad: f32,
    elevation_rad: f32,
}

impl State {
    /// As the command line says.
    pub fn new(look: &Look, orbit: Orbit) -> Self {
        let sun = look.toward_sun;
        let sun_deg = [sun.x.atan2(sun.z).to_degrees(), sun.y.clamp(-1.0, 1.0).asin().to_degrees()];
        let (stage, show, background) = (look.params.stage, look.params.show, look.params.background);
        let grows = look.growth.growth != GrowthChoice::None;
        let wind_m_per_s = look.wind.wind;
        Self { home: orbit, orbit, walker: None, sun_deg, stage, show, background, grows, wind_m_per_s }
    }

    /// Does what a key says.
    pub fn act(&mut self, action: Action) -> Request {
        match action {
            Action::Stage(stage) => self.stage = stage,
            Action::Show(show) => self.show = if self.show == show { Show::Picture } else { show },
            Action::Growth => self.grows = !self.grows,
            Action::Wind(more) => self.wind_m_per_s = (self.wind_m_per_s + more).clamp(0.0, 60.0),
            Action::Background => self.background = next(self.background),
            Action::TurnSun(degrees) => self.sun_deg[0] = (self.sun_deg[0] + degrees).rem_euclid(360.0),
            Action::LiftSun(degrees) => self.sun_deg[1] = (self.sun_deg[1] + degrees).clamp(-5.0, 90.0),
            Action::Turn(degrees) => self.turn(degrees.to_radians(), 0.0),
            Action::Lift(degrees) => self.turn(0.0, degrees.to_radians()),
            Action::Approach(factor) => self.approach(factor),
            Action::Sidestep(steps) => self.sidestep(steps),
            Action::Walk => self.walk_or_orbit(),
            Action::Home => (self.orbit, self.walker) = (self.home, None),
            Action::Help => return Request::Help,
            Action::Screenshot => return Request::Screenshot,
            Action::Quit => return Request::Quit,
        }
        Request::Redraw
    }

    /// Turns the viewer round the tree, or the walker's head.
    pub fn turn(&mut self, azimuth_rad: f32, elevation_rad: f32) {
        const LIMIT: f32 = std::f32::consts::FRAC_PI_2;
        match &mut self.walker {
            // The head turns right when the tree would turn left.
            Some(walker) => {
                walker.azimuth_rad -= azimuth_rad;
                walker.elevation_rad = (walker.elevation_rad - elevation_rad).clamp(-LIMIT, LIMIT);
            }
            None => {
                self.orbit.azimuth_rad += azimuth_rad;
                self.orbit.elevation_rad = (self.orbit.elevation_rad + elevation_rad).clamp(-LIMIT, LIMIT);
            }
        }
    }

    /// Goes nearer or farther.
    pub fn approach(&mut self, factor: f32) {
        match &mut self.walker {
            Some(walker) => walker.go(0.0, if factor < 1.0 { STEP_M } else { -STEP_M }),
            None => self.orbit.distance_m = (self.orbit.distance_m * factor).clamp(0.05, 1e5),
        }
    }

    fn sidestep(&mut self, steps: f32) {
        match &mut self.walker {
            Some(walker) => walker.go(steps * STEP_M, 0.0),
            None => self.turn((5.0 * steps).to_radians(), 0.0),
        }
    }

    /// A walker starts where the viewer stood, with his feet on the ground.
    fn walk_or_orbit(&mut self) {
        self.walker = match self.walker {
            Some(_) => None,
            None => {
                let Orbit { azimuth_rad, elevation_rad: _, .. } = self.orbit;
                let eye = self.orbit.camera(0.0).eye.with_y(EYE_M);
                let toward = self.orbit.target - eye;
                let elevation_rad = -toward.y.atan2(toward.with_y(0.0).length());
                Some(Walker { eye, azimuth_rad, elevation_rad })
            }
        };
    }

    fn camera(&self) -> Camera {
        match &self.walker {
            Some(w) => {
                let mut camera = Camera::orbit(w.eye, w.azimuth_rad, w.elevation_rad, 1.0);
                camera.eye = w.eye;
                camera
            }
            None => self.orbit.camera(0.0),
        }
    }

    /// Whether the picture moves by itself.
    pub fn moves(&self) -> bool {
        self.wind_m_per_s > 0.0
    }

    /// The picture to draw `time_s` after the window was opened.
    pub fn shot(&self, look: &Look, size_px: [u32; 2], time_s: f64) -> Shot {
        let mut shot = look.shot(self.camera());
        (shot.size_px, shot.stage, shot.show, shot.background, shot.toward_sun) =
            (size_px, self.stage, self.show, self.background, toward(self.sun_deg));
        shot.wind.wind = self.wind_m_per_s;
        shot.wind.time += time_s;
        if !self.grows {
            shot.growth.growth = GrowthChoice::None;
        } else if shot.growth.growth == GrowthChoice::None {
            shot.growth.growth = GrowthChoice::Auto;
        }
        shot
    }

    /// What is switched on, in words.
    pub fn words(&self) -> String {
        let how = if self.walker.is_some() { "walking" } else { "orbit" };
        let [azimuth, elevation] = self.sun_deg;
        format!("{how}, {:?}, sun {azimuth:.0}°/{elevation:.0}°, wind {} m/s", self.stage, self.wind_m_per_s)
    }
}

impl Walker {
    fn go(&mut self, right_m: f32, forward_m: f32) {
        let (s, c) = self.azimuth_rad.sin_cos();
        self.eye += right_m * Vec3::new(c, 0.0, -s) - forward_m * Vec3::new(s, 0.0, c);
    }
}

fn next(background: Background) -> Background {
    match background {
        Background::Sky => Background::Black,
        Background::Black => Background::White,
        Background::White | Background::Alpha => Background::Sky,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> State {
        let orbit = Orbit { target: Vec3::new(0.0, 5.0, 0.0), azimuth_rad: 0.0, elevation_rad: 0.1, distance_m: 20.0 };
        State {
            home: orbit,
            orbit,
            walker: None,
            sun_deg: [0.0, 45.0],
            stage: Stage::Lit,
            show: Show::Picture,
            background: Background::Sky,
            grows: true,
            wind_m_per_s: 0.0,
        }
    }

    #[test]
    fn a_walker_starts_where_the_viewer_stood_looks_at_the_tree_and_walks_towards_it() {
        let mut state = state();
        state.act(Action::Walk);
        let before = state.camera();
        assert_eq!(before.eye.y, EYE_M);
        let toward = (state.orbit.target - before.eye).normalize();
        assert!(toward.dot(-before.axes[2]) > 0.9999);
        state.act(Action::Approach(0.9));
        let gone = state.camera().eye - before.eye;
        assert!((gone.length() - STEP_M).abs() < 1e-5 && gone.dot(toward.with_y(0.0).normalize()) > 0.99 * STEP_M);
        state.act(Action::Home);
        assert_eq!(state.camera(), state.home.camera(0.0));
    }

    #[test]
    fn no_sequence_of_keys_leads_out_of_the_world() {
        let mut state = state();
        for action in [Action::Lift(5.0), Action::Approach(0.9), Action::LiftSun(5.0), Action::Walk, Action::Lift(-5.0)] {
            (0..200).for_each(|_| _ = state.act(action));
            let camera = state.camera();
            assert!(camera.eye.is_finite() && camera.axes.iter().all(|a| a.is_finite()), "{action:?}");
        }
    }
}
