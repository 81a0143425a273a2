//! The path of a camera: keys of time, eye and target, and what lies smoothly between them (Catmull-Rom, by time). Seconds and metres,
//! +Y up.

use std::f32::consts::TAU;
use std::path::Path as FilePath;

use glam::Vec3;
use serde::Deserialize;

use crate::geom::HeightField;
use crate::{Error, Result, files};

/// A path file may have this many keys; an hour of film at 24 frames a second has 86,400.
pub const MOST_KEYS: usize = 100_000;

/// The columns of a path file.
pub const COLUMNS: &str = "t,ex,ey,ez,tx,ty,tz";

/// Where the camera stands, and the point that it looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Where it stands, metres.
    pub eye: Vec3,
    /// The middle of the picture, metres.
    pub target: Vec3,
}

impl Look {
    /// Unit vector of sight; north where the eye is the target.
    pub fn direction(&self) -> Vec3 {
        (self.target - self.eye).normalize_or(Vec3::NEG_Z)
    }
}

/// A moment of the path.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// When, seconds.
    pub time_s: f32,
    /// Where the camera stands, metres.
    pub eye: Vec3,
    /// What it looks at, metres.
    pub target: Vec3,
}

impl Key {
    /// The same place and direction for another time.
    fn look(&self) -> Look {
        Look { eye: self.eye, target: self.target }
    }
}

/// A camera's path; one key is a still camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    keys: Vec<Key>,
}

impl Path {
    /// A path through `keys`. Where the last stands where the first does, it is round and has no corner there.
    ///
    /// # Errors
    /// [`Error::CameraPath`], which counts keys from 1: none, too many, times that do not grow, numbers that are none, an eye in its target.
    pub fn new(keys: Vec<Key>) -> Result<Self> {
        let refuse =
            |place: String, expected: &str, found: String| Err(Error::CameraPath { place, expected: expected.to_owned(), found });
        if keys.is_empty() || keys.len() > MOST_KEYS {
            let expected = format!("1 to {MOST_KEYS} keys");
            return refuse("a camera path".to_owned(), &expected, keys.len().to_string());
        }
        for (index, key) in keys.iter().enumerate() {
            let place = || format!("key {}", index + 1);
            if !(key.time_s.is_finite() && key.eye.is_finite() && key.target.is_finite()) {
                return refuse(place(), "seven finite numbers", format!("{key:?}"));
            }
            if key.eye == key.target {
                return refuse(place(), "an eye away from its target", format!("both at {}", key.eye));
            }
            if let Some(before) = index.checked_sub(1).map(|i| keys[i].time_s).filter(|before| *before >= key.time_s) {
                return refuse(place(), &format!("a time after {before} s"), format!("{} s", key.time_s));
            }
        }
        Ok(Self { keys })
    }

