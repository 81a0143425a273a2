use std::collections::BTreeSet;
use std::sync::{Arc, LazyLock};

use glam::{Vec2, Vec3};
use image::RgbaImage;

use super::plan::{PlannedBox, Rules, plan};
use super::*;
use crate::Seed;
use crate::geom::Bounds;
use crate::model::reference::Asked;
use crate::model::{Material, Wrap};
use crate::repr::file::Origin;
use crate::repr::{Seen, Settings, SoftwareCapture};

const RULES: Rules = Rules { least_share: 0.15, least_leaves: 100, most_boxes: 48 };

fn preset(name: &str) -> ReferenceTree {
    match TreeSource::open(name, &Asked::default(), Seed(1)).unwrap().0 {
        TreeSource::Reference(tree) => *tree,
        TreeSource::Model { .. } => unreachable!("a preset is a tree"),
    }
}

/// Grown once for all tests.
static OAK: LazyLock<ReferenceTree> = LazyLock::new(|| preset("oak"));

/// Tufts of leaves at the tips of branches that stand out from a stem, as a file would bring them: without bones.
fn tufted(branches: u32, leaves: u32) -> ReferenceTree {
    let (mut wood, mut crown) = (Surface::default(), Surface::default());
    let quad = |a: Vec3, along: Vec3, across: Vec3| Surface {
        mesh: PolyMesh {
            positions: vec![a, a + across, a + across + along, a + along],
            triangles: vec![],
            quads: vec![[0, 1, 2, 3]],
        },
        normals: vec![across.cross(along).normalize(); 4],
        uvs: vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO],
        ..Surface::default()
    };
    wood.append(quad(Vec3::ZERO, 10.0 * Vec3::Y, 0.3 * Vec3::X));
    for branch in 0..branches {
        let mut draws = Seed(7).keyed("tuft", u64::from(branch));
        let turn = branch as f32 * 2.4;
        let out = Vec3::new(turn.cos(), 0.3, turn.sin());
        let foot = Vec3::Y * (3.0 + 7.0 * branch as f32 / branches as f32);
        wood.append(quad(foot, 3.0 * out, 0.1 * Vec3::Y));
        for _ in 0..leaves {
            let mut signed = || draws.signed() as f32;
            let at = foot + 3.0 * out + 0.9 * Vec3::new(signed(), signed(), signed());
            let along = Vec3::new(signed(), signed(), signed()).normalize_or(Vec3::Y);
            crown.append(quad(at, 0.2 * along, 0.2 * along.any_orthonormal_vector()));
        }
    }
    let leaf = Material {
        name: "leaf".to_owned(),
        texture: Some(Arc::new(RgbaImage::from_pixel(4, 4, image::Rgba([60, 120, 30, 255])))),
        wrap: Wrap::Clamp,
        alpha_cutoff: Some(0.5),
        two_sided: true,
        ..Material::default()
    };
    let bark = Material { name: "bark".to_owned(), ..Material::default() };
    let part = |name: &str, surface, material| Part { name: name.to_owned(), surface, material, crown_center: None };
    let mut asked = Asked { leaves: vec![], wood: vec!["bark".to_owned()] };
    let mut parts = vec![part("wood", wood, bark)];
    if crown.mesh.polygon_count() > 0 {
        parts.push(part("leaves", crown, leaf));
        asked.leaves.push("leaf".to_owned());
    }
    ReferenceTree::new("tufted".to_owned(), parts, &asked).unwrap()
}

fn crown_of(tree: ReferenceTree, settings: &[&str]) -> Crown {
    let source = TreeSource::reference(tree);
    let settings = Settings::parse(["picture_px=16", "least_leaves=20"].iter().chain(settings).copied()).unwrap();
    let capture = SoftwareCapture::default();
    crown(&Job { source: &source, scope: Scope::Foliage, settings: &settings, seed: Seed(1), capture: &capture }).unwrap()
}

fn check_plan(boxes: &[PlannedBox], branches: &Branches, rules: Rules) {
    assert!(boxes.len() <= rules.most_boxes && boxes[0].leaves.len() == branches.leaves.len());
    for (number, own) in boxes.iter().enumerate() {
        let children: Vec<&PlannedBox> = boxes.iter().filter(|b| b.parent == Some(number as u32)).collect();
        assert_eq!(own.divided, !children.is_empty());
        assert!(children.is_empty() || children.len() >= 2, "a box alone in another shows nothing new");
        for child in &children {
            assert!(child.bounds.min.cmpge(own.bounds.min).all() && child.bounds.max.cmple(own.bounds.max).all(), "boxes nest");
            assert!(child.leaves.len() >= rules.least_leaves.min(own.leaves.len()));
            assert_eq!(child.depth, own.depth + 1);
        }
        let mut held: Vec<u32> = children.iter().flat_map(|child| child.leaves.iter().copied()).collect();
        let mut leaves = own.leaves.clone();
        held.sort_unstable();
        leaves.sort_unstable();
        assert!(children.is_empty() || held == leaves, "every leaf once");
    }
}

