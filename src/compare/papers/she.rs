//! She et al. 2018: what a sphere-board costs, of what it consists, and how it looks from above.

use image::imageops;

use crate::Result;
use crate::compare::staging::{cropped, window};
use crate::compare::{Seen, TRUTH, View};
use crate::gpu::layout::Instance;
use crate::model::Part;
use crate::page::grouped;
use crate::params::ParamValue as _;
use crate::render::{Background, Shot, Stage, Stand};
use crate::repr::{BuiltTree, Settings};

use super::{Bench, Exhibit, Ours, Panel, Printed, Table, one_tree, times};

const PAPER: &str = "She et al. 2018, “Sphere-board” trees (ISPRS Int. J. Geo-Inf. 7(2), 45)";
/// The paper's screen.
const SCREEN_PX: [u32; 2] = [1440, 810];
/// What it compares, in our words.
const STAND_INS: [(&str, &str); 4] =
    [("billboard", "billboard"), ("crossed-planes", "crossed planes"), ("sphere-board", "sphere-board"), (TRUTH, "geometry")];

/// Figure 16.
pub(super) const FIG_16: Exhibit = Exhibit {
    id: "she-fig-16",
    paper: PAPER,
    figure: "Figure 16",
    title: "A frame of one tree, stage by stage",
    theirs: Printed::words(
        "Curves of frame rates at 1440 × 810 pixels. §4: “the frame rate for the SBTM, even with lighted effects, still remains at an \
         acceptable level of between 45 and 48”, that is 21 to 22 ms; more than billboards (BBTM) and crossed planes (CPTM) take.",
    ),
    ours: fig_16,
    differs: "Where the device is a processor that draws in software, smoothing and light weigh more than on their graphics card, since \
              every pixel of the screen passes through them.",
};

fn fig_16(bench: &mut Bench) -> Result<Ours> {
    let stages = [Stage::Unshaped, Stage::Reshaped, Stage::Antialiased, Stage::Lit];
    let mut table =
        Table::new("Milliseconds of a whole frame, median", ["stage", "billboard", "crossed planes", "sphere-board", "geometry"]);
    let mut columns = vec![];
    for (method, _) in STAND_INS {
        let (_, tree) = bench.uploaded(method)?;
        let stands = [Stand { tree: &tree, instances: &[Instance::IDENTITY] }];
        let times = stages.map(|stage| {
            let shot = Shot { stage, background: Background::Black, ..one_tree(&tree, SCREEN_PX) };
            bench.frame_ms(&shot, &stands)
        });
        columns.push(times.into_iter().collect::<Result<Vec<f64>>>()?);
    }
    for (row, stage) in stages.iter().enumerate() {
        let ms = |column: usize| format!("{:.1}", columns[column][row]);
        table.row([stage.show(), ms(0), ms(1), ms(2), ms(3)]);
    }
    let lit = |column: usize| columns[column][stages.len() - 1];
    let [billboard, planes, tree] = [0, 1, 3].map(|column| times(lit(2), lit(column)));
    let found = format!(
        "Lit, the sphere-board takes {:.1} ms: {billboard} times what the billboard does, {planes} times the crossed planes, {tree} times the \
         geometry.",
        lit(2)
    );
    Ok(Ours { tables: vec![table], found, ..Ours::default() })
}

/// Table 1.
pub(super) const TABLE_1: Exhibit = Exhibit {
    id: "she-table-1",
    paper: PAPER,
    figure: "Table 1",
    title: "Primitives of the models",
    theirs: Printed {
        words: "",
        head: &["model", "primitive", "crown", "trunk"],
        rows: &[
            &["sphere-board", "triangles", "56", "16"],
            &["sphere-board", "quadrilaterals", "2124", "24"],
            &["graphics-based", "triangles", "19657", "200"],
        ],
    },
    ours: table_1,
    differs: "Triangles come where our surface follows the lobes of the crown, and from the rings of its wood.",
};

