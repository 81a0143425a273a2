//! Upright planes that cross in the trunk's axis, each with its own picture of the whole tree, the same seen from both sides (She §1.2.2,
//! fig. 2b; Truelsen A.2, fig. 34). Seen from the sky they disappear (She fig. 17c); a level plane with a picture from above helps.

use std::f32::consts::PI;

use glam::Vec3;

use super::billboard::nothing_seen;
use super::card::{self, Card};
use super::{BuiltPart, BuiltTree, Facing, Job, Representation, Scope, Seen, SourceKind, Switch, TreeSource};
use crate::Result;
use crate::geom::Bounds;
use crate::params::{ParamSet, ParamSpec, PowerOfTwo};
use crate::raster::View;

crate::params! {
    /// How crossed planes are made.
    pub struct CrossedPlanesParams {
        /// Upright planes at equal angles.
        planes: u32 = 2, in 2..=8, unit "", source "She fig. 2b";
        /// A level plane at the crown's widest, against the view from above; upright planes then leave the view from there.
        level: Switch = Switch::Off, unit "", source "She fig. 17: the papers have none";
        /// Upright planes seen at a flatter angle than this fade away; 0 shows all of them to everyone.
        fade_deg: f64 = 0.0, in 0..=45, unit "°", source "the papers' planes do not fade";
        /// Texels along the longer side of each picture.
        texture_px: PowerOfTwo = PowerOfTwo(512), in 16..=2048, unit "px", source "Truelsen table 4: 1024 to 64";
    }
}

/// The level plane is not seen by who looks at it at a flatter angle than the first, so that it is no line across the tree; all of it at
/// the second. Degrees.
const LEVEL_FADES_DEG: [f32; 2] = [10.0, 40.0];
/// Beside a level plane, upright ones seen at a flatter angle fade away even if not asked to.
const EDGE_FADES_DEG: f64 = 12.0;
/// Into how many layers the crown is cut to find its widest.
const LAYERS: usize = 24;

/// Planes through the trunk.
pub struct CrossedPlanes;

impl Representation for CrossedPlanes {
    fn id(&self) -> &'static str {
        "crossed-planes"
    }

    fn name(&self) -> &'static str {
        "Crossed planes"
    }

    fn citation(&self) -> &'static str {
        "She et al. 2018, §1.2.2 and fig. 2b; Truelsen & Bonding 2008, appendix A.2"
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::ALL
    }

    fn specs(&self) -> Vec<ParamSpec> {
        CrossedPlanesParams::specs()
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        source.without_extent()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let params: CrossedPlanesParams = job.settings.read()?;
        let bounds = job.source.box_of_all()?;
        let foot = job.source.foot();
        let all_around = |axes| card::window_around(job.source.points(job.scope), axes).unwrap_or(bounds);

        let mut cards = vec![];
        let mut seen = vec![];
        for k in 0..params.planes {
            let axes = View::axes_from(PI * k as f32 / params.planes as f32, 0.0);
            let window = all_around(axes);
            let size_px = Card::size_px(window, params.texture_px.0);
            cards.push(Card { name: format!("plane_{k}"), axes, window, plane: axes[2].dot(foot), size_px });
            seen.push(upright_seen(axes[2], &params));
        }
        if params.level == Switch::On {
            let axes = View::axes_from(0.0, 0.5 * PI);
            let window = all_around(axes);
            let size_px = Card::size_px(window, params.texture_px.0);
            cards.push(Card { name: "level".to_owned(), axes, window, plane: widest_height(job.source, bounds), size_px });
            seen.push(Facing::Toward {
                axis: Vec3::Y,
                cosines: LEVEL_FADES_DEG.map(|deg| deg.to_radians().sin()),
                level: false,
                both_sides: true,
            });
        }

        let anchor = foot.with_y(bounds.center().y);
        let taken = card::captured(job.capture, &job.source.parts(job.scope), &cards)?;
        let parts: Vec<BuiltPart> = taken
            .into_iter()
            .zip(seen)
            .filter_map(|(part, facing)| Some(BuiltPart::still(part?).seen(Seen { anchor, facing, ..Seen::default() })))
            .collect();
        if parts.is_empty() {
            return Err(nothing_seen(self, job.source));
        }
        Ok(BuiltTree::new(bounds, parts))
    }
}

/// From which sides an upright plane across `axis` is seen, by the angle at which it is seen. Where a level plane takes over the view from
/// above, it leaves with the same angle from there, so that it is no line on the level one; all of it stays until the level one is whole.
fn upright_seen(axis: Vec3, params: &CrossedPlanesParams) -> Facing {
    let sine = |deg: f64| deg.to_radians().sin() as f32;
    let fade_deg = params.fade_deg;
    if params.level == Switch::On {
        let all = sine(fade_deg.max(EDGE_FADES_DEG)) * LEVEL_FADES_DEG[1].to_radians().cos();
        return Facing::Toward { axis, cosines: [0.4 * all, all], level: false, both_sides: true };
    }
    if fade_deg <= 0.0 {
        return Facing::Any;
    }
    Facing::Toward { axis, cosines: [0.0, sine(fade_deg)], level: true, both_sides: true }
}

