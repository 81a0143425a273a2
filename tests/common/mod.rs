//! What the tests that draw share: the software driver, or a visible skip, and trees made in code.
#![allow(dead_code, unused_imports)] // each test program uses its share

// What `testing.rs` takes from its parent, which is `sphereboard::gpu` in the library's own tests.
use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::render::Renderer;

pub mod props;
#[path = "../../src/gpu/testing.rs"]
mod testing;

pub use testing::{skip, software_gpu};

/// A renderer on [`software_gpu`].
pub fn software_renderer() -> Option<Renderer> {
    software_gpu().map(|gpu| Renderer::new(gpu).expect("the software driver takes every pipeline"))
}
