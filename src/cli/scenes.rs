//! What `sphereboard grove --help` says of scenes: the presets, and everything that a scene file may hold, from the tables that read it.

use crate::grove::SceneFile;
use crate::grove::path::CameraParams;
use crate::grove::placement::PlantingParams;
use crate::grove::scene::{PRESETS, SpeciesEntry, StageParams};
use crate::grove::terrain::TerrainParams;
use crate::grove::trail::FollowParams;
use crate::params::{ParamSet, ParamSpec};
use crate::render::CullParams;

/// A scene file with a little of everything.
const EXAMPLE: &str = include_str!("../../examples/scenes/park.toml");

/// What the short help closes with.
pub fn short_help() -> String {
    examples() + "\n`--help` also says what a scene file holds."
}

fn examples() -> String {
    format!(
        "Examples:\n  sphereboard grove --out grove\n  sphereboard grove --preset truelsen-10k --trees 2000 --frames 60 --out slices\n  \
         sphereboard grove park.toml --method billboard --video --out park\n\
         {WRITES}"
    )
}

const WRITES: &str =
    "DIR gets report.html to look at, frames.csv (a line for each frame), summary.json, plots/*.svg and frames/*.png.";

/// What the long help closes with.
pub fn help() -> String {
    let mut text = examples();
    text += "\n\nA frame is timed until the device has finished it; nothing is read back and nothing waits for a screen. Pictures are taken \
             afterwards.\nA drive that the device does not survive keeps the frames so far in frames.csv, one that is killed in frames.csv.part.\n";
    text += "\nPresets (--preset):\n";
    for preset in PRESETS {
        let title = SceneFile::parse(preset.text).map_or_else(|_| String::new(), |scene| scene.title);
        text += &entry(preset.name, &format!("{title} ({})", preset.source));
    }
    text += "\nA scene file is TOML. Metres, seconds and degrees; +Y up, +X east, -Z north; 0, 0, 0 is the middle of the ground. Whatever is left \
             out keeps its default. Files are sought beside the scene file. At its top:\n";
    for (name, meaning) in SceneFile::FIELDS {
        text += &entry(name, meaning);
    }
    text += "\n[[species]], once for each:\n";
    for (name, meaning) in SpeciesEntry::FIELDS {
        text += &entry(name, meaning);
    }
    text += &table("terrain", TerrainParams::specs());
    text += &table("planting", PlantingParams::specs());
    text += &table("camera", CameraParams::specs());
    text += &table("stage", StageParams::specs());
    text += &table("levels", FollowParams::specs());
    text += &table("culling", CullParams::specs());
    text += "\nFor example:\n";
    EXAMPLE.lines().for_each(|line| text += &format!("{}\n", format!("  {line}").trim_end()));
    text
}

/// A name and what it means, whose lines stand under each other in a window of 80 columns.
fn entry(name: &str, meaning: &str) -> String {
    const INDENT: usize = 20;
    const COLUMNS: usize = 79;
    let mut text = format!("  {name:<width$}", width = INDENT - 2);
    let mut column = INDENT;
    for word in meaning.replace('`', "").split_whitespace() {
        let length = word.chars().count();
        if column > INDENT && column + 1 + length > COLUMNS {
            text += &format!("\n{:INDENT$}", "");
            column = INDENT;
        }
        text += &format!(" {word}");
        column += 1 + length;
    }
    text + "\n"
}

fn table(name: &str, specs: Vec<ParamSpec>) -> String {
    let line = |spec: &ParamSpec| {
        let range = spec.with_unit(&spec.kind.range());
        entry(spec.name, &format!("{} [default: {}; {range}]", spec.meaning, spec.default))
    };
    format!("\n[{name}]\n{}", specs.iter().map(line).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_is_a_scene() {
        assert_eq!(SceneFile::parse(EXAMPLE).unwrap().species.len(), 2);
    }

    #[test]
    fn the_help_names_every_field_of_a_scene() {
        let text = help();
        let names = SceneFile::FIELDS.iter().chain(SpeciesEntry::FIELDS).map(|field| field.0);
        let parts = [TerrainParams::specs(), PlantingParams::specs(), CameraParams::specs(), StageParams::specs()];
        let specs = [parts.concat(), FollowParams::specs(), CullParams::specs()].concat();
        for name in names.chain(specs.iter().map(|spec| spec.name)).chain(PRESETS.map(|preset| preset.name)) {
            assert!(text.contains(&format!("\n  {name} ")), "{name}");
        }
    }
}
