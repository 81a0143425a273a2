//! The painter of `photos/`: repeatable, and the committed masks are the ones it paints.

#[path = "../examples/paint_sample/painter/mod.rs"]
mod painter;

use std::path::Path;

use painter::{Painting, Species, paint};
use sphereboard::Seed;
use sphereboard::photo::decode::{DecodeParams, decode};
use sphereboard::raster::Mask;

fn committed(file: &str) -> image::RgbImage {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("photos").join(file);
    decode(&path, &DecodeParams::default()).expect("the samples are in the repository").image
}

#[test]
fn the_committed_samples_are_what_the_painter_paints() {
    for species in [Species::Oak, Species::Spruce] {
        let name = species.name();
        let Painting { image, crown, gaps } = paint(species, Seed(7), 600, 800);
        for (kind, painted) in [("mask", &crown), ("gaps", &gaps)] {
            let file = committed(&format!("painted_{name}_{kind}.png"));
            let found = Mask::from_fn(file.width(), file.height(), |x, y| file.get_pixel(x, y)[0] >= 128);
            // Sines may differ in the last bit between machines, and with them a pixel of an edge.
            assert!(found.iou(painted) > 0.995, "{name} {kind}: {}", found.iou(painted));
        }
        let jpeg = committed(&format!("painted_{name}.jpg"));
        let apart: u64 = image.iter().zip(jpeg.iter()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        let mean = apart as f64 / image.len() as f64;
        assert!(mean < 5.0, "{name}: the JPEG is {mean} levels from the painting");
    }
}

#[test]
fn the_same_seed_paints_the_same_picture_at_any_shape() {
    for (width, height) in [(90, 120), (160, 100), (16, 16)] {
        let [a, b] = [7, 7].map(|seed| paint(Species::Oak, Seed(seed), width, height));
        assert_eq!(a.image, b.image);
        assert!(a.crown == b.crown && a.crown.count() > 0 && a.gaps.zip(&a.crown, |gap, crown| gap && !crown).count() == 0);
        assert_ne!(paint(Species::Oak, Seed(8), width, height).image, a.image);
    }
}
