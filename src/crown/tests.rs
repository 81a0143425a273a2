//! What a crown promises, on the shapes that break such promises: forks, columns, umbrellas, bays, specks, noise, and real masks.

use std::f64::consts::{PI, TAU};

use glam::DVec2;
use proptest::prelude::*;

use super::*;
use crate::files::shared_folder;
use crate::geom::Topology;
use crate::photo::silhouette::{self, SilhouetteParams};
use crate::raster::{Mask, fill_triangle};

/// A mask with its outline in metres: ten metres high, foot below the middle of the axis's lower end.
struct Subject {
    mask: Mask,
    outline: Outline,
    foot_px: DVec2,
    metres_per_px: f64,
}

impl Subject {
    fn new(crown: &Mask, tree: &Mask, azimuth_rad: f64) -> Self {
        let silhouette = silhouette::trace(crown, tree, &SilhouetteParams::default()).unwrap();
        let bounds = tree.bounds().unwrap();
        let foot_px = DVec2::new(silhouette.axis.base.x, f64::from(bounds.y + bounds.height));
        let metres_per_px = 10.0 / f64::from(bounds.height);
        // What one outline can hold: the largest region without its holes.
        let mut mask = Mask::new(crown.width(), crown.height());
        crate::raster::fill_polygon(&mut mask, &silhouette.contour);
        Self { mask, outline: Outline::from_silhouette(&silhouette, foot_px, metres_per_px, azimuth_rad), foot_px, metres_per_px }
    }

    /// The orthographic silhouette of the crowns from the outline's own azimuth.
    fn silhouette(&self, crowns: &[Crown], positions: impl Fn(&Crown) -> &[Vec3]) -> Mask {
        let mut mask = Mask::new(self.mask.width(), self.mask.height());
        let (sin, cos) = self.outline.azimuth_rad.sin_cos();
        for crown in crowns {
            let pixel = |p: Vec3| {
                let seen = DVec2::new(f64::from(p.x) * cos - f64::from(p.z) * sin, -f64::from(p.y));
                self.foot_px + seen / self.metres_per_px
            };
            for t in crown.mesh.triangulated() {
                fill_triangle(&mut mask, t.map(|i| pixel(positions(crown)[i as usize])));
            }
        }
        mask
    }

    /// How near the undisturbed and the disturbed crowns come to the mask, in IoU.
    fn fidelity(&self, crowns: &[Crown]) -> (f64, f64) {
        let of = |positions: fn(&Crown) -> &[Vec3]| self.mask.iou(&self.silhouette(crowns, positions));
        (of(|c| &c.cloud), of(|c| &c.disturbed))
    }

    /// IoU of the best star-shaped fit about the first crown's centre.
    fn bound(&self) -> f64 {
        let region = region_of(0, &self.outline).unwrap();
        star::Star::fit(&region, star::best_center(&region, 1.0), 1.0).iou(&region)
    }
}

fn shape(width: u32, height: u32, inside: impl Fn(f64, f64) -> bool) -> Mask {
    Mask::from_fn(width, height, |x, y| inside(f64::from(x) + 0.5, f64::from(y) + 0.5))
}

/// Names and masks of awkward crowns.
fn awkward() -> Vec<(&'static str, Mask)> {
    let disc = |x: f64, y: f64, cx: f64, cy: f64, r: f64| (x - cx).hypot(y - cy) < r;
    vec![
        ("round", shape(120, 120, move |x, y| disc(x, y, 60.0, 60.0, 50.0))),
        (
            "forked",
            shape(160, 200, |x, y| {
                let arm = (x - 80.0).abs() - (190.0 - y) * 0.35;
                (20.0..190.0).contains(&y) && (arm.abs() < 14.0 || (y > 150.0 && arm < 0.0))
            }),
        ),
        ("columnar", shape(40, 400, |x, y| (x - 20.0).abs() < 9.0 && (10.0..390.0).contains(&y))),
        ("umbrella", shape(240, 140, move |x, y| disc(x, y, 120.0, 130.0, 110.0) && !disc(x, y, 120.0, 165.0, 110.0))),
        ("bay", shape(160, 160, move |x, y| disc(x, y, 80.0, 80.0, 70.0) && !disc(x, y, 150.0, 80.0, 45.0))),
        ("flat", shape(300, 40, |x, y| ((x - 150.0) / 140.0).powi(2) + ((y - 20.0) / 12.0).powi(2) < 1.0)),
        ("leaning", shape(200, 200, |x, y| ((x - 100.0 - (100.0 - y) * 0.5) / 30.0).powi(2) + ((y - 100.0) / 90.0).powi(2) < 1.0)),
        ("cone", shape(120, 220, |x, y| (10.0..210.0).contains(&y) && (x - 60.0).abs() < (y - 10.0) * 0.22)),
        (
            "two lobes",
            shape(260, 140, move |x, y| {
                disc(x, y, 60.0, 70.0, 50.0)
                    || disc(x, y, 195.0, 60.0, 45.0)
                    || ((50.0..200.0).contains(&x) && (100.0..112.0).contains(&y))
            }),
        ),
        ("speck", shape(12, 12, |x, y| (2.0..10.0).contains(&x) && (2.0..10.0).contains(&y))),
        ("three pixels", shape(5, 5, |x, y| (1.0..4.0).contains(&x) && (1.0..4.0).contains(&y))),
    ]
}

