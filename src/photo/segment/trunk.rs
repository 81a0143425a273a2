//! The trunk below the crown (ours: She models it by hand): the straight, nearly upright strip from the crown's base to the ground whose
//! colour differs most from what is left and right of it. Pixels, y down.

use image::RgbImage;
use rayon::prelude::*;

use super::bits::Bits;
use super::small::Small;
use crate::raster::Mask;

/// Long side of the picture in which the trunk is looked for: a slender trunk is still some pixels wide.
const LONG_SIDE_PX: u32 = 512;
/// Rows above and below that are averaged before colours are compared: bark goes on downwards, leaves and grass do not.
const BLUR_ROWS: usize = 3;
/// Colour difference (ΔE) to both sides from which a row speaks for a trunk, and the most that counts.
const CLEAR: f32 = 8.0;
const CLEAREST: f32 = 26.0;
/// Weight of rows within the crown, where leaves hide the bark.
const IN_CROWN: f32 = 0.9;
/// Part of the crown's height above its base in which its trunk may already show.
const INSIDE: f32 = 0.4;
/// Sideways steps per row that are tried: up to 17° to both sides.
const SLOPES: std::ops::RangeInclusive<i32> = -10..=10;
const SLOPE_STEP: f32 = 0.03;
/// Usual width of a trunk in crown widths, and the widest.
const USUAL_WIDTH: f32 = 0.05;
const WIDEST: f32 = 0.16;
/// Width in trunk widths up to which the lower end of a crown is a trunk with its bark and its root flare.
const STALK: f32 = 3.0;

/// A straight trunk, pixels of the photograph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strip {
    /// Middle of its upper end.
    top: [f32; 2],
    /// Middle of its foot.
    foot: [f32; 2],
    width: f32,
}

/// The trunk below a crown; `None` when no strip stands out.
pub fn find(image: &RgbImage, crown: &Mask) -> Option<Strip> {
    let small = Small::with_long_side(image, LONG_SIDE_PX);
    let inside = Small::new_mask(crown, &small);
    let place = Place::of(&small, &inside)?;
    let sums = row_sums(&small, place.rows.0);
    let widest = ((place.width * WIDEST) as usize).max(3);
    let mut widths: Vec<usize> = (0..12).map(|i| (2.0 * (widest as f32 / 2.0).powf(i as f32 / 11.0)).round() as usize).collect();
    widths.dedup();
    let best = widths.par_iter().filter_map(|&w| place.best_line(&small, &inside, &sums, w)).collect::<Vec<_>>();
    let line = best.into_iter().max_by(|a, b| a.score.total_cmp(&b.score))?;
    let scale = image.width() as f32 / small.width as f32;
    let line = place.fit_width(&sums, line);
    let at = |y: usize| [(line.x_at(place.anchor, y) + if line.width % 2 == 1 { 0.5 } else { 0.0 }) * scale, y as f32 * scale];
    Some(Strip { top: at(line.top), foot: at(line.foot + 1), width: line.width as f32 * scale })
}

/// Where a trunk is looked for in the reduced picture.
struct Place {
    /// The crown's median column, and its width.
    axis: f32,
    width: f32,
    /// First and one past the last row.
    rows: (usize, usize),
    /// The crown's lowest row.
    anchor: usize,
    crown_height: f32,
}

/// A candidate.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// Middle at the anchor row, and sideways pixels per row.
    x: f32,
    slope: f32,
    width: usize,
    top: usize,
    foot: usize,
    score: f32,
}

impl Line {
    fn x_at(&self, anchor: usize, y: usize) -> f32 {
        self.x + self.slope * (y as f32 - anchor as f32)
    }
}

/// Sums of L*a*b* along each row, from the row `first` on, averaged over neighbouring rows; one more column than the picture.
fn row_sums(small: &Small, first: usize) -> Vec<Vec<[f32; 3]>> {
    (first..small.height)
        .into_par_iter()
        .map(|y| {
            let (top, bottom) = (y.saturating_sub(BLUR_ROWS).max(first), (y + BLUR_ROWS + 1).min(small.height));
            let mut sums = vec![[0.0f32; 3]; small.width + 1];
            for x in 0..small.width {
                let mean = |c: usize| (top..bottom).map(|v| small.lab[v * small.width + x][c]).sum::<f32>() / (bottom - top) as f32;
                sums[x + 1] = std::array::from_fn(|c| sums[x][c] + mean(c));
            }
            sums
        })
        .collect()
}

