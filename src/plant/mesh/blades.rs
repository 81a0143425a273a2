//! Blades and petals that an L-system draws by outline, between `{` and `}` (Prusinkiewicz & Lindenmayer 1990, §5.1), metres.

use glam::Vec3;

use crate::geom::Surface;
use crate::plant::{Polygon, Skeleton};

/// All polygons of a skeleton, each as a fan of triangles round its first corner, where outlines of leaves have their foot. Corners that
/// are not finite or enclose nothing are left out.
pub fn blades(skeleton: &Skeleton) -> Surface {
    let mut surface = Surface::default();
    for polygon in &skeleton.polygons {
        let normal = area_normal(polygon);
        if !(normal.is_finite() && normal.length_squared() > 0.0) {
            continue;
        }
        let first = surface.mesh.positions.len() as u32;
        surface.mesh.positions.extend(&polygon.corners);
        surface.normals.extend(polygon.corners.iter().map(|_| normal.normalize_or(Vec3::Y)));
        surface.mesh.triangles.extend((1..polygon.corners.len() as u32 - 1).map(|i| [first, first + i, first + i + 1]));
    }
    surface
}

/// Normal to the outline, twice its area long; NaN with a corner that is not finite.
fn area_normal(polygon: &Polygon) -> Vec3 {
    let Some((foot, rest)) = polygon.corners.split_first() else { return Vec3::ZERO };
    rest.windows(2).map(|pair| (pair[0] - *foot).cross(pair[1] - *foot)).sum()
}
