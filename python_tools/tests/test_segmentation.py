"""The segmentation check must notice a fault, so faults are planted here."""

import json
import stat
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from sphereboard_tools import ours, rivals
from sphereboard_tools.check_segmentation import REDS, SHE, agreement, markdown, summary
from sphereboard_tools.check_segmentation import run as check
from sphereboard_tools.hsv import HsvParameters, opencv_crown, skimage_crown
from sphereboard_tools.images import BadInputError, Mask, Picture, iou, photographs
from sphereboard_tools.pairs import read_pairs

METHODS = (opencv_crown, skimage_crown)


def painted(seed: int, rows: int = 90, columns: int = 70) -> Picture:
    """Paint a speckled green disc with holes on a blue ground, and specks of green outside."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[0:rows, 0:columns]
    inside = np.hypot(x - columns / 2, y - rows / 2) < 28
    green = np.where(inside, random.random(inside.shape) < 0.9, random.random(inside.shape) < 0.05)
    picture = random.integers(0, 60, (rows, columns, 3))
    picture[..., 2] += 120 * ~green
    picture[..., 1] += 120 * green
    return picture.astype(np.uint8)


def segmented(picture: Picture, crown: Mask | None) -> ours.Segmented:
    """Pose as a result of our program."""
    return ours.Segmented(Path("tree.png"), picture, crown, None if crown is None else SHE)


@pytest.mark.parametrize("seed", range(5))
def test_opencv_and_skimage_agree_on_every_pixel(seed: int):
    picture = painted(seed)
    for parameters in (SHE, REDS, HsvParameters(45, 170, 0, 1), HsvParameters(0, 360, 3, 0)):
        assert np.array_equal(opencv_crown(picture, parameters), skimage_crown(picture, parameters))


@pytest.mark.parametrize("method", METHODS)
def test_both_ends_of_the_range_belong_to_it(method):
    # Hues 90, 150, 89.8 and 150.2.
    colours = [[128, 255, 1], [1, 255, 128], [129, 255, 1], [1, 255, 129]]
    for colour, inside in zip(colours, [True, True, False, False], strict=True):
        picture = np.full((20, 20, 3), colour, dtype=np.uint8)
        assert method(picture, SHE).all() == inside


@pytest.mark.parametrize("method", METHODS)
def test_a_range_below_zero_goes_on_below_360(method):
    # Hues 0, 45, 330, 46 and 329.
    colours = [[200, 0, 0], [200, 150, 0], [200, 0, 100], [180, 138, 0], [180, 0, 93]]
    for colour, inside in zip(colours, [True, True, True, False, False], strict=True):
        picture = np.full((20, 20, 3), colour, dtype=np.uint8)
        assert method(picture, REDS).all() == inside


@pytest.mark.parametrize("method", METHODS)
def test_a_crown_at_the_frame_keeps_its_edge(method):
    picture = np.full((40, 40, 3), (0, 0, 200), dtype=np.uint8)
    picture[:, 25:] = (0, 200, 0)
    mask = method(picture, SHE)
    assert mask[:, 25:].all() and not mask[:, :25].any()


@pytest.mark.parametrize("method", METHODS)
def test_of_equal_components_the_first_is_kept(method):
    picture = np.full((60, 40, 3), (0, 0, 200), dtype=np.uint8)
    picture[5:15, 25:35] = picture[40:50, 8:18] = (0, 200, 0)
    mask = method(picture, SHE)
    assert mask[10, 30] and not mask[45, 13]


@pytest.mark.parametrize("method", METHODS)
def test_no_green_gives_an_empty_mask(method):
    assert not method(np.full((20, 20, 3), 90, dtype=np.uint8), SHE).any()


def test_agreement_notices_one_pixel_of_shift():
    picture = painted(1)
    crown = opencv_crown(picture, SHE)
    assert agreement(segmented(picture, crown)).holds
    assert not agreement(segmented(picture, np.roll(crown, 1, axis=1))).holds
    assert not agreement(segmented(picture, np.roll(crown, 1, axis=0))).holds


def test_agreement_notices_a_wrong_refusal():
    assert not agreement(segmented(painted(2), None)).holds
    assert agreement(segmented(np.full((30, 30, 3), 90, dtype=np.uint8), None)).holds


def test_iou_of_known_masks():
    left, right = np.zeros((4, 4), dtype=bool), np.zeros((4, 4), dtype=bool)
    left[:, :2] = right[:, 1:3] = True
    assert iou(left, right) == pytest.approx(1 / 3)
    assert iou(left & right & ~left, left & ~left) == 1
    with pytest.raises(BadInputError, match="one size"):
        iou(left, right[:2])


@pytest.mark.parametrize("method", [rivals.grabcut, rivals.random_walker])
def test_rivals_find_an_obvious_crown(method):
    picture = painted(3, 300, 280)
    truth = np.hypot(*(np.mgrid[0:300, 0:280] - np.array([150, 140])[:, None, None])) < 90
    picture[truth] = np.array([20, 160, 30]) + np.random.default_rng(0).integers(0, 20, (int(truth.sum()), 3))
    assert iou(method(picture), truth) > 0.9


def test_pairs_and_their_table(tmp_path: Path):
    (tmp_path / "PAIRS.csv").write_text(
        "image,mask_tree,mask_crown,quality,single_tree,green_crown\na.png,a_tree.png,a_crown.png,human,yes,yes\nb.png,b_tree.png,,human,no,yes\n"
    )
    mask = np.zeros((10, 10), dtype=np.uint8)
    mask[2:8, 2:8] = 255
    cv2.imwrite(str(tmp_path / "a_crown.png"), mask)
    cv2.imwrite(str(tmp_path / "a_tree.png"), np.full((10, 10), 255, dtype=np.uint8))
    pairs = read_pairs(tmp_path)
    assert [pair.counts for pair in pairs] == [True, False]
    assert pairs[0].score(mask > 0) == 1 and pairs[0].score(mask >= 0) == 1
    assert summary([(pairs[0], [0.4]), (pairs[1], [0.9])], 0) == (0.4, 0.4, 1)
    assert "| (b) | human | 0.900 |" in markdown(["x"], [(pairs[0], [0.4]), (pairs[1], [0.9])])


def test_masks_are_not_photographs(tmp_path: Path):
    for name in ("b.JPG", "a.png", "a_mask.png", "a_gaps.png", "a_crown.png", "PAIRS.csv"):
        (tmp_path / name).touch()
    assert [p.name for p in photographs(tmp_path)] == ["a.png", "b.JPG"]


def pretender(folder: Path, shift: int) -> Path:
    """Write a program that poses as ours: OpenCV's mask, shifted."""
    program = folder / "sphereboard"
    parameters = {"parameters": {"segment": {"method": "hsv", "opening_px": 2, "closing_px": 4}}, "hue_deg": [90, 150]}
    program.write_text(
        f"""#!/usr/bin/env python3
import sys
from pathlib import Path
import cv2, numpy as np
from sphereboard_tools.hsv import opencv_crown
from sphereboard_tools.images import read_picture
from sphereboard_tools.check_segmentation import SHE
photo, out = Path(sys.argv[2]), Path(sys.argv[sys.argv.index("--out") + 1])
picture = read_picture(photo)
mask = np.roll(opencv_crown(picture, SHE), {shift}, axis=1)
cv2.imwrite(str(out / (photo.stem + ".mask.png")), mask * np.uint8(255))
cv2.imwrite(str(out / (photo.stem + ".pixels.png")), picture[..., ::-1])
(out / (photo.stem + ".json")).write_text({json.dumps(parameters)!r})
"""
    )
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    return program


@pytest.mark.parametrize(("shift", "good"), [(0, True), (1, False)])
def test_the_whole_check_passes_and_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd, shift: int, good: bool):
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:/usr/bin:/bin")
    photos = tmp_path / "photos"
    photos.mkdir()
    cv2.imwrite(str(photos / "tree.png"), painted(4)[..., ::-1])
    assert check([photos], pretender(tmp_path, shift), tmp_path / "out", quick=True) is good
    said = capfd.readouterr()
    assert ("1 of 1 photographs agree" in said.out) is good
    assert ("the hsv masks differ" in said.err) is not good


def test_a_missing_program_and_an_empty_folder_are_named(tmp_path: Path):
    with pytest.raises(BadInputError, match="cargo build"):
        ours.find_binary(tmp_path / "nothing")
    with pytest.raises(BadInputError, match="no photographs"):
        check([tmp_path], pretender(tmp_path, 0), tmp_path / "out", quick=True)
