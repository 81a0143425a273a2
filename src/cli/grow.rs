//! `sphereboard grow`: L-system to GLB or OBJ.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use serde_json::{Map, Value, json};

use crate::model::grown::{Clothing, ClothingParams, GrownTree, open_picture};
use crate::model::{About, bounds, glb, obj};
use crate::plant::mesh::{LeafParams, Sheet, WoodParams};
use crate::plant::presets::{PRESETS, Preset, preset};
use crate::plant::{DeriveParams, Grammar, Skeleton, TurtleParams, draw};
use crate::{Error, Result, Seed, files};

use super::batch::{progress_bar, text_of};
use super::{Outcome, options, say};

/// The command's arguments.
pub fn command() -> Command {
    let file = |name: &'static str, help: &'static str| {
        Arg::new(name).long(name).value_name("FILE").value_parser(value_parser!(PathBuf)).help(help)
    };
    let command = Command::new("grow")
        .override_usage("sphereboard grow [OPTIONS] --out <FILE> <SYSTEM>\n       sphereboard grow --list")
        .about("Grow a tree from an L-system: <FILE>.glb (or .obj with its .mtl and pictures) and <FILE>.json (parameters, counts, times)")
        .after_help(
            "Examples:\n  sphereboard grow oak --out oak.glb\n  sphereboard grow birch --age 14.5 --seed 7 --out young_birch.glb\n  \
             sphereboard grow my.lsys --leaf-kind narrow --leaf-texture mine.png --out my.obj\n\
             Age counts derivations; each preset says at which nothing grows any more. Leaf pictures stand on their foot: middle of the lower edge.",
        )
        .arg(
            Arg::new("system")
                .value_name("SYSTEM")
                .required_unless_present("list")
                .help("A preset (see --list), or the file of an L-system: our text format, or Truelsen's XML where it ends in .xml"),
        )
        .arg(Arg::new("list").long("list").action(ArgAction::SetTrue).help("Describe the presets and stop"))
        .arg(file("out", "Where the tree goes: a name that ends in .glb or .obj").required_unless_present("list"))
        .arg(
            Arg::new("age")
                .long("age")
                .value_name("A")
                .allow_negative_numbers(true)
                .help("Derivations; a fraction draws the last of them part grown [default: what the L-system says, else 5]"),
        )
        .arg(
            options::seed("Seed of every random choice; same system, options and seed give the same bytes"),
        )
        .arg(file("bark-texture", "A picture of bark that tiles, instead of a painted one"))
        .arg(file("leaf-texture", "A picture of a leaf or twig with alpha, instead of painted ones"))
        .arg(Arg::new("json").long("json").action(ArgAction::SetTrue).help("Print the report as JSON on standard output"));
    let command = options::add::<ClothingParams>(command, "Bark and leaves");
    let command = options::add::<LeafParams>(command, "Leaves");
    let command = options::add::<WoodParams>(command, "Wood");
    let command = options::add::<TurtleParams>(command, "Turtle (an L-system may bring its own defaults)");
    options::add::<DeriveParams>(command, "Limits")
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    if matches.get_flag("list") {
        return Ok(if say::out(&list()) { ExitCode::SUCCESS } else { ExitCode::FAILURE });
    }
    let settings = Settings::read(matches)?;
    let _folder = files::ready_folder(settings.out.parent().unwrap_or(Path::new("")))?;
    let done = settings.grow().and_then(|grown| {
        files::write_all(&grown.files)?;
        Ok(settings.told(&grown))
    });
    Ok(match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            say::err(&format!("sphereboard: {error}"));
            ExitCode::FAILURE
        }
    })
}

/// The presets as a table.
fn list() -> String {
    let row = |p: &Preset| {
        let age = p.grammar().ok().and_then(|g| g.initial_age()).unwrap_or_default();
        format!(
            "{:8} {}\n         {} m high, {} leaf quads, each {}; grown at age {age}",
            p.name, p.common, p.height_m, p.leaves, p.shows
        )
    };
    PRESETS.iter().map(row).collect::<Vec<_>>().join("\n")
}

/// An L-system, and what is known of it.
struct System {
    /// Preset or file name.
    name: String,
    grammar: Grammar,
    preset: Option<&'static Preset>,
    file: Option<PathBuf>,
}

/// Longest text of an L-system that is read.
const MOST_TEXT_BYTES: u64 = 16 << 20;

