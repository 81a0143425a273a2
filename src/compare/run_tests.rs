//! Whole comparisons of a small tree on the software driver: what fails in one place alone, what is stopped and goes on.

use std::path::Path;
use std::sync::Mutex;

use super::*;
use crate::gpu::testing::software_gpu;
use crate::model::reference::Asked;
use crate::plant::presets::preset;
use crate::render::Renderer;
use crate::repr::file::{self, Origin};
use crate::repr::limits::BudgetParams;
use crate::repr::{self, BuiltTree, Order, REFERENCE_FOCAL_PX, Settings, SoftwareCapture, TreeSource};
use crate::{Error, Result, Seed};

fn renderers(count: usize) -> Option<Vec<Renderer>> {
    (0..count).map(|_| software_gpu().map(|gpu| Renderer::new(gpu).unwrap())).collect()
}

fn young() -> TreeSource {
    TreeSource::grown(preset("birch").unwrap(), Some(8.0), &Asked::default(), Seed(1)).unwrap().0
}

fn small_plan() -> Plan {
    let views = vec![View { azimuth_deg: 10.0, elevation_deg: 0.0 }, View { azimuth_deg: 100.0, elevation_deg: 0.0 }];
    let motion = MotionPlan { orbit_frames: 2, dolly_frames: 4, dolly_px: [60.0, 30.0] };
    Plan {
        views,
        heights_px: vec![64.0, 32.0],
        levels: false,
        motion,
        timing_ms: 1,
        ..Plan::new(Profile::Quick, Views::Default, 64)
    }
}

/// A comparison of these methods in a folder; `before` hears of every picture.
fn compared(
    renderers: &mut [Renderer],
    folder: &Path,
    methods: &[&str],
    extras: &[std::path::PathBuf],
    before: &(dyn Fn(Progress) + Sync),
) -> Result<Comparison> {
    let (source, capture) = (young(), SoftwareCapture::new());
    let plan = small_plan();
    let identity = Identity {
        program: "test".to_owned(),
        commit: "0".to_owned(),
        source: "birch".to_owned(),
        plan: plan.clone(),
        seed: 1,
        settings: vec![],
        adapter: "software".to_owned(),
    };
    let contenders = Contender::all(&methods.iter().map(|id| (*id).to_owned()).collect::<Vec<_>>(), extras)?;
    let shop = Workshop { source: &source, seed: Seed(1), capture: &capture, budget: BudgetParams::default() };
    let request = Request { shop, photograph: None, contenders: &contenders, plan: &plan, budget: &Budget::default(), folder };
    let mut store = Store::open(folder, &identity, false)?;
    run(renderers, &request, &mut store, before)
}

/// A baked stand-in for [`young`] in a file of that name.
fn baked(folder: &Path, name: &str, method: &str) -> std::path::PathBuf {
    let settings = Settings::default();
    let order = Order { method, trunk: None, settings: &settings, seed: Seed(1) };
    let built = repr::build(&order, &young(), &SoftwareCapture::new()).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, file::write(&built, &Origin::of(&order, "birch").unwrap()).unwrap()).unwrap();
    path
}

