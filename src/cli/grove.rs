//! `sphereboard grove`: thousands of trees, driven through, and what they cost.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::builder::NonEmptyStringValueParser;
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use indicatif::ProgressBar;

use crate::gpu::Gpu;
use crate::grove::against::{Against, Pictures, drive_against};
use crate::grove::drive::{self, Frame, Grove};
use crate::grove::export::{self, ExportParams};
use crate::grove::page::{self, Picture, Video};
use crate::grove::record::{Recorder, Setting, Started};
use crate::grove::scene::{PRESETS, SpeciesEntry, StageParams, lay_out, preset};
use crate::grove::stock::{self, StandIn, Stock};
use crate::grove::trail::FollowParams;
use crate::grove::{Scene, SceneFile, culling, photos};
use crate::raster::{FRAME_MS, PngEffort, png_with, webp};
use crate::render::{CullParams, Renderer};
use crate::repr::{self, Settings, SoftwareCapture};
use crate::{Result, Seed, Warning, files};

use super::batch::{progress_bar, text_of};
use super::walk::{self, Walk};
use super::window::{self, Opening};
use super::{Outcome, look, options, say, scenes, subject};

/// The command's arguments.
pub fn command() -> Command {
    let text = |name: &'static str, value: &'static str| Arg::new(name).long(name).value_name(value);
    let file = |name: &'static str, value: &'static str| text(name, value).value_parser(value_parser!(PathBuf));
    let keys = format!("With --interactive. {}", window::keys::help(walk::KEYS));
    let command = Command::new("grove")
        .about("Thousands of trees on a terrain: drive through them and see what a frame costs")
        .after_help(format!("{}\n\n{keys}", scenes::short_help()))
        .after_long_help(format!("{}\n\n{keys}", scenes::help()))
        .arg(
            Arg::new("scene")
                .value_name("SCENE.toml")
                .value_parser(value_parser!(PathBuf))
                .help("A scene file; the end of `--help` says what it holds"),
        )
        .arg(
            text("preset", "NAME")
                .conflicts_with("scene")
                .value_parser(PRESETS.map(|preset| preset.name))
                .help("A scene that comes with the program [default without a scene file: she-540]"),
        )
        .arg(text("trees", "N").value_parser(value_parser!(u64)).help("How many trees, instead of the scene's"))
        .arg(
            text("species", "A,B,…")
                .value_delimiter(',')
                .value_parser(NonEmptyStringValueParser::new())
                .help("Presets or files that are planted, instead of the scene's"),
        )
        .arg(text("method", "ID").help("What stands for each tree, or `auto`: the chain of levels that a comparison recommends"))
        .arg(
            text("set", "KEY=VALUE")
                .action(ArgAction::Append)
                .help("Set a parameter of the method; may be repeated; `sphereboard methods ID` lists them"),
        )
        .arg(text("against", "ID").conflicts_with("interactive").help(
            "Then drive the same frames with this method and tell how many times as fast the scene's is, how many times fewer triangles it has, \
             and its FLIP over the pixels of trees in the pictures that are kept: `geometry` draws every leaf",
        ))
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
        )
        .arg(Arg::new("video").long("video").action(ArgAction::SetTrue).help(format!(
            "Also drive.webp, a moving picture of the drive: 25 frames a second, {MOST_VIDEO_FRAMES} at most, evenly along the path"
        )));
    let command = options::add::<CullParams>(command, "Culling and drawing, instead of the scene's");
    let command = options::add::<FollowParams>(command, "Levels of detail, instead of the scene's");
    let command = options::add::<StageParams>(command, "Light and air, instead of the scene's");
    look::add_adapter(add_exchange(command))
}

