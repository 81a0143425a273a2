//! What the growth of outlines costs, and how much it flickers.
//!
//! * flicker: 120 frames of an orbit in steps of 0.25°; in the band of Qmax pixels round the outline, the mean absolute difference to the
//!   previous frame re-projected by depth; unshaped, grown steadily, and grown as in the paper (new random numbers in every frame);
//! * cost: the frame with growth against the same frame without, one tree at 1440×810;
//! * cost per silhouette pixel: at 540 trees that all grow, against 10.
//!
//! `cargo bench --bench growth [-- MODEL.glb ADAPTER]`; without a model, `photos/oak.jpg` is modelled first. Prints its figures and
//! writes them to `target/render-bench/growth.{md,csv}`, which `make bench` puts into `results/`.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use glam::{Mat4, Vec3};
use sphereboard::gpu::{AdapterChoice, Gpu, layout::Instance};
use sphereboard::model::glb;
use sphereboard::model::pipeline::{self, ModelParams, Request, View};
use sphereboard::photo::{DecodeParams, Hints, decode};
use sphereboard::render::{
    Background, Camera, GrowthChoice, GrowthEdges, GrowthKeys, GrowthParams, GrowthRoots, Picture, Renderer, Shot, Stage, Stand,
    Tree,
};
use sphereboard::{Result, Seed};

/// Frames per measured median.
const RUNS: usize = 31;
/// Frames of a grove per measured median.
const GROVE_RUNS: usize = 11;

/// One figure.
struct Figure {
    measured: &'static str,
    case: String,
    value: f64,
    unit: &'static str,
}

/// All figures so far.
#[derive(Default)]
struct Figures(Vec<Figure>);

impl Figures {
    /// Adds one, and prints it.
    fn add(&mut self, measured: &'static str, case: impl Into<String>, value: f64, unit: &'static str) {
        let case = case.into();
        println!("{measured}, {case}: {value:.3} {unit}");
        self.0.push(Figure { measured, case, value, unit });
    }

    /// Writes all of them as a table to read and one to reckon with.
    fn store(&self, gpu: &Gpu) {
        let adapter = format!("{}, {} {}", gpu.info.name, gpu.info.driver, gpu.info.driver_info);
        let mut text = format!("# Growth of outlines\n\n{adapter}\n\n| measured | case | value | unit |\n|---|---|---:|---|\n");
        let mut rows = "adapter,measured,case,value,unit\n".to_owned();
        for Figure { measured, case, value, unit } in &self.0 {
            let _ = writeln!(text, "| {measured} | {case} | {value:.3} | {unit} |");
            let _ = writeln!(rows, "\"{adapter}\",{measured},\"{case}\",{value:.3},{unit}");
        }
        let folder = Path::new("target/render-bench");
        let written = std::fs::create_dir_all(folder)
            .and_then(|()| std::fs::write(folder.join("growth.md"), &text))
            .and_then(|()| std::fs::write(folder.join("growth.csv"), &rows));
        if let Err(what) = written {
            eprintln!("the tables could not be written to {}: {what}", folder.display());
        }
    }
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let choice: AdapterChoice = arguments.get(1).map_or("auto", String::as_str).parse().unwrap_or_else(|never| match never {});
    let gpu = match Gpu::open(&choice) {
        Ok(gpu) => gpu,
        Err(what) => {
            eprintln!("SKIPPED: no graphics adapter ({what}); install mesa-vulkan-drivers");
            return Ok(());
        }
    };
    println!("adapter: {}, {} {}", gpu.info.name, gpu.info.driver, gpu.info.driver_info);
    let mut renderer = Renderer::new(gpu)?;
    let model = match arguments.first() {
        Some(path) => glb::read(&std::fs::read(path).expect("a readable model"))?,
        None => modelled()?,
    };
    println!("growth: {:?}", model.about.growth);
    let tree = renderer.upload(&model.parts())?.growing(model.about.growth);
    let mut figures = Figures::default();
    share_of_the_frame(&mut renderer, &tree, &mut figures)?;
    cost_per_silhouette_pixel(&mut renderer, &tree, &mut figures)?;
    flicker(&mut renderer, &tree, &mut figures)?;
    figures.store(&renderer.gpu);
    Ok(())
}

