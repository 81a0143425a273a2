//! The report of a drive: `report.html` (one page that needs nothing but itself and the pictures beside it), `summary.json`, and
//! `plots/*.svg`, which the page holds too. Everything but the marks that follow a chosen moment is there without a script.

use std::path::{Path, PathBuf};

use minijinja::value::Serde;
use minijinja::{Value, context};
use serde::Serialize;
use serde_json::json;

use crate::page::{self, Page, grouped, safe};
use crate::params::{ParamSet, ParamSpec};
use crate::render::CullParams;
use crate::{Error, Result, files};

use super::drive::Frame;
use super::path::CameraParams;
use super::placement::PlantingParams;
use super::plots::{Chart, Curve, Drawing, Drawn};
use super::record::{Drive, PASSES, Summary};
use super::scene::StageParams;
use super::terrain::TerrainParams;
use super::trail::FollowParams;

const BODY: &str = include_str!("page/grove.html");
const STYLE: &str = include_str!("page/grove.css");
const SCRIPT: &str = include_str!("page/grove.js");

/// A picture of a frame, beside the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Picture {
    /// Its file, seen from the page.
    pub file: String,
    /// Which frame.
    pub frame: u32,
}

/// The drive as a moving picture, beside the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Video {
    /// Its file, seen from the page.
    pub file: String,
    /// How many frames it has.
    pub frames: u32,
    /// How many seconds it shows in one.
    pub times: f32,
}

/// Points that a plot, and moments that the page has at most: of longer drives each is the mean of several frames.
const MOST_MOMENTS: usize = 480;

/// Frames that are shown as one.
struct Moment {
    time_s: f64,
    ms: f64,
    cpu_ms: f64,
    passes_ms: [f64; PASSES.len()],
    triangles: f64,
    draws: f64,
    trees: f64,
    near: f64,
    uploaded_bytes: f64,
    /// By the names of [`level_names`].
    levels: Vec<f64>,
}

/// Writes all of it; gives where the page is.
///
/// # Errors
/// Those of [`files::write_all`].
pub fn write(folder: &Path, drive: &Drive, pictures: &[Picture], video: Option<&Video>) -> Result<PathBuf> {
    let summary = serde_json::to_string_pretty(&drive.summary)
        .map_err(|cause| Error::Internal { stage: "grove::page", what: cause.to_string() })?;
    let names = level_names(&drive.summary);
    let moments = moments(drive, &names);
    let plots = charts(&drive.summary, &moments, &names)
        .into_iter()
        .map(|(name, words, chart)| Ok((name, words, chart.draw()?)))
        .collect::<Result<Vec<_>>>()?;
    let html = html(drive, &moments, &names, &plots, (pictures, video))?;
    let page = folder.join("report.html");
    let plot_folder = folder.join("plots");
    let _folder = files::ready_folder(&plot_folder)?;
    let mut all = vec![(folder.join("summary.json"), summary.into_bytes()), (page.clone(), html.into_bytes())];
    all.extend(plots.into_iter().map(|(name, _, drawing)| (plot_folder.join(format!("{name}.svg")), drawing.svg.into_bytes())));
    files::write_all(&all)?;
    Ok(page)
}

/// The names of the levels of all species, nearest first; those of the same name count together.
fn level_names(summary: &Summary) -> Vec<String> {
    let most = summary.species.iter().map(|species| species.levels.len()).max().unwrap_or(0);
    let mut names: Vec<String> = vec![];
    for level in 0..most {
        for name in summary.species.iter().filter_map(|species| species.levels.get(level)) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
    }
    names
}

fn moments(drive: &Drive, names: &[String]) -> Vec<Moment> {
    let together = drive.frames.len().div_ceil(MOST_MOMENTS).max(1);
    drive.frames.chunks(together).map(|frames| Moment::of(frames, &drive.summary, names)).collect()
}

impl Moment {
    fn of(frames: &[Frame], summary: &Summary, names: &[String]) -> Self {
        let mean = |of: &dyn Fn(&Frame) -> f64| frames.iter().map(of).sum::<f64>() / frames.len().max(1) as f64;
        let at_level = |name: &String| {
            mean(&|frame| {
                let of_species = summary.species.iter().zip(&frame.shown);
                let counts = of_species.flat_map(|(species, shown)| species.levels.iter().zip(shown));
                counts.filter(|(level, _)| *level == name).map(|(_, count)| *count as f64).sum()
            })
        };
        Self {
            time_s: mean(&|frame| f64::from(frame.time_s)),
            ms: mean(&|frame| frame.ms),
            cpu_ms: mean(&|frame| frame.cpu_ms),
            passes_ms: std::array::from_fn(|pass| mean(&|frame| frame.passes_ms()[pass])),
            triangles: mean(&|frame| frame.counted.triangles as f64),
            draws: mean(&|frame| frame.counted.draws as f64),
            trees: mean(&|frame| frame.trees as f64),
            near: mean(&|frame| frame.near as f64),
            uploaded_bytes: mean(&|frame| frame.uploaded_bytes as f64),
            levels: names.iter().map(at_level).collect(),
        }
    }
}