#[test]
fn boxes_hold_every_leaf_once_at_every_depth_and_nest() {
    for (name, mut tree) in [("oak", OAK.clone()), ("juniper", preset("juniper"))] {
        for skeleton in [true, false] {
            if !skeleton {
                tree.skeleton = None;
            }
            let branches = Branches::of(&tree);
            for rules in [RULES, Rules { least_share: 0.0, most_boxes: 9, ..RULES }, Rules { most_boxes: 1, ..RULES }] {
                let boxes = plan(&branches, rules);
                check_plan(&boxes, &branches, rules);
                assert!(rules.most_boxes < 9 || boxes.len() > 4, "{name}: {} boxes", boxes.len());
            }
        }
    }
}

#[test]
fn a_smaller_threshold_gives_more_boxes() {
    let branches = Branches::of(&OAK);
    let count = |least_share| plan(&branches, Rules { least_share, least_leaves: 50, most_boxes: 1000 }).len();
    assert!(count(0.9) < count(0.3) && count(0.3) < count(0.1), "{} {} {}", count(0.9), count(0.3), count(0.1));
}

#[test]
fn leaves_grow_on_the_branch_of_their_bone() {
    let tree = &*OAK;
    let branches = Branches::of(tree);
    let skeleton = tree.skeleton.as_ref().unwrap();
    let bones = crate::plant::boxes::of(skeleton);
    // Quad i is the i-th leaf of the skeleton, and its bone lies in the range of its branch and in that of none that grows on it.
    let of_leaf = skeleton.bones.iter().enumerate().filter(|(_, bone)| bone.kind == crate::plant::BoneKind::Leaf);
    for ((bone, _), (leaf, branch)) in of_leaf.zip(tree.leaves.iter().zip(&branches.branch_of)) {
        assert_eq!(leaf.quads, 1);
        let own = &skeleton.branches[*branch as usize];
        // Leaves of one node of a twig begin at one place, in brackets of their own: any of those will do.
        let near = |range: &Range<u32>| range.start as usize <= bone + 8 && bone <= range.end as usize + 8;
        assert!(near(&own.bones), "leaf bone {bone}, branch {branch} of bones {:?}", own.bones);
        assert!(bones[*branch as usize].bounds.is_some());
    }
}

#[test]
fn branches_of_an_imported_tree_are_its_pieces_of_wood() {
    let tree = tufted(5, 40);
    let branches = Branches::of(&tree);
    assert_eq!(branches.boxes.len(), 1 + 1 + 5, "the plant, the stem, five branches");
    let parents: Vec<_> = branches.boxes[1..].iter().map(|branch| branch.parent).collect();
    assert_eq!(parents, [0, 1, 1, 1, 1, 1].map(Some), "branches stand on the stem");
    let tufts: Vec<u32> = branches.branch_of.chunks(40).map(|tuft| tuft[0]).collect();
    assert_eq!(tufts.iter().collect::<BTreeSet<_>>().len(), 5);
    assert!(branches.branch_of.chunks(40).zip(&tufts).all(|(tuft, own)| tuft.iter().all(|branch| branch == own)));
}

/// Of each box that is not divided, what shows its leaves to a viewer at `eye`: how many of it and those that it lies in show their
/// pictures wholly without fading, or its leaves.
fn showing(crown: &Crown, parts: &[BuiltPart], eye: Vec3) -> Vec<usize> {
    let shows = |seen: &Seen| {
        let away = |anchor: Vec3| eye.distance(anchor) / crown.height_m;
        away(seen.anchor) >= seen.appears[1] && away(seen.vanish_anchor.unwrap_or(seen.anchor)) < seen.vanishes[0]
    };
    let visible: BTreeSet<&str> = parts.iter().filter(|p| shows(&p.seen)).map(|p| p.part.name.as_str()).collect();
    for built in parts {
        let crisp = shows(&built.seen);
        assert!(!crisp || built.seen.share_from(eye, crown.height_m) == 1.0, "what shows fades nowhere");
    }
    let finest = (0..crown.boxes.len()).filter(|number| {
        let divided = crown.boxes[*number].divided && crown.boxes[*number].depth as usize + 1 < crown.atlases.len();
        !divided && (crown.boxes[*number].depth as usize) < crown.atlases.len()
    });
    let path = |number: usize| std::iter::successors(Some(number), |n| crown.boxes[*n].parent.map(|p| p as usize));
    finest
        .map(|number| {
            let pictures = path(number).filter(|n| visible.contains(format!("box_{n}").as_str())).count();
            let leaves = visible.contains(format!("leaves_of_box_{number}").as_str());
            pictures + usize::from(leaves)
        })
        .collect()
}

