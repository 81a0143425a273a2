//! Lluch, Camahort & Vivó 2003 and 2004: branches by importance, and leaves in pictures on boxes.

use glam::Vec3;

use crate::compare::{TRUTH, View};
use crate::gpu::layout::Instance;
use crate::model::reference::Asked;
use crate::plant::presets::preset;
use crate::render::{Background, Camera, FOV_Y_RAD, Shot, Stand, Tree};
use crate::repr::{BuiltTree, REFERENCE_FOCAL_PX, Settings, TreeSource, multichain};
use crate::{Error, Result};

use super::she::framed;
use super::{Bench, Chart, Curve, Exhibit, Ours, Printed, Table, grouped, in_rows, times};

const PAPER_2003: &str = "Lluch et al. 2003, Procedural multiresolution for plant and tree rendering";
const PAPER_2004: &str = "Lluch et al. 2004, An image-based multiresolution model for interactive foliage rendering (WSCG)";

/// Lluch04, figure 7.
pub(super) const FIG_7: Exhibit = Exhibit {
    id: "lluch04-fig-7",
    paper: PAPER_2004,
    figure: "Figure 7",
    title: "Leaves as geometry and in three arrangements of pictures",
    theirs: Printed {
        words: "“There are barely any visual differences between the first and the last image.” 4 to 6 MB of pictures for a tree.",
        head: &["panel", "leaves are", "polygons"],
        rows: &[
            &["a", "geometry", "20,000"],
            &["b", "axis-aligned pictures", "20"],
            &["c", "volumetric pictures", "200"],
            &["d", "diagonal pictures", "50"],
        ],
    },
    ours: fig_7,
    differs: "A box of ours is divided before its texels become larger than pixels, however many boxes that takes; theirs are some twenty for a \
              whole tree. And where they saw “barely any visual differences” there are numbers here.",
};

fn fig_7(bench: &mut Bench) -> Result<Ours> {
    let mut ours = Ours { columns: 4, ..Ours::default() };
    let mut table = Table::new(
        "At the distance of one level: finest boxes",
        ["panel", "leaves are", "polygons of leaves", "pictures with mips, MB", "FLIP", "1 − IoU"],
    );
    let view = View { azimuth_deg: 20.0, elevation_deg: 5.0 };
    let (built, tree) = bench.uploaded(TRUTH)?;
    let leaves: usize =
        bench.source().parts(crate::repr::Scope::Foliage).iter().map(|part| part.surface.mesh.polygon_count()).sum();
    let truth = bench.look(&tree, view, 320.0, None)?;
    let geometry_mb = megabytes(&built);
    table.row(["a".into(), "geometry".into(), leaves.to_string(), geometry_mb, "0".into(), "0".into()]);
    ours.panels.push(framed(
        bench,
        &truth,
        &truth,
        "lluch7-a",
        format!("a · geometry, {} polygons", grouped(&leaves.to_string())),
    )?);
    let mut tried = vec![];
    for (panel, arrangement, words) in [("b", "axes", "axis-aligned"), ("c", "volume", "volumetric"), ("d", "diagonal", "diagonal")]
    {
        let built = bench.built("box-hierarchy", &Settings::default().with("arrangement", arrangement))?;
        let finest = built.levels.iter().find(|level| level.name != "leaves").map_or(10.0, |level| level.distance);
        let polygons = box_polygons(&built, finest);
        let tree = bench.renderer.upload_built(&built)?;
        let seen = bench.look(&tree, view, 320.0, Some(finest))?;
        let f = bench.figures(&truth, &seen)?;
        tried.push((words, polygons, f.flip));
        let numbers = [f.flip, f.silhouette].map(|value| format!("{value:.3}"));
        let [flip, silhouette] = numbers;
        table.row([panel.into(), format!("{words} pictures"), polygons.to_string(), megabytes(&built), flip, silhouette]);
        let caption = format!("{panel} · {words} pictures, {polygons} polygons");
        ours.panels.push(framed(bench, &truth, &seen, &format!("lluch7-{panel}"), caption)?);
    }
    let most = tried.iter().max_by_key(|(_, polygons, _)| *polygons);
    let least = tried.iter().min_by(|a, b| a.2.total_cmp(&b.2));
    ours.found = most.zip(least).map_or_else(String::new, |((most, polygons, _), (least, _, flip))| {
        format!("Here the {most} pictures have the most polygons ({polygons}), in the paper the volumetric; the {least} ones are nearest to the tree (FLIP {flip:.3}).")
    });
    ours.tables.push(table);
    Ok(ours)
}

fn megabytes(built: &BuiltTree) -> String {
    format!("{:.2}", crate::repr::Stats::of_all(built).texture_bytes as f64 / 1e6)
}

