//! Where the viewer stands. Depth is reversed: 1 at the near plane, towards 0 with distance, so that 32-bit floats stay exact.

use glam::{Mat3, Mat4, Vec3, Vec4};

use crate::repr::REFERENCE_FOCAL_PX;

/// How far the picture opens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// From a point, infinitely far.
    Perspective {
        /// Angle from the bottom to the top of the picture, radians.
        fov_y_rad: f32,
        /// Nothing nearer is seen, metres.
        near_m: f32,
    },
    /// Parallel.
    Orthographic {
        /// Half of what fits from bottom to top, metres.
        half_height_m: f32,
        /// Nearest distance seen, metres.
        near_m: f32,
        /// Farthest distance seen, metres.
        far_m: f32,
    },
}

/// Smoothed outlines lie where the distance grows by this share; `shaders/shared/outline.wgsl` has the same for perspective.
const LAYER: f32 = 0.02;

impl Projection {
    /// Parallel: the difference of depth that a layer makes, as it is seen in perspective from where the picture just fits. Perspective: 0.
    pub fn layer(&self) -> f32 {
        match *self {
            Self::Perspective { .. } => 0.0,
            Self::Orthographic { half_height_m, near_m, far_m } => {
                LAYER * half_height_m / (0.5 * FOV_Y_RAD).tan() / (far_m - near_m)
            }
        }
    }
}

/// A viewer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Where it stands, world space, metres.
    pub eye: Vec3,
    /// Right, up and backward: unit vectors of world space.
    pub axes: [Vec3; 3],
    /// How far the picture opens.
    pub projection: Projection,
}

/// A 50 mm lens on 24 mm of film height: how tall things look in most photographs.
pub const FOV_Y_RAD: f32 = 0.471_1;

impl Camera {
    /// From azimuth `azimuth_rad` (0 is +Z, π/2 is +X) and `elevation_rad` above the horizon, as [`crate::raster::View`] has them,
    /// `distance_m` away from `target`.
    pub fn orbit(target: Vec3, azimuth_rad: f32, elevation_rad: f32, distance_m: f32) -> Self {
        let ((sa, ca), (se, ce)) = (azimuth_rad.sin_cos(), elevation_rad.sin_cos());
        let (right, backward) = (Vec3::new(ca, 0.0, -sa), Vec3::new(sa * ce, se, ca * ce));
        let near_m = (0.02 * distance_m).clamp(0.01, 0.5);
        Self {
            eye: target + distance_m * backward,
            axes: [right, backward.cross(right), backward],
            projection: Projection::Perspective { fov_y_rad: FOV_Y_RAD, near_m },
        }
    }

    /// From a point towards another, upright; `fov_y_rad` from the bottom to the top of the picture.
    pub fn looking(eye: Vec3, target: Vec3, fov_y_rad: f32) -> Self {
        let backward = (eye - target).normalize_or(Vec3::Z);
        let right = Vec3::Y.cross(backward).normalize_or(Vec3::X);
        let projection = Projection::Perspective { fov_y_rad, near_m: 0.25 };
        Self { eye, axes: [right, backward.cross(right), backward], projection }
    }

    /// The distance from `target` at which all of `points` just fit, with a margin of 4 %, into a picture of this width over height.
    pub fn fitting_distance_m(points: &[Vec3], target: Vec3, azimuth_rad: f32, elevation_rad: f32, aspect: f32) -> f32 {
        let [right, up, backward] = Self::orbit(target, azimuth_rad, elevation_rad, 1.0).axes;
        let slope = (0.5 * FOV_Y_RAD).tan() / 1.04;
        let needed = points.iter().map(|&p| {
            let p = p - target;
            p.dot(backward) + p.dot(up).abs().max(p.dot(right).abs() / aspect) / slope
        });
        needed.fold(0.1, f32::max)
    }

    /// World to view space: +X right, +Y up, looking along -Z.
    pub fn view_from_world(&self) -> Mat4 {
        let [right, up, backward] = self.axes;
        Mat4::from_mat3(Mat3::from_cols(right, up, backward).transpose()) * Mat4::from_translation(-self.eye)
    }

