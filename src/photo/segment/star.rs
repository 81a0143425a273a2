//! The best star-shaped region: one boundary radius per direction, found by dynamic programming around a circle.

use super::small::Small;

/// Directions around the centre.
const DIRECTIONS: usize = 128;
/// Radii along each direction.
const RADII: usize = 96;
/// Largest change of radius, in steps, between neighbouring directions.
const JUMP: usize = 10;

/// A star-shaped region of the reduced photograph.
#[derive(Debug, Clone)]
pub struct Star {
    /// Centre, pixels.
    pub centre: (f32, f32),
    /// Radius in each direction, pixels; direction 0 points right, going clockwise in the picture.
    pub radius: Vec<f32>,
    /// Evidence inside less boundary length: what it maximises.
    pub worth: f32,
}

impl Star {
    /// Maximises Σ evidence inside − `stiffness` × Σ |change of radius|. `evidence` is log-odds per pixel; what lies outside the
    /// picture counts slightly against.
    pub fn fit(small: &Small, evidence: &[f32], centre: (f32, f32), stiffness: f32) -> Self {
        let step = (small.width as f32).hypot(small.height as f32) * 0.75 / RADII as f32;
        let turn = std::f32::consts::TAU / DIRECTIONS as f32;
        let gain = gains(small, evidence, centre, step, turn);
        // Twice around: the first and the last half turn only settle the start, the middle turn is closed.
        let turns = 2 * DIRECTIONS;
        let mut best = gain[..RADII].to_vec();
        let mut from = vec![0u8; turns * RADII];
        for d in 1..turns {
            let gain = &gain[d % DIRECTIONS * RADII..][..RADII];
            let mut next = vec![0.0; RADII];
            for (k, value) in next.iter_mut().enumerate() {
                let (mut top, mut arg) = (f32::NEG_INFINITY, k);
                for j in k.saturating_sub(JUMP)..=(k + JUMP).min(RADII - 1) {
                    let v = best[j] - stiffness * step * j.abs_diff(k) as f32;
                    if v > top {
                        (top, arg) = (v, j);
                    }
                }
                *value = top + gain[k];
                from[d * RADII + k] = arg as u8;
            }
            best = next;
        }
        let mut k = (0..RADII).max_by(|&a, &b| best[a].total_cmp(&best[b])).unwrap_or(0);
        let mut index = vec![0; DIRECTIONS];
        for d in (1..turns).rev() {
            if d < DIRECTIONS + DIRECTIONS / 2 && d >= DIRECTIONS / 2 {
                index[d % DIRECTIONS] = k;
            }
            k = from[d * RADII + k] as usize;
        }
        let worth = (0..DIRECTIONS)
            .map(|d| gain[d * RADII + index[d]] - stiffness * step * index[d].abs_diff(index[(d + 1) % DIRECTIONS]) as f32)
            .sum();
        Self { centre, radius: index.iter().map(|&k| (k + 1) as f32 * step).collect(), worth }
    }

    /// The pixels inside.
    pub fn fill(&self, small: &Small) -> Vec<bool> {
        (0..small.len())
            .map(|i| {
                let (dx, dy) = ((i % small.width) as f32 + 0.5 - self.centre.0, (i / small.width) as f32 + 0.5 - self.centre.1);
                let turn = dy.atan2(dx).rem_euclid(std::f32::consts::TAU) / std::f32::consts::TAU * DIRECTIONS as f32;
                let (d, t) = (turn as usize % DIRECTIONS, turn.fract());
                dx.hypot(dy) <= self.radius[d] * (1.0 - t) + self.radius[(d + 1) % DIRECTIONS] * t
            })
            .collect()
    }
}

/// Evidence inside the sector up to each radius, direction by direction.
fn gains(small: &Small, evidence: &[f32], centre: (f32, f32), step: f32, turn: f32) -> Vec<f32> {
    let mut gain = vec![0.0; DIRECTIONS * RADII];
    for (d, gain) in gain.chunks_exact_mut(RADII).enumerate() {
        let (sin, cos) = (d as f32 * turn).sin_cos();
        let mut sum = 0.0;
        for (k, value) in gain.iter_mut().enumerate() {
            let r = (k as f32 + 0.5) * step;
            let (x, y) = ((centre.0 + r * cos).floor(), (centre.1 + r * sin).floor());
            let inside = x >= 0.0 && y >= 0.0 && x < small.width as f32 && y < small.height as f32;
            let e = if inside { evidence[y as usize * small.width + x as usize] } else { -0.5 };
            sum += e * r * step * turn;
            *value = sum;
        }
    }
    gain
}