/// What comes in from photographs, and what goes out to other programs.
fn add_exchange(command: Command) -> Command {
    let file = |name: &'static str, value: &'static str| {
        Arg::new(name)
            .long(name)
            .value_name(value)
            .value_parser(value_parser!(PathBuf))
            .help_heading("Photographs and other programs")
    };
    let command = command
        .arg(
            file("photos", "DIR")
                .conflicts_with_all(["species", "preset"])
                .requires("inventory")
                .help("Model every photograph of this folder, instead of the scene's species; each is planted where --inventory names its file"),
        )
        .arg(file("inventory", "FILE").help(
            "Trees from a table (CSV) or GeoJSON points instead of the scene's: x and y or longitude and latitude, species or photo, height, \
             crown width",
        ))
        .arg(file("export", "FILE.glb").help(
            "Also write the grove as GLB for other programs: each tree once and lists of where its copies stand (EXT_mesh_gpu_instancing), \
             about 40 bytes for each tree; the ground as a mesh",
        ));
    options::add::<ExportParams>(command, "Photographs and other programs")
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let file = scene_file(matches)?;
    if matches.get_flag("interactive") {
        return interactive(matches, &file);
    }
    if let Some(other) = matches.get_one::<String>("against") {
        repr::method(other)?;
    }
    let out = matches.get_one::<PathBuf>("out").expect("clap requires it");
    let pictures = *matches.get_one::<u32>("pictures").expect("clap gives the default");
    let video = matches.get_flag("video");
    let mut renderer = Renderer::new(Gpu::open(&look::adapter(matches))?)?;
    let _folder = files::ready_folder(out)?;
    let mut started = Started::default();
    let (mut scene, stock) = planted(matches, &file, &mut started)?;
    write_export(matches, &scene, &stock)?;
    let mut watch = Watch(Instant::now());
    let mut grove = Grove::plant(&renderer, &scene, &stock)?;
    started.device_ms = watch.lap_ms();
    let culling = culling::choose(&mut renderer, &mut grove, &mut scene)?;
    say::out(&culling.sentence());
    let info = &renderer.gpu.info;
    let setting = Setting {
        adapter: format!("{}, {} {}", info.name, info.driver, info.driver_info),
        command: super::compare::command_line(),
        culling,
        started,
    };
    let mut recorder = Recorder::new(out, &scene, &grove, &setting)?;
    let bar = progress_bar(u64::from(file.frames));
    let mut kept = Ok(());
    let driven = drive::drive(&mut renderer, &mut grove, &scene, &mut |_, frame| {
        bar.inc(1);
        kept = recorder.keep(&frame);
        kept.is_ok()
    });
    bar.finish_and_clear();
    kept?;
    // What was driven so far is told even where the device was lost on the way.
    let mut drive = recorder.finish(&grove, driven.as_ref().err().map(ToString::to_string))?;
    let mut camera = Taken { renderer: &mut renderer, grove: &mut grove, scene: &scene, out };
    let seen = driven.and_then(|()| Ok((camera.pictures(pictures)?, if video { Some(camera.video()?) } else { None })));
    if let (Some(method), Ok(_)) = (matches.get_one::<String>("against"), &seen) {
        let ours = Pictures::take(&mut renderer, &mut grove, &scene, kept_frames(pictures, file.frames))?;
        drop(grove);
        drive.summary.against = Some(against(matches, &mut renderer, &scene, method, (&drive.frames, &ours), out)?);
    }
    let (pictures, video) = seen.as_ref().map_or((&[][..], None), |(pictures, video)| (&pictures[..], video.as_ref()));
    let page = page::write(out, &drive, pictures, video)?;
    seen.map(drop)?;
    say::out(&drive.summary.sentence());
    if let Some(against) = &drive.summary.against {
        say::out(&against.sentence());
    }
    say::out(&text_of(&page));
    Ok(ExitCode::SUCCESS)
}

/// Tells how long each thing took.
struct Watch(Instant);

impl Watch {
    fn lap_ms(&mut self) -> f64 {
        std::mem::replace(&mut self.0, Instant::now()).elapsed().as_secs_f64() * 1e3
    }
}

/// The scene laid out, and the trees that it is planted with; what a user should know of them is said.
fn planted(matches: &ArgMatches, file: &SceneFile, started: &mut Started) -> Result<(Scene, Vec<Stock>)> {
    let spinner = subject::spinner("growing species".to_owned());
    let mut watch = Watch(Instant::now());
    let stock = grown(matches, file, file.stand_in(&file.method), &spinner)?;
    started.species_ms = watch.lap_ms();
    stock.iter().for_each(|stock| subject::warn(&stock.size.name, &stock.warnings));
    let sizes: Vec<_> = stock.iter().map(|stock| stock.size.clone()).collect();
    let scene = lay_out(file, &sizes, &mut |what| spinner.set_message(what.to_owned()))?;
    started.places_ms = watch.lap_ms();
    spinner.finish_and_clear();
    subject::warn("scene", &scene.warnings);
    Ok((scene, stock))
}

