//! How far a stand-in is from the truth in one picture.

use serde::{Deserialize, Serialize};

use crate::Result;
use crate::metrics::{
    covered_area_error, depth_rms_m, flip, hausdorff_px, mean_color_difference, silhouette, silhouette_iou, ssim,
};

use super::staging::{BACKGROUNDS, Seen, cropped, window};

/// A column of the report: what it is called, its unit, what it means, and whether less is better.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Column {
    /// Its name in tables and files.
    pub id: &'static str,
    /// For people.
    pub name: &'static str,
    /// Unit; empty for pure numbers.
    pub unit: &'static str,
    /// One sentence.
    pub meaning: &'static str,
    /// How it is read from [`Figures`].
    #[serde(skip)]
    pub of: fn(&Figures) -> f64,
}

/// Every figure of error, in the order of the tables: the report's columns, the file's, and the tests' are these.
pub const COLUMNS: &[Column] = &[
    Column {
        id: "flip",
        name: "FLIP, mean",
        unit: "",
        meaning: "what a person sees who flickers between the two, 0 to 1",
        of: |f| f.flip,
    },
    Column {
        id: "flip_p99",
        name: "FLIP, 99 %",
        unit: "",
        meaning: "99 % of the pixels differ by this or less",
        of: |f| f.flip_p99,
    },
    Column { id: "dissimilarity", name: "1 − SSIM", unit: "", meaning: "how unlike the patterns are", of: |f| f.dissimilarity },
    Column {
        id: "silhouette",
        name: "1 − IoU",
        unit: "",
        meaning: "share of both silhouettes that is only one's",
        of: |f| f.silhouette,
    },
    Column {
        id: "hausdorff_px",
        name: "Hausdorff",
        unit: "px",
        meaning: "how far the outline is off where it is farthest",
        of: |f| f.hausdorff_px,
    },
    Column {
        id: "area",
        name: "|Δ area|",
        unit: "",
        meaning: "how much more or less it covers, in parts of the truth",
        of: |f| f.area.abs(),
    },
    Column { id: "delta_e", name: "ΔE2000", unit: "", meaning: "difference of the mean colours", of: |f| f.delta_e },
    Column {
        id: "depth_pct",
        name: "depth",
        unit: "% of height",
        meaning: "RMS difference of depth where both are seen",
        of: |f| f.depth_pct,
    },
];

/// Errors of one picture; 0 is perfect in all of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Mean FLIP, over both backgrounds.
    pub flip: f64,
    /// 99th percentile of FLIP, the worse of both backgrounds.
    pub flip_p99: f64,
    /// 1 − SSIM, over both backgrounds.
    pub dissimilarity: f64,
    /// 1 − intersection over union of the silhouettes.
    pub silhouette: f64,
    /// Hausdorff distance of the silhouettes, pixels; the picture's diagonal where only one has any.
    pub hausdorff_px: f64,
    /// Covered area: above 0 too much, below too little, in parts of the truth; 1 where the truth covers nothing.
    pub area: f64,
    /// CIEDE2000 of the mean colours; 100 where only one has any.
    pub delta_e: f64,
    /// RMS of depth over common pixels, percent of the tree's height; 100 where there are none.
    pub depth_pct: f64,
}

impl Figures {
    /// Holds `test` against `truth` within the box around what is there of the truth, and a margin.
    ///
    /// # Errors
    /// [`UnlikeSizes`](crate::Error::UnlikeSizes).
    pub fn of(truth: &Seen, test: &Seen, height_m: f32) -> Result<Self> {
        let part = window(truth);
        let [truth, test] = [truth, test].map(|seen| cropped(seen, part));
        let mut figures = Self::default();
        for background in 0..BACKGROUNDS.len() {
            let [a, b] = [&truth, &test].map(|seen| seen.over(background));
            let (seen, share) = (flip(&a, &b)?, 1.0 / BACKGROUNDS.len() as f64);
            figures.flip += share * seen.mean;
            figures.flip_p99 = figures.flip_p99.max(seen.p99);
            figures.dissimilarity += share * (1.0 - ssim(&a, &b)?);
        }
        let [a, b] = [&truth, &test].map(|seen| silhouette(&seen.color));
        figures.silhouette = 1.0 - silhouette_iou(&a, &b)?;
        let diagonal_px = f64::from(part[2]).hypot(f64::from(part[3]));
        figures.hausdorff_px = hausdorff_px(&a, &b)?.min(diagonal_px);
        figures.area = covered_area_error(&a, &b).min(1.0);
        let nothing = a.count() == 0 && b.count() == 0;
        let or = |found: Option<f64>| found.unwrap_or(if nothing { 0.0 } else { 100.0 });
        figures.delta_e = or(mean_color_difference(&truth.color, &test.color));
        figures.depth_pct = or(depth_rms_m(&truth.depth_m, &test.depth_m)?.map(|m| 100.0 * m / f64::from(height_m)));
        Ok(figures)
    }

