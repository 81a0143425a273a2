//! A mask of one bit per pixel: 64 pixels a word make opening, closing, labelling and hole filling cheap (She §3.1, fig. 7c–d).
//!
//! Borders follow OpenCV: what lies outside the picture never erodes the set and never grows into it.

use rayon::prelude::*;

use crate::raster::Mask;

/// A set of pixels, row by row, each row padded to whole words with zeros.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bits {
    width: usize,
    height: usize,
    /// Words per row.
    stride: usize,
    words: Vec<u64>,
}

/// A horizontal run of pixels `start..end`, with the number of its row.
#[derive(Debug, Clone, Copy)]
struct Run {
    row: usize,
    start: usize,
    end: usize,
}

/// Which neighbours count as connected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Neighbours {
    Four,
    Eight,
}

impl Bits {
    /// The set of pixels for which `inside` holds; rows are filled in parallel. `inside(y, row)` pushes one word per 64 pixels.
    pub fn from_rows(width: usize, height: usize, fill: impl Fn(usize, &mut [u64]) + Sync) -> Self {
        let stride = width.div_ceil(64);
        let mut words = vec![0; stride * height];
        words.par_chunks_mut(stride.max(1)).enumerate().for_each(|(y, row)| fill(y, row));
        Self { width, height, stride, words }
    }

    /// Packs a byte mask.
    pub fn from_mask(mask: &Mask) -> Self {
        let (width, raw) = (mask.width() as usize, mask.as_raw());
        Self::from_rows(width, mask.height() as usize, |y, row| {
            for (word, bytes) in row.iter_mut().zip(raw[y * width..(y + 1) * width].chunks(64)) {
                *word = bytes.iter().enumerate().fold(0, |w, (i, &v)| w | u64::from(v != 0) << i);
            }
        })
    }

    /// Unpacks to a byte mask.
    pub fn to_mask(&self) -> Mask {
        let mut mask = Mask::new(self.width as u32, self.height as u32);
        mask.as_raw_mut().par_chunks_mut(self.width.max(1)).enumerate().for_each(|(y, bytes)| {
            for (word, bytes) in self.row(y).iter().zip(bytes.chunks_mut(64)) {
                for (i, byte) in bytes.iter_mut().enumerate() {
                    *byte = 255 * (word >> i & 1) as u8;
                }
            }
        });
        mask
    }

    /// A byte mask of at most `longest_px` on its longer side, for looking at: one pixel of each square, unsmoothed.
    pub fn to_small_mask(&self, longest_px: usize) -> Mask {
        let step = self.width.max(self.height).div_ceil(longest_px).max(1);
        let at = |x: u32, y: u32| (x as usize * step, y as usize * step);
        Mask::from_fn(self.width.div_ceil(step) as u32, self.height.div_ceil(step) as u32, |x, y| {
            let (x, y) = at(x, y);
            self.row(y)[x / 64] >> (x % 64) & 1 == 1
        })
    }

    /// Pixels in the set.
    pub fn count(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// Pixels of both sets.
    pub fn and(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a & b)
    }

