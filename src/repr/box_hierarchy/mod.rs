//! Boxes with pictures, one for every large enough branch of a tree (Lluch, Camahort & Vivó 2004). Leaves only: the wood is another
//! method's (§6).
//!
//! ```text
//! tree ──branches──▶ branches with boxes ──plan──▶ boxes with pictures ──planes, atlas──▶ Crown ──▶ parts
//!                                                                                          │ ▲
//!                                                                                          ▼ │
//!                                                                             stream: a folder, coarse to fine
//! ```

mod atlas;
mod branches;
mod crown;
mod plan;
mod planes;
mod stream;

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::built::REFERENCE_FOCAL_PX;
use super::file::Origin;
use super::{BuiltTree, Capture, Job, Order, Representation, Scope, SourceKind, TreeSource, card, not_applicable, tasks};
use crate::geom::{PolyMesh, Surface};
use crate::model::Part;
use crate::model::glb::MAX_TEXTURE_PX;
use crate::model::reference::{Leaf, ReferenceTree};
use crate::params::{ParamSet, ParamSpec, PowerOfTwo};
use crate::{Error, Result, params};

use atlas::{Taken, packed, rimmed, take};
use branches::Branches;
use plan::{PlannedBox, Rules, plan};
use planes::{Plane, planes};

pub use atlas::Atlas;
pub use crown::{BoxCard, Crown, LeafBox};
pub use planes::Arrangement;
pub use stream::{Received, Stream, read_stream, write_stream};

params! {
    /// Which boxes of a tree get pictures, and which pictures.
    pub struct BoxParams {
        /// How the pictures of a box are arranged.
        arrangement: Arrangement = Arrangement::Diagonal, unit "", source "Lluch04 §4.2, fig. 6: a sense of volume without more storage";
        /// Rows and columns of each picture, with an empty rim of two.
        picture_px: PowerOfTwo = PowerOfTwo(64), in 16..=512, unit "px", source "Lluch04 §3.2.3: 64, or 128 for higher quality";
        /// Slices along each axis of a box, where it is arranged so.
        slices: u32 = 10, in 2..=32, unit "", source "Lluch04 fig. 7: ten times the polygons of the arrangement by axes";
        /// Least volume of a box with pictures, as a share of the box that it lies in; smaller branches share one.
        least_share: f64 = 0.15, in 0.0..=0.9, unit "", source "Lluch04 §3.2.4: a threshold; ours: about eight boxes below the first, fig. 7";
        /// Least leaves in a box: fewer are drawn as they are.
        least_leaves: u32 = 128, in 1..=1000000, unit "", source "ours: six pictures cost more than that";
        /// Most boxes with pictures.
        most_boxes: u32 = 48, in 1..=4096, unit "", source "Lluch04 §5: 4 to 6 MB of pictures for a tree";
        /// How many pixels wide a texel may become before its box is divided.
        texel_px: f64 = 1.0, in 0.25..=16.0, unit "px", source "Lluch04 §4.1: pictures are shown unscaled";
        /// Over which share of its distance a box fades into those that it is divided into.
        box_fade: f64 = 0.25, in 0.0..=0.9, unit "", source "ours: short enough to cost little, long enough to be a blend";
    }
}

/// The method.
pub struct BoxHierarchy;

impl Representation for BoxHierarchy {
    fn id(&self) -> &'static str {
        "box-hierarchy"
    }

    fn name(&self) -> &'static str {
        "Hierarchy of boxes"
    }

    fn citation(&self) -> &'static str {
        "Lluch, Camahort & Vivó 2004, §3–4, fig. 6–8"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Foliage]
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::REFERENCE
    }

    fn specs(&self) -> Vec<ParamSpec> {
        BoxParams::specs()
    }

    /// Branches by procedural multiresolution (§6).
    fn partner(&self) -> &'static str {
        "multichain"
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        source.in_leaf().err()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        built(&crown(job)?, job.source)
    }
}

/// What is ordered, as a stream: the boxes, and the wood as its method builds it. With it comes the tree as [`super::build`] has it, which tells
/// what it costs and what a user should know.
///
/// # Errors
/// Those of [`super::build`] and of [`Stream::of`]; [`Error::NotApplicable`] when another method is ordered.
pub fn stream(order: &Order, source: &TreeSource, capture: &dyn Capture) -> Result<(Stream, BuiltTree)> {
    let tasks = tasks(order, source)?;
    let [boxes, wood] = &tasks[..] else { return Err(no_stream(order)) };
    if boxes.method.id() != BoxHierarchy.id() {
        return Err(no_stream(order));
    }
    let crown = crown(&boxes.job(order, source, capture))?;
    let mut built = built(&crown, source)?;
    let wood = match source.parts(Scope::Wood).is_empty() {
        true => None,
        false => Some(BuiltTree { method: wood.method.id().to_owned(), ..wood.method.build(&wood.job(order, source, capture))? }),
    };
    let stream = Stream::of(&crown, source.box_of_all()?, wood.as_ref(), &Origin::of(order, source.name())?)?;
    if let Some(wood) = wood {
        built = built.joined(wood);
    }
    Ok((stream, BuiltTree { method: BoxHierarchy.id().to_owned(), ..built }))
}

