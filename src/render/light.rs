//! Sun and sky: from where the sun stands to the light of a frame. Linear light in units in which a face that is seen in the photograph's
//! own mean light has its base colour.

use glam::Vec3;

use crate::params::PowerOfTwo;

crate::params! {
    /// How a scene is lit.
    pub struct LightParams {
        /// Brightness of sun and sky together.
        exposure: f64 = 1.0, in 0.05..=8.0, unit "", source "ours: a sunlit crown is as bright as in its photograph";
        /// Side of the shadow map, pixels.
        shadow_map_px: PowerOfTwo = PowerOfTwo(1024), in 256..=8192, unit "px", source "ours: 2 cm a texel on a tree of 15 m; twice as many cost three times as much time";
        /// Trees cast shadows up to this far from the viewer.
        shadow_range_m: f64 = 150.0, in 10.0..=2000.0, unit "m", source "ours: beyond, crowns hide the ground between them";
        /// How far off the air has taken two thirds of what it ever takes of what is behind it.
        haze_m: f64 = 700.0, in 1.0..=1000000.0, unit "m", source "ours: single trees are clear, and what lies far off runs into the horizon";
        /// The share of it that the air takes at most: less than 1 is a clear day, 1 is fog.
        haze_most: f64 = 0.72, in 0.0..=1.0, unit "", source "ours: ridges stay to be seen";
    }
}

/// The light of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// On a face turned to the sun.
    pub sun: Vec3,
    /// From above, without the sun.
    pub sky: Vec3,
    /// From the ground.
    pub ground: Vec3,
}

impl Light {
    /// Light on a clear day with the sun in that direction (unit length). Ours: warm and weak when low, none below the horizon, with
    /// the blue of the sky taking over.
    pub fn of(toward_sun: Vec3, exposure: f32) -> Self {
        let height = toward_sun.y;
        let low = (-7.0 * height.max(0.0)).exp();
        let risen = smooth((height + 0.04) / 0.12);
        let sun = risen * Vec3::new(1.40, 1.30, 1.09).lerp(Vec3::new(1.40, 0.88, 0.47), low);
        let day = 0.03 + 0.97 * smooth((height + 0.2) / 0.35);
        let sky = day * Vec3::new(0.48, 0.54, 0.65).lerp(Vec3::new(0.46, 0.43, 0.51), low);
        // Grass throws back a seventh, mostly green; and what the crown itself throws about.
        let ground = Vec3::new(0.17, 0.18, 0.10) * (height.max(0.0) * sun + sky);
        Self { sun: exposure * sun, sky: exposure * sky, ground: exposure * ground }
    }
}

fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(elevation_deg: f32) -> Light {
        let (up, along) = elevation_deg.to_radians().sin_cos();
        Light::of(Vec3::new(along, up, 0.0), 1.0)
    }

    #[test]
    fn low_sun_is_warm_and_a_sun_below_the_horizon_gives_none() {
        let (noon, evening, night) = (at(60.0).sun, at(4.0).sun, at(-10.0));
        assert!(evening.z / evening.x < 0.8 * noon.z / noon.x);
        assert_eq!(night.sun, Vec3::ZERO);
        assert!(night.sky.min_element() > 0.0, "it never gets black");
    }

    #[test]
    fn nothing_jumps_as_the_sun_rises() {
        for step in -900..900 {
            let (a, b) = (at(0.1 * step as f32), at(0.1 * (step + 1) as f32));
            assert!((a.sun - b.sun).length() < 0.08 && (a.sky - b.sky).length() < 0.02, "{step}");
        }
    }
}