    /// A camera that never moves.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn still(eye: Vec3, target: Vec3) -> Result<Self> {
        Self::new(vec![Key { time_s: 0.0, eye, target }])
    }

    /// Its keys.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// From the first key to the last, seconds.
    pub fn length_s(&self) -> f32 {
        self.keys[self.keys.len() - 1].time_s - self.keys[0].time_s
    }

    /// Where the camera is `time_s` after the path's beginning; before it the first key, after its end the last.
    pub fn at(&self, time_s: f32) -> Look {
        let time = self.keys[0].time_s + time_s;
        let next = self.keys.partition_point(|key| key.time_s <= time);
        let Some(here) = next.checked_sub(1) else { return self.keys[0].look() };
        let (Some(from), Some(to)) = (self.keys.get(here), self.keys.get(next)) else { return self.keys[here].look() };
        let span = to.time_s - from.time_s;
        let along = (time - from.time_s) / span;
        let pace = [self.pace(here), self.pace(next)];
        let between = |a: Vec3, b: Vec3, pace: [Vec3; 2]| hermite([a, b], pace.map(|p| p * span), along);
        Look {
            eye: between(from.eye, to.eye, pace.map(|p| p.eye)),
            target: between(from.target, to.target, pace.map(|p| p.target)),
        }
    }

    /// Metres a second at a key: Catmull-Rom's slope between its neighbours, over the seam where the path is round.
    fn pace(&self, index: usize) -> Look {
        let (keys, last) = (&self.keys, self.keys.len() - 1);
        let slope =
            |a: &Key, b: &Key, seconds: f32| Look { eye: (b.eye - a.eye) / seconds, target: (b.target - a.target) / seconds };
        let round = last > 1 && keys[0].look() == keys[last].look();
        if round && (index == 0 || index == last) {
            let seconds = keys[last].time_s - keys[last - 1].time_s + keys[1].time_s - keys[0].time_s;
            return slope(&keys[last - 1], &keys[1], seconds);
        }
        let (before, after) = (&keys[index.saturating_sub(1)], &keys[(index + 1).min(last)]);
        slope(before, after, after.time_s - before.time_s)
    }

    /// Once around `target` at `radius_m`, from `height_m` above it, in `length_s`; begins south of it (azimuth 0).
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn orbit(target: Vec3, radius_m: f32, height_m: f32, length_s: f32) -> Result<Self> {
        const KEYS: u16 = 48;
        let key = |index: u16| {
            let share = f32::from(index) / f32::from(KEYS);
            // The last key is the first to the bit, which is how the path is known to be round.
            let (sin, cos) = (TAU * if index == KEYS { 0.0 } else { share }).sin_cos();
            Key { time_s: share * length_s, eye: target + Vec3::new(radius_m * sin, height_m, radius_m * cos), target }
        };
        Self::new((0..=KEYS).map(key).collect())
    }

    /// Over the ground and back to where it began, in `length_s`: from high above the southern rim down to `above_m` over the ground,
    /// a figure of eight through the middle, and up again. As Truelsen's tour (§7.3.4): far away first, then close to the trees.
    ///
    /// # Errors
    /// Those of [`Self::new`] and of [`Self::keep_above`].
    pub fn tour(ground: &HeightField, above_m: f32, length_s: f32) -> Result<Self> {
        const KEYS: u16 = 96;
        let bounds = ground.bounds();
        let (middle, size) = (bounds.center(), bounds.size());
        // Never over the rim, and over wide ground not so fast that nothing is seen: 10 m a second on average.
        let reach = (0.42 * Vec3::new(size.x, 0.0, size.z)).min(Vec3::splat(0.6 * 10.0 * length_s / 4.0).max(Vec3::splat(10.0)));
        let overview = 0.35 * reach.x.min(reach.z);
        let place = |share: f32| {
            // Gerono's figure of eight, entered and left at its southern end.
            let (sin, cos) = (TAU * share).sin_cos();
            let (x, z) = (middle.x + reach.x * sin * cos, middle.z + reach.z * cos);
            // High at the ends of the path, low from an eighth to seven eighths.
            let high = smooth(1.0 - 8.0 * share.min(1.0 - share));
            let floor = ground.height_at(x, z).unwrap_or(bounds.max.y);
            Vec3::new(x, floor + above_m + overview * high, z)
        };
        let key = |index: u16| {
            let share = f32::from(index % KEYS) / f32::from(KEYS);
            // Looks where it will be, a twelfth of the path on, so that curves are seen coming.
            let eye = place(share);
            let ahead = place((share + 1.0 / 12.0).fract());
            let floor = ground.height_at(ahead.x, ahead.z).unwrap_or(bounds.max.y) + above_m;
            Key {
                time_s: f32::from(index) / f32::from(KEYS) * length_s,
                eye,
                target: Vec3::new(ahead.x, floor.min(ahead.y), ahead.z),
            }
        };
        let mut path = Self::new((0..=KEYS).map(key).collect())?;
        path.keep_above(ground, 0.5 * above_m);
        Ok(path)
    }

    /// Raises the keys where the path would come nearer than `clearance_m` to the ground; by how much at most, metres, 0 where nothing
    /// had to be. What lies off the ground is left alone.
    pub fn keep_above(&mut self, ground: &HeightField, clearance_m: f32) -> f32 {
        let before: Vec<f32> = self.keys.iter().map(|key| key.eye.y).collect();
        // Raising both keys of a span raises all of it and takes from its neighbours less than that; a few rounds settle it.
        for _ in 0..16 {
            let lacks: Vec<f32> = (0..self.keys.len()).map(|span| self.lacking_m(span, ground, clearance_m)).collect();
            if lacks.iter().all(|lack| *lack <= 0.0) {
                break;
            }
            for (index, key) in self.keys.iter_mut().enumerate() {
                let lack = lacks[index].max(lacks[index.saturating_sub(1)]);
                key.eye.y += if lack > 0.0 { lack + 0.01 } else { 0.0 };
            }
            self.close_seam();
        }
        // Whatever is left over lifts the whole path.
        let left = (0..self.keys.len()).map(|span| self.lacking_m(span, ground, clearance_m)).fold(0.0, f32::max);
        self.keys.iter_mut().for_each(|key| key.eye.y += left);
        self.keys.iter().zip(before).map(|(key, before)| key.eye.y - before).fold(0.0, f32::max)
    }

    /// Both ends of a round path at the higher of the two.
    fn close_seam(&mut self) {
        let last = self.keys.len() - 1;
        let (first, end) = (self.keys[0], self.keys[last]);
        if (first.eye.x, first.eye.z, first.target) == (end.eye.x, end.eye.z, end.target) {
            let high = first.eye.y.max(end.eye.y);
            (self.keys[0].eye.y, self.keys[last].eye.y) = (high, high);
        }
    }

    /// How much higher the span after key `index` would have to be, metres. Looked at sixteen times for each cell of the ground, whose
    /// ridges are sharp.
    fn lacking_m(&self, index: usize, ground: &HeightField, clearance_m: f32) -> f32 {
        const MOST_LOOKS: f32 = 10_000.0;
        let from = &self.keys[index];
        let to = self.keys.get(index + 1).unwrap_or(from);
        let looks = (16.0 * from.eye.distance(to.eye) / ground.step_m).ceil().clamp(8.0, MOST_LOOKS);
        let lack = |look: u32| {
            let time = from.time_s - self.keys[0].time_s + look as f32 / looks * (to.time_s - from.time_s);
            let eye = self.at(time).eye;
            ground.height_at(eye.x, eye.z).map_or(0.0, |floor| floor + clearance_m - eye.y)
        };
        (0..=looks as u32).map(lack).fold(0.0, f32::max)
    }

    /// From a file: TOML where its name says so, otherwise lines of `t,ex,ey,ez,tx,ty,tz` (seconds, metres), a header and `#` allowed.
    ///
    /// # Errors
    /// [`Error::InFile`] around those of [`Self::from_csv`] and [`Self::from_toml`]; those of reading.
    pub fn open(path: &FilePath) -> Result<Self> {
        const MOST_BYTES: u64 = 32 << 20;
        let bytes = files::read_whole(path, MOST_BYTES)?;
        let text = String::from_utf8_lossy(&bytes);
        let read = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) { Self::from_toml } else { Self::from_csv };
        read(&text).map_err(|cause| Error::InFile { path: path.to_owned(), cause: Box::new(cause) })
    }

    /// From lines of `t,ex,ey,ez,tx,ty,tz`.
    ///
    /// # Errors
    /// [`Error::CameraPath`], which names the line.
    pub fn from_csv(text: &str) -> Result<Self> {
        let mut keys = vec![];
        for (index, line) in text.lines().enumerate() {
            let line = line.trim_start_matches('\u{feff}').trim();
            let header = keys.is_empty() && line.replace(' ', "").eq_ignore_ascii_case(COLUMNS);
            if line.is_empty() || line.starts_with('#') || header {
                continue;
            }
            let refuse = |found: &str| Error::CameraPath {
                place: format!("line {}", index + 1),
                expected: format!("seven finite numbers, {COLUMNS}"),
                found: format!("`{}`", found.chars().take(60).collect::<String>()),
            };
            let numbers: Option<Vec<f32>> =
                line.split(',').map(|n| n.trim().parse().ok().filter(|n: &f32| n.is_finite())).collect();
            let numbers: [f32; 7] = numbers.and_then(|n| n.try_into().ok()).ok_or_else(|| refuse(line))?;
            let [time_s, eye @ .., tx, ty, tz] = numbers;
            let key = Key { time_s, eye: eye.into(), target: Vec3::new(tx, ty, tz) };
            // What is wrong with one key beside the one before it is told by its line, not its number.
            let pair: Vec<Key> = keys.last().copied().into_iter().chain([key]).collect();
            Self::new(pair).map_err(|error| match error {
                Error::CameraPath { expected, found, .. } => {
                    Error::CameraPath { place: format!("line {}", index + 1), expected, found }
                }
                other => other,
            })?;
            keys.push(key);
        }
        Self::new(keys)
    }

    /// From `[[key]]` tables with `time_s`, `eye` and `target`.
    ///
    /// # Errors
    /// [`Error::CameraPath`], which names the line or the key.
    pub fn from_toml(text: &str) -> Result<Self> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            key: Vec<Key>,
        }
        let refuse = |error: toml::de::Error| {
            let line = error.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
            let expected = "[[key]] tables with time_s, eye = [x, y, z] and target = [x, y, z]".to_owned();
            Error::CameraPath { place: format!("line {line}"), expected, found: error.message().to_owned() }
        };
        Self::new(toml::from_str::<File>(text).map_err(refuse)?.key)
    }
}

