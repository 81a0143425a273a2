//! Reference trees: wood told from foliage, leaves counted one by one, doubts said.

use std::sync::Arc;

use glam::{Quat, Vec2, Vec3};
use image::{Rgba, RgbaImage};
use sphereboard::geom::{PolyMesh, Surface};
use sphereboard::model::reference::{Asked, By, ReferenceTree, Role};
use sphereboard::model::{About, Material, ModelCrown, Part, TreeModel, TrunkShape, glb, import};
use sphereboard::{Error, Seed, files};

/// The shared trees: leaves and leaf quads as their makers say (CREDITS.csv).
#[test]
fn the_shared_trees_have_their_leaves() {
    let Some(folder) = files::shared_folder().map(|folder| folder.join("meshes")).filter(|folder| folder.is_dir()) else {
        println!("SKIPPED: the shared meshes are not there");
        return;
    };
    for (name, leaves, quads, wood_triangles) in [
        ("eztree_oak_medium.glb", 2660, 5320, 3166),
        ("eztree_ash_medium.glb", 2720, 5440, 9120),
        ("eztree_pine_medium.glb", 2460, 4920, 10_032),
        ("quaternius_Birch_1.obj", 46, 552, 1210),
        ("quaternius_Pine_1.obj", 43, 258, 148),
        ("quaternius_Tree_1.obj", 15, 180, 444),
    ] {
        let tree = ReferenceTree::open(&folder.join(name), &Asked::default()).unwrap();
        assert_eq!((tree.leaves.len(), tree.leaf_quads()), (leaves, quads), "{name}");
        assert_eq!(tree.triangle_count(), wood_triangles + 2 * quads, "{name}");
        assert!(tree.told.iter().all(|told| told.by == By::Alpha));
        let too_high = tree.bounds.size().y > 60.0;
        assert_eq!(
            tree.warnings.iter().map(|w| w.code.as_str()).collect::<Vec<_>>(),
            if too_high { vec!["units"] } else { vec![] }
        );
        check_leaves(&tree);
    }
}

/// Every polygon of the foliage belongs to exactly one leaf.
fn check_leaves(tree: &ReferenceTree) {
    let mut next = vec![(0, 0); tree.foliage.len()];
    for leaf in &tree.leaves {
        let (quad, triangle) = &mut next[leaf.part as usize];
        assert_eq!((leaf.first_quad, leaf.first_triangle), (*quad, *triangle));
        (*quad, *triangle) = (*quad + leaf.quads, *triangle + leaf.triangles);
    }
    for (part, (quads, triangles)) in tree.foliage.iter().zip(next) {
        assert_eq!((part.surface.mesh.quads.len(), part.surface.mesh.triangles.len()), (quads as usize, triangles as usize));
    }
}

/// How leaves are written.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    /// Two triangles over four vertices.
    Indexed,
    /// Two triangles over six vertices.
    Soup,
    /// One quad.
    Quads,
    /// A leaf and its back, each with vertices of its own.
    TwoSided,
    /// Two quads that cross.
    Crossed,
    /// All first quads, then all that cross them.
    CrossedLater,
}

/// A crown of `count` leaves, 10 cm long, in a ball of 2 m about (0, 5, 0); many stand on one twig and share its end as a corner.
fn leaves(count: u64, form: Form) -> Surface {
    let mut surface = Surface::default();
    let rounds = if form == Form::CrossedLater { 2 } else { 1 };
    for (round, leaf) in (0..rounds).flat_map(|round| (0..count).map(move |leaf| (round, leaf))) {
        let mut draws = Seed(3).keyed("leaf", leaf);
        let mut twig = Seed(3).keyed("twig", leaf / 4);
        let mut unit = || twig.unit() as f32 - 0.5;
        let foot = Vec3::new(4.0 * unit(), 5.0 + 4.0 * unit(), 4.0 * unit());
        let turn = Quat::from_rotation_y(6.0 * draws.unit() as f32) * Quat::from_rotation_x(3.0 * draws.unit() as f32);
        let quarter = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
        // A kite with its tip at the twig, so that neighbours share a point but never an edge.
        let corners = [(0.0, 0.0), (0.05, 0.05), (0.0, 0.1), (-0.05, 0.05)].map(|(x, y)| Vec3::new(x, y, 0.0));
        let pieces: Vec<[Vec3; 4]> = match form {
            Form::TwoSided => vec![corners, [0, 3, 2, 1].map(|k| corners[k])],
            Form::Crossed => vec![corners, corners.map(|p| quarter * p)],
            Form::CrossedLater if round == 1 => vec![corners.map(|p| quarter * p)],
            _ => vec![corners],
        };
        for piece in pieces {
            add(&mut surface, piece.map(|p| foot + turn * p), form);
        }
    }
    surface
}

