//! What a stand-in costs at a distance: counted from its data, timed on the device.

use std::time::{Duration, Instant};

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::Result;
use crate::gpu::layout::Instance;
use crate::render::{Background, Camera, Projection, Renderer, Shot, Stand, Tree};
use crate::repr::{BuiltTree, Drawn, REFERENCE_FOCAL_PX, Stats};

use super::plan::View;
use super::staging::{Seen, Stage};

/// What one method costs at one distance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Triangles of one instance.
    pub triangles: usize,
    /// Draw calls of any number of instances.
    pub draw_calls: usize,
    /// Pictures on the device with all their smaller sizes; what is seen at that distance.
    pub texture_bytes: usize,
    /// Vertices and corners of triangles on the device; what is seen at that distance.
    pub geometry_bytes: usize,
    /// Milliseconds of the device for one instance, median of frames.
    pub ms: f64,
    /// 95 % of the frames took this or less, per instance.
    pub ms_p95: f64,
    /// How many frames were timed; of fewer than three the 95 % say nothing.
    pub frames: usize,
    /// How many instances were in a frame.
    pub instances: usize,
    /// Area of all triangles as seen, over the area covered: how often a pixel is shaded at most.
    pub overdraw: f64,
}

/// Side of the timed picture, pixels.
const SIDE_PX: u32 = 768;
/// From where trees are timed.
const TIMED_FROM: View = View { azimuth_deg: 10.0, elevation_deg: 15.0 };
/// Frames at most; at least one after the first, which does not count.
const MOST_FRAMES: usize = 200;
/// Triangles of a timed frame at most: a full tree would fill a far picture with a thousand million.
const MOST_TRIANGLES: usize = 200_000;

impl Cost {
    /// Counts and times a tree `height_px` pixels high, for about `budget`.
    ///
    /// # Errors
    /// Those of [`Renderer::timed`].
    pub fn measure(
        renderer: &mut Renderer,
        stage: &Stage,
        (built, tree): (&BuiltTree, &Tree),
        height_px: f32,
        level: Option<f32>,
        budget: Duration,
    ) -> Result<Self> {
        let distance = level.unwrap_or(REFERENCE_FOCAL_PX / height_px);
        let stats = Stats::at(built, distance);
        let shot = Shot { level_distance: level, ..timed_shot(stage, height_px) };
        let most = (MOST_TRIANGLES / stats.triangles.max(1)).max(1);
        let instances = rows(stage, &shot.camera, height_px, most);
        let mut frames: Vec<f64> = vec![];
        let begun = Instant::now();
        while frames.len() < 2 || begun.elapsed() < budget && frames.len() < MOST_FRAMES {
            let passes = renderer.timed(&shot, &[Stand { tree, instances: &instances }])?;
            frames.push(passes.iter().filter(|(pass, _)| TREE_PASSES.contains(pass)).map(|(_, ms)| ms).sum());
        }
        frames.remove(0);
        frames.sort_by(f64::total_cmp);
        let per_instance = |frame: f64| frame / instances.len() as f64;
        Ok(Self {
            triangles: stats.triangles,
            draw_calls: stats.draw_calls,
            texture_bytes: stats.texture_bytes,
            geometry_bytes: stats.geometry_bytes,
            ms: per_instance(frames[frames.len() / 2]),
            ms_p95: per_instance(frames[(frames.len() * 95).div_ceil(100) - 1]),
            frames: frames.len(),
            instances: instances.len(),
            overdraw: 0.0,
        })
    }
}

/// Area of all triangles over the area covered, of a picture in which the tree was `seen`.
pub(super) fn overdraw(built: &BuiltTree, distance: f32, camera: &Camera, side_px: u32, seen: &Seen) -> f64 {
    let covered_px: f64 = seen.color.pixels().map(|p| f64::from(p.0[3]) / 255.0).sum();
    let shaded_px = projected_px(built, distance, camera, side_px);
    if covered_px > 0.0 { shaded_px / covered_px } else { 0.0 }
}

/// Passes whose time trees are to blame for; backdrop and composite cost what they cost without any.
pub(super) const TREE_PASSES: [&str; 3] = ["shadow map", "trees", "growth"];

fn timed_shot(stage: &Stage, height_px: f32) -> Shot {
    let (camera, _) = stage.camera(TIMED_FROM, height_px);
    let fov_y_rad = 2.0 * (0.5 * SIDE_PX as f32 / REFERENCE_FOCAL_PX).atan();
    let near_m = match camera.projection {
        Projection::Perspective { near_m, .. } | Projection::Orthographic { near_m, .. } => near_m,
    };
    let camera = Camera { projection: Projection::Perspective { fov_y_rad, near_m }, ..camera };
    Shot { background: Background::Black, ..Shot::new(camera, [SIDE_PX; 2]) }
}

/// As many trees as find room side by side, `most` at most, all at the distance of the one in the middle.
fn rows(stage: &Stage, camera: &Camera, height_px: f32, most: usize) -> Vec<Instance> {
    let size = stage.bounds.size();
    let [right, up, _] = camera.axes;
    let step = Vec3::new(size.x.max(size.z), size.y, 0.0).max(Vec3::splat(1e-2)) * 1.05;
    let m_per_px = stage.height_m() / height_px;
    let room = |step_m: f32| ((SIDE_PX as f32 * m_per_px / step_m).floor() as usize).clamp(1, 64);
    let (mut columns, mut rows) = (room(step.x), room(step.y));
    while columns * rows > most {
        if columns > rows { columns -= 1 } else { rows -= 1 }
    }
    let middle = |count: usize, i: usize| i as f32 - 0.5 * count.saturating_sub(1) as f32;
    let place = |i: usize| {
        let at = middle(columns, i % columns) * step.x * right + middle(rows, i / columns) * step.y * up;
        Instance { position: at.to_array(), id: i as u32, ..Instance::IDENTITY }
    };
    (0..columns * rows).map(place).collect()
}

/// Pixels that all triangles of what is seen at a distance cover together, each counted as often as triangles lie over it. Cards that turn
/// are taken as they face the viewer.
fn projected_px(built: &BuiltTree, distance: f32, camera: &Camera, side_px: u32) -> f64 {
    let clip = camera.clip_from_world(1.0);
    let half = 0.5 * side_px as f32;
    let mut sum = 0.0;
    for part in built.parts_at(distance) {
        let surface = &part.part.surface;
        let pivot = match part.drawn {
            Drawn::Turned { pivot, .. } => Some(pivot),
            _ => None,
        };
        let place = |v: u32| {
            let p = surface.mesh.positions[v as usize];
            let p = pivot.map_or(p, |pivot| {
                let [right, up, backward] = camera.axes;
                let d = p - pivot;
                pivot + d.x * right + d.y * up + d.z * backward
            });
            (clip.project_point3(p) * half).truncate()
        };
        for triangle in surface.mesh.triangulated() {
            let [a, b, c] = triangle.map(place);
            let area = 0.5 * (b - a).perp_dot(c - a);
            if area.is_finite() && (area > 0.0 || part.part.material.two_sided) {
                sum += f64::from(area.abs());
            }
        }
    }
    sum
}
