//! The report of everything that was measured so far: tables and plots.

use std::fmt::Write as _;
use std::path::Path;

use sphereboard::grove::plots::{Chart, Curve, Drawn};
use sphereboard::repr::METHODS;
use sphereboard::{Error, Result, files};

use crate::bars::{self, BARS, Bar};
use crate::site::{Moment, Row, recalled};

type File = (&'static str, String);

pub fn write() -> Result<()> {
    let mut text =
        "# Groves\n\nA frame is timed by the clock on the wall until the device has finished it, nothing is read back, the first \
                    three are left out. Where a path has more frames than time allows, fewer are taken, spread over all of it.\n"
            .to_owned();
    let mut plots: Vec<File> = vec![];
    bars_table(&mut text);
    lodf(&mut text);
    culling(&mut text);
    alone(&mut text, &mut plots)?;
    tour(&mut text, &mut plots)?;
    behind(&mut text);
    println!("{text}");
    let folder = Path::new("target/render-bench");
    std::fs::create_dir_all(folder).map_err(|cause| Error::Write { path: folder.to_owned(), cause })?;
    plots.extend([("grove.md", text), ("grove.csv", csv()?)]);
    let files: Vec<_> = plots.into_iter().map(|(name, text)| (folder.join(name), text.into_bytes())).collect();
    files::write_all(&files)
}

/// Every row.
fn all() -> Vec<Row> {
    let jobs = BARS.iter().map(Bar::job).chain(METHODS.iter().map(|method| format!("alone:{}", method.id())));
    jobs.chain(["tour", "behind"].map(str::to_owned)).flat_map(|job| recalled::<Row>(&job)).collect()
}

fn csv() -> Result<String> {
    let internal = |what: String| Error::Internal { stage: "the bench's table", what };
    let mut writer = csv::Writer::from_writer(vec![]);
    all().iter().try_for_each(|row| writer.serialize(row)).map_err(|e| internal(e.to_string()))?;
    writer.into_inner().map_err(|e| internal(e.to_string())).map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
}

fn is_software(row: &Row) -> bool {
    row.adapter.contains("llvmpipe")
}

fn bars_table(text: &mut String) {
    *text += "\n## The scenes of the bars\n\n| scene | method | paper | bar, fps | fps | median, ms | 99 %, ms | frames | trees | seen | near | triangles | draws | bytes/tree | memory, MB | species, s | start, s | adapter |\n|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---|\n";
    for bar in &BARS {
        for row in bars::rows(bar) {
            let asked = bar.fps[usize::from(!is_software(&row))];
            let met =
                asked.map_or_else(|| "–".to_owned(), |fps| format!("≥ {fps}{}", if row.fps() >= fps { "" } else { " (missed)" }));
            let Row {
                method,
                median_ms,
                p99_ms,
                frames,
                trees,
                seen,
                near,
                triangles,
                draws,
                bytes_per_tree,
                memory_mb,
                species_s,
                start_s,
                adapter,
                ..
            } = &row;
            let _ = writeln!(
                text,
                "| {} | {method} | {} | {met} | {:.1} | {median_ms:.1} | {p99_ms:.1} | {frames} | {trees} | {seen} | {near} | {triangles} | {draws} | {bytes_per_tree:.1} | {memory_mb:.0} | {species_s:.1} | {start_s:.1} | {adapter} |",
                bar.job(),
                bar.paper,
                row.fps()
            );
        }
    }
    *text += "\nMemory is the most that the process ever held, growing the species included; of `rebollo-100` its second row. Start: placing all \
              trees and putting them onto the device.\n";
}

/// Who culls.
fn culling(text: &mut String) {
    *text += "\n## Culling\n\nMilliseconds from a camera's step until the device knows what is seen and what casts shadows: median of 15 places on \
              the path. At the start of a drive both are measured, and the faster culls.\n\n| scene | trees | processor | device | chosen |\n\
              |---|---:|---:|---:|---|\n";
    for (bar, row) in BARS.iter().flat_map(|bar| bars::rows(bar).into_iter().take(1).map(move |row| (bar, row))) {
        let Row { trees, cpu_cull_ms, compute_cull_ms, culling, .. } = row;
        let _ = writeln!(text, "| {} | {trees} | {cpu_cull_ms:.2} | {compute_cull_ms:.2} | {culling} |", bar.job());
    }
}

/// Rebollo: what fewer triangles gain, and what is seen of it.
fn lodf(text: &mut String) {
    let rows = recalled::<Row>("rebollo-100");
    let [ours, whole] = &rows[..] else { return };
    let saved = whole.triangles as f64 / ours.triangles.max(1) as f64;
    let gained = whole.median_ms / ours.median_ms;
    let _ = writeln!(
        text,
        "\nRebollo §V: LoDF draws {:.0} % fewer triangles ({saved:.2} times fewer) and is {gained:.2} times as fast: {:.2} of that ratio (asked for: \
         0.85). FLIP over the pixels of trees, mean of three pictures against all leaves: {:.3} (asked for: at most 0.05).",
        100.0 * (1.0 - 1.0 / saved),
        gained / saved,
        ours.flip
    );
}

fn alone(text: &mut String, plots: &mut Vec<File>) -> Result<()> {
    let of_method =
        |method: &&dyn sphereboard::repr::Representation| (method.id(), recalled::<Row>(&format!("alone:{}", method.id())));
    let measured: Vec<(&str, Vec<Row>)> = METHODS.iter().map(of_method).filter(|(_, rows)| !rows.is_empty()).collect();
    let Some((_, first)) = measured.first() else { return Ok(()) };
    let _ = write!(
        text,
        "\n## Each method alone\n\nFrames a second at 640 × 360 on {}; birches 40 m² each, a camera going round in their middle. FLIP: \
                    over the pixels of trees in the picture of 100, against geometry.\n\n| method | FLIP |",
        first[0].adapter
    );
    crate::alone::TREES.iter().for_each(|trees| *text += &format!(" {trees} |"));
    *text += &format!("\n|---|---:|{}\n", "---:|".repeat(crate::alone::TREES.len()));
    let flip = |rows: &[Row]| rows.iter().map(|row| row.flip).find(|flip| flip.is_finite());
    for (method, rows) in &measured {
        let _ = write!(text, "| {method} | {} |", flip(rows).map_or_else(|| "–".to_owned(), |flip| format!("{flip:.3}")));
        for trees in crate::alone::TREES {
            let row = rows.iter().find(|row| row.trees as u64 == trees);
            let _ = write!(text, " {} |", row.map_or_else(|| "–".to_owned(), |row| format!("{:.1}", row.fps())));
        }
        text.push('\n');
    }
    *text += "\nA method stops where a frame takes more than a second.\n";
    let curves = measured
        .iter()
        .map(|(method, rows)| Curve::new(*method, Drawn::Line, rows.iter().map(|row| [row.trees as f64, row.fps()]).collect()));
    let by_number =
        chart("Frame rate against number of trees, each method alone", ["trees", "frames a second"], [true; 2], curves.collect());
    plots.push(("grove.svg", by_number.draw()?.svg));
    let at_most = |rows: &[Row]| rows.iter().find(|row| row.trees == 10_000).map(Row::fps);
    let points = measured.iter().filter_map(|(method, rows)| {
        Some(Curve::new(*method, Drawn::Line, vec![[flip(rows).filter(|flip| *flip > 0.0)?, at_most(rows)?]]))
    });
    let title = "Frame rate of 10,000 trees against image error, each method alone";
    let by_error = chart(title, ["FLIP over the pixels of trees", "frames a second"], [false, true], points.collect());
    plots.push(("grove-error.svg", by_error.draw()?.svg));
    Ok(())
}

fn chart(title: &str, axes: [&str; 2], logarithmic: [bool; 2], curves: Vec<Curve>) -> Chart {
    Chart { title: title.to_owned(), axes: axes.map(str::to_owned), logarithmic, curves }
}

fn tour(text: &mut String, plots: &mut Vec<File>) -> Result<()> {
    let rows = recalled::<Row>("tour");
    let Some(first) = rows.first() else { return Ok(()) };
    let _ = write!(
        text,
        "\n## Truelsen's tour\n\n{} trees as slices (`{}`), {}. Each drive but the batches' is `indirect` with levels and culling. Truelsen's own: \
         batches gain 2 to 4 times far away and little near (fig. 32), levels likewise (fig. 30); of 11 or 9 fps culling makes 11 to 42 or 9 to 38 \
         (table 3).\n\n| drive | fps | median, ms | 99 %, ms | triangles | draws | trees seen |\n|---|---:|---:|---:|---:|---:|---:|\n",
        first.trees, first.method, first.adapter
    );
    for row in &rows {
        let Row { how, median_ms, p99_ms, triangles, draws, seen, .. } = row;
        let _ = writeln!(text, "| {how} | {:.1} | {median_ms:.1} | {p99_ms:.1} | {triangles} | {draws} | {seen} |", row.fps());
    }
    let moments = recalled::<Moment>("tour-moments");
    // A third, two thirds of the way, and its end are far, near, far; table 3 has three positions.
    let at = |how: &str, share: f32| {
        let of: Vec<&Moment> = moments.iter().filter(|moment| moment.how == how).collect();
        of.get(((share * of.len() as f32) as usize).min(of.len().saturating_sub(1))).map(|m| (1e3 / m.ms, m.triangles))
    };
    *text += "\n| position on the path | with culling: fps | triangles | without: fps | triangles |\n|---|---:|---:|---:|---:|\n";
    for share in [0.0, 0.25, 0.5] {
        let cell =
            |how: &str| at(how, share).map_or_else(|| "– | –".to_owned(), |(fps, triangles)| format!("{fps:.1} | {triangles}"));
        let _ = writeln!(text, "| {share} | {} | {} |", cell("indirect"), cell("no culling"));
    }
    let curve = |how: &str, name: &str, of: &dyn Fn(&Moment) -> f64| {
        let points = moments.iter().filter(|moment| moment.how == how).map(|moment| [f64::from(moment.time_s), of(moment)]);
        Curve::new(name, Drawn::Line, points.collect())
    };
    let fps = |moment: &Moment| 1e3 / moment.ms;
    let triangles = |moment: &Moment| moment.triangles as f64;
    let axes = |up| ["seconds along the path", up];
    let levels = |of: &dyn Fn(&Moment) -> f64| vec![curve("indirect", "with levels", of), curve("no levels", "without", of)];
    let batches = crate::tour::batches().into_iter().map(|batch| curve(batch, batch, &fps)).collect();
    for (name, title, up, curves) in [
        ("grove-fig30.svg", "Truelsen fig. 30: the tour with and without levels", "frames a second", levels(&fps)),
        ("grove-fig31.svg", "Truelsen fig. 31: triangles along the tour", "triangles", levels(&triangles)),
        ("grove-fig32.svg", "Truelsen fig. 32: the tour by batch", "frames a second", batches),
    ] {
        plots.push((name, chart(title, axes(up), [false; 2], curves).draw()?.svg));
    }
    Ok(())
}

fn behind(text: &mut String) {
    let rows = recalled::<Row>("behind");
    let [half, whole] = &rows[..] else { return };
    let _ = writeln!(
        text,
        "\n## Trees behind the camera\n\n{} trees, and {} of which the added ones are all behind the camera: both show {} and {} in {} and {} calls, with {} sent \
         to the device in every frame; a frame takes {} times as long (median of {} pairs; asked for: at most 1.10).",
        half.trees, whole.trees, half.seen, whole.seen, half.draws, whole.draws, half.how, whole.how, whole.frames
    );
}
