//! Billboard clouds (Décoret et al. 2003, Behrendt et al. 2005; Truelsen §2.2, She fig. 2d): the leaves drawn onto a few dozen to a few
//! hundred planes that stand among them. Metres; pictures in texels.
//!
//! [`planes`] finds the planes. Every plane then gets the tightest rectangle round its own leaves, and all rectangles are packed into one
//! picture ([`atlas`]). The picture is taken at once: leaves are moved to where their plane's rectangle lies in it, lying as they lie
//! towards their plane, so that one parallel view shows each plane's own leaves and no others, with normals in the plane's own axes.
//!
//! A leaf that leans away from its plane would be drawn foreshortened, and the crown would grow thin: of a flat thing, as much is seen on the
//! average over all directions as it has area. So it is drawn as wide as it is (ours), up to [`MOST_STRETCH`].

mod atlas;
mod planes;

use glam::{Mat3, Vec2, Vec3};
use rayon::prelude::*;

use self::planes::{Leaf, Misfit, Plane, Sheet, sheets};
use super::card::{Card, captured};
use super::levels::{Rung, relieving};
use super::pick::picked;
use super::{BuiltTree, Capture, Job, Representation, Scope, SourceKind, TreeSource, not_applicable};
use crate::geom::{Bounds, PolyMesh, Surface};
use crate::model::Part;
use crate::params::{ParamSet, ParamSpec, PowerOfTwo};
use crate::{Result, Warning};

crate::params! {
    /// How a billboard cloud is made.
    pub struct CloudParams {
        /// Most planes, for the finest level; coarser ones have two fifths and a ninth of that.
        planes: u32 = 500, in 1..=4000, unit "", source "ours; Truelsen §2.2 tells of 50 to 60, which the coarsest level has";
        /// Levels of detail; 1 for the finest alone at all distances.
        levels: u32 = 3, in 1..=3, unit "", source "ours: 500, 200 and 55 planes";
        /// How far a corner of a leaf may be moved onto its plane, in heights of the tree, where there are planes enough.
        bound: f64 = 0.03, in 0.0001..=0.5, unit "", source "Décoret et al. 2003, §3.1: an error bound in object space; ours: the value";
        /// Texels along each side of the finest level's picture; coarser ones have half as many.
        atlas_px: PowerOfTwo = PowerOfTwo(2048), in 64..=8192, unit "px", source "ours: a texel is a pixel at about two tree heights";
        /// How many pixels leaves may be off their places when a level takes over.
        error_px: f64 = 3.0, in 0.1..=64.0, unit "px", source "ours: where one leaf is among thousands, no one knows";
    }
}

/// Planes of each level, as shares of those of the finest.
const SHARES: [f32; 3] = [1.0, 0.4, 0.11];

/// Texels between rectangles, so that coarser mip levels of one do not show another.
const GAP_PX: f32 = 4.0;

/// A leaf is drawn at most so many times as wide as its plane sees it.
const MOST_STRETCH: f32 = 3.0;

/// A level of which a larger share of leaf area than this is beyond the bound is said so.
const TOLD_BEYOND: f32 = 0.02;

/// Billboard clouds.
pub struct BillboardCloud;

impl Representation for BillboardCloud {
    fn id(&self) -> &'static str {
        "billboard-cloud"
    }

    fn name(&self) -> &'static str {
        "Billboard cloud"
    }

    fn citation(&self) -> &'static str {
        "Décoret et al. 2003; Behrendt et al. 2005 (Truelsen 2008, §2.2; She et al. 2018, fig. 2d)"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Foliage]
    }

    fn partner(&self) -> &'static str {
        "lodstrips"
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::REFERENCE
    }

    fn specs(&self) -> Vec<ParamSpec> {
        CloudParams::specs()
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        source.in_leaf().err()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let params: CloudParams = job.settings.read()?;
        let bounds = job.source.box_of_all()?;
        let foliage = Foliage::of(job.source)?;
        let bound_m = params.bound as f32 * bounds.height_m();
        let counts = &SHARES[..params.levels as usize];
        let made: Vec<Vec<Sheet>> =
            counts.par_iter().map(|share| sheets(&foliage.leaves, planes_of(*share, params.planes), bound_m, job.seed)).collect();
        let rung = |(number, sheets): (usize, &Vec<Sheet>)| {
            let side_px = (params.atlas_px.0 >> number.min(1)).max(64);
            let Some(part) = foliage.drawn(sheets, side_px, job.capture)? else { return Ok(None) };
            let error_m = Misfit::of(&foliage.leaves, sheets, bound_m).rms_m;
            Ok(Some(Rung { name: format!("{} planes", sheets.len()), error_m, parts: vec![part] }))
        };
        let rungs: Vec<Result<Option<Rung>>> = made.par_iter().enumerate().map(rung).collect();
        let rungs = rungs.into_iter().filter_map(Result::transpose).collect::<Result<Vec<Rung>>>()?;
        let warnings = made.first().and_then(|finest| beyond(&foliage.leaves, finest, bound_m)).into_iter().collect();
        let (parts, levels) = relieving(rungs, bounds.center(), params.error_px as f32, bounds.height_m());
        Ok(BuiltTree { levels, warnings, ..BuiltTree::new(bounds, parts) })
    }
}

