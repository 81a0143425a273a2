//! `sphereboard render`: a model to a picture.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Arg, ArgMatches, Command, value_parser};
use glam::Vec3;

use crate::gpu::{AdapterChoice, Gpu, layout::Instance};
use crate::model::{self, glb};
use crate::raster::png;
use crate::render::{Background, Camera, GrowthParams, Renderer, Shot, Stage, Stand};
use crate::{Error, Result, files};

use super::{Outcome, options};

crate::params! {
    /// How a model is looked at.
    pub struct LookParams {
        /// From where round the tree: 0 is the side of the photograph, 90 its right.
        azimuth_deg: f64 = 0.0, in -360.0..=360.0, unit "°", source "ours: the front";
        /// How far above the horizon the viewer stands; 90 looks straight down.
        elevation_deg: f64 = 5.0, in -90.0..=90.0, unit "°", source "ours: a person's eye, looking slightly up and down";
        /// Distance from the middle of the tree; 0 fits the tree into the picture.
        distance_m: f64 = 0.0, in 0.0..=100000.0, unit "m", source "ours: all of it seen";
        /// How far the picture is taken.
        stage: Stage = Stage::Lit, unit "", source "She fig. 15";
        /// What stands behind.
        background: Background = Background::Sky, unit "", source "ours: as in a scene";
    }
}

/// The command's arguments.
pub fn command() -> Command {
    let command = Command::new("render")
        .about("Draw a model: one picture, or a turntable")
        .arg(Arg::new("model").value_name("MODEL").required(true).value_parser(value_parser!(PathBuf)).help("A GLB file"))
        .arg(
            Arg::new("out")
                .long("out")
                .value_name("FILE")
                .required(true)
                .value_parser(value_parser!(PathBuf))
                .help("The picture: PNG"),
        )
        .arg(Arg::new("size").long("size").value_name("WxH").default_value("1440x810").help("Size of the picture, pixels"))
        .arg(
            Arg::new("sun")
                .long("sun")
                .value_name("AZ,EL")
                .allow_negative_numbers(true)
                .default_value("40,45")
                .help("Where the sun stands: azimuth as the viewer's, elevation above the horizon, °"),
        )
        .arg(
            Arg::new("adapter")
                .long("adapter")
                .value_name("NAME")
                .default_value("auto")
                .help("Which graphics adapter: auto, software, gpu or a part of its name; `sphereboard doctor` lists them"),
        );
    options::add::<GrowthParams>(options::add::<LookParams>(command, "View"), "Growth of outlines")
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let look: LookParams = options::read(matches)?;
    let text = |name: &str| matches.get_one::<String>(name).expect("clap gives the default").as_str();
    let size_px = pair(text("size"), 'x', "--size", "WIDTHxHEIGHT in pixels, for example 1440x810")?;
    let [azimuth, elevation] =
        pair::<f32>(text("sun"), ',', "--sun", "AZIMUTH,ELEVATION in degrees, for example 40,45")?.map(f32::to_radians);
    let toward_sun = Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
    let path: &PathBuf = matches.get_one("model").expect("clap requires it");
    let bytes = files::read_whole(path, 1 << 30)?;
    let parts = glb::read(&bytes)?.parts();
    let bounds = model::bounds(&parts).expect("a model has a crown");
    let choice: AdapterChoice = text("adapter").parse().unwrap_or_else(|never| match never {});
    let mut renderer = Renderer::new(Gpu::open(&choice)?)?;
    let tree = renderer.upload(&parts)?;
    let distance = if look.distance_m > 0.0 { look.distance_m as f32 } else { Camera::distance_for(bounds, 0.95) };
    let shot = Shot {
        camera: Camera::orbit(
            bounds.center(),
            look.azimuth_deg.to_radians() as f32,
            look.elevation_deg.to_radians() as f32,
            distance,
        ),
        size_px,
        stage: look.stage,
        background: look.background,
        toward_sun,
        growth: options::read(matches)?,
        frame: 0,
    };
    let picture = renderer.picture(&shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }])?;
    let out: &PathBuf = matches.get_one("out").expect("clap requires it");
    files::write_all(&[(out.clone(), png(&picture.color)?)])?;
    Ok(ExitCode::SUCCESS)
}

/// Two numbers with a sign between them.
fn pair<T: std::str::FromStr>(text: &str, between: char, flag: &'static str, expected: &str) -> Result<[T; 2]> {
    let numbers = text.split_once(between).and_then(|(a, b)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]));
    numbers.ok_or_else(|| Error::Hint { flag, expected: expected.to_owned(), found: text.to_owned() })
}