/// Closed, manifold, outward, genus 0; every triangle of both clouds faces away from the centre.
fn check_promises(crown: &Crown) -> Result<(), String> {
    if !Topology::of(&crown.mesh).is_sphere() {
        return Err(format!("not a sphere: {:?}", Topology::of(&crown.mesh)));
    }
    for (name, positions) in [("undisturbed", &crown.cloud), ("disturbed", &crown.disturbed)] {
        for t in crown.mesh.triangulated() {
            let [a, b, c] = t.map(|i| (positions[i as usize] - crown.center).as_dvec3());
            if a.dot(b.cross(c)) <= 0.0 {
                return Err(format!("{name} triangle {t:?} does not face away from the centre"));
            }
        }
    }
    Ok(())
}

fn with_detail(detail: Detail) -> CrownParams {
    CrownParams { detail, ..CrownParams::default() }
}

#[test]
fn awkward_shapes_become_closed_stars_that_keep_their_outline() {
    for (name, mask) in awkward() {
        let subject = Subject::new(&mask, &mask, 0.0);
        for detail in [Detail::Low, Detail::Medium, Detail::High] {
            let crowns = build(std::slice::from_ref(&subject.outline), &with_detail(detail), Seed(5))
                .unwrap_or_else(|e| panic!("{name}, {detail:?}: {e}"));
            for crown in &crowns {
                check_promises(crown).unwrap_or_else(|e| panic!("{name}, {detail:?}: {e}"));
            }
            let polygons: usize = crowns.iter().map(|c| c.mesh.polygon_count()).sum();
            let wanted = detail.polygons() as f64;
            assert!((0.7 * wanted..1.25 * wanted).contains(&(polygons as f64)), "{name}, {detail:?}: {polygons} polygons");
            if detail == Detail::Medium && mask.count() > 100 {
                let (smooth, rough) = subject.fidelity(&crowns);
                let bound = subject.bound();
                assert!(smooth >= 0.95 * bound && rough >= 0.9 * bound, "{name}: {smooth:.3} and {rough:.3}, star {bound:.3}");
            }
        }
    }
}

#[test]
fn most_polygons_are_quads() {
    let mask = &awkward()[0].1;
    let crowns = build(&[Subject::new(mask, mask, 0.0).outline], &CrownParams::default(), Seed(1)).unwrap();
    let mesh = &crowns[0].mesh;
    assert!(mesh.quads.len() > 7 * mesh.triangles.len(), "{} quads, {} triangles", mesh.quads.len(), mesh.triangles.len());
}

#[test]
fn separate_lobes_become_separate_crowns() {
    let crowns_of = |name: &str, lobe_split: f64| {
        let mask = awkward().into_iter().find(|(n, _)| *n == name).unwrap().1;
        let params = CrownParams { lobe_split, ..CrownParams::default() };
        build(&[Subject::new(&mask, &mask, 0.0).outline], &params, Seed(1)).unwrap()
    };
    assert_eq!(crowns_of("round", 0.05).len(), 1);
    assert_eq!(crowns_of("umbrella", 0.05).len(), 3);
    let two = crowns_of("two lobes", 0.05);
    assert_eq!(two.len(), 2);
    assert!((two[0].center.x - two[1].center.x).abs() > 3.0);
    assert_eq!(crowns_of("two lobes", 1.0).len(), 1);
}

