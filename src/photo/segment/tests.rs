//! Segmentation as a whole: what is found, what hints change, what is refused.

use image::{Rgb, RgbImage};
use proptest::prelude::*;

use super::*;
use crate::Seed;

/// A round crown of the given colour on a trunk, lawn below, sky above: 180×240 pixels, crown centre (90, 90), radius 55.
fn painted(leaf: [u8; 3]) -> Photo {
    let image = RgbImage::from_fn(180, 240, |x, y| {
        let mut draws = Seed(5).keyed("pixel", u64::from(y) * 180 + u64::from(x));
        let light = draws.signed();
        let shade = |c: [u8; 3], depth: f64| Rgb(c.map(|v| (f64::from(v) * (1.0 + depth * light)).clamp(0.0, 255.0) as u8));
        if in_crown(x, y) {
            shade(leaf, 0.45)
        } else if (86..94).contains(&x) && (140..205).contains(&y) {
            shade([70, 55, 45], 0.1)
        } else if y > 195 {
            shade([120, 150, 70], 0.08)
        } else {
            shade([150, 190, 240], 0.01)
        }
    });
    Photo { image, opaque: None }
}

fn in_crown(x: u32, y: u32) -> bool {
    (f64::from(x) - 90.0).hypot(f64::from(y) - 90.0) < 55.0
}

fn truth() -> Mask {
    Mask::from_fn(180, 240, in_crown)
}

fn auto(photo: &Photo, hints: &Hints) -> Result<Segmentation> {
    segment(photo, &SegmentParams::default(), hints)
}

fn hsv(photo: &Photo, hints: &Hints) -> Result<Segmentation> {
    segment(photo, &SegmentParams { method: Method::Hsv, ..SegmentParams::default() }, hints)
}

fn message(result: Result<Segmentation>) -> String {
    result.expect_err("a refusal").to_string()
}

#[test]
fn a_painted_crown_is_found_in_every_season() {
    for leaf in [[60, 120, 40], [190, 150, 30], [170, 50, 40], [120, 80, 40]] {
        let found = auto(&painted(leaf), &Hints::default()).expect("a crown");
        let iou = found.crown.iou(&truth());
        assert!(iou > 0.9, "{leaf:?}: {iou:.3}");
    }
}

#[test]
fn crown_trunk_and_gaps_fit_together() {
    let found = auto(&painted([60, 120, 40]), &Hints::default()).expect("a crown");
    assert_eq!(found.crown.zip(&found.tree, |c, t| c && !t).count(), 0, "the tree holds the crown");
    assert_eq!(found.gaps.zip(&found.crown, |g, c| g && !c).count(), 0, "gaps lie in the crown");
    assert!(found.tree.get(90, 170), "the trunk belongs to the tree");
    assert!(!found.crown.get(90, 180), "the trunk does not belong to the crown");
    assert!(!found.tree.get(40, 220), "the lawn belongs to neither");
}

#[test]
fn the_papers_method_takes_green_and_says_what_else_it_saw() {
    let found = hsv(&painted([40, 120, 50]), &Hints::default()).expect("a crown");
    assert!(found.crown.iou(&truth()) > 0.95);
    let said = message(hsv(&painted([170, 50, 40]), &Hints::default()));
    assert!(said.contains("red") && said.contains("--hue -25..35"), "{said}");
    let red = Hints { hue_deg: Some((-25.0, 35.0)), ..Hints::default() };
    assert!(hsv(&painted([170, 50, 40]), &red).expect("a crown").crown.iou(&truth()) > 0.9);
    assert!(hsv(&painted([170, 40, 60]), &red).expect("a crown").crown.iou(&truth()) > 0.9, "reds below 0° too");
}

#[test]
fn hints_bind() {
    let photo = painted([60, 120, 40]);
    let rect = Rect { x: 30, y: 30, width: 60, height: 130 };
    for method in [Method::Auto, Method::Hsv] {
        let params = SegmentParams { method, ..SegmentParams::default() };
        let found = segment(&photo, &params, &Hints { rect: Some(rect), hue_deg: Some((60.0, 150.0)), ..Hints::default() })
            .expect("a crown");
        let b = found.crown.bounds().expect("not empty");
        assert!(b.x >= 30 && b.x + b.width <= 90, "{method:?}: {b:?} leaves the rectangle");
    }
    let excluded = Hints { exclude: vec![(40, 90)], ..Hints::default() };
    assert!(auto(&photo, &excluded).is_ok_and(|s| !s.crown.get(40, 90)));
    let given = Mask::from_fn(180, 240, |x, y| x < 50 && y < 50 || x == 170 && y == 200);
    let found = auto(&photo, &Hints { mask: Some(given), ..Hints::default() }).expect("the mask as given");
    assert_eq!(found.crown, Mask::from_fn(180, 240, |x, y| x < 50 && y < 50));
}

