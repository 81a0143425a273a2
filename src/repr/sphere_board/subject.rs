//! The tree as the pictures show it: its clusters of foliage, each with photographs of it alone, and its trunk (She §3.1, fig. 4b).
//!
//! Clusters are the lobes and separate pieces of the outline. A true tree's leaves are dealt out to them, and each is looked at from the
//! other side in turn, so that what only the front shows as one is parted in depth, too.

use std::collections::VecDeque;
use std::f32::consts::{FRAC_PI_2, TAU};

use glam::Vec3;
use rayon::prelude::*;

use super::picture::{Picture, Scale, Stand, nothing_seen, taken, trunk_seen};
use super::tone::tone;
use super::{SphereBoardParams, Unseen};
use crate::crown::{self, CrownParams, Hull, Outline};
use crate::geom::{Bounds, PolyMesh, Surface};
use crate::model::{Part, TrunkShape, bounds as bounds_of};
use crate::photo::Roughness;
use crate::raster::{to_linear, to_srgb};
use crate::repr::{Job, Scope, TreeSource};
use crate::texture::Front;
use crate::{Error, Result};

/// From where a cluster is looked at to find its parts: from the front, from the right, and from above.
const SIDES: [Stand; 3] = [Stand::round(0.0), Stand::round(FRAC_PI_2), Stand::ABOVE];
/// From where its outline is taken, where its depth may be seen.
const OUTLINES: [Stand; 5] =
    [Stand::round(0.0), Stand::round(0.5 * FRAC_PI_2), Stand::round(FRAC_PI_2), Stand::round(1.5 * FRAC_PI_2), Stand::ABOVE];
/// From how many sides the model of a photograph is looked at for its coarser levels.
const AROUND_A_MODEL: u32 = 4;

/// A cluster of foliage.
pub(in crate::repr) struct Cluster {
    pub hull: Hull,
    /// What its texture is made of; the first is the front, and there is one.
    pub pictures: Vec<Picture>,
    outline: Outline,
    /// What its leaves' shade leaves of its colour.
    pub(in crate::repr) tone: f32,
}

/// All that is known of a tree.
pub(in crate::repr) struct Subject {
    /// The largest first; at least one unless there is a finest level already.
    pub clusters: Vec<Cluster>,
    pub trunk: Option<Part>,
    /// The crowns of the finest level, where there are some already.
    pub finest: Option<Vec<Part>>,
}

impl Subject {
    pub(in crate::repr) fn of(job: &Job, params: &SphereBoardParams, bounds: Bounds) -> Result<Self> {
        let foliage: Vec<Part> = job.source.parts(Scope::Foliage).into_iter().cloned().collect();
        let size = job.source.bounds(Scope::Foliage).unwrap_or(bounds).size().max_element().max(1e-3);
        let scale = Scale { metres_per_px: size / params.picture_px as f32, longest_px: params.picture_px };
        let TreeSource::Model { model, .. } = job.source else {
            let groups = groups(job, foliage, params, scale)?;
            let mut clusters = found(groups.par_iter().map(|group| Cluster::of(job, group, params.azimuths, params, scale)))?;
            if clusters.is_empty() {
                return Err(nothing_seen());
            }
            clusters.sort_by(|a, b| b.hull.area_m2().total_cmp(&a.hull.area_m2()));
            let trunk = trunk(job, &clusters, bounds, scale)?;
            return Ok(Self { clusters, trunk, finest: None });
        };
        let seen = SphereBoardParams { depth: Unseen::Seen, above: Unseen::Seen, ..params.clone() };
        let cluster = |crown: &Part| Cluster::of(job, std::slice::from_ref(crown), AROUND_A_MODEL, &seen, scale);
        let clusters = found(foliage.par_iter().map(cluster))?;
        Ok(Self { clusters, trunk: model.trunk.as_ref().map(|trunk| trunk.part()), finest: Some(foliage) })
    }
}

/// The clusters that are large enough to be seen.
fn found(clusters: impl ParallelIterator<Item = Result<Cluster>>) -> Result<Vec<Cluster>> {
    let clusters: Vec<Result<Cluster>> = clusters.collect();
    clusters.into_iter().filter(|cluster| !matches!(cluster, Err(Error::CrownTooSmall { .. } | Error::Outline { .. }))).collect()
}

