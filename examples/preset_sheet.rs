//! The contact sheet of the trees that come with the program: front, side, 45° above, bare wood; one row per preset, into
//! `results/local/sheets/presets.png`.
//!
//! `cargo run --release --example preset_sheet [FILE]`; `make sheets` runs it without arguments.

use std::path::{Path, PathBuf};

use image::RgbImage;
use rayon::prelude::*;
use sphereboard::model::grown::grow_preset;
use sphereboard::plant::presets::PRESETS;
use sphereboard::raster::{PngEffort, png_with};
use sphereboard::report::{draw, sheet};
use sphereboard::{Result, Seed, files};

/// Height of a row.
const ROW_PX: u32 = 240;

fn main() -> Result<()> {
    let out = std::env::args_os().nth(1).map_or_else(|| "results/local/sheets/presets.png".into(), PathBuf::from);
    let _folder = files::ready_folder(out.parent().unwrap_or(Path::new("")))?;
    let rows: Vec<RgbImage> =
        PRESETS.par_iter().map(|preset| sheet::grown_row(&grow_preset(preset, Seed(1))?.parts, ROW_PX)).collect::<Result<_>>()?;
    for (number, preset) in PRESETS.iter().enumerate() {
        println!("row {}: {}, {} leaf quads", number + 1, preset.common, preset.leaves);
    }
    files::write_whole(&out, &png_with(&draw::stacked(&rows, 6), PngEffort::Small)?)?;
    println!("{}", out.display());
    Ok(())
}