    /// Pixels of either set.
    pub fn or(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a | b)
    }

    /// Pixels of the set on the picture's top and bottom rows, left and right columns.
    pub fn frame_contact(&self) -> [usize; 4] {
        let row = |y: usize| self.row(y).iter().map(|w| w.count_ones() as usize).sum();
        let column = |x: usize| (0..self.height).filter(|&y| self.row(y)[x / 64] >> (x % 64) & 1 == 1).count();
        if self.words.is_empty() { [0; 4] } else { [row(0), row(self.height - 1), column(0), column(self.width - 1)] }
    }

    /// First and one past the last column of each row's pixels, from the top; `None` for an empty row.
    pub fn spans(&self) -> Vec<Option<(usize, usize)>> {
        let span = |words: &[u64]| {
            let first = words.iter().position(|&w| w != 0)?;
            let last = words.iter().rposition(|&w| w != 0)?;
            Some((64 * first + words[first].trailing_zeros() as usize, 64 * last + 64 - words[last].leading_zeros() as usize))
        };
        (0..self.height).map(|y| span(self.row(y))).collect()
    }

    /// The pixels above row `end`.
    pub fn above(&self, end: usize) -> Self {
        let mut out = self.clone();
        out.words[(end.min(self.height)) * self.stride..].fill(0);
        out
    }

    /// The disc around a pixel, in a picture of this size.
    pub fn disc(&self, x: u32, y: u32, radius_px: u32) -> Self {
        let (cx, cy, r2) = (i64::from(x), i64::from(y), i64::from(radius_px).pow(2));
        Self::from_rows(self.width, self.height, |y, row| {
            let reach = ((r2 - (y as i64 - cy).pow(2)) as f64).sqrt();
            if reach >= 0.0 {
                let (from, to) = ((cx - reach as i64).max(0) as usize, ((cx + reach as i64 + 1).max(0) as usize).min(self.width));
                (from..to).for_each(|x| row[x / 64] |= 1 << (x % 64));
            }
        })
    }

    /// Opening with a disc: what is narrower than the disc goes.
    pub fn open(&self, radius_px: u32) -> Self {
        self.erode(radius_px).dilate(radius_px)
    }

    /// Closing with a disc: gaps narrower than the disc are filled.
    pub fn close(&self, radius_px: u32) -> Self {
        self.dilate(radius_px).erode(radius_px)
    }

    /// Dilation with OpenCV's elliptical element of (2r+1)² pixels.
    pub fn dilate(&self, radius_px: u32) -> Self {
        if radius_px == 0 || self.words.is_empty() {
            return self.clone();
        }
        let radius = radius_px as usize;
        let rows_of = rows_by_half_width(radius);
        let band = 64.max(2 * radius);
        let mut out = vec![0; self.words.len()];
        out.par_chunks_mut(band * self.stride).enumerate().for_each(|(b, out)| {
            let (top, rows) = (b * band, out.len() / self.stride);
            let mut wide = vec![0; self.stride];
            for y in top.saturating_sub(radius)..(top + rows + radius).min(self.height) {
                if self.row(y).iter().all(|&w| w == 0) {
                    continue;
                }
                wide.copy_from_slice(self.row(y));
                for (half_width, offsets) in rows_of.iter().enumerate() {
                    if half_width > 0 {
                        self.widen(&mut wide);
                    }
                    for dy in offsets {
                        let Some(target) = (y as i64 + dy - top as i64).try_into().ok().filter(|&t: &usize| t < rows) else {
                            continue;
                        };
                        let target = &mut out[target * self.stride..(target + 1) * self.stride];
                        target.iter_mut().zip(&wide).for_each(|(o, w)| *o |= w);
                    }
                }
            }
        });
        Self { words: out, ..*self }
    }

    /// Erosion with the same element: the dilation of the complement, complemented.
    pub fn erode(&self, radius_px: u32) -> Self {
        if radius_px == 0 { self.clone() } else { self.not().dilate(radius_px).not() }
    }

    /// The complement.
    pub fn not(&self) -> Self {
        let mut out = self.clone();
        let last = self.last_word();
        for row in out.words.chunks_mut(self.stride.max(1)) {
            row.iter_mut().for_each(|w| *w = !*w);
            if let Some(w) = row.last_mut() {
                *w &= last;
            }
        }
        out
    }

    /// The largest 8-connected component; of equals, the one met first from the top left. Empty when the set is.
    pub fn largest_component(&self) -> Self {
        let runs = self.runs();
        let roots = roots(&runs, self.height, Neighbours::Eight);
        let mut areas = vec![0; runs.len()];
        for (run, &root) in runs.iter().zip(&roots) {
            areas[root] += run.end - run.start;
        }
        // `max_by_key` keeps the last of equals; going backwards makes that the first.
        let Some(largest) = (0..runs.len()).rev().max_by_key(|&i| areas[i]) else { return self.clone() };
        self.of_runs(runs.iter().zip(&roots).filter(|(_, root)| **root == largest).map(|(run, _)| run))
    }

    /// The 8-connected components of at least `least` of the largest's area.
    pub fn without_crumbs(&self, least: f64) -> Self {
        let runs = self.runs();
        let roots = roots(&runs, self.height, Neighbours::Eight);
        let mut areas = vec![0; runs.len()];
        for (run, &root) in runs.iter().zip(&roots) {
            areas[root] += run.end - run.start;
        }
        let enough = least * areas.iter().max().copied().unwrap_or(0) as f64;
        self.of_runs(runs.iter().zip(&roots).filter(|(_, root)| areas[**root] as f64 >= enough).map(|(run, _)| run))
    }

    /// The 8-connected component that holds a pixel; `None` when the set does not.
    pub fn component_at(&self, x: usize, y: usize) -> Option<Self> {
        let runs = self.runs();
        let at = runs.iter().position(|r| r.row == y && (r.start..r.end).contains(&x))?;
        let roots = roots(&runs, self.height, Neighbours::Eight);
        Some(self.of_runs(runs.iter().zip(&roots).filter(|(_, root)| **root == roots[at]).map(|(run, _)| run)))
    }

    /// The set with every hole filled: background that no 4-connected path joins to the picture's border.
    pub fn fill_holes(&self) -> Self {
        let background = self.not();
        let runs = background.runs();
        let roots = roots(&runs, self.height, Neighbours::Four);
        let mut open = vec![false; runs.len()];
        for (run, &root) in runs.iter().zip(&roots) {
            open[root] |= run.row == 0 || run.row + 1 == self.height || run.start == 0 || run.end == self.width;
        }
        self.of_runs(runs.iter().zip(&roots).filter(|(_, root)| open[**root]).map(|(run, _)| run)).not()
    }

    /// The pixels of the set with a 4-neighbour outside it, or on the picture's border.
    pub fn outline(&self) -> Self {
        let inner = self.not().dilate(1).not();
        let mut out = self.zip(&inner, |a, b| a & !b);
        let frame = Self::from_rows(self.width, self.height, |y, row| {
            if y == 0 || y + 1 == self.height {
                row.fill(!0);
                *row.last_mut().expect("a row has a word") &= self.last_word();
            } else {
                row[0] |= 1;
                row[(self.width - 1) / 64] |= 1 << ((self.width - 1) % 64);
            }
        });
        out.words.iter_mut().zip(&self.words).zip(&frame.words).for_each(|((o, s), f)| *o |= s & f);
        out
    }

    fn zip(&self, other: &Self, combine: impl Fn(u64, u64) -> u64) -> Self {
        let words = self.words.iter().zip(&other.words).map(|(&a, &b)| combine(a, b)).collect();
        Self { words, ..*self }
    }

    fn row(&self, y: usize) -> &[u64] {
        &self.words[y * self.stride..(y + 1) * self.stride]
    }

    /// The valid bits of a row's last word.
    fn last_word(&self) -> u64 {
        !0 >> ((64 - self.width % 64) % 64)
    }

    /// Grows a row by one pixel to both sides.
    fn widen(&self, row: &mut [u64]) {
        let mut carry = 0;
        for i in 0..row.len() {
            let word = row[i];
            let next = row.get(i + 1).map_or(0, |w| w << 63);
            row[i] = word | word << 1 | carry | word >> 1 | next;
            carry = word >> 63;
        }
        if let Some(w) = row.last_mut() {
            *w &= self.last_word();
        }
    }

    fn runs(&self) -> Vec<Run> {
        let mut runs = Vec::new();
        for row in 0..self.height {
            let words = self.row(row);
            let mut x = 0;
            while let Some(start) = next_bit(words, x, self.width, 0) {
                let end = next_bit(words, start, self.width, !0).unwrap_or(self.width);
                runs.push(Run { row, start, end });
                x = end;
            }
        }
        runs
    }

    fn of_runs<'a>(&self, runs: impl Iterator<Item = &'a Run>) -> Self {
        let mut out = Self { words: vec![0; self.words.len()], ..*self };
        for run in runs {
            let row = &mut out.words[run.row * self.stride..(run.row + 1) * self.stride];
            let (first, last) = (run.start / 64, (run.end - 1) / 64);
            for (i, word) in row.iter_mut().enumerate().take(last + 1).skip(first) {
                let from = if i == first { !0 << (run.start % 64) } else { !0 };
                let to = if i == last { !0 >> (63 - (run.end - 1) % 64) } else { !0 };
                *word |= from & to;
            }
        }
        out
    }
}

