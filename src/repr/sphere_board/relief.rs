//! Surfaces that lie where the leaves are that a view shows, on average: what stands for a heap of leaves from one side stays right when it
//! is looked at somewhat from aside. Metres, texels of the view.

use glam::{Vec2, Vec3, Vec4};

use crate::geom::{PolyMesh, Surface};
use crate::raster::{self, Layer, View};

/// Where in depth lies what a view shows.
pub(super) struct Relief<'a> {
    view: &'a View,
    /// Metres towards the viewer from the view's middle, smoothed and everywhere.
    depth: Layer,
}

/// Half the width of what is averaged of depths, texels.
const SMOOTHED: usize = 4;

/// Cosines to the viewer between which a side of the surface begins to be moved and is moved all the way. The rim, which is seen edge-on, is
/// moved with what it bounds: left where it is, it would be as large as it is near.
const TURNED: [f32; 2] = [-0.4, 0.0];
/// Weight from which on a depth is known well enough not to be filled in from around.
const KNOWN: f32 = 0.05;
/// And under which nothing is known.
const LEFT_BEHIND: f32 = 1e-4;

impl<'a> Relief<'a> {
    pub(super) fn of(view: &'a View, taken: &'a raster::Capture) -> Self {
        let width = view.width_px as usize;
        let seen = Layer::from_fn(width, view.height_px as usize, |x, y| {
            let at = y * width + x;
            let (depth, covered) = (taken.depth_m[at], f32::from(taken.coverage.as_raw()[at]) / 255.0);
            if depth.is_finite() { Vec4::new(covered * depth, 0.0, 0.0, covered) } else { Vec4::ZERO }
        });
        let mut depth = seen.low_pass(SMOOTHED);
        // Where nothing is, sums that run along rows leave a little behind.
        let known = |t: Vec4| if t.w < LEFT_BEHIND { Vec4::ZERO } else { Vec4::new(t.x / t.w, 0.0, 0.0, (t.w / KNOWN).min(1.0)) };
        depth.texels.iter_mut().for_each(|t| *t = known(*t));
        depth.bleed();
        Self { view, depth }
    }

    /// The surface with the side that the viewer sees brought to where the leaves are that he sees: nothing moves in the picture, but seen
    /// somewhat from aside leaves stay together. Which side that is say its normals, which are to be as smooth as the movement. What
    /// stands out beyond the picture is drawn in to its border: the picture's smaller sizes are not empty there, and would go on beyond.
    pub(super) fn raised(&self, surface: &Surface) -> PolyMesh {
        let View { axes: [right, up, toward], center, half_size_m, width_px, height_px, .. } = *self.view;
        let moved = |(p, n): (&Vec3, &Vec3)| {
            let faces = ((n.dot(toward) - TURNED[0]) / (TURNED[1] - TURNED[0])).clamp(0.0, 1.0);
            let aside = *p - center;
            let at = Vec2::new(aside.dot(right), aside.dot(up)).clamp(-half_size_m, half_size_m);
            let x = (0.5 + 0.5 * at.x / half_size_m.x) * width_px as f32;
            let y = (0.5 - 0.5 * at.y / half_size_m.y) * height_px as f32;
            let seen = self.depth.bilinear(x.clamp(0.5, width_px as f32 - 0.5), y.clamp(0.5, height_px as f32 - 0.5)).x;
            let own = aside.dot(toward);
            center + at.x * right + at.y * up + (own + faces * (seen - own)) * toward
        };
        let mesh = &surface.mesh;
        PolyMesh { positions: mesh.positions.iter().zip(&surface.normals).map(moved).collect(), ..mesh.clone() }
    }
}