fn no_stream(order: &Order) -> Error {
    let why = format!("only {} makes streams", BoxHierarchy.id());
    let method = super::method(order.method).map_or(BoxHierarchy.id(), |method| method.id());
    Error::NotApplicable { method, source_name: "--stream".to_owned(), why }
}

fn built(crown: &Crown, source: &TreeSource) -> Result<BuiltTree> {
    Ok(BuiltTree { levels: crown.levels(), ..BuiltTree::new(source.box_of_all()?, crown.parts()) })
}

/// The boxes of a tree's leaves with their pictures: what [`BoxHierarchy`] builds its parts from, and what goes into a stream.
///
/// # Errors
/// Those of [`Representation::build`].
pub fn crown(job: &Job) -> Result<Crown> {
    let params: BoxParams = job.settings.read()?;
    let tree = job.source.in_leaf().map_err(|why| not_applicable(&BoxHierarchy, job.source, why))?;
    let rules = Rules {
        least_share: params.least_share as f32,
        least_leaves: params.least_leaves as usize,
        most_boxes: params.most_boxes as usize,
    };
    let branches = Branches::of(tree);
    let planned = plan(&branches, rules);
    let height_m = BuiltTree::new(job.source.box_of_all()?, vec![]).height_m();
    let side_px = params.picture_px.0;
    let planes_of = |own: &PlannedBox| planes(own.bounds, params.arrangement, params.slices);
    check_room(&planned, &params)?;
    let taken = |own: &PlannedBox| pictures_of(job, tree, &branches, own, &planes_of(own), &params);
    let pictures: Vec<Vec<Taken>> = planned.par_iter().map(taken).collect::<Result<_>>()?;

    let mut boxes: Vec<LeafBox> = planned.iter().map(|own| leaf_box(own, &params, height_m)).collect();
    let mut atlases = vec![];
    for depth in 0..=planned.iter().map(|own| own.depth).max().unwrap_or(0) {
        let at_depth = || (0..boxes.len()).filter(|i| planned[*i].depth == depth);
        let own: Vec<(usize, &Taken)> = at_depth().flat_map(|i| pictures[i].iter().map(move |p| (i, p))).collect();
        let Some((atlas, places)) = packed(own.iter().map(|(_, picture)| *picture), side_px) else { break };
        for ((number, picture), uvs) in own.into_iter().zip(places) {
            let plane = planes_of(&planned[number])[picture.plane];
            boxes[number].cards.push(BoxCard { corners: rectangle(&plane, side_px), uvs });
        }
        atlases.push(atlas);
    }
    let finest = (0..).zip(&planned).filter(|(_, own)| !own.divided);
    let leaves = finest.flat_map(|(number, own)| leaves_of(tree, &own.leaves).into_iter().map(move |part| (number, part)));
    let leaves = leaves.map(|(number, part)| (number, Part { name: format!("{}_of_box_{number}", part.name), ..part }));
    let mut crown =
        Crown { height_m, band: params.box_fade as f32, arrangement: params.arrangement, leaves: leaves.collect(), boxes, atlases };
    crown.nest_distances();
    Ok(crown)
}

/// Refuses more pictures than memory or the atlas of a depth has room for, before any is taken.
fn check_room(planned: &[PlannedBox], params: &BoxParams) -> Result<()> {
    let (lower, side_px) = ("picture_px, most_boxes or slices", params.picture_px.0);
    let each = params.arrangement.pictures(params.slices) as usize;
    card::check_room(planned.len() * each, u64::from(side_px).pow(2), lower)?;
    for depth in 0..=planned.iter().map(|own| own.depth).max().unwrap_or(0) {
        let pictures = planned.iter().filter(|own| own.depth == depth).count() * each;
        let [columns, rows] = atlas::cells(pictures as u32);
        if columns.max(rows).saturating_mul(side_px) > MAX_TEXTURE_PX {
            let room = u64::from(MAX_TEXTURE_PX).pow(2);
            return Err(card::too_many(pictures, u64::from(columns * rows) * u64::from(side_px).pow(2), room, lower));
        }
    }
    Ok(())
}