/// How much a column of `2 half + 1` pixels differs from both its flanks at a row: the smaller of the two colour differences.
pub fn ridge(small: &Small, x: usize, y: usize, half: usize) -> f32 {
    let row = &small.lab[y * small.width..(y + 1) * small.width];
    let mean = |from: i64, to: i64| -> Option<[f32; 3]> {
        (from >= 0 && to <= small.width as i64 && from < to).then(|| {
            let part = &row[from as usize..to as usize];
            [0, 1, 2].map(|c: usize| part.iter().map(|p| p[c]).sum::<f32>() / part.len() as f32)
        })
    };
    let (x, half) = (x as i64, half as i64);
    let Some(middle) = mean(x - half, x + half + 1) else { return 0.0 };
    let flank = |side: Option<[f32; 3]>| side.map_or(0.0, |s| (0..3).map(|c| (s[c] - middle[c]).powi(2)).sum::<f32>().sqrt());
    flank(mean(x - 3 * half - 1, x - half)).min(flank(mean(x + half + 1, x + 3 * half + 2)))
}

/// How far a colour is from any bark's: green beyond moss or blue, as lawn, leaves and sky between two trunks are. ΔE.
fn unlike_bark([_, a, b]: [f32; 3]) -> f32 {
    (-a - 5.0).max(0.0) + (-b - 8.0).max(0.0)
}

/// How much `width` pixels around the middle `x` differ from both flanks: the smaller of the two colour differences.
fn contrast(sums: &[[f32; 3]], x: usize, width: usize) -> f32 {
    let flank = width.clamp(2, 8);
    let left = x as i64 - (width / 2) as i64;
    let mean = |from: i64, to: i64| -> Option<[f32; 3]> {
        let (a, b) = (sums.get(usize::try_from(from).ok()?)?, sums.get(usize::try_from(to).ok()?)?);
        Some([0, 1, 2].map(|c| (b[c] - a[c]) / (to - from) as f32))
    };
    let right = left + width as i64;
    let Some(middle) = mean(left, right) else { return 0.0 };
    let differs = |side: Option<[f32; 3]>| side.map_or(0.0, |s| (0..3).map(|c| (s[c] - middle[c]).powi(2)).sum::<f32>().sqrt());
    let clear = differs(mean(left - flank as i64, left)).min(differs(mean(right, right + flank as i64)));
    clear - unlike_bark(middle)
}

impl Place {
    fn of(small: &Small, crown: &[bool]) -> Option<Self> {
        let mut columns: Vec<usize> = (0..small.count()).filter(|&i| crown[i]).map(|i| i % small.width).collect();
        let top = crown.iter().position(|&c| c)? / small.width;
        let anchor = crown.iter().rposition(|&c| c)? / small.width;
        columns.sort_unstable();
        // Single twigs do not make a crown wider.
        let at = |q: f32| columns[((columns.len() - 1) as f32 * q) as usize] as f32;
        let crown_height = (anchor - top + 1) as f32;
        let first = anchor - (INSIDE * crown_height) as usize;
        Some(Self { axis: at(0.5), width: at(0.98) - at(0.02) + 1.0, rows: (first, small.height), anchor, crown_height })
    }

