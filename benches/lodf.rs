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
use std::path::Path;
use std::time::Instant;

use sphereboard::compare::papers::extraction::{CLUSTERS, LEAVES, Measured, extraction, total};
use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::render::Renderer;
use sphereboard::repr::lodf::{LeafForest, foliage, simplify, storage};
use sphereboard::{Result, Seed};

/// Passes over all levels, of which the quickest counts at each level.
const RUNS: usize = 5;

fn main() -> Result<()> {
    let mut text = "# Foliage in levels of detail\n".to_owned();
    simplification(&mut text);
    storage_tables(&mut text);
    let surface = foliage::synthetic(LEAVES, Seed(1));
    let begun = Instant::now();
    let forest = LeafForest::of(&surface, CLUSTERS);
    let _ = writeln!(text, "\n{LEAVES} leaves in {CLUSTERS} clusters: {:.0} ms.\n", begun.elapsed().as_secs_f64() * 1e3);
    let mut rows = extraction(&surface, &forest, RUNS);
    match Gpu::open(&"auto".parse::<AdapterChoice>().unwrap_or_else(|never| match never {})) {
        Ok(gpu) => {
            let _ = writeln!(text, "Drawn by {}, {} {}.\n", gpu.info.name, gpu.info.driver, gpu.info.driver_info);
            rows.extend(total(&mut Renderer::new(gpu)?, &surface, &forest, RUNS)?);
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

/// Means over all levels, and how far each is behind the quickest.
fn summary(rows: &[Measured], text: &mut String) {
    text.push_str("## What a change of level costs\n\nMeans over 50 levels, quickest of 5 passes.\n\n| | | ms | times the GPU-resident | sent, KB |\n|---|---|---:|---:|---:|\n");
    let mean = |of: &dyn Fn(&Measured) -> f64, how: &str, what: &str| {
        let mine: Vec<f64> = rows.iter().filter(|row| row.how == how && row.what == what).map(of).collect();
        mine.iter().sum::<f64>() / mine.len().max(1) as f64
    };
    for rows in rows.chunk_by(|a, b| (a.how, a.what) == (b.how, b.what)) {
        let Measured { how, what, .. } = rows[0];
        let ms = mean(&|row| row.ms, how, what);
        let resident = mean(&|row| row.ms, "lodf, GPU-resident", what);
        let sent = mean(&|row| row.bytes as f64, how, what) / 1024.0;
        let _ = writeln!(text, "| {how} | {what} | {ms:.3} | {:.1} | {sent:.1} |", ms / resident.max(1e-9));
    }
}

fn store(text: &str, rows: &[Measured]) {
    let mut csv = "method,what,level,ms,leaves,bytes_sent\n".to_owned();
    for Measured { how, what, level, ms, leaves, bytes } in rows {
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
