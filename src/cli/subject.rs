//! What a command is about: a tree, and the method that stands for it. The same options for all commands that build or draw.

use std::path::Path;
use std::time::Duration;

use clap::{Arg, ArgAction, ArgMatches, Command};
use glam::Vec3;
use indicatif::{ProgressBar, ProgressStyle};

use crate::geom::Bounds;
use crate::gpu::{AdapterChoice, Gpu};
use crate::model::reference::Asked;
use crate::plant::presets::preset;
use crate::render::GpuCapture;
use crate::repr::box_hierarchy;
use crate::repr::limits::{self, BudgetParams};
use crate::repr::{self, BuiltPart, BuiltTree, Capture, Order, Scope, Settings, SoftwareCapture, TreeSource, file};
use crate::{Error, Result, Seed, Warning, files};

use super::{look, options, say};

/// What a source may be, for help.
pub const SOURCE_HELP: &str =
    "A tree: a model of ours or of any other program (GLB, glTF or OBJ), or a preset of `sphereboard grow --list`";

/// Adds what says how a source is read: seed, and which materials are leaves or wood.
pub fn add_source(command: Command, seed_help: &'static str) -> Command {
    add_materials(command.arg(options::seed(seed_help)))
}

/// Adds which materials of a file are leaves or wood.
pub fn add_materials(command: Command) -> Command {
    let names = |name: &'static str, help: &'static str| {
        Arg::new(name).long(name).value_name("MATERIAL").action(ArgAction::Append).help(help)
    };
    command
        .arg(names("leaves", "This material is foliage, whatever it looks like; may be repeated"))
        .arg(names("wood", "This material is wood, whatever it looks like; may be repeated"))
}

/// Adds the method and its parameters.
pub fn add_method(command: Command, required: bool) -> Command {
    let with_method = |arg: Arg| if required { arg } else { arg.requires("method") };
    let method = Arg::new("method").long("method").value_name("ID").required(required).help(if required {
        "Which representation to build; `sphereboard methods` lists them"
    } else {
        "Which representation to build and draw; `sphereboard methods` lists them [default: what the file holds]"
    });
    let set = Arg::new("set").long("set").value_name("KEY=VALUE").action(ArgAction::Append).help(
        "Set a parameter of the method, or with trunk.KEY one of the wood's; may be repeated; `sphereboard methods ID` lists them",
    );
    let trunk =
        Arg::new("trunk").long("trunk").value_name("ID").help("Which method builds the wood, where the method builds only leaves");
    let command = command
        .arg(method.help_heading("Method"))
        .arg(with_method(set).help_heading("Method"))
        .arg(with_method(trunk).help_heading("Method"));
    add_making(command)
}

/// Adds how methods are built, whichever they are.
pub fn add_making(command: Command) -> Command {
    options::add::<CaptureParams>(options::add::<BudgetParams>(command, "Method"), "Method")
}

/// What was said about materials with `--leaves` and `--wood`.
pub fn asked(matches: &ArgMatches) -> Asked {
    let names = |name| matches.get_many::<String>(name).unwrap_or_default().cloned().collect();
    Asked { leaves: names("leaves"), wood: names("wood") }
}

crate::choices! {
    /// Who takes pictures of a tree for a method.
    pub enum CaptureChoice {
        /// The software rasteriser: the same bytes on every machine.
        Software = "software",
        /// The graphics adapter: quicker where there is a real one, and the same within a rounding.
        Gpu = "gpu",
    }
}

crate::params! {
    /// How pictures of a tree are taken.
    pub struct CaptureParams {
        /// Who takes pictures of the tree where a method shows pictures.
        capture: CaptureChoice = CaptureChoice::Software, unit "", source "ours: baking needs no adapter and gives the same everywhere";
    }
}

/// What the options of [`add_source`] and [`add_method`] say.
pub struct Wish {
    /// Of every random number.
    pub seed: Seed,
    /// Which materials are what.
    pub asked: Asked,
    /// The method, if one was named.
    pub method: Option<String>,
    /// Who builds the wood.
    pub trunk: Option<String>,
    /// Parameters of the method.
    pub settings: Settings,
    /// What the built tree may take.
    pub budget: BudgetParams,
    /// Who takes pictures for it.
    pub capture: CaptureChoice,
    /// With which adapter, if that is a device.
    adapter: AdapterChoice,
}

impl Wish {
    /// Reads them; what can be known to be wrong without a tree is refused at once.
    ///
    /// # Errors
    /// [`Error::UnknownMethod`], and those of [`Settings::parse`] and [`Settings::check`].
    pub fn read(matches: &ArgMatches) -> Result<Self> {
        // A command that compares all methods has none of these options.
        let text = |name| matches.try_get_one::<String>(name).ok().flatten().cloned();
        let set = matches.try_get_many::<String>("set").ok().flatten().unwrap_or_default();
        let settings = Settings::parse(set.map(String::as_str))?;
        let (method, trunk) = (text("method"), text("trunk"));
        if let Some(method) = &method {
            settings.split("trunk.").0.check(repr::method(method)?)?;
        }
        if let Some(trunk) = &trunk {
            settings.split("trunk.").1.check(repr::method(trunk)?)?;
        }
        let (seed, budget) = (options::read_seed(matches)?, options::read(matches)?);
        let CaptureParams { capture } = options::read(matches)?;
        Ok(Self { seed, asked: asked(matches), method, trunk, settings, budget, capture, adapter: look::adapter(matches) })
    }