/// What is plotted: the file's name, what to know of it, and the chart.
fn charts(summary: &Summary, moments: &[Moment], names: &[String]) -> Vec<(&'static str, String, Chart)> {
    let curve = |name: &str, drawn: Drawn, of: &dyn Fn(&Moment) -> f64| {
        Curve::new(name, drawn, moments.iter().map(|moment| [moment.time_s, of(moment)]).collect())
    };
    let chart = |title: &str, up: &str, curves: Vec<Curve>| Chart {
        title: title.to_owned(),
        axes: ["seconds along the path".to_owned(), up.to_owned()],
        logarithmic: [false; 2],
        curves,
    };
    let used = |pass: &usize| summary.passes_ms.iter().any(|(name, ..)| name == PASSES[*pass]);
    let cpu = curve("before the device", Drawn::Area, &|moment| moment.cpu_ms);
    let passes = (0..PASSES.len()).filter(used).map(|pass| curve(PASSES[pass], Drawn::Area, &|moment| moment.passes_ms[pass]));
    let whole = curve("whole frame", Drawn::Total, &|moment| moment.ms);
    let levels = names.iter().enumerate().map(|(i, name)| curve(name, Drawn::Line, &|moment| moment.levels[i]));
    let near = curve("drawn by themselves", Drawn::Line, &|moment| moment.near);
    let seen = curve("trees in the picture", Drawn::Total, &|moment| moment.trees);
    let together = summary.frames.div_ceil(MOST_MOMENTS).max(1);
    let mean = if together > 1 { format!(" Each point is the mean of {together} frames.") } else { String::new() };
    let frame_words = format!(
        "What a frame takes, pass upon pass; the line is the whole frame until the device had finished it, by the clock on the wall.{mean}"
    );
    let level_words =
        "As Truelsen's fig. 31, trees in place of billboards. A tree that goes from one level to the next is counted in both; \
                       trees that are drawn by themselves (outlines that grow, leaves of their own) are in none."
            .to_owned();
    vec![
        (
            "frame-time",
            frame_words,
            chart("Milliseconds of a frame", "ms", [cpu].into_iter().chain(passes).chain([whole]).collect()),
        ),
        ("levels", level_words, chart("Trees in the picture, by level", "trees", levels.chain([near, seen]).collect())),
        (
            "triangles",
            "Of trees, in all passes. The ground's are not among them.".to_owned(),
            chart("Triangles", "triangles", vec![curve("triangles of trees", Drawn::Line, &|moment| moment.triangles)]),
        ),
        (
            "draws",
            "Of trees, in all passes.".to_owned(),
            chart("Draw calls", "calls", vec![curve("draw calls", Drawn::Line, &|moment| moment.draws)]),
        ),
    ]
}

fn html(
    drive: &Drive,
    moments: &[Moment],
    names: &[String],
    plots: &[(&str, String, Drawing)],
    (pictures, video): (&[Picture], Option<&Video>),
) -> Result<String> {
    let Drive { summary, frames } = drive;
    let plot = |(name, words, drawing): &(&str, String, Drawing)| {
        context! { name => *name, words, svg => safe(drawing.embedded()), inside => drawing.inside, along => drawing.along }
    };
    let picture = |picture: &Picture| {
        let frame = frames.get(picture.frame as usize);
        context! { file => picture.file.as_str(), frame => picture.frame, time_s => frame.map(|f| f.time_s), ms => frame.map(|f| short(f.ms)),
        trees => frame.map(|f| grouped(f.trees)) }
    };
    let data = page::json(&data(summary, moments, names))?;
    let passes = summary.passes_ms.iter().map(|(name, median, most)| {
        let share = if summary.median_ms > 0.0 { 100.0 * median / summary.median_ms } else { 0.0 };
        context! { name, median => format!("{median:.2}"), most => format!("{most:.2}"), share => format!("{share:.0} %") }
    });
    let parameters = groups(&summary.parameters);
    let title = if summary.title.is_empty() { "A grove" } else { &summary.title };
    let tab = format!("{title}: what a frame costs");
    Page { title: &tab, body: BODY, style: STYLE, script: Some((SCRIPT, &data)) }.render(context! {
        title,
        summary => Value::from(Serde(summary)),
        trees => grouped(summary.trees),
        facts => facts(summary),
        passes => passes.collect::<Vec<_>>(),
        plots => plots.iter().map(plot).collect::<Vec<_>>(),
        pictures => pictures.iter().map(picture).collect::<Vec<_>>(),
        video => video.map(|video| Value::from(Serde(video))),
        parameters,
    })
}

