//! `sphereboard photograph`: a reference tree to a photograph and its exact masks.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Arg, ArgMatches, Command, value_parser};

use crate::gpu::Gpu;
use crate::model::Growth;
use crate::model::reference::{Asked, ReferenceTree};
use crate::params::PowerOfTwo;
use crate::raster::{PngEffort, jpeg, png_with};
use crate::render::{LightParams, Renderer};
use crate::report::studio::{self, Sitting, StudioParams, photograph};
use crate::repr::TreeSource;
use crate::{Error, Result, Seed, files};

use super::batch::{progress_bar, text_of};
use super::{Outcome, look, options, say, subject};

/// The command's arguments.
pub fn command() -> Command {
    let angle = |name: &'static str, help: &'static str| {
        let short = name.trim_end_matches("-deg");
        Arg::new(name).long(name).alias(short).value_name("DEG").allow_negative_numbers(true).help(help)
    };
    let command = Command::new("photograph")
        .about("Photograph a true tree, for a model to be made of: P.jpg, and the exact masks P.tree.png and P.crown.png")
        .after_help(
            "Examples:\n  sphereboard photograph oak --out oak.jpg\n  \
             sphereboard photograph ash.glb --azimuth-deg 90 --lens-mm 50 --sun 150,20 --out ash_east.jpg\n\
             P.tree.png is 255 where wood and leaves cover half of a pixel or more. P.crown.png is 255 where leaves do, and in everything\n\
             that these enclose, be it wood or sky: the crown as segmentation should find it. What of it is not in P.tree.png are gaps.\n\
             The circle: photograph a tree, `sphereboard model P.jpg --height-m H`, and compare the model with the tree.",
        )
        .arg(Arg::new("tree").value_name("TREE").required(true).help(subject::SOURCE_HELP))
        .arg(
            Arg::new("out")
                .long("out")
                .value_name("P.jpg")
                .required(true)
                .value_parser(value_parser!(PathBuf))
                .help("The photograph, a name that ends in .jpg; the masks go beside it"),
        )
        .arg(angle("azimuth-deg", "From where round the tree, °: 0 is +Z, 90 is +X").default_value("0"))
        .arg(angle(
            "elevation-deg",
            "How far above the horizon the camera stands, °, as the middle of the tree sees it [default: it stands on the ground, see --eye-m]",
        ))
        .arg(
            Arg::new("quality").long("quality").value_name("N").allow_negative_numbers(true).default_value("92").help("Of the JPEG, 1 to 100"),
        );
    let command = subject::add_source(command, "Seed of a preset's growth, of clouds, hedge and grain");
    let command = look::add_adapter(look::add_size_and_sun(command, "1000x1300"));
    let command = options::add::<StudioParams>(command, "Camera and surroundings");
    options::add::<LightParams>(command, "Light")
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let sitting = sitting(matches)?;
    let quality = options::whole(matches, "quality", 1..=100u8)?.expect("clap gives the default");
    let out = matches.get_one::<PathBuf>("out").expect("clap requires it");
    let is_jpeg = |e: &std::ffi::OsStr| e.eq_ignore_ascii_case("jpg") || e.eq_ignore_ascii_case("jpeg");
    if !out.extension().is_some_and(is_jpeg) || out.file_stem().is_none() {
        let expected = "a file name that ends in .jpg".to_owned();
        return Err(Error::Parameter { name: "--out".to_owned(), expected, found: text_of(out) });
    }
    let outputs = [out.clone(), out.with_extension("tree.png"), out.with_extension("crown.png")];
    let tree = matches.get_one::<String>("tree").expect("clap requires it");
    files::refuse_overwriting(outputs.iter().map(PathBuf::as_path), &[PathBuf::from(tree)])?;
    let _folder = files::ready_folder(out.parent().unwrap_or(Path::new("")))?;

    let bar = progress_bar(studio::STEPS + 1);
    let (truth, growth) = truth(tree, &subject::asked(matches), sitting.seed)?;
    let mut renderer = Renderer::new(Gpu::open(&look::adapter(matches))?)?;
    bar.inc(1);
    let taken = photograph(&mut renderer, &truth, growth, &sitting, &|| bar.inc(1))?;
    bar.finish_and_clear();
    let [picture, whole, crown] = outputs;
    let mask = |mask: &crate::raster::Mask| png_with(&mask.to_gray(), PngEffort::Small);
    let made = [(picture, jpeg(&taken.image, quality)?), (whole, mask(&taken.tree)?), (crown, mask(&taken.crown)?)];
    files::write_all(&made)?;
    let names: Vec<String> = made.iter().map(|(path, _)| text_of(path)).collect();
    Ok(if say::out(&names.join("  ")) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn sitting(matches: &ArgMatches) -> Result<Sitting> {
    let usual = Sitting::default();
    // The sun's map is drawn once: it may be as fine as the leaves.
    let light = LightParams { shadow_map_px: PowerOfTwo(usual.light.shadow_map_px.0), ..LightParams::default() };
    Ok(Sitting {
        azimuth_rad: degrees(matches, "azimuth-deg", 360.0)?.unwrap_or(0.0).to_radians(),
        elevation_rad: degrees(matches, "elevation-deg", 89.0)?.map(f32::to_radians),
        size_px: look::size_px(matches)?,
        toward_sun: look::toward_sun(matches)?,
        light: options::read_over(matches, light)?,
        seed: options::read_seed(matches)?,
        params: options::read(matches)?,
    })
}

/// An angle of at most `most` degrees either way, where it was given.
fn degrees(matches: &ArgMatches, name: &'static str, most: f32) -> Result<Option<f32>> {
    let Some(text) = matches.get_one::<String>(name) else { return Ok(None) };
    let angle = text.parse().ok().filter(|angle: &f32| angle.abs() <= most);
    angle.map(Some).ok_or_else(|| Error::Parameter {
        name: format!("--{name}"),
        expected: format!("an angle from -{most} to {most}°"),
        found: text.clone(),
    })
}

/// What is photographed, and how the outlines of our own models grow.
fn truth(text: &str, asked: &Asked, seed: Seed) -> Result<(ReferenceTree, Option<Growth>)> {
    let (source, mut warnings) = TreeSource::open(text, asked, seed)?;
    let growth = source.growth();
    let tree = match source {
        TreeSource::Reference(tree) => *tree,
        TreeSource::Model { name, parts, .. } => {
            let tree = ReferenceTree::new(name, parts, asked)?;
            warnings.extend(tree.warnings.iter().cloned());
            tree
        }
    };
    subject::warn(text, &warnings);
    Ok((tree, growth))
}
