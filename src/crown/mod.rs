//! From outlines to closed sphere-board surfaces (She §3.1, fig. 8–9).
//!
//! Object space: metres, +Y up, origin at the foot of the trunk, +Z towards the photographer of azimuth 0. A photographer at azimuth α
//! stands in the direction (sin α, 0, cos α) and has (cos α, 0, −sin α) on the right.
//!
//! ```text
//! outline ──region──▶ cells ──lobes──▶ parts ──star──▶ radius per direction ──hull──▶ solid ──cloud──▶ rings ──surface──▶ mesh
//! ```

mod cloud;
mod hull;
mod lobes;
mod region;
mod star;
mod surface;
#[cfg(test)]
mod tests;

use glam::{DVec2, Vec3};

use crate::geom::PolyMesh;
use crate::params::ParamSet as _;
use crate::photo::Silhouette;
use crate::{Error, Result, Seed};

pub use hull::Hull;
use hull::View;
use region::Region;

crate::choices! {
    /// How many polygons a crown has.
    pub enum Detail {
        /// About 300 polygons, for the distance.
        Low = "low",
        /// About 2,200 polygons, She's own size (table 1).
        Medium = "medium",
        /// About 8,000 polygons, for the foreground.
        High = "high",
    }
}

impl Detail {
    /// Polygons of a tree's crowns together.
    pub fn polygons(self) -> usize {
        match self {
            Self::Low => 300,
            Self::Medium => 2_200,
            Self::High => 8_000,
        }
    }
}

crate::params! {
    /// How outlines become crowns.
    pub struct CrownParams {
        /// How many polygons the crowns have: about 300, 2,200 or 8,000.
        detail: Detail = Detail::Medium, unit "", source "She table 1: 56 triangles + 2,124 quads";
        /// How strongly the crown's points are disturbed: 0 leaves the revolved crown as it is, 1 is the default; multiplies the three semi-axes below.
        disturb: f64 = 1.0, in 0.0..=3.0, unit "", source "ours: one control for She §3.1, fig. 9d";
        /// Ellipsoid for disturbing feature points (EDFP): semi-axis across the surface, as a fraction of the crown's radius there.
        edfp_radial: f64 = 0.09, in 0.0..=0.5, unit "", source "ours: She gives no sizes; this one makes lumps without spikes";
        /// EDFP: semi-axis along the profile, as a fraction of the distance between rings of points.
        edfp_along: f64 = 0.3, in 0.0..=1.0, unit "", source "ours: under a half, so that points keep their neighbours";
        /// EDFP: semi-axis around the crown's axis, as a fraction of the distance between points of a ring.
        edfp_around: f64 = 0.3, in 0.0..=1.0, unit "", source "ours: under a half, so that points keep their neighbours";
        /// EDFP: how much of the radial disturbance neighbours share: 0 crumples every facet, 1 gives smooth lumps.
        edfp_clump: f64 = 0.7, in 0.0..=1.0, unit "", source "ours: foliage grows in clumps";
        /// EDFP: size of those lumps, as a fraction of the crown's mean radius.
        edfp_clump_size: f64 = 0.3, in 0.02..=5.0, unit "", source "ours: about the size of a bough's foliage";
        /// Largest fold along the diagonal of a quad; sharper pairs stay two triangles.
        quad_fold_deg: f64 = 50.0, in 0.0..=90.0, unit "°", source "ours: She §3.2 joins near-coplanar triangles, but names no angle";
        /// Largest fault of a single crown before it is split into lobes: 1 − IoU of its outline with the photograph's, area missed and area filled in alike.
        lobe_split: f64 = 0.05, in 0.0..=1.0, unit "", source "ours: She fig. 4b splits by hand; smaller faults hardly show";
        /// Smallest lobe, as a part of the outline's area.
        min_lobe: f64 = 0.03, in 0.001..=0.5, unit "", source "ours: anything smaller is a twig";
        /// Largest number of crowns of one tree.
        max_crowns: u32 = 5, in 1..=50, unit "crowns", source "ours: further lobes add little but polygons";
    }
}

/// A crown's outline as one photograph shows it: metres, x right as that photographer sees it, y up, foot of the trunk at the origin.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Outline {
    /// Where the photographer stands: 0 in front (+Z), π/2 on the right of that one (+X).
    pub azimuth_rad: f64,
    /// How high above the horizon he stands: near 0 the outline is revolved, else it only limits how far the crown reaches.
    pub elevation_rad: f64,
    /// Closed contour without repeated end, of the largest piece.
    pub contour: Vec<DVec2>,
    /// Those of further pieces.
    pub others: Vec<Vec<DVec2>>,
    /// Where the axis leaves the crown below.
    pub axis_base: DVec2,
    /// Where it leaves it above.
    pub axis_top: DVec2,
    /// Feature points left of the axis, base to top.
    pub left: Vec<DVec2>,
    /// Feature points right of the axis, base to top.
    pub right: Vec<DVec2>,
}

impl Outline {
    /// Whether it was seen from about the crown's own height.
    fn is_level(&self) -> bool {
        self.elevation_rad.abs() < 0.35
    }

