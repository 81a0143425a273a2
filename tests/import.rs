//! Models of other programs: whatever glTF and OBJ allow is read as it is meant, and no broken file does harm.
//!
//! Above 600 lines, since every test takes a few lines to say what a file holds; the builders of files are in `fixtures`.

mod fixtures;

use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};
use image::{Rgba, RgbaImage};
use serde_json::{Value, json};
use sphereboard::geom::PolyMesh;
use sphereboard::model::import::{self, Folder, Imported};
use sphereboard::model::{Part, Wrap, bounds};
use sphereboard::{Error, files};

use fixtures::{Gltf, glb, square, textured};

/// The shared meshes with this ending; a visible line when they are not there.
fn shared_meshes(ending: &str) -> Vec<PathBuf> {
    let Some(folder) = files::shared_folder().map(|folder| folder.join("meshes")).filter(|folder| folder.is_dir()) else {
        println!("SKIPPED: the shared meshes are not there");
        return Vec::new();
    };
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    found.retain(|path| path.extension().is_some_and(|e| e == ending));
    found.sort();
    found
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap().to_string_lossy().into_owned()
}

#[test]
fn the_shared_glb_trees_are_read() {
    for path in shared_meshes("glb") {
        let imported = import::open(&path).unwrap();
        let [wood, leaves] = &imported.parts[..] else { panic!("two parts") };
        let (branch_triangles, leaf_quads, height_m) = match stem(&path).as_str() {
            "eztree_ash_medium" => (9120, 5440, 77.387),
            "eztree_oak_medium" => (3166, 5320, 64.732),
            "eztree_pine_medium" => (10_032, 4920, 51.138),
            other => panic!("what is {other}?"),
        };
        assert_eq!((wood.surface.mesh.triangles.len(), leaves.surface.mesh.triangles.len()), (branch_triangles, 2 * leaf_quads));
        assert_eq!((wood.material.alpha_cutoff, leaves.material.alpha_cutoff), (None, Some(0.5)));
        assert_eq!((wood.name.as_str(), wood.material.name.as_str(), leaves.name.as_str()), ("branches", "branches", "leaves"));
        assert!(imported.parts.iter().all(|part| part.material.texture.is_some() && !part.surface.uvs.is_empty()));
        assert!((bounds(&imported.parts).unwrap().max.y - height_m).abs() < 1e-3, "{path:?}");
        assert!(imported.warnings.is_empty() && imported.tree_model.is_none());
        assert!(imported.parts.iter().flat_map(|p| &p.surface.normals).all(|n: &Vec3| n.is_normalized()));
    }
}

#[test]
fn the_shared_obj_trees_are_read() {
    for path in shared_meshes("obj") {
        let imported = import::open(&path).unwrap();
        let [bark, leaves] = &imported.parts[..] else { panic!("two parts") };
        let (bark_triangles, leaf_quads) = match stem(&path).as_str() {
            "quaternius_Birch_1" => (1210, 552),
            "quaternius_Pine_1" => (148, 258),
            "quaternius_Tree_1" => (444, 180),
            other => panic!("what is {other}?"),
        };
        assert_eq!(bark.surface.mesh.triangulated().count(), bark_triangles);
        assert_eq!((leaves.surface.mesh.triangles.len(), leaves.surface.mesh.quads.len()), (0, leaf_quads));
        assert_eq!((bark.material.alpha_cutoff, leaves.material.alpha_cutoff), (None, Some(0.5)));
        assert!(imported.parts.iter().all(|part| part.material.texture.is_some() && !part.surface.uvs.is_empty()));
        assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
        assert!(imported.parts.iter().flat_map(|p| &p.surface.normals).all(|n: &Vec3| n.is_normalized()));
    }
}

fn read(file: &Gltf) -> Imported {
    import::read(&file.glb(), &Folder::default()).unwrap()
}

fn only(imported: Imported) -> Part {
    let [part] = <[Part; 1]>::try_from(imported.parts).expect("one part");
    part
}

fn failure(bytes: &[u8]) -> String {
    import::read(bytes, &Folder::default()).unwrap_err().to_string()
}

fn codes(imported: &Imported) -> Vec<&str> {
    imported.warnings.iter().map(|warning| warning.code.as_str()).collect()
}

/// The area that faces each way: orientation and shape in one number.
fn area(mesh: &PolyMesh) -> Vec3 {
    let p = |i: u32| mesh.positions[i as usize];
    mesh.triangulated().map(|[a, b, c]| 0.5 * (p(b) - p(a)).cross(p(c) - p(a))).sum()
}

