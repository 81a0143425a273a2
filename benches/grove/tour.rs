//! Truelsen's tour over his slices: by batch (fig. 32), with and without levels (fig. 30, 31), with and without culling (table 3).

use sphereboard::Result;
use sphereboard::grove::scene::preset;
use sphereboard::params::{Kind, ParamSet};
use sphereboard::render::CullParams;

use crate::site::{How, Site, grown, in_turns, keep, renderer};

/// Trees of the tour: with ten thousand, one call for each card would be measured for minutes.
const TREES: u64 = 2000;

/// The batches that there are.
pub fn batches() -> Vec<&'static str> {
    let kind = CullParams::specs().into_iter().find(|spec| spec.name == "batch").map(|spec| spec.kind);
    match kind {
        Some(Kind::Choice(words)) => words.iter().map(|word| word.0).collect(),
        _ => vec![],
    }
}

pub fn run(job: &str) -> Result<()> {
    let mut file = preset("truelsen-10k")?;
    (file.trees, file.frames) = (TREES, 120);
    let stock = grown(&file)?;
    let mut hows = vec![];
    for batch in batches() {
        let mut cull = CullParams::default();
        cull.set("batch", batch)?;
        hows.push(How { name: batch.to_owned(), cull, ..How::default() });
    }
    hows.push(How { name: "no levels".to_owned(), no_levels: true, ..How::default() });
    hows.push(How { name: "no culling".to_owned(), no_culling: true, ..How::default() });
    let sites = hows.iter().map(|_| Site::planted(renderer()?, &file, &stock, 0.0));
    let drives = in_turns(job, &mut sites.collect::<Result<Vec<_>>>()?, &hows)?;
    let (rows, moments): (Vec<_>, Vec<_>) = drives.into_iter().unzip();
    let moments: Vec<_> = moments.into_iter().flatten().collect();
    keep(job, &rows)?;
    keep("tour-moments", &moments)
}
