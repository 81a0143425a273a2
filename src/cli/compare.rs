//! `sphereboard compare`: every representation of a tree held against the tree itself, as a page with numbers and pictures.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};

use crate::compare::answer::Chain;
use crate::compare::photograph::{self, Photograph};
use crate::compare::{self, Contender, Identity, Load, Plan, Profile, Request, Store, TRUTH, Views, Workshop, papers};
use crate::gpu::{AdapterChoice, Gpu};
use crate::model::About;
use crate::params::ParamValue;
use crate::plant::presets::preset;
use crate::render::Renderer;
use crate::repr::{self, Scope, TreeSource, file};
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
        /// Seconds that a tree may take with the software driver on four cores: what is looked at is thinned out to fit. 0 for 90 of the quick
        /// profile, 1,200 of the others.
        time_budget_s: u32 = 0, in 0..=604_800, unit "s", source "ours: reckoned from triangles, so that all machines look at the same";
        /// Error up to which a stand-in is good enough: mean FLIP over all views.
        max_flip: f64 = 0.08, in 0.0..=1.0, unit "", source "ours: about where a second look is needed to tell two pictures apart";
        /// What cheap means.
        cost: compare::answer::CostKind = compare::answer::CostKind::Ms, unit "", source "ours: time is what runs out first";
    }
}

const SOURCE_HELP: &str = "A tree: a preset of `sphereboard grow --list`, a model of ours or of any other program (GLB, glTF or OBJ), or a \
                           photograph of one";

/// The command's arguments.
pub fn command() -> Command {
    let path =
        |name: &'static str, value: &'static str| Arg::new(name).long(name).value_name(value).value_parser(value_parser!(PathBuf));
    let command = Command::new("compare")
        .about("Which stand-in for this tree, at which distance, at what cost: every method against the tree itself, as a page")
        .after_help(
            "Examples:\n  sphereboard compare oak --out oak_compared\n  \
             sphereboard compare ash.glb --profile full --methods billboard,octahedral,sphere-board --out ash_compared\n  \
             sphereboard compare oak --extra my_oak_impostor.glb --chain oak_chain.glb --cost bytes --out oak_compared\n  \
             sphereboard compare photo.jpg --out photo_compared\n\
             What is looked at is reckoned from the tree's triangles to fit --time-budget-s, and what is left out for that is said.\n\
             Of a photograph its own view is held against the photograph, all others against its model.\n\
             A run that was stopped goes on where it was. DIR/report.html answers first and shows everything behind the answer.",
        )
        .arg(Arg::new("source").value_name("SOURCE").required(true).num_args(1..).help(SOURCE_HELP))
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
        .arg(
            Arg::new("extra")
                .long("extra")
                .value_name("FILE")
                .action(ArgAction::Append)
                .value_parser(value_parser!(PathBuf))
                .help("Somebody else's stand-in for the same tree, at the same place and size (GLB, glTF or OBJ), as one more row; may be repeated"),
        )
        .arg(
            path("chain", "FILE.glb")
                .help("Also write the recommended chain of stand-ins: as one file with levels, and each link as a file beside it"),
        )
        .arg(Arg::new("anew").long("anew").action(ArgAction::SetTrue).help("Drop what another comparison has left in DIR"));
    let command = options::add::<CompareParams>(command, "Comparison");
    look::add_adapter(subject::add_making(subject::add_source(command, "Seed of every random number")))
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let wanted = Wanted::read(matches)?;
    let out = matches.get_one::<PathBuf>("out").expect("clap requires it");
    let sources: Vec<&String> = matches.get_many("source").expect("clap requires one").collect();
    let mut renderers = renderers(&look::adapter(matches))?;
    let _folder = files::ready_folder(out)?;
    for text in &sources {
        let name = Path::new(text).file_stem().map_or_else(|| "tree".to_owned(), |stem| stem.to_string_lossy().into_owned());
        let folder = if sources.len() == 1 { out.clone() } else { out.join(name) };
        say::out(&text_of(&wanted.compare(&mut renderers, text, &folder)?));
    }
    Ok(ExitCode::SUCCESS)
}

/// Several trees are drawn at once where a processor draws: each keeps one core busy most of the time.
const SOFTWARE_RENDERERS: usize = 3;

