//! The contact sheet of every representation: rows are methods, the tree itself first, columns are distances and elevations. Of a preset it
//! belongs to `results/`, of anybody's file to `results/local/`.
//!
//! `cargo run --release --example method_sheet [TREE] [FILE] [METHOD…]`; `make sheets` runs it without arguments: the oak, into
//! `results/local/sheets/methods.oak.png`. A FILE that ends in `.jpg` becomes a JPEG.

use std::path::{Path, PathBuf};

use image::RgbImage;
use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::raster::{PngEffort, jpeg, png_with};
use sphereboard::render::Renderer;
use sphereboard::report::{draw, methods};
use sphereboard::repr::{self, METHODS, Order, Settings, SoftwareCapture, Stats, TreeSource};
use sphereboard::{Result, Seed, files};

/// At this leaves still have edges, and the sheet of all methods a quarter of its size as a PNG.
const JPEG_QUALITY: u8 = 70;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let name = arguments.first().map_or("oak", String::as_str);
    let out = arguments.get(1).map_or_else(|| PathBuf::from(format!("results/local/sheets/methods.{name}.png")), PathBuf::from);
    let _folder = files::ready_folder(out.parent().unwrap_or(Path::new("")))?;
    let (source, _) = TreeSource::open(name, &Default::default(), Seed(1))?;
    let mut renderer = Renderer::new(Gpu::open(&AdapterChoice::Auto)?)?;
    let mut rows: Vec<RgbImage> = vec![];
    let asked = |id: &str| arguments.len() < 3 || arguments[2..].iter().any(|a| a == id);
    for method in METHODS.iter().filter(|method| asked(method.id())) {
        let order = Order { method: method.id(), trunk: None, settings: &Settings::default(), seed: Seed(1) };
        let row = match repr::build(&order, &source, &SoftwareCapture::new()) {
            Ok(built) => {
                let near = Stats::at(&built, methods::DISTANCES[0]);
                let all = Stats::of_all(&built);
                println!(
                    "row {}: {} — built in {:.0} ms; near: {} triangles, {} calls; {} textures, {:.1} MB",
                    rows.len() + 1,
                    method.id(),
                    built.build_ms,
                    near.triangles,
                    near.draw_calls,
                    all.textures,
                    all.texture_bytes as f64 / 1e6
                );
                let tree = renderer.upload_built(&built)?;
                methods::row(&mut renderer, &tree, built.bounds)?
            }
            Err(why) => {
                println!("row {}: {} — {why}", rows.len() + 1, method.id());
                methods::missing()
            }
        };
        rows.push(row);
    }
    let sheet = draw::stacked(&rows, 6);
    let is_jpeg = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("jpg"));
    files::write_whole(&out, &if is_jpeg { jpeg(&sheet, JPEG_QUALITY)? } else { png_with(&sheet, PngEffort::Small)? })?;
    println!("{}", out.display());
    Ok(())
}