fn planes_of(share: f32, most: u32) -> usize {
    (share * most as f32).round().max(1.0) as usize
}

/// What to say when leaves are moved farther than was asked.
fn beyond(leaves: &[Leaf], sheets: &[Sheet], bound_m: f32) -> Option<Warning> {
    let share = Misfit::of(leaves, sheets, bound_m).beyond;
    (share > TOLD_BEYOND).then(|| {
        let message = format!(
            "{:.0} % of the leaf area lies farther than {bound_m:.2} m from its plane; raise planes or bound to have it nearer",
            100.0 * share
        );
        Warning::new("beyond-bound", message)
    })
}

/// All leaves of a tree.
struct Foliage<'a> {
    /// Surfaces that leaves are of.
    parts: Vec<&'a Part>,
    /// Each leaf's part and its polygons there.
    polygons: Vec<(usize, Polygons)>,
    /// Each leaf as the clustering sees it.
    leaves: Vec<Leaf>,
}

/// Triangles and quads of a leaf.
type Polygons = (Vec<[u32; 3]>, Vec<[u32; 4]>);

impl<'a> Foliage<'a> {
    fn of(source: &'a TreeSource) -> Result<Self> {
        let tree = source.in_leaf().map_err(|why| not_applicable(&BillboardCloud, source, why))?;
        let polygons: Vec<(usize, Polygons)> = tree
            .leaves
            .iter()
            .map(|leaf| {
                let mesh = &tree.foliage[leaf.part as usize].surface.mesh;
                let range = |first: u32, count: u32| first as usize..(first + count) as usize;
                let triangles = mesh.triangles[range(leaf.first_triangle, leaf.triangles)].to_vec();
                (leaf.part as usize, (triangles, mesh.quads[range(leaf.first_quad, leaf.quads)].to_vec()))
            })
            .collect();
        let parts: Vec<&Part> = tree.foliage.iter().collect();
        let leaves = polygons.par_iter().map(|(part, polygons)| leaf(&parts[*part].surface.mesh, polygons)).collect::<Vec<_>>();
        Ok(Self { parts, polygons, leaves })
    }

    /// The cards of these sheets with their picture of `side_px` texels a side; `None` where nothing is seen.
    fn drawn(&self, sheets: &[Sheet], side_px: u32, capture: &dyn Capture) -> Result<Option<Part>> {
        let middle = self.middle();
        let flat = self.flattened(sheets);
        let rectangles: Vec<Rectangle> =
            sheets.par_iter().map(|sheet| Rectangle::round(sheet.plane, &self.corners(sheet, &flat), middle)).collect();
        let sizes: Vec<Vec2> = rectangles.iter().map(|rectangle| rectangle.size).collect();
        let (places, scale) = atlas::packed(&sizes, GAP_PX / side_px as f32);
        // The picture is in metres too: as wide as makes a metre of leaves a metre.
        let side_m = 1.0 / scale.max(1e-9);
        let pieces = Laid { sheets, rectangles: &rectangles, places: &places, side_m };
        let laid: Vec<Part> = flat.par_iter().enumerate().map(|(part, surface)| self.laid(part, surface, &pieces)).collect();
        let laid: Vec<&Part> = laid.iter().filter(|part| part.surface.mesh.polygon_count() > 0).collect();
        let Some(depth) = Bounds::of(laid.iter().flat_map(|part| part.surface.mesh.positions.iter().copied())) else {
            return Ok(None);
        };
        let card = Card {
            name: "cloud".to_owned(),
            axes: [Vec3::X, Vec3::Y, Vec3::Z],
            window: Bounds { min: Vec3::new(0.0, 0.0, depth.min.z), max: Vec3::new(side_m, side_m, depth.max.z) },
            plane: 0.0,
            size_px: [side_px; 2],
        };
        let taken = captured(capture, &laid, &[card])?.into_iter().next().flatten();
        Ok(taken.map(|part| Part { surface: cards(&rectangles, &places, scale), ..part }))
    }