fn add(surface: &mut Surface, corners: [Vec3; 4], form: Form) {
    let first = surface.mesh.positions.len() as u32;
    let order: &[usize] = if form == Form::Soup { &[0, 1, 2, 0, 2, 3] } else { &[0, 1, 2, 3] };
    let uvs = [(0.5, 1.0), (1.0, 0.5), (0.5, 0.0), (0.0, 0.5)].map(Vec2::from);
    for &k in order {
        surface.mesh.positions.push(corners[k]);
        surface.normals.push((corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize());
        surface.uvs.push(uvs[k]);
    }
    match form {
        Form::Soup => surface.mesh.triangles.extend([[first, first + 1, first + 2], [first + 3, first + 4, first + 5]]),
        Form::Quads => surface.mesh.quads.push([first, first + 1, first + 2, first + 3]),
        _ => surface.mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]),
    }
}

/// A stem of six sides from y = 0 to `top`, of three rings per metre.
fn stem(top: f32) -> Surface {
    let mut mesh = PolyMesh::default();
    let rings = (3.0 * top) as u32 + 1;
    for (ring, side) in (0..=rings).flat_map(|ring| (0..6u32).map(move |side| (ring, side))) {
        let angle = side as f32 * std::f32::consts::TAU / 6.0;
        mesh.positions.push(Vec3::new(0.15 * angle.sin(), top * ring as f32 / rings as f32, 0.15 * angle.cos()));
        if ring < rings {
            let at = |ring: u32, side: u32| ring * 6 + side % 6;
            mesh.quads.push([at(ring, side), at(ring, side + 1), at(ring + 1, side + 1), at(ring + 1, side)]);
        }
    }
    let uvs = vec![Vec2::splat(0.01); mesh.positions.len()];
    Surface { normals: mesh.vertex_normals(), uvs, mesh, ..Surface::default() }
}

/// Left half opaque, right half gaps.
fn half_cut() -> Material {
    let texture = RgbaImage::from_fn(8, 8, |x, _| Rgba([80, 140, 60, if x < 4 { 255 } else { 0 }]));
    Material { texture: Some(Arc::new(texture)), alpha_cutoff: Some(0.5), ..Material::default() }
}

fn part(name: &str, material: Material, surface: Surface) -> Part {
    Part { name: name.to_owned(), surface, material: Material { name: name.to_owned(), ..material }, crown_center: None }
}

fn tree(parts: Vec<Part>) -> ReferenceTree {
    let tree = ReferenceTree::new("tree".to_owned(), parts, &Asked::default()).unwrap();
    check_leaves(&tree);
    tree
}

#[test]
fn leaves_are_counted_however_they_are_written() {
    for (form, quads) in [
        (Form::Indexed, 300),
        (Form::Soup, 300),
        (Form::Quads, 300),
        (Form::TwoSided, 600),
        (Form::Crossed, 600),
        (Form::CrossedLater, 600),
    ] {
        let tree = tree(vec![part("a", Material::default(), stem(5.0)), part("b", half_cut(), leaves(300, form))]);
        assert_eq!((tree.leaves.len(), tree.leaf_quads()), (300, quads), "form {}", form as u8);
        assert!(tree.warnings.is_empty(), "{:?}", tree.warnings);
    }
}

#[test]
fn the_surface_stays_what_it_was() {
    let before = leaves(200, Form::CrossedLater);
    let tree = tree(vec![part("a", Material::default(), stem(5.0)), part("b", half_cut(), before.clone())]);
    let after = &tree.foliage[0].surface;
    assert_eq!((&after.mesh.positions, &after.uvs), (&before.mesh.positions, &before.uvs));
    let triangles = |mesh: &PolyMesh| {
        let mut all: Vec<[u32; 3]> = mesh.triangulated().collect();
        for t in &mut all {
            let least = (0..3).min_by_key(|&k| t[k]).unwrap();
            t.rotate_left(least);
        }
        all.sort_unstable();
        all
    };
    assert_eq!(triangles(&after.mesh), triangles(&before.mesh));
}