/// The pictures of a box.
fn pictures_of(
    job: &Job,
    tree: &ReferenceTree,
    branches: &Branches,
    own: &PlannedBox,
    planes: &[Plane],
    params: &BoxParams,
) -> Result<Vec<Taken>> {
    let side_px = params.picture_px.0;
    let take = |leaves: &[u32], range: Range<usize>| {
        let parts = leaves_of(tree, leaves);
        let taken = take(job.capture, &parts.iter().collect::<Vec<_>>(), &planes[range.clone()], side_px)?;
        Ok(taken.into_iter().map(move |picture| Taken { plane: picture.plane + range.start, ..picture }))
    };
    if params.arrangement != Arrangement::Diagonal {
        return Ok(take(&own.leaves, 0..planes.len())?.collect());
    }
    let mut pictures = vec![];
    for number in 0..planes.len() {
        let shown = |leaf: &&u32| params.arrangement.shows(planes, number, branches.leaves[**leaf as usize].center());
        let leaves: Vec<u32> = own.leaves.iter().filter(shown).copied().collect();
        pictures.extend(take(&leaves, number..number + 1)?);
    }
    Ok(pictures)
}

/// A box without its pictures. It does from where a texel is as wide as allowed (§4.1, fig. 5).
fn leaf_box(own: &PlannedBox, params: &BoxParams, height_m: f32) -> LeafBox {
    let texel_m = own.bounds.size().max_element().max(1e-4) / (params.picture_px.0 - 2 * atlas::RIM_PX) as f32;
    LeafBox {
        parent: own.parent,
        depth: own.depth,
        corners: [own.bounds.min, own.bounds.max],
        leaves: own.leaves.len() as u32,
        divided: own.divided,
        distance: texel_m * REFERENCE_FOCAL_PX / params.texel_px as f32 / height_m,
        cards: vec![],
    }
}

/// The rectangle of a picture with its rim.
fn rectangle(plane: &Plane, side_px: u32) -> [Vec3; 4] {
    let [right, up, toward] = plane.axes;
    let window = rimmed(plane.window, side_px);
    let (low, high) = (window.min, window.max);
    [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)].map(|(x, y)| x * right + y * up + plane.at * toward)
}

/// Just those leaves: the parts of the foliage that have any of them.
fn leaves_of(tree: &ReferenceTree, numbers: &[u32]) -> Vec<Part> {
    let mut sorted: Vec<&Leaf> = numbers.iter().map(|number| &tree.leaves[*number as usize]).collect();
    sorted.sort_unstable_by_key(|leaf| (leaf.part, leaf.first_quad, leaf.first_triangle));
    let of_part = |leaves: &[&Leaf]| {
        let whole = &tree.foliage[leaves[0].part as usize];
        let surface = gathered(&whole.surface, leaves);
        Part { name: whole.name.clone(), surface, material: whole.material.clone(), crown_center: None }
    };
    sorted.chunk_by(|a, b| a.part == b.part).map(of_part).collect()
}

/// The polygons of those leaves over the vertices that they use.
fn gathered(whole: &Surface, leaves: &[&Leaf]) -> Surface {
    const UNUSED: u32 = u32::MAX;
    let mut numbers = vec![UNUSED; whole.mesh.positions.len()];
    let mut used: Vec<usize> = vec![];
    let mut number = |v: u32| {
        if numbers[v as usize] == UNUSED {
            numbers[v as usize] = used.len() as u32;
            used.push(v as usize);
        }
        numbers[v as usize]
    };
    let (mut quads, mut triangles) = (vec![], vec![]);
    for leaf in leaves {
        let own = &whole.mesh.quads[leaf.first_quad as usize..][..leaf.quads as usize];
        quads.extend(own.iter().map(|quad| quad.map(&mut number)));
        let own = &whole.mesh.triangles[leaf.first_triangle as usize..][..leaf.triangles as usize];
        triangles.extend(own.iter().map(|triangle| triangle.map(&mut number)));
    }
    fn taken<T: Copy>(list: &[T], used: &[usize]) -> Vec<T> {
        if list.is_empty() { vec![] } else { used.iter().map(|v| list[*v]).collect() }
    }
    Surface {
        mesh: PolyMesh { positions: taken(&whole.mesh.positions, &used), triangles, quads },
        normals: taken(&whole.normals, &used),
        uvs: taken(&whole.uvs, &used),
        colors: taken(&whole.colors, &used),
    }
}

#[cfg(test)]
mod tests;
