//! How the sphere-board does beside the methods that it has to stand up to, looked down upon: FLIP and its parts for every preset, at 128 px
//! and below, from 45° and above, in both suns; what each picture costs; and which pictures it loses to something no heavier.
//!
//! `cargo run --release --example sphere_score OUT.csv [--presets a,b] [--methods a,b] [--heights 128,64] [--suns 0,1] [--set key=value]…
//! [--truth DIR] [--sheet DIR]`: `--set` is for the sphere-board, `--truth` keeps the true pictures from one run to the next (of one
//! version of the renderer), `--sheet` gets pictures, four times as large.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use glam::{Vec3, Vec4};
use image::{Rgba, RgbaImage, imageops};
use rayon::prelude::*;
use sphereboard::compare::{Figures, Plan, Profile, Seen, Stage, View, Views, coarser, finer};
use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::metrics::over;
use sphereboard::model::reference::Asked;
use sphereboard::plant::presets::PRESETS;
use sphereboard::raster::{Layer, PngEffort, png_with};
use sphereboard::render::{Renderer, Shot};
use sphereboard::report::draw;
use sphereboard::repr::{self, BuiltTree, Order, REFERENCE_FOCAL_PX, Settings, SoftwareCapture, Stats, TreeSource};
use sphereboard::{Result, Seed, files};

const METHODS: [&str; 5] = ["sphere-board", "billboard", "crossed-planes", "slices", "grid-slices"];
const HEIGHTS_PX: [f32; 4] = [128.0, 64.0, 32.0, 16.0];
const ELEVATIONS_DEG: [f32; 4] = [45.0, 60.0, 75.0, 90.0];
/// As in `compare`: not along the axes of anything.
const AZIMUTHS_DEG: [f32; 4] = [10.0, 100.0, 190.0, 280.0];

struct Asking {
    out: PathBuf,
    presets: Vec<String>,
    methods: Vec<String>,
    heights_px: Vec<f32>,
    suns: Vec<usize>,
    settings: Vec<String>,
    truth: Option<PathBuf>,
    sheet: Option<PathBuf>,
}

impl Asking {
    fn of(mut words: impl Iterator<Item = String>) -> Self {
        let own = |all: &[&str]| all.iter().map(|s| (*s).to_owned()).collect();
        let mut asking = Self {
            out: words.next().expect("OUT.csv").into(),
            presets: PRESETS.iter().map(|preset| preset.name.to_owned()).collect(),
            methods: own(&METHODS),
            heights_px: HEIGHTS_PX.to_vec(),
            suns: vec![0, 1],
            settings: vec![],
            truth: None,
            sheet: None,
        };
        while let Some(word) = words.next() {
            let value = words.next().expect("a value after each option");
            let list = || value.split(',').map(str::to_owned).collect::<Vec<_>>();
            match word.as_str() {
                "--presets" => asking.presets = list(),
                "--methods" => asking.methods = list(),
                "--heights" => asking.heights_px = list().iter().map(|h| h.parse().expect("pixels")).collect(),
                "--suns" => asking.suns = list().iter().map(|s| s.parse().expect("0 or 1")).collect(),
                "--set" => asking.settings.push(value),
                "--truth" => asking.truth = Some(value.into()),
                "--sheet" => asking.sheet = Some(value.into()),
                _ => panic!("no option {word}"),
            }
        }
        asking
    }
}

/// One picture to take.
#[derive(Clone, Copy)]
struct Look {
    height_px: f32,
    view: View,
    sun: usize,
}

/// What is told of a picture: the figures of `compare`, and FLIP with all but one part of the error taken out.
#[derive(Clone, Copy, Default)]
struct Score {
    error: Figures,
    /// Own outline and gaps, the truth's colours.
    outline_only: f64,
    /// The truth's outline and gaps, own colours.
    tone_only: f64,
    /// All its own, but of the truth's mean colour.
    mean_right: f64,
    /// How much lighter it is than the truth on average, sRGB steps; and how much more it covers.
    lighter: f64,
    more: f64,
}