#[test]
fn what_fails_at_one_distance_is_told_there_and_the_rest_goes_on() {
    let Some(mut renderers) = renderers(1) else { return };
    let folder = tempfile::tempdir().unwrap();
    let broken = baked(folder.path(), "broken-at-32.glb", "billboard");
    let found = compared(&mut renderers, folder.path(), &["geometry"], &[broken], &|_| ()).unwrap();
    let run = &found.methods[1];
    assert!(run.refused.is_none() && run.rows.len() == 2);
    assert!(run.rows[0].failed.is_none() && run.rows[0].error.flip > 0.0);
    let why = run.rows[1].failed.as_deref().unwrap();
    assert!(why.starts_with("2 of 2 pictures") && why.contains("as tests asked for"), "{why}");
    assert!(run.rows[1].cost.triangles > 0, "its cost is known all the same");
    assert_eq!(found.cells.iter().filter(|cell| cell.failed.is_some()).count(), 2);
    // No part of the answer, though its error of nothing is less than any.
    let rows: Vec<Row> = found.methods.iter().flat_map(|run| run.rows.clone()).collect();
    let bands = answer::bands(&rows, 1.0, answer::CostKind::Triangles);
    assert_eq!(bands.iter().map(|band| band.method.as_deref().unwrap()).collect::<Vec<_>>(), ["broken-at-32", "geometry"]);
    let asked = page::Asked { max_flip: 0.1, cost: answer::CostKind::Ms, command: "test" };
    let identity = serde_json::from_str(&std::fs::read_to_string(folder.path().join("identity.json")).unwrap()).unwrap();
    page::write(folder.path(), &found, &identity, asked).unwrap();
    let csv = std::fs::read_to_string(folder.path().join("cells.csv")).unwrap();
    assert_eq!(csv.lines().filter(|line| line.contains("as tests asked for")).count(), 2);
    assert!(csv.lines().all(|line| line.split(',').count() == 6 + COLUMNS.len() + 4), "{csv}");
}

#[test]
fn several_renderers_find_what_one_finds_and_figures_are_whole() {
    let Some(mut renderers) = renderers(2) else { return };
    let methods = ["geometry", "billboard", "crossed-planes"];
    let figures = |renderers: &mut [Renderer]| {
        let folder = tempfile::tempdir().unwrap();
        let found = compared(renderers, folder.path(), &methods, &[], &|_| ()).unwrap();
        for strip in motion::STRIPS.iter().take(1) {
            assert!(folder.path().join("pictures/billboard").join(strip).exists());
        }
        found
    };
    let (both, one) = (figures(&mut renderers), figures(&mut renderers[..1]));
    assert_eq!(both.cells, one.cells);
    for (a, b) in both.methods.iter().zip(&one.methods) {
        assert_eq!((&a.method, a.motion, a.disk_bytes), (&b.method, b.motion, b.disk_bytes));
        let motion = a.motion.unwrap();
        assert!(a.disk_bytes > 1000 && motion.flicker > 0.0 && (0.0..10.0).contains(&motion.orbit_jod), "{a:?}");
        assert!(a.spent.build_s > 0.0 && a.spent.timing_s > 0.0 && a.spent.pictures_s > 0.0 && a.spent.motion_s > 0.0);
    }
    let tree = both.methods[0].motion.unwrap();
    assert!(tree.flicker >= 1.0, "one sample for each pixel is not calmer than many");
    assert!(tree.popping.is_none() && tree.dolly_jod.is_none(), "nothing of the tree itself changes with distance");
    assert!(both.budget.spent.truth_s > 0.0 && both.budget.spent.sum() < 1.5 * both.budget.taken_s, "{:?}", both.budget);
    assert!(both.budget.taken_s > 0.0 && both.budget.peak_mb.is_none_or(|mb| mb > 10.0));
}

#[test]
fn stand_ins_of_others_are_rows_and_bad_ones_are_refused_in_theirs() {
    let Some(mut renderers) = renderers(1) else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let ours = baked(folder.path(), "ours.glb", "billboard");
    std::fs::write(path("bad.glb"), b"no tree").unwrap();
    let triangle = "v -9 0 0\nv 9 0 0\nv 0 90 0\nf 1 2 3\n";
    std::fs::write(path("huge.obj"), triangle).unwrap();
    let extras = [ours.clone(), path("bad.glb"), path("huge.obj"), path("absent.glb"), ours];
    let found = compared(&mut renderers, folder.path(), &["geometry", "billboard"], &extras, &|_| ()).unwrap();
    let ids: Vec<&str> = found.methods.iter().map(|run| run.method.as_str()).collect();
    assert_eq!(ids, ["geometry", "billboard", "ours", "bad", "huge", "absent", "ours-2"]);
    // Read back, a stand-in is what it was.
    assert_eq!(found.methods[1].rows[0].error, found.methods[2].rows[0].error);
    assert_eq!(found.methods[1].levels, found.methods[2].levels);
    for (run, word) in found.methods[3..6].iter().zip(["bad.glb", "stand where the tree stands", "absent.glb"]) {
        let why = run.refused.as_deref().unwrap();
        assert!(why.contains(word) && run.rows.is_empty(), "{why}");
    }
}

