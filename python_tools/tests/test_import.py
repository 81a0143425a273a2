"""The import check must notice a difference, so differences are planted here."""

import json
import stat
from pathlib import Path

import numpy as np
import pytest

from sphereboard_tools.check_import import Contents, by_open3d, differences, run
from sphereboard_tools.images import BadInputError

SQUARE = "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nf 1 2 3 4\n"


def square(folder: Path) -> Path:
    """Write an OBJ of one quad, 2 m wide and 3 m high."""
    path = folder / "square.obj"
    path.write_text(SQUARE, encoding="utf-8")
    return path


def program(folder: Path, triangles: int) -> Path:
    """Write a program that reports so many triangles of whatever it is asked about."""
    bounds = {"min": [0, 0, 0], "max": [2, 3, 0]}
    text = json.dumps({"files": [{"ok": True, "triangles": triangles, "bounds_m": bounds}]})
    path = folder / "sphereboard"
    path.write_text(f"#!/bin/sh\necho '{text}'\n", encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_open3d_reads_a_square(tmp_path: Path):
    contents = by_open3d(square(tmp_path))
    assert contents.triangles == 2
    assert np.array_equal(contents.box, [[0, 0, 0], [2, 3, 0]])


def test_differences_are_noticed(tmp_path: Path):
    theirs = by_open3d(square(tmp_path))
    assert differences(theirs, theirs) == []
    assert "3 triangles, but Open3D counts 2" in differences(Contents(3, theirs.box), theirs)
    assert "a box of" in differences(Contents(2, theirs.box + 1e-3), theirs)[0]


def test_files_are_compared_with_the_program(tmp_path: Path):
    path = square(tmp_path)
    assert run([path], program(tmp_path, 2))
    assert not run([path], program(tmp_path, 3))


def test_what_open3d_cannot_read_is_named(tmp_path: Path):
    (tmp_path / "none.obj").write_text("# nothing\n", encoding="utf-8")
    with pytest.raises(BadInputError, match=r"none\.obj"):
        by_open3d(tmp_path / "none.obj")
