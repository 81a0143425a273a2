//! `sphereboard bake`: what a method makes of a tree, as a GLB file, and what it costs.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use serde_json::{Value, json};

use crate::page::grouped;
use crate::repr::box_hierarchy::{self, BoxHierarchy};
use crate::repr::file::{self, Origin};
use crate::repr::limits;
use crate::repr::{BuiltTree, Drawn, Representation as _, Stats};
use crate::{Error, Result, files};

use super::batch::text_of;
use super::subject::{self, Wish, spinner};
use super::{Outcome, look, say};

/// The command's arguments.
pub fn command() -> Command {
    let command = Command::new("bake")
        .about("Build a representation of a tree, write it as GLB, and say what it costs")
        .after_help(
            "Examples:\n  sphereboard methods\n  sphereboard bake oak --method crossed-planes --set planes=3 --out oak_planes.glb\n  \
             sphereboard bake ash.glb --method geometry --levels 0 --out ash_full.glb\n\
             The file opens in every glTF viewer; `render` and `view` draw it as they draw what they build themselves.\n\
             Several levels of detail stand under a node each: the finest is shown, the others are named by MSFT_lod and are scenes of their\n\
             own. What glTF cannot say (cards that turn, parts seen from some sides only) is in the nodes' extras, and a note says so.\n\
             Distances are from the middle of the tree in heights of the tree, in a picture of 1080 rows and 45°.",
        )
        .arg(Arg::new("source").value_name("SOURCE").required(true).help(subject::SOURCE_HELP))
        .arg(
            Arg::new("out")
                .long("out")
                .value_name("T.glb")
                .required_unless_present("stream")
                .value_parser(value_parser!(PathBuf))
                .help("The file to write, a name that ends in .glb"),
        )
        .arg(
            Arg::new("stream")
                .long("stream")
                .value_name("DIR")
                .conflicts_with_all(["out", "levels"])
                .value_parser(value_parser!(PathBuf))
                .help(
                    "With --method box-hierarchy: a folder for the tree as a stream of files, coarse to fine. Any of them from the first on are \
                     a tree, which `render` and `view` draw when given the folder",
                ),
        )
        .arg(
            Arg::new("levels")
                .long("levels")
                .value_name("all|N|NAME")
                .allow_negative_numbers(true)
                .default_value("all")
                .help("Which levels of detail go into the file: all, or one by number (0 is the finest) or name, to be seen at any distance"),
        )
        .arg(Arg::new("json").long("json").action(ArgAction::SetTrue).help("Print everything as JSON instead of a table"));
    look::add_adapter(subject::add_source(subject::add_method(command, true), "Seed of a preset's growth and of the method"))
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let wish = Wish::read(matches)?;
    let method = wish.method.clone().expect("clap requires it");
    let text = matches.get_one::<String>("source").expect("clap requires it");
    if let Some(folder) = matches.get_one::<PathBuf>("stream") {
        return stream(&wish, &method, text, folder, matches.get_flag("json"));
    }
    let out = matches.get_one::<PathBuf>("out").expect("clap requires it");
    if !out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb")) || out.file_stem().is_none() {
        return Err(Error::Hint { flag: "--out", expected: "a file *.glb".to_owned(), found: text_of(out) });
    }
    files::refuse_overwriting([out.as_path()], &[PathBuf::from(text)])?;
    let _folder = files::ready_folder(out.parent().unwrap_or("".as_ref()))?;

    let bar = spinner(format!("{text}: growing or reading it"));
    let source = wish.source(text)?;
    bar.set_message(format!("{text}: building {method}"));
    let built = wish.build(&method, &source)?;
    let levels = matches.get_one::<String>("levels").expect("clap gives the default");
    let built = match level_of(levels, &built)? {
        Some(number) => file::one_level(built, number),
        None => built,
    };
    bar.set_message(format!("{text}: writing {}", out.display()));
    let bytes = file::write(&built, &Origin::of(&wish.order(&method), source.name())?)?;
    let size = bytes.len();
    files::write_all(&[(out.clone(), bytes)])?;
    bar.finish_and_clear();
    notes(&built).iter().for_each(|note| say::err(&format!("note: {note}")));
    let text = if matches.get_flag("json") {
        format!("{:#}", report(&built, &Origin::of(&wish.order(&method), source.name())?, &text_of(out), size))
    } else {
        format!("{}\n{}", out.display(), table(&built, size))
    };
    Ok(if say::out(&text) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The tree as a stream of files.
fn stream(wish: &Wish, method: &str, text: &str, folder: &Path, as_json: bool) -> Outcome {
    if method != BoxHierarchy.id() {
        let what = format!("only the method {} makes streams, and {method} was asked for", BoxHierarchy.id());
        return Err(Error::Usage { what, remedy: "choose --method box-hierarchy, or --out for a GLB file" });
    }
    let bar = spinner(format!("{text}: growing or reading it"));
    let source = wish.source(text)?;
    bar.set_message(format!("{text}: building {method}"));
    let (stream, built) = wish.captured(|capture| box_hierarchy::stream(&wish.order(method), &source, capture))?;
    limits::check_textures(&built, &wish.budget)?;
    subject::warn(source.name(), &built.warnings);
    bar.set_message(format!("{text}: writing {}", folder.display()));
    box_hierarchy::write_stream(folder, &stream)?;
    bar.finish_and_clear();
    let files = stream.0.iter();
    let text = if as_json {
        let files: Vec<_> = files.map(|(name, bytes)| json!({"name": name, "bytes": bytes.len()})).collect();
        format!("{:#}", json!({"out": text_of(folder), "files": files, "color_bytes": stream.color_bytes()}))
    } else {
        let lines = files.map(|(name, bytes)| format!("{:>12}  {}", grouped(bytes.len()), folder.join(name).display()));
        let colors = format!("the colour pictures have {} bytes together", grouped(stream.color_bytes()));
        lines.chain([colors]).collect::<Vec<_>>().join("\n")
    };
    Ok(if say::out(&text) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The level that was asked for; `None` for all.
fn level_of(text: &str, built: &BuiltTree) -> Result<Option<usize>> {
    if text == "all" {
        return Ok(None);
    }
    let named = built.levels.iter().position(|level| level.name == text);
    let number = named.or_else(|| text.parse().ok().filter(|number| *number < built.levels.len()));
    number.map(Some).ok_or_else(|| {
        let names = built.levels.iter().enumerate().map(|(i, level)| format!("{i} ({})", level.name)).collect::<Vec<_>>();
        Error::Hint { flag: "--levels", expected: format!("all, or one of {}", names.join(", ")), found: text.to_owned() }
    })
}

/// What a viewer that knows only glTF, or any file at all, shows otherwise than we do.
fn notes(built: &BuiltTree) -> Vec<String> {
    let (forests, others): (Vec<_>, Vec<_>) = built.parts.iter().partition(|part| matches!(part.drawn, Drawn::Forest(_)));
    let mut kinds: Vec<(&str, usize)> = Vec::new();
    for needs in others.iter().filter_map(|part| file::beyond_gltf(part)) {
        match kinds.iter_mut().find(|(known, _)| *known == needs) {
            Some((_, count)) => *count += 1,
            None => kinds.push((needs, 1)),
        }
    }
    let (all, other) = (others.len(), if forests.is_empty() { "" } else { "other " });
    let note = |(needs, count): &(&str, usize)| {
        format!(
            "{count} of {all} {other}parts: each {needs}, for which glTF has no word: only `sphereboard render` and `view` show it so"
        )
    };
    let leaves = (!forests.is_empty()).then(|| {
        let method = &built.method;
        format!(
            "the leaves go one by one with distance, which no file holds: this one has them as plain levels; `sphereboard render` and `view` \
             show them go when they build the tree themselves, with --method {method}"
        )
    });
    leaves.into_iter().chain(kinds.iter().map(note)).collect()
}

/// Costs by level, for people.
fn table(built: &BuiltTree, file_bytes: usize) -> String {
    const HEAD: [&str; 9] =
        ["level", "seen at", "polygons", "triangles", "vertices", "draw calls", "textures", "texture MB", "geometry MB"];
    let row = |name: &str, at: String, stats: &Stats| {
        let counts = [stats.polygons, stats.triangles, stats.vertices, stats.draw_calls, stats.textures].map(grouped);
        let [polygons, triangles, vertices, calls, textures] = counts;
        let mb = |bytes: usize| format!("{:.2}", bytes as f64 / 1e6);
        [name.to_owned(), at, polygons, triangles, vertices, calls, textures, mb(stats.texture_bytes), mb(stats.geometry_bytes)]
    };
    let mut rows = vec![HEAD.map(str::to_owned)];
    for (level, (name, stats)) in built.levels.iter().zip(Stats::of_levels(built)) {
        rows.push(row(
            &name,
            format!("{} heights, {} m", three_digits(level.distance), three_digits(level.distance * built.height_m())),
            &stats,
        ));
    }
    if built.levels.len() > 1 {
        rows.push(row("everything", String::new(), &Stats::of_all(built)));
    }
    let mut lines = aligned(&rows, 2);
    lines.push(format!("built in {:.0} ms; the file has {} bytes", built.build_ms, grouped(file_bytes)));
    lines.join("\n")
}

/// The same for programs.
fn report(built: &BuiltTree, origin: &Origin, out: &str, file_bytes: usize) -> Value {
    let levels = built.levels.iter().zip(Stats::of_levels(built));
    let level = |(level, (name, stats)): (&crate::repr::Level, (String, Stats))| json!({"level": name, "distance_heights": level.distance, "distance_m": level.distance * built.height_m(), "stats": stats});
    json!({
        "sphereboard": env!("CARGO_PKG_VERSION"),
        "out": out,
        "method": built.method,
        "origin": origin,
        "levels": levels.map(level).collect::<Vec<_>>(),
        "everything": Stats::of_all(built),
        "build_ms": built.build_ms,
        "file_bytes": file_bytes,
        "notes": notes(built),
        "warnings": built.warnings,
    })
}

/// Rows as lines with columns under each other; the first `left` of them begin together, the others end together.
pub fn aligned<const N: usize>(rows: &[[String; N]], left: usize) -> Vec<String> {
    let widths: [usize; N] = std::array::from_fn(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0));
    let cell = |(column, (text, width)): (usize, (&String, usize))| {
        if column < left { format!("{text:<width$}") } else { format!("{text:>width$}") }
    };
    let line =
        |row: &[String; N]| row.iter().zip(widths).enumerate().map(cell).collect::<Vec<_>>().join("  ").trim_end().to_owned();
    rows.iter().map(line).collect()
}

/// A number with three digits that count, or all before the point: 0.302, 5, 12.5, 1234.
fn three_digits(number: f32) -> String {
    let before = if number.abs() > 0.0 { number.abs().log10().floor() as i32 + 1 } else { 1 };
    let text = format!("{number:.places$}", places = (3 - before).clamp(0, 9) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