/// By preset and method: FLIP, bytes in all, bytes there, of each picture.
type Results = BTreeMap<(String, String), Vec<(f64, usize, usize)>>;

fn main() -> Result<()> {
    let asking = Asking::of(std::env::args().skip(1));
    let mut renderer = Renderer::new(Gpu::open(&AdapterChoice::Auto)?)?;
    let plan = Plan::new(Profile::Full, Views::Default, 128);
    let looks: Vec<Look> = asking
        .heights_px
        .iter()
        .flat_map(|&height_px| ELEVATIONS_DEG.map(|elevation_deg| (height_px, elevation_deg)))
        .flat_map(|(height_px, elevation_deg)| AZIMUTHS_DEG.map(|azimuth_deg| (height_px, View { azimuth_deg, elevation_deg })))
        .flat_map(|(height_px, view)| asking.suns.iter().map(move |&sun| Look { height_px, view, sun }))
        .collect();
    let mut table =
        "preset,method,height_px,elevation_deg,flip,flip_p99,iou,area,delta_e,depth_pct,flip_outline_only,flip_tone_only,\
                     flip_mean_right,lighter,more,triangles,bytes_seen,bytes_all,build_ms\n"
            .to_owned();
    let mut results = Results::new();
    for preset in &asking.presets {
        let (source, _) = TreeSource::open(preset, &Asked::default(), Seed(1))?;
        let stage = Stage { bounds: source.box_of_all()? };
        let mut see = |built: &BuiltTree, truth: bool| -> Result<Vec<Seen>> {
            let tree = renderer.upload_built(built)?;
            let picture = |look: &Look| {
                let by = if truth { finer(look.height_px) } else { 1 };
                let shot = stage.shot(look.view, look.height_px, plan.suns[look.sun], None);
                let large = shot.size_px.map(|side| side * by);
                let seen = stage.see(&mut renderer, &tree, &Shot { size_px: large, ..shot })?;
                Ok(if by > 1 { coarser(&seen, by) } else { seen })
            };
            looks.iter().map(picture).collect()
        };
        let kept = asking.truth.as_ref().map(|folder| folder.join(format!("{preset}.{}.bin", name_of(&looks))));
        let truth = match kept.as_ref().and_then(|path| std::fs::read(path).ok()) {
            Some(bytes) => unpacked(&bytes),
            None => {
                let built = build("geometry", &source, &[])?;
                let truth = see(&built, true)?;
                kept.iter().for_each(|path| std::fs::write(path, packed(&truth)).expect("a folder to keep true pictures in"));
                truth
            }
        };
        let mut rows = vec![shown(&looks, &truth)];
        for method in &asking.methods {
            let set: &[String] = if method == "sphere-board" { &asking.settings } else { &[] };
            let built = build(method, &source, set)?;
            let seen = see(&built, false)?;
            let scores: Vec<Score> = truth.par_iter().zip(&seen).map(|(a, b)| score(a, b, &stage)).collect::<Result<_>>()?;
            rows.push(shown(&looks, &seen));
            for (of, at) in groups(&looks) {
                let mean = |get: fn(&Score) -> f64| at.iter().map(|&i| get(&scores[i])).sum::<f64>() / at.len() as f64;
                let here = Stats::at(&built, REFERENCE_FOCAL_PX / of.height_px);
                let all = Stats::of_all(&built);
                let bytes = |stats: &Stats| stats.texture_bytes + stats.geometry_bytes;
                let flip = mean(|s| s.error.flip);
                let _ = writeln!(
                    table,
                    "{preset},{method},{},{},{flip:.5},{:.4},{:.4},{:.4},{:.3},{:.2},{:.5},{:.5},{:.5},{:.2},{:.4},{},{},{},{:.0}",
                    of.height_px,
                    of.view.elevation_deg,
                    mean(|s| s.error.flip_p99),
                    1.0 - mean(|s| s.error.silhouette),
                    mean(|s| s.error.area.abs()),
                    mean(|s| s.error.delta_e),
                    mean(|s| s.error.depth_pct),
                    mean(|s| s.outline_only),
                    mean(|s| s.tone_only),
                    mean(|s| s.mean_right),
                    mean(|s| s.lighter),
                    mean(|s| s.more),
                    here.triangles,
                    bytes(&here),
                    bytes(&all),
                    built.build_ms,
                );
                results.entry((preset.clone(), method.clone())).or_default().push((flip, bytes(&here), bytes(&all)));
            }
        }
        if let Some(folder) = &asking.sheet {
            let _folder = files::ready_folder(folder)?;
            files::write_whole(&folder.join(format!("{preset}.png")), &png_with(&draw::stacked(&rows, 6), PngEffort::Small)?)?;
        }
        tell(preset, &asking.methods, &results);
    }
    files::write_whole(&asking.out, table.as_bytes())
}

