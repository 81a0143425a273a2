//! Scene files: which trees on which ground, seen along which path, in which picture; and the scene that is laid out from one.

mod layout;
mod presets;
mod table;

use std::collections::BTreeMap;
use std::path::{Path as FilePath, PathBuf};

use serde::Deserialize;

pub use layout::{Scene, lay_out};
pub use presets::{PRESETS, Preset, preset};
use table::{settings, table};

use super::path::{CameraParams, Key};
use super::placement::{PlantingParams, check_number};
use super::stock::StandIn;
use super::terrain::TerrainParams;
use super::trail::FollowParams;
use crate::params::ParamSet;
use crate::render::{CullParams, Stage};
use crate::repr::Settings;
use crate::{Error, Result, files, repr};

crate::params! {
    /// Light and air, and how far pictures are taken.
    pub struct StageParams {
        /// How far pictures are taken.
        stage: Stage = Stage::Lit, unit "", source "She fig. 15 b-e";
        /// Where the sun stands round the scene; 0 is south, 90 is east.
        sun_azimuth_deg: f64 = 50.0, in -360.0..=360.0, unit "°", source "ours: from behind the viewer's right shoulder as the tour begins";
        /// How high the sun stands.
        sun_elevation_deg: f64 = 40.0, in 0.0..=90.0, unit "°", source "ours: a summer morning";
        /// Where fog has taken half of what is seen; 0 is clear air.
        fog_half_m: f64 = 0.0, in 0.0..=100_000.0, unit "m", source "ours: small scenes have none";
        /// How hard the wind blows; 0 is calm.
        wind_m_s: f64 = 0.0, in 0.0..=60.0, unit "m/s", source "ours: none of the papers' groves moves";
    }
}

