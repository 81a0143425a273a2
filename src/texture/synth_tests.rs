use super::*;
use crate::raster::{Mask, View};
use crate::texture::test_shapes::{leafy, lumpy_ball};
use glam::DVec2;
use image::{Rgb, RgbImage};

fn paper() -> SynthParams {
    SynthParams { front: FrontChoice::Synth, ..SynthParams::default() }
}

fn total(c: &Counts) -> usize {
    c.front + c.started + c.extended + c.rematched + c.matched.iter().sum::<usize>()
}

#[test]
fn every_polygon_gets_a_block_of_its_own_size_inside_the_exemplar() {
    let (mesh, exemplar) = (lumpy_ball(16, 1.2), leafy(64));
    let texture = synthesize(&mesh, &exemplar, 20.0, &[], &paper(), Seed(1)).unwrap();
    assert_eq!(total(&texture.counts), mesh.polygon_count());
    assert_eq!(texture.counts.started, 1);
    assert!(texture.counts.extended > 0 && texture.counts.matched[0] > 0);
    for (flat, block) in texture.flat.flats.iter().zip(&texture.blocks) {
        for k in 0..flat.count {
            let next = (k + 1) % flat.count;
            let (here, there) = (flat.corners[k].distance(flat.corners[next]), block.corners[k].distance(block.corners[next]));
            assert!((20.0 * here - there).abs() < 0.02, "distances are those of the flattened polygon");
            assert!(block.corners[k].min_element() >= -0.6 && block.corners[k].max_element() <= 64.6, "{:?}", block.corners[k]);
        }
    }
}

#[test]
fn an_extension_shares_the_texels_of_its_edge() {
    let mesh = lumpy_ball(16, 1.2);
    let texture = synthesize(&mesh, &leafy(96), 20.0, &[], &paper(), Seed(1)).unwrap();
    let mut found = 0;
    for (p, block) in texture.blocks.iter().enumerate().filter(|b| b.1.cv == 1) {
        found += usize::from((0..texture.flat.flats[p].count).any(|k| {
            let Some(hinge) = texture.flat.hinges[p][k] else { return false };
            let next = (k + 1) % texture.flat.flats[p].count;
            [k, next].iter().all(|&c| {
                let there = hinge.unfolded.transform_point2(texture.flat.flats[p].corners[c]);
                texture.blocks[hinge.polygon].map.transform_point2(there).distance(block.corners[c]) < 0.01
            })
        }));
    }
    assert!(found >= texture.counts.extended && found > 0, "{found} {:?}", texture.counts);
}

#[test]
fn blocks_stay_upright() {
    let params = paper();
    let texture = synthesize(&lumpy_ball(16, 1.2), &leafy(96), 20.0, &[], &params, Seed(1)).unwrap();
    let limit = (params.block_lean_deg as f32).to_radians().cos() - 1e-4;
    for (flat, block) in texture.flat.flats.iter().zip(&texture.blocks) {
        if let Some(up) = flat.up {
            assert!((block.map.matrix2 * up).normalize().dot(-Vec2::Y) >= limit);
        }
        assert!(block.map.matrix2.determinant() < 0.0, "y up in the plane is y down in the picture, and nothing is mirrored");
    }
}

#[test]
fn matching_agrees_better_with_its_neighbours_than_chance() {
    let (mesh, exemplar) = (lumpy_ball(16, 1.2), leafy(96));
    let layer = Layer::from(&exemplar);
    let texture = synthesize(&mesh, &exemplar, 20.0, &[], &paper(), Seed(1)).unwrap();
    let step = |shift: f32| {
        let mut sum = 0.0;
        for (p, block) in texture.blocks.iter().enumerate() {
            let flat = &texture.flat.flats[p];
            for k in 0..flat.count {
                let Some(hinge) = texture.flat.hinges[p][k] else { continue };
                let at = flat.corners[k].midpoint(flat.corners[(k + 1) % flat.count]);
                let mine = block.map.transform_point2(at) + shift;
                let other = texture.blocks[hinge.polygon].map.transform_point2(hinge.unfolded.transform_point2(at));
                sum += (layer.bilinear(mine.x, mine.y) - layer.bilinear(other.x, other.y)).truncate().length();
            }
        }
        sum
    };
    assert!(step(0.0) < 0.85 * step(17.0), "{} {}", step(0.0), step(17.0));
}

