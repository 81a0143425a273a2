//! Wind: how far it pushes a tree. How it moves each point is in `shaders/shared/sway.wgsl`, for all drawers.

use glam::Vec2;

crate::params! {
    /// The wind.
    pub struct WindParams {
        /// Its speed at the top of a tree. 0 is a picture without wind, to the byte.
        wind: f64 = 0.0, in 0.0..=60.0, unit "m/s", source "She §4: feature points sway; ours: still, so that pictures compare";
        /// Where it comes from, as azimuth: 0 is the side of the photograph, 90 its right.
        wind_from_deg: f64 = 270.0, in -360.0..=360.0, unit "°", source "ours: from the left, so that a tree seen from the front leans to the right";
        /// The moment.
        time: f64 = 0.0, in 0.0..=1000000.0, unit "s", source "ours: the beginning";
    }
}

/// Share of its height by which a tree's top leans in a wind of 1 m/s. Drag goes with the square of the speed; ours, so that 5 m/s are a
/// hand's breadth on a tree of 10 m and 10 m/s half a metre.
const LEAN: f32 = 0.000_55;

/// The speed at which crowns have streamlined to half of their drag, m/s.
const STREAMLINED_M_PER_S: f32 = 18.0;

/// The farthest that leaves flutter, metres, and the speed at which they do so half, m/s.
const FLUTTER_M: f32 = 0.06;
const FLUTTER_M_PER_S: f32 = 8.0;

/// What the shaders need of the wind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sway {
    /// How far it pushes the top of a tree, as share of the tree's height, along world x and z.
    pub lean: Vec2,
    /// How far leaves flutter at most, metres.
    pub flutter_m: f32,
}

impl Sway {
    /// No wind.
    pub const NONE: Self = Self { lean: Vec2::ZERO, flutter_m: 0.0 };

    /// Of a wind.
    pub fn of(params: &WindParams) -> Self {
        let speed = params.wind as f32;
        if speed <= 0.0 {
            return Self::NONE;
        }
        let (sin, cos) = (params.wind_from_deg.to_radians() as f32).sin_cos();
        let lean = LEAN * speed * speed / (1.0 + (speed / STREAMLINED_M_PER_S).powi(2));
        Self { lean: -lean * Vec2::new(sin, cos), flutter_m: FLUTTER_M * speed / (speed + FLUTTER_M_PER_S) }
    }

    /// The farthest that any point of a tree so tall moves, metres.
    pub fn reach_m(&self, height_m: f32) -> f32 {
        // The field's sums of sines: 1.18 along, 0.4 across, and both squared down.
        let bent = 1.3 * self.lean.length() * height_m;
        bent + 0.6 * bent * bent / height_m.max(1e-3) + 2.0 * self.flutter_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blowing(wind: f64, wind_from_deg: f64) -> Sway {
        Sway::of(&WindParams { wind, wind_from_deg, ..WindParams::default() })
    }

    #[test]
    fn a_tree_leans_away_from_where_the_wind_comes_from() {
        let from_the_left = blowing(8.0, 270.0).lean;
        assert!(from_the_left.x > 0.0 && from_the_left.y.abs() < 1e-6);
        let from_the_front = blowing(8.0, 0.0).lean;
        assert!(from_the_front.y < 0.0 && from_the_front.x.abs() < 1e-6);
    }

    #[test]
    fn more_wind_leans_more_but_never_flat() {
        let leans: Vec<f32> = (0..=60).map(|v| blowing(f64::from(v), 0.0).lean.length()).collect();
        assert_eq!(leans[0], 0.0);
        assert!(leans.windows(2).all(|w| w[0] < w[1]) && leans[60] < 0.25, "{leans:?}");
    }
}
