//! Learns the weights of `--method auto` from photographs with drawn crowns, and says what they are worth on photographs they have
//! not seen.
//!
//! `cargo run --release --example train_segmentation [-- src/photo/segment/weights.rs]` reads the photographs from the shared folder and
//! the crowns' outlines from `examples/data/crown_outlines.csv` (our own: photograph, corners in its pixels), prints the intersection
//! over union of both looks and of the shaped crown, in the reduced picture, by weights from the other folds, then of the pairs by the
//! weights from all photographs; those it writes to the file named, if any.

use std::path::{Path, PathBuf};

use glam::DVec2;
use image::RgbImage;
use rayon::prelude::*;
use sphereboard::Seed;
use sphereboard::files::shared_folder;
use sphereboard::photo::segment::features::{FIRST, SECOND, Scene};
use sphereboard::photo::segment::model::{Look, Term};
use sphereboard::photo::segment::shape::crown;
use sphereboard::photo::segment::small::Small;
use sphereboard::raster::{Mask, fill_polygon};

/// Parts cut from each photograph, in addition to the whole.
const PARTS: usize = 8;
/// Penalty on each squared weight, in samples.
const DECAY: f64 = 1000.0;
/// Looks: the first at the pixels, each further one with the belief of the one before.
const LOOKS: usize = 2;
const FOLDS: usize = 5;
/// Pixels drawn from each picture.
const SAMPLES: usize = 1200;
/// These show the same tree as a pair of the test set.
const HELD_OUT: [&str; 4] = ["fagus_grandifolia_05", "pseudotsuga_menziesii_19", "catalpa_speciosa_43", "maclura_pomifera_33"];

/// One picture: its analysis, the truth per pixel of the reduced picture, and the number of the photograph it comes from.
struct Example {
    photo: usize,
    scene: Scene,
    truth: Vec<bool>,
    first: Vec<f32>,
}

fn example(photo: usize, image: &RgbImage, mask: &RgbImage) -> Example {
    let scene = Scene::new(Small::new(image));
    let first = scene.first();
    Example { photo, scene, truth: truth(&Small::new(mask)), first }
}

/// The white pixels of a reduced mask.
fn truth(mask: &Small) -> Vec<bool> {
    mask.rgb.iter().map(|c| c[0] >= 128.0).collect()
}

/// The photograph, and parts of it that keep most of the crown.
fn examples(photo: usize, row: &Row) -> Vec<Example> {
    let (image, mask) = (open(&row.image), &row.masks[0]);
    let mut out = vec![example(photo, &image, mask)];
    let (w, h) = image.dimensions();
    for part in 0..PARTS {
        let mut draws = Seed(1).keyed("part", (photo * 64 + part) as u64);
        let mut cut = |n: u32| (0.22 * draws.unit() * draws.unit().sqrt() * f64::from(n)) as u32;
        let (left, right, top, bottom) = (cut(w), cut(w), cut(h) / 2, cut(h));
        let crop = |i: &RgbImage| image::imageops::crop_imm(i, left, top, w - left - right, h - top - bottom).to_image();
        let mut light = crop(&image);
        let gamma = 1.0 + 0.25 * draws.signed();
        let gain: [f64; 3] = std::array::from_fn(|_| 1.0 + 0.1 * draws.signed());
        for p in light.pixels_mut() {
            (0..3).for_each(|c| p.0[c] = (255.0 * gain[c] * (f64::from(p.0[c]) / 255.0).powf(gamma)).min(255.0) as u8);
        }
        out.push(example(photo, &light, &crop(mask)));
    }
    out
}

/// A learned look that owns its numbers.
#[derive(Clone)]
struct Learned {
    terms: Vec<Term>,
    bias: f32,
}

impl Learned {
    fn judge(&self, rows: &[f32]) -> Vec<f32> {
        Look { terms: &self.terms, bias: self.bias }.judge(rows)
    }
}