fn table_1(bench: &mut Bench) -> Result<Ours> {
    let mut table = Table::new("", ["model", "primitive", "crown", "trunk"]);
    let nearest = |built: &BuiltTree| built.levels.first().map_or(0.0, |level| level.distance);
    let crown_of_boards = |part: &Part| part.crown_center.is_some();
    let boards = bench.built("sphere-board", &Settings::default())?;
    let source = bench.source();
    let leaves: Vec<String> = source.parts(crate::repr::Scope::Foliage).iter().map(|part| part.name.clone()).collect();
    let tree = bench.built(TRUTH, &Settings::default())?;
    let mut count = |built: &BuiltTree, name: &str, is_crown: &dyn Fn(&Part) -> bool| -> [usize; 2] {
        let parts: Vec<&Part> = built.parts_at(nearest(built)).map(|built| &built.part).collect();
        let sum = |crown: bool, count: fn(&Part) -> usize| -> usize {
            parts.iter().filter(|part| is_crown(part) == crown).map(|part| count(part)).sum()
        };
        let of = |crown, count| sum(crown, count).to_string();
        let triangles = |part: &Part| part.surface.mesh.triangles.len();
        let quads = |part: &Part| part.surface.mesh.quads.len();
        table.row([name.to_owned(), "triangles".to_owned(), of(true, triangles), of(false, triangles)]);
        table.row([name.to_owned(), "quadrilaterals".to_owned(), of(true, quads), of(false, quads)]);
        [true, false].map(|crown| sum(crown, triangles) + sum(crown, quads))
    };
    let [crown, _] = count(&boards, "sphere-board", &crown_of_boards);
    let [foliage, wood] = count(&tree, "geometry", &|part| leaves.contains(&part.name));
    let found = format!(
        "The sphere-board's crown has {} primitives where theirs has 2,180; the tree itself {} in its crown and {} in its wood where \
         theirs has 19,657 and 200.",
        grouped(crown),
        grouped(foliage),
        grouped(wood)
    );
    Ok(Ours { tables: vec![table], found, ..Ours::default() })
}

/// Figure 17.
pub(super) const FIG_17: Exhibit = Exhibit {
    id: "she-fig-17",
    paper: PAPER,
    figure: "Figure 17",
    title: "Crossed planes and a sphere-board from three elevations",
    theirs: Printed::words(
        "Photographs of a screen with Sabina chinensis: from the side, from gently above, and from the top, where “the SBTM looks reasonable, \
         whereas the CPTM gives a considerable impression of slicing and even disappears”.",
    ),
    ours: fig_17,
    differs: "Beside them stands what the paper lacks, the tree itself, and with it a number for each picture.",
};

fn fig_17(bench: &mut Bench) -> Result<Ours> {
    let mut table = Table::new(
        "Held against the tree itself",
        ["elevation", "crossed planes: FLIP", "1 − IoU", "sphere-board: FLIP", "1 − IoU"],
    );
    let mut ours = Ours { columns: 3, ..Ours::default() };
    let subjects = [TRUTH, "crossed-planes", "sphere-board"];
    let trees = subjects.iter().map(|method| Ok(bench.uploaded(method)?.1)).collect::<Result<Vec<_>>>()?;
    for (elevation_deg, words) in [(0.0, "from the side"), (30.0, "from gently above"), (88.0, "from the top")] {
        let view = View { azimuth_deg: 25.0, elevation_deg };
        let seen = trees.iter().map(|tree| bench.look(tree, view, 320.0, None)).collect::<Result<Vec<_>>>()?;
        let [planes, boards] = [1, 2].map(|i| bench.figures(&seen[0], &seen[i]));
        let (planes, boards) = (planes?, boards?);
        let figure = |value: f64| format!("{value:.3}");
        ours.found = format!(
            "From the top {:.0} % of the crossed planes' outline and the tree's are the other's too, and {:.0} % of the sphere-board's.",
            100.0 * (1.0 - planes.silhouette),
            100.0 * (1.0 - boards.silhouette)
        );
        table.row([
            format!("{elevation_deg:.0}°"),
            figure(planes.flip),
            figure(planes.silhouette),
            figure(boards.flip),
            figure(boards.silhouette),
        ]);
        let names = ["the tree itself", "crossed planes", "sphere-board"];
        for ((seen_one, name), method) in seen.iter().zip(names).zip(subjects) {
            let file = format!("she17-{elevation_deg:.0}-{method}");
            ours.panels.push(framed(bench, &seen[0], seen_one, &file, format!("{name}, {words}"))?);
        }
    }
    ours.tables.push(table);
    Ok(ours)
}

/// A panel with what is seen, cut as the tree itself is, at least 96 pixels to a side.
pub(super) fn framed(bench: &Bench, truth: &Seen, seen: &Seen, file: &str, caption: String) -> Result<Panel> {
    let picture = cropped(seen, window(truth)).over(0);
    let least = picture.width().min(picture.height()).max(1);
    let times = 96u32.div_ceil(least).clamp(1, 12);
    let picture = match times {
        1 => picture,
        _ => imageops::resize(&picture, picture.width() * times, picture.height() * times, imageops::FilterType::Nearest),
    };
    bench.panel(file, caption, &picture)
}
