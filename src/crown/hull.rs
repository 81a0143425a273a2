//! The solid that fits all outlines: a radius for every direction from the centre (She §3.1, fig. 8; the limits are ours).
//!
//! Seen from view v, direction d projects to a direction in the picture, and the point may lie at most where the outline is: radius ≤
//! ρ_v(angle of the projection) ∕ length of the projection. In the outline's own plane that limit *is* the outline; elsewhere it keeps
//! what is revolved (a drooping rim, a leaning top) from swelling the silhouette. A radius per direction is star-shaped by nature.

use std::f64::consts::{PI, TAU};

use glam::{DMat2, DVec2, DVec3};

use super::region::Region;
use super::star::{Star, best_center};
use super::{Outline, lean};

/// One outline about the solid's centre.
#[derive(Debug, Clone)]
pub(super) struct View {
    pub azimuth_rad: f64,
    /// What the photographer has above him, unit vector.
    up: DVec3,
    /// Whether it is revolved about the axis.
    level: bool,
    pub star: Star,
    /// Feature points on the star's border, metres from its centre.
    pub features: Vec<DVec2>,
}

impl View {
    pub fn new(outline: &Outline, region: &Region, star: Star) -> Self {
        let seen = |p: &DVec2| {
            let d = *p - star.center;
            ((d.length() - star.radius(d.to_angle())).abs() < 1.5 * region.cell_m).then_some(d)
        };
        let features = outline.left.iter().chain(&outline.right).filter_map(seen).collect();
        let [_, up] = seen_axes(outline);
        Self { azimuth_rad: outline.azimuth_rad, up, level: outline.is_level(), star, features }
    }

    /// What the photographer has on the right, in object space.
    pub fn right(&self) -> DVec3 {
        horizontal(self.azimuth_rad)
    }

    /// The direction's projection into the picture.
    pub fn project(&self, d: DVec3) -> DVec2 {
        DVec2::new(d.dot(self.right()), d.dot(self.up))
    }

    /// The outline's radius in direction `d`, averaged over `half_rad` on both sides.
    pub fn limit(&self, d: DVec3, half_rad: f64) -> f64 {
        let p = self.project(d);
        // Looking straight along d there is no limit.
        self.star.mean_radius(p.to_angle(), half_rad) / p.length().max(1e-6)
    }
}

/// What the photographer of an outline has on the right and above him, in object space.
fn seen_axes(outline: &Outline) -> [DVec3; 2] {
    let right = horizontal(outline.azimuth_rad);
    let (sin, cos) = outline.elevation_rad.sin_cos();
    // Upright and tilted towards where he looks along the ground.
    [right, DVec3::Y * cos + DVec3::Y.cross(right) * sin]
}

/// The horizontal unit vector at `azimuth_rad` around the vertical: what a photographer there has on the right.
fn horizontal(azimuth_rad: f64) -> DVec3 {
    DVec3::new(azimuth_rad.cos(), 0.0, -azimuth_rad.sin())
}

/// One side of one outline: where it stands around the axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    pub azimuth_rad: f64,
    pub view: usize,
}

/// Views, axis and centre of one crown.
#[derive(Debug, Clone)]
pub struct Hull {
    pub(super) views: Vec<View>,
    pub(super) center: DVec3,
    /// Unit vector upward along the crown.
    pub(super) axis: DVec3,
    /// Left and right of every view, by azimuth.
    pub(super) sides: Vec<Side>,
}

impl Hull {
    /// A crown about one or more views whose stars share their centre's height; `slope` is the lean in the first view.
    pub(super) fn new(views: Vec<View>, slope: f64) -> Self {
        let axis_run = views[0].right() * slope;
        Self::with_axis(views, axis_run)
    }

    fn with_axis(views: Vec<View>, run: DVec3) -> Self {
        let level = || views.iter().filter(|view| view.level);
        let offsets: Vec<(f64, f64)> = level().map(|v| (v.azimuth_rad, v.star.center.x)).collect();
        let center = place(&offsets) + DVec3::Y * views[0].star.center.y;
        let side =
            |(view, v): (usize, &View)| [0.0, PI].map(|turn| Side { azimuth_rad: (v.azimuth_rad + turn).rem_euclid(TAU), view });
        let mut sides: Vec<Side> = views.iter().enumerate().filter(|(_, view)| view.level).flat_map(side).collect();
        sides.sort_by(|a, b| a.azimuth_rad.total_cmp(&b.azimuth_rad));
        Self { axis: (DVec3::Y + run).normalize(), views, center, sides }
    }

