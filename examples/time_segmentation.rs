//! Times both methods on one photograph: `cargo run --release --example time_segmentation -- PHOTO`.

use std::time::Instant;

use sphereboard::params::ParamSet;
use sphereboard::photo::{Hints, Photo, SegmentParams, segment::segment};

fn main() {
    let path = std::env::args().nth(1).expect("a photograph");
    let start = Instant::now();
    let photo = Photo { image: image::open(path).expect("a picture").to_rgb8(), opaque: None };
    println!("decode {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    for method in ["hsv", "auto"] {
        let mut params = SegmentParams::default();
        params.set("method", method).expect("a method");
        let mut ms: Vec<f64> = (0..7)
            .map(|_| {
                let start = Instant::now();
                segment(&photo, &params, &Hints::default()).expect("a crown");
                start.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        ms.sort_by(f64::total_cmp);
        println!("{method}: median {:.0} ms, fastest {:.0} ms", ms[3], ms[0]);
    }
}
