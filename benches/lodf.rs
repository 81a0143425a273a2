//! Foliage in levels of detail: how long simplification takes, what is stored (Rebollo tables II to V), and what a change of level costs
//! (fig. 15 and 16), beside the predecessor VDF and meshoptimizer's simplifier. Trunks are left out: they are the same on all sides.
//!
//! * simplification of 100,000 leaves;
//! * storage on synthetic foliage of just the paper's leaf counts;
//! * extraction: the level goes from 0 to 1 (all leaves to one a cluster) in 50 steps, everywhere at once or by the distance from a viewer
//!   who walks off; CPU-side (the list of all leaves shown is written anew, as it is sent) and GPU-resident (what has changed is sent);
//! * total: extraction and a frame of 256×256 pixels, where there is an adapter.
//!
//! `cargo bench --bench lodf`; prints its figures and writes them to `target/render-bench/lodf.{md,csv}`, which `make bench` puts into
//! `results/`.

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use sphereboard::geom::Surface;
use sphereboard::gpu::{AdapterChoice, Gpu, layout::Instance};
use sphereboard::model::{Material, Part};
use sphereboard::render::{Camera, Renderer, Shot, Stage, Stand};
use sphereboard::repr::lodf::{Detail, LeafForest, LeafId, Resolution, Shown, Viewer, Wanted, Zones, foliage, simplify, storage};
use sphereboard::repr::vdf::Hierarchy;
use sphereboard::repr::{BuiltPart, BuiltTree, Drawn, Seen};
use sphereboard::{Result, Seed};

/// The tree of fig. 11, 15 and 16: Taxus Baccata.
const LEAVES: usize = 48_160;
const CLUSTERS: usize = 641;
/// Levels between 0 and 1.
const STEPS: usize = 50;
/// Passes over all levels, of which the quickest counts at each level.
const RUNS: usize = 5;

/// What was measured at one level.
struct Row {
    how: &'static str,
    what: &'static str,
    level: f64,
    ms: f64,
    leaves: usize,
    bytes: u64,
}

fn main() -> Result<()> {
    let mut text = "# Foliage in levels of detail\n".to_owned();
    simplification(&mut text);
    storage_tables(&mut text);
    let surface = foliage::synthetic(LEAVES, Seed(1));
    let begun = Instant::now();
    let forest = LeafForest::of(&surface, CLUSTERS);
    let _ = writeln!(text, "\n{LEAVES} leaves in {CLUSTERS} clusters: {:.0} ms.\n", begun.elapsed().as_secs_f64() * 1e3);
    let mut rows = extraction(&surface, &forest);
    match Gpu::open(&"auto".parse::<AdapterChoice>().unwrap_or_else(|never| match never {})) {
        Ok(gpu) => {
            let _ = writeln!(text, "Drawn by {}, {} {}.\n", gpu.info.name, gpu.info.driver, gpu.info.driver_info);
            total(&mut Renderer::new(gpu)?, &surface, &forest, &mut rows)?;
        }
        Err(what) => eprintln!("SKIPPED: no graphics adapter ({what}); install mesa-vulkan-drivers"),
    }
    summary(&rows, &mut text);
    println!("{text}");
    store(&text, &rows);
    Ok(())
}

fn simplification(text: &mut String) {
    let blades = foliage::blades(&foliage::synthetic(100_000, Seed(2)));
    let begun = Instant::now();
    let collapses = simplify::simplify(&blades, 1_389);
    let seconds = begun.elapsed().as_secs_f64();
    let _ = writeln!(text, "\nSimplification of 100,000 leaves to {}: {seconds:.2} s.", blades.len() - collapses.len());
}

fn storage_tables(text: &mut String) {
    let row = |&(tree, leaves, groups): &(&str, usize, usize)| {
        storage::Row::of(tree, &LeafForest::of(&foliage::synthetic(leaves, Seed(1)), groups))
    };
    let rows: Vec<_> = storage::TREES.iter().map(row).collect();
    let _ = writeln!(
        text,
        "\n## What is stored\n\nSynthetic foliage of the paper's leaf counts and clusters.\n\n{}",
        storage::table(&rows)
    );
}

