//! Decoding photographs: every accepted kind gives the same colours, upright; everything else gives its own message.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageFormat, Rgb, RgbImage};
use moxcms::ColorProfile;
use proptest::prelude::*;
use sphereboard::Error;
use sphereboard::photo::decode::{DecodeParams, decode, decode_bytes};

/// Six columns of colour, 8 px wide, and a white patch in the top left corner: no two orientations look alike.
const COLOURS: [[u8; 3]; 6] = [[200, 40, 30], [60, 140, 40], [40, 60, 180], [230, 220, 120], [128, 128, 128], [0, 0, 0]];

fn patches() -> RgbImage {
    RgbImage::from_fn(48, 32, |x, y| Rgb(if x < 8 && y < 8 { [255; 3] } else { COLOURS[x as usize / 8] }))
}

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("the encoder takes this kind of pixels");
    bytes.into_inner()
}

/// A JPEG whose colours survive well enough to compare.
fn jpeg(exif: Option<Vec<u8>>) -> Vec<u8> {
    jpeg_with(exif, None)
}

fn jpeg_with(exif: Option<Vec<u8>>, profile: Option<Vec<u8>>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 98);
    if let Some(exif) = exif {
        encoder.set_exif_metadata(exif).expect("JPEG carries EXIF");
    }
    if let Some(profile) = profile {
        encoder.set_icc_profile(profile).expect("JPEG carries ICC profiles");
    }
    encoder.write_image(&patches(), 48, 32, ExtendedColorType::Rgb8).expect("a small JPEG");
    bytes
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/decode").join(name)
}

fn params() -> DecodeParams {
    DecodeParams::default()
}

/// Compares the middle of every patch.
fn assert_patches(what: &str, found: &RgbImage, expected: &RgbImage, tolerance: u8) {
    assert_eq!(found.dimensions(), expected.dimensions(), "{what}");
    for (x, y) in (4..found.width()).step_by(8).flat_map(|x| (4..found.height()).step_by(8).map(move |y| (x, y))) {
        let (f, e) = (found.get_pixel(x, y).0, expected.get_pixel(x, y).0);
        assert!(f.iter().zip(e).all(|(f, e)| f.abs_diff(e) <= tolerance), "{what} at {x},{y}: {f:?} instead of {e:?}");
    }
}

#[test]
fn every_kind_of_colour_arrives_as_srgb() {
    let rgb = DynamicImage::ImageRgb8(patches());
    for format in [ImageFormat::Png, ImageFormat::WebP, ImageFormat::Tiff, ImageFormat::Bmp] {
        assert_patches(&format!("{format:?}"), &decode_bytes(&encoded(&rgb, format), &params()).unwrap().image, &patches(), 0);
    }
    assert_patches("JPEG", &decode_bytes(&jpeg(None), &params()).unwrap().image, &patches(), 3);
    for format in [ImageFormat::Png, ImageFormat::Tiff] {
        let deep = encoded(&DynamicImage::ImageRgb16(rgb.to_rgb16()), format);
        assert_patches(&format!("16-bit {format:?}"), &decode_bytes(&deep, &params()).unwrap().image, &patches(), 0);
    }
    for name in ["cmyk.jpg", "ycck.jpg", "cmyk.tif"] {
        assert_patches(name, &decode(&fixture(name), &params()).unwrap().image, &patches(), 3);
    }
    // A palette of "web-safe" colours rounds to steps of 51.
    for name in ["palette.png", "palette.bmp", "palette.tif"] {
        assert_patches(name, &decode(&fixture(name), &params()).unwrap().image, &patches(), 52);
    }
}

#[test]
fn grey_becomes_rgb_and_floats_are_clamped() {
    let grey = DynamicImage::ImageRgb8(patches()).to_luma8();
    let expected = DynamicImage::ImageLuma8(grey.clone()).to_rgb8();
    for (what, image) in [
        ("8-bit grey", DynamicImage::ImageLuma8(grey.clone())),
        ("16-bit grey", DynamicImage::ImageLuma16(DynamicImage::ImageLuma8(grey.clone()).to_luma16())),
        ("grey and alpha", DynamicImage::ImageLumaA8(DynamicImage::ImageLuma8(grey).to_luma_alpha8())),
    ] {
        let photo = decode_bytes(&encoded(&image, ImageFormat::Png), &params()).unwrap();
        assert_patches(what, &photo.image, &expected, 0);
        assert!(photo.opaque.is_none(), "{what}: all pixels are opaque");
    }
    // The files were greyed by the weights of ITU-R BT.601, not by ours.
    let weighed = |c: [u8; 3]| (299 * u32::from(c[0]) + 587 * u32::from(c[1]) + 114 * u32::from(c[2])) as f32 / 1000.0;
    let greyed = |factor: f32| {
        let grey = |x, y| Rgb([(factor * weighed(patches().get_pixel(x, y).0)).min(255.0) as u8; 3]);
        RgbImage::from_fn(48, 32, grey)
    };
    let cut_out = decode(&fixture("grey_alpha.tif"), &params()).unwrap();
    assert_patches("grey and alpha in TIFF", &cut_out.image, &greyed(1.0), 1);
    assert_eq!(cut_out.opaque.expect("the last column is transparent").count(), 40 * 32);
    let bright = decode(&fixture("grey_float.tif"), &params()).unwrap().image;
    assert_patches("floating-point grey in TIFF, 1.5 times as bright", &bright, &greyed(1.5), 1);
    let glaring = image::Rgb32FImage::from_fn(4, 4, |x, _| Rgb([[-1.0, 0.5, 7.0], [f32::NAN, 1.0, f32::INFINITY]][x as usize % 2]));
    let photo = decode_bytes(&encoded(&DynamicImage::ImageRgb32F(glaring), ImageFormat::Tiff), &params()).unwrap();
    assert_eq!(photo.image.get_pixel(0, 0).0, [0, 128, 255]);
    assert_eq!(photo.image.get_pixel(1, 0).0[1], 255);
}

