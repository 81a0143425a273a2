//! Truelsen & Bønding 2008: what bones cost, what slices cost at distances and sizes, and how they look beside the tree.

use crate::Result;
use crate::compare::{TRUTH, View};
use crate::gpu::layout::Instance;
use crate::model::grown::{Clothing, GrownTree};
use crate::plant::mesh::{BarkKind, LeafKind, LeafParams, WoodParams};
use crate::plant::{DeriveParams, Grammar, draw};
use crate::render::{Background, Shot, Stand};
use crate::repr::grid_slices::tables;
use crate::repr::{Job, REFERENCE_FOCAL_PX, Scope, Settings};

use super::she::framed;
use super::{Bench, Exhibit, Ours, Printed, Table, one_tree, times};

const PAPER: &str =
    "Truelsen & Bønding 2008, Visualizing procedurally generated trees in real time using multiple levels of detail (Copenhagen)";
/// A window of their time.
const WINDOW_PX: [u32; 2] = [800, 600];
/// Their own L-system, from appendix C.
const FRACTAL_PLANT: &str = include_str!("../../../tests/plant/truelsen/fractal_plant.xml");

/// Table 1.
pub(super) const TABLE_1: Exhibit = Exhibit {
    id: "truelsen-table-1",
    paper: PAPER,
    figure: "Table 1",
    title: "Geometry at ages: bones and frame rate",
    theirs: Printed {
        words: "The thesis does not say of which L-system; each year has about three times as many bones.",
        head: &["age", "bones", "frames/s"],
        rows: &[
            &["0", "2", "275"],
            &["1", "5", "260"],
            &["2", "17", "220"],
            &["3", "53", "78"],
            &["4", "161", "27"],
            &["5", "486", "9"],
            &["6", "1460", "3"],
        ],
    },
    ours: table_1,
    differs: "Their time grows with every bone, since each was a call of its own (“a brute-force rendering procedure”); ours draws all bones \
              in one call. The L-system is the Fractal Plant of their appendix C, which branches faster than the one of their table.",
};

fn table_1(bench: &mut Bench) -> Result<Ours> {
    let mut table =
        Table::new("Fractal Plant, 800 × 600 pixels, a frame waited for", ["age", "bones", "triangles", "ms", "frames/s"]);
    let grammar = Grammar::parse_xml(FRACTAL_PLANT)?;
    let seed = bench.request.seed;
    let clothing = Clothing::painted(BarkKind::Furrowed, LeafKind::Oval, seed);
    let mut ages = vec![];
    for age in 0..=5 {
        let age = f64::from(age);
        let chain = grammar.derive(age, &DeriveParams::default(), seed, &mut |_| {})?;
        let skeleton = draw(&chain, &grammar, grammar.turtle(), seed, age)?;
        let grown = GrownTree::new(&skeleton, &clothing, &WoodParams::default(), &LeafParams::default(), seed)?;
        let tree = bench.renderer.upload(&grown.parts)?;
        let shot = Shot { background: Background::Black, ..one_tree(&tree, WINDOW_PX) };
        let ms = bench.frame_ms(&shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }])?;
        let cells = [format!("{age}"), skeleton.bones.len().to_string(), tree.triangles().to_string()];
        let [age, bones, triangles] = cells;
        table.row([age, bones, triangles, format!("{ms:.1}"), format!("{:.0}", 1e3 / ms)]);
        ages.push([skeleton.bones.len() as f64, ms]);
    }
    let [more, longer] = [0, 1].map(|i| times(ages[ages.len() - 1][i], ages[0][i]));
    let found = format!(
        "From age 0 to 5 there are {more} times as many bones, and a frame takes {longer} times as long; theirs 243 and 31."
    );
    Ok(Ours { tables: vec![table], found, ..Ours::default() })
}

/// Table 2.
pub(super) const TABLE_2: Exhibit = Exhibit {
    id: "truelsen-table-2",
    paper: PAPER,
    figure: "Table 2",
    title: "Geometry and impostor at distances",
    theirs: Printed {
        words: "",
        head: &["distance", "geometry (161 bones)", "impostor (14 billboards)"],
        rows: &[
            &["3.9", "28 frames/s", "54 frames/s"],
            &["5.6", "28 frames/s", "84 frames/s"],
            &["19.0", "28 frames/s", "185 frames/s"],
        ],
    },
    ours: table_2,
    differs: "What takes slices their time is looking up their pictures, for every pixel that they cover. Distances are theirs, in heights of \
              the tree by their own units; the tree is not their bare one.",
};