/// Declares what a table of a scene file has: the struct, and its fields with their meanings for the command's help.
macro_rules! described {
    ($(#[$outer:meta])* pub struct $name:ident { $( #[doc = $meaning:literal] $(#[$meta:meta])* pub $field:ident : $ty:ty, )+ }) => {
        $(#[$outer])*
        pub struct $name { $( #[doc = $meaning] $(#[$meta])* pub $field: $ty, )+ }

        impl $name {
            /// Its fields and what they mean.
            pub const FIELDS: &[(&str, &str)] = &[ $( (stringify!($field), $meaning.trim_ascii()), )+ ];
        }
    };
}

described! {
    /// A species of the scene.
    #[derive(Debug, Clone, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct SpeciesEntry {
        /// A preset (`sphereboard grow --list`), or the file of a model, sought beside the scene file.
        pub source: String,
        /// Share of the trees over the sum of all shares, 0 to 1,000,000; 1 unless given.
        #[serde(default = "one")]
        pub share: f64,
        /// How many different trees of a preset are grown, 1 to 16, so that repetition does not show; 1 unless given.
        #[serde(default = "one_tree")]
        pub variants: u32,
        /// Seed of the first variant, the next have the next; 1 unless given.
        #[serde(default = "first_seed")]
        pub seed: u64,
        /// The folder of a comparison of this source (`sphereboard compare`), or its `report.json`, beside the scene file: where the method is
        /// `auto`, its chain is drawn instead of the one that comes with the program.
        #[serde(default)]
        pub compared: Option<PathBuf>,
    }
}

impl SpeciesEntry {
    /// One tree of a source.
    pub fn new(source: impl Into<String>) -> Self {
        Self { source: source.into(), share: one(), variants: one_tree(), seed: first_seed(), compared: None }
    }
}

fn one() -> f64 {
    1.0
}
fn one_tree() -> u32 {
    1
}
fn first_seed() -> u64 {
    1
}

described! {
    /// A scene as its file says it. Fields that are missing have the values of [`SceneFile::default`].
    #[derive(Debug, Clone, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields, default)]
    pub struct SceneFile {
        /// What it shows; empty unless given.
        pub title: String,
        /// Which method draws the trees, or `auto`: the chain that a comparison recommends. `auto` unless given.
        pub method: String,
        /// Parameters of methods (`sphereboard methods ID`): a table for each, for example `[settings.slices]`.
        #[serde(deserialize_with = "settings")]
        pub settings: BTreeMap<String, Settings>,
        /// Width and height of the picture, 16 to 8192 pixels; 1280 × 720 unless given.
        pub size_px: [u32; 2],
        /// How many trees, 0 to 4,194,304; 540 unless given (She §3.5). An inventory says for itself.
        pub trees: u64,
        /// Seed of ground and planting; 1 unless given.
        pub seed: u64,
        /// Frames along the path, 1 to 1,000,000; 300 unless given.
        pub frames: u32,
        /// `tour`, `orbit`, or a file of `t,ex,ey,ez,tx,ty,tz` beside the scene file; `tour` unless given, ignored beside `key`.
        pub path: String,
        /// The path's keys, for scenes that hold their own: `time_s`, `eye`, `target`. One is a still camera.
        pub key: Vec<Key>,
        /// A picture of heights or a GeoTIFF, beside the scene file; hills from the seed unless given.
        pub ground: Option<PathBuf>,
        /// A CSV table or GeoJSON points of trees, beside the scene file; blue noise unless given.
        pub inventory: Option<PathBuf>,
        /// What grows, 1 to 64 of them; one oak unless given.
        pub species: Vec<SpeciesEntry>,
        /// The ground's parameters.
        #[serde(deserialize_with = "table")]
        pub terrain: TerrainParams,
        /// Those of planting.
        #[serde(deserialize_with = "table")]
        pub planting: PlantingParams,
        /// Those of the camera.
        #[serde(deserialize_with = "table")]
        pub camera: CameraParams,
        /// Light and air.
        #[serde(deserialize_with = "table")]
        pub stage: StageParams,
        /// How levels of detail follow the camera.
        #[serde(deserialize_with = "table")]
        pub levels: FollowParams,
        /// Which trees are drawn, and how.
        #[serde(deserialize_with = "table")]
        pub culling: CullParams,
    }
}

impl Default for SceneFile {
    fn default() -> Self {
        Self {
            title: String::new(),
            method: AUTO.to_owned(),
            settings: BTreeMap::new(),
            size_px: [1280, 720],
            trees: 540,
            seed: 1,
            frames: 300,
            path: "tour".to_owned(),
            key: vec![],
            ground: None,
            inventory: None,
            species: vec![SpeciesEntry::new("oak")],
            terrain: TerrainParams::default(),
            planting: PlantingParams::default(),
            camera: CameraParams::default(),
            stage: StageParams::default(),
            levels: FollowParams::default(),
            culling: CullParams::default(),
        }
    }
}

/// In place of a method: the chain that a comparison recommends.
pub const AUTO: &str = "auto";

impl SceneFile {
    /// Reads and checks a file; the files that it names are sought beside it.
    ///
    /// # Errors
    /// [`Error::InFile`] around those of [`Self::parse`]; those of reading.
    pub fn open(path: &FilePath) -> Result<Self> {
        const MOST_BYTES: u64 = 16 << 20;
        let bytes = files::read_whole(path, MOST_BYTES)?;
        let inside = |cause| Error::InFile { path: path.to_owned(), cause: Box::new(cause) };
        let mut scene = Self::parse(&String::from_utf8_lossy(&bytes)).map_err(inside)?;
        let folder = path.parent().unwrap_or(FilePath::new(""));
        for file in scene.ground.iter_mut().chain(&mut scene.inventory) {
            *file = folder.join(&*file);
        }
        if !scene.path_is_made() {
            scene.path = folder.join(&scene.path).to_string_lossy().into_owned();
        }
        for species in &mut scene.species {
            species.compared = species.compared.take().map(|path| folder.join(path));
            let beside = folder.join(&species.source);
            if crate::plant::presets::preset(&species.source).is_none() && beside.exists() {
                species.source = beside.to_string_lossy().into_owned();
            }
        }
        Ok(scene)
    }

    /// From TOML.
    ///
    /// # Errors
    /// [`Error::SceneFile`] with the line; those of [`Self::check`].
    pub fn parse(text: &str) -> Result<Self> {
        let scene: Self = toml::from_str(text).map_err(|error| {
            let line = error
                .span()
                .map_or(1, |span| 1 + text.as_bytes()[..span.start.min(text.len())].iter().filter(|b| **b == b'\n').count());
            Error::SceneFile { line, what: error.message().trim().replace('\n', " ") }
        })?;
        scene.check()?;
        Ok(scene)
    }

    /// What a method is built with in this scene.
    pub fn stand_in<'a>(&'a self, method: &'a str) -> StandIn<'a> {
        StandIn { method, settings: self.settings.get(method).unwrap_or(Settings::none()) }
    }

    /// Sets parameters of the scene's method over those that the scene has.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the method is [`AUTO`]: a chain is of several.
    pub fn set(&mut self, settings: &Settings) -> Result<()> {
        if self.method == AUTO {
            let expected = "a method that it sets a parameter of, by --method".to_owned();
            return Err(Error::Parameter { name: "--set".to_owned(), expected, found: AUTO.to_owned() });
        }
        let own = self.settings.entry(self.method.clone()).or_default();
        *own = std::mem::take(own).and(settings);
        Ok(())
    }

    /// Whether the path comes from a word instead of a file.
    fn path_is_made(&self) -> bool {
        ["tour", "orbit"].contains(&self.path.as_str())
    }

    /// Checks every value, also after some were overridden.
    ///
    /// # Errors
    /// [`Error::Parameter`] with what was expected; [`Error::UnknownMethod`]; [`Error::TooManyTrees`].
    pub fn check(&self) -> Result<()> {
        let wrong = |name: &str, expected: &str, found: String| {
            Err(Error::Parameter { name: name.to_owned(), expected: expected.to_owned(), found })
        };
        check_number(self.trees)?;
        if !self.size_px.iter().all(|side| (16..=8192).contains(side)) {
            return wrong("size_px", "16 to 8192 px a side", format!("{} × {}", self.size_px[0], self.size_px[1]));
        }
        if !(1..=1_000_000).contains(&self.frames) {
            return wrong("frames", "1 to 1000000", self.frames.to_string());
        }
        if !(1..=64).contains(&self.species.len()) {
            return wrong("species", "1 to 64 tables [[species]]", format!("{} of them", self.species.len()));
        }
        for species in &self.species {
            if !(0.0..=1e6).contains(&species.share) {
                return wrong("share", "0 to 1000000", species.share.to_string());
            }
            if !(1..=16).contains(&species.variants) {
                return wrong("variants", "1 to 16", species.variants.to_string());
            }
        }
        if self.species.iter().all(|species| species.share == 0.0) {
            return wrong("share", "more than 0 for one species", "0 for all".to_owned());
        }
        if self.method != AUTO {
            repr::method(&self.method)?;
        }
        for (method, settings) in &self.settings {
            settings.split("trunk.").0.check(repr::method(method)?)?;
        }
        self.terrain.validate()?;
        self.planting.validate()?;
        self.camera.validate()?;
        self.stage.validate()?;
        self.levels.validate()?;
        self.culling.validate()
    }
}

#[cfg(test)]
mod tests;