    /// The surfaces of all parts, with every leaf as wide along its plane as it is in space.
    fn flattened(&self, sheets: &[Sheet]) -> Vec<Surface> {
        let mut surfaces: Vec<Surface> = self.parts.iter().map(|part| part.surface.clone()).collect();
        for sheet in sheets {
            for &leaf in &sheet.leaves {
                let ((part, polygons), Leaf { center, normal, .. }) = (&self.polygons[leaf as usize], &self.leaves[leaf as usize]);
                let facing = normal.dot(sheet.plane.normal);
                let across = (*normal - facing * sheet.plane.normal).normalize_or_zero();
                let more = (1.0 / facing.abs().max(1e-6)).min(MOST_STRETCH) - 1.0;
                for vertex in vertices(polygons) {
                    let p = &mut surfaces[*part].mesh.positions[vertex as usize];
                    *p += more * (*p - *center).dot(across) * across;
                }
            }
        }
        surfaces
    }

    /// Every corner of a sheet's leaves.
    fn corners(&self, sheet: &Sheet, flat: &[Surface]) -> Vec<Vec3> {
        let of = |leaf: &u32| {
            let (part, polygons) = &self.polygons[*leaf as usize];
            vertices(polygons).into_iter().map(|vertex| flat[*part].mesh.positions[vertex as usize])
        };
        sheet.leaves.iter().flat_map(of).collect()
    }

    /// Middle of all leaves.
    fn middle(&self) -> Vec3 {
        Bounds::of(self.leaves.iter().map(|leaf| leaf.center)).map_or(Vec3::ZERO, |bounds| bounds.center())
    }

    /// The leaves of one part, flattened as `flat`, laid into the picture.
    fn laid(&self, part: usize, flat: &Surface, pieces: &Laid) -> Part {
        let mut surface = Surface::default();
        for ((sheet, rectangle), place) in pieces.sheets.iter().zip(pieces.rectangles).zip(pieces.places) {
            let mine = sheet.leaves.iter().map(|&leaf| &self.polygons[leaf as usize]).filter(|(of, _)| *of == part);
            let (mut triangles, mut quads) = (vec![], vec![]);
            for (_, (t, q)) in mine {
                triangles.extend_from_slice(t);
                quads.extend_from_slice(q);
            }
            if triangles.is_empty() && quads.is_empty() {
                continue;
            }
            let mut piece = picked(flat, &triangles, &quads);
            let into = rectangle.axes.transpose();
            let shift = (pieces.side_m * *place - rectangle.low).extend(-rectangle.plane_m);
            piece.mesh.positions.iter_mut().for_each(|p| *p = into * *p + shift);
            piece.normals.iter_mut().for_each(|n| *n = into * *n);
            surface.append(piece);
        }
        Part { surface, ..self.parts[part].clone() }
    }
}