fn renderers(choice: &AdapterChoice) -> Result<Vec<Renderer>> {
    let first = Renderer::new(Gpu::open(choice)?)?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let more = if first.gpu.info.device_type == wgpu::DeviceType::Cpu { SOFTWARE_RENDERERS.min(cores) - 1 } else { 0 };
    let others = (0..more).map(|_| Renderer::new(Gpu::open(choice)?));
    std::iter::once(Ok(first)).chain(others).collect()
}

/// What the command line asks for.
struct Wanted {
    params: CompareParams,
    wish: Wish,
    contenders: Vec<Contender>,
    plan: Plan,
    anew: bool,
    chain: Option<PathBuf>,
    /// What else changes figures.
    settings: Vec<String>,
}

impl Wanted {
    fn read(matches: &ArgMatches) -> Result<Self> {
        let params: CompareParams = options::read(matches)?;
        let extras: Vec<PathBuf> = matches.get_many("extra").unwrap_or_default().cloned().collect();
        let contenders = Contender::all(&methods(matches)?, &extras)?;
        let plan = plan(matches, &params)?;
        let chain = matches.get_one::<PathBuf>("chain").cloned();
        if let Some(path) = &chain {
            check_chain(path, matches)?;
        }
        let settings = settings(matches, &extras)?;
        Ok(Self { settings, params, wish: Wish::read(matches)?, contenders, plan, anew: matches.get_flag("anew"), chain })
    }

    /// Compares what stands for one tree; gives where the page is.
    fn compare(&self, renderers: &mut [Renderer], text: &str, folder: &Path) -> Result<PathBuf> {
        if self.params.profile == Profile::Papers {
            return papers(&mut renderers[0], &self.wish, text, folder);
        }
        let (source, photograph, digest) = self.open(text)?;
        let allowed_s = match (self.params.time_budget_s, self.params.profile) {
            (0, Profile::Quick) => 90.0,
            (0, _) => 1200.0,
            (asked, _) => f64::from(asked),
        };
        let plan = self.plan.clone();
        let plan = if photograph.is_some() { plan.with_photograph() } else { plan };
        let triangles = source.parts(Scope::Tree).iter().map(|part| part.surface.mesh.triangulated().count()).sum();
        let (plan, budget) = compare::fit(plan, Load::of(triangles, source.box_of_all()?, self.contenders.len()), allowed_s);
        say::err(&planned(text, &plan, &budget));
        let _folder = files::ready_folder(folder)?;
        let identity = self.identity(digest, &plan, renderers);
        let mut store = Store::open(folder, &identity, self.anew)?;
        let bar = progress_bar(((1 + self.contenders.len()) * plan.pictures()) as u64);
        let asked = compare::page::Asked { max_flip: self.params.max_flip, cost: self.params.cost, command: &command_line() };
        self.wish.captured(|capture| {
            let shop = Workshop { source: &source, seed: self.wish.seed, capture, budget: self.wish.budget.clone() };
            let request = Request {
                shop,
                photograph: photograph.as_ref(),
                contenders: &self.contenders,
                plan: &plan,
                budget: &budget,
                folder,
            };
            let comparison = compare::run(renderers, &request, &mut store, &|progress| {
                bar.set_message(progress.doing.to_owned());
                bar.set_position(progress.done as u64);
            })?;
            bar.finish_and_clear();
            let page = compare::page::write(folder, &comparison, &identity, asked)?;
            if let Some(path) = &self.chain {
                let written = write_chain(path, &compare::page::chain(&comparison, &asked), &request, self.params.max_flip)?;
                written.iter().for_each(|path| _ = say::out(&text_of(path)));
            }
            Ok(page)
        })
    }

    /// The tree of that name, the photograph that is its truth if it is one's, and a word that changes with its file.
    fn open(&self, text: &str) -> Result<(TreeSource, Option<Photograph>, String)> {
        let path = Path::new(text);
        let bytes = if preset(text).is_none() && path.is_file() { files::read_whole(path, u64::MAX)? } else { vec![] };
        let digest = if bytes.is_empty() { text.to_owned() } else { format!("{text} ({})", digest(&bytes)) };
        if photograph::is_picture(&bytes) {
            let (source, photograph, warnings) = photograph::open(path, self.wish.seed)?;
            subject::warn(text, &warnings);
            return Ok((source, Some(photograph), digest));
        }
        Ok((self.wish.source(text)?, None, digest))
    }