/// The age of an L-system that says none.
const USUAL_AGE: f64 = 5.0;

impl System {
    fn open(text: &str) -> Result<Self> {
        if let Some(preset) = preset(text) {
            return Ok(Self { name: text.to_owned(), grammar: preset.grammar()?, preset: Some(preset), file: None });
        }
        let path = PathBuf::from(text);
        let known = || PRESETS.iter().map(|p| p.name).collect::<Vec<_>>().join(", ");
        let bytes = files::read_whole(&path, MOST_TEXT_BYTES).map_err(|error| match error {
            Error::NoSuchFile { .. } => Error::UnknownSystem { known: known(), found: text.to_owned() },
            other => other,
        })?;
        let source = String::from_utf8_lossy(&bytes);
        let is_xml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xml"));
        let read = if is_xml { Grammar::parse_xml(&source) } else { Grammar::parse(&source) };
        let grammar = read.map_err(|cause| Error::InFile { path: path.clone(), cause: Box::new(cause) })?;
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(Self { name, grammar, preset: None, file: Some(path) })
    }
}

/// Everything that was asked for.
struct Settings {
    system: System,
    out: PathBuf,
    is_obj: bool,
    json: bool,
    age: f64,
    seed: Seed,
    textures: [Option<PathBuf>; 2],
    clothing: ClothingParams,
    leaf: LeafParams,
    wood: WoodParams,
    turtle: TurtleParams,
    derive: DeriveParams,
}

/// A tree that is ready to be written.
struct Ready {
    files: Vec<(PathBuf, Vec<u8>)>,
    report: Value,
}

impl Settings {
    fn read(matches: &ArgMatches) -> Result<Self> {
        let system = System::open(matches.get_one::<String>("system").expect("clap requires it without --list"))?;
        let out = matches.get_one::<PathBuf>("out").expect("clap requires it without --list").clone();
        let ends_in = |ending: &str| out.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
        if !(ends_in("glb") || ends_in("obj")) || out.file_stem().is_none() {
            let expected = "a file name that ends in .glb or .obj".to_owned();
            return Err(Error::Parameter { name: "--out".to_owned(), expected, found: text_of(&out) });
        }
        let mut clothing: ClothingParams = options::read(matches)?;
        if let Some(preset) = system.preset {
            let given = |name| matches.get_one::<String>(name).is_some();
            clothing.leaf_kind = if given("leaf_kind") { clothing.leaf_kind } else { preset.leaf };
            clothing.bark_kind = if given("bark_kind") { clothing.bark_kind } else { preset.bark };
        }
        let settings = Self {
            is_obj: ends_in("obj"),
            json: matches.get_flag("json"),
            age: age(matches, &system.grammar)?,
            seed: options::read_seed(matches)?,
            textures: ["bark-texture", "leaf-texture"].map(|name| matches.get_one::<PathBuf>(name).cloned()),
            clothing,
            leaf: options::read(matches)?,
            wood: options::read(matches)?,
            turtle: options::read_over(matches, system.grammar.turtle().clone())?,
            derive: options::read(matches)?,
            system,
            out,
        };
        let inputs: Vec<PathBuf> = settings.textures.iter().flatten().chain(&settings.system.file).cloned().collect();
        files::refuse_overwriting([settings.out.as_path(), &settings.beside("json"), &settings.beside("mtl")], &inputs)?;
        Ok(settings)
    }

    /// A file beside the output.
    fn beside(&self, extension: &str) -> PathBuf {
        self.out.with_extension(extension)
    }

    fn grow(&self) -> Result<Ready> {
        let started = Instant::now();
        let mut stages_ms = Vec::new();
        let mut stage = |name: &'static str, since: Instant| stages_ms.push(json!({"stage": name, "ms": ms_since(since)}));
        let skeleton = self.skeleton()?;
        stage("derive and draw", started);
        let dressing = Instant::now();
        let clothing = self.clothing()?;
        stage("pictures", dressing);
        let meshing = Instant::now();
        let tree = GrownTree::new(&skeleton, &clothing, &self.wood, &self.leaf, self.seed)?;
        stage("mesh", meshing);
        let encoding = Instant::now();
        let mut files = if self.is_obj { obj::write(&tree.parts, &self.out)? } else { vec![(self.out.clone(), self.glb(&tree)?)] };
        stage("encode", encoding);
        let report = self.report(&tree, &skeleton, &files, stages_ms, ms_since(started));
        files.push((self.beside("json"), serde_json::to_vec_pretty(&report).expect("a JSON value serialises")));
        Ok(Ready { files, report })
    }

