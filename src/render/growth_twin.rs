//! The CPU twin of `shaders/growth.wgsl`: the oracle for its GPU form. From the trees' temporary colour, depth and id pictures it computes
//! the same grown pixels, exactly, by the plainest means: every root of the picture in order, every pixel a plain comparison.

use super::growth::GrowthInput;
use crate::gpu::layout::{FACING_BITS, GROWN, GrowingCrown, LENGTH_BITS, PLACE_BITS};

/// The trees' temporary pictures, row by row from the top left.
#[derive(Debug, Clone, PartialEq)]
pub struct TreePictures {
    /// sRGB bytes.
    pub color: Vec<[u8; 4]>,
    /// Reversed depth, 0 where nothing is.
    pub depth: Vec<f32>,
    /// Crown, facing and place on the limb; see `shaders/shared/id.wgsl`.
    pub id: Vec<u32>,
}

/// A pixel of an outline from which growth starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Root {
    /// Column and row.
    pub at: [i32; 2],
    /// Length in sixteenths of a pixel.
    pub length: u32,
    /// The two sides that its pixels alternate between (0 R, 1 T, 2 L, 3 B).
    pub sides: [usize; 2],
}

/// A pixel that has grown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrownPixel {
    /// Column and row.
    pub at: [i32; 2],
    /// Its root.
    pub root: [i32; 2],
    /// How much of it is covered, sixteenths.
    pub coverage: u32,
}

/// R, T, L, B; y runs down.
const SIDES: [[i32; 2]; 4] = [[1, 0], [0, -1], [-1, 0], [0, 1]];
const LONGEST: f32 = (16 * ((1 << LENGTH_BITS) - 1)) as f32;
const FACING_FULL: u32 = 26;
const FACING_LOSS: u32 = 3;

/// The twin's view of one picture.
#[derive(Debug)]
pub struct Twin<'a> {
    /// What the growth is computed from beside the pictures.
    pub input: &'a GrowthInput,
    /// Those.
    pub pictures: &'a TreePictures,
}

impl Twin<'_> {
    /// Every root, row by row.
    pub fn roots(&self) -> Vec<Root> {
        let [width, height] = self.input.frame.size_px.map(|n| n as i32);
        let all = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        all.filter_map(|at| self.root(at)).collect()
    }

    /// Every grown pixel, row by row: a whole one wins over a tip, then the smallest depth, then the shorter way from the root, then the lower root. Those that stand
    /// behind what the picture shows there are left out.
    pub fn grown(&self) -> Vec<GrownPixel> {
        let mut winners: Vec<Option<(GrownPixel, u32)>> = vec![None; self.pictures.depth.len()];
        for root in self.roots() {
            for i in 1..=self.steps(root.length) {
                let at = add(root.at, offset_of(root.sides, i));
                let coverage = (root.length - (i as u32 - 1) * 16).min(16);
                let pixel = GrownPixel { at, root: root.at, coverage };
                let winner = &mut winners[self.index(at)];
                // Roots come in order: of equals the first, which is the lower, stays.
                let wins = winner.is_none_or(|(other, steps)| {
                    let rank = |pixel: &GrownPixel| (pixel.coverage == 16, self.depth(pixel.root));
                    let (ours, theirs) = (rank(&pixel), rank(&other));
                    ours > theirs || (ours == theirs && (i as u32) < steps)
                });
                if wins {
                    *winner = Some((pixel, i as u32));
                }
            }
        }
        let grown = winners.into_iter().flatten().map(|(pixel, _)| pixel);
        grown.filter(|pixel| self.depth(pixel.root) > self.depth(pixel.at)).collect()
    }

    /// The pictures with the grown pixels in them: those that are wholly covered exactly, others within what blending rounds.
    pub fn pictures(&self) -> TreePictures {
        let mut out = self.pictures.clone();
        for pixel in self.grown() {
            let (to, root) = (self.index(pixel.at), self.index(pixel.root));
            let part = pixel.coverage as f32 / 16.0;
            let (over, under) = (self.pictures.color[root], self.pictures.color[to]);
            out.color[to] = std::array::from_fn(|c| match c {
                3 => (f32::from(over[3]) * part + f32::from(under[3]) * (1.0 - part)).round() as u8,
                _ if pixel.coverage == 16 => over[c],
                _ => {
                    let [over, under] = [over[c], under[c]].map(crate::raster::to_linear);
                    crate::raster::to_srgb(over * part + under * (1.0 - part))
                }
            });
            out.depth[to] = self.pictures.depth[root];
            out.id[to] = GROWN | pixel.coverage;
        }
        out
    }

    fn index(&self, [x, y]: [i32; 2]) -> usize {
        y as usize * self.input.frame.size_px[0] as usize + x as usize
    }

    fn contains(&self, at: [i32; 2]) -> bool {
        let [width, height] = self.input.frame.size_px.map(|n| n as i32);
        (0..width).contains(&at[0]) && (0..height).contains(&at[1])
    }

    fn depth(&self, at: [i32; 2]) -> f32 {
        self.pictures.depth[self.index(at)]
    }

    /// Depth as a whole number.
    fn whole_depth(&self, at: [i32; 2]) -> u32 {
        (self.depth(at) * 16_777_216.0) as u32
    }

    fn steps(&self, length: u32) -> i32 {
        ((length + self.input.frame.tips * 15) / 16) as i32
    }

    /// Whether what has depth `other` is background for a root of depth `own`.
    fn is_behind(&self, own: u32, other: u32, gap_m: f32) -> bool {
        let frame = &self.input.frame;
        if other == 0 {
            return true;
        }
        if frame.inner == 0 || other >= own {
            return false;
        }
        let product = if frame.orthographic != 0 { 16_777_216.0 } else { own as f32 * other as f32 };
        frame.depth_units * (own - other) as f32 > gap_m * product
    }

    fn root(&self, at: [i32; 2]) -> Option<Root> {
        let id = self.pictures.id[self.index(at)];
        let slot = id >> (PLACE_BITS + FACING_BITS);
        if slot == 0 {
            return None;
        }
        let crown = &self.input.crowns[slot as usize];
        let own = self.whole_depth(at);
        let open = SIDES.map(|side| {
            let beside = add(at, side);
            self.contains(beside) && self.is_behind(own, self.whole_depth(beside), crown.gap_m)
        });
        let axis = axis_of(open, self.input.frame.corners != 0)?;
        let (full, sides) = self.growth(at, id, crown, axis);
        let clear = (1..=full.div_ceil(16) as i32).take_while(|i| {
            let next = add(at, offset_of(sides, *i));
            self.contains(next) && self.is_behind(own, self.whole_depth(next), crown.gap_m)
        });
        let length = full.min(clear.count() as u32 * 16);
        (self.steps(length) > 0).then_some(Root { at, length, sides })
    }

    /// Length in sixteenths of a pixel, and sides, of the growth of a root whose background lies in octant `axis`.
    fn growth(&self, at: [i32; 2], id: u32, crown: &GrowingCrown, axis: u32) -> (u32, [usize; 2]) {
        let frame = &self.input.frame;
        let place = id & ((1 << PLACE_BITS) - 1);
        let facing = (id >> PLACE_BITS) & ((1 << FACING_BITS) - 1);
        let mut limb = self.input.limbs[(crown.first + ((place * crown.count) >> PLACE_BITS)) as usize];
        if frame.random != 0 {
            let h = scrambled(scrambled(self.index(at) as u32) ^ frame.frame);
            limb = (h & 0xffff) | (((axis + [0, 1, 7][((h >> 16) % 3) as usize]) & 7) << 21);
        }
        let [a, b] = frame.px_per_m;
        let scale = ((a + b * self.depth(at)).min(65535.0) * 256.0) as u32;
        let pixels = |units: f32| (units * scale as f32).min(LONGEST) as u32;
        let longest = pixels(crown.max_units);
        let shortest = pixels(crown.min_units).min(longest);
        if longest < 16 {
            return (0, [0, 0]);
        }
        let full = shortest + (((longest - shortest) * (limb & 0xffff)) >> 16);
        let loss = ((facing.max(FACING_FULL) - FACING_FULL) * FACING_LOSS).min(64);
        ((full * (64 - loss)) >> 6, sides_of(axis, (limb >> 16) & 255))
    }
}

