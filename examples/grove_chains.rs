//! The chains of stand-ins that `sphereboard grove` draws presets and photographs with: compares each at five distances and writes
//! `src/grove/chains.json`.
//!
//! `cargo run --release --example grove_chains [NAME...]`, by default every preset and `photograph`; those that are not named stay as
//! they are. What is compared: the methods that a chain of a grove can be made of, from where a walker and a low flight see trees, in
//! one light, at 1024, 256, 64, 16 and 8 pixels; so switches lie at 512, 128, 32 and 11 pixels.

use std::path::Path;

use sphereboard::compare::{
    Budget, Comparison, Contender, Identity, MotionPlan, Plan, Profile, Request, Store, TRUTH, View, Views, Workshop, photograph,
    run,
};
use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::grove::chains::{Chains, PHOTOGRAPH, Rule};
use sphereboard::model::About;
use sphereboard::model::reference::Asked;
use sphereboard::plant::presets::PRESETS;
use sphereboard::render::Renderer;
use sphereboard::repr::limits::BudgetParams;
use sphereboard::repr::{SoftwareCapture, TreeSource, method, takes};
use sphereboard::{Result, Seed, files};

/// Where the chains are kept.
const OUT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/grove/chains.json");
/// The photograph whose model stands for all of them.
const PHOTO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/photos/lime.jpg");
/// What a chain can be made of: meshes with levels, and stand-ins of few triangles. Not octahedral impostors: each pixel of the square round
/// the tree reads several textures, which is beyond a software driver near, and far they are no nearer than other cards.
const METHODS: [&str; 8] =
    ["lodf", "lodstrips", "meshopt", "sphere-board", "billboard-cloud", "grid-slices", "crossed-planes", "billboard"];
/// Trees are compared this high, pixels.
const HEIGHTS_PX: [f32; 5] = [1024.0, 256.0, 64.0, 16.0, 8.0];
/// From there: azimuth and elevation, degrees.
const FROM: [[f32; 2]; 5] = [[10.0, 3.0], [130.0, 3.0], [250.0, 3.0], [70.0, 25.0], [190.0, 25.0]];

fn main() -> Result<()> {
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    if names.is_empty() {
        names = PRESETS.iter().map(|preset| preset.name).chain([PHOTOGRAPH]).map(str::to_owned).collect();
    }
    let open = || Renderer::new(Gpu::open(&AdapterChoice::Software)?);
    let mut renderers = (0..3).map(|_| open()).collect::<Result<Vec<_>>>()?;
    let info = &renderers[0].gpu.info;
    let mut chains = Chains {
        program: About::this_program(),
        command: "make chains".to_owned(),
        adapter: format!("{}, {} {}", info.name, info.driver, info.driver_info),
        rule: Rule::default(),
        bands: Chains::own().bands.clone(),
    };
    for name in &names {
        let comparison = compare(&mut renderers, name, &chains)?;
        let rows: Vec<_> = comparison.methods.iter().flat_map(|run| run.rows.clone()).collect();
        for row in &rows {
            let work = Rule::work(row) / f64::from(row.height_px).powi(2);
            println!(
                "{name} {:4} px  {:15} {:.4}  {work:7.2} px/px²  {:6} triangles",
                row.height_px, row.method, row.error.flip, row.cost.triangles
            );
        }
        let bands = chains.rule.bands(&rows);
        for band in &bands {
            println!(
                "{name}: {:4} px: {} ({:.4}, {:.0} px)",
                band.height_px,
                band.method.as_deref().unwrap_or("-"),
                band.flip,
                band.cost
            );
        }
        chains.bands.insert(name.clone(), bands);
        let text = serde_json::to_string_pretty(&chains).expect("chains serialise");
        files::write_whole(Path::new(OUT), format!("{text}\n").as_bytes())?;
    }
    Ok(())
}

fn compare(renderers: &mut [Renderer], name: &str, chains: &Chains) -> Result<Comparison> {
    let seed = Seed(1);
    let source = match name {
        PHOTOGRAPH => photograph::open(Path::new(PHOTO), seed)?.0,
        preset => TreeSource::open(preset, &Asked::default(), seed)?.0,
    };
    let plan = Plan {
        views: FROM.map(|[azimuth_deg, elevation_deg]| View { azimuth_deg, elevation_deg }).to_vec(),
        heights_px: HEIGHTS_PX.to_vec(),
        // Nothing is asked of motion or time here.
        motion: MotionPlan { orbit_frames: 2, dolly_frames: 2, dolly_px: [64.0, 32.0] },
        timing_ms: 1,
        ..Plan::new(Profile::Quick, Views::Default, 512)
    };
    // Near, the outline of a photograph's model grows as the photograph's does, which no mesh does that is made of it.
    let mesh = |id: &str| ["lodf", "lodstrips", "meshopt"].contains(&id);
    let wanted = METHODS.into_iter().filter(|id| name != PHOTOGRAPH || !mesh(id));
    let taken = wanted.filter(|id| method(id).and_then(|method| takes(method, &source)).is_ok());
    let methods: Vec<String> = [TRUTH].into_iter().chain(taken).map(str::to_owned).collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/grove_chains").join(name);
    let identity = Identity {
        program: chains.program.clone(),
        commit: String::new(),
        source: name.to_owned(),
        plan: plan.clone(),
        seed: seed.0,
        settings: vec![],
        adapter: chains.adapter.clone(),
    };
    // What has changed in a method is no part of the identity: never go on from before.
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder under target/");
    let mut store = Store::open(&folder, &identity, true)?;
    let (capture, contenders) = (SoftwareCapture::new(), Contender::all(&methods, &[])?);
    let shop = Workshop { source: &source, seed, capture: &capture, budget: BudgetParams::default() };
    let request =
        Request { shop, photograph: None, contenders: &contenders, plan: &plan, budget: &Budget::default(), folder: &folder };
    run(renderers, &request, &mut store, &|_| ())
}