/// Height at which the leaves, or what there is, reach farthest: of layers of equal height the one with the largest box on the ground.
fn widest_height(source: &TreeSource, bounds: Bounds) -> f32 {
    let scope = if source.bounds(Scope::Foliage).is_some() { Scope::Foliage } else { Scope::Tree };
    let all = source.bounds(scope).unwrap_or(bounds);
    let (low, high) = (all.min.y, all.max.y.max(all.min.y + 1e-6));
    let mut layers = vec![None::<Bounds>; LAYERS];
    for p in source.points(scope) {
        let layer = ((p.y - low) / (high - low) * LAYERS as f32) as usize;
        let layer = &mut layers[layer.min(LAYERS - 1)];
        *layer = Some(layer.map_or(Bounds { min: p, max: p }, |b| Bounds { min: b.min.min(p), max: b.max.max(p) }));
    }
    let area = |layer: &Option<Bounds>| layer.map_or(0.0, |b| b.size().x * b.size().z);
    let widest = (0..LAYERS).max_by(|a, b| area(&layers[*a]).total_cmp(&area(&layers[*b]))).unwrap_or(0);
    low + (widest as f32 + 0.5) / LAYERS as f32 * (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repr::trial::{self, built, mask, overlap};

    #[test]
    fn each_plane_has_the_outline_of_the_tree_from_both_of_its_sides() {
        for source in [trial::tree(), trial::tree_at(Vec3::new(0.0, 0.0, 4.0))] {
            let tree = built("crossed-planes", &["planes=3", "level=on"], &source).unwrap();
            assert_eq!(tree.parts.len(), 4);
            let sides = [(0.0, 0.0), (PI / 3.0, 0.0), (2.0 * PI / 3.0, 0.0), (0.0, 0.5 * PI)];
            for (part, (azimuth, elevation)) in tree.parts.iter().zip(sides) {
                let behind = if elevation > 0.0 { (azimuth, -elevation) } else { (azimuth + PI, elevation) };
                for (azimuth, elevation) in [(azimuth, elevation), behind] {
                    let view = View::around(source.points(Scope::Tree), azimuth, elevation, 160, 160);
                    let same = overlap(&mask([&part.part], &view), &mask(source.parts(Scope::Tree), &view));
                    assert!(same > 0.93, "{} from {azimuth} {elevation}: {same}", part.part.name);
                }
            }
        }
    }

    #[test]
    fn planes_cross_in_the_trunk_and_the_level_one_lies_where_the_crown_is_widest() {
        let foot = Vec3::new(2.0, 0.0, 4.0);
        let tree = built("crossed-planes", &["level=on"], &trial::tree_at(foot)).unwrap();
        for part in &tree.parts[..2] {
            let (normal, corner) = (part.part.surface.normals[0], part.part.surface.mesh.positions[0]);
            assert!(normal.y.abs() < 1e-6 && (foot - corner).dot(normal).abs() < 1e-4);
        }
        let height = tree.parts[2].part.surface.mesh.positions[0].y;
        assert!((height - 2.6).abs() < 0.15, "{height}");
    }

    #[test]
    fn fading_planes_leave_one_that_is_all_there() {
        let without = built("crossed-planes", &["fade_deg=45", "texture_px=16"], &trial::tree()).unwrap();
        let tree = built("crossed-planes", &["fade_deg=45", "level=on", "texture_px=16"], &trial::tree()).unwrap();
        for i in 0..360 {
            for elevation in [-0.15, 0.0, 0.68, 1.0, 0.5 * PI] {
                let toward = View::axes_from((i as f32).to_radians(), elevation)[2];
                let shares: Vec<f32> = tree.parts.iter().map(|part| part.seen.share_toward(toward)).collect();
                assert!(shares.iter().any(|s| *s > 0.999), "{i} {elevation}: {shares:?}");
                let most = without.parts.iter().map(|part| part.seen.share_toward(toward)).fold(0.0, f32::max);
                assert!(most > 0.999, "{i} {elevation}");
                assert_eq!(shares[2] > 0.0, elevation > 0.2, "no line from the side");
            }
        }
        for (tree, toward) in [(&without, Vec3::X), (&tree, Vec3::X), (&tree, Vec3::Y)] {
            assert!(tree.parts[0].seen.share_toward(toward) < 1e-6, "edge-on");
        }
    }

    #[test]
    fn a_bare_tree_and_one_leaf_stand_and_a_point_is_refused() {
        assert_eq!(
            built("crossed-planes", &["level=on"], &trial::bare()).unwrap().parts.len(),
            2,
            "an open tube shows nothing from above"
        );
        assert_eq!(built("crossed-planes", &[], &trial::one_leaf()).unwrap().parts.len(), 1);
        assert!(built("crossed-planes", &[], &trial::point()).is_err());
    }
}
