//! The exhibits are complete, and a page comes out of them whatever fails.

use super::*;
use crate::gpu::testing::software_gpu;
use crate::model::reference::Asked;
use crate::repr::SoftwareCapture;

#[test]
fn every_exhibit_has_what_the_issue_asks_for() {
    let names: Vec<String> = EXHIBITS.iter().map(|e| format!("{} {}", e.paper.split(',').next().unwrap_or(""), e.figure)).collect();
    assert_eq!(EXHIBITS.len(), 14, "{names:?}");
    let mut ids: Vec<_> = EXHIBITS.iter().map(|exhibit| exhibit.id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), EXHIBITS.len(), "two exhibits of one address");
    for Exhibit { id, theirs, differs, .. } in EXHIBITS {
        assert!(differs.ends_with('.') && differs.len() > 60, "{id}: {differs}");
        assert!(!differs.contains(|c: char| c.is_ascii_digit()), "{id}: figures belong to what is found");
        assert!(!theirs.words.is_empty() || !theirs.rows.is_empty(), "{id} quotes nothing");
        assert!(theirs.rows.iter().all(|row| row.len() == theirs.head.len()), "{id}: a row of another length");
    }
}

/// Where the papers' texts are, every number that is quoted stands in them.
#[test]
fn what_is_quoted_is_printed() {
    let Some(folder) = crate::files::shared_folder().map(|folder| folder.join("papers")).filter(|folder| folder.is_dir()) else {
        eprintln!("SKIPPED: the papers' texts are not there");
        return;
    };
    let plain = |text: &str| text.replace([',', '“', '”', '*'], "").split_whitespace().collect::<Vec<_>>().join(" ");
    for (begins, file) in [
        ("she", "she-2018-sphere-board.txt"),
        ("truelsen", "truelsen-bonding-2008-slice-impostors.txt"),
        ("lluch03", "lluch-2003-procedural-multiresolution.txt"),
        ("lluch04", "lluch-2004-image-based-multiresolution.txt"),
        ("rebollo", "rebollo-2007-lodf.txt"),
    ] {
        let text = plain(&std::fs::read_to_string(folder.join(file)).unwrap()).replace("20.000", "20000");
        for Exhibit { id, theirs, .. } in EXHIBITS.iter().filter(|exhibit| exhibit.id.starts_with(begins)) {
            let is_number = |word: &&str| word.len() > 1 && word.chars().all(|c| c.is_ascii_digit() || c == '.');
            let cells = theirs.rows.iter().flat_map(|row| row.iter());
            for cell in cells {
                let cell = plain(cell).replace(['(', ')'], " ");
                cell.split(' ')
                    .filter(is_number)
                    .for_each(|number| assert!(text.contains(number), "{id}: {number} is not in {file}"));
            }
            for quote in theirs.words.split('“').skip(1).filter_map(|rest| rest.split('”').next()) {
                assert!(text.to_lowercase().contains(&plain(quote).to_lowercase()), "{id}: “{quote}” is not in {file}");
            }
        }
    }
}

#[test]
fn a_chart_has_its_curves_within_its_axes() {
    let curve = Curve { name: "a".to_owned(), points: vec![[0.0, 3.0], [1.0, 7.0]] };
    let chart = Chart { title: "t".to_owned(), axes: ["x".to_owned(), "y".to_owned()], curves: vec![curve] };
    let svg = chart.svg();
    assert!(svg.contains("points=\"52.0,164.5 508.0,42.5\""), "{svg}");
    let none = Chart { curves: vec![], ..chart };
    assert!(!none.svg().contains("NaN"));
}

/// A tree from a file has no bones: the exhibits that need them say so, and the page has the rest. Slow exhibits are left out.
#[test]
fn what_cannot_be_drawn_is_told_and_the_rest_is_there() {
    let Some(gpu) = software_gpu() else { return };
    let mut renderer = Renderer::new(gpu).unwrap();
    let golden = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/oak.glb");
    let (source, _) = TreeSource::open(&golden.to_string_lossy(), &Asked::default(), Seed(1)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let capture = SoftwareCapture::new();
    let request = Request { source: &source, capture: &capture, seed: Seed(1), command: "as <typed>", folder: folder.path() };
    let mut bench = Bench::new(&mut renderer, &request).unwrap();
    let shown: Vec<Shown> = [&she::TABLE_1, &she::FIG_17, &lluch::FIG_5_7].map(|exhibit| show(exhibit, &mut bench)).into();
    assert!(shown[0].failed.is_none() && shown[1].ours.panels.len() == 9, "{:?} {:?}", shown[0].failed, shown[1].failed);
    assert!(shown[2].failed.is_some() && shown[2].ours.found.is_empty());
    // The golden oak's geometry is a sphere-board: its primitives are those of the first row.
    let first = &shown[0].ours.tables[0].rows;
    assert!(
        shown[0]
            .ours
            .found
            .contains(&format!("{} in its wood", first[2][3].parse::<usize>().unwrap() + first[3][3].parse::<usize>().unwrap()))
    );
    assert!(shown[1].ours.found.contains(" % of the crossed planes"), "{}", shown[1].ours.found);
    let page = page::write(&bench, &request, &shown).unwrap();
    let html = std::fs::read_to_string(page).unwrap();
    assert!(html.contains(&shown[1].ours.found.replace('\'', "&#x27;")), "what is found is told");
    assert!(html.contains("Not of this tree") && html.contains("as &lt;typed&gt;") && !html.contains("http"), "{html}");
    for panel in &shown[1].ours.panels {
        let (_, name) = panel.file.rsplit_once('/').unwrap();
        assert!(folder.path().join(&panel.file).is_file() && html.contains(name), "{name}");
    }
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.path().join("papers.json")).unwrap()).unwrap();
    assert_eq!(json["exhibits"][0]["theirs"]["rows"][1][2], "2124");
}

#[test]
fn large_numbers_are_grouped_and_nothing_else() {
    let all = ["105091", "20281", "1234567", "1024", "12.50", "−12345", "Fractal", ""].map(grouped);
    assert_eq!(all, ["105,091", "20,281", "1,234,567", "1024", "12.50", "−12345", "Fractal", ""]);
}
