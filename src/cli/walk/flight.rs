//! Where the viewer of a grove is: on the scene's path, or flying by hand, never below ground. Knows nothing of windows. Metres, seconds.

use glam::Vec3;

use crate::geom::HeightField;
use crate::grove::{Look, Path};

/// Nearer to the ground, the near plane would cut it open.
const CLEARANCE_M: f32 = 0.6;
/// Farther off nothing is left to be seen, and coordinates lose their digits.
const FARTHEST_M: f32 = 50_000.0;
/// Up and down no farther than this: straight up has no left and right.
const STEEPEST_RAD: f32 = 1.55;
/// What a key does that is only tapped, in seconds of flight.
const TAP_S: f32 = 0.1;
/// A frame that took longer counts as that long: slow drivers are no reason to fly through a hill.
const LONGEST_S: f32 = 0.25;
/// With shift so many times as fast.
const FASTER: f32 = 5.0;

/// A way to fly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Where one looks.
    Forward,
    /// Away from there.
    Back,
    /// Level, to the left.
    Left,
    /// Level, to the right.
    Right,
    /// Straight up.
    Up,
    /// Straight down.
    Down,
}

/// A viewer.
#[derive(Debug, Clone)]
pub struct Flight {
    eye: Vec3,
    azimuth_rad: f32,
    elevation_rad: f32,
    /// How fast keys fly.
    speed_m_s: f32,
    held: Vec<Way>,
    fast: bool,
    /// Whether the path is followed.
    follows: bool,
    /// Where on the path.
    path_s: f32,
}

impl Flight {
    /// At the beginning of a path, following it.
    pub fn new(path: &Path, speed_m_s: f32) -> Self {
        let (eye, held) = (Vec3::ZERO, vec![]);
        let mut flight =
            Self { eye, azimuth_rad: 0.0, elevation_rad: 0.0, speed_m_s, held, fast: false, follows: true, path_s: 0.0 };
        flight.take(path.at(0.0));
        flight
    }

    fn take(&mut self, look: Look) {
        let sight = look.direction();
        self.eye = look.eye;
        self.azimuth_rad = sight.x.atan2(-sight.z);
        self.elevation_rad = sight.y.clamp(-1.0, 1.0).asin();
    }

    /// Unit vector of sight; azimuth 0 is north, -Z.
    fn sight(&self) -> Vec3 {
        let ((sa, ca), (se, ce)) = (self.azimuth_rad.sin_cos(), self.elevation_rad.sin_cos());
        Vec3::new(sa * ce, se, -ca * ce)
    }

    fn toward(&self, way: Way) -> Vec3 {
        let (sa, ca) = self.azimuth_rad.sin_cos();
        let right = Vec3::new(ca, 0.0, sa);
        match way {
            Way::Forward => self.sight(),
            Way::Back => -self.sight(),
            Way::Left => -right,
            Way::Right => right,
            Way::Up => Vec3::Y,
            Way::Down => Vec3::NEG_Y,
        }
    }

    /// What is looked at, a hundred metres away.
    pub fn look(&self) -> Look {
        Look { eye: self.eye, target: self.eye + 100.0 * self.sight() }
    }

    /// A key that flies is pressed: the path is left.
    pub fn press(&mut self, way: Way, ground: &HeightField) {
        self.follows = false;
        if !self.held.contains(&way) {
            self.held.push(way);
            self.fly(self.toward(way), TAP_S, ground);
        }
    }

    /// It is let go; `None` for all.
    pub fn release(&mut self, way: Option<Way>) {
        self.held.retain(|held| way.is_some_and(|way| way != *held));
    }

    /// Faster while shift is held.
    pub fn hurry(&mut self, fast: bool) {
        self.fast = fast;
    }

    /// Looks to the right and up: the path is left.
    pub fn turn(&mut self, right_rad: f32, up_rad: f32) {
        self.follows = false;
        self.azimuth_rad = (self.azimuth_rad + right_rad).rem_euclid(std::f32::consts::TAU);
        self.elevation_rad = (self.elevation_rad + up_rad).clamp(-STEEPEST_RAD, STEEPEST_RAD);
    }

    /// Keys fly so many times as fast from now on.
    pub fn speed_up(&mut self, factor: f32) {
        self.speed_m_s = (self.speed_m_s * factor).clamp(0.1, 1000.0);
    }

    /// Follows the path from where it was left, or stays.
    pub fn follow_or_stay(&mut self) {
        self.follows = !self.follows;
    }

