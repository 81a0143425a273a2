//! Cells of equal size over a cloud of points, to find neighbours: what keeps simplification of 100,000 leaves a matter of a second.

use glam::{IVec3, Vec3};

/// Cells with the numbers of the points in them.
#[derive(Debug, Default)]
pub struct Grid {
    /// Edge of a cell, metres.
    pub cell_m: f32,
    low: Vec3,
    size: IVec3,
    cells: Vec<Vec<u32>>,
}

/// Points of a cell on the average, if they were spread evenly.
const PER_CELL: f32 = 2.0;
/// Most points of one cell that are looked at: more stand in one place.
const MOST_IN_CELL: usize = 48;
/// Share of the points, at either end of each axis, that do not say how large the cloud is.
const STRAY: f32 = 0.01;

impl Grid {
    /// Cells around finite points.
    pub fn of(points: impl Iterator<Item = (u32, Vec3)>) -> Self {
        let points: Vec<(u32, Vec3)> = points.collect();
        let (low, extent) = extent(&points);
        let longest = extent.max_element();
        if longest <= 0.0 {
            return Self { cell_m: 1.0, low, size: IVec3::ONE, cells: vec![points.into_iter().map(|p| p.0).collect()] };
        }
        // A flat cloud has a thickness of one cell.
        let volume = extent.max(Vec3::splat(longest / 64.0)).as_dvec3().element_product();
        let cell_m = ((volume * f64::from(PER_CELL) / points.len() as f64).cbrt() as f32).max(longest / 256.0);
        let size = (extent / cell_m).ceil().as_ivec3().max(IVec3::ONE);
        let mut grid = Self { cell_m, low, size, cells: vec![vec![]; size.as_i64vec3().element_product() as usize] };
        for (number, at) in points {
            grid.add(number, at);
        }
        grid
    }

    /// Adds a point.
    pub fn add(&mut self, number: u32, at: Vec3) {
        let cell = self.number(self.cell(at));
        self.cells[cell].push(number);
    }

    /// Every point.
    pub fn all(&self) -> impl Iterator<Item = u32> {
        self.cells.iter().flatten().copied()
    }

    /// The points in the cells that are `ring` cells away from the one of `at`, latest first; `look` says whether the point still counts.
    pub fn ring(&self, at: Vec3, ring: i32, look: &mut impl FnMut(u32) -> bool) {
        let middle = self.cell(at);
        let (low, high) = ((middle - ring).max(IVec3::ZERO), (middle + ring).min(self.size - 1));
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                let edge = (z - middle.z).abs() == ring || (y - middle.y).abs() == ring;
                let step = if edge || ring == 0 { 1 } else { 2 * ring };
                let first = if edge { low.x } else { middle.x - ring };
                for x in (first..=high.x).step_by(step as usize).filter(|&x| x >= low.x) {
                    let cell = &self.cells[self.number(IVec3::new(x, y, z))];
                    let mut left = MOST_IN_CELL;
                    for &number in cell.iter().rev() {
                        left -= usize::from(look(number));
                        if left == 0 {
                            break;
                        }
                    }
                }
            }
        }
    }

    /// The cell of a place; strays count to the outermost.
    fn cell(&self, at: Vec3) -> IVec3 {
        ((at - self.low) / self.cell_m).floor().as_ivec3().clamp(IVec3::ZERO, self.size - 1)
    }

    fn number(&self, cell: IVec3) -> usize {
        ((cell.z * self.size.y + cell.y) * self.size.x + cell.x) as usize
    }
}

/// Lowest corner and size of the box around all but a few points.
fn extent(points: &[(u32, Vec3)]) -> (Vec3, Vec3) {
    if points.is_empty() {
        return (Vec3::ZERO, Vec3::ZERO);
    }
    let along = |axis: usize| {
        let mut sorted: Vec<f32> = points.iter().map(|(_, p)| p[axis]).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let aside = (STRAY * points.len() as f32) as usize;
        (sorted[aside], sorted[sorted.len() - 1 - aside])
    };
    let [x, y, z] = [0, 1, 2].map(along);
    let low = Vec3::new(x.0, y.0, z.0);
    (low, Vec3::new(x.1, y.1, z.1) - low)
}