/// Each vertex of a leaf once.
fn vertices((triangles, quads): &Polygons) -> Vec<u32> {
    let mut numbers: Vec<u32> = triangles.iter().flatten().chain(quads.iter().flatten()).copied().collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

fn leaf(mesh: &PolyMesh, polygons: &Polygons) -> Leaf {
    let corners: Vec<Vec3> = vertices(polygons).into_iter().map(|v| mesh.positions[v as usize]).collect();
    let (triangles, quads) = polygons;
    let halves = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
    let (mut area_m2, mut sum) = (0.0, Vec3::ZERO);
    for [a, b, c] in triangles.iter().copied().chain(halves).map(|t| t.map(|v| mesh.positions[v as usize])) {
        let twice = (b - a).cross(c - a);
        area_m2 += 0.5 * twice.length();
        // Crossed quads look every way: their normals must not cancel out.
        sum += if twice.dot(sum) < 0.0 { -twice } else { twice };
    }
    let center = corners.iter().sum::<Vec3>() / corners.len().max(1) as f32;
    Leaf { center, normal: sum.normalize_or(Vec3::Y), corners, area_m2 }
}

/// Where a plane's leaves lie in it.
struct Rectangle {
    /// Right, up and out of the crown.
    axes: Mat3,
    /// Lower left corner and size, along right and up, metres.
    low: Vec2,
    size: Vec2,
    /// Where the plane lies along the third axis, metres.
    plane_m: f32,
}

/// Where everything lies in the picture.
struct Laid<'a> {
    sheets: &'a [Sheet],
    rectangles: &'a [Rectangle],
    /// Lower left corner of each rectangle, as shares of the picture's side.
    places: &'a [Vec2],
    /// Side of the picture.
    side_m: f32,
}

impl Rectangle {
    /// The tightest round `corners`, looking away from `middle`.
    fn round(plane: Plane, corners: &[Vec3], middle: Vec3) -> Self {
        let out = if plane.distance(middle) > 0.0 { -1.0 } else { 1.0 };
        let (normal, plane_m) = (out * plane.normal, out * plane.offset_m);
        let ([right, up], low, size) = atlas::tight(corners, normal);
        Self { axes: Mat3::from_cols(right, up, normal), low, size, plane_m }
    }
}