    /// The tree of that name; what a user should know of it is said.
    ///
    /// # Errors
    /// Those of [`TreeSource::open`].
    pub fn source(&self, text: &str) -> Result<TreeSource> {
        let (source, warnings) = TreeSource::open(text, &self.asked, self.seed)?;
        warn(text, &warnings);
        Ok(source)
    }

    /// What to build.
    pub fn order<'a>(&'a self, method: &'a str) -> Order<'a> {
        Order { method, trunk: self.trunk.as_deref(), settings: &self.settings, seed: self.seed }
    }

    /// What `make` makes with the pictures that were asked for.
    ///
    /// # Errors
    /// Those of `make`, and of [`Gpu::open`] where a device takes them.
    pub fn captured<T>(&self, make: impl FnOnce(&dyn Capture) -> Result<T>) -> Result<T> {
        match self.capture {
            CaptureChoice::Software => make(&SoftwareCapture::new()),
            CaptureChoice::Gpu => make(&GpuCapture::new(&Gpu::open(&self.adapter)?)?),
        }
    }

    /// The wished-for stand-in of `source`.
    ///
    /// # Errors
    /// Those of [`repr::build`] and [`limits::check_textures`].
    pub fn build(&self, method: &str, source: &TreeSource) -> Result<BuiltTree> {
        let built = self.captured(|capture| repr::build(&self.order(method), source, capture))?;
        limits::check_textures(&built, &self.budget)?;
        warn(source.name(), &built.warnings);
        Ok(built)
    }

    /// What is to be drawn of the tree of that name: what the method makes of it, or without one what is in the file.
    ///
    /// # Errors
    /// Those of [`Wish::source`] and [`Wish::build`], or of [`repr::open_model`].
    pub fn subject(&self, text: &str) -> Result<Subject> {
        if let Some(method) = &self.method {
            let bar = spinner(format!("{text}: growing or reading it"));
            let source = self.source(text)?;
            bar.set_message(format!("{text}: building {method}"));
            let built = self.build(method, &source)?;
            bar.finish_and_clear();
            let points = corners(built.bounds);
            return Ok(Subject { built, points });
        }
        if preset(text).is_some() {
            let source = self.source(text)?;
            let parts = source.parts(Scope::Tree).into_iter().cloned().map(BuiltPart::still).collect();
            return Ok(Subject {
                points: source.points(Scope::Tree).collect(),
                built: BuiltTree::new(source.box_of_all()?, parts),
            });
        }
        if Path::new(text).is_dir() {
            let built = box_hierarchy::read_stream(text.as_ref())?.built()?;
            warn(text, &built.warnings);
            return Ok(Subject { points: corners(built.bounds), built });
        }
        if let Some(built) = baked(text.as_ref()) {
            return Ok(Subject { points: corners(built.bounds), built });
        }
        let imported = repr::open_model(text)?;
        warn(text, &imported.warnings);
        let growth = imported.tree_model.as_ref().map(|model| model.about.growth);
        let points: Vec<Vec3> = imported.parts.iter().flat_map(|part| part.surface.mesh.positions.iter().copied()).collect();
        let bounds = Bounds::of(points.iter().copied()).ok_or_else(|| Error::EmptyModel { why: String::new() })?;
        let parts = imported.parts.into_iter().map(BuiltPart::still).collect();
        Ok(Subject { built: BuiltTree { growth, ..BuiltTree::new(bounds, parts) }, points })
    }
}

/// What `sphereboard bake` wrote; `None` for any other file, and with a warning for one that was changed.
fn baked(path: &Path) -> Option<BuiltTree> {
    // What cannot be read is told by whoever reads it next.
    let bytes = files::read_whole(path, u64::MAX).ok()?;
    match file::read(&bytes)? {
        Ok((built, _)) => Some(built),
        Err(error) => {
            say::err(&format!("{}: warning: a baked tree that was changed is read as any other mesh: {error}", path.display()));
            None
        }
    }
}

/// A tree to be drawn.
pub struct Subject {
    /// It.
    pub built: BuiltTree,
    /// What has to be in the picture. Of what a method has built, the corners of the tree's box: so that all methods are seen from the
    /// same place.
    pub points: Vec<Vec3>,
}

fn corners(Bounds { min, max }: Bounds) -> Vec<Vec3> {
    let pick = |bit: bool, low: f32, high: f32| if bit { high } else { low };
    (0..8).map(|i| Vec3::new(pick(i & 1 > 0, min.x, max.x), pick(i & 2 > 0, min.y, max.y), pick(i & 4 > 0, min.z, max.z))).collect()
}

/// Says what a user should know of what was read or built.
pub fn warn(name: &str, warnings: &[Warning]) {
    warnings.iter().for_each(|warning| say::err(&format!("{name}: warning: {}", warning.message)));
}

/// Says what is being done, and for how long already, where nobody can tell how long it will take.
pub fn spinner(message: String) -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} {elapsed:>3}  {wide_msg}").expect("the template is a constant");
    let bar = ProgressBar::new_spinner().with_style(style).with_message(message);
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}
