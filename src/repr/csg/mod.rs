//! Constructive solid geometry (She fig. 15a): cones, cylinders, spheres and ellipsoids that come nearest to crown and trunk, joined into
//! one closed surface, with the tree's own foliage on it.

mod cover;
mod fit;
mod primitive;
mod union;

use glam::{DVec3, Vec3};
use image::RgbaImage;

use crate::geom::Bounds;
use crate::model::Part;
use crate::params::{ParamSet as _, ParamSpec, PowerOfTwo};
use crate::raster::{self, Mask, View};
use crate::{Error, Result};

use super::sphere_board::picture::{Picture, Scale, Stand, taken, trunk_seen};
use super::sphere_board::subject::groups;
use super::sphere_board::{SphereBoardParams, leafless};
use super::{BuiltPart, BuiltTree, Job, Representation, Scope, SourceKind, TreeSource};
use fit::{Sight, fitted};
use primitive::{Primitive, Shape, Solid};

crate::params! {
    /// How primitives are fitted.
    pub struct CsgParams {
        /// Most primitives of the crown.
        max_primitives: u32 = 6, in 1..=16, unit "primitives", source "ours: She's figure has about as many";
        /// Corners round each primitive.
        columns: u32 = 20, in 6..=64, unit "corners", source "ours: round to the eye from a few heights off";
        /// Side of the square of foliage that is repeated over the crown.
        texture_size: PowerOfTwo = PowerOfTwo(256), in 32..=1024, unit "texels", source "ours";
    }
}

/// Pixels of the pictures that silhouettes are taken from.
const PICTURE_PX: u32 = 384;

/// The method.
pub struct Csg;

impl Representation for Csg {
    fn id(&self) -> &'static str {
        "csg"
    }

    fn name(&self) -> &'static str {
        "Constructive solid geometry"
    }

    fn citation(&self) -> &'static str {
        "She et al. 2018, §4, fig. 15a"
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::ALL
    }

    fn specs(&self) -> Vec<ParamSpec> {
        CsgParams::specs()
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        leafless(source)
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let params: CsgParams = job.settings.read()?;
        let bounds = job.source.box_of_all()?;
        let tree = Tree::of(job, &params)?;
        let crown = tree.crown(&params)?;
        let mut primitives = crown.clone();
        let trunk = tree.trunk(job, &crown)?;
        primitives.extend(trunk);
        let bark = trunk.map_or(Ok(None), |trunk| bark(job, &trunk))?;
        let turned = |(number, one): (usize, &Primitive)| one.surface(params.columns as usize, 0.37 + 0.731 * number as f64);
        let solids: Vec<Solid> = primitives.iter().enumerate().map(turned).collect();
        let joined = union::union(&solids);
        let most = tree.pictures.iter().max_by_key(|picture| picture.crown.count()).unwrap_or(&tree.pictures[0]);
        let parts = cover::parts(job, &joined, crown.len(), most, bark, params.texture_size.0)?;
        Ok(BuiltTree::new(bounds, parts.into_iter().map(BuiltPart::still).collect()))
    }
}

/// What is known of the tree.
struct Tree {
    /// From the front, the right and above.
    pictures: Vec<Picture>,
    groups: Vec<Vec<Part>>,
    points: Vec<DVec3>,
    scale: Scale,
}

impl Tree {
    fn of(job: &Job, params: &CsgParams) -> Result<Self> {
        let foliage: Vec<Part> = job.source.parts(Scope::Foliage).into_iter().cloned().collect();
        let size = job.source.bounds(Scope::Foliage).map_or(1.0, |bounds| bounds.size().max_element().max(1e-3));
        let scale = Scale { metres_per_px: size / PICTURE_PX as f32, longest_px: PICTURE_PX };
        let stands = [Stand::round(0.0), Stand::round(std::f32::consts::FRAC_PI_2), Stand::ABOVE];
        let pictures: Vec<Picture> = taken(job.capture, &foliage, &stands, scale)?.into_iter().flatten().collect();
        if pictures.is_empty() {
            return Err(Error::CrownTooSmall { needed: 9, found: 0 });
        }
        let middle = |part: &Part, polygon: &[u32]| {
            let corners = polygon.iter().map(|&v| part.surface.mesh.positions[v as usize].as_dvec3());
            corners.sum::<DVec3>() / polygon.len() as f64
        };
        let points =
            foliage.iter().flat_map(|part| part.surface.mesh.polygons().map(move |polygon| middle(part, polygon))).collect();
        let asked = SphereBoardParams { max_crowns: params.max_primitives, ..SphereBoardParams::default() };
        Ok(Self { pictures, groups: groups(job, foliage, &asked, scale)?, points, scale })
    }