use super::super::BuiltPart;

/// Places within, before and far behind every switch.
fn eyes(crown: &Crown) -> impl Iterator<Item = Vec3> {
    let far = 1.3 * crown.boxes[0].distance * crown.height_m;
    (0..300).map(move |i| {
        let mut draws = Seed(3).keyed("eye", i);
        let toward = Vec3::new(draws.signed() as f32, draws.signed() as f32, draws.signed() as f32).normalize_or(Vec3::Z);
        Vec3::Y * 5.0 + far * (draws.unit() as f32).powi(2) * toward
    })
}

#[test]
fn every_leaf_shows_just_once_from_everywhere() {
    let crown = crown_of(tufted(12, 60), &["most_boxes=40", "least_share=0.01"]);
    assert!(crown.boxes.len() > 8 && crown.atlases.len() > 1);
    let parts = crown.parts();
    let mut mixed = 0;
    for eye in eyes(&crown) {
        let counts = showing(&crown, &parts, eye);
        assert!(counts.iter().all(|count| *count == 1), "from {eye}: {counts:?}");
        let shown =
            |name: &str| parts.iter().any(|p| p.part.name.starts_with(name) && p.seen.share_from(eye, crown.height_m) == 1.0);
        mixed += usize::from(shown("leaves") && shown("box"));
    }
    assert!(mixed > 10, "near boxes show leaves while far ones show pictures (fig. 8)");
}

#[test]
fn a_box_does_from_further_off_than_those_in_it() {
    let crown = crown_of(tufted(12, 60), &["least_share=0.01"]);
    for own in &crown.boxes {
        let Some(parent) = own.parent.map(|p| &crown.boxes[p as usize]) else { continue };
        let away = own.anchor().distance(parent.anchor()) / crown.height_m;
        assert!(parent.distance >= own.distance + away);
    }
    // 64 texels of a box of 2 m fill 64 pixels at a distance of 2 m × focal length / 60 without the rim.
    let own = PlannedBox {
        parent: None,
        depth: 0,
        leaves: vec![],
        bounds: Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 2.0, 0.5) },
        divided: false,
    };
    let distance = leaf_box(&own, &BoxParams::default(), 10.0).distance;
    assert!((distance * 10.0 - 2.0 * REFERENCE_FOCAL_PX / 60.0).abs() < 1e-3);
}

#[test]
fn pictures_show_only_the_leaves_of_their_box_and_keep_their_rims_empty() {
    for arrangement in ["axes", "volume", "diagonal"] {
        let set = format!("arrangement={arrangement}");
        let crown = crown_of(tufted(6, 60), &[&set, "slices=3", "least_share=0.01"]);
        let per_box = if arrangement == "volume" { 9 } else { 6 };
        for own in &crown.boxes {
            assert!(own.cards.len() <= per_box && own.cards.len() >= per_box - 3, "{arrangement}: {}", own.cards.len());
            let picture = &crown.atlases[own.depth as usize].color;
            for card in &own.cards {
                let size = Vec2::new(picture.width() as f32, picture.height() as f32);
                let [low, high] = card.uvs.map(|uv| (uv * size).as_uvec2());
                assert_eq!(high - low, glam::UVec2::splat(16));
                let is_there = |x: u32, y: u32| picture.get_pixel(low.x + x, low.y + y).0[3] >= 128;
                assert!((0..16).all(|i| [(i, 0), (0, i), (i, 15), (15, i)].iter().all(|(x, y)| !is_there(*x, *y))));
                assert!((0..256).any(|i| is_there(i % 16, i / 16)));
                // A picture of one tuft in a box of its own is as wide as the tuft.
                let span = Bounds::of(card.corners).unwrap().size().length();
                assert!(span <= 1.5 * own.bounds().size().length());
            }
        }
    }
}

