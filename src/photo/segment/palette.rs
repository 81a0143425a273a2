//! The picture's own palette: its colours and textures in a few groups, so that evidence about some pixels reaches all their likes.

use rayon::prelude::*;

/// Numbers that describe a pixel to the palette.
pub const CHANNELS: usize = 5;

/// Which group each pixel belongs to.
pub struct Palette {
    /// Group of each pixel.
    pub group: Vec<u8>,
    /// Number of groups.
    pub groups: usize,
}

impl Palette {
    /// k-means with a deterministic start: the first centre is the mean, each next one the sample farthest from all so far.
    pub fn new(pixels: &[[f32; CHANNELS]], groups: usize) -> Self {
        let samples: Vec<[f32; CHANNELS]> = pixels.iter().step_by((pixels.len() / 6000).max(1)).copied().collect();
        let mut centres = vec![mean(&samples, |_| true)];
        let mut nearest: Vec<f32> = samples.iter().map(|s| distance(s, &centres[0])).collect();
        while centres.len() < groups {
            let far = (0..samples.len()).max_by(|&a, &b| nearest[a].total_cmp(&nearest[b])).unwrap_or(0);
            centres.push(samples[far]);
            nearest.iter_mut().zip(&samples).for_each(|(n, s)| *n = n.min(distance(s, &samples[far])));
        }
        for _ in 0..8 {
            let owner: Vec<u8> = samples.iter().map(|s| closest(s, &centres)).collect();
            for (k, centre) in centres.iter_mut().enumerate() {
                if owner.contains(&(k as u8)) {
                    *centre = mean(&samples, |i| owner[i] == k as u8);
                }
            }
        }
        Self { group: pixels.par_iter().map(|p| closest(p, &centres)).collect(), groups }
    }

    /// For each pixel, the weighted mean of `values` over its group, drawn towards the overall mean by a pseudo-count.
    pub fn spread(&self, values: &[f32], weights: impl Fn(usize) -> f32) -> Vec<f32> {
        let (mut sums, mut totals) = (vec![0.0f64; self.groups], vec![0.0f64; self.groups]);
        for (i, (&g, &v)) in self.group.iter().zip(values).enumerate() {
            let w = f64::from(weights(i));
            sums[g as usize] += w * f64::from(v);
            totals[g as usize] += w;
        }
        let (sum, total) = (sums.iter().sum::<f64>(), totals.iter().sum::<f64>().max(1e-9));
        let prior = 0.002 * total;
        let means: Vec<f32> =
            (0..self.groups).map(|g| ((sums[g] + prior * sum / total) / (totals[g] + prior).max(1e-9)) as f32).collect();
        self.group.iter().map(|&g| means[g as usize]).collect()
    }
}

fn distance(a: &[f32; CHANNELS], b: &[f32; CHANNELS]) -> f32 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

fn closest(p: &[f32; CHANNELS], centres: &[[f32; CHANNELS]]) -> u8 {
    let mut best = (f32::INFINITY, 0);
    for (k, centre) in centres.iter().enumerate() {
        let d = distance(p, centre);
        if d < best.0 {
            best = (d, k as u8);
        }
    }
    best.1
}

fn mean(samples: &[[f32; CHANNELS]], belongs: impl Fn(usize) -> bool) -> [f32; CHANNELS] {
    let (mut sum, mut n) = ([0.0; CHANNELS], 0.0f32);
    for (_, s) in samples.iter().enumerate().filter(|(i, _)| belongs(*i)) {
        (0..CHANNELS).for_each(|c| sum[c] += s[c]);
        n += 1.0;
    }
    sum.map(|v| v / n.max(1.0))
}