fn modelled() -> Result<sphereboard::model::TreeModel> {
    let bytes = std::fs::read("photos/oak.jpg").expect("the sample photograph");
    let photo = decode::decode_bytes(&bytes, &DecodeParams::default())?;
    let views = [View { photo, hints: Hints::default(), azimuth_rad: 0.0 }];
    let request =
        Request { views: &views, params: &ModelParams::default(), height_is_given: false, seed: Seed(0), sources: vec![] };
    Ok(pipeline::run(&request, &|_| ())?.model)
}

fn shot(tree: &Tree, turn_deg: f32, size_px: [u32; 2], stage: Stage, growth: GrowthParams) -> Shot {
    let bounds = tree.bounds().expect("a tree of something");
    let distance = 0.5 * bounds.size().y / (0.5 * sphereboard::render::FOV_Y_RAD).tan() * 1.15;
    let camera = Camera::orbit(bounds.center(), turn_deg.to_radians(), 0.05, distance);
    Shot { stage, background: Background::Black, toward_sun: Vec3::Y, growth, ..Shot::new(camera, size_px) }
}

fn params(growth: GrowthChoice) -> GrowthParams {
    GrowthParams { growth, ..GrowthParams::default() }
}

fn paper() -> GrowthParams {
    GrowthParams { growth_keys: GrowthKeys::Random, ..GrowthParams::default() }
}

fn flicker(renderer: &mut Renderer, tree: &Tree, figures: &mut Figures) -> Result<()> {
    let strict = GrowthParams { growth_roots: GrowthRoots::Sides, growth_edges: GrowthEdges::Outer, ..paper() };
    for (pixels, stage) in [("whole pixels", Stage::Reshaped), ("anti-aliased", Stage::Antialiased)] {
        let mut of = |stage, growth: &GrowthParams| flicker_of(renderer, tree, stage, growth);
        let bare = if stage == Stage::Reshaped { Stage::Unshaped } else { stage };
        let unshaped = of(bare, &params(GrowthChoice::None))?;
        let steady = of(stage, &params(GrowthChoice::Auto))?;
        let random = of(stage, &paper())?;
        for (way, value) in [("unshaped", unshaped), ("steady", steady), ("random", random)] {
            figures.add("flicker", format!("{pixels}: {way}"), value, "255ths");
        }
        figures.add("flicker", format!("{pixels}: steady over unshaped"), steady / unshaped, "times");
        figures.add("flicker", format!("{pixels}: random over unshaped"), random / unshaped, "times");
        figures.add(
            "flicker",
            format!("{pixels}: added by steady over added by random"),
            (steady - unshaped) / (random - unshaped),
            "times",
        );
    }
    let value = flicker_of(renderer, tree, Stage::Reshaped, &strict)?;
    figures.add("flicker", "whole pixels: random, roots and edges as in the paper", value, "255ths");
    Ok(())
}

/// Mean over 120 steps of the mean absolute difference in the band of Qmax pixels round the outline.
fn flicker_of(renderer: &mut Renderer, tree: &Tree, stage: Stage, growth: &GrowthParams) -> Result<f64> {
    let size_px = [600, 600];
    let mut sum = 0.0;
    let mut last: Option<(Shot, Picture)> = None;
    for frame in 0..=120 {
        let now = Shot { frame, ..shot(tree, 0.25 * frame as f32, size_px, stage, growth.clone()) };
        let stands = [Stand { tree, instances: &[Instance::IDENTITY] }];
        let bare = renderer.picture(&Shot { stage: Stage::Unshaped, ..now.clone() }, &stands)?;
        let picture = renderer.picture(&now, &stands)?;
        if let Some((before, last)) = &last {
            sum += band_difference(&now, &bare, &picture, before, last, tree);
        }
        last = Some((now, picture));
    }
    Ok(sum / 120.0)
}

