//! What of space a picture shows: between planes.

use glam::{Mat4, Vec3, Vec4};

use crate::geom::Bounds;

/// The planes that bound what a picture shows; each is positive inside.
#[derive(Debug, Clone, Copy)]
pub struct Frustum([Vec4; 6]);

/// How a thing lies to the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Nothing of it is seen.
    Outside,
    /// Some of it may be.
    Across,
    /// All of it is within.
    Inside,
}

impl Frustum {
    /// Of a projection to clip space with reversed depth, w ≥ z ≥ 0 (Gribb & Hartmann 2001).
    pub fn new(clip_from_world: &Mat4) -> Self {
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip_from_world.row(row));
        // The far plane of a picture that shows everything to infinity has no normal.
        let unit = |plane: Vec4| if plane.truncate().length() > 1e-9 { plane / plane.truncate().length() } else { Vec4::W };
        Self([w + x, w - x, w + y, w - y, w - z, z].map(unit))
    }

    /// The planes.
    pub fn planes(&self) -> [[f32; 4]; 6] {
        self.0.map(|plane| plane.to_array())
    }

    /// How a box lies.
    pub fn of_box(&self, bounds: &Bounds) -> Side {
        let (center, half) = (bounds.center(), 0.5 * bounds.size());
        self.least(center, |normal| normal.abs().dot(half))
    }

    /// How a ball lies.
    pub fn of_ball(&self, center: Vec3, radius_m: f32) -> Side {
        self.least(center, |_| radius_m)
    }

    fn least(&self, center: Vec3, reach: impl Fn(Vec3) -> f32) -> Side {
        let mut side = Side::Inside;
        for plane in &self.0 {
            let (way, reach) = (plane.dot(center.extend(1.0)), reach(plane.truncate()));
            if way < -reach {
                return Side::Outside;
            }
            if way < reach {
                side = Side::Across;
            }
        }
        side
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Camera, Projection};

    #[test]
    fn what_projects_into_the_picture_is_inside() {
        let mut camera = Camera::orbit(Vec3::new(3.0, 1.0, -2.0), 0.8, 0.2, 30.0);
        for projection in [camera.projection, Projection::Orthographic { half_height_m: 9.0, near_m: 1.0, far_m: 50.0 }] {
            camera.projection = projection;
            let clip_from_world = camera.clip_from_world(1.6);
            let frustum = Frustum::new(&clip_from_world);
            for i in 0..4000u32 {
                let part = |k: u32| ((i.wrapping_mul(k) >> 7) % 1000) as f32 / 10.0 - 50.0;
                let at = Vec3::new(part(2_654_435_761), part(2_246_822_519), part(3_266_489_917));
                let clip = clip_from_world * at.extend(1.0);
                let inside = clip.x.abs() <= clip.w && clip.y.abs() <= clip.w && (0.0..=clip.w).contains(&clip.z);
                let edge = [clip.x.abs() - clip.w, clip.y.abs() - clip.w, clip.z - clip.w].iter().any(|d| d.abs() < 1e-3);
                let side = frustum.of_ball(at, 0.0);
                assert!(edge || inside == (side != Side::Outside), "{at} {clip} {side:?}");
                let around = Bounds { min: at - 2.0, max: at + 2.0 };
                assert!(edge || !inside || frustum.of_box(&around) != Side::Outside);
            }
        }
    }
}
