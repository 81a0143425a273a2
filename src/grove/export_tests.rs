use super::*;
use crate::geom::{Bounds, HeightField};
use crate::grove::path::{Key, Path};
use crate::grove::placement::SpeciesSize;
use crate::grove::{Planted, SceneFile};
use crate::repr::Seen;

fn part(name: &str) -> Part {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 2.0, 0.0), Vec3::new(0.0, 2.0, 0.0)];
    let mesh = PolyMesh { positions, triangles: vec![], quads: vec![[0, 1, 2, 3]] };
    let surface = Surface { mesh, normals: vec![Vec3::Z; 4], ..Surface::default() };
    Part { name: name.to_owned(), surface, material: Material::default(), crown_center: None }
}

/// A mesh to 5 tree heights, then a card that turns.
fn stock(name: &str, far: Drawn) -> Stock {
    let near = BuiltPart::still(part("mesh")).seen(Seen::between(Vec3::Y, 0.0, 5.0, 0.1));
    let far = BuiltPart { part: part("card"), drawn: far, seen: Seen::between(Vec3::Y, 5.0, f32::MAX, 0.1) };
    let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 2.0, 0.1) };
    let size =
        SpeciesSize { name: name.to_owned(), also: vec![], share: 1.0, height_m: 2.0, crown_width_m: 1.0, trunk_radius_m: 0.1 };
    Stock { built: BuiltTree::new(bounds, vec![near, far]), size, warnings: vec![] }
}

fn scene(planted: Vec<Planted>, species: &[Stock]) -> Scene {
    let key = Key { time_s: 0.0, eye: Vec3::new(0.0, 5.0, 50.0), target: Vec3::ZERO };
    Scene {
        file: SceneFile::default(),
        ground: HeightField::flat(400.0).unwrap(),
        georeference: None,
        species: species.iter().map(|stock| stock.size.clone()).collect(),
        planted,
        path: Path::new(vec![key]).unwrap(),
        warnings: vec![],
    }
}

fn planted(count: u16) -> Vec<Planted> {
    let tree = |i: u16| {
        let at = f32::from(i);
        let position = Vec3::new((at * 37.7).rem_euclid(400.0) - 200.0, 0.1 * at.sin(), (at * 91.3).rem_euclid(400.0) - 200.0);
        Planted { species: i % 2, position, yaw_rad: (0.61 * at).rem_euclid(6.25), scale: 1.0 + 0.5 * at.sin() }
    };
    (0..count).map(tree).collect()
}

/// The file's JSON and the numbers of one of its accessors.
struct Read {
    json: serde_json::Value,
    bytes: Vec<u8>,
}

impl Read {
    fn new(glb: &[u8]) -> Self {
        let glb = gltf::binary::Glb::from_slice(glb).unwrap();
        Self { json: serde_json::from_slice(&glb.json).unwrap(), bytes: glb.bin.unwrap().into_owned() }
    }

    fn list<const N: usize>(&self, accessor: &serde_json::Value) -> Vec<[f32; N]> {
        let accessor = &self.json["accessors"][accessor.as_u64().unwrap() as usize];
        assert_eq!((&accessor["componentType"], &accessor["type"]), (&5126.into(), &format!("VEC{N}").into()));
        let view = &self.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let (from, length) = (view["byteOffset"].as_u64().unwrap() as usize, view["byteLength"].as_u64().unwrap() as usize);
        assert_eq!(length, accessor["count"].as_u64().unwrap() as usize * 4 * N, "as long as it says");
        assert!(from % 4 == 0 && from + length <= self.bytes.len());
        let numbers: Vec<f32> = self.bytes[from..from + length].as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        numbers.as_chunks::<N>().0.to_vec()
    }

    /// Name, foot, turn as a quaternion and size of every copy.
    fn copies(&self) -> Vec<(String, Vec3, [f32; 4], [f32; 3])> {
        let mut all = vec![];
        for node in self.json["nodes"].as_array().unwrap() {
            let Some(lists) = node["extensions"].get("EXT_mesh_gpu_instancing") else { continue };
            let lists = &lists["attributes"];
            let [at, turn, size] = ["TRANSLATION", "ROTATION", "SCALE"].map(|name| &lists[name]);
            let (at, turn, size) = (self.list::<3>(at), self.list::<4>(turn), self.list::<3>(size));
            assert!(at.len() == turn.len() && at.len() == size.len() && !at.is_empty(), "lists of one length");
            assert!(node.get("mesh").is_some() && node.get("translation").is_none() && node.get("matrix").is_none());
            let name = node["name"].as_str().unwrap();
            all.extend(at.into_iter().zip(turn).zip(size).map(|((at, turn), size)| (name.to_owned(), at.into(), turn, size)));
        }
        all
    }
}