    /// The best strip of one width.
    fn best_line(&self, small: &Small, crown: &[bool], sums: &[Vec<[f32; 3]>], width: usize) -> Option<Line> {
        let evidence: Vec<f32> = (self.rows.0..self.rows.1)
            .flat_map(|y| (0..small.width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let v = contrast(&sums[y - self.rows.0], x, width).min(CLEAREST) - CLEAR;
                if crown[y * small.width + x] { (IN_CROWN * v).max(-0.4 * CLEAR) } else { v }
            })
            .collect();
        let reach = (0.3 * self.width).max(2.0);
        let (from, to) = ((self.axis - reach).max(0.0) as usize, ((self.axis + reach) as usize).min(small.width - 1));
        let lines = SLOPES.flat_map(|s| (from..=to).map(move |x| (s as f32 * SLOPE_STEP, x as f32)));
        let scored = lines
            .filter_map(|(slope, x)| self.score(small, crown, &evidence, Line { x, slope, width, top: 0, foot: 0, score: 0.0 }));
        scored.max_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// The line with the width and place that have the greatest contrast: a wider strip is mixed with what stands beside the trunk, and
    /// the flanks of a narrower one are bark.
    fn fit_width(&self, sums: &[Vec<[f32; 3]>], line: Line) -> Line {
        // Half a width aside: of a trunk lit from the side, the bright half alone is the best strip of its own width.
        let reach = (line.width / 2) as i32;
        let widths =
            ((line.width / 2).max(2)..=2 * line.width).flat_map(|width| (-reach..=reach).map(move |shift| (width, shift as f32)));
        let fitted = widths.map(|(width, shift)| {
            let moved = Line { x: line.x + shift, width, ..line };
            let rows = moved.top..=moved.foot;
            let sum: f32 =
                rows.map(|y| contrast(&sums[y - self.rows.0], moved.x_at(self.anchor, y).round().max(0.0) as usize, width)).sum();
            (sum, moved)
        });
        fitted.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(line, |(_, moved)| moved)
    }

    /// Where the line's evidence begins and ends, and its sum times how usual such a trunk is.
    fn score(&self, small: &Small, crown: &[bool], evidence: &[f32], line: Line) -> Option<Line> {
        let (mut sum, mut top) = (0.0f32, self.rows.0);
        let mut best = line;
        for y in self.rows.0..self.rows.1 {
            let x = line.x_at(self.anchor, y).round();
            if x < 0.0 || x >= small.width as f32 {
                break;
            }
            let inside = crown[y * small.width + x as usize];
            sum += evidence[(y - self.rows.0) * small.width + x as usize];
            if sum <= 0.0 && inside {
                (sum, top) = (0.0, y);
            }
            if sum > best.score {
                best = Line { score: sum, top, foot: y, ..line };
            }
            if sum < best.score - 12.0 * CLEAR {
                break;
            }
        }
        if best.score <= 0.0 {
            return None;
        }
        let near = |d: f32, usual: f32| 1.0 / (1.0 + (d / usual).powi(2));
        let foot = line.x_at(self.anchor, best.foot);
        let prior = near((foot - self.axis) / self.width, 0.2)
            * near(line.slope, 0.15)
            * near((line.width as f32 / self.width / USUAL_WIDTH).ln(), 1.2);
        best.score *= prior;
        (best.score > 0.6 * CLEAR * 0.04 * self.crown_height).then_some(best)
    }
}

impl Strip {
    fn x_at(&self, y: f32) -> f32 {
        let t = (y - self.top[1]) / (self.foot[1] - self.top[1]).max(1.0);
        self.top[0] + t * (self.foot[0] - self.top[0])
    }

    /// The strip as pixels of a picture.
    pub fn draw(&self, (width, height): (u32, u32)) -> Bits {
        Bits::from_rows(width as usize, height as usize, |y, row| {
            let y = y as f32 + 0.5;
            if y < self.top[1] || y >= self.foot[1] {
                return;
            }
            let edge = |side: f32| (self.x_at(y) + 0.5 * side * self.width).round().clamp(0.0, width as f32) as usize;
            (edge(-1.0)..edge(1.0)).for_each(|x| row[x / 64] |= 1 << (x % 64));
        })
    }

    /// Gives the bare stalk at the crown's lower end to the trunk: rows in which the crown is hardly wider than this strip and beside it
    /// at most by its width.
    pub fn take_stalk(self, crown: &Bits) -> (Self, Bits) {
        let spans = crown.spans();
        let is_stalk = |y: usize| {
            let (x, widest) = (self.x_at(y as f32 + 0.5), STALK * self.width);
            let slim =
                |(a, b): (usize, usize)| (b - a) as f32 <= widest && a as f32 <= x + self.width && x - self.width <= b as f32;
            y as f32 >= self.top[1] && spans[y].is_some_and(slim)
        };
        let row = |span: &Option<_>| span.is_some();
        let (Some(top), Some(bottom)) = (spans.iter().position(row), spans.iter().rposition(row)) else {
            return (self, crown.clone());
        };
        // A crown that is stalk from its first row on would be nothing without it.
        let Some(end) = (top..=bottom).rev().find(|&y| !is_stalk(y)).map(|y| y + 1).filter(|&end| end <= bottom) else {
            return (self, crown.clone());
        };
        let foot_y = self.foot[1].max(bottom as f32 + 1.0);
        (Self { foot: [self.x_at(foot_y), foot_y], ..self }, crown.above(end).without_crumbs(super::CRUMB))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A crown of columns 8..`right` and rows 10..20 over a strip down column 10.
    fn taken(right: usize) -> Bits {
        let crown = Mask::from_fn(30, 30, |x, y| {
            (8..right as u32).contains(&x) && (10..20).contains(&y) || x == 10 && (20..24).contains(&y)
        });
        Strip { top: [10.5, 5.0], foot: [10.5, 24.0], width: 3.0 }.take_stalk(&Bits::from_mask(&crown)).1
    }

    #[test]
    fn the_stalk_below_a_crown_is_the_trunks_but_a_crown_that_is_nothing_else_stays() {
        assert_eq!(taken(28).count(), 200);
        assert_eq!(taken(12).count(), 44);
    }
}
