//! The trunk below the crown: the darkest or brightest narrow column that leads from the crown's base down to the ground.

use super::small::Small;

/// Adds the visible trunk to the crown, in the reduced photograph; nothing when no column stands out.
pub fn with_trunk(small: &Small, crown: &[bool]) -> Vec<bool> {
    let mut tree = crown.to_vec();
    let Some((left, right, bottom)) = extent(small, crown) else { return tree };
    let crown_width = right - left + 1;
    let widths = (1..=(crown_width / 14).max(2)).collect::<Vec<_>>();
    let best = widths
        .into_iter()
        .filter_map(|half| column(small, crown, (left, right, bottom), half))
        .max_by(|a, b| a.score.total_cmp(&b.score));
    let Some(column) = best else { return tree };
    for &(x, y) in &column.path {
        for px in x.saturating_sub(column.half)..=(x + column.half).min(small.width - 1) {
            tree[y * small.width + px] = true;
        }
    }
    tree
}

/// Leftmost and rightmost column and lowest row of the crown.
fn extent(small: &Small, crown: &[bool]) -> Option<(usize, usize, usize)> {
    let columns = || (0..small.count()).filter(|&i| crown[i]).map(|i| i % small.width);
    let bottom = (0..small.count()).rev().find(|&i| crown[i])? / small.width;
    Some((columns().min()?, columns().max()?, bottom))
}

/// A way down: middle columns row by row.
struct Column {
    half: usize,
    score: f32,
    path: Vec<(usize, usize)>,
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

/// The best way down from the crown for one width: a seam by dynamic programming, cut at its foot.
fn column(small: &Small, crown: &[bool], (left, right, bottom): (usize, usize, usize), half: usize) -> Option<Column> {
    /// Colour difference (ΔE) that a trunk shows to both sides.
    const CLEAR: f32 = 9.0;
    let third = (right - left) / 3;
    let (from, to) = (left + third, (right - third).max(left + third) + 1);
    let top = (0..=bottom).rev().find(|&y| (from..to).any(|x| crown[y * small.width + x]))?;
    let rows = small.height - top - 1;
    // Best sum of clearness over a seam that started under the crown and ends here.
    let mut sums = vec![0.0f32; to - from];
    let mut steps: Vec<Vec<i8>> = Vec::new();
    let mut best: (f32, usize, usize) = (0.0, 0, 0);
    for y in top + 1..top + 1 + rows {
        let mut next = vec![0.0; to - from];
        let mut step = vec![0i8; to - from];
        for x in 0..to - from {
            let lower = |dx: i8| (x as i64 + i64::from(dx)).try_into().ok().and_then(|i: usize| sums.get(i)).copied();
            let (value, dx) = [0i8, -1, 1]
                .into_iter()
                .filter_map(|dx| Some((lower(dx)? - 0.5 * f32::from(dx.abs()), dx)))
                .fold((f32::NEG_INFINITY, 0), |a, b| if b.0 > a.0 { b } else { a });
            let already = crown[y * small.width + x + from];
            next[x] = value + if already { 0.0 } else { (ridge(small, x + from, y, half) - CLEAR).clamp(-CLEAR, CLEAR) };
            step[x] = dx;
            if next[x] > best.0 {
                best = (next[x], x, y);
            }
        }
        sums = next;
        steps.push(step);
    }
    let (score, mut x, foot) = best;
    let mut path = Vec::new();
    for y in (top + 1..=foot).rev() {
        path.push((x + from, y));
        x = (x as i64 + i64::from(steps[y - top - 1][x])).clamp(0, (to - from) as i64 - 1) as usize;
    }
    // Shorter than wide is a stain, not a trunk.
    (path.len() > 2 * (2 * half + 1)).then_some(Column { half, score: score * (half as f32).sqrt(), path })
}
