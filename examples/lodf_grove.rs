//! Rebollo's figures 9 and 12 to 14 redrawn, and how smoothly levels change.
//!
//! * fig. 12–14: 100 trees of 8 species, in full and with 40 % fewer polygons of leaves, and where the pictures differ, with FLIP;
//! * fig. 9: one crown whose near clusters are finer, by each criterion;
//! * a sweep of the level before a standing camera and a dolly: FLIP from frame to frame, largest over median.
//!
//! `cargo run --release --example lodf_grove [FOLDER [TREES]]`, by default `results/local/lodf` and 100 trees.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;
use image::{RgbImage, RgbaImage, imageops};
use sphereboard::gpu::{AdapterChoice, Gpu, layout::Instance};
use sphereboard::metrics::{flip, flip_map, over};
use sphereboard::model::reference::Asked;
use sphereboard::raster::jpeg;
use sphereboard::render::{Camera, Renderer, Shot, Stage, Stand, Tree};
use sphereboard::repr::lodf::{Detail, LeafForest, Zones};
use sphereboard::repr::{BuiltTree, Drawn, Order, Scope, Settings, SoftwareCapture, TreeSource, build};
use sphereboard::{Result, Seed, files};

/// What stands in the grove.
const SPECIES: [&str; 8] = ["oak", "lime", "birch", "acacia", "poplar", "pine", "spruce", "juniper"];
/// Pictures of the grove.
const SIZE_PX: [u32; 2] = [1280, 720];
/// Steps of the sweep and of the dolly.
const STEPS: usize = 24;
/// Pixels of more FLIP than that are marked.
const MARKED: f32 = 0.2;

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().map_or_else(|| PathBuf::from("results/local/lodf"), PathBuf::from);
    let trees: usize = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(100);
    std::fs::create_dir_all(&folder).expect("a folder for the results");
    let mut renderer = Renderer::new(Gpu::open(&AdapterChoice::Auto)?)?;
    let mut text = format!("# Foliage in levels of detail\n\n{}, {}\n", renderer.gpu.info.name, renderer.gpu.info.driver_info);
    let built: Vec<Built> = SPECIES.iter().map(|name| Built::of(name)).collect::<Result<_>>()?;
    grove(&mut renderer, &built, trees, &folder, &mut text)?;
    zones(&mut renderer, &built[0], &folder, &mut text)?;
    steps(&mut renderer, &built[0], &folder, &mut text)?;
    files::write_whole(&folder.join("README.md"), text.as_bytes())?;
    println!("{text}");
    Ok(())
}

/// A species: its wood in full, its foliage as a forest.
struct Built {
    tree: BuiltTree,
    wood_polygons: usize,
    leaves: usize,
}

impl Built {
    fn of(name: &str) -> Result<Self> {
        let (source, _) = TreeSource::open(name, &Asked::default(), Seed(1))?;
        let order = Order { method: "lodf", trunk: Some("geometry"), settings: &Settings::default(), seed: Seed(1) };
        let polygons = |scope| source.parts(scope).iter().map(|part| part.surface.mesh.triangulated().count()).sum();
        let leaves: usize = source.parts(Scope::Foliage).iter().map(|part| part.surface.mesh.polygon_count()).sum();
        Ok(Self { tree: build(&order, &source, &SoftwareCapture::new())?, wood_polygons: polygons(Scope::Wood), leaves })
    }

    /// On the device, with that detail.
    fn with(&self, renderer: &Renderer, detail: Detail) -> Result<Tree> {
        let mut tree = self.tree.clone();
        for part in &mut tree.parts {
            if let Drawn::Forest(forest) = &part.drawn {
                part.drawn = Drawn::Forest(Arc::new(LeafForest { detail, ..(**forest).clone() }));
            }
        }
        renderer.upload_built(&tree)
    }
}

fn level(share: f32) -> Detail {
    Detail { near: 0.0, far: 1e-3, least: share, zones: Zones::Uniform }
}