#[test]
fn photographs_stand_upright() {
    // A little-endian EXIF block of one entry: tag 0x112 (orientation), short, count 1.
    let exif = |orientation: u8| {
        [b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".as_slice(), &[orientation, 0, 0, 0, 0, 0, 0, 0]].concat()
    };
    for orientation in 1..=8 {
        let mut upright = DynamicImage::ImageRgb8(patches());
        upright.apply_orientation(image::metadata::Orientation::from_exif(orientation).expect("1 to 8 are defined"));
        let photo = decode_bytes(&jpeg(Some(exif(orientation))), &params()).unwrap();
        assert_patches(&format!("orientation {orientation}"), &photo.image, upright.as_rgb8().expect("made as RGB"), 3);
    }
    // 6: the camera was turned, so the top of the scene is the left edge of the file: a quarter turn clockwise mends it.
    let turned = image::imageops::rotate90(&patches());
    for name in ["orientation6.tif", "orientation6.webp"] {
        assert_patches(name, &decode(&fixture(name), &params()).unwrap().image, &turned, 0);
    }
    assert_patches("nonsense", &decode_bytes(&jpeg(Some(exif(99))), &params()).unwrap().image, &patches(), 3);
}

#[test]
fn the_wide_colours_of_a_phone_become_srgb() {
    let p3 = ColorProfile::new_display_p3().encode().unwrap();
    // By the primaries of SMPTE EG 432-1 and IEC 61966-2-1, computed elsewhere; what sRGB cannot show is clipped.
    let srgb = [[218, 0, 4], [0, 142, 6], [34, 61, 187], [232, 220, 103], [128, 128, 128], [0, 0, 0]];
    let expected = RgbImage::from_fn(48, 32, |x, y| Rgb(if x < 8 && y < 8 { [255; 3] } else { srgb[x as usize / 8] }));
    assert_patches("Display P3", &decode_bytes(&jpeg_with(None, Some(p3)), &params()).unwrap().image, &expected, 4);

    let plain = decode_bytes(&jpeg(None), &params()).unwrap().image;
    for profile in [ColorProfile::new_srgb().encode().unwrap(), b"no profile at all".to_vec()] {
        assert_eq!(decode_bytes(&jpeg_with(None, Some(profile)), &params()).unwrap().image, plain, "nothing to convert");
    }
}

#[test]
fn transparency_becomes_a_mask_only_where_it_says_something() {
    let cut_out = |alpha: u8| {
        let mut image = DynamicImage::ImageRgb8(patches()).to_rgba8();
        image.enumerate_pixels_mut().filter(|(x, ..)| *x >= 40).for_each(|(_, _, pixel)| pixel[3] = alpha);
        decode_bytes(&encoded(&DynamicImage::ImageRgba8(image), ImageFormat::Png), &params()).unwrap()
    };
    let opaque = cut_out(127).opaque.expect("a sixth of the picture is transparent");
    assert_eq!((opaque.count(), opaque.get(39, 0), opaque.get(40, 0)), (40 * 32, true, false));
    assert!(cut_out(128).opaque.is_none());
}

#[test]
fn a_huge_picture_is_refused_by_its_header_alone() {
    let refused = |bytes: &[u8], limit: f64| decode_bytes(bytes, &DecodeParams { max_megapixels: limit }).unwrap_err();
    let header = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\x01\x86\xa0\0\x01\x86\xa0\x08\x02\0\0\0\0\0\0\0";
    let error = refused(header, 200.0);
    assert!(matches!(error, Error::TooManyPixels { width: 100_000, height: 100_000, .. }), "{error}");
    assert!(error.to_string().contains("100000×100000 px (10000.0 megapixels)"), "{error}");

    let mut bmp = encoded(&DynamicImage::ImageRgb8(patches()), ImageFormat::Bmp);
    bmp[18..26].copy_from_slice(&[0xa0, 0x86, 1, 0, 0xa0, 0x86, 1, 0]);
    assert!(matches!(refused(&bmp, 200.0), Error::TooManyPixels { width: 100_000, .. }));

    let mut large = jpeg(None);
    let frame = large.windows(2).position(|w| w == [0xff, 0xc0]).expect("a baseline frame header");
    large[frame + 5..frame + 9].fill(0xff);
    assert!(matches!(refused(&large, 200.0), Error::TooManyPixels { width: 65_535, height: 65_535, .. }));
    assert!(matches!(refused(&jpeg(None), 0.0015), Error::TooManyPixels { width: 48, height: 32, .. }));
    assert!(decode_bytes(&jpeg(None), &DecodeParams { max_megapixels: 0.001536 }).is_ok(), "48 × 32 px are 0.001536 MP");
}

#[test]
fn every_way_to_fail_has_its_own_message() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        match decode(&path, &params()).unwrap_err() {
            Error::InFile { path: named, cause } if named == path => *cause,
            other => panic!("{other} does not say which file"),
        }
    };
    let missing = decode(&folder.path().join("nowhere.jpg"), &params()).unwrap_err();
    assert!(matches!(missing, Error::NoSuchFile { .. }), "{missing}");
    let is_folder = decode(folder.path(), &params()).unwrap_err();
    assert!(matches!(is_folder, Error::NotAFile { found: "a folder", .. }), "{is_folder}");
    assert!(matches!(write("empty.jpg", b""), Error::EmptyFile));
    assert!(matches!(write("letter.jpg", b"Dear Sir or Madam,"), Error::NotAnImage { found: "text" }));
    assert!(matches!(write("a.png", b"GIF89a\x01\0\x01\0\0\0\0"), Error::NotAnImage { found: "a GIF picture" }));
    let iphone = write("IMG_0001.jpg", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic");
    assert!(iphone.to_string().contains("HEIC"), "{iphone}");
    let mut damaged = encoded(&DynamicImage::ImageRgb8(patches()), ImageFormat::Png);
    damaged[45] ^= 0x55;
    assert!(matches!(write("damaged.png", &damaged), Error::DamagedImage { format: "PNG", .. }));
}