fn close(a: Vec3, b: Vec3) -> bool {
    (a - b).length() < 1e-5
}

#[test]
fn lists_strips_and_fans_of_any_index_give_the_same_square() {
    let u8s = |file: &mut Gltf, v: &[u8]| file.accessor(v, 5121, "SCALAR", v.len());
    let u32s = |file: &mut Gltf, v: &[u32]| {
        let bytes: Vec<u8> = v.iter().flat_map(|v| v.to_le_bytes()).collect();
        file.accessor(&bytes, 5125, "SCALAR", v.len())
    };
    let mut cases = vec![(4, square())];
    for (mode, corners) in [(4, &[0u8, 1, 2, 0, 2, 3][..]), (5, &[1, 2, 0, 3]), (6, &[0, 1, 2, 3])] {
        let (mut narrow, mut wide) = (square(), square());
        let narrow_indices = u8s(&mut narrow, corners);
        let wide_indices = u32s(&mut wide, &corners.iter().map(|&c| c.into()).collect::<Vec<_>>());
        for (mut file, indices) in [(narrow, narrow_indices), (wide, wide_indices)] {
            file.json["meshes"][0]["primitives"][0]["indices"] = indices.into();
            file.json["meshes"][0]["primitives"][0]["mode"] = mode.into();
            cases.push((mode, file));
        }
    }
    let mut fan = square();
    fan.json["meshes"][0]["primitives"][0]["mode"] = json!(6);
    fan.json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    cases.push((6, fan));
    for (mode, file) in cases {
        let part = only(read(&file));
        assert_eq!(part.surface.mesh.triangles.len(), 2, "mode {mode}");
        assert!(close(area(&part.surface.mesh), Vec3::Z), "mode {mode}: {:?}", area(&part.surface.mesh));
        assert!(part.surface.normals.iter().all(|n| close(*n, Vec3::Z)), "mode {mode}: normals are made");
    }
}

#[test]
fn a_strip_is_stitched_by_lines_and_a_list_loses_them() {
    let mut strip = square();
    let stitched = strip.indices(&[1, 2, 0, 3, 3, 3]);
    strip.json["meshes"][0]["primitives"][0]["indices"] = stitched.into();
    strip.json["meshes"][0]["primitives"][0]["mode"] = json!(5);
    let imported = read(&strip);
    assert!(imported.warnings.is_empty());
    assert_eq!(only(imported).surface.mesh.triangles.len(), 2);
    let mut list = square();
    let lines = list.indices(&[0, 1, 2, 0, 2, 3, 1, 1, 2]);
    list.json["meshes"][0]["primitives"][0]["indices"] = lines.into();
    let imported = read(&list);
    assert_eq!(codes(&imported), ["degenerate-triangles"]);
    assert_eq!(only(imported).surface.mesh.triangles.len(), 2);
}

#[test]
fn nodes_move_turn_scale_and_mirror() {
    let mut file = square();
    let up = file.floats(&[0.0, 0.6, 0.8].repeat(4), "VEC3");
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = up.into();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // The parent turns +X to −Z (90° about Y) and moves up by 5; the child stretches and mirrors.
    file.json["nodes"] = json!([
        {"children": [1], "translation": [0, 5, 0], "rotation": [0, half, 0, half]},
        {"mesh": 0, "name": "child", "scale": [-2, 3, 1]},
    ]);
    let part = only(read(&file));
    assert_eq!(part.name, "child");
    let mesh = &part.surface.mesh;
    let expected = [(0.0, 5.0, 0.0), (0.0, 5.0, 2.0), (0.0, 8.0, 2.0), (0.0, 8.0, 0.0)].map(Vec3::from);
    assert!(mesh.positions.iter().zip(expected).all(|(a, b)| close(*a, b)), "{:?}", mesh.positions);
    // +Z became +X; the mirrored winding is put right.
    assert!(close(area(mesh), Vec3::new(6.0, 0.0, 0.0)), "{:?}", area(mesh));
    // The normal (0, 0.6, 0.8) leans by the inverse of the stretch: (0, 0.2, 0.8) before the turn.
    let leaning = Vec3::new(0.8, 0.2, 0.0).normalize();
    assert!(part.surface.normals.iter().all(|n| close(*n, leaning)), "{:?}", part.surface.normals);
    // The same as one matrix, column by column.
    file.json["nodes"] = json!([{"mesh": 0, "matrix": [0, 0, 2, 0, 0, 3, 0, 0, 1, 0, 0, 0, 0, 5, 0, 1]}]);
    let same = only(read(&file));
    assert!(same.surface.mesh.positions.iter().zip(&mesh.positions).all(|(a, b)| close(*a, *b)));
    assert_eq!(same.surface.mesh.triangles, mesh.triangles);
    // Twice the mesh, once as it is.
    file.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "translation": [3, 0, 0]}]);
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    assert_eq!(bounds(&read(&file).parts).unwrap().max, Vec3::new(4.0, 1.0, 0.0));
}

