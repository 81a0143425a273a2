//! The crown keeps its cover (issue "Geometric multiresolution"), on a real preset, as it is seen with its picture's holes.

use std::f32::consts::FRAC_PI_4;

use glam::Vec3;

use super::LeafForest;
use crate::Seed;
use crate::geom::Bounds;
use crate::model::Part;
use crate::model::reference::Asked;
use crate::raster::View;
use crate::repr::{Capture, Scope, SoftwareCapture, TreeSource};

/// What is covered from eight sides.
fn covered(part: &Part, around: Bounds) -> Vec<f64> {
    let reach = 0.5 * around.size().length();
    let view = |side: u8| {
        let axes = View::axes_from(f32::from(side) * FRAC_PI_4, 0.0);
        let middle = Vec3::from(axes.map(|axis| axis.dot(around.center())));
        View::of_window(axes, Bounds { min: middle - reach, max: middle + reach }, 400, 400)
    };
    let views: Vec<View> = (0..8).map(view).collect();
    let taken = SoftwareCapture::new().take(&[part], &views).unwrap();
    taken.iter().map(|taken| taken.coverage.as_raw().iter().map(|a| f64::from(*a)).sum()).collect()
}

#[test]
fn half_the_leaves_cover_as_much_from_eight_sides() {
    let (source, _) = TreeSource::open("oak", &Asked::default(), Seed(1)).unwrap();
    let part = source.parts(Scope::Foliage)[0];
    let leaves = part.surface.mesh.polygon_count();
    let mut forest = LeafForest::of(&part.surface, leaves.div_ceil(72));
    let around = part.surface.mesh.bounds().unwrap();
    let all = covered(part, around);
    for (share, within) in [(0.5, 0.05), (0.1, 0.15)] {
        forest.detail = super::Detail { near: 0.0, far: 1.0, least: share, ..forest.detail };
        let half = Part { surface: forest.surface_at(&part.surface, 2.0), ..part.clone() };
        half.check().unwrap();
        assert_eq!(half.surface.mesh.polygon_count(), leaves - ((1.0 - share) * leaves as f32) as usize);
        for (half, all) in covered(&half, around).iter().zip(&all) {
            assert!((half / all - 1.0).abs() <= within, "{} of the cover at {share} of the leaves", half / all);
        }
    }
}