/// The foliage of a tree, one list of parts for each cluster: the crowns of a model, or what is found on a true tree.
pub(in crate::repr) fn groups(job: &Job, foliage: Vec<Part>, params: &SphereBoardParams, scale: Scale) -> Result<Vec<Vec<Part>>> {
    match job.source {
        TreeSource::Model { .. } => Ok(foliage.into_iter().map(|crown| vec![crown]).collect()),
        TreeSource::Reference(_) => parted(job, foliage, params, scale),
    }
}

fn parted(job: &Job, foliage: Vec<Part>, params: &SphereBoardParams, scale: Scale) -> Result<Vec<Vec<Part>>> {
    let sides = &SIDES[..if params.depth == Unseen::Seen { 3 } else { 1 }];
    let mut done = Vec::new();
    // What is still to be looked at, from which side next, and from how many it was found to be one.
    let mut open = VecDeque::from([(foliage, 0, 0)]);
    let mut whole_px = None;
    while let Some((parts, side, times_whole)) = open.pop_front() {
        let room = params.max_crowns as usize - done.len() - open.len();
        let picture = if times_whole < sides.len() && room > 1 {
            taken(job.capture, &parts, &[sides[side]], scale)?.pop().flatten()
        } else {
            None
        };
        let Some((picture, outline)) = picture.and_then(|picture| picture.outline().ok().map(|outline| (picture, outline))) else {
            done.push(parts);
            continue;
        };
        let area_px = picture.crown.count() as f64;
        let of_all = area_px / *whole_px.get_or_insert(area_px);
        let usual = CrownParams::default();
        let min_lobe = (usual.min_lobe / of_all.max(1e-3)).min(0.5);
        let lobes = crown::hulls(
            &[outline],
            &CrownParams { max_crowns: room.min(50) as u32, min_lobe, lobe_split: params.lobe_split, ..usual },
        )?;
        let next = (side + 1) % sides.len();
        if lobes.len() < 2 {
            open.push_back((parts, next, times_whole + 1));
        } else {
            let groups = dealt_out(&parts, &lobes);
            open.extend(groups.into_iter().filter(|group| !group.is_empty()).map(|group| (group, next, 1)));
        }
    }
    Ok(done)
}

/// The polygons of `parts`, each to the lobe in which it lies deepest.
fn dealt_out(parts: &[Part], lobes: &[Hull]) -> Vec<Vec<Part>> {
    let mut groups = vec![Vec::new(); lobes.len()];
    for part in parts {
        let mesh = &part.surface.mesh;
        let lobe_of = |polygon: &[u32]| {
            let middle = polygon.iter().map(|&v| mesh.positions[v as usize]).sum::<Vec3>() / polygon.len() as f32;
            let depths = lobes.iter().map(|lobe| lobe.depth_of(middle)).enumerate();
            depths.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |lobe| lobe.0)
        };
        let lobe: Vec<usize> = mesh.polygons().map(lobe_of).collect();
        for (number, group) in groups.iter_mut().enumerate() {
            let surface = kept(&part.surface, |polygon| lobe[polygon] == number);
            if surface.mesh.polygon_count() > 0 {
                group.push(Part { surface, ..part.clone() });
            }
        }
    }
    groups
}

/// The polygons of a surface for whose numbers `keep` holds, with only the vertices that they use.
fn kept(surface: &Surface, keep: impl Fn(usize) -> bool) -> Surface {
    let mesh = &surface.mesh;
    let mut number = vec![u32::MAX; mesh.positions.len()];
    let mut used = Vec::new();
    let mut renumbered = |v: u32| {
        let slot = &mut number[v as usize];
        if *slot == u32::MAX {
            *slot = used.len() as u32;
            used.push(v as usize);
        }
        *slot
    };
    let first_quad = mesh.triangles.len();
    let chosen = |&(polygon, _): &(usize, &[u32; 3])| keep(polygon);
    let triangles = mesh.triangles.iter().enumerate().filter(chosen).map(|(_, t)| t.map(&mut renumbered)).collect();
    let quads = mesh.quads.iter().enumerate().filter(|(quad, _)| keep(first_quad + quad));
    let quads = quads.map(|(_, q)| q.map(&mut renumbered)).collect();
    fn of<T: Copy>(list: &[T], used: &[usize]) -> Vec<T> {
        if list.is_empty() { vec![] } else { used.iter().map(|&v| list[v]).collect() }
    }
    Surface {
        mesh: PolyMesh { positions: of(&mesh.positions, &used), triangles, quads },
        normals: of(&surface.normals, &used),
        uvs: of(&surface.uvs, &used),
        colors: of(&surface.colors, &used),
    }
}

