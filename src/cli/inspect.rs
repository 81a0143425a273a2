//! `sphereboard inspect`: what is in a model file, as the other commands will see it.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use serde_json::{Value, json};

use crate::Result;
use crate::geom::Bounds;
use crate::model::reference::{ReferenceTree, Role};
use crate::model::{Part, Wrap};
use crate::page::grouped;

use super::batch::text_of;
use super::{Outcome, say, subject};

/// The command's arguments.
pub fn command() -> Command {
    let command = Command::new("inspect")
        .about("Say what is in model files (GLB, glTF, OBJ): surfaces, materials, leaves, size, and what looks wrong")
        .after_help(
            "Leaves and wood are told apart by material alpha; where nothing is cut out, by many small flat pieces; then by name.\n\
             A leaf quad is a pair of triangles or a quad; quads that cross in one place are one leaf.\n\
             Exit code 1 when a file could not be read.",
        )
        .arg(
            Arg::new("files")
                .value_name("FILE")
                .required(true)
                .num_args(1..)
                .value_parser(value_parser!(PathBuf))
                .help("Models of trees: .glb, .gltf, .obj; material libraries and textures are looked for beside them"),
        )
        .arg(Arg::new("json").long("json").action(ArgAction::SetTrue).help("Print everything as JSON instead"));
    subject::add_materials(command)
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let asked = subject::asked(matches);
    let files: Vec<&PathBuf> = matches.get_many("files").unwrap_or_default().collect();
    let mut reports = Vec::new();
    let (mut failed, mut said) = (0, true);
    for path in &files {
        let tree = ReferenceTree::open(path, &asked);
        failed += usize::from(tree.is_err());
        if matches.get_flag("json") {
            reports.push(report(path, &tree));
            continue;
        }
        match tree {
            Ok(tree) => said &= say::out(&table(path, &tree)),
            Err(error) => say::err(&format!("sphereboard: {error}")),
        }
    }
    if matches.get_flag("json") {
        let whole = json!({"sphereboard": env!("CARGO_PKG_VERSION"), "failed": failed, "files": reports});
        said &= say::out(&format!("{whole:#}"));
    }
    Ok(if failed == 0 && said { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Everything, for programs.
fn report(path: &Path, tree: &Result<ReferenceTree>) -> Value {
    let tree = match tree {
        Ok(tree) => tree,
        Err(error) => return json!({"file": text_of(path), "ok": false, "error": error.to_string()}),
    };
    let parts: Vec<Value> = tree.parts().zip(roles(tree)).map(|(part, role)| part_report(part, role)).collect();
    json!({
        "file": text_of(path),
        "ok": true,
        "name": tree.name,
        "bounds_m": bounds_report(tree.bounds),
        "triangles": tree.triangle_count(),
        "leaves": tree.leaves.len(),
        "leaf_quads": tree.leaf_quads(),
        "parts": parts,
        "told": tree.told,
        "warnings": tree.warnings,
    })
}

fn part_report(part: &Part, role: Role) -> Value {
    let (mesh, material) = (&part.surface.mesh, &part.material);
    json!({
        "name": part.name,
        "role": role,
        "vertices": mesh.positions.len(),
        "triangles": mesh.triangles.len(),
        "quads": mesh.quads.len(),
        "bounds_m": mesh.bounds().map(bounds_report),
        "vertex_colors": !part.surface.colors.is_empty(),
        "material": {
            "name": material.name,
            "factor": material.factor,
            "texture_px": material.texture.as_ref().map(|t| [t.width(), t.height()]),
            "wrap": if material.wrap == Wrap::Clamp { "clamp" } else { "repeat" },
            "alpha_cutoff": material.alpha_cutoff,
            "two_sided": material.two_sided,
        },
    })
}

fn bounds_report(bounds: Bounds) -> Value {
    json!({"min": bounds.min.to_array(), "max": bounds.max.to_array()})
}

/// The roles of [`ReferenceTree::parts`].
fn roles(tree: &ReferenceTree) -> impl Iterator<Item = Role> {
    let wood = std::iter::repeat_n(Role::Wood, tree.wood.len());
    wood.chain(std::iter::repeat_n(Role::Foliage, tree.foliage.len()))
}

/// The same for people.
fn table(path: &Path, tree: &ReferenceTree) -> String {
    let size = tree.bounds.size();
    let mut lines = vec![
        text_of(path),
        format!(
            "  size       {:.2} m high, {:.2} m wide, {:.2} m deep; from y = {:.2} m",
            size.y, size.x, size.z, tree.bounds.min.y
        ),
        format!("  triangles  {}", grouped(tree.triangle_count())),
        format!("  leaves     {}, of {} leaf quads", grouped(tree.leaves.len()), grouped(tree.leaf_quads())),
        format!(
            "  {:<8} {:<24} {:<24} {:>10} {:>10} {:>10}  {}",
            "role", "part", "material", "triangles", "quads", "vertices", "looks"
        ),
    ];
    for (part, role) in tree.parts().zip(roles(tree)) {
        let mesh = &part.surface.mesh;
        lines.push(format!(
            "  {:<8} {:<24} {:<24} {:>10} {:>10} {:>10}  {}",
            word(role),
            cut(&part.name),
            cut(&part.material.name),
            grouped(mesh.triangles.len()),
            grouped(mesh.quads.len()),
            grouped(mesh.positions.len()),
            looks(part)
        ));
    }
    for told in &tree.told {
        let by = serde_json::to_value(told.by).ok().and_then(|by| by.as_str().map(str::to_owned)).unwrap_or_default();
        lines.push(format!("  {} is {}, told by: {by}", told.part, word(told.role)));
    }
    lines.extend(tree.warnings.iter().map(|warning| format!("  warning: {}", warning.message)));
    lines.join("\n")
}

fn word(role: Role) -> &'static str {
    match role {
        Role::Wood => "wood",
        Role::Foliage => "foliage",
    }
}

fn looks(part: &Part) -> String {
    let material = &part.material;
    let texture = material.texture.as_ref().map_or("no texture".to_owned(), |t| format!("texture {}×{} px", t.width(), t.height()));
    let cut = material.alpha_cutoff.map_or(String::new(), |cutoff| format!(", cut out at {cutoff}"));
    let sides = if material.two_sided { ", two-sided" } else { "" };
    let colors = if part.surface.colors.is_empty() { "" } else { ", vertex colours" };
    format!("{texture}{cut}{sides}{colors}")
}

/// A name that fits its column.
fn cut(name: &str) -> String {
    if name.chars().count() <= 24 { name.to_owned() } else { name.chars().take(23).chain(['…']).collect() }
}
