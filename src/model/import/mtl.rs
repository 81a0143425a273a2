//! MTL material libraries: colour, texture and cut-outs (`Kd`, `map_Kd`, `map_d`); how a surface shines does not matter to trees.
//!
//! `d` and `Tr` are not read: exporters disagree on which way they count, and no part of a tree is made of glass.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::Vec2;
use image::imageops::{self, FilterType};
use image::{Rgba, RgbaImage};

use super::folder::{Folder, shortened};
use super::picture::{self, PixelBudget};
use super::{Warnings, text};
use crate::model::{Material, Wrap};
use crate::raster::ALPHA_CUTOFF;

/// Greys that Blender and others write beside every texture without meaning them.
const UNMEANT_GREYS: [f32; 3] = [0.0, 0.64, 0.8];

/// A material, and how its texture lies on the surface.
pub struct Look {
    pub material: Material,
    scale: Vec2,
    offset: Vec2,
}

impl Look {
    /// Where a texture coordinate comes to lie (`-s`, `-o`), with v downwards as in glTF.
    pub fn placed(&self, uv: Vec2) -> Vec2 {
        let upwards = Vec2::new(uv.x, 1.0 - uv.y) * self.scale + self.offset;
        Vec2::new(upwards.x, 1.0 - upwards.y)
    }
}

/// What a surface without material looks like.
pub fn plain() -> Material {
    Material { factor: [0.8, 0.8, 0.8, 1.0], two_sided: true, ..Material::default() }
}

/// What the libraries say of the materials in use.
pub fn looks(libraries: &[String], used: &[&str], folder: &Folder, warnings: &mut Warnings) -> BTreeMap<String, Look> {
    let mut entries = BTreeMap::new();
    for library in libraries {
        match fetch(library, folder, warnings) {
            Ok(bytes) => read(&bytes, &mut entries),
            Err(why) => {
                let message = format!("the material library {why}; what it describes is drawn in plain grey");
                warnings.add("missing-materials", message);
            }
        }
    }
    let mut pictures = Pictures { folder, decoded: BTreeMap::new(), budget: PixelBudget::default() };
    let mut found = BTreeMap::new();
    for &name in used {
        match entries.get(name) {
            Some(entry) => drop(found.insert(name.to_owned(), entry.look(name, &mut pictures, warnings))),
            None if name.is_empty() => {}
            None => warnings
                .add("missing-materials", format!("the material {} is in no library and drawn in plain grey", shortened(name))),
        }
    }
    found
}

/// A library's bytes: `mtllib` names one file, whose name may hold spaces, or several.
fn fetch(names: &str, folder: &Folder, warnings: &mut Warnings) -> Result<Vec<u8>, String> {
    let whole = moved(names, folder, warnings);
    if whole.is_ok() || !names.contains(char::is_whitespace) {
        return whole;
    }
    let several = names.split_whitespace().map(|name| moved(name, folder, warnings)).collect::<Result<Vec<_>, _>>();
    several.map(|files| files.join(&b'\n')).or(whole)
}

/// A file by the name that another computer had for it: as it says, else by its last part beside the model.
fn moved(name: &str, folder: &Folder, warnings: &mut Warnings) -> Result<Vec<u8>, String> {
    let name = name.trim().trim_matches('"');
    folder.file(name).or_else(|why| {
        let last = name.rsplit(['/', '\\']).next().unwrap_or_default();
        let bytes = if last == name { Err(()) } else { folder.file(last).map_err(drop) };
        let bytes = bytes.map_err(|()| why)?;
        warnings.add(
            "moved-file",
            format!("{} is not where the model says; {} beside the model is used", shortened(name), shortened(last)),
        );
        Ok(bytes)
    })
}

/// One `newmtl`.
#[derive(Default)]
struct Entry {
    diffuse: Option<[f32; 3]>,
    color: Option<Map>,
    ambient: Option<Map>,
    opacity: Option<Map>,
}

