//! Where the photographer stands: as near as the whole tree still fits.

use glam::Vec3;

use super::Sitting;
use crate::geom::Bounds;
use crate::render::{Camera, Projection};
use crate::{Error, Result};

/// Half the diagonal of film of 36×24 mm.
const HALF_DIAGONAL_MM: f32 = 21.633;

/// Halvings of the distance's logarithm: enough for a millimetre in a kilometre.
const HALVINGS: u32 = 32;

/// The nearest camera, on the side that was asked for, whose picture holds all of `points` with the margin that was asked for. It points at
/// the middle of what it sees of the tree's height, and level across.
///
/// # Errors
/// [`Error::BelowGround`] when the elevation asked for lies below the lawn.
pub fn camera(points: &[Vec3], bounds: Bounds, sitting: &Sitting) -> Result<Camera> {
    let [width, height] = sitting.size_px.map(|side| side.max(1) as f32);
    let half_height_slope = HALF_DIAGONAL_MM / sitting.params.lens_mm as f32 * height / width.hypot(height);
    let slopes = [half_height_slope * width / height, half_height_slope].map(|slope| slope * sitting.params.fill as f32);
    let fits = |distance_m: f32| {
        let camera = standing(bounds, points, sitting, distance_m, half_height_slope);
        let [right, up, backward] = camera.axes;
        points.iter().all(|&p| {
            let p = p - camera.eye;
            let before = -p.dot(backward);
            before > 0.0 && p.dot(right).abs() <= before * slopes[0] && p.dot(up).abs() <= before * slopes[1]
        })
    };
    let size = bounds.size().length().max(0.01);
    let (mut near, mut far) = ((0.1 * size).ln(), (2000.0 * size).ln());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (near + far);
        if fits(middle.exp()) { far = middle } else { near = middle }
    }
    let camera = standing(bounds, points, sitting, far.exp(), half_height_slope);
    match sitting.elevation_rad {
        Some(elevation) if camera.eye.y <= 0.05 => {
            Err(Error::BelowGround { elevation_deg: elevation.to_degrees(), eye_m: camera.eye.y, distance_m: far.exp() })
        }
        _ => Ok(camera),
    }
}

/// The camera at that distance from the tree's axis.
fn standing(bounds: Bounds, points: &[Vec3], sitting: &Sitting, distance_m: f32, half_height_slope: f32) -> Camera {
    let (sa, ca) = sitting.azimuth_rad.sin_cos();
    let (away, right) = (Vec3::new(sa, 0.0, ca), Vec3::new(ca, 0.0, -sa));
    let middle_m = bounds.center().y;
    let axis = Vec3::new(bounds.center().x, 0.0, bounds.center().z);
    let eye = match sitting.elevation_rad {
        Some(elevation) => axis + distance_m * elevation.cos() * away + (middle_m + distance_m * elevation.sin()) * Vec3::Y,
        None => axis + distance_m * away + sitting.params.eye_m as f32 * Vec3::Y,
    };
    let heights = points.iter().map(|&p| {
        let p = p - eye;
        p.y.atan2((-p.dot(away)).max(1e-3))
    });
    let (low, high) = heights.fold((f32::MAX, f32::MIN), |(low, high), angle| (low.min(angle), high.max(angle)));
    let (sin, cos) = (0.5 * (low + high)).sin_cos();
    let backward = cos * away - sin * Vec3::Y;
    let near_m = (0.02 * distance_m).clamp(0.01, 0.5);
    let projection = Projection::Perspective { fov_y_rad: 2.0 * half_height_slope.atan(), near_m };
    Camera { eye, axes: [right, backward.cross(right), backward], projection }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::studio::StudioParams;

    fn box_of(size: Vec3) -> (Vec<Vec3>, Bounds) {
        let corners = (0..8).map(|i| {
            let side = |bit: u32| if i & bit == 0 { 0.0 } else { 1.0 };
            Vec3::new(side(1) - 0.5, side(2), side(4) - 0.5) * size
        });
        let points: Vec<Vec3> = corners.collect();
        let bounds = Bounds::of(points.iter().copied()).expect("eight corners");
        (points, bounds)
    }

    #[test]
    fn the_tree_fills_as_much_of_the_picture_as_was_asked() {
        for (size, lens_mm) in [(Vec3::new(4.0, 16.0, 4.0), 35.0), (Vec3::new(30.0, 5.0, 8.0), 120.0)] {
            for elevation_rad in [None, Some(0.4)] {
                let params = StudioParams { lens_mm, ..StudioParams::default() };
                let sitting = Sitting { azimuth_rad: 0.7, elevation_rad, params, ..Sitting::default() };
                let (points, bounds) = box_of(size);
                let camera = camera(&points, bounds, &sitting).expect("above the ground");
                let clip = camera.clip_from_world(1000.0 / 1300.0);
                let largest = points.iter().map(|&p| clip.project_point3(p).truncate().abs().max_element()).fold(0.0, f32::max);
                assert!((largest - 0.84).abs() < 2e-3, "{size} {lens_mm} {elevation_rad:?}: {largest}");
                assert!(elevation_rad.is_some() || (camera.eye.y - 1.6).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_longer_lens_stands_farther_off_and_sees_the_35_mm_angle() {
        let (points, bounds) = box_of(Vec3::new(4.0, 10.0, 4.0));
        let at = |lens_mm, size_px| {
            let params = StudioParams { lens_mm, ..StudioParams::default() };
            camera(&points, bounds, &Sitting { params, size_px, ..Sitting::default() }).expect("on the ground")
        };
        assert!(at(200.0, [600, 800]).eye.length() > 3.0 * at(50.0, [600, 800]).eye.length());
        // 50 mm on 36×24 mm: 2 · atan(12 / 50) from bottom to top.
        let Projection::Perspective { fov_y_rad, .. } = at(50.0, [3600, 2400]).projection else { panic!("a perspective") };
        assert!((fov_y_rad - 2.0 * (12.0f32 / 50.0).atan()).abs() < 1e-4);
    }

    #[test]
    fn a_camera_below_the_lawn_is_refused() {
        let (points, bounds) = box_of(Vec3::new(4.0, 10.0, 4.0));
        let refused =
            camera(&points, bounds, &Sitting { elevation_rad: Some(-0.6), ..Sitting::default() }).unwrap_err().to_string();
        assert!(refused.contains("--elevation-deg") && refused.contains("below the ground"), "{refused}");
    }
}