/// The octant towards the background of a root (R, T, L, B are background): one side (fig. 13b), or two beside each other where corners
/// grow.
fn axis_of(open: [bool; 4], corners: bool) -> Option<u32> {
    let count = open.iter().filter(|open| **open).count();
    let first = (0..4).find(|&i| open[i] && !open[(i + 3) % 4]);
    match (count, first) {
        (1, Some(side)) => Some(2 * side as u32),
        (2, Some(side)) if corners && open[(side + 1) % 4] => Some(2 * side as u32 + 1),
        _ => None,
    }
}

/// The sides that a growth alternates between: of the directions round `axis` (three, fig. 13c; five round a corner) the nearest to a
/// screen direction, in 256ths of a turn counter-clockwise from the right.
fn sides_of(axis: u32, direction: u32) -> [usize; 2] {
    let octant = ((direction + 16) / 32) % 8;
    let most = if axis.is_multiple_of(2) { 1 } else { 2 };
    let turn = match (octant + 8 - axis) % 8 {
        0 | 4 => 0,
        left @ 1..4 => (left as i32).min(most),
        right => (right as i32 - 8).max(-most),
    };
    let octant = (axis as i32 + turn).rem_euclid(8);
    let (before, after) = (octant as usize / 2, (octant as usize).div_ceil(2) % 4);
    let after_first = match (axis.is_multiple_of(2), turn) {
        (true, _) => after == axis as usize / 2,
        // A corner: both of its sides are background; of the growth between them the level one comes first.
        (false, 0) => after.is_multiple_of(2),
        (false, turn) => turn < 0,
    };
    if after_first { [after, before] } else { [before, after] }
}

/// The i-th pixel of a growth, seen from its root.
fn offset_of(sides: [usize; 2], i: i32) -> [i32; 2] {
    let ([ax, ay], [bx, by]) = (SIDES[sides[0]], SIDES[sides[1]]);
    let (a, b) = ((i + 1) / 2, i / 2);
    [a * ax + b * bx, a * ay + b * by]
}

fn add([ax, ay]: [i32; 2], [bx, by]: [i32; 2]) -> [i32; 2] {
    [ax + bx, ay + by]
}

fn scrambled(word: u32) -> u32 {
    let h = (word ^ (word >> 16)).wrapping_mul(0x7feb_352d);
    let h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

#[cfg(test)]
#[path = "growth_tests.rs"]
mod tests;
