use super::*;
use crate::compare::{Cell, Cost, Figures, Motion, Plan, Profile, Views};

fn row(method: &str, height_px: f32, flip: f64, texture_bytes: usize) -> Row {
    let error = Figures { flip, ..Figures::default() };
    Row {
        method: method.to_owned(),
        level: None,
        height_px,
        error,
        cost: Cost { texture_bytes, ms: 1.0, ..Cost::default() },
        failed: None,
    }
}

/// Methods with their FLIP from the side, how much it grows towards the top, and their bytes.
fn comparison(source: &str, methods: &[(&str, f64, f64, usize)]) -> Comparison {
    let plan = Plan::new(Profile::Quick, Views::Default, 128);
    let run = |&(method, flip, _, bytes): &(&str, f64, f64, usize)| MethodRun {
        method: method.to_owned(),
        name: format!("The {method}"),
        citation: "ours".to_owned(),
        parameters: vec![("size_px".to_owned(), "64".to_owned())],
        build_ms: 1.0,
        memory_bytes: bytes,
        motion: Some(Motion { flicker: 1.2, orbit_jod: 9.0, ..Motion::default() }),
        rows: plan.heights_px.iter().map(|&height_px| row(method, height_px, flip, bytes)).collect(),
        ..MethodRun::default()
    };
    let mut cells = vec![];
    for &(method, flip, grows, _) in methods {
        for (height_px, view) in
            plan.heights_px.iter().flat_map(|&height_px| (0..plan.views.len()).map(move |view| (height_px, view)))
        {
            let error = Figures { flip: flip + grows * f64::from(plan.views[view].elevation_deg) / 90.0, ..Figures::default() };
            cells.push(Cell { method: method.to_owned(), level: None, view, height_px, sun: 0, error, failed: None });
        }
    }
    let methods = methods.iter().map(run).collect();
    Comparison { source: source.to_owned(), height_m: 9.0, budget: Budget::default(), methods, plan, cells }
}

const METHODS: [(&str, f64, f64, usize); 4] = [
    ("geometry", 0.0, 0.0, 9000),
    ("sphere-board", 0.05, 0.0, 500),
    ("billboard", 0.03, 0.2, 100),
    ("octahedral", 0.01, 0.0, 5000),
];

fn identity(comparison: &Comparison) -> Identity {
    Identity {
        program: "sphereboard 0".to_owned(),
        commit: "0".to_owned(),
        source: comparison.source.clone(),
        plan: comparison.plan.clone(),
        seed: 7,
        settings: vec![],
        adapter: "none".to_owned(),
    }
}

fn written(comparison: &Comparison) -> (String, String, String) {
    let folder = tempfile::tempdir().unwrap();
    let asked = Asked { max_flip: 0.08, cost: CostKind::Bytes, command: "sphereboard compare oak --out x" };
    let page = write(folder.path(), comparison, &identity(comparison), asked).unwrap();
    assert_eq!(page, folder.path().join("report.html"));
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    (text("report.html"), text("report.json"), text("cells.csv"))
}

/// What stands in the page's element for data.
fn embedded(html: &str) -> &str {
    let begin = r#"<script type="application/json" id="data">"#;
    let (_, rest) = html.split_once(begin).unwrap();
    rest.split_once("</script>").unwrap().0
}

#[test]
fn the_page_holds_the_data_once_and_fetches_nothing() {
    let comparison = comparison("oak", &METHODS);
    let (html, json, cells) = written(&comparison);
    assert_eq!(embedded(&html), json);
    assert_eq!(html.matches(&json).count(), 1);
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    for (i, (method, ..)) in METHODS.iter().enumerate() {
        assert_eq!(value["methods"][i]["method"], *method);
    }
    assert_eq!(value["elevations"].as_array().unwrap().len(), 4 * 3 * 3);
    assert_eq!(value["pictures"][0]["file"], "e0_h64_s0.png");
    assert_eq!(cells.lines().count(), 1 + 4 * comparison.plan.pictures() + 4, "a line for each picture and each film");
    assert!(cells.lines().filter(|line| line.ends_with(",orbit,1.20000,9.00000,")).count() == 4, "{cells}");
    for address in ["http:", "https:", "src=\"//", "@import", "fetch("] {
        assert!(!html.contains(address), "{address}");
    }
    assert_eq!(written(&comparison).0, html);
}

#[test]
fn a_name_cannot_leave_its_place() {
    let evil = "</script><img src=x onerror=alert(1)><!--<script>";
    let (html, json, _) = written(&comparison(evil, &METHODS));
    assert!(!html.contains("<img src=x") && !html.contains("<!--"));
    assert_eq!(html.matches("</script>").count(), 2);
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(value["source"], evil);
}

#[test]
fn where_ours_is_beaten_is_said_and_only_there() {
    let (_, json, _) = written(&comparison("oak", &METHODS));
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    // The billboard is better from the side alone; the octahedral one needs more bytes; the truth does not count.
    let losses = value["losses"].as_array().unwrap();
    assert_eq!(losses.len(), 3);
    for loss in losses {
        assert_eq!((loss["elevation_deg"].as_f64(), loss["by"].as_array().unwrap().len()), (Some(0.0), 1));
        assert_eq!(loss["by"][0]["method"], "billboard");
    }
}

#[test]
fn a_comparison_of_nothing_has_a_page_too() {
    let (html, ..) = written(&comparison("", &[]));
    assert!(html.contains("\"methods\":[]"));
}