/// Looks from one elevation at one distance, by number.
fn groups(looks: &[Look]) -> Vec<(Look, Vec<usize>)> {
    let mut groups: Vec<(Look, Vec<usize>)> = vec![];
    for (number, look) in looks.iter().enumerate() {
        let same = |l: &Look| l.height_px == look.height_px && l.view.elevation_deg == look.view.elevation_deg;
        match groups.iter_mut().find(|(first, _)| same(first)) {
            Some((_, numbers)) => numbers.push(number),
            None => groups.push((*look, vec![number])),
        }
    }
    groups
}

fn build(method: &str, source: &TreeSource, settings: &[String]) -> Result<BuiltTree> {
    let settings = Settings::parse(settings.iter().map(String::as_str))?;
    repr::build(&Order { method, trunk: None, settings: &settings, seed: Seed(1) }, source, &SoftwareCapture::new())
}

/// Says how the sphere-board did on a preset: its mean FLIP, the others', and where which of them beats it.
fn tell(preset: &str, methods: &[String], results: &Results) {
    let of = |method: &str| results.get(&(preset.to_owned(), method.to_owned()));
    let Some(own) = of("sphere-board") else { return };
    let mut line = format!("{preset:9}");
    for method in methods {
        let Some(found) = of(method) else { continue };
        let mean = found.iter().map(|r| r.0).sum::<f64>() / found.len() as f64;
        let beaten =
            |limit: &dyn Fn(usize) -> bool| own.iter().zip(found).enumerate().filter(|(i, (o, f))| f.0 < o.0 && limit(*i)).count();
        let lighter = beaten(&|i| found[i].2 <= own[i].2);
        let _ = write!(line, " | {method} {mean:.4} ({} kB)", found[0].2 / 1000);
        if method != "sphere-board" {
            let _ = write!(line, " wins {lighter}/{}", beaten(&|_| true));
        }
    }
    println!("{line}");
}

fn score(truth: &Seen, test: &Seen, stage: &Stage) -> Result<Score> {
    let with = |shape: &RgbaImage, colors: &RgbaImage| {
        let bled = bled(colors);
        RgbaImage::from_fn(shape.width(), shape.height(), |x, y| {
            let [r, g, b, _] = bled.get_pixel(x, y).0;
            Rgba([r, g, b, shape.get_pixel(x, y).0[3]])
        })
    };
    let flip_of = |color: RgbaImage| {
        Figures::of(truth, &Seen { color, depth_m: test.depth_m.clone() }, stage.height_m()).map(|figures| figures.flip)
    };
    let (true_mean, own_mean) = (mean_of(&truth.color), mean_of(&test.color));
    let mut right = test.color.clone();
    right.pixels_mut().for_each(|p| {
        for k in 0..3 {
            p.0[k] = (f32::from(p.0[k]) + true_mean[k] - own_mean[k]).round().clamp(0.0, 255.0) as u8;
        }
    });
    let (of_truth, of_own) = (true_mean.w.max(1e-6), own_mean.w);
    Ok(Score {
        error: Figures::of(truth, test, stage.height_m())?,
        outline_only: flip_of(with(&test.color, &truth.color))?,
        tone_only: flip_of(with(&truth.color, &test.color))?,
        mean_right: flip_of(right)?,
        lighter: f64::from((own_mean - true_mean).truncate().dot(Vec3::new(0.2126, 0.7152, 0.0722))),
        more: f64::from(of_own / of_truth - 1.0),
    })
}