    /// Brings a silhouette seen from the ground from pixels to metres. `foot_px` is the foot of the trunk in the photograph.
    pub fn from_silhouette(silhouette: &Silhouette, foot_px: DVec2, metres_per_px: f64, azimuth_rad: f64) -> Self {
        let metres = |p: &DVec2| DVec2::new(p.x - foot_px.x, foot_px.y - p.y) * metres_per_px;
        let all = |points: &[DVec2]| points.iter().map(metres).collect();
        Self {
            azimuth_rad,
            elevation_rad: 0.0,
            contour: all(&silhouette.contour),
            others: silhouette.others.iter().map(|piece| all(piece)).collect(),
            axis_base: metres(&silhouette.axis.base),
            axis_top: metres(&silhouette.axis.top),
            left: all(&silhouette.left),
            right: all(&silhouette.right),
        }
    }
}

/// One closed crown surface: manifold, of genus 0, facing outward, star-shaped about its centre.
#[derive(Debug, Clone)]
pub struct Crown {
    /// Triangles and quads over the disturbed points.
    pub mesh: PolyMesh,
    /// Every polygon's triangles face away from this point.
    pub center: Vec3,
    /// The point cloud before disturbance (She fig. 9b): the vertices of the smooth crown, point for point.
    pub cloud: Vec<Vec3>,
    /// The disturbed points (She fig. 9d): the vertices of `mesh`.
    pub disturbed: Vec<Vec3>,
}

impl Crown {
    /// The surface over the undisturbed cloud (She fig. 9c).
    pub fn undisturbed(&self) -> PolyMesh {
        PolyMesh { positions: self.cloud.clone(), ..self.mesh.clone() }
    }
}

/// Models the crowns that `outlines` show, with the polygons of `detail`: [`hulls`], then [`surfaces`].
///
/// # Errors
/// As those two.
pub fn build(outlines: &[Outline], params: &CrownParams, seed: Seed) -> Result<Vec<Crown>> {
    surfaces(&hulls(outlines, params)?, params.detail.polygons(), params, seed)
}

/// The solids that `outlines` of one tree show. The first may give several: its lobes, and pieces that stand apart (She fig. 4b). Each has
/// every outline as seen from its azimuth; where there are several solids, what the others show at its height.
///
/// # Errors
/// [`Error::Outline`] when there is no outline or one encloses nothing; [`Error::Parameter`] for a parameter out of range.
pub fn hulls(outlines: &[Outline], params: &CrownParams) -> Result<Vec<Hull>> {
    params.validate()?;
    let regions = (0..outlines.len()).map(|i| region_of(i, &outlines[i])).collect::<Result<Vec<_>>>()?;
    let ([first, others @ ..], [outline, ..]) = (&regions[..], outlines) else {
        return Err(Error::Outline { view: 0, why: "none was given".to_owned() });
    };
    let parts = lobes::split(first, params);
    if others.is_empty() {
        let hull = |(i, (region, star)): (usize, (Region, _))| {
            // A side lobe stands upright; only the whole crown leans.
            let slope = if i == 0 { lean(outline) } else { 0.0 };
            Hull::new(vec![View::new(outline, &region, star)], slope)
        };
        return Ok(parts.into_iter().enumerate().map(hull).collect());
    }
    if parts.len() == 1 {
        return Ok(vec![hull::joined(outlines, &regions)]);
    }
    let hull = |(part, _): (Region, _)| {
        let (mut seen, mut at_its_height) = (vec![outline.clone()], vec![part.clone()]);
        for (outline, other) in outlines[1..].iter().zip(others) {
            let other = if outline.is_level() { other.at_the_height_of(&part) } else { Some(other.clone()) };
            if let Some(other) = other {
                seen.push(outline.clone());
                at_its_height.push(other);
            }
        }
        hull::joined(&seen, &at_its_height)
    };
    Ok(parts.into_iter().map(hull).collect())
}

/// The surfaces of `hulls`; together they have about `polygons` polygons, shared by area.
///
/// # Errors
/// [`Error::Internal`] only.
pub fn surfaces(hulls: &[Hull], polygons: usize, params: &CrownParams, seed: Seed) -> Result<Vec<Crown>> {
    let areas: Vec<f64> = hulls.iter().map(Hull::area_m2).collect();
    let total: f64 = areas.iter().sum();
    let share = |area: f64| (polygons as f64 * area / total) as usize;
    hulls.iter().zip(&areas).enumerate().map(|(i, (hull, &area))| surface::crown(hull, share(area), params, seed, i)).collect()
}

fn region_of(view: usize, outline: &Outline) -> Result<Region> {
    let finite = outline
        .contour
        .iter()
        .chain(outline.others.iter().flatten())
        .chain([&outline.axis_base, &outline.axis_top])
        .all(|p| p.is_finite());
    if !finite || !outline.azimuth_rad.is_finite() || !outline.elevation_rad.is_finite() {
        return Err(Error::Outline { view, why: "it has coordinates that are no numbers".to_owned() });
    }
    Region::of(std::iter::once(&outline.contour).chain(&outline.others))
        .ok_or_else(|| Error::Outline { view, why: "it encloses no area".to_owned() })
}

/// Horizontal run per rise of the outline's axis; upright when the axis is too short to tell.
fn lean(outline: &Outline) -> f64 {
    let d = outline.axis_top - outline.axis_base;
    if d.y > 0.0 { (d.x / d.y).clamp(-1.0, 1.0) } else { 0.0 }
}