    fn identity(&self, source: String, plan: &Plan, renderers: &[Renderer]) -> Identity {
        let info = &renderers[0].gpu.info;
        Identity {
            program: About::this_program(),
            commit: env!("SPHEREBOARD_COMMIT").to_owned(),
            source,
            plan: plan.clone(),
            seed: self.wish.seed.0,
            settings: self.settings.clone(),
            adapter: format!("{}, {} {}", info.name, info.driver, info.driver_info),
        }
    }
}

/// What was said on the command line that changes figures and is not in the plan; of files a word that changes with them.
fn settings(matches: &ArgMatches, extras: &[PathBuf]) -> Result<Vec<String>> {
    let mut settings = vec![];
    for name in ["leaves", "wood", "texture_budget_mb", "capture"] {
        if matches.value_source(name) == Some(ValueSource::CommandLine) {
            let values = matches.get_many::<String>(name).unwrap_or_default();
            settings.extend(values.map(|value| format!("--{} {value}", name.replace('_', "-"))));
        }
    }
    for path in extras {
        // One that cannot be read is refused in its row.
        let word = files::read_whole(path, u64::MAX).map_or_else(|_| "unreadable".to_owned(), |bytes| digest(&bytes));
        settings.push(format!("--extra {} ({word})", text_of(path)));
    }
    Ok(settings)
}

/// A word that changes when the bytes do: Fowler, Noll and Vo's sum, and their number.
fn digest(bytes: &[u8]) -> String {
    let sum = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    format!("{} bytes, {sum:016x}", bytes.len())
}

/// A chain is of one tree, and in a GLB file.
fn check_chain(path: &Path, matches: &ArgMatches) -> Result<()> {
    let sources: Vec<&String> = matches.get_many("source").unwrap_or_default().collect();
    if sources.len() > 1 {
        let what = format!("a chain is of one tree, but there are {} sources", sources.len());
        return Err(Error::Usage { what, remedy: "compare them one by one, or leave out --chain" });
    }
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb")) || path.file_stem().is_none() {
        return Err(Error::Hint { flag: "--chain", expected: "a file *.glb".to_owned(), found: text_of(path) });
    }
    files::refuse_overwriting([path], &sources.into_iter().map(PathBuf::from).collect::<Vec<_>>())
}

/// Writes the recommended chain as one file, and each link beside it as `NAME_1_METHOD.glb`, …; gives what was written.
fn write_chain(path: &Path, chain: &Chain, request: &Request, max_flip: f64) -> Result<Vec<PathBuf>> {
    let bar = subject::spinner(format!("{}: building {} links", path.display(), chain.links.len()));
    let links = compare::chain::build(chain, request.contenders, &request.shop)?;
    let origin = compare::chain::origin(chain, &request.shop);
    let joined = compare::chain::join(chain, &links, max_flip)?;
    let mut outputs = vec![(path.to_owned(), file::write(&joined, &origin)?)];
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    for (i, link) in links.iter().enumerate() {
        outputs.push((path.with_file_name(format!("{stem}_{}_{}.glb", i + 1, link.method)), file::write(link, &origin)?));
    }
    let _folder = files::ready_folder(path.parent().unwrap_or("".as_ref()))?;
    files::write_all(&outputs)?;
    bar.finish_and_clear();
    Ok(outputs.into_iter().map(|(path, _)| path).collect())
}

/// What is looked at, in a sentence or two.
fn planned(text: &str, plan: &Plan, budget: &compare::Budget) -> String {
    let views = format!("{} views at {} distances under {} sun(s)", plan.views.len(), plan.heights_px.len(), plan.suns.len());
    let thinned = if budget.thinned.is_empty() { String::new() } else { format!("; left out: {}", budget.thinned.join("; ")) };
    let over = if budget.planned_s > budget.allowed_s { ", which nothing more can be left out for" } else { "" };
    format!("{text}: {views}, reckoned to take {:.0} s of {:.0} s{over}{thinned}", budget.planned_s, budget.allowed_s)
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