/// Walks over all levels `RUNS` times and keeps the quickest of each. `change` goes to a level and gives leaves and bytes sent.
fn walked(rows: &mut Vec<Row>, how: &'static str, what: &'static str, mut change: impl FnMut(f64) -> (usize, u64)) {
    let mut best: Vec<Row> = vec![];
    for run in 0..RUNS {
        change(0.0);
        for step in 1..=STEPS {
            let level = step as f64 / STEPS as f64;
            let begun = Instant::now();
            let (leaves, bytes) = change(level);
            let ms = begun.elapsed().as_secs_f64() * 1e3;
            if run == 0 {
                best.push(Row { how, what, level, ms, leaves, bytes });
            } else {
                best[step - 1].ms = best[step - 1].ms.min(ms);
            }
        }
    }
    rows.extend(best);
}

/// A viewer who walks off, in the crown's own space: at level 0 so near that all is shown in full, at 1 so far that nothing is.
fn viewer(level: f64) -> Viewer {
    Viewer::at(Vec3::new(0.0, 6.0, 5.0 + 195.0 * level as f32), 10.0)
}

fn by_distance(forest: &LeafForest) -> LeafForest {
    LeafForest { detail: Detail { near: 0.4, far: 19.0, least: 0.0, zones: Zones::Distance }, ..forest.clone() }
}

fn extraction(surface: &Surface, forest: &LeafForest) -> Vec<Row> {
    let mut rows = vec![];
    let structure = &forest.forest;
    let blades = foliage::blades(surface);
    let collapses = simplify::simplify(&blades, CLUSTERS);
    let last = collapses.len() as f64;
    let zones = by_distance(forest);
    let corners_of = |leaf: u32, corner: u8| surface.mesh.quads[leaf as usize][usize::from(corner)];

    // What is sent of CPU-side models: the four vertex numbers of every leaf shown.
    let hierarchy = Hierarchy::new(&surface.mesh, &collapses);
    let mut out: Vec<[u32; 4]> = Vec::with_capacity(LEAVES);
    let mut front = hierarchy.finest();
    let mut listed = |front: &sphereboard::repr::vdf::Front| {
        out.clear();
        out.extend(
            front
                .nodes()
                .iter()
                .map(|&node| hierarchy.nodes()[node as usize].corners.map(|c| corners_of(c >> 3, (c >> 1 & 3) as u8))),
        );
        (black_box(&out).len(), 16 * out.len() as u64)
    };
    walked(&mut rows, "vdf", "uniform, extraction", |level| {
        hierarchy.set_uniform(&mut front, (level * last) as usize);
        listed(&front)
    });
    walked(&mut rows, "vdf", "variable, extraction", |level| {
        let (eye, detail) = (viewer(level).eye, zones.detail);
        hierarchy.set_variable(&mut front, |(middle, radius)| {
            last as f32 * (1.0 - detail.share(0.1 * (eye.distance(middle) - radius).max(0.0)))
        });
        listed(&front)
    });

    let mut out: Vec<[u32; 4]> = Vec::with_capacity(LEAVES);
    let mut resolution = Resolution::finest(structure);
    let mut listed = |resolution: &Resolution| {
        out.clear();
        for cluster in 0..structure.clusters() as u32 {
            out.extend(
                structure
                    .shown(cluster, resolution.collapsed(cluster))
                    .map(|number| structure.shape(LeafId { cluster, number }).corners.map(|c| corners_of(c.leaf, c.corner))),
            );
        }
        (black_box(&out).len(), 16 * out.len() as u64)
    };
    walked(&mut rows, "lodf, CPU-side", "uniform, extraction", |level| {
        resolution.set_uniform(structure, LEAVES - (level * last) as usize);
        listed(&resolution)
    });
    walked(&mut rows, "lodf, CPU-side", "variable, extraction", |level| {
        let Wanted::Variable(wanted) = zones.wanted(&viewer(level)) else { return (0, 0) };
        resolution.set_variable(structure, |cluster| wanted[cluster as usize] as usize);
        listed(&resolution)
    });

    let mut shown = Shown::finest(forest);
    walked(&mut rows, "lodf, GPU-resident", "uniform, extraction", |level| {
        let sent = shown.set(forest, &Wanted::Uniform((level * last) as f32));
        (shown.entries().len(), sent.bytes() as u64)
    });
    walked(&mut rows, "lodf, GPU-resident", "variable, extraction", |level| {
        let sent = shown.set(&zones, &zones.wanted(&viewer(level)));
        (shown.entries().len(), sent.bytes() as u64)
    });

    let indices: Vec<u32> = surface.mesh.triangulated().flatten().collect();
    let positions: Vec<[f32; 3]> = surface.mesh.positions.iter().map(|p| p.to_array()).collect();
    walked(&mut rows, "meshopt", "uniform, extraction", |level| {
        let left = (LEAVES as f64 - level * last) as usize;
        let kept = meshopt::simplify_sloppy_decoder(&indices, &positions, 6 * left, f32::MAX, None);
        (black_box(&kept).len() / 6, 4 * kept.len() as u64)
    });
    rows
}

