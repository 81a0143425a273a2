//! Ground as heights over a regular grid, metres. What it answers is what is drawn: every cell is two triangles split from its
//! south-west to its north-east corner, and heights between the points lie on them. North is -Z, east is +X.

use glam::Vec3;

use super::Bounds;
use crate::{Error, Result};

/// Points that a side may have: 16.7 million points are 64 MB of heights, and about 0.8 GB as a mesh.
pub const MOST_POINTS: u32 = 4096;

/// How far from the origin ground may lie or rise, metres: farther off, 32-bit positions are coarser than a twig.
pub const FARTHEST_M: f32 = 1e6;

/// A regular grid of heights, row by row from the north-west corner.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    /// Points from west to east.
    pub columns: u32,
    /// Points from north to south.
    pub rows: u32,
    /// Distance between neighbouring points, metres.
    pub step_m: f32,
    /// X of the first column, metres.
    pub west_m: f32,
    /// Z of the first row, metres; rows go towards +Z.
    pub north_m: f32,
    /// Heights of the points, row by row, metres.
    pub heights_m: Vec<f32>,
}

/// A surface ready for the device.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundMesh {
    /// One point per height, row by row, metres.
    pub positions: Vec<Vec3>,
    /// Unit normals, smooth over neighbouring cells.
    pub normals: Vec<Vec3>,
    /// Three to a triangle, counter-clockwise seen from above, row by row of cells.
    pub indices: Vec<u32>,
}

impl HeightField {
    /// A grid whose first point lies at (`west_m`, `north_m`).
    ///
    /// # Errors
    /// [`Error::Ground`]: fewer than 2 × 2 or more than [`MOST_POINTS`] points a side, a number of heights that is not theirs, a step
    /// outside 1 mm to 10 km, anything that is not finite or farther away than [`FARTHEST_M`].
    pub fn new(columns: u32, rows: u32, step_m: f32, west_m: f32, north_m: f32, heights_m: Vec<f32>) -> Result<Self> {
        let refuse = |expected: String, found: String, remedy: &'static str| Err(Error::Ground { expected, found, remedy });
        if ![columns, rows].iter().all(|side| (2..=MOST_POINTS).contains(side)) {
            let expected = format!("ground of 2 to {MOST_POINTS} points a side");
            return refuse(expected, format!("{columns} × {rows}"), "resample the height map");
        }
        if heights_m.len() != columns as usize * rows as usize {
            let expected = format!("{columns} × {rows} heights");
            return refuse(expected, format!("{} of them", heights_m.len()), "give one for each point");
        }
        if !(1e-3..=1e4).contains(&step_m) {
            let expected = "points 0.001 to 10000 m apart".to_owned();
            return refuse(expected, format!("{step_m} m"), "correct the size of the ground");
        }
        let (east_m, south_m) = (west_m + (columns - 1) as f32 * step_m, north_m + (rows - 1) as f32 * step_m);
        let mut all = [west_m, north_m, east_m, south_m].into_iter().chain(heights_m.iter().copied());
        if let Some(far) = all.find(|v| !(v.abs() <= FARTHEST_M)) {
            let expected = format!("ground within {FARTHEST_M} m of the origin");
            return refuse(expected, format!("{far}"), "fill in missing heights, or move the origin nearer");
        }
        Ok(Self { columns, rows, step_m, west_m, north_m, heights_m })
    }

