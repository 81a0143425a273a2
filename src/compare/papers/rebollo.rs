//! Rebollo et al. 2007: what foliage in levels of detail stores, and what a change of level costs.

use crate::Result;
use crate::repr::lodf::storage::{Row, TREES};
use crate::repr::lodf::{LeafForest, foliage};
use crate::repr::{Drawn, Settings};

use super::extraction::Measured;
use super::{Bench, Chart, Curve, Exhibit, Ours, Printed, Table, times};

const PAPER: &str = "Rebollo et al. 2007, A clustering framework for real-time rendering of tree foliage";

/// Tables I to V.
pub(super) const TABLES: Exhibit = Exhibit {
    id: "rebollo-tables",
    paper: PAPER,
    figure: "Tables I to V",
    title: "What foliage stores, in MB and as a ratio to the original",
    theirs: Printed {
        words: "All tables in one, by tree; ratios in brackets. Tables IV and V both give Sorbus 1.50 MB and 227 groups, which table III \
                (1.87 MB, 339 groups) and the ratios contradict.",
        head: &["tree", "leaves", "MB (I)", "VDF MB (II)", "LoDF MB (III, IV)", "groups", "with device MB (V)"],
        rows: &[
            &["Betula Populifolia", "8,140", "0.50", "0.80 (1.62)", "0.61 (1.24)", "119", ""],
            &["Betula Lenta", "20,376", "1.24", "2.01 (1.62)", "1.54 (1.24)", "285", ""],
            &["Pistacia Lentiscus", "5,594", "0.34", "", "0.42 (1.24)", "89", "0.51 (1.49)"],
            &["Spartium Junceum", "10,740", "0.66", "", "0.81 (1.24)", "155", "0.97 (1.49)"],
            &["Olea Europaea", "16,107", "0.98", "", "1.21 (1.24)", "288", "1.46 (1.49)"],
            &["C. Sempervirens", "19,951", "1.22", "", "1.50 (1.24)", "277", "1.81 (1.49)"],
            &["Quercus Suber", "20,281", "1.24", "", "1.53 (1.24)", "282", "1.84 (1.49)"],
            &["Sorbus Aucuparia", "24,840", "1.52", "2.45 (1.62)", "1.87 (1.24)", "339", "1.50 (1.49)"],
            &["J. Oxycedrus", "32,289", "1.97", "", "2.46 (1.24)", "440", "2.93 (1.49)"],
            &["Quercus Cerris", "41,155", "2.51", "", "3.10 (1.24)", "558", "3.73 (1.49)"],
            &["Taxus Baccata", "48,160", "2.94", "4.76 (1.62)", "3.63 (1.24)", "641", "4.37 (1.49)"],
        ],
    },
    ours: tables,
    differs: "That is counted as the paper counts, positions and numbers alone. The last column has everything that is really kept, beside an \
              original that has normals and texture coordinates too.",
};

fn tables(bench: &mut Bench) -> Result<Ours> {
    let head = ["tree", "leaves", "MB", "VDF MB", "LoDF MB", "groups", "with device MB", "everything, ratio"];
    let mut table = Table::new("Made-up foliage of the paper's leaf counts and groups, and the tree of this page", head);
    let mb = |bytes: usize| bytes as f64 / f64::from(1u32 << 20);
    let mut add = |row: &Row| {
        let with = |bytes: usize, ratio: f64| format!("{:.2} ({ratio:.2})", mb(bytes));
        table.row([
            row.tree.clone(),
            row.originals.to_string(),
            format!("{:.2}", mb(row.original_bytes)),
            with(row.vdf_bytes, row.vdf_ratio()),
            with(row.lodf_bytes, row.ratio()),
            row.groups.to_string(),
            with(row.with_device_bytes, row.device_ratio()),
            format!("{:.2}", row.stored_ratio()),
        ]);
    };
    let seed = bench.request.seed;
    let mut ratios = vec![];
    for &(tree, leaves, groups) in TREES {
        let row = Row::of(tree, &LeafForest::of(&foliage::synthetic(leaves, seed), groups));
        ratios.push([row.vdf_ratio(), row.ratio(), row.device_ratio()]);
        add(&row);
    }
    let built = bench.built("lodf", &Settings::default())?;
    for part in &built.parts {
        if let Drawn::Forest(forest) = &part.drawn {
            add(&Row::of(&format!("{} (this page's)", bench.source().name()), forest));
        }
    }
    let [vdf, lodf, device] = [0, 1, 2].map(|i| ratios.iter().map(|row| row[i]).sum::<f64>() / ratios.len().max(1) as f64);
    let found = format!(
        "Of the paper's trees VDF takes {vdf:.2} times the leaves themselves, LoDF {lodf:.2}, with the device's part {device:.2}; theirs \
         1.62, 1.24 and 1.49."
    );
    Ok(Ours { tables: vec![table], found, ..Ours::default() })
}