    /// World to clip space for a picture of this width over height.
    pub fn clip_from_world(&self, aspect: f32) -> Mat4 {
        let clip_from_view = match self.projection {
            Projection::Perspective { fov_y_rad, near_m } => {
                let f = 1.0 / (0.5 * fov_y_rad).tan();
                Mat4::from_cols(Vec4::X * (f / aspect), Vec4::Y * f, Vec4::NEG_W, Vec4::Z * near_m)
            }
            Projection::Orthographic { half_height_m: h, near_m, far_m } => {
                let depth = 1.0 / (far_m - near_m);
                let last = Vec4::new(0.0, 0.0, far_m * depth, 1.0);
                Mat4::from_cols(Vec4::X / (h * aspect), Vec4::Y / h, Vec4::Z * depth, last)
            }
        };
        clip_from_view * self.view_from_world()
    }

    /// Pixels per metre at depth `d` are `x + y · d`, for a picture this tall.
    pub fn px_per_m(&self, height_px: u32) -> [f32; 2] {
        let half = 0.5 * height_px as f32;
        match self.projection {
            Projection::Perspective { fov_y_rad, near_m } => [0.0, half / (0.5 * fov_y_rad).tan() / near_m],
            Projection::Orthographic { half_height_m, .. } => [half / half_height_m, 0.0],
        }
    }

    /// In a picture this tall, what is `d` metres away looks as large as what is `x + y · d` metres away in the picture for which distances
    /// are told ([`REFERENCE_FOCAL_PX`]).
    pub fn heights(&self, height_px: u32) -> [f32; 2] {
        let half = 0.5 * height_px as f32;
        match self.projection {
            Projection::Perspective { fov_y_rad, .. } => [0.0, REFERENCE_FOCAL_PX * (0.5 * fov_y_rad).tan() / half],
            Projection::Orthographic { half_height_m, .. } => [REFERENCE_FOCAL_PX * half_height_m / half, 0.0],
        }
    }

    /// Distance from the viewer's plane at a depth of the buffer, metres; infinity where nothing is.
    pub fn distance_m(&self, depth: f32) -> f32 {
        match self.projection {
            _ if depth <= 0.0 => f32::INFINITY,
            Projection::Perspective { near_m, .. } => near_m / depth,
            Projection::Orthographic { near_m, far_m, .. } => far_m - depth * (far_m - near_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_runs_from_one_at_the_near_plane_and_gives_the_distance_back() {
        let mut camera = Camera::orbit(Vec3::new(1.0, 2.0, 3.0), 0.7, 0.3, 20.0);
        let parallel = Projection::Orthographic { half_height_m: 5.0, near_m: 1.0, far_m: 60.0 };
        for projection in [camera.projection, parallel] {
            camera.projection = projection;
            let toward = -camera.axes[2];
            for distance in [1.0f32, 2.0, 20.0, 55.0] {
                let clip = camera.clip_from_world(1.5) * (camera.eye + distance * toward).extend(1.0);
                assert!((camera.distance_m(clip.z / clip.w) / distance - 1.0).abs() < 1e-4, "{projection:?} {distance}");
            }
        }
    }

    #[test]
    fn a_metre_has_as_many_pixels_as_the_matrix_says() {
        let camera = Camera::orbit(Vec3::ZERO, 0.0, 0.0, 20.0);
        let at = |p: Vec3| {
            let clip = camera.clip_from_world(2.0) * p.extend(1.0);
            (0.5 * 400.0 * clip.y / clip.w, clip.z / clip.w)
        };
        let ((top, depth), (foot, _)) = (at(Vec3::Y), at(Vec3::ZERO));
        let [a, b] = camera.px_per_m(400);
        assert!((top - foot - (a + b * depth)).abs() < 1e-3);
    }

    #[test]
    fn straight_down_is_a_view_like_any_other() {
        let camera = Camera::orbit(Vec3::ZERO, 0.0, std::f32::consts::FRAC_PI_2, 10.0);
        let clip = camera.clip_from_world(1.0) * Vec4::new(1.0, 0.0, 0.0, 1.0);
        assert!(clip.x > 0.0 && clip.is_finite());
    }
}