    /// Goes on by so long.
    pub fn advance(&mut self, step_s: f32, path: &Path, ground: &HeightField) {
        if self.follows {
            // A still camera's path has no length.
            let length_s = path.length_s();
            self.path_s = if length_s > 0.0 { (self.path_s + step_s).rem_euclid(length_s) } else { 0.0 };
            return self.take(path.at(self.path_s));
        }
        let along: Vec3 = self.held.iter().map(|way| self.toward(*way)).sum();
        self.fly(along.normalize_or_zero(), step_s.clamp(0.0, LONGEST_S), ground);
    }

    fn fly(&mut self, along: Vec3, step_s: f32, ground: &HeightField) {
        let speed = if self.fast { FASTER * self.speed_m_s } else { self.speed_m_s };
        let farthest = Vec3::splat(FARTHEST_M);
        let to = (self.eye + speed * step_s * along).clamp(-farthest, farthest);
        // Around a scene's ground lies a meadow at its lowest height.
        let floor = ground.height_at(to.x, to.z).unwrap_or_else(|| ground.bounds().min.y);
        self.eye = to.with_y(to.y.max(floor + CLEARANCE_M));
    }

    /// Whether it goes on by itself.
    pub fn moves(&self) -> bool {
        self.follows || !self.held.is_empty()
    }

    /// In words.
    pub fn words(&self) -> String {
        if self.follows { "following the path".to_owned() } else { format!("flying, {:.1} m/s", self.speed_m_s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hill() -> HeightField {
        HeightField::new(3, 3, 20.0, -20.0, -20.0, vec![0.0, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 0.0]).unwrap()
    }

    fn flight() -> (Flight, Path) {
        let path = Path::orbit(Vec3::ZERO, 30.0, 12.0, 10.0).unwrap();
        (Flight::new(&path, 8.0), path)
    }

    #[test]
    fn the_path_is_followed_round_and_round_left_by_a_key_and_taken_up_where_it_was_left() {
        let ((mut flight, path), ground) = (flight(), hill());
        let same = |flight: &Flight, time_s: f32| {
            let (there, here) = (path.at(time_s), flight.look());
            assert!(there.eye.distance(here.eye) < 1e-3 && there.direction().dot(here.direction()) > 0.9999, "{time_s}");
        };
        same(&flight, 0.0);
        flight.advance(13.0, &path, &ground);
        same(&flight, 3.0);
        flight.press(Way::Up, &ground);
        flight.release(Some(Way::Up));
        let left = flight.look().eye;
        assert!(left.y > path.at(3.0).eye.y && !flight.moves());
        flight.advance(1.0, &path, &ground);
        assert_eq!(flight.look().eye, left, "nothing is held");
        flight.follow_or_stay();
        flight.advance(1.0, &path, &ground);
        same(&flight, 4.0);
    }

    #[test]
    fn keys_fly_where_they_say_and_shift_is_faster() {
        let ((mut flight, path), ground) = (flight(), hill());
        let gone = |flight: &mut Flight, way| {
            let before = flight.look();
            flight.press(way, &ground);
            flight.advance(0.2, &path, &ground);
            flight.release(None);
            (flight.look().eye - before.eye, before.direction())
        };
        let (forward, sight) = gone(&mut flight, Way::Forward);
        assert!(forward.normalize().dot(sight) > 0.9999 && (forward.length() - 8.0 * 0.3).abs() < 1e-3);
        let (right, _) = gone(&mut flight, Way::Right);
        assert!(sight.cross(Vec3::Y).dot(right) > 0.0 && right.y == 0.0);
        flight.hurry(true);
        let (left, _) = gone(&mut flight, Way::Left);
        assert!((left + FASTER * right).length() < 1e-3);
    }

    #[test]
    fn nobody_gets_below_ground_or_out_of_the_world_or_loses_the_horizon() {
        let ((mut flight, path), ground) = (flight(), hill());
        flight.speed_up(1e9);
        for way in [Way::Down, Way::Forward, Way::Left, Way::Up, Way::Back, Way::Right, Way::Down] {
            for turn in [0.3, -40.0, 40.0] {
                flight.turn(turn, turn);
                flight.press(way, &ground);
                (0..100).for_each(|_| flight.advance(1e3, &path, &ground));
                flight.release(None);
                let look = flight.look();
                let floor = ground.height_at(look.eye.x, look.eye.z).unwrap_or(0.0);
                assert!(look.eye.is_finite() && look.eye.y >= floor + 0.99 * CLEARANCE_M, "{way:?} {}", look.eye);
                assert!(look.eye.abs().max_element() <= FARTHEST_M && look.direction().with_y(0.0).length() > 0.01);
            }
        }
    }
}