#[test]
fn the_seed_decides_and_nothing_else() {
    let (mesh, exemplar) = (lumpy_ball(10, 1.0), leafy(48));
    let blocks = |seed| {
        synthesize(&mesh, &exemplar, 15.0, &[], &paper(), Seed(seed)).unwrap().blocks.iter().map(|b| b.corners).collect::<Vec<_>>()
    };
    assert_eq!(blocks(1), blocks(1));
    assert_ne!(blocks(1), blocks(2));
}

/// A photograph of the ball of radius 1 and centre (0, 2.5, 0): left half red, right half green, 100 pixels per metre.
fn portrait() -> (RgbImage, Mask, Mask) {
    let image = RgbImage::from_fn(300, 400, |x, _| if x < 150 { Rgb([200, 40, 40]) } else { Rgb([40, 160, 40]) });
    let crown = Mask::from_fn(300, 400, |x, y| (f64::from(x) - 149.5).hypot(f64::from(y) - 149.5) < 100.0);
    (image, crown, Mask::new(300, 400))
}

#[test]
fn the_front_shows_the_photograph_and_its_colours_run_on_round_the_crown() {
    let (image, crown, gaps) = portrait();
    let front = Front {
        image: &image,
        crown: &crown,
        gaps: &gaps,
        metres_per_px: 0.01,
        foot_px: DVec2::new(150.0, 400.0),
        axes: View::axes_from(0.0, 0.0),
        mean: None,
        delight: 0.0,
    };
    let mesh = lumpy_ball(20, 1.0);
    let texture = synthesize(&mesh, &leafy(64), 30.0, &[front], &SynthParams::default(), Seed(1)).unwrap();
    assert_eq!(total(&texture.counts), mesh.polygon_count());
    assert!((0.1..0.5).contains(&(texture.counts.front as f64 / mesh.polygon_count() as f64)), "{:?}", texture.counts);
    let layer = texture.fronts.get(0).unwrap();
    let (left, right) = (layer.sample(Vec3::new(-0.5, 2.5, 0.8)), layer.sample(Vec3::new(0.5, 2.5, 0.8)));
    assert!(
        (left.truncate() - Vec3::new(200.0, 40.0, 40.0)).length() < 3.0
            && (right.truncate() - Vec3::new(40.0, 160.0, 40.0)).length() < 3.0
    );
    for (p, block) in texture.blocks.iter().enumerate() {
        let flat = &texture.flat.flats[p];
        if block.source == BlockSource::Front(0) {
            assert!(flat.normal.z > 0.3 && flat.lift(flat.middle()).z > 0.0, "only what faced the camera");
        }
    }
    // Beside the photograph's rim the left of the crown is redder than the right.
    let mean_gain = |left: bool| {
        let near = |p: &usize| {
            let at = texture.flat.flats[*p].lift(texture.flat.flats[*p].middle());
            texture.blocks[*p].source == BlockSource::Exemplar
                && (0.0..0.5).contains(&at.z)
                && (at.x < -0.5) == left
                && at.x.abs() > 0.5
        };
        let gains: Vec<f32> = (0..texture.gains.len()).filter(near).map(|p| texture.gains[p].x / texture.gains[p].y).collect();
        gains.iter().sum::<f32>() / gains.len() as f32
    };
    assert!(mean_gain(true) > 2.0 * mean_gain(false), "{} {}", mean_gain(true), mean_gain(false));
}

#[test]
fn a_front_that_says_nothing_is_left_out() {
    let (image, crown, gaps) = portrait();
    let front = Front {
        image: &image,
        crown: &crown,
        gaps: &gaps,
        metres_per_px: 0.01,
        foot_px: DVec2::new(150.0, 400.0),
        axes: View::axes_from(0.0, 0.0),
        mean: None,
        delight: 0.5,
    };
    let none = Mask::new(300, 400);
    for broken in [
        Front { crown: &none, ..front },
        Front { gaps: &crown, ..front },
        Front { metres_per_px: 0.0, ..front },
        Front { foot_px: DVec2::NAN, ..front },
        Front { foot_px: DVec2::new(9e9, 0.0), ..front },
        Front { crown: &Mask::new(3, 3), ..front },
    ] {
        let texture = synthesize(&lumpy_ball(6, 1.0), &leafy(32), 10.0, &[broken], &SynthParams::default(), Seed(1)).unwrap();
        assert_eq!(texture.counts.front, 0);
    }
}
