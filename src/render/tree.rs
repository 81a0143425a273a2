//! A tree on the device: what was uploaded of it, and what the frame has to know of its shape.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;

use super::forest::ForestPart;
use super::impostor;
use super::part::{DevicePart, PartStore, PlaceInTree, Textures};
use crate::geom::Bounds;
use crate::gpu::Gpu;
use crate::model::{Growth, GrowthProfile, Part};
use crate::repr::{BuiltPart, BuiltTree, Drawn, Seen};

/// A tree on the device.
#[derive(Debug)]
pub struct Tree {
    meshes: Vec<DevicePart>,
    impostors: Vec<DevicePart>,
    forests: Vec<ForestPart>,
    groups: Vec<Seen>,
    bounds: Option<Bounds>,
    reach: Option<Bounds>,
    triangles: usize,
    crowns: Vec<CrownShape>,
    growth: Growth,
    number: u64,
}

/// The number of the next tree.
static NEXT: AtomicU64 = AtomicU64::new(0);

/// What growth has to know of a crown; object space, metres.
#[derive(Debug, Clone, Copy)]
pub struct CrownShape {
    /// From where all of it is seen.
    pub center: Vec3,
    /// Half axes of the ellipsoid that is like it.
    pub half_axes: Vec3,
    /// The box around it.
    pub bounds: Bounds,
    /// When it is seen.
    pub seen: Seen,
}

impl CrownShape {
    fn of(BuiltPart { part, seen, .. }: &BuiltPart) -> Option<Self> {
        let (center, bounds) = (part.crown_center?, part.surface.mesh.bounds()?);
        let half_axes = (0.5 * bounds.size()).max(Vec3::splat(1e-4));
        Some(Self { center, half_axes, bounds, seen: *seen })
    }
}

impl Tree {
    /// Puts a tree onto the device. Parts that share a picture share its texture.
    pub fn upload(gpu: &Gpu, store: &PartStore, built: &BuiltTree) -> Self {
        let drawable: Vec<_> = built.parts.iter().filter(|built| built.part.surface.mesh.polygon_count() > 0).collect();
        let bounds = (!drawable.is_empty()).then_some(built.bounds);
        let mut tree = Self {
            meshes: vec![],
            impostors: vec![],
            forests: vec![],
            groups: vec![],
            bounds,
            reach: drawable.iter().filter_map(|built| reach(built)).chain(bounds).reduce(joined),
            triangles: drawable.iter().map(|built| built.part.surface.mesh.triangulated().count()).sum(),
            crowns: vec![],
            growth: built.growth.unwrap_or_else(|| Growth::likely(GrowthProfile::Broadleaf, f64::from(built.height_m()))),
            number: NEXT.fetch_add(1, Ordering::Relaxed),
        };
        let mut textures = Textures::default();
        for built_part in drawable {
            let crown = CrownShape::of(built_part);
            tree.crowns.extend(crown);
            let crown = if crown.is_some() { tree.crowns.len() as u32 } else { 0 };
            let BuiltPart { part, drawn, seen } = built_part;
            let place = PlaceInTree { bounds: built.bounds, crown, group: tree.group(*seen) };
            if let Drawn::Forest(forest) = drawn {
                tree.forests.push(ForestPart::upload(gpu, store, built_part, forest, place, &mut textures));
                continue;
            }
            let device_part = store.upload(gpu, part, (drawn, seen), place, &mut textures);
            match drawn {
                Drawn::Octahedral(_) => tree.impostors.push(device_part),
                Drawn::Still | Drawn::Turned { .. } | Drawn::Forest(_) => tree.meshes.push(device_part),
            }
        }
        tree
    }

    fn group(&mut self, seen: Seen) -> usize {
        self.groups.iter().position(|known| *known == seen).unwrap_or_else(|| {
            self.groups.push(seen);
            self.groups.len() - 1
        })
    }

    /// The same tree, whose outlines grow so.
    pub fn growing(self, growth: Growth) -> Self {
        Self { growth, ..self }
    }

    /// How its outlines grow.
    pub fn growth(&self) -> Growth {
        self.growth
    }

    /// Unlike that of any other tree that was ever uploaded.
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// Its sphere-board crowns.
    pub fn crowns(&self) -> &[CrownShape] {
        &self.crowns
    }

    /// The box around the tree, object space; `None` for a tree of nothing.
    pub fn bounds(&self) -> Option<Bounds> {
        self.bounds
    }

    /// The box around whatever is drawn of it, however its cards turn; object space.
    pub fn reach(&self) -> Option<Bounds> {
        self.reach
    }

    /// Its height above its foot, metres: what wind and distances are scaled by.
    pub fn height_m(&self) -> f32 {
        self.bounds.map_or(1.0, |b| b.height_m())
    }

    /// At what height it stands, metres, object space.
    pub fn foot_y(&self) -> f32 {
        self.bounds.map_or(0.0, |b| b.foot_y())
    }

    /// Triangles of one instance.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    /// When its parts are seen: each part belongs to one of these.
    pub fn groups(&self) -> &[Seen] {
        &self.groups
    }

    /// Its surfaces, and cards that turn.
    pub fn meshes(&self) -> &[DevicePart] {
        &self.meshes
    }

    /// Its foliage in levels of detail.
    pub fn forests(&self) -> &[ForestPart] {
        &self.forests
    }

    /// Its octahedral impostors.
    pub fn impostors(&self) -> &[DevicePart] {
        &self.impostors
    }
}

/// Parts that are always seen, as a built tree.
pub fn always_seen(parts: &[Part]) -> BuiltTree {
    let bounds = crate::model::bounds(parts).unwrap_or(Bounds { min: Vec3::ZERO, max: Vec3::ZERO });
    BuiltTree::new(bounds, parts.iter().cloned().map(BuiltPart::still).collect())
}

/// The box in which a part may be drawn.
fn reach(BuiltPart { part, drawn, .. }: &BuiltPart) -> Option<Bounds> {
    let own = part.surface.mesh.bounds()?;
    let farthest =
        |pivot: Vec3, level: Vec3| part.surface.mesh.positions.iter().map(|p| ((*p - pivot) * level).length()).fold(0.0, f32::max);
    let around = |center: Vec3, half: Vec3| Bounds { min: center - half, max: center + half };
    Some(match *drawn {
        // No corner of a collapsed leaf stands where none stood.
        Drawn::Still | Drawn::Forest(_) => own,
        Drawn::Turned { pivot, upright: true } => {
            let across = farthest(pivot, Vec3::new(1.0, 0.0, 1.0));
            let turned = around(pivot, Vec3::new(across, 0.0, across));
            Bounds { min: turned.min.with_y(own.min.y), max: turned.max.with_y(own.max.y) }
        }
        Drawn::Turned { pivot, upright: false } => around(pivot, Vec3::splat(farthest(pivot, Vec3::ONE))),
        Drawn::Octahedral(impostor) => around(impostor.center, Vec3::splat(impostor::REACH * impostor.radius_m)),
    })
}

fn joined(a: Bounds, b: Bounds) -> Bounds {
    Bounds { min: a.min.min(b.min), max: a.max.max(b.max) }
}
