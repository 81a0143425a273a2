//! Milliseconds of each pass of a frame of 1440×810 pixels, and what the growth of outlines adds to it.
//!
//! * `one tree`: the four stages of She's fig. 16;
//! * `n trees`: 1, 10, 100 and 540 trees, reshaped, in rows that fill the picture;
//! * growth: the same frame with growth and with none, in turns; asked for: at most 35 % more on the software driver.
//!
//! Passes are timed by the device where it can, else by the clock on the wall with a wait after each; whole frames by the clock on the
//! wall. Medians of frames taken in turns, so that a busy machine slows all alike. `cargo bench --bench render [-- ADAPTER]` prints tables
//! and writes them to `target/render-bench/render.{md,csv}`, which `make bench` puts into `results/`.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use glam::Vec3;
use sphereboard::Seed;
use sphereboard::compare::papers::{in_rows, one_tree};
use sphereboard::gpu::layout::Instance;
use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::model::TreeModel;
use sphereboard::model::pipeline::{self, ModelParams, Request, View};
use sphereboard::params::ParamValue as _;
use sphereboard::photo::{DecodeParams, Hints, decode};
use sphereboard::render::{Background, Camera, FOV_Y_RAD, GrowthChoice, GrowthParams, Renderer, Shot, Stage, Stand, Tree};

/// Frames of each kind, after [`WARM`].
const RUNS: usize = 21;
/// Frames before, in which drivers compile.
const WARM: usize = 3;
const SIZE_PX: [u32; 2] = [1440, 810];
/// Growth may add so much to a frame on the software driver.
const GROWTH_SHARE: f64 = 0.35;

/// What is measured together, in turns.
struct Scene<'a> {
    name: String,
    stands: Vec<Stand<'a>>,
    shots: Vec<(String, Shot)>,
}

