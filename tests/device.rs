//! What goes wrong with devices: memory that stays, a device that is lost, sizes beyond any, no adapter at all. Nothing may panic, and
//! every message says what to do.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use common::{software_gpu, software_renderer};
use glam::Vec3;
use image::RgbaImage;
use sphereboard::Error;
use sphereboard::geom::Surface;
use sphereboard::gpu::layout::Instance;
use sphereboard::gpu::{Gpu, PassClock};
use sphereboard::model::{Material, Part, TreeModel, glb};
use sphereboard::render::{Background, Camera, Renderer, Shot, Stand};

fn model_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/oak.glb")
}

fn model() -> TreeModel {
    glb::read(&std::fs::read(model_path()).unwrap()).unwrap()
}

fn shot(size_px: [u32; 2]) -> Shot {
    Shot { background: Background::Alpha, ..Shot::new(Camera::orbit(Vec3::Y * 5.0, 0.3, 0.2, 25.0), size_px) }
}

/// Uploads a model, takes a small picture with every pass, and drops everything but the renderer.
fn once(renderer: &mut Renderer, parts: &[Part]) -> Result<RgbaImage, Error> {
    let tree = renderer.upload(parts)?;
    Ok(renderer.picture(&shot([96, 96]), &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }])?.color)
}

/// What lives on the device: buffers, textures, their views, bind groups, allocated bytes.
fn living(gpu: &Gpu) -> [u64; 5] {
    gpu.wait().unwrap();
    let report = gpu.instance.generate_report().expect("a native build reports");
    let hub = report.hub_report();
    let counts = [&hub.buffers, &hub.textures, &hub.texture_views, &hub.bind_groups].map(|kind| kind.num_kept_from_user as u64);
    let bytes = gpu.device.generate_allocator_report().map_or(0, |report| report.total_allocated_bytes);
    [counts[0], counts[1], counts[2], counts[3], bytes]
}

/// Memory of this process, bytes; 0 where the system does not say.
fn resident_bytes() -> u64 {
    let pages = std::fs::read_to_string("/proc/self/statm").ok().and_then(|text| text.split(' ').nth(1)?.parse::<u64>().ok());
    pages.unwrap_or(0) * 4096
}

#[test]
fn memory_comes_back_after_each_of_200_models() {
    let Some(mut renderer) = software_renderer() else { return };
    let parts = model().parts();
    let first = once(&mut renderer, &parts).unwrap();
    (0..20).for_each(|_| _ = once(&mut renderer, &parts).unwrap());
    let (settled, memory) = (living(&renderer.gpu), resident_bytes());
    assert!(settled[..4].iter().all(|&count| count > 0), "{settled:?}");
    for load in 0..180 {
        let picture = once(&mut renderer, &parts).unwrap();
        assert!(picture == first, "picture {load} differs from the first");
        assert_eq!(living(&renderer.gpu), settled, "buffers, textures, views, bind groups, bytes after {load} more models");
    }
    let grown = resident_bytes().saturating_sub(memory);
    println!("{settled:?} on the device; the process grew by {} kB over 180 models", grown >> 10);
    assert!(grown < 16 << 20, "the process grew by {grown} bytes over 180 models");
}

#[test]
fn a_lost_device_is_an_error_and_a_new_one_goes_on() {
    let Some(mut renderer) = software_renderer() else { return };
    let parts = model().parts();
    let before = once(&mut renderer, &parts).unwrap();
    let tree = renderer.upload(&parts).unwrap();
    let stands = [Stand { tree: &tree, instances: &[Instance::IDENTITY] }];
    renderer.gpu.device.destroy();
    let typed = |what: &str, result: Result<(), Error>| match result {
        Err(Error::Device { .. }) => {}
        other => panic!("{what}: {other:?}"),
    };
    typed("a picture of the same size", renderer.picture(&shot([96, 96]), &stands).map(drop));
    typed("a picture of another size", renderer.picture(&shot([64, 96]), &stands).map(drop));
    typed("a frame", renderer.frame(&shot([96, 96]), &stands));
    typed("a timed frame", renderer.timed(&shot([96, 96]), &stands).map(drop));
    typed("an upload", renderer.upload(&parts).map(drop));
    drop(tree);
    drop(renderer);
    let mut again = software_renderer().expect("it was there a moment ago");
    assert!(once(&mut again, &parts).unwrap() == before, "the new device draws another picture");
}

