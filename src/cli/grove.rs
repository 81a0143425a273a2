//! `sphereboard grove`: thousands of trees, driven through, and what they cost.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use indicatif::ProgressBar;

use crate::gpu::Gpu;
use crate::grove::drive::{self, FollowParams, Grove};
use crate::grove::record::{Recorder, Setting};
use crate::grove::scene::{PRESETS, SpeciesEntry, lay_out, preset};
use crate::grove::stock::{self, Stock};
use crate::grove::{Scene, SceneFile};
use crate::raster::{PngEffort, png_with};
use crate::render::{CullParams, Renderer};
use crate::repr::SoftwareCapture;
use crate::{Result, files};

use super::batch::{progress_bar, text_of};
use super::walk::{self, Walk};
use super::window::{self, Opening};
use super::{Outcome, look, options, say, subject};

/// The command's arguments.
pub fn command() -> Command {
    let text = |name: &'static str, value: &'static str| Arg::new(name).long(name).value_name(value);
    let file = |name: &'static str, value: &'static str| text(name, value).value_parser(value_parser!(PathBuf));
    let command = Command::new("grove")
        .about("Thousands of trees on a terrain: drive through them and see what a frame costs")
        .arg(Arg::new("scene").value_name("SCENE.toml").value_parser(value_parser!(PathBuf)).help("A scene file"))
        .arg(
            text("preset", "NAME")
                .conflicts_with("scene")
                .value_parser(PRESETS.map(|preset| preset.name))
                .help("A scene that comes with the program [default without a scene file: she-540]"),
        )
        .arg(text("trees", "N").value_parser(value_parser!(u64)).help("How many trees, instead of the scene's"))
        .arg(text("species", "A,B,…").value_delimiter(',').help("Presets or files that are planted, instead of the scene's"))
        .arg(text("method", "ID").help("What stands for each tree, or `auto`: the chain of levels that a comparison recommends"))
        .arg(text("path", "WHICH").help("tour, orbit, or a file with a line t,ex,ey,ez,tx,ty,tz for each key"))
        .arg(text("frames", "N").value_parser(value_parser!(u32)).help("Frames along the path"))
        .arg(text("size", "WxH").help("Size of the picture in pixels"))
        .arg(
            file("out", "DIR")
                .required_unless_present("interactive")
                .help("Folder for frames.csv, summary.json, plots and pictures; with --interactive for those that the key c saves"),
        )
        .arg(
            Arg::new("interactive")
                .long("interactive")
                .action(ArgAction::SetTrue)
                .help("Open the scene in a window instead: fly, switch the method live, freeze culling, colour by level"),
        )
        .arg(window::seconds().requires("interactive"))
        .arg(
            text("pictures", "N")
                .value_parser(value_parser!(u32).range(0..=100))
                .default_value("5")
                .help("Frames that are kept as PNG, evenly along the path"),
        );
    let command = options::add::<CullParams>(command, "Culling and drawing");
    look::add_adapter(options::add::<FollowParams>(command, "Levels of detail"))
        .after_help(format!("With --interactive. {}", window::keys::help(walk::KEYS)))
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let file = scene_file(matches)?;
    let (cull, follow): (CullParams, FollowParams) = (options::read(matches)?, options::read(matches)?);
    if matches.get_flag("interactive") {
        return interactive(matches, &file, cull, follow);
    }
    let out = matches.get_one::<PathBuf>("out").expect("clap requires it");
    let pictures = *matches.get_one::<u32>("pictures").expect("clap gives the default");
    let mut renderer = Renderer::new(Gpu::open(&look::adapter(matches))?)?;
    let _folder = files::ready_folder(out)?;
    let (scene, stock) = planted(&file)?;
    let mut grove = Grove::plant(&renderer, &scene, &stock)?;
    let info = &renderer.gpu.info;
    let setting = Setting {
        adapter: format!("{}, {} {}", info.name, info.driver, info.driver_info),
        command: super::compare::command_line(),
        cull: &cull,
        follow: &follow,
    };
    let mut recorder = Recorder::new(out, &scene, &grove, &setting)?;
    let bar = progress_bar(u64::from(file.frames));
    let mut kept = Ok(());
    let driven = drive::drive(&mut renderer, &mut grove, &scene, (&cull, &follow), &mut |_, frame| {
        bar.inc(1);
        kept = recorder.keep(&frame);
        kept.is_ok()
    });
    bar.finish_and_clear();
    kept?;
    // What was driven so far is told even where the device was lost on the way.
    let summary = recorder.finish(&grove)?;
    driven?;
    write_pictures(&mut renderer, &mut grove, &scene, (&cull, &follow), (out, pictures))?;
    say::out(&summary);
    say::out(&text_of(&out.join("summary.json")));
    Ok(ExitCode::SUCCESS)
}