/// Figure 15.
pub(super) const FIG_15: Exhibit = Exhibit {
    id: "rebollo-fig-15",
    paper: PAPER,
    figure: "Figure 15",
    title: "A change of level: VDF and LoDF, both in main memory",
    theirs: Printed::words(
        "Curves of milliseconds against the level of detail, 0 (48,160 leaves) to 1, for Taxus Baccata, uniform and variable: “trees can be \
         visualised quite a lot faster than when using VDF+MOM”.",
    ),
    ours: |bench| curves(bench, &["vdf", "lodf, CPU-side"]),
    differs: "This is extraction alone, without the trunk’s (MOM and LodStrips). What takes time is writing the list of leaves, which both do \
              anew.",
};

/// Figure 16.
pub(super) const FIG_16: Exhibit = Exhibit {
    id: "rebollo-fig-16",
    paper: PAPER,
    figure: "Figure 16",
    title: "A change of level: LoDF in main memory and on the device",
    theirs: Printed::words(
        "The same curves for LoDF with and without taking advantage of the graphics hardware: “the total and extraction time for visualising \
         a tree can be reduced by using this property”.",
    ),
    ours: |bench| curves(bench, &["lodf, CPU-side", "lodf, GPU-resident"]),
    differs: "On the device only what has changed is sent. Total time is not drawn here; on a software driver drawing takes far longer than \
              extraction and hides it.",
};

fn curves(bench: &mut Bench, shown: &[&str]) -> Result<Ours> {
    let rows: Vec<Measured> = bench.extracted().iter().filter(|row| shown.contains(&row.how)).cloned().collect();
    let head = ["structure", "change", "ms, mean of 50 levels", "sent, KB"];
    let mut table = Table::new("48,160 leaves in 641 clusters", head);
    let mut charts: Vec<Chart> = vec![];
    let mut means: Vec<(&str, &str, f64, f64)> = vec![];
    for rows in rows.chunk_by(|a, b| (a.how, a.what) == (b.how, b.what)) {
        let (how, what) = (rows[0].how, rows[0].what);
        let mean = |of: &dyn Fn(&Measured) -> f64| rows.iter().map(of).sum::<f64>() / rows.len().max(1) as f64;
        let (ms, sent) = (mean(&|row| row.ms), mean(&|row| row.bytes as f64 / 1024.0));
        table.row([how.to_owned(), what.to_owned(), format!("{ms:.3}"), format!("{sent:.1}")]);
        means.push((how, what, ms, sent));
        let curve = Curve { name: how.to_owned(), points: rows.iter().map(|row| [row.level, row.ms]).collect() };
        match charts.iter_mut().find(|chart| chart.title == what) {
            Some(chart) => chart.curves.push(curve),
            None => {
                let axes = ["level of detail, 0 all leaves".to_owned(), "ms".to_owned()];
                charts.push(Chart { title: what.to_owned(), axes, curves: vec![curve] });
            }
        }
    }
    let beside = |(how, what, ms, sent): &(&str, &str, f64, f64)| {
        let (other, _, other_ms, other_sent) = means.iter().find(|mean| mean.0 == shown[0] && mean.1 == *what)?;
        let (time, bytes) = (times(*ms, *other_ms), times(*sent, *other_sent));
        (how != other).then(|| format!("{what}: {how} takes {time} times as long as {other} and sends {bytes} times as much"))
    };
    let found = means.iter().filter_map(beside).collect::<Vec<_>>();
    let found = if found.is_empty() { String::new() } else { format!("{}.", found.join("; ")) };
    Ok(Ours { tables: vec![table], charts, found, ..Ours::default() })
}