/// Penalised logistic regression by Newton's method; every picture counts the same. `data` holds (inputs, truth) of each picture.
fn train(inputs: usize, data: &[(&[f32], &[bool])]) -> Learned {
    let mut draws = Seed(7).keyed("samples", inputs as u64);
    let samples: Vec<(&[f32], f64)> = data
        .iter()
        .flat_map(|(rows, truth)| {
            let picks: Vec<usize> = (0..SAMPLES).map(|_| draws.below(truth.len())).collect();
            picks.into_iter().map(|i| (&rows[i * inputs..(i + 1) * inputs], f64::from(u8::from(truth[i]))))
        })
        .collect();
    let n = samples.len() as f64;
    let scales: Vec<(f64, f64)> = (0..inputs)
        .map(|c| {
            let mean = samples.iter().map(|s| f64::from(s.0[c])).sum::<f64>() / n;
            let variance = samples.iter().map(|s| (f64::from(s.0[c]) - mean).powi(2)).sum::<f64>() / n;
            (mean, 1.0 / variance.sqrt().max(1e-3))
        })
        .collect();
    let size = 2 * inputs + 1;
    let expand = |x: &[f32]| {
        let z: Vec<f64> = x.iter().zip(&scales).map(|(v, (m, s))| ((f64::from(*v) - m) * s).clamp(-3.0, 3.0)).collect();
        z.iter().copied().chain(z.iter().map(|z| z * z)).chain([1.0]).collect::<Vec<f64>>()
    };
    let mut weights = vec![0.0; size];
    for _ in 0..7 {
        let (mut hessian, mut gradient) = (vec![0.0; size * size], vec![0.0; size]);
        for (x, t) in &samples {
            let e = expand(x);
            let p = 1.0 / (1.0 + (-e.iter().zip(&weights).map(|(a, b)| a * b).sum::<f64>()).exp());
            let curvature = p * (1.0 - p);
            for i in 0..size {
                gradient[i] += (p - t) * e[i];
                let c = curvature * e[i];
                hessian[i * size..=i * size + i].iter_mut().zip(&e).for_each(|(h, v)| *h += c * v);
            }
        }
        for i in 0..size {
            let penalty = if i + 1 < size { DECAY } else { 1e-6 };
            gradient[i] += penalty * weights[i];
            hessian[i * size + i] += penalty;
        }
        let step = cholesky_solve(hessian, gradient, size);
        weights.iter_mut().zip(step).for_each(|(w, s)| *w -= s);
    }
    let terms = (0..inputs).map(|c| [scales[c].0, scales[c].1, weights[c], weights[inputs + c]].map(|v| v as f32)).collect();
    Learned { terms, bias: weights[2 * inputs] as f32 }
}

/// Solves a symmetric positive definite system whose lower triangle is given.
fn cholesky_solve(mut a: Vec<f64>, mut b: Vec<f64>, n: usize) -> Vec<f64> {
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = a[i * n + j] - (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum::<f64>();
            a[i * n + j] = if i == j { sum.sqrt() } else { sum / a[j * n + j] };
        }
        b[i] = (b[i] - (0..i).map(|k| a[i * n + k] * b[k]).sum::<f64>()) / a[i * n + i];
    }
    for i in (0..n).rev() {
        b[i] = (b[i] - (i + 1..n).map(|k| a[k * n + i] * b[k]).sum::<f64>()) / a[i * n + i];
    }
    b
}

fn iou(logits: &[f32], truth: &[bool]) -> f64 {
    let both = logits.iter().zip(truth).filter(|(l, t)| **l > 0.0 && **t).count();
    let either = logits.iter().zip(truth).filter(|(l, t)| **l > 0.0 || **t).count();
    both as f64 / either.max(1) as f64
}

fn rust_table(name: &str, look: &Learned) -> String {
    let rows: Vec<String> =
        look.terms.iter().map(|t| format!("        [{}],\n", t.map(|v| format!("{v:.4}")).join(", "))).collect();
    format!("pub const {name}: Look<'static> = Look {{\n    terms: &[\n{}    ],\n    bias: {:.4},\n}};\n", rows.concat(), look.bias)
}

/// The learned looks, in order.
type Looks = Vec<Learned>;

fn judge(looks: &Looks, scene: &Scene) -> Vec<Vec<f32>> {
    let mut out = vec![looks[0].judge(&scene.first())];
    for look in &looks[1..] {
        out.push(look.judge(&scene.second(&out[out.len() - 1])));
    }
    out
}

/// Weights per fold, and from all pictures.
fn learn(rows: &[Row]) -> Vec<Looks> {
    let all: Vec<Example> = rows
        .par_iter()
        .enumerate()
        .filter(|(_, r)| !HELD_OUT.contains(&r.name.as_str()))
        .flat_map_iter(|(i, r)| examples(i, r))
        .collect();
    println!("{} pictures", all.len());
    // Each picture's first look is by weights that have not seen its photograph.
    let folds: Vec<usize> = (0..=FOLDS).collect();
    let learned = |e: &Example, fold: usize| e.photo % FOLDS != fold;
    let mut weights = vec![Looks::new(); FOLDS + 1];
    let mut inputs: Vec<Vec<f32>> = all.iter().map(|e| e.first.clone()).collect();
    for look in 0..LOOKS {
        let size = if look == 0 { FIRST } else { SECOND };
        let learned: Vec<Learned> = folds
            .par_iter()
            .map(|&fold| {
                let data: Vec<_> =
                    all.iter().zip(&inputs).filter(|(e, _)| learned(e, fold)).map(|(e, f)| (&f[..], &e.truth[..])).collect();
                train(size, &data)
            })
            .collect();
        inputs = all.par_iter().zip(&inputs).map(|(e, f)| e.scene.second(&learned[e.photo % FOLDS].judge(f))).collect();
        weights.iter_mut().zip(learned).for_each(|(w, l)| w.push(l));
    }
    weights
}