#[test]
fn points_choose_among_the_papers_components() {
    let two = RgbImage::from_fn(200, 100, |x, y| {
        let near = |cx: f64, r: f64| (f64::from(x) - cx).hypot(f64::from(y) - 50.0) < r;
        if near(50.0, 40.0) || near(150.0, 30.0) { Rgb([40, 120, 50]) } else { Rgb([150, 190, 240]) }
    });
    let photo = Photo { image: two, opaque: None };
    let crown = |include: &[(u32, u32)], exclude: &[(u32, u32)]| {
        hsv(&photo, &Hints { include: include.to_vec(), exclude: exclude.to_vec(), ..Hints::default() })
    };
    let sides = |s: Result<Segmentation>| s.map(|s| (s.crown.get(30, 50), s.crown.get(150, 50))).expect("a crown");
    assert_eq!(sides(crown(&[], &[])), (true, false), "the larger");
    assert_eq!(sides(crown(&[(150, 50)], &[])), (false, true), "the one with the point");
    assert_eq!(sides(crown(&[(150, 50), (50, 50)], &[])), (true, true), "both");
    assert_eq!(sides(crown(&[], &[(50, 50)])), (false, true), "the one without the point");
    let pierced = crown(&[(30, 50)], &[(60, 50)]).expect("a crown").crown;
    assert!(pierced.get(30, 50) && !pierced.get(60, 50) && pierced.get(75, 50), "a disc goes");
    let said = message(crown(&[(100, 5)], &[]));
    assert!(said.contains("--include must be on a patch") && said.contains("100,5, where there is none"), "{said}");
    assert!(message(crown(&[], &[(50, 50), (150, 50)])).contains("that no --exclude point removes"));
}

#[test]
fn specks_of_sky_are_gaps_and_bright_leaves_are_not() {
    let mut photo = painted([60, 120, 40]);
    let (sky, leaf) = (Rgb([150, 190, 240]), Rgb([170, 210, 90]));
    let speck = |x: u32, y: u32| x % 9 < 2 && y % 9 < 2;
    let heart = |x: u32, y: u32| (f64::from(x) - 90.0).hypot(f64::from(y) - 90.0) < 45.0;
    for (x, _, p) in photo.image.enumerate_pixels_mut().filter(|(x, y, _)| heart(*x, *y) && speck(*x, *y)) {
        *p = if x < 90 { sky } else { leaf };
    }
    let gaps = auto(&photo, &Hints::default()).expect("a crown").gaps;
    let share = |left: bool| {
        let of = Mask::from_fn(180, 240, |x, y| heart(x, y) && speck(x, y) && (x < 90) == left);
        of.zip(&gaps, |a, b| a && b).count() as f64 / of.count() as f64
    };
    assert!(share(true) > 0.9 && share(false) < 0.05, "{} {}", share(true), share(false));
}

#[test]
fn a_thin_trunk_is_found_with_its_width_and_foot() {
    for (x0, width) in [(88, 4), (85, 10)] {
        let mut photo = painted([60, 120, 40]);
        for (x, y, p) in photo.image.enumerate_pixels_mut().filter(|(_, y, _)| (144..205).contains(y)) {
            *p = if (x0..x0 + width).contains(&x) && y < 200 {
                Rgb([70, 55, 45])
            } else if y > 195 {
                Rgb([120, 150, 70])
            } else {
                Rgb([150, 190, 240])
            };
        }
        let found = auto(&photo, &Hints::default()).expect("a crown");
        let cues = crate::photo::trunk::find(&photo.image, &found.crown, &found.tree).expect("a trunk");
        assert!((cues.width_px - f64::from(width)).abs() <= 2.0, "{cues:?}");
        assert!((cues.foot_px.y - 200.0).abs() <= 5.0 && (cues.foot_px.x - f64::from(x0 + width / 2)).abs() <= 2.0, "{cues:?}");
        assert!(cues.bark.iter().zip([70, 55, 45]).all(|(a, b)| a.abs_diff(b) < 12), "{cues:?}");
    }
}

