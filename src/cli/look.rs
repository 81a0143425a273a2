//! How a model is looked at: the options that `render` and `view` share.

use std::f32::consts::TAU;
use std::str::FromStr;

use clap::builder::NonEmptyStringValueParser;
use clap::{Arg, ArgMatches, Command};
use glam::Vec3;

use crate::geom::Bounds;
use crate::gpu::{AdapterChoice, Gpu};
use crate::render::{Background, Camera, GrowthParams, LightParams, Renderer, Shot, Show, Stage, WindParams};
use crate::{Error, Result};

use super::options;

/// Longest side that any adapter draws or window system takes; the adapter in use may take less.
const MAX_SIDE_PX: u32 = 16_384;
const SIZE: &str = "WIDTHxHEIGHT in pixels, 1 to 16384 each, for example 1440x810";

crate::params! {
    /// How a model is looked at.
    pub struct LookParams {
        /// From where round the tree: 0 is the side of the photograph, 90 stands on the right of what 0 shows.
        azimuth_deg: f64 = 0.0, in -360.0..=360.0, unit "°", source "ours: the side that was photographed";
        /// How far above the horizon the viewer stands; 90 looks straight down.
        elevation_deg: f64 = 5.0, in -90.0..=90.0, unit "°", source "ours: about a person's view of a tree";
        /// Distance from the middle of the tree; 0 stands where the whole tree just fits.
        distance_m: f64 = 0.0, in 0.0..=100000.0, unit "m", source "ours: all of it seen";
        /// How far the picture is taken.
        stage: Stage = Stage::Lit, unit "", source "She fig. 15 b-e";
        /// What is shown of the surfaces.
        show: Show = Show::Picture, unit "", source "ours: how they look";
        /// What stands behind the tree.
        background: Background = Background::Sky, unit "", source "ours: as in a scene";
    }
}

/// Everything that [`add`] offers, read.
pub struct Look {
    /// The table.
    pub params: LookParams,
    /// Picture size, pixels.
    pub size_px: [u32; 2],
    /// Towards the sun, unit length.
    pub toward_sun: Vec3,
    /// Sun and sky.
    pub light: LightParams,
    /// Wind and its time.
    pub wind: WindParams,
    /// How outlines grow.
    pub growth: GrowthParams,
    /// Which adapter draws.
    adapter: AdapterChoice,
}

/// Where the viewer stands round a tree.
#[derive(Debug, Clone, Copy)]
pub struct Orbit {
    /// What is looked at, metres.
    pub target: Vec3,
    /// Azimuth and elevation as [`Camera::orbit`] has them.
    pub azimuth_rad: f32,
    /// Above the horizon.
    pub elevation_rad: f32,
    /// From the target.
    pub distance_m: f32,
}

impl Orbit {
    /// The camera there, turned by another `turn_rad` round the tree.
    pub fn camera(&self, turn_rad: f32) -> Camera {
        Camera::orbit(self.target, self.azimuth_rad + turn_rad, self.elevation_rad, self.distance_m)
    }
}

/// Adds the options.
pub fn add(command: Command) -> Command {
    let command = options::add::<LookParams>(add_adapter(add_size_and_sun(command, "1440x810")), "View");
    let command = options::add::<LightParams>(command, "Light");
    let command = options::add::<WindParams>(command, "Wind");
    options::add::<GrowthParams>(command, "Growth of outlines (She §3.3, fig. 13)")
}

/// Adds the size of the picture and where the sun stands, for [`size_px`] and [`toward_sun`].
pub fn add_size_and_sun(command: Command, size: &'static str) -> Command {
    command
        .arg(
            Arg::new("size")
                .long("size")
                .value_name("WxH")
                .allow_hyphen_values(true)
                .default_value(size)
                .help("Size of the picture in pixels"),
        )
        .arg(
            Arg::new("sun")
                .long("sun")
                .value_name("AZ,EL")
                .allow_hyphen_values(true)
                .default_value("40,45")
                .help("Where the sun stands, in °: azimuth as the viewer's, elevation above the horizon"),
        )
}

/// The picture's width and height.
///
/// # Errors
/// [`Error::Hint`] unless they are two numbers in range.
pub fn size_px(matches: &ArgMatches) -> Result<[u32; 2]> {
    let size_px: [u32; 2] = pair(text(matches, "size"), 'x', "--size", SIZE)?;
    if size_px.iter().all(|side| (1..=MAX_SIDE_PX).contains(side)) {
        return Ok(size_px);
    }
    Err(Error::Hint { flag: "--size", expected: SIZE.to_owned(), found: text(matches, "size").to_owned() })
}