    /// Level ground of `side_m` × `side_m` around the origin, two triangles.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn flat(side_m: f32) -> Result<Self> {
        Self::new(2, 2, side_m, -0.5 * side_m, -0.5 * side_m, vec![0.0; 4])
    }

    /// Height on the drawn triangles, metres; `None` off the ground and for what is no number.
    pub fn height_at(&self, x: f32, z: f32) -> Option<f32> {
        let ([nw, ne, sw, se], u, v) = self.cell(x, z)?;
        // The corner that the triangle's two legs meet in, so that the points themselves come out exact.
        Some(if u + v <= 1.0 { nw + u * (ne - nw) + v * (sw - nw) } else { se + (1.0 - u) * (sw - se) + (1.0 - v) * (ne - se) })
    }

    /// Unit normal of the drawn triangle, not smoothed: how steep the ground is under a foot.
    pub fn normal_at(&self, x: f32, z: f32) -> Option<Vec3> {
        let ([nw, ne, sw, se], u, v) = self.cell(x, z)?;
        let (east, south) = if u + v <= 1.0 { (ne - nw, sw - nw) } else { (se - sw, se - ne) };
        Some(Vec3::new(-east, self.step_m, -south).normalize())
    }

    /// Heights of the corners north-west, north-east, south-west and south-east around a place, and how far it lies from the first
    /// eastwards and southwards, 0 to 1.
    fn cell(&self, x: f32, z: f32) -> Option<([f32; 4], f32, f32)> {
        let along = |at: f32, from: f32, points: u32| {
            // Twice as exact as the numbers it gets, so that a point of the grid finds itself.
            let place = (f64::from(at) - f64::from(from)) / f64::from(self.step_m);
            // Half a thousandth of a cell beyond the rim is rounding.
            let last = f64::from(points - 1);
            let inside = (-5e-4..=last + 5e-4).contains(&place);
            let place = place.clamp(0.0, last);
            let cell = place.floor().min(last - 1.0);
            inside.then_some((cell as usize, (place - cell) as f32))
        };
        let ((column, u), (row, v)) = (along(x, self.west_m, self.columns)?, along(z, self.north_m, self.rows)?);
        let first = row * self.columns as usize + column;
        let below = first + self.columns as usize;
        let h = &self.heights_m;
        Some(([h[first], h[first + 1], h[below], h[below + 1]], u, v))
    }

    /// From west to east and from north to south, metres.
    pub fn size_m(&self) -> [f32; 2] {
        [(self.columns - 1) as f32 * self.step_m, (self.rows - 1) as f32 * self.step_m]
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        let (low, high) = self.heights_m.iter().fold((f32::MAX, f32::MIN), |(low, high), &h| (low.min(h), high.max(h)));
        let [width, depth] = self.size_m();
        let min = Vec3::new(self.west_m, low, self.north_m);
        Bounds { min, max: Vec3::new(self.west_m + width, high, self.north_m + depth) }
    }

    /// How many triangles are drawn.
    pub fn triangles(&self) -> usize {
        2 * (self.columns as usize - 1) * (self.rows as usize - 1)
    }

    /// The surface as it is drawn.
    pub fn mesh(&self) -> GroundMesh {
        let (columns, rows) = (self.columns as usize, self.rows as usize);
        let height = |column: usize, row: usize| self.heights_m[row * columns + column];
        let points = || (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let place = |(column, row): (usize, usize)| {
            Vec3::new(self.west_m + column as f32 * self.step_m, height(column, row), self.north_m + row as f32 * self.step_m)
        };
        let normal = |(column, row): (usize, usize)| {
            let ([w, e], [n, s]) = (around(column, columns), around(row, rows));
            let rise =
                [(height(e, row) - height(w, row)) / (e - w) as f32, (height(column, s) - height(column, n)) / (s - n) as f32];
            Vec3::new(-rise[0], self.step_m, -rise[1]).normalize()
        };
        let cells = (0..rows - 1).flat_map(|row| (0..columns - 1).map(move |column| (row * columns + column) as u32));
        let down = self.columns;
        let indices = cells.flat_map(|nw| [nw, nw + down, nw + 1, nw + 1, nw + down, nw + down + 1]).collect();
        GroundMesh { positions: points().map(place).collect(), normals: points().map(normal).collect(), indices }
    }
}

