//! Decode → segment → model on small random pictures: any answer is fine, a panic or a hang is not.
//!
//! Bytes that are no picture test the decoder. Since they hardly ever become one, most runs paint a picture: strokes of colour on a
//! plain ground, which is enough for crowns, trunks, skies and everything that only looks like them.

#![no_main]

use std::io::Cursor;

use image::{ImageFormat, Rgb, RgbImage};
use libfuzzer_sys::arbitrary::{self, Arbitrary};
use libfuzzer_sys::fuzz_target;
use sphereboard::Seed;
use sphereboard::crown::Detail;
use sphereboard::model::glb;
use sphereboard::model::pipeline::{self, ModelParams, Request, View};
use sphereboard::params::PowerOfTwo;
use sphereboard::photo::decode::{self, DecodeParams};
use sphereboard::photo::segment::{Hints, Method, SegmentParams};

#[derive(Arbitrary, Debug)]
enum Input {
    File(Vec<u8>),
    Painting(Painting),
}

#[derive(Arbitrary, Debug)]
struct Painting {
    width: u8,
    height: u8,
    ground: [u8; 3],
    strokes: Vec<Stroke>,
    hsv: bool,
    hue_deg: Option<(u16, u16)>,
    include: Vec<(u8, u8)>,
}

/// An ellipse, its colour varied from pixel to pixel.
#[derive(Arbitrary, Debug)]
struct Stroke {
    center: (u8, u8),
    radii: (u8, u8),
    colour: [u8; 3],
    grain: u8,
}

/// Longest side of a painting: large enough for a crown, small enough for a hundred runs a second.
const LONGEST_PX: u32 = 96;

const MOST_STROKES: usize = 40;

impl Painting {
    fn paint(&self) -> RgbImage {
        let side = |byte: u8| u32::from(byte) % LONGEST_PX + 1;
        let mut image = RgbImage::from_pixel(side(self.width), side(self.height), Rgb(self.ground));
        for stroke in self.strokes.iter().take(MOST_STROKES) {
            for (x, y, pixel) in image.enumerate_pixels_mut() {
                stroke.paint(x, y, pixel);
            }
        }
        image
    }

    fn hints(&self) -> Hints {
        Hints {
            hue_deg: self.hue_deg.map(|(low, high)| (f64::from(low), f64::from(high))),
            include: self.include.iter().take(4).map(|&(x, y)| (x.into(), y.into())).collect(),
            ..Hints::default()
        }
    }
}

impl Stroke {
    fn paint(&self, x: u32, y: u32, pixel: &mut Rgb<u8>) {
        let offset = |at: u32, center: u8, radius: u8| (f64::from(at) - f64::from(center)) / (f64::from(radius) + 0.5);
        let (u, v) = (offset(x, self.center.0, self.radii.0), offset(y, self.center.1, self.radii.1));
        if u * u + v * v <= 1.0 {
            let noise = (x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77)) >> 13;
            let shift = (noise % (u32::from(self.grain) + 1)) as u8;
            *pixel = Rgb(self.colour.map(|value| value.saturating_add(shift)));
        }
    }
}

/// The bytes of a file, and what was asked of the segmentation.
fn file(input: &Input) -> (Vec<u8>, SegmentParams, Hints) {
    match input {
        Input::File(bytes) => (bytes.clone(), SegmentParams::default(), Hints::default()),
        Input::Painting(painting) => {
            let mut bytes = Cursor::new(vec![]);
            painting.paint().write_to(&mut bytes, ImageFormat::Bmp).expect("memory takes every picture");
            let method = if painting.hsv { Method::Hsv } else { Method::Auto };
            (bytes.into_inner(), SegmentParams { method, ..SegmentParams::default() }, painting.hints())
        }
    }
}

fuzz_target!(|input: Input| {
    let (bytes, params, hints) = file(&input);
    // A header may promise more pixels than the few bytes hold: refuse those, or the run measures the allocator.
    let Ok(photo) = decode::decode_bytes(&bytes, &DecodeParams { max_megapixels: 1.0 }) else { return };
    let mut all = ModelParams::default();
    all.segment = params;
    all.crown.detail = Detail::Low;
    all.bake.texture_size = PowerOfTwo(64);
    let views = [View { photo, hints, azimuth_rad: 0.0 }];
    let request = Request { views: &views, params: &all, height_is_given: false, seed: Seed(1), sources: vec![] };
    if let Ok(run) = pipeline::run(&request, &|_| ()) {
        let bytes = glb::write(&run.model).expect("what the pipeline makes can be written");
        assert_eq!(glb::read(&bytes).expect("what is written can be read"), run.model);
    }
});
