//! Paints the sample photographs of `photos/`: a tree of leaf strokes on sky and lawn, with its exact mask.
//!
//! `cargo run --release --example paint_sample -- --out photos` writes, for an oak and a spruce, `painted_NAME.jpg`,
//! `painted_NAME_mask.png` (the crown, its gaps filled, as segmentation should find it) and `painted_NAME_gaps.png` (sky seen
//! through the crown). Same seed and size, same bytes.

mod painter;

use std::io::Cursor;
use std::path::{Path, PathBuf};

use clap::Parser;
use image::codecs::jpeg::JpegEncoder;
use painter::{Painting, Species};
use sphereboard::raster::Mask;
use sphereboard::{Seed, files};

/// Paints sample photographs of trees with their exact masks.
#[derive(Parser)]
struct Options {
    /// Other seeds give other trees.
    #[arg(long, default_value_t = 7)]
    seed: u64,
    /// Width of the pictures, pixels.
    #[arg(long, default_value_t = 600, value_parser = clap::value_parser!(u32).range(16..=8000))]
    width: u32,
    /// Height of the pictures, pixels; the tree grows with it.
    #[arg(long, default_value_t = 800, value_parser = clap::value_parser!(u32).range(16..=8000))]
    height: u32,
    /// Folder for the pictures.
    #[arg(long, default_value = "photos")]
    out: PathBuf,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = Options::parse();
    std::fs::create_dir_all(&options.out)?;
    for species in [Species::Oak, Species::Spruce] {
        let painting = painter::paint(species, Seed(options.seed), options.width, options.height);
        save(&painting, species.name(), &options.out)?;
    }
    Ok(())
}

fn save(painting: &Painting, name: &str, folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, 90).encode_image(&painting.image)?;
    files::write_whole(&folder.join(format!("painted_{name}.jpg")), &jpeg)?;
    for (kind, mask) in [("mask", &painting.crown), ("gaps", &painting.gaps)] {
        files::write_whole(&folder.join(format!("painted_{name}_{kind}.png")), &png(mask)?)?;
    }
    Ok(())
}

fn png(mask: &Mask) -> image::ImageResult<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    mask.to_gray().write_to(&mut bytes, image::ImageFormat::Png)?;
    Ok(bytes.into_inner())
}
