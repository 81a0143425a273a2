//! What every representation of one tree costs, counted and timed, and the tables of the papers that count:
//!
//! * every row of `METHODS` on the oak: milliseconds to build it (median of 3), and level by level polygons, calls, bytes;
//! * Lluch04 fig. 7: polygons of the whole tree and of each arrangement of boxes; bytes of a stream;
//! * Lluch03 table 1: branches and polygons of a multichain, coarsest to finest;
//! * Truelsen's table 2 (cost against distance) and table 4 (cost against texture size), for his slices;
//! * LodStrips beside plain indexed simplification: bytes, milliseconds, Hausdorff distance.
//!
//! `cargo bench --bench methods`. Prints its tables and writes them to `target/render-bench/methods.md`, which `make bench` puts into
//! `results/`.

use std::fmt::Write as _;

use sphereboard::compare::papers::box_polygons;
use sphereboard::plant::presets::preset;
use sphereboard::repr::grid_slices::tables;
use sphereboard::repr::{self, BuiltTree, Job, METHODS, Order, Scope, Settings, SoftwareCapture, Stats, TreeSource};
use sphereboard::{Result, Seed};

const SEED: Seed = Seed(1);

fn main() -> Result<()> {
    let (oak, _) = TreeSource::open("oak", &Default::default(), SEED)?;
    let mut text =
        "# Representations of the oak preset\n\n20,281 leaves, 189,990 triangles; software capture; seed 1.\n".to_owned();
    every_method(&oak, &mut text)?;
    boxes(&oak, &mut text)?;
    multichain(&mut text)?;
    slices(&oak, &mut text)?;
    strips(&oak, &mut text);
    println!("{text}");
    let folder = std::path::Path::new("target/render-bench");
    if let Err(what) = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(folder.join("methods.md"), &text)) {
        eprintln!("the tables could not be written to {}: {what}", folder.display());
    }
    Ok(())
}

fn built(id: &str, source: &TreeSource, settings: &Settings) -> Result<BuiltTree> {
    repr::build(&Order { method: id, trunk: None, settings, seed: SEED }, source, &SoftwareCapture::new())
}

fn megabytes(bytes: usize) -> f64 {
    bytes as f64 / 1e6
}

fn every_method(oak: &TreeSource, text: &mut String) -> Result<()> {
    *text += "\n## Every method\n\n| method | built, ms | level | seen whole at, heights | polygons | triangles | draw calls | textures | textures, MB | geometry, MB |\n|---|---:|---|---:|---:|---:|---:|---:|---:|---:|\n";
    for method in METHODS {
        let mut times: Vec<f64> = vec![];
        let mut last = None;
        for _ in 0..3 {
            let built = built(method.id(), oak, &Settings::default())?;
            times.push(built.build_ms);
            last = Some(built);
        }
        times.sort_by(f64::total_cmp);
        let built = last.expect("built three times");
        for (number, (level, (name, s))) in built.levels.iter().zip(Stats::of_levels(&built)).enumerate() {
            let (id, ms) = if number == 0 { (method.id(), format!("{:.0}", times[1])) } else { ("", String::new()) };
            let _ = writeln!(
                text,
                "| {id} | {ms} | {name} | {:.1} | {} | {} | {} | {} | {:.2} | {:.2} |",
                level.distance,
                s.polygons,
                s.triangles,
                s.draw_calls,
                s.textures,
                megabytes(s.texture_bytes),
                megabytes(s.geometry_bytes)
            );
        }
    }
    Ok(())
}

