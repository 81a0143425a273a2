//! Photograph to model, beside what it is measured against, in one run:
//!
//! * `segment-12mp`: methods hsv and auto, beside the hsv steps in OpenCV (a Python process of `sphereboard_tools`, same cores);
//! * `model-12mp`: the whole run at medium detail, from JPEG bytes to GLB bytes.
//!
//! The 12 MP photograph is a shared one enlarged to 3000×4000 and saved as JPEG; without `../shared`, our own sample.
//! `make bench` runs this and writes `results/<date>-<machine>/`.

use std::hint::black_box;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use image::imageops::FilterType;
use sphereboard::model::glb;
use sphereboard::model::pipeline::{self, ModelParams, Request, View};
use sphereboard::params::ParamSet as _;
use sphereboard::photo::{DecodeParams, Hints, Photo, SegmentParams, decode, segment};
use sphereboard::{Seed, files};

fn photo_path() -> PathBuf {
    let shared = files::shared_folder().map(|s| s.join("photos/single/catalpa_speciosa_43.jpg")).filter(|p| p.exists());
    shared.unwrap_or_else(|| {
        eprintln!("SKIPPED: the shared photograph is not there; measuring on photos/oak.jpg");
        "photos/oak.jpg".into()
    })
}

/// The photograph enlarged to 12 MP, as the bytes of a JPEG file.
fn jpeg_12mp() -> Vec<u8> {
    let photo = image::open(photo_path()).expect("the photograph opens").into_rgb8();
    let large = image::imageops::resize(&photo, 3000, 4000, FilterType::CatmullRom);
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 92).encode_image(&large).expect("a picture encodes");
    bytes.into_inner()
}

fn decoded(jpeg: &[u8]) -> Photo {
    decode::decode_bytes(jpeg, &DecodeParams::default()).expect("our own JPEG decodes")
}

fn segmentation(c: &mut Criterion) {
    let photo = decoded(&jpeg_12mp());
    let mut group = c.benchmark_group("segment-12mp");
    group.sample_size(10).measurement_time(Duration::from_secs(8));
    for method in ["hsv", "auto"] {
        let mut params = SegmentParams::default();
        params.set("method", method).expect("a method of the table");
        group.bench_function(method, |b| {
            b.iter(|| segment::segment(black_box(&photo), &params, &Hints::default()).expect("a tree is there"))
        });
    }
    match OpenCv::start(&photo, &SegmentParams::default()) {
        Some(mut opencv) => {
            group.bench_function("opencv-hsv", |b| b.iter_custom(|runs| opencv.time(runs)));
        }
        None => eprintln!("SKIPPED: the OpenCV side needs `scripts/setup test` first"),
    }
    group.finish();
}

fn whole_model(c: &mut Criterion) {
    let jpeg = jpeg_12mp();
    let mut group = c.benchmark_group("model-12mp");
    group.sample_size(10).measurement_time(Duration::from_secs(20));
    group.bench_function("medium", |b| {
        b.iter(|| {
            let views = [View { photo: decoded(&jpeg), hints: Hints::default(), azimuth_rad: 0.0 }];
            let request = Request {
                views: &views,
                params: &ModelParams::default(),
                height_is_given: true,
                seed: Seed(1),
                sources: vec!["bench".to_owned()],
            };
            glb::write(&pipeline::run(&request, &|_| ()).expect("a tree is there").model).expect("a model is written")
        });
    });
    group.finish();
}

/// A Python process that times OpenCV's hsv steps on the same pixels.
struct OpenCv {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    _folder: tempfile::TempDir,
}

impl OpenCv {
    fn start(photo: &Photo, params: &SegmentParams) -> Option<Self> {
        let tools = PathBuf::from("target/python/bin/sphereboard-tools");
        let folder = tempfile::tempdir().ok()?;
        let pixels = folder.path().join("pixels.png");
        photo.image.save(&pixels).ok()?;
        let radii = [params.opening_px.to_string(), params.closing_px.to_string()];
        let mut child = Command::new(tools)
            .arg("time-hsv")
            .arg(pixels)
            .args(radii)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .ok()?;
        let (to, from) = (child.stdin.take()?, BufReader::new(child.stdout.take()?));
        Some(Self { child, to, from, _folder: folder })
    }

    /// Asks for `runs` runs and returns the time they took by Python's clock.
    fn time(&mut self, runs: u64) -> Duration {
        writeln!(self.to, "{runs}").expect("the Python process listens");
        let mut line = String::new();
        self.from.read_line(&mut line).expect("the Python process answers");
        Duration::from_secs_f64(line.trim().parse().expect("the answer is seconds"))
    }
}

impl Drop for OpenCv {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

criterion_group!(benches, segmentation, whole_model);
criterion_main!(benches);
