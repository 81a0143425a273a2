//! Who culls faster on the adapter at hand, the processor or the device: measured at a few places along the path of the scene itself, until
//! the device knows what each shows, nothing drawn.

use serde::Serialize;

use super::drive::{Grove, shot};
use super::scene::Scene;
use super::trail::Trail;
use crate::render::{Batch, CullParams, Culling, Renderer};
use crate::{Error, Result};

/// Places along the path.
const PLACES: usize = 5;
/// How often each is asked: the first time pipelines are made and buffers grow.
const TURNS: usize = 4;

/// Who culls, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chosen {
    /// `cpu` or `compute`.
    pub by: Culling,
    /// What was asked for: `auto`, or one of the two.
    pub asked: Culling,
    /// Median milliseconds of a frame's culling by the processor; nothing where it was not measured.
    pub cpu_ms: Option<f64>,
    /// And by the device.
    pub compute_ms: Option<f64>,
    /// Why the device cannot, where it cannot.
    pub refused: Option<String>,
}

impl Default for Chosen {
    fn default() -> Self {
        Self { by: Culling::Cpu, asked: Culling::Auto, cpu_ms: None, compute_ms: None, refused: None }
    }
}

impl Chosen {
    /// In a sentence.
    pub fn sentence(&self) -> String {
        let who = if self.by == Culling::Compute { "the device" } else { "the processor" };
        let whose = if self.asked == Culling::Auto { "" } else { ", as it was told to" };
        match (self.cpu_ms, self.compute_ms, &self.refused) {
            (Some(cpu), Some(compute), _) => {
                format!("{who} culls{whose}: {cpu:.2} ms a frame by the processor, {compute:.2} ms by the device")
            }
            (.., Some(why)) => format!("{who} culls{whose}: {why}"),
            _ => format!("{who} culls{whose}"),
        }
    }
}

/// Measures both and sets whoever is faster in the scene, unless that says who culls. Batches but the indirect are for the processor.
///
/// # Errors
/// Those of [`Renderer::cull_ms`]; where it is the device's choice but not told to, that it cannot is none.
pub fn choose(renderer: &mut Renderer, grove: &mut Grove, scene: &mut Scene) -> Result<Chosen> {
    let cull = scene.file.culling.clone();
    let asked = cull.culling;
    let mut chosen = Chosen { asked, ..Chosen::default() };
    if cull.batch == Batch::Indirect {
        let mut measured = |culling| median_ms(renderer, grove, scene, &CullParams { culling, ..cull.clone() });
        chosen.cpu_ms = Some(measured(Culling::Cpu)?);
        match measured(Culling::Compute) {
            Ok(ms) => chosen.compute_ms = Some(ms),
            Err(error @ Error::ShaderRoom { .. }) if asked != Culling::Compute => chosen.refused = Some(error.to_string()),
            Err(error) => return Err(error),
        }
    }
    if asked == Culling::Auto {
        let faster = chosen.cpu_ms.zip(chosen.compute_ms).is_some_and(|(cpu, compute)| compute < cpu);
        scene.file.culling.culling = if faster { Culling::Compute } else { Culling::Cpu };
    }
    chosen.by = if scene.file.culling.on_device() { Culling::Compute } else { Culling::Cpu };
    Ok(chosen)
}

fn median_ms(renderer: &mut Renderer, grove: &mut Grove, scene: &Scene, cull: &CullParams) -> Result<f64> {
    let mut all = vec![];
    for turn in 0..TURNS {
        let mut trail = Trail::default();
        for place in 0..PLACES {
            let time_s = scene.path.length_s() * place as f32 / PLACES as f32;
            let look = scene.path.at(time_s);
            let mut shot = shot(scene, look, time_s, trail.follow(look.eye, time_s, &scene.file.levels), 0);
            // A still camera is culled once: every time it stands a little elsewhere.
            shot.camera.eye.y += 1e-3 * turn as f32;
            let ms = renderer.cull_ms(&shot, grove.world(cull, None))?;
            if turn > 0 {
                all.push(ms);
            }
        }
    }
    all.sort_by(f64::total_cmp);
    Ok(all[all.len() / 2])
}