/// The rectangles in space, with their places in the picture.
fn cards(rectangles: &[Rectangle], places: &[Vec2], scale: f32) -> Surface {
    let mut surface = Surface::default();
    for (rectangle, place) in rectangles.iter().zip(places) {
        let first = surface.mesh.positions.len() as u32;
        for corner in [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y] {
            let flat = rectangle.low + corner * rectangle.size;
            surface.mesh.positions.push(rectangle.axes * flat.extend(rectangle.plane_m));
            surface.normals.push(rectangle.axes.z_axis);
            let at = *place + scale * corner * rectangle.size;
            surface.uvs.push(Vec2::new(at.x, 1.0 - at.y));
        }
        surface.mesh.quads.push([first, first + 1, first + 2, first + 3]);
    }
    surface
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Seed;
    use crate::model::reference::{Asked, ReferenceTree};
    use crate::raster::{View, render};
    use crate::repr::{Order, Settings, SoftwareCapture, Stats, build};

    fn built(source: &TreeSource, settings: &Settings) -> Result<BuiltTree> {
        build(&Order { method: "billboard-cloud", trunk: None, settings, seed: Seed(1) }, source, &SoftwareCapture::default())
    }

    /// A tree of these leaves, squares of 20 cm, and a stick.
    fn tree(leaves: &[(Vec3, Vec3)]) -> TreeSource {
        let mut surface = Surface::default();
        for (at, normal) in leaves {
            let (u, v) = normal.any_orthonormal_pair();
            let first = surface.mesh.positions.len() as u32;
            surface.mesh.positions.extend([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)].map(|(x, y)| *at + x * u + y * v));
            surface.normals.extend([*normal; 4]);
            surface.mesh.quads.push([first, first + 1, first + 2, first + 3]);
        }
        let material =
            crate::model::Material { factor: [0.1, 0.5, 0.1, 1.0], name: "leaf".to_owned(), two_sided: true, ..Default::default() };
        let stick =
            PolyMesh { positions: vec![Vec3::ZERO, 0.1 * Vec3::X, 2.0 * Vec3::Y], triangles: vec![[0, 1, 2]], quads: vec![] };
        let stick = Surface { normals: vec![Vec3::Z; 3], mesh: stick, ..Surface::default() };
        let parts = vec![
            Part { name: "leaves".to_owned(), surface, material, crown_center: None },
            Part { name: "wood".to_owned(), surface: stick, material: Default::default(), crown_center: None },
        ];
        let asked = Asked { leaves: vec!["leaf".to_owned()], ..Asked::default() };
        TreeSource::reference(ReferenceTree::new("test".to_owned(), parts, &asked).unwrap())
    }

    #[test]
    fn each_card_shows_its_own_leaves_where_they_are() {
        // Two crossing sheets of leaves with gaps between them.
        let leaf = |i: i32, j: i32, x: Vec3, normal: Vec3| (0.3 * i as f32 * x + (1.0 + 0.3 * j as f32) * Vec3::Y, normal);
        let cells = || (-3..=3).flat_map(|i| (0..4).map(move |j| (i, j)));
        let leaves: Vec<_> =
            cells().map(|(i, j)| leaf(i, j, Vec3::X, Vec3::Z)).chain(cells().map(|(i, j)| leaf(i, j, Vec3::Z, Vec3::X))).collect();
        let source = tree(&leaves);
        let tree = built(&source, &Settings::default().with("planes", 2).with("levels", 1).with("atlas_px", 256)).unwrap();
        let cloud = &tree.parts[0].part;
        assert_eq!(cloud.surface.mesh.quads.len(), 2);
        for azimuth_deg in [0.0f32, 37.0, 90.0, 200.0] {
            let view = View::around(source.points(Scope::Tree), azimuth_deg.to_radians(), 0.2, 200, 200);
            let of = |parts: Vec<&Part>| {
                render(&parts.iter().map(|part| (&part.surface, part.material.raster())).collect::<Vec<_>>(), &view, None).unwrap()
            };
            let (mine, own) = (of(vec![cloud]), of(source.parts(Scope::Foliage)));
            let pixels = || mine.coverage.as_raw().iter().zip(own.coverage.as_raw()).map(|(a, b)| (*a > 127, *b > 127));
            let (both, either) = (pixels().filter(|(a, b)| *a && *b).count(), pixels().filter(|(a, b)| *a || *b).count());
            assert!(both as f32 > 0.75 * either as f32, "{both} of {either} from {azimuth_deg}°");
        }
    }

    #[test]
    fn levels_have_fewer_planes_and_less_of_everything() {
        let (source, _) = TreeSource::open("acacia", &Asked::default(), Seed(1)).unwrap();
        let tree = built(&source, &Settings::default().with("planes", 100).with("atlas_px", 256)).unwrap();
        let cards: Vec<usize> =
            tree.parts.iter().filter(|part| part.part.name == "cloud").map(|part| part.part.surface.mesh.quads.len()).collect();
        assert!(cards.len() == 3 && cards[0] <= 100 && cards[1] <= 40 && cards[2] <= 11 && cards[2] > 4, "{cards:?}");
        let stats = Stats::of_levels(&tree);
        assert!(
            stats[0].1.textures == 3
                && stats[0].0 == format!("{} planes", cards[0])
                && stats.windows(2).all(|pair| pair[0].1.polygons > pair[1].1.polygons),
            "{stats:?}"
        );
        let again = built(&source, &Settings::default().with("planes", 100).with("atlas_px", 256)).unwrap();
        assert!(tree.parts.iter().zip(&again.parts).all(|(a, b)| a.part == b.part), "the same seed gives the same cloud");
    }

    #[test]
    fn a_bound_that_cannot_be_kept_is_said_and_one_leaf_is_enough() {
        let scattered: Vec<_> =
            (0..50).map(|i| (Vec3::new((i % 7) as f32, 1.0 + (i % 5) as f32, (i % 3) as f32), Vec3::Y)).collect();
        let tree_of_two = built(&tree(&scattered), &Settings::default().with("planes", 2).with("bound", 0.001)).unwrap();
        assert!(tree_of_two.warnings.iter().any(|warning| warning.code == "beyond-bound"));
        let one = built(&tree(&[(Vec3::Y, Vec3::Z)]), &Settings::default()).unwrap();
        assert!(one.parts.iter().any(|part| part.part.surface.mesh.quads.len() == 1));
        let TreeSource::Reference(mut bare) = tree(&[(Vec3::Y, Vec3::Z)]) else { unreachable!("built as one") };
        (bare.leaves, bare.foliage) = (vec![], vec![]);
        let error = built(&TreeSource::Reference(bare), &Settings::default()).unwrap_err();
        assert!(error.to_string().contains("it has no leaves"), "{error}");
    }
}
