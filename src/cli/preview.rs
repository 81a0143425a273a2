//! Previews of many models by one renderer, opened when the first is wanted.

use std::sync::{Arc, Mutex, PoisonError, mpsc};

use image::RgbImage;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::gpu::{AdapterChoice, Gpu};
use crate::model::TreeModel;
use crate::render::Renderer;
use crate::{Error, Result, report};

/// Draws one preview after the other, whichever thread asks.
pub struct Previews {
    /// One thread of its own. Whoever asks for a preview is itself a worker of rayon's: drawing there, it would take up another photograph
    /// whenever it waited for others to help, and meet itself before the renderer.
    thread: ThreadPool,
    renderer: Arc<Mutex<Opened>>,
}

/// What became of opening the adapter.
enum Opened {
    NotYet(AdapterChoice),
    // Boxed: a renderer is large, and there is one at most.
    Here(Box<Renderer>),
    /// It failed with this message; nobody tries again.
    Failed(String),
}

impl Previews {
    /// Nothing is opened yet.
    ///
    /// # Errors
    /// [`Error::Internal`] when there is no thread to be had.
    pub fn new(adapter: AdapterChoice) -> Result<Self> {
        // A panic there, a mistake of ours, is then the loss of one preview.
        let thread = ThreadPoolBuilder::new().num_threads(1).panic_handler(|_| ()).build();
        let thread = thread.map_err(|cause| Error::Internal { stage: "setting up previews", what: cause.to_string() })?;
        Ok(Self { thread, renderer: Arc::new(Mutex::new(Opened::NotYet(adapter))) })
    }

    /// A preview, or why there is none.
    pub fn draw(&self, model: TreeModel) -> Result<RgbImage, String> {
        let (send, receive) = mpsc::channel();
        let renderer = self.renderer.clone();
        // Nobody is left to hear of it only when the program ends.
        self.thread.spawn(move || _ = send.send(renderer.lock().unwrap_or_else(PoisonError::into_inner).draw(&model)));
        receive.recv().unwrap_or_else(|_| Err("the thread that draws previews has ended".to_owned()))
    }
}

impl Opened {
    fn draw(&mut self, model: &TreeModel) -> Result<RgbImage, String> {
        if let Self::NotYet(adapter) = self {
            *self = match Gpu::open(adapter).and_then(Renderer::new) {
                Ok(renderer) => Self::Here(Box::new(renderer)),
                Err(error) => Self::Failed(error.to_string()),
            };
        }
        match self {
            Self::Here(renderer) => report::preview::preview(renderer, model).map_err(|e| e.to_string()),
            Self::Failed(why) => Err(why.clone()),
            Self::NotYet(_) => unreachable!("just opened"),
        }
    }
}
