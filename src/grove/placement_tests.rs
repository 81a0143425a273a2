use super::*;
use crate::grove::terrain::{TerrainParams, hills};
use proptest::prelude::*;

fn ground(width: f64, depth: f64, relief: f64) -> HeightField {
    let params = TerrainParams { ground_width_m: width, ground_depth_m: depth, relief_m: relief, ..Default::default() };
    hills(&params, Seed(5)).unwrap()
}

fn kinds(shares: &[f64]) -> Vec<SpeciesSize> {
    let kind = |(index, &share): (usize, &f64)| SpeciesSize {
        name: format!("kind {index}"),
        also: vec![],
        share,
        height_m: 10.0,
        crown_width_m: 6.0,
        trunk_radius_m: 0.3,
    };
    shares.iter().enumerate().map(kind).collect()
}

/// Smallest distance between any two, by looking at neighbours in order of x.
fn nearest(points: &[[f32; 2]]) -> f32 {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut least = f32::INFINITY;
    for (i, a) in sorted.iter().enumerate() {
        for b in &sorted[i + 1..] {
            if b[0] - a[0] >= least {
                break;
            }
            least = least.min((a[0] - b[0]).hypot(a[1] - b[1]));
        }
    }
    least
}

#[test]
fn threads_do_not_matter_and_seeds_do() {
    let ground = ground(300.0, 200.0, 20.0);
    let params = PlantingParams::default();
    let all = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let open = Openness::new(&ground, &params, Seed(seed));
            let points = scatter(&ground, 3000, 0.6, Seed(seed), &|x, z| open.allows(x, z)).unwrap().points;
            plant(&points, &ground, &kinds(&[1.0, 2.0, 3.0]), &params, Seed(seed))
        })
    };
    let one = all(1, 1);
    assert_eq!(one.len(), 3000);
    assert_eq!(one, all(4, 1));
    assert_ne!(one, all(4, 2));
}

#[test]
fn a_billion_trees_are_refused_with_their_memory() {
    let told = scatter(&ground(100.0, 100.0, 0.0), 1_000_000_000, 0.6, Seed(1), &|_, _| true).unwrap_err().to_string();
    assert!(told.contains("116 GB") && told.contains("4194304"), "{told}");
}

#[test]
fn few_trees_none_and_nowhere_to_stand() {
    let ground = ground(100.0, 60.0, 0.0);
    for count in [0, 1, 2, 7] {
        assert_eq!(scatter(&ground, count, 0.8, Seed(1), &|_, _| true).unwrap().points.len(), count as usize);
    }
    let nowhere = scatter(&ground, 50, 0.6, Seed(1), &|_, _| false).unwrap();
    assert!(nowhere.points.is_empty() && nowhere.warnings[0].message.contains("only 0 of 50"));
    // A strip of a thousandth of the ground, which a look at the whole may miss.
    let strip = scatter(&ground, 20, 0.6, Seed(1), &|x, _| (10.0..10.1).contains(&x)).unwrap();
    assert_eq!(strip.points.len(), 20);
}

