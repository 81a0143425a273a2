//! From evidence per pixel to one crown: the region whose shape and colours agree best.

use super::features::Scene;
use super::star::Star;

/// The crown in the reduced photograph.
pub fn crown(scene: &Scene, logits: &[f32]) -> Vec<bool> {
    let small = &scene.small;
    let evidence: Vec<f32> = logits.iter().map(|v| if v.abs() > 10.0 { *v } else { v.clamp(-3.0, 3.0) }).collect();
    let env = |n: &str, d: f32| std::env::var(n).ok().and_then(|v| v.parse().ok()).unwrap_or(d);
    let best = centres(scene, &evidence)
        .into_iter()
        .map(|c| Star::fit(small, &evidence, c, env("STIFF", 2.0)))
        .max_by(|a, b| a.worth.total_cmp(&b.worth));
    best.map_or_else(|| vec![false; small.len()], |s| s.fill(small))
}

/// Candidate centres: a grid over the bulk of the positive evidence.
fn centres(scene: &Scene, evidence: &[f32]) -> Vec<(f32, f32)> {
    let small = &scene.small;
    let mut out = Vec::new();
    for gy in 0..7 {
        for gx in 0..7 {
            let (x, y) = ((0.2 + 0.1 * gx as f32) * small.width as f32, (0.2 + 0.1 * gy as f32) * small.height as f32);
            if evidence[y as usize * small.width + x as usize] > 0.0 {
                out.push((x, y));
            }
        }
    }
    out
}
