//! What the photograph shows of the trunk: width, foot, neck and bark colour (ours: She models the trunk by hand). Pixels, y down.

use glam::DVec2;
use image::{GrayImage, Luma, RgbImage};
use imageproc::region_labelling::{Connectivity, connected_components};

use crate::raster::{Mask, Rect};

/// The visible trunk, pixels.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrunkCues {
    /// Where the trunk meets the ground, middle of its width.
    pub foot_px: DVec2,
    /// Where the trunk enters the crown, middle of its width.
    pub neck_px: DVec2,
    /// Median width.
    pub width_px: f64,
    /// Median bark colour, 8-bit sRGB.
    pub bark: [u8; 3],
}

/// The trunk in `tree` without `crown`, its colour from `photo`. `None` when no trunk shows below the crown's middle, or when the
/// three differ in size.
pub fn find(photo: &RgbImage, crown: &Mask, tree: &Mask) -> Option<TrunkCues> {
    if photo.dimensions() != (crown.width(), crown.height()) {
        return None;
    }
    let runs = runs(crown, tree)?;
    let (foot_px, neck_px, width_px) = shape(&runs);
    // The middle half of each run: its edges are mixed with what stands behind.
    let middle =
        |run: &Run| (run.from + run.width / 4..run.from + run.width - run.width / 4).map(|x| (x, run.y)).collect::<Vec<_>>();
    let bark_pixels: Vec<[u8; 3]> =
        runs.iter().flat_map(middle).filter_map(|(x, y)| photo.get_pixel_checked(x, y)).map(|p| p.0).collect();
    if bark_pixels.is_empty() {
        return None;
    }
    let median = |channel: usize| {
        let mut values: Vec<u8> = bark_pixels.iter().map(|p| p[channel]).collect();
        values.sort_unstable();
        values[values.len() / 2]
    };
    Some(TrunkCues { foot_px, neck_px, width_px, bark: [median(0), median(1), median(2)] })
}

/// Where the trunk enters the crown, middle of its width; `None` without a visible trunk. Both masks have one size.
pub(super) fn neck(crown: &Mask, tree: &Mask) -> Option<DVec2> {
    runs(crown, tree).map(|runs| shape(&runs).1)
}

/// One sampled row of the trunk: `width` pixels from column `from`.
struct Run {
    y: u32,
    from: u32,
    width: u32,
}

/// Foot, neck and median width of a trunk's runs, which are ordered from the top.
fn shape(runs: &[Run]) -> (DVec2, DVec2, f64) {
    let end = (runs.len() / 10).max(1);
    let middle = |part: &[Run]| part.iter().map(|r| f64::from(r.from) + 0.5 * f64::from(r.width)).sum::<f64>() / part.len() as f64;
    let mut widths: Vec<u32> = runs.iter().map(|r| r.width).collect();
    widths.sort_unstable();
    let foot = DVec2::new(middle(&runs[runs.len() - end..]), f64::from(runs[runs.len() - 1].y + 1));
    let neck = DVec2::new(middle(&runs[..end]), f64::from(runs[0].y));
    (foot, neck, f64::from(widths[widths.len() / 2]))
}

/// Longest side of the grid on which the trunk is looked for, pixels: a larger photograph is sampled at every second pixel, third, ….
const FINEST: u32 = 1000;

/// The longest run of each sampled row of the tallest connected part of the tree that is not crown, below the crown's middle.
fn runs(crown: &Mask, tree: &Mask) -> Option<Vec<Run>> {
    if (crown.width(), crown.height()) != (tree.width(), tree.height()) {
        return None;
    }
    let (crown_box, tree_box) = (crown.bounds()?, tree.bounds()?);
    let top = crown_box.y + crown_box.height / 2;
    let bottom = tree_box.y + tree_box.height;
    let window = Rect { x: tree_box.x, y: top, width: tree_box.width, height: bottom.checked_sub(top).filter(|&h| h > 0)? };
    let pitch = window.height.max(window.width).div_ceil(FINEST).max(1);
    let full = |x: u32, y: u32| (window.x + x * pitch + pitch / 2, window.y + y * pitch + pitch / 2);
    let bare = GrayImage::from_fn(window.width.div_ceil(pitch), window.height.div_ceil(pitch), |x, y| {
        let (x, y) = full(x, y);
        let (x, y) = (i64::from(x), i64::from(y));
        Luma([255 * u8::from(tree.get(x, y) && !crown.get(x, y))])
    });
    let labels = connected_components(&bare, Connectivity::Eight, Luma([0]));
    let label = tallest(&labels)?;
    let mut runs = Vec::new();
    for (y, row) in labels.rows().enumerate() {
        let row: Vec<bool> = row.map(|l| l.0[0] == label).collect();
        if let Some((from, width)) = longest_run(&row) {
            runs.push(Run { y: full(0, y as u32).1, from: window.x + from as u32 * pitch, width: width as u32 * pitch });
        }
    }
    // Less than this is the ragged edge between two masks, not a trunk.
    let visible = runs.len() as u32 * pitch >= 3.max(crown_box.height / 50);
    let slim = shape(&runs).2 <= 0.6 * f64::from(crown_box.width);
    (visible && slim).then_some(runs)
}

