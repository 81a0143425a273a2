//! One tree alone, seen from a view: the same camera, window and light for the truth and for everything that is held against it.

use glam::Vec3;
use image::{RgbImage, RgbaImage, imageops};

use crate::Result;
use crate::geom::Bounds;
use crate::gpu::layout::Instance;
use crate::metrics::over;
use crate::render::{Background, Camera, Projection, Renderer, Shot, Stand, Tree};
use crate::repr::REFERENCE_FOCAL_PX;

use super::plan::{Sun, View};

/// Around the box of the true tree, a share of it.
const MARGIN: f32 = 0.1;

/// Backgrounds that pictures are compared over, sRGB: foliage is dark before the one and bright before the other.
pub const BACKGROUNDS: [[u8; 3]; 2] = [[226, 234, 242], [24, 28, 24]];

/// A tree on a stage of its own.
#[derive(Debug, Clone, Copy)]
pub struct Stage {
    /// The box around the true tree, metres.
    pub bounds: Bounds,
}

/// What was seen.
#[derive(Debug, Clone)]
pub struct Seen {
    /// sRGB, straight alpha: transparent where nothing is.
    pub color: RgbaImage,
    /// Distance from the viewer's plane, metres; infinite where nothing is.
    pub depth_m: Vec<f32>,
}

impl Seen {
    /// Over one of [`BACKGROUNDS`].
    pub fn over(&self, background: usize) -> RgbImage {
        over(&self.color, BACKGROUNDS[background])
    }
}

impl Stage {
    /// Height of the tree, metres.
    pub fn height_m(&self) -> f32 {
        self.bounds.height_m()
    }

    /// The camera that sees the tree `height_px` pixels high, and the side of its square picture: what the box around the tree needs, and
    /// `MARGIN`.
    pub fn camera(&self, view: View, height_px: f32) -> (Camera, u32) {
        let distance_m = self.height_m() * REFERENCE_FOCAL_PX / height_px;
        let orbit = Camera::orbit(self.bounds.center(), view.azimuth_deg.to_radians(), view.elevation_deg.to_radians(), distance_m);
        let [right, up, backward] = orbit.axes;
        // In pixels, from the middle; what is nearer looks larger.
        let reach = |p: Vec3| {
            let p = p - self.bounds.center();
            let focal_px = REFERENCE_FOCAL_PX / (distance_m - p.dot(backward)).max(0.1 * distance_m);
            focal_px * p.dot(right).abs().max(p.dot(up).abs())
        };
        let half_px = corners(self.bounds).into_iter().map(reach).fold(4.0, f32::max) * (1.0 + MARGIN);
        let side_px = (2.0 * half_px).ceil().clamp(16.0, 4096.0);
        let fov_y_rad = 2.0 * (0.5 * side_px / REFERENCE_FOCAL_PX).atan();
        let near_m = (0.02 * distance_m).min(0.1 * self.height_m());
        (Camera { projection: Projection::Perspective { fov_y_rad, near_m }, ..orbit }, side_px as u32)
    }

    /// The shot of a view; `level` draws the level of detail of that distance instead of the one that belongs there.
    pub fn shot(&self, view: View, height_px: f32, sun: Sun, level: Option<f32>) -> Shot {
        let (camera, side_px) = self.camera(view, height_px);
        let ((sa, ca), (se, ce)) = (sun.azimuth_deg.to_radians().sin_cos(), sun.elevation_deg.to_radians().sin_cos());
        Shot {
            background: Background::Alpha,
            toward_sun: Vec3::new(sa * ce, se, ca * ce),
            level_distance: level,
            ..Shot::new(camera, [side_px; 2])
        }
    }

    /// Takes a picture.
    ///
    /// # Errors
    /// Those of [`Renderer::picture`].
    pub fn see(&self, renderer: &mut Renderer, tree: &Tree, shot: &Shot) -> Result<Seen> {
        let picture = renderer.picture(shot, &[Stand { tree, instances: &[Instance::IDENTITY] }])?;
        Ok(Seen { color: picture.color, depth_m: picture.depth_m })
    }
}

