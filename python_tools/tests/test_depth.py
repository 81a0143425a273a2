"""The check of depth must notice a difference, so differences are planted here."""

import json
import stat
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813
import pytest

from sphereboard_tools.check_depth import compared, pair_faults, read, read_depth, run
from sphereboard_tools.images import BadInputError


def write(path: Path, pixels: np.ndarray, names: tuple[str, ...] = ("Z",)) -> Path:
    """Write a picture of floats."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], oiio.FLOAT)
    spec.channelnames = names
    buffer = oiio.ImageBuf(spec)
    buffer.set_pixels(oiio.ROI(), np.ascontiguousarray(pixels, dtype=np.float32))
    assert buffer.write(str(path)), buffer.geterror()
    return path


def depths() -> np.ndarray:
    """Make a slope with nothing in one corner."""
    pixels = np.linspace(10, 12, 12, dtype=np.float32).reshape(3, 4, 1)
    pixels[0, 0] = np.inf
    return pixels


def pair(folder: Path, error: float, **ours: float) -> dict:
    """Write two depth pictures, one of them off by a share, and what we say of them."""
    write(folder / "a.exr", depths() * (1 + error))
    write(folder / "b.exr", depths())
    found = compared(read(folder / "a.exr"), read(folder / "b.exr"), 1e-3)
    return {"files": ["a.exr", "b.exr"], "threshold": 1e-3, "ours": {**found, **ours}, "largest_relative": 1e-4}


def test_figures_that_agree_pass_and_others_are_named(tmp_path: Path):
    assert pair_faults(pair(tmp_path, 5e-5), tmp_path) == []
    assert "mean 0.5, but" in pair_faults(pair(tmp_path, 5e-5, mean=0.5), tmp_path)[0]
    assert "over 3, but" in pair_faults(pair(tmp_path, 5e-5, over=3), tmp_path)[0]


def test_a_depth_that_is_off_is_named(tmp_path: Path):
    assert "off by 2.0e-04" in pair_faults(pair(tmp_path, 2e-4), tmp_path)[0]
    row = pair(tmp_path, 0)
    hole = depths()
    hole[2, 2] = np.inf
    write(tmp_path / "a.exr", hole)
    assert any("where nothing should be" in fault for fault in pair_faults(row, tmp_path))


def test_what_is_no_depth_is_named(tmp_path: Path):
    path = write(tmp_path / "rgb.exr", np.zeros((2, 2, 3)), ("R", "G", "B"))
    with pytest.raises(BadInputError, match="one channel Z"):
        read_depth(path)
    (tmp_path / "none.exr").write_bytes(b"nothing")
    with pytest.raises(BadInputError, match=r"none\.exr"):
        read(tmp_path / "none.exr")


def program(folder: Path, picture: Path, depth: Path) -> Path:
    """Write a program that copies two files to where a render would go."""
    path = folder / "sphereboard"
    path.write_text(f'#!/bin/sh\ncp {picture} "$4"\ncp {depth} "$6"\n', encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_a_render_is_checked_with_its_picture(tmp_path: Path):
    distances = np.full((240, 320, 1), np.inf, dtype=np.float32)
    distances[60:180, 100:220] = np.linspace(37, 43, 120)[:, None, None]
    picture = np.zeros((240, 320, 4))
    picture[60:180, 100:220] = 1
    depth = write(tmp_path / "depth.exr", distances)
    binary = program(tmp_path, write(tmp_path / "picture.png", picture, ("R", "G", "B", "A")), depth)
    pairs = tmp_path / "pairs"
    pairs.mkdir()
    (pairs / "a.json").write_text(json.dumps(pair(pairs, 0)), encoding="utf-8")
    assert run(tmp_path / "m.glb", pairs, tmp_path / "out", binary)
    distances[0, 0] = 40
    write(depth, distances)
    assert not run(tmp_path / "m.glb", pairs, tmp_path / "out", binary)
    with pytest.raises(BadInputError, match="no pairs"):
        run(tmp_path / "m.glb", tmp_path / "nothing", tmp_path / "out", binary)