    fn skeleton(&self) -> Result<Skeleton> {
        let bar = progress_bar(self.age.ceil() as u64);
        let mut step = |progress: crate::plant::Progress| {
            bar.set_message(format!("{}: {} modules", self.system.name, progress.modules));
            bar.set_position(u64::from(progress.step));
        };
        let chain = self.system.grammar.derive(self.age, &self.derive, self.seed, &mut step)?;
        let skeleton = draw(&chain, &self.system.grammar, &self.turtle, self.seed, self.age);
        bar.finish_and_clear();
        skeleton
    }

    fn clothing(&self) -> Result<Clothing> {
        let mut clothing = Clothing::painted(self.clothing.bark_kind, self.clothing.leaf_kind, self.seed);
        if let Some(path) = &self.textures[0] {
            clothing.bark = Arc::new(open_picture(path)?);
        }
        if let Some(path) = &self.textures[1] {
            clothing.leaf = Arc::new(open_picture(path)?);
            clothing.sheet = Sheet { columns: 1, by_light: false };
        }
        Ok(clothing)
    }

    fn glb(&self, tree: &GrownTree) -> Result<Vec<u8>> {
        let about = tree.about(&self.system.name, self.age, self.seed, self.parameters());
        glb::write_parts(&tree.parts, &about, &About::this_program())
    }

    /// Every effective parameter by name.
    fn parameters(&self) -> Map<String, Value> {
        let tables = [json!(self.clothing), json!(self.leaf), json!(self.wood), json!(self.turtle), json!(self.derive)];
        tables.into_iter().filter_map(|table| if let Value::Object(map) = table { Some(map) } else { None }).flatten().collect()
    }

    fn report(
        &self,
        tree: &GrownTree,
        skeleton: &Skeleton,
        files: &[(PathBuf, Vec<u8>)],
        stages_ms: Vec<Value>,
        total_ms: f64,
    ) -> Value {
        let corners = bounds(&tree.parts).map(|b| json!({"min": b.min.to_array(), "max": b.max.to_array()}));
        let part = |part: &crate::model::Part| {
            let mesh = &part.surface.mesh;
            json!({"part": part.name, "vertices": mesh.positions.len(), "triangles": mesh.triangles.len(), "quads": mesh.quads.len()})
        };
        let file = |(path, bytes): &(PathBuf, Vec<u8>)| json!({"file": text_of(path), "bytes": bytes.len()});
        json!({
            "sphereboard": env!("CARGO_PKG_VERSION"),
            "system": self.system.name,
            "title": self.system.grammar.title(),
            "age": self.age,
            "seed": self.seed,
            "leaf_shows": self.system.preset.filter(|_| self.textures[1].is_none()).map(|p| p.shows),
            "parameters": self.parameters(),
            "textures": self.textures.iter().map(|t| t.as_deref().map(text_of)).collect::<Vec<_>>(),
            "counts": {"bones": skeleton.bones.len(), "leaves": tree.leaf_bones.len(), "parts": tree.parts.iter().map(part).collect::<Vec<_>>()},
            "height_m": tree.height_m(),
            "bounds_m": corners,
            "files": files.iter().map(file).collect::<Vec<_>>(),
            "warnings": self.system.grammar.warnings(),
            "stages_ms": stages_ms,
            "total_ms": total_ms,
        })
    }

    /// Prints what was made; false when standard output fails.
    fn told(&self, ready: &Ready) -> bool {
        for warning in self.system.grammar.warnings() {
            say::err(&format!("{}: warning: {}", self.system.name, warning.message));
        }
        let names: Vec<String> = ready.files.iter().map(|(path, _)| text_of(path)).collect();
        say::out(&if self.json { format!("{:#}", ready.report) } else { names.join("  ") })
    }
}

/// `--age`, or what the L-system says.
fn age(matches: &ArgMatches, grammar: &Grammar) -> Result<f64> {
    let Some(text) = matches.get_one::<String>("age") else { return Ok(grammar.initial_age().unwrap_or(USUAL_AGE)) };
    text.parse().ok().filter(|age: &f64| age.is_finite() && *age >= 0.0).ok_or_else(|| Error::Parameter {
        name: "--age".to_owned(),
        expected: "a number of derivations, 0 or more".to_owned(),
        found: text.clone(),
    })
}

fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