#[test]
fn a_trunk_lit_from_one_side_is_found_whole() {
    let mut photo = painted([60, 120, 40]);
    for (x, _, p) in photo.image.enumerate_pixels_mut().filter(|(x, y, _)| (82..98).contains(x) && (140..205).contains(y)) {
        *p = if x < 90 { Rgb([55, 42, 35]) } else { Rgb([135, 110, 90]) };
    }
    let found = auto(&photo, &Hints::default()).expect("a crown");
    let cues = crate::photo::trunk::find(&photo.image, &found.crown, &found.tree).expect("a trunk");
    // Not its bright or its dark half, eight pixels wide.
    assert!((11.0..=18.0).contains(&cues.width_px) && (cues.foot_px.x - 90.0).abs() <= 2.0, "{cues:?}");
}

#[test]
fn a_crown_that_fills_the_frame_shows_the_sky_only_through_its_gaps() {
    let in_gap = |x: u32, y: u32| x % 30 < 6 && y % 30 < 8;
    let gaps_of = |leaf: [u8; 3], sky: [u8; 3]| {
        let image = RgbImage::from_fn(180, 240, |x, y| {
            let shade = (7 * x + 13 * y + x * y) % 40;
            let colour = if y >= 200 { [120, 100, 70] } else { leaf };
            Rgb(if y < 200 && in_gap(x, y) { sky } else { colour.map(|v| v - shade as u8) })
        });
        let mask = Mask::from_fn(180, 240, |_, y| y < 200);
        let found = auto(&Photo { image, opaque: None }, &Hints { mask: Some(mask), ..Hints::default() }).expect("a crown");
        found.gaps
    };
    let truth = Mask::from_fn(180, 240, |x, y| y < 200 && in_gap(x, y));
    for sky in [[120, 170, 230], [250, 250, 250]] {
        let found = gaps_of([70, 120, 50], sky);
        assert!(found.iou(&truth) > 0.8, "{sky:?}: {:.2}", found.iou(&truth));
    }
    // The grey-green of a blue spruce is no sky, nor is bark between its twigs.
    assert_eq!(gaps_of([140, 165, 160], [90, 80, 70]).count(), 0);
}

#[test]
fn a_cut_outs_background_is_never_crown() {
    let half = Mask::from_fn(180, 240, |x, y| x < 90 && y < 200);
    let found = auto(&Photo { opaque: Some(half.clone()), ..painted([60, 120, 40]) }, &Hints::default()).expect("a crown");
    assert_eq!(found.crown.zip(&half, |c, o| c && !o).count(), 0);
}