fn band_difference(now: &Shot, bare: &Picture, picture: &Picture, before: &Shot, last: &Picture, tree: &Tree) -> f64 {
    let [width, height] = now.size_px.map(|n| n as i32);
    let middle_m = (now.camera.eye - tree.bounds().expect("a tree").center()).length();
    let [a, b] = now.camera.px_per_m(now.size_px[1]);
    let near_m = now.camera.distance_m(1.0);
    let reach = (tree.growth().max_m as f32 * (a + b * near_m / middle_m)).ceil() as i32;
    let at = |x: i32, y: i32| (y * width + x) as usize;
    let solid = |x: i32, y: i32| bare.depth_m[at(x.clamp(0, width - 1), y.clamp(0, height - 1))].is_finite();
    let mut band = vec![false; (width * height) as usize];
    for y in 0..height {
        for x in 0..width {
            let edge = solid(x, y) && !(solid(x + 1, y) && solid(x - 1, y) && solid(x, y + 1) && solid(x, y - 1));
            if edge {
                for (dy, dx) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dy, dx))) {
                    let (x, y) = (x + dx, y + dy);
                    if dx * dx + dy * dy <= reach * reach && (0..width).contains(&x) && (0..height).contains(&y) {
                        band[at(x, y)] = true;
                    }
                }
            }
        }
    }
    let aspect = width as f32 / height as f32;
    let world_from_clip = now.camera.clip_from_world(aspect).inverse();
    let before_from_world: Mat4 = before.camera.clip_from_world(aspect);
    let (mut sum, mut count) = (0.0, 0);
    for y in 0..height {
        for x in (0..width).filter(|&x| band[at(x, y)]) {
            let depth = picture.depth_m[at(x, y)];
            // Where nothing is, the plane through the middle of the tree is taken.
            let d = near_m / if depth.is_finite() { depth } else { middle_m };
            let ndc = [2.0 * (x as f32 + 0.5) / width as f32 - 1.0, 1.0 - 2.0 * (y as f32 + 0.5) / height as f32];
            let world = world_from_clip.project_point3(Vec3::new(ndc[0], ndc[1], d));
            let then = before_from_world.project_point3(world);
            let (u, v) = ((0.5 + 0.5 * then.x) * width as f32 - 0.5, (0.5 - 0.5 * then.y) * height as f32 - 0.5);
            let now = picture.color.get_pixel(x as u32, y as u32).0;
            let then = bilinear(last, u, v);
            sum += (0..3).map(|c| f64::from((f32::from(now[c]) - then[c]).abs())).sum::<f64>() / 3.0;
            count += 1;
        }
    }
    sum / f64::from(count.max(1))
}

fn bilinear(picture: &Picture, u: f32, v: f32) -> [f32; 3] {
    let (width, height) = picture.color.dimensions();
    let texel = |x: f32, y: f32| {
        picture.color.get_pixel((x.max(0.0) as u32).min(width - 1), (y.max(0.0) as u32).min(height - 1)).0.map(f32::from)
    };
    let (x, y) = (u.floor(), v.floor());
    let (s, t) = (u - x, v - y);
    let corners = [texel(x, y), texel(x + 1.0, y), texel(x, y + 1.0), texel(x + 1.0, y + 1.0)];
    std::array::from_fn(|c| {
        let [a, b, d, e] = corners.map(|corner| corner[c]);
        (a * (1.0 - s) + b * s) * (1.0 - t) + (d * (1.0 - s) + e * s) * t
    })
}

/// Medians of the frame times of two shots, ms, taken in turns.
fn in_turns(renderer: &mut Renderer, stands: &[Stand], shots: [&Shot; 2], runs: usize) -> Result<[f64; 2]> {
    let mut times = [vec![], vec![]];
    for run in 0..runs + 2 {
        for (shot, times) in shots.iter().zip(&mut times) {
            let begun = Instant::now();
            renderer.frame(shot, stands)?;
            if run >= 2 {
                times.push(begun.elapsed().as_secs_f64() * 1e3);
            }
        }
    }
    Ok(times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    }))
}

