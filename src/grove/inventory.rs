//! Trees that stand where a list says: CSV as spreadsheets and city offices write it, or GeoJSON points. Bad rows are told and skipped.

mod geojson;
mod table;

use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;

use super::Planted;
use super::placement::{PlantingParams, SpeciesSize, Stands, foot_at, turn};
use super::terrain::{Georeference, degree_m};
use crate::geom::HeightField;
use crate::{Error, Result, Seed, Warning, files};

/// What coordinates are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinates {
    /// Metres east and north.
    Plane,
    /// Longitude and latitude, degrees.
    Degrees,
}

/// A row of a list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// Its line in a CSV file; its number among a GeoJSON file's features.
    pub line: usize,
    /// East and north, or longitude and latitude.
    pub at: [f64; 2],
    /// Its species, or the photograph that shows it: which of [`Inventory::names`].
    pub name: Option<u32>,
    /// Height, metres.
    pub height_m: Option<f32>,
    /// Width of the crown, metres.
    pub crown_width_m: Option<f32>,
}

/// Rows that were skipped.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Skipped {
    /// How many.
    pub count: usize,
    /// The first of them: line and reason.
    pub first: Vec<(usize, String)>,
}

impl Skipped {
    /// So many reasons are kept.
    const KEPT: usize = 100;

    fn add(&mut self, line: usize, why: String) {
        self.count += 1;
        if self.first.len() < Self::KEPT {
            self.first.push((line, why));
        }
    }

    /// One sentence with the first few, or nothing.
    fn warning(&self, what: &str) -> Option<Warning> {
        let few: Vec<String> = self.first.iter().take(5).map(|(line, why)| format!("{what} {line}: {why}")).collect();
        let more = if self.count > few.len() { format!("; and {} more", self.count - few.len()) } else { String::new() };
        (self.count > 0)
            .then(|| Warning::new("inventory-rows-skipped", format!("{} rows were skipped ({}{more})", self.count, few.join("; "))))
    }
}

/// A list of trees.
#[derive(Debug, Clone, PartialEq)]
pub struct Inventory {
    /// Its sound rows.
    pub entries: Vec<Entry>,
    /// Species or photographs, each once, in order of appearance.
    pub names: Vec<String>,
    /// What coordinates are.
    pub coordinates: Coordinates,
    /// Rows that are not sound.
    pub skipped: Skipped,
    /// What its rows are called: `line` or `feature`.
    pub rows_are: &'static str,
}

/// A list may have this many bytes.
const MOST_BYTES: u64 = 1 << 30;

/// Heights and crown widths that trees have, metres.
const SIZES_M: std::ops::RangeInclusive<f32> = 0.05..=200.0;

/// Reads a list, GeoJSON where it begins as JSON does.
///
/// # Errors
/// [`Error::InFile`] around [`Error::Inventory`] for a file without coordinates, or that cannot be read at all; those of reading.
pub fn open(path: &Path) -> Result<Inventory> {
    let bytes = files::read_whole(path, MOST_BYTES)?;
    read(&bytes).map_err(|cause| Error::InFile { path: path.to_owned(), cause: Box::new(cause) })
}

/// As [`open`], from a file's bytes.
///
/// # Errors
/// [`Error::Inventory`]; [`Error::TooManyTrees`].
pub fn read(bytes: &[u8]) -> Result<Inventory> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.trim_ascii_start().first() == Some(&b'{') { geojson::read(bytes) } else { table::read(bytes) }
}

/// What a column or a property holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Column {
    East,
    North,
    Longitude,
    Latitude,
    Name,
    /// Which photograph shows the tree: names it better than its species.
    Photograph,
    Height,
    CrownWidth,
}

impl Column {
    /// By its name: letters of either case, `_`, `-` and spaces alike, units behind it left out.
    fn called(name: &str) -> Option<Self> {
        let name = name.split(['(', '[']).next().unwrap_or_default().trim().to_lowercase();
        let name: String = name.chars().filter(|c| c.is_alphanumeric()).collect();
        Some(match name.as_str() {
            "x" | "xm" | "e" | "east" | "easting" | "eastm" | "xcoord" | "coordx" | "rechtswert" => Self::East,
            "y" | "ym" | "n" | "north" | "northing" | "northm" | "ycoord" | "coordy" | "hochwert" => Self::North,
            "lon" | "lng" | "long" | "longitude" | "laengengrad" => Self::Longitude,
            "lat" | "latitude" | "breitengrad" => Self::Latitude,
            "species" | "speciesname" | "scientificname" | "latinname" | "botanicalname" | "taxon" | "genus" | "tree"
            | "treetype" | "commonname" | "baumart" | "gattung" => Self::Name,
            "photo" | "photograph" | "image" | "picture" | "file" | "filename" => Self::Photograph,
            "height" | "heightm" | "h" | "treeheight" | "treeheightm" | "hoehe" | "baumhoehe" => Self::Height,
            "crown" | "crownm" | "crownwidth" | "crownwidthm" | "crowndiameter" | "crowndiameterm" | "crowndiam" | "canopy"
            | "canopywidth" | "spread" | "spreadm" | "kronedurch" | "kronendurchmesser" => Self::CrownWidth,
            _ => return None,
        })
    }
}