/// The trees of a scene and what stands for them.
fn grown(matches: &ArgMatches, file: &SceneFile, by: StandIn, spinner: &ProgressBar) -> Result<Vec<Stock>> {
    match matches.get_one::<PathBuf>("photos") {
        Some(folder) => model_photos(folder, file, by),
        None => stock::stock(&file.species, by, &SoftwareCapture::new(), &|name| {
            spinner.set_message(format!("{name}: growing and building"));
        }),
    }
}

/// The scene in a window, until that is closed.
fn interactive(matches: &ArgMatches, file: &SceneFile) -> Outcome {
    let seconds = window::seconds_of(matches)?;
    let screenshots = matches.get_one::<PathBuf>("out").cloned().unwrap_or_else(|| ".".into());
    let _folder = files::ready_folder(&screenshots)?;
    let events = window::events()?;
    let watch = walk::Watch::new(file);
    let (scene, stock) = planted(matches, file, &mut Started::default())?;
    let opening = Opening { size_px: file.size_px, adapter: look::adapter(matches), screenshots, seconds };
    window::run(events, opening, Walk::new(scene, (stock, watch)))?;
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
    if let Some(folder) = matches.get_one::<PathBuf>("photos") {
        file.species = vec![SpeciesEntry::new(text_of(folder))];
    }
    if let Some(path) = matches.get_one::<PathBuf>("inventory") {
        file.inventory = Some(path.clone());
    }
    if ["species", "photos"].iter().any(|name| matches.value_source(name).is_some()) {
        // Not the scene that its title names.
        let names: Vec<_> = file.species.iter().filter_map(|species| Path::new(&species.source).file_stem()?.to_str()).collect();
        file.title = format!("A grove of {}", names.join(", "));
    }
    let text = |name| matches.get_one::<String>(name).cloned();
    file.trees = matches.get_one("trees").copied().unwrap_or(file.trees);
    file.frames = matches.get_one("frames").copied().unwrap_or(file.frames);
    file.method = text("method").unwrap_or(file.method);
    if let Some(set) = matches.get_many::<String>("set") {
        file.set(&Settings::parse(set.map(String::as_str))?)?;
    }
    if let Some(path) = text("path") {
        (file.path, file.key) = (path, vec![]);
    }
    if matches.contains_id("size") && text("size").is_some() {
        file.size_px = look::size_px(matches)?;
    }
    file.stage = options::read_over(matches, file.stage)?;
    file.levels = options::read_over(matches, file.levels)?;
    file.culling = options::read_over(matches, file.culling)?;
    file.check()?;
    Ok(file)
}

/// Which frames are kept as pictures: `count` of them, evenly along the path; a drive of few frames has no more pictures than frames.
fn kept_frames(count: u32, frames: u32) -> Vec<u32> {
    let count = count.min(frames);
    (0..count).map(|i| (u64::from(frames) * (2 * u64::from(i) + 1) / (2 * u64::from(count))) as u32).collect()
}

/// The same drive with another method; its pictures are written beside those of the drive.
fn against(
    matches: &ArgMatches,
    renderer: &mut Renderer,
    scene: &Scene,
    method: &str,
    (frames, pictures): (&[Frame], &Pictures),
    out: &Path,
) -> Result<Against> {
    let spinner = subject::spinner(format!("building {method}"));
    let stock = grown(matches, &scene.file, scene.file.stand_in(method), &spinner)?;
    spinner.finish_and_clear();
    let bar = progress_bar(frames.len() as u64);
    bar.set_message(method.to_owned());
    let (mut against, truths) = drive_against(renderer, scene, (method, &stock), (frames, pictures), &mut || bar.inc(1))?;
    bar.finish_and_clear();
    for (compared, truth) in against.pictures.iter_mut().zip(truths) {
        compared.file = format!("frames/frame_{:05}_{method}.png", compared.frame);
        files::write_whole(&out.join(&compared.file), &png_with(&truth, PngEffort::Small)?)?;
    }
    Ok(against)
}

/// A moving picture has so many frames at most: a minute of 10 a second. Of longer drives it leaves some out.
const MOST_VIDEO_FRAMES: u32 = 600;