/// 0 to 1 with level ends.
fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// The cubic through both `ends` with these slopes over the whole span.
fn hermite(ends: [Vec3; 2], slopes: [Vec3; 2], t: f32) -> Vec3 {
    let (t2, t3) = (t * t, t * t * t);
    // Written around the first end, so that equal ends without slopes stay where they are to the bit.
    ends[0] + (ends[1] - ends[0]) * (3.0 * t2 - 2.0 * t3) + slopes[0] * (t3 - 2.0 * t2 + t) + slopes[1] * (t3 - t2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn hills(seed: f32) -> HeightField {
        let height = |i: u32| 20.0 * ((i % 41) as f32 * 0.31 + seed).sin() + 15.0 * ((i / 41) as f32 * 0.23 * seed).cos();
        HeightField::new(41, 41, 5.0, -100.0, -100.0, (0..41 * 41).map(height).collect()).unwrap()
    }

    #[test]
    fn one_key_is_a_still_camera() {
        let path = Path::from_csv("0, 1,2,3, 4,5,6\n").unwrap();
        assert_eq!(path.length_s(), 0.0);
        for time in [-1.0, 0.0, 7.0, f32::NAN] {
            assert_eq!(path.at(time), Look { eye: Vec3::new(1.0, 2.0, 3.0), target: Vec3::new(4.0, 5.0, 6.0) });
        }
    }

    #[test]
    fn bad_lines_are_named() {
        let told = |text: &str| Path::from_csv(text).unwrap_err().to_string();
        assert!(told("t,ex,ey,ez,tx,ty,tz\n0,1,2,3,4,5,6\n# note\n1,2,3\n").contains("line 4"));
        assert!(told("0,1,2,3,4,5,6\n1,NaN,2,3,4,5,6").contains("line 2"));
        assert!(told("5,1,2,3,4,5,6\n\n5,1,2,3,4,5,7").contains("line 3: expected a time after 5 s"));
        assert!(told("5,1,2,3,1,2,3").contains("line 1: expected an eye away from its target"));
        assert!(told("").contains("expected 1 to 100000 keys, but found 0"));
        let told = |text: &str| Path::from_toml(text).unwrap_err().to_string();
        assert!(told("[[key]]\ntime_s = 0\neye = [0,0,0]\ntarget = [0,0]\n").contains("line"));
        assert!(Path::from_toml("[[key]]\ntime_s = 0.0\neye = [0.0,0.0,0.0]\ntarget = [0.0,0.0,1.0]\n").is_ok());
    }

    #[test]
    fn an_orbit_is_round() {
        let target = Vec3::new(3.0, 1.0, -2.0);
        let path = Path::orbit(target, 50.0, 10.0, 20.0).unwrap();
        for step in 0..200 {
            let look = path.at(0.1 * step as f32);
            let flat = Vec3::new(look.eye.x - target.x, 0.0, look.eye.z - target.z);
            assert!((flat.length() - 50.0).abs() < 0.01 && look.target == target, "{look:?}");
        }
        // No corner at the seam: as far in its last hundredth of a second as in its first.
        let (first, last) = (path.at(0.01).eye - path.at(0.0).eye, path.at(20.0).eye - path.at(19.99).eye);
        assert!((first - last).length() < 1e-3);
    }

    proptest! {
        #[test]
        fn a_tour_never_goes_below_ground_nor_off_it(seed in 0.1f32..6.0, above in 1.0f32..20.0, length in 5.0f32..200.0) {
            let ground = hills(seed);
            let path = Path::tour(&ground, above, length).unwrap();
            for step in 0..=3000 {
                let eye = path.at(length * step as f32 / 3000.0).eye;
                let floor = ground.height_at(eye.x, eye.z);
                prop_assert!(floor.is_some_and(|floor| eye.y > floor + 0.25 * above), "{} at {}", eye, step);
            }
            prop_assert_eq!(path.at(0.0), path.at(length));
        }

        #[test]
        fn paths_run_through_their_keys(points in prop::collection::vec((0.1f32..5.0, -50.0f32..50.0, -50.0f32..50.0), 2..12)) {
            let mut time_s = 3.0;
            let keys: Vec<Key> = points.iter().map(|&(wait, x, z)| {
                time_s += wait;
                Key { time_s, eye: Vec3::new(x, 2.0, z), target: Vec3::new(z, 0.0, x) }
            }).collect();
            let path = Path::new(keys.clone()).unwrap();
            for key in &keys {
                let look = path.at(key.time_s - keys[0].time_s);
                prop_assert!(look.eye.distance(key.eye) < 0.02 && look.target.distance(key.target) < 0.02);
            }
        }
    }
}