#[test]
fn every_tree_stands_in_the_file_once_where_it_was_planted() {
    let species = [stock("ash", Drawn::Still), stock("elm", Drawn::Still)];
    let scene = scene(planted(300), &species);
    let params = ExportParams { export_cell_m: 50.0, ..ExportParams::default() };
    let export = export(&scene, &species, &params).unwrap();
    let read = Read::new(&export.glb);
    for list in ["extensionsUsed", "extensionsRequired"] {
        assert_eq!(read.json[list], serde_json::json!(["EXT_mesh_gpu_instancing"]));
    }
    let mut found = read.copies();
    assert_eq!((found.len(), export.trees, export.triangles), (300, 300, 600));
    for tree in &scene.planted {
        let index = found.iter().position(|(_, at, ..)| *at == tree.position).expect("a copy for each tree");
        let (name, _, turn, size) = found.swap_remove(index);
        assert!(name.starts_with(["ash", "elm"][usize::from(tree.species)]) && name.contains("card"), "{name}");
        let cell = [tree.position.z, tree.position.x].map(|v| ((v + 200.0) / 50.0).floor());
        assert!(name.ends_with(&format!("{}/{}", cell[0], cell[1])), "{name}: {}", tree.position);
        let expected = glam::Mat3::from_rotation_y(tree.yaw_rad) * Vec3::X;
        assert!(((glam::Quat::from_array(turn) * Vec3::X) - expected).length() < 1e-5, "turned as planted");
        assert_eq!(size, [tree.scale; 3]);
    }
    // Ground: one mesh that is not copied.
    assert_eq!(read.json["nodes"][0]["name"], "ground");
    assert_eq!(super::export(&scene, &species, &params).unwrap(), export, "same scene, same bytes");
}

#[test]
fn a_tree_more_is_forty_bytes_more_and_no_tree_needs_no_extension() {
    let species = [stock("ash", Drawn::Still), stock("elm", Drawn::Still)];
    let params = ExportParams { export_cell_m: 400.0, ..ExportParams::default() };
    let of = |count| export(&scene(planted(count), &species), &species, &params).unwrap();
    let binary = |count| Read::new(&of(count).glb).bytes.len();
    assert_eq!(binary(1200) - binary(600), 600 * 40);
    let none = of(0);
    assert!(none.trees == 0 && none.draws == 0 && Read::new(&none.glb).json.get("extensionsRequired").is_none());
}

#[test]
fn what_gltf_cannot_say_is_left_for_a_level_near_by_or_told() {
    let turned = Drawn::Turned { pivot: Vec3::ZERO, upright: true };
    let of = |distance: f64, cell: &Stock| {
        let params = ExportParams { export_distance: distance, ..ExportParams::default() };
        let scene = scene(planted(1), std::slice::from_ref(cell));
        let export = export(&scene, std::slice::from_ref(cell), &params).unwrap();
        (Read::new(&export.glb).copies()[0].0.clone(), export.warnings.len())
    };
    let plain = stock("ash", Drawn::Still);
    assert!(of(2.0, &plain).0.contains("mesh") && of(10.0, &plain).0.contains("card") && of(5.2, &plain).1 == 0);
    let turning = stock("ash", turned);
    assert!(of(6.0, &turning).0.contains("mesh"), "the mesh is near enough");
    let (name, warnings) = of(10.0, &turning);
    assert!(name.contains("card") && warnings == 1, "nothing else is near");
    // Crossed: as wide along Z as along X, seen from both sides.
    let (part, plainly) = plainly(&turning.built.parts[1]);
    let Plainly::Other(crossed) = plainly else { panic!("one card alone") };
    let box_of = crossed.mesh.bounds().unwrap();
    assert!(part.material.two_sided && (box_of.size() - Vec3::new(1.0, 2.0, 1.0)).length() < 1e-6, "{box_of:?}");
}