#[test]
fn a_renderer_on_a_lost_device_is_an_error() {
    let Some(gpu) = software_gpu() else { return };
    gpu.device.destroy();
    assert!(matches!(Renderer::new(gpu), Err(Error::Device { .. })));
}

#[test]
fn a_device_lost_between_two_passes_is_an_error() {
    let Some(gpu) = software_gpu() else { return };
    for mut clock in [PassClock::new(&gpu), PassClock::wall()] {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let begun = clock.passed(&gpu, &mut encoder, "begin");
        gpu.device.destroy();
        let ended = clock.passed(&gpu, &mut encoder, "end");
        gpu.queue.submit([encoder.finish()]);
        assert!([begun, ended, clock.read(&gpu).map(drop)].iter().any(Result::is_err));
    }
}

#[test]
fn sizes_beyond_any_are_refused_and_the_next_picture_is_taken() {
    let Some(mut renderer) = software_renderer() else { return };
    let parts = model().parts();
    let tree = renderer.upload(&parts).unwrap();
    let stands = [Stand { tree: &tree, instances: &[Instance::IDENTITY] }];
    for size_px in [[0, 0], [0, 64], [64, 0], [16_384, 16_384], [u32::MAX, 1], [1, u32::MAX], [u32::MAX, u32::MAX]] {
        match renderer.picture(&shot(size_px), &stands) {
            Err(error @ Error::PictureSize { .. }) => assert!(error.to_string().contains(&size_px[0].to_string()), "{error}"),
            other => panic!("{size_px:?}: {:?}", other.map(|picture| picture.color.dimensions())),
        }
    }
    for size_px in [[1, 1], [3, 2], [1, 700], [64, 64]] {
        let picture = renderer.picture(&shot(size_px), &stands).unwrap().color;
        assert_eq!(picture.dimensions(), (size_px[0], size_px[1]));
    }
}

#[test]
fn parts_beyond_the_device_are_an_error() {
    let Some(renderer) = software_renderer() else { return };
    let side = renderer.gpu.device.limits().max_texture_dimension_2d + 1;
    let surface = Surface {
        mesh: sphereboard::geom::PolyMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            ..Default::default()
        },
        normals: vec![Vec3::Z; 3],
        uvs: vec![glam::Vec2::ZERO; 3],
        ..Default::default()
    };
    let texture = Some(std::sync::Arc::new(RgbaImage::new(side, 1)));
    let part = Part { name: "wide".to_owned(), surface, material: Material { texture, ..Material::default() }, crown_center: None };
    let refused = renderer.upload(&[part]);
    assert!(matches!(refused, Err(Error::Device { .. })), "{refused:?}");
    renderer.gpu.check().unwrap();
}

/// Runs the program where no Vulkan driver is to be found.
fn without_adapter(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sphereboard"))
        .args(arguments)
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .env("VK_DRIVER_FILES", "/nonexistent")
        .output()
        .unwrap()
}

fn said(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

#[test]
fn without_an_adapter_drawing_says_what_to_install() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let out = folder.path().join("p.png");
    let (model, out) = (model_path().display().to_string(), out.display().to_string());
    for arguments in [&["render", &model, "--out", &out][..], &["view", &model], &["doctor"]] {
        let output = without_adapter(arguments);
        let words = said(&output);
        let expected = if arguments[0] == "doctor" { 1 } else { 2 };
        assert_eq!(output.status.code(), Some(expected), "{arguments:?}: {words}");
        assert!(!words.contains("panicked"), "{words}");
        let remedy = if arguments[0] == "doctor" { "mesa-vulkan-drivers" } else { "sphereboard doctor" };
        let screenless = arguments[0] == "view" && words.contains("window");
        assert!(words.contains(remedy) || screenless, "{arguments:?}: {words}");
    }
    assert!(!Path::new(&out).exists());
}

#[test]
fn without_an_adapter_a_model_is_made_all_the_same() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let photo = Path::new(env!("CARGO_MANIFEST_DIR")).join("photos/oak.jpg");
    let (photo, out) = (photo.display().to_string(), folder.path().display().to_string());
    let output = without_adapter(&["model", &photo, "--detail", "low", "--texture-size", "256", "--out", &out]);
    let words = said(&output);
    assert!(output.status.success(), "{words}");
    assert!(folder.path().join("oak.glb").exists());
    assert!(!folder.path().join("oak.preview.png").exists());
    assert!(words.contains("preview"), "nothing is said of the preview: {words}");
}