/// First position `>= from` whose bit differs from those of `flip`: a set bit for 0, a clear one for all ones.
fn next_bit(words: &[u64], from: usize, width: usize, flip: u64) -> Option<usize> {
    let mut i = from / 64;
    let mut word = (words.get(i)? ^ flip) & (!0 << (from % 64));
    loop {
        if word != 0 {
            return Some(i * 64 + word.trailing_zeros() as usize).filter(|&x| x < width);
        }
        i += 1;
        word = words.get(i)? ^ flip;
    }
}

/// For each half width 0..=r, the rows of the elliptical element that have it (`cv::getStructuringElement`, `MORPH_ELLIPSE`).
fn rows_by_half_width(radius: usize) -> Vec<Vec<i64>> {
    let (r, mut rows) = (radius as i64, vec![Vec::new(); radius + 1]);
    let inverse = 1.0 / (r * r) as f64;
    for dy in -r..=r {
        let half_width = (r as f64 * (((r * r - dy * dy) as f64) * inverse).sqrt()).round_ties_even();
        rows[half_width as usize].push(dy);
    }
    rows
}

/// For every run the first run of its component (union–find over runs, top to bottom).
fn roots(runs: &[Run], height: usize, neighbours: Neighbours) -> Vec<usize> {
    let reach = usize::from(neighbours == Neighbours::Eight);
    let mut parent: Vec<usize> = (0..runs.len()).collect();
    let mut starts = vec![0; height + 2];
    for run in runs {
        starts[run.row + 1] += 1;
    }
    for y in 0..=height {
        starts[y + 1] += starts[y];
    }
    for y in 1..height {
        let (mut a, mut b) = (starts[y - 1], starts[y]);
        while a < starts[y] && b < starts[y + 1] {
            if runs[a].start < runs[b].end + reach && runs[b].start < runs[a].end + reach {
                let (x, z) = (find(&mut parent, a), find(&mut parent, b));
                parent[x.max(z)] = x.min(z);
            }
            if runs[a].end < runs[b].end { a += 1 } else { b += 1 }
        }
    }
    (0..runs.len()).map(|i| find(&mut parent, i)).collect()
}

