//! `sphereboard compare`: every representation of a tree held against the tree itself, as a page with numbers and pictures.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};

use crate::compare::{self, Identity, Plan, Profile, Request, Store, TRUTH, Views, papers};
use crate::gpu::Gpu;
use crate::model::About;
use crate::params::ParamValue;
use crate::render::Renderer;
use crate::repr;
use crate::{Error, Result, files};

use super::batch::{progress_bar, text_of};
use super::subject::{self, Wish};
use super::{Outcome, look, options, say};

crate::params! {
    /// How a comparison is made.
    pub struct CompareParams {
        /// How much is looked at.
        profile: Profile = Profile::Quick, unit "", source "ours: an answer at once, the rest when it is wanted";
        /// Largest height of the tree in a picture; the others are a half, a quarter … of it.
        size_px: u32 = 512, in 32..=1024, unit "px", source "ours: a tree that fills half of a screen";
        /// Error up to which a stand-in is good enough: mean FLIP over all views.
        max_flip: f64 = 0.08, in 0.0..=1.0, unit "", source "ours: about where a second look is needed to tell two pictures apart";
        /// What cheap means.
        cost: compare::answer::CostKind = compare::answer::CostKind::Ms, unit "", source "ours: time is what runs out first";
    }
}

/// The command's arguments.
pub fn command() -> Command {
    let path =
        |name: &'static str, value: &'static str| Arg::new(name).long(name).value_name(value).value_parser(value_parser!(PathBuf));
    let command = Command::new("compare")
        .about("Which stand-in for this tree, at which distance, at what cost: every method against the tree itself, as a page")
        .after_help(
            "Examples:\n  sphereboard compare oak --out oak_compared\n  \
             sphereboard compare ash.glb --profile full --methods billboard,octahedral,sphere-board --out ash_compared\n\
             A run that was stopped goes on where it was. DIR/report.html answers first and shows everything behind the answer.",
        )
        .arg(Arg::new("source").value_name("SOURCE").required(true).num_args(1..).help(subject::SOURCE_HELP))
        .arg(path("out", "DIR").required(true).help("Folder for the report; of several sources each gets a folder in it"))
        .arg(
            Arg::new("methods")
                .long("methods")
                .value_name("A,B,…")
                .value_delimiter(',')
                .action(ArgAction::Append)
                .help("Only these methods [default: all that take the tree]"),
        )
        .arg(
            Arg::new("views")
                .long("views")
                .value_name("WHICH")
                .default_value("default")
                .help("default, dense (azimuths every 15°), or a file with a line AZIMUTH ELEVATION in degrees for each view"),
        )
        .arg(Arg::new("anew").long("anew").action(ArgAction::SetTrue).help("Drop what another comparison has left in DIR"));
    let command = options::add::<CompareParams>(command, "Comparison");
    look::add_adapter(subject::add_making(subject::add_source(command, "Seed of every random number")))
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let params: CompareParams = options::read(matches)?;
    let wish = Wish::read(matches)?;
    let out = matches.get_one::<PathBuf>("out").expect("clap requires it");
    let sources: Vec<&String> = matches.get_many("source").expect("clap requires one").collect();
    let methods = methods(matches)?;
    let plan = plan(matches, &params)?;
    let mut renderer = Renderer::new(Gpu::open(&look::adapter(matches))?)?;
    let _folder = files::ready_folder(out)?;
    for text in &sources {
        let name = Path::new(text).file_stem().map_or_else(|| "tree".to_owned(), |stem| stem.to_string_lossy().into_owned());
        let folder = if sources.len() == 1 { out.clone() } else { out.join(name) };
        if params.profile == Profile::Papers {
            say::out(&text_of(&papers(&mut renderer, &wish, text, &folder)?));
            continue;
        }
        let report = one(&mut renderer, &wish, text, &methods, &plan, &params, &folder, matches.get_flag("anew"))?;
        say::out(&text_of(&report));
    }
    Ok(ExitCode::SUCCESS)
}