    /// The direction at an elevation above the plane across the axis and an azimuth around it.
    pub(super) fn direction(&self, elevation_rad: f64, azimuth_rad: f64) -> DVec3 {
        elevation_rad.cos() * self.outward(azimuth_rad) + elevation_rad.sin() * self.axis
    }

    /// The unit vector away from the axis at an azimuth.
    pub(super) fn outward(&self, azimuth_rad: f64) -> DVec3 {
        horizontal(azimuth_rad).reject_from_normalized(self.axis).normalize()
    }

    /// The smallest limit of all views in direction `d`.
    pub(super) fn limit(&self, d: DVec3, half_rad: f64) -> f64 {
        self.views.iter().map(|v| v.limit(d, half_rad)).fold(f64::INFINITY, f64::min)
    }

    /// Takes so much off it all round, metres, though never more than a part of it: what growth will put back when it is drawn.
    pub fn inset(&mut self, metres: f64) {
        for view in &mut self.views {
            let inner = |r: f64| (r - metres).max(INSET_MOST * r);
            view.star.radius_m.iter_mut().for_each(|r| *r = inner(*r));
            view.features.iter_mut().for_each(|p| *p *= inner(p.length()) / p.length().max(1e-9));
        }
    }

    /// The point from which all of it is seen.
    pub fn middle(&self) -> glam::Vec3 {
        self.center.as_vec3()
    }

    /// How far out a place lies in the first view, from 0 in the centre over 1 on the outline.
    pub fn depth_of(&self, place: glam::Vec3) -> f64 {
        let view = &self.views[0];
        let d = view.project(place.as_dvec3()) - view.star.center;
        d.length() / view.star.radius(d.to_angle()).max(1e-9)
    }

    /// Rough surface area, for sharing polygons among crowns, square metres.
    pub fn area_m2(&self) -> f64 {
        let radii = self.views.iter().flat_map(|v| &v.star.radius_m);
        let count: usize = self.views.iter().map(|v| v.star.radius_m.len()).sum();
        4.0 * PI * radii.map(|r| r * r).sum::<f64>() / count as f64
    }
}

/// What an inset leaves at least.
const INSET_MOST: f64 = 0.75;

/// The least IoU with its star at which an outline that is not revolved limits the crown.
const LEAST_LIMIT: f64 = 0.6;

/// Several outlines of one tree, as one crown: each view's best centre gives one equation for the place of the common centre.
pub(super) fn joined(outlines: &[Outline], regions: &[Region]) -> Hull {
    let level = || outlines.iter().zip(regions).filter(|(outline, _)| outline.is_level());
    let centers: Vec<DVec2> = level().map(|(_, region)| best_center(region, 1.0)).collect();
    let height = centers.iter().map(|c| c.y).sum::<f64>() / centers.len().max(1) as f64;
    let azimuths = || level().map(|(outline, _)| outline.azimuth_rad);
    let spot = place(&azimuths().zip(centers.iter().map(|c| c.x)).collect::<Vec<_>>());
    let run = place(&azimuths().zip(level().map(|(outline, _)| lean(outline))).collect::<Vec<_>>());
    let center = spot + DVec3::Y * height;
    let view = |(outline, region): (&Outline, &Region)| {
        let [right, up] = seen_axes(outline);
        let star = Star::fit(region, DVec2::new(center.dot(right), center.dot(up)), 1.0);
        // One that limits only must be seen whole from the centre, or it would cut away what is there.
        (outline.is_level() || star.iou(region) > LEAST_LIMIT).then(|| View::new(outline, region, star))
    };
    Hull::with_axis(outlines.iter().zip(regions).filter_map(view).collect(), run)
}

/// The horizontal vector whose offsets to the right, seen from each azimuth, come nearest to those given; the shortest where several do.
fn place(offsets: &[(f64, f64)]) -> DVec3 {
    // Far below any real offset: only decides what the views leave open.
    let mut normal = DMat2::from_diagonal(DVec2::splat(1e-9));
    let mut sum = DVec2::ZERO;
    for &(azimuth, offset) in offsets {
        let right = horizontal(azimuth);
        let row = DVec2::new(right.x, right.z);
        normal += DMat2::from_cols(row * row.x, row * row.y);
        sum += row * offset;
    }
    let p = normal.inverse() * sum;
    DVec3::new(p.x, 0.0, p.y)
}