#[test]
fn instances_stand_where_their_accessors_say() {
    let mut file = square();
    let places = file.floats(&[0.0, 0.0, 0.0, 10.0, 0.0, 0.0], "VEC3");
    let scales = file.floats(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0], "VEC3");
    file.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places, "SCALE": scales}}});
    let imported = read(&file);
    assert_eq!(imported.parts.len(), 2);
    assert_eq!(bounds(&imported.parts).unwrap().max, Vec3::new(12.0, 2.0, 0.0));
}

#[test]
fn sparse_strided_quantised_and_normalised_numbers_are_read() {
    // The third corner moves to (1, 1, 7); the base is all zeros in the second case.
    for base in [true, false] {
        let mut file = square();
        let (indices, values) = (file.view(&2u16.to_le_bytes()), file.view(&[1.0f32, 1.0, 7.0].map(f32::to_le_bytes).concat()));
        let accessor = &mut file.json["accessors"][0];
        accessor["sparse"] = json!({
            "count": 1, "indices": {"bufferView": indices, "componentType": 5123}, "values": {"bufferView": values},
        });
        if !base {
            accessor.as_object_mut().unwrap().remove("bufferView");
        }
        let positions = only(read(&file)).surface.mesh.positions;
        assert_eq!(positions[2], Vec3::new(1.0, 1.0, 7.0));
        assert_eq!(positions[1], if base { Vec3::X } else { Vec3::ZERO });
    }
    // Positions as bytes and texture coordinates as normalised u16, interleaved with a stride of 8.
    let mut file = textured(&RgbaImage::from_pixel(1, 1, Rgba([9; 4])), json!({}), json!({}));
    let corner = |x: u8, y: u8, u: u16, v: u16| [&[x, y, 0, 0][..], &u.to_le_bytes(), &v.to_le_bytes()].concat();
    let bytes =
        [corner(0, 0, 0, 65_535), corner(200, 0, 65_535, 65_535), corner(200, 100, 65_535, 0), corner(0, 100, 0, 0)].concat();
    let view = file.view(&bytes);
    file.json["bufferViews"][view]["byteStride"] = json!(8);
    file.json["accessors"][0] = json!({"bufferView": view, "componentType": 5121, "type": "VEC3", "count": 4});
    file.json["accessors"][1] =
        json!({"bufferView": view, "byteOffset": 4, "componentType": 5123, "type": "VEC2", "count": 4, "normalized": true});
    file.json["nodes"][0]["scale"] = json!([0.01, 0.01, 0.01]);
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let part = only(read(&file));
    assert!(close(part.surface.mesh.positions[2], Vec3::new(2.0, 1.0, 0.0)));
    assert_eq!(part.surface.uvs, [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(Vec2::from));
}

#[test]
fn a_primitive_keeps_only_the_vertices_that_it_uses() {
    let mut file = square();
    let half = file.indices(&[0, 2, 3]);
    file.json["meshes"][0]["primitives"][0]["indices"] = half.into();
    let part = only(read(&file));
    assert_eq!(part.surface.mesh.positions.len(), 3);
    assert_eq!(part.surface.mesh.triangles, [[0, 1, 2]]);
}

/// A dot in the top left corner of a 2×1 picture: red, then half-transparent green.
fn picture() -> RgbaImage {
    RgbaImage::from_fn(2, 1, |x, _| if x == 0 { Rgba([255, 0, 0, 255]) } else { Rgba([0, 255, 0, 100]) })
}

#[test]
fn alpha_modes_become_cut_outs() {
    let material = |properties: Value| {
        let imported = read(&textured(&picture(), properties, json!({})));
        let warned = codes(&imported).join(" ");
        (only(imported).material, warned)
    };
    let (opaque, _) =
        material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 0.5, 1, 0.2]}}));
    assert_eq!((opaque.alpha_cutoff, opaque.factor, opaque.two_sided), (None, [1.0, 0.5, 1.0, 1.0], false));
    let (mask, warned) = material(json!({"alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": true}));
    assert_eq!((mask.alpha_cutoff, mask.two_sided, warned.as_str()), (Some(0.3), true, ""));
    assert_eq!(material(json!({"alphaMode": "MASK"})).0.alpha_cutoff, Some(0.5));
    let (blend, warned) = material(json!({"alphaMode": "BLEND"}));
    assert_eq!((blend.alpha_cutoff, warned.as_str()), (Some(0.5), "blend-as-mask"));
    assert_eq!(blend.texture.unwrap().as_ref(), &picture());
    // Two images of the same bytes are one.
    let mut twice = textured(&picture(), json!({"alphaMode": "MASK"}), json!({}));
    let image = twice.json["images"][0].clone();
    twice.push("images", image);
    twice.push("textures", json!({"source": 1}));
    twice.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}));
    let mut primitive = twice.json["meshes"][0]["primitives"][0].clone();
    primitive["material"] = json!(1);
    twice.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    let parts = read(&twice).parts;
    let [one, other] = [0, 1].map(|k: usize| parts[k].material.texture.as_ref().unwrap());
    assert!(std::sync::Arc::ptr_eq(one, other));
    let (unsaid, warned) = material(json!({}));
    assert_eq!((unsaid.alpha_cutoff, warned.as_str()), (None, "alpha-unused"));
    let solid = RgbaImage::from_pixel(2, 2, Rgba([1, 2, 3, 255]));
    let imported = read(&textured(&solid, json!({"alphaMode": "BLEND"}), json!({})));
    assert!(imported.warnings.is_empty());
    assert_eq!(only(imported).material.alpha_cutoff, None, "it blends with nothing");
    let (older, _) = material(json!({"pbrMetallicRoughness": {}, "extensions": {"KHR_materials_pbrSpecularGlossiness":
        {"diffuseFactor": [0.5, 1, 1, 1], "diffuseTexture": {"index": 0}}}}));
    assert!(older.texture.is_some() && older.factor[0] == 0.5);
}