fn find(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn masks() -> impl Strategy<Value = Mask> {
        (1u32..140, 1u32..20, any::<u64>(), 1usize..9).prop_map(|(w, h, seed, density)| {
            let mut draws = crate::Seed(seed).keyed("mask", 0);
            Mask::from_fn(w, h, |_, _| draws.below(10) < density)
        })
    }

    /// The definition: any pixel under the element.
    fn dilate_plainly(mask: &Mask, radius: u32) -> Mask {
        let rows = rows_by_half_width(radius as usize);
        Mask::from_fn(mask.width(), mask.height(), |x, y| {
            rows.iter().enumerate().any(|(half, offsets)| {
                offsets.iter().any(|dy| (-(half as i64)..=half as i64).any(|dx| mask.get(i64::from(x) + dx, i64::from(y) + dy)))
            })
        })
    }

    /// The component of one pixel, by flooding.
    fn flood(mask: &Mask, from: (i64, i64), of: bool, steps: &[(i64, i64)]) -> Mask {
        let (mut out, mut todo) = (Mask::new(mask.width(), mask.height()), vec![from]);
        let within = |x: i64, y: i64| x >= 0 && y >= 0 && x < mask.width().into() && y < mask.height().into();
        while let Some((x, y)) = todo.pop() {
            if within(x, y) && mask.get(x, y) == of && !out.get(x, y) {
                out.set(x as u32, y as u32, true);
                todo.extend(steps.iter().map(|(dx, dy)| (x + dx, y + dy)));
            }
        }
        out
    }

    const FOUR: [(i64, i64); 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];
    const EIGHT: [(i64, i64); 8] = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1)];

    proptest! {
        #[test]
        fn morphology_is_its_definition(mask in masks(), radius in 0u32..6) {
            let bits = Bits::from_mask(&mask);
            prop_assert_eq!(bits.to_mask(), mask.clone());
            prop_assert_eq!(bits.dilate(radius).to_mask(), dilate_plainly(&mask, radius));
            let complement = Mask::from_fn(mask.width(), mask.height(), |x, y| !mask.get(x.into(), y.into()));
            let eroded = dilate_plainly(&complement, radius);
            prop_assert_eq!(bits.erode(radius).not().to_mask(), eroded);
        }

        #[test]
        fn components_and_holes_are_what_flooding_finds(mask in masks()) {
            let bits = Bits::from_mask(&mask);
            let all = |m: &Mask| (0..m.height()).flat_map(|y| (0..m.width()).map(move |x| (i64::from(x), i64::from(y)))).collect::<Vec<_>>();
            let largest = all(&mask).into_iter().filter(|&(x, y)| mask.get(x, y)).map(|p| flood(&mask, p, true, &EIGHT).count()).max();
            let found = bits.largest_component().to_mask();
            prop_assert_eq!(found.count(), largest.unwrap_or(0));
            if let Some(&p) = all(&found).iter().find(|&&(x, y)| found.get(x, y)) {
                prop_assert_eq!(flood(&mask, p, true, &EIGHT), found);
            }
            let (w, h) = (i64::from(mask.width()), i64::from(mask.height()));
            let mut outside = Mask::new(mask.width(), mask.height());
            for (x, y) in all(&mask).into_iter().filter(|&(x, y)| x == 0 || y == 0 || x == w - 1 || y == h - 1) {
                if !mask.get(x, y) && !outside.get(x, y) {
                    outside = outside.zip(&flood(&mask, (x, y), false, &FOUR), |a, b| a || b);
                }
            }
            prop_assert_eq!(bits.fill_holes().not().to_mask(), outside);
        }
    }

    #[test]
    fn a_rings_outline_is_its_border() {
        let square = Mask::from_fn(70, 9, |x, y| (2..68).contains(&x) && (2..7).contains(&y));
        assert_eq!(Bits::from_mask(&square).outline().count(), 2 * 66 + 2 * 3);
        let full = Mask::from_fn(70, 9, |_, _| true);
        assert_eq!(Bits::from_mask(&full).outline().count(), 2 * 70 + 2 * 7);
    }
}
