"""The check of other viewers must notice lost cut-outs and missing pictures, so these are planted here."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from sphereboard_tools.check_viewers import compare
from sphereboard_tools.images import BadInputError


def plant(folder: Path, name: str, covered: np.ndarray):
    picture = np.zeros((*covered.shape, 4), np.uint8)
    picture[covered] = (40, 90, 30, 255)
    cv2.imwrite(str(folder / name), picture)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Write shots of one card whose leaves cover a good half of it."""
    (tmp_path / "shots.json").write_text(json.dumps({"shots": [{"name": "card"}]}), encoding="utf-8")
    blocks = np.random.default_rng(1).random((16, 16)) < 0.6
    plant(tmp_path, "card.ours.png", np.kron(blocks, np.ones((12, 12))) > 0)
    return tmp_path


def test_the_same_picture_is_alike(folder: Path):
    (folder / "card.three.png").write_bytes((folder / "card.ours.png").read_bytes())
    assert compare(folder, "three")


def test_lost_cut_outs_are_noticed(folder: Path, capsys: pytest.CaptureFixture[str]):
    plant(folder, "card.three.png", np.ones((192, 192), bool))
    assert not compare(folder, "three")
    assert "card: silhouettes" in capsys.readouterr().err


def test_nothing_in_both_is_not_alike(folder: Path):
    for who in ("ours", "three"):
        plant(folder, f"card.{who}.png", np.zeros((192, 192), bool))
    assert not compare(folder, "three")


def test_a_missing_picture_says_so(folder: Path):
    with pytest.raises(BadInputError, match=r"blender.png is missing"):
        compare(folder, "blender")