#[test]
fn textures_wrap_turn_and_mirror() {
    let beyond = |wrap: u32| {
        let mut file = textured(&picture(), json!({}), json!({"wrapS": wrap, "wrapT": wrap}));
        let uvs = file.floats(&[0.0, 1.0, 2.0, 1.0, 2.0, 0.0, 0.0, 0.0], "VEC2");
        file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uvs.into();
        only(read(&file))
    };
    assert_eq!(beyond(33_071).material.wrap, Wrap::Clamp);
    assert_eq!(beyond(10_497).material.wrap, Wrap::Repeat);
    let mirrored = beyond(33_648);
    let unfolded = mirrored.material.texture.unwrap();
    assert_eq!((unfolded.dimensions(), mirrored.material.wrap), ((4, 1), Wrap::Repeat));
    assert_eq!([0, 1, 2, 3].map(|x| unfolded.get_pixel(x, 0)[0]), [255, 0, 0, 255]);
    assert_eq!(mirrored.surface.uvs[1], Vec2::ONE);
    // A quarter turn, then scaled and moved: what the extension's own formula gives.
    let mut file = textured(&picture(), json!({}), json!({}));
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2, 3]}});
    let uvs = only(read(&file)).surface.uvs;
    // (u, v) → (2u, 3v) → (3v, −2u) → + offset.
    let expected = [(3.5, 0.25), (3.5, -1.75), (0.5, -1.75), (0.5, 0.25)].map(Vec2::from);
    assert!(uvs.iter().zip(expected).all(|(a, b)| (*a - b).length() < 1e-5), "{uvs:?}");
}

#[test]
fn vertex_colours_come_along_unless_they_are_white() {
    let mut file = square();
    let colors = file.accessor(&[255, 0, 128, 255].repeat(4), 5121, "VEC4", 4);
    file.json["accessors"][colors]["normalized"] = json!(true);
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colors.into();
    let found = only(read(&file)).surface.colors;
    assert_eq!((found.len(), found[0][0], found[0][1]), (4, 1.0, 0.0));
    let white = file.floats(&[1.0; 12], "VEC3");
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = white.into();
    assert!(only(read(&file)).surface.colors.is_empty());
}

