//! Part of a surface by itself: some of its polygons, and of its vertices only those that they have.

use std::collections::BTreeSet;

use crate::geom::{PolyMesh, Surface};

/// The surface of these polygons over the vertices of `surface`, which are kept in their order.
///
/// # Panics
/// When a polygon names a vertex that is not there.
pub fn picked(surface: &Surface, triangles: &[[u32; 3]], quads: &[[u32; 4]]) -> Surface {
    let mut number = vec![u32::MAX; surface.mesh.positions.len()];
    triangles.iter().flatten().chain(quads.iter().flatten()).for_each(|&v| number[v as usize] = 0);
    let kept: Vec<usize> = (0..number.len()).filter(|&v| number[v] == 0).collect();
    kept.iter().zip(0..).for_each(|(&v, n)| number[v] = n);
    let new = |v: u32| number[v as usize];
    Surface {
        mesh: PolyMesh {
            positions: of(&kept, &surface.mesh.positions),
            triangles: triangles.iter().map(|t| t.map(new)).collect(),
            quads: quads.iter().map(|q| q.map(new)).collect(),
        },
        normals: of(&kept, &surface.normals),
        uvs: of(&kept, &surface.uvs),
        colors: of(&kept, &surface.colors),
    }
}

/// As [`picked`], from triangles alone: where both halves of one of the surface's quads are among them, they are that quad again.
///
/// # Panics
/// As [`picked`].
pub fn picked_with_quads(surface: &Surface, triangles: &[[u32; 3]]) -> Surface {
    let turned = |t: [u32; 3]| {
        let first = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
        [t[first], t[(first + 1) % 3], t[(first + 2) % 3]]
    };
    let mut left: BTreeSet<[u32; 3]> = triangles.iter().map(|t| turned(*t)).collect();
    let halves = |q: &[u32; 4]| [turned([q[0], q[1], q[2]]), turned([q[0], q[2], q[3]])];
    let whole = |q: &&[u32; 4]| {
        let [a, b] = halves(q);
        let both = left.contains(&a) && left.contains(&b);
        both && left.remove(&a) && left.remove(&b)
    };
    let quads: Vec<[u32; 4]> = surface.mesh.quads.iter().filter(whole).copied().collect();
    let rest: Vec<[u32; 3]> = triangles.iter().filter(|t| left.contains(&turned(**t))).copied().collect();
    picked(surface, &rest, &quads)
}

/// Half the sum of the cross products' lengths: the area of all polygons, m².
pub fn area_m2(mesh: &PolyMesh) -> f32 {
    let area = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|v| mesh.positions[v as usize].as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    };
    mesh.triangulated().map(area).sum::<f64>() as f32
}

fn of<T: Copy>(kept: &[usize], all: &[T]) -> Vec<T> {
    kept.iter().filter_map(|&v| all.get(v).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn halves_become_quads_again_and_unused_vertices_go() {
        let positions = (0..9).map(|i| Vec3::new(i as f32, (i * i) as f32, 0.0)).collect();
        let mesh = PolyMesh { positions, triangles: vec![[0, 1, 2]], quads: vec![[1, 2, 3, 4], [5, 6, 7, 8]] };
        let surface = Surface { mesh, ..Surface::default() };
        let all: Vec<[u32; 3]> = surface.mesh.triangulated().collect();
        assert_eq!(picked_with_quads(&surface, &all).mesh, surface.mesh);
        // One half of the first quad, and the second quad's with their corners in another order.
        let some = picked_with_quads(&surface, &[[1, 2, 3], [6, 7, 5], [7, 8, 5]]);
        assert_eq!((some.mesh.triangles.as_slice(), some.mesh.quads.as_slice()), (&[[0, 1, 2]][..], &[[3, 4, 5, 6]][..]));
        assert_eq!(some.mesh.positions[0], surface.mesh.positions[1]);
    }
}
