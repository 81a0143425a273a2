//! Where the pictures of a box stand: crossed along its axes, in slices, or along its diagonals (Lluch04 §4, fig. 3, 6, 7), metres.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;

use crate::choices;
use crate::geom::Bounds;
use crate::raster::View;
use crate::repr::card::window_around;

choices! {
    /// How the pictures of a box are arranged.
    pub enum Arrangement {
        /// Six pictures, one from each side, back to back on the three planes through its middle (fig. 3, 7b).
        Axes = "axes",
        /// Parallel slices along each of its three axes (fig. 7c).
        Volume = "volume",
        /// Six pictures, one on each plane through two opposite edges, seen from both sides (fig. 6, 7d).
        Diagonal = "diagonal",
    }
}

impl Arrangement {
    /// A picture is seen wholly from the second cosine of the angle to its normal on and not at all below the first. So edge-on lines do not
    /// show, and of every leaf about as much area is seen from everywhere as it has: of three crossed planes one from the front, at 0.577
    /// all three from a corner; of three pairs of diagonal ones two at 0.707.
    pub fn cosines(self) -> [f32; 2] {
        match self {
            Self::Axes => [0.3, 0.8],
            Self::Volume => [0.4, 0.75],
            Self::Diagonal => [0.2, 0.85],
        }
    }

    /// How many pictures a box has at most.
    pub fn pictures(self, slices: u32) -> u32 {
        match self {
            Self::Axes | Self::Diagonal => 6,
            Self::Volume => 3 * slices,
        }
    }

    /// Which of a box's planes show a leaf with that middle. All, but of every two that cross along an axis only the nearer one: else a crown
    /// would be twice as dense from everywhere, and leaves would stand far from where they are (ours).
    pub fn shows(self, planes: &[Plane], number: usize, middle: Vec3) -> bool {
        let away = |plane: &Plane| (plane.axes[2].dot(middle) - plane.at).abs();
        match self {
            Self::Axes | Self::Volume => true,
            Self::Diagonal => {
                let nearer = away(&planes[number & !1]) <= away(&planes[number | 1]);
                nearer == (number & 1 == 0)
            }
        }
    }
}

/// One picture of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Right, up and towards the viewer: unit vectors, right-handed.
    pub axes: [Vec3; 3],
    /// What is taken, in those axes.
    pub window: Bounds,
    /// Where the picture stands along the last axis.
    pub at: f32,
}

/// The pictures of a box, in an order that depends on the arrangement alone.
pub fn planes(bounds: Bounds, arrangement: Arrangement, slices: u32) -> Vec<Plane> {
    let size = bounds.size();
    let least = 0.5 * (Vec3::splat(1e-3 * size.max_element().max(1e-2)) - size).max(Vec3::ZERO);
    let bounds = Bounds { min: bounds.min - least, max: bounds.max + least };
    let all = |axes: [Vec3; 3]| {
        let window = window_around(corners(bounds), axes).expect("a box has corners");
        Plane { axes, window, at: window.center().z }
    };
    match arrangement {
        Arrangement::Axes => sides().map(all).to_vec(),
        Arrangement::Diagonal => diagonals(bounds.size()).map(all).to_vec(),
        Arrangement::Volume => {
            let [front, right, _, _, above, _] = sides();
            [front, right, above].into_iter().flat_map(|axes| sliced(all(axes), slices)).collect()
        }
    }
}

fn corners(bounds: Bounds) -> impl Iterator<Item = Vec3> {
    let ends = [bounds.min, bounds.max];
    (0..8usize).map(move |i| Vec3::new(ends[i & 1].x, ends[i >> 1 & 1].y, ends[i >> 2].z))
}

/// From the front, the right, behind, the left, above and below.
fn sides() -> [[Vec3; 3]; 6] {
    let round = |quarter: f32| View::axes_from(quarter * FRAC_PI_2, 0.0);
    [
        round(0.0),
        round(1.0),
        View::axes_from(PI, 0.0),
        round(3.0),
        View::axes_from(0.0, FRAC_PI_2),
        View::axes_from(0.0, -FRAC_PI_2),
    ]
}

/// Perpendicular to the planes through opposite edges: two that contain each of the upright, the right and the front axis.
fn diagonals(size: Vec3) -> [[Vec3; 3]; 6] {
    let upright = |z: f32| [Vec3::new(size.x, 0.0, z * size.z).normalize_or(Vec3::X), Vec3::Y];
    let leaning = |z: f32| [Vec3::X, Vec3::new(0.0, size.y, z * size.z).normalize_or(Vec3::Y)];
    let tilted = |x: f32| [Vec3::Z, Vec3::new(x * size.x, size.y, 0.0).normalize_or(Vec3::Y)];
    [upright(1.0), upright(-1.0), leaning(1.0), leaning(-1.0), tilted(1.0), tilted(-1.0)]
        .map(|[right, up]| [right, up, right.cross(up)])
}

/// The plane's slab in slices, from back to front.
fn sliced(plane: Plane, slices: u32) -> impl Iterator<Item = Plane> {
    let (low, thick) = (plane.window.min.z, plane.window.size().z / slices as f32);
    (0..slices).map(move |i| {
        let mut window = plane.window;
        (window.min.z, window.max.z) = (low + i as f32 * thick, low + (i + 1) as f32 * thick);
        Plane { window, at: window.center().z, ..plane }
    })
}
