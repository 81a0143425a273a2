//! Import on damaged glTF and OBJ files: any answer is fine, a panic, a hang or a heap of memory is not.
//!
//! Random bytes hardly ever become a file, so most runs damage a sound one: numbers of its JSON are replaced, bytes of its buffer
//! flipped. What is read must be fit for a renderer.

#![no_main]

use std::sync::OnceLock;

use libfuzzer_sys::arbitrary::{self, Arbitrary};
use libfuzzer_sys::fuzz_target;
use serde_json::{Value, json};
use sphereboard::Seed;
use sphereboard::model::import::{self, Folder};
use sphereboard::model::reference::{Asked, ReferenceTree};
use sphereboard::model::{Part, bounds};
use sphereboard::repr::file::{self, Origin};
use sphereboard::repr::{BuiltPart, BuiltTree};

#[derive(Arbitrary, Debug)]
enum Input {
    File(Vec<u8>),
    Obj(Vec<Line>),
    Gltf { damages: Vec<Damage>, bytes: Vec<(u16, u8)>, cut: u16 },
    Baked { flips: Vec<(u32, u8)>, cut: u32 },
}

/// One line of an OBJ file.
#[derive(Arbitrary, Debug)]
enum Line {
    Vertex([i8; 3]),
    Uv([i8; 2]),
    Face(Vec<(i8, Option<i8>)>),
    Material(u8),
    Other(String),
}

/// Another value for the n-th number of the document.
#[derive(Arbitrary, Debug)]
struct Damage {
    number: u16,
    value: Number,
}

#[derive(Arbitrary, Debug)]
enum Number {
    Small(u8),
    Signed(i32),
    Wide(u64),
    Real(f64),
}

impl Line {
    fn text(&self) -> String {
        match self {
            Self::Vertex([x, y, z]) => format!("v {x} {y} {z}"),
            Self::Uv([u, v]) => format!("vt {u} {v}"),
            Self::Face(corners) => {
                let corner = |(v, t): &(i8, Option<i8>)| t.map_or(format!(" {v}"), |t| format!(" {v}/{t}"));
                format!("f{}", corners.iter().map(corner).collect::<String>())
            }
            Self::Material(name) => format!("usemtl {name}"),
            Self::Other(text) => text.clone(),
        }
    }
}

/// A file with a bit of everything: two nodes, a strip, a sparse accessor, strides, colours, instances, a texture transform.
fn document() -> Value {
    json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [
            {"children": [1], "rotation": [0, 0, 0, 1], "translation": [1, 2, 3]},
            {"mesh": 0, "scale": [1, -1, 1], "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}},
        ],
        "meshes": [{"primitives": [
            {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": 3}, "indices": 4, "mode": 4, "material": 0},
            {"attributes": {"POSITION": 0}, "indices": 4, "mode": 5},
        ]}],
        "materials": [{"alphaMode": "MASK", "alphaCutoff": 0.5, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1],
            "baseColorTexture": {"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform": {"rotation": 1, "scale": [2, 2]}}}}}],
        "textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 33648, "wrapT": 33071}], "images": [{"bufferView": 3}],
        "accessors": [
            {"bufferView": 0, "byteOffset": 0, "componentType": 5126, "type": "VEC3", "count": 4, "sparse": {"count": 1,
                "indices": {"bufferView": 2, "byteOffset": 0, "componentType": 5123}, "values": {"bufferView": 1, "byteOffset": 0}}},
            {"bufferView": 1, "componentType": 5120, "type": "VEC3", "count": 4, "normalized": true},
            {"bufferView": 1, "componentType": 5123, "type": "VEC2", "count": 4, "normalized": true},
            {"bufferView": 1, "componentType": 5121, "type": "VEC4", "count": 4, "normalized": true},
            {"bufferView": 2, "componentType": 5123, "type": "SCALAR", "count": 6},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48, "byteStride": 12}, {"buffer": 0, "byteOffset": 48, "byteLength": 16, "byteStride": 4},
            {"buffer": 0, "byteOffset": 64, "byteLength": 12}, {"buffer": 0, "byteOffset": 76, "byteLength": 68},
        ],
        "buffers": [{"byteLength": 144}],
    })
}

fn binary() -> Vec<u8> {
    let positions = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    let mut bytes: Vec<u8> = positions.iter().flat_map(|p| p.to_le_bytes()).collect();
    bytes.extend([0, 0, 127, 0].repeat(4));
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    let picture = image::RgbImage::from_pixel(2, 1, image::Rgb([9, 99, 9]));
    let mut bmp = std::io::Cursor::new(vec![]);
    picture.write_to(&mut bmp, image::ImageFormat::Bmp).expect("memory takes every picture");
    bytes.extend(bmp.into_inner());
    bytes.resize(144, 0);
    bytes
}

