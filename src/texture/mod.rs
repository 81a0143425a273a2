//! From the exemplar to a virtual texture over every polygon, and on to one baked atlas per crown (She §3.2, fig. 10–12).
//!
//! [`synthesize`] gives every polygon its own block of the exemplar (or, with `--front photo`, of the photograph) by extension and
//! matching; [`bake`] joins the blocks along minimum-error cuts into one continuous chart. Polygons in metres, blocks in texels.

mod bake;
mod chart;
mod cut;
mod flat;
mod front;
mod gaps;
mod grain;
mod matching;
mod measure;
mod relax;
mod synth;
#[cfg(test)]
mod test_shapes;

pub use bake::{Atlas, BakeParams, bake, shares, texels_per_m};
pub use front::Front;
pub use synth::{Block, BlockSource, Counts, FrontChoice, SynthParams, VirtualTexture, synthesize};