#[test]
fn points_are_spread_evenly_and_rows_do_not_show() {
    let ground = ground(400.0, 400.0, 0.0);
    let points = scatter(&ground, 8000, 0.7, Seed(3), &|_, _| true).unwrap().points;
    // Quarters of the ground hold alike many; blue noise deviates less than chance, whose deviation would be 39.
    let mut quarters = [0usize; 4];
    for [x, z] in &points {
        quarters[usize::from(*x > 0.0) + 2 * usize::from(*z > 0.0)] += 1;
    }
    assert!(quarters.iter().all(|&n| n.abs_diff(2000) < 60), "{quarters:?}");
    // Directions to the nearest neighbour: none of eight is preferred.
    let mut directions = [0usize; 8];
    for a in points.iter().take(2000) {
        let distance = |b: &&[f32; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let b = points.iter().filter(|b| *b != a).min_by(|b, c| distance(b).total_cmp(&distance(c))).unwrap();
        let turn = (b[1] - a[1]).atan2(b[0] - a[0]).rem_euclid(TAU) / TAU;
        directions[((8.0 * turn) as usize).min(7)] += 1;
    }
    // Five standard deviations of a binomial with n = 2000, p = 1/8, made wider since neighbours are mutual.
    assert!(directions.iter().all(|&n| n.abs_diff(250) < 105), "{directions:?}");
}

#[test]
fn clearings_take_the_share_they_are_told() {
    let ground = ground(800.0, 800.0, 0.0);
    let params = PlantingParams { clearings: 0.4, clearing_m: 60.0, ..Default::default() };
    let open = Openness::new(&ground, &params, Seed(1));
    let share = open_share(&ground, &|x, z| open.allows(x, z));
    assert!((share - 0.6).abs() < 0.03, "{share}");
    let cliff = HeightField::new(3, 2, 10.0, 0.0, 0.0, vec![0.0, 0.0, 30.0, 0.0, 0.0, 30.0]).unwrap();
    let open = Openness::new(&cliff, &PlantingParams { clearings: 0.0, ..Default::default() }, Seed(1));
    assert!(open.allows(5.0, 5.0) && !open.allows(15.0, 5.0) && !open.allows(25.0, 5.0));
}

#[test]
fn species_keep_their_shares_and_clump_when_told() {
    let ground = ground(500.0, 500.0, 0.0);
    let points = scatter(&ground, 10_000, 0.6, Seed(1), &|_, _| true).unwrap().points;
    let planted = |clumping: f64| {
        let params = PlantingParams { species_clumping: clumping, ..Default::default() };
        plant(&points, &ground, &kinds(&[1.0, 3.0]), &params, Seed(1))
    };
    let mixed = planted(0.0);
    let first = mixed.iter().filter(|t| t.species == 0).count();
    assert!(first.abs_diff(2500) < 220, "{first}");
    // Trees that follow each other in rows stand side by side.
    let alike = |trees: &[Planted]| trees.windows(2).filter(|w| w[0].species == w[1].species).count();
    assert!(alike(&planted(1.0)) > alike(&mixed) + 500);
}

/// A crease between looks that random trees found.
#[test]
fn no_foot_hangs_over_a_crease() {
    let (ground, x, z, radius, around) = (ground(200.0, 200.0, 60.0), -49.931_71, 89.511_66, 0.237_473_15, 5.350_614_f32);
    let foot = foot_at(&ground, x, z, radius).unwrap();
    let floor = ground.height_at(x + radius * around.sin(), z + radius * around.cos()).unwrap();
    assert!(foot.y <= floor + 0.02 * radius, "{} over {floor}", foot.y);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn blue_noise_keeps_its_distance_its_number_and_the_ground(
        width in 20.0f64..300.0, depth in 20.0f64..300.0, count in 1u64..1500, evenness in 0.3f64..0.8, seed in 0u64..1000,
    ) {
        let ground = ground(width, depth, 30.0);
        let scattered = scatter(&ground, count, evenness, Seed(seed), &|_, _| true).unwrap();
        prop_assert_eq!(scattered.points.len() as u64, count);
        prop_assert!(nearest(&scattered.points) >= scattered.apart_m * 0.9999, "{} {}", nearest(&scattered.points), scattered.apart_m);
        let ideal = evenness * (f64::from(ground.size_m()[0] * ground.size_m()[1]) / count as f64).sqrt();
        prop_assert!(f64::from(scattered.apart_m) > 0.6 * ideal, "{} {}", scattered.apart_m, ideal);
        prop_assert!(scattered.points.iter().all(|p| ground.height_at(p[0], p[1]).is_some()));
    }

    #[test]
    fn no_foot_hangs_over_a_slope(x in -90.0f32..90.0, z in -90.0f32..90.0, radius in 0.0f32..1.5, around in 0.0f32..TAU) {
        let ground = ground(200.0, 200.0, 60.0);
        let foot = foot_at(&ground, x, z, radius).unwrap();
        let floor = ground.height_at(x + radius * around.sin(), z + radius * around.cos()).unwrap();
        // Between two looks a crease may lie deeper, by a tenth of the radius times the change of slope.
        prop_assert!(foot.y <= floor + 0.05 * radius + 1e-4, "{} over {}", foot.y, floor);
        prop_assert!(foot.y > ground.height_at(x, z).unwrap() - 4.0 * radius - 1e-4, "not buried");
    }

    #[test]
    fn planted_trees_are_sound(count in 1u64..300, spread in 0.0f64..0.9, seed in 0u64..100) {
        let ground = ground(120.0, 80.0, 10.0);
        let params = PlantingParams { size_spread: spread, ..Default::default() };
        let points = scatter(&ground, count, 0.5, Seed(seed), &|_, _| true).unwrap().points;
        let trees = plant(&points, &ground, &kinds(&[1.0, 0.0, 2.0]), &params, Seed(seed));
        prop_assert_eq!(trees.len(), points.len());
        for tree in &trees {
            prop_assert!(tree.species != 1 && tree.species < 3, "a share of 0 is no tree");
            prop_assert!((0.0..TAU).contains(&tree.yaw_rad) && tree.position.is_finite());
            prop_assert!((f64::from(tree.scale) - 1.0).abs() <= spread + 1e-6 && tree.scale > 0.0);
        }
    }
}

#[test]
#[ignore = "a timing: run it alone, in release"]
fn a_million_trees_over_sixteen_square_kilometres() {
    let params = TerrainParams {
        ground_width_m: 4000.0,
        ground_depth_m: 4000.0,
        ground_step_m: 16.0,
        relief_m: 120.0,
        hill_m: 900.0,
        ..Default::default()
    };
    let ground = hills(&params, Seed(1)).unwrap();
    let planting = PlantingParams::default();
    let begun = std::time::Instant::now();
    let open = Openness::new(&ground, &planting, Seed(1));
    let points = scatter(&ground, 1_000_000, 0.6, Seed(1), &|x, z| open.allows(x, z)).unwrap().points;
    let scattered = begun.elapsed();
    let trees = plant(&points, &ground, &kinds(&[1.0, 1.0, 1.0]), &planting, Seed(1));
    println!("{} trees: {scattered:?} for places, {:?} with trees", trees.len(), begun.elapsed());
    assert!(trees.len() == 1_000_000);
}