/// Polygons with pictures of boxes that are drawn at a distance: only they have normals in a picture.
pub fn box_polygons(built: &BuiltTree, distance: f32) -> usize {
    let cards = built.parts_at(distance).filter(|part| part.part.material.normal_texture.is_some());
    cards.map(|part| part.part.surface.mesh.polygon_count()).sum()
}

/// Lluch04, figure 10.
pub(super) const FIG_10: Exhibit = Exhibit {
    id: "lluch04-fig-10",
    paper: PAPER_2004,
    figure: "Figure 10",
    title: "Frame rate against the number of trees",
    theirs: Printed::words(
        "Two curves: geometry falls at once, boxes of pictures slowly; “our approach can render scenes with a couple of hundred trees at \
         interactive rates” (Pentium III, GeForce 2 MX).",
    ),
    ours: fig_10,
    differs: "Trees stand so far away that boxes stand for branches; from nearer leaves are drawn as they are and nothing is saved. \
              Counts stop where a frame takes longer than a second and a half; on a software driver that comes early.",
};

/// How far the nearest tree stands at least, in heights.
const NEAREST_HEIGHTS: f32 = 24.0;
/// Most milliseconds of a frame before more trees are tried.
const LONGEST_MS: f64 = 1_500.0;
const COUNTS: [usize; 6] = [1, 5, 20, 50, 100, 200];

fn fig_10(bench: &mut Bench) -> Result<Ours> {
    let mut table = Table::new("800 × 600 pixels, reshaped, frames a second", ["trees", "geometry", "boxes"]);
    let mut curves = vec![];
    for (method, name) in [(TRUTH, "geometry"), ("box-hierarchy", "boxes of pictures")] {
        let (_, tree) = bench.uploaded(method)?;
        let mut points = vec![];
        for count in COUNTS {
            let instances = in_rows(1.1 * bench.stage.height_m(), count);
            let ms = bench.frame_ms(&grove(bench, &tree, &instances), &[Stand { tree: &tree, instances: &instances }])?;
            points.push([count as f64, 1e3 / ms]);
            if ms > LONGEST_MS {
                break;
            }
        }
        curves.push(Curve { name: name.to_owned(), points });
    }
    for (row, count) in COUNTS.iter().enumerate() {
        let cell = |curve: &Curve| curve.points.get(row).map_or("—".to_owned(), |[_, rate]| format!("{rate:.2}"));
        table.row([count.to_string(), cell(&curves[0]), cell(&curves[1])]);
    }
    let both = curves[0].points.iter().zip(&curves[1].points).next_back();
    let found = both.map_or_else(String::new, |([trees, geometry], [_, boxes])| {
        format!("At {trees} trees, the most that both drew, boxes give {} times the frames of geometry.", times(*boxes, *geometry))
    });
    let axes = ["trees".to_owned(), "frames/s".to_owned()];
    let chart = Chart { title: "Frames a second against the number of trees".to_owned(), axes, curves };
    Ok(Ours { tables: vec![table], charts: vec![chart], found, ..Ours::default() })
}

/// All of them, from slightly above.
fn grove(bench: &Bench, tree: &Tree, instances: &[Instance]) -> Shot {
    let height_m = bench.stage.height_m();
    let half_m = instances.iter().map(|i| i.position[0]).fold(0.0, f32::max) + 0.6 * height_m;
    let deep_m = instances.iter().map(|i| i.position[2]).fold(0.0, f32::max);
    let across = (0.5 * FOV_Y_RAD).tan() * 800.0 / 600.0;
    let distance_m = (half_m / across).max(NEAREST_HEIGHTS * height_m) + deep_m;
    let middle = tree.bounds().map_or(Vec3::ZERO, |bounds| bounds.center());
    let camera = Camera::orbit(Vec3::new(0.0, middle.y, 0.0), 0.0, 0.3, distance_m);
    Shot { stage: crate::render::Stage::Reshaped, background: Background::Black, ..Shot::new(camera, [800, 600]) }
}

/// Lluch03, table 1.
pub(super) const TABLE_1: Exhibit = Exhibit {
    id: "lluch03-table-1",
    paper: PAPER_2003,
    figure: "Table 1",
    title: "Branches and polygons of four levels of a multichain",
    theirs: Printed {
        words: "Wood alone.",
        head: &["level", "generic tree: branches", "polygons", "acacia: branches", "polygons"],
        rows: &[
            &["coarsest", "27", "172", "57", "255"],
            &["medium", "233", "872", "414", "1430"],
            &["high", "638", "2103", "805", "2605"],
            &["finest", "1023", "3252", "2048", "6334"],
        ],
    },
    ours: table_1,
    differs: "Levels are cut at the shares of branches that the paper's are. Our branches are round and bend.",
};

