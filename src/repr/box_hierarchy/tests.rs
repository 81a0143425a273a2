use super::*;
use crate::Seed;
use crate::model::reference::Asked;
use crate::repr::{Settings, SoftwareCapture, Stats};

fn preset(name: &str) -> TreeSource {
    TreeSource::open(name, &Asked::default(), Seed(1)).unwrap().0
}

/// Set by hand: prints figures of a preset.
#[test]
#[ignore = "figures, not a check"]
fn figures() {
    let name = std::env::var("TREE").unwrap_or("oak".to_owned());
    let source = preset(&name);
    let texts = std::env::var("SET").unwrap_or_default();
    let settings = Settings::parse(texts.split_whitespace()).unwrap();
    let job = Job { source: &source, scope: Scope::Foliage, settings: &settings, seed: Seed(1), capture: &SoftwareCapture::new() };
    let begun = std::time::Instant::now();
    let crown = crown(&job).unwrap();
    println!("{name}: {:.2} s", begun.elapsed().as_secs_f32());
    for (i, b) in crown.boxes.iter().enumerate() {
        let size = b.bounds().size();
        println!(
            "{i:3} parent {:?} depth {} leaves {:5} divided {} distance {:.2} size {size:.1} cards {}",
            b.parent,
            b.depth,
            b.leaves,
            b.divided,
            b.distance,
            b.cards.len()
        );
    }
    for (d, atlas) in crown.atlases.iter().enumerate() {
        println!("atlas {d}: {:?}", atlas.color.dimensions());
        if let Ok(folder) = std::env::var("OUT") {
            atlas.color.save(format!("{folder}/atlas_{d}.png")).unwrap();
            atlas.normals.as_ref().unwrap().save(format!("{folder}/normals_{d}.png")).unwrap();
        }
    }
    let built = BoxHierarchy.build(&job).unwrap();
    built.check().unwrap();
    for (level, stats) in Stats::of_levels(&built) {
        println!("{level}: {stats:?}");
    }
    println!("{:?}", built.levels);
}
