//! What the tests that draw share: the software driver, or a visible skip.

use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::render::Renderer;

/// A renderer on the software driver, whose pictures are the same everywhere; `None`, said aloud, where it is not installed.
///
/// # Panics
/// Where it is not installed and `SPHEREBOARD_REQUIRE_GPU` is set.
pub fn software_renderer() -> Option<Renderer> {
    match Gpu::open(&AdapterChoice::Software) {
        Ok(gpu) => Some(Renderer::new(gpu).expect("the software driver takes every pipeline")),
        Err(why) => {
            let required = std::env::var_os("SPHEREBOARD_REQUIRE_GPU").is_some_and(|v| v != "0");
            assert!(!required, "SPHEREBOARD_REQUIRE_GPU is set, but {why}");
            eprintln!("SKIPPED: no graphics adapter ({why}); install mesa-vulkan-drivers");
            None
        }
    }
}