/// A row as it comes from a file, before it is checked.
#[derive(Default)]
struct Row<'a> {
    at: [Option<f64>; 2],
    name: Option<&'a str>,
    /// What stands there, unless it is a word for nothing.
    height: Option<&'a str>,
    crown_width: Option<&'a str>,
    comma: bool,
}

/// Collects rows.
struct Collector {
    inventory: Inventory,
    /// Numbers of the names; looked up only.
    numbers: BTreeMap<String, u32>,
}

impl Collector {
    fn new(coordinates: Coordinates, rows_are: &'static str) -> Self {
        let inventory = Inventory { entries: vec![], names: vec![], coordinates, skipped: Skipped::default(), rows_are };
        Self { inventory, numbers: BTreeMap::new() }
    }

    /// Takes a row whatever its coordinates turn out to be.
    fn take_anywhere(&mut self, line: usize, row: &Row) -> Result<()> {
        let told = std::mem::replace(&mut self.inventory.coordinates, Coordinates::Plane);
        let taken = self.take(line, row);
        self.inventory.coordinates = told;
        taken
    }

    /// Takes a row, or tells what is wrong with it.
    fn take(&mut self, line: usize, row: &Row) -> Result<()> {
        match self.entry(line, row) {
            Ok(entry) => self.inventory.entries.push(entry),
            Err(why) => self.inventory.skipped.add(line, why),
        }
        super::placement::check_number(self.inventory.entries.len() as u64)
    }

    fn entry(&mut self, line: usize, row: &Row) -> Result<Entry, String> {
        let [Some(east), Some(north)] = row.at else { return Err("it has no place".to_owned()) };
        if !(east.is_finite() && north.is_finite()) {
            return Err(format!("its place is {east}, {north}"));
        }
        if self.inventory.coordinates == Coordinates::Degrees && !(east.abs() <= 180.0 && north.abs() <= 90.0) {
            return Err(format!("{east}, {north} is no longitude and latitude"));
        }
        let size = |text: Option<&str>, what: &str| match text {
            None => Ok(None),
            Some(text) => match number(text, row.comma).map(|v| v as f32) {
                Some(v) if SIZES_M.contains(&v) => Ok(Some(v)),
                _ => Err(format!("its {what} is {text:.20}, not {} to {} m", SIZES_M.start(), SIZES_M.end())),
            },
        };
        let (height_m, crown_width_m) = (size(row.height, "height")?, size(row.crown_width, "crown width")?);
        Ok(Entry { line, at: [east, north], name: row.name.map(|name| self.number(name)), height_m, crown_width_m })
    }

    fn number(&mut self, name: &str) -> u32 {
        if let Some(number) = self.numbers.get(name) {
            return *number;
        }
        let number = self.inventory.names.len() as u32;
        self.inventory.names.push(name.to_owned());
        self.numbers.insert(name.to_owned(), number);
        number
    }
}

/// What stands in a field, unless it is empty or a word for nothing.
fn said(text: &str) -> Option<&str> {
    let text = text.trim();
    let nothing = ["", "-", "na", "n/a", "null", "none", "unknown"].iter().any(|word| text.eq_ignore_ascii_case(word));
    (!nothing).then_some(text)
}

/// A number, with its unit or without; `comma` allows 3,5.
fn number(text: &str, comma: bool) -> Option<f64> {
    let text = text.trim().trim_end_matches('m').trim_end();
    text.parse().ok().or_else(|| if comma { text.replace(',', ".").parse().ok() } else { None })
}

fn refused(expected: &str, found: String) -> Error {
    Error::Inventory { expected: expected.to_owned(), found }
}

/// How a list's coordinates come into the scene: less `middle`, times `unit_m`, north turned to -Z.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Coordinates of the scene's origin.
    pub middle: [f64; 2],
    /// Metres to a unit of the coordinates, eastwards and northwards.
    pub unit_m: [f64; 2],
    /// Which way was taken, where that is not obvious.
    pub warning: Option<Warning>,
}

impl Frame {
    /// X and Z in the scene.
    pub fn to_scene(&self, [east, north]: [f64; 2]) -> [f32; 2] {
        [((east - self.middle[0]) * self.unit_m[0]) as f32, ((self.middle[1] - north) * self.unit_m[1]) as f32]
    }
}