#[test]
fn a_gltf_file_finds_its_neighbours_and_nothing_else() {
    let place = tempfile::tempdir().unwrap();
    let inner = place.path().join("tree");
    std::fs::create_dir(&inner).unwrap();
    let mut file = textured(&picture(), json!({"alphaMode": "MASK"}), json!({}));
    let bytes = file.bytes.clone();
    file.json["buffers"][0]["uri"] = json!("my%20tree.bin");
    std::fs::write(inner.join("my tree.bin"), &bytes).unwrap();
    let path = inner.join("tree.gltf");
    std::fs::write(&path, file.json.to_string()).unwrap();
    assert!(only(import::open(&path).unwrap()).material.texture.is_some());
    let outside = place.path().join("secret.bin");
    std::fs::write(&outside, &bytes).unwrap();
    let refused = |uri: &str, file: &mut Gltf| {
        file.json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, file.json.to_string()).unwrap();
        import::open(&path).unwrap_err().to_string()
    };
    for uri in ["../secret.bin", "%2e%2e/secret.bin", "..\\secret.bin", outside.to_str().unwrap(), "file:///etc/passwd", ""] {
        let message = refused(uri, &mut file);
        assert!(message.contains("outside") || message.contains("network"), "{uri}: {message}");
    }
    assert!(refused("gone.bin", &mut file).contains("is the file gone.bin, which is not there"));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&outside, inner.join("link.bin")).unwrap();
        assert!(refused("link.bin", &mut file).contains("outside"));
    }
    // A picture that is missing costs the picture only.
    file.json["buffers"][0]["uri"] = json!("my%20tree.bin");
    file.json["images"][0] = json!({"uri": "bark.png"});
    std::fs::write(&path, file.json.to_string()).unwrap();
    let imported = import::open(&path).unwrap();
    assert_eq!(codes(&imported), ["missing-texture"]);
    assert!(imported.warnings[0].message.contains("bark.png, which is not there"), "{:?}", imported.warnings);
    // The same triangle of bytes as a data URI: (0,0,0) (1,0,0) (0,1,0).
    let data = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let document = json!({
        "asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": data}],
    });
    let text = format!("\u{feff}{document}");
    let imported = import::read(text.as_bytes(), &Folder::default()).unwrap();
    assert_eq!(only(imported).surface.mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
}

#[test]
fn what_cannot_be_read_says_so() {
    let with = |key: &str, value: Value| {
        let mut file = square();
        file.json[key] = value;
        failure(&file.glb())
    };
    let draco = with("extensionsRequired", json!(["KHR_draco_mesh_compression"]));
    assert!(draco.contains("KHR_draco_mesh_compression") && draco.contains("without Draco"), "{draco}");
    assert!(with("extensionsRequired", json!(["EXT_meshopt_compression"])).contains("without meshopt"));
    assert!(with("extensionsRequired", json!(["KHR_texture_basisu"])).contains("PNG, JPEG or WebP"));
    assert!(with("extensionsRequired", json!(["ACME_magic"])).contains("ACME_magic"));
    assert!(with("asset", json!({"version": "1.0"})).contains("version"));
    assert!(with("nodes", json!([{}])).contains("no triangles"));
    assert!(with("nodes", json!([{"children": [0]}])).contains("below itself"));
    assert!(with("nodes", json!([{"mesh": 7}])).contains("names mesh 7"));
    assert!(with("meshes", json!([{"primitives": [{"attributes": {"POSITION": 0}, "mode": 1}]}])).contains("points or lines"));
    for (bytes, word) in [
        (&b""[..], "nothing"),
        (b"\x89PNG\r\n\x1a\n0000", "a picture"),
        (b"ply\nformat ascii 1.0", "a PLY model"),
        (b"Kaydara FBX Binary  ", "an FBX model"),
        (b"newmtl bark\nKd 1 1 1", "an MTL material library"),
        (b"hello", "something else"),
        (b"\0\0\0\0", "something else"),
        (b"{}", "version"),
        (b"glTF", "ends within its header"),
    ] {
        assert!(failure(bytes).contains(word), "{}", failure(bytes));
    }
}