/// Towards the sun, unit length.
///
/// # Errors
/// [`Error::Hint`] unless they are two angles.
pub fn toward_sun(matches: &ArgMatches) -> Result<Vec3> {
    let sun: [f32; 2] = pair(text(matches, "sun"), ',', "--sun", "AZIMUTH,ELEVATION in °, for example 40,45")?;
    if !(sun[0].abs() <= 360.0 && sun[1].abs() <= 90.0) {
        let expected = "AZIMUTH,ELEVATION with -360 ≤ AZIMUTH ≤ 360 and -90 ≤ ELEVATION ≤ 90 °".to_owned();
        return Err(Error::Hint { flag: "--sun", expected, found: text(matches, "sun").to_owned() });
    }
    Ok(toward(sun))
}

fn text<'a>(matches: &'a ArgMatches, name: &str) -> &'a str {
    matches.get_one::<String>(name).expect("clap gives the default")
}

/// Adds the choice of the adapter, which every command that draws has.
pub fn add_adapter(command: Command) -> Command {
    command.arg(
        Arg::new("adapter")
            .long("adapter")
            .value_name("NAME")
            .default_value("auto")
            .value_parser(NonEmptyStringValueParser::new())
            .help("Which graphics adapter draws: auto, software, gpu, or a part of its name; `sphereboard doctor` lists them"),
    )
}

/// The adapter that [`add_adapter`] was told.
pub fn adapter(matches: &ArgMatches) -> AdapterChoice {
    let text = matches.get_one::<String>("adapter").expect("clap gives the default");
    text.parse().unwrap_or_else(|never| match never {})
}

impl Look {
    /// Reads the options of [`add`].
    ///
    /// # Errors
    /// [`Error::Hint`] or [`Error::Parameter`] for values that make no sense.
    pub fn read(matches: &ArgMatches) -> Result<Self> {
        Ok(Self {
            params: options::read(matches)?,
            size_px: size_px(matches)?,
            toward_sun: toward_sun(matches)?,
            light: options::read(matches)?,
            wind: options::read(matches)?,
            growth: options::read(matches)?,
            adapter: adapter(matches),
        })
    }

    /// Opens the adapter and compiles the passes.
    ///
    /// # Errors
    /// Those of [`Gpu::open`] and [`Renderer::new`].
    pub fn renderer(&self) -> Result<Renderer> {
        Renderer::new(Gpu::open(&self.adapter)?)
    }

    /// Where `points` are looked at from as told; `turning`, from a distance at which they fit from every side.
    ///
    /// # Errors
    /// [`Error::Usage`] when the tree is so large or far off that coordinates lose their digits.
    pub fn orbit(&self, points: &[Vec3], turning: bool) -> Result<Orbit> {
        let target = Bounds::of(points.iter().copied()).map_or(Vec3::ZERO, |b| b.center());
        let [width, height] = self.size_px.map(|side| side.max(1) as f32);
        let azimuth_rad = self.params.azimuth_deg.to_radians() as f32;
        let elevation_rad = self.params.elevation_deg.to_radians() as f32;
        let fitting = |turn: f32| Camera::fitting_distance_m(points, target, azimuth_rad + turn, elevation_rad, width / height);
        let sides = if turning { 24 } else { 1 };
        let distance_m = match self.params.distance_m as f32 {
            0.0 => (0..sides).map(|i| fitting(TAU * i as f32 / sides as f32)).fold(0.0, f32::max),
            told => told,
        };
        // Beyond, a 32-bit coordinate has less than a decimetre to it.
        if (target.length() + distance_m).is_nan() || target.length() + distance_m > 1e6 {
            let what = format!("the tree stands {:.0} m from the origin and is seen from {distance_m:.0} m", target.length());
            return Err(Error::Usage { what, remedy: "export it in metres, near the origin" });
        }
        Ok(Orbit { target, azimuth_rad, elevation_rad, distance_m })
    }

    /// The picture to take from there.
    pub fn shot(&self, camera: Camera) -> Shot {
        let LookParams { stage, show, background, .. } = self.params;
        Shot {
            stage,
            show,
            background,
            toward_sun: self.toward_sun,
            light: self.light.clone(),
            wind: self.wind.clone(),
            growth: self.growth.clone(),
            ..Shot::new(camera, self.size_px)
        }
    }
}

/// The direction of an azimuth and an elevation, °: a unit vector.
pub fn toward([azimuth_deg, elevation_deg]: [f32; 2]) -> Vec3 {
    let ((sa, ca), (se, ce)) = (azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
    Vec3::new(sa * ce, se, ca * ce)
}

/// Two numbers with a sign between them.
fn pair<T: FromStr>(text: &str, between: char, flag: &'static str, expected: &str) -> Result<[T; 2]> {
    let numbers = text.split_once(between).and_then(|(a, b)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]));
    numbers.ok_or_else(|| Error::Hint { flag, expected: expected.to_owned(), found: text.to_owned() })
}
