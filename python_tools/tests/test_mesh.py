"""The mesh check must notice a fault, so faults are planted here."""

import json
import struct
from pathlib import Path

import numpy as np
import open3d
import pytest

from sphereboard_tools.check_mesh import check_file, check_surface, run
from sphereboard_tools.glb import Surface, read_glb
from sphereboard_tools.images import BadInputError


def sphere(centre: float = 0.0) -> Surface:
    """Make a small sphere."""
    mesh = open3d.geometry.TriangleMesh.create_sphere(radius=1.0, resolution=8)
    positions = (np.asarray(mesh.vertices) + np.array([centre, 0, 0])).astype(np.float32)
    return Surface("crown 0", positions, np.asarray(mesh.triangles).astype(np.int64))


def cut(surface: Surface) -> Surface:
    """Give each triangle vertices of its own, as a chart's cut does along its border."""
    return Surface(
        surface.name, surface.positions[surface.triangles].reshape(-1, 3), np.arange(surface.triangles.size).reshape(-1, 3)
    )


def with_triangles(surface: Surface, triangles: np.ndarray) -> Surface:
    return Surface(surface.name, surface.positions, triangles)


def joined(a: Surface, b: Surface) -> Surface:
    return Surface(
        a.name, np.concatenate([a.positions, b.positions]), np.concatenate([a.triangles, b.triangles + len(a.positions)])
    )


def write_glb(path: Path, surfaces: list[Surface]) -> Path:
    """Write the least GLB that holds the surfaces."""
    binary, views, accessors, meshes = b"", [], [], []
    for surface in surfaces:
        for data, kind, component in ((surface.positions, "VEC3", 5126), (surface.triangles.astype("<u2").ravel(), "SCALAR", 5123)):
            blob = data.tobytes()
            views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(blob)})
            accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(data), "type": kind})
            binary += blob + bytes(-len(blob) % 4)
        primitive = {"attributes": {"POSITION": len(views) - 2}, "indices": len(views) - 1}
        meshes.append({"name": surface.name, "primitives": [primitive]})
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": meshes,
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def test_a_sphere_is_sound_with_and_without_a_cut():
    assert check_surface(sphere()) == []
    assert check_surface(cut(sphere())) == []
    assert check_surface(joined(sphere(), sphere(3.0))) == []


def test_a_missing_triangle_is_noticed():
    faults = check_surface(with_triangles(sphere(), sphere().triangles[1:]))
    assert "not watertight" in faults and any("Euler" in fault for fault in faults)


def test_a_flipped_triangle_is_noticed():
    triangles = sphere().triangles.copy()
    triangles[7] = triangles[7][::-1]
    assert "triangles that disagree on which side is outside" in check_surface(with_triangles(sphere(), triangles))


def test_a_surface_inside_out_is_noticed():
    assert check_surface(with_triangles(sphere(), sphere().triangles[:, ::-1])) == ["inside out"]


def test_a_doubled_triangle_is_noticed():
    triangles = np.concatenate([sphere().triangles, sphere().triangles[:1]])
    assert "not edge-manifold" in check_surface(with_triangles(sphere(), triangles))


def test_crossing_parts_are_noticed():
    crossing = joined(sphere(), sphere(0.7))
    assert "intersects itself" in check_surface(crossing)


def test_a_torus_is_not_a_crown():
    mesh = open3d.geometry.TriangleMesh.create_torus()
    torus = Surface("crown", np.asarray(mesh.vertices, dtype=np.float32), np.asarray(mesh.triangles, dtype=np.int64))
    assert check_surface(torus) == ["Euler numbers [0] of its connected parts instead of 2 each"]


def test_spheres_that_touch_in_a_vertex_are_noticed():
    tip = sphere().positions[:, 2].argmax()
    other = sphere().positions * [1, 1, -1] + 2 * sphere().positions[tip]
    touching = joined(sphere(), Surface("", other.astype(np.float32), sphere().triangles[:, ::-1]))
    assert "not vertex-manifold" in check_surface(touching)


def test_files_are_read_and_judged(tmp_path: Path):
    trunk = Surface("trunk", 0.5 * sphere().positions, sphere().triangles)
    good = write_glb(tmp_path / "good.glb", [cut(sphere()), trunk])
    assert [s.name for s in read_glb(good)] == ["crown 0", "trunk"]
    assert np.array_equal(read_glb(good)[1].positions, trunk.positions)
    assert run([good])
    bad = write_glb(tmp_path / "bad.glb", [with_triangles(sphere(), sphere().triangles[1:])])
    assert not run([good, bad])


def test_bad_files_are_named(tmp_path: Path):
    (tmp_path / "not.glb").write_text("no GLB at all, really none")
    with pytest.raises(BadInputError, match="not a GLB file"):
        read_glb(tmp_path / "not.glb")
    with pytest.raises(BadInputError, match="no mesh with"):
        check_file(write_glb(tmp_path / "trunk.glb", [Surface("trunk", sphere().positions, sphere().triangles)]))