/// A part of a picture around what is there in it, with [`MARGIN`] on all sides: x, y, width, height. The whole where nothing is.
pub fn window(truth: &Seen) -> [u32; 4] {
    let (width, height) = truth.color.dimensions();
    let there = truth.color.enumerate_pixels().filter(|(_, _, p)| p.0[3] > 0);
    let (mut low, mut high) = ([u32::MAX; 2], [0; 2]);
    for (x, y, _) in there {
        (low, high) = ([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]);
    }
    if low[0] > high[0] {
        return [0, 0, width, height];
    }
    let wide = |low: u32, high: u32, size: u32| {
        let margin = (MARGIN * (high - low + 1) as f32).ceil() as u32 + 1;
        (low.saturating_sub(margin), (high + 1 + margin).min(size))
    };
    let ((x0, x1), (y0, y1)) = (wide(low[0], high[0], width), wide(low[1], high[1], height));
    [x0, y0, x1 - x0, y1 - y0]
}

/// That part of a picture.
pub fn cropped(seen: &Seen, [x, y, width, height]: [u32; 4]) -> Seen {
    let color = imageops::crop_imm(&seen.color, x, y, width, height).to_image();
    let row = |row: u32| {
        let begin = ((y + row) * seen.color.width() + x) as usize;
        &seen.depth_m[begin..begin + width as usize]
    };
    let depth_m = (0..height).flat_map(row).copied().collect();
    Seen { color, depth_m }
}

fn corners(b: Bounds) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        let pick = |bit: usize, low, high| if i >> bit & 1 == 0 { low } else { high };
        Vec3::new(pick(0, b.min.x, b.max.x), pick(1, b.min.y, b.max.y), pick(2, b.min.z, b.max.z))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgba;

    #[test]
    fn a_tree_is_as_high_as_asked_and_in_the_picture_from_every_side() {
        let stage = Stage { bounds: Bounds { min: Vec3::new(-3.0, 0.0, -2.0), max: Vec3::new(4.0, 9.0, 2.5) } };
        for (azimuth_deg, elevation_deg) in [(0.0, 0.0), (55.0, 30.0), (200.0, 90.0)] {
            for height_px in [512.0, 64.0, 16.0] {
                let (camera, side_px) = stage.camera(View { azimuth_deg, elevation_deg }, height_px);
                let clip = camera.clip_from_world(1.0);
                for corner in corners(stage.bounds) {
                    let p = clip.project_point3(corner);
                    assert!(p.x.abs() < 1.0 && p.y.abs() < 1.0, "{azimuth_deg} {elevation_deg} {height_px}: {p}");
                }
                let middle = clip.project_point3(stage.bounds.center() + 0.5 * camera.axes[1] * 9.0);
                let seen_px = middle.y * side_px as f32;
                assert!((seen_px - height_px).abs() < 0.02 * height_px + 1.0, "{seen_px} {height_px}");
            }
        }
    }

    #[test]
    fn the_window_lies_round_what_is_there() {
        let mut color = RgbaImage::new(40, 30);
        (10..20).for_each(|x| (5..25).for_each(|y| color.put_pixel(x, y, Rgba([1, 2, 3, 255]))));
        let depth_m = (0..1200).map(|i| i as f32).collect();
        let seen = Seen { color, depth_m };
        assert_eq!(window(&seen), [8, 2, 14, 26]);
        let part = cropped(&seen, [8, 2, 14, 26]);
        assert_eq!((part.depth_m[0], part.depth_m[14], part.depth_m.len()), (88.0, 128.0, 14 * 26));
        assert_eq!(window(&Seen { color: RgbaImage::new(4, 3), depth_m: vec![] }), [0, 0, 4, 3]);
    }
}