fn boxes(oak: &TreeSource, text: &mut String) -> Result<()> {
    *text += "\n## Boxes (Lluch04, fig. 7: the tree 20,000 polygons; axis-aligned 20, volumetric 200, diagonal 50; 4 to 6 MB of pictures)\n\n| arrangement | one level: polygons | pictures with mips, MB | stream, files | colours in it, bytes |\n|---|---|---:|---:|---:|\n";
    for arrangement in ["axes", "volume", "diagonal"] {
        let settings = Settings::default().with("arrangement", arrangement);
        let built = built("box-hierarchy", oak, &settings)?;
        let polygons: Vec<String> = built.levels.iter().map(|level| box_polygons(&built, level.distance).to_string()).collect();
        let order = Order { method: "box-hierarchy", trunk: None, settings: &settings, seed: SEED };
        let (stream, _) = repr::box_hierarchy::stream(&order, oak, &SoftwareCapture::new())?;
        let colors = stream.color_bytes();
        let _ = writeln!(
            text,
            "| {arrangement} | {} | {:.2} | {} | {colors} |",
            polygons.join(", "),
            megabytes(Stats::of_all(&built).texture_bytes),
            stream.0.len()
        );
    }
    Ok(())
}

fn multichain(text: &mut String) -> Result<()> {
    *text += "\n## Multichain (Lluch03, table 1)\n\n| preset | coarsest: branches, polygons | medium | high | finest |\n|---|---:|---:|---:|---:|\n";
    for name in ["birch", "acacia"] {
        let preset = preset(name).expect("a preset of that name");
        let (source, _) = TreeSource::grown(preset, None, &Default::default(), SEED)?;
        let (TreeSource::Reference(tree), Some(skeleton)) = (&source, source.skeleton()) else { continue };
        let rows = repr::multichain::table(tree, skeleton, SEED)?;
        let cells: Vec<String> = rows.iter().map(|(branches, polygons)| format!("{branches}, {polygons}")).collect();
        let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
    }
    Ok(())
}

fn slices(oak: &TreeSource, text: &mut String) -> Result<()> {
    let built = built("grid-slices", oak, &Settings::default())?;
    *text += "\n## Grid slices against distance (Truelsen, table 2)\n\n| distance, their units | heights | triangles | draw calls | texture look-ups, pixels |\n|---:|---:|---:|---:|---:|\n";
    for row in tables::against_distance(&built, &tables::TABLE_2_UNITS) {
        let tables::DistanceRow { units, distance, stats, lookups } = row;
        let _ = writeln!(text, "| {units} | {distance:.1} | {} | {} | {lookups:.0} |", stats.triangles, stats.draw_calls);
    }
    *text += "\n## Grid slices against the size of their pictures (Truelsen, table 4)\n\n| side, texels | textures | MB |\n|---:|---:|---:|\n";
    let (settings, capture) = (Settings::default(), SoftwareCapture::new());
    let job = Job { source: oak, scope: Scope::Tree, settings: &settings, seed: SEED, capture: &capture };
    for (side, stats) in tables::against_size(&job, &tables::TABLE_4_PX)? {
        let _ = writeln!(text, "| {side} | {} | {:.2} |", stats.textures, megabytes(stats.texture_bytes));
    }
    Ok(())
}

fn strips(oak: &TreeSource, text: &mut String) {
    let found = repr::lodstrips::measure::compare(&oak.parts(Scope::Wood)[0].surface, SEED);
    let _ = writeln!(
        text,
        "\n## LodStrips beside plain indexed simplification (meshopt), the oak's wood\n\nBuilt in {:.0} ms; {:.2} MB for all levels, {:.2} MB as indexed levels.\n\n| triangles | LodStrips: ms to get there | Hausdorff, m | mean, m | meshopt: ms | Hausdorff, m | mean, m |\n|---:|---:|---:|---:|---:|---:|---:|",
        found.build_ms,
        megabytes(found.lodstrips_bytes),
        megabytes(found.indexed_bytes)
    );
    for [ours, plain] in &found.levels {
        let _ = writeln!(
            text,
            "| {} | {:.2} | {:.3} | {:.4} | {:.2} | {:.3} | {:.4} |",
            ours.triangles, ours.ms, ours.hausdorff_m, ours.mean_m, plain.ms, plain.hausdorff_m, plain.mean_m
        );
    }
}