#[test]
fn the_profile_is_the_outline_left_and_right() {
    // A half disc on the left, a square on the right: nothing symmetric can show both.
    let mask =
        shape(200, 200, |x, y| if x < 100.0 { (x - 100.0).hypot(y - 100.0) < 80.0 } else { x < 150.0 && (y - 100.0).abs() < 80.0 });
    let subject = Subject::new(&mask, &mask, 0.0);
    let crowns = build(std::slice::from_ref(&subject.outline), &CrownParams::default(), Seed(1)).unwrap();
    let (smooth, _) = subject.fidelity(&crowns);
    assert!(smooth > 0.97, "{smooth}");
    // From behind, left and right change places.
    let behind = Subject { outline: Outline { azimuth_rad: PI, ..subject.outline.clone() }, ..Subject::new(&mask, &mask, PI) };
    let mirrored = behind.silhouette(&crowns, |c| &c.cloud);
    assert!(mirrored.iou(&subject.mask) < 0.9);
}

#[test]
fn same_seed_same_crown_other_seed_other_crown() {
    let mask = &awkward()[1].1;
    let outline = [Subject::new(mask, mask, 0.0).outline];
    let of = |seed| build(&outline, &CrownParams::default(), Seed(seed)).unwrap();
    // Not assert_eq: it would print thousands of points.
    assert!(of(1)[0].mesh == of(1)[0].mesh);
    assert!(of(1)[0].cloud == of(2)[0].cloud);
    assert!(of(1)[0].mesh != of(2)[0].mesh);
}

#[test]
fn without_disturbance_every_point_stays_where_the_outlines_put_it() {
    let mask = &awkward()[0].1;
    let outline = Subject::new(mask, mask, 0.0).outline;
    let of = |disturb: f64| {
        build(std::slice::from_ref(&outline), &CrownParams { disturb, ..with_detail(Detail::Low) }, Seed(1)).unwrap().remove(0)
    };
    let (still, usual, wild) = (of(0.0), of(1.0), of(2.0));
    assert_eq!(still.cloud, still.disturbed);
    let moved = |crown: &Crown| crown.cloud.iter().zip(&crown.disturbed).map(|(a, b)| a.distance(*b)).sum::<f32>();
    assert!(0.0 < moved(&usual) && 1.3 * moved(&usual) < moved(&wild), "{} {}", moved(&usual), moved(&wild));
}