#[test]
fn without_alpha_many_small_flat_pieces_are_leaves() {
    let roles = |tree: &ReferenceTree| tree.told.iter().map(|told| (told.role, told.by)).collect::<Vec<_>>();
    let opaque = tree(vec![part("a", Material::default(), stem(5.0)), part("b", Material::default(), leaves(300, Form::Indexed))]);
    assert_eq!(roles(&opaque), [(Role::Wood, By::Connectivity), (Role::Foliage, By::Connectivity)]);
    // All in one surface, as a scanner or a careless exporter leaves it.
    let mut all = stem(5.0);
    let crown = leaves(300, Form::Indexed);
    let first = all.mesh.positions.len() as u32;
    all.mesh.triangles.extend(crown.mesh.triangles.iter().map(|t| t.map(|v| v + first)));
    all.mesh.positions.extend(&crown.mesh.positions);
    all.normals.extend(&crown.normals);
    all.uvs.extend(&crown.uvs);
    let one = tree(vec![part("tree", Material::default(), all.clone())]);
    assert_eq!(roles(&one), [(Role::Wood, By::Connectivity), (Role::Foliage, By::Connectivity)]);
    assert_eq!((one.leaves.len(), one.wood[0].surface.mesh.positions.len()), (300, first as usize));
    // The same with one texture for both, of which the stem uses the opaque corner.
    let atlas = tree(vec![part("tree", half_cut(), all)]);
    assert_eq!(roles(&atlas), [(Role::Wood, By::Alpha), (Role::Foliage, By::Alpha)]);
    assert_eq!(atlas.leaves.len(), 300);
    // Short twigs of six sides are no leaves.
    let mut twigs = Surface::default();
    for k in 0..100u32 {
        let twig = stem(0.3);
        let first = twigs.mesh.positions.len() as u32;
        twigs.mesh.quads.extend(twig.mesh.quads.iter().map(|q| q.map(|v| v + first)));
        twigs.mesh.positions.extend(twig.mesh.positions.iter().map(|p| *p + Vec3::Y * 0.05 * k as f32));
        twigs.normals.extend(twig.normals);
        twigs.uvs.extend(twig.uvs);
    }
    let bare = tree(vec![part("twigs", Material::default(), twigs.clone())]);
    assert_eq!((roles(&bare), bare.warnings[0].code.as_str()), (vec![(Role::Wood, By::Default)], "no-leaves"));
    let named = tree(vec![part("Needles.001", Material::default(), twigs), part("a", Material::default(), stem(5.0))]);
    assert_eq!(roles(&named), [(Role::Foliage, By::Name), (Role::Wood, By::Name)]);
}

#[test]
fn a_person_has_the_last_word() {
    let parts = || vec![part("Bark", half_cut(), stem(5.0)), part("Leaf", Material::default(), leaves(300, Form::Indexed))];
    let asked = |leaves: &[&str], wood: &[&str]| {
        let names = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect();
        ReferenceTree::new("tree".to_owned(), parts(), &Asked { leaves: names(leaves), wood: names(wood) })
    };
    let tree = asked(&["leaf"], &["BARK"]).unwrap();
    assert_eq!(
        tree.told.iter().map(|told| (told.role, told.by)).collect::<Vec<_>>(),
        [(Role::Wood, By::Asked), (Role::Foliage, By::Asked)]
    );
    assert_eq!(tree.leaves.len(), 300);
    let tree = asked(&[], &["Leaf"]).unwrap();
    assert_eq!(tree.told[1].role, Role::Wood);
    let error = asked(&["Leafs"], &[]).unwrap_err();
    assert!(matches!(&error, Error::UnknownMaterial { flag: "--leaves", .. }), "{error}");
    assert!(error.to_string().contains("Bark, Leaf"), "{error}");
}

#[test]
fn doubts_are_said_and_nothing_is_moved() {
    let moved = |by: &dyn Fn(Vec3) -> Vec3| {
        let mut parts = vec![part("a", Material::default(), stem(8.0)), part("b", half_cut(), leaves(300, Form::Indexed))];
        parts.iter_mut().flat_map(|part| &mut part.surface.mesh.positions).for_each(|p| *p = by(*p));
        let tree = tree(parts);
        let codes: Vec<&str> = tree.warnings.iter().map(|warning| warning.code.as_str()).collect();
        codes.join(" ")
    };
    assert_eq!(moved(&|p| p), "");
    assert_eq!(moved(&|p| 100.0 * p), "units");
    assert_eq!(moved(&|p| 0.01 * p), "units");
    assert_eq!(moved(&|p| p + Vec3::Y * 3.0), "foot");
    assert_eq!(moved(&|p| p + Vec3::X * 3.0), "foot");
    assert_eq!(moved(&|p| Vec3::new(p.x, -p.z, p.y)), "lies");
    assert!(matches!(ReferenceTree::new("none".to_owned(), vec![], &Asked::default()), Err(Error::EmptyModel { .. })));
}