/// Takes pictures of frames of the path.
struct Taken<'a> {
    renderer: &'a mut Renderer,
    grove: &'a mut Grove,
    scene: &'a Scene,
    out: &'a Path,
}

impl Taken<'_> {
    /// `count` of them, evenly along the path; those of an earlier drive go.
    fn pictures(&mut self, count: u32) -> Result<Vec<Picture>> {
        let folder = self.out.join("frames");
        let _folder = files::ready_folder(&folder)?;
        files::remove_numbered(&folder, "frame_", ".png")?;
        let bar = progress_bar(u64::from(count));
        bar.set_message("pictures");
        let mut taken = vec![];
        for frame in kept_frames(count, self.scene.file.frames) {
            let picture = drive::picture(self.renderer, self.grove, self.scene, frame)?;
            let name = format!("frame_{frame:05}.png");
            files::write_whole(&folder.join(&name), &png_with(&picture.color, PngEffort::Small)?)?;
            taken.push(Picture { file: format!("frames/{name}"), frame });
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(taken)
    }

    /// The drive as a moving picture.
    fn video(&mut self) -> Result<Video> {
        const NAME: &str = "drive.webp";
        let all = self.scene.file.frames;
        let step = all.div_ceil(MOST_VIDEO_FRAMES);
        let frames = all.div_ceil(step);
        if step > 1 {
            let told =
                format!("the moving picture has {frames} of {all} frames, each {step}th: it holds {MOST_VIDEO_FRAMES} at most");
            subject::warn("video", &[Warning::new("video-thinned", told)]);
        }
        let bar = progress_bar(u64::from(frames));
        bar.set_message("moving picture");
        let size_px = self.scene.file.size_px;
        let pictures = (0..frames).map(|i| {
            let picture = drive::picture(self.renderer, self.grove, self.scene, i * step)?;
            bar.inc(1);
            Ok(picture.color)
        });
        let bytes = webp(size_px, pictures)?;
        bar.finish_and_clear();
        files::write_whole(&self.out.join(NAME), &bytes)?;
        let shown_s = frames as f32 * FRAME_MS as f32 * 1e-3;
        Ok(Video { file: NAME.to_owned(), frames, times: self.scene.path.length_s() / shown_s })
    }
}

/// A tree of every photograph in a folder. Those that fail are told, and the rest goes on.
fn model_photos(folder: &Path, file: &SceneFile, by: StandIn) -> Result<Vec<Stock>> {
    let photos = photos::find(folder)?;
    let bar = progress_bar(photos.len() as u64);
    let modelled = photos::stock(&photos, by, Seed(file.seed), &SoftwareCapture::new(), &|name| {
        bar.set_message(name.to_owned());
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    if !modelled.failed.is_empty() {
        say::err(&format!("{} of {} photographs could not be modelled", modelled.failed.len(), photos.len()));
        subject::warn(&text_of(folder), &modelled.failed);
    }
    Ok(modelled.stock)
}

/// The grove for other programs, where it is wanted.
fn write_export(matches: &ArgMatches, scene: &Scene, stock: &[Stock]) -> Result<()> {
    let Some(path) = matches.get_one::<PathBuf>("export") else { return Ok(()) };
    let named = [matches.get_one::<PathBuf>("scene"), scene.file.inventory.as_ref(), scene.file.ground.as_ref()];
    let sources = scene.file.species.iter().map(|species| PathBuf::from(&species.source));
    files::refuse_overwriting([path.as_path()], &named.into_iter().flatten().cloned().chain(sources).collect::<Vec<_>>())?;
    let bar = subject::spinner(format!("{}: {} trees", path.display(), scene.planted.len()));
    let export = export::export(scene, stock, &options::read(matches)?)?;
    let _folder = files::ready_folder(path.parent().unwrap_or("".as_ref()))?;
    files::write_whole(path, &export.glb)?;
    bar.finish_and_clear();
    subject::warn("export", &export.warnings);
    let mb = |bytes: usize| bytes as f64 / 1e6;
    say::out(&format!(
        "{}: {:.1} MB, of them {:.1} MB for {} trees; {} triangles in {} draw calls",
        path.display(),
        mb(export.glb.len()),
        mb(export.bytes_of_copies),
        export.trees,
        export.triangles,
        export.draws
    ));
    Ok(())
}