#[test]
fn pictures_beyond_the_budget_are_refused() {
    let source = young();
    let budget = BudgetParams { texture_budget_mb: 0.01 };
    let shop = Workshop { source: &source, seed: Seed(1), capture: &SoftwareCapture::new(), budget };
    let contenders = Contender::all(&["billboard".to_owned()], &[]).unwrap();
    assert!(matches!(contenders[0].build(&shop), Err(Error::TextureBudget { .. })));
}

#[test]
fn what_is_finished_is_not_done_again() {
    let Some(mut renderers) = renderers(1) else { return };
    let folder = tempfile::tempdir().unwrap();
    let methods = ["geometry", "billboard"];
    let first = compared(&mut renderers, folder.path(), &methods, &[], &|_| ()).unwrap();
    // The end of a run in the middle of a line.
    let list = folder.path().join("finished.jsonl");
    let text = std::fs::read_to_string(&list).unwrap();
    let cut = text.trim_end().rfind('\n').unwrap() + 40;
    std::fs::write(&list, &text[..cut]).unwrap();
    let doing = Mutex::new(vec![]);
    let hear = |progress: Progress| doing.lock().unwrap().push(progress.doing.to_owned());
    let second = compared(&mut renderers, folder.path(), &methods, &[], &hear).unwrap();
    let doing = doing.into_inner().unwrap();
    assert!(doing.iter().any(|id| id == "billboard") && !doing.iter().any(|id| id == "geometry"));
    assert_eq!(first.cells, second.cells);
    assert!(second.budget.taken_s > first.budget.taken_s);
    // Nothing is left to do.
    let third = compared(&mut renderers, folder.path(), &methods, &[], &|_| ()).unwrap();
    assert_eq!(third.cells, first.cells);
}

#[test]
fn a_chain_in_a_file_draws_at_every_distance_as_the_link_that_belongs_there() {
    let Some(mut renderers) = renderers(1) else { return };
    let source = young();
    let shop = Workshop { source: &source, seed: Seed(1), capture: &SoftwareCapture::new(), budget: BudgetParams::default() };
    let ids = ["box-hierarchy", "lodf", "billboard"].map(str::to_owned);
    let contenders = Contender::all(&ids, &[]).unwrap();
    let link = |(method, from_distance): (&String, f32)| answer::Link {
        method: method.clone(),
        level: None,
        from_height_px: (from_distance > 0.0).then(|| REFERENCE_FOCAL_PX / from_distance),
        from_distance,
    };
    let links = ids.iter().zip([0.0, 12.0, 40.0]).map(link).collect();
    let chain = answer::Chain { links };
    let built = chain::build(&chain, &contenders, &shop).unwrap();
    let joined = chain::join(&chain, &built, 0.1).unwrap();
    let bytes = file::write(&joined, &chain::origin(&chain, &shop)).unwrap();
    let (read, _) = file::read(&bytes).unwrap().unwrap();
    assert!(read.levels.len() >= 3, "{:?}", read.levels);
    let stage = Stage { bounds: source.box_of_all().unwrap() };
    let view = View { azimuth_deg: 20.0, elevation_deg: 15.0 };
    let mut seen = |built: &BuiltTree, distance: f32| {
        let tree = renderers[0].upload_built(built).unwrap();
        let shot = stage.shot(view, REFERENCE_FOCAL_PX / distance, small_plan().suns[0], None);
        stage.see(&mut renderers[0], &tree, &shot).unwrap().color
    };
    for (i, distance) in [(0, 8.0), (1, 25.0), (2, 60.0)] {
        let (whole, alone) = (seen(&read, distance), seen(&built[i], distance));
        let difference = crate::metrics::difference_of_pictures(&whole, &alone, 0.02).unwrap();
        assert!(difference.mean < 0.002, "{} at {distance}: {difference:?}", ids[i]);
    }
}