/// What was measured of one shot, ms.
struct Measured {
    scene: String,
    shot: String,
    passes: Vec<(&'static str, f64)>,
    frame: f64,
}

fn main() -> sphereboard::Result<()> {
    let choice: AdapterChoice =
        std::env::args().skip(1).find(|a| !a.starts_with("--")).unwrap_or_else(|| "auto".into()).parse().unwrap();
    let gpu = match Gpu::open(&choice) {
        Ok(gpu) => gpu,
        Err(why) => {
            eprintln!("SKIPPED: no graphics adapter ({why}); install mesa-vulkan-drivers");
            return Ok(());
        }
    };
    let mut renderer = Renderer::new(gpu)?;
    let model = modelled()?;
    let tree = renderer.upload(&model.parts())?.growing(model.about.growth);
    let height_m = tree.bounds().expect("a tree of something").size().y;
    let rows: Vec<Vec<Instance>> = [1, 10, 100, 540].into_iter().map(|count| in_rows(height_m, count)).collect();
    let mut measured = measure(&mut renderer, &fig_16(&tree, &rows[0]))?;
    for instances in &rows {
        measured.extend(measure(&mut renderer, &reshaped(&tree, instances))?);
    }
    let growth = growth_share(&mut renderer, &tree, &rows[0])?;
    store(&renderer.gpu, &tree, &measured, &growth);
    Ok(())
}

fn modelled() -> sphereboard::Result<TreeModel> {
    let photo = decode::decode(Path::new("photos/oak.jpg"), &DecodeParams::default())?;
    let views = [View { photo, hints: Hints::default(), azimuth_rad: 0.0 }];
    let request =
        Request { views: &views, params: &ModelParams::default(), height_is_given: false, seed: Seed(1), sources: vec![] };
    Ok(pipeline::run(&request, &|_| ())?.model)
}

fn fig_16<'a>(tree: &'a Tree, instances: &'a [Instance]) -> Scene<'a> {
    let stages = [Stage::Unshaped, Stage::Reshaped, Stage::Antialiased, Stage::Lit];
    let shots = stages.map(|stage| (stage.show(), Shot { stage, ..one_tree(tree, SIZE_PX) }));
    Scene { name: "one tree".to_owned(), stands: vec![Stand { tree, instances }], shots: shots.into() }
}

/// Rows of trees from slightly above, as near as they fill the picture; outlines of all of them grow by a pixel or more.
fn reshaped<'a>(tree: &'a Tree, instances: &'a [Instance]) -> Scene<'a> {
    let height_m = tree.bounds().expect("a tree of something").size().y;
    let half_width_m = instances.iter().map(|i| i.position[0]).fold(0.0, f32::max) + 0.5 * height_m;
    let half_across = (0.5 * FOV_Y_RAD).tan() * SIZE_PX[0] as f32 / SIZE_PX[1] as f32;
    let distance_m = (half_width_m / half_across).max(2.6 * height_m);
    let camera = Camera::orbit(Vec3::Y * 0.4 * height_m, 0.0, 0.35, distance_m);
    // Longest growth is told, in metres for two pixels at the farthest tree.
    let [a, b] = camera.px_per_m(SIZE_PX[1]);
    let farthest_m = distance_m + half_width_m + height_m;
    let max_m = 2.0 * f64::from(farthest_m / (a * farthest_m + b * camera.distance_m(1.0)));
    let growth = GrowthParams { growth_max_m: max_m.max(tree.growth().max_m), ..GrowthParams::default() };
    let shot = Shot { stage: Stage::Reshaped, background: Background::Sky, growth, ..Shot::new(camera, SIZE_PX) };
    let name = if instances.len() == 1 { "1 tree in a row".to_owned() } else { format!("{} trees in rows", instances.len()) };
    Scene { name, stands: vec![Stand { tree, instances }], shots: vec![(Stage::Reshaped.show(), shot)] }
}

/// Times every shot of a scene, in turns: passes by the device, and the whole frame by the clock on the wall.
fn measure(renderer: &mut Renderer, scene: &Scene) -> sphereboard::Result<Vec<Measured>> {
    let mut frames = vec![vec![]; scene.shots.len()];
    let mut passes = vec![vec![]; scene.shots.len()];
    for run in 0..WARM + RUNS {
        for (number, (_, shot)) in scene.shots.iter().enumerate() {
            let begun = Instant::now();
            renderer.frame(shot, &scene.stands)?;
            let frame = begun.elapsed().as_secs_f64() * 1e3;
            let timed = renderer.timed(shot, &scene.stands)?;
            if run >= WARM {
                frames[number].push(frame);
                passes[number].push(timed);
            }
        }
    }
    let median_passes = |runs: &Vec<Vec<(&'static str, f64)>>| {
        let of_pass = |i: usize| (runs[0][i].0, median(runs.iter().map(|run| run[i].1).collect()));
        (0..runs[0].len()).map(of_pass).collect()
    };
    let of_shot = |((name, _), (frames, passes)): (&(String, Shot), (Vec<f64>, Vec<_>))| Measured {
        scene: scene.name.clone(),
        shot: name.clone(),
        passes: median_passes(&passes),
        frame: median(frames),
    };
    Ok(scene.shots.iter().zip(frames.into_iter().zip(passes)).map(of_shot).collect())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Every stage that grows, as its name with the background's, the frame with growth and the same without, ms. Under a sky growth is a
/// smaller share of more.
fn growth_share(renderer: &mut Renderer, tree: &Tree, instances: &[Instance]) -> sphereboard::Result<Vec<(String, f64, f64)>> {
    let stands = [Stand { tree, instances }];
    let none = GrowthParams { growth: GrowthChoice::None, ..GrowthParams::default() };
    let stages = [Stage::Reshaped, Stage::Antialiased, Stage::Lit];
    let frames = stages.into_iter().flat_map(|stage| [(stage, Background::Sky), (stage, Background::Black)]);
    frames
        .map(|(stage, background)| {
            let with = Shot { stage, background, ..one_tree(tree, SIZE_PX) };
            let without = Shot { growth: none.clone(), ..with.clone() };
            let mut times = [vec![], vec![]];
            for run in 0..WARM + 2 * RUNS {
                for (shot, times) in [&with, &without].into_iter().zip(&mut times) {
                    let begun = Instant::now();
                    renderer.frame(shot, &stands)?;
                    if run >= WARM {
                        times.push(begun.elapsed().as_secs_f64() * 1e3);
                    }
                }
            }
            let [with, without] = times.map(median);
            Ok((format!("{}, {} behind", stage.show(), background.show()), with, without))
        })
        .collect()
}

/// Prints the tables, and writes them.
fn store(gpu: &Gpu, tree: &Tree, measured: &[Measured], growth: &[(String, f64, f64)]) {
    let info = &gpu.info;
    let clock = if gpu.has_timestamps() { "the device's timestamps" } else { "the clock on the wall, waiting after each" };
    let mut text = format!(
        "# Rendering\n\n{} ({:?}), {} {}. {}×{} pixels; a tree of {} triangles. Medians of {RUNS} frames, ms; passes by {clock}.\n\n",
        info.name,
        info.device_type,
        info.driver,
        info.driver_info,
        SIZE_PX[0],
        SIZE_PX[1],
        tree.triangles()
    );
    let mut rows = String::from("adapter,driver,scene,stage,pass,median_ms\n");
    let mut row = |m: &Measured, pass: &str, ms: f64| {
        let _ = writeln!(rows, "\"{}\",\"{} {}\",{},{},{pass},{ms:.3}", info.name, info.driver, info.driver_info, m.scene, m.shot);
    };
    text += "| scene | stage | frame | passes |\n| --- | --- | --- | --- |\n";
    for m in measured {
        m.passes.iter().for_each(|(pass, ms)| row(m, pass, *ms));
        row(m, "frame", m.frame);
        let passes: Vec<_> = m.passes.iter().map(|(pass, ms)| format!("{pass} {ms:.2}")).collect();
        let _ = writeln!(text, "| {} | {} | {:.2} | {} |", m.scene, m.shot, m.frame, passes.join(", "));
    }
    text += "\n| growth, one tree | with, ms | without, ms | more | asked for |\n| --- | --- | --- | --- | --- |\n";
    for (stage, with, without) in growth {
        let (more, most) = (100.0 * (with / without - 1.0), 100.0 * GROWTH_SHARE);
        let _ = writeln!(text, "| {stage} | {with:.2} | {without:.2} | {more:.0} % | at most {most:.0} % on a software driver |");
    }
    println!("{text}");
    let folder = Path::new("target/render-bench");
    let written = std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(folder.join("render.md"), &text))
        .and_then(|()| std::fs::write(folder.join("render.csv"), &rows));
    written.unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
}