/// The places of all numbers.
fn numbers(value: &Value, at: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(_) => found.push(at.to_owned()),
        Value::Array(list) => list.iter().enumerate().for_each(|(k, v)| numbers(v, &format!("{at}/{k}"), found)),
        Value::Object(map) => map.iter().for_each(|(k, v)| numbers(v, &format!("{at}/{k}"), found)),
        _ => {}
    }
}

fn damaged(damages: &[Damage], flips: &[(u16, u8)], cut: u16) -> Vec<u8> {
    let (mut json, mut binary) = (document(), binary());
    let mut places = Vec::new();
    numbers(&json, "", &mut places);
    for damage in damages {
        let place = &places[usize::from(damage.number) % places.len()];
        *json.pointer_mut(place).expect("the place was just found") = match damage.value {
            Number::Small(n) => n.into(),
            Number::Signed(n) => n.into(),
            Number::Wide(n) => n.into(),
            Number::Real(n) => n.into(),
        };
    }
    let length = binary.len();
    flips.iter().for_each(|&(at, with)| binary[usize::from(at) % length] ^= with);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let whole = 28 + text.len() + binary.len();
    let header = |kind: &[u8; 4], length: usize| [&(length as u32).to_le_bytes()[..], kind].concat();
    let mut file = [b"glTF", &2u32.to_le_bytes()[..], &(whole as u32).to_le_bytes()].concat();
    file.extend(header(b"JSON", text.len()));
    file.extend(text);
    file.extend(header(b"BIN\0", binary.len()));
    file.extend(binary);
    if cut % 8 == 1 {
        file.truncate(usize::from(cut));
    }
    file
}

/// A tree as `sphereboard bake` writes it, its bytes flipped and its end cut off.
fn baked(flips: &[(u32, u8)], cut: u32) -> Vec<u8> {
    static SOUND: OnceLock<Vec<u8>> = OnceLock::new();
    let sound = SOUND.get_or_init(|| {
        let parts = import::read(&damaged(&[], &[], 0), &Folder::default()).expect("the file is sound").parts;
        let built = BuiltTree::new(bounds(&parts).expect("there are parts"), parts.into_iter().map(BuiltPart::still).collect());
        let origin = Origin { source: "fuzz".to_owned(), trunk: None, parameters: Default::default(), seed: Seed(1) };
        file::write(&built, &origin).expect("the tree is sound")
    });
    let mut bytes = sound.clone();
    flips.iter().for_each(|&(at, with)| bytes[at as usize % sound.len()] ^= with);
    if cut % 8 == 1 {
        bytes.truncate(cut as usize % sound.len());
    }
    bytes
}

/// What a renderer relies on.
fn check(part: &Part) {
    let (surface, count) = (&part.surface, part.surface.mesh.positions.len());
    assert!(surface.mesh.polygon_count() > 0 && surface.normals.len() == count);
    assert!(surface.mesh.polygons().flatten().all(|&corner| (corner as usize) < count));
    assert!(surface.mesh.positions.iter().all(|p| p.is_finite()) && surface.uvs.iter().all(|uv| uv.is_finite()));
    assert!([0, count].contains(&surface.uvs.len()) && [0, count].contains(&surface.colors.len()));
    assert!(part.material.texture.is_none() || surface.uvs.len() == count);
    assert!(surface.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
}

fuzz_target!(|input: Input| {
    let bytes = match &input {
        Input::File(bytes) => bytes.clone(),
        Input::Obj(lines) => lines.iter().map(Line::text).collect::<Vec<_>>().join("\n").into_bytes(),
        Input::Gltf { damages, bytes, cut } => damaged(damages, bytes, *cut),
        Input::Baked { flips, cut } => baked(flips, *cut),
    };
    if let Some(Ok((built, _))) = file::read(&bytes) {
        built.check().expect("what is read is sound");
        built.parts.iter().for_each(|part| check(&part.part));
    }
    let Ok(imported) = import::read(&bytes, &Folder::default()) else { return };
    assert!(!imported.parts.is_empty());
    imported.parts.iter().for_each(check);
    let tree = ReferenceTree::new("fuzz".to_owned(), imported.parts, &Asked::default()).expect("a tree with polygons");
    tree.parts().for_each(check);
    let _ = tree.leaf_quads() + tree.triangle_count();
});