#[test]
fn unusable_outlines_are_errors() {
    let mask = &awkward()[0].1;
    let good = Subject::new(mask, mask, 0.0).outline;
    let params = CrownParams::default();
    let with = |contour: Vec<DVec2>| Outline { contour, ..good.clone() };
    for bad in [vec![], vec![DVec2::ONE], vec![DVec2::ZERO, DVec2::X], vec![DVec2::NAN, DVec2::X, DVec2::Y]] {
        assert!(matches!(build(&[with(bad.clone())], &params, Seed(1)), Err(Error::Outline { .. })), "{bad:?}");
        assert!(matches!(build(&[good.clone(), with(bad)], &params, Seed(1)), Err(Error::Outline { view: 1, .. })));
    }
    assert!(matches!(build(&[], &params, Seed(1)), Err(Error::Outline { .. })));
    let wild = CrownParams { edfp_radial: 9.0, ..params };
    assert!(matches!(build(&[good], &wild, Seed(1)), Err(Error::Parameter { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn random_masks_keep_every_promise(
        radii in proptest::collection::vec(2.0f64..40.0, 5..24), squash in 0.2f64..3.0, noise in any::<u64>(), disturb in 0.0f64..0.5, turns in 0usize..3,
    ) {
        let mask = Mask::from_fn(100, 100, |x, y| {
            let d = DVec2::new(f64::from(x) - 50.0, (f64::from(y) - 50.0) * squash);
            let at = (d.to_angle() / TAU).rem_euclid(1.0) * radii.len() as f64;
            let hole = Seed(noise).keyed("hole", u64::from(x / 3 + 100 * (y / 3))).unit() < 0.15;
            d.length() < radii[at as usize % radii.len()] && (!hole || d.length() < 3.0)
        });
        if let Ok(silhouette) = silhouette::trace(&mask, &mask, &SilhouetteParams::default()) {
            let of = |azimuth: f64| Outline::from_silhouette(&silhouette, DVec2::new(50.0, 100.0), 0.1, azimuth);
            let outlines: Vec<Outline> = (0..=turns).map(|i| of(1.1 * i as f64)).collect();
            let params = CrownParams { edfp_radial: disturb, edfp_along: 2.0 * disturb, edfp_around: 1.0, ..with_detail(Detail::Low) };
            let crowns = build(&outlines, &params, Seed(noise)).unwrap();
            prop_assert!(!crowns.is_empty() && crowns.len() <= 5);
            for crown in &crowns {
                let kept = check_promises(crown);
                prop_assert!(kept.is_ok(), "{}", kept.unwrap_err());
            }
        }
    }
}

/// A mask picture, or a visible skip.
fn shared_mask(path: &str) -> Option<Mask> {
    let Some(folder) = shared_folder() else {
        println!("SKIPPED: {path} is not there; set SPHEREBOARD_SHARED to the shared folder");
        return None;
    };
    Some(Mask::from_gray(&image::open(folder.join("photos").join(path)).unwrap().to_luma8()))
}

#[test]
fn real_masks_keep_their_outline() {
    for name in ["tdus_zelkova_s5", "tdus_ginkgo_h6", "tdus_cedrus_deodara_v13", "tdus_michelia_chapensis_hq"] {
        let Some(crown) = shared_mask(&format!("pairs/{name}_crown.png")) else { return };
        let tree = shared_mask(&format!("pairs/{name}_mask.png")).unwrap();
        let subject = Subject::new(&crown, &tree, 0.0);
        let crowns = build(std::slice::from_ref(&subject.outline), &CrownParams::default(), Seed(1)).unwrap();
        let ((smooth, rough), bound) = (subject.fidelity(&crowns), subject.bound());
        crowns.iter().for_each(|c| check_promises(c).unwrap());
        assert!(smooth >= 0.95 * bound && rough >= 0.9 * bound, "{name}: {smooth:.3} and {rough:.3}, star {bound:.3}");
    }
}

#[test]
fn two_photographs_of_one_cedar_are_both_kept() {
    // The second photograph was taken from the other side of the road: what stands left in one stands right in the other.
    let views = [("A", 0.0), ("B", PI)].map(|(view, azimuth)| {
        shared_mask(&format!("multiview/tdus_cedar_2views/view{view}_mask.png")).map(|tree| {
            let crown = without_trunk(&tree);
            Subject::new(&crown, &tree, azimuth)
        })
    });
    let [Some(a), Some(b)] = views else { return };
    let crowns = build(&[a.outline.clone(), b.outline.clone()], &CrownParams::default(), Seed(1)).unwrap();
    check_promises(&crowns[0]).unwrap();
    for (name, view) in [("A", &a), ("B", &b)] {
        let (smooth, rough) = view.fidelity(&crowns);
        println!("cedar view {name}: undisturbed {smooth:.3}, disturbed {rough:.3}");
        assert!(smooth >= 0.88 && rough >= 0.88, "view {name}: {smooth:.3}, {rough:.3}");
    }
}

#[test]
fn a_view_from_the_side_shapes_the_depth() {
    // Wide from the front, slim from the right, and no two halves alike.
    let front = shape(220, 220, |x, y| (20.0..200.0).contains(&y) && (x - 110.0).abs() < 90.0 - 0.3 * (y - 20.0));
    let right = shape(220, 220, |x, y| (20.0..200.0).contains(&y) && (x - 110.0).abs() < 25.0 + 0.1 * (y - 20.0));
    let views = [Subject::new(&front, &front, 0.0), Subject::new(&right, &right, PI / 2.0)];
    let crowns = build(&[views[0].outline.clone(), views[1].outline.clone()], &CrownParams::default(), Seed(1)).unwrap();
    for view in &views {
        let (smooth, rough) = view.fidelity(&crowns);
        assert!(smooth > 0.95 && rough > 0.92, "azimuth {}: {smooth:.3}, {rough:.3}", view.outline.azimuth_rad);
    }
}

/// The mask without its rows' slim runs below the middle: the trunk.
fn without_trunk(tree: &Mask) -> Mask {
    let bounds = tree.bounds().unwrap();
    let slim = bounds.width as i64 / 8;
    Mask::from_fn(tree.width(), tree.height(), |x, y| {
        let (x, y) = (i64::from(x), i64::from(y));
        let reach = |step: i64| (1..=slim).take_while(|k| tree.get(x + k * step, y)).count() as i64;
        tree.get(x, y) && (y < i64::from(bounds.y + bounds.height / 2) || reach(1) + reach(-1) >= slim)
    })
}

#[test]
fn twelve_views_of_a_thin_plant_do_not_break() {
    let mut outlines = Vec::new();
    for degrees in (0..360).step_by(30) {
        let Some(folder) = shared_folder() else { return println!("SKIPPED: set SPHEREBOARD_SHARED to the shared folder") };
        let path = folder.join(format!("photos/multiview/phenomenal_maize/bin_side_{degrees}.png"));
        let mask = Mask::from_gray(&image::open(path).unwrap().to_luma8());
        outlines.push(Subject::new(&mask, &mask, f64::from(degrees).to_radians()).outline);
    }
    let crowns = build(&outlines, &CrownParams::default(), Seed(1)).unwrap();
    crowns.iter().for_each(|c| check_promises(c).unwrap());
}
