"""Does Open3D find crowns and trunks closed, manifold, oriented outward, without handles and without self-intersection?"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import open3d

from sphereboard_tools.glb import Surface, read_glb
from sphereboard_tools.images import BadInputError

SPHERE_EULER = 2
CROWN = "crown"
"""A file without a mesh whose name contains this is not one of ours."""


@dataclass(frozen=True)
class Finding:
    """What is wrong with a mesh, in words; nothing when all is well."""

    mesh: str
    faults: list[str]


def check_surface(surface: Surface) -> list[str]:
    """List the faults of one closed surface."""
    welded = surface.welded()
    if len(welded.triangles) == 0 or not np.isfinite(welded.positions).all():
        return ["empty or not finite"]
    mesh = to_open3d(welded)
    checks = {
        "not watertight": mesh.is_watertight(),
        "not edge-manifold": mesh.is_edge_manifold(allow_boundary_edges=False),
        "not vertex-manifold": mesh.is_vertex_manifold(),
        "not orientable": mesh.is_orientable(),
        "triangles that disagree on which side is outside": is_consistent(welded),
        "inside out": signed_volume(welded) > 0,
        "intersects itself": not mesh.is_self_intersecting(),
    }
    faults = [fault for fault, good in checks.items() if not good]
    numbers = euler_numbers(mesh)
    if any(number != SPHERE_EULER for number in numbers):
        faults.append(f"Euler numbers {numbers} of its connected parts instead of {SPHERE_EULER} each")
    return faults


def to_open3d(surface: Surface) -> open3d.geometry.TriangleMesh:
    """Hand a surface to Open3D."""
    return open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(surface.positions.astype(np.float64)),
        open3d.utility.Vector3iVector(surface.triangles.astype(np.int32)),
    )


def is_consistent(surface: Surface) -> bool:
    """Whether each edge is walked once in each direction, so that all triangles face the same side."""
    a, b = surface.triangles, np.roll(surface.triangles, -1, axis=1)
    edges = np.stack([a.ravel(), b.ravel()], axis=1)
    forward, backward = np.unique(edges, axis=0), np.unique(edges[:, ::-1], axis=0)
    return len(forward) == len(edges) and np.array_equal(forward, backward)


def signed_volume(surface: Surface) -> float:
    """Volume enclosed; negative when the triangles face inward."""
    a, b, c = (surface.positions[surface.triangles[:, k]].astype(np.float64) for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def euler_numbers(mesh: open3d.geometry.TriangleMesh) -> list[int]:
    """Vertices − edges + triangles of each connected part."""
    clusters = np.asarray(mesh.cluster_connected_triangles()[0])
    numbers = []
    for cluster in range(clusters.max() + 1):
        part = open3d.geometry.TriangleMesh(mesh)
        part.remove_triangles_by_mask(clusters != cluster)
        numbers.append(part.remove_unreferenced_vertices().euler_poincare_characteristic())
    return numbers


def check_file(path: Path) -> list[Finding]:
    """Check every mesh of a GLB file."""
    surfaces = list(read_glb(path))
    if not any(CROWN in surface.name.lower() for surface in surfaces):
        raise BadInputError(f"{path} has no mesh with “{CROWN}” in its name; give a file that sphereboard model wrote")
    return [Finding(surface.name, check_surface(surface)) for surface in surfaces]


def run(files: list[Path]) -> bool:
    """Check files, print what is wrong and a closing line; True when all is well."""
    good = meshes = 0
    for path in files:
        for finding in check_file(path):
            meshes += 1
            good += not finding.faults
            for fault in finding.faults:
                print(f"{path}: {finding.mesh}: {fault}", file=sys.stderr)
    print(f"Open3D: {good} of {meshes} meshes in {len(files)} files are watertight, manifold, outward and of genus 0")
    return good == meshes
