//! Where the foliage is along one direction, and where slices of it should stand (ours, for Truelsen §9.2: "a more adaptive slicing
//! scheme, for improving the billboard distribution to fit the geometric object"). Metres.

use glam::Vec3;

use crate::geom::Bounds;
use crate::model::Part;

/// How often planes are moved to the middle of what is nearest to them.
const ROUNDS: usize = 48;

/// Foliage along a direction: how much of its area lies how deep.
pub struct Depths {
    /// Depth of every triangle's middle, rising.
    depths: Vec<f32>,
    /// Area, and area times depth, of all triangles before each.
    sums: Vec<(f64, f64)>,
}

impl Depths {
    /// Of all triangles of `parts`, along the unit vector `toward`.
    pub fn of(parts: &[&Part], toward: Vec3) -> Self {
        let mut triangles: Vec<(f32, f64)> = vec![];
        for mesh in parts.iter().map(|part| &part.surface.mesh) {
            triangles.extend(mesh.triangulated().map(|corners| {
                let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
                (toward.dot(a + b + c) / 3.0, f64::from(0.5 * (b - a).cross(c - a).length()))
            }));
        }
        triangles.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut sum = (0.0, 0.0);
        let mut sums = vec![sum];
        for (depth, area) in &triangles {
            sum = (sum.0 + area, sum.1 + area * f64::from(*depth));
            sums.push(sum);
        }
        Self { depths: triangles.into_iter().map(|t| t.0).collect(), sums }
    }

    /// The mean depth of what lies between two depths; `None` where nothing does.
    pub fn mean(&self, [from, to]: [f32; 2]) -> Option<f32> {
        let at = |depth: f32| self.sums[self.depths.partition_point(|d| *d < depth)];
        let (low, high) = (at(from), at(to));
        let area = high.0 - low.0;
        (area > 0.0).then(|| ((high.1 - low.1) / area) as f32)
    }

    /// Moves rising `planes`, all but number `fixed`, to where the foliage next to them is, so that it is shown as near as can be to where
    /// it is: the sum of its squared distances from its planes falls in every round (Lloyd 1982, "Least squares quantization in PCM").
    /// A plane with no foliage next to it stays.
    pub fn settle(&self, planes: &mut [f32], fixed: usize) {
        for _ in 0..ROUNDS {
            let edges = edges(planes, f32::MIN, f32::MAX);
            for (i, plane) in planes.iter_mut().enumerate().filter(|(i, _)| *i != fixed) {
                *plane = self.mean(edges[i]).unwrap_or(*plane);
            }
        }
    }
}

/// The slab of each of rising `planes`: half-way to its neighbours, and at the ends to `low` and `high`.
pub fn edges(planes: &[f32], low: f32, high: f32) -> Vec<[f32; 2]> {
    let between = |i: usize| 0.5 * (planes[i] + planes[i + 1]);
    let last = planes.len().saturating_sub(1);
    let slab = |i: usize| [if i == 0 { low } else { between(i - 1) }, if i == last { high } else { between(i) }];
    (0..planes.len()).map(slab).collect()
}

/// The box in `axes` around all polygons of `parts` that reach into a slab of the last axis, cut to it; `None` where none does.
pub fn window_of(parts: &[&Part], axes: [Vec3; 3], slab: [f32; 2]) -> Option<Bounds> {
    let mut window: Option<Bounds> = None;
    for mesh in parts.iter().map(|part| &part.surface.mesh) {
        for polygon in mesh.polygons() {
            let corners = || polygon.iter().map(|v| Vec3::from(axes.map(|axis| axis.dot(mesh.positions[*v as usize]))));
            let Some(around) = Bounds::of(corners()) else { continue };
            if around.max.z >= slab[0] && around.min.z <= slab[1] {
                window = Bounds::of(window.into_iter().flat_map(|w| [w.min, w.max]).chain([around.min, around.max]));
            }
        }
    }
    window.map(|w| Bounds { min: w.min.truncate().extend(slab[0]), max: w.max.truncate().extend(slab[1]) })
}