fn grove(renderer: &mut Renderer, built: &[Built], trees: usize, folder: &Path, text: &mut String) -> Result<()> {
    let side = (trees as f32).sqrt().ceil() as usize;
    let mut places: Vec<Vec<Instance>> = vec![vec![]; built.len()];
    for tree in 0..trees {
        let mut draws = Seed(3).keyed("grove", tree as u64);
        let (column, row) = ((tree % side) as f32, (tree / side) as f32);
        let mut aside = || 5.0 * draws.signed() as f32;
        let position = [(column - 0.5 * side as f32) * 14.0 + aside(), 0.0, -row * 14.0 + aside()];
        let turn = std::f32::consts::PI * draws.unit() as f32;
        let rotation = [0.0, turn.sin(), 0.0, turn.cos()].map(|x| (x * f32::from(i16::MAX)) as i16);
        places[draws.below(built.len())].push(Instance { position, rotation, ..Instance::IDENTITY });
    }
    let camera = Camera::orbit(Vec3::new(0.0, 2.0, -25.0), 0.1, 0.22, 62.0);
    let shot = Shot::new(camera, SIZE_PX);
    let count = |of: &dyn Fn(&Built) -> usize| built.iter().zip(&places).map(|(tree, at)| of(tree) * at.len()).sum::<usize>();
    let (wood, leaves) = (count(&|tree| tree.wood_polygons), count(&|tree| tree.leaves));
    let mut draw = |detail: Detail, shot: &Shot, read: bool| -> Result<(Option<RgbaImage>, usize)> {
        let uploaded: Vec<Tree> = built.iter().map(|tree| tree.with(renderer, detail)).collect::<Result<_>>()?;
        let stands: Vec<Stand> = uploaded.iter().zip(&places).map(|(tree, instances)| Stand { tree, instances }).collect();
        let picture =
            if read { Some(renderer.picture(shot, &stands)?.color) } else { renderer.frame(shot, &stands).map(|()| None)? };
        Ok((picture, renderer.leaves_shown()))
    };
    let (full, all) = draw(level(1.0), &shot, true)?;
    // Two leaves of five go: the farther a tree stands, the more of its own.
    let goal = 0.6 * all as f64;
    let by_distance = |near: f32| Detail { near, far: 6.0 * near, least: 0.08, zones: Zones::Uniform };
    let (mut low, mut high) = (0.05f32, 40.0f32);
    for _ in 0..7 {
        let middle = (low * high).sqrt();
        let (_, left) = draw(by_distance(middle), &Shot { stage: Stage::Unshaped, ..shot.clone() }, false)?;
        if left as f64 > goal { high = middle } else { low = middle }
    }
    let (reduced, left) = draw(by_distance(low), &shot, true)?;
    let (full, reduced) = (over(&full.expect("asked for"), [0; 3]), over(&reduced.expect("asked for"), [0; 3]));
    let map = flip_map(&full, &reduced)?;
    let mut marked = full.clone();
    for (pixel, error) in marked.pixels_mut().zip(&map) {
        let grey = pixel.0.iter().map(|c| u32::from(*c)).sum::<u32>() / 3;
        pixel.0 = if *error > MARKED { [255, 0, 0] } else { [(128 + grey / 2) as u8; 3] };
    }
    let differ = map.iter().filter(|error| **error > MARKED).count() as f64 / map.len() as f64;
    let figures = flip(&full, &reduced)?;
    let _ = writeln!(text, "\n## {trees} trees of {} species (fig. 12–14)\n", built.len());
    let _ = writeln!(
        text,
        "| | polygons of leaves | leaves |\n|---|---:|---:|\n| in full | {} | {all} |\n| reduced | {} | {left} |\n",
        2 * all,
        2 * left
    );
    let _ = writeln!(
        text,
        "{:.1} % fewer polygons of leaves; {leaves} leaves stand in the grove. The wood, {wood} triangles, is the same in both. FLIP {:.4}, p99 {:.4}; {:.1} % of the pixels differ by more than {MARKED}.",
        100.0 * (1.0 - left as f64 / all as f64),
        figures.mean,
        figures.p99,
        100.0 * differ
    );
    for (name, picture) in [("grove_full", &full), ("grove_reduced", &reduced), ("grove_difference", &marked)] {
        save(folder, name, picture)?;
    }
    Ok(())
}