impl Cluster {
    fn of(job: &Job, parts: &[Part], azimuths: u32, params: &SphereBoardParams, scale: Scale) -> Result<Self> {
        let mut stands: Vec<Stand> = (0..azimuths).map(|i| Stand::round(i as f32 * TAU / azimuths as f32)).collect();
        stands.extend((params.above == Unseen::Seen).then_some(Stand::ABOVE));
        let pictured = stands.len();
        if params.depth == Unseen::Seen {
            // Those that tell of the shape alone.
            stands.extend(OUTLINES.iter().filter(|outline| !stands[..pictured].contains(outline)).copied().collect::<Vec<_>>());
        }
        let mut pictures = taken(job.capture, parts, &stands, scale)?;
        let outlines: Vec<Outline> = pictures.iter().flatten().map(Picture::outline).collect::<Result<_>>()?;
        let alone = CrownParams { max_crowns: 1, ..CrownParams::default() };
        let hull = crown::hulls(&outlines, &alone)?.pop().ok_or_else(nothing_seen)?;
        let of_leaves = bounds_of(parts).unwrap_or(Bounds { min: Vec3::ZERO, max: Vec3::ONE });
        let seen: Vec<&Picture> = pictures.iter().flatten().collect();
        let crowns_own = parts.iter().any(|part| part.crown_center.is_some());
        // A model's surface is smooth already.
        let tone = if crowns_own { 1.0 } else { tone(&seen, of_leaves.center(), 0.5 * of_leaves.size()) };
        pictures.truncate(pictured);
        let pictures: Vec<Picture> = pictures.into_iter().flatten().collect();
        let outline = outlines.into_iter().next().filter(|_| !pictures.is_empty()).ok_or_else(nothing_seen)?;
        Ok(Self { hull, pictures, outline, tone })
    }

    pub(in crate::repr) fn fronts(&self) -> Vec<Front<'_>> {
        self.pictures.iter().map(Picture::front).collect()
    }

    /// How rough its first outline is, and what a pixel of that measures.
    pub(in crate::repr) fn roughness(&self) -> Option<(Roughness, f64)> {
        let metres_per_px = self.pictures.first()?.metres_per_px;
        let px: Vec<_> = self.outline.contour.iter().map(|p| glam::DVec2::new(p.x, -p.y) / metres_per_px).collect();
        Some((Roughness::of(&px), metres_per_px))
    }
}

/// The trunk below the crowns, as it is seen from the front, with a limb to every further cluster; a likely one where leaves hide it, none
/// where no wood is.
fn trunk(job: &Job, clusters: &[Cluster], bounds: Bounds, scale: Scale) -> Result<Option<Part>> {
    let Some(first) = clusters.first().filter(|_| job.source.points(Scope::Wood).next().is_some()) else { return Ok(None) };
    // A trunk's shape stands at y = 0, wherever the tree does.
    let foot = bounds.foot_y() * Vec3::Y;
    let center = first.hull.middle() - foot;
    let mut shape = match trunk_seen(job.capture, job.source, 0.0, scale)? {
        Some((cues, metres_per_px)) => TrunkShape::seen(&cues, metres_per_px, center),
        None => {
            let base = clusters.iter().map(|cluster| cluster.outline.axis_base.y).fold(f64::MAX, f64::min) as f32;
            TrunkShape::guessed(base * Vec3::Y - foot, center, f64::from(bounds.height_m()))
        }
    };
    // Where it stands in depth is known from the wood alone. Bare between clusters, it is seen up to the largest.
    let course = course(job, bounds, shape.width_m);
    let straight = center * (shape.neck.y / center.y.max(1e-3)).clamp(0.0, 1.0);
    let followed = course(shape.neck.y);
    // Where it parts into limbs, one of those would have been followed.
    let strayed = clusters.len() == 1 && followed.distance(straight) > shape.width_m;
    shape.neck = if strayed { straight.with_y(shape.neck.y) } else { followed };
    shape.tip = if clusters.len() > 1 { course(center.y) } else { shape.neck.midpoint(center) };
    let [r, g, b, _] = bark(job);
    shape.bark = [r, g, b].map(to_srgb);
    let mut part = shape.build().part();
    let (neck, tip) = (shape.neck, shape.tip);
    for cluster in &clusters[1..] {
        let end = cluster.hull.middle() - foot;
        let aside = Vec3::new(end.x - neck.x, 0.0, end.z - neck.z).length();
        // It leaves the trunk somewhat lower than it ends.
        let share = ((end.y - RISE * aside - neck.y) / (tip.y - neck.y).max(1e-3)).clamp(0.0, 0.95);
        let thick = LIMB * shape.width_m;
        part.surface.append(limb(neck.lerp(tip, share), end, [thick, 0.4 * thick]));
    }
    part.surface.mesh.positions.iter_mut().for_each(|p| *p += foot);
    Ok(Some(part))
}