#[test]
fn hostile_numbers_do_no_harm() {
    let mut file = textured(&picture(), json!({"alphaMode": "MASK"}), json!({"wrapS": 33_648}));
    let colors = file.floats(&[0.5; 16], "VEC4");
    let normals = file.floats(&[0.0, 0.0, 1.0].repeat(4), "VEC3");
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colors.into();
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    let (indices, values) = (file.view(&[2, 0]), file.view(&[0; 12]));
    file.json["accessors"][0]["sparse"] = json!({"count": 1, "indices": {"bufferView": indices, "byteOffset": 0, "componentType": 5123}, "values": {"bufferView": values, "byteOffset": 0}});
    file.json["nodes"] = json!([{"children": [1], "rotation": [0, 0, 0, 1]}, {"mesh": 0, "scale": [1, 1, 1]}]);
    let places = file.floats(&[0.0; 6], "VEC3");
    file.json["nodes"][1]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    for view in file.json["bufferViews"].as_array_mut().unwrap() {
        view["byteStride"] = json!(0);
    }
    for accessor in file.json["accessors"].as_array_mut().unwrap() {
        accessor["byteOffset"] = json!(0);
    }
    assert_eq!(read(&file).parts.len(), 2);
    let numbers = numbers(&file.json, String::new());
    assert!(numbers.len() > 80, "{} numbers", numbers.len());
    let hostile = [
        json!(-1),
        json!(0),
        json!(1),
        json!(3),
        json!(255),
        json!(65_536),
        json!(4_294_967_295u32),
        json!(1u64 << 53),
        json!(u64::MAX),
        json!(1e308),
        json!(0.5),
    ];
    for (pointer, value) in numbers.iter().flat_map(|pointer| hostile.iter().map(move |value| (pointer, value))) {
        let mut damaged = Gltf { json: file.json.clone(), bytes: file.bytes.clone() };
        *damaged.json.pointer_mut(pointer).unwrap() = value.clone();
        if let Ok(imported) = import::read(&damaged.glb(), &Folder::default()) {
            for part in &imported.parts {
                let (mesh, count) = (&part.surface.mesh, part.surface.mesh.positions.len());
                assert!(mesh.polygons().flatten().all(|&corner| (corner as usize) < count), "{pointer} = {value}");
                assert!(mesh.positions.iter().all(|p| p.is_finite()) && part.surface.normals.len() == count, "{pointer} = {value}");
                assert!([0, count].contains(&part.surface.uvs.len()) && [0, count].contains(&part.surface.colors.len()));
            }
        }
    }
}

/// Where in the document every number stands.
fn numbers(value: &Value, at: String) -> Vec<String> {
    match value {
        Value::Number(_) => vec![at],
        Value::Array(list) => list.iter().enumerate().flat_map(|(k, v)| numbers(v, format!("{at}/{k}"))).collect(),
        Value::Object(map) => map.iter().flat_map(|(k, v)| numbers(v, format!("{at}/{k}"))).collect(),
        _ => vec![],
    }
}

#[test]
fn a_file_that_ends_early_or_nests_deep_does_no_harm() {
    let file = textured(&picture(), json!({}), json!({}));
    let whole = file.glb();
    for length in 0..whole.len() {
        assert!(import::read(&whole[..length], &Folder::default()).is_err(), "{length} bytes");
    }
    for at in 0..whole.len() {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x55;
        let _ = import::read(&damaged, &Folder::default());
    }
    // A chain of nodes as deep as it is long.
    let mut deep = square();
    let nodes = 100_000;
    deep.json["nodes"] =
        (0..nodes).map(|k| if k + 1 < nodes { json!({"children": [k + 1]}) } else { json!({"mesh": 0}) }).collect();
    assert_eq!(read(&deep).parts.len(), 1);
    // A small file that stands for a very large tree.
    let mut many = square();
    let places = many.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 4_000_000_000u32}));
    many.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    assert!(failure(&many.glb()).contains("more vertices than can be held"));
    // Nothing, fifty million times.
    let mut nothing = square();
    let none = nothing.indices(&[]);
    let primitive = json!({"attributes": {"POSITION": 0}, "indices": none});
    nothing.json["meshes"][0]["primitives"] = std::iter::repeat_n(primitive, 10_000).collect();
    nothing.json["nodes"] = std::iter::repeat_n(json!({"mesh": 0}), 5000).collect();
    nothing.json["scenes"][0]["nodes"] = (0..5000).collect();
    assert!(failure(&nothing.glb()).contains("more vertices than can be held"));
    // JSON that nests.
    let nested = format!("{}{}", "{\"a\":".repeat(100_000), "1");
    assert!(failure(nested.as_bytes()).contains("JSON"));
    assert!(failure(&glb(b"{\"asset\":{\"version\":\"2.0\"}}", b"")).contains("no triangles"));
}

/// A folder with these files; the first is the model.
fn folder(files: &[(&str, &[u8])]) -> (tempfile::TempDir, PathBuf) {
    let place = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, bytes)| std::fs::write(place.path().join(name), bytes).unwrap());
    let path = place.path().join(files[0].0);
    (place, path)
}