#[test]
fn a_hundred_thousand_leaves_in_one_place_do_not_take_forever() {
    let mut heap = Surface::default();
    let mut draws = Seed(1).keyed("heap", 0);
    for _ in 0..100_000 {
        let at = Vec3::new(draws.unit() as f32, draws.unit() as f32, draws.unit() as f32) * 0.004;
        add(&mut heap, [(0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.1)].map(|(x, y)| at + Vec3::new(x, y, 0.0)), Form::Indexed);
    }
    let started = std::time::Instant::now();
    let tree = tree(vec![part("a", Material::default(), stem(5.0)), part("b", half_cut(), heap)]);
    assert_eq!(tree.leaf_quads(), 100_000);
    assert!(started.elapsed().as_secs() < 20);
}

#[test]
fn inspect_prints_for_people_and_programs() {
    let place = tempfile::tempdir().unwrap();
    let obj = "usemtl bark\nv 0 0 0\nv 1 0 0\nv 1 3 0\nv 0 3 0\nf 1 2 3 4\n";
    let path = place.path().join("my tree.obj");
    std::fs::write(&path, obj).unwrap();
    let run = |arguments: &[&str]| {
        let output = assert_cmd::Command::cargo_bin("sphereboard").unwrap().arg("inspect").args(arguments).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let path = path.to_str().unwrap();
    let (code, table, _) = run(&[path]);
    assert_eq!(code, Some(0));
    assert!(table.contains("3.00 m high") && table.contains("bark is wood") && table.contains("warning: no leaves"), "{table}");
    let (code, report, errors) = run(&["--json", "--leaves", "bark", path, "gone.glb"]);
    assert_eq!((code, errors.as_str()), (Some(1), ""));
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let [tree, gone] = &report["files"].as_array().unwrap()[..] else { panic!("two files") };
    assert_eq!((&tree["leaves"], &tree["leaf_quads"], &tree["triangles"]), (&1.into(), &1.into(), &2.into()));
    assert_eq!(tree["parts"][0]["role"], "foliage");
    assert!(gone["error"].as_str().unwrap().contains("there is no file gone.glb"));
    let (code, _, errors) = run(&["--wood", "brak", path]);
    assert_eq!(code, Some(1));
    assert!(errors.contains("--wood names the material brak, but the file has bark"), "{errors}");
}

#[test]
fn a_model_of_ours_is_known_again() {
    let crown = leaves(1, Form::Quads);
    let about = About {
        format: About::FORMAT,
        program: About::this_program(),
        seed: 1,
        sources: vec![],
        height_m: 9.0,
        height_guessed: true,
        parameters: serde_json::Map::new(),
        feature_points: vec![],
        exemplar_window_px: None,
        gap_fraction: 0.0,
        growth: sphereboard::model::Growth::likely(sphereboard::model::GrowthProfile::Broadleaf, 9.0),
    };
    let texture = RgbaImage::from_pixel(2, 2, Rgba([1, 2, 3, 255]));
    let center = Vec3::Y * 5.0;
    let trunk = Some(TrunkShape::guessed(Vec3::Y * 2.0, Vec3::Y * 5.0, 10.0).build());
    let model = TreeModel { crowns: vec![ModelCrown { surface: crown, texture, center }], trunk, about };
    let bytes = glb::write(&model).unwrap();
    let imported = import::read(&bytes, &import::Folder::default()).unwrap();
    assert_eq!((imported.tree_model.as_ref(), imported.parts[0].crown_center), (Some(&model), Some(center)));
    let tree = ReferenceTree::new("oak".to_owned(), imported.parts, &Asked::default()).unwrap();
    assert!(tree.leaves.is_empty(), "a crown is one surface");
    assert_eq!(
        tree.told.iter().map(|told| (told.role, told.by)).collect::<Vec<_>>(),
        [(Role::Foliage, By::Model), (Role::Wood, By::Model)]
    );
    // Rearranged by another program, it is a mesh like any other.
    let text = String::from_utf8_lossy(&bytes).into_owned();
    assert!(text.contains("\"triangles\":"));
    let at = bytes.windows(9).position(|w| w == b"\"triangle").unwrap();
    let mut changed = bytes;
    changed[at + 1] = b'T';
    let imported = import::read(&changed, &import::Folder::default()).unwrap();
    assert_eq!((imported.tree_model.is_none(), imported.warnings[0].code.as_str()), (true, "changed-model"));
    assert_eq!(imported.parts.len(), 2);
}