    /// The mean of each figure.
    pub fn mean(all: &[Self]) -> Self {
        let of = |get: fn(&Self) -> f64| all.iter().map(get).sum::<f64>() / all.len().max(1) as f64;
        Self {
            flip: of(|f| f.flip),
            flip_p99: of(|f| f.flip_p99),
            dissimilarity: of(|f| f.dissimilarity),
            silhouette: of(|f| f.silhouette),
            hausdorff_px: of(|f| f.hausdorff_px),
            area: of(|f| f.area),
            delta_e: of(|f| f.delta_e),
            depth_pct: of(|f| f.depth_pct),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgba, RgbaImage};

    /// A crown on a stem with branches, mottled, farther away towards the right.
    fn tree(branch: bool) -> Seen {
        let there = |x: i32, y: i32| {
            let crown = (x - 60).pow(2) + (y - 45).pow(2) < 900 && (x * 7 + y * 13) % 11 > 1;
            let stem = (57..63).contains(&x) && (45..115).contains(&y);
            crown || stem || branch && (85..105).contains(&x) && (38..44).contains(&y)
        };
        let color = RgbaImage::from_fn(120, 120, |x, y| {
            let shade = ((x / 3 + y / 5) % 4) as u8;
            if there(x as i32, y as i32) { Rgba([60 + 12 * shade, 90 + 10 * shade, 40, 255]) } else { Rgba([0; 4]) }
        });
        let depth_m = color.enumerate_pixels().map(|(x, _, p)| if p.0[3] > 0 { 20.0 + 0.02 * x as f32 } else { f32::INFINITY });
        Seen { depth_m: depth_m.collect(), color }
    }

    fn changed(seen: &Seen, from: impl Fn(u32, u32) -> (u32, u32), by: f32) -> Seen {
        let color = RgbaImage::from_fn(120, 120, |x, y| {
            let (x, y) = from(x, y);
            let [r, g, b, a] = seen.color.get_pixel(x.min(119), y.min(119)).0;
            let [r, g, b] = [r, g, b].map(|v| (by * f32::from(v)) as u8);
            Rgba([r, g, b, a])
        });
        let at = |i: usize| from(i as u32 % 120, i as u32 / 120);
        let depth_m = (0..14_400).map(|i| seen.depth_m[(at(i).1.min(119) * 120 + at(i).0.min(119)) as usize]).collect();
        Seen { color, depth_m }
    }

    #[test]
    fn the_truth_itself_has_no_error() {
        assert_eq!(Figures::of(&tree(true), &tree(true), 10.0).unwrap(), Figures::default());
    }

    /// Shifted by a pixel, 5 % darker, mirrored, a branch missing: the figures that should notice do.
    #[test]
    fn every_planted_fault_is_noticed() {
        let truth = tree(true);
        let shifted = Figures::of(&truth, &changed(&truth, |x, y| (x.saturating_sub(1), y), 1.0), 10.0).unwrap();
        assert!(shifted.flip > 0.01 && shifted.silhouette > 0.02 && shifted.hausdorff_px >= 1.0, "{shifted:?}");
        let darker = Figures::of(&truth, &changed(&truth, |x, y| (x, y), 0.95), 10.0).unwrap();
        assert!(darker.flip > 0.005 && darker.delta_e > 0.8 && darker.silhouette == 0.0, "{darker:?}");
        let mirrored = Figures::of(&truth, &changed(&truth, |x, y| (119 - x, y), 1.0), 10.0).unwrap();
        assert!(mirrored.flip > 0.03 && mirrored.hausdorff_px > 10.0 && mirrored.depth_pct > 1.0, "{mirrored:?}");
        let missing = Figures::of(&truth, &tree(false), 10.0).unwrap();
        assert!(missing.hausdorff_px > 10.0 && missing.area < -0.02 && missing.silhouette > 0.02, "{missing:?}");
    }

    #[test]
    fn nothing_against_something_is_as_bad_as_it_gets_and_finite() {
        let nothing = Seen { color: RgbaImage::new(120, 120), depth_m: vec![f32::INFINITY; 14_400] };
        for (a, b) in [(&tree(true), &nothing), (&nothing, &tree(true))] {
            let figures = Figures::of(a, b, 10.0).unwrap();
            assert!(figures.silhouette == 1.0 && figures.delta_e == 100.0 && COLUMNS.iter().all(|c| (c.of)(&figures).is_finite()));
        }
        assert_eq!(Figures::of(&nothing, &nothing, 10.0).unwrap(), Figures::default());
    }
}