/// The papers' figures and tables, redrawn on a tree.
fn papers(renderer: &mut Renderer, wish: &Wish, text: &str, folder: &Path) -> Result<PathBuf> {
    let source = wish.source(text)?;
    let _folder = files::ready_folder(folder)?;
    let bar = progress_bar(papers::EXHIBITS.len() as u64);
    let page = wish.captured(|capture| {
        let request = papers::Request { source: &source, capture, seed: wish.seed, command: &command_line(), folder };
        papers::run(renderer, &request, &|exhibit| {
            bar.set_message(exhibit.id);
            bar.inc(1);
        })
    })?;
    bar.finish_and_clear();
    Ok(page)
}

/// The methods asked for, the truth first.
fn methods(matches: &ArgMatches) -> Result<Vec<String>> {
    let asked: Vec<String> = matches.get_many::<String>("methods").unwrap_or_default().cloned().collect();
    let chosen = if asked.is_empty() { compare::every_method() } else { asked };
    chosen.iter().try_for_each(|id| repr::method(id).map(|_| ()))?;
    let mut methods = vec![TRUTH.to_owned()];
    chosen.into_iter().for_each(|id| {
        if !methods.contains(&id) {
            methods.push(id)
        }
    });
    Ok(methods)
}

fn plan(matches: &ArgMatches, params: &CompareParams) -> Result<Plan> {
    let text = matches.get_one::<String>("views").expect("clap gives the default");
    match Views::parse(text) {
        Some(views) => Ok(Plan::new(params.profile, views, params.size_px)),
        None => {
            let bytes = files::read_whole(Path::new(text), 1 << 20)?;
            let views = Plan::views_of(&String::from_utf8_lossy(&bytes));
            let views = views.map_err(|cause| Error::InFile { path: text.into(), cause: Box::new(cause) })?;
            Ok(Plan { views, ..Plan::new(params.profile, Views::Default, params.size_px) })
        }
    }
}

#[allow(clippy::too_many_arguments)] // what was read from one command line
fn one(
    renderer: &mut Renderer,
    wish: &Wish,
    text: &str,
    methods: &[String],
    plan: &Plan,
    params: &CompareParams,
    folder: &Path,
    anew: bool,
) -> Result<PathBuf> {
    let source = wish.source(text)?;
    let _folder = files::ready_folder(folder)?;
    let info = &renderer.gpu.info;
    let identity = Identity {
        program: About::this_program(),
        source: text.to_owned(),
        plan: plan.clone(),
        seed: wish.seed.0,
        settings: vec![],
        adapter: format!("{}, {} {}", info.name, info.driver, info.driver_info),
    };
    let mut store = Store::open(folder, &identity, anew)?;
    let full = params.profile != Profile::Quick;
    let bar = progress_bar((methods.len() * plan.pictures()) as u64);
    let last = Cell::new(0);
    let comparison = wish.captured(|capture| {
        let request = Request {
            source: &source,
            methods,
            plan,
            seed: wish.seed,
            capture,
            levels: full,
            timing_ms: if full { 200 } else { 60 },
            folder,
        };
        compare::run(renderer, &request, &mut store, &|progress| {
            bar.set_message(progress.doing.to_owned());
            bar.inc(progress.done.saturating_sub(last.get()) as u64);
            last.set(progress.done);
        })
    })?;
    bar.finish_and_clear();
    let asked = compare::page::Asked { max_flip: params.max_flip, cost: params.cost, command: &command_line() };
    compare::page::write(folder, &comparison, &identity, asked)
}

/// The command line as it can be typed again.
pub fn command_line() -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./,:=+@%".contains(c);
    let quoted = |word: String| match word {
        word if !word.is_empty() && word.chars().all(plain) => word,
        word => format!("'{}'", word.replace('\'', "'\\''")),
    };
    let words = std::env::args_os().skip(1).map(|word| quoted(word.to_string_lossy().into_owned()));
    ["sphereboard".to_owned()].into_iter().chain(words).collect::<Vec<_>>().join(" ")
}