/// A photograph and its crown as drawn, white on black, by one person or two.
struct Row {
    name: String,
    image: PathBuf,
    masks: Vec<RgbImage>,
}

fn open(path: &Path) -> RgbImage {
    image::open(path).expect("a picture").to_rgb8()
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The pictures of `PAIRS.csv` with one green tree whose mask a person drew.
fn pairs(folder: &Path) -> Vec<Row> {
    let table = std::fs::read_to_string(folder.join("PAIRS.csv")).expect("PAIRS.csv in the folder");
    let rows = table.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
    let wanted = |r: &Vec<&str>| ["human", "exact-alpha", "drawn"].contains(&r[3]) && r[4] == "yes" && r[5] == "yes";
    let masks = |r: &[&str]| r[1..3].iter().filter(|m| !m.is_empty()).map(|m| open(&folder.join(m))).collect();
    rows.filter(wanted).map(|r| Row { name: stem(Path::new(r[0])), image: folder.join(r[0]), masks: masks(&r) }).collect()
}

/// The photographs of the table of outlines: `file,"x,y x,y …"`.
fn drawn(photos: &Path, outlines: &Path) -> Vec<Row> {
    let table = std::fs::read_to_string(outlines).expect("the table of outlines");
    let row = |line: &str| {
        let (file, outline) = line.split_once(',').expect("a file and its outline");
        let number = |v: &str| v.parse::<f64>().expect("a coordinate");
        let corner = |c: &str| c.split_once(',').map(|(x, y)| DVec2::new(number(x), number(y)) + 0.5).expect("x,y");
        let corners: Vec<DVec2> = outline.trim_matches('"').split_whitespace().map(corner).collect();
        let image = photos.join(file);
        let (width, height) = image::image_dimensions(&image).expect("a photograph");
        let mut mask = Mask::new(width, height);
        fill_polygon(&mut mask, &corners);
        // The outline's own pixels belong to the crown.
        let mut mask = mask.to_gray();
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let pixel = |p: &DVec2| (p.x.floor() as f32, p.y.floor() as f32);
            imageproc::drawing::draw_line_segment_mut(&mut mask, pixel(a), pixel(b), image::Luma([255]));
        }
        Row { name: stem(&image), image, masks: vec![image::DynamicImage::from(mask).to_rgb8()] }
    };
    table.lines().skip(1).map(row).collect()
}

/// Prints the table of a set; `weights` gives those that have not seen the picture.
fn report(title: &str, rows: &[Row], weights: impl Fn(usize) -> Looks + Sync) {
    let measure = |(i, row): (usize, &Row)| {
        let scene = Scene::new(Small::new(&open(&row.image)));
        let looks = judge(&weights(i), &scene);
        let shape = crown(&scene, &looks).iter().map(|&s| if s { 1.0 } else { -1.0 }).collect();
        let truths: Vec<Vec<bool>> = row.masks.iter().map(|m| truth(&Small::new(m))).collect();
        let best = |stage: &Vec<f32>| truths.iter().map(|t| iou(stage, t)).fold(0.0, f64::max);
        looks.iter().chain([&shape]).map(best).collect::<Vec<f64>>()
    };
    let results: Vec<Vec<f64>> = rows.par_iter().enumerate().map(measure).collect();
    for (row, ious) in rows.iter().zip(&results) {
        println!("{:40} {}", row.name, ious.iter().map(|v| format!("{v:.3} ")).collect::<String>());
    }
    print!("{title}:");
    for stage in 0..=LOOKS {
        let mut v: Vec<f64> = results.iter().map(|r| r[stage]).collect();
        v.sort_by(f64::total_cmp);
        let (mean, low) = (v.iter().sum::<f64>() / v.len() as f64, v.iter().filter(|&&v| v < 0.5).count());
        print!("  mean {mean:.3} median {:.3} low {low}", v[v.len() / 2]);
    }
    println!();
}

fn main() {
    let Some(photos) = shared_folder().map(|f| f.join("photos")).filter(|f| f.exists()) else {
        println!("SKIPPED: no shared photographs");
        return;
    };
    let single = drawn(&photos.join("single"), &Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/data/crown_outlines.csv"));
    let weights = learn(&single);
    report("photographs of the training set, unseen", &single, |i| weights[i % FOLDS].clone());
    report("pairs", &pairs(&photos.join("pairs")), |_| weights[FOLDS].clone());
    if let Some(file) = std::env::args().nth(1) {
        let names = ["FIRST_LOOK", "SECOND_LOOK"];
        let tables: String =
            names.iter().zip(&weights[FOLDS]).map(|(n, l)| format!("\n/// Learned.\n{}", rust_table(n, l))).collect();
        let head = "//! Weights learned by `examples/train_segmentation.rs`; not to be edited.\n\nuse super::model::Look;\n";
        std::fs::write(file, format!("{head}{tables}")).expect("a written table");
    }
}
