//! How much of the sky a place in the crown sees: which leaves stand in the sun and which in the shade. Metres.
//!
//! Ours: rays to the sky are marched through a grid that counts leaf area, and weaken as light does in foliage (Beer-Lambert).

use glam::{IVec3, Vec3};

use crate::geom::Bounds;

/// Cells along the longest side of the crown.
const CELLS: f32 = 40.0;

/// Part of the light that a leaf area as large as the cell's face takes away (leaves stand at all angles).
const EXTINCTION: f32 = 0.5;

/// Directions to the sky: the zenith, and eight round it, all about as bright.
const SKY: [Vec3; 9] = [
    Vec3::new(0.0, 1.0, 0.0),
    Vec3::new(0.75, 0.66, 0.0),
    Vec3::new(-0.75, 0.66, 0.0),
    Vec3::new(0.0, 0.66, 0.75),
    Vec3::new(0.0, 0.66, -0.75),
    Vec3::new(0.66, 0.35, 0.66),
    Vec3::new(-0.66, 0.35, 0.66),
    Vec3::new(0.66, 0.35, -0.66),
    Vec3::new(-0.66, 0.35, -0.66),
];

/// Leaf area per cell, as optical depth.
pub struct Shade {
    low: Vec3,
    cell_m: f32,
    size: IVec3,
    depth: Vec<f32>,
}

impl Shade {
    /// The shade that leaves of these places and areas (m²) cast. `None` without leaves.
    pub fn of(leaves: &[(Vec3, f32)]) -> Option<Self> {
        let bounds = Bounds::of(leaves.iter().map(|(at, _)| *at))?;
        let cell_m = (bounds.size().max_element() / CELLS).max(1e-3);
        let size = (bounds.size() / cell_m).floor().as_ivec3() + 1;
        let mut shade = Self { low: bounds.min, cell_m, size, depth: vec![0.0; (size.x * size.y * size.z) as usize] };
        for (at, area) in leaves {
            if let Some(cell) = shade.cell(*at) {
                shade.depth[cell] += EXTINCTION * area / (cell_m * cell_m);
            }
        }
        Some(shade)
    }

    /// Part of the sky's light that reaches a place, 0 to 1.
    pub fn light(&self, at: Vec3) -> f32 {
        let through = |toward: &Vec3| {
            let mut depth = 0.0;
            // From the next cell on: what a leaf's own cell holds is as much before it as behind it.
            let mut place = at + self.cell_m * *toward;
            while let Some(cell) = self.cell(place) {
                depth += self.depth[cell];
                place += self.cell_m * *toward;
            }
            (-depth).exp()
        };
        SKY.iter().map(through).sum::<f32>() / SKY.len() as f32
    }

    fn cell(&self, at: Vec3) -> Option<usize> {
        let c = ((at - self.low) / self.cell_m).floor().as_ivec3();
        let inside = c.cmpge(IVec3::ZERO).all() && c.cmplt(self.size).all();
        inside.then(|| ((c.y * self.size.z + c.z) * self.size.x + c.x) as usize)
    }
}
