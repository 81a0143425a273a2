//! The thesis's tables of costs, from what any built tree holds: against distance (table 2) and against the size of pictures (table 4).
//! They timed a graphics card of 2004; here is what its time went into.

use glam::Vec3;
use serde::Serialize;

use super::{GridSlices, HEIGHTS_PER_UNIT};
use crate::Result;
use crate::repr::{BuiltTree, Job, REFERENCE_FOCAL_PX, Representation, Stats};

/// The distances of table 2, in their units.
pub const TABLE_2_UNITS: [f32; 3] = [3.9, 5.6, 19.0];

/// The sizes of table 4, texels along a side.
pub const TABLE_4_PX: [u32; 5] = [1024, 512, 256, 128, 64];

/// What a tree costs at a distance.
#[derive(Debug, Clone, Serialize)]
pub struct DistanceRow {
    /// In their units.
    pub units: f32,
    /// In tree heights, as [`Seen`](crate::repr::Seen) has them.
    pub distance: f32,
    /// What is drawn.
    pub stats: Stats,
    /// Pixels of a picture of [`REFERENCE_FOCAL_PX`] that its polygons cover, one over the other, on the mean over all azimuths at the
    /// horizon: as often a texture is looked up, which was their bottleneck (§7.3.3).
    pub lookups: f64,
}

/// Table 2 of any built tree.
pub fn against_distance(built: &BuiltTree, units: &[f32]) -> Vec<DistanceRow> {
    let row = |&units: &f32| {
        let distance = units * HEIGHTS_PER_UNIT;
        DistanceRow { units, distance, stats: Stats::at(built, distance), lookups: lookups(built, distance) }
    };
    units.iter().map(row).collect()
}

/// Table 4: the tree of a job with pictures of each size, and all that it then holds.
///
/// # Errors
/// Those of [`Representation::build`].
pub fn against_size(job: &Job, sizes_px: &[u32]) -> Result<Vec<(u32, Stats)>> {
    let row = |&size_px: &u32| {
        let settings = job.settings.clone().with("size_px", size_px);
        let built = GridSlices.build(&Job { settings: &settings, ..*job })?;
        Ok((size_px, Stats::of_all(&built)))
    };
    sizes_px.iter().map(row).collect()
}

/// An upright polygon is seen under 2/π of its area on the mean, a level one not at all.
fn lookups(built: &BuiltTree, distance: f32) -> f64 {
    let pixels_per_m = f64::from(REFERENCE_FOCAL_PX / (distance.max(1e-3) * built.height_m()));
    let sides = built.parts_at(distance).filter(|part| part.seen.share_toward(Vec3::Z) > 0.0);
    let upright = |part: &crate::repr::BuiltPart| {
        let mesh = &part.part.surface.mesh;
        let area = |corners: [u32; 3]| {
            let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
            let normal = 0.5 * (b - a).cross(c - a);
            f64::from(normal.x.hypot(normal.z))
        };
        mesh.triangulated().map(area).sum::<f64>()
    };
    sides.map(upright).sum::<f64>() * std::f64::consts::FRAC_2_PI * pixels_per_m * pixels_per_m
}