/// The label that spans the most rows, the lowest number among equals; `None` when all is background.
fn tallest(labels: &image::ImageBuffer<Luma<u32>, Vec<u32>>) -> Option<u32> {
    let count = *labels.as_raw().iter().max()? as usize;
    let mut spans = vec![(u32::MAX, 0); count + 1];
    for (_, y, label) in labels.enumerate_pixels() {
        let span = &mut spans[label.0[0] as usize];
        *span = (span.0.min(y), span.1.max(y));
    }
    (1..=count).rev().max_by_key(|&l| spans[l].1 - spans[l].0).map(|l| l as u32)
}

/// First index and length of the longest run of `true`.
fn longest_run(row: &[bool]) -> Option<(usize, usize)> {
    let mut best: Option<(usize, usize)> = None;
    let mut start = 0;
    for i in 0..=row.len() {
        if i == row.len() || !row[i] {
            if i > start && best.is_none_or(|(_, length)| i - start > length) {
                best = Some((start, i - start));
            }
            start = i + 1;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    fn crown_and_tree() -> (Mask, Mask) {
        let crown = Mask::from_fn(60, 80, |x, y| (x as f64 - 30.0).hypot(y as f64 - 25.0) < 20.0);
        let trunk = Mask::from_fn(60, 80, |x, y| (27..33).contains(&x) && (30..70).contains(&y));
        let tree = crown.zip(&trunk, |a, b| a || b);
        (crown, tree)
    }

    #[test]
    fn a_plain_trunk_is_measured_exactly() {
        let (crown, tree) = crown_and_tree();
        let photo = RgbImage::from_fn(60, 80, |x, _| if (28..32).contains(&x) { Rgb([90, 70, 50]) } else { Rgb([10, 200, 10]) });
        let cues = find(&photo, &crown, &tree).unwrap();
        assert_eq!((cues.foot_px, cues.width_px, cues.bark), (DVec2::new(30.0, 70.0), 6.0, [90, 70, 50]));
        assert!((cues.neck_px.x - 30.0).abs() < 0.51 && (44.0..46.0).contains(&cues.neck_px.y), "{cues:?}");
    }

    #[test]
    fn a_large_photograph_is_sampled_and_gives_the_same_trunk() {
        let disc = |x: u32, y: u32| (f64::from(x) - 1000.0).hypot(f64::from(y) - 800.0) < 700.0;
        let crown = Mask::from_fn(2000, 2600, disc);
        let tree = Mask::from_fn(2000, 2600, |x, y| disc(x, y) || ((900..1100).contains(&x) && (800..2500).contains(&y)));
        let cues = find(&RgbImage::new(2000, 2600), &crown, &tree).unwrap();
        assert!(cues.foot_px.distance(DVec2::new(1000.0, 2500.0)) < 3.0 && (cues.width_px - 200.0).abs() < 3.0, "{cues:?}");
    }

    #[test]
    fn no_trunk_no_cues() {
        let (crown, _) = crown_and_tree();
        let photo = RgbImage::new(60, 80);
        assert_eq!(find(&photo, &crown, &crown), None);
        assert_eq!(find(&photo, &Mask::new(60, 80), &Mask::new(60, 80)), None);
        assert_eq!(find(&photo, &crown, &Mask::new(3, 3)), None);
    }
}
