//! Where many trees stand: square cells of the ground, so that whole cells are seen or not. Trees of a cell lie together in memory, those of
//! a species among them too.

use std::ops::Range;

use rayon::prelude::*;

use super::Shape;
use crate::geom::Bounds;
use crate::gpu::layout::Placed;

/// Trees that cells hold at least on average, and fewer than four times as many: few enough that cells are small beside the picture, many
/// enough that asking each of a million trees is never needed.
const TREES_OF_A_CELL: usize = 32;
/// Sides of the smallest cells, metres. Each larger side is twice the one before, and all count from the origin: so trees that come elsewhere
/// change nothing about the cells here.
const SMALLEST_M: f32 = 1.0;

/// The number of the smallest cell in which a tree stands: bits of its row and its column in turns, so that a quarter of the number is the
/// cell of twice the side (Morton order).
fn smallest_cell(placed: &Placed) -> u64 {
    let spread = |at_m: f32| {
        let line = ((at_m / SMALLEST_M).floor() as i64 + (1 << 30)).clamp(0, (1 << 31) - 1) as u64;
        let steps = [(16, 0x0000_ffff_0000_ffff), (8, 0x00ff_00ff_00ff_00ff), (4, 0x0f0f_0f0f_0f0f_0f0f)];
        let steps = steps.into_iter().chain([(2, 0x3333_3333_3333_3333), (1, 0x5555_5555_5555_5555)]);
        steps.fold(line, |bits, (by, kept)| (bits | bits << by) & kept)
    };
    let [x, _, z] = placed.position;
    spread(x) | spread(z) << 1
}

/// How often the smallest side is doubled, so that cells with trees hold enough of them.
fn doublings(trees: &[Standing]) -> u32 {
    let mut cells: Vec<u64> = trees.par_iter().map(|(_, placed)| smallest_cell(placed)).collect();
    cells.par_sort_unstable();
    let mut doublings = 0;
    loop {
        cells.dedup();
        if cells.len() * TREES_OF_A_CELL <= trees.len() || cells.len() <= 1 {
            return doublings;
        }
        cells.iter_mut().for_each(|cell| *cell >>= 2);
        doublings += 1;
    }
}

/// A square of the ground with trees.
#[derive(Debug, Clone)]
pub struct Cell {
    /// Around all that may be drawn of its trees, in still air.
    pub bounds: Bounds,
    /// The tallest of them, metres: how far the wind may push them.
    pub tallest_m: f32,
    /// Its runs in [`Cells::runs`].
    pub runs: Range<u32>,
}

/// Trees of one species in one cell.
#[derive(Debug, Clone)]
pub struct Run {
    /// Which species.
    pub species: u16,
    /// Which trees, by their numbers.
    pub trees: Range<u32>,
    /// Smallest and largest scale of them.
    pub scales: [f32; 2],
}

/// All cells.
#[derive(Debug, Clone, Default)]
pub struct Cells {
    /// Cells that hold trees, neighbours mostly beside each other.
    pub cells: Vec<Cell>,
    /// Their runs.
    pub runs: Vec<Run>,
}

/// Where a tree stands that is of a species.
pub type Standing = (u16, Placed);

impl Cells {
    /// Sorts trees into cells: gives them in their new order. Equal trees keep their order, so that it depends on nothing but them.
    pub fn sort(trees: &[Standing], shapes: &[Shape]) -> (Self, Vec<Placed>) {
        let doublings = doublings(trees);
        let cell_of = |placed: &Placed| smallest_cell(placed) >> (2 * doublings);
        let mut order: Vec<(u64, u16, u32)> =
            trees.par_iter().zip(0..trees.len() as u32).map(|((species, placed), i)| (cell_of(placed), *species, i)).collect();
        order.par_sort_unstable();
        let placed = order.par_iter().map(|(_, _, i)| trees[*i as usize].1).collect::<Vec<_>>();
        let mut all = Self::default();
        let mut begin = 0;
        for cell in order.chunk_by(|a, b| a.0 == b.0) {
            all.add(cell, begin, &placed, shapes);
            begin += cell.len() as u32;
        }
        (all, placed)
    }

    fn add(&mut self, cell: &[(u64, u16, u32)], mut begin: u32, placed: &[Placed], shapes: &[Shape]) {
        let first = self.runs.len() as u32;
        let (mut around, mut tallest_m) = (None::<Bounds>, 0.0f32);
        for run in cell.chunk_by(|a, b| a.1 == b.1) {
            let (species, trees) = (run[0].1, begin..begin + run.len() as u32);
            begin = trees.end;
            let shape = &shapes[usize::from(species)];
            let mut scales = [f32::MAX, 0.0f32];
            for tree in &placed[trees.start as usize..trees.end as usize] {
                let scale = tree.scale();
                scales = [scales[0].min(scale), scales[1].max(scale)];
                let reach = shape.reach_at(tree);
                around = Some(around.map_or(reach, |b| Bounds { min: b.min.min(reach.min), max: b.max.max(reach.max) }));
            }
            tallest_m = tallest_m.max(scales[1] * shape.height_m);
            self.runs.push(Run { species, trees, scales });
        }
        if let Some(bounds) = around {
            self.cells.push(Cell { bounds, tallest_m, runs: first..self.runs.len() as u32 });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{shape, standing};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_tree_is_in_one_cell_that_holds_it(trees in prop::collection::vec((0u16..3, -900f32..900.0, -50f32..900.0), 0..400)) {
            let trees: Vec<Standing> = trees.into_iter().map(|(species, x, z)| standing(species, x, z)).collect();
            let shapes = [shape(4.0), shape(9.0), shape(20.0)];
            let (cells, placed) = Cells::sort(&trees, &shapes);
            prop_assert_eq!(placed.len(), trees.len());
            let mut next = 0;
            for cell in &cells.cells {
                for run in &cells.runs[cell.runs.start as usize..cell.runs.end as usize] {
                    prop_assert_eq!(run.trees.start, next);
                    next = run.trees.end;
                    for tree in run.trees.clone() {
                        let tree = &placed[tree as usize];
                        let reach = shapes[usize::from(run.species)].reach_at(tree);
                        prop_assert!(cell.bounds.min.cmple(reach.min).all() && cell.bounds.max.cmpge(reach.max).all());
                        prop_assert!(trees.iter().any(|(species, known)| *species == run.species && known == tree));
                    }
                }
            }
            prop_assert_eq!(next as usize, trees.len());
        }
    }

    #[test]
    fn cells_hold_as_many_trees_as_they_are_made_for() {
        let trees: Vec<Standing> = (0..10_000).map(|i| standing(0, (i % 100) as f32 * 5.0, (i / 100) as f32 * 5.0)).collect();
        let (cells, _) = Cells::sort(&trees, &[shape(8.0)]);
        let mean = 10_000.0 / cells.cells.len() as f32;
        assert!((32.0..128.0).contains(&mean), "{mean}");
        assert!(Cells::sort(&[], &[]).0.cells.is_empty());
    }
}