#[test]
fn contradictions_are_refused_with_what_to_do() {
    let photo = painted([60, 120, 40]);
    let none = Hints::default;
    for (hints, words) in [
        (Hints { hue_deg: Some((150.0, 90.0)), ..none() }, "--hue must be LO..HI with -180 ≤ LO ≤ HI ≤ 360 degrees"),
        (Hints { hue_deg: Some((f64::NAN, 90.0)), ..none() }, "--hue must be"),
        (Hints { include: vec![(180, 3)], ..none() }, "--include must be inside the picture of 180×240 pixels, but is 180,3"),
        (Hints { exclude: vec![(0, 240)], ..none() }, "--exclude must be inside"),
        (Hints { rect: Some(Rect { x: 170, y: 0, width: 11, height: 5 }), ..none() }, "--rect must be"),
        (Hints { rect: Some(Rect { x: 0, y: 0, width: 0, height: 5 }), ..none() }, "--rect must be"),
        (Hints { mask: Some(Mask::new(180, 239)), ..none() }, "the mask has 180×239 pixels, but 180×240 were expected"),
        (Hints { mask: Some(Mask::new(180, 240)), ..none() }, "--mask must be"),
    ] {
        let said = message(auto(&photo, &hints));
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn pictures_without_a_crown_are_refused() {
    let flat = |w, h| Photo { image: RgbImage::from_pixel(w, h, Rgb([90, 140, 60])), opaque: None };
    assert!(matches!(auto(&flat(1, 1), &Hints::default()), Err(Error::PictureTooSmall { width: 1, height: 1 })));
    assert!(matches!(auto(&flat(64, 64), &Hints::default()), Err(Error::NothingToSee { what: "one colour" })));
    let sky = RgbImage::from_fn(120, 160, |_, y| Rgb([120 + (y / 2) as u8, 170 + (y / 3) as u8, 250]));
    assert!(matches!(auto(&Photo { image: sky, opaque: None }, &Hints::default()), Err(Error::NothingToSee { what: "sky" })));
    let blue = message(auto(&painted([40, 60, 150]), &Hints::default()));
    assert!(blue.contains("no foliage found") && blue.contains("--hue") && blue.contains("--mask"), "{blue}");
}

#[test]
fn a_crown_at_the_frame_and_a_tiny_one_are_told() {
    let whole = painted([60, 120, 40]).image;
    let photo = Photo { image: image::imageops::crop_imm(&whole, 80, 0, 100, 240).to_image(), opaque: None };
    let codes = |s: Segmentation| s.warnings.into_iter().map(|w| w.code).collect::<Vec<_>>();
    let mask = Mask::from_fn(100, 240, |x, y| in_crown(x + 80, y));
    assert_eq!(codes(auto(&photo, &Hints { mask: Some(mask), ..Hints::default() }).expect("a crown")), ["crown-cut-by-frame"]);
    let speck = Mask::from_fn(100, 240, |x, y| (50..55).contains(&x) && (50..60).contains(&y));
    assert_eq!(codes(auto(&photo, &Hints { mask: Some(speck), ..Hints::default() }).expect("a crown")), ["small-crown"]);
}

#[test]
fn the_leafless_tree_is_refused_and_autumn_is_not() {
    let Some(folder) = crate::files::shared_folder().map(|f| f.join("photos/single")) else {
        println!("SKIPPED: no shared photographs");
        return;
    };
    let open = |name: &str| Photo { image: image::open(folder.join(name)).expect("a shared photograph").to_rgb8(), opaque: None };
    assert!(matches!(auto(&open("leafless_tree_negative.jpg"), &Hints::default()), Err(Error::Leafless)));
    for name in ["acer_rubrum_13.jpg", "acer_saccharinum_16.jpg", "quercus_alba_38.jpg", "../pairs/tdus_prunus_v10.png"] {
        assert!(auto(&open(name), &Hints::default()).is_ok(), "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn no_picture_and_no_hint_panics_and_answers_repeat(
        (w, h) in (1u32..90, 1u32..90),
        seed in any::<u64>(),
        tones in 1usize..40,
        method in prop_oneof![Just(Method::Auto), Just(Method::Hsv)],
        rect in proptest::option::of((0u32..100, 0u32..100, 0u32..100, 0u32..100)),
        include in proptest::collection::vec((0u32..90, 0u32..90), 0..3),
        exclude in proptest::collection::vec((0u32..90, 0u32..90), 0..3),
        hue in proptest::option::of((-190.0..370.0, -190.0..370.0)),
        (masked, cut_out) in (any::<bool>(), any::<bool>()),
        (opening_px, closing_px) in (0u32..=200, 0u32..=200),
    ) {
        let mut draws = Seed(seed).keyed("picture", 0);
        let palette: Vec<[u8; 3]> = (0..tones).map(|_| std::array::from_fn(|_| draws.below(256) as u8)).collect();
        let block = 1 + draws.below(20) as u32;
        let image = RgbImage::from_fn(w, h, |x, y| Rgb(palette[((x / block) * 7 + (y / block) * 13) as usize % tones]));
        let spots = |draws: &mut crate::seed::Draws| Mask::from_fn(w, h, |_, _| draws.below(2) == 0);
        let photo = Photo { image, opaque: cut_out.then(|| spots(&mut draws)) };
        let hints = Hints {
            rect: rect.map(|(x, y, width, height)| Rect { x, y, width, height }),
            include,
            exclude,
            mask: masked.then(|| spots(&mut draws)),
            hue_deg: hue,
        };
        let params = SegmentParams { method, opening_px, closing_px };
        let (a, b) = (segment(&photo, &params, &hints), segment(&photo, &params, &hints));
        match (a, b) {
            (Ok(a), Ok(b)) => {
                prop_assert!(a.crown.count() > 0 && a.crown == b.crown && a.tree == b.tree && a.gaps == b.gaps);
                prop_assert_eq!(a.gaps.zip(&a.crown, |g, c| g && !c).count(), 0);
            }
            (Err(a), Err(b)) => prop_assert_eq!(a.to_string(), b.to_string()),
            _ => prop_assert!(false, "one run failed, the other did not"),
        }
    }
}