/// A `map_…` statement.
struct Map {
    file: String,
    scale: Vec2,
    offset: Vec2,
    clamp: bool,
    /// The channel to use of it: `r`, `g`, `b`, `m` (alpha), `l` (luminance).
    channel: Option<char>,
}

/// Adds the entries of a library. A statement that cannot be read says nothing.
fn read(bytes: &[u8], entries: &mut BTreeMap<String, Entry>) {
    let mut current: Option<&mut Entry> = None;
    for (_, line) in text::logical_lines(bytes) {
        let (keyword, rest) = text::keyword(&line);
        if keyword.eq_ignore_ascii_case("newmtl") {
            let entry = entries.entry(rest.to_owned()).or_default();
            *entry = Entry::default();
            current = Some(entry);
            continue;
        }
        let Some(entry) = current.as_deref_mut() else { continue };
        match keyword.to_ascii_lowercase().as_str() {
            "kd" => entry.diffuse = text::numbers::<3>(rest).ok().filter(|(_, count)| *count == 3).map(|(rgb, _)| rgb),
            "map_kd" => entry.color = Map::of(rest),
            "map_ka" => entry.ambient = Map::of(rest),
            "map_d" => entry.opacity = Map::of(rest),
            _ => {}
        }
    }
}

impl Map {
    /// Options, then a file name that may hold spaces.
    fn of(statement: &str) -> Option<Self> {
        let mut map = Self { file: String::new(), scale: Vec2::ONE, offset: Vec2::ZERO, clamp: false, channel: None };
        let mut rest = statement.trim();
        while let Some((option, after)) = rest.strip_prefix('-').and_then(|rest| rest.split_once(char::is_whitespace)) {
            let most = match option {
                "o" | "s" | "t" => 3,
                "mm" => 2,
                "blendu" | "blendv" | "cc" | "clamp" | "texres" | "bm" | "boost" | "imfchan" | "type" => 1,
                _ => break,
            };
            let mut words = Vec::new();
            rest = after.trim_start();
            while words.len() < most {
                let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                // How many numbers follow is not fixed; the name ends them.
                if most == 3 && word.parse::<f32>().is_err() {
                    break;
                }
                words.push(word);
                rest = after.trim_start();
            }
            map.option(option, &words);
        }
        map.file = rest.trim().to_owned();
        (!map.file.is_empty()).then_some(map)
    }

    fn option(&mut self, option: &str, words: &[&str]) {
        let number =
            |k: usize, rest: f32| words.get(k).and_then(|word| word.parse().ok()).filter(|n: &f32| n.is_finite()).unwrap_or(rest);
        match option {
            "s" => self.scale = Vec2::new(number(0, 1.0), number(1, 1.0)),
            "o" => self.offset = Vec2::new(number(0, 0.0), number(1, 0.0)),
            "clamp" => self.clamp = words.first().is_some_and(|word| word.eq_ignore_ascii_case("on")),
            "imfchan" => self.channel = words.first().and_then(|word| word.chars().next()),
            _ => {}
        }
    }
}

impl Entry {
    fn look(&self, name: &str, pictures: &mut Pictures, warnings: &mut Warnings) -> Look {
        // Some exporters write only the ambient map, of the same picture.
        let color = pictures.of(&self.color, name, warnings).or_else(|| pictures.of(&self.ambient, name, warnings));
        let opacity = pictures.of(&self.opacity, name, warnings);
        let texture = match (&color, &opacity) {
            (Some((color, picture)), Some((opacity, cut))) if color.file != opacity.file => {
                pictures.cut_out(Some(picture), cut, opacity.channel, name, warnings)
            }
            (Some((_, picture)), _) => Some(picture.clone()),
            (None, Some((opacity, cut))) => pictures.cut_out(None, cut, opacity.channel, name, warnings),
            (None, None) => None,
        };
        let laid = color.as_ref().or(opacity.as_ref()).map(|(map, _)| *map);
        let [r, g, b] = self.diffuse.unwrap_or([1.0; 3]).map(|c| c.clamp(0.0, 1.0));
        let unmeant = color.is_some() && r == g && g == b && UNMEANT_GREYS.iter().any(|grey| (grey - r).abs() < 1e-3);
        let cut_out = texture.as_ref().is_some_and(|texture| picture::has_cut_outs(texture));
        let material = Material {
            name: name.to_owned(),
            factor: if unmeant { [1.0; 4] } else { [r, g, b, 1.0] },
            texture,
            normal_texture: None,
            wrap: if laid.is_some_and(|map| map.clamp) { Wrap::Clamp } else { Wrap::Repeat },
            alpha_cutoff: cut_out.then_some(ALPHA_CUTOFF),
            two_sided: true,
        };
        let (scale, offset) = laid.map_or((Vec2::ONE, Vec2::ZERO), |map| (map.scale, map.offset));
        Look { material, scale, offset }
    }
}