fn table_2(bench: &mut Bench) -> Result<Ours> {
    let mut table = Table::new(
        "Milliseconds of the passes that draw trees, one tree",
        ["distance", "in heights", "geometry, ms", "slices, ms", "polygons", "look-ups, pixels"],
    );
    let (_, truth) = bench.uploaded(TRUTH)?;
    let (built, slices) = bench.uploaded("grid-slices")?;
    let mut taken = vec![];
    for row in tables::against_distance(&built, &tables::TABLE_2_UNITS) {
        let view = View { azimuth_deg: 10.0, elevation_deg: 5.0 };
        let height_px = REFERENCE_FOCAL_PX / row.distance;
        let [geometry, impostor] = [&truth, &slices].map(|tree| bench.tree_ms(tree, view, height_px));
        let (geometry, impostor) = (geometry?, impostor?);
        table.row([
            format!("{}", row.units),
            format!("{:.1}", row.distance),
            format!("{geometry:.2}"),
            format!("{impostor:.2}"),
            row.stats.polygons.to_string(),
            format!("{:.0}", row.lookups),
        ]);
        taken.push([impostor, geometry]);
    }
    let found = taken.first().zip(taken.last()).map_or_else(String::new, |(near, far)| {
        let [slices, tree] = [0, 1].map(|i| times(far[i], near[i]));
        format!(
            "From the nearest to the farthest the slices' time comes to {slices} times what it was, the geometry's to {tree} times."
        )
    });
    Ok(Ours { tables: vec![table], found, ..Ours::default() })
}

/// Table 4.
pub(super) const TABLE_4: Exhibit = Exhibit {
    id: "truelsen-table-4",
    paper: PAPER,
    figure: "Table 4",
    title: "Slices against the size of their pictures",
    theirs: Printed {
        words: "Static: one tree that covers most of the window. Dynamic: 3,000 trees, the camera moving.",
        head: &["side, texels", "static, frames/s", "dynamic, frames/s"],
        rows: &[
            &["1024", "46.8", "13.1"],
            &["512", "56.2", "13.6"],
            &["256", "56.9", "16.2"],
            &["128", "57.2", "19.8"],
            &["64", "62.1", "22.7"],
        ],
    },
    ours: table_4,
    differs: "What the size decides is memory, four times as much with each step, and how near one may go.",
};

fn table_4(bench: &mut Bench) -> Result<Ours> {
    let mut table = Table::new("", ["side, texels", "static, ms", "frames/s", "pictures", "MB with mips"]);
    let request = bench.request;
    let settings = Settings::default();
    let job = Job { source: request.source, scope: Scope::Tree, settings: &settings, seed: request.seed, capture: request.capture };
    let mut taken = vec![];
    for (side, stats) in tables::against_size(&job, &tables::TABLE_4_PX)? {
        let built = bench.built("grid-slices", &Settings::default().with("size_px", side))?;
        let tree = bench.renderer.upload_built(&built)?;
        let shot = Shot { background: Background::Black, ..one_tree(&tree, WINDOW_PX) };
        let ms = bench.frame_ms(&shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }])?;
        let mb = stats.texture_bytes as f64 / 1e6;
        table.row([
            side.to_string(),
            format!("{ms:.1}"),
            format!("{:.1}", 1e3 / ms),
            stats.textures.to_string(),
            format!("{mb:.2}"),
        ]);
        taken.push((side, ms));
    }
    let found = taken.first().zip(taken.last()).map_or_else(String::new, |((large, slow), (small, quick))| {
        format!("From {large} to {small} texels there are {} times as many frames; theirs 1.33 times.", times(*slow, *quick))
    });
    Ok(Ours { tables: vec![table], found, ..Ours::default() })
}

/// Figures 25 and 26.
pub(super) const FIG_25_26: Exhibit = Exhibit {
    id: "truelsen-fig-25",
    paper: PAPER,
    figure: "Figures 25 and 26",
    title: "The impostor beside the tree, along its axis and across",
    theirs: Printed::words(
        "Pictures of 7 + 7 slices. Along the axis (25) “the error is less”; at an angle (26) “there is a branch that is cut short, and the \
         foliage is more dense because of our increased clip depth of the base textures”.",
    ),
    ours: fig_25_26,
    differs: "Across the grid a viewer sees between its slices. Ours shade by their own normals, theirs by the light in which their pictures \
              were taken.",
};

fn fig_25_26(bench: &mut Bench) -> Result<Ours> {
    let mut ours = Ours { columns: 2, ..Ours::default() };
    let mut table = Table::new("Slices held against the tree", ["view", "FLIP", "1 − SSIM", "1 − IoU", "Δ area"]);
    let (_, truth) = bench.uploaded(TRUTH)?;
    let (_, slices) = bench.uploaded("grid-slices")?;
    let mut flips = vec![];
    for (azimuth_deg, words, file) in [(0.0, "along the grid (fig. 25)", "axis"), (45.0, "across it (fig. 26)", "across")] {
        let view = View { azimuth_deg, elevation_deg: 5.0 };
        let [tree, impostor] = [&truth, &slices].map(|tree| bench.look(tree, view, 400.0, None));
        let (tree, impostor) = (tree?, impostor?);
        let f = bench.figures(&tree, &impostor)?;
        flips.push(f.flip);
        let numbers = [f.flip, f.dissimilarity, f.silhouette].map(|value| format!("{value:.3}"));
        let [flip, dissimilarity, silhouette] = numbers;
        table.row([words.to_owned(), flip, dissimilarity, silhouette, format!("{:+.1} %", 100.0 * f.area)]);
        ours.panels.push(framed(bench, &tree, &tree, &format!("truelsen25-{file}-tree"), format!("the tree, {words}"))?);
        ours.panels.push(framed(bench, &tree, &impostor, &format!("truelsen25-{file}-slices"), format!("slices, {words}"))?);
    }
    ours.found = format!("FLIP across the grid is {} times that along it.", times(flips[1], flips[0]));
    ours.tables.push(table);
    Ok(ours)
}