/// The scene laid out, and the trees that it is planted with; what a user should know of them is said.
fn planted(file: &SceneFile) -> Result<(Scene, Vec<Stock>)> {
    let spinner = subject::spinner("growing species".to_owned());
    let stock = stock::stock(&file.species, &file.method, &SoftwareCapture::new(), &|name| {
        spinner.set_message(format!("{name}: growing and building"));
    })?;
    stock.iter().for_each(|stock| subject::warn(&stock.size.name, &stock.warnings));
    let sizes: Vec<_> = stock.iter().map(|stock| stock.size.clone()).collect();
    let scene = lay_out(file, &sizes, &mut |what| spinner.set_message(what.to_owned()))?;
    spinner.finish_and_clear();
    subject::warn("scene", &scene.warnings);
    Ok((scene, stock))
}

/// The scene in a window, until that is closed.
fn interactive(matches: &ArgMatches, file: &SceneFile, cull: CullParams, follow: FollowParams) -> Outcome {
    let seconds = window::seconds_of(matches)?;
    let screenshots = matches.get_one::<PathBuf>("out").cloned().unwrap_or_else(|| ".".into());
    let _folder = files::ready_folder(&screenshots)?;
    let events = window::events()?;
    let watch = walk::Watch::new(file);
    let (scene, stock) = planted(file)?;
    let opening = Opening { size_px: file.size_px, adapter: look::adapter(matches), screenshots, seconds };
    window::run(events, opening, Walk::new(scene, (stock, watch), cull, follow))?;
    Ok(ExitCode::SUCCESS)
}

/// The scene that was asked for, with what was asked instead of its own.
fn scene_file(matches: &ArgMatches) -> Result<SceneFile> {
    let name = matches.get_one::<String>("preset").map_or("she-540", String::as_str);
    let mut file = match matches.get_one::<PathBuf>("scene") {
        Some(path) => SceneFile::open(path)?,
        None => preset(name)?,
    };
    if let Some(species) = matches.get_many::<String>("species") {
        file.species = species.map(SpeciesEntry::new).collect();
    }
    let text = |name| matches.get_one::<String>(name).cloned();
    file.trees = matches.get_one("trees").copied().unwrap_or(file.trees);
    file.frames = matches.get_one("frames").copied().unwrap_or(file.frames);
    file.method = text("method").unwrap_or(file.method);
    if let Some(path) = text("path") {
        (file.path, file.key) = (path, vec![]);
    }
    if matches.contains_id("size") && text("size").is_some() {
        file.size_px = look::size_px(matches)?;
    }
    file.check()?;
    Ok(file)
}

fn write_pictures(
    renderer: &mut Renderer,
    grove: &mut Grove,
    scene: &Scene,
    params: (&CullParams, &FollowParams),
    (out, count): (&Path, u32),
) -> Result<()> {
    let folder = out.join("frames");
    let _folder = files::ready_folder(&folder)?;
    let bar: ProgressBar = progress_bar(u64::from(count));
    for i in 0..count {
        let number = (u64::from(scene.file.frames) * (2 * u64::from(i) + 1) / (2 * u64::from(count))) as u32;
        let picture = drive::picture(renderer, grove, scene, params, number)?;
        files::write_whole(&folder.join(format!("frame_{number:05}.png")), &png_with(&picture.color, PngEffort::Small)?)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}