fn table_1(bench: &mut Bench) -> Result<Ours> {
    let seed = bench.request.seed;
    let acacia = preset("acacia").ok_or(Error::Internal { stage: "compare::papers", what: "there is no acacia".to_owned() })?;
    let (acacia, _) = TreeSource::grown(acacia, None, &Asked::default(), seed)?;
    let rows = |source: &TreeSource| match (source, source.skeleton()) {
        (TreeSource::Reference(tree), Some(skeleton)) => multichain::table(tree, skeleton, seed),
        _ => Err(Error::NotApplicable {
            method: "multichain",
            source_name: source.name().to_owned(),
            why: "only a grown tree has the bones that its levels are made of".to_owned(),
        }),
    };
    let name = bench.source().name();
    let head = ["level", "branches", "polygons", "acacia: branches", "polygons"];
    let mut table = Table::new(&format!("{name}, and our acacia"), head);
    table.head[1] = format!("{name}: branches");
    let (own, acacia) = (rows(bench.source())?, rows(&acacia)?);
    for (level, ((branches, polygons), acacia)) in ["coarsest", "medium", "high", "finest"].iter().zip(own.iter().zip(&acacia)) {
        let numbers = [*branches, *polygons, acacia.0, acacia.1].map(|n| n.to_string());
        let [a, b, c, d] = numbers;
        table.row([(*level).to_owned(), a, b, c, d]);
    }
    let found = own.last().map_or_else(String::new, |(branches, polygons)| {
        format!(
            "A branch of {name} has {} polygons at the finest level, one of their generic tree 3.18.",
            times(*polygons as f64, *branches as f64)
        )
    });
    Ok(Ours { tables: vec![table], found, ..Ours::default() })
}

/// Lluch03, figures 5 and 7.
pub(super) const FIG_5_7: Exhibit = Exhibit {
    id: "lluch03-fig-5",
    paper: PAPER_2003,
    figure: "Figures 4 to 7",
    title: "Levels of a multichain, near and at the distance where each is drawn",
    theirs: Printed::words(
        "“Note that the visual structure of the trees is preserved by all four LODs.” The lower row has leaves.",
    ),
    ours: fig_5_7,
    differs: "Each level stands beside the whole tree at the same distance. Leaves go with the branches that bear them (the paper adds none of \
              them to its multichain), so that far crowns can be thinner than theirs.",
};

fn fig_5_7(bench: &mut Bench) -> Result<Ours> {
    let mut ours = Ours { columns: 4, ..Ours::default() };
    let mut table = Table::new(
        "Each level held against the whole tree",
        ["level", "drawn from, heights", "looked at, pixels high", "polygons", "FLIP", "1 − IoU"],
    );
    let (mut far, mut flips) = (vec![], vec![]);
    let (_, whole) = bench.uploaded(TRUTH)?;
    let (built, chain) = bench.uploaded("multichain")?;
    let view = View { azimuth_deg: 20.0, elevation_deg: 5.0 };
    for (number, level) in built.levels.iter().enumerate() {
        // Nearer than 2.5 heights a tree does not fit its picture, farther than 60 it is a speck: then it is looked at from there, and that is
        // said.
        let distance = level.distance.clamp(2.5, 60.0);
        let height_px = REFERENCE_FOCAL_PX / distance;
        let truth = bench.look(&whole, view, height_px, None)?;
        let seen = bench.look(&chain, view, height_px, Some(level.distance))?;
        let f = bench.figures(&truth, &seen)?;
        flips.push(f.flip);
        let polygons = crate::repr::Stats::at(&built, level.distance).polygons;
        table.row([
            level.name.clone(),
            format!("{:.1}", level.distance),
            format!("{height_px:.0}"),
            polygons.to_string(),
            format!("{:.3}", f.flip),
            format!("{:.3}", f.silhouette),
        ]);
        let near = bench.look(&chain, view, 320.0, Some(level.distance))?;
        let whole_near = bench.look(&whole, view, 320.0, None)?;
        ours.panels.push(framed(bench, &whole_near, &near, &format!("lluch4-{number}"), format!("{}, near", level.name))?);
        let nearer = if distance < level.distance { ", nearer than it is drawn" } else { "" };
        let caption = format!("{height_px:.0} px high{nearer}, {} polygons", grouped(&polygons.to_string()));
        far.push(framed(bench, &truth, &seen, &format!("lluch5-{number}"), caption)?);
    }
    ours.panels.extend(far);
    let most = flips.iter().fold(0.0, |most: f64, flip| most.max(*flip));
    ours.found = format!("Where each of {} levels is drawn its FLIP is at most {most:.3}.", flips.len());
    ours.tables.push(table);
    Ok(ours)
}