#[test]
fn as_much_of_a_leaf_shows_from_everywhere() {
    let cube = Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE };
    for arrangement in [Arrangement::Axes, Arrangement::Volume, Arrangement::Diagonal] {
        let planes = planes::planes(cube, arrangement, 2);
        let seen = Seen { facing: crate::repr::Facing::Own { cosines: arrangement.cosines() }, ..Seen::default() };
        for i in 0..200 {
            let mut draws = Seed(5).keyed("leaf", i);
            let mut vector = || Vec3::new(draws.signed() as f32, draws.signed() as f32, draws.signed() as f32);
            let toward = vector().normalize_or(Vec3::X);
            let area: f32 = (0..64)
                .map(|_| {
                    let leaf = vector();
                    let shown = (0..planes.len()).filter(|n| arrangement.shows(&planes, *n, leaf));
                    let slab = |n: usize| {
                        let window = planes[n].window;
                        (window.min.z..window.max.z).contains(&planes[n].axes[2].dot(leaf))
                    };
                    let front = |n: &usize| arrangement != Arrangement::Axes || planes[*n].axes[2].dot(toward) > 0.0;
                    let area = |n: usize| {
                        let cosine = planes[n].axes[2].dot(toward).abs();
                        let [none, all] = arrangement.cosines();
                        cosine * ((cosine - none) / (all - none)).clamp(0.0, 1.0)
                    };
                    shown.filter(|n| slab(*n)).filter(front).map(area).sum::<f32>()
                })
                .sum::<f32>()
                / 64.0;
            assert!((0.6..1.5).contains(&area), "{arrangement:?} from {toward}: {area}");
        }
        assert_eq!(seen.share_toward(Vec3::X), 1.0, "each polygon has its own side");
    }
}

fn stream_of(crown: &Crown) -> Stream {
    let bounds = Bounds { min: Vec3::new(-4.0, 0.0, -4.0), max: Vec3::new(4.0, crown.height_m, 4.0) };
    let origin = Origin { source: "tufted".to_owned(), trunk: None, parameters: Default::default(), seed: Seed(1) };
    Stream::of(crown, bounds, None, &origin).unwrap()
}

fn received(files: &[(String, Vec<u8>)]) -> Result<Received> {
    Stream::received(|name| Ok(files.iter().find(|(known, _)| known == name).map(|(_, bytes)| bytes.clone())))
}

#[test]
fn any_beginning_of_a_stream_is_a_tree() {
    let crown = crown_of(tufted(12, 60), &["least_share=0.01"]);
    let Stream(files) = stream_of(&crown);
    assert_eq!(files.len(), 2 + 2 * crown.atlases.len());
    assert!(matches!(received(&files[..1]), Err(Error::BrokenBoxStream { .. })), "an index alone is nothing to draw");
    for count in 2..=files.len() {
        let come = received(&files[..count]).unwrap();
        assert_eq!(come.files, [count, files.len()]);
        let built = come.built().unwrap();
        built.check().unwrap();
        assert_eq!(built.warnings.is_empty(), count == files.len());
        for eye in eyes(&crown).take(60) {
            assert!(showing(&come.crown, &built.parts, eye).iter().all(|count| *count == 1), "{count} files, from {eye}");
        }
        // Half a file more is no file more.
        if let Some((name, bytes)) = files.get(count) {
            let half = (name.clone(), bytes[..bytes.len() / 2].to_vec());
            let with_half: Vec<_> = files[..count].iter().cloned().chain([half]).collect();
            assert_eq!(received(&with_half).unwrap().files[0], count);
        }
    }
    let whole = received(&files).unwrap().crown;
    assert_eq!((&whole.boxes, &whole.leaves), (&crown.boxes, &crown.leaves));
    for (own, come) in crown.atlases.iter().zip(&whole.atlases) {
        let kept = own.color.pixels().zip(come.color.pixels()).all(|(a, b)| (a.0[3] >= 128) == (b.0[3] >= 128));
        assert!(kept && own.color.dimensions() == come.color.dimensions(), "what is there stays there");
    }
}