/// Moments in numbers, for the marks that follow one: each column's name, how it is shown, and its values.
fn data(summary: &Summary, moments: &[Moment], names: &[String]) -> serde_json::Value {
    let column = |name: &str, show: &str, of: &dyn Fn(&Moment) -> f64| {
        // Three places are more than clocks tell.
        let values: Vec<f64> = moments.iter().map(|moment| (of(moment) * 1e3).round() / 1e3).collect();
        json!({ "name": name, "show": show, "values": values })
    };
    let mut columns = vec![
        column("time", "s", &|moment| moment.time_s),
        column("whole frame", "ms", &|moment| moment.ms),
        column("before the device", "ms", &|moment| moment.cpu_ms),
    ];
    for pass in (0..PASSES.len()).filter(|pass| summary.passes_ms.iter().any(|(name, ..)| name == PASSES[*pass])) {
        columns.push(column(PASSES[pass], "ms", &|moment| moment.passes_ms[pass]));
    }
    columns.push(column("trees in the picture", "whole", &|moment| moment.trees));
    columns.push(column("drawn by themselves", "whole", &|moment| moment.near));
    for (level, name) in names.iter().enumerate() {
        columns.push(column(&format!("level {name}"), "whole", &|moment| moment.levels[level]));
    }
    columns.push(column("triangles of trees", "whole", &|moment| moment.triangles));
    columns.push(column("draw calls", "whole", &|moment| moment.draws));
    columns.push(column("sent to the device", "bytes", &|moment| moment.uploaded_bytes));
    json!({ "columns": columns })
}

/// What everything was, in words.
fn facts(summary: &Summary) -> Vec<[String; 2]> {
    let Summary { size_px: [width, height], started, species, .. } = summary;
    let line = |name: &str, text: String| [name.to_owned(), text];
    let seconds = |ms: f64| if ms < 995.0 { format!("{ms:.0} ms") } else { format!("{:.1} s", ms / 1e3) };
    let of_species = |one: &super::record::OfSpecies| format!("{} × {}, {:.1} m high", grouped(one.trees), one.name, one.height_m);
    let mut facts = vec![
        line("Scene", summary.title.clone()),
        line("Trees", format!("{}: {}", grouped(summary.trees), species.iter().map(of_species).collect::<Vec<_>>().join("; "))),
        line("Drawn as", summary.method.clone()),
        line("Ground", format!("{} triangles", grouped(summary.ground_triangles))),
        line("Picture", format!("{width} × {height} pixels")),
        line("Path", format!("{:.1} s in {} frames", summary.path_s, grouped(summary.frames))),
        line("Seed", summary.seed.to_string()),
        line("Adapter, driver", summary.adapter.clone()),
        line("Culling", summary.culling.sentence()),
        line("Program", format!("{}, commit {}", summary.program, summary.commit)),
        line(
            "Until the first frame",
            format!(
                "{} for the species, {} for ground and places, {} to put them onto the device",
                seconds(started.species_ms),
                seconds(started.places_ms),
                seconds(started.device_ms)
            ),
        ),
        line("On the device, beyond the species", format!("{:.1} bytes for each tree", summary.bytes_per_tree)),
        line("Sent to the device", format!("{} bytes in all frames", grouped(summary.uploaded_bytes as usize))),
    ];
    facts.extend(summary.memory_mb.map(|mb| line("Memory of the program, at most", format!("{} MB", grouped(mb as usize)))));
    facts
}

/// Every parameter, by the table it is from.
fn groups(values: &serde_json::Value) -> Vec<Value> {
    let group = |name: &str, key: &str, specs: Vec<ParamSpec>| {
        let of_one = |spec: &ParamSpec| {
            let value = match &values[key][spec.name] {
                serde_json::Value::String(word) => word.clone(),
                other => other.as_f64().map_or_else(|| other.to_string(), |number| number.to_string()),
            };
            let changed = value != spec.default;
            context! { name => spec.name, value => spec.with_unit(&value), default => spec.with_unit(&spec.default), changed, meaning => spec.meaning }
        };
        context! { name, key, rows => specs.iter().map(of_one).collect::<Vec<_>>() }
    };
    vec![
        group("Ground", "terrain", TerrainParams::specs()),
        group("Planting", "planting", PlantingParams::specs()),
        group("Camera", "camera", CameraParams::specs()),
        group("Light and air", "stage", StageParams::specs()),
        group("Culling and drawing", "culling", CullParams::specs()),
        group("Levels of detail", "levels", FollowParams::specs()),
    ]
}

/// Milliseconds with as many places as matter.
fn short(ms: f64) -> String {
    if ms < 10.0 { format!("{ms:.2}") } else { format!("{ms:.1}") }
}

#[cfg(test)]
mod tests;
