//! What a person may say about a picture: `--rect`, `--include`, `--exclude`, `--mask`, `--hue` (She §3.1, "manual interventions").

use std::path::{Path, PathBuf};

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};

use crate::photo::segment::check_hue;
use crate::photo::{DecodeParams, Hints};
use crate::raster::Rect;
use crate::{Error, Result};

use super::batch::texts_of;

/// Adds the options.
pub fn add(command: Command) -> Command {
    let option = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name)
            .long(name)
            .value_name(value)
            .allow_hyphen_values(true)
            .help(help)
            .help_heading("Manual help with the segmentation (pixels of the upright photograph)")
    };
    command
        .arg(option("rect", "X,Y,W,H", "The crown lies inside this rectangle; X,Y is its top left corner"))
        .arg(option("include", "X,Y", "This pixel belongs to the crown; may be repeated").action(ArgAction::Append))
        .arg(option("exclude", "X,Y", "This pixel does not belong to the crown; may be repeated").action(ArgAction::Append))
        .arg(
            option(
                "mask",
                "FILE",
                "A picture of the photograph's size, white where the crown is, instead of the segmentation; once per photograph",
            )
            .action(ArgAction::Append)
            .allow_hyphen_values(false)
            .value_parser(value_parser!(PathBuf)),
        )
        .arg(option(
            "hue",
            "LO..HI",
            "Range of the foliage's hue in ° (0 red, 60 yellow, 120 green), low to high, for reds across 0 as in -20..20; She §3.1 uses 90..150",
        ))
}

/// What was said about the photographs of one run.
pub struct HintOptions {
    /// For every photograph alike.
    common: Hints,
    /// None, or one per photograph in their order.
    masks: Vec<PathBuf>,
}

impl HintOptions {
    /// Reads the options for a run over `photos` photographs.
    ///
    /// # Errors
    /// [`Error::Hint`] for text of another form or an impossible hue range, [`Error::Usage`] for a rectangle or a point with several
    /// photographs, or another number of masks than of photographs.
    pub fn read(matches: &ArgMatches, photos: usize) -> Result<Self> {
        let text = |name: &str| matches.get_one::<String>(name).map(String::as_str);
        let points = |name: &'static str, flag: &'static str| -> Result<Vec<(u32, u32)>> {
            let given = matches.get_many::<String>(name).unwrap_or_default();
            given
                .map(|t| {
                    whole_numbers::<2>(flag, t, "X,Y, two whole numbers of pixels from the top left corner").map(|[x, y]| (x, y))
                })
                .collect()
        };
        let common = Hints {
            rect: text("rect")
                .map(|t| whole_numbers::<4>("--rect", t, "X,Y,W,H, four whole numbers of pixels"))
                .transpose()?
                .map(|[x, y, width, height]| Rect { x, y, width, height }),
            include: points("include", "--include")?,
            exclude: points("exclude", "--exclude")?,
            mask: None,
            hue_deg: text("hue").map(hue_range).transpose()?,
        };
        let of_one_picture = ["rect", "include", "exclude"].into_iter().find(|name| matches.contains_id(name));
        if let Some(name) = of_one_picture.filter(|_| photos > 1) {
            let what = format!("--{name} describes one picture, but {photos} photographs were given");
            return Err(Error::Usage { what, remedy: "run them one at a time" });
        }
        let masks: Vec<PathBuf> = matches.get_many("mask").unwrap_or_default().cloned().collect();
        if !masks.is_empty() && masks.len() != photos {
            let given = if masks.len() == 1 { "1 mask was".to_owned() } else { format!("{} masks were", masks.len()) };
            let what = format!("{given} given for {photos} photograph{}", if photos == 1 { "" } else { "s" });
            return Err(Error::Usage { what, remedy: "give --mask once per photograph, in their order" });
        }
        Ok(Self { common, masks })
    }

    /// The hints for the photograph of that number; decodes its mask.
    ///
    /// # Errors
    /// [`Error::InOption`] around those of decoding.
    pub fn of(&self, photo: usize, decode: &DecodeParams) -> Result<Hints> {
        let mask = self.masks.get(photo).map(|path| crown_mask(path, decode)).transpose()?;
        Ok(Hints { mask, ..self.common.clone() })
    }

    /// The files of the masks.
    pub fn masks(&self) -> &[PathBuf] {
        &self.masks
    }

    /// What was given, for reports.
    pub fn report(&self) -> serde_json::Value {
        let Hints { rect, include, exclude, hue_deg, .. } = &self.common;
        serde_json::json!({"rect": rect, "include": include, "exclude": exclude, "hue_deg": hue_deg, "masks": texts_of(&self.masks)})
    }
}

fn whole_numbers<const N: usize>(flag: &'static str, text: &str, expected: &str) -> Result<[u32; N]> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    numbers.and_then(|n| n.try_into().ok()).ok_or_else(|| wrong(flag, text, expected))
}

fn hue_range(text: &str) -> Result<(f64, f64)> {
    let range = text.split_once("..").and_then(|(low, high)| Some((low.trim().parse().ok()?, high.trim().parse().ok()?)));
    let range = range.ok_or_else(|| wrong("--hue", text, "LO..HI, two angles in °, for example 45..170"))?;
    check_hue(range)?;
    Ok(range)
}

fn wrong(flag: &'static str, text: &str, expected: &str) -> Error {
    Error::Hint { flag, expected: expected.to_owned(), found: if text.is_empty() { "empty".to_owned() } else { text.to_owned() } }
}

/// A hand-drawn mask: white is crown.
fn crown_mask(path: &Path, decode: &DecodeParams) -> Result<crate::raster::Mask> {
    let in_option = |cause| Error::InOption { flag: "--mask", cause: Box::new(cause) };
    let photo = crate::photo::decode::decode(path, decode).map_err(in_option)?;
    Ok(crate::raster::Mask::from_gray(&image::imageops::grayscale(&photo.image)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hue_ranges_are_read_and_reversed_ones_refused() {
        assert_eq!(hue_range("45..170").unwrap(), (45.0, 170.0));
        assert_eq!(hue_range("45.5..45.5").unwrap(), (45.5, 45.5));
        assert_eq!(hue_range("-20..20").unwrap(), (-20.0, 20.0));
        for text in ["150..90", "340..20", "90", "90..", "-200..20", "-90..300", "0..400", "NaN..20", "a..b", ""] {
            let message = hue_range(text).unwrap_err().to_string();
            assert!(message.contains("--hue must be LO..HI"), "{message}");
        }
    }

    #[test]
    fn rectangles_need_four_whole_numbers() {
        assert_eq!(whole_numbers::<4>("--rect", "1, 2,3,4", "").unwrap(), [1, 2, 3, 4]);
        for text in ["1,2,3", "1,2,3,4,5", "1,2,3,-4", "1.5,2,3,4", ""] {
            assert!(whole_numbers::<4>("--rect", text, "").is_err(), "{text}");
        }
    }
}