/// The neighbours of a point along a side, itself where there is none.
fn around(at: usize, points: usize) -> [usize; 2] {
    [at.saturating_sub(1), (at + 1).min(points - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bumpy(columns: u32, rows: u32, heights: &[f32]) -> HeightField {
        let heights = (0..columns * rows).map(|i| heights[i as usize % heights.len()]).collect();
        HeightField::new(columns, rows, 2.5, -3.0, 40.0, heights).unwrap()
    }

    #[test]
    fn a_cell_is_two_triangles_split_from_south_west_to_north_east() {
        let field = HeightField::new(2, 2, 10.0, 0.0, 0.0, vec![0.0, 4.0, 8.0, 100.0]).unwrap();
        assert_eq!(field.height_at(5.0, 5.0), Some(6.0), "on the split, the other corners count nothing");
        assert_eq!(field.height_at(2.5, 2.5), Some(3.0));
        assert_eq!(field.height_at(10.0, 10.0), Some(100.0));
        assert_eq!(field.height_at(10.1, 5.0), None);
        assert_eq!(field.height_at(f32::NAN, 5.0), None);
        assert_eq!(field.triangles(), 2);
        let down = field.normal_at(1.0, 1.0).unwrap();
        assert!((down - Vec3::new(-0.4, 1.0, -0.8).normalize()).length() < 1e-6, "{down}");
    }

    #[test]
    fn what_cannot_be_ground_is_refused() {
        let new = |columns, rows, step, heights| HeightField::new(columns, rows, step, 0.0, 0.0, heights);
        assert!(new(1, 5, 1.0, vec![0.0; 5]).is_err());
        assert!(new(5000, 2, 1.0, vec![0.0; 10_000]).is_err());
        assert!(new(2, 2, 1.0, vec![0.0; 5]).is_err());
        assert!(new(2, 2, 0.0, vec![0.0; 4]).is_err());
        assert!(new(2, 2, f32::NAN, vec![0.0; 4]).is_err());
        assert!(new(2, 2, 1.0, vec![0.0, f32::NAN, 0.0, 0.0]).is_err());
        assert!(new(u32::MAX, u32::MAX, 1.0, vec![]).is_err());
        let told = new(2, 2, 1.0, vec![0.0, 0.0, f32::INFINITY, 0.0]).unwrap_err().to_string();
        assert!(told.contains("within 1000000 m") && told.contains("inf"), "{told}");
    }

    proptest! {
        #[test]
        fn heights_and_normals_are_those_of_the_drawn_triangles(
            columns in 2u32..7, rows in 2u32..7, heights in prop::collection::vec(-5.0f32..5.0, 1..40), pick in any::<prop::sample::Index>(),
            a in 0.01f32..0.9, b in 0.01f32..0.9,
        ) {
            let field = bumpy(columns, rows, &heights);
            let mesh = field.mesh();
            prop_assert_eq!(mesh.indices.len(), 3 * field.triangles());
            let triangle = pick.index(field.triangles());
            let [p, q, r] = [0, 1, 2].map(|corner| mesh.positions[mesh.indices[3 * triangle + corner] as usize]);
            let (a, b) = if a + b < 0.98 { (a, b) } else { (0.5 * a, 0.5 * b) };
            let at = p + a * (q - p) + b * (r - p);
            prop_assert!((field.height_at(at.x, at.z).unwrap() - at.y).abs() < 1e-3);
            let normal = (q - p).cross(r - p).normalize();
            prop_assert!(normal.y > 0.0, "seen from above");
            prop_assert!((field.normal_at(at.x, at.z).unwrap() - normal).length() < 1e-4);
            for (&point, normal) in mesh.positions.iter().zip(&mesh.normals) {
                prop_assert!((field.height_at(point.x, point.z).unwrap() - point.y).abs() < 1e-3);
                prop_assert!(normal.y > 0.0 && (normal.length() - 1.0).abs() < 1e-5);
            }
            let bounds = field.bounds();
            prop_assert_eq!(Bounds::of(mesh.positions.iter().copied()), Some(bounds));
            prop_assert_eq!(field.size_m(), [bounds.size().x, bounds.size().z]);
        }
    }
}