fn zones(renderer: &mut Renderer, built: &Built, folder: &Path, text: &mut String) -> Result<()> {
    let _ = writeln!(text, "\n## Zones of a crown (fig. 9)\n\n| | leaves |\n|---|---:|");
    let bounds = built.tree.bounds;
    let camera = Camera::orbit(bounds.center(), 0.3, 0.1, 1.9 * bounds.max.y);
    let mut sheet = RgbImage::new(4 * 480, 640);
    for (column, zones) in [Zones::Uniform, Zones::Distance, Zones::Size, Zones::Silhouette].into_iter().enumerate() {
        let tree = built.with(renderer, Detail { near: 1.5, far: 2.2, least: 0.04, zones })?;
        let picture =
            renderer.picture(&Shot::new(camera, [480, 640]), &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }])?;
        imageops::replace(&mut sheet, &over(&picture.color, [0; 3]), 480 * column as i64, 0);
        let _ = writeln!(text, "| {zones:?} | {} of {} |", renderer.leaves_shown(), built.leaves);
    }
    save(folder, "zones", &sheet)
}

fn steps(renderer: &mut Renderer, built: &Built, folder: &Path, text: &mut String) -> Result<()> {
    let bounds = built.tree.bounds;
    let orbit = |heights: f32| Camera::orbit(bounds.center(), 0.3, 0.1, heights * bounds.max.y);
    let _ = writeln!(text, "\n## From frame to frame\n\n| | largest FLIP | median | largest over median |\n|---|---:|---:|---:|");
    let mut told = |name: &str, frames: &[RgbImage]| -> Result<()> {
        let flips = frames.windows(2).map(|pair| Ok(flip(&pair[0], &pair[1])?.mean)).collect::<Result<Vec<f64>>>()?;
        let mut sorted = flips.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let (median, largest) = (sorted[sorted.len() / 2], sorted[sorted.len() - 1]);
        let _ = writeln!(text, "| {name} | {largest:.4} | {median:.4} | {:.2} |", largest / median);
        Ok(())
    };
    let size_px = [320, 400];
    let mut sheet = RgbImage::new(6 * size_px[0], 2 * size_px[1]);
    let mut frames = vec![];
    for step in 0..=STEPS {
        let tree = built.with(renderer, level(0.1f32.powf(step as f32 / STEPS as f32)))?;
        let picture =
            renderer.picture(&Shot::new(orbit(1.6), size_px), &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }])?;
        frames.push(over(&picture.color, [0; 3]));
    }
    (0..6).for_each(|k| imageops::replace(&mut sheet, &frames[k * STEPS / 5], i64::from(size_px[0]) * k as i64, 0));
    told("level from 100 % to 10 % of the leaves, by equal shares", &frames)?;
    let tree = built.with(renderer, Detail { near: 3.0, far: 14.0, least: 0.1, zones: Zones::Uniform })?;
    let still = built.with(renderer, level(1.0))?;
    for (name, tree) in [("dolly", &tree), ("the same dolly in full detail", &still)] {
        let mut frames = vec![];
        for step in 0..=STEPS {
            let distance = 1.2 * 4.0f32.powf(step as f32 / STEPS as f32);
            let picture =
                renderer.picture(&Shot::new(orbit(distance), size_px), &[Stand { tree, instances: &[Instance::IDENTITY] }])?;
            frames.push(over(&picture.color, [0; 3]));
        }
        if name == "dolly" {
            (0..6).for_each(|k| {
                imageops::replace(&mut sheet, &frames[k * STEPS / 5], i64::from(size_px[0]) * k as i64, i64::from(size_px[1]))
            });
        }
        told(name, &frames)?;
    }
    save(folder, "levels", &sheet)
}

fn save(folder: &Path, name: &str, picture: &RgbImage) -> Result<()> {
    files::write_whole(&folder.join(format!("{name}.jpg")), &jpeg(picture, 88)?)
}