fn share_of_the_frame(renderer: &mut Renderer, tree: &Tree, figures: &mut Figures) -> Result<()> {
    let stands = [Stand { tree, instances: &[Instance::IDENTITY] }];
    for (name, size_px, stage, background) in [
        ("360×200, reshaped, black behind", [360, 200], Stage::Reshaped, Background::Black),
        ("1440×810, reshaped, black behind", [1440, 810], Stage::Reshaped, Background::Black),
        ("1440×810, reshaped, sky behind", [1440, 810], Stage::Reshaped, Background::Sky),
        ("1440×810, lit, sky behind", [1440, 810], Stage::Lit, Background::Sky),
    ] {
        let grown = Shot { background, ..shot(tree, 20.0, size_px, stage, params(GrowthChoice::Auto)) };
        let bare = Shot { growth: params(GrowthChoice::None), ..grown.clone() };
        let [with, without] = in_turns(renderer, &stands, [&grown, &bare], RUNS)?;
        figures.add("frame", format!("{name}, with growth"), with, "ms");
        figures.add("frame", format!("{name}, without"), without, "ms");
        figures.add("frame", format!("{name}, growth adds"), 100.0 * (with / without - 1.0), "%");
    }
    Ok(())
}

/// Trees in rows, seen from above, each as tall in the picture as `rows` rows allow.
fn cost_per_silhouette_pixel(renderer: &mut Renderer, tree: &Tree, figures: &mut Figures) -> Result<()> {
    let height_m = tree.bounds().expect("a tree").size().y;
    let mut per_pixel = vec![];
    for (count, across) in [(10, 4), (540, 30)] {
        let rows = (count as f32 / across as f32).ceil();
        let place = |i: usize| {
            let (x, z) = ((i % across) as f32 - 0.5 * (across - 1) as f32, (i / across) as f32 - 0.5 * (rows - 1.0));
            Instance { position: [x * 1.1 * height_m, 0.0, z * 1.1 * height_m], ..Instance::IDENTITY }
        };
        let instances: Vec<_> = (0..count).map(place).collect();
        let stands = [Stand { tree, instances: &instances }];
        // Long enough that all of them grow.
        let growth = GrowthParams { growth_max_m: 0.04 * f64::from(height_m), ..params(GrowthChoice::Auto) };
        let mut grown = shot(tree, 0.0, [1440, 810], Stage::Reshaped, growth);
        let distance = 1.35 * rows * height_m / (2.0 * (0.5 * sphereboard::render::FOV_Y_RAD).tan()) * 0.75;
        grown.camera = Camera::orbit(Vec3::new(0.0, 0.4 * height_m, 0.0), 0.0, 0.9, distance.max(3.0 * height_m));
        let bare = Shot { growth: params(GrowthChoice::None), ..grown.clone() };
        let [with, without] = in_turns(renderer, &stands, [&grown, &bare], GROVE_RUNS)?;
        let pixels = silhouette_px(&renderer.picture(&bare, &stands)?, 0.2 * height_m);
        let nanoseconds = (with - without) * 1e6 / pixels as f64;
        println!("{count} trees: {:.2} ms of growth, {pixels} silhouette pixels", with - without);
        figures.add("cost per silhouette pixel", format!("{count} trees"), nanoseconds, "ns");
        per_pixel.push(nanoseconds);
    }
    figures.add("cost per silhouette pixel", "540 trees over 10", per_pixel[1] / per_pixel[0], "times");
    Ok(())
}

/// Pixels of trees beside which there is nothing, or something `gap_m` deeper.
fn silhouette_px(picture: &Picture, gap_m: f32) -> usize {
    let (width, height) = (picture.color.width() as usize, picture.color.height() as usize);
    let depth = &picture.depth_m;
    let inside = |i: usize, x: usize, y: usize| {
        let behind = |other: usize| depth[other] > depth[i] + gap_m;
        (x > 0 && behind(i - 1))
            || (x + 1 < width && behind(i + 1))
            || (y > 0 && behind(i - width))
            || (y + 1 < height && behind(i + width))
    };
    (0..width * height).filter(|&i| depth[i].is_finite() && inside(i, i % width, i / width)).count()
}