fn png(picture: &RgbaImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

const OBJ: &str = "# a leaf and a stem\r\nmtllib my tree.mtl\r\no tree\r\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl old leaf \nf -4/-4 -3/-3 \\\n -2/-2 -1/-1\n\
    v 0 0 -1\nusemtl stem\nf 1 2 5\nl 1 2\n";

#[test]
fn an_obj_keeps_its_quads_counts_backwards_and_has_spaces_in_its_names() {
    let mtl = "newmtl old leaf\nKd 0.5 1 1\nmap_Kd -s 2 2 1 -clamp on leaf colour.png\nmap_d -imfchan l leaf cut.png\nnewmtl stem\nKd 0.3 0.2 0.1\n";
    let colour = RgbaImage::from_pixel(2, 2, Rgba([10, 20, 30, 255]));
    let cut = RgbaImage::from_fn(2, 2, |x, _| Rgba([255 * x as u8, 255 * x as u8, 255 * x as u8, 255]));
    let (_place, path) = folder(&[
        ("tree.obj", OBJ.as_bytes()),
        ("my tree.mtl", mtl.as_bytes()),
        ("leaf colour.png", &png(&colour)),
        ("leaf cut.png", &png(&cut)),
    ]);
    let imported = import::open(&path).unwrap();
    assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
    let [leaf, stem] = &imported.parts[..] else { panic!("two parts") };
    assert_eq!((leaf.material.name.as_str(), stem.material.name.as_str()), ("old leaf", "stem"));
    assert_eq!((leaf.surface.mesh.quads.len(), stem.surface.mesh.triangles.len()), (1, 1));
    assert!(close(area(&leaf.surface.mesh), Vec3::Z) && leaf.surface.normals.iter().all(|n| n.is_normalized()));
    // −s 2 2 scales upwards from the bottom: v = 1 − 2·0 at the first corner, 1 − 2·1 at the third.
    assert_eq!((leaf.surface.uvs[0], leaf.surface.uvs[2]), (Vec2::new(0.0, 1.0), Vec2::new(2.0, -1.0)));
    assert_eq!((leaf.material.alpha_cutoff, leaf.material.wrap, leaf.material.factor[0]), (Some(0.5), Wrap::Clamp, 0.5));
    let texture = leaf.material.texture.as_ref().unwrap();
    assert_eq!([0, 1].map(|x| texture.get_pixel(x, 0).0), [[10, 20, 30, 0], [10, 20, 30, 255]]);
    assert_eq!((stem.material.alpha_cutoff, stem.material.factor), (None, [0.3, 0.2, 0.1, 1.0]));
}

#[test]
fn an_obj_without_its_neighbours_is_still_a_shape() {
    let (_place, path) = folder(&[("tree.obj", OBJ.as_bytes())]);
    let imported = import::open(&path).unwrap();
    assert_eq!((imported.parts.len(), codes(&imported)[0]), (2, "missing-materials"));
    let (_place, path) = folder(&[
        ("tree.obj", OBJ.as_bytes()),
        ("my tree.mtl", b"newmtl old leaf\nmap_Kd C:\\art\\leaf.png\nnewmtl stem\nmap_Kd ../../bark.png"),
        ("leaf.png", &png(&picture())),
    ]);
    let imported = import::open(&path).unwrap();
    assert_eq!(codes(&imported), ["moved-file", "missing-texture"], "{:?}", imported.warnings);
    assert_eq!(imported.parts[0].material.alpha_cutoff, Some(0.5), "its own alpha cuts it out");
}

#[test]
fn large_faces_are_cut_into_ears() {
    // An arrowhead with a notch: a fan from the first corner would cover what is outside.
    let arrow = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 4 5 1 2 3\n";
    let part = only(import::read(arrow.as_bytes(), &Folder::default()).unwrap());
    assert_eq!(part.surface.mesh.triangles.len(), 3);
    let covered: f32 = part
        .surface
        .mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| part.surface.mesh.positions[i as usize]);
            0.5 * (b - a).cross(c - a).z
        })
        .inspect(|area| assert!(*area > 0.0, "a triangle faces backwards"))
        .sum();
    assert!((covered - 10.0).abs() < 1e-5, "{covered}");
    // A dart is cut along the diagonal inside it.
    let dart = "v 0 0 0\nv 2 -1 0\nv 0.5 0 0\nv 2 1 0\nf 2 3 4 1\n";
    let part = only(import::read(dart.as_bytes(), &Folder::default()).unwrap());
    assert!(part.surface.mesh.triangulated().all(|t| {
        let [a, b, c] = t.map(|i| part.surface.mesh.positions[i as usize]);
        (b - a).cross(c - a).z > 0.0
    }));
}

