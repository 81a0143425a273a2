//! Upright primitives (She fig. 15a): what they cover from a side, what lies inside, and their surface as triangles. Metres.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

/// A move that nobody sees, in sizes of a primitive.
const HAIR: f64 = 2e-4;

/// A kind of solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Ellipsoid,
    Sphere,
    /// Its tip above.
    Cone,
    Cylinder,
}

impl Shape {
    pub const ALL: [Self; 4] = [Self::Ellipsoid, Self::Sphere, Self::Cone, Self::Cylinder];
}

/// A solid whose axis stands upright, by its box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Primitive {
    pub shape: Shape,
    pub center: DVec3,
    /// Half the sides of its box; a sphere's are equal.
    pub half: DVec3,
}

impl Primitive {
    /// That of the kind that comes nearest to the same box.
    pub fn with(self, shape: Shape) -> Self {
        let half = if shape == Shape::Sphere { DVec3::splat(self.half.element_product().cbrt()) } else { self.half };
        Self { shape, half, ..self }
    }

    /// Whether it covers a place of the picture along `axes` (right, up): level, or from straight above.
    pub fn covers(&self, axes: [DVec3; 2], place: DVec2) -> bool {
        let d = place - DVec2::new(self.center.dot(axes[0]), self.center.dot(axes[1]));
        if axes[1].y.abs() < 0.5 {
            let p = d.x * axes[0] + d.y * axes[1];
            return (p.x / self.half.x).powi(2) + (p.z / self.half.z).powi(2) <= 1.0;
        }
        let across = (self.half.x * axes[0].x).hypot(self.half.z * axes[0].z);
        let (x, y) = ((d.x / across).abs(), d.y / self.half.y);
        match self.shape {
            Shape::Ellipsoid | Shape::Sphere => x * x + y * y <= 1.0,
            Shape::Cylinder => x <= 1.0 && y.abs() <= 1.0,
            Shape::Cone => y.abs() <= 1.0 && x <= 0.5 * (1.0 - y),
        }
    }

    /// How far out a place lies: below 1 inside.
    pub fn depth_of(&self, place: DVec3) -> f64 {
        let q = (place - self.center) / self.half;
        let across = q.x.hypot(q.z);
        match self.shape {
            Shape::Ellipsoid | Shape::Sphere => q.length(),
            Shape::Cylinder => across.max(q.y.abs()),
            Shape::Cone => (across + 0.5 * (1.0 + q.y)).max(-q.y),
        }
    }

    /// Its surface: closed, convex, outward, `columns` round the axis. `turn` turns it about its axis and moves it by a hair, lest two of a
    /// kind meet face on face.
    pub fn surface(&self, columns: usize, turn: f64) -> Solid {
        let rows: Vec<DVec2> = match self.shape {
            Shape::Ellipsoid | Shape::Sphere => {
                let rings = (columns / 2).max(3);
                (1..rings).map(|k| DVec2::from_angle((k as f64 / rings as f64 - 0.5) * PI)).collect()
            }
            Shape::Cylinder => vec![DVec2::new(1.0, -1.0), DVec2::new(1.0, 1.0)],
            Shape::Cone => vec![DVec2::new(1.0, -1.0)],
        };
        let hair = HAIR * DVec3::new((7.1 * turn).sin(), (5.3 * turn).cos(), (3.7 * turn).sin());
        let at = |across: f64, up: f64, angle: f64| {
            self.center + self.half * hair + self.half * DVec3::new(across * angle.sin(), up, across * angle.cos())
        };
        let mut solid = Solid { positions: vec![at(0.0, -1.0, 0.0), at(0.0, 1.0, 0.0)], triangles: vec![] };
        for row in &rows {
            solid.positions.extend((0..columns).map(|k| at(row.x, row.y, turn + TAU * k as f64 / columns as f64)));
        }
        let corner = |row: usize, column: usize| 2 + row * columns + column % columns;
        for k in 0..columns {
            solid.triangles.push([0, corner(0, k + 1), corner(0, k)]);
            solid.triangles.push([1, corner(rows.len() - 1, k), corner(rows.len() - 1, k + 1)]);
            for row in 1..rows.len() {
                let [a, b, c, d] = [corner(row - 1, k), corner(row - 1, k + 1), corner(row, k + 1), corner(row, k)];
                solid.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        solid
    }
}

/// Triangles, outward, over places in space.
#[derive(Debug, Clone, Default)]
pub(super) struct Solid {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[usize; 3]>,
}
