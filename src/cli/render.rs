//! `sphereboard render`: a model to a picture, a depth picture, or a turntable.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Arg, ArgMatches, Command, value_parser};
use glam::Vec3;
use image::RgbaImage;
use indicatif::ProgressBar;

use crate::geom::Bounds;
use crate::gpu::layout::Instance;
use crate::raster::{FRAME_MS, exr_depth, gif, png, webp};
use crate::render::{Picture, Renderer, Shot, Stand, Tree};
use crate::{Error, Result, files};

use super::look::{self, Look, Orbit};
use super::subject::{self, Wish};
use super::{Outcome, batch, options, say};

/// The command's arguments.
pub fn command() -> Command {
    let file = |name: &'static str| Arg::new(name).long(name).value_name("FILE").value_parser(value_parser!(PathBuf));
    let command = Command::new("render")
        .about("Draw a tree, or what a method makes of it: a picture, its depth, or a turntable")
        .arg(Arg::new("source").value_name("SOURCE").required(true).help(subject::SOURCE_HELP))
        .arg(file("out").required_unless_present("turntable").help("The picture, PNG"))
        .arg(
            file("depth")
                .requires("out")
                .help("Also write the distance from the viewer's plane: OpenEXR, channel Z, metres, infinity where nothing is"),
        )
        .arg(file("turntable").help("A full turn round the tree: *.gif, *.webp, or a folder for frames as PNG"))
        .arg(
            Arg::new("frames")
                .long("frames")
                .value_name("N")
                .allow_negative_numbers(true)
                .default_value("75")
                .help("Pictures of the turntable, 2 to 3600; it shows 25 a second"),
        );
    let command = subject::add_method(command, false);
    look::add(subject::add_source(command, "Seed of a preset's growth and of the method"))
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let look = Look::read(matches)?;
    let frames = options::whole(matches, "frames", 2..=3600)?.expect("clap gives the default");
    let path = |name: &str| matches.get_one::<PathBuf>(name).cloned();
    let source = matches.get_one::<String>("source").expect("clap requires it");
    let wish = Wish::read(matches)?;
    let (out, depth, turntable) = (path("out"), path("depth"), path("turntable"));
    check_outputs(source.as_ref(), out.as_deref(), depth.as_deref(), turntable.as_deref(), frames)?;

    let subject = wish.subject(source)?;
    let orbit = look.orbit(&subject.points, turntable.is_some())?;
    warn_inside(&orbit, &subject.points);
    let mut renderer = look.renderer()?;
    let tree = renderer.upload_built(&subject.built)?;
    let mut scene = Scene { look: &look, orbit, tree: &tree, renderer: &mut renderer };
    if let Some(out) = out {
        let picture = scene.picture(0.0, 0)?;
        let mut made = vec![(out, png(&picture.color)?)];
        if let Some(depth) = depth {
            made.push((depth, exr_depth(look.size_px, &picture.depth_m)?));
        }
        files::write_all(&made)?;
        made.iter().for_each(|(path, _)| _ = say::out(&path.display().to_string()));
    }
    if let Some(target) = turntable {
        scene.turntable(&target, frames)?;
        say::out(&target.display().to_string());
    }
    Ok(ExitCode::SUCCESS)
}

/// One tree on its own, and how it is looked at.
struct Scene<'a> {
    look: &'a Look,
    orbit: Orbit,
    tree: &'a Tree,
    renderer: &'a mut Renderer,
}

impl Scene<'_> {
    /// The picture turned round the tree, of that number in a series of 25 a second.
    fn picture(&mut self, turn_rad: f32, frame: u32) -> Result<Picture> {
        let mut shot = Shot { frame, ..self.look.shot(self.orbit.camera(turn_rad)) };
        shot.wind.time += f64::from(frame * FRAME_MS) / 1e3;
        self.renderer.picture(&shot, &[Stand { tree: self.tree, instances: &[Instance::IDENTITY] }])
    }

    /// A full turn, as one file or as a folder of frames.
    fn turntable(&mut self, target: &Path, frames: u32) -> Result<()> {
        let bar = batch::progress_bar(u64::from(frames));
        let size_px = self.look.size_px;
        let pictures = self.turn(frames, &bar);
        match extension(target).as_deref() {
            Some("gif") => files::write_whole(target, &gif(pictures)?)?,
            Some(_) => files::write_whole(target, &webp(size_px, pictures)?)?,
            None => {
                let _folder = files::ready_folder(target)?;
                for (number, picture) in pictures.enumerate() {
                    files::write_whole(&frame_path(target, number as u32), &png(&picture?)?)?;
                }
            }
        }
        bar.finish_and_clear();
        Ok(())
    }

    /// The frames of a full turn.
    fn turn(&mut self, frames: u32, bar: &ProgressBar) -> impl Iterator<Item = Result<RgbaImage>> {
        (0..frames).map(move |frame| {
            let picture = self.picture(std::f32::consts::TAU * frame as f32 / frames as f32, frame)?;
            bar.inc(1);
            Ok(picture.color)
        })
    }
}

/// Refuses outputs that are not what their names say, that replace each other or the model, or that would mix two turntables.
fn check_outputs(model: &Path, out: Option<&Path>, depth: Option<&Path>, turntable: Option<&Path>, frames: u32) -> Result<()> {
    let kind = |flag, path: Option<&Path>, allowed: &[Option<&str>], expected: &str| match path {
        Some(path) if !allowed.contains(&extension(path).as_deref()) => {
            Err(Error::Hint { flag, expected: expected.to_owned(), found: path.display().to_string() })
        }
        _ => Ok(()),
    };
    kind("--out", out, &[Some("png")], "a file *.png")?;
    kind("--depth", depth, &[Some("exr")], "a file *.exr")?;
    kind("--turntable", turntable, &[Some("gif"), Some("webp"), None], "a file *.gif or *.webp, or a folder")?;
    files::refuse_overwriting([out, depth, turntable].into_iter().flatten(), &[model.to_owned()])?;
    let later = turntable.filter(|path| path.is_dir()).map(|folder| frame_path(folder, frames)).filter(|path| path.exists());
    match later {
        Some(path) => Err(Error::Usage {
            what: format!("{} is of a longer turntable and would stay among the new frames", path.display()),
            remedy: "choose another folder, or delete the frames there",
        }),
        None => Ok(()),
    }
}

fn extension(path: &Path) -> Option<String> {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase())
}

fn frame_path(folder: &Path, number: u32) -> PathBuf {
    folder.join(format!("{number:04}.png"))
}

/// From inside, surfaces are seen from behind, where there is nothing to see.
fn warn_inside(orbit: &Orbit, points: &[Vec3]) {
    let eye = orbit.camera(0.0).eye;
    let inside = Bounds::of(points.iter().copied()).is_some_and(|b| eye.cmpge(b.min).all() && eye.cmple(b.max).all());
    if inside {
        say::err("warning: the viewer stands among the leaves, and most surfaces are not seen from inside; raise --distance-m");
    }
}