#[test]
fn a_broken_obj_names_its_line() {
    for (text, words) in [
        ("v 0 0 0\nf 1 2 3\n", "in line 2 a face names vertex 2, but there are 1 so far"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "in line 4 a face names vertex 0"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2 3\n", "names texture coordinate 1"),
        ("v 0 0 0\nf -2 -1 -1\n", "names vertex -2"),
        ("v 0 0 0\nf -9223372036854775808 1 1\n", "names vertex"),
        ("v 0 0 zero\n", "in line 1 “zero” is not a finite number"),
        ("v 0 0 nan\n", "not a finite number"),
        ("v 1 2\n", "fewer than three coordinates"),
        ("v 0 0 0\n", "no triangles"),
        ("v 0 0 0\nf 1 1 1\n", "no triangles (1 faces with fewer"),
    ] {
        assert!(failure(text.as_bytes()).contains(words), "{}", failure(text.as_bytes()));
    }
    assert!(matches!(import::open(Path::new("no/such.glb")), Err(Error::NoSuchFile { .. })));
}

#[test]
fn a_tree_of_a_thousand_nodes_becomes_one_surface_per_material() {
    let mut file = textured(&picture(), json!({"alphaMode": "MASK"}), json!({}));
    file.push("materials", json!({"name": "bark"}));
    let plain = json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": 2, "material": 1}]});
    file.push("meshes", plain);
    file.json["nodes"] = (0..1000).map(|k| json!({"mesh": k % 2, "translation": [k, 0, 0]})).collect();
    file.json["scenes"][0]["nodes"] = (0..1000).collect();
    let imported = read(&file);
    let [leaves, bark] = &imported.parts[..] else { panic!("{} parts", imported.parts.len()) };
    for (part, far) in [(leaves, 999.0), (bark, 1000.0)] {
        assert_eq!((part.surface.mesh.triangles.len(), part.surface.mesh.positions.len()), (1000, 2000));
        assert!(close(area(&part.surface.mesh), 500.0 * Vec3::Z));
        assert_eq!(part.surface.mesh.bounds().unwrap().max.x, far);
    }
    assert_eq!((leaves.surface.uvs.len(), bark.surface.uvs.len()), (2000, 0));
}

#[test]
fn normal_textures_are_read_where_they_lie_as_the_colours_do() {
    let with = |normal: Value, base: bool| {
        let mut file = textured(&picture(), json!({}), json!({"wrapS": 33_648, "wrapT": 33_071}));
        if !base {
            file.json["materials"][0]["pbrMetallicRoughness"] = json!({});
        }
        file.json["materials"][0]["normalTexture"] = normal;
        let bumps = RgbaImage::from_fn(2, 1, |x, _| if x == 0 { Rgba([128, 128, 255, 255]) } else { Rgba([218, 128, 218, 255]) });
        let mut png = std::io::Cursor::new(vec![]);
        bumps.write_to(&mut png, image::ImageFormat::Png).unwrap();
        let view = file.view(&png.into_inner());
        let image = file.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        file.push("textures", json!({"source": image, "sampler": 0}));
        let uvs = file.floats(&[0.0, 1.0, 2.0, 1.0, 2.0, 0.0, 0.0, 0.0], "VEC2");
        file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uvs.into();
        read(&file)
    };
    let plain = only(with(json!({"index": 1}), true));
    let normals = plain.material.normal_texture.unwrap();
    assert_eq!(normals.dimensions(), (4, 1), "mirrored as the colours are");
    assert_eq!([0, 1, 2, 3].map(|x| normals.get_pixel(x, 0)[0]), [128, 218, 218, 128]);
    // A slope of one made half as steep: 26.6° instead of 45°.
    let flatter = only(with(json!({"index": 1, "scale": 0.5}), true)).material.normal_texture.unwrap();
    let [x, _, z, _] = flatter.get_pixel(1, 0).0.map(|v| f32::from(v) / 127.5 - 1.0);
    assert!((x / z - 0.5).abs() < 0.02, "{x} {z}");
    // Without colours it lies as it says itself.
    let alone = only(with(json!({"index": 1}), false));
    assert!(alone.material.texture.is_none() && alone.material.normal_texture.is_some() && alone.surface.uvs.len() == 4);
    let elsewhere = json!({"index": 1, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}});
    let imported = with(elsewhere, true);
    assert_eq!(codes(&imported), ["normals-elsewhere"]);
    assert!(only(imported).material.normal_texture.is_none());
    assert!(only(with(json!({"index": 99}), true)).material.normal_texture.is_none());
}