/// Mean sRGB of what is there, and how much there is.
fn mean_of(picture: &RgbaImage) -> Vec4 {
    let texel = |p: &Rgba<u8>| {
        let alpha = f32::from(p.0[3]) / 255.0;
        (alpha * Vec3::from([p.0[0], p.0[1], p.0[2]].map(f32::from))).extend(alpha)
    };
    let sum: Vec4 = picture.pixels().map(texel).sum();
    (sum.truncate() / sum.w.max(1e-6)).extend(sum.w)
}

/// With colours everywhere.
fn bled(picture: &RgbaImage) -> RgbaImage {
    let (width, height) = picture.dimensions();
    let mut layer = Layer::from_fn(width as usize, height as usize, |x, y| {
        let [r, g, b, a] = picture.get_pixel(x as u32, y as u32).0;
        Vec3::from([r, g, b].map(f32::from)).extend(f32::from(u8::from(a > 0)))
    });
    layer.bleed();
    RgbaImage::from_fn(width, height, |x, y| {
        let t = layer.texels[(y * width + x) as usize];
        Rgba([t.x as u8, t.y as u8, t.z as u8, 255])
    })
}

/// The pictures of the first azimuth in each light and at each elevation, at the largest size.
fn shown(looks: &[Look], seen: &[Seen]) -> image::RgbImage {
    let first = looks[0];
    let chosen = looks.iter().zip(seen).filter(|(look, _)| {
        look.height_px == first.height_px && look.view.azimuth_deg == first.view.azimuth_deg && look.view.elevation_deg != 75.0
    });
    let panels: Vec<image::RgbImage> = chosen
        .map(|(_, seen)| {
            let picture = over(&seen.color, [160, 170, 180]);
            let size = (4 * picture.width(), 4 * picture.height());
            imageops::resize(&picture, size.0, size.1, imageops::FilterType::Nearest)
        })
        .collect();
    draw::side_by_side(&panels, 6)
}

fn name_of(looks: &[Look]) -> String {
    let mut heights: Vec<String> = looks.iter().map(|look| look.height_px.to_string()).collect();
    heights.dedup();
    let suns: std::collections::BTreeSet<String> = looks.iter().map(|look| look.sun.to_string()).collect();
    format!("{}_s{}", heights.join("-"), suns.into_iter().collect::<Vec<_>>().join("-"))
}

fn packed(seen: &[Seen]) -> Vec<u8> {
    let one = |seen: &Seen| {
        let mut bytes: Vec<u8> = [seen.color.width(), seen.color.height()].iter().flat_map(|n| n.to_le_bytes()).collect();
        bytes.extend(seen.color.as_raw());
        bytes.extend(seen.depth_m.iter().flat_map(|d| d.to_le_bytes()));
        bytes
    };
    seen.iter().flat_map(one).collect()
}

fn unpacked(mut bytes: &[u8]) -> Vec<Seen> {
    let mut all = vec![];
    while let Some((head, rest)) = bytes.split_at_checked(8) {
        let size = |at: usize| u32::from_le_bytes(head[at..at + 4].try_into().expect("four bytes"));
        let (width, height) = (size(0), size(4));
        let texels = (width * height) as usize;
        let (color, rest) = rest.split_at(4 * texels);
        let (depth, rest) = rest.split_at(4 * texels);
        let depth_m = depth.chunks_exact(4).map(|d| f32::from_le_bytes(d.try_into().expect("four bytes"))).collect();
        all.push(Seen { color: RgbaImage::from_raw(width, height, color.to_vec()).expect("as large as said"), depth_m });
        bytes = rest;
    }
    all
}
