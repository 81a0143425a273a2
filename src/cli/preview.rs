//! Previews of many models by one renderer, opened when the first is wanted.

use std::sync::{Mutex, PoisonError};

use image::RgbImage;

use crate::gpu::{AdapterChoice, Gpu};
use crate::model::TreeModel;
use crate::render::Renderer;
use crate::{Error, Result, report};

/// Draws one preview after the other, whichever thread asks.
pub struct Previews {
    adapter: AdapterChoice,
    renderer: Mutex<Opened>,
}

/// What became of opening the adapter.
enum Opened {
    NotYet,
    // Boxed: a renderer is large, and there is one at most.
    Here(Box<Renderer>),
    /// It failed with this message; nobody tries again.
    Failed(String),
}

impl Previews {
    /// Nothing is opened yet.
    pub fn new(adapter: AdapterChoice) -> Self {
        Self { adapter, renderer: Mutex::new(Opened::NotYet) }
    }

    /// A preview, or why there is none.
    pub fn draw(&self, model: &TreeModel) -> Result<RgbImage, String> {
        let mut opened = self.renderer.lock().unwrap_or_else(PoisonError::into_inner);
        if let Opened::NotYet = *opened {
            *opened = match Gpu::open(&self.adapter).and_then(Renderer::new) {
                Ok(renderer) => Opened::Here(Box::new(renderer)),
                Err(error) => Opened::Failed(error.to_string()),
            };
        }
        match &mut *opened {
            Opened::Here(renderer) => report::preview::preview(renderer, model).map_err(|e: Error| e.to_string()),
            Opened::Failed(why) => Err(why.clone()),
            Opened::NotYet => unreachable!("just opened"),
        }
    }
}