#[test]
fn damaged_streams_are_refused() {
    let crown = crown_of(tufted(6, 60), &["least_share=0.01"]);
    let Stream(files) = stream_of(&crown);
    for number in 1..files.len() {
        let mut damaged = files.clone();
        let middle = damaged[number].1.len() / 2;
        damaged[number].1[middle] ^= 1;
        let error = received(&damaged).unwrap_err().to_string();
        assert!(error.contains(&files[number].0), "{error}");
    }
    let index = String::from_utf8(files[0].1.clone()).unwrap();
    for (what, with) in
        [("\"parent\":0", "\"parent\":77"), ("\"depth\":1", "\"depth\":3"), ("\"format\":1", "\"format\":9"), ("{", "[")]
    {
        assert!(index.contains(what));
        let mut damaged = files.clone();
        damaged[0].1 = index.replacen(what, with, 1).into_bytes();
        assert!(matches!(received(&damaged), Err(Error::BrokenBoxStream { .. })), "{what}");
    }
    assert!(received(&files[1..]).is_err());
}

#[test]
fn a_stream_lies_in_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let crown = crown_of(tufted(3, 30), &[]);
    write_stream(folder.path(), &stream_of(&crown)).unwrap();
    assert_eq!(read_stream(folder.path()).unwrap().crown.leaves, crown.leaves);
    std::fs::remove_file(folder.path().join("leaves.glb")).unwrap();
    assert!(read_stream(folder.path()).unwrap().crown.leaves.is_empty());
}

#[test]
fn one_leaf_is_a_box_and_none_is_refused() {
    let crown = crown_of(tufted(1, 1), &[]);
    assert_eq!((crown.boxes.len(), crown.leaves.len()), (1, 1));
    assert!(!crown.parts().is_empty());
    let bare = TreeSource::reference(tufted(2, 0));
    assert!(BoxHierarchy.refuses(&bare).is_some());
    let settings = Settings::default();
    let job =
        Job { source: &bare, scope: Scope::Foliage, settings: &settings, seed: Seed(1), capture: &SoftwareCapture::default() };
    assert!(matches!(BoxHierarchy.build(&job), Err(Error::NotApplicable { .. })));
}

#[test]
fn a_stream_is_ordered_as_a_file_is() {
    let mut tree = tufted(6, 40);
    // Without a picture no file has a place for these.
    tree.wood.iter_mut().for_each(|part| part.surface.uvs.clear());
    let source = TreeSource::reference(tree);
    let settings = Settings::default();
    let of = |method, trunk| stream(&Order { method, trunk, settings: &settings, seed: Seed(1) }, &source, &SoftwareCapture::new());
    for trunk in ["billboard", "lodf", "no-such"] {
        assert!(matches!(of("box-hierarchy", Some(trunk)), Err(Error::UnknownMethod { .. })), "{trunk}");
    }
    assert!(matches!(of("geometry", None), Err(Error::NotApplicable { .. })));
    let (stream, built) = of("box-hierarchy", None).unwrap();
    let order = Order { method: "box-hierarchy", trunk: None, settings: &settings, seed: Seed(1) };
    let plain = crate::repr::build(&order, &source, &SoftwareCapture::new()).unwrap();
    assert!(received(&stream.0).is_ok() && built.parts.len() == plain.parts.len() && built.levels == plain.levels);
    assert!(built.parts.iter().zip(&plain.parts).all(|(a, b)| a.part == b.part && a.seen == b.seen));
}

#[test]
fn the_colours_of_an_oak_fit_into_250_kb() {
    let crown = crown_of(OAK.clone(), &["picture_px=64", "least_leaves=128"]);
    let bytes = stream_of(&crown).color_bytes();
    println!("{bytes} bytes of colour");
    assert!((50_000..=250_000).contains(&bytes), "{bytes} bytes");
}

#[test]
fn pictures_without_room_are_refused_before_they_are_taken() {
    struct Untaken;
    impl Capture for Untaken {
        fn take(&self, _: &[&Part], _: &[crate::raster::View]) -> Result<Vec<crate::raster::Capture>> {
            panic!("a picture was taken")
        }
    }
    let source = TreeSource::reference(tufted(12, 60));
    let set = ["arrangement=volume", "slices=32", "picture_px=512", "least_share=0", "least_leaves=1"];
    let settings = Settings::parse(set).unwrap();
    let job = Job { source: &source, scope: Scope::Foliage, settings: &settings, seed: Seed(1), capture: &Untaken };
    let refused = crown(&job).unwrap_err();
    assert!(matches!(refused, Error::TooManyPictures { .. }) && refused.to_string().contains("picture_px"), "{refused}");
    for count in 1..5000u32 {
        let [columns, rows] = atlas::cells(count);
        assert!(columns.is_power_of_two() && columns * rows >= count && columns * (rows - 1) < count && rows <= columns, "{count}");
    }
}
