use super::*;
use crate::Seed;
use image::{Rgb, RgbImage};
use palette::Lab;
use palette::color_difference::Ciede2000 as _;

/// A leafy disc with a trunk up its middle, a shaded left half and a bay of sky at its right.
fn painted(size: u32) -> (Photo, Mask, Mask) {
    let noise = |x: u32, y: u32| Seed(3).keyed("painted", u64::from(y) << 32 | u64::from(x)).unit();
    let at = |v: u32| (f64::from(v) + 0.5) / f64::from(size) - 0.5;
    let sky = |x: u32, y: u32| noise(x / 3 + 7000, y / 3) < 0.06 || (at(x) > 0.25 && at(y).abs() < 0.08);
    let image = RgbImage::from_fn(size, size, |x, y| {
        let v = 0.6 * noise(x, y) + 0.4 * noise(5000 + x / 3, y / 3);
        let shade = if at(x) < 0.0 { 0.7 } else { 1.0 };
        if sky(x, y) {
            Rgb([170, 200, 240])
        } else if at(x).abs() < 0.05 && at(y) > 0.0 {
            Rgb([100, 70, 50])
        } else {
            Rgb([(shade * (40.0 + 80.0 * v)) as u8, (shade * (70.0 + 130.0 * v)) as u8, (shade * (20.0 + 40.0 * v)) as u8])
        }
    });
    let crown = Mask::from_fn(size, size, |x, y| at(x).hypot(at(y)) < 0.47);
    let gaps = Mask::from_fn(size, size, |x, y| crown.get(i64::from(x), i64::from(y)) && sky(x, y));
    (Photo { image, opaque: None }, crown, gaps)
}

#[test]
fn the_window_lies_in_foliage_and_has_the_crowns_colour() {
    for size in [90, 400, 900] {
        let (photo, crown, gaps) = painted(size);
        let exemplar = choose(&photo, &crown, &gaps, 0.5, &ExemplarParams::default()).unwrap();
        let w = exemplar.window_px;
        let inside = (w.y..w.y + w.height).flat_map(|y| (w.x..w.x + w.width).map(move |x| (x, y)));
        let (all, gap) =
            (f64::from(w.width * w.height), inside.clone().filter(|&(x, y)| gaps.get(x.into(), y.into())).count() as f64);
        assert!(inside.filter(|&(x, y)| crown.get(x.into(), y.into())).count() as f64 > 0.97 * all);
        assert!(gap / all < 0.12, "{size}: the bay is avoided, {gap} of {all}");
        let trunk = |x: u32| (f64::from(x) / f64::from(size) - 0.5).abs() < 0.05;
        let bark = (w.x..w.x + w.width).filter(|&x| trunk(x)).count() as f64
            * f64::from((w.y + w.height).saturating_sub(size / 2).min(w.height));
        assert!(bark / all < 0.1, "{size}: the trunk is avoided, {w:?}");
        assert!(f64::from(w.width) > 0.14 * f64::from(size), "{size}: {w:?}");
        assert!(exemplar.delta_e < 1.5, "{size}: ΔE2000 {}", exemplar.delta_e);
    }
}

#[test]
fn the_colour_difference_is_the_mean_colours_own() {
    let (photo, crown, gaps) = painted(200);
    let exemplar = choose(&photo, &crown, &gaps, 1.0, &ExemplarParams::default()).unwrap();
    let foliage = encoded_mean(&photo.image, &crown, &gaps).unwrap();
    assert_eq!(exemplar.delta_e, color_difference(opaque_mean(&exemplar.image).unwrap(), foliage));
    // Sharma, Wu & Dalal 2005, table 1, pairs 1 and 21: Lab to ΔE2000.
    let pairs = [([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425), ([50.0, 2.5, 0.0], [50.0, 3.2592, 0.3350], 1.0)];
    for (a, b, expected) in pairs {
        let [a, b] = [a, b].map(|[l, a, b]: [f32; 3]| Lab::<palette::white_point::D65>::new(l, a, b));
        assert!((a.difference(b) - expected).abs() < 1e-3);
    }
    assert!(color_difference(Vec3::new(60.0, 120.0, 40.0), Vec3::new(75.0, 120.0, 40.0)) > 2.0);
}

#[test]
fn gaps_become_transparent_within_their_limit_and_foliage_bleeds_under_them() {
    let (photo, crown, gaps) = painted(300);
    let params = ExemplarParams { gap_limit: 0.02, ..ExemplarParams::default() };
    let open = |e: &Exemplar| e.image.pixels().filter(|p| p[3] < 128).count() as f64 / f64::from(e.image.width().pow(2));
    let free = choose(&photo, &crown, &gaps, 1.0, &ExemplarParams::default()).unwrap();
    let tight = choose(&photo, &crown, &gaps, 1.0, &params).unwrap();
    assert!(open(&free) > 0.03 && open(&tight) <= 0.02, "{} {}", open(&free), open(&tight));
    assert!(free.image.pixels().all(|p| p[2] < 130), "no sky blue under the gaps");
    // The painted gaps are spread evenly, so that the core has about as many as the whole.
    let whole = gaps.count() as f64 / crown.count() as f64;
    assert!((free.gap_fraction - whole).abs() < 0.2 * whole, "{} for {whole}", free.gap_fraction);
}

#[test]
fn texels_are_as_dense_as_asked_for() {
    let (photo, crown, gaps) = painted(300);
    for scale in [0.25, 0.7, 1.0, 1.8] {
        let e = choose(&photo, &crown, &gaps, scale, &ExemplarParams::default()).unwrap();
        assert!((f64::from(e.image.width()) - scale * f64::from(e.window_px.width)).abs() <= 0.5);
        assert!((e.scale - scale).abs() < 0.03, "{} for {scale}", e.scale);
    }
}

#[test]
fn tiny_crowns_work_and_empty_ones_are_refused() {
    let params = ExemplarParams::default();
    for size in [2u32, 3, 5, 9, 17] {
        let photo = Photo { image: RgbImage::from_pixel(size, size, Rgb([60, 120, 40])), opaque: None };
        let e = choose(&photo, &Mask::from_fn(size, size, |_, _| true), &Mask::new(size, size), 1.0, &params).unwrap();
        assert!(e.image.pixels().all(|p| p[3] == 255 && p[1].abs_diff(120) <= 1), "{size}");
        let line = Mask::from_fn(size, size, |x, _| x == 1);
        assert_eq!(choose(&photo, &line, &Mask::new(size, size), 1.0, &params).is_ok(), size >= 4);
        let all = Mask::from_fn(size, size, |_, _| true);
        assert!(matches!(choose(&photo, &all, &all, 1.0, &params), Err(Error::Exemplar { .. })));
        assert!(matches!(choose(&photo, &Mask::new(size, size), &all, 1.0, &params), Err(Error::Exemplar { .. })));
        assert!(matches!(choose(&photo, &Mask::new(size + 1, size), &all, 1.0, &params), Err(Error::Exemplar { .. })));
        assert!(matches!(choose(&photo, &all, &Mask::new(size, size), f64::NAN, &params), Err(Error::Parameter { .. })));
    }
}