/// The picture with the alpha that another one gives: its alpha channel when that says something, else its luminance.
fn with_opacity(picture: &RgbaImage, cut: &RgbaImage, channel: Option<char>) -> RgbaImage {
    let has_alpha = cut.pixels().any(|p| p[3] < 255);
    let channel = channel.unwrap_or(if has_alpha { 'm' } else { 'l' });
    let luminance = |[r, g, b]: [u8; 3]| ((299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b) + 500) / 1000) as u8;
    let opacity = |p: &Rgba<u8>| match channel {
        'r' => p[0],
        'g' => p[1],
        'b' => p[2],
        'm' => p[3],
        _ => luminance([p[0], p[1], p[2]]),
    };
    let resized = (cut.dimensions() != picture.dimensions())
        .then(|| imageops::resize(cut, picture.width(), picture.height(), FilterType::Triangle));
    let cut = resized.as_ref().unwrap_or(cut);
    RgbaImage::from_fn(picture.width(), picture.height(), |x, y| {
        let Rgba([r, g, b, _]) = *picture.get_pixel(x, y);
        Rgba([r, g, b, opacity(cut.get_pixel(x, y))])
    })
}

/// The pictures of one file, each decoded once.
struct Pictures<'a> {
    folder: &'a Folder,
    decoded: BTreeMap<String, Option<Arc<RgbaImage>>>,
    budget: PixelBudget,
}

impl Pictures<'_> {
    fn of<'m>(&mut self, map: &'m Option<Map>, material: &str, warnings: &mut Warnings) -> Option<(&'m Map, Arc<RgbaImage>)> {
        let map = map.as_ref()?;
        Some((map, self.get(&map.file, material, warnings)?))
    }

    /// A picture (without one: white) with the opacity that another one gives.
    fn cut_out(
        &mut self,
        picture: Option<&Arc<RgbaImage>>,
        cut: &RgbaImage,
        channel: Option<char>,
        material: &str,
        warnings: &mut Warnings,
    ) -> Option<Arc<RgbaImage>> {
        let (width, height) = picture.map_or(cut.dimensions(), |picture| picture.dimensions());
        if !self.budget.spend(width as usize * height as usize) {
            warnings.missing_texture(&format!("of the material {}", shortened(material)), "is one too many");
            return None;
        }
        let white = picture.is_none().then(|| RgbaImage::from_pixel(width, height, Rgba([255; 4])));
        let picture = picture.map(Arc::as_ref).or(white.as_ref())?;
        Some(Arc::new(with_opacity(picture, cut, channel)))
    }

    fn get(&mut self, file: &str, material: &str, warnings: &mut Warnings) -> Option<Arc<RgbaImage>> {
        if let Some(known) = self.decoded.get(file) {
            return known.clone();
        }
        let bytes = moved(file, self.folder, warnings).and_then(|bytes| self.budget.admit(&bytes).map(|()| bytes));
        let picture = match bytes.and_then(|bytes| picture::decode(&bytes)) {
            Ok(picture) => Some(Arc::new(picture)),
            Err(why) => {
                warnings.missing_texture(&format!("of the material {}", shortened(material)), &why);
                None
            }
        };
        self.decoded.insert(file.to_owned(), picture.clone());
        picture
    }
}