#[test]
fn a_picture_that_ends_early_is_called_truncated() {
    let rgb = DynamicImage::ImageRgb8(patches());
    let whole = [ImageFormat::Png, ImageFormat::WebP, ImageFormat::Tiff, ImageFormat::Bmp].map(|f| encoded(&rgb, f));
    for bytes in whole.iter().chain([&jpeg(None)]) {
        for part in [0.2, 0.5, 0.9] {
            let cut = (bytes.len() as f64 * part) as usize;
            let error = decode_bytes(&bytes[..cut], &params()).unwrap_err();
            assert!(matches!(error, Error::Truncated { .. }), "{part}: {error}");
        }
    }
    let without_end_marker = jpeg(None).len() - 2;
    assert!(matches!(decode_bytes(&jpeg(None)[..without_end_marker], &params()), Err(Error::Truncated { .. })));
    // Phones append films and maps of depth behind the picture.
    assert!(decode_bytes(&[jpeg(None), vec![7; 1000]].concat(), &params()).is_ok());
}

#[test]
fn the_file_name_is_no_evidence() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("really_a_webp.jpg");
    std::fs::write(&path, encoded(&DynamicImage::ImageRgb8(patches()), ImageFormat::WebP)).unwrap();
    assert_eq!(decode(&path, &params()).unwrap().image, patches());
}

/// Valid files of every kind, to be broken.
fn seeds() -> Vec<Vec<u8>> {
    let rgb = DynamicImage::ImageRgb8(patches());
    let mut seeds: Vec<_> =
        [ImageFormat::Png, ImageFormat::WebP, ImageFormat::Tiff, ImageFormat::Bmp].map(|f| encoded(&rgb, f)).to_vec();
    seeds.push(jpeg(None));
    seeds.push(jpeg_with(None, ColorProfile::new_display_p3().encode().ok()));
    let mut names: Vec<_> = std::fs::read_dir(fixture("")).unwrap().map(|e| e.unwrap().path()).collect();
    names.sort();
    seeds.extend(names.iter().filter(|p| p.extension().is_some_and(|e| e != "md")).map(|p| std::fs::read(p).unwrap()));
    seeds
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_make_it_panic(
        seed in prop::sample::select(seeds()),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..12),
        end in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut bytes = seed;
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Some(end) = end {
            bytes.truncate(end.index(bytes.len()));
        }
        // A small limit, as the largest size that a mutated header may honestly declare costs time.
        if let Ok(photo) = decode_bytes(&bytes, &DecodeParams { max_megapixels: 0.5 }) {
            prop_assert!(photo.image.width() > 0 && photo.image.height() > 0);
            if let Some(opaque) = photo.opaque {
                prop_assert_eq!((opaque.width(), opaque.height()), photo.image.dimensions());
            }
        }
    }
}