/// Slabs in which the trunk is followed upwards.
const SLABS: usize = 60;

/// Where the trunk is at a height above its foot: its wood is followed up from there, slab by slab.
fn course(job: &Job, bounds: Bounds, width_m: f32) -> impl Fn(f32) -> Vec3 {
    let (foot_y, slab_m) = (bounds.foot_y(), bounds.height_m() / SLABS as f32);
    let slab_of = move |y: f32| ((y / slab_m).max(0.0) as usize).min(SLABS - 1);
    let mut slabs = vec![Vec::new(); SLABS];
    job.source.points(Scope::Wood).for_each(|p| slabs[slab_of(p.y - foot_y)].push(p));
    let mut at = Vec3::ZERO;
    let mut places = Vec::new();
    for slab in &slabs {
        let near = slab.iter().filter(|p| Vec3::new(p.x - at.x, 0.0, p.z - at.z).length() < width_m);
        let (sum, count) = near.fold((Vec3::ZERO, 0.0), |(sum, count), p| (sum + *p, count + 1.0));
        // A branch that leaves it pulls it aside: it does not turn so quickly.
        let wanted = if count > 0.0 { sum / count } else { at };
        at = at.lerp(wanted, 0.6);
        places.push(Vec3::new(at.x, 0.0, at.z));
    }
    move |y| places[slab_of(y)] + y * Vec3::Y
}

/// How much a limb rises over its run, and how thick it is at the trunk, of the trunk's width.
const RISE: f32 = 0.25;
const LIMB: f32 = 0.2;
/// Its corners.
const LIMB_SIDES: u32 = 5;

/// A closed limb between two places; half its width at either.
fn limb(from: Vec3, to: Vec3, radii: [f32; 2]) -> Surface {
    let along = (to - from).normalize_or(Vec3::Y);
    let (right, up) = along.any_orthonormal_pair();
    let mut surface = Surface::default();
    for (end, radius) in [from, to].into_iter().zip(radii) {
        for k in 0..LIMB_SIDES {
            let (sin, cos) = (TAU * k as f32 / LIMB_SIDES as f32).sin_cos();
            surface.normals.push(cos * right + sin * up);
            surface.mesh.positions.push(end + radius * (cos * right + sin * up));
        }
    }
    for k in 0..LIMB_SIDES {
        let next = (k + 1) % LIMB_SIDES;
        surface.mesh.quads.push([k, next, LIMB_SIDES + next, LIMB_SIDES + k]);
        if (1..LIMB_SIDES - 1).contains(&k) {
            surface.mesh.triangles.push([0, next, k]);
            surface.mesh.triangles.push([LIMB_SIDES, LIMB_SIDES + k, LIMB_SIDES + next]);
        }
    }
    surface
}

/// The mean colour of the wood: linear light.
pub(in crate::repr) fn bark(job: &Job) -> [f32; 4] {
    let mut sum = glam::Vec4::ZERO;
    for part in job.source.parts(Scope::Wood) {
        let texture = part.material.texture.as_ref().map_or(glam::Vec4::ONE, |picture| {
            let texels = picture.pixels().filter(|texel| texel.0[3] >= 128).step_by(7);
            let (sum, count) = texels.fold((Vec3::ZERO, 0.0f32), |(sum, count), texel| {
                (sum + Vec3::from([texel.0[0], texel.0[1], texel.0[2]].map(to_linear)), count + 1.0)
            });
            if count > 0.0 { (sum / count).extend(1.0) } else { glam::Vec4::ONE }
        });
        let weight = part.surface.mesh.polygon_count() as f32;
        sum += weight * (texture * glam::Vec4::from(part.material.factor)).truncate().extend(1.0);
    }
    if sum.w > 0.0 { (sum / sum.w).to_array() } else { [0.12, 0.09, 0.06, 1.0] }
}
