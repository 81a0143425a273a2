//! The graphics device: choosing an adapter, loading shaders, the structs that shaders mirror, reading pictures back, timing.
//!
//! Knows nothing of trees. Headless first: a window hands in its surface only where one is wanted.

mod adapter;
mod buffer;
pub mod layout;
mod readback;
mod shader;
mod survey;
#[cfg(test)]
pub mod testing;
mod texture;
mod timing;

pub use adapter::{AdapterChoice, Gpu, instance};
pub use buffer::{Changes, KeptBuffer, storage_layout, upload_buffer};
pub use readback::{read_buffer, read_texture};
pub use shader::{SHADERS, Shader, VARIANTS, assemble, assemble_for};
pub use survey::{Found, survey};
pub use texture::{Target, target, upload_mips};
pub use timing::PassClock;
