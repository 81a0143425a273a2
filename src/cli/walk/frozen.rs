//! The edges of what a frozen camera sees, drawn over the picture that looks at it from outside (Truelsen fig. 27).

use glam::{Mat4, Vec2, Vec3, Vec4};

use crate::render::{Camera, Shot};

/// The edges as lines over the picture, pixels from its top left corner: from the frozen eye to `far_m`, and the border of what is seen there.
pub fn strokes(frozen: &Camera, far_m: f32, shot: &Shot) -> Vec<[Vec2; 2]> {
    let [width, height] = shot.size_px.map(|side| side as f32);
    let aspect = width / height;
    let clip_from_world = shot.camera.clip_from_world(aspect);
    let corners = corners(frozen, far_m, aspect);
    let edges = (0..4).flat_map(|i| [[frozen.eye, corners[i]], [corners[i], corners[(i + 1) % 4]]]);
    let to_px = |clip: Vec4| 0.5 * Vec2::new(width * (1.0 + clip.x / clip.w), height * (1.0 - clip.y / clip.w));
    edges.filter_map(|edge| visible(edge, &clip_from_world)).map(|ends| ends.map(to_px)).collect()
}

/// What the corners of the picture show at that distance, one after the other.
fn corners(camera: &Camera, far_m: f32, aspect: f32) -> [Vec3; 4] {
    let world_from_clip = camera.clip_from_world(aspect).inverse();
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| {
        let at = world_from_clip.project_point3(Vec3::new(x, y, 1.0)) - camera.eye;
        camera.eye + far_m / at.dot(-camera.axes[2]) * at
    })
}

/// The part of a line that is in the picture, clip space.
fn visible(edge: [Vec3; 2], clip_from_world: &Mat4) -> Option<[Vec4; 2]> {
    let [a, b] = edge.map(|at| *clip_from_world * at.extend(1.0));
    let (mut first, mut last) = (0.0f32, 1.0f32);
    // Each is positive inside; depth is reversed, and there is no far plane.
    for inside in [|p: Vec4| p.w - p.z, |p: Vec4| p.w + p.x, |p: Vec4| p.w - p.x, |p: Vec4| p.w + p.y, |p: Vec4| p.w - p.y] {
        let (at_a, at_b) = (inside(a), inside(b));
        match (at_a >= 0.0, at_b >= 0.0) {
            (true, true) => {}
            (false, false) => return None,
            (true, false) => last = last.min(at_a / (at_a - at_b)),
            (false, true) => first = first.max(at_a / (at_a - at_b)),
        }
    }
    (first < last).then(|| [a.lerp(b, first), a.lerp(b, last)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_where_it_stands_the_edges_are_the_border_and_from_aside_they_start_at_its_eye() {
        let frozen = Camera::looking(Vec3::new(0.0, 5.0, 0.0), Vec3::new(0.0, 5.0, -50.0), 0.8);
        // A wider lens sees the border of the other's picture, all edges within.
        let wide = Shot::new(Camera::looking(Vec3::new(0.0, 5.0, 1.0), Vec3::new(0.0, 5.0, -50.0), 1.2), [320, 180]);
        let lines = strokes(&frozen, 100.0, &wide);
        assert_eq!(lines.len(), 8);
        assert!(lines.iter().flatten().all(|p| p.x >= 0.0 && p.x <= 320.0 && p.y >= 0.0 && p.y <= 180.0));
        // From the right, its eye is left of the middle of what it sees.
        let aside = Shot::new(Camera::looking(Vec3::new(400.0, 5.0, -50.0), Vec3::new(0.0, 5.0, -50.0), 0.8), [320, 180]);
        let lines = strokes(&frozen, 100.0, &aside);
        let from_eye: Vec<_> = lines.iter().step_by(2).map(|line| line[0]).collect();
        assert!(from_eye.iter().all(|p| p.distance(from_eye[0]) < 1e-2 && (p.y - 90.0).abs() < 1e-2), "{from_eye:?}");
        // Behind the viewer nothing is drawn.
        let away = Shot::new(Camera::looking(Vec3::new(400.0, 5.0, -50.0), Vec3::new(900.0, 5.0, -50.0), 0.8), [320, 180]);
        assert_eq!(strokes(&frozen, 100.0, &away), Vec::<[Vec2; 2]>::new());
    }
}
