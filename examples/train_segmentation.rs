//! Learns the weights of `--method auto` from photographs with drawn crowns, and says what they are worth on photographs they have
//! not seen.
//!
//! `cargo run --release --example train_segmentation -- PHOTOS MASKS [weights.rs]`; a mask is `<stem>_crown.png`.

use std::path::{Path, PathBuf};

use image::RgbImage;
use rayon::prelude::*;
use sphereboard::Seed;
use sphereboard::photo::segment::features::{FIRST, SECOND, Scene};
use sphereboard::photo::segment::model::{Look, Term};
use sphereboard::photo::segment::shape::crown;
use sphereboard::photo::segment::small::Small;

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
    let truth = Small::new(mask).rgb.iter().map(|c| c[0] >= 128.0).collect();
    let first = scene.first();
    Example { photo, scene, truth, first }
}

/// The photograph, and parts of it that keep most of the crown.
fn examples(photo: usize, path: &Path, mask: &Path) -> Vec<Example> {
    let image = image::open(path).expect("a photograph").to_rgb8();
    let mask = image::open(mask).expect("a mask").to_rgb8();
    let mut out = vec![example(photo, &image, &mask)];
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
        out.push(example(photo, &light, &crop(&mask)));
    }
    out
}

/// A learned look that owns its numbers.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
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
        .flat_map_iter(|(i, r)| examples(i, &r.image, &r.masks[0]))
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

struct Row {
    name: String,
    image: PathBuf,
    masks: Vec<PathBuf>,
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn pairs(folder: &Path) -> Vec<Row> {
    let table = std::fs::read_to_string(folder.join("PAIRS.csv")).expect("PAIRS.csv in the folder");
    let rows = table.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
    let wanted = |r: &Vec<&str>| ["human", "exact-alpha", "drawn"].contains(&r[3]) && r[4] == "yes" && r[5] == "yes";
    rows.filter(wanted)
        .map(|r| Row {
            name: stem(Path::new(r[0])),
            image: folder.join(r[0]),
            masks: r[1..3].iter().filter(|m| !m.is_empty()).map(|m| folder.join(m)).collect(),
        })
        .collect()
}

/// Pictures of a folder whose crown lies in another as `<stem>_crown.png`.
fn drawn(photos: &Path, masks: &Path) -> Vec<Row> {
    let mut files: Vec<_> = std::fs::read_dir(photos).expect("a folder").map(|e| e.expect("readable").path()).collect();
    files.sort();
    let row = |image: PathBuf| Row { name: stem(&image), masks: vec![masks.join(format!("{}_crown.png", stem(&image)))], image };
    files.into_iter().map(row).filter(|r| r.masks[0].exists()).collect()
}

/// Prints the table of a set; `weights` gives those that have not seen the picture.
fn report(title: &str, rows: &[Row], weights: impl Fn(usize) -> Looks + Sync, out: &Path) {
    let results: Vec<Vec<f64>> = rows
        .par_iter()
        .enumerate()
        .map(|(i, row)| {
            let scene = Scene::new(Small::new(&image::open(&row.image).expect("a photograph").to_rgb8()));
            let looks = judge(&weights(i), &scene);
            let shape = crown(&scene, &looks);
            let shape: Vec<f32> = shape.iter().map(|&s| if s { 1.0 } else { -1.0 }).collect();
            let (w, h) = (scene.small.width as u32, scene.small.height as u32);
            let draw = |suffix: &str, values: &[f32]| {
                let grey = values.iter().map(|v| (255.0 / (1.0 + (-v).exp())) as u8).collect();
                image::GrayImage::from_raw(w, h, grey)
                    .expect("one byte a pixel")
                    .save(out.join(format!("{}.{suffix}.png", row.name)))
                    .expect("written");
            };
            for (look, name) in looks.iter().zip(["first", "second", "third"]) {
                draw(name, look);
            }
            draw("shape", &shape.iter().map(|v| 20.0 * v).collect::<Vec<_>>());
            draw(
                "sky",
                &scene
                    .sky
                    .likeness
                    .iter()
                    .zip(&scene.sky.grown)
                    .map(|(l, g)| 8.0 * (l - 0.5) + if *g { 4.0 } else { -4.0 })
                    .collect::<Vec<_>>(),
            );
            looks
                .iter()
                .chain([&shape])
                .map(|l| {
                    row.masks
                        .iter()
                        .map(|m| {
                            let truth: Vec<bool> =
                                Small::new(&image::open(m).expect("a mask").to_rgb8()).rgb.iter().map(|c| c[0] >= 128.0).collect();
                            iou(l, &truth)
                        })
                        .fold(0.0, f64::max)
                })
                .collect()
        })
        .collect();
    for (row, ious) in rows.iter().zip(&results) {
        println!("{:40} {}", row.name, ious.iter().map(|v| format!("{v:.3} ")).collect::<String>());
    }
    print!("{title}:");
    for look in 0..=LOOKS {
        let mut v: Vec<f64> = results.iter().map(|r| r[look]).collect();
        v.sort_by(f64::total_cmp);
        print!(
            "  mean {:.3} median {:.3} low {}",
            v.iter().sum::<f64>() / v.len() as f64,
            v[v.len() / 2],
            v.iter().filter(|&&v| v < 0.5).count()
        );
    }
    println!();
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let single = drawn(Path::new(&args[0]), Path::new(&args[1]));
    let (cache, out) = (Path::new(&args[3]), Path::new(&args[4]));
    let weights: Vec<Looks> = if cache.exists() {
        serde_json::from_slice(&std::fs::read(cache).expect("readable")).expect("weights")
    } else {
        let weights = learn(&single);
        std::fs::write(cache, serde_json::to_vec(&weights).expect("numbers")).expect("written");
        weights
    };
    report("photographs of the training set, unseen", &single, |i| weights[i % FOLDS].clone(), out);
    report("pairs", &pairs(Path::new(&args[2])), |_| weights[FOLDS].clone(), out);
    if let Some(file) = args.get(5) {
        let names = ["FIRST_LOOK", "SECOND_LOOK", "THIRD_LOOK"];
        let tables: String =
            names.iter().zip(&weights[FOLDS]).map(|(n, l)| format!("\n/// Learned.\n{}", rust_table(n, l))).collect();
        let text = format!(
            "//! Weights learned by `examples/train_segmentation.rs`; not to be edited.\n\nuse super::model::Look;\n{tables}"
        );
        std::fs::write(file, text).expect("a written table");
    }
}