impl Inventory {
    /// Into a scene: by the ground's own place on the Earth where it speaks of the same coordinates; as metres from the ground's middle
    /// where most of the list then stands on it (`size_m`, east and north); otherwise about the list's own middle. Longitudes and
    /// latitudes are laid flat there: equirectangular, good to a metre over ten kilometres.
    pub fn frame(&self, georeference: Option<&Georeference>, size_m: [f32; 2]) -> Frame {
        let degrees = self.coordinates == Coordinates::Degrees;
        if let Some(map) = georeference.filter(|map| map.geographic == degrees) {
            return Frame { middle: map.origin, unit_m: map.unit_m, warning: None };
        }
        let on_ground = |e: &&Entry| e.at[0].abs() <= 0.5 * f64::from(size_m[0]) && e.at[1].abs() <= 0.5 * f64::from(size_m[1]);
        if !degrees && georeference.is_none() && 2 * self.entries.iter().filter(on_ground).count() >= self.entries.len() {
            return Frame { middle: [0.0; 2], unit_m: [1.0; 2], warning: None };
        }
        let middle = [0, 1].map(|axis| median(self.entries.iter().map(|e| e.at[axis]).collect()));
        let (unit_m, flat) =
            if degrees { (degree_m(middle[1]), "longitudes and latitudes, laid flat") } else { ([1.0; 2], "metres") };
        let why =
            if georeference.is_some() { "the ground's map has other coordinates" } else { "the ground has no place on the map" };
        let told =
            format!("the inventory was placed about its own middle, {:.5}, {:.5} ({flat}), since {why}", middle[0], middle[1]);
        Frame { middle, unit_m, warning: Some(Warning::new("inventory-centred", told)) }
    }

    /// Plants every row. Rows off the ground, or of impossible size, are told and skipped.
    pub fn plant(
        &self,
        frame: &Frame,
        ground: &HeightField,
        species: &[SpeciesSize],
        params: &PlantingParams,
        seed: Seed,
    ) -> (Vec<Planted>, Vec<Warning>) {
        let (kinds, unknown) = self.kinds(species, seed);
        let stands = Stands::new(species, params, seed);
        let tree = |entry: &Entry| -> Result<Planted, String> {
            let [x, z] = frame.to_scene(entry.at);
            let mut draws = seed.keyed("grove-listed", entry.line as u64);
            let kind = entry.name.map_or_else(|| stands.species_at(x, z, &mut draws), |name| kinds[name as usize]);
            let own = species.get(kind).ok_or("there is no species to plant")?;
            let scale = match (entry.height_m, entry.crown_width_m) {
                (Some(height), _) => height / own.height_m,
                (None, Some(width)) => width / own.crown_width_m,
                (None, None) => 1.0,
            };
            if !(1e-3..=1e3).contains(&scale) {
                return Err(format!("it would be {scale} times its species' size"));
            }
            let foot = foot_at(ground, x, z, own.trunk_radius_m * scale)
                .ok_or_else(|| format!("{x:.1} m east, {:.1} m north is off the ground", -z))?;
            Ok(Planted { species: kind as u16, position: foot, yaw_rad: turn(&mut draws), scale })
        };
        let trees: Vec<_> = self.entries.par_iter().map(tree).collect();
        let (mut planted, mut skipped) = (Vec::with_capacity(trees.len()), self.skipped.clone());
        for (entry, tree) in self.entries.iter().zip(trees) {
            match tree {
                Ok(tree) => planted.push(tree),
                Err(why) => skipped.add(entry.line, why),
            }
        }
        (planted, frame.warning.iter().cloned().chain(unknown).chain(skipped.warning(self.rows_are)).collect())
    }

    /// Which species each name is, and those that none is called.
    fn kinds(&self, species: &[SpeciesSize], seed: Seed) -> (Vec<usize>, Option<Warning>) {
        let mut unknown = vec![];
        let kinds = self.names.iter().map(|name| {
            kind_of(name, species).unwrap_or_else(|| {
                unknown.push(name.as_str());
                // Like names stay alike, whatever stands around them.
                let key = name.bytes().fold(7, |h: u64, b| h.wrapping_mul(31).wrapping_add(b.into()));
                seed.keyed("grove-unknown-species", key).below(species.len())
            })
        });
        let kinds = kinds.collect();
        let few = unknown.iter().take(5).map(|name| format!("{name:.40}")).collect::<Vec<_>>().join(", ");
        let told = format!("{} species of the inventory are not in the scene ({few}); others stand for them", unknown.len());
        (kinds, (!unknown.is_empty()).then(|| Warning::new("inventory-species-unknown", told)))
    }
}

/// The species that a list means: called just so; or one that its name holds, or whose names hold it, or its genus.
fn kind_of(name: &str, species: &[SpeciesSize]) -> Option<usize> {
    let plain = |text: &str| text.to_lowercase().replace(['_', '-'], " ").trim().to_owned();
    let wanted = plain(name);
    // A photograph may be named with its ending.
    let stem = wanted.rsplit_once('.').map_or(wanted.as_str(), |(stem, _)| stem);
    let names = |s: &SpeciesSize| std::iter::once(&s.name).chain(&s.also).map(|n| plain(n)).collect::<Vec<_>>();
    let find = |fits: &dyn Fn(&str) -> bool| species.iter().position(|s| names(s).iter().any(|n| fits(n)));
    let word = |n: &str, w: &str| n.split(|c: char| !c.is_alphanumeric()).any(|part| part == w);
    let genus = wanted.split(' ').next().filter(|genus| genus.len() > 3);
    find(&|n| n == wanted || n == stem)
        .or_else(|| find(&|n| word(&wanted, n) || (wanted.len() > 3 && n.contains(&wanted))))
        .or_else(|| genus.and_then(|genus| find(&|n| word(n, genus))))
}

/// The middle value; 0 of none.
fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

#[cfg(test)]
mod tests;