    /// The primitives of the crown.
    fn crown(&self, params: &CsgParams) -> Result<Vec<Primitive>> {
        let sights: Vec<Sight> = self.pictures.iter().filter_map(|picture| Sight::of(picture, &picture.crown)).collect();
        let start = |group: &Vec<Part>| {
            let bounds = crate::model::bounds(group)?;
            let half = (0.45 * bounds.size().as_dvec3()).max(DVec3::splat(1e-3));
            Some(Primitive { shape: Shape::Ellipsoid, center: bounds.center().as_dvec3(), half })
        };
        let starts: Vec<Primitive> = self.groups.iter().filter_map(start).collect();
        Ok(fitted(&sights, &Shape::ALL, &starts, &self.points, params.max_primitives as usize).0)
    }

    /// That of the trunk, from the ground into the crown; none where leaves hide it.
    fn trunk(&self, job: &Job, crown: &[Primitive]) -> Result<Option<Primitive>> {
        let Some((cues, metres_per_px)) = trunk_seen(job.capture, job.source, 0.0, self.scale)? else { return Ok(None) };
        let height = (cues.foot_px.y - cues.neck_px.y) * metres_per_px;
        let across = 0.5 * cues.width_px * metres_per_px;
        let aside = 0.5 * (cues.neck_px.x - cues.foot_px.x) * metres_per_px;
        // Up to the middle of the highest primitive that stands over it: what lies inside is left out anyway.
        let foot = job.source.foot().as_dvec3();
        let over = |one: &&Primitive| (one.center - foot).with_y(0.0).length() < one.half.x.max(one.half.z);
        let higher = |a: &&Primitive, b: &&Primitive| a.center.y.total_cmp(&b.center.y);
        let end = crown.iter().filter(over).max_by(higher).or_else(|| crown.iter().min_by(higher));
        let top = end.map_or(height, |one| one.center.y - foot.y).max(height + across);
        let half = DVec3::new(across, 0.5 * top, across).max(DVec3::splat(1e-3));
        let cylinder = Primitive { shape: Shape::Cylinder, center: foot + DVec3::new(0.5 * aside, 0.5 * top, 0.0), half };
        // A cone reaches farther up, and is as wide half way to the neck.
        let wide = top / (top - 0.5 * height).max(0.1 * top);
        let cone = Primitive { shape: Shape::Cone, half: half * DVec3::new(wide, 1.0, wide), ..cylinder };
        let wood: Vec<Part> = job.source.parts(Scope::Wood).into_iter().cloned().collect();
        let Some(picture) = taken(job.capture, &wood, &[Stand::round(0.0)], self.scale)?.pop().flatten() else {
            return Ok(Some(cylinder));
        };
        let below = picture.foot_px.y - (foot.y + height) / metres_per_px;
        let bare = Mask::from_fn(picture.crown.width(), picture.crown.height(), |x, y| {
            f64::from(y) > below && picture.crown.get(x.into(), y.into())
        });
        let Some(sight) = Sight::of(&picture, &bare) else { return Ok(Some(cylinder)) };
        let agreement = |one| sight.agreement_below(one, foot.y + height);
        Ok(Some(if agreement(&cone) > agreement(&cylinder) { cone } else { cylinder }))
    }
}

/// Texels along a picture of bark.
const BARK_PX: u32 = 64;
/// Its side, of the trunk's width: bark at the edges is seen aslant.
const BARK: f32 = 0.6;

/// A square of bark from the middle of the trunk's lower part, and its side in metres; `None` where something else is there, too.
fn bark(job: &Job, trunk: &Primitive) -> Result<Option<(RgbaImage, f64)>> {
    let (half, center) = (trunk.half.as_vec3(), trunk.center.as_vec3());
    let side_m = BARK * 2.0 * half.x;
    // Above the flare of the roots.
    let middle = center.with_y(center.y - half.y + (0.2 * half.y).max(0.5 * side_m));
    let reach = Vec3::new(0.5 * side_m, 0.5 * side_m, 2.0 * half.z);
    let window = Bounds { min: middle - reach, max: middle + reach };
    let view = View::of_window(View::axes_from(0.0, 0.0), window, BARK_PX, BARK_PX);
    let taken = job.capture.take(&job.source.parts(Scope::Wood), &[view])?;
    let whole = |taken: &raster::Capture| taken.coverage.pixels().all(|covered| covered[0] > 200);
    Ok(taken.into_iter().find(whole).map(|taken| (taken.color, f64::from(side_m))))
}

#[cfg(test)]
mod tests;