/// Extraction and a frame.
fn total(renderer: &mut Renderer, surface: &Surface, forest: &LeafForest, rows: &mut Vec<Row>) -> Result<()> {
    let texture = image::RgbaImage::from_pixel(1, 1, image::Rgba([60, 120, 40, 255]));
    let material = Material { texture: Some(Arc::new(texture)), two_sided: true, alpha_cutoff: Some(0.5), ..Material::default() };
    let part = Part { name: "leaves".to_owned(), surface: surface.clone(), material, crown_center: None };
    let bounds = part.surface.mesh.bounds().expect("leaves");
    let mut failed = Ok(());
    for (how, resent) in [("vdf", true), ("lodf, GPU-resident", false)] {
        for (what, zones) in [("uniform, total", Zones::Uniform), ("variable, total", Zones::Distance)] {
            let forest = LeafForest { resent, detail: Detail { zones, ..by_distance(forest).detail }, ..forest.clone() };
            let drawn = BuiltPart { part: part.clone(), drawn: Drawn::Forest(Arc::new(forest)), seen: Seen::default() };
            let tree = renderer.upload_built(&BuiltTree::new(bounds, vec![drawn]))?;
            walked(rows, how, what, |level| {
                let camera = Camera::orbit(bounds.center(), 0.0, 0.0, 5.0 + 195.0 * level as f32);
                let shot = Shot { stage: Stage::Unshaped, ..Shot::new(camera, [256, 256]) };
                let frame = renderer.frame(&shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }]);
                if failed.is_ok() {
                    failed = frame;
                }
                (renderer.leaves_shown(), renderer.sent_bytes())
            });
        }
    }
    failed
}

/// Means over all levels, and how far each is behind the quickest.
fn summary(rows: &[Row], text: &mut String) {
    text.push_str("## What a change of level costs\n\nMeans over 50 levels, quickest of 5 passes.\n\n| | | ms | times the GPU-resident | sent, KB |\n|---|---|---:|---:|---:|\n");
    let mean = |of: &dyn Fn(&Row) -> f64, how: &str, what: &str| {
        let mine: Vec<f64> = rows.iter().filter(|row| row.how == how && row.what == what).map(of).collect();
        mine.iter().sum::<f64>() / mine.len().max(1) as f64
    };
    for rows in rows.chunk_by(|a, b| (a.how, a.what) == (b.how, b.what)) {
        let Row { how, what, .. } = rows[0];
        let ms = mean(&|row| row.ms, how, what);
        let resident = mean(&|row| row.ms, "lodf, GPU-resident", what);
        let sent = mean(&|row| row.bytes as f64, how, what) / 1024.0;
        let _ = writeln!(text, "| {how} | {what} | {ms:.3} | {:.1} | {sent:.1} |", ms / resident.max(1e-9));
    }
}

fn store(text: &str, rows: &[Row]) {
    let mut csv = "method,what,level,ms,leaves,bytes_sent\n".to_owned();
    for Row { how, what, level, ms, leaves, bytes } in rows {
        let _ = writeln!(csv, "\"{how}\",\"{what}\",{level:.2},{ms:.4},{leaves},{bytes}");
    }
    let folder = Path::new("target/render-bench");
    let written = std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(folder.join("lodf.md"), text))
        .and_then(|()| std::fs::write(folder.join("lodf.csv"), csv));
    if let Err(what) = written {
        eprintln!("the tables could not be written to {}: {what}", folder.display());
    }
}
